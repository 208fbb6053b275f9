"""Cameras as text, judged by what nobody here wrote: Mitsuba itself, OpenGL's matrices by PyGLM, VTK's formulas, and those that
pbrt's and POV-Ray's sources document, as a chain of matrices. Both ways, with mirrored, shifted, stretched, upright, long and
far cameras.

Code for VTK and for textbook ray tracers: read back it is the same camera, and by those programs' own rules, too.
"""

import ast
import dataclasses
import json
import math
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon import cameras
from viewcam_addon.cameras import Camera, Options
from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole

from .conftest import CAMERAS, allowed, picture_error, points_before
from .test_judges import FLOAT32, judged, same_picture

pytestmark = pytest.mark.usefixtures("only_numbers")


SQUARE = [name for name in CAMERAS if "not_square" not in name and name != "mirrored_and_shifted"]
FORMATS = ["text", "pbrt", "mitsuba", "pov_ray", "matrices", "look_at", "three_js"]


def of(name):
    return Camera(name, CAMERAS[name])


def can_say(form, name):
    pinhole = CAMERAS[name]
    return not ((form == "look_at" and pinhole.mirrored) or (form == "mitsuba" and name not in SQUARE))


@pytest.mark.parametrize("name", CAMERAS)
@pytest.mark.parametrize("form", FORMATS)
def test_what_we_write_we_read_as_the_same_camera(name, form):
    if not can_say(form, name):
        with pytest.raises(InputError):
            cameras.write([of(name)], form)
        return
    text = cameras.write([of(name)], form)
    assert cameras.recognized(text) == form
    (camera,) = cameras.read(text)
    assert camera.size_stated
    same_picture(camera, CAMERAS[name])


@pytest.mark.parametrize("axes", ["as_is", "y_up"])
@pytest.mark.parametrize("form", FORMATS)
def test_axes_and_scale_come_back_from_every_format(form, axes):
    options = Options(axes=axes, scale=0.01)
    (camera,) = cameras.read(cameras.write([of("shifted")], form, options), options=options)
    same_picture(camera, CAMERAS["shifted"])


places = st.tuples(*[st.floats(-1e4, 1e4)] * 3)


@settings(max_examples=150, deadline=None)
@given(
    *(places, st.tuples(*[st.floats(-10, 10)] * 3), st.floats(10, 1e5), st.floats(0.5, 2), st.integers(1, 4000)),
    *(st.tuples(st.floats(-1, 2), st.floats(-1, 2)), st.booleans(), st.sampled_from(FORMATS)),
    *(st.sampled_from(["as_is", "y_up"]), st.floats(1e-3, 1e3)),
)
def test_any_camera_comes_back_from_every_format(eye, view, distance, aspect, width, point, mirrored, form, axes, scale):
    look_at = tuple(a + b for a, b in zip(eye, view, strict=True))
    if math.dist(eye, look_at) < 0.1 or math.hypot(look_at[0] - eye[0], look_at[1] - eye[1]) < 0.01:
        return  # nearly along up, numbers of four digits say little of a roll
    pinhole = Pinhole(
        eye, look_at, (0, 0, 1), (distance, distance * aspect), width, 300, (point[0] * width, point[1] * 300), mirrored
    )
    options = Options(axes=axes, scale=scale)
    try:
        text = cameras.write([Camera("a", pinhole)], form, options)
    except InputError:
        assert (form == "mitsuba" and aspect != 1) or (form == "look_at" and mirrored)
        return
    (camera,) = cameras.read(text, options=options)
    same_picture(camera, pinhole)


# ---- Mitsuba


@pytest.fixture(scope="module")
def mitsuba():
    module = pytest.importorskip("mitsuba")
    module.set_variant("scalar_rgb")
    return module


def rays_of_mitsuba(mitsuba, sensor, places):
    """Directions through places of the picture, parts of its width and height from the top left."""
    return np.array(
        [np.array(sensor.sample_ray(0, 0, mitsuba.Point2f(*place), mitsuba.Point2f(0))[0].d).ravel() for place in places]
    )


def error_of_rays(pinhole, rays, places):
    """Pixels between where rays go and where they should, in the view plane."""
    u, v, w = pinhole.basis()
    u = -u if pinhole.mirrored else u
    across, upwards, away = (rays @ axis for axis in (u, v, w))
    column = pinhole.principal_point[0] - pinhole.distance[0] * across / away
    row = pinhole.principal_point[1] - pinhole.distance[1] * upwards / away
    expected = places[:, 0] * pinhole.width, (1 - places[:, 1]) * pinhole.height
    return float(np.hypot(column - expected[0], row - expected[1]).max())


def check_rays(pinhole, rays, places):
    error = error_of_rays(pinhole, rays, places)
    # A direction is float32, and so are eye and target, whose difference it is.
    reach = max(map(abs, (*pinhole.eye, *pinhole.look_at))) / math.dist(pinhole.eye, pinhole.look_at)
    farthest = max(*pinhole.distance, *map(abs, pinhole.principal_point), pinhole.width, pinhole.height)
    limit = max(1e-3, 16 * FLOAT32 * farthest * max(1, reach))
    assert error < limit, f"{error:.3g} pixels, {limit:.3g} are allowed"
    return error


PLACES = np.random.default_rng(3).uniform(0, 1, (30, 2))


@pytest.mark.parametrize("name", [name for name in SQUARE if name not in ("far_from_origin", "off_the_picture")])
def test_mitsuba_sees_through_what_we_write_as_we_do(mitsuba, name):
    scene = mitsuba.load_string(cameras.write([of(name)], "mitsuba"))
    (sensor,) = scene.sensors()
    assert tuple(sensor.film().size()) == (CAMERAS[name].width, CAMERAS[name].height)
    check_rays(CAMERAS[name], rays_of_mitsuba(mitsuba, sensor, PLACES), PLACES)


SENSORS = {
    "nothing_said": "",
    "fov": '<float name="fov" value="33"/>',
    "fov_y": '<float name="fov" value="33"/><string name="fov_axis" value="y"/>',
    "fov_diagonal": '<float name="fov" value="63"/><string name="fov_axis" value="diagonal"/>',
    "fov_smaller": '<float name="fov" value="33"/><string name="fov_axis" value="smaller"/>',
    "fov_larger": '<float name="fov" value="33"/><string name="fov_axis" value="larger"/>',
    "focal_length": '<string name="focal_length" value="85mm"/>',
    "principal_point": '<float name="principal_point_offset_x" value="0.1"/>'
    '<float name="principal_point_offset_y" value="-0.2"/>',
}
TRANSFORMS = {
    "lookat": '<lookat origin="7, -6, 4" target="0, 0, 1" up="0, 0, 1"/>',
    "chain": '<rotate x="1" angle="30"/><translate value="1,2,3"/><rotate value="0 0 1" angle="-75"/>',
    "lookat_moved": '<lookat origin="7 -6 4" target="0 0 1" up="0 0 1"/><rotate y="1" angle="20"/><translate z="2"/>',
    "matrix": '<matrix value="0 0 1 4  1 0 0 5  0 1 0 6  0 0 0 1"/>',
    "mirror": '<scale x="-1"/><lookat origin="7, -6, 4" target="0, 0, 1" up="0, 0, 1"/>',
}
FILMS = {
    "wide": '<integer name="width" value="640"/><integer name="height" value="360"/>',
    "upright": '<integer name="width" value="300"/><integer name="height" value="500"/>',
    "crop": '<integer name="width" value="640"/><integer name="height" value="360"/><integer name="crop_offset_x" value="100"/>'
    '<integer name="crop_offset_y" value="30"/><integer name="crop_width" value="200"/>'
    '<integer name="crop_height" value="150"/>',
    "default": "",
}


