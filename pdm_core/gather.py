"""Indirect light at points as rows over the field's nodes: geometry alone, no reflectance and no emission.

A row entry is (exact visible form factor of a source cell) x (kernel-weighted mean of the cell's biquadratics), so
a constant field is gathered exactly whatever the cells. Cells are taken as coarse as the tolerance allows.

Between the nodes: what x receives from source s is F(x, s) M(x, s), the visible form factor, with all its shadows,
corners and contacts, times the mean radiance of what x sees of s, which varies little. For the sources that matter M
is interpolated and F is taken exactly at x; the others are interpolated as a sum.
"""

import copy
from dataclasses import dataclass

import numpy as np

from .closed_forms import divide, dot, polygon_unoccluded
from .error_estimates import DECAY, decay
from .field import basis
from .field_charts import graded, graded_slope
from .numerics import Block, gauss_legendre
from .shapes.shape import unit
from .visibility import Shadows

VIRTUAL = 6  # levels a leaf may be divided below itself, near the receiver
RECEIVERS = 1024  # in a block of rows
PAIRS = 2048  # of points and source planes whose cells are sorted out at once
LINKS = 4096  # pairs whose form factors are computed between two signs of life
CLOSE = 0.5  # size over distance of a cell whose factor nine samples do not tell
AT_HAND = 0.9  # size over distance of a cell that may begin right at the receiver
UNSEEN = 1e-9  # of the others' weight, hidden samples: where no sample is seen, they share out the exact factor
PARTLY = 0.1  # error of the share of a cell that samples see, of its factor
FACTORS = 1 << 13  # of whole surfaces in a block of rows: few large calls, but signs of life between
BLOCK = 128  # rows of a dense block: neighbours, which use much the same nodes
MOST = 12  # sources taken exactly on one surface: each costs a form factor for every point evaluated
_GAUSS, _WEIGHTS = (rule[:, None] for rule in gauss_legendre(3))
_CHILDREN = np.array([(0, 0, 1, 1), (0, 1, 0, 1)])
_SIZES = ((1, 1), (1, 4), (2, 8), (4, 16), (8, 24))  # rings x directions sampled over a sphere's outline


@dataclass
class Detail:
    """What the field looks like, per cell, in the units of the tolerance: decides how finely sources are taken."""

    variation: np.ndarray  # (n cells,) range of the field over the cell
    below: np.ndarray  # (n cells,) largest surplus of its descendants: lost where the cell stands for them
    surface: np.ndarray  # (n surfaces,) range of the field over the surface


@dataclass
class _Cells:
    """Frontier of (receiver, source rectangle); owner is the cell whose nodes carry the field there."""

    receiver: np.ndarray
    owner: np.ndarray
    origin: np.ndarray  # (2, n) of the rectangle in the owner, in its widths
    width: np.ndarray  # (n,) of the rectangle in the owner's widths

    def take(self, index):
        return _Cells(self.receiver[index], self.owner[index], self.origin.take(index, axis=1), self.width[index])


@dataclass
class _Pairs:
    """(point, source plane), (m, ...) each; height of the point over the plane, occluders padded with -1.

    foot (2, m): of the point on the plane, along its edges; cosines times distance, from the point's normal: below
    (m,) of the foot and slope (2, m) of what one edge adds.
    """

    points: np.ndarray
    normals: np.ndarray
    height: np.ndarray
    tolerance: np.ndarray
    surface: np.ndarray
    source: np.ndarray
    occluders: np.ndarray
    shadows: Shadows
    foot: np.ndarray
    below: np.ndarray
    slope: np.ndarray


