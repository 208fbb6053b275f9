"""Rays that leave a surface: how many meet it again (acne), and how many step over what stands close by (leaks).

Hits are the core's own, seen from the eye, and so are the rays that go on from each, as shadow and bounce rays do: anywhere on
its side of the surface, every other one nearly along it (cosines down to FLATTEST, evenly on the logarithm).

- Acne: rays that go out from a closed convex ball of triangles. None may meet it.
- Leaks: rays that go into a closed slab through the side that the eye sees, off its rim. Every one must meet it from within.

Candidates are where rays start: no offset; a fixed distance of 1e-4 along the normal; 1e-6 · max(1, |P|), which was good enough
for a room; steps of floats in each coordinate (Wächter and Binder, Ray Tracing Gems, 2019, ch. 6); ours, which Interaction in
tracer/core/ray.h holds and triangle_mesh.h derives.

Exact spheres: acne as above; leaks with another sphere that stands before each hit, closer than any float32 could tell. And
shadow rays end at lamps: one that lies in a surface must not be hidden by it, and a sheet just before a lamp must hide it.
There the candidates are where the ray ends.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.native import CoreScene
from viewcam_addon.tracer.scene import Mesh, Object, Scene, Spheres

from ..charts import Chart, Curve

Array = NDArray[np.float64]

# Counted, of the few hundred thousand rays of a place: none is none.
TIE = 0.0
_NONE = " What lies on the lower edge is 0."
_AWAY = np.array([0.48, 0.36, 0.8])  # where things stand, seen from the eye: askew to all axes
_THIN = 1e-10  # thickness of the slab where scales are swept, as a share of the distance
# Cosine of the flattest rays.
FLATTEST = 1e-3
_CAMERA = Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 1, 1, 1)


@dataclass(frozen=True)
class Leaving:
    """n rays that leave surfaces.

    points, normals, directions, starts : (n, 3).
    starts : ours.
    """

    points: Array
    normals: Array
    directions: Array
    starts: Array


Rule = Callable[[Leaving], Array]


def charts(quick: bool = False) -> tuple[Chart, ...]:
    rays = 2000 if quick else 60_000
    scales, distances, walls = 10.0 ** np.arange(-6, 15), 10.0 ** np.arange(0.5, 15), 10.0 ** -np.arange(2, 16.0)
    by_scale = [(_acne(scale, 4 * scale, rays), _leaks(scale, 4 * scale, _THIN * 4 * scale, rays)) for scale in scales]
    by_distance = [_half(_acne(1, far, rays), _leaks(1, far, 0.1, rays)) for far in distances]
    sizes = 10.0 ** np.arange(0, 13)
    by_wall = [_half(_acne(1, 4, rays), _leaks(1, 4, 4 * thickness, rays)) for thickness in walls]
    counted = " per million rays"
    return (
        Chart(
            "secondary-acne",
            "Rays that meet the surface they leave, against the scale",
            "size of the scene",
            "hits" + counted,
            _curves(scales, [acne for acne, _ in by_scale]),
            "A ball four of its radii from the eye. Every rule works where its distance is larger than a rounding of float64."
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
            "A ball of radius 1 and a slab 0.1 thick. Ours fails where float64 does: where the slab is as thin as the "
            "roundings of its own corners and of the start." + _NONE,
            tie=TIE,
        ),
        Chart(
            "secondary-wall",
            "Acne and leaks together, against the thickness of the wall",
            "thickness / distance from the eye",
            "wrong" + counted,
            _curves(walls, by_wall, aside="no offset"),
            "Read where a curve leaves the floor: the thinnest wall that holds. Ours holds 1e-14 of its distance, some dozen "
            "roundings of float64. "
            "Without offset many rays have acne, however thick the wall." + _NONE,
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
    return _beside(leaving, np.full(len(leaving.points), 1e-4))


def relative(leaving: Leaving) -> Array:
    return _beside(leaving, 1e-6 * np.maximum(1, np.linalg.norm(leaving.points, axis=1)))


def float_steps(leaving: Leaving) -> Array:
    """256 steps of floats along each component of the normal; near 0, where steps are tiny, a fixed distance."""
    point = leaving.points.astype(np.float32)
    normal = (_side(leaving)[:, None] * leaving.normals).astype(np.float32)
    steps = (256 * normal).astype(np.int32)
    stepped = (point.view(np.int32) + np.where(point < 0, -steps, steps)).view(np.float32)
    return np.where(np.abs(point) < 1 / 32, point + normal / np.float32(65536), stepped).astype(float)


def ours(leaving: Leaving) -> Array:
    return leaving.starts


RULES: dict[str, Rule] = {
    "no offset": no_offset,
    "1e-4 along the normal": fixed,
    "1e-6 · max(1, |P|) along the normal": relative,
    "256 steps of floats (Wächter, Binder)": float_steps,
    "ours": ours,
}


def _beside(leaving: Leaving, distance: Array) -> Array:
    return leaving.points + (distance * _side(leaving))[:, None] * leaving.normals


def _side(leaving: Leaving) -> Array:
    return np.sign((leaving.normals * leaving.directions).sum(axis=1))


# Triangles.


def _acne(size: float, distance: float, rays: int) -> dict[str, float]:
    """Hits per million rays that go out from a ball."""
    ball = _ball()
    core, leaving = _hits(ball * size + _AWAY * distance, np.ones(len(ball), bool), size, distance, rays, 1)
    return {name: 1e6 * np.mean(_met(core, rule(leaving), leaving.directions)) for name, rule in RULES.items()}


def _large(size: float, rays: int) -> dict[str, float]:
    """Hits per million rays that leave a floor of two triangles, of this size, at a distance of 1 from the eye."""
    floor = _cube(0)[:2] - (0.3, 0.2, 1)
    corners = floor * (size, size, 1) @ _turn() + _AWAY
    core, leaving = _hits(corners, np.ones(2, bool), 0.5, 1, rays, 1)
    return {name: 1e6 * np.mean(_met(core, rule(leaving), leaving.directions)) for name, rule in RULES.items()}


def _leaks(size: float, distance: float, thickness: float, rays: int) -> dict[str, float]:
    """Leaks per million rays that go into a slab."""
    cube = _cube()
    inner = np.abs(cube[..., :2]).max(axis=(1, 2)) < 1
    slab = cube * (size, size, thickness / 2) @ _turn() + _AWAY * distance
    core, leaving = _hits(slab, inner, size, distance, rays, -1)
    return {name: 1e6 * np.mean(~_met(core, rule(leaving), leaving.directions)) for name, rule in RULES.items()}


def _met(core: CoreScene, starts: Array, directions: Array) -> NDArray[np.bool_]:
    return np.isfinite(core.closest(core.rays(starts, directions))[0])


def _core_of(geometry: Mesh | Spheres) -> CoreScene:
    """The thing, in a rendering space that is the world: the eye is at its origin."""
    return CoreScene(Scene(_CAMERA, {"thing": geometry}, (Object("thing", "thing", np.eye(4)),)), 1)


def _mesh(corners: Array) -> Mesh:
    """(m, 3, 3) corners; those at one place are one vertex."""
    vertices, place = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    return Mesh(vertices, place.reshape(-1, 3).astype(np.int32), np.zeros(len(corners), np.int32))


def _hits(
    corners: Array, chosen: NDArray[np.bool_], size: float, distance: float, rays: int, side: int
) -> tuple[CoreScene, Leaving]:
    """The hits of rays from the eye that aim at a thing, and a ray from each hit to the eye's side (1) or the other (−1).

    corners : (m, 3, 3), of the triangles.
    chosen : (m,), whose hits count. The eye is at the origin.
    """
    random = np.random.default_rng(4)
    core = _core_of(_mesh(corners))
    across = _AWAY * distance + random.uniform(-1, 1, (2 * rays, 3)) * 0.6 * size
    seen = core.rays(np.zeros((1, 3)), across)
    _, objects, primitives = core.closest(seen)
    seen = seen[np.flatnonzero((objects >= 0) & chosen[primitives])[:rays]]
    normals = core.leaving(seen, _AWAY)[1]
    directions = _leaving(normals * side, random)
    points, normals, _, starts, _ = core.leaving(seen, directions)
    return core, Leaving(points, normals, directions, starts)


def _leaving(normals: Array, random: np.random.Generator) -> Array:
    """(n, 3) unit directions on the side of the normals, half evenly over the hemisphere, half nearly along the surface."""
    count = len(normals)
    flat = FLATTEST ** random.uniform(0, 1, count)
    cosine = np.where(np.arange(count) % 2, random.uniform(FLATTEST, 1, count), flat)[:, None]
    across = np.cross(normals, random.normal(size=(count, 3)))
    return normals * cosine + across / np.linalg.norm(across, axis=1, keepdims=True) * np.sqrt(1 - cosine * cosine)


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
    counts = [_of_spheres(distance, max(rays // 30, 300)) for distance in distances]
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
    center = _AWAY * distance
    core = _core_of(Spheres(center[None], np.ones(1), np.zeros(1, np.int32)))
    seen = core.rays(np.zeros((1, 3)), center + random.uniform(-0.5, 0.5, (rays, 3)))
    _, normals, _, _, _ = core.leaving(seen, _AWAY)
    directions = _leaving(normals, random)
    points, _, _, starts, _ = core.leaving(seen, directions)
    outwards = normals + 0.1 * directions
    leaving, upwards = Leaving(points, normals, directions, starts), Leaving(points, normals, outwards, starts)
    rules = {
        "as from a triangle, for float32": lambda leaving: _beside(leaving, np.full(rays, 2.0**-24 * 3.5 * distance)),
        **{name: rule for name, rule in RULES.items() if rule in (fixed, relative)},
        "ours": ours,
    }
    counts = {}
    for name, rule in rules.items():
        acne = _met(core, rule(leaving), directions)
        leaks = ~_meets_its_sphere(points + normals * (1 + 1e-13 * distance), rule(upwards), outwards)
        counts[name] = 1e6 * (np.mean(acne) + np.mean(leaks)) / 2
    return counts


def _meets_its_sphere(centers: Array, starts: Array, directions: Array) -> NDArray[np.bool_]:
    """True where rays meet unit spheres, each its own: (n, 3)."""
    met = np.empty(len(starts), bool)
    for ray, (center, start, direction) in enumerate(zip(centers, starts, directions, strict=True)):
        alone = _core_of(Spheres(center[None], np.ones(1), np.zeros(1, np.int32)))
        met[ray] = _met(alone, start[None], direction[None])[0]
    return met


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
    """Wrong answers per million rays that go from a floor to lamps in a sheet above it, and to lamps behind it."""
    random = np.random.default_rng(7)
    turn, place = _turn(), _AWAY * 4 * scale
    sheet = _divided(_cube(0)[:2] - (0, 0, 1), 3) @ turn * scale + place
    floor = (_cube(0)[:2] - (0, 0, 2)) @ turn * scale + place
    normal = _normals(sheet)[0]
    core = _core_of(_mesh(np.concatenate([sheet, floor])))
    shares = random.dirichlet((1, 1, 1), (2, rays))
    on_sheet, on_floor = (
        np.einsum("nk,nkd->nd", share, corners[random.integers(0, len(corners), rays)])
        for share, corners in zip(shares, (sheet, floor), strict=True)
    )
    above = on_floor + 0.5 * scale * normal
    seen = core.rays(above, on_floor - above)
    points, _, _, _, _ = core.leaving(seen, normal)
    counts = dict.fromkeys(ENDS, 0.0)
    for behind, hidden in ((0.0, False), (_THIN * 4 * scale, True)):
        apart = on_sheet + behind * normal - points
        distances = np.linalg.norm(apart, axis=1)
        directions = apart / distances[:, None]
        _, _, _, starts, lengths = core.leaving(seen, directions, distances)
        for name, end in ENDS.items():
            length = lengths if end is None else end(distances) * distances
            met = core.occluded(core.rays(starts, directions, 0.0, length))
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
