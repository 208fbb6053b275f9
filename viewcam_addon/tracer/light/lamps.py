"""The lamps of a scene, numbered kind after kind: how they light points, and what rays see that run into them.

Lamps block no ray, as in Cycles: a ray sees all that it runs through.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Indices, dot, gather
from ..rays.view import View
from ..scene.lamps import Area, Lamp, Point, Spot, Sun
from .bulbs import Bulbs, Sampled, Suns, entries, replace
from .plates import Ellipses, Rectangles

# More light than any picture holds, less than makes products overflow.
MOST = 1e100
# Rays at a time: their arrays stay in a core's cache.
_RAYS = 4096
# For more lamps it pays to ask first which of them such a beam of rays can reach.
_MANY = 16
_BALL = 1e-12  # of a squared distance: the roundings of it and of what is subtracted
_ROUNDING = 1e-6  # of angles: the arc cosine of 1 − 2⁻⁵³ is 1e-8

Table = Suns | Bulbs | Rectangles | Ellipses
_KINDS = (
    (Suns, lambda lamp: isinstance(lamp, Sun)),
    (Bulbs, lambda lamp: isinstance(lamp, Point | Spot)),
    (Rectangles, lambda lamp: isinstance(lamp, Area) and not lamp.ellipse),
    (Ellipses, lambda lamp: isinstance(lamp, Area) and lamp.ellipse),
)


class Lamps:
    """Lamps of all kinds, numbered kind after kind.

    shadowed : (k,) bool, whether they cast shadows. with_size : (k,) bool, whether rays can run into them. sized : whether they
    can into any.
    """

    def __init__(self, lamps: Sequence[Lamp], view: View) -> None:
        self.tables, self.firsts, shadowed = [], [], []
        for table, belongs in _KINDS:
            some = [lamp for lamp in lamps if belongs(lamp)]
            if some:
                self.tables.append(table(some, view))
                self.firsts.append(len(shadowed))
                shadowed += [lamp.casts_shadow for lamp in some]
        self.shadowed = np.array(shadowed, bool)
        self.count = len(shadowed)
        self.with_size = np.concatenate([np.zeros(0, bool), *(table.sized for table in self.tables)])
        self.sized = bool(self.with_size.any())

    def sample(self, which: Indices, position: Floats, shading: Floats, u: Floats) -> Sampled:
        """Directions, distances, and radiances over densities, of one lamp for each point."""
        if len(self.tables) == 1:
            return self._sample(self.tables[0], which, position, shading, u)
        found = np.empty((3, len(which))), np.empty(len(which)), np.empty((3, len(which)))
        for table, first in zip(self.tables, self.firsts, strict=True):
            some = np.flatnonzero((which >= first) & (which < first + table.colours.shape[1]))
            asked = (gather(values, some) for values in (which - first, position, shading, u))
            replace(found, some, self._sample(table, *asked))
        return found

    @staticmethod
    def _sample(table: Table, which: Indices, position: Floats, shading: Floats, u: Floats) -> Sampled:
        direction, distance, factor = table.sample(which, position, shading, u)
        return direction, distance, entries(table.colours, which) * np.minimum(factor, MOST)

    def estimate(self, lamp: int, position: Floats, normal: Floats) -> Floats:
        """(n,): about how much a lamp brings to points, 0 only where it brings nothing."""
        kind = np.searchsorted(self.firsts, lamp, side="right") - 1
        return self.tables[kind].estimate(lamp - self.firsts[kind], position, normal)

    def powers(self, extent: float) -> Floats:
        """(k,), of suns what falls on a scene as large as this."""
        powers = [
            table.colours.mean(axis=0) * (4 * np.pi * extent**2 if isinstance(table, Suns) else 1.0) for table in self.tables
        ]
        return np.concatenate([np.empty(0), *powers])

    def met(self, starts: Floats, directions: Floats, nearest: Floats, farthest: Floats) -> Floats:
        """As `Emitters.lamps_met`."""
        count = directions.shape[1]
        light = np.zeros((3, count))
        starts, nearest, farthest = (
            np.broadcast_to(values, (*np.shape(values)[:-1], count)) for values in (starts, nearest, farthest)
        )
        tables = [table for table in self.tables if not isinstance(table, Suns) and table.sized.any()]
        are_many = sum(len(table.sized) for table in tables) > _MANY
        for first in range(0, count if tables else 0, _RAYS):
            part = slice(first, first + _RAYS)
            rays = [values[..., part] for values in (starts, directions, nearest, farthest)]
            beam = _Beam(*rays[:2]) if are_many else None
            for table in tables:
                seen = table.sized if beam is None else table.sized & beam.reaches(table.centres, table.reach)
                for lamp in np.flatnonzero(seen):
                    _add_lamp(light[:, part], table, lamp, *rays)
        return light

    def suns_met(self, directions: Floats) -> Floats:
        """As `Emitters.suns_met`."""
        light = np.zeros_like(directions)
        for table in self.tables:
            if isinstance(table, Suns):
                for lamp in np.flatnonzero(table.sized):
                    light += table.colours[:, lamp, None] * table.met(lamp, directions)
        return light


def _add_lamp(
    light: Floats, table: Table, lamp: int, starts: Floats, directions: Floats, nearest: Floats, farthest: Floats
) -> None:
    """Add what rays see of a lamp. Most pass by it so far off that a ball round it tells."""
    way = table.centres[:, lamp, None] - starts
    along, squared = dot(way, directions), dot(way, way)
    reach = table.reach[lamp] ** 2
    close = (squared * (1 - _BALL) - along * along <= reach) & ((along > 0) | (squared <= reach))
    close = np.flatnonzero(close)
    if len(close):
        factors = table.met(lamp, *(gather(values, close) for values in (starts, directions, nearest, farthest)))
        light[:, close] += table.colours[:, lamp, None] * factors


class _Beam:
    """A ball and a cone that hold the starts and the directions of rays."""

    def __init__(self, starts: Floats, directions: Floats) -> None:
        least, greatest = starts.min(axis=1), starts.max(axis=1)
        self._middle, self._radius = (least + greatest) / 2, float(np.linalg.norm(greatest - least)) / 2
        axis = directions.sum(axis=1)
        length = float(np.linalg.norm(axis))
        self._axis = axis / length if length > 0 else np.array([0.0, 0.0, 1.0])
        self._opening = float(np.arccos(np.clip(dot(self._axis, directions).min(), -1.0, 1.0))) + _ROUNDING

    def reaches(self, centres: Floats, reach: Floats) -> NDArray[np.bool_]:
        """(k,) whether any of the rays can come within `reach` of the centres, (3, k)."""
        way = centres - self._middle[:, None]
        distance = np.sqrt(dot(way, way))
        reach = reach + self._radius
        with np.errstate(divide="ignore", invalid="ignore"):
            aside = np.arccos(np.clip(dot(self._axis, way) / distance, -1.0, 1.0)) - np.arcsin(
                np.minimum(reach / distance, 1.0)
            )
        return (distance <= reach * (1 + _ROUNDING)) | (aside <= self._opening)
