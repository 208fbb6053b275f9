"""Spheres and ellipsoids where their intersection loses its digits.

They are far away, grazed, stretched, far from the origin, or have the eye on them. Two things are measured for each ray:
whether hit or miss is decided right, and the relative error of the depth where both the truth and the method say hit. The
truth is the quadric itself in 60 digits, of the very float64 numbers that the methods are given. An eye inside a sphere sees
nothing, as in Cycles, and that counts as right.

Candidates, each in float32 and in float64: the textbook's quadratic; the same with the near root as c/q (Press et al.,
Numerical Recipes, 5.6); and that with the discriminant of the perpendicular from the center to the ray (Haines et al., Ray
Tracing Gems, 2019, ch. 7). They are given the center less the eye, subtracted in their own precision. Ours is
tracer/core/shapes/sphere.h.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import mpmath
import numpy as np
from numpy.typing import NDArray

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.native import CoreScene
from viewcam_addon.tracer.scene import Object, Scene, Spheres

from ..charts import Chart, Curve

Array = NDArray[np.float64]
Formula = Callable[[Array, Array, Array], Array]

# Half a dozen roundings of float64 in a depth.
TIE = 6 * 2.0**-53
# Rays that meet a surface at a cosine of 0.1 slide ten times as far along it; flatter ones have a chart of their own.
SLANTED_TIE = 10 * TIE
_FLATTEST = 0.1
# Shares of rays that differ by less than this are the same share of a few hundred.
SHARE_TIE = 0.01
_FORWARD = np.array([0.0, 0.0, -1.0])
_DIGITS = 60


@dataclass(frozen=True)
class Shots:
    """n rays at n spheres of one object.

    matrix : (4, 4), object to world.
    centers : (3, n), object space.
    radii : (n,).
    eye : (3,), world space.
    x, y : (n,): the rays are (x, y, −1) in world space.
    """

    matrix: Array
    centers: Array
    radii: Array
    eye: Array
    x: Array
    y: Array


def charts(quick: bool = False) -> tuple[Chart, ...]:
    rays = 60 if quick else 2000
    distance, decisions = _measured(_far_away, 10.0 ** np.arange(0.5, 17.5), rays)
    grazing_depth, grazing = _measured(_grazed, 10.0 ** -np.arange(0.0, 18), rays, flattest=0.0)
    near, near_decisions = _measured(_from_nearby, 10.0 ** -np.arange(0.0, 17), rays)
    stretched, _ = _measured(_stretched, 10.0 ** np.arange(-6.0, 7), rays)
    far, _ = _measured(_far_from_origin, 10.0 ** np.arange(0.0, 13), rays)
    depth, share = "largest relative error of the depth", "share of rays for which hit or miss is decided wrongly"
    return (
        Chart(
            "spheres-distance",
            "Small spheres far away: depth",
            "distance of the center / radius",
            depth,
            distance,
            "Read where a curve leaves the floor. The textbook's discriminant loses the square of the distance, that of the "
            "perpendicular nothing that a depth would show; ours is its float64.",
            tie=TIE,
        ),
        Chart(
            "spheres-distance-decisions",
            "Small spheres far away: hit or miss",
            "distance of the center / radius",
            share,
            decisions,
            "Rays aimed evenly at the disc and a tenth of its radius beyond. Ours errs for one ray in two thousand from 1e13 "
            "radii on, where the last bit of the ray's own direction is a thousandth of the sphere.",
            tie=SHARE_TIE,
        ),
        Chart(
            "spheres-grazing",
            "Rays along the silhouette: hit or miss",
            "distance of the ray from the silhouette / radius",
            share,
            grazing,
            "Spheres three to thirty radii away; half of the rays pass inside the silhouette. Ours decides right down to the "
            "rounding of the ray's direction, some 1e-15 of the radius.",
            tie=SHARE_TIE,
            reverse=True,
        ),
        Chart(
            "spheres-grazing-depth",
            "Rays along the silhouette: depth",
            "distance of the ray from the silhouette / radius",
            depth,
            grazing_depth,
            "Near the silhouette the depth depends on the root of a difference: every method loses half of the digits there.",
            tie=TIE,
            reverse=True,
        ),
        Chart(
            "spheres-near",
            "The eye near the surface: depth",
            "distance of the eye from the surface / radius",
            depth,
            near,
            "The nearer the eye, the more |f|² − 1 cancels: the others lose all digits at their precision's last bit. Ours "
            "sums the squares in pairs of float64 and keeps its digits where the eye stands 1e-16 radii outside.",
            tie=TIE,
            reverse=True,
        ),
        Chart(
            "spheres-near-decisions",
            "The eye near the surface, outside and inside: hit or miss",
            "distance of the eye from the surface / radius",
            share,
            near_decisions,
            "Half of the eyes stand inside, where nothing is to be seen. Ours knows on which side the eye is to the last bit "
            "of its coordinates.",
            tie=SHARE_TIE,
            reverse=True,
        ),
        Chart(
            "spheres-stretched",
            "Ellipsoids: depth",
            "scale of one axis",
            depth,
            stretched,
            "Discs on the left, needles on the right, turned at random. Methods in float64 that take the perpendicular are as "
            "exact as the ray itself, whose last bit slides along a surface that it meets at a flat angle.",
            tie=SLANTED_TIE,
        ),
        Chart(
            "spheres-far-from-origin",
            "Spheres of a turned object far from the origin: depth",
            "distance of eye and sphere from the origin / radius",
            depth,
            far,
            "The others subtract the eye from a center that was rounded in world space. Ours takes the eye into the object's "
            "space as a pair of float64: its depth does not know where the origin is.",
            tie=SLANTED_TIE,
        ),
    )


def _far_away(distance: float, rays: int, random: np.random.Generator) -> Shots:
    centers = _centers(distance, rays, random)
    offset = 1.1 * np.sqrt(random.uniform(0, 1, rays))
    return _aimed(np.eye(4), centers, np.ones(rays), offset, random)


def _grazed(gap: float, rays: int, random: np.random.Generator) -> Shots:
    centers = _centers(10 ** random.uniform(0.5, 1.5, rays), rays, random)
    return _aimed(np.eye(4), centers, np.ones(rays), 1 + gap * random.choice([-1, 1], rays), random)


def _from_nearby(gap: float, rays: int, random: np.random.Generator) -> Shots:
    """Eyes near a surface, each at the origin before its own sphere, looking anywhere before them."""
    centers = _centers(1 + gap * random.choice([-1, 1], rays), rays, random, 1.4)
    across = random.normal(size=(2, rays))
    return Shots(np.eye(4), centers, np.ones(rays), np.zeros(3), *across)


def _stretched(scale: float, rays: int, random: np.random.Generator) -> Shots:
    matrix = np.eye(4)
    turned, _ = np.linalg.qr(random.normal(size=(3, 3)))
    matrix[:3, :3] = turned @ np.diag([1.0, 1.0, scale])
    matrix[2, 3] = -5 * max(scale, 1)
    surface = random.normal(size=(3, rays))
    surface /= np.linalg.norm(surface, axis=0)
    x, y, z = matrix[:3, :3] @ surface + matrix[:3, 3:]
    return Shots(matrix, np.zeros((3, rays)), np.ones(rays), np.zeros(3), -x / z, -y / z)


def _far_from_origin(distance: float, rays: int, random: np.random.Generator) -> Shots:
    matrix = np.eye(4)
    matrix[:3, :3], _ = np.linalg.qr(random.normal(size=(3, 3)))
    centers = np.repeat(random.normal(size=(3, 1)) * distance, rays, axis=1)
    eye = matrix[:3, :3] @ centers[:, 0] + (0.3, 0.2, 5)
    surface = random.normal(size=(3, rays))
    x, y, z = matrix[:3, :3] @ centers + surface / np.linalg.norm(surface, axis=0) - eye[:, None]
    return Shots(matrix, centers, np.ones(rays), eye, -x / z, -y / z)


def _centers(distance: float | Array, rays: int, random: np.random.Generator, spread: float = 0.5) -> Array:
    """(3, n) points at these distances from the origin, in the directions of a picture."""
    directions = np.stack([*random.uniform(-spread, spread, (2, rays)), np.full(rays, -1.0)])
    return directions / np.linalg.norm(directions, axis=0) * distance


def _aimed(matrix: Array, centers: Array, radii: Array, offset: Array, random: np.random.Generator) -> Shots:
    """Rays from the origin that pass the centers at `offset` radii."""
    distance = np.linalg.norm(centers, axis=0)
    towards = centers / distance
    aside = np.cross(towards.T, random.normal(size=centers.shape).T).T
    aside /= np.linalg.norm(aside, axis=0)
    sine = np.minimum(offset * radii / distance, 1)
    x, y, z = towards * np.sqrt(1 - sine * sine) + aside * sine
    return Shots(matrix, centers, radii, np.zeros(3), -x / z, -y / z)


def _measured(
    shots: Callable[..., Shots], sweep: Array, rays: int, flattest: float = _FLATTEST
) -> tuple[tuple[Curve, ...], tuple[Curve, ...]]:
    """The curves of the depth's errors, of rays that meet the surface at this cosine or more, and of the wrong decisions."""
    result: dict[str, list[tuple[float, float]]] = {}
    for x in sweep:
        aimed = shots(x, rays, np.random.default_rng(3))
        truth, cosine = np.array(list(_true_depths(aimed))).T
        for name, depths in _found_depths(aimed):
            result.setdefault(name, []).append(_errors(depths, truth, cosine >= flattest))
    return tuple(
        tuple(Curve(name, sweep, [errors[kind] for errors in values], name == "ours") for name, values in result.items())
        for kind in range(2)
    )


