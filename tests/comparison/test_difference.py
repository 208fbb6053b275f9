"""The picture of what differs: in the colours of the report, and with a mark where another surface is seen."""

from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon.comparison import difference, geometry, pictures, radiance
from viewcam_addon.errors import InputError
from viewcam_addon.image import Image
from viewcam_addon.pinhole import Pinhole

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
        return written[0].astype(int), words["colours"]

    return draw


def test_an_error_is_lighter_than_none_and_what_was_not_compared_is_grey(drawn, paper_scene):
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
    def picture(colour):
        passes = {"Combined": np.concatenate([colour, np.ones((48, 64, 1))], axis=-1), "Depth": np.full((48, 64, 1), 8.0)}
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
