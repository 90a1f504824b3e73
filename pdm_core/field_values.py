"""Values at the nodes of a Field: continuous, foretold at new nodes, and what cells add to what their parents tell."""

import numpy as np

from .biquadratic import BILINEAR, CHILD_OF_PARENT, EDGE_AXES, EDGES, QUARTERS

ROOT = 0.4  # a root's surplus over the bilinear interpolant counts this much


def conform(field, leaves, index, values):
    """Values (m, c) of some surface's nodes, continuous: those that hang on a coarser neighbour's edge set to it.

    leaves: all of the surface's; index (n nodes,): place of each of its nodes in values.
    """
    values = values.copy()
    hanging, along = field.edge_nodes(leaves, 4), field.level[leaves][:, EDGE_AXES]
    for level in range(along.max() + 1):
        cell, edge, part = np.nonzero((hanging >= 0) & (along == level)[:, :, None])
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
    out[below] = at[below] - CHILD_OF_PARENT[field.role[cells[below]]] @ values[index[field.nodes[parent[below]]]]
    return out


def surpluses(field, values):
    """As surpluses_of, for all cells and values (n nodes, c)."""
    return surpluses_of(field, np.arange(len(field.level)), np.arange(len(field.keys)), values)


def by_axis(field, square, cells=None):
    """Squares (n cells, 9, ...) of surpluses -> (n cells, 2, ...) their means over the nodes, as values bend along
    either axis: what is on the lines between the parent's nodes, and a share of the middle. cells: see inherited."""
    first, second, middle = square[:, 3] + square[:, 5], square[:, 1] + square[:, 7], square[:, 4]
    both = first + second
    share = np.divide(first, both, out=np.full(both.shape, 0.5), where=both > 0)
    return inherited(field, np.stack([first + share * middle, second + (1 - share) * middle], axis=1) / 9, cells)


def inherited(field, each, cells=None):
    """What surpluses (n cells, 2, ...) tell of either axis -> the same, of cells that their parents were not halved
    along it for what tells of their last ancestor that was. cells: these, ascending, with all their ancestors, not all.
    """
    made, place = field.made, np.arange(len(each))
    if cells is not None:
        made = np.searchsorted(cells, made[cells])
    own = made == place[:, None]
    alone = np.flatnonzero(own.sum(axis=1) == 1)
    axis = own[alone, 1].astype(int)
    each[alone, axis] = each[alone].sum(axis=1)
    return each[made, np.arange(2)]


def predict(field, values, old):
    """values (old, c) of the first nodes -> (n - old, c) at the others, from their cells' parents, coarse first."""
    full = np.concatenate([values, np.zeros((len(field.keys) - old, values.shape[1]))])
    known = np.arange(len(full)) < old
    depth = field.level.sum(axis=1)
    for level in range(1, depth.max() + 1):
        cells = np.flatnonzero((depth == level) & ~known[field.nodes].all(axis=1))
        parent = field.parent[cells]
        guess = np.einsum("nij,njc->nic", CHILD_OF_PARENT[field.role[cells]], full[field.nodes[parent]])
        new = ~known[field.nodes[cells]]
        full[field.nodes[cells][new]] = guess[new]
        known[field.nodes[cells]] = True
    return full[old:]
