"""Cameras as Unity has them, as JSON: out only.

`position` and `rotation` (a quaternion x, y, z, w) in a left-handed world, x to the right, y up, z forward: the world's z is
negated on the way, so a world with z up is to be turned as well (axes y_up). `fieldOfView` is the degrees of the height, where
that says the camera; `worldToCameraMatrix` and `projectionMatrix`, rows, say any, with OpenGL's axes and clip space, as Unity's
Camera has them.

Source: Unity's scripting reference, Camera. Rejected: lensShift, whose sign no document says.
"""

import json
from collections.abc import Sequence

import numpy as np

from ..errors import InputError
from . import axes
from .camera import Camera, Options
from .matrices import projection, view
from .unreal import centered_field_of_view

TITLE = "Unity cameras (JSON)"
SUFFIX = ".json"

_TO_LEFT_HANDED = np.diag([1.0, 1, -1, 1])


def write(cameras: Sequence[Camera], options: Options) -> str:
    records, before = [], axes.UNTURNED
    for camera in cameras:
        u, v, w = ((a, b, -c) for a, b, c in camera.pinhole.axes())
        forward = tuple(-x for x in w)
        before = axes.continued(axes.quaternion([*zip(u, v, forward, strict=True)]), before)
        records.append(_written(camera, before))
    return json.dumps({"cameras": records}, indent=1) + "\n"


def _written(camera: Camera, quaternion: axes.Quaternion) -> dict:
    pinhole = camera.pinhole
    qw, qx, qy, qz = quaternion
    try:
        angle = {"fieldOfView": centered_field_of_view(camera, "Unity")[1]}
    except InputError:
        angle = {}
    return {
        "name": camera.name,
        "width": pinhole.width,
        "height": pinhole.height,
        "position": [pinhole.eye[0], pinhole.eye[1], -pinhole.eye[2] + 0.0],
        "rotation": [qx, qy, qz, qw],
        **angle,
        "worldToCameraMatrix": (view(camera) @ _TO_LEFT_HANDED + 0.0).tolist(),
        "projectionMatrix": projection(camera).tolist(),
    }
