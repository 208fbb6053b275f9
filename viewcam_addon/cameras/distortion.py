"""Lens distortion: where a lens puts what a pinhole sees, and back. The camera stays a pinhole; its picture is undistorted.

Points are x, y in the view plane at distance 1, y downwards. Every lens here is a projection, which moves a point along its
radius, and then OpenCV's polynomial: COLMAP's, Metashape's, Meshroom's, RealityCapture's, Kalibr's and nerfstudio's models are
these with other names, so each formula stands once. The readers know which names mean which coefficient.

Sources: OpenCV's calib3d (projectPoints, initUndistortRectifyMap, fisheye; computeTiltProjectionMatrix), COLMAP's
src/colmap/sensor/models.h; Devernay and Faugeras 2001 (FOV), Fitzgibbon 2001 (division), Khomutenko et al. 2016 (EUCM). What
has no picture in a plane at all, as panoramas, is refused by name, in camera.py.
"""

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from .. import checks
from ..errors import InputError
from ..pinhole import Pinhole, ViewPlane

_UNSEEN = 1e-3  # pixels: what this project calls the same camera
_STEPS = 100  # Newton's method takes five or so where there is an answer
_SAME = 1e-13  # in the plane at distance 1: a step that is none any more
_INVERSE = 1e-9  # largest distance between a place and its distorted answer
_STEP = 1e-6  # the differences that make its Jacobian are right to 1e-10, and so is each step


