"""Cameras as texts: what people and programs write down, in any spelling, and that nothing of it is guessed, run or slow.

Among them K, R, t and 4 × 4 matrices in code: written here as each language writes them, they are the same camera.
"""

import json
import math
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from viewcam_addon import cameras
from viewcam_addon.cameras import Camera, Options
from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.scene import Scene, scene_file

from .test_read_only_formats import Known, the_same

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
        "eye 7 -6 4\ncentre 0 0 1\nup 0 0 1\nd 1200",
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


known = Known("shifted")
K = np.array([[known.f_x, 0, known.c_x], [0, known.f_y, known.c_y], [0, 0, 1]])
R = np.array([known.u, -known.v, -known.w])
T = -R @ known.e
W2C = np.vstack([np.column_stack([R, T]), [0, 0, 0, 1]])
C2W = np.vstack([np.column_stack([R.T, known.e]), [0, 0, 0, 1]])
OPENGL = C2W @ np.diag([1, -1, -1, 1])
CORNER = Options(size=(known.width, known.height), pixel="corner")


def row(numbers, between=", "):
    return between.join(repr(float(number)) for number in np.ravel(numbers))


def rows(matrix, between=" ", after="; "):
    return after.join(row(each, between) for each in matrix)


def fixed(array):
    return np.array2string(array, separator=" ", floatmode="unique")


F, C_X, C_Y = repr(known.f_x), repr(known.c_x), repr(known.c_y)
CODES = {
    "numpy": f"K = np.array({K.tolist()})\nR = np.array({R.tolist()}, dtype=np.float64)\nt = np.array({T.tolist()})",
    "repr": f"K = {K!r}\nR = {R.tolist()!r}\nt = {T.tolist()!r}",
    "printed": f"K:\n{fixed(K)}\nR:\n{fixed(R)}\nt: {fixed(T)}",
    "torch": f"K = torch.tensor({K.tolist()}, dtype=torch.float64, device='cuda')\n"
    f"extrinsics = torch.tensor({W2C.tolist()}).cuda()",
    "names": f"f = {F}\ncx, cy = {C_X}, {C_Y}\n"
    f"K = np.array([[f, 0, cx], [0, {known.f_y!r}, cy], [0, 0, 1]])\nw2c = {W2C.tolist()}",
    "transposed": f"K = np.array({K.T.tolist()}).T\nR = np.array({R.T.tolist()}).transpose()\nt = {T[:, None].tolist()}",
    "repr_of_numpy_2": f"K = {K.tolist()}\nR = {R.tolist()}\nt = [{', '.join(f'np.float64({float(x)!r})' for x in T)}]",
    "reshaped": f"K = np.array([{row(K)}]).reshape(3, 3)\nR = np.array([{row(R)}]).reshape((3, 3))\nt = [{row(T)}]",
    "matlab": f"K = [{rows(K)}];  % intrinsics\nR = [{rows(R.T)}]'; t = [{row(T, '; ')}];",
    "matlab_lines": f"K = [{rows(K, '  ', chr(10))}];\nR = [{rows(R, ', ')}];\nt = [{row(T, ' ')}]';",
    "julia": f"K = [{rows(K)}]\nR = [{rows(R)}]\nt = [{row(T)}]",
    "opencv": f"cv::Mat K = (cv::Mat_<double>(3, 3) << {row(K)}); // pixels\ncv::Mat R = (cv::Mat_<double>(3,3) << {row(R)});\n"
    f"cv::Mat tvec = (cv::Mat_<double>(3,1) << {row(T)});",
    "opencv_small": f"cv::Matx33d K({row(K)});\ncv::Matx33d R({row(R)});\ncv::Vec3d t({row(T)});",
    "eigen": f"Eigen::Matrix3d K, R;\nK << {row(K)};\nR << {row(R[0])},\n     {row(R[1])},\n     {row(R[2])};\n"
    f"Eigen::Vector3d t({row(T)});",
    "c": f"double K[3][3] = {{{{{row(K[0])}}}, {{{row(K[1])}}}, {{{row(K[2])}}}}};\nconst double R[9] = {{{row(R)}}}; // rows\n"
    f"double t[] = {{{row(T)}}};",
    "r": f"K <- matrix(c({row(K.T)}), nrow = 3)\nR <- matrix(c({row(R)}), nrow = 3, byrow = TRUE)\nt <- c({row(T)})",
    "dictionary": f"camera = {{'K': np.array({K.tolist()}), 'R': np.array({R.tolist()}), 't': np.array({T.tolist()})}}",
    "rows_by_columns": f"K = {K.tolist()}\nextrinsic = {W2C.T.tolist()}",
}