def _errors(depths: Array, truth: Array, counted: NDArray[np.bool_]) -> tuple[float, float]:
    """Largest relative error of the depth where it counts and both hit, nan if none does; share of wrong decisions."""
    both = np.isfinite(depths) & np.isfinite(truth) & counted
    largest = np.abs(depths[both] / truth[both] - 1).max() if both.any() else np.nan
    return largest, np.mean(np.isfinite(depths) != np.isfinite(truth))


def _true_depths(shots: Shots) -> Iterator[tuple[float, float]]:
    """The depth of each ray, inf where it misses, and the cosine at which it meets the unit sphere that the ellipsoid was."""
    with mpmath.workdps(_DIGITS):
        matrix = mpmath.matrix(shots.matrix.tolist())
        linear = matrix[:3, :3]
        inverse = mpmath.eye(3) if np.array_equal(shots.matrix, np.eye(4)) else linear**-1
        away = inverse * (matrix[:3, 3] - mpmath.matrix(shots.eye.tolist()))
        columns = [[inverse[row, column] for row in range(3)] for column in range(3)]
        for *center, radius, x, y in zip(
            *shots.centers.tolist(), shots.radii.tolist(), shots.x.tolist(), shots.y.tolist(), strict=True
        ):
            f = [a + c for a, c in zip(away, center, strict=True)]
            d = [mpmath.mpf(x) * a + mpmath.mpf(y) * b - c for a, b, c in zip(*columns, strict=True)]
            square, along = mpmath.fdot(d, d), mpmath.fdot(f, d)
            tangent = mpmath.fdot(f, f) - mpmath.mpf(radius) ** 2
            discriminant = along * along - square * tangent
            seen = tangent > 0 and along > 0 and discriminant >= 0
            if seen:
                root = mpmath.sqrt(discriminant)
                yield float(tangent / (along + root)), float(root / mpmath.sqrt(square) / mpmath.mpf(radius))
            else:
                yield np.inf, 0.0


