"""Whatever the pose, each format's reader sees points at the pixels where the pinhole itself sees them.

And it must be able to fail: every mistake that is made between these conventions is caught in every format.
"""

import dataclasses
import json
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from viewcam_addon import cameras
from viewcam_addon.cameras import axes, colmap, transforms
from viewcam_addon.cameras import sidecar as record
from viewcam_addon.cameras.camera import Camera
from viewcam_addon.intrinsics import CameraData
from viewcam_addon.pinhole import Pinhole

FILE = "images/one.png"
coordinates = st.floats(-100, 100)
triples = st.tuples(coordinates, coordinates, coordinates)


@st.composite
def poses(draw):
    """eye, look_at and up; every third straight down or up, exactly or nearly."""
    look_at, up = draw(triples), draw(triples)
    if draw(st.integers(0, 2)):
        return draw(triples), look_at, up
    eye = (look_at[0], look_at[1], look_at[2] + draw(st.sampled_from([-1.0, 1.0])) * draw(st.floats(0.5, 100)))
    return eye, look_at, (draw(st.sampled_from([0.0, 1e-12, -1e-6])), 0.0, draw(st.sampled_from([-2.0, 1.0])))


@st.composite
def pinholes(draw, mirrored=False):
    eye, look_at, up = draw(poses())
    assume(eye != look_at and any(up))
    size = draw(st.integers(1, 8192)), draw(st.integers(1, 8192))
    d = draw(st.floats(1, 1e5))
    distance = d if draw(st.booleans()) else (d, d * draw(st.floats(0.1, 10)))
    point = draw(st.none() | st.tuples(st.floats(-1e4, 1e4), st.floats(-1e4, 1e4)))
    return Pinhole(eye, look_at, up, distance, *size, point, mirrored=mirrored and draw(st.booleans()))


def points_before(pinhole, seed):
    """(16, 3) points at depths from 1/16 to 1000, within and beside the picture."""
    random = np.random.default_rng(seed)
    depth = 2 ** random.uniform(-4, 10, (16, 1))
    across = random.uniform(-2, 2, (16, 2))
    u, v, w = pinhole.basis()
    return np.array(pinhole.eye) + depth * (across[:, :1] * u + across[:, 1:] * v - w)


seeds = st.integers(0, 2**32 - 1)


@given(pinholes(), seeds)
def test_nerfstudio_sees_what_the_pinhole_sees(readers, hold_together, pinhole, seed):
    text = json.dumps(transforms.document([Camera("view", pinhole, image=FILE)]))
    hold_together(readers["transforms"](text)[FILE], pinhole, points_before(pinhole, seed))


@given(pinholes(), seeds)
def test_colmap_sees_what_the_pinhole_sees(readers, hold_together, pinhole, seed):
    texts = colmap.texts([Camera("view", pinhole, image=FILE)])
    hold_together(readers["colmap"](texts)[FILE], pinhole, points_before(pinhole, seed))


@given(pinholes(mirrored=True), seeds)
def test_the_matrices_of_a_sidecar_see_what_the_pinhole_sees_mirrored_or_not(readers, hold_together, pinhole, seed):
    document = json.loads(json.dumps(record.record(pinhole)))
    hold_together(readers["record"](document)[""], pinhole, points_before(pinhole, seed))


@pytest.mark.parametrize("height", [-5.0, 5.0])
def test_straight_down_and_up_are_among_the_poses(readers, hold_together, height):
    pinhole = Pinhole((1, 2, height), (1, 2, 0), (0, 0, 1), 500.0, 320, 180)
    assert pinhole.is_singular
    points = points_before(pinhole, 1)
    hold_together(readers["colmap"](colmap.texts([Camera("view", pinhole, image=FILE)]))[FILE], pinhole, points)
    hold_together(
        readers["transforms"](json.dumps(transforms.document([Camera("view", pinhole, image=FILE)])))[FILE], pinhole, points
    )


# --- The sidecar's record of a camera: from it the pinhole comes back, and its matrices say the same as the datasets
PINHOLE = Pinhole((7, -6, 4), (0.5, 0.2, 1), (0.1, 0, 1), (1200.0, 900.0), 640, 360, (300.0, 150.0))
MIRRORED = dataclasses.replace(PINHOLE, mirrored=True)


def through_json(*arguments):
    return json.loads(json.dumps(record.record(*arguments), allow_nan=False))


