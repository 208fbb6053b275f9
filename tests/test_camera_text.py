import json
import math
import time
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from viewcam_addon import camera_text
from viewcam_addon.camera_text import read, written
from viewcam_addon.errors import InputError
from viewcam_addon.intrinsics import Frame
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.scene import Scene, scene_file

POSE = {"eye": (7.0, -6.0, 4.0), "look_at": (0.0, 0.0, 1.0), "up": (0.0, 0.0, 1.0)}
FRAME = Frame(1920, 1080)

numbers = st.floats(allow_nan=False, allow_infinity=False)
triples = st.tuples(numbers, numbers, numbers)


def said(camera):
    """What a text said, without what it did not."""
    return {name: value for name in ("eye", "look_at", "up", "distance") if (value := getattr(camera, name)) is not None}


def bits(values):
    return [float(number).hex() for number in values]


@given(triples, triples, triples, st.floats(min_value=5e-324, allow_infinity=False))
@example((-0.0, 1e-323, 1.7e308), (0.1, 1 / 3, -0.0), (0.0, 0.0, 1.0), 2.0**-1074)
def test_what_is_written_reads_back_bit_for_bit(eye, look_at, up, distance):
    text = written(eye, look_at, up, distance)
    camera = read(text)
    assert "\n" not in text
    assert bits((*camera.eye, *camera.look_at, *camera.up)) == bits((*eye, *look_at, *up))
    assert bits([camera.distance_in(FRAME)]) == bits([distance])


def test_what_is_written_has_the_keys_of_a_scene_file():
    document = json.loads(written(*POSE.values(), 1200.0))
    assert {key: tuple(value) for key, value in document.items() if key != "distance"} == POSE
    assert document["distance"] == 1200


def test_numbers_that_are_not_finite_are_not_written():
    with pytest.raises(InputError, match="finite"):
        written((math.nan, 0, 0), (0, 0, 0), (0, 0, 1), 1.0)


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
    ],
)
def test_people_write_the_four_values_in_many_ways(text):
    assert said(read(text)) == POSE | {"distance": 1200}
    assert read(text).notes == ()


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
    if given_values:
        assert said(read(text)) == given_values
    else:
        with pytest.raises(InputError):
            read(text)


def test_a_camera_of_a_scene_file_keeps_its_picture_in_another_size():
    text = '{"eye": [0, -6, 2.5], "look_at": [0, 0, 1], "up": [0, 0, 1], "distance": [400, 400], "width": 320, "height": 180}'
    assert read(text).distance_in(Frame(1280, 720)) == 1600


def test_of_a_scene_file_the_stated_camera_is_read_in_the_worlds_coordinates(tmp_path):
    stated = Pinhole((0.1, 0.2, 0.3), (0, 0, -1), (0, 1, 0), 1200.0, 1920, 1080)
    made = Pinhole((0.1000001, 0.2, 0.3), (0, 0, -1), (0, 1, 0), 1200.0, 1920, 1080)
    scene_file.write(Scene(made, {}, (), stated_camera=stated, origin=(10.0, 0.0, 0.0)), tmp_path / "scene.json")
    camera = read((tmp_path / "scene.json").read_text())
    assert (camera.eye, camera.look_at, camera.up) == ((10.1, 0.2, 0.3), (10.0, 0.0, -1.0), (0.0, 1.0, 0.0))
    assert camera.distance_in(FRAME) == 1200 and camera.notes == ()


@pytest.mark.parametrize(
    ("more", "note"),
    [
        ('"principal_point": [170, 90]', "shifted"),
        ('"mirrored": true', "mirrored"),
        ('"distance": [400, 600]', "not square"),
    ],
)
def test_what_of_a_scene_file_the_four_values_can_not_say_is_told(more, note):
    (told,) = read('{"eye": [0, -6, 2.5], "width": 320, "height": 180, ' + more + "}").notes
    assert note in told


