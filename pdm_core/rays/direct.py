"""Direct light at points: closed forms of what each source would give, times the share of it that is seen.

The share is that of points spread over the source, seen through one perspective bundle each; where part is seen, of
more and more of them, until what is unsure is below the tolerance.
"""

from itertools import chain, product

import numpy as np

from ..at_once import CACHED, slices
from ..closed_forms import dot, kernel, ways
from ..tolerances import FAINT, TINY
from .bundles import NOTHING, along, flat_faces
from .grid import batches
from .perspective import seen_from
from .tally import Tally, unseen
from .tinted import colours_of

COARSE = 0.02  # target from which on few points of a source will do
FINE = 0.004  # target down to which COMPARED will do
READ = {True: (16, 256), False: (64, 1024)}  # points of a source at first and at most, by whether the target is coarse
# the same where only differences count, which the same points tell alike: 1 / 64 of a lamp in the tenth of a floor that
# sees part of it is .1 % of its light
COMPARED = 16, 64
SCATTERED = 4, 24  # points of a source for each of many receivers, of one of TURNS sets of so many
ASKED = 64  # times that each of them is asked at least: what is seen of a point costs as much by few receivers
GOLDEN = (5**0.5 - 1) / 2
FACTOR = 4  # how many times more where part is seen
AT_NODES = 4, 16  # at one of the places of a node, which stand for it together
TURNS = 3  # sets of points that these receivers see in turn
ALL = 32  # points of a source that nodes see, each a few of them, about as many in all, where facets are no more than
NOT_DEAR = 2048  # of them: else to look from a point costs more than all nodes that do
ASIDE = 3  # points further on in each next run of as many as there are sets
POWER = 0.75  # of n points: the error of a share that they tell, where part is seen, is about 1 / (2 n)^POWER
MANY = 8  # sources, from which on the penumbra of each one is looked for by few points, the same ones at all places
BETWEEN = 0.3  # of a source's light, and of what may be off, that its points do not stand for: more are needed, up to
STAND = 256  # of them, whatever is told


