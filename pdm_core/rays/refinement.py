"""What makes a solution by rays better: more directions, finer shadows, smaller cells, where the error comes from."""

import numpy as np

from ..plan import RAY_MEMORY
from ..signs_of_life import in_thread
from .check import SAFETY
from .rows import Traced

MOST_RAYS = 4096  # directions of a point where colours are read
POWER = 0.72  # the error of n directions falls as n to this
LEAST_TOLD = 1e-3  # of the target, see RayState.told
SHARES = {"rays": 0.6, "shadows": 0.25, "nodes": 0.55, "sent": 0.5}  # of the error that is left, each part's at most
REACHED = 0.95  # of the target: what is worked towards
STEP = 32  # of directions where colours are read
MORE = 1.25  # times as many directions of the nodes at least, as all their rays begin anew
MOST_MORE = 8.0, 3.0  # how many times more directions at once where colours are read, and of the nodes, as few tell it
HALVED = 0.7  # of the error of cells, what halves of them leave
HELPS = 0.9  # of the square of the error: what is left at most where it is worth a round
KEPT_WHOLE = 0.02  # of the square of the error: cells that make no more are not halved


def improve(check):
    """Work of a Check's RayState on the largest parts of its error; False where nothing is left to do; yields."""
    state, excess, did = check.state, excess_of(check), False
    if excess["rays"] > 1 and state.read < MOST_RAYS:
        more = state.read * excess["rays"] ** (1 / POWER)
        more = STEP * np.ceil(np.clip(more, 1.5 * state.read, MOST_MORE[0] * state.read) / STEP)
        state.read = int(min(more, MOST_RAYS))
        did = True
    if excess["shadows"] > 1 and state.told > LEAST_TOLD:
        state.told *= max(0.7 / excess["shadows"], 0.1)
        check.looked, did = None, True
    if excess["nodes"] > 1:
        did |= yield from trace_finer(state, excess["nodes"])
    if excess["sent"] > 1:
        did |= yield from refine(check, excess["sent"])
    return did


def excess_of(check):
    """{part: how many times larger it is than its share of what the target allows}; of cells, which are slow to become
    finer, than what the others leave once they are no larger than their shares, where that is more."""
    allowed = REACHED * check.state.target / SAFETY
    shares = {k: share * allowed for k, share in SHARES.items()}
    others = sum(min(v, shares.get(k, allowed)) ** 2 for k, v in check.parts.items() if k != "sent")
    shares["sent"] = max(shares["sent"], np.sqrt(max(allowed**2 - others, 0.0)))
    return {k: check.parts[k] / share for k, share in shares.items()}


def trace_finer(state, excess):
    """More directions at the nodes, whose error is so many times too large, where memory has room; yields."""
    more = max(min(excess, MOST_MORE[1]) ** (1 / POWER), MORE)
    count = int(np.ceil(len(state.traced.directions) * more))
    count += count % 2
    if Traced.bytes_for(len(state.nodes), count) > RAY_MEMORY:
        return False
    yield from state.trace_anew(count)
    return True


def refine(check, excess):
    """Halve the cells that hold most of the error of what is sent, which is so many times too large; yields."""
    state, nodes = check.state, check.state.nodes
    cells, meshes = yield from in_thread(_worst, check, excess)
    if not cells.any() and not meshes.any():
        return False
    finer = yield from in_thread(nodes.refined, cells, meshes)
    if _bytes(state, len(finer)) > RAY_MEMORY or len(finer) == len(nodes):
        return False
    yield from state.take_nodes(finer)
    return True


def _worst(check, excess):
    """Which cells (k, 2) to halve along which axis, and which meshes (n surfaces,) to merge less."""
    state, nodes = check.state, check.state.nodes
    seen, (cells, meshes) = check.seen(), check.surplus
    area, together = (np.bincount(nodes.surface, a, len(meshes)) for a in (nodes.weight, nodes.weight * seen))
    meshes = meshes * together / np.maximum(area, 1e-300)
    square = np.concatenate([(cells * seen[: len(cells), None]).ravel(), meshes])
    # a cell becomes two, each part of a mesh four
    new = np.concatenate([np.ones(cells.size), np.maximum(3 * nodes.number, 1)])
    may = np.concatenate([nodes.lattice.may_split().ravel(), ~nodes.meshes.is_finest]) & (square > 0)
    allowed = (REACHED / excess) ** 2
    marked, cells_alone = (
        _marked(square, new, some, allowed) for some in (may, may & (np.arange(len(new)) < cells.size))
    )
    # a mesh becomes finer as a whole: later, while cells alone help and bring more for so many new ones
    less = [1 - (1 - HALVED**2) * square[some].sum() / max(square.sum(), 1e-300) for some in (marked, cells_alone)]
    gain = [np.log(1 / part) / max(new[some].sum(), 1) for part, some in zip(less, (marked, cells_alone))]
    if less[1] < HELPS and gain[1] > gain[0]:
        marked = cells_alone
    order = np.argsort(square / new)
    # what brings most for its memory first
    best = order[::-1][marked[order[::-1]]]
    marked[best[np.cumsum(new[best]) > RAY_MEMORY / _bytes(state, 1) - len(nodes)]] = False
    return marked[: cells.size].reshape(cells.shape), marked[cells.size :]


def _marked(square, new, may, allowed):
    """(k,) bool of those that may be halved: what brings most for so many new ones each, (k,), until no more than what
    is allowed of the sum of squares (k,) is left."""
    order = np.argsort(np.where(may, square / new, -1.0))
    kept = np.cumsum(square[order]) / max(square.sum(), 1e-300)
    marked = np.zeros(len(square), bool)
    marked[order[(kept + HALVED**2 * (1 - kept) > allowed) & (kept > KEPT_WHOLE)]] = True
    return marked & may


def _bytes(state, nodes):
    return Traced.bytes_for(nodes, len(state.traced.directions))