@dataclass(frozen=True)
class Lens:
    """The lens: how it bends a pinhole's picture.

    terms : (name, value) of its coefficients, as its program calls them.
    projection : one of PROJECTIONS, and parameters its own.
    radial : the polynomial's coefficients of r², r⁴, …
    divisor : the coefficients of r², r⁴, … of the polynomial that divides it.
    tangential : OpenCV's p1, p2.
    prism : its s1, s2 (across) and s3, s4 (down), on r² and r⁴.
    tilt : its τx and τy, radians.
    skew : the factor of y in what is added to x.
    radial_first : true if the tangential and prism terms are computed at the point that the radial ones have moved.
    """

    terms: tuple[tuple[str, float], ...] = field(compare=False)
    projection: str = "pinhole"
    parameters: tuple[float, ...] = ()
    radial: tuple[float, ...] = ()
    divisor: tuple[float, ...] = ()
    tangential: tuple[float, float] = (0.0, 0.0)
    prism: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    tilt: tuple[float, float] = (0.0, 0.0)
    skew: float = 0.0
    radial_first: bool = False

    def __post_init__(self) -> None:
        for name in ("radial", "divisor"):  # lenses that do the same are the same
            terms = getattr(self, name)
            while terms and not terms[-1]:
                terms = terms[:-1]
            object.__setattr__(self, name, tuple(terms))

    def to_json(self) -> dict[str, Any]:
        """The lens, as JSON can hold it."""
        return {**dataclasses.asdict(self), "terms": dict(self.terms)}

    @classmethod
    def from_json(cls, document: Mapping[str, Any]) -> Self:
        """The lens that `to_json` gave. Raises InputError for what is none."""
        try:
            values = {**document, "terms": tuple((str(name), float(value)) for name, value in document["terms"].items())}
            for name, count in _COUNTS.items():
                numbers = checks.array(name, values[name])
                checks.finite(name, numbers)
                if numbers.ndim != 1 or (count and len(numbers) != count):
                    raise ValueError(f"no {name}")
                values[name] = tuple(numbers.tolist())
            values["skew"] = checks.number("skew", values["skew"])
            checks.truth("radial_first", values["radial_first"])
            if len(values["parameters"]) != PROJECTIONS[values["projection"]]:
                raise ValueError("no parameters")
            if values["projection"] in ("fov", "measured") and not all(values["parameters"]):
                raise ValueError("a divisor of 0")
            return cls(**values)
        except (LookupError, TypeError, ValueError, AttributeError) as error:
            raise InputError("the lens is none of this project's: write the file again") from error

    def distort(self, points: ArrayLike) -> np.ndarray:
        """The places in the photograph of a pinhole's points, (..., 2) → (..., 2); NaN where the model has none."""
        with np.errstate(all="ignore"):
            return self._polynomial(_along_radius(np.asarray(points, dtype=np.float64), self._profile))

    def undistort(self, points: ArrayLike) -> np.ndarray:
        """The pinhole's points of places in the photograph, (..., 2) → (..., 2); NaN where no point is seen there."""
        with np.errstate(all="ignore"):
            return _along_radius(self._inverse_polynomial(np.asarray(points, dtype=np.float64)), self._inverse_profile)

    def folds(self, points: ArrayLike) -> np.ndarray:
        """True for a pinhole's points, (..., 2), at which the model no longer goes outwards: no lens shows them there."""
        points = np.asarray(points, dtype=np.float64)
        with np.errstate(all="ignore"):
            along_x, along_y = ((self.distort(points + step) - self.distort(points - step)) for step in _STEP * np.eye(2))
            moved = self.distort(points)
            turned = _cross(along_x, along_y)
            return ~((turned > 0) & (((moved * points).sum(axis=-1) > 0) | (np.abs(points).max(axis=-1) < _STEP)))

    def _profile(self, r: np.ndarray) -> np.ndarray:
        """The radius at which the projection shows what the pinhole has at the radius r."""
        match self.projection:
            case "equidistant":
                return np.arctan(r)
            case "fov":
                (omega,) = self.parameters
                return np.arctan(2 * r * math.tan(omega / 2)) / omega
            case "division":
                (k,) = self.parameters
                return 2 * r / (1 + np.sqrt(1 - 4 * k * r * r))
            case "measured":  # the root of k s³ + s − r that goes to 0 with r
                (k,) = self.parameters
                size = math.sqrt(3 * abs(k))
                triple = 1.5 * size * r
                return 2 / size * (np.sinh(np.arcsinh(triple) / 3) if k > 0 else np.sin(np.arcsin(triple) / 3))
            case "eucm":
                alpha, beta = self.parameters
                return r / (alpha * np.sqrt(beta * r * r + 1) + 1 - alpha)
        return r

    def _inverse_profile(self, r: np.ndarray) -> np.ndarray:
        """The radius in the pinhole's picture of what the projection shows at the radius r; NaN behind the camera."""
        match self.projection:
            case "equidistant":
                return np.where(r < math.pi / 2, np.tan(r), np.nan)
            case "fov":
                (omega,) = self.parameters
                return np.where(np.abs(r * omega) < math.pi / 2, np.tan(r * omega), np.nan) / (2 * math.tan(omega / 2))
            case "division":
                (k,) = self.parameters
                return np.where(k * r * r < 1, r / (1 + k * r * r), np.nan)
            case "measured":
                (k,) = self.parameters
                return np.where(1 + 3 * k * r * r > 0, r * (1 + k * r * r), np.nan)
            case "eucm":
                alpha, beta = self.parameters
                depth = (1 - beta * alpha * alpha * r * r) / (alpha * np.sqrt(1 - (2 * alpha - 1) * beta * r * r) + 1 - alpha)
                return np.where(depth > 0, r / depth, np.nan)
        return r

    def _polynomial(self, points: np.ndarray) -> np.ndarray:
        x, y = points[..., 0], points[..., 1]
        r = x * x + y * y
        factor = (1 + _even(r, self.radial)) / (1 + _even(r, self.divisor))
        moved_x, moved_y = x * factor, y * factor
        if self.radial_first:
            x, y = moved_x, moved_y
            r = x * x + y * y
        (p1, p2), (s1, s2, s3, s4) = self.tangential, self.prism
        moved_x = moved_x + 2 * p1 * x * y + p2 * (r + 2 * x * x) + _even(r, (s1, s2))
        moved_y = moved_y + p1 * (r + 2 * y * y) + 2 * p2 * x * y + _even(r, (s3, s4))
        if any(self.tilt):
            moved_x, moved_y, depth = np.moveaxis(
                np.stack([moved_x, moved_y, np.ones_like(moved_x)], axis=-1) @ _tilted(*self.tilt).T, -1, 0
            )
            moved_x, moved_y = moved_x / depth, moved_y / depth
        return np.stack([moved_x + self.skew * moved_y, moved_y], axis=-1)

    def _inverse_polynomial(self, points: np.ndarray) -> np.ndarray:
        """The inverse by Newton's method, from the points themselves; NaN without one, or with one beyond the lens's fold."""
        inverse, size = points.copy(), 1 + np.abs(points).max(axis=-1)
        for _ in range(_STEPS):
            off = self._polynomial(inverse) - points
            along_x, along_y = (
                (self._polynomial(inverse + step) - self._polynomial(inverse - step)) / (2 * _STEP)
                for step in _STEP * np.eye(2)
            )
            turned = _cross(along_x, along_y)
            step = np.stack([_cross(off, along_y), _cross(along_x, off)], axis=-1) / turned[..., None]
            inverse = inverse - step
            if not (np.abs(step).max(axis=-1) > _SAME * size).any():
                break
        is_right = (np.abs(self._polynomial(inverse) - points).max(axis=-1) < _INVERSE * size) & (turned > 0)
        return np.where(is_right[..., None], inverse, np.nan)


