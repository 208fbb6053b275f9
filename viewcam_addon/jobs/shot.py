"""One shot: which camera, of how many pixels, at which frame, and how it is rendered.

`FIELDS` has the check of each value alone, `conflicts` what values can't be together. A Shot raises the first problem; a list
of shots (rows.py) asks both for all problems there are, with the place of each.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

from .. import checks
from ..errors import InputError
from ..pinhole import Triple, check_distance
from ..tracer.scene import film
from . import names

ENGINES = ("CYCLES", "EEVEE", "VIEWCAM")
LEVELS = (*film.LEVELS, "auto")

# Blender's limits: RNA's of the resolution and of frames, Cycles' of samples, and the float32 in which a camera is stored.
_SIZES = (4, 65536)
_FRAMES = (-1048574, 1048574)
_SAMPLES = (1, 2**24)
_ASPECTS = (1 / 200, 200.0)
_LARGEST_FLOAT32, _SMALLEST_FLOAT32 = (2.0 - 2.0**-23) * 2.0**127, 2.0**-126

FOUR_VALUES = ("eye", "look_at", "up", "d")
BESIDE_THEM = ("principal_point", "pixel_aspect", "mirrored")


@dataclass(frozen=True)
class Shot:
    """A shot, immutable and validated.

    Parameters
    ----------
    name : of its files, without a suffix.
    eye, look_at, up : three floats, world space; d : view-plane distance in pixels, > 0. All four, or `camera`.
    camera : the name of a camera of the .blend, in place of the four values. Without either it is the scene's own at the frame,
        which markers may bind.
    principal_point : (c_x, c_y), where the view axis meets the picture, pixels from its left and bottom edge; its middle where
        None. pixel_aspect : width of a pixel over its height, from 1/200 to 200. mirrored : whether the picture is. These go
        with the four values, `principal_point` with a size as well.
    width, height : pixels of the picture, both or none.
    frame : whole. engine : one of ENGINES. samples : a pixel. level : one of LEVELS.

    None stands for what the .blend or the command line says.

    Raises
    ------
    InputError
        if a value is not one of these, or beyond Blender's limits.
    """

    name: str
    eye: Triple | None = None
    look_at: Triple | None = None
    up: Triple | None = None
    d: float | None = None
    camera: str | None = None
    width: int | None = None
    height: int | None = None
    frame: int | None = None
    engine: str | None = None
    samples: int | None = None
    level: str | None = None
    principal_point: tuple[float, float] | None = None
    pixel_aspect: float | None = None
    mirrored: bool | None = None

    def __post_init__(self) -> None:
        for field, check in FIELDS.items():
            if getattr(self, field) is not None:
                object.__setattr__(self, field, check(field, getattr(self, field)))
        for fields, sentence in conflicts({field: value for field, value in vars(self).items() if value is not None}):
            raise InputError(f"{', '.join(fields)} of the shot {checks.shown(self.name)}: {sentence}")


def conflicts(values: Mapping[str, object], names_camera: bool = False) -> list[tuple[tuple[str, ...], str]]:
    """What the values of one shot can't be together: (fields, sentence) of each problem.

    values : what is said, by field; None where it is wrong already, and no more is to be said of it. names_camera : whether the
    scene's own camera won't do.
    """
    found = []
    if "name" not in values:
        found.append((("name",), "missing, give each shot a name of its own for its files"))
    given = tuple(field for field in (*FOUR_VALUES, *BESIDE_THEM) if field in values)
    missing = tuple(field for field in FOUR_VALUES if field not in values)
    if "camera" in values and given:
        found.append((("camera", *given), "a shot has either a camera of the file or the four values, leave one of them out"))
    elif "camera" not in values and missing and (given or names_camera):
        found.append((missing, "missing, give eye, look_at, up and d, or the name of a camera of the file"))
    if "principal_point" in values and "width" not in values:
        found.append((("width", "height"), "missing, the principal point counts pixels of a picture: give its size"))
    if values.get("eye") is not None and values.get("eye") == values.get("look_at"):
        found.append((("eye", "look_at"), "they are the same point, and the view has no direction: move one of them"))
    for one, other in (("width", "height"), ("height", "width")):
        if one in values and other not in values:
            found.append(((other,), f"missing, give {one} and {other}, or neither"))
    return found


def _text(place: str, value: object) -> str:
    if not isinstance(value, str) or not value:
        raise InputError(f"{place} is {checks.shown(value)}: give a text")
    if any("\udc80" <= character <= "\udcff" for character in value):
        raise InputError(f"{place} is {checks.shown(value)}, which holds bytes that are not UTF-8: save the file as UTF-8")
    return value


def _name(place: str, value: object) -> str:
    names.check(place, _text(place, value))
    return value


def _choice(place: str, value: object, *, among: tuple[str, ...]) -> str:
    if not isinstance(value, str) or value not in among:
        raise InputError(f"{place} is {checks.shown(value)}: give one of {', '.join(among)}")
    return value


def _point(place: str, value: object) -> Triple:
    point = checks.vector(place, value, 3)
    for coordinate in point:
        checks.number(place, coordinate, -_LARGEST_FLOAT32, _LARGEST_FLOAT32)
    return point


def _up(place: str, value: object) -> Triple:
    up = _point(place, value)
    if not any(up):
        raise InputError(f"{place} is (0, 0, 0): it has no direction, give the vector that shall point up in the picture")
    return up


def _distance(place: str, value: object) -> float:
    d = checks.number(place, value)
    check_distance(d, place)
    return checks.number(place, d, _SMALLEST_FLOAT32, _LARGEST_FLOAT32)


def _pair(place: str, value: object) -> tuple[float, float]:
    point = checks.vector(place, value, 2)
    for coordinate in point:
        checks.number(place, coordinate, -_LARGEST_FLOAT32, _LARGEST_FLOAT32)
    return point


def _aspect(place: str, value: object) -> float:
    return checks.number(place, value, *_ASPECTS)


def _truth(place: str, value: object) -> bool:
    spoken = {"true": True, "false": False}.get(value.lower(), value) if isinstance(value, str) else value
    return checks.truth(place, spoken)


def _whole(place: str, value: object, *, limits: tuple[int, int]) -> int:
    number = checks.number(place, value)
    if not number.is_integer() or not limits[0] <= number <= limits[1]:
        raise InputError(f"{place} is {checks.shown(value)}: give a whole number from {limits[0]} to {limits[1]}")
    return math.trunc(number)


FIELDS: dict[str, Callable[[str, object], object]] = {
    "name": _name,
    "eye": _point,
    "look_at": _point,
    "up": _up,
    "d": _distance,
    "camera": _text,
    "width": partial(_whole, limits=_SIZES),
    "height": partial(_whole, limits=_SIZES),
    "frame": partial(_whole, limits=_FRAMES),
    "engine": partial(_choice, among=ENGINES),
    "samples": partial(_whole, limits=_SAMPLES),
    "level": partial(_choice, among=LEVELS),
    "principal_point": _pair,
    "pixel_aspect": _aspect,
    "mirrored": _truth,
}
"""The check of each field: (what a sentence calls it, value) → the value as a Shot keeps it, or InputError."""
