"""Form factors between whole surfaces: exact visible inner integrals, an adaptive outer Gauss rule.

Rows: every target of a surface is integrated at the same outer points, where the exact inner factors close to
rounding; so a closed scene's rows sum to 1 whatever the outer rule, and closure can be trusted as a check of the
visibility. Where nothing hides anything, aligned rectangles have a closed form and need no outer rule at all.

Where balls hide planes from a plane, the inner factor has kinks, of order 3/2, where the outline of a ball touches an
edge of the target or passes over a corner of it: on lines and conics of the outer plane. The outer rule is then broken
there, and converges as if there were none. Elsewhere cells are split until they agree.

Beside it the published method (Baranoski, UFRGS 1992): Gauss quadrature over both parameter domains.
"""

import time
from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from .aligned import aligned_rectangles
from .at_once import AT_ONCE, parts, slices
from .checked import NAMED, SceneError, array, index, number, of_kind, some_of
from .contacts import contacts_of, settle
from .exchange import polygon_exchange
from .kinks import broken_rule, kinks
from .numerics import gauss_square
from .published import parametric
from .scene import Scene, in_pieces
from .shapes.shape import bounds_of
from .tolerances import ROUNDING, TINY
from .visibility import Factors, shafts_of

POINTS = 6  # Gauss points a direction in a cell
ORDERS = (4, 6, 8, 10, 14, 20)  # Gauss points between two kinks, until two orders agree
TIGHT = (1e-3, 1e-6)  # tolerances below which the first, and the second, of ORDERS need not be tried
CELLS = 20000  # most cells of one surface
# in pairs of a point and a target that nothing hides, about a microsecond each: what others take, and all at most, some
# 50 s in a room of 12 balls and 2 screens. Surfaces share what is left evenly
EXACT, SAMPLED, WORK = 4, 180, 45_000_000
PEAKS = 16.0, 4.0  # sizes of surfaces, and of cells, of their distance from a target whose peak their nodes may miss
SHARE = 0.5  # part of the remaining error that one level's accepted cells may use


@dataclass
class FormFactors:
    """F[i, j]: leaving i, arriving at j, (n, n), or (rows, n); background (n,): what meets no surface, 1 - F[i].sum().

    error (n, n): estimated absolute error of each entry; seconds; counts of the pairs that were free, exact, sampled;
    warnings: a sentence that names the entries, if any, whose errors are above what was asked for.
    """

    F: np.ndarray
    background: np.ndarray
    error: np.ndarray
    seconds: float
    counts: Counter = field(default_factory=Counter)
    warnings: list = field(default_factory=list)


def form_factors(scene, rtol=1e-4, rows=None):
    """Form factors between all surfaces of the scene to the relative error rtol of each entry -> FormFactors.

    rows: indices of the surfaces to leave from, if not all; the arrays then have these rows alone. The errors are
    what was reached, estimated from the last refinement; where CELLS or WORK end it early, a warning says so.
    """
    of_kind(scene, Scene, "form_factors")
    rtol = number(rtol, "form_factors: rtol", "a number between 0 and 1", 0, 1)
    wanted = _wanted(rows, len(scene))
    start = time.perf_counter()
    if scene.plurals:
        return _of_pieces(scene, rtol, wanted, start)
    scene = settle(scene)[0]
    shafts, counts = shafts_of(scene), Counter()
    seen = Factors(scene, shafts, counts)
    n = len(scene)
    factors, error = np.zeros((n, n)), np.zeros((n, n))
    i, j = (a.ravel() for a in np.indices((n, n)))
    hidden = shafts.candidates(i, j)
    hidden[(i == j) & ~shafts.inside[i]] = -1  # what does not see itself is not hidden from itself
    occluded = (hidden >= 0).any(axis=1).reshape(n, n) if hidden.size else np.zeros((n, n), bool)
    planes = np.array([s.shape.is_flat for s in scene.surfaces])
    pairwise = planes & ~occluded.any(axis=1) & np.isin(np.arange(n), wanted)
    done = _closed_pairs(scene, np.flatnonzero(pairwise), np.flatnonzero(planes), rtol, factors, error, counts)
    for left, row in zip(range(len(np.unique(wanted)), 0, -1), np.unique(wanted)):
        targets = np.flatnonzero(~done[row])
        if len(targets):
            lists = hidden.reshape(n, n, -1)[row, targets]
            curves = kinks(scene, row, targets, lists)
            if curves is None or _peaked(scene, row, np.zeros((1, 2)), np.ones(2), targets, PEAKS[0]).any():
                most = (WORK - _work(counts)) // left
                value, wrong = _row(seen, row, targets, lists, rtol, most)
            else:
                value, wrong = _broken_row(seen, row, targets, lists, curves, rtol)
            factors[row, targets], error[row, targets] = value, wrong
    background = 1 - factors.sum(axis=1)  # by rows as they were integrated, which close exactly
    _reciprocal(scene, np.unique(wanted), factors, error)
    background, factors, error = background[wanted], factors[wanted], error[wanted]
    warnings = _above(scene, wanted, factors, error, rtol)
    return FormFactors(factors, background, error, time.perf_counter() - start, counts, warnings)


