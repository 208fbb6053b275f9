"""Points of surfaces, with all that light needs to know there, and the tables of the scene that they are made from.

Rejected: making them of the passes of surface.py, which are float32 and in world space. The tables are built for the levels of
light only, and of colours and UV only what some material asks for.
"""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Indices, Some, cross, dot, gather, pick, put
from ..compiled.standing import or_compiled
from ..scene import Scene, Spheres
from ..scene.materials import PLAIN, Material
from . import offset
from .balls import balls_of
from .ellipsoids import Ellipsoids
from .tables import by_material, parts
from .triangles import Planes, Triangles, facing
from .view import View


@dataclass(frozen=True, eq=False)
class Points:
    """n points of surfaces that rays meet, in camera space.

    position : (3, n) float64. normal : (3, n) float64, unit, of the true geometry, on the side that the ray came from.
    shading : (3, n) float64, unit, smooth where the mesh is, turned to the other side where `normal` is.
    backside : (n,) bool, met from behind: from where the corners run clockwise in the object's own space, as in Cycles.
    material : (n,) int32, index into `materials_of(scene)`.
    primitive : (n,) intp: triangles first, then the scene's spheres, each counted from object to object.
    offset : (n,) float64, how far off rays that leave start (offset.py).
    uv : (2, n) float32, 0 without a UV map, or None where no material has an image.
    vertex_colour : (3, n) float64, 0 on what has none, or None where no material asks for it.
    """

    position: Floats
    normal: Floats
    shading: Floats
    backside: NDArray[np.bool_]
    material: NDArray[np.int32]
    primitive: Indices
    offset: Floats
    uv: Floats | None
    vertex_colour: Floats | None

    @property
    def count(self) -> int:
        return self.position.shape[1]

    def at(self, which: Some) -> "Points":
        """Some of the points; what nobody reads of them is never copied."""
        return self if isinstance(which, slice) and which == slice(None) else _Chosen(self, which)

    @staticmethod
    def joined(parts: "list[Points]") -> "Points":
        """Several, one after the other; all of one scene."""
        values = {field.name: [getattr(part, field.name) for part in parts] for field in fields(Points)}
        return Points(**{name: None if some[0] is None else np.concatenate(some, axis=-1) for name, some in values.items()})


class _Chosen(Points):
    """Some of other points."""

    def __init__(self, points: Points, which: Some) -> None:
        vars(self).update(_points=points, _which=which)

    def __getattr__(self, name: str) -> NDArray | None:
        points, which = vars(self)["_points"], vars(self)["_which"]
        if name == "shading" and points.shading is points.normal:
            value = self.normal  # where nothing is smooth, both normals are one array, and stay it
        else:
            value = getattr(points, name)
            value = None if value is None else pick(value, which)
        vars(self)[name] = value
        return value


def materials_of(scene: Scene) -> tuple[Material, ...]:
    """What `Points.material` counts: `PLAIN`, then the scene's."""
    return (PLAIN, *scene.materials.values())


