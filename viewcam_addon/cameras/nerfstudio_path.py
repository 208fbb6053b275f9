"""nerfstudio's camera_path.json: the flight that its viewer saves and `ns-render camera-path` renders.

Of each camera `camera_to_world` is 4 × 4, row after row, x right, y up, z away from the view, and `fov` the degrees of the
height; `render_width` and `render_height` are those of all. The principal point is the middle and pixels are square. The world
is the one that nerfstudio trains in: dataparser_transforms.json, which stands beside the trained model, says how it came of the
data's, p′ = scale (R p + t). Where that file stands beside the path, too, `original_world` undoes it.

A path that is written has no keyframes, which the viewer would need to edit it: they are for its splines.

Source: nerfstudio's cameras/camera_paths.py (get_path_from_json), data/dataparsers/base_dataparser.py
(save_dataparser_transform).
"""

import json
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import checks
from ..errors import InputError
from . import axes, naming, own
from .camera import Camera, LeftOut, Options, not_a_pinhole
from .source import Record, Source

TITLE = "camera_path.json of nerfstudio"
SUFFIX = ".json"
WORLD = "dataparser_transforms.json"

_FPS = 24
_OF_NERFSTUDIO = f"The path is in the world that nerfstudio trains in: with {WORLD} beside it, the original world can be chosen"


def recognizes(source: Source) -> bool:
    path = source.document.get("camera_path")
    if _is_world(source):
        return True
    return isinstance(path, list) and bool(path) and isinstance(path[0], dict) and "camera_to_world" in path[0]


def _is_world(source: Source) -> bool:
    return source.document.keys() == {"transform", "scale"}


def read(source: Source, options: Options) -> list[Camera]:
    if _is_world(source):
        raise InputError(
            f"{source.name} has no cameras: it says how nerfstudio's world came of the data's; put it beside camera_path.json, "
            "and choose the original world there"
        )
    top = Record(source.document, source.name)
    kind = top.get("camera_type")
    size = top.size("render_width"), top.size("render_height")
    fps = top.number("fps", least=1e-3, most=1e6) if "fps" in top else None  # in older files it is not
    world = _world(source) if options.original_world else None
    notes = (_OF_NERFSTUDIO,) if world is None else ()
    left_out, cameras = LeftOut(), []
    for number, frame in enumerate(top.records("camera_path", "camera")):
        name = str(frame.get("name") or f"{number:05d}")
        with left_out.unless_pinhole(name):
            if kind is not None and str(kind).lower() != "perspective":
                not_a_pinhole(frame.place, f"of the camera type {checks.quoted(kind)}")
            fov = math.radians(frame.number("fov", least=1e-6, most=180 - 1e-6))
            d = size[1] / 2 / math.tan(fov / 2)
            matrix = np.array(frame.numbers("camera_to_world", 16)).reshape(4, 4)
            if world is not None:
                matrix[:3] = _undone(matrix, *world)
            plane = axes.view_plane(d, d, size[0] / 2, size[1] / 2, size)
            pinhole, more = axes.pinhole(matrix, plane, frame.place)
            cameras.append(Camera(name, pinhole, True, (*notes, *more), time=None if fps is None else number / fps))
    return left_out.with_notes(cameras)


def notes_in(source: Source) -> list[str]:
    return [source.text]


def _world(source: Source) -> tuple[np.ndarray, float] | None:
    """The 3 × 4 transform and the scale of the file beside the path; None if there is none."""
    file = source.file(WORLD)
    if file is None:
        return None
    record = Record(file.document, file.name)
    return np.array(record.numbers("transform", 12)).reshape(3, 4), record.number("scale", least=1e-12, most=1e12)


def _undone(matrix: np.ndarray, transform: np.ndarray, scale: float) -> np.ndarray:
    """The first three rows of a camera's matrix in the world of the data."""
    back = np.array(axes.rotation(transform[:, :3].tolist(), WORLD)[0])  # whose rows are the rotation's columns
    return np.column_stack([back @ matrix[:3, :3], back @ (matrix[:3, 3] / scale - transform[:, 3])])


def write(cameras: Sequence[Camera], options: Options) -> str:
    naming.refuse_mirrored(cameras, "camera_path.json")
    sizes = {(camera.pinhole.width, camera.pinhole.height) for camera in cameras}
    if len(sizes) != 1:
        raise InputError("camera_path.json has one size for all cameras, and these have several: choose another format")
    ((width, height),) = sizes
    naming.refuse_shifted(cameras, "camera_path.json", square=True)
    lines = [
        json.dumps(
            {
                "name": camera.name,
                "camera_to_world": [number for row in axes.camera_to_world(camera.pinhole) for number in row],
                "fov": math.degrees(2 * math.atan(height / 2 / camera.pinhole.distance[1])),
                "aspect": width / height,
                own.KEY: own.document(camera.pinhole),
            }
        )
        for camera in cameras
    ]
    head: dict[str, Any] = {
        **({"comment": options.remembered} if options.remembered else {}),
        "camera_type": "perspective",
        "render_width": width,
        "render_height": height,
        "fps": _FPS,
        "seconds": len(lines) / _FPS,
        "smoothness_value": 0,
        "is_cycle": False,
        "crop": None,
        "keyframes": [],
    }
    return json.dumps(head)[:-1] + ', "camera_path": [\n ' + ",\n ".join(lines) + "\n]}\n"
