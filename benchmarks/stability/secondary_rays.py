"""Rays that leave a surface: how many meet it again (acne), and how many step over what stands close by (leaks).

Hits are the geometry level's own: seen from the eye, in camera space, refined in float64. From each a ray goes on by Embree, as
shadow and bounce rays will: its start in float32, its direction anywhere on its side of the surface, every other one nearly
along it (cosines down to FLATTEST, evenly on the logarithm).

- Acne: rays that go out from a closed convex ball of triangles. None may meet it.
- Leaks: rays that go into a closed slab through the side that the eye sees, off its rim. Every one must meet it from within.

Candidates: no offset; a fixed distance of 1e-4 along the normal; 1e-6 · max(1, |P|), which was good enough for a room; steps of
floats in each coordinate (Wächter and Binder, Ray Tracing Gems, 2019, ch. 6); ours, tracer/rays/offset.py.

Exact spheres are tested in float64: acne as above; leaks with another sphere that stands before each hit, closer than any
float32 could tell. And shadow rays end at lamps: one that lies in a surface must not be hidden by it, and a sheet just before a
lamp must hide it. There the candidates are where the ray ends.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.arrays import dot, gather
from viewcam_addon.tracer.rays import offset
from viewcam_addon.tracer.rays.ellipsoids import Ellipsoids, ellipsoids_of
from viewcam_addon.tracer.rays.embree import embree_scene
from viewcam_addon.tracer.rays.triangles import Planes, Triangles, triangles_of
from viewcam_addon.tracer.rays.view import View
from viewcam_addon.tracer.rays.visibility import visibility
from viewcam_addon.tracer.scene import Mesh, Object, Spheres

from ..charts import Chart, Curve

Array = NDArray[np.float64]

# Counted, of the few hundred thousand rays of a place: none is none.
TIE = 0.0
_NONE = " What lies on the lower edge is 0."
_AWAY = np.array([0.48, 0.36, 0.8])  # where things stand, seen from the eye: askew to all axes
_THIN = 1e-5  # of the distance: thickness of the slab where scales are swept


@dataclass(frozen=True)
class Leaving:
    """n rays that leave surfaces. points, normals, directions : (3, n), camera space. offsets : (n,), ours."""

    points: Array
    normals: Array
    directions: Array
    offsets: Array


Rule = Callable[[Leaving], Array]


def charts(quick: bool = False) -> tuple[Chart, ...]:
    rays = 2000 if quick else 60_000
    scales, distances, walls = 10.0 ** np.arange(-6, 7), 10.0 ** np.arange(0.5, 8), 10.0 ** -np.arange(2, 7.5, 0.5)
    by_scale = [(_acne(scale, 4 * scale, rays), _leaks(scale, 4 * scale, _THIN * 4 * scale, rays)) for scale in scales]
    by_distance = [_half(_acne(1, far, rays), _leaks(1, far, 0.1, rays)) for far in distances]
    sizes = 10.0 ** np.arange(0, 8)
    by_wall = [_half(_acne(1, 4, rays), _leaks(1, 4, 4 * thickness, rays)) for thickness in walls]
    counted = " per million rays"
    return (
        Chart(
            "secondary-acne",
            "Rays that meet the surface they leave, against the scale",
            "size of the scene",
            "hits" + counted,
            _curves(scales, [acne for acne, _ in by_scale]),
            "A ball four of its radii from the eye. A fixed distance works where it is larger than a rounding of float32."
            + _NONE,
            tie=TIE,
        ),
        Chart(
            "secondary-large",
            "Rays that meet the surface they leave, large triangles near the eye",
            "size of the triangles / distance of the eye",
            "hits" + counted,
            _curves(sizes, [_large(size, rays) for size in sizes]),
            "A floor of two triangles, seen near the eye. The larger they are, the more their corners' rounding moves them "
            "here: a rule that knows only the point does not see it." + _NONE,
            tie=TIE,
        ),
        Chart(
            "secondary-leaks",
            "Rays that step over a thin wall, against the scale",
            "size of the scene",
            "leaks" + counted,
            _curves(scales, [leaks for _, leaks in by_scale]),
            f"A wall that is {_THIN:.0e} of its distance thick. Fixed distances step over it as soon as they are larger."
            + _NONE,
            tie=TIE,
        ),
        Chart(
            "secondary-distance",
            "Acne and leaks together, against the distance from the eye",
            "distance / size of the object",
            "wrong" + counted,
            _curves(distances, by_distance),
            "A ball of radius 1 and a slab 0.1 thick. Ours fails where float32 does: from 3e5 on the slab is as thin as the "
            "roundings of its own corners and of the start." + _NONE,
            tie=TIE,
        ),
        Chart(
            "secondary-wall",
            "Acne and leaks together, against the thickness of the wall",
            "thickness / distance from the eye",
            "wrong" + counted,
            _curves(walls, by_wall, aside="no offset"),
            "Read where a curve leaves the floor: the thinnest wall that holds. Ours holds 1e-6 of its distance, a "
            "dozen roundings, and 99 % of the rays at 3e-7. Without offset every second ray has acne, however thick the wall."
            + _NONE,
            tie=TIE,
            reverse=True,
        ),
        *_chart_of_spheres(rays, counted),
        *_chart_of_lamps(rays, scales, counted),
    )


def _curves(sweep: Array, counts: list[dict[str, float]], aside: str = "") -> tuple[Curve, ...]:
    """A curve for each rule. The one named `aside` is shown and does not compete."""
    return tuple(
        Curve(name, sweep, [count[name] for count in counts], name == "ours", aside if name == aside else "")
        for name in counts[0]
    )


def _half(*parts: dict[str, float]) -> dict[str, float]:
    return {name: sum(part[name] for part in parts) / len(parts) for name in parts[0]}


# Starting points.


def no_offset(leaving: Leaving) -> Array:
    return leaving.points


def fixed(leaving: Leaving) -> Array:
    return _beside(leaving, np.full(leaving.points.shape[1], 1e-4))


def relative(leaving: Leaving) -> Array:
    return _beside(leaving, 1e-6 * np.maximum(1, np.sqrt(dot(leaving.points, leaving.points))))


def float_steps(leaving: Leaving) -> Array:
    """256 steps of floats along each component of the normal; near 0, where steps are tiny, a fixed distance."""
    point = leaving.points.astype(np.float32)
    normal = (np.sign(dot(leaving.normals, leaving.directions)) * leaving.normals).astype(np.float32)
    steps = (256 * normal).astype(np.int32)
    stepped = (point.view(np.int32) + np.where(point < 0, -steps, steps)).view(np.float32)
    return np.where(np.abs(point) < 1 / 32, point + normal / np.float32(65536), stepped).astype(float)


def ours(leaving: Leaving) -> Array:
    return offset.start(leaving.points, leaving.normals, leaving.directions, leaving.offsets)


RULES: dict[str, Rule] = {
    "no offset": no_offset,
    "1e-4 along the normal": fixed,
    "1e-6 · max(1, |P|) along the normal": relative,
    "256 steps of floats (Wächter, Binder)": float_steps,
    "ours": ours,
}


def _beside(leaving: Leaving, distance: Array) -> Array:
    return leaving.points + distance * np.sign(dot(leaving.normals, leaving.directions)) * leaving.normals


# Triangles.


def _acne(size: float, distance: float, rays: int) -> dict[str, float]:
    """Hits per million rays that go out from a ball."""
    ball = _ball()
    triangles, leaving = _hits(ball * size + _AWAY * distance, np.ones(len(ball), bool), size, distance, rays, 1)
    return {name: 1e6 * np.mean(_met(triangles, rule(leaving), leaving.directions)) for name, rule in RULES.items()}


def _large(size: float, rays: int) -> dict[str, float]:
    """Hits per million rays that leave a floor of two triangles, of this size, at a distance of 1 from the eye."""
    floor = _cube(0)[:2] - (0.3, 0.2, 1)
    corners = floor * (size, size, 1) @ _turn() + _AWAY
    triangles, leaving = _hits(corners, np.ones(2, bool), 0.5, 1, rays, np.sign(-_normals(corners)[0] @ _AWAY))
    return {name: 1e6 * np.mean(_met(triangles, rule(leaving), leaving.directions)) for name, rule in RULES.items()}


def _leaks(size: float, distance: float, thickness: float, rays: int) -> dict[str, float]:
    """Leaks per million rays that go into a slab."""
    cube = _cube()
    inner = np.abs(cube[..., :2]).max(axis=(1, 2)) < 1
    slab = cube * (size, size, thickness / 2) @ _turn() + _AWAY * distance
    triangles, leaving = _hits(slab, inner, size, distance, rays, -1)
    return {name: 1e6 * np.mean(~_met(triangles, rule(leaving), leaving.directions)) for name, rule in RULES.items()}


def _met(triangles: Triangles, starts: Array, directions: Array) -> NDArray[np.bool_]:
    embree = embree_scene(triangles.vertices.T, triangles.corners.T)
    return embree.run(starts.T.astype(np.float32), np.ascontiguousarray(directions.T, np.float32)) >= 0


def _hits(
    corners: Array, chosen: NDArray[np.bool_], size: float, distance: float, rays: int, side: int
) -> tuple[Triangles, Leaving]:
    """What rays from the eye that aim at a thing meet, and a ray from each hit that goes out (side 1) or in (−1).

    corners : (m, 3, 3), of the triangles, world space. chosen : (m,), whose hits count. The eye is at the origin.
    """
    random = np.random.default_rng(4)
    view = View(Pinhole((0, 0, 0), tuple(_AWAY), (0.1, 0.9, -0.2), 1, 1, 1))
    count = len(corners)
    mesh = Mesh(corners.reshape(-1, 3), np.arange(3 * count, dtype=np.int32).reshape(-1, 3), np.zeros(count, np.int32))
    triangles = triangles_of([(Object("thing", "mesh", np.eye(4)), mesh)], view)
    planes = Planes(triangles, view)
    x, y = random.uniform(-1, 1, (2, 2 * rays)) * 0.6 * size / distance
    triangle = visibility(triangles, planes, ellipsoids_of([], view), (0.0, np.inf)).first(x, y)
    met = np.flatnonzero((triangle >= 0) & chosen[triangle])[:rays]
    triangle, x, y = triangle[met], x[met], y[met]
    points = np.stack([x, y, np.ones_like(x)]) * planes.depth(triangle, x, y)
    normals = view.axes @ _normals(corners)[triangle].T
    directions = _leaving(normals * side, random)
    return triangles, Leaving(points, normals, directions, gather(offset.triangle_offsets(triangles), triangle))


def _leaving(normals: Array, random: np.random.Generator) -> Array:
    """(3, n) unit directions on the side of the normals, half evenly over the hemisphere, half nearly along the surface."""
    count = normals.shape[1]
    flat = offset.FLATTEST ** random.uniform(0, 1, count)
    cosine = np.where(np.arange(count) % 2, random.uniform(offset.FLATTEST, 1, count), flat)
    across = np.cross(normals.T, random.normal(size=(count, 3))).T
    return normals * cosine + across / np.linalg.norm(across, axis=0) * np.sqrt(1 - cosine * cosine)


def _normals(corners: Array) -> Array:
    """(m, 3) unit outward normals of triangles whose corners run counter-clockwise seen from outside."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def _ball(levels: int = 4) -> Array:
    """(m, 3, 3) corners of an octahedron's faces, each divided in four again and again, on the unit sphere."""
    faces = [
        [(x, 0, 0), (0, y, 0), (0, 0, z)] if x * y * z > 0 else [(0, y, 0), (x, 0, 0), (0, 0, z)]
        for x in (-1, 1)
        for y in (-1, 1)
        for z in (-1, 1)
    ]
    return _divided(np.array(faces, float), levels, spherical=True)


