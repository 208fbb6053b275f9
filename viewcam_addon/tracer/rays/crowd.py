"""Which of many spheres a ray from anywhere meets: Embree's answer, corrected in float64.

The few largest are tested by all rays: a ground that is a huge sphere would else stand in every ray's way. Each other one hides
in an octahedron. Wherever a ray crosses one's faces, its sphere is tested in float64, and the ray goes on behind that crossing
by a step that float32 can tell. It enters and leaves each octahedron, so that a sphere is overlooked only if steps skip both;
octahedra differ in size, so that those of spheres that touch or coincide don't share their faces. Of those that hold the start
only the way out is crossed: a ray goes on that far even if it has met something.

Without Embree all rays test all spheres.

Rejected: cards, as for eye rays (visibility.py), which need rays from one point; boxes, which more rays cross in vain than
octahedra; icosahedra, which have two and a half times as many faces for a fifth fewer such rays.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Indices, gather
from ..compiled.standing import or_compiled
from .balls import Balls
from .embree import EmbreeScene, embree_scene, rows

_FEW = 4

_STEP = 2.0**-20  # of a coordinate: eight roundings of float32 of a start and of a crossing
_LEAST = 2.0**-17  # of a coordinate: how far octahedra reach beyond their spheres at least, so that both crossings are apart
_SPREAD = 2.0**-5  # of their size: by how much octahedra differ
_GOLDEN = 0.618033988749895
_FAR = 1e37

Hits = tuple[Indices, Indices, Floats]
"""Which spheres, or which one, which rays meet them, and how far off."""


@or_compiled
def crowd_of(balls: Balls, visible: NDArray[np.bool_], unit: float) -> "Crowd":
    """Some of the spheres; the arguments are those of `Crowd`."""
    return Crowd(balls, visible, unit)


class Crowd:
    """Some of the spheres.

    visible : (n,) bool, which of the balls. unit : Embree's units in one of the world.
    """

    def __init__(self, balls: Balls, visible: NDArray[np.bool_], unit: float) -> None:
        self._balls, self._unit = balls, unit
        chosen = np.flatnonzero(visible)
        chosen = chosen[np.argsort(-balls.reach[chosen], kind="stable")]
        few = len(chosen) if EmbreeScene is None else _FEW
        self._few, self._many = chosen[:few], chosen[few:]
        if len(self._many):
            self._embree = self._octahedra()

    @property
    def is_empty(self) -> bool:
        return not len(self._few)

    def _octahedra(self) -> "EmbreeScene":
        axes, centres = gather(self._balls.axes, self._many), gather(self._balls.centres, self._many)
        lengths = np.sqrt((axes * axes).sum(axis=1))
        margin = _LEAST * (np.abs(centres).max(axis=0) + lengths.max(axis=0))
        size = np.sqrt(3) * (1 + _SPREAD * (self._many * _GOLDEN % 1)) * (1 + margin / lengths)
        self._widest = 2 * float((lengths * size).max())
        axes *= size[:, None]
        tips = np.stack([centres + sign * axis for axis in axes for sign in (-1, 1)])  # (6, 3, n)
        faces = np.array([[x, 2 + y, 4 + z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
        corners = faces + 6 * np.arange(len(self._many))[:, None, None]
        return embree_scene(tips.transpose(2, 0, 1).reshape(-1, 3) * self._unit, corners.reshape(-1, 3).astype(np.int32))

    def met(self, starts: Floats, directions: Floats, leaving: Indices, limits: Floats) -> Iterator[Hits]:
        """Spheres that n rays meet, in no order, those that are nearer than `limits` surely.

        starts, directions : (3, n), camera space, unit. leaving : (n,), the numbers of the spheres that the rays leave.
        limits : (n,), read anew before each answer: they may shrink, to 0 where nothing more is asked.
        """
        for ball in self._few:
            which = self._balls.near(ball, starts, directions, limits)
            which = which[leaving[which] != self._balls.number[ball]]
            yield ball, which, self._balls.distance(ball, gather(starts, which), gather(directions, which))
        if len(self._many):
            yield from self._many_met(starts, directions, leaving, limits)

    def any(self, starts: Floats, directions: Floats, leaving: Indices, limits: Floats) -> NDArray[np.bool_]:
        """Whether rays meet any sphere nearer than `limits`, (n,); as `met`, but that limits stay as they are."""
        met, limits = np.zeros(len(limits), bool), limits.copy()
        for _, which, distance in self.met(starts, directions, leaving, limits):
            which = which[distance < limits[which]]
            met[which], limits[which] = True, 0.0
        return met

    def _many_met(self, starts: Floats, directions: Floats, leaving: Indices, limits: Floats) -> Iterator[Hits]:
        rays = np.flatnonzero(limits > 0)
        gone, beyond = np.zeros(len(rays)), self._beyond(limits[rays])
        while len(rays):
            ways = gather(directions, rays)
            origins = gather(starts, rays) + gone * ways
            ahead = np.minimum((beyond - gone) * self._unit, _FAR).astype(np.float32)
            crossed = self._embree.run(rows(origins * self._unit), rows(ways), dists=ahead, output=1)
            on = np.flatnonzero(crossed["primID"] >= 0)
            rays, gone = rays[on], gone[on]
            ball = self._many[crossed["primID"][on] >> 3]
            distance = self._balls.distance(ball, gather(starts, rays), gather(ways, on))
            distance[leaving[rays] == self._balls.number[ball]] = np.inf
            yield ball, rays, distance
            gone = gone + crossed["tfar"][on] / self._unit
            gone += _STEP * (np.abs(gather(origins, on)).max(axis=0) + gone)
            beyond = self._beyond(limits[rays])
            further = np.flatnonzero(gone < beyond)
            rays, gone, beyond = rays[further], gone[further], beyond[further]

    def _beyond(self, limits: Floats) -> Floats:
        """How far rays go on. An octahedron that holds the start is left within `_widest`, be there a nearer hit or not."""
        return np.where(limits > 0, np.maximum(limits, self._widest), 0.0)
