"""The sidecar's record of a camera: from it the pinhole comes back, and its matrices say the same as the datasets."""

import dataclasses
import json

import numpy as np
import pytest

from viewcam_addon import cameras
from viewcam_addon.cameras import sidecar as record
from viewcam_addon.cameras import transforms
from viewcam_addon.cameras.camera import Camera
from viewcam_addon.intrinsics import CameraData
from viewcam_addon.pinhole import Pinhole

PINHOLE = Pinhole((7, -6, 4), (0.5, 0.2, 1), (0.1, 0, 1), (1200.0, 900.0), 640, 360, (300.0, 150.0))
MIRRORED = dataclasses.replace(PINHOLE, mirrored=True)


def through_json(*given):
    return json.loads(json.dumps(record.record(*given), allow_nan=False))


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
