"""Triangles where tests of them leak or lose the depth: at shared edges and vertices, as needles, and seen edge-on.

Leaks are counted on fans: triangles round a common vertex, aimed at that vertex and at the edges that meet there. A ray that
meets none of them has leaked; one that more than one of them reports is a double hit, which a shadow ray does not mind and a
ray that counts what it passes through does. Depths are measured on single triangles, against rational arithmetic on the very
float64 numbers that the methods are given.

Candidates, given the corners relative to the eye: Möller and Trumbore (Fast, minimum storage ray/triangle intersection, 1997)
in float32 and float64; Woop, Benthin and Wald (Watertight ray/triangle intersection, 2013) in both, in float32 with its way out
to float64; Embree, robust and not, with its own float32 depth. Ours is the tracer's core (core/shapes/triangle_mesh.h), which
traces rays in packets and one by one; its depths are those that it shows.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.native import CoreScene
from viewcam_addon.tracer.scene import Mesh, Object, Scene

from ..charts import Chart, Curve

Array = NDArray[np.floating]

# Some twenty roundings of float64 in a depth, of which the worst of a hundred are looked at.
TIE = 16 * 2.0**-53
# The error by half a unit in the last place of the ray's direction.
LAST_BIT = 2.0**-53
# A share of a few hundred rays that none makes.
SHARE_TIE = 1e-3
# A count of rays in a million that one ray in all of them could be.
RARE = 1.0
# The first triangles of a scene that are the ground's.
_GROUND = 2
# Looking down −z from the origin with y up: camera space is the world with z turned round, exactly.
_CAMERA = Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 1, 1, 1)
_TO_WORLD = np.array([1.0, 1.0, -1.0])


def charts(quick: bool = False) -> tuple[Chart, ...]:
    leaks, double = _leaks(10.0 ** np.arange(0.0, 5.5, 1.0 if quick else 0.5), 30 if quick else 2000)
    triangles, rays = (6, 8) if quick else (60, 20)
    slivers = _depth_errors(_sliver, 10.0 ** np.arange(0.0, 13.0), triangles, rays)
    cosines = 10.0 ** -np.arange(0.0, 8.0)
    grazing = tuple(replace(curve, y=curve.y * cosines) for curve in _depth_errors(_grazed, cosines, triangles, rays))
    ground = _seen_on_the_ground(10.0 ** np.arange(0.5, 9.5), 4 if quick else 50)
    depth = "relative error of the depth, 90 % are within"
    return (
        Chart(
            "triangles-leaks",
            "Rays at shared edges and vertices that meet nothing",
            "distance / size of the triangles",
            "leaks per million rays",
            leaks,
            "Möller and Trumbore's test leaks one ray in ten to twenty at any distance, in float64 as in float32, and so does "
            "Embree outside of its robust mode; within, at vertices. Ours leaks nowhere, in packets and one by one. The sweep "
            "ends where a triangle is as small as some hundred roundings of float32.",
            tie=RARE,
        ),
        Chart(
            "triangles-double-hits",
            "Rays at shared edges and vertices that more than one triangle reports",
            "distance / size of the triangles",
            "double hits per million rays",
            double,
            "Counted and not judged: transparency would have to know, but here only the nearest surface is asked for. What "
            "does not leak reports edges twice, and vertices as often as triangles meet there.",
            tie=math.inf,
        ),
        Chart(
            "triangles-slivers",
            "Slender triangles: depth",
            "longest side / height",
            depth,
            slivers,
            "A triangle's normal is a difference of products that are as much larger as the triangle is slender. Ours takes "
            "that difference of a slender one exactly, and the depth does not know how slender it is.",
            tie=TIE,
        ),
        Chart(
            "triangles-grazing",
            "Triangles seen edge-on: depth",
            "cosine between ray and normal",
            "relative error of the depth times the cosine, 90 % are within",
            grazing,
            "The last bit of a ray slides along the surface by one over the cosine: a flat curve is as good as its ray. "
            "All are, each at its precision; ours at that of float64.",
            tie=LAST_BIT,
            reverse=True,
        ),
        Chart(
            "triangles-ground",
            "A ground plane and a mat on it, a ten-thousandth of the eye's height thick",
            "extent of the ground / height of the eye",
            "share of rays at the mat that meet something else",
            ground,
            "Float32 rounds the distance of a plane with the coordinates of its farthest corner: the ground rises over the "
            "mat, sinks below it or is missed. Ours tests all triangles in float64.",
            tie=SHARE_TIE,
        ),
    )


def _leaks(ratios: Array, fans: int) -> tuple[tuple[Curve, ...], tuple[Curve, ...]]:
    counts: dict[str, list[tuple[float, float]]] = {}
    for ratio in ratios:
        for name, hits in _hits_of_fans(1 / ratio, fans, np.random.default_rng(6)):
            counts.setdefault(name, []).append((1e6 * np.mean(hits == 0), 1e6 * np.mean(hits > 1)))
    leaks, double = (
        tuple(Curve(name, ratios, [pair[kind] for pair in pairs], name.startswith("ours")) for name, pairs in counts.items())
        for kind in range(2)
    )
    return leaks, double


def _hits_of_fans(size: float, fans: int, random: np.random.Generator) -> Iterator[tuple[str, Array]]:
    """The number of triangles of its fan that each ray meets.

    size : the triangles' size, in distances.
    """
    side = int(np.clip(0.4 / size, 1, 16))  # fans stand in a square, apart from one another
    groups = [_Fans(size, side, random) for _ in range(min(60, -(-fans // side**2)))]
    for name, test in _FORMULAS.items():
        yield name, np.concatenate([group.hits(lambda *rays, test=test: np.isfinite(test(*rays))) for group in groups])
    for name, robust in (("Embree", False), ("Embree, robust", True)):
        yield name, np.concatenate([group.first_hits(lambda *rays, r=robust: _embree_depth(*rays, r)) for group in groups])
    for name, packets in (("ours", True), ("ours, one by one", False)):
        counts = np.concatenate([group.first_hits(lambda *rays, p=packets: _core_depth(*rays, p)) for group in groups])
        values = np.concatenate([np.isfinite(_core_depth(group.corners, group.x, group.y, packets)) for group in groups])
        yield name, np.where(values, np.maximum(counts, 1), 0)


class _Fans:
    """Fans of six triangles, and rays at their common vertices and at the edges that meet there.

    corners : (3, m, 3): [corner, triangle, axis], camera space; six triangles after another make a fan.
    x, y : (n,) rays.
    fan : (n,) which one each ray is aimed at.
    """

    _TRIANGLES, _RAYS = 6, 24

    def __init__(self, size: float, side: int, random: np.random.Generator) -> None:
        count, n = side**2, self._TRIANGLES
        place = (np.stack(np.divmod(np.arange(count), side), axis=-1) + 0.5) / side * 2 - 1
        center = place + random.uniform(-0.1, 0.1, (count, 2)) / side
        depth = np.exp(random.uniform(-0.7, 0.7, count))
        angle = 2 * np.pi * (np.arange(n) + random.uniform(-0.3, 0.3, (count, n))) / n
        reach = size * random.uniform(0.5, 1, (count, n))
        rim = center[:, None] + reach[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        rim_depth = depth[:, None] * (1 + 0.5 * size * random.uniform(-1, 1, (count, n)))
        middle = np.concatenate([center, np.ones((count, 1))], axis=1) * depth[:, None]
        ring = np.concatenate([rim, np.ones((count, n, 1))], axis=2) * rim_depth[..., None]
        corners = np.stack([np.repeat(middle[:, None], n, axis=1), ring, np.roll(ring, -1, axis=1)]).reshape(3, -1, 3)
        start = random.integers(0, 3, corners.shape[1])  # which corner a triangle names first
        self.corners = corners[(start + np.arange(3)[:, None]) % 3, np.arange(corners.shape[1])]
        self.fan = np.repeat(np.arange(count), self._RAYS)
        share = random.uniform(0, 0.9, len(self.fan)) * random.integers(0, 2, len(self.fan))
        end = ring[self.fan, random.integers(0, n, len(self.fan))]
        aimed = middle[self.fan] * (1 - share[:, None]) + end * share[:, None]
        self.x, self.y = aimed[:, 0] / aimed[:, 2], aimed[:, 1] / aimed[:, 2]

    def hits(self, test: Callable[..., Array]) -> Array:
        """The number of triangles of its fan that a test says each ray meets."""
        result = np.zeros(len(self.fan), int)
        for number in range(self._TRIANGLES):
            a, b, c = self.corners[:, self.fan * self._TRIANGLES + number].transpose(0, 2, 1)
            result += test(a, b, c, self.x, self.y)
        return result

    def first_hits(self, depth: Callable[..., Array]) -> Array:
        """`hits` for a test that reports the first hit only: a scene for the first triangles of the fans, and so on."""
        result = np.zeros(len(self.fan), int)
        for number in range(self._TRIANGLES):
            result += np.isfinite(depth(self.corners[:, number :: self._TRIANGLES], self.x, self.y))
        return result


def _depth_errors(shape: Callable[..., Array], sweep: Array, count: int, rays: int) -> tuple[Curve, ...]:
    """Errors of the depths of nine in ten rays that meet the insides of triangles of a shape."""
    errors: dict[str, list[float]] = {}
    for value in sweep:
        random = np.random.default_rng(8)
        corners = np.stack([shape(value, random) for _ in range(count)], axis=1)
        weights = random.dirichlet((2, 2, 2), (count, rays))
        aimed = np.einsum("crk,kcx->crx", weights, corners)
        x, y = aimed[..., 0] / aimed[..., 2], aimed[..., 1] / aimed[..., 2]
        truth = np.array([_true_depths(*corners[:, i], x[i], y[i]) for i in range(count)])
        for name, depth in _depths(corners, x, y):
            error = np.nan_to_num(np.abs(depth / truth - 1), nan=np.inf)
            errors.setdefault(name, []).append(float(np.quantile(error, 0.9, method="higher")))
    return tuple(Curve(name, sweep, np.array(values), name == "ours") for name, values in errors.items())


def _sliver(slenderness: float, random: np.random.Generator) -> Array:
    """(3, 3) corners of a triangle whose longest side is 1, seen at a cosine of 0.5 or more from some three units away."""
    along, across = _plane(random.uniform(0.5, 1), random)
    third = along * random.uniform(-0.3, 0.3) + across / slenderness
    return _placed(np.stack([along / 2, -along / 2, third]), random)


def _grazed(cosine: float, random: np.random.Generator) -> Array:
    """(3, 3) corners of a triangle of size 1 that is seen at this cosine."""
    along, across = _plane(cosine, random)
    angles = random.uniform(0, 2 * np.pi) + 2 * np.pi / 3 * (np.arange(3) + random.uniform(-0.2, 0.2, 3))
    return _placed((np.cos(angles)[:, None] * along + np.sin(angles)[:, None] * across) / 2, random)


def _plane(cosine: float, random: np.random.Generator) -> Array:
    """Two unit vectors that span a plane which the view axis meets at a cosine to its normal."""
    angle = random.uniform(0, 2 * np.pi)
    normal = np.array([*(np.sqrt(1 - cosine**2) * np.array([np.cos(angle), np.sin(angle)])), cosine])
    first = np.cross(normal, random.normal(size=3))
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first)])


def _placed(corners: Array, random: np.random.Generator) -> Array:
    """Corners round the origin, moved to where the camera looks."""
    return corners + np.array([0, 0, random.uniform(2.5, 4)])


def _seen_on_the_ground(extents: Array, count: int) -> tuple[Curve, ...]:
    """The share of rays at a mat on a ground that do not meet the mat."""
    lost: dict[str, list[float]] = {}
    for extent in extents:
        random = np.random.default_rng(9)
        result: dict[str, list[Array]] = {}
        for _ in range(count):
            for name, triangle in _first_on_the_ground(extent, random):
                result.setdefault(name, []).append(triangle)
        for name, triangles in result.items():
            lost.setdefault(name, []).append(float(np.mean(np.stack(triangles) < _GROUND)))
    return tuple(Curve(name, extents, shares, name == "ours") for name, shares in lost.items())


def _first_on_the_ground(extent: float, random: np.random.Generator) -> Iterator[tuple[str, Array]]:
    """Each method's first triangle, −1 if none: those of the ground, then those of a mat at which all rays are aimed.

    extent : the ground's extent, in heights of the eye.
    """
    angles = np.pi / 2 * (np.arange(4) + random.uniform(-0.4, 0.4, 4))
    ground = np.stack([np.cos(angles), np.sin(angles), np.zeros(4)], axis=-1) * extent * random.uniform(0.6, 1, (4, 1))
    mat = np.array([[-0.4, 0.7, 1e-4], [0.4, 0.7, 1e-4], [0.4, 1.7, 1e-4], [-0.4, 1.7, 1e-4]])
    u, v, w = Pinhole((0, 0, 1), (*random.uniform(-0.2, 0.2, 2), 0), (0, 1, 0), 1, 1, 1).basis()
    points = (np.concatenate([ground, mat]) - (0, 0, 1)) @ np.stack([u, v, -w]).T
    corners = points[np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]).T]
    weights = random.dirichlet((1, 1, 1), 40)
    aimed = np.concatenate([weights @ corners[:, 2], weights @ corners[:, 3]])
    x, y = aimed[:, 0] / aimed[:, 2], aimed[:, 1] / aimed[:, 2]
    for name, depth in _depths(corners, np.tile(x, (4, 1)), np.tile(y, (4, 1))):
        if name in _FORMULAS:
            nearest = np.where(np.isnan(depth), np.inf, depth)
            yield name, np.where(np.isfinite(nearest).any(axis=0), nearest.argmin(axis=0), -1)
    for name, robust in (("Embree", False), ("Embree, robust", True)):
        yield name, _embree(corners, x, y, robust, "INTERSECT")
    core, rays = _core(corners, x, y)
    yield "ours", core.closest(rays)[2]


def _true_depths(a: Array, b: Array, c: Array, x: Array, y: Array) -> list[float]:
    """Depths at which rays meet a plane, in rational arithmetic."""
    a, b, c = ([Fraction(value) for value in corner.tolist()] for corner in (a, b, c))
    p, q = ([end - start for start, end in zip(a, other, strict=True)] for other in (b, c))
    normal = [p[i - 2] * q[i - 1] - p[i - 1] * q[i - 2] for i in range(3)]
    height = sum(n * value for n, value in zip(normal, a, strict=True))
    return [float(height / (normal[0] * Fraction(i) + normal[1] * Fraction(j) + normal[2])) for i, j in zip(x, y, strict=True)]


def _depths(corners: Array, x: Array, y: Array) -> Iterator[tuple[str, Array]]:
    """(m, n) depths of n rays for each of m triangles."""
    a, b, c = corners.transpose(0, 2, 1)[..., None]
    for name, test in _FORMULAS.items():
        yield name, test(a, b, c, x, y)
    for name, robust in (("Embree", False), ("Embree, robust", True)):
        yield name, np.stack([_embree_depth(corners[:, [i]], x[i], y[i], robust) for i in range(len(x))])
    yield "ours", np.stack([_shown_depth(corners[:, [i]], x[i], y[i]) for i in range(len(x))])


def _core(corners: Array, x: Array, y: Array) -> tuple[CoreScene, Array]:
    """(3, m, 3) corners in camera space and n rays, as the core takes them."""
    vertices, place = np.unique(corners.transpose(1, 0, 2).reshape(-1, 3), axis=0, return_inverse=True)
    mesh = Mesh(vertices * _TO_WORLD, place.reshape(-1, 3).astype(np.int32), np.zeros(corners.shape[1], np.int32))
    core = CoreScene(Scene(_CAMERA, {"mesh": mesh}, (Object("triangles", "mesh", np.eye(4)),)), 1)
    return core, core.rays(np.zeros((1, 3)), np.stack([x, y, np.ones_like(x)], axis=1) * _TO_WORLD)


def _core_depth(corners: Array, x: Array, y: Array, packets: bool) -> Array:
    """The depths at which the core first meets something, inf where nothing is."""
    core, rays = _core(corners, x, y)
    return core.closest(rays, packets=packets)[0]


def _shown_depth(corners: Array, x: Array, y: Array) -> Array:
    """Depths as the core shows them, nan where nothing is."""
    core, rays = _core(corners, x, y)
    return core.leaving(rays, np.array([0.0, 0.0, 1.0]))[2]


def _embree_depth(corners: Array, x: Array, y: Array, robust: bool) -> Array:
    """Embree's own float32 depths, nan where it finds nothing. corners : (3, m, 3)."""
    depth = _embree(corners, x, y, robust, "DISTANCE").astype(float)
    return np.where(depth < 1e30, depth, np.nan)


