"""What gives light, and which of it a point is lit by: lamps, surfaces that shine, and the world.

A point gets the light of one emitter, chosen at random, divided by the chance that it had. Of a few emitters the chance is in
proportion to what each may bring to that point; of many it is the same everywhere, half of it by power and half alike for all,
so that what is weak but near gets its share.

Where the eye sees points in the light of very few lamps, that choice is most of the noise: there each lamp is asked by itself,
the brightest at every sample, and others as often as what they may bring is worth it. The sky, too, is then asked no more often
than that. In a field of spheres under three lamps and a sky that makes half the noise in the same time.

Lamps are sampled by solid angle (bulbs.py, plates.py), which is bounded, so that rays scattered by diffuse surfaces need not
look for them. Surfaces that shine are found both ways, weighted by Veach's power heuristic. The world, the same everywhere, is
found best by rays that are scattered: none are aimed at it.

Rejected: a tree of lights (Conty and Kulla, 2018), whose every level is a random choice in Python.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Indices, Some, dot, gather, some
from ..compiled.standing import or_compiled
from ..rays.points import Points, Surfaces
from ..rays.view import View
from ..scene import Scene
from ..scene.lamps import RAYS, Lamp
from .bulbs import replace
from .glowing import Glowing
from .lamps import Lamps
from .textures import Palette

# For so many the chances are computed at each point; each takes a tenth of the time of a shadow ray among few triangles.
_FEW = 32
# So many lamps are asked one by one where the eye sees points. A light has every sample that may bring this part of what the
# brightest may, and one that brings less is left out of samples: half as many of both take as long for the same error.
_ASKED, _WORTH = 4, 0.25
# A smaller chance than one over this comes never.
LONGEST_ODDS = 1e80
# Points at a time. Twice as many gain nothing, half as many cost 3 % in calls of NumPy.
_POINTS = 32768
BELOW_1 = 1 - 2.0**-53


class Aimed(NamedTuple):
    """Where n points look for light, and what they get from there if nothing is in between.

    direction : (3, n), unit. distance : (n,), inf for suns. light : (3, n), radiance over density. pdf : (n,), the density by
    solid angle, inf for lamps, which scattered rays do not find. shadowed : (n,) bool, whether things can be in between.
    """

    direction: Floats
    distance: Floats
    light: Floats
    pdf: Floats
    shadowed: NDArray[np.bool_]


def weight(pdf: Floats, other: Floats) -> Floats:
    """The part that counts of a sample whose direction was picked with the density `pdf`, where another way of picking has the
    density `other`. An infinite pdf counts whole."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ratio = np.fmax(np.divide(other, pdf), 0.0)  # 0 where neither way finds anything
        return 1.0 / (1.0 + ratio * ratio)