def _found_depths(shots: Shots) -> Iterator[tuple[str, Array]]:
    formulas = {"textbook's quadratic": _textbook, "quadratic, near root c/q": _stable, "perpendicular, c/q": _perpendicular}
    for bits, dtype in ((32, np.float32), (64, np.float64)):
        for name, formula in formulas.items():
            with np.errstate(all="ignore"):
                yield f"{name}, float{bits}", _in_unit_space(shots, dtype, formula).astype(float)
    yield "ours", _ours(shots)


def _in_unit_space(shots: Shots, dtype: type, formula: Formula) -> Array:
    matrix = shots.matrix.astype(dtype)
    center = matrix[:3, :3] @ shots.centers.astype(dtype) + matrix[:3, 3:] - shots.eye.astype(dtype)[:, None]
    ray = np.stack([shots.x, shots.y, np.full(len(shots.x), -1.0)]).astype(dtype)
    inverse = np.linalg.inv(matrix[:3, :3])
    return formula(inverse @ center, inverse @ ray, shots.radii.astype(dtype))


def _textbook(f: Array, d: Array, radius: Array) -> Array:
    square, along, constant = dot(d, d), dot(f, d), dot(f, f) - radius * radius
    discriminant = along * along - square * constant
    depth = (along - np.sqrt(discriminant)) / square
    return np.where((discriminant >= 0) & (constant > 0) & (depth > 0), depth, np.inf)


def _stable(f: Array, d: Array, radius: Array) -> Array:
    square, along, constant = dot(d, d), dot(f, d), dot(f, f) - radius * radius
    discriminant = along * along - square * constant
    return _near_root(along, discriminant, constant)


def _perpendicular(f: Array, d: Array, radius: Array) -> Array:
    square, along, constant = dot(d, d), dot(f, d), dot(f, f) - radius * radius
    beside = f - along / square * d
    return _near_root(along, square * (radius * radius - dot(beside, beside)), constant)


def _near_root(along: Array, discriminant: Array, constant: Array) -> Array:
    seen = (discriminant >= 0) & (constant > 0) & (along > 0)
    return np.where(seen, constant / (along + np.sqrt(discriminant)), np.inf)


def _ours(shots: Shots) -> Array:
    """The core's own, called: each ray with its sphere alone, which another's must not hide."""
    camera = Pinhole(tuple(shots.eye), tuple(shots.eye + _FORWARD), (0, 1, 0), 1, 1, 1)
    depths = []
    for center, radius, x, y in zip(shots.centers.T, shots.radii, shots.x, shots.y, strict=True):
        spheres = Spheres(center[None].copy(), np.array([radius]), np.zeros(1, np.int32))
        core = CoreScene(Scene(camera, {"spheres": spheres}, (Object("ellipsoid", "spheres", shots.matrix),)), 1)
        depths.append(core.closest(core.rays(shots.eye[None], np.array([[x, y, -1.0]])))[0][0])
    return np.array(depths)


def dot(a: Array, b: Array) -> Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
