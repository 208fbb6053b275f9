"""The ways in which light leaves a point of a surface, and how often a path takes each.

A path goes one way only, chosen in proportion to the ways' colours, and its weight is divided by that share: where there is one
way, it is taken and nothing is random. Glass is two ways, shared out by Fresnel's equations.
"""

from dataclasses import dataclass

import numpy as np

from . import scattering
from .arrays import Floats, Indices, dot
from .points import Points
from .textures import Palette

DIFFUSE, MIRROR, REFLECTED, GLASS, REFRACTED = range(5)
"""Lambert's; a mirror's; what glass reflects and what it lets in; what plain refraction lets in."""
KINDS = {"diffuse": (DIFFUSE,), "glossy": (MIRROR, REFLECTED), "transmission": (GLASS, REFRACTED)}
"""The kind of ray that each way makes, by which objects and lamps hide and by which bounces are counted."""


@dataclass(frozen=True, eq=False)
class Lobes:
    """The ways at n points.

    ways : which of them the scene has. colours : (ways, 3, n) the part of the light that takes each. shares : (ways, n)
    how often a path does; their sum is 1, or 0 where none leads on. ratio : (n,) the index of refraction beyond the surface
    over that before it, or None where the scene has no glass.
    """

    ways: list[int]
    colours: Floats
    shares: Floats
    ratio: Floats | None

    def __contains__(self, way: int) -> bool:
        return way in self.ways

    def colour(self, way: int) -> Floats:
        return self.colours[self.ways.index(way)]

    def share(self, way: int) -> Floats:
        return self.shares[self.ways.index(way)]

    def chosen(self, u: Floats) -> Indices:
        """(n,) the place in `ways` of the way that each path takes, −1 where none leads on. u : (n,) in [0, 1), or 0."""
        reached = self.shares.cumsum(axis=0)
        # The last way that has a share, where the sum is rounded to less than u.
        chosen = (u >= reached).sum(axis=0)
        last = len(self.ways) - 1 - (self.shares[::-1] > 0).argmax(axis=0)
        return np.where(reached[-1] > 0, np.minimum(chosen, last), -1)

    def of_kind(self, chosen: Indices, kind: str) -> Indices:
        """Which of the points are left by rays of a kind."""
        places = [place for place, way in enumerate(self.ways) if way in KINDS[kind]]
        return np.flatnonzero(np.isin(chosen, places)) if places else np.empty(0, np.intp)

    def weights(self, chosen: Indices, which: Indices) -> Floats:
        """(3, k): what becomes of the light that comes to some of the points by the ways that were chosen."""
        places = chosen[which]
        return self.colours[places, :, which].T / self.shares[places, which]


def lobes_at(palette: Palette, points: Points, direction: Floats) -> Lobes:
    """The ways of paths that come to points along (3, n) unit directions."""
    found: dict[int, Floats] = {}
    ratio = None
    if palette.has("diffuse"):
        found[DIFFUSE] = palette.colour("diffuse", points)
    if palette.has("mirror"):
        found[MIRROR] = palette.colour("mirror", points)
    if palette.has("glass") or palette.has("refraction"):
        ior = palette.ior(points)
        ratio = np.where(points.backside, 1.0 / ior, ior)
        cosine = -dot(points.shading, direction)
        reflectance = scattering.fresnel(cosine, ratio)
        if palette.has("glass"):
            colour = palette.colour("glass", points)
            found[REFLECTED], found[GLASS] = colour * reflectance, colour * (1.0 - reflectance)
        if palette.has("refraction"):
            found[REFRACTED] = palette.colour("refraction", points) * (reflectance < 1.0)
    colours = np.stack(list(found.values())) if found else np.empty((0, 3, len(direction[0])))
    shares = colours.sum(axis=1)
    total = shares.sum(axis=0)
    shares /= np.where(total > 0, total, 1.0)
    return Lobes(list(found), colours, shares, ratio)
