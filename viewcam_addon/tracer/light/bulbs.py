"""Suns, points and spots in camera space: from where they light a point, and how brightly.

Each kind of lamp, here and in plates.py, is a table of its k lamps with three ways to ask:

- `sample` picks, for each point, a direction in which one lamp is seen, evenly over the solid angle that the lamp fills there.
  So what a point gets is bounded however near the lamp, and a lamp of no size is no special case: power and solid angle are
  multiplied out, and the radius cancels.
- `estimate` is how much a lamp brings to points, roughly, and 0 only where it brings nothing.
- `met` is what rays see that run into a lamp.
- `colours` is what the factors that these return are multiplied with.

Rejected: sampling spheres and rectangles by their area, whose samples near a point have the inverse square of their distance,
and multiple importance sampling of lamps at diffuse surfaces, which that needs, and which costs a second ray.
"""

from collections.abc import Sequence

import numpy as np

from ..arrays import Floats, Indices, dot, gather, put
from ..rays.view import View
from ..scene.lamps import Point, Spot, Sun
from .scattering import axes_about, cosine_direction, turned

Sampled = tuple[Floats, ...]
"""Directions (3, n) unit, distances (n,), and what a lamp's colour is multiplied with: its radiance over the density."""

QUARTER_SPHERE = 4 * np.pi  # a power over the squared distance's multiple of it is an irradiance


def entries(table: Floats, which: Indices) -> Floats:
    """The entries of the last axis of `table`, which broadcast where there is but one."""
    return table if table.shape[-1] == 1 else gather(table, which)


def replace(sampled: Sampled, which: Indices, instead: Sampled) -> None:
    for whole, part in zip(sampled, instead, strict=True):
        put(whole, which, part)


def columns(vectors: Sequence[Sequence[float]]) -> Floats:
    """(3, k) of k vectors."""
    return np.array(vectors, np.float64).reshape(-1, 3).T.copy()


def _not_tiny(sizes: Sequence[float]) -> Floats:
    """Sizes as they are, but 0 where their squares are nothing that float64 can divide by."""
    return np.where(np.array(sizes) > 1e-100, sizes, 0.0)


def risen(height: Floats, distance: Floats, reach: Floats) -> Floats:
    """About the cosine under which what reaches `reach` round a place is seen, 0 only if all of it is below the horizon.

    height : of the place above the surface's plane. distance : of the place.
    """
    return np.fmax(height + reach, 0.0) / (distance + reach)


def one_minus_cosine(squared_sine: Floats) -> Floats:
    """1 − cos of angles up to a right one: a lamp that is far away fills a cone whose cosine is 1 to the last bit."""
    return squared_sine / (1.0 + np.sqrt(1.0 - squared_sine))


def within_cone(axis: Floats, spread: Floats, u: Floats) -> tuple[Floats, Floats]:
    """Directions spread evenly over the solid angle of cones, and 1 − cos of their angles to the axes.

    axis : (3, n) or (3, 1), unit. spread : (n,) or (1,), 1 − cos of half the opening. u : (2, n) in [0, 1).
    """
    right, up = axes_about(axis)
    short = u[0] * spread
    sine, (x, y) = np.sqrt(short * (2.0 - short)), turned(u[1])
    return axis * (1.0 - short) + right * (sine * x) + up * (sine * y), short


class Suns:
    """Discs of directions, or one direction each. colours : irradiances."""

    def __init__(self, lamps: Sequence[Sun], view: View) -> None:
        self.colours = columns([lamp.irradiance for lamp in lamps])
        half = _not_tiny([lamp.angle / 2 for lamp in lamps])
        self.sized = half > 0
        self.towards = view.axes @ columns([lamp.towards for lamp in lamps])
        self._half_chord = np.sin(half / 2)
        self.spread = 2 * self._half_chord**2  # 1 − cos
        with np.errstate(divide="ignore"):
            self.radiance = np.where(self.sized, 1 / (np.pi * np.sin(half) ** 2), 0.0)
        self.over_density = 2 / (2 - self.spread)  # that radiance times the solid angle, 2π (1 − cos)

    def sample(self, which: Indices, position: Floats, shading: Floats, u: Floats) -> Sampled:
        towards, spread = entries(self.towards, which), entries(self.spread, which)
        count = u.shape[1]
        if spread.any():
            towards, _ = within_cone(towards, spread, u)
        return (
            np.broadcast_to(towards, (3, count)),
            np.full(count, np.inf),
            np.broadcast_to(entries(self.over_density, which), count),
        )

    def estimate(self, lamp: int, position: Floats, normal: Floats) -> Floats:
        sine = np.sqrt(self.spread[lamp] * (2 - self.spread[lamp]))
        return risen(dot(normal, self.towards[:, lamp]), 1.0, sine) * self.colours[:, lamp].mean()

    def met(self, lamp: int, ahead: Floats) -> Floats:
        """(n,) factors, 0 where rays (3, n), unit, pass the lamp by."""
        apart = ahead - self.towards[:, lamp, None]
        return np.where(dot(apart, apart) <= 4 * self._half_chord[lamp] ** 2, self.radiance[lamp], 0.0)


