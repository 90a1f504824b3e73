"""What makes a solution by rays better: more directions, finer shadows, smaller cells, where the error comes from."""

import numpy as np

from ..plan import RAY_MEMORY
from ..signs_of_life import in_thread
from .check import SAFETY
from .direct import FACTOR
from .engine import RAYS
from .rows import Traced, directions

MOST_RAYS = 4096  # directions of a point where colours are read
POWER = 0.72  # the error of n directions falls as n to this
LEAST_TOLD = 1e-3  # of the target, see RayState.told
SHARES = {"rays": 0.6, "shadows": 0.25, "nodes": 0.55, "sent": 0.5, "lamps": 0.7}  # of the error that is left, at most
MOST_FINER = 4  # times as many points of sources at the nodes
REACHED = 0.95  # of the target: what is worked towards
STEP = 32  # of directions where colours are read
SPARE = 1.15  # times as small as its share the error of the nodes' rays becomes: all begin anew, not for a little
LEAST_MORE = 1.5  # times more directions at once where colours are read, or fewer: each time they are looked at anew
MOST_MORE = 8.0, 3.0  # how many times more directions at once where colours are read, and of the nodes, as few tell it
HALVED = 0.7  # of the error of cells, what halves of them leave
HELPS = 0.9  # of the square of the error: what is left at most where it is worth a round
# of the square of the error: cells that make no more are not halved; with .05 300 balls took 12,900 cells to 4 %, not
# 7,800, and a furnished room 6,100 to 1 %, not 4,900
KEPT_WHOLE = 0.15


def improve(check):
    """Work of a Check's RayState on the largest parts of its error; False where nothing is left to do; yields."""
    state, lit, parts, did = check.state, check.state.lit, check.parts, False
    # what more directions, finer shadows and more points of lamps can lower no more
    at_most = {"rays": state.read >= MOST_RAYS, "shadows": state.told <= LEAST_TOLD, "lamps": lit.finer >= MOST_FINER}
    stuck = np.linalg.norm([parts[k] for k, is_so in at_most.items() if is_so])
    excess = excess_of(parts, state.target, stuck)
    if excess["rays"] > 1 and state.read < MOST_RAYS:
        more = state.read * excess["rays"] ** (1 / POWER)
        more = STEP * np.ceil(np.clip(more, LEAST_MORE * state.read, MOST_MORE[0] * state.read) / STEP)
        state.read = int(min(more, MOST_RAYS))
        did = True
    if excess["shadows"] > 1 and state.told > LEAST_TOLD:
        state.told *= max(0.7 / excess["shadows"], 0.1)
        check.looked, did = None, True
    again = excess["lamps"] > 1 and lit.finer < MOST_FINER
    if again:
        lit.finer *= FACTOR
    count = finer_directions(state, excess["nodes"]) if excess["nodes"] > 1 else None
    finer = (yield from finer_nodes(check, excess["sent"], count)) if excess["sent"] > 1 else None
    if finer is not None:
        state.nodes = finer
        yield from state.extend(finer.old, count, again)
        return True
    if count is not None:
        state.traced = Traced(len(state.nodes), directions(count))
        yield from state.trace(np.arange(len(state.nodes)))
        yield from in_thread(state.link)
    if again:
        yield from lit.extend(state, np.full(len(state.nodes), -1))
    return did or again or count is not None


def fewer_directions(check):
    """How many directions do where colours are read, as far as the other parts of the error leave room; None where
    that is hardly fewer: what few rays told may have asked for too many, and there are more places to read than nodes.
    """
    state, rays = check.state, check.parts.get("rays", 0.0)  # none where there is no light
    others = sum(v * v for k, v in check.parts.items() if k != "rays")
    may = np.sqrt(max((REACHED * state.target / SAFETY) ** 2 - others, rays**2))
    fewer = STEP * np.ceil(state.read * rays / max(may, 1e-300) / STEP)  # not as few as by POWER, lest it be in vain
    fewer = int(max(fewer, min(RAYS, state.read)))
    return fewer if LEAST_MORE * fewer < state.read else None


def excess_of(parts, target, stuck=0.0):
    """parts {name: of the error of a Check} -> {part: how many times larger it is than its share of what the target
    allows}; of all others than lamps, of what these leave; of cells, which are slow to become finer, than what the
    others leave once they are no larger than their shares, where that is more. stuck: of the error, what can be
    lowered no more; where that is larger than the target allows, that much is allowed: smaller ones would not help."""
    allowed = max(REACHED * target / SAFETY, stuck)
    lamps = min(parts["lamps"], SHARES["lamps"] * allowed)
    shares = {k: share * np.sqrt(allowed**2 - lamps**2) for k, share in SHARES.items()}
    shares["lamps"] = SHARES["lamps"] * allowed
    others = sum(min(v, shares.get(k, allowed)) ** 2 for k, v in parts.items() if k != "sent")
    shares["sent"] = max(shares["sent"], np.sqrt(max(allowed**2 - others, 0.0)))
    return {k: parts[k] / share for k, share in shares.items()}


def finer_directions(state, excess):
    """How many directions of the nodes, whose error is so many times too large, are enough; None where memory has no
    room for more."""
    more = min(SPARE * excess, MOST_MORE[1]) ** (1 / POWER)
    count = int(np.ceil(len(state.traced.directions) * more))
    count += count % 2
    return None if Traced.bytes_for(len(state.nodes), count) > RAY_MEMORY else count


def finer_nodes(check, excess, count):
    """Nodes with the cells halved that hold most of the error of what is sent, which is so many times too large; count:
    of their directions, if not as before; None where that helps no more; yields."""
    state, nodes = check.state, check.state.nodes
    room = int(RAY_MEMORY / Traced.bytes_for(1, count or len(state.traced.directions)))
    cells, meshes = yield from in_thread(_worst, check, excess, room)
    if not cells.any() and not meshes.any():
        return None
    finer = yield from in_thread(nodes.refined, cells, meshes)
    return None if len(finer) > room or len(finer) == len(nodes) else finer


def _worst(check, excess, room):
    """Which cells (k, 2) to halve along which axis, and which meshes (n surfaces,) to merge less, so that there are not
    more nodes than there is room for."""
    nodes, scene = check.state.nodes, check.state.scene
    cells, meshes = check.surplus
    # both sides of a mesh become finer together
    number, meshes = (np.bincount(scene.shape_of, a) for a in (np.where(nodes.charts.has, 0, nodes.number), meshes))
    coarse = np.bincount(scene.shape_of, ~nodes.meshes.is_finest) > 0
    square = np.concatenate([cells.ravel(), meshes])
    # a cell becomes two, each part of a mesh four
    new = np.concatenate([np.ones(cells.size), np.maximum(3 * number, 1)])
    may = np.concatenate([nodes.lattice.may_split().ravel(), coarse]) & (square > 0)
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
    marked[best[np.cumsum(new[best]) > room - len(nodes)]] = False
    return marked[: cells.size].reshape(cells.shape), marked[cells.size :][scene.shape_of]


def _marked(square, new, may, allowed):
    """(k,) bool of those that may be halved: what brings most for so many new ones each, (k,), until no more than what
    is allowed of the sum of squares (k,) is left."""
    order = np.argsort(np.where(may, square / new, -1.0))
    kept = np.cumsum(square[order]) / max(square.sum(), 1e-300)
    marked = np.zeros(len(square), bool)
    marked[order[(kept + HALVED**2 * (1 - kept) > allowed) & (kept > KEPT_WHOLE)]] = True
    return marked & may
