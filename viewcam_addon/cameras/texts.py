"""Functions that all formats of a camera's text share: the place of an error, comments, numbers in any punctuation, the
picture.

Every expression goes over the text once: where one of its parts ends, what comes next is of other characters, so that nothing
is tried twice and no text takes long.
"""

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NoReturn

import numpy as np

from .. import checks
from ..errors import InputError
from ..pinhole import Pinhole, Triple, ViewPlane
from . import axes
from .camera import Camera, Options

AXES = ("x", "y", "diagonal", "smaller", "larger")
MIRRORED = (
    "{} sees with left-handed axes: its picture is mirrored, and so is this camera's; "
    "take it unmirrored if the scene was mirrored instead"
)

_UNSAID = re.compile(r"[\s_$-]+")
_GAP = re.compile(r"[\s,;|()\[\]{}<>'\"]*")
_NUMBER = re.compile(r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?")
_NARROWEST = 1e-100  # radians, whose tangent divides
_ASKEW, _NOTED = 2e-3, 1e-5  # cosine between the picture's sides: refused from, told from


def plain(name: str) -> str:
    """A name without capitals, blanks, hyphens and underscores."""
    return (name if name.isalnum() else _UNSAID.sub("", name)).lower()


def fail(text: str, at: int, advice: str) -> NoReturn:
    """Raise the InputError that shows the place."""
    place = text[at : at + 40].strip()
    line = text.count("\n", 0, at) + 1
    raise InputError(
        f"the text is not understood {f'at {checks.quoted(place)}' if place else 'at its end'} (line {line}): {advice}"
    )


def without(comments: str, text: str) -> str:
    """The text with blanks in place of what a pattern matches, so that places stay where they are; strings stay."""
    pattern = re.compile(rf"\"[^\"\\\n]*(?:\\.[^\"\\\n]*)*\"?|{comments}", flags=re.DOTALL)
    return pattern.sub(_blanked, text)


def _blanked(match: re.Match) -> str:
    matched = match[0]
    if matched[0] == '"':
        return matched
    return " " * len(matched) if "\n" not in matched else "\n".join(" " * len(line) for line in matched.split("\n"))


def numbers(text: str, at: int, count: int, name: str) -> tuple[tuple[float, ...], int]:
    """So many finite numbers from `at` on, whatever stands between them, and where they end."""
    result: list[float] = []
    while len(result) < count:
        if gap := _GAP.match(text, at):
            at = gap.end()
        match = _NUMBER.match(text, at)
        if not match or not math.isfinite(float(match[0])):
            fail(text, at, f"give {count} finite numbers for {name}" if count > 1 else f"give a finite number for {name}")
        result.append(float(match[0]))
        at = match.end()
    return tuple(result), at


def closing(text: str, opened: int, brackets: str) -> int:
    """The place where the bracket that opens at `opened` closes."""
    depth = 0
    for match in re.compile("[" + re.escape(brackets) + "]").finditer(text, opened):
        depth += 1 if match[0] == brackets[0] else -1
        if depth == 0:
            return match.start()
    fail(text, opened, f"close it with {brackets[1]}")


@dataclass(frozen=True)
class Film:
    """The picture that a text's camera is for.

    width, height : pixels.
    pixel_aspect : width of a pixel over its height.
    is_stated : true if the text says the pixels.
    """

    width: int
    height: int
    pixel_aspect: float = 1.0
    is_stated: bool = False
    notes: tuple[str, ...] = ()

    @property
    def aspect(self) -> float:
        """The picture's width over its height, as it is looked at."""
        return self.width * self.pixel_aspect / self.height

    def plane(self, angle: float, axis: str, name: str = "the field of view") -> ViewPlane:
        """The view plane of a field of view.

        angle : radians, between 0 and π, along one of AXES.
        """
        if not _NARROWEST < angle < math.pi:
            raise InputError(f"{name} is {math.degrees(angle):g}°: give an angle between 0 and 180")
        width, height = self.width * self.pixel_aspect, float(self.height)
        side = {
            "x": width,
            "y": height,
            "diagonal": math.hypot(width, height),
            "smaller": min(width, height),
            "larger": max(width, height),
        }[axis]
        return self.centered(side / 2 / math.tan(angle / 2) / self.pixel_aspect)

    def centered(self, distance: float) -> ViewPlane:
        """The view plane of a distance in pixel widths, its principal point in the middle."""
        if checks.number("the distance", distance) <= 0:
            raise InputError(f"distance is {distance:g} pixels: the view plane must lie before the eye, give d > 0")
        return ViewPlane((distance, distance * self.pixel_aspect), (self.width / 2, self.height / 2), self.width, self.height)


def film(
    options: Options,
    what: str,
    size: tuple[int, int] | None = None,
    aspect: float | None = None,
    default: tuple[int, int] | None = None,
) -> Film:
    """The picture: as the text says, else as the options say, else the program's own.

    size : pixels, if the text says them.
    aspect : the picture's width over its height, if it says no more than that; the height is kept then.
    default : the program's own size.

    Raises InputError if nobody knows the size.
    """
    if size:
        width, height = (checks.whole(name, number) for name, number in zip(("width", "height"), size, strict=True))
        return Film(width, height, is_stated=True)
    notes: tuple[str, ...] = ()
    if default and not (options.size or options.view_plane or options.base):
        taken = Film(*default)
        notes = (f"The text says no size of the picture: it is {what}'s own, {default[0]} × {default[1]}",)
    else:
        taken = Film(*options.size_or_refuse(what), options.pixel_aspect)
    if aspect is None or abs(taken.aspect / aspect - 1) * taken.width <= 1:
        return replace(taken, notes=notes)
    if not 1e-4 < aspect < 1e4:
        raise InputError(f"the picture of {what} is {aspect:g} times as wide as high: give an aspect between 0.0001 and 10000")
    width = max(1, round(taken.height * aspect / taken.pixel_aspect))
    note = f"The picture of {what} is {aspect:.6g} times as wide as high: taken as {width} × {taken.height} pixels"
    return replace(taken, width=width, notes=(*notes, note))


def posed(
    eye: Triple, look_at: Triple, up: Triple, plane: ViewPlane, mirrored: bool = False, may_be_singular: bool = False
) -> Pinhole:
    """The pinhole of a look-at and a view plane; the numbers of the look-at stay as they are.

    may_be_singular : true if the program knows the canonical axes of a view along up, as ours does.

    Raises InputError if it looks along its up: other programs have no picture then, or each its own.
    """
    pinhole = Pinhole(eye, look_at, up, plane.distance, plane.width, plane.height, plane.principal_point, mirrored)
    if pinhole.is_singular and not may_be_singular:
        raise InputError(f"the camera looks along its up {tuple(up)}, for which its program has no picture: change up")
    return pinhole


def look(pinhole: Pinhole) -> tuple[Triple, Triple, Triple]:
    """eye, look_at, up for programs that know no view along up: there v, which shows the same, takes its place."""
    return pinhole.eye, pinhole.look_at, pinhole.axes()[1] if pinhole.is_singular else pinhole.up


def projected(matrix: np.ndarray, eye: Triple, size: tuple[int, int], what: str) -> tuple[Pinhole, tuple[str, ...]]:
    """The pinhole of any projective camera, and what is to be said of it.

    matrix : (3, 3), from a direction in world space to (column, row, 1) · depth: pixels from the left and the **top**, and a
    depth that is positive in front of the eye. It may scale, mirror and shift, not shear.

    Raises InputError if the picture's sides are not perpendicular, or the matrix is flat.
    """
    checks.finite(f"the projection of {what}", np.asarray(matrix))
    across, down, forward = (np.asarray(row, dtype=np.float64) for row in matrix)
    scale = math.hypot(*forward)
    if not 1e-150 < scale < 1e150:
        raise InputError(f"the projection of {what} has no depth: it is no pinhole camera")
    across, down, forward = across / scale, down / scale, forward / scale
    c_x, c_top = float(across @ forward), float(down @ forward)
    across, down = across - c_x * forward, down - c_top * forward
    d_x, d_y = math.hypot(*across), math.hypot(*down)
    if not (1e-9 < d_x < 1e12 and 1e-9 < d_y < 1e12):
        raise InputError(f"the projection of {what} is flat: its distances are {d_x:g} and {d_y:g} pixels")
    askew = abs(float(across @ down)) / (d_x * d_y)
    if askew > _ASKEW:
        angle = math.degrees(math.asin(min(askew, 1)))
        raise InputError(f"the picture of {what} is sheared by {angle:.3g}°: a pinhole camera's sides are perpendicular")
    notes = (
        (f"The axes of {what} are {askew:.1g} from perpendicular: it has no more digits than that",) if askew > _NOTED else ()
    )
    if abs(d_x / d_y - 1) < 2.0**-20:  # one number, rounded twice
        d_x = d_y = math.sqrt(d_x * d_y)
    matrix = np.column_stack([across / math.hypot(*across), -down / math.hypot(*down), -forward, eye])
    pinhole, _ = axes.pinhole(matrix, axes.view_plane(d_x, d_y, c_x, c_top, size), what)
    return pinhole, notes


def turn(degrees: float, axis: Sequence[float]) -> np.ndarray:
    """(3, 3), the rotation about an axis of length 1, counter-clockwise as seen from its tip in a right-handed space."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = math.radians(degrees)
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * (cross @ cross)


def mirroring(camera: Camera, program: str) -> Camera:
    """The camera, with a sentence on its picture if that is mirrored."""
    return camera.noted(MIRRORED.format(program)) if camera.pinhole.mirrored else camera


def angle_of(value: float, name: str, options: Options) -> float:
    """Radians of an angle whose unit nobody says: degrees from π on, below that what the options say.

    Raises InputError if it may be either.
    """
    value = checks.number(name, value)
    if value <= 0:
        raise InputError(f"{name} is {value:g}: give an angle between 0 and 180 degrees")
    unit = options.angle_unit or ("degrees" if value >= math.pi else None)
    if unit is None:
        raise InputError(
            f"{name} is {value:g}, which may be degrees or radians: write {value:g}° or {value:g}rad, or say the unit"
        )
    return math.radians(value) if unit == "degrees" else value


def shortest(number: float) -> str:
    """The digits that read back as the same number, without a needless .0"""
    text = repr(float(number) + 0.0)
    return text.removesuffix(".0")


def listed(numbers: Iterable[float], separator: str = " ") -> str:
    return separator.join(map(shortest, numbers))
