"""Cells of rays' charts as trees: what they interpolate, and what halving keeps."""

import numpy as np
import pytest

from pdm_core.rays.lattice import Lattice

CHARTS = np.array([[8, 4], [0, 0], [16, 8]])


def middles(lattice):
    """(k, 2) of the leaves on their charts, in [0, 1]^2."""
    return (lattice.corner + lattice.step / 2) / lattice.size[lattice.chart]


def share(lattice):
    """(k,) of their charts that the leaves are."""
    return (lattice.step / lattice.size[lattice.chart]).prod(axis=1)


def halved(seed, times=4):
    """A Lattice after some random leaves were halved along random axes, and its last `old`."""
    rng = np.random.default_rng(seed)
    lattice = Lattice.even(CHARTS, np.array([False, False, True]))
    for _ in range(times):
        lattice, old = lattice.split((rng.random((len(lattice), 2)) < 0.2) & lattice.may_split())
    return lattice, old


def places(seed, count=4000):
    rng = np.random.default_rng(seed)
    return np.where(rng.random(count) < 0.3, 0, 2), rng.random((count, 2))


@pytest.mark.parametrize("seed", range(6))
def test_leaves_cover_their_charts_once(seed):
    lattice, _ = halved(seed)
    total = np.bincount(lattice.chart, share(lattice), 3)
    assert total == pytest.approx([1, 0, 1], abs=1e-12)
    assert (lattice.leaf >= 0).all() and (np.bincount(lattice.leaf) == lattice.step.prod(axis=1)).all()


@pytest.mark.parametrize("seed", range(6))
def test_what_is_even_stays_even(seed):
    lattice, _ = halved(seed)
    chart, at = places(seed)
    leaf, weight = lattice.columns(chart, at)
    assert (lattice.chart[leaf] == chart[:, None]).all()
    assert (weight >= 0).all() and weight.sum(axis=1) == pytest.approx(1, abs=1e-6)


def test_between_leaves_of_one_size_values_are_linear():
    lattice = Lattice.even(CHARTS, np.array([False, False, True]))
    chart, at = places(0)
    leaf, weight = lattice.columns(chart, at)
    found = np.einsum("hk,hki->hi", weight, middles(lattice)[leaf])
    half = 0.5 / lattice.size[chart]
    inner = ((at > half) & (at < 1 - half)).all(axis=1)
    assert inner.sum() > 1000 and np.abs(found - at)[inner].max() < 1e-6


@pytest.mark.parametrize("seed", range(6))
def test_smooth_values_are_met_to_the_size_of_the_leaves(seed):
    lattice, _ = halved(seed)
    chart, at = places(seed)
    leaf, weight = lattice.columns(chart, at)
    off = np.abs(np.einsum("hk,hki->hi", weight, middles(lattice)[leaf]) - at)
    off[:, 0] = np.where(chart == 2, np.minimum(off[:, 0], 0.0), off[:, 0])  # it goes round
    largest = (lattice.step / lattice.size[lattice.chart])[leaf].max(axis=1)
    assert (off <= largest / 2 + 1e-6).all() and (off.mean(axis=0) < largest.mean(axis=0) / 10).all()


@pytest.mark.parametrize("seed", range(6))
def test_halving_leaves_the_others_where_they_are(seed):
    before, _ = halved(seed, 2)
    marked = (np.random.default_rng(seed).random((len(before), 2)) < 0.3) & before.may_split()
    after, old = before.split(marked)
    kept = old >= 0
    assert kept.sum() == (~marked.any(axis=1)).sum()
    assert middles(after)[kept] == pytest.approx(middles(before)[old[kept]])
    assert share(after)[kept] == pytest.approx(share(before)[old[kept]])
    assert len(after) == len(before) + (2 ** marked.sum(axis=1) - 1).sum()


def test_what_no_leaf_covers_is_the_nearest_ones():
    lattice = Lattice.even(np.array([[8, 8]]), np.array([False]))
    gone = (middles(lattice) < 0.5).all(axis=1)
    left = lattice.without(gone)
    leaf, weight = left.columns(np.zeros(1, int), np.array([[0.49, 0.3]]))
    nearest = middles(left)[leaf[0, weight[0].argmax()]]
    assert nearest == pytest.approx([0.5625, 0.3125])


def test_a_step_is_told_where_it_is():
    lattice = Lattice.even(np.array([[16, 8]]), np.array([False]))
    value = (middles(lattice)[:, :1] > 0.5).astype(float)
    along, across = lattice.surplus(value, np.zeros(len(lattice))).T
    beside = np.abs(middles(lattice)[:, 0] - 0.5) < 1 / 16
    assert (along[beside] > 0.05).all() and (along[~beside] < 1e-12).all() and (across < 1e-12).all()
