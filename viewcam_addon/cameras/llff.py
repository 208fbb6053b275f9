"""LLFF's poses_bounds.npy: 17 numbers a picture, of which 15 are a 3 × 5 matrix and two the nearest and farthest depth.

Three columns are the camera's axes **down, right, away from the view**, one is the eye, one is height, width and focal length.
The principal point is the middle. Pictures are named by their order, sorted, in the folder images beside it.

Source: LLFF's README.md and llff/poses/pose_utils.py.
"""

import numpy as np

from .. import npy
from ..errors import InputError
from . import axes, naming
from .camera import Camera, Options
from .source import Source, pixels

TITLE = "LLFF poses_bounds.npy"
FILE = "poses_bounds.npy"

_FOLDERS = ("images", "images_4", "images_8")


def recognizes(source: Source) -> bool:
    return _array(source) is not None


def read(source: Source, _options: Options) -> list[Camera]:
    if (rows := _array(source)) is None:
        return []
    images = naming.in_order(source.path if source.is_folder or not source.path else source.path.parent, _FOLDERS, len(rows))
    cameras = []
    for index, row in enumerate(rows):
        what = f"picture {index}"
        matrix = row[:15].reshape(3, 5)
        height, width = (pixels(f"the size of {what}", float(number)) for number in matrix[:2, 4])
        focal = float(matrix[2, 4])
        if not focal > 0:
            raise InputError(f"{what} has the focal length {focal:g}: give one above 0")
        plane = axes.view_plane(focal, focal, width / 2, height / 2, (width, height))
        down, right, back, eye = matrix[:, :4].T
        pinhole, notes = axes.pinhole(np.column_stack([right, -down, back, eye]), plane, what)
        name = naming.stem(images[index]) if images else f"{index:03d}"
        cameras.append(Camera(name, pinhole, True, notes, images[index] if images else None))
    return cameras


def _array(source: Source) -> np.ndarray | None:
    file = source.file(FILE) if source.is_folder else source
    if file is None or file.data[:6] != b"\x93NUMPY":
        return None
    try:
        array = npy.read(file.data)
    except ValueError:
        return None
    if array.ndim != 2 or array.shape[1] not in (15, 17) or not len(array):
        return None
    return array.astype(np.float64)
