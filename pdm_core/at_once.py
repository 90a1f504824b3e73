"""How much numpy works on at once, lest memory or caches overflow; lists of different lengths as one array."""

import numpy as np

CACHED = 1 << 12  # pairs that cost many numbers each: some 40 arrays of this length stay in a second-level cache
AT_ONCE = 1 << 16  # pairs that cost a few each: what is compared, tested or sorted out


def in_turn(count):
    """Lists of count (n,) entries, one after the other: whose each entry is, and which of its own (sum of count,)."""
    whose = np.repeat(np.arange(len(count)), count)
    return whose, np.arange(len(whose)) - np.repeat(np.cumsum(count) - count, count)
