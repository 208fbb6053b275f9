"""The pinhole camera of the text: viewing coordinates, view plane, rays and projection.

    w = (e − l) / |e − l|     u = (up × w) / |up × w|     v = w × u

The viewing coordinates have their origin at the eye e. w points away from the view, so that u is right, v is up and (u, v, w)
is right-handed. The view plane lies at the distance d before the eye and holds width × height pixels of unit size: d is in
pixels. The sample point (p_x, p_y) in [0, 1)² of the pixel in column c (from the left) and row r (from the bottom) gives

    x_v = c − width/2 + p_x    y_v = r − height/2 + p_y    direction = x_v u + y_v v − d w, normalized

Blender's cameras ask for a little more, and the model gains just that: a distance for each axis (pixel aspect), a principal
point in place of the center (shift, border), and mirroring (negative scale), in which u points left.

**Singularity.** Where the view is exactly parallel to up, u does not exist, and the axes become canonical (`canonical_axes`).
In every other pose the basis is that of exact arithmetic on the same float64 inputs to within 4e-16, however close to singular
it is (exact.py). Rejected: a threshold below which the pose counts as singular (the roll would jump there), and another up near
the pole (the picture would not be the one that the four values state).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import checks, exact
from .errors import InputError

Array = NDArray[np.float64]
Triple = tuple[float, float, float]
Pair = tuple[exact.Vector, exact.Vector]  # vectors as high + low, unevaluated

# Numbers between these two can be squared, or multiplied by an axis, without care.
_SMALLEST_SAFE, _LARGEST_SAFE = 2.0**-500, 2.0**500
_AT_ONCE = 8192  # poses: their numbers stay in a core's cache; more take twice as long each


def check_distance(distance: float, name: str = "distance") -> None:
    """Raise InputError, with the given name, unless a view plane at that distance in pixels lies before the eye."""
    if distance <= 0:
        raise InputError(f"{name} is {distance:g} pixels: the view plane must lie before the eye, give d > 0")


@dataclass(frozen=True)
class ViewPlane:
    """The part of a `Pinhole` that is not its pose.

    distance : in pixels, > 0; one float, or a pair (d_x, d_y) in pixel widths and pixel heights.
    principal_point : (c_x, c_y) in pixels from the left and the bottom edge, the picture's center if it is None.
    width, height : pixels of the picture.

    Raises InputError if a distance is not positive, a size not whole and ≥ 1, or a number not finite.
    """

    distance: tuple[float, float]
    principal_point: tuple[float, float]
    width: int
    height: int

    if TYPE_CHECKING:  # more types may be given than are kept

        def __init__(
            self, distance: float | Sequence[float], principal_point: Sequence[float] | None, width: int, height: int
        ) -> None: ...

    def __post_init__(self) -> None:
        checked = {name: checks.whole(name, getattr(self, name)) for name in ("width", "height")}
        pair = self.distance if np.iterable(self.distance) else (self.distance,) * 2
        checked["distance"] = checks.vector("distance", pair, 2)
        check_distance(min(checked["distance"]))
        center = (checked["width"] / 2, checked["height"] / 2)
        point = center if self.principal_point is None else self.principal_point
        checked["principal_point"] = checks.vector("principal_point", point, 2)
        for name, value in checked.items():
            object.__setattr__(self, name, value)


@dataclass(frozen=True)
class Pinhole:
    """A pinhole camera, immutable and validated.

    eye, look_at : three floats, world space.
    up : three floats, world space, of any length but zero; need not be perpendicular to the view.
    distance : view-plane distance d in pixels, > 0; one float, or a pair (d_x, d_y) in pixel widths and pixel heights.
    width, height : pixels of the picture, whole numbers ≥ 1.
    principal_point : (c_x, c_y), where the view axis meets the picture, in pixels from its left and its bottom edge. The
        picture's center if it is None.
    mirrored : true if u points left in the picture.

    Raises InputError if eye = look_at, up = 0, distance ≤ 0, a size is no whole number from 1 to 2³¹ − 1, or anything is no
    finite number.
    """

    eye: Triple
    look_at: Triple
    up: Triple
    distance: tuple[float, float]
    width: int
    height: int
    principal_point: tuple[float, float] = None  # type: ignore[assignment]
    mirrored: bool = False

    if TYPE_CHECKING:  # more types may be given than are kept

        def __init__(
            self,
            eye: Sequence[float],
            look_at: Sequence[float],
            up: Sequence[float],
            distance: float | Sequence[float],
            width: int,
            height: int,
            principal_point: Sequence[float] | None = None,
            mirrored: bool = False,
        ) -> None: ...

    def __post_init__(self) -> None:
        pose = {name: checks.vector(name, getattr(self, name), 3) for name in ("eye", "look_at", "up")}
        _check_pose(*pose.values())
        plane = ViewPlane(self.distance, self.principal_point, self.width, self.height)
        self._set(*pose.values(), plane, checks.truth("mirrored", self.mirrored))

    def _set(self, eye: Triple, look_at: Triple, up: Triple, plane: ViewPlane, mirrored: bool) -> None:
        """Store what has been checked. A frozen dataclass keeps its fields in its dictionary."""
        self.__dict__.update(
            eye=eye,
            look_at=look_at,
            up=up,
            distance=plane.distance,
            width=plane.width,
            height=plane.height,
            principal_point=plane.principal_point,
            mirrored=mirrored,
            _plane=plane,
        )

    @classmethod
    def of_poses(cls, eye: ArrayLike, look_at: ArrayLike, up: ArrayLike, planes: Sequence[ViewPlane]) -> list["Pinhole"]:
        """Many pinholes of arrays: each as its constructor makes it, in a tenth of the time.

        eye, look_at, up : (n, 3) float64, world space.
        planes : the view plane of each.

        Raises InputError as the constructor does; it names the first such pose.
        """
        vectors = {"eye": eye, "look_at": look_at, "up": up}
        points = checks.broadcast(**{name: checks.array(name, values) for name, values in vectors.items()})
        _check_poses(*points)
        pinholes = []
        for *pose, plane in zip(*(map(tuple, each.tolist()) for each in points), planes, strict=True):
            pinhole = object.__new__(cls)
            pinhole._set(*pose, plane, False)
            pinholes.append(pinhole)
        return pinholes

    @property
    def plane(self) -> ViewPlane:
        """The view plane: all of the camera but its pose."""
        return self._plane

    @cached_property
    def _view(self) -> tuple[Pair, Pair, Triple, float]:
        return _view_of_one(self.eye, self.look_at, self.up)

    @cached_property
    def _axes(self) -> tuple[Triple, Triple, Triple]:
        return _axes_of_one(self.up, *self._view)

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

    def picture_axes(self) -> Array:
        """(3, 3): the unit vectors to the right in the picture, upwards and ahead, world space."""
        u, v, w = self._basis
        return np.array([-u if self.mirrored else u, v, -w])

    @property
    def is_singular(self) -> bool:
        """True if the view is exactly parallel to up, so that the axes are the canonical ones."""
        return not any(self._view[1][0])

    @property
    def sine_to_up(self) -> float:
        """sin θ of the angle θ between the view and up, at most 1, to full precision however small it is; 0 if singular
        or below float64's range.
        """
        apart, across, unit_up, largest = self._view
        if not largest:
            return 0.0
        relative_lengths = [exact.length(each) / exact.largest_component(each) for each in (across[0], unit_up, apart[0])]
        return min(largest * relative_lengths[0] / (relative_lengths[1] * relative_lengths[2]), 1.0)

    def roll_uncertainty(self, precision: float = 2.0**-24) -> float:
        """The roll that rounding the inputs can cause, in radians, at most π.

        precision : relative rounding of each input, ≥ 0, by default that of Blender's float32 properties. It turns the view
            by precision · (|e| + |l|) / |e − l| and up by precision; the roll turns by their sum over sin θ.
        """
        precision = checks.number("precision", precision)
        if precision < 0:
            raise InputError(f"precision is {precision:g}: give a relative rounding of at least 0")
        if precision == 0 or self.sine_to_up == 0:
            return 0.0 if self.sine_to_up else math.pi
        scale = 0.125 if max(map(abs, self.eye + self.look_at)) > exact.LARGEST_PART else 1.0  # no length overflows
        e, l = (tuple(scale * x for x in point) for point in (self.eye, self.look_at))
        apart = math.dist(e, l)
        turn = precision * ((math.hypot(*e) + math.hypot(*l)) / apart + 1) if apart else math.inf
        return min(turn / self.sine_to_up, math.pi)

    def field_of_view(self) -> Triple:
        """(horizontal, vertical, diagonal) in radians, to 1e-15: between opposite edges and, diagonal, between corners."""
        (c_x, c_y), width, height = self.principal_point, float(self.width), float(self.height)
        return (
            _angle_between(self._towards(0.0, c_y), self._towards(width, c_y)),
            _angle_between(self._towards(c_x, 0.0), self._towards(c_x, height)),
            _angle_between(self._towards(0.0, 0.0), self._towards(width, height)),
        )

    def ray_directions(self, columns: ArrayLike, rows: ArrayLike, px: ArrayLike = 0.5, py: ArrayLike = 0.5) -> Array:
        """Directions from the eye through sample points of pixels.

        columns, rows : pixels from the left and from the bottom.
        px, py : the sample point in [0, 1)² of each pixel. All finite, and broadcast.

        Returns (..., 3) float64 unit vectors, world space, to 1e-15 of the sample point that columns + px and rows + py round
        to.
        """
        coordinates = {"columns": columns, "rows": rows, "px": px, "py": py}
        columns, rows, px, py = checks.broadcast(**{name: checks.array(name, values) for name, values in coordinates.items()})
        with np.errstate(all="ignore"):
            x, y = self.view_plane(columns + px, rows + py)
            z = np.float64(1.0)
            if max(np.abs(x).max(initial=0.0), np.abs(y).max(initial=0.0)) > _LARGEST_SAFE:
                x, y, z = map(np.asarray, self._towards(columns + px, rows + py))
            u, v, w = self._basis
            if self.mirrored:
                u = -u
            directions = x[..., None] * u
            directions += y[..., None] * v
            directions -= z[..., None] * w
            directions /= np.sqrt(x * x + y * y + z * z)[..., None]
        return directions

    def view_plane(self, column: ArrayLike, row: ArrayLike) -> tuple[Array, Array]:
        """Continuous picture coordinates to (x, y) in the view plane at distance 1: the ray is (±x) u + y v − w.

        What lies beyond float64's range, as it may for a distance below 1e-290, is ±inf.
        """
        column, row = checks.array("column", column), checks.array("row", row)
        with np.errstate(all="ignore"):
            x = (column - self.principal_point[0]) / self.distance[0]
            y = (row - self.principal_point[1]) / self.distance[1]
            if not (np.isfinite(x).all() and np.isfinite(y).all()):
                checks.finite("column", column)
                checks.finite("row", row)
                x, y = (np.ldexp(*self._slope(axis, values)) for axis, values in enumerate((column, row)))
        return x, y

    def _slope(self, axis: int, place: float | Array) -> tuple[float | Array, exact.Exponent]:
        """x (axis 0) or y (1) of `view_plane`, of any size: fraction · 2^exponent."""
        return exact.quotient(place, self.principal_point[axis], self.distance[axis])

    def _towards(self, column: float | Array, row: float | Array) -> list[float | Array]:
        """(x, y, 1) of the ray through a place in the picture, scaled so that the largest is about 1."""
        ones = (0.0 * column + 1.0, 0)
        return exact.of_one_scale(self._slope(0, column), self._slope(1, row), ones)

    def project(self, points: ArrayLike) -> tuple[Array, Array, Array]:
        """The pixels where points appear in the picture.

        points : (..., 3), world space, finite.

        Returns (column, row, depth), each (...) float64: continuous pixels from the left and from the bottom edge, the center
        of the first pixel at (0.5, 0.5), and the planar depth −w·(P − e) in world units. What does not lie before the eye
        (depth ≤ 0) has no picture: its column and row are nan. What exceeds float64's range is ±inf.
        """
        points = checks.array("points", points)
        if points.shape[-1:] != (3,):
            raise InputError(f"points have the shape {points.shape}: give three coordinates for each")
        u, v, w = self._basis
        with np.errstate(all="ignore"):
            relative, exponent = points - np.array(self.eye), 0
            depth = z = -(relative @ w)
            if not ((np.abs(z) > _SMALLEST_SAFE).all() and np.abs(relative).max(initial=0.0) < _LARGEST_SAFE):
                checks.finite("points", points)
                relative, exponent = _scaled_difference(points, np.array(self.eye))
                z = -(relative @ w)
                depth = np.ldexp(z, exponent)
            forward = np.frexp(np.where(depth > 0, z, np.nan))
            x = relative @ u
            column = self._place(0, -x if self.mirrored else x, *forward)
            row = self._place(1, relative @ v, *forward)
        return column, row, depth

    def _place(self, axis: int, across: Array, forward: Array, exponent: Array) -> Array:
        """The principal point + d · across / (forward · 2^exponent), of which only the sum may overflow."""
        distance, below = math.frexp(self.distance[axis])
        half = np.ldexp(across / forward * distance, below - exponent - 1)
        return (half + self.principal_point[axis] / 2) * 2

    def resized(self, width: int, height: int) -> "Pinhole":
        """This camera with its picture in another number of pixels."""
        scale_x, scale_y = checks.whole("width", width) / self.width, checks.whole("height", height) / self.height
        return replace(
            self,
            width=width,
            height=height,
            distance=(self.distance[0] * scale_x, self.distance[1] * scale_y),
            principal_point=(self.principal_point[0] * scale_x, self.principal_point[1] * scale_y),
        )

    def cropped(self, column: float, row: float, width: int, height: int) -> "Pinhole":
        """The camera of the part of the picture whose lower left pixel is (column, row)."""
        column, row = checks.number("column", column), checks.number("row", row)
        point = (self.principal_point[0] - column, self.principal_point[1] - row)
        return replace(self, width=width, height=height, principal_point=point)


def _scaled_difference(a: Array, b: Array) -> tuple[Array, Array]:
    """a − b, (..., 3), each as a vector whose largest component is about 1, and the exponent of its power of two."""
    quartered = 2 * (np.maximum(np.abs(a), np.abs(b)).max(axis=-1, keepdims=True) > exact.LARGEST_PART)
    apart = np.ldexp(a, -quartered) - np.ldexp(b, -quartered)
    exponent = np.frexp(np.abs(apart).max(axis=-1, keepdims=True))[1]
    return np.ldexp(apart, -exponent), (exponent + quartered)[..., 0]


def basis(eye: ArrayLike, look_at: ArrayLike, up: ArrayLike) -> tuple[Array, Array, Array]:
    """(u, v, w) for any number of poses at once.

    eye, look_at, up : (..., 3) float64, world space; leading axes broadcast.

    Returns three (..., 3) float64 arrays of unit vectors, each component within 4e-16 of exact arithmetic on the same inputs.

    Raises InputError where eye = look_at, up = 0 or something is no finite number; it names the first such pose.
    """
    vectors = {"eye": eye, "look_at": look_at, "up": up}
    e, l, up = checks.broadcast(**{name: checks.array(name, values) for name, values in vectors.items()})
    if e.shape[-1:] != (3,):
        raise InputError(f"eye, look_at and up have the shape {e.shape}: give three numbers for each")
    if e.ndim == 1:
        pose = [checks.vector(name, vector, 3) for name, vector in (("eye", e), ("look_at", l), ("up", up))]
        _check_pose(*pose)
        return tuple(np.array(axis) for axis in _axes_of_one(pose[2], *_view_of_one(*pose)))
    leading, (e, l, up) = e.shape[:-1], (vector.reshape(-1, 3) for vector in (e, l, up))
    axes, valid = basis_of_views(e, l, up)
    if not valid.all():
        _check_poses(e, l, up)
    return tuple(axes.reshape(3, *leading, 3))


def basis_of_views(e: Array, l: Array, up: Array) -> tuple[Array, NDArray[np.bool_]]:
    """(3, n, 3) and (n,): `basis` of n poses, (n, 3) each, and true where they make views; elsewhere it is anything."""
    axes, valid = np.empty((3, *e.shape)), np.empty(len(e), bool)
    with np.errstate(all="ignore"):  # values that leave float64's range here are done again, one by one, below
        for batch in (slice(first, first + _AT_ONCE) for first in range(0, len(e), _AT_ONCE)):
            poses = (vector[batch].T.copy() for vector in (e, l, up))
            axes[:, batch].swapaxes(1, 2)[:], valid[batch] = _basis_of_many(*poses)
    for i in [] if valid.all() else np.flatnonzero(~valid):
        if make_views(e[i], l[i], up[i]):
            pose = [tuple(vector[i].tolist()) for vector in (e, l, up)]
            axes[:, i], valid[i] = _axes_of_one(pose[2], *_view_of_one(*pose)), True
    return axes, valid


def canonical_axes(up: Triple, looking_down: bool) -> tuple[Triple, Triple, Triple]:
    """(u, v, w) of a view exactly along up (looking_down is False) or against it (True).

    With up = (0, 1, 0) these are the text's: down u = (0, 0, 1), v = (1, 0, 0), w = (0, 1, 0); up u = (1, 0, 0), v = (0, 0, 1),
    w = (0, −1, 0). For any other up they are the text's, carried by the smallest rotation that takes (0, 1, 0) to up (for an up
    in the lower half-space, after half a turn about the x axis). In Blender, up = (0, 0, 1), that is (x, y, z) → (x, −z, y).

    Raises InputError if up = 0 or is not finite.
    """
    up = checks.vector("up", up, 3)
    _check_up(up)
    looking_down = checks.truth("looking_down", looking_down)
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


def _axes_of_one(up: Triple, apart: Pair, across: Pair, unit_up: Triple, _largest: float) -> tuple[Triple, Triple, Triple]:
    if any(across[0]):
        return _orthonormal(apart, across)
    return canonical_axes(up, looking_down=sum(a * b for a, b in zip(unit_up, apart[0], strict=True)) > 0)


def _view_of_one(e: Triple, l: Triple, up: Triple) -> tuple[Pair, Pair, Triple, float]:
    """e − l and up × (e − l) as pairs high + low, and up, all of a largest component of about 1.

    The fourth value is the largest component that the product would have if that of up and of e − l were 1.
    """
    safe = _is_moderate(e, l)
    if safe:
        unit_up, apart, across, safe = _view(e, l, up)
    if safe:
        largest = exact.largest_component(across[0])
        largest /= exact.largest_component(unit_up) * exact.largest_component(apart[0])
    else:
        (unit_up,) = exact.scaled_to_one(up)
        apart, across, largest = exact.whole_number_cross(up, e, l)
    return apart, tuple(exact.scaled_to_one(*across)) if largest else across, unit_up, largest


def _basis_of_many(e: Array, l: Array, up: Array) -> tuple[tuple, Array]:
    """(u, v, w) of (3, n) arrays, each such an array, and (n,) bool: where they can be relied on."""
    _, apart, across, safe = _view(e, l, up)
    across = tuple(exact.scaled_to_one(*across))
    return _orthonormal(apart, across), _is_moderate(e, l) & safe & across[0].any(axis=0)


def _view(e: exact.Vector, l: exact.Vector, up: exact.Vector) -> tuple[exact.Vector, Pair, Pair, bool | Array]:
    """up and e − l scaled to a largest component of about 1, up × (e − l), and whether the product is exact to its rounding."""
    high, low = exact.difference(e, l)
    apart = tuple(exact.scaled_to_one(high, low))
    (unit_up,) = exact.scaled_to_one(up)
    *across, settled = exact.cross(unit_up, *apart)
    safe = exact.are_factors(exact.joined(high, low, up), exact.joined(*apart, unit_up))
    return unit_up, apart, tuple(across), safe & settled


def _is_moderate(e: exact.Vector, l: exact.Vector) -> bool | Array:
    """True where e − l can't overflow."""
    return exact.largest_component(exact.joined(e, l)) < exact.LARGEST_PART


