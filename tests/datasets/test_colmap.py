"""COLMAP's text model: its lines on paper, its quaternions everywhere, its digits and files."""

import contextlib
import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from viewcam_addon import cameras
from viewcam_addon.cameras import colmap
from viewcam_addon.cameras.camera import Camera
from viewcam_addon.errors import InputError
from viewcam_addon.files import written_whole
from viewcam_addon.pinhole import Pinhole

AHEAD = Pinhole((0, -5, 0), (0, 0, 0), (0, 0, 1), 1200.0, 640, 360)
ABOVE = Pinhole((1, 2, 9), (1, 2, 0), (0, 0, 1), 1200.0, 640, 360)
WIDE_PIXELS = Pinhole((0, -5, 0), (0, 0, 0), (0, 0, 1), (1200.0, 800.0), 640, 360, (300.0, 150.0))
THREE = [Camera("a", AHEAD), Camera("below/b", WIDE_PIXELS), Camera("c", ABOVE)]

UNIT = 2.0**-53


def content(text):
    return [line for line in text.split("\n")[:-1] if not line.startswith("#")]


def test_on_paper_a_view_along_y_is_a_quarter_turn_about_x_and_one_straight_down_a_half_turn():
    lines = content(colmap.texts(THREE)["images.txt"])
    assert lines[1::2] == ["", "", ""], "the line of image points must be there, and be empty"
    # Along y: x stays, world z is −y of the camera, world y its z. The eye is 5 before the origin.
    assert lines[0] == "1 0.7071067811865475 0.7071067811865475 0.0 0.0 0.0 0.0 5.0 1 a.png"
    # Straight down: x of the camera is −y of the world, y is −x, z is −z.
    number, *pose, camera, name = lines[4].split(" ")
    assert (number, camera, name) == ("3", "1", "c.png")
    w, x, y, z, *translation = map(float, pose)
    assert (w, z, translation) == (0, 0, [2, 1, 9]) and x == -y and abs(x - math.sqrt(0.5)) <= 2 * UNIT


def test_pictures_with_the_same_intrinsics_share_a_camera():
    assert content(colmap.texts(THREE)["cameras.txt"]) == [
        "1 SIMPLE_PINHOLE 640 360 1200.0 320.0 180.0",
        "2 PINHOLE 640 360 1200.0 800.0 300.0 210.0",
    ]
    assert [line.split(" ")[8] for line in content(colmap.texts(THREE)["images.txt"])[::2]] == ["1", "2", "1"]


def test_cameras_are_numbered_without_gaps():
    texts = colmap.texts([THREE[0], THREE[2], THREE[1]])
    assert [line[:2] for line in content(texts["cameras.txt"])] == ["1 ", "2 "]
    assert [line.split(" ")[8] for line in content(texts["images.txt"])[::2]] == ["1", "1", "2"]


def test_there_are_no_points():
    text = colmap.texts(THREE)["points3D.txt"]
    assert content(text) == [] and text.startswith("# POINT3D_ID")


coordinates = st.floats(-1e6, 1e6)
triples = st.tuples(coordinates, coordinates, coordinates)


@given(triples, triples, triples)
@example((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
@example((0.0, 0.0, -5.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
@example((0.0, 0.0, -5.0), (0.0, 0.0, 0.0), (0.0, -1.0, 0.0))  # no rotation at all
@example((0.0, 0.0, -5.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0))  # half a turn about z
@example((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0))  # half a turn about x
@example((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), (0.0, -1.0, 0.0))  # half a turn about y
def test_the_quaternion_has_length_1_and_its_first_number_that_is_not_0_is_positive(eye, look_at, up):
    assume(eye != look_at and any(up))
    texts = colmap.texts([Camera("a", Pinhole(eye, look_at, up, 1.0, 1, 1))])
    quaternion = [float(text) for text in content(texts["images.txt"])[0].split(" ")[1:5]]
    excess = abs(sum(Fraction(number) ** 2 for number in quaternion) - 1)
    # Of the length: half of 4 roundings of the sum of squares, one of the root, and one of each quotient.
    assert excess <= 2 * 4 * UNIT * (1 + UNIT), f"|q|² − 1 = {float(excess):.3g}"
    assert next(number for number in quaternion if number) > 0
    assert "-0.0" not in texts["images.txt"].split()


def test_the_numbers_have_the_digits_of_float64():
    pinhole = Pinhole((0.1, 1e-7, 1 / 3), (1e6, 2, 3), (0, 0, 1), 1e5 / 3, 640, 360, (1 / 7, 2.0**-30))
    camera = content(colmap.texts([Camera("a", pinhole)])["cameras.txt"])[0].split(" ")[4:]
    assert [float(text) for text in camera] == [1e5 / 3, 1 / 7, 360 - 2.0**-30]


def test_the_three_files_are_written_and_nothing_else_with_the_same_bytes_each_time(tmp_path):
    for folder in ("one", "two"):
        cameras.save(THREE, tmp_path / folder / "sparse" / "0", "colmap")
    first, two = (
        {path.name: path.read_bytes() for path in (tmp_path / folder / "sparse" / "0").iterdir()} for folder in ("one", "two")
    )
    assert first == two == {name: text.encode() for name, text in colmap.texts(THREE).items()}
    assert first.keys() == {"cameras.txt", "images.txt", "points3D.txt"} and b"\r" not in b"".join(first.values())


@pytest.mark.parametrize("failing", ["images.txt", "cameras.txt", "points3D.txt"])
def test_where_one_can_not_be_written_it_and_the_images_stay_as_they_were(tmp_path, monkeypatch, failing):
    for name in colmap.texts(THREE):
        (tmp_path / name).write_text("older")

    @contextlib.contextmanager
    def on_a_full_disk(path):
        with written_whole(path) as temporary:
            yield temporary
            if path.name == failing:
                raise OSError(28, "No space left on device")

    monkeypatch.setattr(cameras, "written_whole", on_a_full_disk)
    with pytest.raises(InputError, match=failing):
        cameras.save(THREE, tmp_path, "colmap")
    left = {path.name: path.read_text() for path in tmp_path.iterdir()}
    assert left.keys() == colmap.texts(THREE).keys(), "a temporary file stayed"
    assert left[failing] == left["images.txt"] == "older", "images.txt must not be newer than the cameras it names"


def test_the_translation_is_within_three_roundings_of_exact():
    pinhole = Pinhole((12345.678, -0.1, 1e-3), (1, 2, 3), (0.3, 0.1, 1), 1.0, 1, 1)
    translation = [float(text) for text in content(colmap.texts([Camera("a", pinhole)])["images.txt"])[0].split(" ")[5:8]]
    u, v, w = pinhole.axes()
    for sign, axis, have in zip((-1, 1, 1), (u, v, w), translation, strict=True):
        exact = sign * sum(Fraction(a) * Fraction(b) for a, b in zip(axis, pinhole.eye, strict=True))
        assert abs(Fraction(have) - exact) <= 3 * UNIT * np.linalg.norm(pinhole.eye)
