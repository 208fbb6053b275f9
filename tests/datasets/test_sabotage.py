"""The readers must be able to fail: every mistake that is made between these conventions is caught in every format."""

import json

import numpy as np
import pytest

from viewcam_addon.cameras import colmap, transforms
from viewcam_addon.cameras import sidecar as record
from viewcam_addon.cameras.camera import Camera
from viewcam_addon.pinhole import Pinhole

# Not symmetric in anything: pixels, principal point, roll.
PINHOLE = Pinhole((7, -6, 4), (0.5, 0.2, 1), (0.1, 0, 1), (1200.0, 900.0), 640, 360, (300.0, 150.0))
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
