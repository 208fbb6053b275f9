"""Area lamps in camera space: rectangles and ellipses that shine to one side. Their tables answer as those of bulbs.py do.

From afar a lamp is sampled by its area. A rectangle that is near, or seen at a slant, is sampled evenly over the solid angle it
fills (Ureña, Fajardo and King, An Area-Preserving Parametrization for Spherical Rectangles, 2013), which takes longer and is
less noisy there. That angle is a sum known to 10⁻¹⁵ only, so rectangles that fill less than 10⁻⁶ are sampled by their area
again, and so are those that shear has made parallelograms. An ellipse that is near, where sampling its area would be unbounded,
is sampled as the rectangle round it, of which a fifth is dark.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Indices, dot, gather, pick, some
from ..rays.view import View
from ..scene.lamps import Area
from .bulbs import Sampled, columns, entries, replace
from .scattering import turned

SMALLEST_ANGLE = 1e-6
# How many times its longer half axis a lamp is away where cos/distance² varies less over it than an ellipse's dark fifth costs;
# and by which part of its distance the ends of a rectangle may be farther off than its middle there.
FAR, SLANT = 3.0, 0.2
_ASKEW = 1e-9  # |cos| between the sides of a parallelogram that is no rectangle


class _Plates:
    """Flat lamps with their half sides and normals, which point to where they shine. colours : powers.

    centres : (3, k). reach : (k,), how far lamps reach round them.
    """

    def __init__(self, lamps: Sequence[Area], view: View) -> None:
        self.colours = columns([lamp.power for lamp in lamps])
        self.sized = np.ones(len(lamps), bool)
        self.centres = view.axes @ (columns([lamp.matrix[:3, 3] for lamp in lamps]) - view.eye[:, None])
        sides = [self._half_sides(lamp) for lamp in lamps]
        first, second = (view.axes @ columns([side[number] for side in sides]) for number in (0, 1))
        self.lengths = np.stack([np.sqrt(dot(first, first)), np.sqrt(dot(second, second))])
        self.first, self.second = first / self.lengths[0], second / self.lengths[1]
        normals = np.cross(self.first, self.second, axis=0)
        self._sines = np.sqrt(dot(normals, normals))
        shine = view.axes @ columns([-lamp.matrix[:3, 2] for lamp in lamps])
        self.normals = normals * np.copysign(1 / self._sines, dot(normals, shine))
        self.radiance = 1 / (np.pi * np.array([lamp.area for lamp in lamps]))
        self.reach = np.hypot(*self.lengths)

    @staticmethod
    def _half_sides(lamp: Area) -> tuple[Floats, Floats]:
        raise NotImplementedError

    @staticmethod
    def _covers(across: Floats, along: Floats) -> NDArray[np.bool_]:
        raise NotImplementedError

    def estimate(self, lamp: int, position: Floats, normal: Floats) -> Floats:
        way = self.centres[:, lamp, None] - position
        reach = self.reach[lamp]
        before = -dot(way, self.normals[:, lamp])
        squared = dot(way, way)
        farthest = np.sqrt(squared) + reach
        light = np.fmax(dot(normal, way) + reach, 0.0) * (before + reach)  # two cosines, as of `risen`
        light *= self.colours[:, lamp].mean() / np.pi / (farthest * farthest * (squared + reach**2 / 2))
        return np.where(before > 0, light, 0.0)

    def met(self, lamp: int, starts: Floats, ahead: Floats, nearest: Floats, farthest: Floats) -> Floats:
        """(n,) factors, 0 where rays (3, n), unit, pass the lamp by between `nearest` and `farthest`, distances."""
        normal, first, second = self.normals[:, lamp], self.first[:, lamp], self.second[:, lamp]
        way = self.centres[:, lamp, None] - starts
        facing = dot(normal, ahead)
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = dot(normal, way) / facing
            place = ahead * distance - way
        # Each coordinate along the direction that the other side is perpendicular to: the sides may be askew.
        plane = np.cross(first, second) / self._sines[lamp] ** 2
        across = dot(np.cross(second, plane), place) / self.lengths[0, lamp]
        along = dot(np.cross(plane, first), place) / self.lengths[1, lamp]
        hit = (facing < 0) & (distance > nearest) & (distance < farthest) & self._covers(across, along)
        return np.where(hit, self.radiance[lamp], 0.0)

    def _by_area(self, which: Indices, way: Floats, across: Floats, along: Floats) -> Sampled:
        """Towards points with coordinates −1 to 1 along the half sides, each as likely as the other."""
        lengths = entries(self.lengths, which)
        to = way + entries(self.first, which) * (lengths[0] * across) + entries(self.second, which) * (lengths[1] * along)
        squared = dot(to, to)
        distance = np.sqrt(squared)
        to /= distance
        factor = dot(entries(self.normals, which), to) / squared
        return to, distance, np.fmax(factor * (-1 / np.pi), 0.0)

    def _by_angle(self, which: Indices, way: Floats, u: Floats) -> tuple[Sampled, Floats, Floats]:
        """Evenly over the solid angles of the rectangles; also the coordinates −1 to 1 along the half sides."""
        first, second, normal = (entries(table, which) for table in (self.first, self.second, self.normals))
        lengths = entries(self.lengths, which)
        middle = dot(first, way), dot(second, way)
        depth = dot(normal, way)
        sides = middle[0] - lengths[0], middle[0] + lengths[0], middle[1] - lengths[1], middle[1] + lengths[1]
        with np.errstate(divide="ignore", invalid="ignore"):
            x, y, solid_angle = on_rectangle(*sides, depth, u)
        distance = np.sqrt(x * x + y * y + depth * depth)
        ahead = (first * x + second * y + normal * depth) / distance
        factor = np.where(depth < 0, solid_angle * entries(self.radiance, which), 0.0)
        return (ahead, distance, factor), (x - middle[0]) / lengths[0], (y - middle[1]) / lengths[1]


class Rectangles(_Plates):
    def __init__(self, lamps: Sequence[Area], view: View) -> None:
        super().__init__(lamps, view)
        self.askew = np.abs(dot(self.first, self.second)) > _ASKEW

    @staticmethod
    def _half_sides(lamp: Area) -> tuple[Floats, Floats]:
        return lamp.matrix[:3, 0] * (lamp.size[0] / 2), lamp.matrix[:3, 1] * (lamp.size[1] / 2)

    @staticmethod
    def _covers(across: Floats, along: Floats) -> NDArray[np.bool_]:
        return (np.abs(across) <= 1) & (np.abs(along) <= 1)

    def sample(self, which: Indices, position: Floats, shading: Floats, u: Floats) -> Sampled:
        way = entries(self.centres, which) - position
        sampled = self._by_area(which, way, 2 * u[0] - 1, 2 * u[1] - 1)
        lengths, squared = entries(self.lengths, which), dot(way, way)
        apart = sum(
            np.abs(dot(entries(side, which), way)) * length
            for side, length in zip((self.first, self.second), lengths, strict=True)
        )
        near = (apart > SLANT * squared) | (squared < (FAR * lengths.max(axis=0)) ** 2)
        near = np.flatnonzero(near & ~entries(self.askew, which))
        if len(near):
            which = gather(which, near)
            by_angle, _, _ = self._by_angle(which, gather(way, near), gather(u, near))
            wide = some(by_angle[2] >= SMALLEST_ANGLE * entries(self.radiance, which))
            replace(sampled, pick(near, wide), [pick(values, wide) for values in by_angle])
        return sampled


class Ellipses(_Plates):
    @staticmethod
    def _half_sides(lamp: Area) -> tuple[Floats, Floats]:
        """The half axes, which a sheared circle has as well."""
        axes, lengths, _ = np.linalg.svd(lamp.matrix[:3, :2] * (np.array(lamp.size) / 2))
        return axes[:, 0] * lengths[0], axes[:, 1] * lengths[1]

    @staticmethod
    def _covers(across: Floats, along: Floats) -> NDArray[np.bool_]:
        return across * across + along * along <= 1

    def sample(self, which: Indices, position: Floats, shading: Floats, u: Floats) -> Sampled:
        way = entries(self.centres, which) - position
        radius, (x, y) = np.sqrt(u[0]), turned(u[1])
        sampled = self._by_area(which, way, radius * x, radius * y)
        near = np.flatnonzero(dot(way, way) < (FAR * entries(self.lengths, which)[0]) ** 2)
        if len(near):
            replace(sampled, near, self._as_rectangle(gather(which, near), gather(way, near), gather(u, near)))
        return sampled

    def _as_rectangle(self, which: Indices, way: Floats, u: Floats) -> Sampled:
        sampled, across, along = self._by_angle(which, way, u)
        sampled[2][~self._covers(across, along)] = 0.0
        return sampled


def on_rectangle(x0: Floats, x1: Floats, y0: Floats, y1: Floats, depth: Floats, u: Floats) -> tuple[Floats, Floats, Floats]:
    """Points of rectangles parallel to the x-y plane, spread evenly over the solid angle that is seen from the origin.

    x0 … y1 : (n,), the sides. depth : (n,), of the plane, of either sign. u : (2, n) in [0, 1).

    Returns x, y and the solid angle, (n,) each; of numbers instead of arrays, numbers.
    """
    squared = depth * depth
    # The depth components of the unit normals of the planes through the origin and each side; the others are 0 in pairs.
    bottom, right = -y0 / np.sqrt(squared + y0 * y0), x1 / np.sqrt(squared + x1 * x1)
    top, left = y1 / np.sqrt(squared + y1 * y1), -x0 / np.sqrt(squared + x0 * x0)
    before = np.arcsin(bottom * right) + np.arcsin(right * top)
    behind = np.arcsin(top * left) + np.arcsin(left * bottom)
    solid_angle = before + behind
    # From here on x, that part of the angle is to the left of it which u asks for.
    cosine, sine = turned((u[0] * solid_angle - behind) / (2 * np.pi))
    rest = cosine * bottom + top
    slope = np.sqrt(np.maximum(rest * rest - sine * sine * (squared / (squared + y0 * y0)), 0.0))
    x = np.minimum(np.fmax(np.copysign(depth, rest) * sine / slope, x0), x1)
    # With x known, y spreads as the sine of its elevation.
    squared = x * x + squared
    low, high = y0 / np.sqrt(squared + y0 * y0), y1 / np.sqrt(squared + y1 * y1)
    elevation = low + u[1] * (high - low)
    y = np.minimum(np.fmax(elevation * np.sqrt(squared / np.maximum(1 - elevation * elevation, 0.0)), y0), y1)
    return x, y, np.fmax(solid_angle, 0.0)
