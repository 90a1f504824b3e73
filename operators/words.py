"""What the interface says, in the user's language; reports as JSON stay in English."""

from bpy.app.translations import pgettext_iface


def say(text, *values):
    """`text` translated, with values at its {}s."""
    return pgettext_iface(text).format(*values)


def many(number, one, more):
    """1 object, 2,000 objects; with words that stand alone in the dictionary."""
    return f"{number:,} {pgettext_iface(one if number == 1 else more)}"
