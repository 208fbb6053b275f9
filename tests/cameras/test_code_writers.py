"""Code for VTK and for textbook ray tracers: read back it is the same camera, and by those programs' own rules, too."""

import ast
import math
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon import cameras
from viewcam_addon.cameras import Camera
from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole

from .conftest import CAMERAS, allowed, picture_error, points_before

pytestmark = pytest.mark.usefixtures("only_numbers")

SQUARE = [name for name, each in CAMERAS.items() if each.distance[0] == each.distance[1] and not each.mirrored]
CENTERED = [name for name in SQUARE if CAMERAS[name].principal_point == (CAMERAS[name].width / 2, CAMERAS[name].height / 2)]


def called(text):
    """The calls of a code: name without "set" → its numbers."""
    match = re.findall(r"[sS]et_?(\w+)\(([^()]*)\)", text)
    return {name: ast.literal_eval(f"({numbers},)") for name, numbers in match}


def seen_by_vtk(text, points):
    """Columns and rows (from the bottom) of points, by vtkCamera's ComputeViewTransform and ComputeProjectionTransform."""
    parsed = called(text)
    width, height = ast.literal_eval(re.search(r"windowSize = (.*)", text)[1])
    eye, focal, up = (np.array(parsed[name], float) for name in ("Position", "FocalPoint", "ViewUp"))
    w = (eye - focal) / np.linalg.norm(eye - focal)
    u = np.cross(up, w)
    u /= np.linalg.norm(u)
    v = np.cross(w, u)
    half = math.tan(math.radians(parsed["ViewAngle"][0]) / 2)  # of the height, at the distance 1
    (center_x, center_y), across = parsed["WindowCenter"], half * width / height
    left, right = (center_x - 1) * across, (center_x + 1) * across
    bottom, top = (center_y - 1) * half, (center_y + 1) * half
    from_eye = points - eye
    depth = -from_eye @ w
    x, y = from_eye @ u / depth, from_eye @ v / depth
    return (x - left) / (right - left) * width, (y - bottom) / (top - bottom) * height


@pytest.mark.parametrize("name", SQUARE)
def test_vtk_sees_what_the_pinhole_sees(name):
    pinhole = CAMERAS[name]
    points = points_before(pinhole)
    text = cameras.write([Camera(name, pinhole)], "vtk")
    error = picture_error(pinhole, *seen_by_vtk(text, points), points)
    assert error <= max(1e-3, allowed(pinhole, points)), f"{error:.3g} pixels"


def test_a_principal_point_upside_down_would_be_seen():
    pinhole = CAMERAS["shifted"]
    points = points_before(pinhole)
    text = cameras.write([Camera("a", pinhole)], "vtk")
    broken = re.sub(r"(SetWindowCenter\(.*, )(.*)\)", lambda actual: f"{actual[1]}{-float(actual[2])!r})", text)
    assert picture_error(pinhole, *seen_by_vtk(broken, points), points) > 1


@pytest.mark.parametrize("name", CENTERED)
def test_a_textbooks_ray_tracer_shoots_the_pinholes_rays(name):
    """direction = x u + y v − d w of the middle of pixels of the size 1."""
    pinhole = CAMERAS[name]
    parsed = called(cameras.write([Camera(name, pinhole)], "textbook"))
    assert (parsed["eye"], parsed["lookat"], parsed["hres"], parsed["vres"]) == (
        pinhole.eye,
        pinhole.look_at,
        (pinhole.width,),
        (pinhole.height,),
    )
    assert parsed["view_distance"] == (pinhole.distance[0],) and parsed["pixel_size"] == (1.0,)
    turned = Pinhole(pinhole.eye, pinhole.look_at, parsed["up"], *pinhole.distance[:1], pinhole.width, pinhole.height)
    assert turned.axes() == pinhole.axes()


@pytest.mark.parametrize("form", ["vtk", "textbook"])
@pytest.mark.parametrize("name", [*CAMERAS])
def test_read_back_it_is_the_same_camera_or_it_was_refused(form, name):
    pinhole = CAMERAS[name]
    if name not in (SQUARE if form == "vtk" else CENTERED):
        with pytest.raises(InputError, match=r"mirrored|shifted|square"):
            cameras.write([Camera(name, pinhole)], form)
        return
    (read,) = cameras.read(cameras.write([Camera(name, pinhole)], form))
    same(read.pinhole, pinhole, exact=form == "textbook")


def same(have, pinhole, exact):
    assert (have.eye, have.look_at, have.width, have.height) == (pinhole.eye, pinhole.look_at, pinhole.width, pinhole.height)
    assert have.axes() == pinhole.axes()
    if exact:
        assert (have.distance, have.principal_point) == (pinhole.distance, pinhole.principal_point)
    # The angle θ of half the height is told to unit · θ, which is d/H + H/d times that of the distance.
    bent = pinhole.distance[0] / pinhole.height + pinhole.height / pinhole.distance[0]
    np.testing.assert_allclose(have.distance, pinhole.distance, rtol=16 * 2**-53 * bent)
    np.testing.assert_allclose(have.principal_point, pinhole.principal_point, rtol=0, atol=8 * 2**-53 * 5000)


@settings(max_examples=25, deadline=None)
@given(
    eye=st.tuples(*[st.floats(-1e3, 1e3)] * 3),
    view=st.tuples(*[st.floats(0.1, 1)] * 3),
    size=st.tuples(st.integers(8, 5000), st.integers(8, 5000)),
    d=st.floats(50, 1e5),
    shift=st.tuples(*[st.floats(-0.5, 1.5)] * 2),
)
def test_any_camera_comes_back(eye, view, size, d, shift):
    look_at = tuple(a + b for a, b in zip(eye, view, strict=True))
    centered = Pinhole(eye, look_at, (0, 0, 1), d, *size)
    (read,) = cameras.read(cameras.write([Camera("a", centered)], "textbook"))
    same(read.pinhole, centered, exact=True)
    shifted = Pinhole(eye, look_at, (0, 0, 1), d, *size, tuple(a * b for a, b in zip(shift, size, strict=True)))
    (read,) = cameras.read(cameras.write([Camera("a", shifted)], "vtk"))
    same(read.pinhole, shifted, exact=False)


def test_unreals_quaternions_go_on_from_row_to_row():
    """A pan and a dive all around: with a sign that jumps, whatever goes from one row to the next spins."""
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    eyes = [(5 * math.cos(a), 5 * math.sin(a), 3 * math.sin(2 * a)) for a in np.linspace(0, 4 * math.pi, 73)]
    written_cameras = [
        Camera(f"{number}", Pinhole(eye, (0, 0, 0.2), (0, 0, 1), 500, 640, 360)) for number, eye in enumerate(eyes)
    ]
    rows = [line.split(",") for line in cameras.write(written_cameras, "unreal").splitlines()[1:]]
    turns = np.array([[float(part) for part in row[4:8]] for row in rows])
    assert (turns[1:] * turns[:-1]).sum(axis=1).min() > 0.9
    forward = rotation.from_quat(turns).apply([1, 0, 0])
    assert np.abs(forward * [1, -1, 1] + np.array([camera.pinhole.axes()[2] for camera in written_cameras])).max() < 1e-12
    alone = cameras.write(written_cameras[:1], "unreal").splitlines()[1].split(",")
    assert float(alone[7]) >= 0