@pytest.mark.parametrize("film", FILMS)
@pytest.mark.parametrize("transform", TRANSFORMS)
@pytest.mark.parametrize("sensor", SENSORS)
def test_what_mitsuba_reads_we_read_as_it_does(mitsuba, sensor, transform, film):
    text = (
        f'<scene version="3.0.0"><sensor type="perspective">{SENSORS[sensor]}<transform name="to_world">{TRANSFORMS[transform]}'
        f'</transform><film type="hdrfilm">{FILMS[film]}</film></sensor><emitter type="spot"><transform name="to_world">'
        '<lookat origin="1,1,1" target="0,0,0" up="0,1,0"/></transform></emitter></scene>'
    )
    (expected,) = mitsuba.load_string(text).sensors()
    (camera,) = cameras.read(text)
    pinhole = camera.pinhole
    assert (pinhole.width, pinhole.height) == tuple(expected.film().crop_size())
    check_rays(pinhole, rays_of_mitsuba(mitsuba, expected, PLACES), PLACES)
    assert pinhole.mirrored == (transform == "mirror")


@pytest.mark.parametrize("kind", ["thinlens", "orthographic", "radiancemeter", "distant"])
def test_what_of_mitsuba_is_no_pinhole_is_refused_by_its_name(kind):
    with pytest.raises(InputError, match=kind):
        cameras.read(f'<sensor type="{kind}"><transform name="to_world">{TRANSFORMS["lookat"]}</transform></sensor>')


def test_several_sensors_are_several_cameras():
    text = "<scene>" + "".join(
        f'<sensor type="{kind}" id="{name}"><transform name="to_world">{TRANSFORMS["lookat"]}</transform></sensor>'
        for kind, name in (("perspective", "left"), ("thinlens", "blurred"), ("perspective", "right"))
    )
    cameras_read = cameras.read(text + "</scene>", options=Options(size=(640, 480)))
    assert [camera.name for camera in cameras_read] == ["left", "right"]
    assert "blurred" in cameras_read[0].notes[-1]
    with pytest.raises(InputError, match="name one of 'left', 'right'"):
        cameras.choose(cameras_read)


@pytest.mark.parametrize(
    "text",
    [
        "mi.load_dict({'type': 'perspective', 'fov': 33, 'fov_axis': 'y', 'to_world': mi.ScalarTransform4f().look_at("
        "origin=[7, -6, 4], target=[0, 0, 1], up=[0, 0, 1]), "
        "'film': {'type': 'hdrfilm', 'width': 640, 'height': 360}})",
        "mi.load_dict({'type': 'perspective', 'fov': 33, "
        "'to_world': mi.ScalarTransform4f().translate([1, 2, 3])"
        ".rotate([0, 1, 0], 40) @ mi.ScalarTransform4f().look_at([7, -6, 4], [0, 0, 1], [0, 0, 1]), "
        "'film': {'type': 'hdrfilm', 'width': 64, 'height': 80}})",
        "mi.load_dict({'type': 'perspective', 'principal_point_offset_x': 0.1, "
        "'film': {'type': 'hdrfilm', 'width': 64, 'height': 80}, "
        "'to_world': mi.ScalarTransform4f([[0, 0, 1, 4], [1, 0, 0, 5], [0, 1, 0, 6], [0, 0, 0, 1]])})",
    ],
)
def test_what_mitsuba_reads_as_a_dictionary_we_read_as_it_does(mitsuba, text):
    expected = eval(text, {"mi": mitsuba})
    (camera,) = cameras.read(text)
    assert (camera.pinhole.width, camera.pinhole.height) == tuple(expected.film().size())
    check_rays(camera.pinhole, rays_of_mitsuba(mitsuba, expected, PLACES), PLACES)


# ---- pbrt: its source's formulas, each matrix as it stands there


def translated(x, y, z):
    return np.array([[1, 0, 0, x], [0, 1, 0, y], [0, 0, 1, z], [0, 0, 0, 1]], float)


def pbrt_look_at(e, l, up):
    """Transform LookAt of util/transform.cpp: world from camera, inverted."""
    forward = (l - e) / np.linalg.norm(l - e)
    right = np.cross(up / np.linalg.norm(up), forward)
    right /= np.linalg.norm(right)
    world_from_camera = np.eye(4)
    world_from_camera[:3, 0], world_from_camera[:3, 1] = right, np.cross(forward, right)
    world_from_camera[:3, 2], world_from_camera[:3, 3] = forward, e
    return np.linalg.inv(world_from_camera)


def pbrt_raster(camera_from_world, points, size, fov, window=None, aspect=None):
    """(column, row from the top) by cameras.cpp: screen from camera, NDC from screen, raster from NDC."""
    width, height = size
    a = aspect or width / height
    x0, x1, y0, y1 = window or ((-a, a, -1, 1) if a > 1 else (-1, 1, -1 / a, 1 / a))
    near, far = 1e-2, 1000.0
    perspective = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, far / (far - near), -far * near / (far - near)], [0, 0, 1, 0]])
    scale = 1 / math.tan(math.radians(fov) / 2)
    screen_from_camera = np.diag([scale, scale, 1, 1]) @ perspective
    ndc_from_screen = np.diag([1 / (x1 - x0), 1 / (y1 - y0), 1, 1]) @ translated(-x0, -y1, 0)
    raster_from_ndc = np.diag([width, -height, 1, 1])
    chain = raster_from_ndc @ ndc_from_screen @ screen_from_camera @ camera_from_world
    clip = np.c_[points, np.ones(len(points))] @ chain.T
    return clip[:, 0] / clip[:, 3], clip[:, 1] / clip[:, 3]


@pytest.mark.parametrize("name", [name for name in CAMERAS if name != "straight_down"])
def test_by_pbrts_formulas_what_we_write_is_the_same_picture(name):
    pinhole = CAMERAS[name]
    text = cameras.write([of(name)], "pbrt")
    window = [float(x) for x in text.split('screenwindow" [')[1].split("]")[0].split()]
    numbers = [float(x) for x in text.split("LookAt")[1].split("\n")[0].split()]
    matrix = pbrt_look_at(*(np.array(numbers[i : i + 3]) for i in (0, 3, 6)))
    if "Scale -1 1 1" in text:
        matrix = np.diag([-1, 1, 1, 1]) @ matrix
    points = points_before(pinhole)
    column, row = pbrt_raster(matrix, points, (pinhole.width, pinhole.height), 90, window)
    judged(pinhole, column, row, points)


