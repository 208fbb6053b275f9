"""Lamps and the world, as data. What they do to a surface stands in core/lights/lamps.h.

All quantities are what Cycles makes of Blender's settings, color, strength, exposure and temperature multiplied out: for each
of red, green and blue the irradiance of a sun on what faces it, and the power P of any other lamp. One with the area A has the
radiance P/(π A), to one side if it is flat, and a sphere's area is 4π R²; one of no size has the irradiance P/(4π r²). Scaling
the object scales an area lamp, shapes the cone of a spot, and does not change a radius.

hidden_from : the kinds of rays that don't see the lamp itself, of "camera", "diffuse", "glossy", "transmission"; what a lamp
    hides from, it does not light.
"""

import math
from collections.abc import Collection
from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ... import checks
from ...checks import quoted
from ...errors import InputError
from . import values
from .shader_nodes import Node

RAYS = ("camera", "diffuse", "glossy", "transmission", "shadow")
"""The kinds of rays that things may be hidden from; lamps have no shadow."""

MOST_LINKS = {"receivers": 64, "blockers": 26}
"""The most different sets of objects that lights may have: bits of the core's numbers. Blender's own limit is 64."""

LEAST_SPREAD = 1e-3
"""Radians; what is less spread is nearly a beam, whose light would be found by chance alone."""

_UNIT = 2.0**-50  # a unit vector stays one, to the last bit


def hidden_from(name: str, rays: Collection[str]) -> frozenset[str]:
    """The kinds of rays that something is hidden from; InputError with its `name` where there is no such kind."""
    unknown = sorted(set(rays) - set(RAYS))
    if unknown:
        raise InputError(f"{name} is hidden from {quoted(unknown[0])}: give some of {', '.join(RAYS)}")
    return frozenset(rays)


def _hidden(name: str, rays: Collection[str]) -> frozenset[str]:
    return hidden_from(name.removeprefix("hidden_from of "), rays)


def linked(objects: Collection[str] | None) -> frozenset[str] | None:
    """Names of receivers or blockers; None is all objects."""
    return None if objects is None else frozenset(objects)


def _linked(name: str, objects: Collection[str] | None) -> frozenset[str] | None:
    return linked(objects)


def _emission(name: str, node: Node | None) -> Node | None:
    if node is not None and not node.is_value:
        raise InputError(f"the {name} is a shader {node.type!r}: give a node that makes a color")
    return node


def _direction(name: str, value: object) -> tuple[float, ...]:
    towards = checks.vector(name, value, 3)
    largest = max(map(abs, towards))
    if not largest > 0:
        raise InputError(f"{name} is 0, 0, 0: give the direction to the sun")
    if abs(math.hypot(*towards) - 1) > _UNIT:
        towards = tuple(component / largest for component in towards)
        towards = tuple(component / math.hypot(*towards) for component in towards)
    return towards


def _position(name: str, value: object) -> tuple[float, ...]:
    position = checks.vector(name, value, 3)
    if max(map(abs, position)) > values.LARGEST:
        raise InputError(f"{name} is {quoted(position)}: give numbers below {values.LARGEST:g}")
    return position


def _matrix(name: str, value: Any) -> Any:
    if np.shape(value) != (4, 4) or not (np.abs(value) <= values.LARGEST).all():
        raise InputError(f"the {name} must be 4 × 4 numbers below {values.LARGEST:g}: check its transform")
    return value


def _size(name: str, value: object) -> tuple[float, ...]:
    size = checks.vector(name, value, 2)
    if not all(0 <= side <= values.LARGEST for side in size):
        raise InputError(f"{name} is {quoted(size)}: give two numbers from 0 to {values.LARGEST:g}")
    return size


@dataclass(frozen=True, eq=False)
class Lamp:
    """The base of all lamps. A kind declares where it is, how strong, and then the numbers that the core's lamp of its name
    has.

    casts_shadow : true if objects can stand in its light.
    multiple_importance : true if rays run into it where it has a size, so that the eye, mirrors and glass see it; else it only
        lights what is rough, as much as before.
    receivers : the names of the objects that it lights.
    blockers : the names of the objects that can stand in its light; None is all objects. The eye sees a lamp whatever it
        lights.
    emission : a node that makes what its light is multiplied by, at each place of the lamp and in each direction, or None; it
        is told the place there, in the world, the normal, the way that light goes, and how far that is.
    """

    kind: ClassVar[str]
    name: str
    hidden_from: frozenset[str] = values.value(frozenset(), _hidden, "names", "kind of ray")
    casts_shadow: bool = values.truth(True)
    multiple_importance: bool = values.truth(True)
    receivers: frozenset[str] | None = values.value(None, _linked, "names", "object's name")
    blockers: frozenset[str] | None = values.value(None, _linked, "names", "object's name")
    emission: Node | None = values.value(None, _emission, "node")

    def __post_init__(self) -> None:
        values.check(self, f"light {quoted(self.name)}")

    @property
    def _own(self) -> dict[str, Any]:
        """The fields that its kind declares."""
        return {each.name: getattr(self, each.name) for each in fields(self)[len(fields(Lamp)) :]}

    @property
    def to_world(self) -> NDArray[np.float64]:
        """(4, 4): its own space to world space; a sun is seen towards its z."""
        return next(iter(self._own.values()))

    @property
    def strength(self) -> tuple[float, float, float]:
        """The power, or a sun's irradiance."""
        return list(self._own.values())[1]

    @property
    def numbers(self) -> dict[str, float | bool | tuple[float, ...]]:
        """The numbers that a kind of lamp declares, but for those that all have."""
        return dict(list(self._own.items())[2:])

    @property
    def is_sized(self) -> bool:
        """True if rays can run into it."""
        return True

    @property
    def is_dark(self) -> bool:
        """True if it gives no light at all."""
        return not any(self.strength)


