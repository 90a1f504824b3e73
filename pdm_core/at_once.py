"""How much numpy works on at once, lest memory or caches overflow."""

CACHED = 1 << 12  # pairs that cost many numbers each: some 40 arrays of this length stay in a second-level cache
AT_ONCE = 1 << 16  # pairs that cost a few each: what is compared, tested or sorted out
