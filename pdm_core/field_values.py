"""Values at the nodes of a Field: continuous, foretold at new nodes, and what cells add to what their parents tell."""

import numpy as np

from .biquadratic import BILINEAR, CHILD_OF_PARENT, EDGES, QUARTERS

ROOT = 0.4  # a root's surplus over the bilinear interpolant counts this much


def conform(field, leaves, index, values):
    """Values (m, c) of some surface's nodes, continuous: those that hang on a coarser neighbour's edge set to it.

    leaves: all of the surface's; index (n nodes,): place of each of its nodes in values.
    """
    values = values.copy()
    hanging = field.edge_nodes(leaves, 4)
    for level in range(field.level[leaves].max() + 1):
        cell, edge, part = np.nonzero((hanging >= 0) & (field.level[leaves] == level)[:, None, None])
        ends = index[field.nodes[leaves[cell][:, None], EDGES[edge]]]
        values[index[hanging[cell, edge, part]]] = np.einsum("nk,nkc->nc", QUARTERS[part], values[ends])
    return values


def surpluses_of(field, cells, index, values):
    """Values (m, c), at nodes through index (n nodes,) -> (n cells, 9, c): value minus the parent's interpolant.

    A root has no parent: its bilinear interpolant takes the place, weakened, being one order less.
    """
    at, parent = values.take(index.take(field.nodes.take(cells, axis=0)), axis=0), field.parent[cells]
    root, below = np.flatnonzero(parent < 0), np.flatnonzero(parent >= 0)
    out = np.empty(at.shape)
    out[root] = ROOT * (at[root] - np.einsum("ij,njc->nic", BILINEAR, at[root][:, [0, 2, 6, 8]]))
    which = cells[below] - field.child[parent[below]]
    out[below] = at[below] - CHILD_OF_PARENT[which] @ values[index[field.nodes[parent[below]]]]
    return out


def surpluses(field, values):
    """As surpluses_of, for all cells and values (n nodes, c)."""
    return surpluses_of(field, np.arange(len(field.level)), np.arange(len(field.keys)), values)


def predict(field, values, old):
    """values (old, c) of the first nodes -> (n - old, c) at the others, from their cells' parents, coarse first."""
    full = np.concatenate([values, np.zeros((len(field.keys) - old, values.shape[1]))])
    known = np.arange(len(full)) < old
    for level in range(1, field.level.max() + 1):
        cells = np.flatnonzero((field.level == level) & ~known[field.nodes].all(axis=1))
        parent = field.parent[cells]
        guess = np.einsum("nij,njc->nic", CHILD_OF_PARENT[cells - field.child[parent]], full[field.nodes[parent]])
        new = ~known[field.nodes[cells]]
        full[field.nodes[cells][new]] = guess[new]
        known[field.nodes[cells]] = True
    return full[old:]
