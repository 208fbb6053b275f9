"""A camera from a photograph: from edges that run along known axes, or from points whose places are known.

Pixels count from the lower left corner of the picture, with centers at + 0.5, and are square. What is unknown is d, unless the
lens is known, the turn of the camera and the eye: points tell it, and so does one edge of known length and place. The principal
point is given (the picture's middle, unless it is known better), or free where edges along all three axes tell it: it is the
orthocenter of their vanishing points.

An edge is where the picture of a straight line begins and ends; which way it was drawn says which way its axis points, and so
two axes are enough for one camera without a mirror image. All of an axis' edges meet in its vanishing point, and by how far
they miss it is weighed in pixels of their ends. A start comes from vanishing points (edges), a homography (points in a plane)
or a direct linear transform (six or more points in space); then Gauss-Newton steps, damped as Levenberg and Marquardt have it,
minimize the sum of squares in pixels. How certain the result is follows from how well pixels are known: the covariance is
precision² · (JᵀJ)⁻¹.

Everything runs over leading axes (..., n, 2), so that ten thousand cameras are matched at once; `from_edges`, `from_points` and
`from_rectangle` are for one, and say what is wrong. Rejected: scipy and OpenCV, which Blender does not have; a search for more
than one answer (a plane seen nearly head-on has two, and the better one is found from its homography).

Sources: B. Caprile and V. Torre, Using vanishing points for camera calibration (1990); Z. Zhang, A flexible new technique for
camera calibration (2000), for the homography's constraint; R. Hartley and A. Zisserman, Multiple View Geometry (2004), 7.1.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import checks
from .errors import InputError, counted
from .pinhole import Pinhole, Triple, check_distance

Array = NDArray[np.float64]

_STEPS = 60
_CONVERGED = 1e-11  # share of the parameters: one step more would change them by their rounding
_SHORTEST, _LONGEST = 0.02, 200.0  # d of a start, of half the picture's larger side
_LARGEST_ERROR = math.log(2.0)  # d's, as a factor: a less certain one is no answer
_LARGEST_SHIFT = 0.5  # the principal point's, in halves of the picture's larger side: a less certain one is no answer
_OPEN = 1e-13  # an eigenvalue of 7 by 7 numbers near 1 that is less than this is rounding
# The share of the coordinates' spread within which a point is in a plane.
_FLAT = 1e-6


@dataclass(frozen=True)
class Match:
    """A camera that was found.

    pinhole : the camera.
    precision : the standard deviation with which the pixels were known.
    error : root mean square in pixels of what is left, 0 where there was nothing to spare.
    distance_between : d with a probability of 68 %, lowest and highest.
    eye_error : one standard deviation along each axis, world units; None where the eye is not asked.
    principal_point_error : one standard deviation of column and row, pixels; None where it was fixed.
    pixels : the pixels by which the picture moves as each value goes off by one standard deviation: "look_at" (where its middle
        is), "up" (the roll, at the corners), "distance" (the lens, at the corners), and "eye" and "principal_point" where they
        are asked.
    """

    pinhole: Pinhole
    precision: float
    error: float
    distance_between: tuple[float, float]
    eye_error: Triple | None
    principal_point_error: tuple[float, float] | None
    pixels: dict[str, float]


@dataclass(frozen=True, eq=False)
class Solution:
    """Cameras that were found, over leading axes.

    rotation : (..., 3, 3), its rows are u, v, w.
    eye : (..., 3); of edges, which don't tell it, 0.
    principal_point : (..., 2) pixels from the one that was given, 0 where it is fixed.
    distance : (...).
    residuals : (..., m) in pixels.
    covariance : (..., p, p) for a precision of one pixel, of the turn about u, v and w in radians, of log d, and then of the
        eye (points), of the principal point (edges, where it is free) or of nothing more.
    """

    rotation: Array
    eye: Array
    principal_point: Array
    distance: Array
    residuals: Array
    covariance: Array


@dataclass(frozen=True)
class KnownEdge:
    """An edge whose place and size in the world are known.

    edge : its number among the edges.
    length : world units, > 0.
    start : the place where it begins, world space.
    """

    edge: int
    length: float
    start: Triple = (0.0, 0.0, 0.0)


def from_edges(
    edges: Sequence[tuple[str, Any, Any]],
    like: Pinhole,
    precision: float = 1.0,
    distance: float | None = None,
    known: KnownEdge | None = None,
    is_principal_point_free: bool = False,
) -> Match:
    """The camera whose picture has these edges.

    edges : (axis, start, end), at least two along each of two axes.
    axis : "X", "Y" or "Z".
    start, end : (2,) pixels, drawn towards where the axis points.
    like : its eye, distance to the look-at point, size and principal point are kept.
    precision : the standard deviation of start and end, pixels.
    distance : d in pixels where the lens is known.
    known : an edge whose length and place say how far away the camera stands, and where; without it its eye is kept.
    is_principal_point_free : true to find the principal point as well, which takes edges along all three axes; else that of
        `like` is kept.

    Raises InputError if edges are missing or contradict one another, or leave the lens or a free principal point open, or if no
    camera sees the known one so.
    """
    precision = checks.number("precision", precision, least=1e-9)
    named = [axis for axis, *_ in edges]
    if any(axis not in _AXES for axis in named):
        raise InputError(f"an edge runs along {next(axis for axis in named if axis not in _AXES)!r}: choose X, Y or Z")
    enough = [axis for axis in _AXES if named.count(axis) >= 2]
    if len(enough) < 2:
        raise InputError("too few edges: draw two or more along each of two axes")
    if is_principal_point_free and len(enough) < 3:
        raise InputError("too few edges for a free principal point: draw two or more along each of the three axes, or keep it")
    used = [edge for edge in edges if edge[0] in enough]
    axes = np.array([_AXES.index(axis) for axis, *_ in used])
    ends = checks.array("edges", [[start, end] for _, start, end in used])
    if (np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) < 1.0).any():
        raise InputError("an edge is shorter than a pixel: draw it along more of the line")
    from_middle = ends - np.array(like.principal_point)
    known_distance = _known_distance(distance)
    solution, is_mirrored = solve_edges(from_middle, axes, _half(like), known_distance, is_principal_point_free)
    if is_mirrored:
        raise InputError("the edges' directions are those of a mirrored picture: draw each towards where its axis points")
    eye = np.array(like.eye) if known is None else _eye_of(known, edges, solution, like)
    spare = len(used) - (4 if distance is None else 3) - (2 if is_principal_point_free else 0)
    return _match(replace(solution, eye=eye), like, precision, math.dist(like.eye, like.look_at), spare, None)


def _known_distance(distance: float | None) -> float | None:
    if distance is None:
        return None
    distance = checks.number("distance", distance)
    check_distance(distance)
    return distance


def _eye_of(known: KnownEdge, edges: Sequence[tuple[str, Any, Any]], solution: Solution, like: Pinhole) -> Array:
    """The eye of the camera that sees an edge of known length begin in a known place."""
    length = checks.number("length", known.length)
    if length <= 0:
        raise InputError(f"the known edge has a length of {length:g}: give one above 0")
    axis, *ends = edges[known.edge]
    pixels = checks.array("edges", ends) - np.array(like.principal_point) - solution.principal_point
    rays = np.column_stack([pixels, [-solution.distance] * 2]) @ solution.rotation
    # end · second ray − start · first ray is the edge, the shares of the rays by least squares.
    along = length * np.eye(3)[_AXES.index(axis)]
    (start, end), *_ = np.linalg.lstsq(np.column_stack([-rays[0], rays[1]]), along, rcond=None)
    if not (start > 0 and end > 0):
        raise InputError(f"the edge along {axis} whose length is known does not lie before the camera: draw it anew")
    return np.array(checks.vector("start", known.start, 3)) - start * rays[0]


def from_points(
    points: ArrayLike, pixels: ArrayLike, like: Pinhole, precision: float = 1.0, distance: float | None = None
) -> Match:
    """The camera that sees points of known place.

    points : (n, 3) world space; at least four in one plane, or six.
    pixels : (n, 2), where they are in the picture.
    like : its size, principal point and distance to the look-at point are kept.
    precision : the standard deviation of pixels.
    distance : d in pixels where the lens is known.

    Raises InputError if there are too few points, if they lie on a line or in a plane seen head-on, or if no camera sees them
    so.
    """
    precision = checks.number("precision", precision, least=1e-9)
    points, pixels = checks.array("points", points), checks.array("pixels", pixels)
    if points.ndim != 2 or points.shape[1:] != (3,) or pixels.shape != (len(points), 2):
        both = f"{counted(len(points), 'point')} and {counted(len(pixels), 'pixel')}"
        raise InputError(f"{both} do not belong together: give as many of both")
    singular_values = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    is_flat = len(points) < 4 or singular_values[2] <= _FLAT * singular_values[0]
    if len(points) < (4 if is_flat else 6):
        raise InputError(f"only {counted(len(points), 'point')}: give four in one plane, or six in space")
    if singular_values[1] <= _FLAT * singular_values[0]:
        raise InputError("the points lie on one line: give some beside it")
    middle = np.array(like.principal_point)
    solution = solve_points(points, pixels - middle, _half(like), is_flat, _known_distance(distance))
    away = float(np.mean((points - solution.eye) @ -solution.rotation[2]))
    return _match(solution, like, precision, away, 2 * len(points) - (7 if distance is None else 6), away)


def from_rectangle(
    corners: ArrayLike,
    sides: tuple[float, float],
    like: Pinhole,
    precision: float = 1.0,
    origin: Triple = (0.0, 0.0, 0.0),
    axes: str = "XY",
    distance: float | None = None,
) -> Match:
    """The camera that sees a rectangle of known sides.

    corners : (4, 2) pixels: that at the origin, then around, first along the first axis.
    sides : lengths along both axes, world units.
    origin : world space.
    axes : the two that the sides run along, as "XY" on the floor or "XZ" on a wall.
    distance : d in pixels where the lens is known.

    Raises InputError as from_points does, and if a side has no length.
    """
    if len(axes) != 2 or any(axis not in _AXES for axis in axes) or axes[0] == axes[1]:
        raise InputError(f"a rectangle's sides run along {axes!r}: name two axes, such as XY")
    lengths = checks.vector("sides", sides, 2)
    if min(lengths) <= 0.0:
        raise InputError(f"a rectangle has sides of {lengths[0]:g} and {lengths[1]:g}: give lengths above 0")
    first, second = (length * np.eye(3)[_AXES.index(axis)] for length, axis in zip(lengths, axes, strict=True))
    places = np.array(checks.vector("origin", origin, 3)) + np.array([0 * first, first, first + second, second])
    return from_points(places, corners, like, precision, distance)


def solve_edges(
    ends: Array, axes: NDArray[np.int_], half: float, known_distance: float | None = None, is_principal_point_free: bool = False
) -> tuple[Solution, NDArray[np.bool_]]:
    """The cameras of edges, and whether those that were drawn are of a mirrored picture.

    ends : (..., n, 2, 2): edge, end, pixels from the principal point.
    axes : (n,), the number of the world's axis along which each runs.
    half : half of the picture's larger side, pixels.
    known_distance : d in pixels where the lens is known.
    is_principal_point_free : true to find the principal point as well, from edges along all three axes; `ends` count from where
        it may be.
    """
    present = np.unique(axes)
    scaled = np.concatenate([ends / half, np.ones((*ends.shape[:-1], 1))], axis=-1)
    normals = np.cross(scaled[..., 0, :], scaled[..., 1, :])
    normals /= np.linalg.norm(normals[..., :2], axis=-1, keepdims=True)
    vanishing = np.stack([np.linalg.svd(normals[..., axes == axis, :])[2][..., -1, :] for axis in present], axis=-2)
    center = np.zeros((*vanishing.shape[:-2], 2))
    if is_principal_point_free:
        center = _orthocenter(vanishing)
        scaled[..., :2] -= center[..., None, None, :]
        vanishing[..., :2] -= center[..., None, :] * vanishing[..., 2:]
    above = below = 0.0
    for i, j in combinations(range(len(present)), 2):
        across = (vanishing[..., i, :2] * vanishing[..., j, :2]).sum(axis=-1)
        away = vanishing[..., i, 2] * vanishing[..., j, 2]
        above, below = above - across * away, below + away * away
    square = np.where(below > 0.0, above / np.where(below > 0.0, below, 1.0), _LONGEST**2)
    distance = np.sqrt(np.clip(square, _SHORTEST**2, _LONGEST**2))
    if known_distance is not None:
        distance = np.full_like(distance, known_distance / half)
    seen = vanishing * np.stack([1 / distance, 1 / distance, -np.ones_like(distance)], axis=-1)[..., None, :]
    seen /= np.linalg.norm(seen, axis=-1, keepdims=True)
    # A step along an axis is one in the picture by V − p W, where (V, W) is its vanishing point.
    along = scaled[..., 1, :2] - scaled[..., 0, :2]
    for k, axis in enumerate(present):
        is_along = axes == axis
        towards = vanishing[..., k, None, :2] - scaled[..., is_along, 0, :2] * vanishing[..., k, None, 2:]
        seen[..., k, :] *= np.where((along[..., is_along, :] * towards).sum(axis=(-1, -2)) < 0.0, -1.0, 1.0)[..., None]
    is_mirrored = np.linalg.det(seen) < 0.0 if len(present) == 3 else np.zeros(distance.shape, bool)
    rotation = _nearest_rotation(np.einsum("...ki,kj->...ij", seen, np.eye(3)[present]))
    directions = np.eye(3)[axes]

    free = 2 if is_principal_point_free else 0
    units = np.array([1.0] * 4 + [half] * free)

    def measured(rotation: Array, center: Array, distance: Array) -> tuple[Array, Array]:
        shift = center if free else np.zeros((*distance.shape, 2))
        residual, slopes = _edge_residuals(ends, directions, rotation, distance, shift)
        return residual, slopes[..., : len(units)] * units

    start = distance * half if known_distance is None else np.full_like(distance, known_distance)
    rotation, refined, *rest = _refined(measured, rotation, half * center[..., :free], start, half, known_distance is not None)
    principal_point = refined if free else np.zeros((*distance.shape, 2))
    return Solution(rotation, np.zeros((*distance.shape, 3)), principal_point, *rest), is_mirrored


def solve_points(points: Array, pixels: Array, half: float, is_flat: bool, known_distance: float | None = None) -> Solution:
    """The cameras that see points.

    points : (..., n, 3).
    pixels : (..., n, 2) from the principal point.
    half : see `solve_edges`.

    is_flat : true if the points lie in a plane, where four are enough.
    known_distance : see `solve_edges`.
    """
    center = points.mean(axis=-2, keepdims=True)
    scale = np.sqrt(((points - center) ** 2).sum(axis=-1).mean(axis=-1))[..., None, None]
    local, scaled = (points - center) / scale, pixels / half
    rotation, shift, distance = (_pose_of_a_plane if is_flat else _pose_in_space)(local, scaled)
    if known_distance is not None:  # and farther away by as much as the lens is longer
        shift[..., 2] *= known_distance / half / distance
        distance = np.full_like(distance, known_distance / half)
    eye = center[..., 0, :] - scale[..., 0] * np.einsum("...ij,...i->...j", rotation, shift)

    start = distance * half if known_distance is None else np.full_like(distance, known_distance)

    def measured(rotation: Array, eye: Array, distance: Array) -> tuple[Array, Array]:
        return _point_residuals(points, pixels, rotation, eye, distance, scale[..., 0, 0])

    rotation, eye, *rest = _refined(measured, rotation, eye, start, scale[..., 0, 0], known_distance is not None)
    return Solution(rotation, eye, np.zeros((*distance.shape, 2)), *rest)


_AXES = "XYZ"


def _half(like: Pinhole) -> float:
    return max(like.width, like.height) / 2


def _nearest_rotation(matrix: Array) -> Array:
    left, _, right = np.linalg.svd(matrix)
    sign = np.sign(np.linalg.det(left @ right))
    left = left.copy()
    left[..., :, 2] *= sign[..., None]
    return left @ right


def _turned(rotation: Array, turn: Array) -> Array:
    """The rotation after a turn (..., 3) about u, v and w, in radians (Rodrigues)."""
    angle = np.linalg.norm(turn, axis=-1)[..., None, None]
    cross = _cross_matrix(turn)
    with np.errstate(invalid="ignore", divide="ignore"):
        first = np.where(angle > 1e-8, np.sin(angle) / angle, 1.0)
        second = np.where(angle > 1e-8, (1.0 - np.cos(angle)) / angle**2, 0.5)
    return (np.eye(3) + first * cross + second * cross @ cross) @ rotation


def _cross_matrix(vector: Array) -> Array:
    x, y, z = np.moveaxis(vector, -1, 0)
    zero = np.zeros_like(x)
    return np.stack([np.stack(row, axis=-1) for row in ((zero, -z, y), (z, zero, -x), (-y, x, zero))], axis=-2)


def _orthocenter(vanishing: Array) -> Array:
    """(..., 2) of the triangle of three vanishing points, (..., 3, 3) homogeneous; 0 where that lies outside the picture.

    Two of them, (x, y) and (x′, y′), are seen at a right angle from the eye: x x′ + y y′ − p · (x + x′, y + y′) + p² + d² = 0.
    Of all three these equations are linear in p and p² + d².
    """
    x, y, w = np.moveaxis(vanishing, -1, 0)
    i, j = np.array(list(combinations(range(3), 2))).T
    first, second = np.s_[..., i], np.s_[..., j]
    sums = (x[first] * w[second] + x[second] * w[first], y[first] * w[second] + y[second] * w[first], -w[first] * w[second])
    products = x[first] * x[second] + y[first] * y[second]
    center = np.einsum("...ij,...j->...i", np.linalg.pinv(np.stack(sums, axis=-1)), products)[..., :2]
    return np.where((np.abs(center) <= 1.0).all(axis=-1, keepdims=True), center, 0.0)


def _edge_residuals(
    ends: Array, directions: Array, rotation: Array, distance: Array, principal_point: Array
) -> tuple[Array, Array]:
    """(..., n) by how far each edge misses its vanishing point, counted at its ends, and what changes that: (..., n, 6).

    The sum of squares of both ends' distances from the line through the vanishing point that suits them best is, but for terms
    of higher order, the square of det(start, end, vanishing point) / √(|W start − V|² + |W end − V|²).
    """
    axis = np.einsum("...ij,nj->...ni", rotation, directions)
    none, (x, y) = np.zeros_like(distance), np.moveaxis(principal_point, -1, 0)
    rows = (distance, none, -x), (none, distance, -y), (none, none, none - 1.0)
    to_picture = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)[..., None, :, :]
    # Columns: the vanishing point (V, W) itself, then its change with the turn about u, v, w, log d and the principal point.
    point = (to_picture @ axis[..., None])[..., 0]
    lens = np.concatenate([axis[..., :2] * distance[..., None, None], np.zeros_like(axis[..., :1])], axis=-1)[..., None]
    moved = point[..., 2:, None] * np.eye(3)[:, :2]
    changes = np.concatenate([to_picture @ -_cross_matrix(axis), lens, moved], axis=-1)
    start, end = ends[..., 0, :], ends[..., 1, :]
    normal = np.stack(
        [start[..., 1] - end[..., 1], end[..., 0] - start[..., 0], start[..., 0] * end[..., 1] - start[..., 1] * end[..., 0]],
        axis=-1,
    )
    arms = [each * point[..., 2:] - point[..., :2] for each in (start, end)]
    size = np.sqrt(sum((arm**2).sum(axis=-1) for arm in arms))
    residual = (normal * point).sum(axis=-1) / size
    growth = sum(
        np.einsum("...c,...cp->...p", arm, each[..., :, None] * changes[..., 2:, :] - changes[..., :2, :])
        for arm, each in zip(arms, (start, end), strict=True)
    )
    slope = np.einsum("...c,...cp->...p", normal, changes) / size[..., None]
    return residual, slope - residual[..., None] * growth / (size**2)[..., None]


def _point_residuals(
    points: Array, pixels: Array, rotation: Array, eye: Array, distance: Array, scale: Array
) -> tuple[Array, Array]:
    """(..., 2 n) pixels that points are off, and what changes that: (..., 2 n, 7), the eye in units of `scale`."""
    seen = np.einsum("...ij,...nj->...ni", rotation, points - eye[..., None, :])
    away = -seen[..., 2]
    slope = seen[..., :2] / away[..., None]
    d = distance[..., None, None]
    # ∂(column, row)/∂(seen)
    over = (distance[..., None] / away)[..., None, None]
    to_picture = over * np.concatenate([np.broadcast_to(np.eye(2), (*away.shape, 2, 2)), slope[..., None]], axis=-1)
    turned = to_picture @ -_cross_matrix(seen)
    moved = -to_picture @ (rotation * scale[..., None, None])[..., None, :, :]
    jacobian = np.concatenate([turned, (slope * d)[..., None], moved], axis=-1)
    residual = slope * d - pixels
    flat = (*residual.shape[:-2], -1)
    return residual.reshape(flat), jacobian.reshape(*flat, 7)


def _refined(
    measured: Callable[[Array, Array, Array], tuple[Array, Array]],
    rotation: Array,
    others: Array,
    distance: Array,
    scale: Array | float,
    is_lens_known: bool,
) -> tuple[Array, Array, Array, Array, Array]:
    """The least squares near a start: rotation, others, distance, residuals and covariance, as of a `Solution`.

    others : (..., k) what is asked beside turn and lens: the eye, the principal point, or nothing.
    scale : the unit in which `measured` counts these.
    is_lens_known : the start's is right.
    """
    unknowns = 4 + others.shape[-1]
    scale = np.broadcast_to(scale, distance.shape)
    free = [parameter for parameter in range(unknowns) if parameter != 3 or not is_lens_known]
    damping = np.full(distance.shape, 1e-4)
    residual, jacobian = measured(rotation, others, distance)
    cost = (residual**2).sum(axis=-1)
    for _ in range(_STEPS):
        slopes = jacobian[..., free]
        normal = np.swapaxes(slopes, -1, -2) @ slopes
        gradient = np.einsum("...mp,...m->...p", slopes, residual)
        diagonal = np.einsum("...pp->...p", normal)
        damped = normal + (damping[..., None] * diagonal + 1e-300)[..., None] * np.eye(len(free))
        step = np.zeros((*distance.shape, unknowns))
        step[..., free] = -_solved(damped, gradient)
        step[..., 3] = np.clip(step[..., 3], -1.0, 1.0)
        tried_rotation = _turned(rotation, step[..., :3])
        tried_distance = distance * np.exp(step[..., 3])
        tried_others = others + scale[..., None] * step[..., 4:]
        with np.errstate(all="ignore"):
            tried_residual, tried_jacobian = measured(tried_rotation, tried_others, tried_distance)
            tried = (tried_residual**2).sum(axis=-1)
        better = np.isfinite(tried_jacobian).all(axis=(-1, -2)) & (tried <= cost)

        def chosen(new: Array, old: Array, better: NDArray[np.bool_] = better) -> Array:
            return np.where(better.reshape(better.shape + (1,) * (old.ndim - better.ndim)), new, old)

        rotation, others = chosen(tried_rotation, rotation), chosen(tried_others, others)
        distance = chosen(tried_distance, distance)
        residual, jacobian, cost = chosen(tried_residual, residual), chosen(tried_jacobian, jacobian), chosen(tried, cost)
        damping = np.where(better, np.maximum(damping / 10.0, 1e-15), np.minimum(damping * 10.0, 1e12))
        if (np.abs(step).max(axis=-1) < _CONVERGED).all():
            break
    slopes = jacobian[..., free]
    normal = np.swapaxes(slopes, -1, -2) @ slopes
    size = np.sqrt(np.maximum(np.einsum("...pp->...p", normal), 1e-300))
    both = size[..., :, None] * size[..., None, :]
    values, vectors = np.linalg.eigh(normal / both)
    # Where a step changes nothing (lens and distance of a plane seen head-on) all is open.
    variances = np.where(values[..., :1] > _OPEN, 1.0 / np.maximum(values, _OPEN), 1e300)
    covariance = np.zeros((*distance.shape, unknowns, unknowns))  # a known lens has none
    covariance[..., np.array(free)[:, None], free] = np.einsum("...pk,...k,...qk->...pq", vectors, variances, vectors) / both
    units = np.concatenate([np.ones((*distance.shape, 4)), np.repeat(scale[..., None], unknowns - 4, axis=-1)], axis=-1)
    covariance = covariance * units[..., :, None] * units[..., None, :]
    return _nearest_rotation(rotation), others, distance, residual, covariance


def _solved(matrix: Array, vector: Array) -> Array:
    """The solution of a symmetric positive system, columns brought to one size first."""
    size = np.sqrt(np.maximum(np.einsum("...pp->...p", matrix), 1e-300))
    even = matrix / size[..., :, None] / size[..., None, :]
    try:
        return np.linalg.solve(even, (vector / size)[..., None])[..., 0] / size
    except np.linalg.LinAlgError:
        return np.einsum("...pq,...q->...p", np.linalg.pinv(even, hermitian=True), vector / size) / size


def _pose_of_a_plane(points: Array, pixels: Array) -> tuple[Array, Array, Array]:
    """Rotation, R (center − eye) and d of points in a plane, from their homography.

    pixels : (..., n, 2), in units of half the picture.
    """
    _, _, within = np.linalg.svd(points)
    frame = within[..., :2, :]  # two directions in the plane
    flat = np.einsum("...ij,...nj->...ni", frame, points)
    homography = _null(_direct_rows(flat, pixels)).reshape(*points.shape[:-2], 3, 3)
    a, b = homography[..., 0], homography[..., 1]
    # a and b are (d x, d y, −z) of two directions that are perpendicular and of one length.
    across = (a[..., :2] * b[..., :2]).sum(axis=-1), ((a[..., :2] ** 2) - (b[..., :2] ** 2)).sum(axis=-1)
    away = a[..., 2] * b[..., 2], a[..., 2] ** 2 - b[..., 2] ** 2
    below = away[0] ** 2 + away[1] ** 2 / 4.0
    above = -(across[0] * away[0] + across[1] * away[1] / 4.0)
    square = np.where(below > 0.0, above / np.where(below > 0.0, below, 1.0), _LONGEST**2)
    distance = np.sqrt(np.clip(square, _SHORTEST**2, _LONGEST**2))
    seen = homography / np.stack([distance, distance, -np.ones_like(distance)], axis=-1)[..., None]
    length = np.linalg.norm(seen[..., :2], axis=-2).mean(axis=-1)
    seen = seen / (length * np.where(seen[..., 2, 2] > 0.0, -1.0, 1.0))[..., None, None]  # before the eye, w is below 0
    third = np.cross(seen[..., 0], seen[..., 1])
    plane = np.concatenate([frame, np.cross(frame[..., 0, :], frame[..., 1, :])[..., None, :]], axis=-2)
    rotation = _nearest_rotation(np.stack([seen[..., 0], seen[..., 1], third], axis=-1) @ plane)
    return rotation, seen[..., 2], distance


def _pose_in_space(points: Array, pixels: Array) -> tuple[Array, Array, Array]:
    """The pose from points in space, from the direct linear transform."""
    matrix = _null(_direct_rows(points, pixels)).reshape(*points.shape[:-2], 3, 4)
    ones = np.ones((*points.shape[:-1], 1))
    behind = np.einsum("...j,...nj->...n", matrix[..., 2, :], np.concatenate([points, ones], axis=-1)).sum(axis=-1) < 0.0
    matrix = matrix * np.where(behind, -1.0, 1.0)[..., None, None]
    matrix = matrix / np.linalg.norm(matrix[..., 2, :3], axis=-1)[..., None, None]
    rows = matrix[..., :2, :3] - (matrix[..., :2, :3] @ matrix[..., 2, :3, None]) * matrix[..., 2, None, :3]
    distance = np.clip(np.linalg.norm(rows, axis=-1).mean(axis=-1), _SHORTEST, _LONGEST)
    rotation = _nearest_rotation(np.concatenate([rows / distance[..., None, None], -matrix[..., 2:, :3]], axis=-2))
    shift = np.stack([matrix[..., 0, 3] / distance, matrix[..., 1, 3] / distance, -matrix[..., 2, 3]], axis=-1)
    return rotation, shift, distance


def _direct_rows(points: Array, pixels: Array) -> Array:
    """The linear equations of the direct linear transform: (..., 2 n, 3 (k + 1)) for points of k coordinates."""
    known = np.concatenate([points, np.ones((*points.shape[:-1], 1))], axis=-1)
    zero = np.zeros_like(known)
    columns = np.concatenate([known, zero, -pixels[..., :1] * known], axis=-1)
    rows = np.concatenate([zero, known, -pixels[..., 1:] * known], axis=-1)
    return np.concatenate([columns, rows], axis=-2)


def _null(matrix: Array) -> Array:
    """The vector that the matrix takes nearest to zero."""
    return np.linalg.svd(matrix)[2][..., -1, :]


def _match(solution: Solution, like: Pinhole, precision: float, reach: float, spare: int, depth: float | None) -> Match:
    """The match of one of the cameras that were solved for.

    reach : from the eye to the look-at point.
    spare : residuals beyond the unknowns.
    """
    covariance = solution.covariance * precision**2
    errors = np.sqrt(np.maximum(np.diagonal(covariance), 0.0))
    distance, is_center_free = float(solution.distance), depth is None and len(errors) > 4
    if is_center_free and not math.hypot(*errors[4:]) < _LARGEST_SHIFT * _half(like):
        raise InputError(
            "the principal point can't be told from these: draw longer edges along all three axes, which converge, or keep it"
        )
    if not (np.isfinite(errors).all() and errors[3] < _LARGEST_ERROR and (depth is None or depth > 0.0)):
        raise InputError(
            "the lens can't be told from these: draw longer edges, or choose a view that is not head-on, so that lines converge"
        )
    rotation, eye = solution.rotation, solution.eye
    pinhole = Pinhole(
        tuple(eye.tolist()),
        tuple((eye - reach * rotation[2]).tolist()),
        tuple(rotation[1].tolist()),
        distance,
        like.width,
        like.height,
        tuple((np.array(like.principal_point) + solution.principal_point).tolist()),
    )
    corner = math.hypot(like.width, like.height) / 2
    pixels = {
        "look_at": distance * math.hypot(errors[0], errors[1]),
        "up": float(errors[2]) * corner,
        "distance": float(errors[3]) * corner,
    }
    if is_center_free:
        pixels["principal_point"] = math.hypot(*errors[4:])
    if depth is not None:
        across = rotation[:2] @ covariance[4:, 4:] @ rotation[:2].T
        pixels["eye"] = distance / depth * math.sqrt(max(float(np.trace(across)), 0.0))
    factor = math.exp(errors[3])
    left = math.sqrt(float((solution.residuals**2).sum()) / spare) if spare > 0 else 0.0
    eye_error = tuple(errors[4:].tolist()) if depth is not None else None
    center_error = tuple(errors[4:].tolist()) if is_center_free else None
    return Match(pinhole, precision, left, (distance / factor, distance * factor), eye_error, center_error, pixels)
