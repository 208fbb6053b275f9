"""Cameras as texts: what people and programs write down, in any spelling, and that nothing of it is guessed, run or slow."""

import json
import math
import time
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from viewcam_addon import cameras
from viewcam_addon.cameras import Camera, Options
from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.scene import Scene, scene_file

POSE = {"eye": (7.0, -6.0, 4.0), "look_at": (0.0, 0.0, 1.0), "up": (0.0, 0.0, 1.0)}
# Stands where a text says nothing: nothing of it is like POSE.
BASE = Pinhole((1, 2, 3), (4, 5, 7), (0, 1, 0), 1234.0, 1920, 1080, (900.0, 500.0), True)
HD = Options(size=(1920, 1080))

numbers = st.floats(-1e150, 1e150)
triples = st.tuples(numbers, numbers, numbers)


def read(text, options=HD):
    (camera,) = cameras.read(text, options=options)
    return camera


def pinhole_of(text, **options):
    """The camera of a text that may say only some of it."""
    return read(text, Options(size=(1920, 1080), base=BASE, **options)).pinhole


def pose(pinhole):
    return {name: getattr(pinhole, name) for name in POSE}


pinholes = st.builds(
    Pinhole,
    triples,
    triples,
    triples,
    st.tuples(st.floats(1e-3, 1e9), st.floats(1e-3, 1e9)),
    st.integers(1, 2**31 - 1),
    st.integers(1, 2**31 - 1),
    st.tuples(numbers, numbers),
    st.booleans(),
)


def allow(build, *values):
    try:
        return build(*values)
    except InputError:
        return None


@given(triples, triples, triples, st.floats(1e-3, 1e9), st.floats(1e-3, 1e9), st.integers(1, 9999), triples, st.booleans())
@example((-0.0, 1e-323, 1.7e148), (0.1, 1 / 3, -0.0), (0.0, 0.0, 1.0), 2.0**-9, 2.0**-9, 640, (1.0, 2.0, 0.0), True)
def test_what_is_written_reads_back_bit_for_bit(eye, look_at, up, d_x, d_y, width, point, mirrored):
    pinhole = allow(Pinhole, eye, look_at, up, (d_x, d_y), width, 360, point[:2], mirrored)
    if pinhole:
        text = cameras.write([Camera("Camera", pinhole)], "text")
        assert "\n" not in text
        assert repr(read(text).pinhole) == repr(pinhole)


def test_what_is_written_has_the_keys_of_a_scene_file():
    document = json.loads(cameras.write([Camera("Camera", Pinhole(*POSE.values(), 1200.0, 1920, 1080))], "text"))
    assert {key: tuple(document[key]) for key in POSE} == POSE
    assert {key: document[key] for key in document.keys() - POSE.keys()} == {"distance": 1200, "width": 1920, "height": 1080}


@pytest.mark.parametrize(
    "text",
    [
        "eye=(7, -6, 4) look_at=(0, 0, 1) up=(0, 0, 1) d=1200",
        "eye=7,-6,4; lookat=0,0,1; up=0,0,1; distance=1200px",
        "d: 1200 pixels\nup: [0 0 1]\nlook-at: [0 0 1]\neye: [7 -6 4]",
        "from 7 -6 4 to 0 0 1 up 0 0 1 dist 1.2e3",
        "origin = <7, −6, 4>, target = <0, 0, 1>, up = <0, 0, 1>, distance = 1200.",
        "Eye {7; -6; 4} | Look At {0; 0; 1} | Up {0; 0; +1} | D 1200",
        "{'eye': (7, -6, 4), 'at': (0, 0, 1), 'up': (0, 0, 1), 'd': 1200}",
        "{eye: [7, -6, 4], lookAt: [0, 0, 1], up: [0, 0, 1], distance: 1200}",
        "eye = <Vector (7.0000, -6.0000, 4.0000)>, look_at = Vector((0, 0, 1)), up = Vector((0, 0, 1)), d = 1200",
        '{"eye": [7, -6, 4], "look_at": [0, 0, 1], "up": [0, 0, 1], "distance": 1200}',
        '"camera": {"eye": [7, -6, 4], "look_at": [0, 0, 1], "up": [0, 0, 1], "distance": 1200},',
        "lookfrom 7 -6 4\nlookat 0 0 1\nvup 0 0 1\nd 1200",
    ],
)
def test_people_write_the_four_values_in_many_ways(text):
    assert read(text).pinhole == Pinhole(*POSE.values(), 1200.0, 1920, 1080)
    assert read(text).notes == () and not read(text).size_stated


