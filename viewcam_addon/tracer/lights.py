"""Lamps and the world, as data. What they do to a surface is computed in emitters.py.

All quantities are what Cycles makes of Blender's settings (intern/cycles/blender/light.cpp), colour, strength, exposure and the
lamp's size multiplied out: a power in watts for each of red, green and blue, with 1/π of it where Blender's watts have it. A
lamp of the radiant power Φ and the area A has the radiance Φ/(π A); a point has the irradiance Φ/(4π r²).

hidden_from : which rays don't see the lamp itself, of "camera", "diffuse", "glossy", "transmission"; what a lamp hides from, it
    does not light.
"""

from collections.abc import Collection
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from .. import checks
from ..errors import InputError
from .materials import radiance

RAYS = ("camera", "diffuse", "glossy", "transmission", "shadow")
"""The kinds of rays that things may be hidden from; lamps have no shadow."""


@dataclass(frozen=True, eq=False)
class Lamp:
    """What all lamps have. casts_shadow : whether objects can stand in its light."""

    name: str
    hidden_from: frozenset[str] = frozenset()
    casts_shadow: bool = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "hidden_from", hidden_from(f"light {self.name!r}", self.hidden_from))

    def _check(self, what: str, value: object, least: float = 0.0, most: float = 1e18) -> None:
        object.__setattr__(self, what, checks.number(f"{what} of light {self.name!r}", value, least, most))

    def _check_colour(self, what: str) -> None:
        object.__setattr__(self, what, radiance(f"{what} of light {self.name!r}", getattr(self, what)))

    def _check_matrix(self) -> None:
        if self.matrix.shape != (4, 4) or not np.isfinite(self.matrix).all():
            raise InputError(f"the matrix of light {self.name!r} must be 4 × 4 finite numbers: check its transform")


@dataclass(frozen=True, eq=False)
class Sun(Lamp):
    """Light from one direction, or from a disc of directions.

    towards : unit vector to the sun, world space. irradiance : (3,) on a surface that faces it. angle : diameter of the disc,
    radians, 0 to π.
    """

    kind: ClassVar[str] = "sun"
    towards: tuple[float, float, float] = (0.0, 0.0, 1.0)
    irradiance: tuple[float, float, float] = (1.0, 1.0, 1.0)
    angle: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_colour("irradiance")
        self._check("angle", self.angle, 0.0, np.pi)
        towards = np.array(checks.vector(f"towards of light {self.name!r}", self.towards, 3))
        largest = np.abs(towards).max()
        if not largest > 0:
            raise InputError(f"towards of light {self.name!r} is 0, 0, 0: give the direction to the sun")
        towards /= largest
        object.__setattr__(self, "towards", tuple((towards / np.sqrt(towards @ towards)).tolist()))


@dataclass(frozen=True, eq=False)
class Point(Lamp):
    """A point, or a sphere that shines evenly.

    position : world space. power : (3,). radius : world units. soft_falloff : Blender's setting of that name, which matters
    inside and close to the sphere only.
    """

    kind: ClassVar[str] = "point"
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    power: tuple[float, float, float] = (1.0, 1.0, 1.0)
    radius: float = 0.0
    soft_falloff: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "position", checks.vector(f"position of light {self.name!r}", self.position, 3))
        self._check_colour("power")
        self._check("radius", self.radius)


@dataclass(frozen=True, eq=False)
class Spot(Lamp):
    """A point or sphere that shines into a cone about its local −z axis.

    matrix : (4, 4) float64, the lamp's space to world space; angles are measured in the lamp's space. power : (3,), of a point
    that would shine everywhere as in the middle of the cone. radius : world units. angle : of the whole cone, radians, 0 to π.
    blend : 0 to 1, the part of the cone over which the light falls off.
    """

    kind: ClassVar[str] = "spot"
    matrix: NDArray[np.float64] = None
    power: tuple[float, float, float] = (1.0, 1.0, 1.0)
    radius: float = 0.0
    angle: float = np.pi / 4
    blend: float = 0.15
    soft_falloff: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_matrix()
        self._check_colour("power")
        self._check("radius", self.radius)
        self._check("angle", self.angle, 0.0, np.pi)
        self._check("blend", self.blend, 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class Area(Lamp):
    """A rectangle or an ellipse that shines evenly towards its local −z axis.

    matrix : (4, 4) float64, the lamp's space to world space. size : along its local x and y axes, before the matrix. power :
    (3,). ellipse : instead of a rectangle.
    """

    kind: ClassVar[str] = "area"
    matrix: NDArray[np.float64] = None
    size: tuple[float, float] = (1.0, 1.0)
    power: tuple[float, float, float] = (1.0, 1.0, 1.0)
    ellipse: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_matrix()
        self._check_colour("power")
        size = checks.vector(f"size of light {self.name!r}", self.size, 2)
        if min(size) < 0:
            raise InputError(f"size of light {self.name!r} is {size}: give two numbers that are not negative")
        object.__setattr__(self, "size", size)


@dataclass(frozen=True)
class World:
    """Light from everywhere beyond the scene. radiance : (3,). hidden_from : as for lamps."""

    radiance: tuple[float, float, float] = (0.0, 0.0, 0.0)
    hidden_from: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        object.__setattr__(self, "radiance", radiance("radiance of the world", self.radiance))
        object.__setattr__(self, "hidden_from", hidden_from("the world", self.hidden_from))


def hidden_from(name: str, rays: Collection[str]) -> frozenset[str]:
    """The kinds of rays that something is hidden from; InputError with its `name` where there is no such kind."""
    unknown = sorted(set(rays) - set(RAYS))
    if unknown:
        raise InputError(f"{name} is hidden from {unknown[0]!r}: give some of {', '.join(RAYS)}")
    return frozenset(rays)
