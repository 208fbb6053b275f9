"""MuJoCo's cameras, in a model's XML: `<camera pos="…" xyaxes="…" fovy="45"/>`.

The camera looks along its −z, x to the right and y upwards, as OpenGL's; `fovy` is the height's field of view in degrees, 45
unless given. Poses are those of the bodies and frames around it, in the state in which the model begins. The orientation is one
of quat (w first), axisangle, xyaxes, zaxis and euler, in the unit and the order that <compiler> says.

A camera that turns towards a body is refused, and so are a principal point and classes of defaults that say something of
cameras. Source: MuJoCo's XML reference (camera, compiler, frame orientations).
"""

import itertools
import math
from collections.abc import Iterator
from xml.etree import ElementTree

import numpy as np

from .. import checks
from ..errors import InputError, counted
from . import axes, texts
from .camera import Camera, LeftOut, Options, not_a_pinhole
from .source import Source, flat, pixels

TITLE = "MuJoCo model"

_ORIENTATIONS = {"quat": 4, "axisangle": 4, "xyaxes": 6, "zaxis": 3, "euler": 3}
_MOST = 4_000


def recognizes(source: Source) -> bool:
    root = source.xml
    if root is None:
        return False
    return (root.tag == "mujoco" and root.find(".//camera") is not None) or _is_camera(root)


def _is_camera(element: ElementTree.Element) -> bool:
    return element.tag == "camera" and "pos" in element.attrib and bool({*_ORIENTATIONS, "fovy"} & element.attrib.keys())


def read(source: Source, options: Options) -> list[Camera]:
    root = source.xml
    if root is None:
        raise InputError(f"{source.name} is no XML: give MuJoCo's model")
    compiler = root.find("compiler")
    model = _Model(root, ElementTree.Element("compiler") if compiler is None else compiler, options)
    left_out, cameras = LeftOut(), []
    for number, (element, matrix) in enumerate(itertools.islice(model.cameras(), _MOST)):
        name = element.get("name") or f"camera_{number}"
        with left_out.unless_pinhole(name):
            cameras.append(model.camera(name, element, matrix))
    return left_out.with_notes(cameras)


