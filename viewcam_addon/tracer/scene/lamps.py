"""Lamps and the world, as data. What they do to a surface is computed in emitters.py.

All quantities are what Cycles makes of Blender's settings, colour, strength, exposure and temperature multiplied out: for each
of red, green and blue the irradiance of a sun on what faces it, and the power P of any other lamp. One with the area A has the
radiance P/(π A), to one side if it is flat, and a sphere's area is 4π R²; one of no size has the irradiance P/(4π r²). Scaling
the object scales an area lamp, shapes the cone of a spot, and does not change a radius.

hidden_from : which rays don't see the lamp itself, of "camera", "diffuse", "glossy", "transmission"; what a lamp hides from, it
    does not light.
"""

import math
from collections.abc import Collection
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ... import checks
from ...checks import shown
from ...errors import InputError
from .materials import radiance
from .shader_nodes import Node

RAYS = ("camera", "diffuse", "glossy", "transmission", "shadow")
"""The kinds of rays that things may be hidden from; lamps have no shadow."""

MOST_LINKS = {"receivers": 64, "blockers": 27}
"""How many different sets of objects the lamps of a scene may have: bits of the core's numbers. Blender's own limit is 64."""

# Of coordinates and sizes: as of scenes, products of a few of them are float64's.
LARGEST = 1e18

LEAST_SPREAD = 1e-3
"""Radians; what is less spread is nearly a beam, whose light would be found by chance alone."""


@dataclass(frozen=True, eq=False)
class Lamp:
    """What all lamps have.

    casts_shadow : whether objects can stand in its light. is_met : whether rays run into it, so that the eye, mirrors and glass
    see it, where it has a size; else it only lights what is rough, as much as before. receivers : names of the objects that it
    lights; blockers : of those that can stand in its light; None is all objects. The eye sees a lamp whatever it lights.
    emission : a node that makes what its light is multiplied by, at each place of the lamp and in each direction, or None; it
    is told the place there, in the world, the normal, the way that light goes, and how far that is.
    """

    name: str
    hidden_from: frozenset[str] = frozenset()
    casts_shadow: bool = True
    is_met: bool = True
    receivers: frozenset[str] | None = None
    blockers: frozenset[str] | None = None
    emission: Node | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "hidden_from", hidden_from(f"light {shown(self.name)}", self.hidden_from))
        for what in ("casts_shadow", "is_met"):
            truth = checks.truth(f"{what} of light {shown(self.name)}", getattr(self, what))
            object.__setattr__(self, what, truth)
        if self.emission is not None and not self.emission.is_value:
            raise InputError(
                f"the emission of light {shown(self.name)} is a shader {self.emission.type!r}: give a node that makes a colour"
            )
        for what in ("receivers", "blockers"):
            if getattr(self, what) is not None:
                object.__setattr__(self, what, frozenset(getattr(self, what)))

    @property
    def is_dark(self) -> bool:
        """Whether it gives no light at all."""
        raise NotImplementedError

    def _check(self, what: str, value: object, least: float = 0.0, most: float = LARGEST) -> None:
        object.__setattr__(self, what, checks.number(f"{what} of light {shown(self.name)}", value, least, most))

    def _check_angle(self, what: str = "angle", least: float = 0.0) -> None:
        """At most π, as which the float32 just above it counts, Blender's 180°."""
        self._check(what, getattr(self, what), least, float(np.float32(np.pi)))
        object.__setattr__(self, what, min(getattr(self, what), np.pi))

    def _check_colour(self, what: str) -> None:
        object.__setattr__(self, what, radiance(f"{what} of light {shown(self.name)}", getattr(self, what)))

    def _check_matrix(self) -> None:
        if np.shape(self.matrix) != (4, 4) or not (np.abs(self.matrix) <= LARGEST).all():
            raise InputError(
                f"the matrix of light {shown(self.name)} must be 4 × 4 numbers below {LARGEST:g}: check its transform"
            )


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
        self._check_angle()
        towards = checks.vector(f"towards of light {shown(self.name)}", self.towards, 3)
        largest = max(map(abs, towards))
        if not largest > 0:
            raise InputError(f"towards of light {shown(self.name)} is 0, 0, 0: give the direction to the sun")
        if abs(math.hypot(*towards) - 1) > 2.0**-50:  # what is a unit vector stays one, to the last bit
            towards = tuple(component / largest for component in towards)
            towards = tuple(component / math.hypot(*towards) for component in towards)
        object.__setattr__(self, "towards", towards)

    @property
    def is_dark(self) -> bool:
        return not any(self.irradiance)


