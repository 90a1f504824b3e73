"""What hangs together by links between pairs."""

import numpy as np


def connected(n, a, b):
    """(n,) for nodes 0..n-1 with edges a[i]-b[i]: the smallest node of each node's component.

    Hooking to the smaller root and halving paths, a few rounds of each (Shiloach and Vishkin 1982).
    """
    label = np.arange(n)
    while True:
        low = np.minimum(label[a], label[b])
        if (label[a] == low).all() and (label[b] == low).all():
            return label
        np.minimum.at(label, label[a], low)
        np.minimum.at(label, label[b], low)
        while (label[label] != label).any():
            label = label[label]
