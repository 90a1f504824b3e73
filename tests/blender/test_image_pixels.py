"""Pixels of images as linear light."""

import bpy
import numpy as np
import pytest


def byte_image(tmp_path, values, space="sRGB"):
    """An image loaded from a PNG of values (h, w, 4) in 0..255."""
    height, width = values.shape[:2]
    made = bpy.data.images.new("Made", width, height, alpha=True)
    made.pixels.foreach_set((values / 255).astype(np.float32).ravel())
    made.filepath_raw, made.file_format = str(tmp_path / "made.png"), "PNG"
    made.save()
    loaded = bpy.data.images.load(made.filepath_raw)
    loaded.colorspace_settings.name = space
    return loaded


def random_bytes(opaque=True):
    values = np.random.default_rng(3).integers(0, 256, (4, 6, 4))
    values[..., 3] = 255 if opaque else values[..., 3]
    return values


@pytest.mark.parametrize("space", ["sRGB", "Display P3", "Rec.1886", "Rec.2020", "ACEScg", "ACES2065-1"])
def test_bytes_are_decoded_as_blender_does(addon, tmp_path, space):
    image = byte_image(tmp_path, random_bytes(), space)
    found = addon("operators.reading.image_pixels").read_pixels(image)
    settings = bpy.context.scene.render.image_settings
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    image.save_render(str(tmp_path / "linear.exr"))
    linear = np.empty(96, np.float32)
    bpy.data.images.load(str(tmp_path / "linear.exr")).pixels.foreach_get(linear)
    assert np.abs(found - linear.reshape(4, 6, 4)).max() < 5e-4


def test_data_stays_as_it_is_and_colours_are_multiplied_by_alpha(addon, tmp_path):
    values = random_bytes(opaque=False)
    image = byte_image(tmp_path, values, "Non-Color")
    read_pixels = addon("operators.reading.image_pixels").read_pixels
    assert np.allclose(read_pixels(image), values / 255, atol=1e-6)
    image.colorspace_settings.name = "Linear Rec.709"
    assert np.allclose(read_pixels(image)[..., :3], values[..., :3] / 255 * values[..., 3:] / 255, atol=1e-6)
    image.alpha_mode = "CHANNEL_PACKED"
    assert np.allclose(read_pixels(image), values / 255, atol=1e-6)
    image.alpha_mode = "NONE"
    assert (read_pixels(image)[..., 3] == 1).all()


def test_floats_packed_and_generated_images(addon, tmp_path):
    read_pixels = addon("operators.reading.image_pixels").read_pixels
    image = bpy.data.images.new("HDR", 3, 2, float_buffer=True)
    values = np.linspace(0, 50, 24, dtype=np.float32).reshape(2, 3, 4)
    values[..., 3] = 1
    image.pixels.foreach_set(values.ravel())
    assert np.array_equal(read_pixels(image), values)
    packed = byte_image(tmp_path, random_bytes())
    packed.pack()
    before = read_pixels(packed)
    (tmp_path / "made.png").unlink()
    packed.reload()
    assert np.array_equal(read_pixels(packed), before)
    made = bpy.data.images.new("Made", 4, 4)
    made.generated_color = (0.5, 0.5, 0.5, 1)
    assert np.allclose(read_pixels(made)[..., :3], 0.214, atol=2e-3)  # as sRGB bytes


def test_what_has_no_pixels_is_named(addon, tmp_path):
    pixels = addon("operators.reading.image_pixels")
    missing = bpy.data.images.new("Wood", 4, 4)
    missing.source, missing.filepath = "FILE", "/nowhere/wood.png"
    with pytest.raises(pixels.ImageError, match="'Wood' '/nowhere/wood.png' is missing"):
        pixels.read_pixels(missing)
    tiles = bpy.data.images.new("Tiles", 4, 4, tiled=True)
    with pytest.raises(pixels.ImageError, match="'Tiles' is a set of tiles"):
        pixels.read_pixels(tiles)
    strange = byte_image(tmp_path, random_bytes(), "Filmic Log")
    with pytest.raises(pixels.ImageError, match="'Filmic Log', which is not read"):
        pixels.read_pixels(strange)
