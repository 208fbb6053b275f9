"""POV-Ray's camera { … }.

**Vectors.** `right`, `up` and `direction` span the picture: the ray through (x, y), from the top left in parts of the picture,
goes along direction + (x − ½) right + (½ − y) up. So shape and handedness are in `right` and `up`, whatever the picture's size:
seen from a right-handed world `right x` gives a mirrored picture, and `right -x` one that is not. `angle` sets the length of
`direction` for the horizontal field of view. `look_at` turns the camera by `sky`, keeping those lengths.

**Order.** From version 3.5 on these are applied in one order, wherever they stand, and rotate, translate, scale and matrix
after them as they stand. Of several cameras the last counts. What POV-Ray computes (`#declare`, sums,
`image_width/image_height`) is computed as far as it is plain arithmetic; what stands under #if,
in a loop or a macro is refused.

Sources: POV-Ray 3.7's source/backend/parser/parser.cpp (Parse_Camera) and source/backend/render/tracepixel.cpp. Rejected:
following #include, since a paste has no folder.
"""

import bisect
import contextlib
import math
import re
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ..errors import InputError
from . import axes, naming, own, texts
from .camera import Camera, Options, not_a_pinhole
from .expressions import Expressions, Unknown, numbers
from .source import Source

TITLE = "POV-Ray camera"
SUFFIX = ".pov"
SEVERAL = "a folder"

_CAMERA = re.compile(r"\bcamera\s*\{")
_COMMENT = r"//[^\n]*|/\*.*?(?:\*/|\Z)"
_DECLARE = re.compile(r"#\s*(?:declare|local)\s+(\w+)\s*=\s*")
_CONDITION = re.compile(r"#\s*(if|ifdef|ifndef|while|for|switch|macro|end)\b")
_VERSION = re.compile(r"#\s*version\s+(\d+(?:\.\d+)?)")
_WORD = re.compile(r"\s*([A-Za-z_]\w*)")
_VECTORS = ("location", "right", "up", "direction", "sky", "look_at")
_SIZE = (800, 600)
_NARROWEST = 1e-9  # degrees
_PARALLEL = 1e-10  # POV-Ray's EPSILON
_MOVES = ("rotate", "translate", "scale", "matrix")
_KINDS = (
    *("orthographic", "fisheye", "ultra_wide_angle", "omnimax", "panoramic", "cylinder", "spherical", "mesh_camera"),
    *("stereo", "octa", "cube", "plate_carree", "mercator", "lambert_azimuthal", "lambert_cylindrical"),
)
_BLUR = ("blur_samples", "focal_point", "confidence", "variance", "bokeh", "aperture")
_WORDS = "|".join((*_VECTORS, *_MOVES, *_KINDS, *_BLUR, "perspective", "angle"))
_SAYS_CAMERA = re.compile(rf"\bcamera\s*\{{\s*(?:(?:{_WORDS})\b|(\w+)\s*((?:{_WORDS})\b)?)")
_PIXELS = re.compile(r"\+([WwHh])(\d{1,6})\b")
_UNITS = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def recognizes(source: Source) -> bool:
    if source.is_binary or not _CAMERA.search(source.text):
        return False
    text = texts.without(_COMMENT, source.text)
    declared = {match[1] for match in _DECLARE.finditer(text)}
    is_stated = any(match[1] is None or match[1] in declared or match[2] for match in _SAYS_CAMERA.finditer(text))
    return is_stated and _in_use(text) is not None


def read(source: Source, options: Options) -> list[Camera]:
    text = texts.without(_COMMENT, source.text)
    version = _VERSION.search(text)
    number = float(version[1]) if version else 3.7
    if version and number < 3.5:
        texts.fail(
            text, version.start(), "before version 3.5 the order of the statements counted otherwise, write #version 3.7"
        )
    block = _in_use(text)
    if block is None:
        raise InputError(f"{source.name} has camera {{ … }} in comments only: give one outside of them")
    start, others = block
    camera = _Block(text, start, options, _size(source.text), number).camera()
    return [camera.noted(*([f"Of {others + 1} cameras the last is the one in use"] if others else []))]