@pytest.mark.parametrize("aspect", [1.0, 1.5])
@pytest.mark.parametrize(
    ("says", "of_which"),
    [
        ("hfov=40", 0),
        ("vfov 40°", 1),
        ("fov=40 axis=x", 0),
        ("fov: 40 deg, fov_axis: vertical", 1),
        ("fov_axis=diagonal fov=40", 2),
        ("fov=40 fov_axis=smaller", 1),
        ("fov=40 fov_axis=larger", 0),
        ('{"fov": 40, "fov_axis": "diagonal"}', 2),
    ],
)
def test_a_field_of_view_becomes_the_distance_that_has_it(says, of_which, aspect):
    frame = Frame(1920, 1080, pixel_aspect_x=aspect)
    distance = read(says).distance_in(frame)
    seen = Pinhole(*POSE.values(), (distance, distance * aspect), 1920, 1080).field_of_view()[of_which]
    # A tangent, a quotient and their inverses: a few roundings of 1.1e-16 each.
    assert math.degrees(seen) == pytest.approx(40, rel=2e-15)


def test_the_shorter_side_of_an_upright_picture_is_its_width():
    angle = 'LookAt 0 0 0 0 1 0 0 0 1 Camera "perspective" "float fov" 40'
    assert read(angle).distance_in(Frame(1080, 1920)) == read("hfov=40").distance_in(Frame(1080, 1920))


@pytest.mark.parametrize(
    ("text", "fov"),
    [
        ("LookAt 7 -6 4  0 0 1  0 0 1", None),
        (
            'Scale -1 1 1  # mirrored\nLookAt 7 -6 4 # eye\n 0 0 1 # at\n 0 0 1\nCamera "perspective" "float fov" [40]',
            40,
        ),
        (
            'LookAt 7 -6 4 0 0 1 0 0 1\nCamera "perspective" "float lensradius" [0] "float fov" 40 "bool b" "true"\nFilm "rgb"',
            40,
        ),
        ('LookAt 7 -6 4 0 0 1 0 0 1 Camera "perspective"\nWorldBegin\nTranslate 1 2 3\nShape "sphere"', 90),
    ],
)
def test_pbrt_names_points_of_the_scene_and_the_shorter_sides_angle(text, fov):
    camera = read(text)
    assert said(camera) == POSE
    assert camera.field_of_view == (None if fov is None else (math.radians(fov), "smaller"))
    assert bool(camera.notes) == ("Scale" not in text), "a picture that is mirrored in pbrt is told of, and only such"


@pytest.mark.parametrize(
    ("text", "field_of_view"),
    [
        ('<lookat origin="7, -6, 4" target="0, 0, 1" up="0, 0, 1"/>', None),
        (
            '<sensor type="perspective"><!--<lookat/>--><float name="fov" value="40"/>'
            '<string name="fov_axis" value="smaller"/>'
            "<transform name='to_world'>\n<lookat target='0 0 1' origin='7 -6 4' up='0 0 1'/></transform></sensor>",
            (math.radians(40), "smaller"),
        ),
        ("mi.ScalarTransform4f().look_at(origin=[7, -6, 4], target=[0, 0, 1], up=[0, 0, 1])", None),
        (
            "{'type': 'perspective', 'fov': 40, "
            "'to_world': T.look_at(\n    origin=(7, -6, 4),\n    target=(0, 0, 1), up=(0, 0, 1),\n)}",
            (math.radians(40), "x"),
        ),
        (
            '<lookat origin="7, -6, 4" target="0, 0, 1" up="0, 0, 1"/><string name="focal_length" value="50mm"/>',
            (2 * math.atan(math.hypot(36, 24) / 100), "diagonal"),
        ),
    ],
)
def test_mitsubas_look_at_is_read_from_xml_and_from_python(text, field_of_view):
    camera = read(text)
    assert said(camera) == POSE and camera.notes == ()
    if field_of_view is None:
        assert camera.field_of_view is None
    else:
        assert camera.field_of_view == (pytest.approx(field_of_view[0], rel=1e-15), field_of_view[1])


