"""Pixels of the report."""

import struct
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon.comparison import pictures


def decoded(data):
    """(height, width, channels) of a PNG with filters 0 and 2, by the format's definition."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    chunks, at = {}, 8
    while at < len(data):
        (size,), name = struct.unpack(">I", data[at : at + 4]), data[at + 4 : at + 8]
        chunks[name] = data[at + 8 : at + 8 + size]
        assert struct.unpack(">I", data[at + 8 + size : at + 12 + size])[0] == zlib.crc32(name + chunks[name])
        at += 12 + size
    width, height, depth, kind = struct.unpack(">IIBB", chunks[b"IHDR"][:10])
    assert depth == 8
    channels = {2: 3, 3: 1, 6: 4}[kind]
    lines = np.frombuffer(zlib.decompress(chunks[b"IDAT"]), np.uint8).reshape(height, -1)
    rows = np.zeros((height, width * channels), np.uint8)
    for i, line in enumerate(lines):
        rows[i] = line[1:] + (rows[i - 1] if line[0] == 2 and i else 0)
    return rows.reshape(height, width, channels), chunks


@given(height=st.integers(1, 9), width=st.integers(1, 9), channels=st.sampled_from([3, 4]), seed=st.integers(0, 99))
def test_a_png_holds_the_picture(height, width, channels, seed):
    picture = np.random.default_rng(seed).integers(0, 256, (height, width, channels), dtype=np.uint8)
    assert (decoded(pictures.png(picture))[0] == picture).all()


def test_levels_become_a_palette_whose_first_colour_is_see_through():
    levels = np.arange(pictures.LEVELS + 1, dtype=np.uint8).reshape(1, -1)
    pixels, chunks = decoded(pictures.png(levels))
    assert (pixels[..., 0] == levels).all()
    assert chunks[b"tRNS"] == b"\0"
    assert chunks[b"PLTE"][3:] == pictures.colour_scale().tobytes()


def test_the_colour_scale_gets_lighter_in_even_steps():
    linear = (pictures.colour_scale() / 255.0) ** 2.2 @ [0.2126, 0.7152, 0.0722]
    lightness = np.cbrt(linear)
    steps = np.diff(lightness)
    assert (steps > 0).all(), "a larger error must never look darker"
    # Oklab's lightness against CIE's: they agree to a factor of 2 along a scale of changing hue.
    assert steps.max() < 2.5 * np.median(steps)


def test_errors_are_placed_on_a_logarithmic_scale():
    errors = np.array([[np.nan, 1e-6, 1e-4, 1e-3, 1e-2, 5.0]], dtype=np.float32)
    levels = pictures.on_scale(errors, 1e-4, 1e-2)[0]
    assert levels.tolist() == [0, 1, 1, pytest.approx((1 + pictures.LEVELS) / 2, abs=1), pictures.LEVELS, pictures.LEVELS]


def test_rows_from_the_bottom_end_up_at_the_bottom():
    errors = np.full((4, 3), 1e-4, dtype=np.float32)
    errors[0] = 1e-2
    assert (pictures.on_scale(errors, 1e-4, 1e-2)[-1] == pictures.LEVELS).all()


def test_a_wide_picture_is_reduced_and_keeps_its_worst_pixel():
    errors = np.full((40, 4000), 1e-6, dtype=np.float32)
    errors[17, 2501] = 1.0
    levels = pictures.on_scale(errors, 1e-6, 1.0)
    assert levels.shape[1] <= 1920
    assert (levels == pictures.LEVELS).sum() == 1


def test_a_shaded_picture_shows_objects_and_sky(paper_scene):
    picture = pictures.shaded(paper_scene.picture())
    assert picture.shape == (200, 320, 3) and picture.dtype == np.uint8
    sky, ground = picture[2, 160], picture[-3, 160]
    assert np.abs(sky.astype(int) - ground).max() > 20
    assert picture.std() > 10


def test_a_crop_is_centred_on_its_pixel():
    picture = np.zeros((20, 30, 3), np.uint8)
    picture[20 - 1 - 4, 7] = 255
    assert (pictures.crop(picture, (30, 20), 7, 4)[7, 7] == 255).all()
    assert pictures.crop(picture, (30, 20), 0, 0).shape == (15, 15, 3)