@dataclass(frozen=True, eq=False)
class Point(Lamp):
    """A point, or a sphere that shines evenly.

    position : world space. power : (3,). radius : world units. soft_falloff : instead of a sphere, a disc that turns towards
    whatever it lights, as Blender's setting of that name makes it: close by, it lights less.
    """

    kind: ClassVar[str] = "point"
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    power: tuple[float, float, float] = (1.0, 1.0, 1.0)
    radius: float = 0.0
    soft_falloff: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        position = checks.vector(f"position of light {shown(self.name)}", self.position, 3)
        if max(map(abs, position)) > LARGEST:
            raise InputError(f"position of light {shown(self.name)} is {shown(position)}: give numbers below {LARGEST:g}")
        object.__setattr__(self, "position", position)
        self._check_colour("power")
        self._check("radius", self.radius)

    @property
    def is_dark(self) -> bool:
        return not any(self.power)


@dataclass(frozen=True, eq=False)
class Spot(Lamp):
    """A point or sphere that shines into a cone about its local −z axis.

    matrix : (4, 4) float64, the lamp's space to world space; angles are measured in the lamp's space. power : (3,), of a point
    that would shine everywhere as in the middle of the cone. radius : world units. angle : of the whole cone, radians, 0 to π.
    blend : 0 to 1, the part of the cone over which the light falls off. soft_falloff : as of points.
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
        self._check_angle()
        self._check("blend", self.blend, 0.0, 1.0)

    @property
    def is_dark(self) -> bool:
        return not any(self.power) or np.linalg.det(self.matrix[:3, :3]) == 0


@dataclass(frozen=True, eq=False)
class Area(Lamp):
    """A rectangle or an ellipse that shines evenly to one side, towards its local −z axis; one without an area is dark.

    matrix : (4, 4) float64, the lamp's space to world space. size : along its local x and y axes, before the matrix. power :
    (3,). ellipse : instead of a rectangle. spread : the angle of the cone into which it shines as through a grid, radians; π is
    without one, and the power is the same.
    """

    kind: ClassVar[str] = "area"
    matrix: NDArray[np.float64] = None
    size: tuple[float, float] = (1.0, 1.0)
    power: tuple[float, float, float] = (1.0, 1.0, 1.0)
    ellipse: bool = False
    spread: float = np.pi

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_matrix()
        self._check_colour("power")
        self._check_angle("spread", LEAST_SPREAD)
        size = checks.vector(f"size of light {shown(self.name)}", self.size, 2)
        if not all(0 <= side <= LARGEST for side in size):
            raise InputError(f"size of light {shown(self.name)} is {shown(size)}: give two numbers from 0 to {LARGEST:g}")
        object.__setattr__(self, "size", size)

    @property
    def area(self) -> float:
        """In world space."""
        across, along = self.matrix[:3, :2].T * np.array(self.size)[:, None]
        return float(np.linalg.norm(np.cross(across, along))) * (np.pi / 4 if self.ellipse else 1.0)

    @property
    def is_dark(self) -> bool:
        return not any(self.power) or self.area == 0 or not self.matrix[:3, 2].any()


@dataclass(frozen=True)
class World:
    """Light from everywhere beyond the scene. radiance : (3,). hidden_from : as for lamps.

    image : key in `Scene.images` of what the radiance is multiplied by, equirectangular: its rows go from straight down to
    straight up, its middle shows what lies along x, and its left half what lies along y; or None. closest : the nearest pixel
    instead of a linear interpolation between four. rotation : of directions before they are looked up there, radians about x,
    then y, then z, as in Blender's Mapping node. backdrop : what the camera sees instead, hidden as this one
    is, or None.
    """

    radiance: tuple[float, float, float] = (0.0, 0.0, 0.0)
    hidden_from: frozenset[str] = frozenset()
    image: str | None = None
    closest: bool = False
    rotation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    backdrop: "World | None" = None

    def __post_init__(self) -> None:
        if self.backdrop and (self.backdrop.backdrop or self.backdrop.hidden_from):
            raise InputError("the backdrop of the world has a backdrop or is hidden: leave both to the world")
        object.__setattr__(self, "radiance", radiance("radiance of the world", self.radiance))
        object.__setattr__(self, "hidden_from", hidden_from("the world", self.hidden_from))
        object.__setattr__(self, "rotation", checks.vector("rotation of the world", self.rotation, 3))

    @property
    def images(self) -> tuple[str, ...]:
        """Its image, and that of its backdrop, where they have one."""
        return tuple(each.image for each in (self, self.backdrop) if each and each.image is not None)

    @property
    def is_black(self) -> bool:
        """Whether neither it nor its backdrop shows anything."""
        return not any(self.radiance) and (self.backdrop is None or self.backdrop.is_black)


def hidden_from(name: str, rays: Collection[str]) -> frozenset[str]:
    """The kinds of rays that something is hidden from; InputError with its `name` where there is no such kind."""
    unknown = sorted(set(rays) - set(RAYS))
    if unknown:
        raise InputError(f"{name} is hidden from {shown(unknown[0])}: give some of {', '.join(RAYS)}")
    return frozenset(rays)
