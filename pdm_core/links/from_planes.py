"""Light of planes at points: their cells, divided where they are near or partly hidden, and samples of each."""

from dataclasses import dataclass

import numpy as np

from ..at_once import CACHED, in_turn, parts
from ..biquadratic import CHILDREN, FIRST_ROLE, basis
from ..closed_forms import divide, dot
from ..contour import polygon_unoccluded
from ..field_charts import graded, graded_slope
from ..numerics import gauss_legendre
from ..shadows import Shadows
from ..tolerances import TINY

SLENDER = 1.5  # times as long one way as the other: a cell that is halved along the longer alone
VIRTUAL = 6  # levels a leaf may be divided below itself, near the receiver
CLOSE = 0.5  # size over distance of a cell whose factor nine samples do not tell
AT_HAND = 0.9  # size over distance of a cell that may begin right at the receiver
PARTLY = 0.1  # error of the share of a cell that samples see, of its factor
_GAUSS, _WEIGHTS = (rule[:, None] for rule in gauss_legendre(3))


@dataclass
class _Cells:
    """Frontier of (receiver, source rectangle); owner is the cell whose nodes carry the field there."""

    receiver: np.ndarray
    owner: np.ndarray
    origin: np.ndarray  # (2, n) of the rectangle in the owner, in its widths
    width: np.ndarray  # (2, n) of the rectangle in the owner's widths
    slender: np.ndarray  # (2, n) bool: along which axis it is so much shorter than along the other

    def take(self, index):
        along = (a.take(index, axis=1) for a in (self.origin, self.width, self.slender))
        return _Cells(self.receiver[index], self.owner[index], *along)


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


