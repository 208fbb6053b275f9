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

from .arrays import Floats, Indices, dot, gather
from .lights import Point, Spot, Sun
from .scattering import axes_about, cosine_direction
from .view import View

Sampled = tuple[Floats, Floats, Floats]
"""Directions (3, n) unit, distances (n,), and what a lamp's colour is multiplied with: its radiance over the density."""

_QUARTER_SPHERE = 4 * np.pi  # a power over the squared distance's multiple of it is an irradiance


def entries(table: Floats, which: Indices) -> Floats:
    """The entries of the last axis of `table`, which broadcast where there is but one."""
    return table if table.shape[-1] == 1 else gather(table, which)


def some(values: Floats, which: Indices) -> Floats:
    """Values of (n,) points, or (1,) for all of them, at some of the points."""
    return values if len(values) == 1 else values[which]


def columns(vectors: Sequence[Sequence[float]]) -> Floats:
    """(3, k) of k vectors."""
    return np.array(vectors, np.float64).reshape(-1, 3).T.copy()


def risen(height: Floats, distance: Floats, reach: Floats) -> Floats:
    """About the cosine under which what reaches `reach` round a place is seen, 0 only if all of it is below the horizon.

    height : of the place above the surface's plane. distance : of the place.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (np.maximum(height, 0.0) + reach) / (distance + reach)
    return np.where(height + reach > 0, share, 0.0)


def one_minus_cosine(squared_sine: Floats) -> Floats:
    """1 − cos of angles up to a right one: a lamp that is far away fills a cone whose cosine is 1 to the last bit."""
    return squared_sine / (1.0 + np.sqrt(1.0 - squared_sine))


def within_cone(axis: Floats, spread: Floats, u: Floats) -> tuple[Floats, Floats]:
    """Directions spread evenly over the solid angle of cones, and 1 − cos of their angles to the axes.

    axis : (3, n) or (3, 1), unit. spread : (n,) or (1,), 1 − cos of half the opening. u : (2, n) in [0, 1).
    """
    right, up = axes_about(axis)
    short = u[0] * spread
    sine, turn = np.sqrt(short * (2.0 - short)), 2 * np.pi * u[1]
    return axis * (1.0 - short) + right * (sine * np.cos(turn)) + up * (sine * np.sin(turn)), short


class Suns:
    """Discs of directions, or one direction each. colours : irradiances."""

    def __init__(self, lamps: Sequence[Sun], view: View) -> None:
        self.colours = columns([lamp.irradiance for lamp in lamps])
        half = np.array([lamp.angle for lamp in lamps]) / 2
        self.sized = half > 0
        self._towards = view.axes @ columns([lamp.towards for lamp in lamps])
        self._half_chord = np.sin(half / 2)
        self._spread = 2 * self._half_chord**2  # 1 − cos
        with np.errstate(divide="ignore"):
            self._radiance = np.where(self.sized, 1 / (np.pi * np.sin(half) ** 2), 0.0)
        self._over_density = 2 / (2 - self._spread)  # that radiance times the solid angle, 2π (1 − cos)

    def sample(self, which: Indices, position: Floats, shading: Floats, u: Floats) -> Sampled:
        towards, spread = entries(self._towards, which), entries(self._spread, which)
        count = u.shape[1]
        if spread.any():
            towards, _ = within_cone(towards, spread, u)
        return (
            np.broadcast_to(towards, (3, count)),
            np.full(count, np.inf),
            np.broadcast_to(entries(self._over_density, which), count),
        )

    def estimate(self, lamp: int, position: Floats, normal: Floats) -> Floats:
        sine = np.sqrt(self._spread[lamp] * (2 - self._spread[lamp]))
        return risen(dot(normal, self._towards[:, lamp]), 1.0, sine) * self.colours[:, lamp].mean()

    def met(self, lamp: int, ahead: Floats) -> Floats:
        """(n,) factors, 0 where rays (3, n), unit, pass the lamp by."""
        apart = ahead - self._towards[:, lamp, None]
        return np.where(dot(apart, apart) <= 4 * self._half_chord[lamp] ** 2, self._radiance[lamp], 0.0)


class Bulbs:
    """Points and spots: spheres, or, with `soft_falloff`, discs that face whatever they light. colours : powers.

    At the distance d a sphere of the radius R fills a cone of sin θ = R/d, a disc one of tan θ = R/d. Both have the radiance
    P/(4π² R²) and the solid angle 2π (1 − cos θ): R cancels. Inside a sphere light comes evenly from everywhere.
    """

    def __init__(self, lamps: Sequence[Point | Spot], view: View) -> None:
        places = [lamp.matrix[:3, 3] if isinstance(lamp, Spot) else lamp.position for lamp in lamps]
        self.colours = columns([lamp.power for lamp in lamps])
        self._centres = view.axes @ (columns(places) - view.eye[:, None])
        self._radii = np.array([lamp.radius for lamp in lamps])
        self.sized = self._radii > 0
        self._soft = np.array([lamp.soft_falloff for lamp in lamps])
        self._cones = _Cones(lamps, view) if any(isinstance(lamp, Spot) for lamp in lamps) else None
        with np.errstate(divide="ignore"):
            self._radiance = np.where(self.sized, 1 / (_QUARTER_SPHERE * np.pi * self._radii**2), 0.0)

    def sample(self, which: Indices, position: Floats, shading: Floats, u: Floats) -> Sampled:
        way = entries(self._centres, which) - position
        squared = dot(way, way)
        distance = np.sqrt(squared)
        with np.errstate(divide="ignore", invalid="ignore"):
            axis = np.where(distance > 0, way / distance, [[0.0], [0.0], [1.0]])
            if not entries(self._radii, which).any():
                ahead, factor = axis, np.where(distance > 0, 1 / (_QUARTER_SPHERE * squared), 0.0)
                return ahead, distance, self._attenuated(factor, which, ahead)
        return self._sample_sized(which, way, axis, distance, shading, u)

    def _sample_sized(self, which: Indices, way: Floats, axis: Floats, distance: Floats, shading: Floats, u: Floats) -> Sampled:
        radius, soft = entries(self._radii, which), entries(self._soft, which)
        radius_squared = radius * radius
        squared = distance * distance
        inside = np.flatnonzero((distance <= radius) & ~soft & (radius > 0))
        to_edge = squared + np.where(soft, radius_squared, 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            squared_sine = np.where(to_edge > 0, np.minimum(radius_squared / to_edge, 1.0), 0.0)
            spread = one_minus_cosine(squared_sine)
            factor = np.where(to_edge > 0, (2 - spread) ** -1 / (2 * np.pi * to_edge), 0.0)
            ahead, short = within_cone(axis, spread, u)
            along = distance * (1 - short)
            root = np.sqrt(np.maximum(radius_squared - squared * short * (2 - short), 0.0))
            met = np.where(soft, squared / along, along - root)
        factor = self._attenuated(factor, which, ahead)
        if len(inside):
            ahead[:, inside], density = cosine_direction(shading[:, inside], u[:, inside])
            along = dot(way[:, inside], ahead[:, inside])
            aside = squared[inside] - along * along
            met[inside] = along + np.sqrt(np.maximum(some(radius_squared, inside) - aside, 0.0))
            factor[inside] = some(entries(self._radiance, which), inside) / np.maximum(density, _LEAST_DENSITY)
        return ahead, met, factor

    def _attenuated(self, factor: Floats, which: Indices, ahead: Floats) -> Floats:
        return factor if self._cones is None else factor * self._cones.attenuation(which, ahead)

    def estimate(self, lamp: int, position: Floats, normal: Floats) -> Floats:
        way = self._centres[:, lamp, None] - position
        radius = self._radii[lamp]
        distance = np.sqrt(dot(way, way))
        with np.errstate(divide="ignore", invalid="ignore"):
            falloff = self.colours[:, lamp].mean() / (_QUARTER_SPHERE * np.maximum(distance, radius) ** 2)
            light = np.where(distance + radius > 0, falloff, 0.0) * risen(dot(normal, way), distance, radius)
            if self._cones is not None:
                seen = self._cones.attenuation(np.array([lamp]), way / distance)
                light *= np.maximum(np.nan_to_num(seen), _LEAST_OF_A_WIDE_SPOT if radius > 0 else 0.0)
        return light

    def met(self, lamp: int, starts: Floats, ahead: Floats, nearest: Floats, farthest: Floats) -> Floats:
        """(n,) factors, 0 where rays (3, n), unit, pass the lamp by between `nearest` and `farthest`, distances."""
        radius_squared = self._radii[lamp] ** 2
        way = self._centres[:, lamp, None] - starts
        along, squared = dot(way, ahead), dot(way, way)
        if self._soft[lamp]:
            with np.errstate(divide="ignore", invalid="ignore"):
                distance = squared / along
                hit = (along > 0) & (distance * distance - squared <= radius_squared)
        else:
            aside = way - along * ahead
            root = radius_squared - dot(aside, aside)
            inside = squared <= radius_squared
            distance = along + np.copysign(np.sqrt(np.maximum(root, 0.0)), inside - 0.5)
            hit = (root >= 0) & ((along > 0) | (inside & (self._cones is None or not self._cones.is_spot[lamp])))
        hit = np.flatnonzero(hit & (distance > nearest) & (distance < farthest))
        factors = np.zeros(len(along))
        factors[hit] = self._radiance[lamp]
        if self._cones is not None:
            lit = self._cones.attenuation(np.array([lamp]), ahead[:, hit])
            factors[hit] *= lit if self._soft[lamp] else np.where(inside[hit], 1.0, lit)
        return factors


_LEAST_OF_A_WIDE_SPOT = 0.05
"""What the estimate of a spot that has a radius never falls below: part of it may be seen from where its middle is dark."""

_HARD_EDGE = 1e-30
_LEAST_DENSITY = 1e-30


class _Cones:
    """The cones of spots, measured in their own space; points have none, and light is not weakened.

    is_spot : (k,).
    """

    def __init__(self, lamps: Sequence[Point | Spot], view: View) -> None:
        self.is_spot = np.array([isinstance(lamp, Spot) for lamp in lamps])
        inverses = [np.linalg.inv(lamp.matrix[:3, :3]) @ view.axes.T if isinstance(lamp, Spot) else np.eye(3) for lamp in lamps]
        self._inverse = np.stack([inverse.ravel() for inverse in inverses], axis=1)
        angles = np.array([lamp.angle if isinstance(lamp, Spot) else 0.0 for lamp in lamps])
        blends = np.array([lamp.blend if isinstance(lamp, Spot) else 0.0 for lamp in lamps])
        edge = np.cos(angles / 2)
        self._edge = np.where(self.is_spot, edge, -2.0)
        self._slope = 1 / np.maximum((1 - edge) * blends, _HARD_EDGE)

    def attenuation(self, which: Indices, ahead: Floats) -> Floats:
        """(n,) for rays (3, n), unit, towards the lamps."""
        inverse = entries(self._inverse, which)
        x, y, z = (dot(inverse[row : row + 3], ahead) for row in (0, 3, 6))
        with np.errstate(invalid="ignore"):
            cosine = z / np.sqrt(x * x + y * y + z * z)
        rise = np.clip((cosine - entries(self._edge, which)) * entries(self._slope, which), 0.0, 1.0)
        return rise * rise * (3 - 2 * rise)
