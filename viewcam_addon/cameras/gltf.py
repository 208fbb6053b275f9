"""glTF 2.0: cameras on nodes, of a .gltf or a .glb.

Camera axes are x right, y up, z away from the view; the world's y points up. A camera has a vertical angle, and an aspect
ratio or that of whatever shows it; no size, no shift. So a shifted or mirrored camera is refused on the way out, and the size
goes into `extras`, which is where glTF lets programs keep what others do not know. Nodes may be scaled, which a camera is not
by the specification.

Source: Khronos' glTF 2.0 specification, sections 3.10 and 5.12.
"""

import json
import math
import re
import struct
from collections.abc import Sequence

import numpy as np

from .. import checks
from ..errors import InputError
from . import axes, naming, own
from .camera import Camera, LeftOut, Options, not_a_pinhole
from .source import Record, Source

TITLE = "glTF and GLB"
SUFFIX = ".gltf"

_Y_UP = "glTF's y points up: the numbers stay as they are unless the axes Y up → Z up are chosen"
_NEAR = 0.01  # written where glTF asks for one
_SAME = 1e-3  # some write float32, and some a few digits


def recognizes(source: Source) -> bool:
    document = _document(source)
    lists = [isinstance(document.get(key), list) for key in ("cameras", "nodes")]
    return all(lists) or ("asset" in document and ("cameras" in document or "nodes" in document))


def read(source: Source, options: Options) -> list[Camera]:
    document = Record(_document(source), source.name)
    cameras = document.records("cameras", "camera") if "cameras" in document else []
    nodes = document.records("nodes", "node") if "nodes" in document else []
    worlds = _Worlds(nodes, _moving(document))
    left_out, result = LeftOut(InputError), []
    for index, node in enumerate(nodes):
        if "camera" not in node:
            continue
        camera = cameras[_index(node, "camera", len(cameras))]
        name = next(
            (text for text in (node.get("name"), camera.get("name")) if isinstance(text, str) and text), f"node {index}"
        )
        with left_out.unless_pinhole(name):
            result.append(_camera(name, camera, worlds.of(index), options))
            if worlds.moves(index):
                result[-1] = result[-1].noted(f"{name} is animated: it was taken as it stands without its animation")
    return left_out.with_notes(result)


def write(cameras: Sequence[Camera], options: Options) -> str:
    naming.refuse_mirrored(cameras, "glTF")
    document = {
        "asset": {
            "version": "2.0",
            "generator": "Virtual Pinhole",
            **({"extras": {"comment": options.remembered}} if options.remembered else {}),
        },
        "scene": 0,
        "scenes": [{"nodes": [*range(len(cameras))]}],
        "nodes": [_node(i, camera) for i, camera in enumerate(cameras)],
        "cameras": [_perspective(camera) for camera in cameras],
    }
    return json.dumps(document, indent=1, allow_nan=False) + "\n"


def notes_in(source: Source) -> list[str]:
    return [_json(source).text]


def _document(source: Source) -> dict:
    inner = _json(source)
    if inner is not source and inner.json_problem:
        raise InputError(f"the JSON in {source.name} is none ({inner.json_problem}): export it again")
    return dict(inner.document)


def _json(source: Source) -> Source:
    """The JSON: the file itself, or what a GLB has of it."""
    data = source.data
    if data[:4] != b"glTF":
        return source
    if len(data) < 20 or data[16:20] != b"JSON":
        raise InputError(f"{source.name} is a GLB without its JSON: export it again, as glTF 2.0")
    (length,) = struct.unpack("<I", data[12:16])
    return Source(data[20 : 20 + length].decode("utf-8", errors="replace"))


class _Worlds:
    """The nodes' matrices in the world."""

    def __init__(self, nodes: list[Record], moving: set[int]) -> None:
        self._nodes, self._moving = nodes, moving
        self._parents: dict[int, int] = {}
        self._known: dict[int, tuple[np.ndarray, bool]] = {}
        for index, node in enumerate(nodes):
            for child in _list(node.get("children")):
                if not isinstance(child, int) or not 0 <= child < len(nodes) or child in self._parents:
                    raise InputError(
                        f"{node.place} has the child {checks.quoted(child)}, which is none or another's: correct it"
                    )
                self._parents[child] = index

    def of(self, index: int) -> np.ndarray:
        node: int | None = index
        unknown: list[int] = []
        while node is not None and node not in self._known:
            if len(unknown) > len(self._nodes):
                raise InputError(f"node {node} is its own parent: correct its children")
            unknown.append(node)
            node = self._parents.get(node)
        matrix, moves = (np.eye(4), False) if node is None else self._known[node]
        for node in reversed(unknown):
            matrix, moves = matrix @ _local(self._nodes[node]), moves or node in self._moving
            self._known[node] = matrix, moves
        return matrix

    def moves(self, index: int) -> bool:
        """True if the node or one above it is animated, whose matrix was asked for."""
        return self._known[index][1]


