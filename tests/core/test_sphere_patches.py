"""Patches of a sphere's inner side by contour: inside a sphere every patch gets its share of the area."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sphere_patches import sphere_patch_unoccluded


def directions(count, seed):
    d = np.random.default_rng(seed).normal(size=(count, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


@given(
    st.integers(0, 1 << 30),
    st.floats(-6, 6),
    st.tuples(st.floats(0, 1), st.floats(0, 1)).filter(lambda t: abs(t[0] - t[1]) > 0.01),
    st.floats(-3, 3),
    st.floats(0.01, 2 * np.pi),
)
@settings(max_examples=60, deadline=None)
def test_on_the_sphere_a_patch_is_its_share_of_the_area(seed, scale, heights, start, width):
    """F_ij = A_j / (4 pi R^2), wherever the point is."""
    radius, centre = 10.0**scale, 10.0**scale * np.array([0.3, -0.2, 0.7])
    out = directions(50, seed)
    low, high = np.arccos(np.sort(1 - 2 * np.array(heights))[::-1])
    border = np.abs(np.arccos(out[:, 2])[:, None] - [low, high]).min(axis=1)
    phi = np.arctan2(out[:, 1], out[:, 0])[:, None] - [start, start + width]
    off = (border > 1e-2) & (np.abs(np.sin(phi / 2)).min(axis=1) * np.sqrt(1 - out[:, 2] ** 2) > 1e-2)
    found = sphere_patch_unoccluded(centre + radius * out, -out, centre, radius, (low, start), (high, start + width))
    share = (np.cos(low) - np.cos(high)) * width / (4 * np.pi)
    assert np.abs(found - share)[off].max(initial=0) < 1e-10


@pytest.mark.parametrize("seed", range(4))
def test_patches_sum_to_the_whole_from_anywhere_inside(seed):
    rng = np.random.default_rng(seed)
    centre, radius = rng.normal(size=3), rng.uniform(0.1, 10)
    points, normals = (
        centre + radius * directions(200, seed) * rng.uniform(0, 0.95, (200, 1)),
        directions(200, seed + 9),
    )
    theta, phi = np.linspace(0, np.pi, 5), np.linspace(0, 2 * np.pi, 6) + 0.1
    patches = [
        sphere_patch_unoccluded(points, normals, centre, radius, (theta[i], phi[j]), (theta[i + 1], phi[j + 1]))
        for i in range(4)
        for j in range(5)
    ]
    assert np.abs(sum(patches) - 1).max() < 1e-12
    assert min(p.min() for p in patches) >= 0


def test_against_a_product_rule():
    points, normals = 0.8 * directions(20, 1), directions(20, 2)
    low, high = (0.4, 0.5), (1.9, 2.7)
    nodes, weights = np.polynomial.legendre.leggauss(300)
    theta, phi = (a + (b - a) * (nodes + 1) / 2 for a, b in zip(low, high))
    ring = np.sin(theta)[:, None]
    d = np.stack([ring * np.cos(phi), ring * np.sin(phi), np.cos(theta)[:, None] + 0 * phi], axis=-1)
    area = np.outer(weights, weights) * (high[0] - low[0]) * (high[1] - low[1]) / 4 * ring
    e = 2 * d - points[:, None, None]
    kernel = np.maximum((e * normals[:, None, None]).sum(-1), 0) * (e * d).sum(-1) / (e * e).sum(-1) ** 2
    expected = (kernel * area * 4).sum(axis=(1, 2)) / np.pi
    found = sphere_patch_unoccluded(points, normals, (0, 0, 0), 2.0, low, high)
    assert np.abs(found - expected).max() < 1e-6  # the rule's own error, where the horizon crosses the patch
