"""pbrt's LookAt, and the field of view of the Camera after it."""

import re

from . import parsing
from .parsing import VECTORS, Values

PATTERN = re.compile(r"\bLookAt\b")

_NINE_NUMBERS = re.compile(r"\bLookAt(?:\s++[-+.\deE]++){9}")
_MOVES = ("Rotate", "Translate", "Transform", "ConcatTransform", "CoordSysTransform", "Identity")
_STATEMENT = re.compile(r'"[^"]*+"?+|([A-Za-z]\w*+)')
_KIND = re.compile(r'\s*+"([^"]*+)"')
_PARAMETER = re.compile(r'\s*+"\s*+\w++\s++(\w++)\s*+"\s*+')
_VALUE = re.compile(r'\[[^][]*+\]|"[^"]*+"|[^\s"]*+')


def read(text: str, _start: int) -> Values | None:
    """The camera of a scene, of which only the statements before WorldBegin count; None if no LookAt has nine numbers."""
    text = parsing.without(r"#[^\n]*+", text)
    if not _NINE_NUMBERS.search(text):
        return None
    values: Values = {}
    is_mirrored_back = False
    for found in _STATEMENT.finditer(text):
        word, at = found[1], found.end()
        if word == "WorldBegin":
            break
        if word in _MOVES:
            parsing.fail(text, found.start(), "LookAt alone is, write eye, look-at and up of the scene")
        if word == "Scale":
            if "eye" in values or parsing.numbers(text, at, 3, "Scale")[0] != (-1, 1, 1):
                parsing.fail(text, found.start(), "of Scale only -1 1 1 before LookAt is")
            is_mirrored_back = not is_mirrored_back
        elif word == "LookAt":
            if "eye" in values:
                parsing.fail(text, found.start(), "there is a LookAt before, leave one out")
            numbers, _ = parsing.numbers(text, at, 9, "LookAt")
            values.update(zip(VECTORS, (numbers[0:3], numbers[3:6], numbers[6:9]), strict=True))
        elif word == "Camera":
            values["fov"], values["axis"] = _field_of_view(text, at), "smaller"
    if "eye" in values and not is_mirrored_back:
        values["notes"] = (parsing.left_handed("pbrt"),)
    return values


def _field_of_view(text: str, at: int) -> float:
    """Degrees, of the camera whose kind and parameters stand at `at`."""
    kind = _KIND.match(text, at)
    if not kind or kind[1] != "perspective":
        parsing.fail(text, at, "only a perspective camera is a pinhole")
    angle, at = 90.0, kind.end()
    while parameter := _PARAMETER.match(text, at):
        at = parameter.end()
        if parameter[1] in ("screenwindow", "frameaspectratio"):
            parsing.fail(text, parameter.start(), "leave this out, and give the picture its size in Blender")
        if parameter[1] == "fov":
            (angle,), _ = parsing.numbers(text, at, 1, "fov")
        at = _VALUE.match(text, at).end()
    return angle
