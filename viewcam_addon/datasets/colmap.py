"""A COLMAP model as text: cameras.txt, images.txt, and a points3D.txt without points, since none are known.

**Cameras.** One line for each set of intrinsics that the pictures have: SIMPLE_PINHOLE (f, cx, cy) where pixels are square,
else PINHOLE (fx, fy, cx, cy). The upper left corner of the picture is (0, 0), its first pixel's centre (0.5, 0.5).

**Images.** Two lines each, the second one empty: it would list image points. The pose takes world space to the camera's x
right, y down, z into the view, as a unit quaternion (w first, Hamilton's) and a translation. Of the two quaternions of a
rotation it is the one whose first number that is not 0 is positive. All numbers have as many digits as bring back the same
float64.

rigs.txt and frames.txt, new in COLMAP 3.12, are left out: without them each image is a frame of its own, as older readers take
it.

Sources: COLMAP's doc/format.rst, doc/database.rst (pixel centres) and src/colmap/scene/reconstruction_io_text.cc (what parts a
line: a name ends at a space).
"""

import contextlib
import math
import os
from collections.abc import Iterable
from pathlib import Path

from ..errors import InputError
from ..files import written_whole
from ..pinhole import Pinhole
from . import View, checked, named
from .matrices import Rows, intrinsics, world_to_camera

Quaternion = tuple[float, float, float, float]


def write(folder: str | os.PathLike[str], views: Iterable[View]) -> None:
    """Write the `texts` into a folder, which is made if need be: each whole or not at all, images.txt last.

    Raises
    ------
    InputError
        as `texts` does, or if the folder can't be written or the disk is full.
    """
    with contextlib.ExitStack() as files:
        for name, text in texts(views).items():
            temporary = files.enter_context(written_whole(Path(folder) / name))
            temporary.write_text(text, encoding="utf-8", newline="\n")


def check_names(files: Iterable[str]) -> None:
    """Raise InputError if a picture's name holds a space, of any width, since some readers part there, too."""
    parted = [file for file in files if any(map(str.isspace, file))]
    if parted:
        raise InputError(f"a COLMAP model can't name a picture with a space, as {named(parted)}: rename it")


def texts(views: Iterable[View]) -> dict[str, str]:
    """Name of the file → what it holds; cameras and images are numbered from 1, in the order of the views.

    Raises
    ------
    InputError
        if there is no view, two are of one file, one is mirrored, or the name of one holds a space.
    """
    views = checked(views, "a COLMAP model")
    check_names([view.file for view in views])
    numbers: dict[str, int] = {}
    images = []
    for number, view in enumerate(views, start=1):
        camera = numbers.setdefault(_camera(view.pinhole), len(numbers) + 1)
        images.append(f"{number} {_pose(view.pinhole)} {camera} {view.file}\n\n")
    cameras = [f"{number} {camera}\n" for camera, number in numbers.items()]
    return {
        "images.txt": "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME\n# POINTS2D[] as X Y POINT3D_ID\n" + "".join(images),
        "cameras.txt": "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n" + "".join(cameras),
        "points3D.txt": "# POINT3D_ID X Y Z R G B ERROR TRACK[] as IMAGE_ID POINT2D_IDX\n",
    }


def _camera(pinhole: Pinhole) -> str:
    (f_x, _, c_x), (_, f_y, c_y), _ = intrinsics(pinhole)
    model, focal = ("SIMPLE_PINHOLE", [f_x]) if f_x == f_y else ("PINHOLE", [f_x, f_y])
    return f"{model} {pinhole.width} {pinhole.height} {_spaced(*focal, c_x, c_y)}"


def _pose(pinhole: Pinhole) -> str:
    *rows, _ = world_to_camera(pinhole)
    return _spaced(*quaternion(rows), *(row[3] for row in rows))


def _spaced(*numbers: float) -> str:
    return " ".join(map(repr, numbers))


def quaternion(rotation: Rows) -> Quaternion:
    """(w, x, y, z) of the rotation in the upper left 3 × 3 of a matrix, of length 1 to 4 · 2⁻⁵³.

    Each row below is the quaternion times four times one of its own numbers; the row of the largest number, at least ½, cancels
    nothing.
    """
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = (row[:3] for row in rotation)
    multiples = (
        (1 + xx + yy + zz, zy - yz, xz - zx, yx - xy),
        (zy - yz, 1 + xx - yy - zz, yx + xy, xz + zx),
        (xz - zx, yx + xy, 1 - xx + yy - zz, zy + yz),
        (yx - xy, xz + zx, zy + yz, 1 - xx - yy + zz),
    )
    best = max(range(4), key=lambda i: multiples[i][i])
    w, x, y, z = multiples[best]
    size = math.copysign(math.sqrt(w * w + x * x + y * y + z * z), next(part for part in (w, x, y, z) if part))
    return tuple(part / size + 0.0 for part in (w, x, y, z))