class Bulbs:
    """Points and spots: spheres, or, with `soft_falloff`, discs that face whatever they light. colours : powers.

    At the distance d a sphere of the radius R fills a cone of sin θ = R/d, a disc one of tan θ = R/d. Both have the radiance
    P/(4π² R²) and the solid angle 2π (1 − cos θ): R cancels. Inside a sphere light comes evenly from everywhere.

    centres : (3, k). reach : (k,), how far lamps reach round them.
    """

    def __init__(self, lamps: Sequence[Point | Spot], view: View) -> None:
        places = [lamp.matrix[:3, 3] if isinstance(lamp, Spot) else lamp.position for lamp in lamps]
        self.colours = columns([lamp.power for lamp in lamps])
        self.centres = view.axes @ (columns(places) - view.eye[:, None])
        self.radii = self.reach = _not_tiny([lamp.radius for lamp in lamps])
        self.sized = self.radii > 0
        self.soft = np.array([lamp.soft_falloff for lamp in lamps])
        self.cones = _Cones(lamps, view) if any(isinstance(lamp, Spot) for lamp in lamps) else None
        with np.errstate(divide="ignore"):
            self.radiance = np.where(self.sized, 1 / (QUARTER_SPHERE * np.pi * self.radii**2), 0.0)

    def sample(self, which: Indices, position: Floats, shading: Floats, u: Floats) -> Sampled:
        way = entries(self.centres, which) - position
        squared = dot(way, way)
        distance = np.sqrt(squared)
        with np.errstate(divide="ignore", invalid="ignore"):
            axis = np.where(distance > 0, way / distance, [[0.0], [0.0], [1.0]])
            if not entries(self.radii, which).any():
                factor = np.where(distance > 0, 1 / (QUARTER_SPHERE * squared), 0.0)
                return axis, distance, factor if self.cones is None else factor * self.cones.attenuation(which, axis)
        return self._sample_sized(which, way, axis, distance, shading, u)

    def _sample_sized(self, which: Indices, way: Floats, axis: Floats, distance: Floats, shading: Floats, u: Floats) -> Sampled:
        radius, soft = entries(self.radii, which), entries(self.soft, which)
        radius_squared, squared = radius * radius, distance * distance
        to_edge = squared + np.where(soft, radius_squared, 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            spread = one_minus_cosine(np.where(to_edge > 0, np.minimum(radius_squared / to_edge, 1.0), 0.0))
            factor = np.where(to_edge > 0, 1 / ((2 - spread) * (2 * np.pi * to_edge)), 0.0)
            ahead, short = within_cone(axis, spread, u)
            along = distance * (1 - short)
            root = np.sqrt(np.maximum(radius_squared - squared * short * (2 - short), 0.0))
            reached = np.where(soft, np.nan_to_num(squared / along), along - root)
        sampled = ahead, reached, factor
        inside = ~soft & (distance <= radius) & (radius > 0)
        if self.cones is not None:
            narrow = np.flatnonzero(~soft & ~inside & (entries(self.cones.spread, which) < spread))
            if len(narrow):
                replace(sampled, narrow, self._along_the_beam(which[narrow], way[:, narrow], u[:, narrow]))
            factor *= np.where(inside, 1.0, self.cones.attenuation(which, ahead))
        inside = np.flatnonzero(inside)
        if len(inside):
            replace(sampled, inside, self._from_inside(which[inside], way[:, inside], shading[:, inside], u[:, inside]))
        return sampled

    def _along_the_beam(self, which: Indices, way: Floats, u: Floats) -> Sampled:
        """Samples of spheres so large, or near, that the cones of their spots are narrower than they look."""
        spread, radius = entries(self.cones.spread, which), entries(self.radii, which)
        ahead, _ = within_cone(entries(self.cones.axes, which), spread, u)
        along = dot(way, ahead)
        root = radius * radius - (dot(way, way) - along * along)
        hit = (root >= 0) & (along > 0)
        return ahead, along - np.sqrt(np.maximum(root, 0.0)), hit * entries(self.radiance, which) * (2 * np.pi * spread)

    def _from_inside(self, which: Indices, way: Floats, shading: Floats, u: Floats) -> Sampled:
        ahead, density = cosine_direction(shading, u)
        along, radius = dot(way, ahead), entries(self.radii, which)
        reached = along + np.sqrt(np.maximum(radius * radius - dot(way, way) + along * along, 0.0))
        return ahead, reached, entries(self.radiance, which) / np.maximum(density, LEAST_DENSITY)

    def estimate(self, lamp: int, position: Floats, normal: Floats) -> Floats:
        way = self.centres[:, lamp, None] - position
        radius = self.radii[lamp]
        distance = np.sqrt(dot(way, way))
        with np.errstate(divide="ignore", invalid="ignore"):
            falloff = self.colours[:, lamp].mean() / (QUARTER_SPHERE * np.maximum(distance, radius) ** 2)
            light = np.where(distance + radius > 0, falloff, 0.0) * risen(dot(normal, way), distance, radius)
            if self.cones is not None:
                seen = self.cones.attenuation(np.array([lamp]), way / distance)
                light *= np.maximum(np.nan_to_num(seen), LEAST_OF_A_WIDE_SPOT if radius > 0 else 0.0)
        return light

    def met(self, lamp: int, starts: Floats, ahead: Floats, nearest: Floats, farthest: Floats) -> Floats:
        """(n,) factors, 0 where rays (3, n), unit, pass the lamp by between `nearest` and `farthest`, distances."""
        radius_squared = self.radii[lamp] ** 2
        way = self.centres[:, lamp, None] - starts
        along, squared = dot(way, ahead), dot(way, way)
        if self.soft[lamp]:
            with np.errstate(divide="ignore", invalid="ignore"):
                distance = squared / along
                hit = (along > 0) & (distance * distance - squared <= radius_squared)
        else:
            aside = way - along * ahead
            root = radius_squared - dot(aside, aside)
            inside = squared <= radius_squared
            distance = along + np.copysign(np.sqrt(np.maximum(root, 0.0)), inside - 0.5)
            hit = (root >= 0) & ((along > 0) | (inside & (self.cones is None or not self.cones.is_spot[lamp])))
        hit = np.flatnonzero(hit & (distance > nearest) & (distance < farthest))
        factors = np.zeros(len(along))
        factors[hit] = self.radiance[lamp]
        if self.cones is not None:
            lit = self.cones.attenuation(np.array([lamp]), ahead[:, hit])
            factors[hit] *= lit if self.soft[lamp] else np.where(inside[hit], 1.0, lit)
        return factors


LEAST_OF_A_WIDE_SPOT = 0.05
"""What the estimate of a spot that has a radius never falls below: part of it may be seen from where its middle is dark."""

_HARD_EDGE = 1e-30
LEAST_DENSITY = 1e-30
_SHEARED = 1e-9


class _Cones:
    """The cones of spots, measured in their own space; points have none, and nothing of their light is lost.

    is_spot : (k,). axes : (3, k), against the beam. spread : (k,), 1 − cos of half the opening of a cone about them that holds
    all light; more than any sphere fills where that is not known.
    """

    def __init__(self, lamps: Sequence[Point | Spot], view: View) -> None:
        self.is_spot = np.array([isinstance(lamp, Spot) for lamp in lamps])
        inverses = [np.linalg.inv(lamp.matrix[:3, :3]) @ view.axes.T if isinstance(lamp, Spot) else np.eye(3) for lamp in lamps]
        self.inverse = np.stack([inverse.ravel() for inverse in inverses], axis=1)
        angles = np.array([lamp.angle if isinstance(lamp, Spot) else 0.0 for lamp in lamps])
        blends = np.array([lamp.blend if isinstance(lamp, Spot) else 0.0 for lamp in lamps])
        edge = np.cos(angles / 2)
        self.edge = np.where(self.is_spot, edge, -2.0)
        self.slope = 1 / np.maximum((1 - edge) * blends, _HARD_EDGE)
        linear = np.array([lamp.matrix[:3, :3] if isinstance(lamp, Spot) else np.eye(3) for lamp in lamps])
        squares = linear.transpose(0, 2, 1) @ linear
        lengths = np.diagonal(squares, axis1=1, axis2=2)
        self.axes = view.axes @ (linear[:, :, 2] / np.sqrt(lengths[:, 2:])).T
        sheared = np.abs(squares - lengths[:, None] * np.eye(3)).max(axis=(1, 2)) > _SHEARED * lengths.max(axis=1)
        wider = np.maximum(lengths[:, 0], lengths[:, 1]) / lengths[:, 2]
        self.spread = np.where(self.is_spot & ~sheared, 1 - 1 / np.sqrt(1 + np.tan(angles / 2) ** 2 * wider), 2.0)

    def attenuation(self, which: Indices, ahead: Floats) -> Floats:
        """(n,) for rays (3, n), unit, towards the lamps."""
        inverse = entries(self.inverse, which)
        x, y, z = (dot(inverse[row : row + 3], ahead) for row in (0, 3, 6))
        with np.errstate(invalid="ignore"):
            cosine = z / np.sqrt(x * x + y * y + z * z)
        rise = np.clip((cosine - entries(self.edge, which)) * entries(self.slope, which), 0.0, 1.0)
        return rise * rise * (3 - 2 * rise)
