"""Random numbers that tell rows of numbers apart."""

import numpy as np


def names_of(rows):
    """rows (n, k) of numbers, up to 2^53 where they are whole -> (n,) of 64 bits, the same of the same ones; the mixing
    is splitmix64's."""
    name = np.zeros(len(rows), np.uint64)
    for bits in (rows + 0.0).T.copy().view(np.uint64):
        name ^= bits
        for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
            name = (name ^ (name >> np.uint64(shift))) * np.uint64(factor)
        name += np.uint64(0x9E3779B97F4A7C15)
    return name ^ (name >> np.uint64(31))