@pytest.mark.parametrize("pinhole", [PINHOLE, MIRRORED], ids=["plain", "mirrored"])
def test_the_pinhole_comes_back_bit_for_bit(pinhole):
    assert Pinhole(**through_json(pinhole)["camera"]) == pinhole


def test_the_record_can_be_pasted_as_a_camera():
    (camera,) = cameras.read(json.dumps(record.record(PINHOLE)))
    assert camera.pinhole == PINHOLE


def test_the_two_matrices_are_inverse_to_each_other_but_for_the_direction_of_y_and_z():
    document = through_json(PINHOLE)
    turned = np.array(document["cameraToWorld"]) @ np.diag([1.0, -1, -1, 1])
    # Four roundings of products of numbers up to |e| ≈ 10, and axes that are within 4e-16 of perpendicular.
    assert np.abs(turned @ document["worldToCamera"] - np.eye(4)).max() < 10 * (4 * 2.0**-53 + 2 * 4e-16)
    assert document["cameraToWorld"] == transforms.document([Camera("a", PINHOLE)])["frames"][0]["transform_matrix"]


def test_a_mirrored_camera_has_its_x_to_the_left_and_a_negative_determinant():
    plain, mirrored = np.array(through_json(PINHOLE)["worldToCamera"]), np.array(through_json(MIRRORED)["worldToCamera"])
    assert (mirrored == np.diag([-1, 1, 1, 1]) @ plain).all()
    assert np.linalg.det(plain) > 0 > np.linalg.det(mirrored)


def test_k_has_its_rows_from_the_top():
    assert through_json(PINHOLE)["K"] == [[1200, 0, 300], [0, 900, 360 - 150], [0, 0, 1]]


def test_lens_and_sensor_are_there_if_they_are_given():
    data = CameraData(50.0, 36.0, 24.0, "VERTICAL", 0.1, -0.2)
    assert CameraData(**through_json(PINHOLE, data)["blender"]) == data
    assert "blender" not in through_json(PINHOLE)


def test_it_says_what_its_matrices_mean():
    assert "upper left corner" in record.record(PINHOLE)["convention"]


# --- docs/datasets.md: its program runs, and writes what the page shows
PAGE = Path(__file__).parents[2] / "docs" / "datasets.md"
BLOCK = re.compile(r"```(\w+)\n(.*?)```", re.S)


@pytest.fixture(scope="module")
def blocks():
    """Language → what stands in each block of it."""
    actual = BLOCK.findall(PAGE.read_text(encoding="utf-8"))
    return {language: [text for other, text in actual if other == language] for language, _ in actual}


@pytest.fixture(scope="module")
def batch(blocks, tmp_path_factory):
    """The folder in which the page's program ran."""
    folder = tmp_path_factory.mktemp("batch")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        (program,) = blocks["python"]
        exec(compile(program, str(PAGE), "exec"), {})
    return folder


def written(batch):
    return {str(path.relative_to(batch)): path.read_text(encoding="utf-8") for path in batch.rglob("*.*") if path.is_file()}


def test_the_program_writes_what_the_page_shows(blocks, batch):
    files = written(batch)
    assert files.keys() == {"transforms.json", *(f"sparse/0/{name}.txt" for name in ("cameras", "images", "points3D"))}
    transforms, sidecar = blocks["json"]
    assert transforms == files["transforms.json"]
    assert blocks["text"] == [files["sparse/0/cameras.txt"], files["sparse/0/images.txt"]]
    sidecar_values = json.loads(sidecar)
    pinhole = Pinhole(**sidecar_values["camera"])
    assert sidecar_values | {"convention": record.CONVENTION} == json.loads(json.dumps(record.record(pinhole)))
    assert pinhole.eye == (0, -5, 0) and sidecar_values["worldToCamera"] == axes.world_to_camera(pinhole)


def test_what_the_page_shows_the_readers_read(readers, batch):
    """Both cameras look at the origin, which is at their principal points."""
    files = written(batch)
    for projections in (
        readers["transforms"](files["transforms.json"]),
        readers["colmap"]({name.removeprefix("sparse/0/"): text for name, text in files.items()}),
    ):
        assert projections.keys() == {"images/front.png", "images/above.png"}
        for projection in projections.values():
            assert projection([[0.0, 0.0, 0.0]]).tolist() == [[320, 180]]


