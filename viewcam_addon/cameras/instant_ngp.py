"""instant-ngp's camera paths, base_cam.json and its like: what its window saves and `run.py --video_camera_path` renders.

Each keyframe has `R`, a quaternion x, y, z, w, and `T`, camera to world with x right, y down, z into the view, and `fov`, the
degrees of the height. The world is the unit cube in which instant-ngp trains: a point p of the transforms.json is at scale · p
+ offset there, its coordinates in the order y, z, x. Both are in that file, or 0.33 and 0.5. This is undone, so that a path
stands in the world of its data set, whose transforms.json is looked for beside the path. The file says no size.

instant-ngp flies along a spline near the keyframes unless `spline_order` is 1 (from line to line), as it is written here.

Source: instant-ngp's src/camera_path.cu (to_json), include/neural-graphics-primitives/nerf_loader.h (ngp_matrix_to_nerf,
NERF_SCALE), src/nerf_loader.cu (scale, offset) and src/testbed.cu (set_camera_from_keyframe, set_fov).
"""

import json
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import checks
from ..errors import InputError
from . import axes, naming, own, transforms
from .camera import Camera, Options
from .source import Record, Source

TITLE = "camera path of instant-ngp (JSON)"
SUFFIX = ".json"

_KEYS = {"R", "T", "fov"}
_SCALE, _OFFSET = 0.33, 0.5
_CYCLE = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
"""From instant-ngp's axes to those of transforms.json."""
_OTHER_WORLDS = ("from_mitsuba", "normal_mts_args", "aabb")
_UNIT_CUBE = (
    f"instant-ngp's unit cube was undone by its scale of {_SCALE} and offset of {_OFFSET}: a transforms.json beside the path "
    "may have others"
)
_SPLINE = "These are the path's keyframes: instant-ngp itself flies along a spline near them"
_BLUR = "The path has an aperture, of which a pinhole has none: everything is in focus"


def recognizes(source: Source) -> bool:
    path = source.document.get("path")
    return isinstance(path, list) and bool(path) and isinstance(path[0], dict) and path[0].keys() >= _KEYS


def read(source: Source, options: Options) -> list[Camera]:
    top = Record(source.document, source.name)
    size = options.size_or_refuse(source.name)
    scale, offset, notes = _unit_cube(source)
    keyframes = top.records("path", "keyframe")
    if top.get("spline_order") not in (0, 1) and len(keyframes) > 1:
        notes += (_SPLINE,)
    if any(frame.number("aperture_size", 0.0) or frame.number("dof", 0.0) for frame in keyframes):
        notes += (_BLUR,)
    cameras = []
    for number, frame in enumerate(keyframes):
        d = size[1] / 2 / math.tan(math.radians(frame.number("fov", least=1e-6, most=180 - 1e-6)) / 2)
        plane = axes.view_plane(d, d, size[0] / 2, size[1] / 2, size)
        x, y, z, w = frame.numbers("R", 4)
        length = math.hypot(w, x, y, z)
        if not length > 1e-6:  # instant-ngp normalizes it, since those of its splines are not
            raise InputError(f"R of {frame.place} has the length {length:g}: give a quaternion x, y, z, w")
        turn = axes.rotation_of([part / length for part in (w, x, y, z)], frame.place)
        eye = (_CYCLE @ frame.numbers("T", 3) - offset) / scale
        pinhole, more = axes.pinhole(axes.of_opencv(np.column_stack([_CYCLE @ turn, eye])), plane, frame.place)
        name = str(frame.get("name") or f"{number:05d}")
        cameras.append(Camera(name, pinhole, False, (*notes, *more)))
    return cameras


def _unit_cube(source: Source) -> tuple[float, np.ndarray, tuple[str, ...]]:
    """The scale and offset (3) of instant-ngp's cube, and a note where they are its defaults and not the data set's."""
    file = source.file(transforms.FILE)
    if file is None or not file.document:
        return _SCALE, np.full(3, _OFFSET), (_UNIT_CUBE,)
    record = Record(file.document, file.name)
    if other := next((key for key in _OTHER_WORLDS if record.get(key)), None):
        raise InputError(f"{record.place} has {other}, by which instant-ngp's world is another: move it elsewhere")
    offset = record.get("offset")
    if isinstance(offset, int | float):
        offset = [offset] * 3
    numbers = checks.vector(f"offset of {record.place}", offset or [_OFFSET] * 3, 3)
    return record.number("scale", _SCALE, 1e-12, 1e12), np.array(numbers), ()


def write(cameras: Sequence[Camera], options: Options) -> str:
    naming.refuse_mirrored(cameras, "instant-ngp's camera path")
    naming.refuse_shifted(cameras, "instant-ngp's camera path", square=True)
    lines = [json.dumps(_written(camera, number, len(cameras))) for number, camera in enumerate(cameras)]
    head: dict[str, Any] = {
        **({"comment": options.remembered} if options.remembered else {}),
        "loop": False,
        "time": 0.0,
        "duration_seconds": 1.0,
        "spline_order": 1,
    }
    return json.dumps(head)[:-1] + ', "path": [\n ' + ",\n ".join(lines) + "\n]}\n"


def _written(camera: Camera, number: int, count: int) -> dict[str, Any]:
    pinhole = camera.pinhole
    rows = axes.camera_to_world(pinhole)
    y, z, x = ([row[0], -row[1] + 0.0, -row[2] + 0.0] for row in (rows[1], rows[2], rows[0]))
    q_w, *q = axes.quaternion([y, z, x])
    return {
        "name": camera.name,
        "R": [*q, q_w],
        "T": [rows[row][3] * _SCALE + _OFFSET for row in (1, 2, 0)],
        "fov": math.degrees(2 * math.atan(pinhole.height / 2 / pinhole.distance[1])),
        "slice": 0.0,
        "scale": 1.0,
        "aperture_size": 0.0,
        "timestamp": (number + 1) / count,
        own.KEY: own.document(pinhole),
    }