def _embree(corners: Array, x: Array, y: Array, robust: bool, query: str) -> Array:
    scene = EmbreeScene(robust=robust)
    vertices, place = np.unique(corners.transpose(1, 0, 2).reshape(-1, 3), axis=0, return_inverse=True)
    TriangleMesh(scene, vertices.astype(np.float32), place.reshape(-1, 3).astype(np.int32))
    rays = np.stack([x, y, np.ones_like(x)], axis=1).astype(np.float32)
    return scene.run(np.zeros_like(rays), rays, query=query)


def _moller_trumbore(a: Array, b: Array, c: Array, x: Array, y: Array) -> Array:
    first, second = b - a, c - a
    ray = np.stack([x, y, np.ones_like(x)])
    p = np.cross(ray, np.broadcast_to(second, ray.shape), axis=0)
    determinant = _dot(first, p)
    u = _dot(-a, p) / determinant
    q = np.cross(-a, first, axis=0)
    v = _dot(ray, q) / determinant
    depth = _dot(second, q) / determinant
    return np.where((determinant != 0) & (u >= 0) & (v >= 0) & (u + v <= 1) & (depth > 0), depth, np.nan)


def _watertight(a: Array, b: Array, c: Array, x: Array, y: Array) -> Array:
    """The z axis is the ray's greatest, as the picture reaches no farther than 45° from it."""
    a_x, b_x, c_x = (corner[0] - x * corner[2] for corner in (a, b, c))
    a_y, b_y, c_y = (corner[1] - y * corner[2] for corner in (a, b, c))
    u, v, w = c_x * b_y - c_y * b_x, a_x * c_y - a_y * c_x, b_x * a_y - b_y * a_x
    if u.dtype == np.float32:
        doubt = (u == 0) | (v == 0) | (w == 0)
        a_x, b_x, c_x, a_y, b_y, c_y = (value.astype(float) for value in (a_x, b_x, c_x, a_y, b_y, c_y))
        finer = c_x * b_y - c_y * b_x, a_x * c_y - a_y * c_x, b_x * a_y - b_y * a_x
        u, v, w = (np.where(doubt, fine, value).astype(np.float32) for fine, value in zip(finer, (u, v, w), strict=True))
    determinant = u + v + w
    depth = (u * a[2] + v * b[2] + w * c[2]) / determinant
    inside = ((u >= 0) & (v >= 0) & (w >= 0)) | ((u <= 0) & (v <= 0) & (w <= 0))
    return np.where(inside & (determinant != 0) & (depth > 0), depth, np.nan)


def _dot(a: Array, b: Array) -> Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _in_precision(test: Callable[..., Array], dtype: type) -> Callable[..., Array]:
    def rounded(*arrays: Array) -> Array:
        with np.errstate(all="ignore"):
            return test(*(values.astype(dtype) for values in arrays)).astype(float)

    return rounded


_FORMULAS = {
    f"{name}, float{bits}": _in_precision(test, dtype)
    for name, test in (("Möller–Trumbore", _moller_trumbore), ("watertight", _watertight))
    for bits, dtype in ((32, np.float32), (64, np.float64))
}
