"""Poses, 4 × 4 or 3 × 4 in a text file for each picture: 7-Scenes, 3DMatch, ScanNet, and whatever folder is alike.

    frame-000000.pose.txt            7-Scenes, 3DMatch, tsdf-fusion: with camera-intrinsics.txt in this folder or the one above
    frame-000000.pose.txt            3RScan: with _info.txt in this folder
    pose/0.txt, color/0.jpg          ScanNet: with intrinsic/intrinsic_color.txt, or intrinsics_color.txt, in the one above

These are from the camera, x right, y down, z into the view, to the world. Other files do not say which way they go, and ask for
`Options.pose`; an NPY of one pose or of several is such a file. K counts as OpenCV's does. Pictures that were not placed, whose
numbers are no numbers, are left out.

Source: ScanNet's SensReader/python/README.md; 7-Scenes' and 3DMatch's pages; tsdf-fusion-python's fusion.py and demo.py.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError, counted
from . import naming, opencv
from .camera import Camera, LeftOut, Options
from .source import Source, flat, image_size

TITLE = "pose files (ScanNet, 7-Scenes)"

_FOLDERS = ("", "pose/", "poses/")
_OF_FRAME = re.compile(r"frame-\d+\.pose")
_INTRINSICS = ("intrinsic/intrinsic_color.txt", "intrinsics_color.txt", "camera-intrinsics.txt", "_info.txt")
_INFO = re.compile(r"^(m_\w+) = (.*)$", re.MULTILINE)
_PICTURES = ("{}.color.jpg", "{}.color.png", "color/{}.jpg", "{}.jpg", "{}.png", "rgb/{}.png", "images/{}.jpg")
_FARTHEST = 1e-2


def recognizes(source: Source) -> bool:
    if source.npy is not None:
        return bool(_of_array(source.npy))
    files = _files(source)
    return bool(files) and _matrix(files[0]) is not None


def read(source: Source, options: Options) -> list[Camera]:
    if source.npy is not None:
        named = ((f"{i:05d}", {"transform": matrix}) for i, matrix in enumerate(_of_array(source.npy)))
        return [opencv.camera(name, values, options) for name, values in named]
    files = _files(source)
    shared = _intrinsics(files[0])
    is_known = bool(shared) or (files[0].path is not None and bool(_OF_FRAME.fullmatch(files[0].path.stem)))
    options = replace(options, pose=options.pose or "c2w_opencv") if is_known else options
    picture, size, left_out, cameras, lost = None, None, LeftOut(), [], 0
    for file in files:
        name = file.path.stem.removesuffix(".pose") if file.path else "camera"
        matrix = _matrix(file)
        if matrix is None:
            raise InputError(f"{file.name} is no pose of three or four lines with four numbers each: take it out")
        if not all(map(math.isfinite, matrix)):
            lost += 1
            continue
        if size is None and file.path:
            pictures = ((each, _near(file, each.format(name))) for each in _PICTURES)
            picture, path = next((each for each in pictures if each[1]), (None, None))
            size = image_size(path) if path else (0, 0)
        values: dict[str, Any] = {**shared, "transform": matrix}
        if size and size[0] and shared:
            values |= {"width": size[0], "height": size[1]}
        with left_out.unless_pinhole(name):
            camera = opencv.camera(name, values, options)
            cameras.append(replace(camera, image=picture.format(name).rpartition("/")[2] if picture else None))
    if not cameras and lost:
        raise InputError(f"none of {counted(lost, 'picture')} of {source.name} was placed: give another scan")
    note = (f"{counted(lost, 'picture')} not placed: left out",) if lost else ()
    return [camera.noted(*note) for camera in left_out.with_notes(cameras)]


def _files(source: Source) -> list[Source]:
    """The files of poses, in the order of the numbers in their names."""
    if not source.is_folder:
        return [source]
    for place in _FOLDERS:
        files = [file for file in source.files(f"{place}*.txt") if file.path and file.path.name not in _INTRINSICS]
        if files and _matrix(files[0]) is not None:
            return sorted(files, key=lambda file: [(len(part), part) for part in re.findall(r"\d+|\D+", file.name)])
    return []


def _matrix(file: Source) -> tuple[float, ...] | None:
    """The numbers of a pose, of which some may be infinite; None if it is none."""
    lines = [line.split() for line in file.text[:2000].strip().split("\n")]
    if file.is_binary or "_" in file.text[:2000] or [len(line) for line in lines] not in ([4] * 3, [4] * 4):
        return None
    try:
        rows = np.array([[float(word) for word in line] for line in lines])
    except ValueError:
        return None
    return _pose(rows)


def _of_array(array: np.ndarray) -> list[tuple[float, ...]]:
    """The numbers of each pose of an array, (…, 3 or 4, 4); none if one of them is none."""
    if array.ndim not in (2, 3) or array.shape[-2:] not in ((3, 4), (4, 4)):
        return []
    every = [_pose(rows.astype(np.float64)) for rows in array.reshape(-1, *array.shape[-2:])]
    poses = [pose for pose in every if pose is not None]
    return poses if len(poses) == len(every) else []


def _pose(rows: np.ndarray) -> tuple[float, ...] | None:
    """The numbers of a matrix, of which some may be infinite; None if it is no pose."""
    if np.isfinite(rows).all():
        turn = rows[:3, :3]
        is_turn = np.abs(turn).max() < 2 and np.abs(turn @ turn.T - np.eye(3)).max() < _FARTHEST
        if not is_turn or (len(rows) == 4 and rows[3].tolist() != [0, 0, 0, 1]):
            return None
    return tuple(rows.ravel().tolist())


def _intrinsics(file: Source) -> Mapping[str, Any]:
    """K of the data set, by its plain name; nothing where there is none."""
    for up in ((), ("..",)):
        for name in _INTRINSICS:
            if k_file := file.file(*up, *name.split("/")):
                text, size = k_file.text, {}
                if name == "_info.txt":
                    info = dict(_INFO.findall(text))
                    text = info.get("m_calibrationColorIntrinsic", "")
                    stated = {key.lower(): info.get(f"m_color{key}", "").strip() for key in ("Width", "Height")}
                    size = {key: int(value) for key, value in stated.items() if value.isdecimal() and len(value) < 10}
                numbers = flat(f"K in {k_file.name}", text)
                side = {9: 3, 16: 4}.get(len(numbers))
                if side is None:
                    raise InputError(f"{k_file.name} has {counted(len(numbers), 'number')}: K has 3 × 3, or 4 × 4")
                return {**size, "k": np.array(numbers).reshape(side, side)[:3, :3].ravel().tolist()}
    return {}


def _near(file: Source, picture: str) -> Path | None:
    """The picture beside a file of poses, or in a folder beside its own; None where there is none."""
    if file.path is None:
        return None
    place, _, name = picture.rpartition("/")
    return naming.near(name, file.path.parent.parent / place if place else file.path.parent)