class Emitters:
    """All that gives light in a scene, in camera space.

    lit : whether anything does.
    """

    def __init__(self, scene: Scene, view: View, surfaces: Surfaces, palette: Palette) -> None:
        lamps = [lamp for lamp in scene.lamps if not lamp.is_dark]
        self._world = scene.world
        self._shines = palette.has("emission")
        self.lit = bool(lamps) or self._shines or any(scene.world.radiance)
        seen = _seen_by_kind(lamps, view)
        self.lamps, self._met = seen.pop("diffuse"), seen
        self.glowing = Glowing(scene, surfaces, palette)
        self.count = self.lamps.count + self.glowing.count
        self.shadowed = np.append(self.lamps.shadowed, np.ones(self.glowing.count, bool))
        self.chances = self._fixed_chances(_extent(surfaces)) if self.count > _FEW else None
        self.rows: Floats | None = None  # what the kernel makes of all emitters, at its first use
        self.reached = None if self.chances is None else np.append(self.chances.cumsum()[:-1], 1.0)

    def sampled(self, kind: str) -> bool:
        """Whether there is anything that `sample` finds for surfaces that scatter this kind of rays: diffuse ones only."""
        return kind == "diffuse" and self.count > 0

    @property
    def random(self) -> bool:
        """Whether what `sample` finds depends on its numbers: there are several emitters, or one that has a size."""
        return self.count > 1 or self.lamps.sized or self.glowing.count > 0

    @property
    def weighed(self) -> bool:
        """Whether rays that are scattered may find what `sample` finds, too, so that each counts in part."""
        return self.glowing.count > 0

    def lamps_met_by(self, kind: str) -> bool:
        """Whether rays of this kind can run into lamps."""
        return kind in self._met and self._met[kind].sized

    def meets(self, kind: str) -> bool:
        """Whether rays of this kind can run into light."""
        return self._shines or bool(self.world(kind).any()) or self.lamps_met_by(kind)

    @property
    def asked(self) -> bool:
        """Whether lamps and the sky are asked one by one where the eye sees points."""
        several = self.count > 1 or any(self._world.radiance)
        return several and 0 < self.count <= _ASKED and not self.glowing.count

    def brightest(self, points: Points) -> Floats:
        """(n,): about how much that lamp brings to each point which brings most."""
        return brightest_of(self, points)

    def sky_chance(self, brightest: Floats, kind: str) -> Floats:
        """(n,): how often the sky is worth a ray where lamps bring as much as `brightest` tells."""
        with np.errstate(divide="ignore"):
            return np.minimum(np.pi / _WORTH * self.world(kind).mean() / brightest, 1.0)

    def worth(self, lamp: int) -> float:
        """The part of the brightest that a lamp has to bring to be asked always. One without a size has no noise of its own."""
        return _WORTH if self.lamps.with_size[lamp] else 0.0

    def sample(self, points: Points, u: Floats, lamp: int | None = None, brightest: Floats | None = None) -> Aimed:
        """One emitter for each of n points, and a direction to it. u : (3, n) in [0, 1): which emitter, and where on it.

        lamp : this one, but only as often as it is worth it beside the brightest; the direction is 0 where it is left out.
        """
        return aimed(self, points, u, lamp, brightest)

    def aim(self, points: Points, u: Floats, lamp: int | None, brightest: Floats | None) -> Aimed:
        """`sample` of points that are no more than arrays fit into a core's cache."""
        if lamp is not None and brightest is not None:
            return self._aim_at(lamp, points, u, brightest)
        which, odds, rest = self._choose(points, u[0])
        position, shading, first = points.position, points.shading, self.lamps.count
        pdf = np.broadcast_to(np.inf, points.count)
        if not self.glowing.count:
            direction, distance, light = self.lamps.sample(which, position, shading, u[1:])
        elif not first:
            direction, distance, light, pdf = self.glowing.sample(which, position, rest, u[1:])
        else:
            found = np.empty((3, points.count)), np.empty(points.count), np.empty((3, points.count)), pdf.copy()
            of_glowing = which >= first
            some = np.flatnonzero(~of_glowing)
            here = gather(position, some), gather(shading, some)
            replace(found[:3], some, self.lamps.sample(gather(which, some), *here, gather(u[1:], some)))
            some = np.flatnonzero(of_glowing)
            asked = gather(which, some) - first, gather(position, some), gather(rest, some), gather(u[1:], some)
            replace(found, some, self.glowing.sample(*asked))
            direction, distance, light, pdf = found
        if self.count > 1:
            light *= odds
            if self.glowing.count:
                pdf = np.where(odds > 0, pdf / odds, np.inf)
        shadowed = np.broadcast_to(True, points.count) if self.shadowed.all() else gather(self.shadowed, which)
        return Aimed(direction, distance, light, pdf, shadowed)

    def _aim_at(self, lamp: int, points: Points, u: Floats, brightest: Floats) -> Aimed:
        """One lamp, where chance does not leave it out."""
        estimate = self.lamps.estimate(lamp, points.position, points.normal)
        chance = np.minimum(estimate / (brightest * self.worth(lamp)), 1.0)
        odds = np.where(u[0] < chance, np.minimum(1.0 / chance, LONGEST_ODDS), 0.0)
        which = np.full(points.count, lamp)
        direction, distance, light = self.lamps.sample(which, points.position, points.shading, u[1:])
        shadowed = np.broadcast_to(self.shadowed[lamp], points.count)
        there = odds > 0
        return Aimed(
            np.where(there, direction, 0.0),
            np.where(there, distance, 1.0),
            np.where(there, light * odds, 0.0),
            np.broadcast_to(np.inf, points.count),
            shadowed,
        )

    def _choose(self, points: Points, u: Floats) -> tuple[Indices, Floats, Floats]:
        """Which emitter each point gets, one over the chance that it had, or 0 where none lights it, and what is left of u."""
        if self.count == 1:
            return np.zeros(len(u), np.intp), np.ones(len(u)), u
        if self.chances is not None:
            which = np.searchsorted(self.reached, u, side="right")
            chance = gather(self.chances, which)
            before = gather(self.reached, which) - chance
            return which, 1 / chance, np.clip((u - before) / chance, 0.0, BELOW_1)
        share, *others = self._estimates(points)
        total = sum(others, start=share)
        wanted = u * total
        which, before, reached = np.zeros(len(u), np.intp), 0.0, share
        for estimate in others:
            beyond = wanted >= reached
            which += beyond
            share, before = np.where(beyond, estimate, share), np.where(beyond, reached, before)
            reached = reached + estimate
        odds = np.where(share > 0, np.minimum(total / share, LONGEST_ODDS), 0.0)
        return which, odds, np.fmin((wanted - before) / share, BELOW_1) if self.glowing.count else u

    def _estimates(self, points: Points) -> list[Floats]:
        """(n,) each: about how much each emitter brings to points."""
        at = points.position, points.normal
        lamps = [self.lamps.estimate(lamp, *at) for lamp in range(self.lamps.count)]
        return lamps + [self.glowing.estimate(number, *at) for number in range(self.glowing.count)]

    def _fixed_chances(self, extent: float) -> Floats:
        """(k,) chances of the emitters."""
        powers = np.concatenate([self.lamps.powers(extent), self.glowing.powers()])
        return 0.5 * powers / powers.sum() + 0.5 / self.count

    def lamps_met(self, starts: Floats, directions: Floats, nearest: Floats, farthest: Floats, kind: str) -> Floats:
        """(3, n), the radiance of all lamps that have a size, without suns, and that rays run through.

        starts, directions : (3, n), camera space, directions of unit length. nearest, farthest : distances, (n,) or one.
        """
        return self._met[kind].met(starts, directions, nearest, farthest) if kind in self._met else np.zeros_like(directions)

    def suns_met(self, directions: Floats, kind: str) -> Floats:
        """(3, n), the radiance of suns that rays see which meet nothing."""
        return self._met[kind].suns_met(directions) if kind in self._met else np.zeros_like(directions)

    def world(self, kind: str) -> Floats:
        """(3,), the radiance that rays see which meet nothing."""
        return np.zeros(3) if kind in self._world.hidden_from else np.array(self._world.radiance)

    def surface_weight(
        self, starts: Points, met: Points, directions: Floats, distance: Floats, scattered_pdf: Floats, kind: str
    ) -> Floats:
        """(n,), the part that counts of the light of surfaces that scattered rays run into.

        starts, met : from where to where. directions, distance : of the way. scattered_pdf : the rays' density.
        """
        if kind != "diffuse" or not self.glowing.count:
            return np.ones(met.count)
        density = self.glowing.density(met, directions, distance)
        owner = self.lamps.count + gather(self.glowing.owner, met.primitive)
        if self.chances is not None:
            density *= gather(self.chances, owner)
        elif self.count > 1:
            with np.errstate(divide="ignore", invalid="ignore"):
                estimates = self._estimates(starts)
                chosen = np.choose(owner, estimates, mode="clip") if self.glowing.count > 1 else estimates[-1]
                density *= np.fmax(chosen / sum(estimates), 0.0)
        return weight(scattered_pdf, density)