SCENES = {
    "plain": ("LookAt 7 -6 4 0 0 1 0 0 1", lambda look: look, {}),
    "mirrored_back": ("Scale -1 1 1 LookAt 7 -6 4 0 0 1 0 0 1", lambda look: np.diag([-1, 1, 1, 1]) @ look, {}),
    "moved_world": ("LookAt 7 -6 4 0 0 1 0 0 1 Translate 1 2 3", lambda look: look @ translated(1, 2, 3), {}),
    "scaled": ("Scale 1 2 3 LookAt 7 -6 4 0 0 1 0 0 1", lambda look: np.diag([1, 2, 3, 1]) @ look, {}),
    "turned": (
        "Rotate 90 0 0 1 LookAt 7 -6 4 0 0 1 0 0 1",
        lambda look: np.array([[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]) @ look,
        {},
    ),
    "transform": (
        "Transform [ 0 1 0 0  0 0 1 0  1 0 0 0  .5 -.25 9 1 ]",
        lambda look: np.array([[0, 0, 1, 0.5], [1, 0, 0, -0.25], [0, 1, 0, 9], [0, 0, 0, 1]]),
        {},
    ),
    "window": ("LookAt 7 -6 4 0 0 1 0 0 1", lambda look: look, {"window": [-0.5, 0.7, -0.3, 0.2]}),
    "aspect": ("LookAt 7 -6 4 0 0 1 0 0 1", lambda look: look, {"aspect": 2.0}),
}


@pytest.mark.parametrize("size", [(640, 360), (300, 500)])
@pytest.mark.parametrize("name", SCENES)
def test_pbrts_transforms_and_windows_are_read_as_its_formulas_have_them(name, size):
    statements, chain, more = SCENES[name]
    extra = f'"float screenwindow" [{" ".join(map(str, more["window"]))}]' if "window" in more else ""
    extra += '"float frameaspectratio" 2' if "aspect" in more else ""
    film = f'Film "rgb" "integer xresolution" [{size[0]}] "integer yresolution" {size[1]} "string filename" "a.exr"'
    text = f'{film}\n{statements} # here\nCamera "perspective" "float fov" [40] {extra}\nWorldBegin\nTranslate 9 9 9'
    matrix = chain(pbrt_look_at(np.array([7.0, -6, 4]), np.array([0.0, 0, 1]), np.array([0.0, 0, 1])))
    (camera,) = cameras.read(text)
    points = points_before(camera.pinhole)
    column, row = pbrt_raster(matrix, points, size, 40, **more)
    judged(camera.pinhole, column, row, points)
    assert camera.pinhole.mirrored == (name != "mirrored_back") == any("mirrored" in note for note in camera.notes)


def test_of_several_cameras_pbrt_uses_the_last_and_a_note_says_so():
    text = 'LookAt 1 0 0 0 0 0 0 0 1 Camera "perspective" Identity LookAt 2 0 0 0 0 0 0 0 1 Camera "perspective" "float fov" 40'
    (camera,) = cameras.read(text)
    assert camera.pinhole.eye == (2, 0, 0) and any("2 Cameras" in note for note in camera.notes)
    assert not any("Cameras" in note for note in cameras.read(text.partition("Identity")[2])[0].notes)


def test_pbrts_crop_window_keeps_whole_pixels_and_moves_nothing():
    text = 'LookAt 7 -6 4 0 0 1 0 0 1 Camera "perspective" Film "rgb" "integer xresolution" 641 "integer yresolution" 359'
    whole, part = (cameras.read(f"{text} {more}")[0].pinhole for more in ("", '"float cropwindow" [.1 .5 .25 .75]'))
    # ceil(64.1), ceil(320.5), ceil(89.75), ceil(269.25), from the top left
    assert (part.width, part.height) == (321 - 65, 270 - 90)
    points = points_before(whole)
    for shift, a, b in zip((65, 359 - 270), whole.project(points), part.project(points), strict=False):
        assert a - shift == pytest.approx(b, abs=1e-9)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ('LookAt 1 2 3 4 5 6 7 8 9 Camera "orthographic"', "orthographic, which is no pinhole"),
        ('LookAt 1 2 3 4 5 6 7 8 9 Camera "realistic" "string lensfile" "a.dat"', "of a real lens"),
        ('LookAt 1 2 3 4 5 6 7 8 9 Camera "perspective" "float lensradius" 0.1', "this lens blurs"),
        ("LookAt 1 2 3 4 5 6 7 8", "9 finite numbers"),
        ('ActiveTransform StartTime LookAt 1 2 3 4 5 6 7 8 9 Camera "perspective"', "moves while the shutter"),
        ('Include "camera.pbrt" LookAt 1 2 3 4 5 6 7 8 9 Camera "perspective"', "other files"),
        ('LookAt 1 2 3 1 2 4 0 0 1 Camera "perspective"', "along its up"),
        ('CoordSysTransform "camera" Camera "perspective"', "name a CoordinateSystem"),
        ('Rotate 30 1 1 0 Scale 1 1 3 Rotate 40 1 2 3 LookAt 1 2 3 4 5 6 7 8 9 Camera "perspective"', "sheared"),
        ('LookAt 1 2 3 4 5 6 7 8 9 Camera "perspective" "float fov" 190', "between 0 and 180"),
    ],
)
def test_what_of_pbrt_is_no_pinhole_or_unsaid_is_refused(text, sentence):
    with pytest.raises(InputError, match=sentence):
        cameras.read(text, options=Options(size=(640, 480)))


@pytest.mark.parametrize(
    "text",
    [
        "ActiveTransform StartTime LookAt 1 2 3 0 0 0 0 0 1 ActiveTransform EndTime LookAt 1 2 3 0 0 0 0 0 1",
        "Scale -1 1 1 ActiveTransform EndTime Translate 1 0 0 ActiveTransform All Identity LookAt 1 2 3 0 0 0 0 0 1",
        "AttributeBegin ActiveTransform EndTime Translate 1 0 0 AttributeEnd LookAt 1 2 3 0 0 0 0 0 1",
    ],
)
def test_a_camera_of_pbrt_that_stands_still_may_be_said_at_both_times(text):
    still = 'LookAt 1 2 3 0 0 0 0 0 1 Camera "perspective"'
    options = Options(size=(640, 480))
    assert (
        cameras.read(f'{text} Camera "perspective"', options=options)[0].pinhole
        == cameras.read(still, options=options)[0].pinhole
    )
    with pytest.raises(InputError, match="moves while the shutter"):
        cameras.read(f'{text} ActiveTransform StartTime Translate 1 0 0 Camera "perspective"', options=options)


# ---- POV-Ray: the documented ray through each place of the picture


def pov_rays(location, right, up, direction, places):
    x, y = places[:, :1], places[:, 1:]
    return direction + (x - 0.5) * right + (0.5 - y) * up


def pov_vectors(text):
    return {
        line.split("<")[0].strip(): np.array([float(x) for x in line.split("<")[1].split(">")[0].split(",")])
        for line in text.splitlines()
        if "<" in line
    }