@pytest.mark.parametrize(
    ("text", "mirrored"),
    [
        ("camera { location <7, -6, 4> look_at <0, 0, 1> sky <0, 0, 1> angle 40 }", True),
        (
            "camera{perspective sky z right -x*image_width/image_height // right\n location<7,-6,4> look_at<0,0,1>angle 40}",
            False,
        ),
        (
            "#declare C = camera { /* angle 30 */ angle 40 up y right <-1.33, 0, 0> sky z location <7,-6,4> look_at <0,0,1> };",
            False,
        ),
    ],
)
def test_pov_ray_turns_its_camera_by_the_sky(text, mirrored):
    camera = read(text)
    assert said(camera) == POSE
    assert camera.field_of_view == (math.radians(40), "x")
    assert bool(camera.notes) == mirrored


def test_pov_rays_sky_is_y_unless_given():
    assert read("camera { location <1, 2, 3> look_at <0, 0, 0> }").up == (0, 1, 0)
    assert read("camera { location <1, 2, 3> }").up is None


def test_each_line_of_the_page_is_the_same_camera():
    page = Path(__file__).parent.parent.joinpath("docs", "scene-file.md").read_text(encoding="utf-8")
    lines = page.split("```text\n")[1].split("```")[0].splitlines()
    assert len(lines) == 7
    for line in lines:
        camera = read(line)
        assert (camera.eye, camera.look_at, camera.up) == tuple(POSE.values()), line
        # Sixteen digits of an angle, its tangent, a quotient.
        assert camera.distance_in(FRAME) == pytest.approx(960, rel=1e-14), line
        assert camera.notes == (), line


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "there is no text"),
        (" \n\t", "there is no text"),
        ("hello", "at 'hello'"),
        ("eye=1,2 look_at=0,0,0", "at 'look_at=0,0,0'.*3 finite numbers for eye"),
        ("eye=1,2,3,4", "at '4'"),
        ("look_at=0,0,0\neye=1,2,nan", r"at 'nan' \(line 2\)"),
        ("eye=1,2,1e999", "at '1e999'"),
        ("eye=1,2,3 from=1,2,3", "eye is given twice"),
        ("eye=1,2,3 fov=40", "add axis"),
        ("fov=180 axis=x", "between 0 and 180"),
        ("fov=40 axis=diameter", "at 'diameter'"),
        ("hfov=40 d=1200", "more than once"),
        ("d=0", "d > 0"),
        ("()[]", "neither eye, look-at"),
        ('{"eye": [1, 2]}', "eye is"),
        ('{"eye": [1, 2, NaN]}', "NaN is no number"),
        ('{"eye": [1, 2, 3], "eye": [1, 2, 3]}', "'eye' is given twice"),
        ('{"eye": [1, 2, 3], "from": [1, 2, 3]}', "says eye once more"),
        ('{"eye": [1, 2, 3], "sensor": 36}', "'sensor' is none of a camera"),
        ('{"camera": [1]}', "'camera' is none of a camera"),
        ('{"eye": "here"}', "eye is 'here'"),
        ('{"distance": 400, "width": 0}', "width is 0"),
        ("{}", "neither eye, look-at"),
        ("LookAt 1 2 3 4 5 6 7 8", "at '4 5 6 7 8'"),
        ("LookAt 1 2 3 4 5 6 7 8 9 LookAt 1 2 3 4 5 6 7 8 9", "there is a LookAt before"),
        ("Rotate 10 0 0 1 LookAt 1 2 3 4 5 6 7 8 9", "at 'Rotate 10"),
        ("LookAt 1 2 3 4 5 6 7 8 9 Scale -1 1 1", "at 'Scale -1"),
        ('LookAt 1 2 3 4 5 6 7 8 9 Camera "orthographic"', "only a perspective camera"),
        ('LookAt 1 2 3 4 5 6 7 8 9 Camera "perspective" "float screenwindow" [-1 1 -1 1]', "at '\"float screenwindow"),
        ('<lookat origin="1, 2" target="0, 0, 0"/>', "3 finite numbers for eye"),
        ('<lookat origin="$eye"/>', r"at '\$eye"),
        ("<lookat/><lookat/>", "give one <lookat"),
        ('<transform><translate x="1"/><lookat origin="1,2,3"/></transform>', "at '<translate"),
        ("T.translate([1, 2, 3]) @ T.look_at(origin=[1, 2, 3])", "at '@ T.look_at"),
        ("look_at(origin=[1, 2, 3]", "close it with"),
        ("camera { location <1, 2, 3>", "close it with"),
        ("camera { location <1, 2, 3>*2 }", "give plain numbers for location"),
        ("camera { Home location <1, 2, 3> }", "at 'Home location"),
        ("camera { orthographic location <1, 2, 3> }", "at 'orthographic"),
        ("camera { location <1, 2, 3> rotate 90*x }", "at 'rotate"),
    ],
)
def test_what_is_not_understood_is_shown_in_one_sentence(text, sentence):
    with pytest.raises(InputError, match=sentence) as error:
        read(text)
    assert "\n" not in str(error.value) and len(str(error.value)) < 250


