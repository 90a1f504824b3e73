"""Bundles of rays, along one direction or many side by side, against every shape tried for every ray."""

from collections import Counter

import numpy as np
import pytest

from pdm_core import Plane, Scene, Sphere, Surface
from pdm_core.rays.bundles import NOTHING, Receivers, along
from pdm_core.rays.direct import Shares
from pdm_core.rays.facets import Facets
from pdm_core.rays.perspective import seen_from
from pdm_core.rays.rows import Traced, directions
from pdm_core.rays.sources import Source
from pdm_core.signs_of_life import finish


def heap(rng, planes, balls):
    """Parallelograms and balls at random, seen from both sides."""
    shapes = [Plane(*rng.uniform(-1, 1, (1, 3)), *rng.normal(size=(2, 3)) * 0.4) for _ in range(planes)]
    shapes += [Sphere.at(rng.uniform(-1, 1, 3), rng.uniform(0.05, 0.3)) for _ in range(balls)]
    return shapes, Scene([Surface(s, 0.5, side=side) for s in shapes for side in ("front", "back")])


def nearest(shapes, start, direction):
    """(n,) which of the shapes rays from start (n, 3) along direction (n, 3) meet first, -1 none, one by one."""
    best, found = np.full(len(start), np.inf), np.full(len(start), -1)
    for k, shape in enumerate(shapes):
        if isinstance(shape, Plane):
            u, v = shape.linear[:, 0], shape.linear[:, 1]
            normal = np.cross(u, v)
            depth = (shape.origin - start) @ normal / (direction @ normal)
            there = start + depth[:, None] * direction - shape.origin
            s, t = np.linalg.lstsq(np.stack([u, v], axis=1), there.T, rcond=None)[0]
            hit = (depth > 0) & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
        else:
            to, radius = shape.origin - start, shape.semi_axes[0]
            middle = np.einsum("ni,ni->n", to, direction)
            half = radius**2 - np.einsum("ni,ni->n", to, to) + middle**2
            near, far = (middle + sign * np.sqrt(np.maximum(half, 0)) for sign in (-1, 1))
            depth = np.where(near > 0, near, far)
            hit = (half > 0) & (depth > 0)
        closer = hit & (depth < best)
        best[closer], found[closer] = depth[closer], k
    return found


def free(rng, count):
    """Receivers anywhere in the heap, on no shape."""
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points = rng.uniform(-1.5, 1.5, (count, 3))
    return Receivers(points, normals, np.full(count, -1), np.full(count, 1e-9), np.zeros(count, bool))


@pytest.mark.parametrize("count", (1, 2, 7, 16))
@pytest.mark.parametrize("planes, balls, each", ((40, 0, 300), (0, 30, 50), (30, 30, 400), (3, 1, 40), (300, 20, 3)))
def test_the_nearest_shape_is_met(count, planes, balls, each):
    rng = np.random.default_rng(count * planes + balls)
    shapes, scene = heap(rng, planes, balls)
    facets = Facets(scene)
    receivers = free(rng, each).take(np.tile(np.arange(each), count))
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    about = Receivers(receivers.points - facets.centre, *list(vars(receivers).values())[1:])
    hits = along(facets, directions, about)
    cosine = np.einsum("ni,ni->n", receivers.normals, np.repeat(directions, each, axis=0))
    np.testing.assert_allclose(hits.cosine, cosine, atol=1e-12)
    ray = np.sign(cosine)[:, None] * np.repeat(directions, each, axis=0)
    right = nearest(shapes, receivers.points, ray)
    met = np.where(hits.facet == NOTHING, -1, facets.shape.take(hits.facet))
    np.testing.assert_array_equal(met, np.where(right >= 0, scene.shape_of[::2][right], -1))
    assert (right >= 0).any()


@pytest.mark.parametrize("count, others", ((1, 500), (5, 500), (500, 1), (500, 5)))
@pytest.mark.parametrize("planes, balls", ((40, 0), (0, 30), (30, 30)))
def test_what_stands_between_hides(planes, balls, count, others):
    """Whether there are few points or few receivers."""
    rng = np.random.default_rng(planes)
    shapes, scene = heap(rng, planes, balls)
    facets, receivers, centres = Facets(scene), free(rng, others), rng.uniform(-1, 1, (count, 3))
    which, who = (rng.integers(0, n, 500) for n in (count, others))
    about = Receivers(receivers.points - facets.centre, *list(vars(receivers).values())[1:])
    seen = seen_from(facets, centres - facets.centre, about, which, who)
    to = centres[which] - receivers.points[who]
    far = np.linalg.norm(to, axis=1, keepdims=True)
    hit = nearest(shapes, receivers.points[who], to / far)
    back = nearest(shapes, centres[which], -to / far)
    assert seen[hit < 0].all() and seen.any() and not seen.all()
    # what is met from either end alone may lie beyond the other
    between = (hit >= 0) & (hit == back) & (hit < planes)
    assert not seen[between].any() and between.any() == (planes > 0)


def test_no_scene_is_projected_for_nobody():
    """Of 300,000 facets that took a quarter of a solution."""
    traced = Traced(4, directions(8))
    finish(traced.trace(None, None, np.zeros(0, int)))  # neither facets nor receivers are looked at


class TwoPoints(Source):
    """A source of two points that look up, either side of a wall."""

    def __init__(self):
        super().__init__(np.ones(3), "two points")

    def samples(self, count):
        return np.array([[-1.0, 0, 0], [1, 0, 0]]), np.tile([0.0, 0, 1], (2, 1)), np.ones(2)

    def unoccluded(self, points, normals):
        return np.ones(len(points))

    def against(self, points, normals):
        return np.zeros(len(points), bool)


def test_receivers_are_not_taken_for_others_where_as_many_rays_as_receivers_are_left():
    """Of two receivers one faces both points, the other neither: two rays, both of the first."""
    wall = Plane((0, -5, -5), (0, 10, 0), (0, 0, 10))
    facets = Facets(Scene([Surface(wall, 0.5, side=side) for side in ("front", "back")]))
    points, normals = np.array([[-1.0, 0, 1], [2, 0, 1]]), np.array([[0.0, 0, -1], [0, 0, 1]])
    about = Receivers(points - facets.centre, normals, np.full(2, -1), np.full(2, 1e-9), np.zeros(2, bool))
    shares = Shares(facets, [TwoPoints()], Counter())
    share, *_ = finish(shares._share(shares.sources[0], about, np.arange(2), 2, np.ones(2), np.zeros(1, int)))
    near, far = 1.0, 1 / 5**2  # cosines over square distance
    np.testing.assert_allclose(share[0], near / (near + far))