class Gather:
    """Rows of the indirect operator for receivers (points, normals, surface); sources: surfaces that may reflect."""

    def __init__(self, field, factors, sources):
        self.field, self.factors = field, factors
        self.flat, self.balls, self.rooms = (sources[k] for k in factors.by_kind(sources))
        self.silent, self.sum_tells = factors.shafts.silent(sources), factors.shafts.sum_tells(sources)
        linear = np.array([s.shape.linear for s in factors.scene.surfaces])
        u, v = linear[:, :, 0].T.copy(), linear[:, :, 1].T.copy()
        self.frame, self.metric = (factors.origin.T.copy(), u, v), np.stack([dot(u, u), dot(u, v), dot(v, v)])
        self.area = factors.scene.areas
        everyone = np.arange(len(field.level))
        chart = field.chart_of(everyone)
        self.corner = field.in_chart(everyone).T  # of cells (2, n); their charts begin and extend so along the edges
        self.begin, end = (field.kinds[0].cuts[field.surface, ((0,), (1,)), chart.T + k] for k in (0, 1))
        self.extent = end - self.begin
        self.by_surface = np.argsort(field.node_surface, kind="stable")  # nodes in the order of a block's columns
        self.rank = np.argsort(self.by_surface)
        self.links = 0

    def blocks(self, points, normals, surface, detail, tolerance):
        """Yield Blocks of the receivers' rows over the field's nodes, and None between as a sign of life.

        tolerance (m,): of one link, in detail's units.
        """
        step = int(np.clip(FACTORS // max(len(self.flat) + len(self.balls) + len(self.rooms), 1), 64, RECEIVERS))
        for some in _parts(np.arange(len(points)), step):
            entries = []
            for entry in self._entries(points[some], normals[some], surface[some], detail, tolerance[some]):
                yield None
                if entry is not None:
                    entries.append(entry)
            yield from self._dense(entries, some)

    def _dense(self, entries, rows):
        """Entries (receiver (k,), nodes (k, j), weights (k, j)), receivers counted within rows (m,) -> Blocks."""
        each = [node.shape[1] // 9 for _, node, _ in entries]
        receiver = np.concatenate([np.zeros(0, int), *(np.repeat(e[0], k) for e, k in zip(entries, each))])
        node = np.concatenate([np.zeros((0, 9), int), *(e[1].reshape(-1, 9) for e in entries)])
        weight = np.concatenate([np.zeros((0, 9)), *(e[2].reshape(-1, 9) for e in entries)])
        order = np.argsort(receiver, kind="stable")
        starts = np.arange(0, len(rows), BLOCK)
        ends = np.searchsorted(receiver[order], np.append(starts, len(rows)))
        for start, low, high in zip(starts, ends[:-1], ends[1:]):
            pick, some = order[low:high], rows[start : start + BLOCK]
            nodes, used = self.rank.take(node.take(pick, axis=0)), np.zeros(len(self.rank), bool)
            used[nodes] = True
            columns = np.flatnonzero(used)
            place = (np.cumsum(used) - 1).take(nodes)
            place += (receiver[pick] - start)[:, None] * len(columns)
            dense = np.bincount(place.ravel(), weight.take(pick, axis=0).ravel(), minlength=len(some) * len(columns))
            yield Block(some, self.by_surface[columns], dense.astype(np.float32).reshape(len(some), len(columns)))

    def _entries(self, x, n, own, detail, tol):
        balls = np.zeros(len(x))
        if len(self.balls):
            balls = yield from self._from_balls(x, n, own, detail, tol)
        if len(self.flat):
            yield from self._from_planes(x, n, own, detail, tol, balls)
        if len(self.rooms):
            yield from self._from_rooms(x, n, own, detail, tol)

    # -- planes --------------------------------------------------------------------------------------------------

    def _from_planes(self, x, n, own, detail, tol, balls):
        r, s = (a.ravel() for a in np.meshgrid(np.arange(len(x)), self.flat, indexing="ij"))
        ahead = self.factors.facing(x.take(r, axis=0), s)
        r, s = r[ahead], s[ahead]
        x, n, own, corners = x.take(r, axis=0), n.take(r, axis=0), own[r], self.factors.corners.take(s, axis=0)
        height = np.einsum("ni,ni->n", x - self.factors.origin[s], self.factors.front[s])
        shafts = self.factors.shafts
        occluders = shafts.in_view(x, n, corners, shafts.for_pairs(x, own, s))
        foot = np.ascontiguousarray(self.field.local(s, x)[:, :2].T)
        below = -height * np.einsum("ni,ni->n", n, self.factors.front[s])
        slope = np.stack([dot(n.T, edge.take(s, axis=1)) for edge in self.frame[1:]])
        shadows = Shadows(shafts.table, x, [axis.take(s, axis=1) for axis in self.frame], occluders)
        pairs = _Pairs(x, n, height, tol[r], own, s, occluders, shadows, foot, below, slope)
        links = []
        for start in range(0, len(r), PAIRS):
            chunk = np.arange(start, min(start + PAIRS, len(r)))
            todo = self._whole(chunk, s[chunk])
            while len(todo.receiver):
                todo, *done = self._sort_out(todo, pairs, detail)
                some, split = self._weigh(*done, pairs, detail)
                links.append(some)
                yield None
                todo = self._divide(_joined([todo, split]))
        if not links:
            return
        pair, node, weight, partial = (np.concatenate(part) for part in zip(*links))
        share = np.bincount(pair, weight.sum(axis=1), minlength=len(r))
        hidden = np.bincount(pair, partial, minlength=len(r)) > 0
        scale = yield from self._scales(pairs, r, share, hidden, balls)
        yield r[pair], node, weight * scale[pair][:, None]

    def _scales(self, pairs, r, share, hidden, balls):
        """What the samples of pairs (receiver, plane) are to be multiplied by (p,): they share out what the pair
        exchanges, share (p,) in all by them; how much that is, is exact, and behind what may hide it where hidden (p,).

        balls (m,): the factors of all balls together. Where all factors sum to 1 that tells the one of each
        receiver's planes that the most shapes may hide.
        """
        free, hidden = np.flatnonzero(~hidden & (share > 0)), np.flatnonzero(hidden)
        closed = self._closed(pairs, r, hidden, len(balls))
        cost = (pairs.occluders[hidden] >= 0).sum(axis=1)
        order = hidden[np.lexsort((cost, r[hidden]))]
        last = np.diff(r[order], append=len(balls)) > 0
        left = order[last & closed[r[order]]]
        value, corners = np.zeros(len(r)), self.factors.corners[pairs.source]
        value[free] = polygon_unoccluded(pairs.points[free], pairs.normals[free], corners[free])
        for k in _parts(np.setdiff1d(hidden, left), LINKS):
            s = pairs.source[k]
            x, n, own = pairs.points[k], pairs.normals[k], pairs.surface[k]
            value[k] = self.factors.visible(x, n, own, s, corners[k], occluders=pairs.occluders[k])
            yield
        x, n, own = pairs.points[left], pairs.normals[left], pairs.surface[left]
        others = balls + np.bincount(r, value, minlength=len(balls))
        others = others[r[left]] + self.factors.matrix(x, n, own, self.silent, False).sum(axis=1)
        value[left] = np.maximum(1.0 - others, 0.0)
        self.factors.counts["from the sum"] += len(left)
        return divide(value, share)

    def _closed(self, pairs, r, hidden, count):
        """(count,) Whether all factors of a receiver are known to sum to 1."""
        closed = np.zeros(count, bool)
        if self.sum_tells:
            first = hidden[np.unique(r[hidden], return_index=True)[1]]
            closed[r[first]] = self.factors.shafts.enclosed(pairs.points[first], pairs.normals[first])
        return closed

    def _whole(self, pair, source):
        """The root cells of planes source (n,), for pairs (n,)."""
        charts = self.field.charts[source]
        first = np.repeat(self.field.root[source] - np.cumsum(charts) + charts, charts)
        count = len(first)
        return _Cells(np.repeat(pair, charts), first + np.arange(count), np.zeros((2, count)), np.ones(count))

    def _on_chart(self, cells):
        """Lower corner (2, n) and width (n,) in chart coordinates."""
        size = 0.5 ** self.field.level[cells.owner]
        return self.corner.take(cells.owner, axis=1) + cells.origin * size, size * cells.width

    def _along(self, cells, t):
        """Chart coordinates t (2, ..., n) of cells -> positions along their planes' edges."""
        shape = (2, *(1,) * (t.ndim - 2), -1)
        begin, extent = (a.take(cells.owner, axis=1).reshape(shape) for a in (self.begin, self.extent))
        return begin + extent * graded(t)

    def _reach2(self, source, half):
        """(n,) m^2: square of how far rectangles reach from their middles, half (2, n) along planes source (n,)."""
        uu, uv, vv = self.metric.take(source, axis=1)
        return uu * half[0] ** 2 + vv * half[1] ** 2 + 2 * np.abs(uv) * half[0] * half[1]

    def _sort_out(self, cells, pairs, detail):
        """Drop cells below the horizon; cells to divide further, those good enough, their ends (low, high (2, n)), and
        which of them are close (n,): near the point or across its horizon, where samples do not tell their factors."""
        k, (low, width) = cells.receiver, self._on_chart(cells)
        low, high = np.moveaxis(self._along(cells, np.stack([low, low + width], axis=1)), 1, 0)
        middle, half = (low + high) / 2 - pairs.foot.take(k, axis=1), (high - low) / 2
        below, slope = pairs.below[k], pairs.slope.take(k, axis=1)
        (uu, uv, vv), height, tol = self.metric.take(pairs.source[k], axis=1), pairs.height[k], pairs.tolerance[k]
        above, reach = below + (slope * middle).sum(axis=0), (np.abs(slope) * half).sum(axis=0)
        distance2 = uu * middle[0] ** 2 + vv * middle[1] ** 2 + 2 * uv * middle[0] * middle[1] + height**2
        half2 = self._reach2(pairs.source[k], half)
        distance, g2 = np.sqrt(distance2), half2 / distance2
        area = 4 * half[0] * half[1] * self.area[pairs.source[k]]
        cosine = np.clip((above + reach) / distance, 0, 1)
        factor = area * cosine * np.minimum(height / distance + np.sqrt(g2) * 0.5, 1) / (np.pi * distance2)
        factor = np.minimum(1.0, factor)
        factor[g2 > AT_HAND**2] = 0.5  # a long cell that the point is next to: half of all light, however small
        leaf = self.field.child[cells.owner] < 0
        error = np.where(leaf, 0.0, detail.below[cells.owner])
        error = factor * (error + np.minimum(1.0, g2 * g2) * detail.variation[cells.owner] * cells.width)
        seen = above + reach > 0
        fine = (error <= tol) | (leaf & (cells.width <= 0.5**VIRTUAL))
        close = (g2 > CLOSE**2) | (above < reach)
        done = np.flatnonzero(seen & fine)
        ends = low.take(done, axis=1), high.take(done, axis=1)
        return cells.take(np.flatnonzero(seen & ~fine)), cells.take(done), ends, close[done]

    def _divide(self, cells):
        f = self.field
        child = f.child[cells.owner]
        leaf = np.repeat(child < 0, 4)
        quarter = np.tile(np.arange(4), len(child))
        width = np.repeat(cells.width, 4)
        owner = np.where(leaf, np.repeat(cells.owner, 4), np.repeat(child, 4) + quarter)
        origin = np.repeat(cells.origin, 4, axis=1) + _CHILDREN[:, quarter] * (width / 2)
        origin[:, ~leaf] = 0.0
        return _Cells(np.repeat(cells.receiver, 4), owner, origin, np.where(leaf, width / 2, 1.0))

    def _weigh(self, cells, ends, close, pairs, detail):
        """Of cells good enough by their own: (pair, nodes (k, 9), weights (k, 9), partly hidden) and those to divide,
        which an occluder's outline crosses and that matter; ends and close as _sort_out tells them."""
        k, (low, width) = cells.receiver, self._on_chart(cells)
        t = low[:, None] + width * _GAUSS
        place, slope = self._along(cells, t), graded_slope(t) * _WEIGHTS
        kernel = self._kernel(pairs, k, place - pairs.foot.take(k, axis=1)[:, None]) * (slope[0][:, None] * slope[1])
        size = pairs.height[k] * self.area[pairs.source[k]] * self.extent.take(cells.owner, axis=1).prod(axis=0)
        factor = kernel.sum(axis=(0, 1)) * size * width**2 / np.pi
        self._settle(k, ends, np.flatnonzero(close), pairs, kernel, slope, factor)
        hidden, near = pairs.shadows.over(k, *ends, place)
        partly = near & hidden.any(axis=(0, 1)) & ~hidden.all(axis=(0, 1))
        unsure = partly & (PARTLY * factor * detail.surface[pairs.source[k]] > pairs.tolerance[k])
        unsure &= (self.field.child[cells.owner] >= 0) | (cells.width > 0.5**VIRTUAL)
        keep = np.flatnonzero(~unsure)
        self.links += len(keep)
        scale = factor / kernel.sum(axis=(0, 1))
        kernel = (np.where(hidden, UNSEEN, 1.0) * kernel * scale).take(keep, axis=2)
        a, b = np.moveaxis(basis(cells.origin.take(keep, axis=1)[:, None] + cells.width[keep] * _GAUSS), -1, 1)
        weights = np.einsum("ign,jhn,ghn->ijn", a, b, kernel, optimize=["einsum_path", (0, 2), (0, 1)])
        weights = weights.reshape(9, -1).T
        done = k[keep], self.field.nodes.take(cells.owner[keep], axis=0), weights, near[keep]
        return done, cells.take(np.flatnonzero(unsure))

    def _kernel(self, pairs, k, offset):
        """cos / d^4 (3, 3, n) at points of pairs k (n,), of samples at offsets (2, 3, n) from the foot; the other
        cosine is height / d for all."""
        (a, b), slope, (uu, uv, vv) = offset, pairs.slope.take(k, axis=1), self.metric.take(pairs.source[k], axis=1)
        above = (pairs.below[k] + slope[0] * a)[:, None] + slope[1] * b
        distance2 = (uu * a * a + pairs.height[k] ** 2)[:, None] + vv * b * b + (2 * uv * a)[:, None] * b
        return np.maximum(above, 0.0) / (distance2 * distance2)

    def _settle(self, k, ends, some, pairs, kernel, slope, factor):
        """Exact factors of some of the cells of pairs k (n,); where samples see nothing, the kernel is their area's."""
        k, (low, high) = k[some], (end.take(some, axis=1) for end in ends)
        around = (low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])
        corners = [self._world(pairs.source[k], a, b) for a, b in around]
        factor[some] = polygon_unoccluded(pairs.points[k], pairs.normals[k], np.transpose(corners, (2, 0, 1)))
        unseen = some[kernel.take(some, axis=2).sum(axis=(0, 1)) == 0]
        kernel[:, :, unseen] = slope[0][:, None, unseen] * slope[1][:, unseen]

    def _world(self, source, a, b):
        """Points (3, ..., n) at a, b (..., n) along the edges of planes source (n,)."""
        one = (3, *(1,) * (a.ndim - 1), -1)
        o, u, v = (frame.take(source, axis=1).reshape(one) for frame in self.frame)
        return o + a * u + b * v

    # -- spheres -------------------------------------------------------------------------------------------------

    def _from_balls(self, x, n, own, detail, tol):
        """Yields entries; returns the factors (m,) of all balls together."""
        r, s = (a.ravel() for a in np.meshgrid(np.arange(len(x)), self.balls, indexing="ij"))
        factor = np.empty(len(r))
        for k in _parts(np.arange(len(r)), LINKS):
            factor[k] = self.factors.pairs(x.take(r[k], axis=0), n.take(r[k], axis=0), own[r[k]], s[k])
            yield None
        lit = factor > 0
        r, s, factor = r[lit], s[lit], factor[lit]
        error = factor * detail.surface[s] / np.maximum(tol[r], 1e-300)
        size = np.clip(np.ceil(np.log(np.maximum(error, 1e-3)) / np.log(4)), 0, len(_SIZES) - 1).astype(int)
        for k, (rings, turns) in enumerate(_SIZES):
            for part in _parts(np.flatnonzero(size == k), 65536 // (rings * turns)):
                i = r[part]
                yield self._sample_cone(x.take(i, axis=0), n.take(i, axis=0), s[part], factor[part], i, rings, turns)
        return np.bincount(r, factor, minlength=len(x))

    def _sample_cone(self, x, n, s, factor, r, rings, turns):
        """Directions spread over the outline of ball s, in the space where it is round: (entries of one size)."""
        f = self.field
        local = np.einsum("nij,nj->ni", f.inverse.take(s, axis=0), x - f.origin.take(s, axis=0))
        distance = np.maximum(np.linalg.norm(local, axis=1), 1.0)
        axis, e1, e2 = _frame(-local)
        u, wu = gauss_legendre(rings)
        sin2 = u[None] / distance[:, None] ** 2
        turn = (np.arange(turns) + 0.5) * (2 * np.pi / turns)
        circle = np.cos(turn)[:, None] * e1[:, None] + np.sin(turn)[:, None] * e2[:, None]
        cosine = np.sqrt(1 - sin2)[:, :, None, None]
        d = np.sqrt(sin2)[:, :, None, None] * circle[:, None] + cosine * axis[:, None, None]
        world = np.einsum("nij,nabj->nabi", f.linear[s], d)
        along = np.einsum("nabi,nabi->nab", world, world)
        # solid angle: in the round space d(sin^2)/(2 cos) dphi, and |det| / |L d|^3 to the world
        kernel = np.maximum(np.einsum("nabi,ni->nab", world, n), 0.0) / along**2
        kernel *= wu[None, :, None] / np.sqrt(1 - sin2)[:, :, None]
        total = kernel.sum(axis=(1, 2))
        kernel[total == 0] = 1.0
        weight = kernel * (factor / kernel.sum(axis=(1, 2)))[:, None, None]
        b = np.einsum("nabj,nj->nab", d, local)
        root = np.sqrt(np.maximum(b * b - (np.einsum("ni,ni->n", local, local) - 1)[:, None, None], 0.0))
        hit = local[:, None, None] + (-b - root)[..., None] * d
        return self._spread(np.repeat(s, rings * turns), hit.reshape(-1, 3), weight, r)

    def _spread(self, s, hit, weight, r):
        cell, share = self.field.locate(s, hit)
        weight = weight.reshape(len(r), -1, 1) * share.reshape(len(r), -1, 9)
        return r, self.field.nodes.take(cell, axis=0).reshape(len(r), -1), weight.reshape(len(r), -1)

    def _from_rooms(self, x, n, own, detail, tol):
        """Inner sides of spheres: directions over the hemisphere, those that something hides weighted out."""
        for s in self.rooms:
            surface = np.full(len(x), s)
            factor = self.factors.pairs(x, n, own, surface)
            lit = np.flatnonzero(factor > 0)
            occluders = self.factors.shafts.for_pairs(x[lit], own[lit], surface[lit])
            error = factor[lit].max(initial=0) * detail.surface[s] / max(tol.min(initial=1), 1e-300)
            rings, turns = ((2, 8), (4, 16), (8, 32))[int(np.searchsorted((10, 100), error))]
            for part in _parts(np.arange(len(lit)), 65536 // (rings * turns)):
                k = lit[part]
                yield self._sample_dome(x[k], n[k], s, factor[k], k, occluders[part], rings, turns)

    def _sample_dome(self, x, n, s, factor, r, occluders, rings, turns):
        axis, e1, e2 = _frame(n)
        u, wu = gauss_legendre(rings)
        turn = (np.arange(turns) + 0.5) * (2 * np.pi / turns)
        circle = np.cos(turn)[:, None] * e1[:, None] + np.sin(turn)[:, None] * e2[:, None]
        d = np.sqrt(u)[:, None, None] * circle[:, None] + np.sqrt(1 - u)[:, None, None] * axis[:, None, None]
        local = (x - self.field.origin[s]) @ self.field.inverse[s].T
        step = d @ self.field.inverse[s].T
        a = np.einsum("nabi,nabi->nab", step, step)
        b = np.einsum("nabi,ni->nab", step, local)
        c = (np.einsum("ni,ni->n", local, local) - 1)[:, None, None]
        length = (-b + np.sqrt(np.maximum(b * b - a * c, 0.0))) / a
        weight = wu[None, :, None] * self.factors.shafts.clear(x, d * length[..., None], occluders)
        total = weight.sum(axis=(1, 2))
        weight = np.where((total > 0)[:, None, None], weight, 1.0)
        weight = weight * (factor / weight.sum(axis=(1, 2)))[:, None, None]
        hit = (local[:, None, None] + length[..., None] * step).reshape(-1, 3)
        return self._spread(np.full(len(hit), s), hit, weight, r)


class Received:
    """Indirect light on one surface: values on its nodes (n,) of one surface.

    received (n, s, 3): irradiance / pi from each source; factors (n, s); sources (s,) surface indices.
    """

    def __init__(self, field, surface, received, factors, sources):
        self.field, self.surface, self.sources = copy.copy(field), surface, sources
        self.cells = np.flatnonzero(field.surface == surface)
        self.local = np.zeros(len(field.keys), int)
        nodes = np.flatnonzero(field.node_surface == surface)
        self.local[nodes] = np.arange(len(nodes))
        self.received, self.factors = received, factors
        self.means = self._fill(
            np.divide(received, factors[..., None], out=np.zeros_like(received), where=factors[..., None] > 0)
        )

    def _fill(self, means):
        """Means where nothing of the source is seen: those of the cells around, else of the whole surface."""
        leaves = self.cells[self.field.child[self.cells] < 0]
        nodes = self.local[self.field.nodes[leaves]]
        weight = self.factors
        overall = (weight[..., None] * means).sum(axis=0) / np.maximum(weight.sum(axis=0), 1e-300)[:, None]
        total, share = np.zeros_like(means), np.zeros_like(weight)
        near = weight[nodes].sum(axis=1)
        around = (weight[nodes][..., None] * means[nodes]).sum(axis=1)
        np.add.at(share, nodes, near[:, None])
        np.add.at(total, nodes, around[:, None])
        unseen = weight <= 1e-12
        means = means.copy()
        guess = np.where((share > 0)[..., None], total / np.maximum(share, 1e-300)[..., None], overall)
        means[unseen] = guess[unseen]
        return means

    def choose(self, reflectance, allowed, always, only):
        """Decide which sources are exact, so that the rest interpolates to `allowed` (in L2 of L); keep the errors.

        always: those exact in any case; only: no others.
        """
        f = self.field
        is_leaf = f.child[self.cells] < 0
        leaves = self.cells[is_leaf]
        nodes, size = self.local[f.nodes[self.cells]], f.sizes()[leaves]
        shape = (len(self.means), -1)
        lump = f.surplus_of(self.cells, self.local, self.received.reshape(shape)).reshape(*nodes.shape, -1, 3)
        split = f.surplus_of(self.cells, self.local, self.means.reshape(shape)).reshape(lump.shape)
        split = reflectance * split * self.factors[nodes][..., None]
        lump = reflectance * lump
        scale = size[:, None, None] * DECAY**2 / 9
        cost_lump = (scale * (lump[is_leaf] ** 2).sum(axis=3)).sum(axis=(0, 1))
        cost_split = (scale * (split[is_leaf] ** 2).sum(axis=3)).sum(axis=(0, 1))
        order = np.argsort(cost_split - cost_lump)
        order = np.concatenate([always, order[~np.isin(order, always)]]).astype(int)
        rest = cost_lump.sum() - np.cumsum(cost_lump[order])
        count = len(always)
        while not only and count < min(len(order), MOST):
            left = rest[count - 1] if count else cost_lump.sum()
            if left <= allowed**2 or cost_split[order[count]] >= cost_lump[order[count]]:
                break
            count += 1
        others = order[count:]
        self.take(order[:count])
        lumped = (lump[:, :, others].sum(axis=2) ** 2).sum(axis=2)
        each = (split[:, :, self.exact] ** 2).sum(axis=(2, 3))
        surplus = np.zeros(len(f.level))
        surplus[self.cells] = np.sqrt((lumped + each).mean(axis=1))
        self.leaf_error = decay(f, leaves, surplus) * surplus[leaves] * np.sqrt(size)
        return self

    def take(self, exact):
        """The values to interpolate where the sources `exact` (k,) are those."""
        self.leaves = self.cells[self.field.child[self.cells] < 0]
        self.exact, others = exact, np.setdiff1d(np.arange(self.received.shape[1]), exact)
        means = self.means[:, exact].reshape(len(self.means), 3 * len(exact))
        self.values = np.concatenate([self.received[:, others].sum(axis=1), means], axis=1)
        return self

    def conform(self):
        self.values = self.field.conform_of(self.leaves, self.local, self.values)
        return self

    def between(self, cell, weight, factors):
        """Where cells (n,) and weights (n, 9) interpolate, factors (n, exact sources) -> irradiance / pi (n, 3)"""
        value = np.einsum("nk,nkc->nc", weight, self.values[self.local[self.field.nodes[cell]]])
        means = value[:, 3:].reshape(len(value), -1, 3)
        return value[:, :3] + np.einsum("ns,nsc->nc", factors, means)


def _joined(cells):
    parts = ("receiver", "owner", "origin", "width")
    return _Cells(*(np.concatenate([getattr(c, k) for c in cells], axis=-1) for k in parts))


def _frame(direction):
    """direction (n, 3) -> unit axis and two unit vectors across it."""
    axis = unit(direction)
    seed = np.zeros_like(axis)
    seed[np.arange(len(axis)), np.abs(axis).argmin(axis=1)] = 1.0
    e1 = unit(np.cross(seed, axis))
    return axis, e1, np.cross(axis, e1)


def _parts(index, size):
    size = max(size, 1)
    return [index[k : k + size] for k in range(0, len(index), size)]
