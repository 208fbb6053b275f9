"""POV-Ray's camera { … }, as far as it is a pinhole of location, look_at, sky and angle."""

import re

from . import parsing
from .parsing import Values, Vector

PATTERN = re.compile(r"\bcamera\s*+\{", re.IGNORECASE)

_NAMES = {"location": "eye", "look_at": "look_at", "sky": "up", "angle": "fov"}
_HARMLESS = ("perspective", "right", "up", "aperture", "blur_samples", "focal_point", "confidence", "variance", "bokeh")
_REFUSED = (
    *("direction", "rotate", "translate", "scale", "matrix", "transform"),
    *("orthographic", "fisheye", "ultra_wide_angle", "omnimax", "panoramic", "cylinder", "spherical", "mesh_camera"),
)
_ITEM = re.compile(rf"\b(?:{'|'.join((*_NAMES, *_HARMLESS, *_REFUSED))})\b")
_DIRECTIONS = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
_DIRECTION = re.compile(r"\s*+([-+]?+)\s*+([xyz])\s*+")
_TOWARDS_MINUS = re.compile(r"\s*+<?+\s*+-")


def read(text: str, start: int) -> Values:
    """The camera whose block begins at `start`."""
    text = parsing.without(r"//[^\n]*+|/\*.*?(?:\*/|\Z)", text)
    opened = text.find("{", start)
    if opened < 0:
        parsing.fail(text, start, "give camera { … } outside of a comment")
    text = text[: parsing.closing(text, opened, "{}")]
    items = list(_ITEM.finditer(text, opened))
    starts = [item.start() for item in items] + [len(text)]
    if text[opened + 1 : starts[0]].strip():
        parsing.fail(text, opened + 1, "give location, look_at, sky and angle")
    values: Values = {}
    is_left_handed = True
    for item, end in zip(items, starts[1:], strict=True):
        if item[0] in _REFUSED:
            parsing.fail(text, item.start(), "a camera of location, look_at, sky and angle is")
        if item[0] == "right":
            is_left_handed = not _TOWARDS_MINUS.match(text, item.end(), end)
        if item[0] in _NAMES:
            values[_NAMES[item[0]]] = _value(text, item.end(), end, item[0])
    if "look_at" in values:
        values.setdefault("up", _DIRECTIONS["y"])
    if "fov" in values:
        values["axis"] = "x"
    if "eye" in values and is_left_handed:
        values["notes"] = (parsing.left_handed("POV-Ray"),)
    return values


def _value(text: str, at: int, end: int, name: str) -> Vector | float:
    """A number for `angle`; else <1, 2, 3>, or x, y or z with its sign."""
    if name == "angle":
        (value,), after = parsing.numbers(text, at, 1, name)
    elif axis := _DIRECTION.fullmatch(text, at, end):
        sign = -1.0 if axis[1] == "-" else 1.0
        return tuple(sign * part for part in _DIRECTIONS[axis[2]])
    else:
        value, after = parsing.numbers(text, at, 3, name)
    if text[after:end].strip(" \t\r\n>"):
        parsing.fail(text, after, f"give plain numbers for {name}")
    return value