@given(
    st.permutations(["eye", "look_at", "up", "distance"]),
    st.lists(st.sampled_from([" ", "\n", "\t", ", ", ";\n", " | "]), min_size=4, max_size=4),
    st.sampled_from([" ", ",", ", ", "; ", "\n"]),
    st.sampled_from(["=", ": ", " = ", " "]),
    st.sampled_from(["()", "[]", "<>", "{}", ("", "")]),
    st.integers(0, 15),
    triples,
)
def test_any_order_and_punctuation_says_the_same_and_only_what_was_given(order, ends, comma, says, brackets, chosen, vector):
    given_values = {name: 3.5 if name == "distance" else vector for i, name in enumerate(order) if chosen >> i & 1}
    text = ""
    for (name, value), end in zip(given_values.items(), ends, strict=False):
        parts = [value] if name == "distance" else value
        text += name + says + brackets[0] + comma.join(map(repr, parts)) + brackets[1] + end
    whole = {name: getattr(BASE, name) for name in POSE} | given_values
    distance = whole.pop("distance", None)
    expected = allow(lambda: Pinhole(*(whole[name] for name in POSE), distance or BASE.distance, 1920, 1080)) if text else None
    if expected is None:
        with pytest.raises(InputError):
            pinhole_of(text)
        return
    actual = pinhole_of(text)
    assert pose(actual) == pose(expected) and actual.distance == expected.distance
    # A view plane is said as a whole or not at all.
    assert (actual.principal_point, actual.mirrored) == (((960, 540), False) if distance else (BASE.principal_point, True))


def test_without_a_camera_that_stands_there_what_is_missing_is_named():
    for text, missing in (
        ("eye=1,2,3", "look_at"),
        ("eye=1,2,3 look_at=0,0,0 up=0,0,1", "--distance"),
        ("d=9 size=4x3", "eye"),
    ):
        with pytest.raises(InputError, match=missing):
            read(text)


def test_a_camera_of_a_scene_file_keeps_its_whole_view_plane():
    text = '{"eye": [0, -6, 2.5], "look_at": [0, 0, 1], "up": [0, 0, 1], "distance": [400, 300], "width": 320, "height": 180, '
    text += '"principal_point": [170, 90], "mirrored": true}'
    assert read(text).pinhole == Pinhole((0, -6, 2.5), (0, 0, 1), (0, 0, 1), (400, 300), 320, 180, (170, 90), True)
    assert read(text).size_stated


def test_of_a_scene_file_the_stated_camera_is_read_in_the_worlds_coordinates(tmp_path):
    stated = Pinhole((0.1, 0.2, 0.3), (0, 0, -1), (0, 1, 0), 1200.0, 1920, 1080)
    written = Pinhole((0.1000001, 0.2, 0.3), (0, 0, -1), (0, 1, 0), 1200.0, 1920, 1080)
    scene_file.write(Scene(written, {}, (), stated_camera=stated, origin=(10.0, 0.0, 0.0)), tmp_path / "scene.json")
    camera = read(tmp_path / "scene.json")
    assert camera.pinhole == Pinhole((10.1, 0.2, 0.3), (10.0, 0.0, -1.0), (0.0, 1.0, 0.0), 1200, 1920, 1080)