def _wanted(rows, count):
    """Indices of surfaces, of so many, all unless told; checked."""
    every = range(count) if rows is None else array(rows, "form_factors: rows").ravel()
    rows = [int(k) if k == int(k) else k for k in every if np.isfinite(k)] if len(every) else []
    wanted = np.array([index(k, count, "form_factors: one of rows") for k in rows], int)
    if len(wanted) < len(every):
        raise SceneError("form_factors: rows are not all finite; use indices of surfaces")
    return wanted


def _of_pieces(scene, rtol, wanted, start):
    """As form_factors, of a scene with polygons and meshes: from those between their convex pieces."""
    pieces, owner = in_pieces(scene)
    rows = np.flatnonzero(np.isin(owner, wanted))
    found = form_factors(pieces, rtol, rows)
    share = np.zeros((len(scene), len(rows)))  # of a surface's area, each piece's
    share[owner[rows], np.arange(len(rows))] = pieces.areas[rows]
    share = share[wanted] / share[wanted].sum(axis=1, keepdims=True)
    whole = np.eye(len(scene))[owner]
    factors, error = share @ found.F @ whole, share @ found.error @ whole
    warnings = _above(scene, wanted, factors, error, rtol)
    seconds = time.perf_counter() - start
    return FormFactors(factors, share @ found.background, error, seconds, found.counts, warnings)


def _above(scene, rows, factors, error, rtol):
    """[] or [a sentence that names the entries whose errors are above rtol of them]."""
    i, j = np.nonzero(error > rtol * np.abs(factors) + TINY)
    if not len(i):
        return []
    size = error[i, j] / np.maximum(np.abs(factors[i, j]), TINY)
    worst = np.argsort(-size)[:NAMED]
    name = [surface.name or f"surface {k}" for k, surface in enumerate(scene.surfaces)]
    named = some_of([f"from {name[rows[i[k]]]!r} to {name[j[k]]!r} {error[i[k], j[k]]:.1g}" for k in worst], len(i))
    return [f"Absolute errors are above {rtol:g} of their form factors ({named}): see error; raise rtol"]


def _reciprocal(scene, rows, factors, error):
    """Of pairs that were integrated from both sides take what is known better, in place, and no error below what the
    two differ by."""
    area = scene.areas[rows, None]
    one, bound = area * factors[np.ix_(rows, rows)], area * error[np.ix_(rows, rows)]
    differ = np.abs(one - one.T) > bound + bound.T + ROUNDING * (area + area.T)
    bound = np.where(differ, np.maximum(bound, np.abs(one - one.T)), bound)
    # who is wrong is not known where they differ: the smaller surface has the smoother integrand
    other = differ & ((area > area.T) | ((area == area.T) & (bound > bound.T)))
    factors[np.ix_(rows, rows)] = np.where(other, one.T, one) / area
    error[np.ix_(rows, rows)] = bound / area


def _closed_pairs(scene, rows, columns, rtol, factors, error, counts):
    """Fill in the pairs of aligned rectangles, and of other planes that lie against nothing where their contours tell
    them to rtol; -> (n, n) bool, which entries are done."""
    done = np.zeros(factors.shape, bool)

    def fill(i, j, value, wrong):
        factors[i, j], error[i, j], done[i, j] = value, wrong, True
        counts["closed"] += len(i)

    i, j = (a.ravel() for a in np.meshgrid(rows, columns, indexing="ij"))
    value, known = aligned_rectangles(scene.surfaces, i, j)
    fill(i[known], j[known], value[known], ROUNDING)
    rest = ~known & ~np.isin(i, contacts_of(scene).covers[0])
    if not rest.any():
        return done
    i, j, flat = i[rest], j[rest], [scene.surfaces[k] for k in columns]
    number = np.searchsorted(columns, np.arange(len(scene)))
    corners = np.array([s.shape.corners if s.side == "front" else s.shape.corners[::-1] for s in flat])
    normals = np.array([s.sign * s.shape.normal for s in flat])
    a, b = number[i], number[j]
    value, wrong = polygon_exchange(corners[a], corners[b], normals[a], normals[b], scene.tolerance)
    value, wrong = value / scene.areas[i], wrong / scene.areas[i]
    known = wrong <= rtol * value + TINY
    fill(i[known], j[known], value[known], wrong[known])
    return done