def _size(text: str) -> tuple[int, int] | None:
    """The pixels that the command line asks for, if a comment repeats it, as in // +W640 +H360."""
    sizes = {(letter.upper(), int(number)) for letter, number in _PIXELS.findall(text)}
    size = dict(sizes)
    return (size["W"], size["H"]) if len(sizes) == 2 and size.keys() == {"W", "H"} and min(size.values()) > 0 else None


def _in_use(text: str) -> tuple[int, int] | None:
    """The opening of the block of the camera in use, and how many others there are; None if there is no camera."""
    blocks = [match.end() - 1 for match in _CAMERA.finditer(text)]
    if not blocks:
        return None
    declared = {match.end(): match[1] for match in _DECLARE.finditer(text)}
    starts = {match.end() - 1: match.start() for match in _CAMERA.finditer(text)}
    used = [opened for opened in blocks if starts[opened] not in declared]
    chosen = used or blocks
    if not used and len(blocks) > 1:
        names = ", ".join(declared[starts[opened]][:40] for opened in blocks[:8])
        raise InputError(f"there are {len(blocks)} cameras and none is in use: keep one of {names}")
    return chosen[-1], len(used) - 1 if used else 0


class _Block:
    """A camera whose block opens at a place."""

    def __init__(self, text: str, opened: int, options: Options, size: tuple[int, int] | None, version: float) -> None:
        self.text, self.options, self.size, self.version = text, options, size, version
        self.conditions = _conditions(text)
        self._refuse_condition(opened)
        self.declared: dict[str, list[int]] = {}
        for match in _DECLARE.finditer(text, 0, opened):
            self.declared.setdefault(match[1], []).append(match.end())
        self._before, self._depth = opened, 0
        self._values: dict[int, object] = {}  # by where it is declared
        self._aspect_of_film = False
        self.film: texts.Film | None = None
        self.reader = Expressions(text, self._name, angled=True)
        self.values: dict[str, Any] = {}
        self.moves: list[tuple[np.ndarray, np.ndarray]] = []
        self._collect(opened, 0)

    def _refuse_condition(self, at: int) -> None:
        if any(start < at < end for start, end in self.conditions):
            texts.fail(self.text, at, "it stands under #if, in a loop or a macro, copy what counts")

    def _name(self, path: str) -> object:
        if path in _UNITS:
            return _UNITS[path]
        if path in ("image_width", "image_height"):
            self._aspect_of_film = True
            return float(self._filmed().width if path == "image_width" else self._filmed().height)
        place = self._declared_at(path)
        if place is None or self._depth > 20:
            return None
        if place not in self._values:
            with self._standing_at(place):
                self._values[place] = self.reader.value(place)[0]
        return self._values[place]

    def _declared_at(self, name: str) -> int | None:
        """The place where it was declared before it is used: what it stands for is not what it is declared as later."""
        places = self.declared.get(name, [])
        count = bisect.bisect_left(places, self._before)
        if not count:
            return None
        self._refuse_condition(places[count - 1])
        return places[count - 1]

    @contextlib.contextmanager
    def _standing_at(self, place: int) -> Iterator[None]:
        before, self._before = self._before, place
        self._depth += 1
        try:
            yield
        finally:
            self._before = before
            self._depth -= 1

    def _filmed(self) -> texts.Film:
        if self.film is None:
            self.film = texts.film(self.options, "POV-Ray's camera", self.size, default=_SIZE)
        return self.film

    def _collect(self, opened: int, depth: int) -> None:
        end = texts.closing(self.text, opened, "{}")
        at, is_first = opened + 1, True
        while match := _WORD.match(self.text, at, end):
            word, at = match[1], match.end()
            at = self._take(word, match.start(1), at, is_first, depth)
            is_first = False
            while self.text[at : at + 1] in (",", ";", " ", "\n", "\t") and at < end:
                at += 1
        if self.text[at:end].strip():
            texts.fail(self.text, at, "give location, look_at, sky, angle, right, up and direction")

    def _take(self, word: str, start: int, at: int, is_first: bool, depth: int) -> int:
        if word == "perspective":
            return at
        if word in _KINDS:
            not_a_pinhole("POV-Ray's camera", word)
        if word in _VECTORS:
            value, end = self.reader.value(at)
            self.values[word] = self._vector(value, at, word)
            return end
        if word in ("angle", "aperture", *_BLUR):
            value, end = self.reader.value(at)
            if word in ("angle", "aperture") and not isinstance(value, float):
                texts.fail(self.text, _place(value, at), f"give a plain number for {word}")
            self.values[word] = value
            if word == "bokeh":
                texts.fail(self.text, start, "this camera blurs and is no pinhole, take bokeh out")
            if self.text[(after := end) : after + 1] == ",":  # angle of a fisheye, confidence
                end = self.reader.value(after + 1)[1]
            return end
        if word in _MOVES:
            return self._move(word, at)
        place = self._declared_at(word) if is_first and depth < 5 else None
        if place is not None and (camera := _CAMERA.match(self.text, place)):
            with self._standing_at(place):
                self._collect(camera.end() - 1, depth + 1)
            return at
        texts.fail(self.text, start, "give location, look_at, sky, angle, right, up, direction and moves alone")

    def _vector(self, value: object, at: int, word: str) -> tuple[float, float, float]:
        if isinstance(value, float):
            value = (value,) * 3
        result = numbers(value, 3)
        if result is None:
            texts.fail(self.text, _place(value, at), f"give plain numbers for {word}")
        return result[0], result[1], result[2]

    def _move(self, word: str, at: int) -> int:
        value, end = self.reader.value(at)
        turn, shift = np.eye(3), np.zeros(3)
        if word == "matrix":
            numbers_given = numbers(value, 12)
            if numbers_given is None:
                texts.fail(self.text, _place(value, at), "give twelve plain numbers for matrix")
            rows = np.array(numbers_given).reshape(4, 3)
            turn, shift = rows[:3].T, rows[3]
        else:
            vector = self._vector(value, at, word)
            if word == "translate":
                shift = np.array(vector)
            elif word == "scale":
                turn = np.diag([part or 1.0 for part in vector])
            else:
                for degrees, axis in zip(vector, np.eye(3), strict=True):
                    turn = texts.turn(degrees, axis) @ turn
        self.moves.append((turn, shift))
        return end

    def camera(self) -> Camera:
        values = self.values
        if values.get("aperture"):
            raise InputError("the camera's aperture blurs, so it is no pinhole: set it to 0 for its middle")
        if "right" not in values and self.version >= 3.8:  # as wide as the picture
            values["right"] = (self._filmed().width * self._filmed().pixel_aspect / self._filmed().height, 0.0, 0.0)
            self._aspect_of_film = True
        right = np.array(values.get("right", (1.33, 0.0, 0.0)))
        up, direction = np.array(values.get("up", _UNITS["y"])), np.array(values.get("direction", _UNITS["z"]))
        sky, eye = values.get("sky", _UNITS["y"]), np.array(values.get("location", (0.0, 0.0, 0.0)))
        lengths = [math.hypot(*vector) for vector in (right, up, direction)]
        if min(lengths) < 1e-12 or max(lengths) > 1e12:
            raise InputError("right, up or direction of POV-Ray's camera has no length: give each one")
        if "angle" in values:
            angle = float(values["angle"])
            if not _NARROWEST < angle < 180:
                raise InputError(f"angle of POV-Ray's camera is {angle:g}°: give one between 0 and 180")
            direction = direction / lengths[2] * (lengths[0] / 2 / math.tan(math.radians(angle) / 2))
            lengths[2] = math.hypot(*direction)
        is_left_handed = float(np.cross(up, direction) @ right) > 0
        along = np.array(values["look_at"]) - eye if "look_at" in values else np.zeros(3)
        if along.any() and np.abs(np.cross(sky, along / math.hypot(*along))).max() < _PARALLEL:
            along, right = along / math.hypot(*along), right / lengths[0]  # POV-Ray keeps right as it is then
            up, direction = np.cross(along, right) * lengths[1], along * lengths[2]
            right = right * (lengths[0] if is_left_handed else -lengths[0])
            values = {word: value for word, value in values.items() if word != "look_at"}
        film = self._film(lengths[0] / lengths[1])
        size = (film.width, film.height)
        # A picture whose pixels nobody said has square ones, and a width that is whole: half a pixel may be missing there.
        is_known = film.is_stated or self._aspect_of_film or self._is_given
        exact = size[0] if is_known else size[1] * lengths[0] / lengths[1] / film.pixel_aspect
        notes: tuple[str, ...] = ()
        if "look_at" in values:
            look_at = values["look_at"]
            plane = axes.view_plane(
                lengths[2] * exact / lengths[0], lengths[2] * size[1] / lengths[1], size[0] / 2, size[1] / 2, size
            )
            if abs(plane.distance[0] / plane.distance[1] - 1) < 2.0**-20:
                d = math.sqrt(plane.distance[0] * plane.distance[1])  # both are one distance but for their rounding
                plane = axes.view_plane(d, d, size[0] / 2, size[1] / 2, size)
            pinhole = texts.posed(tuple(eye.tolist()), look_at, tuple(sky), plane, is_left_handed)
            if self.moves:
                u, v, w = pinhole.basis()
                direction, up = -w * lengths[2], v * lengths[1]
                right = (-u if is_left_handed else u) * lengths[0]
        if "look_at" not in values or self.moves:
            for turn, shift in self.moves:
                eye, right, up, direction = turn @ eye + shift, turn @ right, turn @ up, turn @ direction
            rays = np.column_stack([right / exact, -up / size[1], direction - right / 2 + up / 2])
            if abs(np.linalg.det(rays)) < 1e-30:
                raise InputError("right, up and direction of POV-Ray's camera lie in one plane: turn one of them")
            centered = np.array([[1, 0, (size[0] - exact) / 2], [0, 1, 0], [0, 0, 1]])
            pinhole, notes = texts.projected(centered @ np.linalg.inv(rays), tuple(eye.tolist()), size, "POV-Ray's camera")
        camera = Camera("Camera", pinhole, film.is_stated, (*film.notes, *notes))
        return texts.mirroring(camera, "POV-Ray")

    @property
    def _is_given(self) -> bool:
        """True if somebody said which picture this camera is for."""
        return self.size is None and self.options.size is not None and not self.options.size_fits

    def _film(self, aspect: float) -> texts.Film:
        """The picture: any, if the text takes the shape of whatever it is; else one of the shape that right and up say.

        A size that was given is the picture's, as in POV-Ray, whose pixels are not square then where right and up are of
        another shape: +W640 +H480 with right 1.33 makes them 0.25 % too narrow.
        """
        if self._aspect_of_film or self._is_given:
            return self._filmed()
        return texts.film(self.options, "POV-Ray's camera", self.size, aspect, _SIZE)