@pytest.mark.parametrize("aspect", [1.0, 1.5])
@pytest.mark.parametrize(
    ("says", "of_which"),
    [
        ("hfov=40", 0),
        ("vfov 40°", 1),
        ("fov=40 axis=x", 0),
        ("fov: 40 deg, fov_axis: vertical", 1),
        (f"fov = {math.radians(40)!r} rad axis = y", 1),
        ("fov_axis=diagonal fov=40", 2),
        ("fov=40 fov_axis=smaller", 1),
        ("fov=40 fov_axis=larger", 0),
        ('{"fov": 40, "fov_axis": "diagonal"}', 2),
    ],
)
def test_a_field_of_view_becomes_the_distance_that_has_it(says, of_which, aspect):
    seen = pinhole_of(says, pixel_aspect=aspect)
    assert seen.distance[1] / seen.distance[0] == pytest.approx(aspect, rel=1e-15)
    # A tangent, a quotient and their inverses: a few roundings of 1.1e-16 each.
    assert math.degrees(seen.field_of_view()[of_which]) == pytest.approx(40, rel=2e-15)


def test_the_shorter_side_of_an_upright_picture_is_its_width():
    angle = 'LookAt 0 0 0 0 1 0 0 0 1 Camera "perspective" "float fov" 40'
    upright = Options(size=(1080, 1920), base=BASE)
    assert read(angle, upright).pinhole.distance == pytest.approx(read("hfov=40", upright).pinhole.distance, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "there is no text"),
        (" \n\t", "there is no text"),
        ("hello", "is no camera that is understood, from its beginning"),
        ("eye=1,2 look_at=0,0,0", "at 'look_at=0,0,0'.*3 finite numbers for eye"),
        ("eye=1,2,3,4", "at '4'"),
        ("look_at=0,0,0\neye=1,2,nan", r"at 'nan' \(line 2\)"),
        ("eye=1,2,1e999", "at '1e999'"),
        ("eye=1,2,3 from=1,2,3", "eye is given twice"),
        ("eye=1,2,3 fov=40", "add axis"),
        ("hfov=0.7", "may be degrees or radians"),
        ("fov=180 axis=x", "between 0 and 180"),
        ("fov=40 axis=diameter", "at 'diameter'"),
        ("hfov=40 d=1200", "more than once"),
        ("d=0", "d > 0"),
        ("()[]", "is no camera"),
        ('{"eye": [1, 2]}', "eye is"),
        ('{"eye": [1, 2, NaN]}', "eye is"),
        ('{"eye": [1, 2, 3], "eye": [1, 2, 3]}', "'eye' is given twice"),
        ('{"eye": [1, 2, 3], "from": [1, 2, 3]}', "says eye once more"),
        ('{"camera": {"eye": [1, 2, 3], "sensor": 36}}', "'sensor' is none of a camera"),
        ('{"eye": "here"}', "eye is 'here'"),
        ('{"distance": 400, "width": 0}', "width is 0"),
        ("{}", "is no camera"),
    ],
)
def test_what_is_not_understood_is_shown_in_one_sentence(text, sentence):
    with pytest.raises(InputError, match=sentence) as error:
        pinhole_of(text)
    assert "\n" not in str(error.value) and len(str(error.value)) < 1200


def test_each_line_of_the_page_is_the_same_camera():
    page = Path(__file__).parents[2].joinpath("docs", "scene-file.md").read_text(encoding="utf-8")
    lines = page.split("```text\n")[1].split("```")[0].splitlines()
    assert len(lines) >= 7
    for line in lines:
        reread = read(line)
        assert pose(reread.pinhole) == POSE, line
        # Sixteen digits of an angle, its tangent, a quotient.
        assert reread.pinhole.distance == pytest.approx((960, 960), rel=1e-14), line
        assert reread.notes == () and not reread.pinhole.mirrored, line


PIECES = "eye|=|(|)|{|}|<|>|1|-|.|e9|nan|inf|\"|'|look_at|LookAt |camera {|<lookat |/>|up|,| |\n|#|/*|//|<!--|d=|fov|axis|[|]|:"
PIECES = [
    *PIECES.split("|"),
    "\0",
    "é",
    "𝟛",
    'Camera "',
    "gluLookAt(",
    "camera.position",
    "vec3(",
    "view = ",
    "right",
    "*",
    "x",
]


