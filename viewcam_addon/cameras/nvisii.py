"""NVISII's JSON beside each picture, in the manner of NDDS: RTMV, what DOPE is trained with, Isaac Sim's writers.

`camera_data` has `camera_view_matrix`, world to camera. NVISII lists glm's matrix column after column, and USD has row vectors,
so its rows are those of the transposed matrix, and the translation is the last one; where a program has transposed it, the last
row is 0 0 0 1, and it is taken so. NVISII's camera has x right, y up, z away from the view, DOPE's x right, y down, z into it,
under the same keys. Which it is, `camera_look_at` tells, or the objects, whose `location` counts from the camera; else it is
NVISII's, unless `Options.pose` says otherwise. `intrinsics` are pixels of `width` × `height` from the picture's corner.
The pose stands there again as `cam2world`, `location_world`, `quaternion_world_xyzw` and `camera_look_at`: what contradicts the
matrix is refused.

Left out: NDDS's own files, whose intrinsics stand in another file and whose camera nothing describes.

Source: NVISII's examples/21.ndds_export.py (export_to_ndds_file); Deep_Object_Pose's data_generation/nvisii_data_gen.
"""

from pathlib import Path

import numpy as np

from ..errors import InputError
from . import axes
from .camera import Camera, Options
from .source import Record, Source

TITLE = "NVISII, DOPE, RTMV (JSON)"
SUFFIX = ".json"
SEVERAL = "a folder"

_LAST = [0.0, 0.0, 0.0, 1.0]
_CLOSE = 1e-3  # some of these programs write five decimals
_TAKEN = "Nothing says which way the camera looks along its z: it was taken as NVISII's, y up, z away from the view"


def recognizes(source: Source) -> bool:
    data = source.document.get("camera_data")
    return isinstance(data, dict) and {"camera_view_matrix", "intrinsics"} <= data.keys()


def read(source: Source, options: Options) -> list[Camera]:
    data = Record(source.document["camera_data"], "camera_data")
    stated = "width" in data and "height" in data
    size = (data.size("width"), data.size("height")) if stated else options.size_or_refuse(source.name)
    k = data.record("intrinsics")
    f_x, f_y = (k.number(key, least=1e-9) for key in ("fx", "fy"))
    plane = axes.view_plane(f_x, f_y, k.number("cx"), k.number("cy"), size)
    matrix = _matrix(data, "camera_view_matrix")
    forward = _forward(source, data, matrix[2, :3])
    assumptions: tuple[str, ...] = ()
    if forward == 0:
        forward = 1.0 if options.pose == "w2c_opencv" else -1.0
        assumptions = () if options.pose in ("w2c_opencv", "w2c_opengl") else (_TAKEN,)
    rows = matrix[:3] * [[1.0], [forward], [forward]]
    pose = axes.from_world_to_camera(rows[:, :3], rows[:, 3].tolist(), "camera_data")
    pinhole, notes = axes.pinhole(pose, plane, "camera_data")
    _check_again(data, pose, forward)
    name = Path(source.name).stem if source.path else "camera"
    return [Camera(name, pinhole, stated, (*assumptions, *notes), f"{name}.png" if source.path else None)]


def _matrix(data: Record, key: str) -> np.ndarray:
    """(4, 4) for column vectors, whichever way it is listed."""
    matrix = np.array(data.numbers(key, 16)).reshape(4, 4)
    return matrix.T if matrix[3].tolist() != _LAST or matrix[:, 3].tolist() == _LAST else matrix


def _check_again(data: Record, pose: np.ndarray, forward: float) -> None:
    """Refuse a pose that contradicts the matrix.

    pose : (3, 4) or (4, 4), camera to world of the matrix, as `axes.camera_to_world` has it.
    forward : the sign of the view along z, as `_forward` has it.
    """
    turn, eye = pose[:3, :3] * [1.0, -forward, -forward], pose[:3, 3]
    turns, eyes = {}, {}
    if "cam2world" in data:
        again = _matrix(data, "cam2world")
        turns["cam2world"], eyes["cam2world"] = again[:3, :3] - turn, again[:3, 3] - eye
    if "quaternion_world_xyzw" in data:
        x, y, z, w = data.numbers("quaternion_world_xyzw", 4)
        turns["quaternion_world_xyzw"] = axes.rotation_of((w, x, y, z), data.place) - turn
    if "location_world" in data:
        eyes["location_world"] = np.subtract(data.numbers("location_world", 3), eye)
    if "camera_look_at" in data:
        look = data.record("camera_look_at")
        at, place = np.array(look.numbers("at", 3)), np.array(look.numbers("eye", 3))
        if away := float(np.linalg.norm(at - place)):  # all 0 where the program was not told
            turns["camera_look_at"] = (at - place) / away - forward * turn[:, 2]
            eyes["camera_look_at"] = place - eye
    far = _CLOSE * (1 + np.linalg.norm(eye))
    wrong = [
        key for errors, most in ((turns, _CLOSE), (eyes, far)) for key, error in errors.items() if np.abs(error).max() > most
    ]
    if wrong:
        raise InputError(
            f"{wrong[0]} of camera_data says another pose than its camera_view_matrix: take out the one that is wrong"
        )


def _forward(source: Source, data: Record, z: np.ndarray) -> float:
    """1 if the camera looks along its z, −1 if against it, 0 if nothing tells. z : (3) that axis in the world."""
    if "camera_look_at" in data:
        look = data.record("camera_look_at")
        ahead = float(z @ np.subtract(look.numbers("at", 3), look.numbers("eye", 3)))
        if ahead:
            return float(np.sign(ahead))
    objects = source.document.get("objects")
    records = [Record(each, "an object") for each in objects if isinstance(each, dict)] if isinstance(objects, list) else []
    return float(np.sign(sum(np.sign(each.numbers("location", 3)[2]) for each in records if "location" in each)))