def _cube(levels: int = 3) -> Array:
    """(m, 3, 3) corners of the cube from −1 to 1."""
    square = np.array([[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]], float)
    halves = square[[[0, 1, 2], [0, 2, 3]]]
    turns = [np.roll(np.eye(3), shift, axis=0) for shift in range(3)]
    sides = [halves @ turn for turn in turns]
    sides += [-side[:, ::-1] for side in sides]
    return _divided(np.concatenate(sides), levels)


def _divided(corners: Array, levels: int, spherical: bool = False) -> Array:
    for _ in range(levels):
        a, b, c = corners.transpose(1, 0, 2)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        corners = np.stack([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]).transpose(0, 2, 1, 3).reshape(-1, 3, 3)
        if spherical:
            corners /= np.linalg.norm(corners, axis=-1, keepdims=True)
    return corners


def _turn() -> Array:
    return np.linalg.qr(np.random.default_rng(6).normal(size=(3, 3)))[0]


# Exact spheres.


def _chart_of_spheres(rays: int, counted: str) -> tuple[Chart]:
    distances = 10.0 ** np.arange(0.5, 13)
    counts = [_of_spheres(distance, rays) for distance in distances]
    return (
        Chart(
            "secondary-spheres",
            "Acne and leaks together, exact spheres in float64",
            "distance / radius",
            "wrong" + counted,
            _curves(distances, counts),
            "Before each hit stands another sphere, at 1e-13 of the distance. Rays that start on the surface, in float64, "
            "are right: from inside nothing is seen. Offsets made for float32 are inside that other sphere." + _NONE,
            tie=TIE,
        ),
    )