PIECES = [
    "eye",
    "=",
    "(",
    ")",
    "{",
    "}",
    "<",
    ">",
    "1",
    "-",
    ".",
    "e9",
    "nan",
    "inf",
    '"',
    "'",
    "look_at",
    "LookAt ",
    "camera {",
]
PIECES += [
    "<lookat ",
    "/>",
    "up",
    ",",
    " ",
    "\n",
    "#",
    "/*",
    "//",
    "<!--",
    "d=",
    "fov",
    "axis",
    "[",
    "]",
    ":",
    "\0",
    "é",
    "𝟛",
    "Camera ",
]


@given(st.lists(st.sampled_from(PIECES), max_size=40).map("".join) | st.text(max_size=60))
def test_any_text_is_read_or_refused_in_a_sentence(text):
    try:
        camera = read(text)
    except InputError as error:
        assert str(error)
    else:
        assert said(camera) or camera.field_of_view
        assert all(math.isfinite(number) for name in POSE if name in said(camera) for number in said(camera)[name])


MILLION = 1_000_000
HUGE = {
    **{repr(piece): piece * (MILLION // len(piece)) for piece in PIECES},
    "a long word": "a" * MILLION,
    "a long number": "eye=" + "1" * MILLION,
    "a long JSON number": '{"distance": ' + "1" * MILLION + "}",
    "nested JSON": '{"eye":' * (MILLION // 7),
    "nested lists": '{"eye":' + "[" * MILLION,
    "numbers": "eye=" + "1 " * (MILLION // 2),
    "pairs": "eye=1,2,3 " * (MILLION // 10),
    "tags": "<lookat " * (MILLION // 8),
    "attributes": "<lookat " + "a='" * (MILLION // 3) + ">",
    "unclosed values": "<lookat " + 'a="b=' * (MILLION // 5) + ">",
    "look_at(": "look_at(origin=" * (MILLION // 15),
    "items": "look_at(origin=1,2,3)" + "'fov':" * (MILLION // 6),
    "cameras": "camera {" + "right " * (MILLION // 6) + "}",
    "comments": "camera { location <1,2,3> " + "/*" * (MILLION // 2),
    "pbrt": "LookAt 1 2 3 4 5 6 7 8 9 " + 'Camera "perspective" ' + '"float a" [ ' * (MILLION // 12),
    "pbrt parameters": "LookAt 1 2 3 4 5 6 7 8 9 " + 'Camera "perspective" ' + '"float a" 1 ' * (MILLION // 12),
    "almost pbrt": "LookAt 1 2 " * (MILLION // 11),
    "pbrt comments": "LookAt " + "# \n" * (MILLION // 3),
    "pbrt in a comment": "LookAt #" * (MILLION // 8),
    "cameras of pbrt": "LookAt 1 2 3 4 5 6 7 8 9 " + 'Camera "perspective" "float fov" 40 ' * (MILLION // 36),
}


@pytest.mark.parametrize("name", HUGE)
def test_a_million_characters_take_no_time(name):
    started = time.process_time()
    try:
        read(HUGE[name])
    except InputError as error:
        assert len(str(error)) < 250
    # 0.6 s at most were measured; what is quadratic in a million takes minutes.
    assert time.process_time() - started < 5


def test_more_than_ten_million_characters_are_refused():
    with pytest.raises(InputError, match="10000001 characters"):
        read("1" * (camera_text._MOST_CHARACTERS + 1))