def _place(value: object, at: int) -> int:
    return value.at if isinstance(value, Unknown) and value.at else at


def _conditions(text: str) -> list[tuple[int, int]]:
    """The beginnings and ends of #if … #end and their like."""
    result, opened = [], []
    for match in _CONDITION.finditer(text):
        if match[1] != "end":
            opened.append(match.start())
        elif opened:
            start = opened.pop()
            if not opened:
                result.append((start, match.start()))
    return result + [(start, len(text)) for start in opened[:1]]


def write(cameras: Sequence[Camera], options: Options) -> str | dict[str, str]:
    """camera { … } without angles, whose lengths say the distances exactly. Each is a scene, of which the last one counts."""
    return naming.a_file_each(cameras, SUFFIX, _written)


def _written(camera: Camera) -> str:
    pinhole = camera.pinhole
    (d_x, d_y), (c_x, c_y), (width, height) = pinhole.distance, pinhole.principal_point, (pinhole.width, pinhole.height)
    e = texts.listed(pinhole.eye, ", ")
    lines = [f"// +W{width} +H{height}", *own.beginning(camera, "//"), "camera {", f"  location <{e}>"]
    if (c_x, c_y) == (width / 2, height / 2):
        across = texts.shortest(width / d_x)
        lines += [
            f"  right <{across if pinhole.mirrored else '-' + across}, 0, 0>",
            f"  up <0, {texts.shortest(height / d_y)}, 0>",
            "  direction <0, 0, 1>",
            f"  sky <{texts.listed(texts.look(pinhole)[2], ', ')}>",
            f"  look_at <{texts.listed(pinhole.look_at, ', ')}>",
        ]
    else:
        right, up, ahead = pinhole.picture_axes()
        right *= width / d_x
        up *= height / d_y
        direction = ahead + right * ((width / 2 - c_x) / width) + up * ((height / 2 - c_y) / height)
        vectors = (("right", right), ("up", up), ("direction", direction))
        lines += [f"  {name} <{texts.listed(vector.tolist(), ', ')}>" for name, vector in vectors]
    return "\n".join([*lines, "}", ""])