@pytest.mark.parametrize("name", CODES)
def test_a_camera_in_the_code_of_any_language_is_that_camera(name):
    assert cameras.recognized(CODES[name]) == "arrays"
    the_same(cameras.read(CODES[name], options=CORNER), known)


WAYS = {"w2c_opencv": W2C, "c2w_opencv": C2W, "c2w_opengl": OPENGL, "w2c_opengl": np.linalg.inv(OPENGL)}


@pytest.mark.parametrize("name", ["pose", "T", "c2w", "transform_matrix"])
@pytest.mark.parametrize("way", WAYS)
def test_a_matrix_goes_the_way_that_is_chosen_and_is_refused_without(name, way):
    text = f"K = np.array({K.tolist()})\n{name} = np.array({WAYS[way].tolist()})"
    options = Options(size=CORNER.size, pixel="corner", pose=way)
    the_same(cameras.read(text, options=options), known)
    with pytest.raises(InputError, match="which way it goes is not said: give --pose, one of w2c_opencv, c2w_opencv"):
        cameras.read(text, options=CORNER)


def test_a_matrix_alone_leaves_the_lens_as_it_is():
    text = f"bpy.context.object.matrix_world = Matrix({OPENGL.tolist()})"
    (read,) = cameras.read(text, options=Options(view_plane=known.pinhole.plane))
    assert not read.size_stated
    the_same([read], known)


def blenders(matrix):
    """A matrix as Blender's console shows it."""
    return "<Matrix 4x4 " + "\n            ".join(f"({row(each)})" for each in matrix) + ">"


ALONE = {
    "numpy": lambda m: repr(np.array(m)),
    "printed": fixed,
    "list": lambda m: repr(m.tolist()),
    "three_rows": lambda m: repr(m[:3].tolist()),
    "arrays": lambda m: repr([*m]),
    "torch": lambda m: f"tensor({m.tolist()}, device='cuda:0', dtype=torch.float64)",
    "matlab": lambda m: f"[{rows(m)}]",
    "lines": lambda m: rows(m, ", ", chr(10)),
    "julia": lambda m: f"4×4 Matrix{{Float64}}:\n{rows(m, '  ', chr(10))}",
    "mathutils": lambda m: f"Matrix(({', '.join(f'({row(each)})' for each in m)}))",
    "blender": blenders,
    "columns": lambda m: row(m.T),
}


@pytest.mark.parametrize("name", ALONE)
def test_a_matrix_without_a_name_is_a_pose_once_its_way_is_said(name):
    with np.printoptions(floatmode="unique"):
        text = ALONE[name](OPENGL)
    assert cameras.recognized(text) == "arrays"
    with pytest.raises(InputError, match="which way it goes is not said"):
        cameras.read(text, options=Options(view_plane=known.pinhole.plane))
    the_same(cameras.read(text, options=Options(view_plane=known.pinhole.plane, pose="c2w_opengl")), known)


@pytest.mark.parametrize(
    "text",
    [
        rows(OPENGL * 2),  # no row 0 0 0 1
        row(np.arange(12)),  # no rotation
        rows(OPENGL) + "; 1 2 3 4",
        rows(OPENGL) + " meters",
    ],
)
def test_other_numbers_alone_are_no_pose(text):
    with pytest.raises(InputError, match="no camera that is understood"):
        cameras.recognized(text)


@pytest.mark.parametrize("factor", [1.0, 1000.0])
def test_variables_as_matlab_shows_them_are_read_with_the_factor_that_it_takes_out(factor):
    def display(name, matrix, factor=1.0):
        by = f"   {factor:.1e} *\n\n" if factor != 1 else ""
        return f"{name} =\n\n{by}" + "".join(f"   {row(each, '   ')}\n" for each in matrix / factor) + "\n\n"

    text = display("K", K, factor) + display("R", R) + display("t", T[:, None])
    (read,) = cameras.read(text, options=CORNER)
    np.testing.assert_allclose(read.pinhole.distance, known.pinhole.distance, rtol=1e-15)
    np.testing.assert_allclose(read.pinhole.eye, known.pinhole.eye, rtol=1e-12)


