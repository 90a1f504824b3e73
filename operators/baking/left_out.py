"""One table of what a bake leaves out or approximates: of whom, what, what comes of it, what to do."""

import re

# how what is read says who a sentence is about
QUOTED = r"""(?:'[^']*'|"[^"]*")"""  # as Python writes names: with an apostrophe in the other quotes
NAMES = rf"(?P<name>{QUOTED}(?:, {QUOTED})*(?: and \d+ more)?)"
ABOUT = re.compile(rf"^(?P<kind>Object|Material|World|Light|Scene)s? {NAMES}( \(.*?\))?:? ")
NO_PART = "takes no part in the light"
NO_COLOURS = "lights the others and gets no colours"
NOT_WANTED = "is not among the objects to bake"


def left_out(objects, refused, warnings):
    """[{kind, name, what, effect, advice}] of a report's entries; each text may be ''."""
    rows = [_row("Object", each["name"], each["reason"], NO_PART) for each in refused]
    for each in objects:
        if each["reason"] and each["reason"] != NOT_WANTED:
            rows.append(_row("Object", each["name"], each["reason"], NO_COLOURS))
    for text in warnings:
        if about := ABOUT.match(text):
            name = about["name"]
            is_one = re.fullmatch(QUOTED, name)
            rows.append(_row(about["kind"], name[1:-1] if is_one else name, text[about.end() :]))
    return rows


def other(warnings):
    """Those of a report's warnings that its table does not tell."""
    return [text for text in warnings if not ABOUT.match(text)]


def _row(kind, name, text, effect=""):
    """what: effect; advice"""
    text, _, advice = text.partition("; ")
    what, _, own = text.partition(": ")
    return {"kind": kind, "name": name, "what": what, "effect": own or effect, "advice": advice}