@dataclass(frozen=True, eq=False)
class Sun(Lamp):
    """Light from one direction, or from a disc of directions.

    towards : unit vector to the sun, world space.
    irradiance : (3,) on a surface that faces it.
    angle : diameter of the disc, radians, 0 to π.
    """

    kind: ClassVar[str] = "sun"
    towards: tuple[float, float, float] = values.value((0.0, 0.0, 1.0), _direction, "vector", 3)
    irradiance: tuple[float, float, float] = values.light()
    angle: float = values.angle(0.0)

    @property
    def is_sized(self) -> bool:
        return self.angle > 0

    @property
    def to_world(self) -> NDArray[np.float64]:
        matrix = np.eye(4)
        matrix[:3, 2] = self.towards
        return matrix


@dataclass(frozen=True, eq=False)
class Point(Lamp):
    """A point, or a sphere that shines evenly.

    position : world space.
    power : (3,).
    radius : world units.
    soft_falloff : instead of a sphere, a disc that turns towards whatever it lights, as Blender's setting of that name makes
        it: close by, it lights less.
    """

    kind: ClassVar[str] = "point"
    position: tuple[float, float, float] = values.value((0.0, 0.0, 0.0), _position, "vector", 3)
    power: tuple[float, float, float] = values.light()
    radius: float = values.number(0.0)
    soft_falloff: bool = values.truth(False)

    @property
    def is_sized(self) -> bool:
        return self.radius > 0

    @property
    def to_world(self) -> NDArray[np.float64]:
        matrix = np.eye(4)
        matrix[:3, 3] = self.position
        return matrix


@dataclass(frozen=True, eq=False)
class Spot(Lamp):
    """A point or sphere that shines into a cone about its local −z axis.

    matrix : (4, 4) float64, the lamp's space to world space; angles are measured in the lamp's space.
    power : the power of a point that would shine everywhere as in the middle of the cone, (3,).
    radius : world units.
    angle : the angle of the whole cone, radians, 0 to π.
    blend : 0 to 1, the part of the cone over which the light falls off.
    soft_falloff : see `Point`.
    """

    kind: ClassVar[str] = "spot"
    matrix: NDArray[np.float64] = values.value(None, _matrix)
    power: tuple[float, float, float] = values.light()
    radius: float = values.number(0.0)
    angle: float = values.angle(np.pi / 4)
    blend: float = values.number(0.15, most=1.0)
    soft_falloff: bool = values.truth(False)

    @property
    def is_sized(self) -> bool:
        return self.radius > 0

    @property
    def is_dark(self) -> bool:
        return super().is_dark or np.linalg.det(self.matrix[:3, :3]) == 0


@dataclass(frozen=True, eq=False)
class Area(Lamp):
    """A rectangle or an ellipse that shines evenly to one side, towards its local −z axis; one without an area is dark.

    matrix : (4, 4) float64, the lamp's space to world space.
    power : (3,).
    size : along its local x and y axes, before the matrix.
    ellipse : instead of a rectangle.
    spread : the angle of the cone into which it shines as through a grid, radians; π is without one, and the power is the same.
    """

    kind: ClassVar[str] = "area"
    matrix: NDArray[np.float64] = values.value(None, _matrix)
    power: tuple[float, float, float] = values.light()
    size: tuple[float, float] = values.value((1.0, 1.0), _size, "vector", 2)
    ellipse: bool = values.truth(False)
    spread: float = values.angle(np.pi, LEAST_SPREAD)

    @property
    def area(self) -> float:
        """The area in world space."""
        across, along = self.matrix[:3, :2].T * np.array(self.size)[:, None]
        return float(np.linalg.norm(np.cross(across, along))) * (np.pi / 4 if self.ellipse else 1.0)

    @property
    def is_dark(self) -> bool:
        return super().is_dark or self.area == 0 or not self.matrix[:3, 2].any()


KINDS: dict[str, type[Lamp]] = {kind.kind: kind for kind in (Sun, Point, Spot, Area)}


@dataclass(frozen=True)
class World:
    """Light from everywhere beyond the scene.

    radiance : (3,).
    hidden_from : see above.

    image : key in `Scene.images` of what the radiance is multiplied by, equirectangular: its rows go from straight down to
        straight up, its middle shows what lies along x, and its left half what lies along y; or None.
    closest : true to take the nearest pixel instead of a linear interpolation between four.
    rotation : the rotation of directions before they are looked up there, radians about x, then y, then z, as in Blender's
        Mapping node.
    backdrop : the world that the camera sees instead, hidden as this one is, or None.
    """

    radiance: tuple[float, float, float] = values.light(0.0)
    hidden_from: frozenset[str] = values.value(frozenset(), _hidden, "names", "kind of ray")
    image: str | None = values.value(None, None, "text")
    closest: bool = values.truth(False)
    rotation: tuple[float, float, float] = values.vector((0.0, 0.0, 0.0))
    backdrop: "World | None" = values.value(None, None, "backdrop")

    def __post_init__(self) -> None:
        if self.backdrop and (self.backdrop.backdrop or self.backdrop.hidden_from):
            raise InputError("the backdrop of the world has a backdrop or is hidden: leave both to the world")
        values.check(self, "the world")

    @property
    def images(self) -> tuple[str, ...]:
        """The image, and that of its backdrop, where they have one."""
        return tuple(each.image for each in (self, self.backdrop) if each and each.image is not None)

    @property
    def is_black(self) -> bool:
        """True if neither it nor its backdrop shows anything."""
        return not any(self.radiance) and (self.backdrop is None or self.backdrop.is_black)
