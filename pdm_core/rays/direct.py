"""Direct light at points: closed forms of what each source would give, times the share of it that is seen.

The share is that of points spread over the source, seen through one perspective bundle each; where part is seen, of
more and more of them, until what is unsure is below the tolerance.
"""

import numpy as np

from ..scene import unit
from .bundles import NOTHING, along, seen_from
from .sources import kernel

COARSE = 0.02  # target from which on few points of a source will do
READ = {True: (16, 256), False: (64, 1024)}  # points of a source at first and at most, by whether the target is coarse
FACTOR = 4  # how many times more where part is seen
AT_NODES = 4, 16  # at one of the places of a node, which stand for it together
FAINT = 0.1  # of the tolerance: a source whose whole light is less is judged by one point
UNSURE, POWER = 1.0, 0.75  # error of a share that n points tell, where part is seen: UNSURE / (2 n)^POWER, about
UNSEEN = 1e-12
BETWEEN = 0.3  # of a source's light that its points do not stand for: more of them are needed
DIMMEST = 1e-6  # of a pattern, so that the whole lamp counts where its beam passes between the points that stand for it


class Shares:
    """What receivers see of sources: factor (n, k) of the irradiance / pi, of unit radiance or as tinted (n, k, 3);
    error (n,) radiance: how far it may be off, as half the points of each tell."""

    def __init__(self, facets, sources, counts):
        self.facets, self.sources, self.counts = facets, sources, counts

    def at(self, receivers, tolerance, points):
        """Generator with a sign of life a bundle; returns factor (n, k, 3) and error (n,) of the light.

        tolerance (n,): of irradiance / pi, for all sources together; points: of a source, at first and at most."""
        n = len(receivers)
        factor, error2 = np.zeros((n, len(self.sources), 3), np.float32), np.zeros(n)
        for k, source in enumerate(self.sources):
            whole = yield from self._unoccluded(source, receivers)
            if not source.shadows:
                factor[:, k] = whole[:, None]
                continue
            light = whole * source.colour.max()
            lit = np.flatnonzero(whole > UNSEEN * max(whole.max(initial=0.0), 1e-300))
            faint = light[lit] < FAINT * tolerance[lit]
            share, off = np.ones((len(lit), 3)), np.zeros(len(lit))
            for some, count in ((faint, 1), (~faint, points[0])):
                some = np.flatnonzero(some)
                while len(some):
                    part = receivers.take(lit[some])
                    share[some], off[some], partly = yield from self._share(source, part, count, whole[lit[some]])
                    unsure = UNSURE / (2 * count) ** POWER * light[lit[some]] * np.sqrt(len(self.sources))
                    again = partly & (unsure > tolerance[lit[some]]) & (count > 1)
                    count *= FACTOR
                    some = some[again] if count <= points[1] else some[:0]
            factor[lit, k] = whole[lit, None] * share
            error2[lit] += (light[lit] * off) ** 2
        return factor, np.sqrt(error2)

    def _unoccluded(self, source, receivers):
        points, out = receivers.points + self.facets.centre, np.zeros(len(receivers))
        step = 1 << 13
        for start in range(0, len(out), step):
            part = slice(start, start + step)
            out[part] = source.unoccluded(points[part], receivers.normals[part])
            yield
        own = receivers.own
        out[(own >= 0) & (own == source.skip)] = 0.0  # what a ball's inner side gives itself is met by rays
        out[source.against(points, receivers.normals)] = 0.0
        return out

    def _share(self, source, receivers, count, whole):
        """Shares seen (n, 3), how far half the points are off (n,), and which see a part alone (n,), or may do so
        between points that together give less than the whole light (n,)."""
        place, normal, weight = source.samples(count)
        tint = source.tint(place)
        n = len(receivers)
        seen, half, plain = np.zeros((n, 3)), np.zeros((2, n)), np.zeros(n)
        total, total_half = np.zeros(n), np.zeros((2, n))
        for j in range(len(place)):
            if source.distant:
                visible = np.zeros(n, bool)
                value = np.maximum(receivers.normals @ place[j], 0.0) * weight[j]
            else:
                at = place[j : j + 1] - self.facets.centre
                only = None if normal is None else normal[j : j + 1]
                value = kernel(at, only, receivers.points, receivers.normals)[:, 0] * weight[j]
                if source.pattern is not None:
                    value *= np.maximum(source.pattern(unit(receivers.points - at)), DIMMEST)
            some = np.flatnonzero(value > 0)
            if len(some):
                visible = np.zeros(n, bool)
                visible[some] = self._visible(source, place[j], receivers if len(some) == n else receivers.take(some))
                self.counts["shadow rays"] += len(some)
                got = value * visible
                seen += got[:, None] * (1.0 if tint is None else tint[j])
                plain += got
                half[j % 2] += got
                total += value
                total_half[j % 2] += value
            yield
        nothing = total <= 0
        safe = np.where(nothing, 1.0, total)
        share = seen / safe[:, None]
        share[nothing] = 1.0  # but no more is known than that some of it is ahead
        each = half / np.where(total_half > 0, total_half, 1.0)
        plain = np.where(nothing, 0.0, plain / safe)
        off = np.where((total_half > 0).all(axis=0), np.abs(each - plain).mean(axis=0), 0.0)
        hides = plain < 1 - 1e-9
        # what is near shines between the points that stand for it: all of it may be seen where they are not
        between = (
            np.where(hides, np.maximum(1 - total / (np.pi * whole), 0.0), 0.0) if source.is_surface else 1.0 * nothing
        )
        between = np.where(between > BETWEEN, between, 0.0)  # else it is how they stand for what is all ahead
        return share, np.maximum(off, between), hides & (plain > 0) | (between > 0)

    def _visible(self, source, place, receivers):
        if source.distant:
            return along(self.facets, place, receivers).facet == NOTHING
        return seen_from(self.facets, place - self.facets.centre, receivers, source.skip)
