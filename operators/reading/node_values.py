"""What a socket of a node tree is: one constant, or an expression of the place that is evaluated on arrays. No bpy.

A number is an array (n, 1), a colour or vector (n, 3), a constant one (1, k): what is computed from them broadcasts.
"""

from dataclasses import dataclass

import numpy as np

LUMINANCE = np.array([0.2126729, 0.7151522, 0.0721750])  # of linear Rec.709, as Cycles has it


@dataclass(eq=False, slots=True)
class Value:
    """constant (1, k); or, where that is None, function(*inputs' arrays) -> (n, k), or of a place: function(places).

    needs: (kind, name) of what it reads at a place; notes: sentences on what was approximated on the way to it.
    """

    constant: np.ndarray | None = None
    function: object = None
    inputs: tuple = ()
    needs: frozenset = frozenset()
    notes: tuple = ()

    @property
    def varies(self):
        return self.constant is None

    def noted(self, *notes):
        """The same with more notes."""
        return Value(self.constant, self.function, self.inputs, self.needs, together([self.notes, notes]))


def together(notes):
    """Tuples of sentences as one, each once, in order."""
    filled = [some for some in notes if some]
    if len(filled) < 2:
        return filled[0] if filled else ()
    return tuple(dict.fromkeys(text for some in filled for text in some))


def constant(value, notes=()):
    """A Value of a number or of k numbers, the same everywhere."""
    return Value(np.array(value, float, ndmin=2), notes=notes)


def at_places(function, *needs):
    """A Value read off places: function(places) -> (n, k)."""
    return Value(function=function, needs=frozenset(needs))


def derive(function, *inputs):
    """The Value function(*arrays) of Values; computed at once where all are constant."""
    notes = together([value.notes for value in inputs])
    if all([value.constant is not None for value in inputs]):
        return Value(np.asarray(function(*[value.constant for value in inputs]), float), notes=notes)
    needs = frozenset().union(*(value.needs for value in inputs if value.needs))
    return Value(None, function, inputs, needs, notes)


def evaluate(value, places):
    """A Value at places -> (n, k), or (1, k) where it is constant. Each part once, and kept while it is needed."""
    order = _in_order(value)
    uses = {id(value): 1}
    for each in order:
        for part in each.inputs:
            uses[id(part)] = uses.get(id(part), 0) + 1
    known = {}
    with np.errstate(all="ignore"):  # a division by 0 is a colour like others in a node tree
        for each in order:
            if not each.varies:
                known[id(each)] = each.constant
                continue
            if each.inputs:
                known[id(each)] = each.function(*(known[id(part)] for part in each.inputs))
            else:
                known[id(each)] = each.function(places)
            for part in each.inputs:
                uses[id(part)] -= 1
                if not uses[id(part)]:
                    known.pop(id(part), None)
    return known[id(value)]


def _in_order(value):
    """Every Value that one is made of, itself last, each after its inputs; no chain is too deep."""
    order, seen, stack = [], set(), [(value, False)]
    while stack:
        each, is_done = stack.pop()
        if is_done:
            order.append(each)
        elif id(each) not in seen:
            seen.add(id(each))
            stack.append((each, True))
            stack += [(part, False) for part in each.inputs if id(part) not in seen]
    return order


def converted(value, given, wanted):
    """A Value of socket type `given` as one of type `wanted`, as links between them convert it."""
    is_number = given not in ("RGBA", "VECTOR")
    if is_number == (wanted not in ("RGBA", "VECTOR")):
        return value
    if is_number:
        return derive(_three_times, value)
    return derive(luminance if given == "RGBA" else _mean, value)


def _three_times(number):
    return np.repeat(number, 3, axis=1)


def _mean(vector):
    return vector.mean(axis=1, keepdims=True)


def luminance(colour):
    """(n, 3) -> (n, 1)"""
    return colour @ LUMINANCE[:, None]


def part(value, k):
    """Component k of a Value, a number."""
    return derive(lambda array: array[:, k : k + 1], value)


def joined(*values):
    """Numbers as the components of one Value."""
    return derive(lambda *arrays: np.concatenate(np.broadcast_arrays(*arrays), axis=1), *values)


def mixed(factor, a, b):
    """(1 - factor) a + factor b of Values; one of them alone, with its notes alone, where the factor leaves it so."""
    if not factor.varies:
        share = factor.constant
        if (share == 0).all():
            return a.noted(*factor.notes)
        if (share == 1).all():
            return b.noted(*factor.notes)
    return derive(lambda f, one, other: (1 - f) * one + f * other, factor, a, b)
