"""Images between their pixels, and beyond their edges, against values worked out by hand."""

import importlib
import sys
import types
from pathlib import Path

import numpy as np
import pytest

# the package and its operators import bpy; empty ones over the same folders let numpy-only modules be imported
for _name, _path in (("without_bpy", "."), ("without_bpy.operators", "operators")):
    _package = types.ModuleType(_name)
    _package.__path__ = [str(Path(__file__).resolve().parents[2] / _path)]
    sys.modules.setdefault(_name, _package)
module = importlib.import_module("without_bpy.operators.reading.picture")
Picture, Tiles, Use = module.Picture, module.Tiles, module.Use
linear_of_srgb, srgb_of_linear = module.linear_of_srgb, module.srgb_of_linear


@pytest.fixture
def pixels():
    made = np.random.default_rng(3).uniform(0.1, 0.9, (4, 8, 4)).astype(np.float32)
    made[..., 3] = 1.0
    return made


def test_linear_between_pixel_centres(pixels):
    picture = Picture(pixels)
    at = np.array([[1.5 / 8, 2.5 / 4], [2.0 / 8, 2.5 / 4], [2.0 / 8, 3.0 / 4]])
    right = [pixels[2, 1], (pixels[2, 1] + pixels[2, 2]) / 2, pixels[2:4, 1:3].mean(axis=(0, 1))]
    np.testing.assert_allclose(picture.look_up(at, Use()), right, rtol=1e-6)


@pytest.mark.parametrize("extension, x", [("REPEAT", 1), ("EXTEND", 7), ("CLIP", None), ("MIRROR", 6)])
def test_beyond_the_edge(pixels, extension, x):
    found = Picture(pixels).look_up(np.array([[9.5 / 8, 0.5 / 4]]), Use(extension, "Closest"))[0]
    np.testing.assert_allclose(found, np.zeros(4) if x is None else pixels[0, x], rtol=1e-6)


def test_cubic_keeps_constants_and_slopes():
    ramp = np.ones((6, 9, 4), np.float32) * (0.1 * np.arange(9, dtype=np.float32))[:, None]
    at = np.column_stack([np.linspace(0.3, 0.7, 9), np.full(9, 0.5)])
    found = Picture(ramp).look_up(at, Use("EXTEND", "Cubic"))[:, 0]
    np.testing.assert_allclose(found, 0.1 * (9 * at[:, 0] - 0.5), atol=1e-6)


def test_bytes_are_interpolated_encoded():
    picture = Picture(np.array([[[0, 0, 0, 1], [1, 1, 1, 1]]], np.float32), np.uint8)
    found = picture.look_up(np.array([[0.5, 0.5]]), Use())
    np.testing.assert_allclose(found[0, :3], linear_of_srgb(0.5), rtol=1e-6)
    values = np.linspace(0, 1, 100)
    np.testing.assert_allclose(linear_of_srgb(srgb_of_linear(values)), values, atol=1e-9)


def test_straight_colours_are_free_of_alpha():
    pixels = np.array([[[0.4, 0.2, 0.1, 0.5]]], np.float32)
    at = np.array([[0.5, 0.5]])
    np.testing.assert_allclose(Picture(pixels).look_up(at, Use())[0], [0.4, 0.2, 0.1, 0.5], rtol=1e-6)
    np.testing.assert_allclose(Picture(pixels).look_up(at, Use(straight=True))[0], [0.8, 0.4, 0.2, 0.5], rtol=1e-6)


def test_tiles(pixels):
    other = pixels[::-1]
    tiles = Tiles({1001: Picture(pixels), 1012: Picture(other)})
    at = np.array([[0.3, 0.6], [1.3, 1.6], [1.3, 0.6]])
    found = tiles.look_up(at, Use(interpolation="Closest"))
    np.testing.assert_allclose(found, [pixels[2, 2], other[2, 2], np.zeros(4)], rtol=1e-6)
