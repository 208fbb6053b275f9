"""This project's own cameras: a line of JSON, a scene file, a picture's sidecar, and what people type.

`write` gives one line of JSON for each camera, with the keys of a scene file (docs/scene-file.md), and of several with their
names; it reads back bit for bit.
`read` understands that and

    eye=(7, -6, 4) look_at=0,0,1 up=[0 0 1] d=1200        in any order, spelling and punctuation; also a Python dict

What a text does not say is that of `Options.base`, and is refused without. A distance or field of view is that of a whole view
plane: principal point in the middle, nothing mirrored, unless the text says so as well.

Rejected: skipping words that are not understood, since one of them may turn the camera.
"""

import contextlib
import json
import math
import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from .. import checks
from ..errors import InputError
from ..pinhole import Pinhole, ViewPlane
from . import texts
from .camera import Camera, Options
from .source import Source
from .texts import AXES, fail, numbers

TITLE = "Virtual Pinhole's text, scene file or sidecar"
SUFFIX = ".json"

VECTORS = ("eye", "look_at", "up")
KEY = "virtual_pinhole"
"""Under which another format's file has a `document` beside its own numbers; or it stands so in a comment."""

_DOCUMENTS = re.compile(rf"{KEY}[^\w{{]{{0,4}}(?:\d{{1,18}} )?(\{{[^{{}}]*\}})")
_BEGINNINGS = re.compile(rf"^(?:#|//) {KEY} of (\"(?:[^\"\\\n]|\\.){{0,1000}}\")", re.MULTILINE)
# The checked values of a text: eye, look_at, up; distance (one or two), width, height, principal_point, mirrored; fov, fov_x,
# fov_y with their axis, degrees or radians as `_Angle` says.
Values = dict[str, Any]

_SPELLINGS = {
    **dict.fromkeys(("eye", "from", "origin", "location", "position", "lookfrom"), "eye"),
    **dict.fromkeys(("lookat", "at", "to", "target", "center", "centre", "focalpoint"), "look_at"),
    **dict.fromkeys(("up", "upvector", "vup", "viewup"), "up"),
    **dict.fromkeys(("distance", "dist", "d"), "distance"),
    **dict.fromkeys(("fov", "fieldofview", "angle"), "fov"),
    **dict.fromkeys(("hfov", "fovx"), "fov_x"),
    **dict.fromkeys(("vfov", "fovy"), "fov_y"),
    **dict.fromkeys(("fovaxis", "axis"), "axis"),
    **dict.fromkeys(("size", "resolution"), "size"),
    **{texts.plain(name): name for name in ("width", "height", "principal_point", "mirrored")},
}
_AXIS_SPELLINGS = {
    **{axis: axis for axis in AXES},
    **dict.fromkeys(("horizontal", "width", "h"), "x"),
    **dict.fromkeys(("vertical", "height", "v"), "y"),
    **dict.fromkeys(("shorter", "narrower"), "smaller"),
    **dict.fromkeys(("longer", "wider"), "larger"),
}
_COUNTS = {**dict.fromkeys(VECTORS, 3), "principal_point": 2, "size": 2}
_LENS = {"distance", "fov", "fov_x", "fov_y"}

_GAP = re.compile(r"[\s,;|()\[\]{}<>'\"]*")
_SAYS = re.compile(r"\s*(?:['\"]\s*)?(?:[=:]\s*)?(?:<?Vector\b)?")
_SAYS_VALUE = re.compile(r"\s*(?:['\"]\s*)?(?:[=:]|[-−+.\d(\[{<]|<?Vector\b|\Z)")
_WORD = re.compile(r"[A-Za-z_][\w-]*")
_TWO_WORDS = re.compile(
    r"(look\s+at|look\s+from|fov\s+axis|field\s+of\s+view|up\s+vector|view\s+up|focal\s+point|principal\s+point)\b",
    re.IGNORECASE,
)
_SIZE = re.compile(r"[\s(\['\"]*(\d{1,9})(?:\s*[x×X*,]\s*|\s+)(\d{1,9})")
_TRUTH = re.compile(r"\s*(true|false|yes|no|0|1)\b", re.IGNORECASE)
_PIXELS = re.compile(r"(?:\s*(?:px|pixels?)\b)?")
_UNIT = re.compile(r"(?:\s*(?:(°|deg(?:rees?)?\b)|(rad(?:ians?)?\b)))?")
_JSON = re.compile(r"\A\s*(?:\{|\"\w+\"\s*:)")
_MOST_LINES = 100_000
_SAID = "write eye=…, look_at=…, up=… and d=…, or copy a camera"