class FromPlanes:
    """Of planes among the sources."""

    def __init__(self, field, factors, planes):
        self.field, self.factors, self.flat = field, factors, planes
        linear = np.array([s.shape.linear for s in factors.scene.surfaces])
        u, v = linear[:, :, 0].T.copy(), linear[:, :, 1].T.copy()
        self.frame, self.metric = (factors.origin.T.copy(), u, v), np.stack([dot(u, u), dot(u, v), dot(v, v)])
        self.area = factors.scene.areas
        everyone = np.arange(len(field.level))
        chart = field.chart_of(everyone)
        # of cells (2, n), in chart coordinates; their charts begin and extend so along the edges
        self.corner, self.size = field.in_chart(everyone).T, 0.5**field.level.T
        self.begin, end = (field.on.rectangles.cuts[field.surface, ((0,), (1,)), chart.T + k] for k in (0, 1))
        self.extent = end - self.begin
        self.links = 0

    def entries(self, x, n, own, detail, tol):
        """Yields entries of Gather, and None, of points (m, 3) m, normals (m, 3), surfaces (m,) and tolerances (m,)."""
        r, s = (a.ravel() for a in np.meshgrid(np.arange(len(x)), self.flat, indexing="ij"))
        ahead = self.factors.facing(x.take(r, axis=0), own[r], s)
        r, s = r[ahead], s[ahead]
        x, n, own, corners = x.take(r, axis=0), n.take(r, axis=0), own[r], self.factors.corners.take(s, axis=0)
        height = np.einsum("ni,ni->n", x - self.factors.origin[s], self.factors.front[s])
        shafts = self.factors.shafts
        occluders = shafts.in_view(x, n, corners, shafts.for_pairs(x, own, s))
        foot = np.ascontiguousarray(self.field.on.local(s, x)[:, :2].T)
        below = -height * np.einsum("ni,ni->n", n, self.factors.front[s])
        slope = np.stack([dot(n.T, edge.take(s, axis=1)) for edge in self.frame[1:]])
        shadows = Shadows(shafts.table, x, [axis.take(s, axis=1) for axis in self.frame], occluders)
        pairs = _Pairs(x, n, height, tol[r], own, s, occluders, shadows, foot, below, slope)
        links = []
        for chunk in parts(np.arange(len(r)), CACHED):
            waiting = [self._whole(chunk, s[chunk])]
            while waiting:
                todo, *done = self._sort_out(waiting.pop(), pairs, detail)
                some, split = self._weigh(*done, pairs, detail)
                links.append(some)
                yield None
                todo = self._divide(_joined([todo, split]))
                waiting += [todo.take(k) for k in parts(np.arange(len(todo.receiver)), 4 * CACHED)]
        if not links:
            return
        pair, node, weight, partial = (np.concatenate(part) for part in zip(*links))
        yield None
        share = np.bincount(pair, weight.sum(axis=1), minlength=len(r))
        hidden = np.bincount(pair, partial, minlength=len(r)) > 0
        scale = yield from self._scales(pairs, share, hidden)
        yield r[pair], node, weight * scale[pair][:, None]

    def _scales(self, pairs, share, hidden):
        """What the samples of pairs are to be multiplied by (p,): they share out what the pair exchanges, share (p,) in
        all by them; how much that is, is exact, and behind what may hide it where hidden (p,); yields."""
        free, hidden = np.flatnonzero(~hidden & (share > 0)), np.flatnonzero(hidden)
        value, corners = np.zeros(len(share)), self.factors.corners[pairs.source]
        value[free] = polygon_unoccluded(pairs.points[free], pairs.normals[free], corners[free])
        for k in parts(hidden, CACHED):
            x, n, own, s = pairs.points[k], pairs.normals[k], pairs.surface[k], pairs.source[k]
            value[k] = self.factors.visible(x, n, own, s, corners[k], occluders=pairs.occluders[k])
            yield
        return divide(value, share)

    def _whole(self, pair, source):
        """The root cells of planes source (n,), for pairs (n,)."""
        charts = self.field.charts[source]
        first = np.repeat(self.field.root[source] - np.cumsum(charts) + charts, charts)
        count = len(first)
        origin = np.zeros((2, count))
        return _Cells(np.repeat(pair, charts), first + np.arange(count), origin, origin + 1, origin > 0)

    def _on_chart(self, cells):
        """Lower corners and widths (2, n) in chart coordinates."""
        size = self.size.take(cells.owner, axis=1)
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
        along = half * np.sqrt([uu, vv])
        cells.slender = SLENDER * along < along[::-1]
        distance, g2 = np.sqrt(distance2), half2 / distance2
        area = 4 * half[0] * half[1] * self.area[pairs.source[k]]
        cosine = np.clip((above + reach) / distance, 0, 1)
        factor = area * cosine * np.minimum(height / distance + np.sqrt(g2) * 0.5, 1) / (np.pi * distance2)
        factor = np.minimum(1.0, factor)
        factor[g2 > AT_HAND**2] = 0.5  # a long cell that the point is next to: half of all light, however small
        leaf = self.field.child[cells.owner] < 0
        error = np.where(leaf, 0.0, detail.below[cells.owner])
        error = factor * (error + np.minimum(1.0, g2 * g2) * detail.variation[cells.owner] * cells.width.max(axis=0))
        seen = above + reach > 0
        fine = (error <= tol) | (leaf & (cells.width.min(axis=0) <= 0.5**VIRTUAL))
        close = (g2 > CLOSE**2) | (above < reach)
        done = np.flatnonzero(seen & fine)
        ends = low.take(done, axis=1), high.take(done, axis=1)
        return cells.take(np.flatnonzero(seen & ~fine)), cells.take(done), ends, close[done]

    def _divide(self, cells):
        """Into their children, leaves into halves along both axes, of slender ones along the longer."""
        f = self.field
        leaf = f.child[cells.owner] < 0
        halved = np.where(leaf, ~cells.slender, f.halved[cells.owner].T)
        which, number = in_turn(1 << halved.sum(axis=0))
        leaf, halved, owner = leaf[which], halved.take(which, axis=1), cells.owner[which]
        half = CHILDREN.take(FIRST_ROLE[halved[0] + 2 * halved[1]] + number, axis=0).T
        width = np.where(leaf, cells.width.take(which, axis=1) / (1 + halved), 1.0)
        origin = np.where(leaf, cells.origin.take(which, axis=1) + half * width, 0.0)
        owner = np.where(leaf, owner, f.child[owner] + number)
        return _Cells(cells.receiver[which], owner, origin, width, cells.slender.take(which, axis=1))

    def _weigh(self, cells, ends, close, pairs, detail):
        """Of cells good enough by their own: (pair, nodes (k, 9), weights (k, 9), partly hidden) and those to divide,
        which an occluder's outline crosses and that matter; ends and close as _sort_out tells them."""
        k, (low, width) = cells.receiver, self._on_chart(cells)
        t = low[:, None] + width[:, None] * _GAUSS
        place, slope = self._along(cells, t), graded_slope(t) * _WEIGHTS
        kernel = self._kernel(pairs, k, place - pairs.foot.take(k, axis=1)[:, None]) * (slope[0][:, None] * slope[1])
        size = pairs.height[k] * self.area[pairs.source[k]] * self.extent.take(cells.owner, axis=1).prod(axis=0)
        factor = kernel.sum(axis=(0, 1)) * size * width[0] * width[1] / np.pi
        self._settle(k, ends, np.flatnonzero(close), pairs, kernel, slope, factor)
        hidden, near = pairs.shadows.over(k, *ends, place)
        partly = near & hidden.any(axis=(0, 1)) & ~hidden.all(axis=(0, 1))
        unsure = partly & (PARTLY * factor * detail.surface[pairs.source[k]] > pairs.tolerance[k])
        unsure &= (self.field.child[cells.owner] >= 0) | (cells.width.min(axis=0) > 0.5**VIRTUAL)
        keep = np.flatnonzero(~unsure)
        self.links += len(keep)
        scale = factor / kernel.sum(axis=(0, 1))
        kernel = (np.where(hidden, TINY, 1.0) * kernel * scale).take(keep, axis=2)
        origin, width = (side.take(keep, axis=1)[:, None] for side in (cells.origin, cells.width))
        a, b = np.moveaxis(basis(origin + width * _GAUSS), -1, 1)
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
        o, u, v = (edge.take(pairs.source[k], axis=1) for edge in self.frame)
        corners = [o + a * u + b * v for a, b in around]
        factor[some] = polygon_unoccluded(pairs.points[k], pairs.normals[k], np.transpose(corners, (2, 0, 1)))
        unseen = some[kernel.take(some, axis=2).sum(axis=(0, 1)) == 0]
        kernel[:, :, unseen] = slope[0][:, None, unseen] * slope[1][:, unseen]


def _joined(cells):
    parts = ("receiver", "owner", "origin", "width", "slender")
    return _Cells(*(np.concatenate([getattr(c, k) for c in cells], axis=-1) for k in parts))
