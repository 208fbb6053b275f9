"""Infinigen's camview_….npz: a camera of a rig at a frame, a file each, in the folder frames/camview/camera_N.

`K`, whose (0, 0) is the picture's corner (the principal point is half the size), `T`, 4 × 4, camera to world with x right, y
down, z into the view, and `HW`, the height and the width. Older files have no HW.

Source: infinigen's infinigen/core/placement/camera.py (save_camera_parameters) and core/util/camera.py
(get_calibration_matrix_K_from_blender).
"""

from pathlib import Path

from ..errors import InputError
from . import axes, opencv
from .camera import Camera, Options
from .source import Source, pixels

TITLE = "camview of Infinigen (NPZ)"
SUFFIX = ".npz"
SEVERAL = "a folder"

_SHAPES = {"K": (3, 3), "T": (4, 4)}


def recognizes(source: Source) -> bool:
    return all(name in source.npz and source.npz[name].shape == shape for name, shape in _SHAPES.items())


def read(source: Source, options: Options) -> list[Camera]:
    name = Path(source.name).stem if source.path else "camview"
    k, pose, sides = source.npz["K"], source.npz["T"], source.npz.get("HW")
    if sides is None:
        size = options.size_or_refuse(source.name)
    elif sides.shape == (2,):
        height, width = (pixels(f"HW of {source.name}", side) for side in sides.tolist())
        size = width, height
    else:
        raise InputError(f"HW of {source.name} has the shape {sides.shape}: it should be height and width")
    plane = opencv.plane_of_k(k.ravel().tolist(), size, opencv.half_pixel(options, "corner"), "K")
    pinhole, notes = axes.pinhole(axes.of_opencv(pose), plane, name)
    return [Camera(name, pinhole, sides is not None, notes)]