class Shares:
    """What receivers see of sources: factor (n, k) of the irradiance / pi, of unit radiance or as tinted (n, k, 3);
    error (n,) radiance: how far it may be off, as half the points of each tell, and where all agree what usually lies
    between them: seen (2, k), how many receivers saw a part of each, and how many would have, did all of them."""

    def __init__(self, facets, sources, counts):
        self.facets, self.sources, self.counts = facets, sources, counts
        self.seen = np.zeros((2, len(sources)))
        self.many = len({id(source.whole) for source in sources}) > MANY
        self.in_turn = facets.count <= NOT_DEAR and not self.many  # whether nodes next to each other see other points

    def at(self, receivers, tolerance, relative, points, sets=(0,)):
        """Generator with a sign of life a bundle; returns factor (n, k, 3), error (n,) of the light, and lost (n,),
        the light of sources that no point stands for: too much of it is taken, if anything.

        tolerance: of irradiance / pi, of all or of each (n,), for all sources together, or relative, of the light there
        unhidden, where that is more; points: of a source, at first and at most; sets (j,): of these, which
        the j places of a node see, and those of the next node others: of several what is seen is usual from then on,
        but not where colours are read, lest one place hang on the others."""
        n, many, learns = len(receivers), self.many, len(sets) > 1
        sets = np.zeros(1, int) if many else np.array(sets)  # of many some are too bright and some too dark
        tolerance = np.broadcast_to(tolerance, n)
        factor = np.zeros((n, len(self.sources), 3), np.float32)
        error2, total, lost = np.zeros((3, n))
        for k, source in enumerate(self.sources):
            factor[:, k] = (yield from self._unoccluded(source, receivers))[:, None]
            total += factor[:, k, 0] * source.colour.max()
        for k, source in enumerate(self.sources):
            if not source.shadows:
                continue
            whole = factor[:, k, 0].astype(float)
            lit = _lit(whole)
            factor[:, k] = 0.0
            light = whole[lit] * source.colour.max()
            # each source's part of the square of what is unsure is its part of the light
            may = np.maximum(np.maximum(tolerance[lit], relative * total[lit]), 1e-300)
            unsure = np.sqrt(light * total[lit]) / may
            needed = unsure ** (1 / POWER) / 2
            share, (off, between, alike) = np.ones((len(lit), 3)), np.zeros((3, len(lit)))
            few = points[0] // FACTOR
            most = few if many else points[0]
            begun = np.select([needed <= 1, needed <= few], [1, few], most)
            for begin in np.unique(begun):
                some, count = np.flatnonzero(begun == begin), begin
                while len(some):
                    found = yield from self._share(source, receivers, lit[some], count, whole[lit[some]], sets)
                    share[some], off[some], between[some], agree, number = found
                    alike[some] = np.where(agree, number, 0)
                    if count == begin:
                        self.seen[:, k] += (~agree).sum(), (1 - 1 / number).sum()
                    again = np.where(agree, off[some] * unsure[some] > 1, needed[some] > count)
                    again &= count < points[1]
                    lacks = between[some] * np.maximum(light / may, 1.0)[some]
                    again |= (lacks > BETWEEN) & (count < STAND)
                    count *= FACTOR
                    some = some[again]
            if learns:
                did, would = self.seen[:, k]
                source.partly = float(min(did / max(would, 1.0), 1.0))
                off[alike > 0] = unseen(alike[alike > 0], source.partly)
            tint, told = yield from colours_of(source, receivers.take(lit), points[0], unsure, self.facets.centre)
            factor[lit, k] = whole[lit, None] * share * tint
            error2[lit] += (light * np.maximum(np.maximum(off, between), told)) ** 2
            lost[lit] += light * between
        return factor, np.sqrt(error2), lost

    def scattered(self, receivers):
        """Generator with a sign of life a bundle; returns factor (n, k, 3) as `at` does, each receiver's share told by
        a few of many points of a source, others for each, of MANY of more sources, the likelier the more they give:
        right in the mean of several, not of each."""
        whole = np.zeros((len(receivers), len(self.sources)), np.float32)
        for k, source in enumerate(self.sources):
            whole[:, k] = yield from self._unoccluded(source, receivers)
        whole *= _taken(whole * [source.colour.sum() for source in self.sources])
        factor = np.repeat(whole[:, :, None], 3, axis=2)
        for k, source in enumerate(self.sources):
            lit = _lit(whole[:, k])
            if source.shadows and len(lit):
                share = yield from self._scattered_share(source, receivers.take(lit))
                factor[lit, k] *= share
        return factor

    def _scattered_share(self, source, receivers):
        """Shares seen (n, 3) by SCATTERED points each, the likelier the more a point gives there: as all points would
        tell in the mean of several receivers; yields."""
        (few, most), n = SCATTERED, len(receivers)
        count = TURNS * most
        if len(self.sources) > MANY:  # of them fewer points are as many in all
            count = min(TURNS * max(most * MANY // len(self.sources), FACTOR * few), max(n * few // ASKED, few))
        place, normal, weight = source.samples(count)
        tint = source.tint(place)
        point, some_shine = np.zeros((n, few), np.int16), np.zeros(n, bool)
        turns = min(TURNS, max(len(place) // few, 1))
        for part, turn in product(slices(n, turns * (2 * CACHED * TURNS // len(place) + 1)), range(turns)):
            mine = np.arange(n)[part][turn::turns]
            own = np.arange(turn, len(place), turns)
            normals = None if normal is None else normal[own]
            upto = self._values(source, place[own], normals, receivers.take(mine)) * weight[own, None]
            upto = upto.cumsum(axis=0)
            for k in range(few):
                at = (k + mine * GOLDEN % 1) / few * upto[-1]
                number = (upto <= at).view(np.int8).sum(axis=0, dtype=np.int8)  # fewer than 2^7
                point[mine, k] = own[np.minimum(number, len(own) - 1)]
            some_shine[mine] = upto[-1] > 0
            yield
        pairs = np.flatnonzero(np.repeat(some_shine, few))
        pairs = pairs[np.argsort(point.ravel()[pairs], kind="stable")]
        which, whose, got = point.ravel()[pairs], pairs // few, np.zeros((n * few, 1 if tint is None else 3))
        used = np.unique(which)  # of a ball half of the points look away from all
        number = np.searchsorted(used, which)
        for some in batches(len(used), len(which) // len(used), self.facets) if len(used) else ():
            part = slice(*np.searchsorted(number, [some[0], some[-1] + 1]))
            seen = visible(self.facets, source, place[used[some]], receivers, number[part] - some[0], whose[part])
            got[pairs[part]] = seen[:, None] if tint is None else seen[:, None] * tint[which[part]]
            self.counts["shadow rays"] += len(seen)
            yield
        return np.where(some_shine[:, None], got.reshape(n, few, -1).sum(axis=1) / few, 1.0)

    def _unoccluded(self, source, receivers):
        points, out = receivers.points + self.facets.centre, np.zeros(len(receivers))
        for part in slices(len(out), CACHED // 2):
            out[part] = source.unoccluded(points[part], receivers.normals[part])
            yield
        own = receivers.own
        # what a shining ball's inner side gives itself is met by rays
        out[(own >= 0) & (own == source.own) & ~(receivers.inside & source.is_spot)] = 0.0
        out[source.against(points, flat_faces(self.facets, receivers))] = 0.0
        out[receivers.under] = 0.0
        if source.receivers is not None:
            out[~np.append(source.receivers, True)[receivers.surface]] = 0.0  # the last in free space
        return out

    def _share(self, source, receivers, some, count, whole, sets):
        """Shares that some (n,) of the receivers see by so many points each, of sets as in `at`: (n, 3), how far they
        may be off (n,), the part of the light that no point stands for (n,); for which all points agree (n,), and how
        many these count for (n,)."""
        node, place = np.divmod(some, len(sets))
        turns, turn = self._turns(sets, node, place, count)
        receivers = receivers.take(some)
        place, normal, weight = source.samples(count * turns)
        turns = min(turns, len(place))
        tint, weight = source.tint(place), turns * weight
        tally = Tally(source, receivers.points + self.facets.centre, len(place) // turns, turns)
        each = [(_set(len(place), turns, k), np.flatnonzero(turn % turns == k)) for k in range(turns)]
        for some, mine in chain(*(_blocks(*own, self.facets) for own in each)):
            part = receivers.take(mine)
            value = self._values(source, place[some], None if normal is None else normal[some], part)
            value *= weight[some, None]
            point, who = np.nonzero(value)
            seen = visible(self.facets, source, place[some], part, point, who)
            self.counts["shadow rays"] += len(who)
            tally.add(place, some, mine, value, (point, who, seen), tint)
            yield
        return tally.shares(whole, source.partly)

    def _turns(self, sets, node, place, count):
        """How many sets of `count` points there are, and which of them places (n,) of nodes (n,) see: of their node's
        own the one that sets (j,) tells."""
        own = sets.max() + 1
        nodes = max(ALL // (count * own), 2) if len(sets) > 1 and self.in_turn else 1
        return nodes * own, sets[place] + own * (node % nodes)

    def _values(self, source, place, normal, receivers):
        """(k, n) What receivers get of places (k, 3) of a source, with normals (k, 3) or none, were all of it there."""
        if source.distant:
            return np.maximum(place @ receivers.normals.T, 0.0)
        points = receivers.points + self.facets.centre
        way = ways(points, place)
        beyond = source.beyond(way, points)
        held = np.zeros(len(points), bool) if normal is None else source.holds(points)
        value = kernel(way, normal, receivers.normals, np.where(held, -1.0, 1.0))
        if source.pattern is not None:
            leaving = np.moveaxis(-way / np.maximum(np.sqrt(dot(way, way)), 1e-300), 0, -1)
            # a little of it everywhere: the whole lamp counts where its beam passes between the points
            shaped = np.maximum(source.pattern(leaving), FAINT)
            value *= shaped if beyond is not None else np.where(held, 1.0, shaped)
        if beyond is not None:
            value[np.isnan(beyond)] *= FAINT
        return value


def visible(facets, source, place, receivers, which, who):
    """(n,) Whether receivers who (n,) see which (n,) of places (k, 3) of a source; sorted by these."""
    facets = source.blockers or facets
    if source.distant:
        cuts = np.searchsorted(which, np.arange(1, len(place)))
        parts = zip(place, np.split(who, cuts))
        seen = [along(facets, one[None], receivers.take(some)).facet == NOTHING for one, some in parts]
        return np.concatenate(seen)
    points = receivers.points.take(who, axis=0) + facets.centre
    beyond = source.beyond((place.take(which, axis=0) - points).T.copy(), points)
    return seen_from(facets, place - facets.centre, receivers, which, who, source.skip, beyond)


def _set(count, turns, which):
    """Which of `count` points (k,) are in one of so many sets: one of each run, not always the same, as every eighth of
    those that fill a square or a ball evenly are in rows."""
    run = np.arange(count // turns)
    return run * turns + (which + ASIDE * run) % turns


def _blocks(points, receivers, facets):
    """Yields parts of indices of points and of receivers that are worked out together, until each has been with all:
    few of those of which there are fewer, from which the others are seen."""
    if not len(receivers):
        return ()
    if len(receivers) < len(points):
        return ((points, receivers[some]) for some in batches(len(receivers), len(points), facets))
    return ((points[some], receivers) for some in batches(len(points), len(receivers), facets))


def _taken(light):
    """(n, k) How often each of k sources counts of whose light receivers get (n, k), where MANY at most are asked."""
    if light.shape[1] <= MANY:
        return 1.0
    upto = light.cumsum(axis=1)
    total = np.maximum(upto[:, -1:], 1e-300)
    turn = (np.arange(len(light)) * GOLDEN % 1)[:, None]
    times = np.diff(np.floor(upto / total * MANY + turn), axis=1, prepend=0)
    return times * total / np.maximum(MANY * light, 1e-300)


def _lit(whole):
    """(k,) Which receivers get anything worth mentioning of what a source would give them unhidden (n,)."""
    return np.flatnonzero(whole > TINY * max(whole.max(initial=0.0), 1e-300))