@given(st.lists(st.sampled_from(PIECES), max_size=40).map("".join) | st.text(max_size=60))
def test_any_text_is_read_or_refused_in_a_sentence(text):
    try:
        cameras_read = cameras.read(text, options=Options(size=(640, 360), base=BASE))
    except InputError as error:
        assert str(error)
    else:
        assert all(isinstance(camera.pinhole, Pinhole) for camera in cameras_read)


LENGTH = 100_000
HUGE = {
    **{repr(piece): piece * (LENGTH // len(piece)) for piece in PIECES},
    "a long word": "a" * LENGTH,
    "a long number": "eye=" + "1" * LENGTH,
    "a long JSON number": '{"distance": ' + "1" * LENGTH + "}",
    "nested JSON": '{"eye":' * (LENGTH // 7),
    "nested lists": '{"eye":' + "[" * LENGTH,
    "numbers": "eye=" + "1 " * (LENGTH // 2),
    "pairs": "eye=1,2,3 " * (LENGTH // 10),
    "tags": "<lookat " * (LENGTH // 8),
    "nested tags": "<sensor><transform>" * (LENGTH // 19),
    "attributes": "<lookat " + "a='" * (LENGTH // 3) + ">",
    "unclosed values": "<lookat " + 'a="b=' * (LENGTH // 5) + ">",
    "look_at(": "look_at(origin=" * (LENGTH // 15),
    "items": "look_at(origin=1,2,3)" + "'fov':" * (LENGTH // 6),
    "types": "{'type': 'perspective', " * (LENGTH // 24),
    "cameras": "camera {" + "right " * (LENGTH // 6) + "}",
    "many cameras": "camera { location x } " * (LENGTH // 22),
    "declares": "#declare a = b; " * (LENGTH // 16) + "camera { location a }",
    "sums": "camera { location " + "1+" * (LENGTH // 2) + "1 }",
    "signs": "camera { location " + "-" * LENGTH + "1 }",
    "comments": "camera { location <1,2,3> " + "/*" * (LENGTH // 2),
    "pbrt": "LookAt 1 2 3 4 5 6 7 8 9 " + 'Camera "perspective" ' + '"float a" [ ' * (LENGTH // 12),
    "pbrt parameters": "LookAt 1 2 3 4 5 6 7 8 9 " + 'Camera "perspective" ' + '"float a" 1 ' * (LENGTH // 12),
    "almost pbrt": "LookAt 1 2 " * (LENGTH // 11),
    "pbrt comments": "LookAt " + "# \n" * (LENGTH // 3),
    "pbrt in a comment": "LookAt #" * (LENGTH // 8),
    "cameras of pbrt": "LookAt 1 2 3 4 5 6 7 8 9 " + 'Camera "perspective" "float fov" 40 ' * (LENGTH // 36),
    "calls": "lookAt(" * (LENGTH // 7),
    "calls and values": "camera.lookAt(a, b, c); " * (LENGTH // 24),
    "positions": "camera.position = vec3(1, 2, 3); " * (LENGTH // 33),
    "names": "a = b; b = a; lookfrom = a; " * (LENGTH // 28),
    "paths": "a.b." * (LENGTH // 4) + "= 1; lookfrom = 1",
    "blanks": "lookfrom" + " " * LENGTH,
    "views": "view = " * (LENGTH // 7),
    "view matrices": "view = [1 0 0 0 0 1 0 0 0 0 1 0 0 0 5 1] " * (LENGTH // 41),
    "divisions": "lookfrom = " + "a/" * (LENGTH // 2),
}


@pytest.mark.parametrize("name", HUGE)
def test_a_hundred_thousand_characters_take_no_time(name):
    started = time.process_time()
    try:
        cameras.read(HUGE[name], options=Options(size=(640, 360), base=BASE))
    except InputError as error:
        assert len(str(error)) < 1200
    # 0.1 s at most were measured on an idle machine; what is quadratic takes minutes at a million, and a hundredth here.
    assert time.process_time() - started < 1


# ---- simulators and differentiable renderers


def test_pybullets_two_matrices_are_eye_target_up_and_the_height_in_degrees():
    text = (
        "view = p.computeViewMatrix(cameraEyePosition=[7, -6, 4], cameraTargetPosition=[0, 0, 1], cameraUpVector=[0, 0, 1])\n"
        "lens = p.computeProjectionMatrixFOV(fov=40, aspect=640 / 480, nearVal=0.1, farVal=100)\n"
        "p.getCameraImage(640, 480, viewMatrix=view, projectionMatrix=lens)\n"
    )
    camera = read(text)
    assert pose(camera.pinhole) == POSE and camera.size_stated
    assert (camera.pinhole.width, camera.pinhole.height) == (640, 480)
    assert camera.pinhole.distance[1] == pytest.approx(240 / math.tan(math.radians(20)))
    by_place = "v = computeViewMatrix([7, -6, 4], [0, 0, 1], [0, 0, 1]); computeProjectionMatrixFOV(40, 1.5, 0.1, 9); "
    assert read(by_place + "getCameraImage(width=600, height=400)").pinhole.distance[1] == pytest.approx(
        200 / math.tan(math.radians(20))
    )
    frustum = "computeViewMatrix([7, -6, 4], [0, 0, 1], [0, 0, 1]); computeProjectionMatrix(-1, 1, -1, 1, 2, 9); "
    assert read(frustum + "getCameraImage(300, 300)").pinhole.distance == (300, 300)


@pytest.mark.parametrize(
    ("axis", "eye"), [(2, (3.34923133, -2.06898911, 4.7101006)), (1, (-1.34923146, 3.71010046, -1.06898908))]
)
def test_pybullets_yaw_and_pitch_are_as_pybullet_has_them(axis, eye):
    """The expected `eye` is that of PyBullet 3.2.7, whose numbers are float32."""
    pinhole = pinhole_of(f"p.computeViewMatrixFromYawPitchRoll([1, 2, 3], 5, 30, -20, 0, {axis})")
    assert pinhole.eye == pytest.approx(eye, abs=1e-6) and pinhole.look_at == (1, 2, 3)
    with pytest.raises(InputError, match="no roll"):
        pinhole_of(f"p.computeViewMatrixFromYawPitchRoll([1, 2, 3], 5, 30, -20, 15, {axis})")


def test_pytorch3ds_view_is_on_a_sphere_and_its_angle_is_of_the_shorter_side():
    text = (
        "R, T = look_at_view_transform(2, 30, 90); c = FoVPerspectiveCameras(R=R, fov=90); RasterizationSettings(image_size={})"
    )
    pinhole = read(text.format(512)).pinhole
    assert pinhole.eye == pytest.approx((math.sqrt(3), 1, 0)) and pinhole.look_at == (0, 0, 0) and pinhole.up == (0, 1, 0)
    assert (pinhole.width, pinhole.height) == (512, 512) and pinhole.distance == pytest.approx((256, 256))
    upright = read(text.format((640, 480))).pinhole  # height first
    assert (upright.width, upright.height) == (480, 640) and upright.distance == pytest.approx((240, 240))
    aimed = (
        "R, T = look_at_view_transform(eye=((7, -6, 4),), at=((0, 0, 1),), up=((0, 0, 1),)); FoVPerspectiveCameras(R=R, T=T)"
    )
    assert pose(read(aimed).pinhole) == POSE
    assert read(aimed).pinhole.distance[1] == pytest.approx(540 / math.tan(math.radians(30)))


@pytest.mark.parametrize(
    ("lens", "problem"),
    [
        ("PerspectiveCameras(focal_length=2.0)", "write FoVPerspectiveCameras"),
        ("FoVOrthographicCameras(R=R)", "orthographic"),
        ("FoVPerspectiveCameras(fov=1.0, degrees=False)", "give fov in degrees"),
        ("FoVPerspectiveCameras(fov=angle)", "field of view"),
    ],
)
def test_pytorch3ds_other_lenses_are_refused(lens, problem):
    with pytest.raises(InputError, match=problem):
        read(f"R, T = look_at_view_transform(2, 30, 90); cameras = {lens}")
