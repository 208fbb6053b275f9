"""The readouts of the panel, as text. Pure: a test calls it without drawing."""

import math
import textwrap
from itertools import product
from typing import NamedTuple

from ...comparison import tolerances
from ...pinhole import Pinhole, Triple
from .. import findings

_CHARACTER = 6.8  # pixels, in the mean of a panel's text


class Readout(NamedTuple):
    """A row of Read-Outs: a label and what the camera has of it.

    texts : one text, or three for the vectors.
    exact : the text that is copied, with all digits and without units.
    """

    label: str
    texts: tuple[str, ...]
    exact: str


def readouts(camera: Pinhole, lens: float, distance: float, to_look_at: tuple[str, float] | None) -> list[Readout]:
    """The camera as Blender has it.

    lens : mm.
    distance : pixels of the picture at 100 %.
    to_look_at : with its unit, and in world units; None where no look-at point is stated.
    """
    rows = [
        Readout("Focal Length", (f"{lens:.6g} mm",), repr(lens)),
        Readout("View Plane", (f"{distance:.8g} px",), repr(distance)),
    ]
    for name, angle in zip(("Horizontal FOV", "Vertical FOV", "Diagonal FOV"), camera.field_of_view(), strict=True):
        rows.append(Readout(name, (f"{math.degrees(angle):.4f}°",), repr(math.degrees(angle))))
    rows += [Readout(name, _components(axis), repr(axis)) for name, axis in zip("uvw", camera.axes(), strict=True)]
    if to_look_at is not None:
        rows.append(Readout("To Look-At", to_look_at[:1], repr(to_look_at[1])))
    return rows


def _components(axis: Triple) -> tuple[str, ...]:
    return tuple(f"{round(component, 5) + 0.0:+.5f}" for component in axis)


def roll_warning(stated: Pinhole, precision: float) -> str | None:
    """A sentence on a pose that is singular, or so near that the rounding of the values turns the picture visibly, else None.

    precision : the relative rounding of the values.
    """
    if stated.is_singular:
        return "The view is parallel to up, and the roll is undefined: the axes are the canonical ones"
    roll, corner = stated.roll_uncertainty(precision), _corner(stated)
    if (
        roll * corner <= tolerances.VISIBLE or roll * stated.sine_to_up * corner > tolerances.VISIBLE
    ):  # the latter is not up's fault
        return None
    angle = math.degrees(math.asin(min(1.0, stated.sine_to_up)))
    if roll >= math.pi:
        return f"The view is within {_figure(angle)}° of up: with the rounding of the values any roll is possible"
    return f"The view is within {_figure(angle)}° of up: the roll is uncertain by {_figure(math.degrees(roll))}°"


def certain_up(stated: Pinhole) -> Triple:
    """The up for which the roll is least uncertain, and which gives the same picture: v, being perpendicular to the view.

    Where a coordinate axis is v but for the rounding of a float32 matrix, that axis.
    """
    v = stated.axes()[1]
    x, y, z = (float(round(component)) for component in v)
    axis = x, y, z
    return axis if max(abs(a - b) for a, b in zip(axis, v, strict=True)) <= findings.LARGEST_TURN else v


def vector(numbers: Triple) -> str:
    """A vector as one writes it: (1, 0, 0), (0.70711, -0.70711, 0)."""
    return f"({', '.join(f'{round(number, 5) + 0.0:g}' for number in numbers)})"


def rounded(numbers: Triple) -> Triple:
    """Numbers as they are shown: those that are less than a float32 step of the largest are 0."""
    step = 2.0**-23 * max(map(abs, numbers))
    x, y, z = (number if abs(number) > step else 0.0 for number in numbers)
    return x, y, z


def distance_warning(stated: Pinhole) -> str | None:
    """A sentence on a camera so far from the origin that Blender's and Cycles' float32 is visible where it looks, else None.

    One rounding of the largest coordinate, seen from as far as the look-at point is away (comparison/tolerances.py).
    """
    largest = max(map(abs, (*stated.eye, *stated.look_at)))
    pixels = tolerances.FLOAT32 * max(stated.distance) * largest / math.dist(stated.eye, stated.look_at)
    if pixels <= tolerances.VISIBLE:
        return None
    return (
        f"So far from the origin Blender and Cycles may be {_figure(pixels)} px off in float32: bring the scene to the origin"
    )


def _figure(value: float) -> str:
    """One significant digit: 0.001, 3, 40."""
    return f"{float(f'{value:.0e}'):g}"


def _corner(camera: Pinhole) -> float:
    """The distance of the picture's farthest corner from the principal point, in pixels."""
    x, y = camera.principal_point
    return max(math.dist((x, y), corner) for corner in product((0, camera.width), (0, camera.height)))


def fits(text: str, width: float) -> bool:
    """True if a region of so many pixels holds a text in one line."""
    return len(text) <= width / _CHARACTER


def wrapped(sentence: str, width: float) -> list[str]:
    """The lines of a sentence in a region of so many pixels."""
    return textwrap.wrap(sentence, max(8, int(width / _CHARACTER)))
