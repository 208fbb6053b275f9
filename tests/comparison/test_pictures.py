"""Pixels of the report."""

import struct
import xml.etree.ElementTree as ElementTree
import zlib
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon import html_page
from viewcam_addon.comparison import charts, difference, geometry, pictures, radiance
from viewcam_addon.comparison.tolerances import ROUNDINGS
from viewcam_addon.errors import InputError
from viewcam_addon.image import Image
from viewcam_addon.pinhole import Pinhole


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


def test_levels_become_a_palette_whose_first_color_is_see_through():
    levels = np.arange(pictures.LEVELS + 1, dtype=np.uint8).reshape(1, -1)
    pixels, chunks = decoded(pictures.png(levels))
    assert (pixels[..., 0] == levels).all()
    assert chunks[b"tRNS"] == b"\0"
    assert chunks[b"PLTE"][3:] == pictures.color_scale().tobytes()


def test_the_color_scale_gets_lighter_in_even_steps():
    linear = (pictures.color_scale() / 255.0) ** 2.2 @ [0.2126, 0.7152, 0.0722]
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


def test_a_crop_is_centered_on_its_pixel():
    picture = np.zeros((20, 30, 3), np.uint8)
    picture[20 - 1 - 4, 7] = 255
    assert (pictures.crop(picture, (30, 20), 7, 4)[7, 7] == 255).all()
    assert pictures.crop(picture, (30, 20), 0, 0).shape == (15, 15, 3)


# --- Drawings of the report


@pytest.mark.parametrize("roundings", [np.empty(0), np.zeros(10), np.geomspace(1e-5, 0.5, 1000), np.full(9, 1e6)])
def test_a_histogram_is_well_formed_whatever_it_shows(roundings):
    drawing = ElementTree.fromstring(charts.histogram(roundings))
    numbers = [float(value) for part in drawing.iter() for key, value in part.items() if key in ("x", "y", "x1", "x2", "width")]
    assert numbers and np.isfinite(numbers).all()


def test_a_percentile_beyond_its_limit_is_marked():
    drawing = charts.histogram(np.full(100, 1.01 * ROUNDINGS[0]))
    assert drawing.count('class="beyond"') == 1 and drawing.count('class="within"') == 4


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (0, "0"),
        (0.5, "0.50"),
        (1, "1.0"),
        (12.3, "12"),
        (1.6e-4, "1.6·10⁻⁴"),
        (-2e-9, "−2.0·10⁻⁹"),
        (9.99e-8, "1.0·10⁻⁷"),
        (3e6, "3.0·10⁶"),
    ],
)
def test_figures_have_two_digits(value, words):
    assert html_page.figure(value) == words


# --- The picture of what differs: in the colors of the report, and with a mark where another surface is seen


PINHOLE = Pinhole((5, -7, 4), (0.2, 0.1, 0.6), (0, 0, 1), 60.0, 64, 48)


@pytest.fixture
def drawn(monkeypatch, tmp_path):
    """A function that gives the picture that is written, (height, width, 3), and the words."""

    def draw(comparison):
        written = []
        png = pictures.png
        monkeypatch.setattr(pictures, "png", lambda picture: written.append(picture) or png(picture))
        words = difference.write(comparison, tmp_path / "difference.png")
        assert (tmp_path / "difference.png").read_bytes().startswith(b"\x89PNG")
        assert words["image"] == str(tmp_path / "difference.png")
        return written[0].astype(int), words["colors"]

    return draw


def test_an_error_is_lighter_than_none_and_what_was_not_compared_is_gray(drawn, paper_scene):
    reference = paper_scene.picture()
    test = paper_scene.rendered()
    test.passes["Position"] = test["Position"].copy()
    test["Position"][10:20, 20:40] *= 1.001
    comparison = geometry.compare(reference, test, paper_scene.pinhole)
    picture, words = drawn(comparison)
    height, width = paper_scene.pinhole.height, paper_scene.pinhole.width
    assert picture.shape == (height, width, 3)
    compared = np.isfinite(comparison.maps["Position"])
    upright = picture[::-1].sum(axis=-1)  # rows from the bottom, as the maps have them
    off = np.zeros_like(compared)
    off[10:20, 20:40] = True
    assert np.median(upright[compared & off]) > 1.5 * np.median(upright[compared & ~off])
    assert (picture[::-1][~compared & (reference["Object Index"][..., 0] == 0)] == 64).mean() > 0.9
    assert words.startswith("Dark ") and "px" in words


def test_another_surface_seen_is_red(drawn, paper_scene):
    reference, test = paper_scene.picture(), paper_scene.rendered()
    test.passes["Object Index"] = test["Object Index"].copy()
    test["Object Index"][12:16, 30:34] += 5
    picture, _ = drawn(geometry.compare(reference, test, paper_scene.pinhole))
    red, green, blue = picture[::-1][12:16, 30:34].reshape(-1, 3).mean(axis=0)
    assert red > 150 and red > 1.5 * green and red > 1.3 * blue


def test_two_pictures_without_a_common_pixel_are_drawn_too(drawn, paper_scene):
    nothing = replace(paper_scene, spheres=(), radius=1e-6)
    picture, _ = drawn(geometry.compare(paper_scene.picture(), nothing.picture(), paper_scene.pinhole))
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 1, "no mark where one side sees a surface"


def test_light_is_orange_where_the_test_is_brighter_and_blue_where_it_is_darker(drawn):
    def picture(color):
        passes = {"Combined": np.concatenate([color, np.ones((48, 64, 1))], axis=-1), "Depth": np.full((48, 64, 1), 8.0)}
        return Image({name: values.astype(np.float32) for name, values in passes.items()}, PINHOLE, {"samples": "1"}, "a.exr")

    truth = np.full((48, 64, 3), 0.5)
    wrong = truth.copy()
    wrong[30:40, 10:20] *= 1.4
    wrong[5:15, 40:60] *= 0.6
    seen, words = drawn(radiance.compare(picture(truth), [picture(wrong)], PINHOLE))
    upright = seen[::-1]
    brighter, darker = upright[35, 15], upright[10, 50]
    assert brighter[0] > brighter[2] + 50 and darker[2] > darker[0] + 50
    assert upright[25, 30].sum() < min(brighter.sum(), darker.sum())
    assert "Orange where Cycles is brighter" in words


def test_where_it_can_not_be_written_a_sentence_says_so(paper_scene, tmp_path):
    comparison = geometry.compare(paper_scene.picture(), paper_scene.rendered(), paper_scene.pinhole)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="can't be written"):
        difference.write(comparison, tmp_path / "file" / "difference.png")