def _of_spheres(distance: float, rays: int) -> dict[str, float]:
    random = np.random.default_rng(5)
    view = View(Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 1, 1, 1))
    center = _AWAY * (1, 1, -1) * distance
    ellipsoids = _spheres(center[:, None], view)
    x, y = (center[:2, None] + random.uniform(-0.5, 0.5, (2, rays))) / -center[2]
    depth = ellipsoids.depth(np.zeros(rays, np.intp), x, y)
    points = np.stack([x, y, np.ones(rays)]) * depth
    normals = np.stack(ellipsoids.normal(np.zeros(rays, np.intp), x, y, depth))
    leaving = Leaving(points, normals, _leaving(normals, random), np.zeros(rays))
    upwards = replace(leaving, directions=normals + 0.1 * leaving.directions)
    float32 = np.full(rays, 2.0**-24 * 3.5 * distance)
    rules = {
        "as from a triangle, for float32": lambda leaving: ours(replace(leaving, offsets=float32)),
        **{name: rule for name, rule in RULES.items() if rule in (fixed, relative)},
        "ours": ours,
    }
    counts = {}
    for name, rule in rules.items():
        acne = _meets_sphere(ellipsoids.positions, rule(leaving), leaving.directions)
        leaks = ~_meets_sphere(points + normals * (1 + 1e-13 * distance), rule(upwards), upwards.directions)
        counts[name] = 1e6 * (np.mean(acne) + np.mean(leaks)) / 2
    return counts


