"""Light along paths from the eye: what the levels `direct` and `path` compute.

Many paths go at once, scattering by scattering. Where one meets a surface, the surface's own light is added, then that of one
emitter, chosen at random, to which a shadow ray is sent; then the path is scattered and goes on until it leaves the scene or
its bounces are used up. Light that both the shadow ray and the scattered ray can find is weighted between them (multiple
importance sampling: Veach, 1997).

Level `direct` is level `path` without bounces, as Cycles counts them: a path may be scattered once more than there are bounces,
in all and by each kind of surface, and where it comes to then, only what shines there counts.

Nothing is computed that a scene does not have: without emitters no shadow rays, without anything bright that rays could run
into no last ray, without either one ray a sample.

Rejected: one path at a time (Python), all paths through all cases at once with masks (most of a scene's paths have one case),
and splitting a path at glass, which makes work where light is faint.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from . import scattering
from .arrays import Floats, Indices, dot
from .emitters import Emitters, weight
from .film import Bounces
from .light import BACKGROUND, DIRECT, INDIRECT, OTHER, Light
from .lobes import DIFFUSE, KINDS, Lobes, lobes_at
from .points import Points, Surfaces
from .sampler import FILM, SCATTERING, Sampler
from .space import Space
from .textures import Palette

# Which of a scattering's random numbers are for what.
_EMITTER, _DIRECTION, _WAY, _SURVIVAL = 0, 3, 5, 6
Numbers = Callable[[Indices, int, int], Floats]
"""Random numbers (count, k) for some of the paths: which, the first dimension, how many dimensions."""

# Scatterings before a path may be ended by chance. Sooner, it costs more noise than it saves time.
_CERTAIN = 3


@dataclass(slots=True)
class Arrivals:
    """Where k paths have come to.

    path : which of the batch's paths. place : where in `Light` that which they bring belongs. weight : (3, k) how much of the
    light from there reaches the eye. counts : (kinds, k) scatterings so far. direction : (3, k), unit, in which they came.
    """

    path: Indices
    place: Indices
    weight: Floats
    counts: NDArray[np.int16]
    direction: Floats
    points: Points


@dataclass(slots=True)
class Rays:
    """k rays of one kind that leave `points`. density : (k,) of the direction's choice, per solid angle, infinite for mirrors.

    last : (k,) whether only what shines where they come to counts. The rest as in `Arrivals`.
    """

    kind: str
    path: Indices
    place: Indices
    weight: Floats
    counts: NDArray[np.int16]
    direction: Floats
    points: Points
    density: Floats
    last: NDArray[np.bool_]


class Paths:
    """Traces paths through one scene; any thread may."""

    def __init__(
        self, surfaces: Surfaces, space: Space, emitters: Emitters, palette: Palette, bounces: Bounces, sampler: Sampler
    ) -> None:
        self._surfaces, self._space, self._emitters, self._palette = surfaces, space, emitters, palette
        self._sampler = sampler
        self._most = bounces.total + 1
        self._most_of = {kind: getattr(bounces, kind) + 1 for kind in KINDS}

    @property
    def random(self) -> bool:
        """Whether paths through the same point of the film may bring different light."""
        emitters, palette = self._emitters, self._palette
        if not emitters.lit:
            return False
        onwards = min(self._most, self._most_of["diffuse"]) > 1 or emitters.meets("diffuse")
        return palette.has("glass") or (palette.has("diffuse") and (emitters.random or onwards))

    def trace(self, pixels: Indices, samples: Indices, primitives: Indices, x: Floats, y: Floats) -> Light:
        """The light of n paths whose rays from the eye, (x, y, 1), meet primitives, −1 for none.

        pixels, samples : (n,) which random numbers each path has.
        """
        light = Light(len(pixels))
        arrivals = self._from_eye(light, primitives, x, y)
        depth = 0
        while self._emitters.lit and arrivals is not None:
            depth += 1
            rays = self._scattered(light, arrivals, depth, pixels, samples)
            arrivals = _joined([self._arrived(light, some) for some in rays])
        return light

    def _from_eye(self, light: Light, primitives: Indices, x: Floats, y: Floats) -> Arrivals:
        """What the eye's rays come to, and the passes that are of this alone."""
        count = len(primitives)
        direction = np.stack([x, y, np.ones(count)])
        direction /= np.sqrt(dot(direction, direction))
        path = np.arange(count)
        met = np.flatnonzero(primitives >= 0)
        points = self._surfaces.seen(primitives[met], x[met], y[met])
        light.covered[met] = True
        if self._palette.has("diffuse"):
            light.colour[:, met] = self._palette.colour("diffuse", points)
        reach = np.full(count, np.inf)
        reach[met] = np.sqrt(dot(points.position, points.position))
        ones, start = np.ones((3, count)), np.zeros((3, count))
        self._add_lamps(light, "camera", path, ones, start, direction, reach, path + BACKGROUND * count)
        if self._palette.has("emission"):
            light.add(path[met], self._palette.colour("emission", points))
        counts = np.zeros((len(KINDS), len(met)), np.int16)
        return Arrivals(met, path[met], ones[:, met], counts, direction[:, met], points)

    def _arrived(self, light: Light, rays: Rays) -> Arrivals:
        """Where rays come to, but the last; adds what shines there."""
        met, points, distance = self._space.first(rays.points, rays.direction, rays.kind)
        if self._emitters.meets(rays.kind):
            reach = np.full(len(rays.path), np.inf)
            reach[met] = distance
            start = rays.points.position
            self._add_lamps(light, rays.kind, rays.place, rays.weight, start, rays.direction, reach, rays.place)
            if self._palette.has("emission"):
                self._add_emission(light, rays, met, points, distance)
        if rays.last.any():
            onwards = np.flatnonzero(~rays.last[met])
            met, points = met[onwards], points.at(onwards)
        return Arrivals(
            rays.path[met], rays.place[met], rays.weight[:, met], rays.counts[:, met], rays.direction[:, met], points
        )

    def _add_lamps(
        self,
        light: Light,
        kind: str,
        places: Indices,
        weights: Floats,
        starts: Floats,
        directions: Floats,
        reach: Floats,
        beyond: Indices,
    ) -> None:
        """Add the lamps that rays run through on their way, and what they see where they meet nothing.

        reach : (n,) distance of what they meet, or inf. beyond : the places for the world's light.
        """
        light.add(places, weights * self._emitters.lamps_met(starts, directions, 0.0, reach, kind))
        missed = np.flatnonzero(np.isinf(reach))
        if len(missed):
            light.add(places[missed], weights[:, missed] * self._emitters.suns_met(directions[:, missed], kind))
            light.add(beyond[missed], weights[:, missed] * self._emitters.world(kind)[:, None])

    def _add_emission(self, light: Light, rays: Rays, met: Indices, points: Points, distance: Floats) -> None:
        radiance = self._palette.colour("emission", points)
        bright = np.flatnonzero(radiance.any(axis=0))
        met, points, distance = met[bright], points.at(bright), distance[bright]
        shared = self._emitters.surface_weight(
            rays.points.at(met), points, rays.direction[:, met], distance, rays.density[met], rays.kind
        )
        light.add(rays.place[met], rays.weight[:, met] * radiance[:, bright] * shared)

    def _scattered(self, light: Light, arrivals: Arrivals, depth: int, pixels: Indices, samples: Indices) -> list[Rays]:
        """Scatter paths for the depth-th time, and add the light of emitters on the way; the rays, by kind."""
        first = FILM + SCATTERING * (depth - 1)

        def numbers(which: Indices, dimension: int, count: int) -> Floats:
            path = arrivals.path[which]
            return self._sampler.numbers(pixels[path], samples[path], first + dimension, count)

        lobes = lobes_at(self._palette, arrivals.points, arrivals.direction)
        places = _places(arrivals, depth, light.count)
        if DIFFUSE in lobes and self._emitters.sampled("diffuse"):
            self._add_emitters(light, arrivals, lobes, places["diffuse"], numbers)
        everyone = np.arange(len(arrivals.path))
        chosen = lobes.chosen(numbers(everyone, _WAY, 1)[0] if len(lobes.ways) > 1 else np.zeros(len(everyone)))
        made = (self._rays(arrivals, lobes, chosen, kind, depth, places[kind], numbers) for kind in KINDS)
        return [rays for rays in made if rays is not None]

    def _add_emitters(self, light: Light, arrivals: Arrivals, lobes: Lobes, places: Indices, numbers: Numbers) -> None:
        """Add the light that diffuse surfaces get from one emitter for each path."""
        which = np.flatnonzero(lobes.share(DIFFUSE) > 0)
        points = arrivals.points.at(which)
        aimed = self._emitters.sample(points, numbers(which, _EMITTER, 3))
        factor = np.maximum(dot(points.shading, aimed.direction), 0.0) / np.pi
        factor[dot(points.normal, aimed.direction) <= 0] = 0.0
        shared = weight(aimed.pdf, lobes.share(DIFFUSE)[which] * factor)
        radiance = arrivals.weight[:, which] * lobes.colour(DIFFUSE)[:, which] * aimed.light * (factor * shared)
        bright = np.flatnonzero(radiance.any(axis=0))
        shadowed = bright[aimed.shadowed[bright]]
        blocked = self._space.blocked(points.at(shadowed), aimed.direction[:, shadowed], aimed.distance[shadowed])
        radiance[:, shadowed[blocked]] = 0.0
        light.add(places[which[bright]], radiance[:, bright])

    def _rays(
        self, arrivals: Arrivals, lobes: Lobes, chosen: Indices, kind: str, depth: int, places: Indices, numbers: Numbers
    ) -> Rays | None:
        """The rays of one kind that leave where paths have come to; None where none can bring anything."""
        which = lobes.of_kind(chosen, kind)
        counts = arrivals.counts[:, which]
        count = counts[list(KINDS).index(kind)]
        count += 1
        last = (count >= self._most_of[kind]) | (depth >= self._most)
        if not self._emitters.meets(kind):
            kept = np.flatnonzero(~last)
            which, counts, last = which[kept], counts[:, kept], last[kept]
        if not len(which):
            return None
        weights = arrivals.weight[:, which] * lobes.weights(chosen, which)
        points, direction = arrivals.points.at(which), arrivals.direction[:, which]
        density = np.full(len(which), np.inf)
        if kind == "diffuse":
            direction, density = scattering.cosine_direction(points.shading, numbers(which, _DIRECTION, 2))
            density *= lobes.share(DIFFUSE)[which]
        elif kind == "glossy":
            direction = scattering.reflected(direction, points.shading)
        else:
            direction, _ = scattering.refracted(direction, points.shading, lobes.ratio[which])
        # A smooth normal may send rays to the wrong side of the true surface: that light is lost, as in Cycles.
        kept = (dot(direction, points.normal) > 0) != (kind == "transmission")
        if depth > _CERTAIN:
            survival = np.where(last, 1.0, np.minimum(np.sqrt(weights.max(axis=0)), 1.0))
            kept &= numbers(which, _SURVIVAL, 1)[0] < survival
            weights /= np.where(survival > 0, survival, 1.0)
        if not kept.all():
            kept = np.flatnonzero(kept)
            which, weights, counts, last = which[kept], weights[:, kept], counts[:, kept], last[kept]
            points, direction, density = points.at(kept), direction[:, kept], density[kept]
        return Rays(kind, arrivals.path[which], places[which], weights, counts, direction, points, density, last)


def _places(arrivals: Arrivals, depth: int, count: int) -> dict[str, Indices]:
    """Where in the light of `count` paths that belongs which rays of each kind bring after the depth-th scattering."""
    if depth == 1:
        return {kind: arrivals.path + count * (DIRECT if kind == "diffuse" else OTHER) for kind in KINDS}
    was_direct = arrivals.place // count == DIRECT
    return dict.fromkeys(KINDS, arrivals.place + count * (INDIRECT - DIRECT) * was_direct)


def _joined(parts: list[Arrivals]) -> Arrivals | None:
    """All paths that go on, in one; None where none does."""
    parts = [part for part in parts if len(part.path)]
    if len(parts) < 2:
        return parts[0] if parts else None
    arrays = (
        np.concatenate([getattr(part, field.name) for part in parts], axis=-1)
        for field in fields(Arrivals)
        if field.name != "points"
    )
    return Arrivals(*arrays, Points.joined([part.points for part in parts]))
