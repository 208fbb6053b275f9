"""MuJoCo's cameras and those of The Ray Tracer Challenge, by numbers that MuJoCo itself and the book say."""

import math

import numpy as np
import pytest

from viewcam_addon import cameras
from viewcam_addon.cameras import Options
from viewcam_addon.errors import InputError

VGA = Options(size=(640, 480))


def model(camera, before="", around=("", "")):
    return f"<mujoco>{before}<worldbody>{around[0]}{camera}{around[1]}</worldbody></mujoco>"


def axes_and_eye(text):
    (camera,) = cameras.read(text, options=VGA)
    return np.column_stack(camera.pinhole.axes()), camera.pinhole.eye, camera.pinhole


# cam_xmat of MuJoCo 3, row by row, to six digits
MATRICES = {
    'xyaxes="0 1 0 -1 0 2"': [0, -0.447214, 0.894427, 1, 0, 0, 0, 0.894427, 0.447214],
    'quat="0.9 0.1 -0.3 0.2"': [0.726316, -0.442105, -0.526316, 0.315789, 0.894737, -0.315789, 0.610526, 0.063158, 0.789474],
    'euler="10 20 30"': [0.813798, -0.469846, 0.34202, 0.543838, 0.823173, -0.163176, -0.204874, 0.318796, 0.925417],
    'zaxis="1 2 3"': [0.960357, -0.079287, 0.267261, -0.079287, 0.841427, 0.534522, -0.267261, -0.534522, 0.801784],
    'axisangle="1 1 0 30"': [0.933013, 0.066987, 0.353553, 0.066987, 0.933013, -0.353553, -0.353553, 0.353553, 0.866025],
    "": [1, 0, 0, 0, 1, 0, 0, 0, 1],
}


@pytest.mark.parametrize("orientation", MATRICES)
def test_mujocos_camera_has_the_matrix_that_mujoco_computes(orientation):
    turn, eye, pinhole = axes_and_eye(model(f'<camera name="a" pos="1 2 3" {orientation} fovy="40"/>'))
    np.testing.assert_allclose(turn, np.reshape(MATRICES[orientation], (3, 3)), atol=1e-6)
    assert eye == (1, 2, 3) and not pinhole.mirrored
    assert pinhole.distance[1] == pytest.approx(240 / math.tan(math.radians(20)))


def test_a_camera_of_a_body_stands_where_the_body_stands():
    """By MuJoCo 3: eye 3 1 3."""
    around = '<body pos="5 0 0" euler="0 0 90">', "</body>"
    turn, eye, pinhole = axes_and_eye(model('<camera pos="1 2 3" euler="10 20 30"/>', around=around))
    expected = [-0.543838, -0.823173, 0.163176, 0.813798, -0.469846, 0.34202, -0.204874, 0.318796, 0.925417]
    np.testing.assert_allclose(turn, np.reshape(expected, (3, 3)), atol=1e-6)
    assert eye == pytest.approx((3, 1, 3)) and pinhole.distance[1] == pytest.approx(240 / math.tan(math.radians(22.5)))


def test_mujocos_compiler_says_the_unit_and_the_order_of_angles():
    """Capitals turn about the axes that stay, so the order is the other way round."""
    angles = [math.radians(angle) for angle in (30, 20, 10)]
    before = '<compiler angle="radian" eulerseq="ZYX"/>'
    turn, _, _ = axes_and_eye(model(f'<camera pos="1 2 3" euler="{" ".join(map(repr, angles))}"/>', before))
    np.testing.assert_allclose(turn, np.reshape(MATRICES['euler="10 20 30"'], (3, 3)), atol=1e-6)


def test_mujocos_sensor_is_the_lens_and_the_resolution_the_size():
    text = '<camera pos="0 0 0" resolution="320 200" sensorsize="0.0064 0.004" focal="0.005 0.006" zaxis="0 0 1"/>'
    (camera,) = cameras.read(text)
    assert camera.size_stated and (camera.pinhole.width, camera.pinhole.height) == (320, 200)
    assert camera.pinhole.distance == pytest.approx((250, 300))


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (model('<camera pos="0 0 0" mode="targetbody" target="a"/>'), "turns towards a body"),
        (model('<camera pos="0 0 0" quat="1 0 0 0" euler="0 0 0"/>'), "MuJoCo takes one orientation"),
        (model('<camera pos="0 0 0" xyaxes="1 0 0 2 0 0"/>'), "no direction"),
        (model('<camera pos="0 0 0" projection="orthographic"/>'), "orthographic"),
        (model('<camera pos="0 0" />'), "has 2 numbers"),
        (model('<camera pos="0 0 0" fovy="180"/>'), "between 0 and 180"),
        (model('<camera pos="0 0 0" principal="0.1 0"/>'), "principal point"),
        (model('<camera pos="0 0 0"/>', '<default><default class="a"><camera fovy="3"/></default></default>'), "default class"),
        (model('<camera pos="0 0 0"/>', '<compiler eulerseq="abc"/>'), "eulerseq"),
    ],
)
def test_what_is_not_read_of_mujoco_is_named(text, problem):
    with pytest.raises(InputError, match=problem):
        cameras.read(text, options=VGA)


BOOK = """
# a comment
- add: light
  at: [ -10, 10, -10 ]
  intensity: [ 1, 1, 1 ]
- add: camera
  width: 201
  height: 101
  field-of-view: 1.5707963267948966
  from: [ 0, 0, 0 ]
  to: [ 0, 0, -1 ]
  up: [ 0, 1, 0 ]
- add: plane
  from: [ 3, 3, 3 ]
"""


def test_the_first_pixels_ray_is_the_one_that_the_ray_tracer_challenge_prints():
    assert cameras.recognized(BOOK) == "ray_tracer_challenge"
    (camera,) = cameras.read(BOOK)
    pinhole = camera.pinhole
    assert pinhole.mirrored and any("left-handed" in note for note in camera.notes)
    column, row, _ = pinhole.project(np.array([[0.66519, 0.33259, -0.66851]]))
    assert (column[0], row[0]) == pytest.approx((0.5, 100.5), abs=2e-3)  # the upper left pixel's center, of five digits


def test_the_books_angle_is_of_the_longer_side():
    upright = BOOK.replace("width: 201", "width: 50").replace("height: 101", "height: 100")
    assert cameras.read(upright)[0].pinhole.distance == pytest.approx((50, 50))


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("  up: [ 0, 1, 0 ]\n", "", "has no up"),
        ("1.5707963267948966", "60", "radians"),
        ("[ 0, 0, -1 ]", "[ 0, 0 ]", "2 numbers"),
    ],
)
def test_what_the_books_camera_lacks_is_named(old, new, problem):
    with pytest.raises(InputError, match=problem):
        cameras.read(BOOK.replace(old, new))
    with pytest.raises(InputError, match="adds 2 cameras"):
        cameras.read(BOOK + BOOK)