@pytest.mark.parametrize("name", CAMERAS)
def test_by_pov_rays_formula_what_we_write_is_the_same_picture(name):
    vectors = pov_vectors(cameras.write([of(name)], "pov_ray"))
    if "look_at" in vectors:
        ahead = vectors["look_at"] - vectors["location"]
        ahead /= np.linalg.norm(ahead)
        right = np.cross(vectors["sky"], ahead)
        right /= np.linalg.norm(right)
        handed = math.copysign(1, np.cross(vectors["up"], vectors["direction"]) @ vectors["right"])
        vectors["up"] = np.cross(ahead, right) * np.linalg.norm(vectors["up"])
        vectors["right"] = handed * right * np.linalg.norm(vectors["right"])
        vectors["direction"] = ahead * np.linalg.norm(vectors["direction"])
    rays = pov_rays(*(vectors[key] for key in ("location", "right", "up", "direction")), PLACES)
    pinhole = CAMERAS[name]
    # The look-at point's rounding remains where the eye is far away: 2⁻⁵³ of it, across the distance to it.
    reach = max(map(abs, pinhole.look_at)) / math.dist(pinhole.eye, pinhole.look_at)
    assert error_of_rays(pinhole, rays, PLACES) < 1e-3 + 16 * 2.0**-53 * max(pinhole.distance) * reach


@pytest.mark.parametrize(
    ("text", "right", "up", "direction", "mirrored"),
    [
        ("location <1,2,3> right 16/9*x direction 2*z", (16 / 9, 0, 0), (0, 1, 0), (0, 0, 2), True),
        ("right -x*4/3 up y direction <0,0,1.5> location 3 rotate 90*y", (0, 0, 4 / 3), (0, 1, 0), (1.5, 0, 0), False),
        (
            "up <0,0,1> right <1.5,0,0> direction <0,1,0> angle 60",
            (1.5, 0, 0),
            (0, 0, 1),
            (0, 0.75 / math.tan(math.pi / 6), 0),
            False,
        ),
        ("direction <0,-.5,2> right 1.5*x scale <2,2,2> translate <1,0,0>", (3, 0, 0), (0, 2, 0), (0, -1, 4), True),
        ("matrix <0,1,0, 0,0,1, 1,0,0, 5,6,7> right x", (0, 1, 0), (0, 0, 1), (1, 0, 0), True),
    ],
)
def test_pov_rays_vectors_are_read_as_its_formula_has_them(text, right, up, direction, mirrored):
    text = f"// +W600 +H400\n#version 3.7;\ncamera {{ {text} }}"
    (camera,) = cameras.read(text)
    rays = pov_rays(None, *map(np.array, (right, up, direction)), PLACES)
    assert error_of_rays(camera.pinhole, rays, PLACES) < 1e-9
    assert camera.pinhole.mirrored == mirrored


@pytest.mark.parametrize("size", [(320, 240), (640, 480), (1920, 1080), (480, 640)])
@pytest.mark.parametrize("pose", ["", "sky z location <7,-6,4> look_at <0,0,1>", "sky z look_at y rotate 30*z"])
def test_a_size_that_is_given_is_pov_rays_and_its_pixels_are_what_right_and_up_make_of_it(size, pose):
    """`povray +W320 +H240` of right 1.33 shoots its rays through 320 columns of 1.33, though 319.2 of them would be square."""
    text = f"camera {{ right <-1.33,0,0> up y direction z {pose} }}"
    (camera,) = cameras.read(text, options=Options(size=size))
    assert (camera.pinhole.width, camera.pinhole.height) == size
    assert camera.pinhole.distance == pytest.approx((size[0] / 1.33, size[1]), rel=1e-12)
    assert camera.pinhole.principal_point == pytest.approx((size[0] / 2, size[1] / 2), abs=1e-9)
    (commented,) = cameras.read(f"// +W{size[0]} +H{size[1]}\n{text}")
    assert commented.pinhole == camera.pinhole


@pytest.mark.parametrize(
    ("text", "size", "mirrored"),
    [
        ("camera { location <7, -6, 4> look_at <0, 0, 1> sky <0, 0, 1> angle 40 }", (479, 360), True),
        (
            "camera{perspective sky z right -x*image_width/image_height // right\n location<7,-6,4> look_at<0,0,1>angle 40}",
            (640, 360),
            False,
        ),
        (
            "#declare C = camera { /* angle 30 */ angle 40 up y right <-1.33,0,0> sky z location <7,-6,4> look_at <0,0,1> };",
            (479, 360),
            False,
        ),
        (
            "camera { location 0 } #declare E = <7,-6,4>; camera { angle 40 sky z right -x*2 look_at z location E up y }",
            (720, 360),
            False,
        ),
        ("#declare A = 20; camera { sky z location 7*x-6*y+4*z look_at <0,0,5-4> angle 2*A }", (479, 360), True),
    ],
)
def test_pov_ray_turns_its_camera_by_the_sky(text, size, mirrored):
    (camera,) = cameras.read(text, options=Options(size=(640, 360), size_fits=True))
    pinhole = camera.pinhole
    assert (pinhole.eye, pinhole.look_at, pinhole.up) == ((7, -6, 4), (0, 0, 1), (0, 0, 1))
    assert (pinhole.width, pinhole.height) == size and pinhole.mirrored == mirrored
    aspect = {479: 1.33, 640: 640 / 360, 720: 2}[size[0]]
    assert pinhole.distance == pytest.approx((360 * aspect / 2 / math.tan(math.radians(20)),) * 2, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("camera { location <1, 2, 3>", "close it with"),
        ("camera { location Home }", "at 'Home"),
        ("camera { Home location <1, 2, 3> }", "at 'Home location"),
        ("camera { orthographic location <1, 2, 3> }", "orthographic, which is no pinhole"),
        ("camera { ultra_wide_angle location <1, 2, 3> }", "ultra_wide_angle"),
        ("camera { location <1, 2, clock> }", "plain numbers for location"),
        ("camera { location <1, 2, 3> look_at 0 aperture 0.4 }", "aperture blurs"),
        ("#if (on) camera { location <1, 2, 3> } #end", "under #if"),
        (
            "#declare A = camera { location 1 } #declare B = camera { location 2 }",
            "2 cameras and none is in use: keep one of A, B",
        ),
        ("#version 3.1; camera { location <1, 2, 3> look_at 0 }", "before version 3.5"),
        (
            "camera { location <1, 2, 3> right <1, .5, 0> up y direction z rotate x translate y scale <1,2,3> }",
            "sheared",
        ),
    ],
)
def test_what_of_pov_ray_is_no_pinhole_or_unsaid_is_refused(text, sentence):
    with pytest.raises(InputError, match=sentence):
        cameras.read(text, options=Options(size=(640, 480)))


# ---- look-at and matrices


def glm_places(glm, view, projection, size, points):
    """(column, row from the top) in the window of OpenGL's clip space."""
    chain = np.array(projection.to_list()).T @ np.array(view.to_list()).T
    clip = np.c_[points, np.ones(len(points))] @ chain.T
    return (clip[:, 0] / clip[:, 3] + 1) / 2 * size[0], (1 - clip[:, 1] / clip[:, 3]) / 2 * size[1]


