"""Lens distortion: never dropped silently, refused with the displacement that it makes at the picture's corner.

All lenses that programs model around a pinhole are here, so that the figure is the lens's own. What leaves the pinhole
altogether (fisheyes, panoramas) is refused by name, in camera.py.
"""

import math
from collections.abc import Callable, Mapping

from ..pinhole import ViewPlane
from .camera import NoPinholeError, Options

_UNSEEN = 1e-3  # pixels: what this project calls the same camera
Point = tuple[float, float]
Lens = Callable[[float, float], Point]
"""x, y in the view plane at distance 1, y downwards, → where the lens puts them."""


def opencv(k: Mapping[str, float]) -> Lens:
    """OpenCV's: radial k1 … k6 (k4 … k6 divide), tangential p1 p2, thin prism s1 … s4. What is missing is 0.

    nerfstudio's and AliceVision's further radial terms are `r8`, on r⁸.
    """

    def lens(x: float, y: float) -> Point:
        r = x * x + y * y
        radial = 1 + _even(r, k.get("k1", 0.0), k.get("k2", 0.0), k.get("k3", 0.0), k.get("r8", 0.0))
        radial /= 1 + _even(r, k.get("k4", 0.0), k.get("k5", 0.0), k.get("k6", 0.0))
        p1, p2 = k.get("p1", 0.0), k.get("p2", 0.0)
        prism_x = k.get("s1", 0.0) * r + k.get("s2", 0.0) * r * r
        prism_y = k.get("s3", 0.0) * r + k.get("s4", 0.0) * r * r
        return (
            x * radial + 2 * p1 * x * y + p2 * (r + 2 * x * x) + prism_x,
            y * radial + p1 * (r + 2 * y * y) + 2 * p2 * x * y + prism_y,
        )

    return lens


def radial(profile: Callable[[float], float]) -> Lens:
    """A lens that moves a point at the radius r to the radius `profile(r)`."""

    def lens(x: float, y: float) -> Point:
        r = math.hypot(x, y)
        factor = profile(r) / r if r else 1.0
        return x * factor, y * factor

    return lens


def _even(r: float, *terms: float) -> float:
    """The polynomial of r² without its constant, by Horner's rule."""
    total = 0.0
    for term in reversed(terms):
        total = (total + term) * r
    return total


def settle(coefficients: Mapping[str, float], lens: Lens, plane: ViewPlane, what: str, options: Options) -> tuple[str, ...]:
    """The note on a distortion that is left out; nothing where there is none.

    coefficients : the lens's numbers by name, as a sentence shows them. what : whose, as a sentence names it.

    Raises
    ------
    NoPinholeError
        if there is one that a picture can show and `options.without_distortion` is not chosen.
    """
    given = {name: value for name, value in coefficients.items() if value}
    if not given:
        return ()
    pixels = displacement(lens, plane)
    size = f"{pixels:.3g} pixels" if math.isfinite(pixels) else "beyond all numbers"
    terms = ", ".join(f"{name} = {value:.6g}" for name, value in given.items())
    if options.without_distortion or pixels < _UNSEEN:
        return (f"The lens distortion of {what} ({terms}) was left out: it moves the picture's corner by {size}",)
    raise NoPinholeError(
        f"{what} has lens distortion ({terms}) that moves the picture's corner by {size}, which no pinhole has: "
        "undistort the pictures, or choose to take it without distortion"
    )


def displacement(lens: Lens, plane: ViewPlane) -> float:
    """How far the lens moves the corner that it moves most, in pixels."""
    (d_x, d_y), (c_x, c_y) = plane.distance, plane.principal_point
    largest = 0.0
    for column in (0, plane.width):
        for row in (0, plane.height):
            x, y = (column - c_x) / d_x, (c_y - row) / d_y
            try:
                moved_x, moved_y = lens(x, y)
                largest = max(largest, math.hypot((moved_x - x) * d_x, (moved_y - y) * d_y))
            except (OverflowError, ZeroDivisionError, ValueError):
                return math.inf
    return largest if math.isfinite(largest) else math.inf
