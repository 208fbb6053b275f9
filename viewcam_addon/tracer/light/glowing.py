"""Surfaces that give light, as emitters that shadow rays are sent to: the triangles of each object that has a bright material.

A triangle is picked by its area times the mean emission of its material, and a point of it evenly. What that brings is
unbounded close by, so it is weighted against rays that are scattered by chance and run into the triangle (emitters.weight).
Spheres are only met by such rays. Rejected: sampling triangles by solid angle, which costs more than those rays, and they are
needed anyway.
"""

import numpy as np

from ..arrays import Floats, Indices, cross, dot, gather
from ..rays.points import Points, Surfaces
from ..scene import Scene
from .textures import Palette

# Less has what a point sees of itself only.
LEAST_DENSITY = 1e-100


class Glowing:
    """The k objects with triangles that shine and that diffuse surfaces see. Nothing of it but `count` is there without any.

    count : k. owner : (m,) int32, for each primitive of the scene, which of them it belongs to, −1 for none.
    """

    def __init__(self, scene: Scene, surfaces: Surfaces, palette: Palette) -> None:
        self._surfaces, self._palette = surfaces, palette
        shining = _shining(surfaces, palette) if palette.has("emission") else []
        self.count = len(shining)
        if shining:
            spheres = sum(len(spheres.radii) for _, spheres in surfaces.balls.placed)
            self._fill(shining, spheres)
            used = [scene.materials[name] for placed in scene.objects for name in placed.materials if name]
            emissions = [material.colours["emission"] for material in used if "emission" in material.colours]
            self.plain = not any(colour.image is not None or colour.vertex for colour in emissions)

    def _fill(self, shining: list[tuple[Indices, Floats]], sphere_count: int) -> None:
        self.primitives = np.concatenate([primitives for primitives, _ in shining])
        a, b, c = self._corners(self.primitives)
        normals = cross(b - a, c - a)
        with np.errstate(invalid="ignore", divide="ignore"):
            normals /= np.sqrt(dot(normals, normals))
        self.shapes = np.concatenate([a, b - a, c - a, normals])
        self.colours = np.concatenate([colours for _, colours in shining], axis=1)
        self.centres, self.reach = np.empty((3, self.count)), np.empty(self.count)
        self.brightness = np.empty(self.count)  # radiance times area
        self.reached, self.last = np.empty(len(self.primitives)), np.empty(self.count, np.intp)
        self.densities = np.zeros(self._surfaces.triangles.count + sphere_count)
        self.owner = np.full(len(self.densities), -1, np.int32)
        end = 0
        for number, (primitives, colours) in enumerate(shining):
            corners = np.stack(self._corners(primitives))
            normals = cross(corners[1] - corners[0], corners[2] - corners[0])
            emission = colours.mean(axis=0)
            shares = np.sqrt(dot(normals, normals)) / 2 * emission
            self.brightness[number] = total = shares.sum()
            least, greatest = corners.min(axis=(0, 2)), corners.max(axis=(0, 2))
            self.centres[:, number] = (least + greatest) / 2
            self.reach[number] = np.linalg.norm(greatest - least) / 2
            part = slice(end, end := end + len(primitives))
            with np.errstate(invalid="ignore", divide="ignore"):
                self.reached[part] = number + np.nan_to_num(shares.cumsum() / total)
                self.densities[primitives] = np.nan_to_num(emission / total, posinf=0.0)
            self.last[number] = part.start + np.flatnonzero(shares).max(initial=0)
            self.owner[primitives] = number

    def _corners(self, triangle: Indices) -> tuple[Floats, ...]:
        triangles = self._surfaces.triangles
        return tuple(gather(triangles.vertices, gather(corner, triangle)) for corner in triangles.corners)

    def sample(self, which: Indices, position: Floats, part: Floats, u: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Where points see some point of objects, how far off, its radiance over the density, and the density by solid angle.

        which : (n,) objects. part : (n,) and u : (2, n), in [0, 1): which triangle, and where on it.
        """
        picked = np.searchsorted(self.reached, which + part, side="right")
        picked = np.minimum(picked, gather(self.last, which))
        primitive = gather(self.primitives, picked)
        corner, first, second, normal = gather(self.shapes, picked).reshape(4, 3, -1)
        far = np.sqrt(u[0])
        along = far * u[1]
        to = corner + first * (far - along) + second * along - position
        squared = dot(to, to)
        distance = np.sqrt(squared)
        with np.errstate(invalid="ignore", divide="ignore"):
            ahead = np.divide(to, distance, out=to)
            density = np.fmax(gather(self.densities, primitive) * squared / np.abs(dot(normal, ahead)), 0.0)
            factor = np.where(density > LEAST_DENSITY, 1 / density, 0.0)
        return ahead, distance, self._radiance(picked, primitive, position, ahead) * factor, density

    def _radiance(self, picked: Indices, primitive: Indices, position: Floats, ahead: Floats) -> Floats:
        if self.plain:
            return gather(self.colours, picked)
        return self._palette.colour("emission", self._surfaces.met(primitive, position, ahead)[0])

    def estimate(self, number: int, position: Floats, normal: Floats) -> Floats:
        """(n,): about how much an object brings to points, 0 only where it brings nothing."""
        way = self.centres[:, number, None] - position
        squared, reach = dot(way, way), self.reach[number]
        risen = np.fmax(dot(normal, way) + reach, 0.0)
        return risen * (self.brightness[number] / ((squared + reach**2 / 2) * (np.sqrt(squared) + reach)))

    def powers(self) -> Floats:
        """(k,), of both sides."""
        return 2 * np.pi * self.brightness if self.count else np.empty(0)

    def density(self, points: Points, ahead: Floats, distance: Floats) -> Floats:
        """(n,) by solid angle, with which `sample` would send rays that met points of its objects; 0 for other points."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.nan_to_num(
                gather(self.densities, points.primitive) * distance * distance / np.abs(dot(points.normal, ahead))
            )


def _shining(surfaces: Surfaces, palette: Palette) -> list[tuple[Indices, Floats]]:
    """Of each object that shines, the triangles that do, and their mean colours (3, n)."""
    triangles = surfaces.triangles
    colours = np.array([palette.mean("emission", number) for number in range(len(palette.having("emission")))]).T
    shines = gather(colours.any(axis=0), surfaces.material[: triangles.count])
    shines &= ~triangles.hidden_from("diffuse")
    primitives = np.flatnonzero(shines)
    objects = np.searchsorted(np.cumsum(triangles.counts), primitives, side="right")
    each = np.split(primitives, np.flatnonzero(np.diff(objects)) + 1) if len(primitives) else []
    return [(some, gather(colours, gather(surfaces.material, some))) for some in each]
