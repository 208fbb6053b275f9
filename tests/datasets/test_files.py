"""transforms.json: what stands where, and that its bytes are those of the same cameras anywhere.

A picture's path stays inside the batch's folder, and what no dataset can say is refused in a sentence that names it.

COLMAP's text model: its lines on paper, its quaternions everywhere, its digits and files.
"""

import contextlib
import json
import math
import re
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from viewcam_addon import cameras
from viewcam_addon.cameras import colmap, naming, transforms
from viewcam_addon.cameras.camera import Camera
from viewcam_addon.errors import InputError
from viewcam_addon.files import written_whole
from viewcam_addon.pinhole import Pinhole

SHIFTED = Pinhole((0, -5, 0), (0, 0, 0), (0, 0, 1), (1200.0, 800.0), 640, 360, (300.0, 150.0))
ABOVE = Pinhole((1, 2, 9), (1, 2, 0), (0, 0, 1), (1200.0, 800.0), 640, 360, (300.0, 150.0))
SQUARE = Pinhole((0, -5, 0), (0, 0, 0), (0, 0, 1), 1200.0, 640, 360)

PICTURE = {"fl_x": 1200.0, "fl_y": 800.0, "cx": 300.0, "cy": 210.0, "w": 640, "h": 360}
ANGLES = {"camera_angle_x", "camera_angle_y"}


def test_pictures_of_one_kind_are_described_once_at_the_top():
    document = transforms.document([Camera("a", SHIFTED), Camera("b", ABOVE)])
    assert {key: document[key] for key in PICTURE} == PICTURE
    assert document.keys() == PICTURE.keys() | ANGLES | {"frames"}
    assert [frame.keys() for frame in document["frames"]] == [{"file_path", "transform_matrix", "virtual_pinhole"}] * 2
    assert [frame["file_path"] for frame in document["frames"]] == ["a.png", "b.png"]


def test_pictures_of_several_kinds_are_described_in_every_frame_and_nowhere_else(readers):
    document = transforms.document([Camera("a", SHIFTED), Camera("b", SQUARE)])
    assert document.keys() == {"frames"}
    for frame in document["frames"]:
        assert frame.keys() == PICTURE.keys() | ANGLES | {"file_path", "transform_matrix", "virtual_pinhole"}
    projections = readers["transforms"](json.dumps(document))
    middle = {file: projection(np.zeros((1, 3))).tolist() for file, projection in projections.items()}
    assert middle == {"a.png": [[300, 210]], "b.png": [[320, 180]]}


def test_the_columns_of_the_matrix_are_u_v_w_and_the_eye():
    (frame,) = transforms.document([Camera("a", ABOVE)])["frames"]
    assert frame["transform_matrix"] == [[0, 1, 0, 1], [-1, 0, 0, 2], [0, 0, 1, 9], [0, 0, 0, 1]]


@pytest.mark.parametrize("axis", "xy")
def test_the_angle_is_the_field_of_view_where_the_principal_point_is_the_middle(axis):
    angles = dict(zip("xy", SQUARE.field_of_view(), strict=False))
    assert math.isclose(transforms.document([Camera("a", SQUARE)])[f"camera_angle_{axis}"], angles[axis], rel_tol=1e-15)
    assert transforms.document([Camera("a", SHIFTED)])["camera_angle_x"] == 2 * math.atan2(320, 1200)


@pytest.mark.parametrize("scale", [1, 16, 128, np.int64(2)])
def test_the_scale_of_the_box_stands_at_the_top_if_it_is_asked_for(scale):
    document = transforms.document([Camera("a", SQUARE)], aabb_scale=scale)
    assert document["aabb_scale"] == scale and json.loads(transforms.text(document)) == document


@pytest.mark.parametrize("scale", [0, 3, 256, -2, True, 2.5, "16"])
def test_a_scale_that_instant_ngp_does_not_take_is_refused(scale):
    with pytest.raises(InputError, match="aabb_scale is"):
        transforms.document([Camera("a", SQUARE)], aabb_scale=scale)


@pytest.mark.parametrize("views", [[SHIFTED, ABOVE], [SHIFTED, SQUARE]], ids=["one kind", "two kinds"])
def test_the_file_holds_the_document_bit_for_bit_one_frame_a_line(tmp_path, views):
    views = [Camera(f"images/{i} é", pinhole) for i, pinhole in enumerate(views)]
    path = tmp_path / "new" / "transforms.json"
    cameras.save(views, path, "transforms")
    text = path.read_bytes().decode()
    assert json.loads(text) == transforms.document(views)
    assert sum("file_path" in line for line in text.splitlines()) == len(views)
    assert "-0.0" not in text and "\r" not in text and text.endswith("}\n")
    assert [file.name for file in path.parent.iterdir()] == ["transforms.json"]


def test_a_refused_camera_leaves_the_older_file(tmp_path):
    path = tmp_path / "transforms.json"
    path.write_text("older")
    with pytest.raises(InputError):
        cameras.save([Camera("a", SQUARE)] * 2, path, "transforms")
    assert path.read_text() == "older" and len(list(tmp_path.iterdir())) == 1