def _local(node: Record) -> np.ndarray:
    x, y, z, w = node.numbers("rotation", 4) if "rotation" in node else (0, 0, 0, 1)
    scale = node.numbers("scale", 3) if "scale" in node else (1, 1, 1)
    matrix = np.eye(4)
    matrix[:3, :3] = axes.rotation_of((w, x, y, z), node.place) * np.array(scale)
    matrix[:3, 3] = node.numbers("translation", 3) if "translation" in node else (0, 0, 0)
    if "matrix" not in node:
        return matrix
    whole = np.array(node.numbers("matrix", 16)).reshape(4, 4).T
    if (matrix != np.eye(4)).any() and np.abs(matrix - whole).max() > _SAME * (1 + np.abs(whole).max()):
        raise InputError(f"{node.place} has a matrix, and another as translation, rotation and scale: take one of them out")
    return whole


def _index(node: Record, key: str, count: int) -> int:
    index = node.get(key)
    if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < count:
        raise InputError(f"{node.called(key)} is {checks.quoted(index)}: the file has {count} of them")
    return index


def _moving(document: Record) -> set[int]:
    channels = [channel for animation in _list(document.get("animations")) for channel in _list(_key(animation, "channels"))]
    targets = [_key(channel, "target") for channel in channels]
    moving = {"nodes": {node for target in targets if isinstance(node := _key(target, "node"), int)}, "cameras": set()}
    for target in targets:
        pointer = _key(_key(_key(target, "extensions"), "KHR_animation_pointer"), "pointer")
        if isinstance(pointer, str) and (match := re.match(r"/(nodes|cameras)/(\d{1,9})/", pointer)):
            moving[match[1]].add(int(match[2]))
    through = ((number, _key(node, "camera")) for number, node in enumerate(_list(document.get("nodes"))))
    return moving["nodes"] | {number for number, camera in through if isinstance(camera, int) and camera in moving["cameras"]}


def _list(value: object) -> list:
    return value if isinstance(value, list) else []


def _key(value: object, key: str) -> object:
    return value.get(key) if isinstance(value, dict) else None


def _camera(name: str, camera: Record, matrix: np.ndarray, options: Options) -> Camera:
    what = f"camera {checks.quoted(name)}"
    if camera.get("type") != "perspective":
        not_a_pinhole(what, f"{checks.quoted(camera.get('type'))}")
    lens = camera.record("perspective")
    angle = lens.number("yfov", least=1e-9)
    if angle >= math.pi:
        raise InputError(f"yfov of {what} is {angle:g}: give radians below π")
    size, stated = _size(camera, what, options)
    width, height = size
    slope = math.tan(angle / 2)
    d_y = height / 2 / slope
    d_x = d_y / options.pixel_aspect
    notes: tuple[str, ...] = ()
    if "aspectRatio" in lens:
        aspect = lens.number("aspectRatio", least=1e-9)
        across = width / 2 / (aspect * slope)
        if stated or abs(across / d_x - 1) < 1e-3:
            d_x = across if abs(across / d_x - 1) > 1e-12 else d_x
        else:
            notes = (
                f"{what} is made for an aspect of {aspect:.6g} and the picture's is {width / height:.6g}: its height counts",
            )
    plane = axes.view_plane(d_x, d_y, width / 2, height / 2, size)
    pinhole, more = axes.pinhole(matrix, plane, what, scaled=True)
    return Camera(name, pinhole, stated, (*notes, *more, *(() if options.axes == "y_up" else (_Y_UP,))))


def _size(camera: Record, what: str, options: Options) -> tuple[tuple[int, int], bool]:
    extras = camera.get("extras")
    if isinstance(extras, dict) and {"width", "height"} <= extras.keys():
        stated_size = Record(extras, what)
        return (stated_size.size("width"), stated_size.size("height")), True
    return options.size_or_refuse(what), False


def _node(index: int, camera: Camera) -> dict:
    rows = axes.camera_to_world(camera.pinhole)[:3]
    w, x, y, z = axes.quaternion(rows)
    return {
        "name": camera.name,
        "camera": index,
        "translation": [row[3] for row in rows],
        "rotation": [x, y, z, w],
        "extras": {own.KEY: own.document(camera.pinhole)},
    }


def _perspective(camera: Camera) -> dict:
    pinhole = camera.pinhole
    width, height = pinhole.width, pinhole.height
    if pinhole.principal_point != (width / 2, height / 2):
        raise InputError(f"glTF can't say that a camera is shifted, as {checks.quoted(camera.name)} is: choose another format")
    d_x, d_y = pinhole.distance
    lens = {
        "yfov": 2 * math.atan2(height / 2, d_y),
        "aspectRatio": checks.number(f"the aspect of {camera.name}", width * d_y / (height * d_x)),
        "znear": _NEAR,
    }
    return {"name": camera.name, "type": "perspective", "perspective": lens, "extras": {"width": width, "height": height}}
