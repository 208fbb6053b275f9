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

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Indices, Some, dot, gather, pick, some
from ..compiled.standing import or_compiled
from ..rays.points import Points, Surfaces
from ..rays.space import Space
from ..scene.film import Bounces
from . import scattering
from .arrivals import Arrivals, Rays, joined, places_of
from .emitters import Emitters, received
from .lobes import DIFFUSE, KINDS, Lobes, lobes_at
from .sampler import FILM, SCATTERING, Sampler
from .sums import BACKGROUND, COLOUR, DIRECT, EMITTED, INDIRECT, OTHER, Light
from .textures import Palette

# Which of a scattering's random numbers are for what.
_EMITTER, _DIRECTION, _WAY, _SURVIVAL = 0, 3, 5, 6
Numbers = Callable[[Some, int, int], Floats]
"""Random numbers (count, k) for some of the paths: which, the first dimension, how many dimensions."""

# Light may grow with every scattering by colours beyond 1; with no more than this, no square of it is infinite.
_MOST_WEIGHT = 1e40
# Scatterings before a path may be ended by chance. Sooner, it costs more noise than it saves time.
_CERTAIN = 3


class Paths:
    """Traces paths through one scene; any thread may.

    categories : of the light that they can bring.
    """

    def __init__(
        self,
        surfaces: Surfaces,
        space: Space,
        emitters: Emitters,
        palette: Palette,
        sampler: Sampler,
        bounces: Bounces,
        clip: tuple[float, float],
    ) -> None:
        self._surfaces, self._space, self._emitters, self._palette = surfaces, space, emitters, palette
        self._sampler, self._clip = sampler, clip
        self._specular_materials = palette.having("mirror") | palette.having("glass") | palette.having("refraction")
        self._specular = specular = bool(self._specular_materials.any())
        self._kinds = [*(["diffuse"] if palette.has("diffuse") else []), *(["glossy", "transmission"] if specular else [])]
        self._most = bounces.total + 1
        self._most_of = {kind: getattr(bounces, kind) + 1 for kind in KINDS}
        self._bright = surfaces.made_of(palette.having("emission"))
        self.categories = self._found()

    def _found(self) -> list[str]:
        emitters, palette = self._emitters, self._palette
        diffuse = palette.has("diffuse")
        onwards = self._most > 1
        found = {
            COLOUR: diffuse,
            EMITTED: emitters.meets("camera"),
            BACKGROUND: emitters.world("camera").any(),
            DIRECT: diffuse and emitters.lit,
            INDIRECT: diffuse and emitters.lit and onwards,
            OTHER: self._specular and emitters.lit,
        }
        return [category for category, there in found.items() if there]

    @property
    def random(self) -> bool:
        """Whether paths through the same point of the film may bring different light."""
        emitters, palette = self._emitters, self._palette
        if not emitters.lit:
            return False
        onwards = min(self._most, self._most_of["diffuse"]) > 1 or emitters.meets("diffuse")
        return palette.has("glass") or (palette.has("diffuse") and (emitters.random or onwards))

    def trace(
        self, pixels: Indices, samples: Indices, primitives: Indices, x: Floats, y: Floats, check: Callable[[], None]
    ) -> Light:
        """The light of n paths whose rays from the eye, (x, y, 1), meet primitives, −1 for none.

        pixels, samples : (n,) which random numbers each path has. check : called between scatterings.
        """
        check()
        light = Light(len(pixels), self.categories)
        arrivals = self._from_eye(light, primitives, x, y)
        depth = 0
        while arrivals is not None and self._emitters.lit:
            check()
            depth += 1
            rays = [rays for alike in self._apart(arrivals) for rays in self._scattered(light, alike, depth, pixels, samples)]
            arrivals = joined([self._arrived(light, some) for some in rays])
        return light

    def _apart(self, arrivals: Arrivals) -> list[Arrivals]:
        """Paths that have come to surfaces without mirrors and glass, which are less work, and the others."""
        if not self._specular:
            return [arrivals]
        specular = gather(self._specular_materials, arrivals.points.material)
        plain, others = arrivals.at(some(~specular)), arrivals.at(some(specular))
        plain.direction = None
        return [alike for alike in (plain, others) if alike.points.count]

    def _from_eye(self, light: Light, primitives: Indices, x: Floats, y: Floats) -> Arrivals | None:
        """What the eye's rays come to, and the passes that are of this alone."""
        np.greater_equal(primitives, 0, out=light.covered)
        met, emitters, palette = some(light.covered), self._emitters, self._palette
        points = self._surfaces.seen(pick(primitives, met), pick(x, met), pick(y, met))
        direction = None
        if self._specular or emitters.lamps_met_by("camera"):
            direction = np.stack([x, y, np.ones(len(x))])
            direction /= np.sqrt(dot(direction, direction))
        if palette.has("diffuse"):
            light.put(COLOUR, met, palette.colour("diffuse", points))
        if palette.has("emission"):
            light.put(EMITTED, met, palette.colour("emission", points))
        missed = np.flatnonzero(~light.covered)
        if BACKGROUND in light:
            light.put(BACKGROUND, missed, emitters.world("camera")[:, None])
        path = np.arange(light.count)
        if emitters.lamps_met_by("camera"):
            reach = np.full(light.count, np.inf)
            reach[met] = np.sqrt(dot(points.position, points.position))
            place = light.place(EMITTED) + path
            nearest, farthest = (depth / direction[2] for depth in self._clip)
            farthest = np.minimum(farthest, reach)
            light.add(place, emitters.lamps_met(np.zeros_like(direction), direction, nearest, farthest, "camera"))
            light.add(place[missed], emitters.suns_met(direction[:, missed], "camera"))
        if not points.count:
            return None
        counts = np.zeros((len(KINDS), points.count), np.int16) if len(self._kinds) > 1 else None
        return Arrivals(path[met], None, None, counts, pick(direction, met) if self._specular else None, points)

    def _scattered(self, light: Light, arrivals: Arrivals, depth: int, pixels: Indices, samples: Indices) -> list[Rays]:
        """Scatter paths for the depth-th time, and add the light of emitters on the way; the rays, by kind."""
        first = FILM + SCATTERING * (depth - 1)

        def numbers(which: Some, dimension: int, count: int) -> Floats:
            path = pick(arrivals.path, which)
            return self._sampler.numbers(gather(pixels, path), gather(samples, path), first + dimension, count)

        lobes = lobes_at(self._palette, arrivals.points, arrivals.direction)
        places = places_of(light, arrivals, depth)
        brightest = self._emitters.brightest(arrivals.points) if depth == 1 and self._emitters.asked else None
        if DIFFUSE in lobes and self._emitters.sampled("diffuse"):
            self._add_emitters(light, arrivals, lobes, places["diffuse"], numbers, brightest)
        leading = [kind for kind in self._kinds if self._leads_on(kind, depth)]
        if not leading:
            return []
        everyone = len(arrivals.path)
        chosen = lobes.chosen(numbers(slice(None), _WAY, 1)[0] if len(lobes.ways) > 1 else np.zeros(everyone))
        made = (
            self._rays(arrivals, lobes, chosen, kind, depth, places[kind], numbers, brightest)
            for kind in leading
            if lobes.leads_on(kind)
        )
        return [rays for rays in made if rays is not None]

    def _leads_on(self, kind: str, depth: int) -> bool:
        """Whether rays of a kind can bring anything after so many scatterings."""
        return depth < self._most or self._emitters.meets(kind)

    def _add_emitters(
        self, light: Light, arrivals: Arrivals, lobes: Lobes, places: Indices, numbers: Numbers, brightest: Floats | None
    ) -> None:
        """Add the light that diffuse surfaces get from one emitter for each path, or from every lamp: see `Emitters.sample`."""
        share = lobes.share(DIFFUSE)
        which = some(share > 0)
        points = arrivals.points.at(which)
        u = numbers(which, _EMITTER, 3) if self._emitters.random else np.zeros((3, points.count))
        asked = [None]
        if brightest is not None and self._emitters.count > 1:
            asked, brightest = range(self._emitters.count), pick(brightest, which)
        for lamp in asked:
            aimed = self._emitters.sample(points, u, lamp, brightest)
            factor, bright = received(points, aimed, pick(share, which), self._emitters.weighed)
            shadowed = points.at(bright), pick(aimed.direction, bright), pick(aimed.distance, bright)
            hidden = self._space.blocked(*shadowed) & pick(aimed.shadowed, bright)
            add_received(light, places, which, bright, hidden, aimed.light, factor, lobes.colour(DIFFUSE), arrivals.weight)

    def _rays(
        self,
        arrivals: Arrivals,
        lobes: Lobes,
        chosen: Indices,
        kind: str,
        depth: int,
        places: Indices,
        numbers: Numbers,
        brightest: Floats | None,
    ) -> Rays | None:
        """The rays of one kind that leave where paths have come to; None where none can bring anything.

        brightest : about what the brightest lamp brings to all points, where rays to the sky may be saved beside it.
        """
        which = lobes.of_kind(chosen, kind)
        counts, last = self._counted(arrivals, which, kind, depth)
        if not self._emitters.meets(kind) and last.any():
            which = np.arange(len(chosen))[which][~last]
            counts, last = self._counted(arrivals, which, kind, depth)
        chance = None
        if kind == "diffuse" and brightest is not None and last.all() and not self._emitters.lamps_met_by(kind):
            chance = self._emitters.sky_chance(pick(brightest, which), kind)
            sent = np.flatnonzero(numbers(which, _SURVIVAL, 1)[0] < chance)
            which, chance = np.arange(len(chosen))[which][sent], chance[sent]
            counts, last = self._counted(arrivals, which, kind, depth)
        points = arrivals.points.at(which)
        if not points.count:
            return None
        weights = lobes.weights(chosen, which, kind)
        if chance is not None:
            weights = _made_up_for(weights, chance)
        if arrivals.weight is not None:
            weights = np.minimum(weights * pick(arrivals.weight, which), _MOST_WEIGHT)
        if kind == "diffuse":
            direction, density = scattering.cosine_direction(points.shading, numbers(which, _DIRECTION, 2))
            density *= pick(lobes.share(DIFFUSE), which)
        else:
            normal, density = pick(lobes.normal, which), np.full(points.count, np.inf)
            incoming = pick(arrivals.direction, which)
            if kind == "glossy":
                direction = scattering.reflected(incoming, normal)
            else:
                direction, _ = scattering.refracted(incoming, normal, pick(lobes.ratio, which))
        # A smooth normal may send rays to the wrong side of the true surface: that light is lost, as in Cycles.
        kept = (dot(direction, points.normal) > 0) != (kind == "transmission")
        if depth > _CERTAIN:
            survival = np.where(last, 1.0, np.minimum(np.sqrt(weights.max(axis=0)), 1.0))
            kept &= numbers(which, _SURVIVAL, 1)[0] < survival
            weights = _made_up_for(weights, survival)
        which_kept = some(kept)
        return Rays(
            kind,
            pick(pick(arrivals.path, which), which_kept),
            pick(pick(places, which), which_kept),
            pick(weights, which_kept),
            None if counts is None else pick(counts, which_kept),
            pick(direction, which_kept),
            points.at(which_kept),
            pick(density, which_kept),
            pick(last, which_kept),
        )

    def _counted(
        self, arrivals: Arrivals, which: Some, kind: str, depth: int
    ) -> tuple[NDArray[np.int16] | None, NDArray[np.bool_]]:
        """The scatterings of paths with this one, and whether it was the last; of one kind alone these are all alike."""
        if arrivals.counts is None:
            return None, np.broadcast_to(depth >= min(self._most, self._most_of[kind]), arrivals.path[which].shape)
        counts = arrivals.counts[:, which].copy()
        count = counts[list(KINDS).index(kind)]
        count += 1
        return counts, (count >= self._most_of[kind]) | (depth >= self._most)

    def _arrived(self, light: Light, rays: Rays) -> Arrivals | None:
        """Where rays come to, but the last; adds what shines there."""
        emitters, shining = self._emitters, self._palette.has("emission")
        world = emitters.world(rays.kind)
        lamps_met = emitters.lamps_met_by(rays.kind)
        if not shining and not lamps_met and rays.last.all():
            escaped = self._space.escaped(rays.points, rays.direction, rays.kind)
            light.add(gather(rays.place, escaped), pick(rays.weight, escaped) * world[:, None])
            return None
        found = self._space.found(rays.points, rays.direction, rays.kind)
        if world.any():
            escaped = np.flatnonzero(found < 0)
            light.add(gather(rays.place, escaped), pick(rays.weight, escaped) * world[:, None])
        asked = found >= 0
        if not lamps_met and rays.last.any():
            asked &= gather(self._bright, found) | ~rays.last
        met = np.flatnonzero(asked)
        points, distance = self._space.met(found, rays.points, rays.direction, met)
        if lamps_met:
            reach = np.full(len(rays.path), np.inf)
            reach[met] = distance
            missed = np.flatnonzero(found < 0)
            seen = emitters.lamps_met(rays.points.position, rays.direction, 0.0, reach, rays.kind)
            seen[:, missed] += emitters.suns_met(gather(rays.direction, missed), rays.kind)
            light.add(rays.place, rays.weight * seen)
        if shining:
            self._add_emission(light, rays, met, points, distance)
        if rays.last.any():
            onwards = np.flatnonzero(~rays.last[met])
            met, points = met[onwards], points.at(onwards)
        if not len(met):
            return None
        return Arrivals(
            gather(rays.path, met),
            gather(rays.place, met),
            pick(rays.weight, met),
            None if rays.counts is None else gather(rays.counts, met),
            gather(rays.direction, met) if self._specular else None,
            points,
        )

    def _add_emission(self, light: Light, rays: Rays, met: Indices, points: Points, distance: Floats) -> None:
        """Add what shines where rays come to, less what shadow rays were to find there."""
        radiance = self._palette.colour("emission", points)
        bright = np.flatnonzero(radiance.any(axis=0))
        met, points, distance = met[bright], points.at(bright), distance[bright]
        shared = self._emitters.surface_weight(
            rays.points.at(met), points, gather(rays.direction, met), distance, pick(rays.density, met), rays.kind
        )
        light.add(gather(rays.place, met), pick(rays.weight, met) * gather(radiance, bright) * shared)


@or_compiled
def add_received(
    light: Light,
    places: Indices,
    which: Some,
    bright: Some,
    hidden: NDArray[np.bool_],
    radiance: Floats,
    factor: Floats,
    colour: Floats,
    weight: Floats | None,
) -> None:
    """Add what diffuse surfaces send on of the light of emitters that nothing hides.

    places, colour, weight : of all paths. which : of these, those that have radiance, (3, n), times factor, (n,). bright :
    which of those may be lit. hidden : of these, which are not.
    """
    bright = np.arange(len(factor))[bright][~hidden]
    which = bright if isinstance(which, slice) else gather(which, bright)
    brought = gather(radiance, bright)
    brought *= gather(factor, bright)
    brought *= gather(colour, which)
    if weight is not None:
        brought *= gather(weight, which)
    light.add(gather(places, which), brought)


def _made_up_for(weights: Floats, survival: Floats) -> Floats:
    """The weights of paths that went on by this chance: they stand for those that did not."""
    return weights / np.where(survival > 0, survival, 1.0)
