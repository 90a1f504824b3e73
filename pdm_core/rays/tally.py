"""What points spread over a source tell of the share of it that receivers see, and how far that may be off."""

import numpy as np

AROUND = 2.0  # spacings of a source's points, within which those lie that tell what is seen between them


class Tally:
    """Sums over `count` points of a source, whose light receivers at points (n, 3) m get: what they give unhidden and
    what of it is seen, all of it and of every second point; they may be of so many sets in turn."""

    def __init__(self, source, points, count, turns=1):
        n, self.turns = len(points), turns
        self.seen, self.given = np.zeros((2, n, 3))  # as tinted
        self.half, self.total_half = np.zeros((2, 2, n))
        self.square = np.zeros(n)
        self.near = Near(source, points, count)

    def add(self, place, some, mine, value, pairs, tint):
        """Of places (k, 3) m on the source some (j,): value (j, i) that receivers mine (i,) get of them, pairs (point,
        who, visible) (m,) of these where that is more than 0, tint (k, 3) of the source or None; takes `value`."""
        point, who, visible = pairs
        close = self.near.add(place[some][point], mine[who], visible)
        value[point[close], who[close]] = 0.0
        got = np.zeros_like(value)
        got[point, who] = value[point, who] * visible
        for light, sums in ((got, self.seen), (value, self.given)):
            sums[mine] += light.sum(axis=0)[:, None] if tint is None else light.T @ tint[some]
        self.square[mine] += (value**2).sum(axis=0)
        for h in range(2):
            half = some // self.turns % 2 == h
            self.half[h, mine] += got[half].sum(axis=0)
            self.total_half[h, mine] += value[half].sum(axis=0)

    def shares(self, whole, partly):
        """Of factors (n,) of the source unhidden, a part of which the part `partly` of all receivers sees: shares seen
        (n, 3), how far they may be off (n,), the part of the light that no point stands for (n,); for which all points
        agree (n,), and how many these count for (n,)."""
        total, near = self.total_half.sum(axis=0), self.near
        some = total > 0
        beside = near.light(total / (np.pi * whole))
        nothing = ~some & (beside <= 0)
        far = np.where(some, self.half.sum(axis=0) / np.where(some, total, 1.0), near.share)
        share = np.divide(self.seen, self.given, out=np.repeat(far[:, None], 3, axis=1), where=self.given > 0)
        share += beside[:, None] * (near.share[:, None] - share)
        share[nothing] = 1.0  # but no more is known than that some of it is ahead
        plain = np.where(nothing, 0.0, far + beside * (near.share - far))
        number, off = self._of_far(far, total)
        off = (1 - beside) * off + beside * of_few(near.share, near.told)
        # points of unlike weights count for fewer
        number = 1 / ((1 - beside) ** 2 / number + beside**2 / np.maximum(near.told, 1.0))
        agree = (plain >= 1 - 1e-9) | (plain <= 0)
        off[agree] = unseen(number[agree], partly)
        # where some of what is near is hidden, nobody knows how much of what lies between its points
        between = np.where(nothing, 1.0, np.where(near.share < 1, beside, 0.0))
        return share, off, between, agree, number

    def _of_far(self, far, total):
        """For how many points (n,) those elsewhere count, and how far their shares far (n,) may be off."""
        number = np.where(total > 0, total**2 / np.maximum(self.square, 1e-300), 1.0)
        each = self.half / np.where(self.total_half > 0, self.total_half, 1.0)
        both = (self.total_half > 0).all(axis=0)
        return number, np.where(both, np.abs(each - far).mean(axis=0), of_few(far, number))


class Near:
    """What points (n, 3) m see of a source nearby, which shines there between `count` points of it: what these do not
    give is near, and seen as far as those of it about there are. told (n,): how many of these; share (n,) seen."""

    def __init__(self, source, points, count):
        self.points, self.there = points, np.zeros(len(points), bool)
        self.told, self.visible = np.zeros((2, len(points)))
        if source.is_surface:
            self.spacing = source.spacing(count)
            self.there = source.distances(points) < self.spacing

    def add(self, place, who, visible):
        """Of places (k, 3) m on the source: visible (k,) from points who (k,), or not; which of them (j,) are near."""
        some = np.flatnonzero(self.there[who])
        if not len(some):
            return some
        who, visible, count = who[some], visible[some], len(self.there)
        apart = np.linalg.norm(place[some] - self.points[who], axis=1)
        about = apart < AROUND * self.spacing
        self.told += np.bincount(who[about], minlength=count)
        self.visible += np.bincount(who[about], visible[about], count)
        return some[apart < self.spacing]

    @property
    def share(self):
        return np.divide(self.visible, self.told, out=np.ones(len(self.told)), where=self.told > 0)

    def light(self, others):
        """(n,) The part of the source's light that comes from near by; others (n,): from elsewhere."""
        return np.where(self.told > 0, np.maximum(1 - others, 0.0), 0.0)


def of_few(share, number):
    """How far shares may be off that so many points tell, if all of them are as likely."""
    share = (number * share + 1) / (number + 2)
    return np.sqrt(share * (1 - share) / (number + 3))


def unseen(number, partly):
    """How far shares may be off of which so many points all tell 0 or 1, where the part `partly` of receivers see any
    other, each as likely: an edge hides half of what one of them stands for before the first is hidden."""
    missed = partly / number
    return np.sqrt(missed / np.maximum(1 - partly + missed, 1e-300) / 12) / number
