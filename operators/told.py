"""What reports say, in the user's language. They are kept in English: a sentence is found again by what it was made
from, clause by clause, and its values are put into the translation."""

import re
from functools import lru_cache

from bpy.app.translations import pgettext_iface

from .baking.left_out import NAMES
from .portuguese_sentences import SENTENCES

PROBE = "Left out or approximated"  # whether the interface is translated by us at all
FIRST, LAST = "\ue000", "\uf8ff"  # private characters that stand for names, which nothing within is translated of
LIST = re.compile(rf"(?<!\w){NAMES}(?!\w)")  # no apostrophes within words
JOINED = "{}; {}", "{}: {}", "{}, {}", "{} and {}"  # of clauses that have entries of their own, or of values
VALUE = re.compile(r"[^ ]*|[^a-z]*|([A-Z0-9(][^ ]* ?)+")  # what needs no entry: one word, no words, names of nodes
OFF = re.compile(r"(\S+ ){0,4}[\d.e+,]+ %")  # an object's name and its error


def told(text):
    """A sentence of a report, translated; as it is where the interface is in English, or nothing is known of it."""
    probe = pgettext_iface(PROBE)
    return text if probe == PROBE or not text else _told(text, probe)


def unknown(text):
    """The clauses of a sentence, or parts of it, that have no entry, joined; '' where all are known."""
    return "; ".join(_translated(_named(text)[0])[1])


@lru_cache(maxsize=4096)
def _told(text, language):
    line, names = _named(text)
    line = _translated(line)[0]
    for k, name in enumerate(names):
        listed, more, count = name.rpartition(" and ")
        is_list = count.endswith(" more") and count[:-5].isdigit()
        shown = pgettext_iface("{} and {} more").format(listed, count[:-5]) if more and is_list else name
        line = line.replace(chr(ord(FIRST) + k), shown)
    return line


def _named(text):
    """text with a character for each list of quoted names, and these lists."""
    names = []

    def put(match):
        names.append(match[0])
        return chr(ord(FIRST) + len(names) - 1)

    return LIST.sub(put, text), names


def _translated(line):
    """(line translated, [what of it has no entry])"""
    if line in SENTENCES or VALUE.fullmatch(line):
        return pgettext_iface(line) if line.strip() else line, []
    found = None
    for made, parts in _ways(line):
        parts = [_translated(part) for part in parts]
        missing = [each for _, lacking in parts for each in lacking]
        if found is None or len("".join(missing)) < len("".join(found[1])):
            found = made.format(*(part for part, _ in parts)), missing
        if not missing:
            return found
    own = pgettext_iface(line)  # Blender's own
    is_value = own != line or OFF.fullmatch(line)
    return (own, []) if is_value else found or (line, [line])


def _ways(line):
    """(what is said, its values) of each way that a line may have been made, the surest first."""
    for entry, literal, pattern in _entries():
        if literal in line and (match := pattern.fullmatch(line)):
            yield pgettext_iface(entry), match.groups()
    if FIRST <= line[0] <= LAST and line[1:2] == " ":
        yield "{} {}", (line[0], line[2:])
    for joined in JOINED:
        left, middle, right = line.partition(joined[2:-2])
        if middle:
            yield joined.replace(" and ", f" {pgettext_iface('and')} "), (left, right)


@lru_cache(maxsize=1)
def _entries():
    """[(entry with {}, its longest words, pattern)], the longest first: the more is said, the surer it is."""
    found = []
    for entry in (each for each in SENTENCES if "{}" in each):
        words = entry.split("{}")
        pattern = "(.*?)".join(map(re.escape, words))
        found.append((len("".join(words)), entry, max(words, key=len), re.compile(pattern)))
    return [each[1:] for each in sorted(found, reverse=True)]