PROJECTIONS = {"pinhole": 0, "equidistant": 0, "fov": 1, "division": 1, "measured": 1, "eucm": 2}
"""The laws by which a lens moves a point along its radius, but for its polynomial, and how many parameters each has."""

_COUNTS = {"parameters": 0, "radial": 0, "divisor": 0, "tangential": 2, "prism": 4, "tilt": 2}
"""The fields of `Lens` that are several numbers, and how many; 0 for any number of them."""


def view_plane(pinhole: Pinhole, lens: Lens | None, columns: ArrayLike, rows: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """The view plane's points that places in the photograph show: as Pinhole.view_plane has them, x and y at distance 1.

    pinhole : the camera with the photograph's own view plane.
    columns, rows : places in the photograph, from its left and bottom edge; broadcast where there is a lens.

    Returns NaN where the photograph shows nothing.
    """
    x, y = pinhole.view_plane(columns, rows)
    if lens is None:
        return x, y
    x, down = np.moveaxis(lens.undistort(np.stack(np.broadcast_arrays(x, -y), axis=-1)), -1, 0)
    return x, -down


def project(pinhole: Pinhole, lens: Lens | None, points: ArrayLike) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The places in the photograph at which points appear, and their depths, as Pinhole.project has them.

    pinhole : the camera with the photograph's own view plane.
    points : (..., 3), world space.

    Returns NaN where the lens folds: it shows no point there.
    """
    column, row, depth = pinhole.project(points)
    if lens is None:
        return column, row, depth
    with np.errstate(invalid="ignore"):
        straight = (np.stack([column, row], axis=-1) - pinhole.principal_point) / pinhole.distance * (1, -1)
        bent = np.where(lens.folds(straight)[..., None], np.nan, lens.distort(straight))
        column, row = np.moveaxis(bent * (1, -1) * pinhole.distance + pinhole.principal_point, -1, 0)
    return column, row, depth


def opencv(k: Mapping[str, float], terms: Mapping[str, float] | None = None, skew: float = 0.0) -> Lens:
    """OpenCV's lens: radial k1 … k6 (k4 … k6 divide), tangential p1 p2, thin prism s1 … s4, tilt tx ty. What is missing is 0.

    The further radial term of nerfstudio, Metashape and RealityCapture is `r8`, on r⁸.

    terms : our name of a term → the program's, where they differ.
    """
    k1, k2, k3, r8, k4, k5, k6, p1, p2, s1, s2, s3, s4, tx, ty = (
        k.get(name, 0.0) for name in ("k1", "k2", "k3", "r8", "k4", "k5", "k6", "p1", "p2", "s1", "s2", "s3", "s4", "tx", "ty")
    )
    return Lens(
        tuple((k if terms is None else terms).items()),
        radial=(k1, k2, k3, r8),
        divisor=(k4, k5, k6),
        tangential=(p1, p2),
        prism=(s1, s2, s3, s4),
        tilt=(tx, ty),
        skew=skew,
    )


def fisheye(k: Mapping[str, float]) -> Lens:
    """OpenCV's fisheye and Kannala–Brandt's: the angle from the axis, and radial k1 … k4 on its even powers."""
    return Lens(tuple(k.items()), "equidistant", radial=tuple(k.get(name, 0.0) for name in ("k1", "k2", "k3", "k4")))


def division(k: float, name: str = "k") -> Lens:
    """The division model: a place at the radius r in the photograph is the pinhole's at r / (1 + k r²)."""
    return Lens(((name, k),), "division", (k,))


def measured(k: float, name: str = "k") -> Lens:
    """VisualSFM's model: a place at the radius r in the photograph is the pinhole's at r (1 + k r²). k : not 0."""
    return Lens(((name, k),), "measured", (k,))


def _along_radius(points: np.ndarray, profile: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    r = np.hypot(points[..., 0], points[..., 1])
    return points * np.where(r > 0, profile(r) / np.where(r > 0, r, 1), 1)[..., None]


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _even(r: np.ndarray, terms: tuple[float, ...]) -> np.ndarray:
    """The polynomial of r², r⁴, … without its constant, by Horner's rule. r : the squares."""
    total = np.zeros_like(r)
    for term in reversed(terms):
        total = (total + term) * r
    return total


def _tilted(tau_x: float, tau_y: float) -> np.ndarray:
    """The homography, 3 × 3, of a sensor that is turned about x and then about y."""
    (c_x, s_x), (c_y, s_y) = ((math.cos(angle), math.sin(angle)) for angle in (tau_x, tau_y))
    turn = np.array([[c_y, 0, -s_y], [0, 1, 0], [s_y, 0, c_y]]) @ np.array([[1, 0, 0], [0, c_x, s_x], [0, -s_x, c_x]])
    return np.array([[turn[2, 2], 0, -turn[0, 2]], [0, turn[2, 2], -turn[1, 2]], [0, 0, 1]]) @ turn


def settle(lens: Lens, plane: ViewPlane, what: str, left_out: bool) -> tuple[Lens | None, tuple[str, ...]]:
    """The lens that a camera has, None where that is none that a picture shows; and notes.

    what : the lens's owner, as a sentence names it.
    left_out : true if no lens is wanted.
    """
    if lens.projection == "pinhole" and not any(value for _, value in lens.terms):
        return None, ()
    pixels = displacement(lens, plane)
    sentence = f"The lens distortion of {what} ({_listed(lens)})"
    if left_out or pixels < _UNSEEN:
        return None, (f"{sentence} was left out: it {_moves(pixels)}",)
    if lens.projection == "pinhole" and pixels > math.hypot(plane.width, plane.height):
        sentence += ", which may be of another model,"
    return lens, (f"{sentence} {_moves(pixels)}: the camera is the pinhole of the undistorted picture",)


def refuse(lens: Lens | None, plane: ViewPlane, what: str, place: str) -> None:
    """Raise InputError if there is a lens, where only a pinhole can be said.

    place : the thing that can't say it.
    """
    if lens is not None:
        raise InputError(
            f"{what} has lens distortion ({_listed(lens)}) that {_moves(displacement(lens, plane))}, which {place} can't say: "
            "undistort the pictures, or choose to take it without distortion"
        )


def displacement(lens: Lens, plane: ViewPlane) -> float:
    """The displacement of the corner that the lens moves most, in pixels."""
    (d_x, d_y), (c_x, c_y) = plane.distance, plane.principal_point
    corners = np.array([[column - c_x, c_y - row] for column in (0, plane.width) for row in (0, plane.height)])
    with np.errstate(all="ignore"):
        corners = corners / [d_x, d_y]
        moved = np.hypot(*((lens.distort(corners) - corners) * [d_x, d_y]).T)
    return float(moved.max()) if np.isfinite(moved).all() else math.inf


def _moves(pixels: float) -> str:
    size = f"{pixels:.3g} pixels" if math.isfinite(pixels) else "more than a number says"
    return f"moves the picture's corner by {size}"


def _listed(lens: Lens) -> str:
    return ", ".join(f"{name} = {value:.6g}" for name, value in lens.terms if value) or lens.projection