@pytest.mark.parametrize("name", CAMERAS)
def test_glm_sees_through_the_matrices_that_we_write_as_we_do(name):
    glm = pytest.importorskip("glm")
    pinhole = CAMERAS[name]
    result = {}
    exec(cameras.write([of(name)], "matrices"), {"np": np}, result)
    view, projection = (glm.dmat4(*result[key].T.ravel().tolist()) for key in ("view", "projection"))
    points = points_before(pinhole)
    judged(pinhole, *glm_places(glm, view, projection, result["size"], points), points)


@pytest.mark.parametrize("hand", ["RH", "LH"])
@pytest.mark.parametrize("order", ["rows", "columns"])
@pytest.mark.parametrize("zero", ["NO", "ZO"])
def test_glms_matrices_of_either_hand_order_and_depth_are_read_as_glm_sees(hand, order, zero):
    glm = pytest.importorskip("glm")
    view = getattr(glm, f"lookAt{hand}")(glm.dvec3(7, -6, 4), glm.dvec3(0, 0, 1), glm.dvec3(0, 0, 1))
    projection = getattr(glm, f"perspective{hand}_{zero}")(0.7, 16 / 9, 0.1, 100.0)
    rows = [np.array(matrix.to_list()) for matrix in (view, projection)]  # glm's lists are columns
    rows = rows if order == "columns" else [matrix.T for matrix in rows]
    text = f"view matrix:\n{rows[0]}\nprojection = {rows[1].tolist()}\nsize: 640x360"
    (camera,) = cameras.read(text)
    points = points_before(camera.pinhole)
    column, row = glm_places(glm, view, projection, (640, 360), points)
    # Printed with eight digits of numbers up to 10.
    assert np.hypot(*(np.array(camera.pinhole.project(points)[:2]) - [column, 360 - row])).max() < 1e-3
    assert camera.pinhole.mirrored == (hand == "LH")


GL = Options(size=(640, 360))
CODE = {
    "gluLookAt": "gluPerspective(40, 640.0/360.0, .1, 100);\ngluLookAt(7,-6,4, 0,0,1, 0,0,1);",
    "glm": "auto view = glm::lookAt(glm::vec3(7,-6,4), glm::vec3(0,0,1), glm::vec3(0,0,1));"
    "auto p = glm::perspective(glm::radians(40.0f), 16.f/9.f, .1f, 100.f);",
    "glm_variables": "glm::vec3 cameraPos = glm::vec3(7.f, -6, 4);\nglm::vec3 cameraFront(-7, 6, -3), up;\n"
    "glm::vec3 cameraUp{0, 0, 1};"
    "view = glm::lookAt(cameraPos, cameraPos + cameraFront, cameraUp);"
    "p = glm::perspective(40 * M_PI / 180, (float)width / (float)height, 0.1f, 100.f);",
    "three.js": "const camera = new THREE.PerspectiveCamera(40, window.innerWidth / window.innerHeight, 0.1, 1000);\n"
    "light.position.set(5, 5, 5); // camera.position.set(9, 9, 9)\n"
    "camera.up.set(0, 0, 1); camera.position.set(7, -6, 4); camera.lookAt(new THREE.Vector3(0, 0, 1));",
    "vtk": "camera.SetPosition(7, -6, 4)\ncamera.SetFocalPoint(0, 0, 1)\ncamera.SetViewUp(0, 0, 1)\ncamera.SetViewAngle(40)",
    "pyvista": "plotter.camera_position = [(7, -6, 4), (0, 0, 1), (0, 0, 1)]\nplotter.camera.view_angle = 40",
    "paraview": "renderView1.ViewSize = [640, 360]\nrenderView1.CameraPosition = [7, -6, 4]\n"
    "renderView1.CameraFocalPoint = [0, 0, 1]\nrenderView1.CameraViewUp = [0, 0, 1]\nrenderView1.CameraViewAngle = 40",
    "weekend": "point3 lookfrom(7, -6, 4); point3 lookat(0, 0, 1); vec3 vup(0, 0, 1); auto vfov = 40;"
    "auto aspect_ratio = 16.0 / 9.0; int image_width = 640; auto aperture = 0.0;\n"
    "camera cam(lookfrom, lookat, vup, vfov, aspect_ratio, aperture, 10.0);",
    "weekend_4": "cam.vfov = 40; cam.lookfrom = point3(7, -6, 4); cam.lookat = point3(0, 0, 1); cam.vup = vec3(0, 0, 1);"
    "cam.aspect_ratio = 16.0 / 9.0; cam.image_width = 640; cam.defocus_angle = 0;",
    "gl-matrix": "mat4.lookAt(view, [7, -6, 4], [0, 0, 1], [0, 0, 1]);"
    "mat4.perspective(p, 40 * Math.PI / 180, c.width / c.height, 0.1, 9);",
    "cesium": "camera.position = new Cesium.Cartesian3(7, -6, 4); camera.direction = new Cesium.Cartesian3(-7, 6, -3);"
    f"camera.up = new Cesium.Cartesian3(0, 0, 1); camera.frustum.fov = {2 * math.atan(math.tan(math.radians(20)) * 16 / 9)!r};",
    "textbook": "Pinhole* pinhole_ptr = new Pinhole; pinhole_ptr->set_eye(7, -6, 4); pinhole_ptr->set_lookat(0, 0, 1);"
    f"pinhole_ptr->set_up_vector(0, 0, 1); pinhole_ptr->set_view_distance({180 / math.tan(math.radians(20)) / 3!r});"
    "pinhole_ptr->set_zoom(1.5); vp.set_hres(640); vp.set_vres(360); vp.set_pixel_size(0.5); pinhole_ptr->compute_uvw();",
}


VTK_WITHOUT_AN_ANGLE = "camera.SetPosition(7, -6, 4); camera.SetFocalPoint(0, 0, 1); camera.SetViewUp(0, 0, 1)"


@pytest.mark.parametrize(
    "text",
    [
        "mlab.view(azimuth=45, elevation=60, distance=10, focalpoint=(0, 0, 0))",
        "ctr.set_front([0.5, -0.2, 0.8]); ctr.set_lookat([0, 0, 0]); ctr.set_up([0, 0, 1])",
        "camera.location = (7.4, -6.9, 5.0); camera.data.lens = 50",
    ],
)
def test_code_that_says_no_eye_or_target_is_not_completed_by_another_camera(text):
    with pytest.raises(InputError, match=r"does not say the camera's (position|target)"):
        cameras.read(text, options=Options(base=CAMERAS["plain"]))


def test_code_may_spell_its_target_as_british_people_do():
    text = "camera.position = (7, -6, 4); camera.{} = (0, 0, 1); camera.up = (0, 0, 1); camera.vfov = 40;"
    american, british = (cameras.read(text.format(name), options=GL)[0] for name in ("center", "centre"))
    assert american.pinhole.look_at == british.pinhole.look_at == (0, 0, 1)


