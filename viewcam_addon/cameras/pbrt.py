"""pbrt's scenes, version 2 to 4, and LuxRender's: the transforms before the Camera, the Camera and the Film.

**Pose.** The current transform at `Camera` takes world space to the camera's, x to the right of the picture, y upwards, z into
the view; each statement multiplies from the right, and what stands after WorldBegin moves objects. Seen from a right-handed
world that camera is left-handed: LookAt alone gives a mirrored picture, and `Scale -1 1 1` before it, which exporters write,
one that is not. LuxRender has LookAt from version 1, where it was right-handed: scenes of these two are known by their film and
their SearchPath.

**Picture.** `fov` is the angle of the *shorter* side. The image plane, [−1, 1] along that side, is `screenwindow` if that is
given; `frameaspectratio` changes its longer side. The film is 1280 × 720 unless said; `cropwindow` keeps a part of it, in
whole pixels, and moves nothing.

Sources: pbrt-v4's src/pbrt/cameras.cpp (PerspectiveCamera::Create), film.cpp (FilmBaseParameters), util/transform.cpp (LookAt)
and scene.cpp; pbrt-v3's src/core/api.cpp; LuxRender's core/geometry/transform.cpp. Rejected: following
Include, since a paste has no folder.
"""

import math
import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple, cast

import numpy as np

from .. import checks
from ..errors import InputError
from ..pinhole import Pinhole, Triple
from . import axes, naming, own, texts
from .camera import Camera, Options, not_a_pinhole
from .source import Source

TITLE = "pbrt scene"
SUFFIX = ".pbrt"
SEVERAL = "a folder"

_COMMENT = r"#[^\n]*"
_WORDS = re.compile(
    r"\"([^\"\\]*(?:\\.[^\"\\]*)*)\"|([A-Za-z]\w*)|([-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?(?![\w.]))|([][])"
    r"|(\"[^\"\\]*(?:\\.[^\"\\]*)*|\d[\w.]*|\S)"
)
_KINDS = ("perspective", "orthographic", "environment", "spherical", "realistic")
_STATEMENT = re.compile(rf'\bLookAt\s+[-+.\d\[]|\bCamera\s*"(?:{"|".join(_KINDS)})"|^[ \t]*Camera[ \t]*"\w+"', re.MULTILINE)
_LUX = re.compile(r'\bFilm\s*"(?:fleximage|multiimage)"|^[ \t]*SearchPath[ \t]*"', re.MULTILINE)
_MOVES = {"LookAt": 9, "Translate": 3, "Scale": 3, "Rotate": 4, "Transform": 16, "ConcatTransform": 16, "Identity": 0}
_NOT_READ = {"Include", "Import"}
_SIZE = (1280, 720)
_MOST_MOVES = 1_000
_NARROWEST = 1e-9  # degrees
_TIMES = {"All": (0, 1), "StartTime": (0,), "EndTime": (1,)}
_HARMLESS = {"shutteropen", "shutterclose", "focaldistance", "lensradius", "medium", "hither", "yon"}

# A parameter: its name, its values (numbers or texts), and where it stands.
_Parameters = dict[str, tuple[list, int]]


def recognizes(source: Source) -> bool:
    return not source.is_binary and source.text.lstrip()[:1] not in ("<", "{", "[") and _has_statement(source.text)


def _has_statement(text: str) -> bool:
    """True if a LookAt is followed by a number, or a Camera by the name of one."""
    return ("LookAt" in text or "Camera" in text) and bool(_STATEMENT.search(texts.without(_COMMENT, text[: 2**20])))


def read(source: Source, options: Options) -> list[Camera]:
    text = texts.without(_COMMENT, source.text)
    scene = _Scene(text)
    with np.errstate(all="ignore"):  # a transform beyond all numbers is refused where the camera takes it
        for word, at, arguments, parameters in _statements(text):
            if word == "WorldBegin":
                break
            scene.take(word, at, arguments, parameters)
        return [scene.camera(options)]


_NOTHING, _MIRROR = np.eye(4), np.diag([-1.0, 1.0, 1.0, 1.0])


class _Transform(NamedTuple):
    """A current transform. look : the numbers of a LookAt that alone, but for a mirror before it, is the transform."""

    matrix: np.ndarray = _NOTHING
    look: Sequence[float] | None = None
    mirrored: bool = True


def _vectors(look: Sequence[float]) -> tuple[Triple, Triple, Triple]:
    """Eye, look-at and up of a LookAt's numbers."""
    return cast(Triple, look[0:3]), cast(Triple, look[3:6]), cast(Triple, look[6:9])