STRAIGHT_DOWN = Pinhole((1, 2, 9), (1, 2, 0), (0, 0, 1), (1200.0, 900.0), 640, 360, (300.0, 150.0))
POINTS = np.array([[0.0, 0, 1], [1, 0, 0.5], [0, 2, 2], [-1, -0.5, 0]])


def in_columns(matrix, change):
    """A 4 × 4 matrix whose 3 × 3 part went through a function."""
    matrix = np.array(matrix)
    matrix[:3, :3] = change(matrix[:3, :3])
    return matrix.tolist()


# Faults of a picture's numbers, under the names of transforms.json.
PICTURE = {
    "half a pixel to the right": lambda values: values | {"cx": values["cx"] + 0.5},
    "half a pixel upwards": lambda values: values | {"cy": values["cy"] - 0.5},
    "rows from the bottom": lambda values: values | {"cy": values["h"] - values["cy"]},
    "the middle for the principal point": lambda values: values | {"cx": values["w"] / 2, "cy": values["h"] / 2},
    "the two distances exchanged": lambda values: values | {"fl_x": values["fl_y"], "fl_y": values["fl_x"]},
    "width and height exchanged": lambda values: values | {"cx": values["cy"], "cy": values["cx"]},
    "a millionth more distance": lambda values: values | {"fl_x": values["fl_x"] * (1 + 1e-6)},
}
# And with a camera-to-world matrix.
POSE = {
    "transposed": lambda matrix: in_columns(matrix, np.transpose),
    "world to camera": lambda matrix: np.linalg.inv(matrix).tolist(),
    "computer vision's axes": lambda matrix: in_columns(matrix, lambda axes: axes * (1, -1, -1)),
    "two axes of the camera exchanged": lambda matrix: in_columns(matrix, lambda axes: axes[:, [1, 0, 2]] * (-1, 1, 1)),
    "two axes of the world exchanged": lambda matrix: (np.array(matrix)[[0, 2, 1, 3]] * [[1], [1], [-1], [1]]).tolist(),
    "mirrored": lambda matrix: in_columns(matrix, lambda axes: axes * (-1, 1, 1)),
    "digits of float32": lambda matrix: np.float32(matrix).astype(float).tolist(),
}
# And with an image's line of COLMAP.
LINE = {
    "x y z w": lambda q, t: ([*q[1:], q[0]], t),
    "the inverse rotation": lambda q, t: ([q[0], -q[1], -q[2], -q[3]], t),
    "one sign": lambda q, t: ([q[0], q[1], -q[2], q[3]], t),
    "the eye for the translation": lambda q, t: (q, list(PINHOLE.eye)),
    "OpenGL's axes": lambda q, t: ([-q[1], q[0], -q[3], q[2]], [t[0], -t[1], -t[2]]),
    "axes exchanged": lambda q, t: (q, [t[1], t[0], t[2]]),
    "six digits": lambda q, t: ([float(f"{number:.6g}") for number in q], t),
}


@pytest.fixture(scope="module")
def held(readers, hold_together):
    """held(format, document): fail unless the document's picture is PINHOLE's."""
    return lambda kind, document: hold_together(next(iter(readers[kind](document).values())), PINHOLE, POINTS)


def picture_and_frame():
    document = transforms.document([Camera("a", PINHOLE)])
    (frame,) = document.pop("frames")
    return document, frame


def with_angles(values):
    """The angles go with the lens: a fault of theirs alone is another one."""
    sides = (("x", "w"), ("y", "h"))
    return values | {f"camera_angle_{axis}": 2 * np.arctan(values[side] / 2 / values[f"fl_{axis}"]) for axis, side in sides}


def test_without_a_fault_all_of_them_hold(held):
    picture, frame = picture_and_frame()
    held("transforms", json.dumps(picture | {"frames": [frame]}))
    held("transforms", json.dumps(with_angles(picture) | {"frames": [frame]}))
    held("colmap", colmap.texts([Camera("a", PINHOLE)]))
    held("record", record.record(PINHOLE))


@pytest.mark.parametrize("fault", PICTURE)
def test_a_wrong_picture_in_transforms_json_is_caught(held, fault):
    picture, frame = picture_and_frame()
    with pytest.raises(AssertionError, match="pixels off"):
        held("transforms", json.dumps(with_angles(PICTURE[fault](picture)) | {"frames": [frame]}))


