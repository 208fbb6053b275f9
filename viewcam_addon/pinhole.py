"""The pinhole camera of the text: viewing coordinates, view plane, rays and projection.

    w = (e − l) / |e − l|     u = (up × w) / |up × w|     v = w × u

The viewing coordinates have their origin at the eye e. w points away from the view, so that u is right, v is up and (u, v, w)
is right-handed. The view plane lies at the distance d before the eye and holds width × height pixels of unit size: d is in
pixels. The sample point (p_x, p_y) in [0, 1)² of the pixel in column c (from the left) and row r (from the bottom) gives

    x_v = c − width/2 + p_x    y_v = r − height/2 + p_y    direction = x_v u + y_v v − d w, normalised

Blender's cameras ask for a little more, and the model gains just that: a distance for each axis (pixel aspect), a principal
point in place of the centre (shift, border), and mirroring (negative scale), in which u points left.

**Singularity.** Where the view is exactly parallel to up, u does not exist, and the axes become canonical (`canonical_axes`).
In every other pose the basis is that of exact arithmetic on the same float64 inputs to within 4e-16, however close to singular
it is (exact.py). Rejected: a threshold below which the pose counts as singular (the roll would jump there), and another up near
the pole (the picture would not be the one that the four values state).
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import exact
from .errors import InputError

Array = NDArray[np.float64]
Triple = tuple[float, float, float]
Pair = tuple[exact.Vector, exact.Vector]  # of vectors: high + low, unevaluated

# A difference of two coordinates below this can't overflow, nor can the splitting of its parts.
_LARGEST_COORDINATE = 2.0**1000


@dataclass(frozen=True)
class Pinhole:
    """A pinhole camera, immutable and validated.

    Parameters
    ----------
    eye, look_at : three floats, world space.
    up : three floats, world space, of any length but zero; need not be perpendicular to the view.
    distance : view-plane distance d in pixels, > 0; one float, or a pair (d_x, d_y) in pixel widths and pixel heights.
    width, height : pixels of the picture, whole numbers ≥ 1.
    principal_point : (c_x, c_y), where the view axis meets the picture, in pixels from its left and its bottom edge.
        The picture's centre if it is None.
    mirrored : whether u points left in the picture.

    Raises
    ------
    InputError
        if eye = look_at, up = 0, distance ≤ 0, a size is below 1 or no whole number, or anything is not finite.
    """

    eye: Triple
    look_at: Triple
    up: Triple
    distance: tuple[float, float]
    width: int
    height: int
    principal_point: tuple[float, float] | None = None
    mirrored: bool = False

    def __post_init__(self) -> None:
        for name in ("eye", "look_at", "up"):
            self._set(name, _finite_tuple(name, getattr(self, name), 3))
        _check_pose(self.eye, self.look_at, self.up)
        for name in ("width", "height"):
            self._set(name, _whole_size(name, getattr(self, name)))
        distance = self.distance if np.ndim(self.distance) else (self.distance, self.distance)
        self._set("distance", _finite_tuple("distance", distance, 2))
        if min(self.distance) <= 0:
            raise InputError(f"distance is {min(self.distance):g} pixels: the view plane must lie before the eye, give d > 0")
        centre = (self.width / 2, self.height / 2)
        point = centre if self.principal_point is None else self.principal_point
        self._set("principal_point", _finite_tuple("principal_point", point, 2))
        self._set("mirrored", bool(self.mirrored))

    def _set(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)

    @cached_property
    def _axes(self) -> tuple[Triple, Triple, Triple]:
        return _basis_of_one(self.eye, self.look_at, self.up)

    @cached_property
    def _basis(self) -> tuple[Array, Array, Array]:
        axes = tuple(np.array(axis) for axis in self._axes)
        for axis in axes:
            axis.setflags(write=False)
        return axes

    def basis(self) -> tuple[Array, Array, Array]:
        """(u, v, w): three (3,) float64 unit vectors, world space, read-only. u is right, v up, w away from the view."""
        return self._basis

    def axes(self) -> tuple[Triple, Triple, Triple]:
        """(u, v, w) as triples of plain floats, for code that handles one pose and wants no arrays."""
        return self._axes

    @property
    def is_singular(self) -> bool:
        """Whether the view is exactly parallel to up, so that the axes are the canonical ones."""
        return not any(_view_of_one(self.eye, self.look_at, self.up)[1][0])

    @cached_property
    def sine_to_up(self) -> float:
        """sin θ of the angle θ between the view and up, to full precision however small it is; 0 if singular
        or below float64's range.
        """
        return _view_of_one(self.eye, self.look_at, self.up)[2]

    def roll_uncertainty(self, precision: float = 2.0**-24) -> float:
        """The roll that rounding the inputs can cause, in radians, at most π.

        precision : relative rounding of each input, by default that of Blender's float32 properties. It turns the view by
            precision · (|e| + |l|) / |e − l| and up by precision; the roll turns by their sum over sin θ.
        """
        apart = math.dist(self.eye, self.look_at)
        turn = precision * ((math.hypot(*self.eye) + math.hypot(*self.look_at)) / apart + 1)
        return min(turn / self.sine_to_up, math.pi) if self.sine_to_up else math.pi

    def field_of_view(self) -> Triple:
        """(horizontal, vertical, diagonal) in radians: between opposite edges and, diagonal, between opposite corners."""
        left, right = self.view_plane(0, 0)[0], self.view_plane(self.width, 0)[0]
        bottom, top = self.view_plane(0, 0)[1], self.view_plane(0, self.height)[1]
        return (
            math.atan(right) - math.atan(left),
            math.atan(top) - math.atan(bottom),
            _angle_between((left, bottom, -1.0), (right, top, -1.0)),
        )

    def ray_directions(self, columns: ArrayLike, rows: ArrayLike, px: ArrayLike = 0.5, py: ArrayLike = 0.5) -> Array:
        """Directions from the eye through sample points of pixels.

        columns, rows : pixels from the left and from the bottom; px, py : the sample point in [0, 1)² of each pixel. All
        broadcast.

        Returns (..., 3) float64 unit vectors, world space.
        """
        x, y = np.broadcast_arrays(*self.view_plane(np.add(columns, px), np.add(rows, py)))
        u, v, w = self._basis
        if self.mirrored:
            u = -u
        directions = x[..., None] * u
        directions += y[..., None] * v
        directions -= w
        directions /= np.sqrt(x * x + y * y + 1.0)[..., None]
        return directions

    def view_plane(self, column: ArrayLike, row: ArrayLike) -> tuple:
        """Continuous picture coordinates to (x, y) in the view plane at distance 1: the ray is (±x) u + y v − w."""
        return (column - self.principal_point[0]) / self.distance[0], (row - self.principal_point[1]) / self.distance[1]

    def project(self, points: ArrayLike) -> tuple[Array, Array, Array]:
        """Where points appear in the picture.

        points : (..., 3), world space.

        Returns (column, row, depth), each (...) float64: continuous pixels from the left and from the bottom edge, the centre
        of the first pixel at (0.5, 0.5), and the planar depth −w·(P − e) in world units. What does not lie before the eye
        (depth ≤ 0) has no picture: its column and row are nan.
        """
        u, v, w = self._basis
        relative = np.asarray(points, dtype=np.float64) - np.array(self.eye)
        depth = -(relative @ w)
        visible = np.where(depth > 0, depth, np.nan)
        x = (relative @ u) / visible
        column = self.principal_point[0] + self.distance[0] * (-x if self.mirrored else x)
        row = self.principal_point[1] + self.distance[1] * ((relative @ v) / visible)
        return column, row, depth

    def resized(self, width: int, height: int) -> "Pinhole":
        """The same picture in another number of pixels."""
        scale_x, scale_y = width / self.width, height / self.height
        return replace(
            self,
            width=width,
            height=height,
            distance=(self.distance[0] * scale_x, self.distance[1] * scale_y),
            principal_point=(self.principal_point[0] * scale_x, self.principal_point[1] * scale_y),
        )

    def cropped(self, column: int, row: int, width: int, height: int) -> "Pinhole":
        """The camera of the part of the picture whose lower left pixel is (column, row)."""
        point = (self.principal_point[0] - column, self.principal_point[1] - row)
        return replace(self, width=width, height=height, principal_point=point)


def basis(eye: ArrayLike, look_at: ArrayLike, up: ArrayLike) -> tuple[Array, Array, Array]:
    """(u, v, w) for any number of poses at once.

    eye, look_at, up : (..., 3) float64, world space; leading axes broadcast.

    Returns three (..., 3) float64 arrays of unit vectors, each component within 4e-16 of exact arithmetic on the same inputs.

    Raises
    ------
    InputError
        where eye = look_at, up = 0 or something is not finite; it names the first such pose.
    """
    e, l, up = np.broadcast_arrays(*(np.asarray(vector, dtype=np.float64) for vector in (eye, look_at, up)))
    if e.ndim == 1:
        pose = [_finite_tuple(name, vector, 3) for name, vector in (("eye", e), ("look_at", l), ("up", up))]
        _check_pose(*pose)
        return tuple(np.array(axis) for axis in _basis_of_one(*pose))
    leading, (e, l, up) = e.shape[:-1], (vector.reshape(-1, 3) for vector in (e, l, up))
    _check_poses(e, l, up)
    with np.errstate(all="ignore"):  # what leaves float64's range here is done again, one by one, below
        axes, safe = _basis_of_many(*(tuple(vector.T) for vector in (e, l, up)))
    u, v, w = (np.stack(axis, axis=-1) for axis in axes)
    for i in np.flatnonzero(~safe):
        u[i], v[i], w[i] = _basis_of_one(*(tuple(vector[i].tolist()) for vector in (e, l, up)))
    return tuple(axis.reshape(*leading, 3) for axis in (u, v, w))


def canonical_axes(up: Triple, looking_down: bool) -> tuple[Triple, Triple, Triple]:
    """(u, v, w) of a view exactly along up (looking_down is False) or against it (True).

    With up = (0, 1, 0) these are the text's: down u = (0, 0, 1), v = (1, 0, 0), w = (0, 1, 0); up u = (1, 0, 0), v = (0, 0, 1),
    w = (0, −1, 0). For any other up they are the text's, carried by the smallest rotation that takes (0, 1, 0) to up (for an up
    in the lower half-space, after half a turn about the x axis). With up = (0, 0, 1) that is (x, y, z) → (x, −z, y), Blender's
    world.
    """
    (unit,) = exact.scaled_to_one(up)
    size = exact.length(unit)
    x, y, z = (component / size for component in unit)
    turned = y < 0
    if turned:
        y, z = -y, -z
    image_of_x = (1 - x * x / (1 + y), -x, -x * z / (1 + y))
    image_of_z = (-x * z / (1 + y), -z, 1 - z * z / (1 + y))
    axes = (image_of_z, image_of_x, (x, y, z)) if looking_down else (image_of_x, image_of_z, (-x, -y, -z))
    if turned:
        axes = tuple((a, -b, -c) for a, b, c in axes)
    return tuple(tuple(component + 0.0 for component in axis) for axis in axes)  # + 0.0 makes −0.0 a plain zero


def _basis_of_one(e: Triple, l: Triple, up: Triple) -> tuple[Triple, Triple, Triple]:
    apart, across, _ = _view_of_one(e, l, up)
    if any(across[0]):
        return _orthonormal(apart, across)
    (unit_up,) = exact.scaled_to_one(up)
    return canonical_axes(up, looking_down=sum(a * b for a, b in zip(unit_up, apart[0], strict=True)) > 0)


def _view_of_one(e: Triple, l: Triple, up: Triple) -> tuple[Pair, Pair, float]:
    """e − l and up × (e − l) as pairs high + low whose largest component is about 1, and sin θ of the view and up."""
    unit_up, apart, across, safe = _view(e, l, up)
    if safe:
        largest = exact.largest_component(across[0])
        largest /= exact.largest_component(unit_up) * exact.largest_component(apart[0])
    else:
        apart, across, largest = exact.rational_cross(up, e, l)
    if not largest:
        return apart, across, 0.0
    across = tuple(exact.scaled_to_one(*across))
    relative_lengths = [exact.length(vector) / exact.largest_component(vector) for vector in (across[0], unit_up, apart[0])]
    return apart, across, largest * relative_lengths[0] / (relative_lengths[1] * relative_lengths[2])


def _basis_of_many(e: tuple, l: tuple, up: tuple) -> tuple[tuple, Array]:
    """(u, v, w), each a triple of (n,) arrays, and (n,) bool: where they can be relied on."""
    _, apart, across, safe = _view(e, l, up)
    across = tuple(exact.scaled_to_one(*across))
    return _orthonormal(apart, across), safe & (exact.largest_component(across[0]) > 0)


def _view(e: tuple, l: tuple, up: tuple) -> tuple[tuple, Pair, Pair, bool | Array]:
    """up and e − l scaled to a largest component of about 1, up × (e − l), and whether the product is exact to its rounding."""
    high, low = exact.difference(e, l)
    apart = tuple(exact.scaled_to_one(high, low))
    (unit_up,) = exact.scaled_to_one(up)
    *across, settled = exact.cross(unit_up, *apart)
    safe = exact.are_factors(high, apart[0]) & exact.are_factors(low, apart[1]) & exact.are_factors(up, unit_up)
    for vector in (e, l):
        safe = safe & (exact.largest_component(vector) < _LARGEST_COORDINATE)
    return unit_up, apart, tuple(across), safe & settled


def _orthonormal(apart: Pair, across: Pair) -> tuple[tuple, tuple, tuple]:
    """(u, v, w) from e − l and up × (e − l); v is their product, and not w × u, which would carry the rounding of both."""
    upward = exact.cross_of_perpendicular(*apart, *across)
    return _normalised(across[0]), _normalised(upward), _normalised(apart[0])


def _normalised(vector: tuple) -> tuple:
    size = exact.length(vector)
    return tuple(component / size for component in vector)


def _finite_tuple(name: str, values: object, count: int) -> tuple[float, ...]:
    try:
        numbers = tuple(float(value) for value in values)
    except (TypeError, ValueError):
        numbers = ()
    if len(numbers) != count:
        raise InputError(f"{name} is {values!r}: give {count} numbers")
    if not all(map(math.isfinite, numbers)):
        raise InputError(f"{name} is {numbers}: every number of it must be finite")
    return numbers


def _whole_size(name: str, value: object) -> int:
    if not isinstance(value, (int, np.integer)) or isinstance(value, bool) or value < 1:
        raise InputError(f"{name} is {value!r} pixels: give a whole number, at least 1")
    return int(value)


def _check_pose(e: Triple, l: Triple, up: Triple) -> None:
    if e == l:
        raise InputError(f"eye and look_at are the same point {e}: the view has no direction, move one of them")
    if not any(up):
        raise InputError("up is (0, 0, 0): it has no direction, give the vector that shall point up in the picture")


def _check_poses(e: Array, l: Array, up: Array) -> None:
    finite = np.isfinite(e).all(-1) & np.isfinite(l).all(-1) & np.isfinite(up).all(-1)
    for i in np.flatnonzero(~finite | (e == l).all(-1) | ~up.any(-1)):
        try:
            pose = [_finite_tuple(name, vector[i], 3) for name, vector in (("eye", e), ("look_at", l), ("up", up))]
            _check_pose(*pose)
        except InputError as error:
            raise InputError(f"pose {i}: {error}") from None


def _angle_between(a: Triple, b: Triple) -> float:
    return math.atan2(math.hypot(*np.cross(a, b)), sum(x * y for x, y in zip(a, b, strict=True)))
