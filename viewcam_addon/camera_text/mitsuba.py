"""Mitsuba's look-at, in a scene's XML or in Python, and the field of view beside it."""

import re

from . import parsing
from .parsing import Values

XML = re.compile(r"<lookat\b", re.IGNORECASE)
PYTHON = re.compile(r"\blook_at\s*+\(\s*+(?:origin|target|up)\b")

_TAG = re.compile(r"<(/?+\w++)([^<>]*+)>")
_ATTRIBUTE = re.compile(r"(\w++)\s*+=\s*+(?:\"([^\"]*+)\"|'([^']*+)')")
_ITEM = re.compile(r"['\"](fov|fov_axis|focal_length)['\"]\s*+:\s*+['\"]?+([^\s,'\"}]++)")
_MOVES = ("translate", "rotate", "scale", "matrix")


def read_xml(text: str, start: int) -> Values:
    """The camera of a scene's XML, or of a part of it."""
    text = parsing.without(r"<!--.*?(?:-->|\Z)", text)
    tags = [(found.start(), found[1].lower(), _attributes(found[2])) for found in _TAG.finditer(text)]
    looks = [(at, attributes) for at, name, attributes in tags if name == "lookat"]
    if len(looks) != 1:
        parsing.fail(text, start, 'give one <lookat origin="…" target="…" up="…"/>')
    at, attributes = looks[0]
    opened, closed = text.rfind("<transform", 0, at), text.find("</transform", at)
    for place, name, _ in tags:
        if 0 <= opened < place < closed and name in _MOVES:
            parsing.fail(text, place, "<lookat> alone is, write eye, look-at and up of the scene")
    named = {attributes.get("name"): attributes.get("value", "") for _, _, attributes in tags}
    return parsing.pairs(" ".join(f"{name}={value}" for name, value in attributes.items())) | _field_of_view(named)


def read_python(text: str, start: int) -> Values:
    """The camera of a Python expression, or of the dictionary around it."""
    opened = text.index("(", start)
    closed = parsing.closing(text, opened, "()")
    if "@" in text:
        parsing.fail(text, text.index("@"), "look_at alone is, write eye, look-at and up of the scene")
    return parsing.pairs(text, opened, closed) | _field_of_view(dict(_ITEM.findall(text)))


def _attributes(tag: str) -> dict[str, str]:
    return {name: double or single for name, double, single in _ATTRIBUTE.findall(tag)}


def _field_of_view(named: dict[str, str]) -> Values:
    values: Values = {}
    if "fov" in named:
        (values["fov"],), _ = parsing.numbers(named["fov"], 0, 1, "fov")
        values["axis"], _ = parsing.axis(named.get("fov_axis", "x"), 0)
    if "focal_length" in named:
        (values["focal_length"],), _ = parsing.numbers(named["focal_length"], 0, 1, "focal_length")
    return values