class _Angle(float):
    """An angle whose unit stands beside it, in radians."""


def recognizes(source: Source) -> bool:
    if source.is_binary or source.is_folder:
        return False
    if lines_of(source):
        return True
    if isinstance(document := _document(source), dict):
        return any(isinstance(document.get(key), dict) for key in ("stated_camera", "camera")) or _is_camera(document)
    word = _word(source.text, _after(_GAP, source.text, 0))
    return word is not None and bool(_SAYS_VALUE.match(source.text, word.end()))


def _is_camera(document: dict) -> bool:
    return any(_spelt(key) in (*VECTORS, *_LENS) for key in document) and all(map(_spelt, document))


def read(source: Source, options: Options) -> list[Camera]:
    if lines := lines_of(source):
        return [
            replace(camera(_of_json(line), options, f"camera {number}"), name=str(line.get("name", f"camera {number}")))
            for number, line in enumerate(lines, start=1)
        ]
    document = _document(source)
    values = _of_json(document) if isinstance(document, dict) else pairs(source.text.replace("−", "-"))
    return [camera(values, options, source.name)]


def write(cameras: Sequence[Camera], options: Options) -> str:
    """A line of JSON for each camera, which has its name where there are several."""
    if len(cameras) == 1:
        return json.dumps(document(cameras[0].pinhole))
    return "\n".join(json.dumps({"name": camera.name} | document(camera.pinhole)) for camera in cameras)


def document(pinhole: Pinhole) -> dict:
    """A camera's values, each a float64 to the bit. Only what is not as usual is said, but the size always: distances count
    its pixels.
    """
    d_x, d_y = pinhole.distance
    document: dict[str, Any] = {name: list(getattr(pinhole, name)) for name in VECTORS}
    document |= {"distance": d_x if d_x == d_y else [d_x, d_y], "width": pinhole.width, "height": pinhole.height}
    if pinhole.principal_point != (pinhole.width / 2, pinhole.height / 2):
        document["principal_point"] = list(pinhole.principal_point)
    if pinhole.mirrored:
        document["mirrored"] = True
    return document


def comment(pinhole: Pinhole) -> str:
    """The values as a comment has them, without the signs of one."""
    return f"{KEY} {json.dumps(document(pinhole))}"


def beginning(camera: Camera, sign: str) -> list[str]:
    """The lines with which a camera's code begins where that of others stands before or after it: its name and its values.

    sign : the characters with which a comment begins.
    """
    return [f"{sign} {KEY} of {json.dumps(camera.name)}", f"{sign} {comment(camera.pinhole)}"]


def parts(text: str) -> list[tuple[str, str]]:
    """The name and the code of each camera of a text, split where `beginning` stands; none if it stands nowhere."""
    starts = [*_BEGINNINGS.finditer(text)]
    ends = [*(match.start() for match in starts[1:]), len(text)]
    whole = [0, *(match.start() for match in starts[1:])]  # text before the first is the first one's
    return [
        (str(json.loads(match[1], strict=False)), text[start:end])
        for match, start, end in zip(starts, whole, ends, strict=False)
    ]


def pinholes_in(text: str) -> list[Pinhole]:
    """The cameras whose values stand in a text, under KEY or in a `comment`; what makes none is passed over."""
    result = []
    for each in _DOCUMENTS.finditer(text):
        with contextlib.suppress(ValueError, InputError, TypeError):
            result.append(Pinhole(**json.loads(each[1])))
    return result