def test_what_of_code_is_another_cameras_is_said():
    text = "gluLookAt(7, -6, 4, 0, 0, 1, 0, 0, 1);"
    (camera,) = cameras.read(text, options=Options(base=CAMERAS["pixels_not_square"]))
    assert camera.pinhole == CAMERAS["pixels_not_square"] and "how the camera sees" in camera.notes[0]
    (camera,) = cameras.read("lookfrom = vec3(7, -6, 4); lookat = vec3(0, 0, 1);", options=Options(base=CAMERAS["rolled"]))
    assert camera.pinhole.up == CAMERAS["rolled"].up and "which way is up" in camera.notes[0]


@pytest.mark.parametrize(
    "text",
    [
        VTK_WITHOUT_AN_ANGLE,
        "plotter.camera_position = [(7, -6, 4), (0, 0, 1), (0, 0, 1)]",
        "view.CameraPosition = [7, -6, 4]\nview.CameraFocalPoint = [0, 0, 1]\nview.CameraViewUp = [0, 0, 1]",
    ],
)
def test_vtks_own_angle_counts_where_its_code_says_none_whatever_camera_was_there(text):
    (camera,) = cameras.read(text, options=Options(size=(640, 360), base=CAMERAS["portrait"]))
    assert camera.pinhole.distance[1] == pytest.approx(180 / math.tan(math.radians(15))) and "30°" in camera.notes[0]


@pytest.mark.parametrize(
    ("part", "size"),
    [
        ((1920, 0, 640, 360), (640, 360)),
        ((0, 360, 640, 360), (1280, 720)),
        ((-100, 50.5, 700, 300), (350, 300)),
        ((0, 0, 5760, 2160), (5760, 2160)),
    ],
)
def test_three_js_view_offset_shows_a_part_of_the_full_picture(part, size):
    """A point's place in the part is that in the full picture less the part's place. It was ignored."""
    text = "camera = new THREE.PerspectiveCamera(40, {}); camera.position.set(7, -6, 4); camera.lookAt(0, 0, 1);"
    full_width, full_height = 5760, 2160  # three by two screens, as in three.js' documentation
    (full,) = cameras.read(text.format("5760 / 2160"), options=Options(size=(full_width, full_height)))
    offset = f"const w = {full_width}; camera.setViewOffset(w, {full_height}, {', '.join(map(str, part))});"
    renderer = f"renderer.setSize({size[0]}, {size[1]});"
    (camera,) = cameras.read(text.format(1.5) + offset + renderer, options=GL)
    assert (camera.pinhole.width, camera.pinhole.height) == size
    points = np.random.default_rng(5).normal(size=(100, 3))
    column, row, _ = full.pinhole.project(points)
    actual = camera.pinhole.project(points)
    x, y, width, height = part
    assert actual[0] == pytest.approx((column - x) * size[0] / width, abs=1e-9 * full_width)
    assert size[1] - actual[1] == pytest.approx((full_height - row - y) * size[1] / height, abs=1e-9 * full_width)


def test_three_js_view_offset_says_the_size_and_may_be_cleared():
    text = CODE["three.js"] + "camera.setViewOffset(1920, 1080, 640, 0, 640, 540);"
    (camera,) = cameras.read(text, options=Options(size=(300, 200)))
    assert (camera.pinhole.width, camera.pinhole.height) == (640, 540) and camera.size_stated
    assert camera.pinhole.principal_point == (320, 0)  # the full picture's middle, from the part's lower left corner
    (cleared,) = cameras.read(text + "camera.clearViewOffset();", options=GL)
    assert cleared.pinhole == cameras.read(CODE["three.js"], options=GL)[0].pinhole


@pytest.mark.parametrize(
    ("more", "problem"),
    [
        ("camera.setViewOffset(innerWidth * 3, 1080, 0, 0, 640, 540);", "give six plain numbers"),
        ("camera.setViewOffset(1920, 1080, 0, 0);", "give six plain numbers"),
        ("camera.setViewOffset(1920, 1080, 0, 0, 0, 540);", "an empty part"),
        ("camera.setViewOffset(1920, 1080, 0, 0, 1e999, 540);", "number|empty part"),
        ("camera.setViewOffset(6, 4, 0, 0, 3, 2); camera.setViewOffset(6, 4, 3, 0, 3, 2);", "something else in line"),
        ("camera.setViewOffset(1920, 1080, 0, 0, 640, 540); camera.aspect = 2;", "another aspect"),
        ("camera.setFocalLength(50);", "by other means"),
    ],
)
def test_a_view_offset_that_can_not_be_told_is_refused(more, problem):
    with pytest.raises(InputError, match=problem):
        cameras.read(CODE["three.js"] + more, options=GL)


@pytest.mark.parametrize("point", ["0, 0, 1", "new THREE.Vector3(0, 0, 1)", "[0, 0, 1]"])
def test_potrees_view_has_its_up_along_z(point):
    """It was three.js' y."""
    text = "window.viewer = new Potree.Viewer(area); viewer.setFOV(40);\nviewer.scene.view.position.set(7, -6, 4);\n"
    (camera,) = cameras.read(text + f"viewer.scene.view.lookAt({point});", options=GL)
    expected = cameras.read(CODE["three.js"], options=GL)[0].pinhole
    assert (camera.pinhole.eye, camera.pinhole.look_at, camera.pinhole.up) == ((7, -6, 4), (0, 0, 1), (0, 0, 1))
    assert camera.pinhole.distance == pytest.approx(expected.distance)


@pytest.mark.parametrize(
    "arguments", ["[7, -6, 4], [0, 0, 1]", "new THREE.Vector3(7, -6, 4), new THREE.Vector3(0, 0, 1), 500, () => done(3, 4)"]
)
def test_potrees_view_is_set_by_position_and_target(arguments):
    text = f"viewer.setFOV(40);\nviewer.scene.view.setView({arguments});\n"
    (camera,) = cameras.read(text, options=GL)
    assert (camera.pinhole.eye, camera.pinhole.look_at, camera.pinhole.up) == ((7, -6, 4), (0, 0, 1), (0, 0, 1))
    assert camera.pinhole.distance == pytest.approx(cameras.read(CODE["three.js"], options=GL)[0].pinhole.distance)
    with pytest.raises(InputError, match="give position and target as plain numbers"):
        cameras.read(text.replace("7, -6", "x, -6"), options=GL)


def test_three_js_turns_by_the_up_that_all_objects_have():
    text = "camera = new THREE.PerspectiveCamera(40, 2); camera.position.set(1, 2, 3); camera.lookAt(0, 0, 0);"
    (camera,) = cameras.read(f"THREE.Object3D.DEFAULT_UP.set(0, 0, 1); {text}", options=GL)
    assert camera.pinhole.up == (0, 0, 1) and cameras.read(text, options=GL)[0].pinhole.up == (0, 1, 0)


