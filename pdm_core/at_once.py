"""How much numpy works on at once, lest memory or caches overflow; lists of different lengths as one array."""

import numpy as np

CACHED = 1 << 12  # pairs that cost many numbers each: some 40 arrays of this length stay in a second-level cache
AT_ONCE = 1 << 16  # pairs that cost a few each: what is compared, tested or sorted out


def in_turn(count):
    """Lists of count (n,) entries, one after the other: whose each entry is, and which of its own (sum of count,)."""
    whose = np.repeat(np.arange(len(count)), count)
    return whose, np.arange(len(whose)) - np.repeat(np.cumsum(count) - count, count)


def entries_of(lists, keys):
    """lists: first (k,) and count (k,) of the entries of each; keys (n,) of some in turn -> positions (m,) among the
    keys, and their entries (m,)."""
    first, count = lists
    which, step = in_turn(count[keys])
    return which, first[keys][which] + step


def lowest(label, *ranks):
    """label (n,), ranks (n,) -> (m,): of each label, by number, the one that is lowest in rank, first by the last."""
    order = np.lexsort((*ranks, label))
    return order[np.flatnonzero(np.diff(label[order], prepend=-1))]


def later(count):
    """Yields pairs (k,), (k,): each entry of a list with the count (n,) entries that follow it."""
    for some in runs(count):
        entry, step = in_turn(count[some])
        yield entry + some.start, entry + some.start + 1 + step


def parts(index, most):
    """[index (k,)] of an index (n,) in turn, each of at most `most`."""
    return [index[some] for some in slices(len(index), most)]


def slices(length, most):
    """[slice] of lists of so many entries in turn, each of at most `most`."""
    most = max(int(most), 1)
    return [slice(k, k + most) for k in range(0, length, most)]


def runs(count, most=AT_ONCE):
    """[slice] of lists of count (n,) entries, in order, that have about `most` together, or are one list."""
    begun = (np.cumsum(count) - count) // most
    cuts = np.flatnonzero(np.diff(begun, prepend=-1))
    return [slice(a, b) for a, b in zip(cuts, np.append(cuts[1:], len(count)))]
