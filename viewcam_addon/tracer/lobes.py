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


@dataclass(slots=True)
class Lobes:
    """The ways at n points. ways : which of them there are. colours : (ways, 3, n). shares : (ways, n), their sum 1 or 0."""

    ways: list[int]
    colours: Floats
    shares: Floats

    def share(self, way: int) -> Floats:
        return self.shares[self.ways.index(way)]

    def chosen(self, u: Floats) -> Indices:
        """(n,) the way that each path takes, −1 where none leads on. u : (n,) from 0 to 1."""
        reached = self.shares.cumsum(axis=0)
        chosen = np.array(self.ways)[np.minimum((u >= reached).sum(axis=0), len(self.ways) - 1)]
        return np.where(reached[-1] > 0, chosen, -1)


def lobes_at(palette: Palette, points: Points, direction: Floats) -> Lobes:
    """The ways of paths that come to points along (3, n) unit directions."""
    found: dict[int, Floats] = {}
    if palette.has("diffuse"):
        found[DIFFUSE] = palette.colour("diffuse", points)
    if palette.has("mirror"):
        found[MIRROR] = palette.colour("mirror", points)
    if palette.has("glass") or palette.has("refraction"):
        ratio = palette.ior_ratio(points)
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
    return Lobes(list(found), colours, shares)
