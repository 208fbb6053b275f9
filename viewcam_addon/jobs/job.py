"""The job: what is to be rendered or checked, and how, one record, which command line, panel, Python, tests and workers make
alike.

`FIELDS` has the check of each value alone, `conflicts` what values can't be together. A Job raises the first problem; a list
of jobs (lists.py) asks both for all problems there are, with the place of each. To JSON and back is here and nowhere else.
"""

import argparse
import dataclasses
import math
import os
import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Self

from .. import argument_types, checks, machine
from .. import file_names as names
from ..cameras.calibration import Calibration
from ..errors import InputError
from ..pinhole import Triple, check_distance
from ..tracer.scene import film

ENGINES = ("CYCLES", "EEVEE", "VIEWCAM", "WORKBENCH")
TESTED = ("CYCLES", "EEVEE", "WORKBENCH")
"""The engines that are compared with the tracer; all but Cycles by their geometry."""
DEVICES = ("CPU", "CUDA", "OPTIX", "HIP", "ONEAPI", "METAL")
LEVELS = (*film.LEVELS, "auto")

# Blender's limits: RNA's of the resolution and of frames, Cycles' of samples and seeds, and the float32 in which a camera is
# stored.
_SIZES = (4, 65536)
_FRAMES = (-1048574, 1048574)
_SAMPLES = (1, 2**24)
_SEEDS = (0, 2**31 - 1)
_THREADS = (1, 1024)
# The bytes of a pixel in the passes of geometry of both sides: 14 channels in float32 each.
_BYTES_OF_A_CHECK = 2 * 14 * 4
_ASPECTS = (1 / 200, 200.0)
_LARGEST_FLOAT32, _SMALLEST_FLOAT32 = (2.0 - 2.0**-23) * 2.0**127, 2.0**-126

_STRICT = "exit with 3 if anything is not modeled: of the picture where one is compared, else of the file"
_FIND = (
    "for light, in place of --samples: as many of them as it takes to find a bias of that size in 99 of 100 cases, as 0.5%%; "
    "what differs by more is found sooner"
)
_SCENE = "the scene that Cycles must show, as viewcam export wrote it (default: what the file holds now)"

FOUR_VALUES = ("eye", "look_at", "up", "d")
BESIDE_THEM = ("principal_point", "pixel_aspect", "mirrored")


def _option(words: str, default: Any = None, **arguments: Any) -> Any:
    """A field that commands have an option for.

    words : the option's help.
    arguments : further arguments of argparse's add_argument.
    """
    return dataclasses.field(default=default, metadata={"help": words, **arguments})