PINHOLE = Pinhole((7, -6, 4), (0, 0, 1), (0, 0, 1), 1200.0, 640, 360)
MIRRORED = Pinhole((7, -6, 4), (0, 0, 1), (0, 0, 1), 1200.0, 640, 360, mirrored=True)

FORMATS = pytest.mark.parametrize("make", [transforms.document, colmap.texts], ids=["transforms", "colmap"])


def refusal(make, *arguments):
    with pytest.raises(InputError) as caught:
        make(*arguments)
    sentence = str(caught.value)
    assert "\n" not in sentence and len(sentence) < 300, sentence
    return sentence


@pytest.mark.parametrize(
    "file", ["a.png", "images/left eye.png", "a/b/c.exr", "Žluťoučký/été.png", "...png", "left\u00a0eye.png"]
)
def test_a_path_inside_the_folder_is_taken(file):
    naming.check_image(file)


@pytest.mark.parametrize(
    "file",
    ["", "/etc/a.png", "../a.png", "a/../../b.png", "a//b.png", "./a.png", "a/", "a\\b.png", "a\nb.png", "\ud800", None, 7],
)
def test_a_path_that_is_none_or_leaves_the_folder_is_refused(file):
    assert "file is" in refusal(naming.check_image, file)


@given(st.text(max_size=12))
def test_any_text_is_a_path_on_one_line_or_refused(text):
    try:
        naming.check_image(text)
    except InputError:
        return
    assert text.splitlines() == [text] and ".." not in text.split("/")


@FORMATS
def test_no_pictures_make_no_dataset(make):
    assert "no picture" in refusal(make, [])


@FORMATS
def test_two_pictures_of_one_file_are_refused_by_its_name(make):
    assert "a.png would be" in refusal(make, [Camera("a", PINHOLE), Camera("b", PINHOLE), Camera("a", PINHOLE)])


@FORMATS
def test_mirrored_cameras_are_refused_by_name_however_many(make):
    views = [Camera("fine", PINHOLE), *(Camera(f"{i}", MIRRORED) for i in range(1000))]
    sentence = refusal(make, views)
    assert "mirrored" in sentence and "0.png, 1.png, 2.png and 997 more" in sentence and "fine" not in sentence


@pytest.mark.parametrize("file", ["left eye.png", "left\u00a0eye.png"], ids=["plain", "non-breaking"])
def test_a_name_with_a_space_is_refused_by_colmap_alone(file):
    views = [Camera("view", PINHOLE, image=file)]
    assert file in refusal(colmap.texts, views)
    assert transforms.document(views)["frames"][0]["file_path"] == file


any_float = st.floats(allow_nan=False, allow_infinity=False)
any_triple = st.tuples(any_float, any_float, any_float)


@FORMATS
@given(any_triple, any_triple, any_triple, st.floats(min_value=5e-324, allow_infinity=False), st.tuples(any_float, any_float))
def test_any_camera_is_written_in_finite_numbers_or_refused(make, eye, look_at, up, distance, point):
    assume(eye != look_at and any(up))
    try:
        content = repr(make([Camera("a", Pinhole(eye, look_at, up, distance, 640, 360, point))]))
    except InputError as error:
        assert make is colmap.texts and "translation" in str(error)
    else:
        assert not re.search(r"\b(nan|inf)\b", content)


def test_an_eye_whose_translation_float64_can_not_hold_is_refused():
    far = Pinhole((1.7e308, 1.7e308, 1.7e308), (0, 0, 0), (0, 0, 1), 1200.0, 640, 360)
    assert "translation" in refusal(colmap.texts, [Camera("a", far)])


AHEAD = Pinhole((0, -5, 0), (0, 0, 0), (0, 0, 1), 1200.0, 640, 360)
ABOVE_SQUARE = Pinhole((1, 2, 9), (1, 2, 0), (0, 0, 1), 1200.0, 640, 360)
WIDE_PIXELS = Pinhole((0, -5, 0), (0, 0, 0), (0, 0, 1), (1200.0, 800.0), 640, 360, (300.0, 150.0))
THREE = [Camera("a", AHEAD), Camera("below/b", WIDE_PIXELS), Camera("c", ABOVE_SQUARE)]

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
        "1 PINHOLE 640 360 1200.0 1200.0 320.0 180.0",
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
    # The rounding of the length: half of 4 roundings of the sum of squares, one of the root, and one of each quotient.
    assert excess <= 2 * 4 * UNIT * (1 + UNIT), f"|q|² − 1 = {float(excess):.3g}"
    assert next(number for number in quaternion if number) > 0
    assert "-0.0" not in texts["images.txt"].split()


def test_the_numbers_have_the_digits_of_float64():
    pinhole = Pinhole((0.1, 1e-7, 1 / 3), (1e6, 2, 3), (0, 0, 1), 1e5 / 3, 640, 360, (1 / 7, 2.0**-30))
    camera = content(colmap.texts([Camera("a", pinhole)])["cameras.txt"])[0].split(" ")[4:]
    assert [float(text) for text in camera] == [1e5 / 3, 1e5 / 3, 1 / 7, 360 - 2.0**-30]


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
