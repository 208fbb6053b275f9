"""Where paths have come to, and the rays that leave there."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Indices, Some, pick
from ..rays.points import Points
from .lobes import KINDS
from .sums import DIRECT, INDIRECT, OTHER, Light


@dataclass(slots=True)
class Arrivals:
    """Where k paths have come to.

    path : which of the batch's paths. place : where in `Light` that which they bring belongs, or None for the eye's own rays.
    weight : (3, k) how much of the light from there reaches the eye, or None where all does. counts : (kinds, k) scatterings
    so far, or None where there is but one kind. direction : (3, k), unit, in which they came, or None where nobody asks.
    """

    path: Indices
    place: Indices | None
    weight: Floats | None
    counts: NDArray[np.int16] | None
    direction: Floats | None
    points: Points

    def at(self, which: Some) -> "Arrivals":
        """Some of them."""
        given = (self.path, self.place, self.weight, self.counts, self.direction)
        return Arrivals(*(None if values is None else pick(values, which) for values in given), self.points.at(which))


@dataclass(slots=True)
class Rays:
    """k rays of one kind that leave `points`. density : (k,) of the direction's choice, per solid angle, infinite for mirrors.

    last : (k,) whether only what shines where they come to counts. The rest as in `Arrivals`.
    """

    kind: str
    path: Indices
    place: Indices
    weight: Floats
    counts: NDArray[np.int16] | None
    direction: Floats
    points: Points
    density: Floats
    last: NDArray[np.bool_]


def places_of(light: Light, arrivals: Arrivals, depth: int) -> dict[str, Indices]:
    """Where that belongs which rays of each kind bring after the depth-th scattering."""
    if arrivals.place is None:
        categories = {"diffuse": DIRECT, "glossy": OTHER, "transmission": OTHER}
        return {kind: arrivals.path + light.place(category) for kind, category in categories.items() if category in light}
    if depth > 2 or DIRECT not in light:
        return dict.fromkeys(KINDS, arrivals.place)
    was_direct = (arrivals.place >= light.place(DIRECT)) & (arrivals.place < light.place(DIRECT) + light.count)
    return dict.fromkeys(KINDS, arrivals.place + was_direct * (light.place(INDIRECT) - light.place(DIRECT)))


def joined(parts: list[Arrivals | None]) -> Arrivals | None:
    """All paths that go on, in one; None where none does."""
    parts = [part for part in parts if part is not None]
    if len(parts) < 2:
        return parts[0] if parts else None
    arrays = (
        np.concatenate([getattr(part, field.name) for part in parts], axis=-1)
        for field in fields(Arrivals)
        if field.name != "points"
    )
    return Arrivals(*arrays, Points.joined([part.points for part in parts]))