@dataclass(frozen=True)
class Job:
    """One picture, to be rendered, labeled or checked; immutable and validated.

    name : the name of its files, without a suffix; a job alone needs none.
    eye, look_at, up : three floats, world space;
    d : view-plane distance in pixels, > 0. All four, or `camera`.
    camera : the name of a camera of the .blend, in place of the four values. Without either it is the scene's own at the frame,
        which markers may bind.
    width, height : pixels of the picture, both or none.
    frame : the frame, a whole number.
    engine : the renderer, one of ENGINES.
    samples : the samples of each pixel; of a check at a level of light, of all of Cycles' pictures together.
    level : the amount that the tracer models, one of LEVELS.
    principal_point : (c_x, c_y), where the view axis meets the picture, pixels from its left and bottom edge; its middle where
        None.
    pixel_aspect : width of a pixel over its height, from 1/200 to 200.
    mirrored : true to mirror the picture. These three go with the four values, `principal_point` with a size as well.
    blend : the path of the file; the one that is open where None.
    trust : true if the file's scripts may run and write.
    seed : the seed of all noise.
    threads : the number of threads to render and trace with, all where None.
    calibration : the calibrated camera whose picture is made of this one's, which covers it (`cover` is its view plane), and
        whose labels are traced.

    Of a check:

    error : the standard error of each of the tracer's pixels, scene-linear, in place of its samples.
    find : a share in percent, "0.5%": the bias that a check at a level of light takes as many samples to find as it needs, on
        both sides (comparison/sequential.py).
    device : one of DEVICES, what Cycles renders on.
    clay : true to cover everything with one matte material, on both sides.
    recenter : true to show both sides the scene with its origin at the eye.
    strict : true to make anything that is not modeled an error; of a check, anything in the picture.
    scene : the path of the scene file that the engine must show, in place of what the .blend holds.

    None stands for what the .blend or the command line says.

    Raises InputError if a value is not one of these, or beyond Blender's limits.
    """

    name: str = ""
    eye: Triple | None = None
    look_at: Triple | None = None
    up: Triple | None = None
    d: float | None = None
    camera: str | None = _option("the camera object (default: the scene's)", metavar="NAME")
    width: int | None = None
    height: int | None = None
    frame: int | None = _option("the frame (default: the file's current one)", type=argument_types.frame, metavar="N")
    engine: str | None = _option("who renders; all but Cycles at level geometry (default: CYCLES)", choices=TESTED)
    samples: int | None = None
    level: str | None = None
    principal_point: tuple[float, float] | None = None
    pixel_aspect: float | None = None
    mirrored: bool | None = None
    blend: str | None = None
    trust: bool = _option("let what is in the file run and write: Python, shaders, caches", False)
    seed: int | None = None
    threads: int | None = None
    calibration: Calibration | None = None
    error: float | None = None
    find: str | None = _option(_FIND, type=argument_types.percentage, metavar="PERCENT")
    device: str = _option("what Cycles renders on, all of that kind (default: %(default)s)", "CPU", choices=DEVICES)
    clay: bool = _option("the same matte material on everything, on both sides", False)
    recenter: bool = _option("put the origin at the eye: for scenes far from it", False)
    strict: bool = _option(_STRICT, False)
    scene: str | None = _option(_SCENE, type=argument_types.path, metavar="SCENE.json")

    def __post_init__(self) -> None:
        for field, check in (FIELDS | _MORE).items():
            if getattr(self, field) is not None and (field, getattr(self, field)) != ("name", ""):
                object.__setattr__(self, field, check(field, getattr(self, field)))
        for fields, sentence in conflicts({field: value for field in FIELDS if (value := getattr(self, field)) is not None}):
            shot = f" of the shot {checks.quoted(self.name)}" if self.name else ""
            raise InputError(f"{', '.join(fields)}{shot}: {sentence}")

    @property
    def size(self) -> tuple[int, int] | None:
        """(width, height) in pixels, None where it is the file's."""
        return (self.width, self.height) if self.width is not None and self.height is not None else None

    @property
    def is_of_scenes_camera(self) -> bool:
        """True if the scene's own camera takes the picture."""
        return self.camera is None and self.eye is None

    @property
    def bias(self) -> float | None:
        """`find` as a share of 1."""
        return None if self.find is None else float(self.find.rstrip("%")) / 100.0

    def refuse_unchecked(self) -> None:
        """Raise InputError if no such check can be made."""
        if self.size:
            width, height = self.size
            what = f"the passes of {width} × {height} pixels, of Cycles and of the tracer,"
            machine.check(what, _BYTES_OF_A_CHECK * width * height, "give a smaller --size")
        if self.engine not in (None, *TESTED):
            raise InputError(f"engine {self.engine} is the tracer itself: choose from {', '.join(TESTED)}")
        if self.find and self.level in (None, LEVELS[0]):
            raise InputError("--find is of light, and level geometry has none: give --level direct, path or auto")
        if self.find and (self.samples is not None or self.error is not None):
            raise InputError("--find says how many samples there are: leave --samples and --error out")
        if self.engine in (None, "CYCLES"):
            return
        if self.level not in (None, LEVELS[0]) or self.error:
            raise InputError(f"--engine {self.engine} is checked at level geometry alone: leave --level and --error out")
        if self.device != "CPU":
            raise InputError(f"--device is for Cycles, and {self.engine} renders on what the graphics driver has: leave it out")

    def listed(self) -> dict[str, Any]:
        """The fields that a list of shots can have, those that are not None."""
        return {field: value for field in FIELDS if (value := getattr(self, field)) is not None}

    def check_words(self) -> str:
        """The words of the command line that check this job alone, by the file's name and no more of its path."""
        words = ["--size", f"{self.width}x{self.height}"] if self.size else []
        stated = self.to_json()
        optional = [field.name for field in dataclasses.fields(self) if field.metadata]
        for name in (*optional, "level", "samples", "error", "seed"):
            if name in stated:
                option = f"--{name.replace('_', '-')}"
                words += [option] if stated[name] is True else [option, str(stated[name])]
        return shlex.join(["check", Path(self.blend or "FILE.blend").name, *words])

    def to_json(self) -> dict[str, Any]:
        """The fields that are not as they are by default, as JSON can hold them."""
        stated = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        result = {name: value for name, value in stated.items() if value != type(self).__dataclass_fields__[name].default}
        return result | ({"calibration": self.calibration.to_json()} if self.calibration else {})

    @classmethod
    def from_json(cls, document: Mapping[str, Any]) -> Self:
        """The job that `to_json` gave. Raises InputError as the class does, and for a key that it does not know."""
        if unknown := [key for key in document if key not in cls.__dataclass_fields__]:
            raise InputError(f"there is no option {unknown[0]!r} of a job: give some of {', '.join(cls.__dataclass_fields__)}")
        return cls(**document)