class _Scene:
    """The statements before WorldBegin."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.transforms: tuple[_Transform, ...] = _Transform(), _Transform()  # as the shutter opens, and as it closes
        self.active: tuple[int, ...] = (0, 1)
        self.moves = self.cameras = 0
        self.kept: list[tuple[tuple[_Transform, ...], tuple[int, ...]]] = []
        self.named: dict[str, tuple[_Transform, ...]] = {}
        self.is_lux = bool(_LUX.search(text))
        self.at_camera: tuple[_Transform, ...] | None = None
        self.lens: tuple[str, int, _Parameters] | None = None
        self.film: _Parameters | None = None

    def take(self, word: str, at: int, arguments: list, parameters: _Parameters) -> None:
        if word in _MOVES:
            self._move(word, at, arguments)
        elif word in ("AttributeBegin", "TransformBegin"):
            self.kept.append((self.transforms, self.active))
        elif word in ("AttributeEnd", "TransformEnd"):
            if self.kept:
                self.transforms, self.active = self.kept.pop()
        elif word == "CoordinateSystem" and arguments:
            self.named[str(arguments[0])] = self.transforms
        elif word == "CoordSysTransform":
            if arguments == ["camera"] and self.at_camera:
                self.named["camera"] = tuple(
                    _Transform(np.linalg.inv(self._invertible(each.matrix, at))) for each in self.at_camera
                )
            if not arguments or not isinstance(arguments[0], str) or arguments[0] not in self.named:
                texts.fail(self.text, at, "name a CoordinateSystem that stands before it")
            self.transforms = self.named[arguments[0]]
        elif word == "ActiveTransform":
            if arguments[:1] and arguments[0] not in _TIMES:
                texts.fail(self.text, at, f"give one of {', '.join(_TIMES)}")
            self.active = _TIMES[arguments[0]] if arguments else (0, 1)
        elif word in _NOT_READ and self.lens is None:
            texts.fail(self.text, at, "other files are not read, copy the camera out of that one")
        elif word == "Camera":
            self.cameras += 1
            if not arguments or not isinstance(arguments[0], str):
                texts.fail(self.text, at, 'give its kind, as in Camera "perspective"')
            self.lens = (arguments[0], at, parameters)
            self.at_camera = self.transforms
            if not np.array_equal(self.transforms[0].matrix, self.transforms[1].matrix):
                texts.fail(self.text, at, "the camera moves while the shutter is open, give one transform for All")
        elif word == "Film":
            self.film = parameters

    def _move(self, word: str, at: int, numbers: list) -> None:
        if len(numbers) != _MOVES[word] or not all(isinstance(x, float) for x in numbers):
            texts.fail(self.text, at, f"give {_MOVES[word]} finite numbers for {word}")
        self.moves += 1
        if self.moves > _MOST_MOVES:
            raise InputError(f"the text has more than {_MOST_MOVES} transforms before WorldBegin: copy one camera")
        step = _matrix(word, numbers, self.text, at)
        if word == "LookAt" and self.is_lux:
            step = _MIRROR @ step
        self.transforms = tuple(
            self._moved(each, word, numbers, step) if time in self.active else each for time, each in enumerate(self.transforms)
        )

    def _moved(self, before: "_Transform", word: str, numbers: list, step: np.ndarray) -> "_Transform":
        matrix = step if word in ("Transform", "Identity") else before.matrix @ step
        if word != "LookAt":
            return _Transform(matrix)
        mirrors = np.array_equal(before.matrix, _MIRROR)
        alone = mirrors or np.array_equal(before.matrix, _NOTHING)
        return _Transform(matrix, numbers if alone else None, mirrors == self.is_lux)

    def camera(self, options: Options) -> Camera:
        kind, at, parameters = self.lens or ("perspective", 0, {})
        if kind != "perspective":
            kind_quoted = checks.quoted(kind)
            not_a_pinhole(f"pbrt's Camera {kind_quoted}", "of a real lens" if kind == "realistic" else kind_quoted.strip("'"))
        matrix, look, mirrored = (self.at_camera or self.transforms)[0]
        notes = [f"pbrt's {name} was not taken" for name in parameters if name not in (*_HARMLESS, *_OF_LENS)]
        if self.cameras > 1:
            notes.append(f"The text has {self.cameras} Cameras, of which pbrt uses the last: so did this")
        if self.lens is None:
            if look is None:
                raise InputError("the text has no Camera, only its pose: copy the Camera statement as well")
            pinhole = texts.posed(*_vectors(look), options.plane_or_refuse("the text"), mirrored)
            return texts.mirroring(Camera("Camera", pinhole, False), "pbrt")
        if _number(parameters, "lensradius", 0.0, self.text) > 0:
            texts.fail(
                self.text, parameters["lensradius"][1], "this lens blurs and is no pinhole, set lensradius to 0 for its middle"
            )
        film, crop = self._film(options)
        left, right, bottom, top = _screen(parameters, film, self.text)
        angle = _angle(parameters, self.text)
        half = math.tan(angle / 2)
        d_x, d_y = film.width / (right - left) / half, film.height / (top - bottom) / half
        c_x, c_top = film.width * -left / (right - left), film.height * top / (top - bottom)
        if look is not None and d_x > 0 and d_y > 0:
            plane = axes.view_plane(d_x, d_y, c_x, c_top, (film.width, film.height))
            pinhole = texts.posed(*_vectors(look), plane, mirrored)
        else:
            to_pixels = np.array([[d_x, 0, c_x], [0, -d_y, c_top], [0, 0, 1]]) @ self._invertible(matrix, at)[:3, :3]
            eye = np.linalg.solve(matrix[:3, :3], -matrix[:3, 3])
            pinhole, more = texts.projected(to_pixels, tuple(eye.tolist()), (film.width, film.height), "pbrt's camera")
            notes += more
        if crop:
            x0, x1, y0, y1 = crop
            pinhole = pinhole.cropped(x0, film.height - y1, x1 - x0, y1 - y0)
        camera = Camera("Camera", pinhole, film.is_stated, (*film.notes, *notes))
        return texts.mirroring(camera, "LuxRender" if self.is_lux else "pbrt")

    def _invertible(self, matrix: np.ndarray, at: int) -> np.ndarray:
        if not np.isfinite(matrix).all() or abs(np.linalg.det(matrix[:3, :3])) < 1e-30:
            texts.fail(self.text, at, "the transform up to here is flat or beyond all numbers, change it")
        return matrix

    def _film(self, options: Options) -> tuple[texts.Film, tuple[int, int, int, int] | None]:
        """The film, and the pixels of it that are kept: x0, x1, y0, y1 from the top left."""
        # A film without its size has that of the version, which nobody knows.
        if self.film is None or not {"xresolution", "yresolution", "cropwindow", "pixelbounds"} & self.film.keys():
            return texts.film(options, "pbrt 3 and 4", default=_SIZE), None
        width, height = (
            _whole(self.film, name, usual, self.text) for name, usual in zip(("xresolution", "yresolution"), _SIZE, strict=True)
        )
        film = texts.film(options, "pbrt", size=(width, height))
        crop = None
        if "pixelbounds" in self.film:
            x0, x1, y0, y1 = (int(x) for x in _numbers(self.film, "pixelbounds", 4, self.text))
            crop = (max(x0, 0), min(x1, film.width), max(y0, 0), min(y1, film.height))
        elif "cropwindow" in self.film:
            x = np.clip(np.array(_numbers(self.film, "cropwindow", 4, self.text), np.float32), 0, 1)
            (x0, x1), (y0, y1) = sorted(x[:2]), sorted(x[2:])
            crop = tuple(
                math.ceil(np.float32(side) * edge)
                for side, edge in zip((film.width,) * 2 + (film.height,) * 2, (x0, x1, y0, y1), strict=True)
            )
        if crop and (crop[1] <= crop[0] or crop[3] <= crop[2]):
            at = (self.film.get("pixelbounds") or self.film["cropwindow"])[1]
            texts.fail(self.text, at, "no pixel is left of the picture, widen it")
        return film, crop


_OF_LENS = {"fov", "halffov", "screenwindow", "frameaspectratio", "lensradius"}


def _screen(parameters: _Parameters, film: texts.Film, text: str) -> tuple[float, float, float, float]:
    aspect = _number(parameters, "frameaspectratio", film.aspect, text)
    if aspect <= 0:
        texts.fail(text, parameters["frameaspectratio"][1], "give a positive ratio")
    if "screenwindow" in parameters:
        left, right, bottom, top = _numbers(parameters, "screenwindow", 4, text)
        if left == right or bottom == top:
            texts.fail(text, parameters["screenwindow"][1], "this window is empty, widen it")
        return left, right, bottom, top
    return (-aspect, aspect, -1.0, 1.0) if aspect > 1 else (-1.0, 1.0, -1 / aspect, 1 / aspect)


def _angle(parameters: _Parameters, text: str) -> float:
    """Radians, of the shorter side."""
    degrees = _number(parameters, "fov", 90.0, text)
    half = _number(parameters, "halffov", -1.0, text)
    degrees = 2 * half if half > 0 else degrees
    if not _NARROWEST < degrees < 180:
        at = parameters["halffov" if half > 0 else "fov"][1]
        texts.fail(text, at, f"the field of view is {degrees:g}°, give an angle between 0 and 180")
    return math.radians(degrees)


def _statements(text: str) -> Iterator[tuple[str, int, list, _Parameters]]:
    """Each statement: its word, its place, its plain arguments, and its parameters."""
    word, at = "", 0
    arguments: list = []
    parameters: _Parameters = {}
    values: list | None = None  # values of the parameter that is being read
    is_open = False
    for match in _WORDS.finditer(text):
        string, name, number, bracket, stray = match.groups()
        if bracket:
            is_open = bracket == "["
            continue
        if name in ("true", "false") or (name in ("All", "StartTime", "EndTime") and word == "ActiveTransform"):
            (arguments if values is None else values).append(name)
        elif name:
            if is_open:
                texts.fail(text, match.start(), "close the bracket before it")
            if word:
                yield word, at, arguments, parameters
            word, at, arguments, parameters, values = name, match.start(), [], {}, None
        elif number:
            (arguments if values is None else values).append(_finite(number, text, match.start()))
        elif stray:
            if word == "WorldBegin" or not word:
                continue
            texts.fail(text, match.start(), "pbrt's statements have words, numbers, quotes and brackets only")
        elif is_open and values is not None:
            values.append(string)
        else:
            parts = string.split()
            if len(parts) == 2 and word and (arguments or word not in ("Camera", "Film")):
                values = []
                parameters[parts[1]] = (values, match.start())
            elif values is not None and not values:
                values.append(string)
            else:
                arguments.append(string)
    if word:
        yield word, at, arguments, parameters


def _finite(number: str, text: str, at: int) -> float:
    value = float(number)
    if not math.isfinite(value):
        texts.fail(text, at, "give a finite number")
    return value


def _numbers(parameters: _Parameters, name: str, count: int, text: str) -> list[float]:
    values, at = parameters[name]
    if len(values) != count or not all(isinstance(value, float) for value in values):
        texts.fail(text, at, f"give {count} numbers for {name}" if count > 1 else f"give a number for {name}")
    return values


def _number(parameters: _Parameters, name: str, usual: float, text: str) -> float:
    return _numbers(parameters, name, 1, text)[0] if name in parameters else usual


def _whole(parameters: _Parameters, name: str, usual: int, text: str) -> int:
    value = _number(parameters, name, float(usual), text)
    if value < 1 or not value.is_integer() or value >= 2**31:
        texts.fail(text, parameters[name][1], f"give whole pixels for {name}")
    return int(value)


def _matrix(word: str, numbers: list[float], text: str, at: int) -> np.ndarray:
    step = np.eye(4)
    if word == "Translate":
        step[:3, 3] = numbers
    elif word == "Scale":
        step[:3, :3] = np.diag(numbers)
    elif word in ("Transform", "ConcatTransform"):
        step = np.array(numbers).reshape(4, 4).T
        if step[3].tolist() != [0, 0, 0, 1]:
            texts.fail(text, at, "its last four numbers should be a translation and 1, pbrt's matrices go column by column")
    elif word == "Rotate":
        length = math.hypot(*numbers[1:])
        if not length:
            texts.fail(text, at, "the axis has no direction, give another")
        step[:3, :3] = texts.turn(numbers[0], [x / length for x in numbers[1:]])
    elif word == "LookAt":
        e, l, up = (np.array(numbers[i : i + 3]) for i in (0, 3, 6))
        pose = Pinhole(tuple(e), tuple(l), tuple(up), 1.0, 1, 1)
        if pose.is_singular:
            texts.fail(text, at, "it looks along its up, for which pbrt has no picture, change up")
        u, v, w = pose.basis()
        step[:3, :3] = [-u, v, -w]
        step[:3, 3] = -step[:3, :3] @ e
    return step


def write(cameras: Sequence[Camera], options: Options) -> str | dict[str, str]:
    """The statements before WorldBegin. Each camera is a scene: a second one would stand in the first one's world."""
    return naming.a_file_each(cameras, SUFFIX, _written)


def _written(camera: Camera) -> str:
    pinhole = camera.pinhole
    (d_x, d_y), (c_x, c_y) = pinhole.distance, pinhole.principal_point
    width, height = pinhole.width, pinhole.height
    window = [-c_x / d_x, (width - c_x) / d_x, -c_y / d_y, (height - c_y) / d_y]
    mirror = [] if pinhole.mirrored else ["Scale -1 1 1"]
    look = "  ".join(texts.listed(vector) for vector in texts.look(pinhole))
    return "\n".join(
        [
            *own.beginning(camera, "#"),
            *mirror,
            f"LookAt {look}",
            f'Camera "perspective" "float fov" [ 90 ] "float screenwindow" [ {texts.listed(window)} ]',
            f'Film "rgb" "integer xresolution" [ {width} ] "integer yresolution" [ {height} ]',
            "",
        ]
    )
