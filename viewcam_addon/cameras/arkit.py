"""Recordings of phones: Polycam's and 3D Scanner App's JSON of each picture, and Record3D's metadata.

All are ARKit's: world y up (against gravity), meters, camera x right, y up, z away from the view in the landscape picture.
Polycam lists the matrix as t_00 … t_23, row after row; of its two folders the corrected one is meant, and its pictures are in
a folder beside it. 3D Scanner App has cameraPoseARFrame, row after row, and the picture beside it. Record3D has a pose as qx qy
qz qw tx ty tz and K column after column.

Source: nerfstudio's polycam_utils.py and record3d_utils.py, and ARKit's documentation of ARCamera.
"""

from pathlib import Path

import numpy as np

from ..errors import InputError
from . import axes, opencv
from .camera import Camera, Options
from .source import Record, Source, image_size

TITLE = "ARKit: Polycam, 3D Scanner App, Record3D"

_Y_UP = "ARKit's y points up: the numbers stay as they are unless the axes Y up → Z up are chosen"
_FOLDERS = ((), ("corrected_cameras",), ("keyframes", "corrected_cameras"), ("cameras",), ("keyframes", "cameras"))
_PICTURES = {"cameras": "images", "corrected_cameras": "corrected_images"}
_POLYCAM = {f"t_{row}{column}" for row in range(3) for column in range(4)}


def recognizes(source: Source) -> bool:
    return bool(_files(source)) or _record3d_in(source) is not None


def read(source: Source, options: Options) -> list[Camera]:
    if metadata := _record3d_in(source):
        cameras = _record3d(metadata, options)
    else:
        cameras = [_camera(file, options) for file in _files(source)]
    return cameras if options.axes == "y_up" else [camera.noted(_Y_UP) for camera in cameras]


def _files(source: Source) -> list[Source]:
    if source.path is None or not source.is_folder:
        return [source] if _is_ours(source) else []
    for parts in _FOLDERS:
        folder = Source(source.path.joinpath(*parts))
        first = next(folder.files("*.json"), None)
        if first and _is_ours(first):
            return [file for file in folder.files("*.json") if _is_ours(file)]
    return []


def _is_ours(source: Source) -> bool:
    keys = source.document.keys()
    return len(keys & _POLYCAM) > len(_POLYCAM) / 2 or {"cameraPoseARFrame", "intrinsics"} <= keys


def _record3d_in(source: Source) -> Source | None:
    file = source.file("metadata") if source.is_folder else source
    return file if file is not None and {"poses", "K", "w", "h"} <= file.document.keys() else None


def _camera(source: Source, options: Options) -> Camera:
    name = source.path.stem if source.path else "camera"
    values = Record(source.document, name)
    matrix = np.eye(4)
    if "cameraPoseARFrame" in values:
        matrix[:] = np.array(values.numbers("cameraPoseARFrame", 16)).reshape(4, 4)
        f_x, f_y, c_x, c_y = opencv.matrix_of_k(values.numbers("intrinsics", 9), name)
        size = (
            next(filter(None, (image_size(source.path.with_suffix(s)) for s in (".jpg", ".png"))), None)
            if source.path
            else None
        )
        stated = size is not None
        size = size or options.size_or_refuse(name)
    else:
        matrix[:3] = [[values.number(f"t_{row}{column}") for column in range(4)] for row in range(3)]
        f_x, f_y, c_x, c_y = (values.number(key) for key in ("fx", "fy", "cx", "cy"))
        size, stated = (values.size("width"), values.size("height")), True
    if not (f_x > 0 and f_y > 0):
        raise InputError(f"{name} has the focal length {min(f_x, f_y):g}: give one above 0")
    pinhole, notes = axes.pinhole(matrix, axes.view_plane(f_x, f_y, c_x, c_y, size), name)
    time = values.number("timestamp") * 1e-6 if "timestamp" in values and "t_00" in values else None
    return Camera(name, pinhole, stated, notes, _picture(source.path) if source.path else None, time=time)


def _picture(path: Path) -> str:
    """The picture of a camera's file: beside it, and Polycam's in a folder of their own, called from the recording's on."""
    folder = path.parent
    if folder.name not in _PICTURES:
        return f"{path.stem}.jpg"
    parts = (folder.parent.name,) if folder.parent.name == "keyframes" else ()
    return "/".join((*parts, _PICTURES[folder.name], f"{path.stem}.jpg"))


def _record3d(source: Source, options: Options) -> list[Camera]:
    values = Record(source.document, source.name)
    k = np.array(values.numbers("K", 9)).reshape(3, 3).T.ravel().tolist()
    size = (values.size("w"), values.size("h"))
    plane = axes.view_plane(*opencv.matrix_of_k(k, source.name), size)
    poses = values.get("poses")
    if not isinstance(poses, list) or not poses:
        raise InputError(f"{source.name} has no poses: record it again")
    rate = values.number("fps", 60.0, 1e-3)
    whats = [f"pose {index}" for index in range(len(poses))]
    planes = [plane] * len(poses)
    if "perFrameIntrinsicCoeffs" in values:
        each = values.get("perFrameIntrinsicCoeffs")
        if not isinstance(each, list) or len(each) != len(poses):
            raise InputError(f"perFrameIntrinsicCoeffs of {source.name} should be four numbers for each pose: record it again")
        of_poses = [Record({"perFrameIntrinsicCoeffs": row}, what) for row, what in zip(each, whats, strict=True)]
        coefficients = (record.numbers("perFrameIntrinsicCoeffs", 4) for record in of_poses)
        planes = [axes.view_plane(f_x, f_y, c_x, c_y, size) for f_x, f_y, c_x, c_y in coefficients]
    numbers = [Record({"pose": pose}, what).numbers("pose", 7) for pose, what in zip(poses, whats, strict=True)]
    x, y, z, w, *eyes = np.array(numbers).T
    turns = axes.rotations_of(np.stack([w, x, y, z], axis=-1), whats)
    matrices = np.concatenate([turns, np.stack(eyes, axis=-1)[:, :, None]], axis=2)
    return [
        Camera(f"pose_{index:04d}", pinhole, True, notes, time=index / rate)
        for index, (pinhole, notes) in enumerate(axes.pinholes(matrices, planes, whats))
    ]