@or_compiled
def brightest_of(emitters: Emitters, points: Points) -> Floats:
    """As `Emitters.brightest`."""
    return np.maximum.reduce([emitters.lamps.estimate(lamp, points.position, points.normal) for lamp in range(emitters.count)])


@or_compiled
def aimed(emitters: Emitters, points: Points, u: Floats, lamp: int | None = None, brightest: Floats | None = None) -> Aimed:
    """As `Emitters.sample`."""
    parts = [slice(first, first + _POINTS) for first in range(0, max(points.count, 1), _POINTS)]
    with np.errstate(divide="ignore", invalid="ignore"):
        found = [
            emitters.aim(points.at(part), u[:, part], lamp, None if brightest is None else brightest[part]) for part in parts
        ]
    return found[0] if len(found) == 1 else Aimed(*(np.concatenate(values, axis=-1) for values in zip(*found, strict=True)))


@or_compiled
def received(points: Points, aimed: Aimed, share: Floats, weighed: bool) -> tuple[Floats, Some]:
    """What white diffuse surfaces send on of the light that they get, (n,), and at which of them there is any.

    share : (n,) how often paths are scattered diffusely. weighed : whether scattered rays may find that light, too.
    """
    factor = dot(points.shading, aimed.direction) / np.pi
    up = factor > 0
    if points.shading is not points.normal:
        up &= dot(points.normal, aimed.direction) > 0
    if weighed:
        factor *= weight(aimed.pdf, share * factor)
    return factor, some(up)


def _extent(surfaces: Surfaces) -> float:
    """Half the diagonal of a box round all surfaces, or 1 where there are none."""
    balls = surfaces.balls
    reach = np.abs(balls.axes).sum(axis=0)
    places = np.concatenate([surfaces.triangles.vertices, balls.centres - reach, balls.centres + reach], axis=1)
    return float(np.linalg.norm(np.ptp(places, axis=1))) / 2 or 1.0 if places.shape[1] else 1.0


def _seen_by_kind(lamps: Sequence[Lamp], view: View) -> dict[str, Lamps]:
    """The lamps that each kind of ray sees; one table where several see the same."""
    made: dict[tuple[int, ...], Lamps] = {}
    seen = {}
    for kind in RAYS[:-1]:
        some = [lamp for lamp in lamps if kind not in lamp.hidden_from]
        key = tuple(map(id, some))
        seen[kind] = made[key] = made.get(key) or Lamps(some, view)
    return seen
