"""cameras.json of 3D Gaussian splatting, which its training leaves beside the model and its viewers read.

A list of pictures, each with `position`, the eye, and `rotation`, camera to world with x right, y down, z into the view, row
after row; `fx`, `fy` in pixels of `width` × `height`. It has no principal point, and the training takes the middle for it.

Viewers take the list as one of views, or, as SuperSplat, as a path with a keyframe each: so what is written here is a path for
them, too. They turn it with the splats as they show these.

Their own are read, too: the list `cameras = [` of antimatter15's main.js, which is JavaScript; the view that a page of
GaussianSplats3D begins with (initialCameraPosition, initialCameraLookAt, cameraUp), 50° of the height; and SIBR's paths, a line
each (`NAME -D origin=… -D target=… -D up=… -D fovy=…`, degrees).

Source: gaussian-splatting's utils/camera_utils.py (camera_to_JSON); antimatter15/splat's main.js (getViewMatrix);
GaussianSplats3D's Viewer.js; SIBR's InputCamera.cpp (loadLookat); SuperSplat's src/file-handler.ts (loadCameraPoses).
"""

import contextlib
import json
import math
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import checks
from ..errors import InputError
from ..pinhole import Pinhole
from . import axes, naming, own, texts
from .camera import Camera, Options
from .source import Record, Source

TITLE = "cameras.json of Gaussian splatting, and its viewers' cameras"
SUFFIX = ".json"

_KEYS = {"position", "rotation", "fx", "fy", "width", "height"}
_MIDDLE = "The file says no principal point: it was taken in the picture's middle, as the training does"


# JavaScript's names of keys, comments and texts.
_LIST = re.compile(r"\bcameras\s*=\s*(?=\[)")
_KEY = re.compile(r"""(?<=[{,])(\s*)["']?([A-Za-z_]\w*)["']?\s*:""")
_TEXT = re.compile(r"'([^'\"\n]*)'")
_COMMENT = r"//[^\n]*|/\*.*?(?:\*/|\Z)"
_VIEWS = {"eye": "initialCameraPosition", "look_at": "initialCameraLookAt", "up": "cameraUp"}
_USUAL_VIEW = {"eye": (0.0, 10.0, 15.0), "look_at": (0.0, 0.0, 0.0), "up": (0.0, 1.0, 0.0)}
_FOV = 50.0
_SIBR = re.compile(r"^(\S*)[ \t]+-D origin=(\S+)[ \t]+-D target=(\S+)[ \t]+-D up=(\S+)[ \t]+-D fov(y?)=(\S+)", re.MULTILINE)


def recognizes(source: Source) -> bool:
    pictures = _pictures(source)
    if bool(pictures) and isinstance(pictures[0], dict) and pictures[0].keys() >= _KEYS:
        return True
    return not (source.is_folder or source.is_binary) and (_VIEWS["eye"] in source.text or bool(_SIBR.search(source.text)))


def _pictures(source: Source) -> list[Any]:
    """The pictures, of JSON or of JavaScript; none where there is none."""
    if isinstance(source.json, list):
        return source.json
    if source.document.keys() >= _KEYS:  # one of them alone
        return [source.document]
    if TITLE not in source.parsed:
        source.parsed[TITLE] = []
        if not (source.is_folder or source.is_binary) and (begin := _LIST.search(source.text)):
            literal = _KEY.sub(r'\1"\2":', texts.without(_COMMENT, source.text[begin.end() :]))
            literal = _TEXT.sub(r'"\1"', re.sub(r",(?=\s*[\]}])", "", literal))
            with contextlib.suppress(ValueError, RecursionError):
                source.parsed[TITLE], _ = json.JSONDecoder(parse_int=checks.whole_of_json).raw_decode(literal)
    pictures: list[Any] = source.parsed[TITLE]
    return pictures


def read(source: Source, options: Options) -> list[Camera]:
    if not _pictures(source):
        return _of_sibr(source, options) or [_first_view(source, options)]
    pictures = [Record(values, f"camera {index}") for index, values in enumerate(_pictures(source))]
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


def _of_sibr(source: Source, options: Options) -> list[Camera]:
    """The cameras of SIBR's lines; none where there are none."""
    cameras: list[Camera] = []
    for line in _SIBR.finditer(source.text):
        name = line[1] or f"{len(cameras):05d}"
        record = Record(
            {"origin": line[2].split(","), "target": line[3].split(","), "up": line[4].split(",")}, f"camera {name}"
        )
        width, height = options.size_or_refuse(source.name)
        fov = Record({"fov": line[6]}, record.place).number("fov", None, 1e-6, 180 - 1e-6)
        d = (height if line[5] else width) / 2 / math.tan(math.radians(fov) / 2)
        eye, target, up = (record.numbers(key, 3) for key in ("origin", "target", "up"))
        cameras.append(Camera(name, Pinhole(eye, target, up, d, width, height), False))
    return cameras


def _first_view(source: Source, options: Options) -> Camera:
    """The view that a page of GaussianSplats3D begins with."""
    width, height = options.size_or_refuse(source.name)
    text = texts.without(_COMMENT, source.text)
    vectors: dict[str, Sequence[float]] = {**_USUAL_VIEW}
    for key, name in _VIEWS.items():
        listed = [match[1] for match in re.finditer(rf"\b{name}\b[\"']?\s*[:=]\s*\[([^\[\]]{{0,200}})\]", text)]
        if len({*listed}) > 1 or (not listed and name in text):
            raise InputError(f"{source.name} says {name} {len(listed)} times as three numbers: give a text that says it once")
        if listed:
            vectors[key] = Record({name: listed[0].rstrip(", \n").split(",")}, source.name).numbers(name, 3)
    d = height / 2 / math.tan(math.radians(_FOV) / 2)
    note = f"GaussianSplats3D shows {_FOV:g}° of the picture's height"
    return Camera("view", Pinhole(vectors["eye"], vectors["look_at"], vectors["up"], d, width, height), False, (note,))


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