@pytest.mark.parametrize("name", CODE)
def test_code_that_looks_at_a_point_is_read_as_the_matrices_of_glm(name):
    glm = pytest.importorskip("glm")
    view = glm.lookAt(glm.dvec3(7, -6, 4), glm.dvec3(0, 0, 1), glm.dvec3(0, 0, 1))
    projection = glm.perspective(math.radians(40), 16 / 9, 0.1, 100.0)
    (camera,) = cameras.read(CODE[name], options=GL)
    points = points_before(camera.pinhole)
    column, row = glm_places(glm, view, projection, (640, 360), points)
    judged(camera.pinhole, column, row, points, FLOAT32)
    assert (camera.pinhole.eye, camera.pinhole.up) == ((7, -6, 4), (0, 0, 1)) and camera.notes == ()


@pytest.mark.parametrize("name", [name for name in CAMERAS if not CAMERAS[name].mirrored and name != "straight_down"])
def test_glm_sees_through_the_frustum_that_we_write_as_we_do(name):
    glm = pytest.importorskip("glm")
    pinhole = CAMERAS[name]
    text = cameras.write([of(name)], "look_at")
    frustum, look = ([float(x) for x in text.split(call)[1].split(")")[0].split(",")] for call in ("glFrustum(", "gluLookAt("))
    view = glm.lookAt(*(glm.dvec3(*look[i : i + 3]) for i in (0, 3, 6)))
    points = points_before(pinhole)
    size = (pinhole.width, pinhole.height)
    judged(pinhole, *glm_places(glm, view, glm.frustum(*frustum), size, points), points, FLOAT32)


def test_vtks_window_center_and_horizontal_angle_are_its_formulas():
    """vtkCamera::ComputeProjectionTransform: xmin = (center − 1) · w, of a w that the angle gives."""
    text = CODE["vtk"] + "\ncamera.SetWindowCenter(0.1, -0.2)\n"
    centered = cameras.read(text, options=GL)[0].pinhole
    half = math.tan(math.radians(20)) * 16 / 9
    left, right = (0.1 - 1) * half, (0.1 + 1) * half
    assert centered.principal_point[0] == pytest.approx(-left / (right - left) * 640)
    assert centered.principal_point[1] == pytest.approx((1 + 0.2) / 2 * 360)
    across = cameras.read(text + "camera.SetUseHorizontalViewAngle(1)", options=GL)[0].pinhole
    assert across.distance[0] == pytest.approx(320 / math.tan(math.radians(20)))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (CODE["vtk"] + "\ncamera.SetParallelProjection(1)", "parallel projection"),
        (CODE["vtk"] + "\ncamera.Zoom(1.5)", "zoom"),
        (CODE["vtk"] + "\ncamera.Azimuth(30)", "by other means"),
        (CODE["vtk"] + "\nrenderer.ResetCamera()", "moves the camera until all is seen"),
        (VTK_WITHOUT_AN_ANGLE + "\ncamera.ParallelProjectionOn()", "orthographic"),
        (VTK_WITHOUT_AN_ANGLE + "\ncamera.Zoom(1.5)", "zoom"),
        (CODE["three.js"] + "rig.add(camera);", "the camera is part of this"),
        (CODE["three.js"] + "camera.up.set(0, 0, 1);", "changes after it was turned"),
        (CODE["three.js"] + "camera.position.x = Math.sin(time);", "computed from what the text does not say"),
        (CODE["three.js"] + "camera.position.x = 3; camera.position.x = 4;", "this is 3 elsewhere"),
        (CODE["weekend_4"] + "cam.lookfrom = orbit(frame);", "eye in plain"),
        (CODE["glm"] + "view = glm::rotate(view, 0.5f, glm::vec3(0, 1, 0));", "moves the view by other means"),
        (
            CODE["glm"].replace("glm::lookAt(", "glm::rotate(one, 0.5f, glm::vec3(0, 1, 0)) * glm::lookAt("),
            "more turns or moves",
        ),
        (CODE["glm"].replace("glm::lookAt(", "glm::translate(glm::lookAt("), "more turns or moves"),
        ("glm::lookAt(eye(1,2,3), at(0,0,0), up(0,1,0))*glm::rotate(one, 1.f, up); glm::perspective(1.f, 1.f)", "more turns"),
        (
            "glTranslatef(0, 0, -3); gluLookAt(1,2,3, 0,0,0, 0,1,0); gluPerspective(40, 1, 1, 9)",
            "moves the view by other means",
        ),
        (CODE["three.js"] + "camera.rotation.x = 1;", "by other means"),
        (CODE["three.js"] + "camera.scale.x = -1;", "by other means"),
        (CODE["three.js"] + "camera.scale.set(1, 2, 1);", "by other means"),
        (CODE["three.js"] + "camera.position.applyAxisAngle(axis, 2);", "by other means"),
        (CODE["three.js"] + "camera.position.z += 2;", "moves the camera"),
        (CODE["weekend_4"] + "cam.lookfrom = point3(1, 2, 3);", "something else in line"),
        (CODE["weekend_4"].replace("defocus_angle = 0;", "defocus_angle = 0.6;"), "blurs"),
        (CODE["textbook"] + "pinhole_ptr->set_roll_angle(30);", "roll"),
        ("ThinLens* p = new ThinLens; p->set_eye(1,2,3); p->set_lookat(0,0,0); p->set_view_distance(9);", "ThinLens"),
        ("camera = new THREE.OrthographicCamera(-1,1,1,-1); camera.position.set(1,2,3); camera.lookAt(0,0,0)", "orthographic"),
        ("gluLookAt(eyeX, eyeY, eyeZ, 0,0,0, 0,1,0); gluPerspective(40, 1, 1, 9)", "plain numbers"),
        ("vec3 lookfrom = random_point(); vec3 lookat(0,0,0); vec3 vup(0,1,0); vfov = 40;", "lookfrom = random|eye in plain"),
        ("lookfrom = vec3(1,2,3); lookat = vec3(0,0,0); vup = vec3(0,1,0); vfov = 0.7", "degrees or radians"),
        ("view = [1 0 0 0 0 0 1 0 0 -1 0 0 0 0 0 1]", "rows or its columns"),
        ("view = [1 0 0 0 0 1 0 0 0 0 1 0 0 0 5 1] projection = [1 0 0 0 0 1 0 0 0 0 -1 0 0 0 0 1]", "orthographic"),
    ],
)
def test_what_code_moves_hides_or_leaves_open_is_refused(text, sentence):
    with pytest.raises(InputError, match=sentence):
        cameras.read(text, options=GL)


def test_what_other_things_look_at_is_no_cameras():
    text = "const view1 = new THREE.PerspectiveCamera(50, 16 / 9); view1.position.set(1, 2, 3); mesh.lookAt(0, 0, 9);"
    (camera,) = cameras.read(text, options=GL)
    assert (camera.pinhole.eye, camera.pinhole.look_at) == ((1, 2, 3), (1, 2, 2))
    (named,) = cameras.read(
        text.replace("view1", "this.instance").replace("mesh", "this.instance").replace("const ", ""), options=GL
    )
    assert (named.pinhole.eye, named.pinhole.look_at) == ((1, 2, 3), (0, 0, 9))


