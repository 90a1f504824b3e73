"""Text broken into as many labels as the region is wide: Blender would clip it."""

import blf

from ..operators.told import told

FONT = 0
POINTS = 11.0  # Blender's default widget text
MARGIN = 78.0  # tabs, borders of panel and box, in units of the interface scale


def wrapped(layout, context, text, icon="NONE"):
    """Labels with all of `text`, a report's in the user's language, the first with `icon`."""
    text = told(text)
    text = text[:1].upper() + text[1:]
    scale = context.preferences.system.ui_scale
    column = layout.column(align=True)
    column.scale_y = 0.8
    width = context.region.width - (MARGIN + (20.0 if icon != "NONE" else 0.0)) * scale
    blf.size(FONT, POINTS * scale)
    for number, line in enumerate(break_lines(text, width, lambda t: blf.dimensions(FONT, t)[0])):
        column.label(text=line, icon=icon if number == 0 else "NONE" if icon == "NONE" else "BLANK1")


def break_lines(text, width, measure):
    """text -> lines of at most `width` by measure(line); a longer word is broken where it must be."""
    lines, line = [], ""
    for word in text.split():
        while word:
            longer = f"{line} {word}" if line else word
            if measure(longer) <= width:
                line, word = longer, ""
            elif line:
                lines.append(line)
                line = ""
            else:
                cut = next((n for n in range(len(word) - 1, 1, -1) if measure(word[:n]) <= width), 1)
                lines.append(word[:cut])
                word = word[cut:]
    return [*lines, line] if line else lines