def conflicts(values: Mapping[str, object], in_list: bool = False) -> list[tuple[tuple[str, ...], str]]:
    """The conflicts among the values of one job: (fields, sentence) of each problem.

    values : the stated values by field; None where one is wrong already, and no more is to be told of it.
    in_list : true for one of several jobs, which needs a name, and a camera that is not the scene's own.
    """
    result: list[tuple[tuple[str, ...], str]] = []
    if "name" not in values and in_list:
        result.append((("name",), "missing, give each shot a name of its own for its files"))
    stated = tuple(field for field in (*FOUR_VALUES, *BESIDE_THEM) if field in values)
    missing = tuple(field for field in FOUR_VALUES if field not in values)
    if "camera" in values and stated:
        result.append((("camera", *stated), "a shot has either a camera of the file or the four values, leave one of them out"))
    elif "camera" not in values and missing and (stated or in_list):
        result.append((missing, "missing, give eye, look_at, up and d, or the name of a camera of the file"))
    if "principal_point" in values and "width" not in values:
        result.append((("width", "height"), "missing, the principal point counts pixels of a picture: give its size"))
    if values.get("eye") is not None and values.get("eye") == values.get("look_at"):
        result.append((("eye", "look_at"), "they are the same point, and the view has no direction: move one of them"))
    for side, other in (("width", "height"), ("height", "width")):
        if side in values and other not in values:
            result.append(((other,), f"missing, give {side} and {other}, or neither"))
    return result


def _text(place: str, value: object) -> str:
    if not isinstance(value, str) or not value:
        raise InputError(f"{place} is {checks.quoted(value)}: give a text")
    if any("\udc80" <= character <= "\udcff" for character in value):
        raise InputError(f"{place} is {checks.quoted(value)}, which holds bytes that are not UTF-8: save the file as UTF-8")
    return value


def _path(place: str, value: object) -> str:
    if not isinstance(value, str | os.PathLike):
        raise InputError(f"{place} is {checks.quoted(value)}: give the path of a file")
    return os.fspath(value)


def _calibration(place: str, value: object) -> Calibration:
    if isinstance(value, Mapping):
        return Calibration.from_json(value)
    if not isinstance(value, Calibration):
        raise InputError(f"{place} is {checks.quoted(value)}: give a Calibration")
    return value


def _above_zero(place: str, value: object) -> float:
    number = checks.number(place, value)
    if number <= 0:
        raise InputError(f"{place} is {checks.quoted(value)}: give a number above 0")
    return number


def _percentage(place: str, value: object) -> str:
    try:
        return argument_types.percentage(value if isinstance(value, str) else checks.quoted(value))
    except argparse.ArgumentTypeError as error:
        raise InputError(f"{place}: {error}") from error


def _name(place: str, value: object) -> str:
    name = _text(place, value)
    names.check(place, name)
    return name


def _choice(place: str, value: object, *, among: tuple[str, ...]) -> str:
    if not isinstance(value, str) or value not in among:
        raise InputError(f"{place} is {checks.quoted(value)}: give one of {', '.join(among)}")
    return value


def _vector(place: str, value: object, count: int = 3) -> tuple[Any, ...]:
    point = checks.vector(place, value, count)
    for coordinate in point:
        checks.number(place, coordinate, -_LARGEST_FLOAT32, _LARGEST_FLOAT32)
    return point


def _up(place: str, value: object) -> tuple[Any, ...]:
    up = _vector(place, value)
    if not any(up):
        raise InputError(f"{place} is (0, 0, 0): it has no direction, give the vector that shall point up in the picture")
    return up


def _distance(place: str, value: object) -> float:
    d = checks.number(place, value)
    check_distance(d, place)
    return checks.number(place, d, _SMALLEST_FLOAT32, _LARGEST_FLOAT32)


def _truth(place: str, value: object) -> bool:
    spoken = {"true": True, "false": False}.get(value.lower(), value) if isinstance(value, str) else value
    return checks.truth(place, spoken)


def _whole(place: str, value: object, *, limits: tuple[int, int]) -> int:
    number = checks.number(place, value)
    if not number.is_integer() or not limits[0] <= number <= limits[1]:
        raise InputError(f"{place} is {checks.quoted(value)}: give a whole number from {limits[0]} to {limits[1]}")
    return math.trunc(number)


FIELDS: dict[str, Callable[[str, object], object]] = {
    "name": _name,
    "eye": _vector,
    "look_at": _vector,
    "up": _up,
    "d": _distance,
    "camera": _text,
    "width": partial(_whole, limits=_SIZES),
    "height": partial(_whole, limits=_SIZES),
    "frame": partial(_whole, limits=_FRAMES),
    "engine": partial(_choice, among=ENGINES),
    "samples": partial(_whole, limits=_SAMPLES),
    "level": partial(_choice, among=LEVELS),
    "principal_point": partial(_vector, count=2),
    "pixel_aspect": partial(checks.number, least=_ASPECTS[0], most=_ASPECTS[1]),
    "mirrored": _truth,
}
"""The check of each field that a list may have: (what a sentence calls it, value) → the value as a Job keeps it; InputError."""

_MORE: dict[str, Callable[[str, object], object]] = {
    "blend": _path,
    "trust": checks.truth,
    "seed": partial(_whole, limits=_SEEDS),
    "threads": partial(_whole, limits=_THREADS),
    "calibration": _calibration,
    "error": _above_zero,
    "find": _percentage,
    "device": partial(_choice, among=DEVICES),
    "clay": checks.truth,
    "recenter": checks.truth,
    "strict": checks.truth,
    "scene": _path,
}