def test_luxrenders_look_at_is_right_handed_as_pbrts_first_version_was():
    """Its LookAt has right = dir × up for the camera's x, where pbrt has up × dir; the rest of the chain is the same."""
    scene = 'LookAt 1 2 3  4 5 6  0 0 1\nCamera "perspective" "float fov" [40]\nFilm "{}" "integer xresolution" [640] '
    scene += '"integer yresolution" [360]'
    (lux,), (pbrt,) = (cameras.read(scene.format(film)) for film in ("fleximage", "image"))
    assert not lux.pinhole.mirrored and pbrt.pinhole.mirrored
    assert dataclasses.replace(lux.pinhole, mirrored=True) == pbrt.pinhole
    (first,) = cameras.read('SearchPath "/usr/share"\n' + scene.format("image"))
    assert first.pinhole == lux.pinhole
    for before, mirrored in (("Scale -1 1 1\n", True), ("Rotate 90 0 0 1\n", False), ("Scale -1 1 1 Rotate 90 0 0 1\n", True)):
        (lux,), (pbrt,) = (cameras.read(before + scene.format(film)) for film in ("fleximage", "image"))
        assert (lux.pinhole.mirrored, pbrt.pinhole.mirrored) == (mirrored, not mirrored)


@pytest.mark.parametrize(
    "text",
    [
        '<Application><Camera Name="cam"/><Node Camera "x"/></Application>',
        'print("Reading camera {}/{}".format(1, 2)); print(f"camera {number}")',
        'from typing import NamedTuple\n\nCameraModel = namedtuple("CameraModel", ["a"])',
        "to: everybody\nabout cameras",
    ],
)
def test_what_only_has_the_words_of_a_format_is_not_taken_for_it(text):
    with pytest.raises(InputError, match=r"no camera that is understood|looks like XML and is none|give 3 finite numbers"):
        cameras.read(text, options=GL)


def test_a_film_of_pbrt_without_its_size_has_the_size_that_is_asked_for():
    text = 'LookAt 1 2 3 4 5 6 0 0 1 Camera "perspective" Film "image" "string filename" "a.exr"'
    (camera,) = cameras.read(text, options=GL)
    assert (camera.pinhole.width, camera.pinhole.height, camera.size_stated) == (640, 360, False)


def test_an_angle_below_pi_is_taken_as_what_the_options_say():
    text = "lookfrom = vec3(1,2,3); lookat = vec3(0,0,0); vup = vec3(0,1,0); vfov = 0.7"
    for unit, angle in (("radians", 0.7), ("degrees", math.radians(0.7))):
        cameras_read = cameras.read(text, options=dataclasses.replace(GL, angle_unit=unit))[0].pinhole
        assert cameras_read.distance[1] == pytest.approx(180 / math.tan(angle / 2))


# ---- engines


def test_unreals_quaternion_turns_its_forward_to_the_view():
    pinhole = CAMERAS["rolled"]
    line = cameras.write([of("rolled")], "unreal").splitlines()[1].split(",")
    place, quaternion, fov = np.array(line[1:4], float), np.array(line[4:8], float), float(line[8])
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation.from_quat(quaternion).as_matrix()
    flip = np.diag([1, -1, 1])
    u, v, w = pinhole.basis()
    assert flip @ place / 100 == pytest.approx(pinhole.eye, abs=1e-14)
    assert np.abs(flip @ rotation - np.column_stack([-w, u, v])).max() < 1e-15
    assert fov == pytest.approx(math.degrees(pinhole.field_of_view()[0]))


def test_unitys_matrices_show_its_left_handed_world_as_the_pinhole_shows_ours():
    pinhole = CAMERAS["shifted_and_not_square"]
    (record,) = json.loads(cameras.write([of("shifted_and_not_square")], "unity"))["cameras"]
    points = points_before(pinhole)
    clip = (
        np.c_[points * [1, 1, -1], np.ones(len(points))]
        @ (np.array(record["projectionMatrix"]) @ record["worldToCameraMatrix"]).T
    )
    column, row = (clip[:, 0] / clip[:, 3] + 1) / 2 * pinhole.width, (1 - clip[:, 1] / clip[:, 3]) / 2 * pinhole.height
    judged(pinhole, column, row, points)
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation.from_quat(record["rotation"]).as_matrix()
    assert np.diag([1, 1, -1]) @ rotation[:, 2] == pytest.approx(-pinhole.basis()[2], abs=1e-15)
    assert "fieldOfView" not in record


def test_what_a_field_of_view_can_not_say_unreal_refuses():
    for name in ("shifted", "mirrored", "pixels_not_square"):
        with pytest.raises(InputError, match="field of view can't say"):
            cameras.write([of(name)], "unreal")
    assert allowed(CAMERAS["plain"], points_before(CAMERAS["plain"])) < 1e-3


UNMIRRORED = [name for name, each in CAMERAS.items() if each.distance[0] == each.distance[1] and not each.mirrored]
CENTERED = [name for name in UNMIRRORED if CAMERAS[name].principal_point == (CAMERAS[name].width / 2, CAMERAS[name].height / 2)]


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
    half = math.tan(math.radians(parsed["ViewAngle"][0]) / 2)  # half the height, at the distance 1
    (center_x, center_y), across = parsed["WindowCenter"], half * width / height
    left, right = (center_x - 1) * across, (center_x + 1) * across
    bottom, top = (center_y - 1) * half, (center_y + 1) * half
    from_eye = points - eye
    depth = -from_eye @ w
    x, y = from_eye @ u / depth, from_eye @ v / depth
    return (x - left) / (right - left) * width, (y - bottom) / (top - bottom) * height


@pytest.mark.parametrize("name", UNMIRRORED)
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
    if name not in (UNMIRRORED if form == "vtk" else CENTERED):
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


@pytest.mark.parametrize("form", ["unreal", "unity"])
def test_quaternions_of_a_path_go_on_from_camera_to_camera(form):
    """A pan and a dive all around: with a sign that jumps, whatever goes from one row to the next spins."""
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    eyes = [(5 * math.cos(a), 5 * math.sin(a), 3 * math.sin(2 * a)) for a in np.linspace(0, 4 * math.pi, 73)]
    written_cameras = [
        Camera(f"{number}", Pinhole(eye, (0, 0, 0.2), (0, 0, 1), 500, 640, 360)) for number, eye in enumerate(eyes)
    ]

    def turns_of(path):
        text = cameras.write(path, form)
        if form == "unity":
            return np.array([record["rotation"] for record in json.loads(text)["cameras"]])
        return np.array([[float(part) for part in line.split(",")[4:8]] for line in text.splitlines()[1:]])

    turns = turns_of(written_cameras)
    assert (turns[1:] * turns[:-1]).sum(axis=1).min() > 0.9
    forward, flip = {"unreal": ([1, 0, 0], [1, -1, 1]), "unity": ([0, 0, 1], [1, 1, -1])}[form]
    forward = rotation.from_quat(turns).apply(forward)
    assert np.abs(forward * flip + np.array([camera.pinhole.axes()[2] for camera in written_cameras])).max() < 1e-12
    assert turns_of(written_cameras[:1])[0, 3] >= 0