class Surfaces:
    """What makes points of the primitives that rays meet.

    The numbers of spheres that visibility.py finds are those of `ellipsoids`; all others are those of `Points.primitive`.
    """

    def __init__(self, scene: Scene, view: View, triangles: Triangles, planes: Planes, ellipsoids: Ellipsoids) -> None:
        self.triangles, self.planes = triangles, planes
        self.handedness, self._ellipsoids = view.handedness, ellipsoids
        placed = [(placed, scene.geometries[placed.geometry]) for placed in scene.objects]
        self.balls = balls_of([pair for pair in placed if isinstance(pair[1], Spheres)], view)
        things = [*triangles.placed, *self.balls.placed]
        names = [placed.materials + ("",) * len(placed.material_indices) for placed, _ in things]
        numbers = {"": 0, **{name: number for number, name in enumerate(scene.materials, start=1)}}
        self.material = by_material(things, [[numbers[name] for name in some] for some in names], np.int32)
        # Of spheres 0: they are tested in float64.
        self.offset = np.zeros(len(self.material))
        self.offset[: triangles.count] = offset.triangle_offsets(triangles)
        self.offset[planes.wide] = offset.wide_offsets(planes)
        # On which side of the cross product of its sides, in camera space, a triangle has its front, and its smooth normals.
        matrices = np.array([placed.matrix[:3, :3] for placed, _ in triangles.placed]).reshape(-1, 3, 3)
        front = np.where(np.linalg.det(matrices) < 0, -1, 1) * int(view.handedness)
        self.front = np.repeat(front.astype(np.int8), triangles.counts)
        self.axes = view.handedness * view.axes
        colours = [colour for material in materials_of(scene) for colour in material.colours.values()]
        self.has_uv = any(colour.image is not None for colour in colours)
        self.colours = _corner_colours(triangles) if any(colour.vertex for colour in colours) else None

    def seen(self, primitives: Indices, x: Floats, y: Floats) -> Points:
        """The points where n rays from the eye, (x, y, 1), meet what visibility.py found for them; no primitive is −1."""

        def triangle_points(triangle: Indices, which: Some) -> Points:
            return triangles_seen(self, triangle, pick(x, which), pick(y, which))

        def sphere_points(sphere: Indices, which: Some) -> Points:
            depth = self._ellipsoids.depth(sphere, pick(x, which), pick(y, which))
            ways = _ways(pick(x, which), pick(y, which))
            centres = gather(self._ellipsoids.positions, sphere)
            return self._on_spheres(gather(self._ellipsoids.number, sphere), centres, ways * depth, ways)

        return self._split(primitives, triangle_points, sphere_points)

    def materials_seen(self, primitives: Indices) -> NDArray[np.int32]:
        """(n,): the materials of primitives that visibility.py found, as in `Points.material`; where there is none, 0."""
        if not len(self.material):
            return np.zeros(len(primitives), np.int32)
        number = np.append(np.arange(self.triangles.count), self._ellipsoids.number + self.triangles.count)
        return np.where(primitives >= 0, gather(self.material, gather(number, np.maximum(primitives, 0))), 0)

    def met(self, primitives: Indices, origins: Floats, directions: Floats) -> tuple[Points, Floats]:
        """The points where n rays from anywhere meet the primitives that space.py found for them, and how far off, (n,).

        primitives : (n,), spheres counted as in `balls`. origins, directions : (3, n), camera space, directions of unit length.
        """
        distances = np.empty(len(primitives))

        def triangle_points(triangle: Indices, which: Some) -> Points:
            points, distances[which] = triangles_met(self, triangle, pick(origins, which), pick(directions, which))
            return points

        def sphere_points(ball: Indices, which: Some) -> Points:
            ways = pick(directions, which)
            distances[which] = self.balls.distance(ball, pick(origins, which), ways)
            position = pick(origins, which) + ways * distances[which]
            return self._on_spheres(gather(self.balls.number, ball), gather(self.balls.centres, ball), position, ways)

        return self._split(primitives, triangle_points, sphere_points), distances

    def made_of(self, materials: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """For each primitive, numbered as space.py finds them, whether its material is one of those."""
        count = self.triangles.count
        made = np.empty(count + self.balls.count, bool)
        for part in parts(count):
            made[part] = gather(materials, self.material[part])
        made[count:] = gather(materials, gather(self.material[count:], self.balls.number))
        return made

    def distance(self, triangle: Indices, origins: Floats, directions: Floats) -> Floats:
        """How far along rays the planes of triangles are, that were found for them."""
        corner, *sides = self.sides(triangle)
        return _plane_distance(corner, cross(*sides), origins, directions)

    def sides(self, triangle: Indices) -> tuple[Floats, Floats, Floats]:
        """(3, n) each: the first corner, and from it to the second and the third."""
        a, b, c = (gather(self.triangles.vertices, gather(corner, triangle)) for corner in self.triangles.corners)
        return a, b - a, c - a

    def _split(self, primitives: Indices, triangle_points, sphere_points) -> Points:
        """The points of triangles and those of spheres, each made by its function, in the order of `primitives`."""
        spheres = primitives >= self.triangles.count
        if not spheres.any():
            return triangle_points(primitives, slice(None))
        if spheres.all():
            return sphere_points(primitives - self.triangles.count, slice(None))
        parts = []
        for chosen, make, first in ((~spheres, triangle_points, 0), (spheres, sphere_points, self.triangles.count)):
            which = np.flatnonzero(chosen)
            parts.append((which, make(primitives[which] - first, which)))
        return _merged(len(primitives), parts)

    def on_triangles(
        self, triangle: Indices, normal: Floats, side: Floats, first: Floats, second: Floats, position: Floats, ways: Floats
    ) -> Points:
        """Points at barycentric coordinates of triangles.

        normal : (3, n), towards where rays come from along `ways`. side : (n,), 1 where it is that of the cross product of the
        triangle's sides, −1 where it is the other's.
        """
        lost = ~np.isfinite(normal[0] + normal[1] + normal[2])
        if lost.any():  # no surface, but what was found there looks at the ray
            side = np.where(lost, 1.0, side)
            normal = np.where(lost, -ways / np.sqrt(dot(ways, ways)), normal)
        return Points(
            position=position,
            normal=normal,
            shading=self._shading(triangle, first, second, normal, side),
            backside=side * gather(self.front, triangle) < 0,
            material=gather(self.material, triangle),
            primitive=triangle,
            offset=gather(self.offset, triangle),
            **dict(zip(("uv", "vertex_colour"), self.varying(triangle, first, second), strict=True)),
        )

    def varying(self, triangle: Indices, first: Floats, second: Floats) -> tuple[Floats | None, Floats | None]:
        """UV and vertex colours at barycentric coordinates of triangles, where anybody asks for them."""
        colours = None if self.colours is None else _interpolated(gather(self.colours, triangle), first, second)
        return self._uv(triangle, first, second), colours

    def _shading(self, triangle: Indices, first: Floats, second: Floats, normal: Floats, side: Floats) -> Floats:
        if self.triangles.corner_normals is None:
            return normal
        smooth = _interpolated(gather(self.triangles.corner_normals, triangle), first, second)
        smooth = np.stack([dot(axis, smooth) for axis in self.axes])
        length = np.sqrt(dot(smooth, smooth))
        with np.errstate(invalid="ignore", divide="ignore"):
            smooth *= side / length
        return smooth if length.all() else np.where(length > 0, smooth, normal)

    def _uv(self, triangle: Indices, first: Floats, second: Floats) -> Floats | None:
        if not self.has_uv:
            return None
        if self.triangles.corner_uvs is None:
            return np.zeros((2, len(triangle)))
        return _interpolated(gather(self.triangles.corner_uvs, triangle), first, second)

    def _on_spheres(self, number: Indices, centres: Floats, position: Floats, ways: Floats) -> Points:
        """As in Cycles, the normal of an ellipsoid too is the direction from its centre."""
        outward = position - centres
        outward /= np.sqrt(dot(outward, outward))
        backside = dot(outward, ways) > 0
        normal = outward * np.where(backside, -1.0, 1.0)
        primitive = number + np.intp(self.triangles.count)
        return Points(
            position=position,
            normal=normal,
            shading=normal,
            backside=backside,
            material=gather(self.material, primitive),
            primitive=primitive,
            offset=np.zeros(len(number)),
            uv=np.zeros((2, len(number))) if self.has_uv else None,
            vertex_colour=None if self.colours is None else np.zeros((3, len(number))),
        )


def _ways(x: Floats, y: Floats) -> Floats:
    """(3, n) rays of the eye."""
    return np.stack([x, y, np.ones_like(x)])


@or_compiled
def triangles_seen(surfaces: Surfaces, triangle: Indices, x: Floats, y: Floats) -> Points:
    """The points where rays from the eye, (x, y, 1), meet triangles that were found for them."""
    depth, first, second = surfaces.planes.hit(triangle, x, y)
    ways = _ways(x, y)
    normal = facing(gather(surfaces.planes.forms[:3], triangle))
    side = gather(surfaces.planes.side, triangle) * surfaces.handedness
    return surfaces.on_triangles(triangle, normal, side, first, second, ways * depth, ways)


@or_compiled
def triangles_met(surfaces: Surfaces, triangle: Indices, origins: Floats, ways: Floats) -> tuple[Points, Floats]:
    """The points where rays from anywhere meet triangles that were found for them, and how far off."""
    corner, *sides = surfaces.sides(triangle)
    normal = cross(*sides)
    first, second = _barycentric(corner, sides, normal, origins, ways)
    position = corner + first * sides[0] + second * sides[1]
    distances = dot(position - origins, ways)
    side = np.where(dot(normal, ways) > 0, -1.0, 1.0)
    with np.errstate(all="ignore"):
        normal *= side / np.sqrt(dot(normal, normal))
    return surfaces.on_triangles(triangle, normal, side, first, second, position, ways), distances


def _corner_colours(triangles: Triangles) -> NDArray[np.float32]:
    """(9, m): [3 · corner + channel, triangle], 0 on meshes without."""
    table, end = np.zeros((9, triangles.count), np.float32), 0
    for _, mesh in triangles.placed:
        begin, end = end, end + len(mesh.triangles)
        if mesh.corner_colours is not None:
            table[:, begin:end] = mesh.corner_colours.reshape(-1, 9).T
    return table


def _interpolated(corners: NDArray[np.float32], first: Floats, second: Floats) -> Floats:
    """(k, n) of what the (3k, n) values at the corners are at the barycentric coordinates."""
    a, b, c = corners.reshape(3, len(corners) // 3, corners.shape[1])
    values = a * (1.0 - first - second)
    values += b * first
    values += c * second
    return values


def _plane_distance(corner: Floats, normal: Floats, origins: Floats, directions: Floats) -> Floats:
    with np.errstate(all="ignore"):  # a ray along the plane
        return dot(normal, corner - origins) / dot(normal, directions)


def _barycentric(
    corner: Floats, sides: list[Floats], normal: Floats, origins: Floats, directions: Floats
) -> tuple[Floats, Floats]:
    """The barycentric coordinates b₁, b₂ where rays meet triangles that were found for them, within the triangles."""
    distance = _plane_distance(corner, normal, origins, directions)
    with np.errstate(all="ignore"):
        inside = origins + distance * directions - corner
        scaled = normal / dot(normal, normal)
        first = dot(cross(inside, sides[1]), scaled)
        second = dot(cross(sides[0], inside), scaled)
    first = np.fmax(np.fmin(first, 1.0), 0.0)
    return first, np.fmax(np.fmin(second, 1.0 - first), 0.0)


def _merged(count: int, parts: list[tuple[Indices, Points]]) -> Points:
    """Points, some here and some there, as one."""
    values = {}
    for field in fields(Points):
        given = [(which, getattr(points, field.name)) for which, points in parts]
        first = given[0][1]
        if first is None:
            values[field.name] = None
            continue
        values[field.name] = np.empty((*first.shape[:-1], count), first.dtype)
        for which, value in given:
            put(values[field.name], which, value)
    return Points(**values)
