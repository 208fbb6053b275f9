"""three.js' JSON of a PerspectiveCamera, alone or in a scene.

`matrix` is camera to parent, column by column, x right, y up, z back, or stands as `position`, `rotation` (radians and their
order) or `quaternion`, and `scale`; `fov` the degrees of the height, `aspect` width over
height as looked at, `zoom` divides both tangents, and `view` cuts a window of width × height pixels, which here says the
principal point and the size. `filmOffset` moves the picture by filmOffset / film's width · d pixels, not by a part of it.

Source: three.js r187, src/cameras/PerspectiveCamera.js (updateProjectionMatrix) and src/loaders/ObjectLoader.js.
"""

import json
import math
from collections.abc import Iterator, Sequence

import numpy as np

from .. import checks
from ..errors import InputError
from . import axes, own, texts
from .camera import Camera, LeftOut, Options, not_a_pinhole
from .source import Record, Source, number

TITLE = "three.js JSON"
SUFFIX = ".json"

_DEEPEST = 50
_ORDERS = ("XYZ", "YZX", "ZXY", "XZY", "YXZ", "ZYX")


def recognizes(source: Source) -> bool:
    return bool(_tops(source))


def _tops(source: Source) -> list[dict]:
    """The object; of a file of the editor the camera of its window and the scene."""
    among = (source.document, source.document.get("camera"), source.document.get("scene"))
    objects = [each.get("object") for each in among if isinstance(each, dict)]
    return [top for top in objects if isinstance(top, dict) and isinstance(top.get("type"), str)]


def read(source: Source, options: Options) -> list[Camera]:
    result = [camera for top in _tops(source) for camera in _cameras(top, np.eye(4), 0)]
    if not result:
        raise InputError(f"{source.name} has no PerspectiveCamera: give a file with one")
    left_out, cameras = LeftOut(), []
    for position, (item, matrix) in enumerate(result, start=1):
        name = str(item.get("name") or f"camera {position}")
        with left_out.unless_pinhole(name):
            if item.get("type") != "PerspectiveCamera":
                not_a_pinhole(f"the camera {checks.quoted(name)}", f"an {checks.quoted(item.get('type'))}")
            cameras.append(_camera(Record(item, f"the camera {checks.quoted(name)}"), matrix, name, options))
    return left_out.with_notes(cameras)


def _cameras(item: object, parent: np.ndarray, depth: int) -> Iterator[tuple[dict, np.ndarray]]:
    if not isinstance(item, dict):
        return
    if depth > _DEEPEST:
        raise InputError(f"the scene is nested more than {_DEEPEST} objects deep: give the camera alone")
    record = Record(item, f"the object {checks.quoted(item.get('name'))}")
    matrix = parent @ _local(record)
    if str(item.get("type", "")).endswith("Camera"):
        yield item, matrix
    children = item.get("children")
    for child in children if isinstance(children, list) else ():
        yield from _cameras(child, matrix, depth + 1)


def _local(record: Record) -> np.ndarray:
    """4 × 4, the object in its parent: its matrix, or else of its position, rotation or quaternion, and scale."""
    if "matrix" in record:
        return np.array(record.numbers("matrix", 16)).reshape(4, 4).T
    matrix = np.eye(4)
    if "quaternion" in record:
        x, y, z, w = record.numbers("quaternion", 4)
        matrix[:3, :3] = axes.rotation_of((w, x, y, z), record.place)
    elif "rotation" in record:
        turns = record.values["rotation"]
        if not isinstance(turns, list) or len(turns) < 3 or [*turns, "XYZ"][3] not in _ORDERS:
            raise InputError(f"{record.called('rotation')} is {checks.quoted(turns)}: give x, y, z in radians and their order")
        for axis in [*turns, "XYZ"][3]:
            index = "XYZ".index(axis)
            radians = number(record.called("rotation"), turns[index])
            matrix[:3, :3] = matrix[:3, :3] @ texts.turn(math.degrees(radians), np.eye(3)[index])
    matrix[:3, :3] *= record.numbers("scale", 3) if "scale" in record else 1.0
    matrix[:3, 3] = record.numbers("position", 3) if "position" in record else 0.0
    return matrix


def _camera(record: Record, matrix: np.ndarray, name: str, options: Options) -> Camera:
    half = math.tan(math.radians(record.number("fov", 50.0, 1e-9, 180 - 1e-9)) / 2) / record.number("zoom", 1.0, 1e-9)
    view = record.record("view") if "view" in record else None
    view = view if view and view.get("enabled") else None
    aspect = record.number("aspect", 1.0, 1e-4, 1e4)
    size = (view.size("width"), view.size("height")) if view else None
    film = texts.film(options, record.place, size, None if size else aspect)
    height, width = 2 * half, 2 * half * aspect
    left, top = -width / 2, height / 2
    if view and size:
        whole = view.number("fullWidth", least=1e-9), view.number("fullHeight", least=1e-9)
        left += view.number("offsetX", 0.0) * width / whole[0]
        top -= view.number("offsetY", 0.0) * height / whole[1]
        width, height = width * size[0] / whole[0], height * size[1] / whole[1]
    if offset := record.number("filmOffset", 0.0):
        gauge = record.number("filmGauge", 35.0, 1e-9)
        left += offset / (gauge * min(aspect, 1.0))
    exact = film.width if size else film.height * aspect / film.pixel_aspect
    d_x, d_y = exact / width, film.height / height
    if abs(d_x / d_y - 1) < 2.0**-40:
        d_x = d_y
    c_x = -left * d_x + (film.width - exact) / 2
    plane = axes.view_plane(d_x, d_y, c_x, top * d_y, (film.width, film.height))
    pinhole, notes = axes.pinhole(matrix, plane, record.place)
    return Camera(name, pinhole, film.is_stated, (*film.notes, *notes))


def write(cameras: Sequence[Camera], options: Options) -> str:
    """One camera as an object, several as the children of a group."""
    written = [_written(camera) for camera in cameras]
    top = written[0] if len(written) == 1 else {"type": "Group", "children": written}
    return (
        json.dumps({"metadata": {"version": 4.6, "type": "Object", "generator": "Virtual Pinhole"}, "object": top}, indent=1)
        + "\n"
    )


def _written(camera: Camera) -> dict:
    pinhole = camera.pinhole
    (d_x, d_y), (c_x, c_y), (width, height) = pinhole.distance, pinhole.principal_point, (pinhole.width, pinhole.height)
    matrix = np.array(axes.camera_to_world(pinhole)).T.ravel().tolist()
    return {
        "type": "PerspectiveCamera",
        "name": camera.name,
        "matrix": matrix,
        "fov": math.degrees(2 * math.atan(height / 2 / d_y)),
        "zoom": 1,
        "near": 0.1,
        "far": 2000,
        "aspect": width * d_y / (height * d_x),
        "view": {
            "enabled": True,
            "fullWidth": width,
            "fullHeight": height,
            "offsetX": width / 2 - c_x + 0.0,
            "offsetY": c_y - height / 2 + 0.0,
            "width": width,
            "height": height,
        },
        "userData": {own.KEY: own.document(pinhole)},
    }