@pytest.mark.parametrize("axis", "xy")
def test_a_wrong_angle_in_transforms_json_is_caught(held, axis):
    picture, frame = picture_and_frame()
    across = dict(zip("xy", PINHOLE.field_of_view(), strict=False))[axis]
    with pytest.raises(AssertionError, match=f"camera_angle_{axis}"):
        held("transforms", json.dumps(picture | {f"camera_angle_{axis}": across, "frames": [frame]}))


@pytest.mark.parametrize("fault", POSE)
def test_a_wrong_matrix_in_transforms_json_is_caught(held, fault):
    picture, frame = picture_and_frame()
    wrong = POSE[fault](frame["transform_matrix"])
    with pytest.raises(AssertionError, match=r"pixels off|no rotation"):
        held("transforms", json.dumps(picture | {"frames": [frame | {"transform_matrix": wrong}]}))


@pytest.mark.parametrize("places", ["both", "parted"])
def test_a_picture_said_where_a_reader_does_not_look_is_caught(held, places):
    picture, frame = picture_and_frame()
    frame |= {"fl_x": 1.0} if places == "both" else {"cx": picture.pop("cx")}
    with pytest.raises(AssertionError, match=r"hides|divides"):
        held("transforms", json.dumps(picture | {"frames": [frame]}))


@pytest.mark.parametrize("fault", PICTURE)
def test_a_wrong_camera_of_colmap_is_caught(held, fault):
    picture, _ = picture_and_frame()
    wrong = PICTURE[fault](picture)
    line = " ".join(["1 PINHOLE", *(repr(wrong[key]) for key in ("w", "h", "fl_x", "fl_y", "cx", "cy"))])
    with pytest.raises(AssertionError, match="pixels off"):
        held("colmap", colmap.texts([Camera("a", PINHOLE)]) | {"cameras.txt": line + "\n"})


@pytest.mark.parametrize("fault", LINE)
def test_a_wrong_pose_of_colmap_is_caught(held, fault):
    texts = colmap.texts([Camera("a", PINHOLE)])
    number, *pose, camera, name = texts["images.txt"].splitlines()[-2].split(" ")
    pose = [float(text) for text in pose]
    quaternion, translation = LINE[fault](pose[:4], pose[4:])
    line = " ".join([number, *map(repr, (*quaternion, *translation)), camera, name])
    with pytest.raises(AssertionError, match=r"pixels off|no rotation"):
        held("colmap", texts | {"images.txt": line + "\n\n"})


def test_a_missing_line_of_image_points_is_caught(held):
    texts = colmap.texts([Camera("a", PINHOLE), Camera("b", PINHOLE)])
    with pytest.raises(AssertionError, match="image points"):
        held("colmap", texts | {"images.txt": texts["images.txt"].replace("\n\n", "\n")})


@pytest.mark.parametrize("fault", PICTURE)
def test_a_wrong_k_of_a_sidecar_is_caught(held, fault):
    wrong = PICTURE[fault](picture_and_frame()[0])
    k = [[wrong["fl_x"], 0, wrong["cx"]], [0, wrong["fl_y"], wrong["cy"]], [0, 0, 1]]
    with pytest.raises(AssertionError, match="pixels off"):
        held("record", record.record(PINHOLE) | {"K": k})


@pytest.mark.parametrize("fault", POSE)
def test_a_wrong_matrix_of_a_sidecar_is_caught(held, fault):
    document = record.record(PINHOLE)
    with pytest.raises(AssertionError, match="pixels off"):
        held("record", document | {"worldToCamera": POSE[fault](document["worldToCamera"])})


@pytest.mark.parametrize("pinhole", [PINHOLE, STRAIGHT_DOWN], ids=["aslant", "straight down"])
@pytest.mark.parametrize("flip", [(1, -1, -1), (-1, 1, -1), (-1, -1, 1)], ids=str)
def test_a_half_turn_of_the_camera_is_caught_wherever_it_looks(readers, hold_together, pinhole, flip):
    document = record.record(pinhole)
    document["worldToCamera"] = (np.diag([*flip, 1.0]) @ document["worldToCamera"]).tolist()
    with pytest.raises(AssertionError, match="pixels off"):
        hold_together(readers["record"](document)[""], pinhole, POINTS)