class _Model:
    def __init__(self, root: ElementTree.Element, compiler: ElementTree.Element, options: Options) -> None:
        self.root, self.options = root, options
        self.in_radians = compiler.get("angle") == "radian"
        self.sequence = compiler.get("eulerseq", "xyz")
        if len(self.sequence) != 3 or not {*self.sequence.lower()} <= {*"xyz"}:
            raise InputError(f"eulerseq of the compiler is {checks.quoted(self.sequence)}: give three of x, y, z, X, Y, Z")
        usual = root.find("default/camera")
        self.usual = {} if usual is None else dict(usual.attrib)
        self.has_classes = root.find("default//default//camera") is not None

    def cameras(self) -> Iterator[tuple[ElementTree.Element, np.ndarray]]:
        """Each camera, and the matrix of the bodies and frames around it."""
        if self.root.tag == "camera":
            yield self.root, np.eye(4)
        for world in self.root.findall("worldbody"):
            yield from self._inside(world, np.eye(4))

    def _inside(self, holder: ElementTree.Element, matrix: np.ndarray) -> Iterator[tuple[ElementTree.Element, np.ndarray]]:
        for child in holder:
            if child.tag == "camera":
                yield child, matrix
            elif child.tag in ("body", "frame") and child.find(".//camera") is not None:
                yield from self._inside(
                    child, matrix @ self._pose(child.attrib, f"{child.tag} {checks.quoted(child.get('name', ''))}")
                )

    def camera(self, name: str, element: ElementTree.Element, around: np.ndarray) -> Camera:
        what = f"camera {checks.quoted(name)}"
        if self.has_classes:
            raise InputError(
                f"a default class says something of cameras, and which one {what} has is not followed: write it out"
            )
        values = self.usual | element.attrib
        if values.get("orthographic") == "true" or values.get("projection") == "orthographic":
            not_a_pinhole(what, "orthographic")
        if values.get("mode", "fixed").startswith("target"):
            raise InputError(f"{what} turns towards a body by itself: give its orientation and mode fixed")
        if any(_numbers(values, key, None, what) != (0, 0) for key in ("principal", "principalpixel") if key in values):
            raise InputError(f"{what} has a principal point, which is not read of MuJoCo: take it out")
        size = None
        if "resolution" in values:
            width, height = _numbers(values, "resolution", 2, what)
            size = pixels(f"resolution of {what}", width), pixels(f"resolution of {what}", height)
        film = texts.film(self.options, what, size)
        if "sensorsize" in values:
            if not size or not {"focal", "focalpixel"} & values.keys():
                raise InputError(f"{what} has a sensorsize: give focal and resolution as well")
            focal = _numbers(values, "focalpixel" if "focalpixel" in values else "focal", 2, what)
            sensor = size if "focalpixel" in values else _numbers(values, "sensorsize", 2, what)
            if min(*focal, *sensor) <= 0:
                raise InputError(f"focal and sensorsize of {what} are not above 0: correct them")
            f_x, f_y = (f / side * count for f, side, count in zip(focal, sensor, size, strict=True))
            plane = axes.view_plane(f_x, f_y, size[0] / 2, size[1] / 2, size)
        else:
            (degrees,) = _numbers(values, "fovy", 1, what) if "fovy" in values else (45.0,)
            plane = film.plane(math.radians(degrees), "y", f"fovy of {what}")
        pinhole, notes = axes.pinhole(around @ self._pose(values, what), plane, what)
        return Camera(name, pinhole, film.is_stated, (*film.notes, *notes))

    def _pose(self, values: dict[str, str], what: str) -> np.ndarray:
        """(4, 4) of pos and the one orientation."""
        stated = [key for key in _ORIENTATIONS if key in values]
        if len(stated) > 1:
            raise InputError(f"{what} has {' and '.join(stated)}: MuJoCo takes one orientation")
        result = np.eye(4)
        result[:3, 3] = _numbers(values, "pos", 3, what) if "pos" in values else (0, 0, 0)
        if stated:
            result[:3, :3] = self._turn(stated[0], np.array(_numbers(values, stated[0], _ORIENTATIONS[stated[0]], what)), what)
        return result

    def _turn(self, kind: str, numbers: np.ndarray, what: str) -> np.ndarray:
        degrees = math.degrees(1.0) if self.in_radians else 1.0
        if kind == "quat":
            return axes.rotation_of(tuple((numbers / (math.hypot(*numbers) or 1.0)).tolist()), what)
        if kind == "euler":
            result = np.eye(3)
            for letter, angle in zip(self.sequence, numbers, strict=True):
                step = texts.turn(float(angle) * degrees, np.eye(3)["xyz".index(letter.lower())].tolist())
                result = result @ step if letter.islower() else step @ result
            return result
        first = _unit(numbers[:3], kind, what)
        if kind == "axisangle":
            return texts.turn(float(numbers[3]) * degrees, first.tolist())
        if kind == "zaxis":  # the shortest turn of z to it
            sine = math.hypot(first[0], first[1])
            across = [-first[1] / sine, first[0] / sine, 0.0] if sine else [1.0, 0.0, 0.0]
            return texts.turn(math.degrees(math.atan2(sine, first[2])), across)
        second = _unit(numbers[3:] - (numbers[3:] @ first) * first, kind, what)
        return np.column_stack([first, second, np.cross(first, second)])


def _unit(vector: np.ndarray, kind: str, what: str) -> np.ndarray:
    length = math.hypot(*vector)
    if not 1e-100 < length < 1e100:
        raise InputError(f"{kind} of {what} has no direction: correct it")
    return vector / length


def _numbers(values: dict[str, str], key: str, count: int | None, what: str) -> tuple[float, ...]:
    result = flat(f"{key} of {what}", values[key])
    if count is not None and len(result) != count:
        raise InputError(f"{key} of {what} has {counted(len(result), 'number')}: it should have {count}")
    return result
