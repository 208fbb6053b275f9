"""A camera as JSON: the four values, the camera of a scene file, or a scene file (docs/scene-file.md)."""

import json
import re
from typing import NoReturn

from .. import checks
from ..errors import InputError
from . import parsing
from .parsing import SPELLINGS, VECTORS, Values

PATTERN = re.compile(r"\A(?:\{|\"\w++\"\s*+:)")
_NUMBERS = ("distance", "width", "fov", "fov_x", "fov_y")


def read(text: str, _start: int) -> Values | None:
    """A JSON object, with or without its braces; None if the text only looks like one."""
    document = _parsed(text)
    if document is None:
        return None
    # What was asked for comes before what Blender made of it.
    camera = next((document[key] for key in ("stated_camera", "camera") if isinstance(document.get(key), dict)), document)
    values: Values = {}
    for key, value in camera.items():
        name = SPELLINGS.get(re.sub(r"[\s_-]", "", key[:40]).lower(), key)
        if name in values:
            raise InputError(f"the key {checks.shown(key)} says {name} once more: leave one of them out")
        values[name] = value
    notes = _notes_beyond_values(values)
    for key, value in values.items():
        if key in VECTORS:
            values[key] = checks.vector(key, value, 3)
        elif key == "axis":
            values[key], _ = parsing.axis(str(value), 0)
        elif key in _NUMBERS:
            values[key] = checks.number(key, value)
        else:
            raise InputError(f"the key {checks.shown(key)} is none of a camera: write eye, look_at, up and distance")
    if "origin" in document and camera is not document:  # a scene whose coordinates are counted from there
        origin = checks.vector("origin", document["origin"], 3)
        for key in values.keys() & {"eye", "look_at"}:
            values[key] = tuple(a + b for a, b in zip(values[key], origin, strict=True))
    return values | {"notes": notes}


def _notes_beyond_values(values: Values) -> tuple[str, ...]:
    """Take out what a scene file's camera says beyond the four values; a note on each that is not as usual."""
    notes = []
    size = [checks.number(key, values[key], 1.0) for key in ("width", "height") if key in values]
    values.pop("height", None)
    if isinstance(values.get("distance"), list):
        across, upwards = checks.vector("distance", values["distance"], 2)
        values["distance"] = across
        if across != upwards:
            notes.append("The copied camera has pixels that are not square: the distance counts their widths")
    point = values.pop("principal_point", None)
    if point is not None and len(size) == 2 and checks.vector("principal_point", point, 2) != (size[0] / 2, size[1] / 2):
        notes.append("The copied camera is shifted: set Shift X and Y as well")
    if values.pop("mirrored", False):
        notes.append("The copied camera is mirrored: this one is not")
    return tuple(notes)


def _parsed(text: str) -> dict | None:
    """The JSON object, without NaN and without keys that appear twice, or None if the text is none."""
    if not text.startswith("{"):
        text = "{" + text.rstrip(",") + "}"
    try:
        return json.loads(text, parse_int=float, parse_constant=_not_finite, object_pairs_hook=_unique)
    except (json.JSONDecodeError, RecursionError):
        return None


def _unique(pairs: list[tuple[str, object]]) -> dict:
    result = {}
    for key, value in pairs:
        if key in result:
            raise InputError(f"the key {checks.shown(key)} is given twice: leave one out")
        result[key] = value
    return result


def _not_finite(name: str) -> NoReturn:
    raise InputError(f"{name} is no number of a camera: give finite ones")
