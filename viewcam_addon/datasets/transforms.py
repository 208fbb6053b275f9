"""transforms.json: cameras as the original NeRF had them, and instant-ngp and nerfstudio made them more precise.

**Pose.** `transform_matrix` is the camera in the world, its columns the camera's axes, x right, y up, z away from the view: u,
v, w and the eye. It counts in whatever the scene counts in.

**Picture.** `fl_x`, `fl_y` are the view-plane distance in pixel widths and heights, `cx`, `cy` the principal point from the
left and the top edge, where the first pixel's centre is (0.5, 0.5), and `w`, `h` pixels. `camera_angle_x` = 2 atan(w / 2
fl_x), for readers that know nothing else, is the field of view if the principal point is the middle, which they take for
granted: it isn't `Pinhole.field_of_view` where the camera is shifted. The original NeRF shoots its rays through the pixels'
corners (bmild/nerf #24), which no file can mend.

**Where they stand.** At the top if all pictures have the same, else in every frame, and always together: nerfstudio takes what
is at the top before it looks into a frame, and instant-ngp reads cx and w from the same object.

Sources: nerfstudio's docs/quickstart/data_conventions.md, nerfstudio/data/dataparsers/nerfstudio_dataparser.py and
cameras/cameras.py (get_image_coords, _generate_rays_from_coords); instant-ngp's docs/nerf_dataset_tips.md, src/nerf_loader.cu
(read_lens, read_focal_length) and include/neural-graphics-primitives/common_device.cuh (pixel_to_ray_pinhole).
"""

import json
import math
import os
from collections.abc import Iterable
from typing import Any

from .. import checks
from ..errors import InputError
from ..files import written_whole
from ..pinhole import Pinhole
from . import View, checked
from .matrices import camera_to_world, intrinsics

FILE = "transforms.json"
AABB_SCALES = tuple(2**exponent for exponent in range(8))


def write(path: str | os.PathLike[str], views: Iterable[View], aabb_scale: int | None = None) -> None:
    """Write the `document`, one frame a line, whole or not at all; the same views give the same bytes.

    Raises
    ------
    InputError
        as `document` does, or if the folder can't be written or the disk is full.
    """
    content = document(views, aabb_scale)
    frames = ",\n".join(f"  {json.dumps(frame, allow_nan=False)}" for frame in content.pop("frames"))
    head = "".join(f" {json.dumps(key)}: {json.dumps(value, allow_nan=False)},\n" for key, value in content.items())
    with written_whole(path) as temporary:
        temporary.write_text(f'{{\n{head} "frames": [\n{frames}\n ]\n}}\n', encoding="utf-8", newline="\n")


def document(views: Iterable[View], aabb_scale: int | None = None) -> dict[str, Any]:
    """What the file holds, frames in the order of the views.

    aabb_scale : for instant-ngp alone: how many times the unit cube it looks for the scene in. Not said if None.

    Raises
    ------
    InputError
        if there is no view, two are of one file or one is mirrored, or if the scale is not one that instant-ngp takes.
    """
    views = checked(views, FILE)
    if aabb_scale is not None and checks.whole("aabb_scale", aabb_scale) not in AABB_SCALES:
        raise InputError(f"aabb_scale is {aabb_scale}: give a power of two from 1 to {AABB_SCALES[-1]}")
    pictures = [_picture(view.pinhole) for view in views]
    shared = all(picture == pictures[0] for picture in pictures)
    return {
        **(pictures[0] if shared else {}),
        **({} if aabb_scale is None else {"aabb_scale": int(aabb_scale)}),
        "frames": [
            {
                "file_path": view.file,
                **({} if shared else picture),
                "transform_matrix": camera_to_world(view.pinhole),
            }
            for view, picture in zip(views, pictures, strict=True)
        ],
    }


def _picture(pinhole: Pinhole) -> dict[str, float]:
    (fl_x, _, cx), (_, fl_y, cy), _ = intrinsics(pinhole)
    return {
        "camera_angle_x": 2 * math.atan2(pinhole.width / 2, fl_x),
        "camera_angle_y": 2 * math.atan2(pinhole.height / 2, fl_y),
        "fl_x": fl_x,
        "fl_y": fl_y,
        "cx": cx,
        "cy": cy,
        "w": pinhole.width,
        "h": pinhole.height,
    }