def camera(values: Values, options: Options, what: str) -> Camera:
    """The camera of what a text says, completed by the options.

    Raises InputError if it contradicts itself, or lacks something that the options do not say either.
    """
    if not values.keys() & {*VECTORS, *_LENS}:
        raise InputError("the text says neither eye, look-at, up nor distance of a camera: copy one, or write eye=1,2,3")
    vectors: dict[str, Any] = {}
    for name in VECTORS:
        value = values.get(name, getattr(options.base, name, None))
        if value is None:
            raise InputError(f"{what} says no {name} of the camera: add {name}=x,y,z")
        vectors[name] = checks.vector(name, value, 3)
    plane, stated, notes = _plane(values, options, what)
    mirrored = values.get("mirrored", bool(options.base and options.base.mirrored and not values.keys() & _LENS))
    pinhole = Pinhole(**vectors, **vars(plane), mirrored=mirrored)
    return Camera("Camera", pinhole, stated, notes)


def _plane(values: Values, options: Options, what: str) -> tuple[ViewPlane, bool, tuple[str, ...]]:
    lengths = [key for key in ("distance", "fov", "fov_x", "fov_y") if key in values]
    if len(lengths) > 1:
        raise InputError("the text says the field of view or distance more than once: leave one of them out")
    if not lengths:
        return options.plane_or_refuse(what), False, ()
    width, height = (checks.whole(key, values[key]) if key in values else None for key in ("width", "height"))
    film = texts.film(options, what, (width, height) if width and height else None)
    if lengths == ["distance"]:
        distance = values["distance"]
        if isinstance(distance, tuple):
            plane = ViewPlane(distance, (film.width / 2, film.height / 2), film.width, film.height)
        else:  # in pixels of a picture of which perhaps only the width is known
            plane = film.centered(distance * (film.width / width if width else 1.0))
    else:
        angle, axis = _angle(values, lengths[0], options)
        plane = film.plane(angle, axis)
    if "principal_point" in values:
        plane = ViewPlane(plane.distance, values["principal_point"], film.width, film.height)
    return plane, film.is_stated, film.notes


def _angle(values: Values, key: str, options: Options) -> tuple[float, str]:
    value = values[key]
    axis = {"fov": values.get("axis"), "fov_x": "x", "fov_y": "y"}[key]
    if axis is None:
        degrees = f"{math.degrees(value) if isinstance(value, _Angle) else value:g}"
        raise InputError(f"a field of view of {degrees}° may be meant across or upwards: add axis=x or axis=y")
    radians = value if isinstance(value, _Angle) else texts.angle_of(value, "the field of view", options)
    if not 0 < radians < math.pi:
        raise InputError(f"the field of view is {math.degrees(radians):g}°: give an angle between 0 and 180")
    return radians, axis


def _spelt(key: object) -> str | None:
    return _SPELLINGS.get(texts.plain(str(key)[:40]))


# ---- JSON


def lines_of(source: Source) -> list[dict]:
    """The cameras of a text with one on each line; none if it is something else."""
    lines = [line for line in source.text.split("\n", _MOST_LINES) if line.strip()]
    if len(lines) < 2 or not all(line.startswith("{") and line.rstrip().endswith("}") for line in lines):
        return []
    documents = [dict(Source(line).document) for line in lines]
    return documents if all(map(_is_camera_of_several, documents)) else []


def _is_camera_of_several(document: dict) -> bool:
    return _is_camera({key: value for key, value in document.items() if key != "name"})


def _document(source: Source) -> object:
    """The JSON object, also without its braces; None if this is none."""
    text = source.text
    if not _JSON.match(text):
        return None
    if source.json is not None:
        return source.json
    if text.lstrip().startswith("{"):
        return None
    return Source("{" + text.strip().rstrip(",") + "}").json


