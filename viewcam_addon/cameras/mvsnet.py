"""MVSNet's cam.txt: R and t in a 4 × 4, K, and the range of depths, a file for each picture in a folder cams.

    extrinsic
    sixteen numbers, world to camera: x right, y down, z into the view
    intrinsic
    nine numbers, K
    nearest depth, interval (number of depths, farthest depth)

BlendedMVS, the preprocessed DTU and Tanks and Temples, and what colmap2mvsnet.py makes of a COLMAP model are such folders; how
deep they see and which pictures make a pair (pair.txt) is no part of a camera. K counts from the picture's corner, as COLMAP's
does: MVSNet puts the center of the first pixel at 0.5. The size is that of the picture, or given.

Rejected: writing it, since a network takes the depths that it searches from there, and no camera knows them.

Source: MVSNet's README.md, mvsnet/homography_warping.py (get_pixel_grids) and colmap2mvsnet.py.
"""

import re
from pathlib import Path

import numpy as np

from ..errors import InputError, counted
from . import axes, naming, opencv
from .camera import Camera, LeftOut, Options
from .source import Source, flat, image_size

TITLE = "MVSNet cam.txt"

_KINDS = ("extrinsic", "intrinsic")
_NAME = "*cam.txt"
_FOLDERS = ("cams", "cams_1", "Cameras", "Cameras/train")
_PICTURES = ("images", "blended_images")
_TEXT = re.compile(r"extrinsic\s([-+\d.eE\s]+)intrinsic\s([-+\d.eE\s]+)")


def recognizes(source: Source) -> bool:
    return any(_TEXT.match(file.text[:4000].lstrip()) for file in _files(source)[:1])


def read(source: Source, options: Options) -> list[Camera]:
    left_out, cameras = LeftOut(), []
    for file in _files(source):
        name = re.sub(r"_?cam$", "", file.path.stem) or "cam" if file.path else "cam"
        with left_out.unless_pinhole(name):
            cameras.append(_camera(file, name, options))
    return left_out.with_notes(cameras)


def _files(source: Source) -> list[Source]:
    if not source.is_folder:
        return [source]
    return next(filter(None, ([*source.files(f"{place}{_NAME}")] for place in ("", *(f"{each}/" for each in _FOLDERS)))), [])


def _camera(file: Source, name: str, options: Options) -> Camera:
    matched = _TEXT.match(file.text[:4000].lstrip())
    what = f"the camera {name}"
    if not matched:
        raise InputError(f"{file.name} has no extrinsic and intrinsic of numbers: export it again")
    extrinsic, intrinsic = (flat(f"the {kind} of {what}", part) for kind, part in zip(_KINDS, matched.groups(), strict=True))
    if len(extrinsic) not in (12, 16) or len(intrinsic) < 9:
        raise InputError(f"{what} has {len(extrinsic)} and {counted(len(intrinsic), 'number')}: it should have 16 and 9")
    picture = _picture(file, name)
    size = image_size(picture) if picture else None
    half = opencv.half_pixel(options, "corner")
    plane = opencv.plane_of_k(intrinsic[:9], size or options.size_or_refuse(what), half, what)
    rows = np.array(axes.upper_rows(np.array(extrinsic).reshape(-1, 4), what))
    pinhole, notes = axes.pinhole(axes.from_world_to_camera(rows[:, :3], rows[:, 3].tolist(), what), plane, what)
    return Camera(name, pinhole, size is not None, notes, f"{name}.jpg" if picture is None else picture.name)


def _picture(file: Source, name: str) -> Path | None:
    """The path of a camera's picture, None where there is none in the folders beside its own."""
    if file.path is None:
        return None
    places = [file.path.parent / up / place for place in _PICTURES for up in ("..", "../..")]
    images = (naming.near(f"{name}.{suffix}", place) for place in places for suffix in ("jpg", "png"))
    return next(filter(None, images), None)
