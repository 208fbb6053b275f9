"""What the sidecar of a picture says of its camera: the exact values, and what others would have to derive from them.

Unlike a dataset's file it can say that a camera is mirrored: the matrices then have a determinant of −1.
"""

import dataclasses
from typing import Any

from ..intrinsics import CameraData
from ..pinhole import Pinhole
from .axes import camera_to_world, intrinsics, world_to_camera

CONVENTION = (
    "K times the first three numbers of worldToCamera times (x, y, z, 1) is depth times (column, row, 1): column vectors; "
    "camera x right, y down, z into the view; pixels from the upper left corner of the picture, the first one's centre at "
    "(0.5, 0.5). cameraToWorld: camera x right, y up, z away from the view, as Blender's matrix_world"
)


def record(pinhole: Pinhole, camera_data: CameraData | None = None) -> dict[str, Any]:
    """The camera as JSON has it, every number a float64 to the bit.

    camera_data : lens, sensor and shift, where it is a Blender camera.

    Returns `camera` (the keys and conventions of a scene file: `Pinhole(**record["camera"])` is the pinhole), `cameraToWorld`
    and `worldToCamera` (4 × 4), `K` (3 × 3), `convention` (what these mean, see axes.py), and `blender` (the fields of
    `CameraData`) if that is given.

    Raises
    ------
    InputError
        if the translation from the world's origin to the camera is beyond float64.
    """
    camera = {key: list(value) if isinstance(value, tuple) else value for key, value in dataclasses.asdict(pinhole).items()}
    return {
        "camera": camera,
        "cameraToWorld": camera_to_world(pinhole),
        "worldToCamera": world_to_camera(pinhole),
        "K": intrinsics(pinhole),
        "convention": CONVENTION,
        **({} if camera_data is None else {"blender": dataclasses.asdict(camera_data)}),
    }