def test_a_row_that_goes_on_after_three_points_is_one_row():
    k = f"K = [{row(K[0], ' ')}; ...\n {row(K[1], ' ')}; ... % of pixels\n {row(K[2], ' ')}];"
    the_same(cameras.read(f"{k}\nR = [{rows(R)}];\nt = [{row(T)}];", options=CORNER), known)


def test_k_alone_leaves_the_camera_where_it_stands():
    """Also where the text's world is another: what it does not say is no part of it."""
    base = known.pinhole
    for axes, scale in (("as_is", 1.0), ("y_up", 0.5)):
        options = Options(size=CORNER.size, base=base, axes=axes, scale=scale)
        (read,) = cameras.read("K = [900 0 330; 0 900 170; 0 0 1];", options=options)
        assert (read.pinhole.eye, read.pinhole.look_at, read.pinhole.up) == (base.eye, base.look_at, base.up)
        assert read.pinhole.distance == (900.0, 900.0) and "where the camera stands" in " ".join(read.notes)
    (read,) = cameras.read("K = [900 0 330; 0 900 170; 0 0 1];", options=CORNER)
    assert read.pinhole.eye == (0, 0, 0)


@pytest.mark.parametrize(
    "pose",
    [
        "R = np.eye(3)\nt = np.zeros(3)",
        "R = eye(3); t = zeros(3, 1);",
        "cv::Mat R = cv::Mat::eye(3, 3, CV_64F);\ncv::Mat t = cv::Mat::zeros(3, 1, CV_64F);",
        "R = torch.eye(3).cuda()\nt = torch.zeros((3, 1))",
    ],
)
def test_an_identity_and_zeros_are_numbers_too(pose):
    (read,) = cameras.read(f"K = [{rows(K)}];\n{pose}\n", options=CORNER)
    assert read.pinhole.eye == (0, 0, 0) and read.pinhole.axes()[1] == (0, -1, 0)


def test_a_size_that_is_computed_is_told_where_the_one_given_counts():
    for size, is_told in (("(w, h)", True), ("[640, 480]", False)):
        (read,) = cameras.read(f"K = np.array({K.tolist()})\nsize = {size}\n", options=Options(size=(640, 480)))
        assert any("size is computed" in note for note in read.notes) == is_told, read.notes


def test_the_size_is_the_texts_own():
    (read,) = cameras.read(f"K = np.array({K.tolist()})\nh, w = 480, 640\n")
    assert read.size_stated and (read.pinhole.width, read.pinhole.height) == (640, 480)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (f"K = np.array({K.tolist()})\nR = np.linalg.inv(np.array({R.tolist()}))\nt = {T.tolist()}", "R is computed"),
        (f"K = np.array({K.tolist()}) * 2", "K is computed"),
        (f"K = np.array({K.tolist()})[:2]", "K is computed"),
        (f"K = np.array([[600, 0, 1281 // 2], [0, 600, 360], [0, 0, 1]])\nR = {R.tolist()}", "K is computed"),
        (f"K = np.array([[fx, 0, 640], [0, fx, 360], [0, 0, 1]])\nR = {R.tolist()}", "K is computed"),
        (f"K = np.array({K.tolist()})\nK = np.array({(2 * K).tolist()})", "K is something else before"),
        (f"K = np.array({K.tolist()})\nR = np.array({R.tolist()})", "only a part of its pose"),
        (f"K = {K.tolist()}\nextrinsic = {(W2C * 2).tolist()}", "last row 0 0 0 1"),
    ],
)
def test_what_is_computed_or_contradicts_itself_is_refused(text, problem):
    with pytest.raises(InputError, match=problem):
        cameras.read(text, options=CORNER)


def test_1_minus_2_in_a_row_without_commas_are_two_numbers_and_with_commas_a_difference():
    text = f"K = [{rows(K)}]; R = [0 -1 0; 1 0 0; 0 0 1]; t = [2 -3, 4, 5];"
    with pytest.raises(InputError, match="t"):  # three numbers, or four
        cameras.read(f"K = [{rows(K)}]; R = [0 -1 0; 1 0 0; 0 0 1]; t = [2 -3 4 5];", options=CORNER)
    (read,) = cameras.read(text, options=CORNER)
    np.testing.assert_allclose(read.pinhole.eye, -np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]).T @ [-1, 4, 5])
