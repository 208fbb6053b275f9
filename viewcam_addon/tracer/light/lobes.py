"""The ways in which light leaves a point of a surface, and how often a path takes each.

A path goes one way only, chosen in proportion to the ways' colours, and its weight is divided by that share: where there is one
way, it is taken and nothing is random. Glass is two ways, shared out by Fresnel's equations.
"""

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Indices, Some, dot, pick, some
from ..rays.points import Points
from . import scattering
from .textures import Palette

DIFFUSE, MIRROR, REFLECTED, GLASS, REFRACTED = range(5)
"""Lambert's; a mirror's; what glass reflects and what it lets in; what plain refraction lets in."""
KINDS = {"diffuse": (DIFFUSE,), "glossy": (MIRROR, REFLECTED), "transmission": (GLASS, REFRACTED)}
"""The kind of ray that each way makes, by which objects and lamps hide and by which bounces are counted."""


@dataclass(frozen=True, eq=False)
class Lobes:
    """The ways at n points.

    ways : which of them the scene has. colours : for each, (3, n) the part of the light that takes it. shares : for each, (n,)
    how often a path does; their sum is 1, or 0 where none leads on. ratio : (n,) the index of refraction beyond the surface
    over that before it, or None where the scene has no glass. normal : (3, n) of mirrors and glass, or None.
    """

    ways: list[int]
    colours: list[Floats]
    shares: list[Floats]
    ratio: Floats | None
    normal: Floats | None

    def __contains__(self, way: int) -> bool:
        return way in self.ways

    def colour(self, way: int) -> Floats:
        return self.colours[self.ways.index(way)]

    def share(self, way: int) -> Floats:
        return self.shares[self.ways.index(way)]

    def leads_on(self, kind: str) -> bool:
        """Whether any way makes rays of a kind."""
        return any(way in self.ways for way in KINDS[kind])

    def chosen(self, u: Floats) -> Indices:
        """(n,) the place in `ways` of the way that each path takes, −1 where none leads on. u : (n,) in [0, 1), or 0."""
        if len(self.ways) == 1:
            return np.where(self.shares[0] > 0, 0, -1)
        chosen, reached = np.full(len(u), -1), np.zeros(len(u))
        for place, share in enumerate(self.shares):
            # The last that has a share is taken even where the sum is rounded to less than u.
            chosen = np.where((share > 0) & (u >= reached), place, chosen)
            reached += share
        return chosen

    def of_kind(self, chosen: Indices, kind: str) -> Some:
        """Which of the points are left by rays of a kind."""
        places = [place for place, way in enumerate(self.ways) if way in KINDS[kind]]
        leaving = np.zeros(len(chosen), bool)
        for place in places:
            leaving |= chosen == place
        return some(leaving)

    def weights(self, chosen: Indices, which: Some, kind: str) -> Floats:
        """(3, k): what becomes of the light that comes to some of the points by the ways of one kind that were chosen."""
        weights: Floats | None = None
        for place, way in enumerate(self.ways):
            if way in KINDS[kind]:
                share = pick(self.shares[place], which)
                part = pick(self.colours[place], which)
                if len(self.ways) > 1:
                    part = part / np.where(share > 0, share, 1.0)
                weights = part if weights is None else np.where(pick(chosen, which) == place, part, weights)
        return weights


def lobes_at(palette: Palette, points: Points, direction: Floats | None) -> Lobes:
    """The ways of paths that come to points along (3, n) unit directions; None where no point is of a mirror or of glass."""
    found: dict[int, Floats] = {}
    ratio = normal = None
    specular = direction is not None
    if palette.has("diffuse"):
        found[DIFFUSE] = palette.colour("diffuse", points)
    if specular:
        normal = scattering.specular_normal(direction, points.normal, points.shading)
    if specular and palette.has("mirror"):
        found[MIRROR] = palette.colour("mirror", points)
    if specular and (palette.has("glass") or palette.has("refraction")):
        ior = palette.ior(points)
        ratio = np.where(points.backside, 1.0 / ior, ior)
        reflectance = scattering.fresnel(-dot(normal, direction), ratio)
        if palette.has("glass"):
            colour = palette.colour("glass", points)
            found[REFLECTED], found[GLASS] = colour * reflectance, colour * (1.0 - reflectance)
        if palette.has("refraction"):
            found[REFRACTED] = palette.colour("refraction", points) * (reflectance < 1.0)
    colours = list(found.values())
    shares = [colour[0] + colour[1] + colour[2] for colour in colours]
    if len(shares) == 1:
        shares = [(shares[0] > 0).astype(np.float64)]
    else:
        total = sum(shares)
        total = np.where(total > 0, total, 1.0)
        shares = [share / total for share in shares]
    return Lobes(list(found), colours, shares, ratio, normal)