def _of_json(document: dict) -> Values:
    # The camera that was asked for comes before the one that Blender made of it.
    camera = next((document[key] for key in ("stated_camera", "camera") if isinstance(document.get(key), dict)), document)
    values: Values = {}
    for key, value in camera.items():
        if key == "name" and camera is document:
            continue
        name = _spelt(key)
        if name is None:
            raise InputError(f"the key {checks.quoted(key)} is none of a camera: write eye, look_at, up and distance")
        if name in values:
            raise InputError(f"the key {checks.quoted(key)} says {name} once more: leave one of them out")
        values[name] = _checked(key, name, value)
    if "size" in values:
        values["width"], values["height"] = values.pop("size")
    if "origin" in document and camera is not document:  # a scene whose coordinates are counted from there
        origin = checks.vector("origin", document["origin"], 3)
        for key in values.keys() & {"eye", "look_at"}:
            values[key] = tuple(a + b for a, b in zip(values[key], origin, strict=True))
    return values


def _checked(key: str, name: str, value: object) -> object:
    if name == "axis":
        return axis(str(value), 0)[0]
    if name == "mirrored":
        return checks.truth(key, value)
    if name in ("width", "height"):
        return checks.whole(key, int(value) if isinstance(value, float) and value.is_integer() else value)
    if name == "size":
        return tuple(map(int, checks.vector(key, value, 2)))
    if name == "distance" and isinstance(value, list):
        return checks.vector(key, value, 2)
    if name in _COUNTS:
        return checks.vector(key, value, _COUNTS[name])
    return checks.number(key, value)


# ---- keys and values


def pairs(text: str) -> Values:
    """Keys and their values, with or without = and : between them, and any brackets and separators around them.

    Raises InputError at the first word that is no key.
    """
    values: Values = {}
    at = 0
    while (at := _after(_GAP, text, at)) < len(text):
        word = _word(text, at)
        if not word:
            fail(text, at, _SAID)
        name = _spelt(word[0]) or ""
        if name in values:
            fail(text, at, f"{name} is given twice, leave one out")
        start = _after(_SAYS, text, word.end())
        values[name], at = _value(text, start, name)
    if "size" in values:
        values["width"], values["height"] = values.pop("size")
    return values


def _after(pattern: re.Pattern[str], text: str, at: int) -> int:
    """The end of what a pattern, which may be nothing, matches at a place."""
    match = pattern.match(text, at)
    return match.end() if match else at


def _word(text: str, at: int) -> re.Match | None:
    word = _TWO_WORDS.match(text, at) or _WORD.match(text, at)
    return word if word and _spelt(word[0]) else None


def _value(text: str, start: int, name: str) -> tuple[object, int]:
    if name == "axis":
        return axis(text, start)
    if name == "mirrored":
        if not (match := _TRUTH.match(text, start)):
            fail(text, start, "say true or false for mirrored")
        return match[1].lower() in ("true", "yes", "1"), match.end()
    if name == "size":
        if not (match := _SIZE.match(text, start)):
            fail(text, start, "give the size as in 1920x1080")
        return (int(match[1]), int(match[2])), match.end()
    if name in _COUNTS:
        return numbers(text, start, _COUNTS[name], name)
    (value,), at = numbers(text, start, 1, name)
    if name in ("width", "height"):
        if not value.is_integer():
            fail(text, start, "give whole pixels")
        return int(value), _after(_PIXELS, text, at)
    if name == "distance":
        return value, _after(_PIXELS, text, at)
    unit = _UNIT.match(text, at)
    if unit is None:
        return value, at
    if unit[1]:
        value = _Angle(math.radians(value))
    elif unit[2]:
        value = _Angle(value)
    return value, unit.end()


def axis(text: str, at: int) -> tuple[str, int]:
    """One of `AXES`, in any spelling, and where the word ends."""
    at = _after(_GAP, text, at)
    word = _WORD.match(text, at)
    if not word or word[0].lower() not in _AXIS_SPELLINGS:
        fail(text, at, f"give one of {', '.join(AXES)} for the axis of the field of view")
    return _AXIS_SPELLINGS[word[0].lower()], word.end()