def _orthonormal(apart: Pair, across: Pair) -> tuple[exact.Vector, exact.Vector, exact.Vector]:
    """(u, v, w) from e − l and up × (e − l); v is their product, and not w × u, which would carry the rounding of both."""
    upward = exact.cross_of_perpendicular(*apart, *across)
    if isinstance(upward, tuple):
        return _normalized(across[0]), _normalized(upward), _normalized(apart[0])
    axes = np.array([across[0], upward, apart[0]]).swapaxes(0, 1)  # all three axes at once
    return tuple((axes / exact.length(axes)).swapaxes(0, 1))


def _normalized(vector: Triple) -> Triple:
    size = exact.length(vector)
    return tuple([component / size for component in vector])


def _check_pose(e: Triple, l: Triple, up: Triple) -> None:
    if e == l:
        raise InputError(f"eye and look_at are the same point {e}: the view has no direction, move one of them")
    _check_up(up)


def _check_up(up: Triple) -> None:
    if not any(up):
        raise InputError("up is (0, 0, 0): it has no direction, give the vector that shall point up in the picture")


def make_views(e: Array, l: Array, up: Array) -> NDArray[np.bool_]:
    """True where eye, look-at and up, (..., 3) each, make a view: all numbers are finite, eye ≠ look-at and up ≠ 0."""
    finite = np.isfinite(e).all(-1) & np.isfinite(l).all(-1) & np.isfinite(up).all(-1)
    return finite & (e != l).any(-1) & up.any(-1)


def _check_poses(e: Array, l: Array, up: Array) -> None:
    for i in np.flatnonzero(~make_views(e, l, up)):
        try:
            pose = [checks.vector(name, vector[i], 3) for name, vector in (("eye", e), ("look_at", l), ("up", up))]
            _check_pose(*pose)
        except InputError as error:
            raise InputError(f"pose {i}: {error}") from None


def _angle_between(a: Triple, b: Triple) -> float:
    across = (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
    return math.atan2(math.hypot(*across), sum(x * y for x, y in zip(a, b, strict=True)))