def _meets_sphere(centres: Array, starts: Array, directions: Array) -> NDArray[np.bool_]:
    """Whether rays meet unit spheres, each its own, seen from their starts by the tracer's own ellipsoids. All (3, n)."""
    ahead = np.where(directions[2] < 0, -1.0, 1.0)
    relative = np.stack([*(centres - starts)[:2], (centres - starts)[2] * ahead])
    view = View(Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 1, 1, 1))
    ellipsoids = _spheres(relative * [[1], [1], [-1]], view)
    ray = ellipsoids.material_index.astype(int)
    x, y = directions[:2] / np.abs(directions[2])
    met = np.zeros(directions.shape[1], bool)
    met[ray] = np.isfinite(ellipsoids.depth(np.arange(ellipsoids.count), x[ray], y[ray]))
    return met


def _spheres(centers: Array, view: View) -> Ellipsoids:
    """Unit spheres, world space, numbered by their materials."""
    numbers = np.arange(centers.shape[1])
    spheres = Spheres(np.ascontiguousarray(centers.T), np.ones(len(numbers)), numbers.astype(np.int32))
    return ellipsoids_of([(Object("spheres", "spheres", np.eye(4), 0, tuple(numbers.tolist())), spheres)], view)


# Lamps.


def _chart_of_lamps(rays: int, scales: Array, counted: str) -> tuple[Chart]:
    return (
        Chart(
            "secondary-lamps",
            "Where a shadow ray ends: lamps that lie in a surface, and sheets before lamps",
            "size of the scene",
            "wrong" + counted,
            _curves(scales, [_of_lamps(scale, rays) for scale in scales]),
            f"Lamps in a sheet must not be hidden by it, and lamps {_THIN:.0e} of their distance behind it must be. Rays "
            "that stop a fixed distance before the lamp are right at one scale only." + _NONE,
            tie=TIE,
        ),
    )


def _of_lamps(scale: float, rays: int) -> dict[str, float]:
    """Wrong answers per million rays that go from before a sheet to lamps in it, and to lamps behind it."""
    random = np.random.default_rng(7)
    corners = _divided(_cube(0)[:2] - (0, 0, 1), 3) @ _turn() * scale + _AWAY * 4 * scale
    normal = _normals(corners)[0]
    triangles = np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3)
    sheet = embree_scene(corners.reshape(-1, 3), triangles)
    shares = random.dirichlet((1, 1, 1), rays)
    on_sheet = np.einsum("nk,nkd->nd", shares, corners[random.integers(0, len(corners), rays)]).T
    aside = random.uniform(-0.5, 0.5, (3, rays))
    starts = on_sheet + (normal[:, None] + aside - np.outer(normal, normal @ aside)) * scale
    counts = dict.fromkeys(ENDS, 0.0)
    for behind, hidden in ((0.0, False), (_THIN * 4 * scale, True)):
        lamps = on_sheet - behind * normal[:, None]
        origins, directions, lengths = offset.shadow_rays(starts, lamps)
        apart = np.linalg.norm(lamps.T - origins, axis=1)
        for name, end in ENDS.items():
            length = lengths if end is None else end(apart).astype(np.float32)
            met = sheet.run(origins, directions, dists=length) >= 0
            counts[name] += 0.5e6 * np.mean(met != hidden)
    return counts


# Lengths of shadow rays in units of the way to the lamp, (n,) of (n,) distances; None is ours.
ENDS: dict[str, Callable[[Array], Array] | None] = {
    "at the lamp": lambda distance: np.ones_like(distance),
    "1e-4 before it": lambda distance: np.maximum(1 - 1e-4 / distance, 0),
    "1e-6 · max(1, distance) before it": lambda distance: np.maximum(1 - 1e-6 * np.maximum(1, distance) / distance, 0),
    "1e-3 of the way before it": lambda distance: np.full_like(distance, 1 - 1e-3),
    "ours": None,
}