def _row(seen, row, targets, hidden, rtol, most):
    """Adaptive outer integral over surface row, of so much work at most, but for the first two levels -> factors and
    errors (targets,)."""
    scene, counts = seen.scene, seen.counts
    rows, columns = scene.surfaces[row].shape.first_cells
    corner = np.stack(np.meshgrid(np.arange(rows) / rows, np.arange(columns) / columns, indexing="ij"), -1)
    corner = corner.reshape(-1, 2)
    size = np.array([1 / rows, 1 / columns])
    before, spent = _work(counts), len(corner)
    value = _cells(seen, row, corner, size, targets, hidden)
    total, wrong = np.zeros(len(targets)), np.zeros(len(targets))
    while True:
        size = size / 2
        child = (corner[:, None] + size * np.array([[0, 0], [0, 1], [1, 0], [1, 1]])).reshape(-1, 2)
        finer = _cells(seen, row, child, size, targets, hidden)
        spent += len(child)
        summed = finer.reshape(-1, 4, len(targets)).sum(axis=1)
        difference = np.abs(summed - value)
        goal = rtol * np.abs(total + summed.sum(axis=0))
        # a cell may err by its share of the goal; the rest is split again. The shares count cells, not area:
        # the trouble sits on lines, where ever smaller cells must be allowed ever smaller errors
        bad = (difference > SHARE * (goal - wrong).clip(0) / np.sqrt(len(corner)) + ROUNDING).any(axis=1)
        bad |= _peaked(scene, row, corner, 2 * size, targets, PEAKS[1])
        each = max(_work(counts) - before, 1) / spent
        if spent + 4 * 4 * bad.sum() > min(CELLS, most / each):
            bad[:] = False
        total += summed[~bad].sum(axis=0)
        wrong += difference[~bad].sum(axis=0)
        if not bad.any():
            return total, wrong + ROUNDING
        bad = np.repeat(bad, 4)
        corner, value = child[bad], finer[bad]


def _work(counts):
    return counts["free"] + EXACT * counts["exact"] + SAMPLED * counts["sampled"]


def _peaked(scene, row, corner, size, targets, ratio):
    """Whether cells (c, 2) of one size are larger than `ratio` times their distance from a target smaller than they:
    its factor may peak between their nodes -> (c,)"""
    middle = parametric(scene.surfaces[row], corner + size / 2)[0]
    ends = parametric(scene.surfaces[row], np.concatenate([corner, corner + size]))[0]
    reach = np.linalg.norm(ends[len(corner) :] - ends[: len(corner)], axis=1)[:, None]
    centre, radius = bounds_of([scene.surfaces[k].shape for k in targets])
    away = np.linalg.norm(middle[:, None] - centre, axis=2)
    return (reach > ratio * np.maximum(away - reach / 2, radius)).any(axis=1)


def _cells(seen, row, corner, size, targets, hidden):
    """Integrals over parameter cells (c, 2) of one size, over the area of surface row -> (c, targets)."""
    surface = seen.scene.surfaces[row]
    nodes, weights = gauss_square(POINTS)
    out = np.empty((len(corner), len(targets)))
    for part in slices(len(corner), AT_ONCE // (len(nodes) * len(targets))):
        st = (corner[part, None] + size * nodes).reshape(-1, 2)
        points, area = parametric(surface, st)
        weight = np.linalg.norm(area, axis=1)
        normals = area / weight[:, None]
        value = _values(seen, row, points, normals, targets, hidden)
        weight = weight.reshape(-1, len(nodes)) * weights * size.prod()
        out[part] = np.einsum("cq,cqt->ct", weight, value.reshape(*weight.shape, -1))
    return out / surface.shape.area


def _values(seen, row, points, normals, targets, hidden):
    """Exact visible factors (m, t) from points (m, 3) with normals (m, 3) of surface row to targets (t,) behind hidden
    (t, k); row -1: whatever lies against it."""
    m, t = len(points), len(targets)
    own, value = np.full(m, row), np.empty((m, t))
    for part in parts(np.arange(m), AT_ONCE // max(t, 1)):
        r, k = np.repeat(part, t), np.tile(np.arange(t), len(part))
        value[part] = seen.pairs(points[r], normals[r], own[r], targets[k], hidden[k]).reshape(len(part), t)
    value[contacts_of(seen.scene).covered(points, own)] = 0.0
    return value


def _broken_row(seen, row, targets, hidden, curves, rtol):
    """Outer integral over the plane row between its kinks -> factors and errors (targets,).

    What is hidden of aligned rectangles is taken from their closed form: their common edges then do not matter.
    """
    scene = seen.scene
    surface, alone = scene.surfaces[row], Factors(scene, seen.shafts, Counter())
    free, known = aligned_rectangles(scene.surfaces, np.full(len(targets), row), targets)
    previous = np.full(len(targets), np.inf)
    for order in ORDERS[sum(rtol < r for r in TIGHT) :]:
        nodes, weights = broken_rule(curves, order)
        points, area = parametric(surface, nodes)
        normals = area / np.linalg.norm(area, axis=1, keepdims=True)
        value = _values(seen, row, points, normals, targets, hidden)
        nothing = np.full((known.sum(), 0), -1)
        value[:, known] -= _values(alone, -1, points, normals, targets[known], nothing)
        total = free * known + weights @ value
        wrong = np.abs(total - previous)
        previous = total
        if (wrong <= rtol * np.abs(total) + ROUNDING).all():
            break
    return total, wrong + ROUNDING
