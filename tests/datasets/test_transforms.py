"""transforms.json: what stands where, and that its bytes are those of the same cameras anywhere."""

import json
import math

import numpy as np
import pytest

from viewcam_addon import cameras
from viewcam_addon.cameras import transforms
from viewcam_addon.cameras.camera import Camera
from viewcam_addon.errors import InputError
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
