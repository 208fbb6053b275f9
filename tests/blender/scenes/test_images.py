"""Blender's images as pictures: each pixel as Blender has it, in as few bytes as hold it."""

import struct
import zlib

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender.scenes.images import picture_of
from viewcam_addon.tracer.scene.colors import RGBE


@pytest.fixture
def image(fresh_blender):
    """image(pixels (height, width, 4), space, **options) → an image of these."""

    def make(pixels, space="Non-Color", **options):
        block = bpy.data.images.new("Made", pixels.shape[1], pixels.shape[0], **options)
        block.colorspace_settings.name = space
        block.pixels.foreach_set(np.float32(pixels).ravel())
        block.update()
        return block

    return make


def in_blender(image):
    """(height, width, 3): the pixels as floats."""
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return np.ascontiguousarray(pixels.reshape(image.size[1], image.size[0], image.channels)[..., :3])


def opaque(*values):
    return np.stack([*values, np.ones_like(values[0])], axis=-1)


@pytest.mark.parametrize("space", ["sRGB", "Non-Color"])
def test_an_image_of_bytes_keeps_its_bytes_which_stand_for_the_floats_that_blender_shows(image, space):
    levels = np.arange(256).reshape(8, 32)
    block = image(opaque(levels, levels[::-1], levels[:, ::-1]) / [255, 255, 255, 1], space)
    picture = picture_of(block)
    assert picture.pixels.dtype == np.uint8 and picture.srgb == (space == "sRGB")
    assert np.array_equal(picture.pixels[..., 0], levels)
    assert picture.values.tobytes() == in_blender(block).tobytes()


def test_bytes_are_multiplied_by_their_alpha_in_whole_bytes(image):
    levels = np.arange(256).reshape(8, 32)
    block = image(np.stack([levels] * 3 + [levels[::-1]], axis=-1) / 255, "sRGB", alpha=True)
    block.alpha_mode = "STRAIGHT"
    multiplied = picture_of(block).pixels
    assert multiplied.dtype == np.uint8 and np.array_equal(multiplied[..., 1], levels * levels[::-1] // 255)
    with_alpha = picture_of(block, alpha=True)
    assert with_alpha.pixels.dtype == np.uint8 and np.array_equal(with_alpha.pixels[..., 3], levels[::-1])


@pytest.mark.parametrize(("bits", "dtype"), [(11, np.float16), (12, np.float32)])
def test_floats_are_half_ones_where_these_hold_their_bits(image, bits, dtype):
    odd = np.random.default_rng(0).integers(2 ** (bits - 1), 2**bits, (3, 4, 5)) | 1
    block = image(opaque(*odd / 128), float_buffer=True)
    picture = picture_of(block)
    assert picture.pixels.dtype == dtype
    assert picture.values.tobytes() == in_blender(block).tobytes()


def test_a_file_of_radiance_keeps_its_four_bytes_where_half_floats_are_too_small_and_too_coarse(fresh_blender, tmp_path):
    """From a night's 2⁻³⁰ to a sun."""
    levels = np.random.default_rng(0).integers(128, 256, (4, 5, 4)).astype(np.uint8)
    levels[..., 3] = np.arange(20).reshape(4, 5) * 3 + 106
    path = tmp_path / "sky.hdr"
    path.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 5\n" + levels[::-1].tobytes())
    block = bpy.data.images.load(str(path))
    picture = picture_of(block)
    assert picture.pixels.dtype == RGBE and np.array_equal(picture.pixels.view(np.uint8), levels)
    assert picture.values.tobytes() == in_blender(block).tobytes()
    assert picture_of(block, alpha=True).values[..., :3].tobytes() == picture.values.tobytes()


def test_a_png_of_two_bytes_keeps_them(fresh_blender, tmp_path):
    levels = np.arange(65536, dtype=">u2").reshape(256, 256)
    rows = b"".join(b"\0" + row.tobytes() for row in np.repeat(levels[::-1, :, None], 3, axis=2))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", 256, 256, 16, 2, 0, 0, 0)
    parts = chunk(b"IHDR", header), chunk(b"IDAT", zlib.compress(rows)), chunk(b"IEND", b"")
    path = tmp_path / "levels.png"
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(parts))
    block = bpy.data.images.load(str(path))
    block.colorspace_settings.name = "Non-Color"
    picture = picture_of(block)
    assert picture.pixels.dtype == np.uint16 and np.array_equal(picture.pixels[..., 2], levels)
    assert picture.values.tobytes() == in_blender(block).tobytes()
