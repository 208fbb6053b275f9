"""cameras.json of 3D Gaussian splatting, which its training leaves beside the model and its viewers read.

A list of pictures, each with `position`, the eye, and `rotation`, camera to world with x right, y down, z into the view, row
after row; `fx`, `fy` in pixels of `width` × `height`. It has no principal point, and the training takes the middle for it.

Viewers take the list as one of views, or, as SuperSplat, as a path with a keyframe each: so what is written here is a path for
them, too. They turn it with the splats as they show these.

Source: gaussian-splatting's utils/camera_utils.py (camera_to_JSON); antimatter15/splat's main.js (getViewMatrix) and
SuperSplat's src/file-handler.ts (loadCameraPoses).
"""

import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..errors import InputError
from . import axes, naming, own
from .camera import Camera, Options
from .source import Record, Source

TITLE = "cameras.json of Gaussian splatting"
SUFFIX = ".json"

_KEYS = {"position", "rotation", "fx", "fy", "width", "height"}
_MIDDLE = "The file says no principal point: it was taken in the picture's middle, as the training does"


def recognizes(source: Source) -> bool:
    return (
        isinstance(source.json, list)
        and bool(source.json)
        and isinstance(source.json[0], dict)
        and source.json[0].keys() >= _KEYS
    )


def read(source: Source, _options: Options) -> list[Camera]:
    pictures = [Record(values, f"camera {index}") for index, values in enumerate(source.json)]
    paths = [str(picture.get("img_name") or picture.place) for picture in pictures]
    cameras = []
    for picture, path, name in zip(pictures, paths, naming.distinct(paths), strict=True):
        f_x, f_y = picture.number("fx"), picture.number("fy")
        if not (f_x > 0 and f_y > 0):
            raise InputError(f"{picture.place} has the focal length {min(f_x, f_y):g}: give one above 0")
        width, height = picture.size("width"), picture.size("height")
        matrix = np.eye(4)
        matrix[:3, :3] = np.array(picture.numbers("rotation", 9)).reshape(3, 3)
        matrix[:3, 3] = picture.numbers("position", 3)
        c_x, c_y = picture.number("cx", width / 2), picture.number("cy", height / 2)
        plane = axes.view_plane(f_x, f_y, c_x, c_y, (width, height))
        pinhole, notes = axes.pinhole(axes.of_opencv(matrix), plane, picture.place)
        image = path if naming.has_suffix(path) else None
        if not ("cx" in picture and "cy" in picture):
            notes = (*notes, _MIDDLE)
        cameras.append(Camera(name, pinhole, True, notes, image))
    return cameras


def write(cameras: Sequence[Camera], options: Options) -> str:
    naming.refuse_mirrored(cameras, "cameras.json")
    naming.refuse_shifted(cameras, "cameras.json", square=False)
    lines = [json.dumps(_written(camera, number)) for number, camera in enumerate(cameras)]
    if options.remembered:
        lines[0] = json.dumps({"comment": options.remembered})[:-1] + f", {lines[0][1:]}"
    return "[\n" + ",\n".join(lines) + "\n]\n"


def _written(camera: Camera, number: int) -> dict[str, Any]:
    pinhole = camera.pinhole
    rows = axes.camera_to_world(pinhole)[:3]
    return {
        "id": number,
        "img_name": camera.image or camera.name,
        "width": pinhole.width,
        "height": pinhole.height,
        "position": [row[3] for row in rows],
        "rotation": [[row[0], -row[1] + 0.0, -row[2] + 0.0] for row in rows],
        "fy": pinhole.distance[1],
        "fx": pinhole.distance[0],
        own.KEY: own.document(pinhole),
    }
