"""Two cameras, and two kinds of error: that of the conversion, and that of the renderer.

The conversion's error is the stated camera (e, l, up, d) against the one read back from Blender's float32 matrix and lens: pure
geometry, no picture needed. The renderer's error shows in the picture; what is the same for all its pixels (shift, zoom,
roll) is told apart here, since it names what is wrong.
"""

from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from ..pinhole import Pinhole
from .tolerances import FILTER_BIAS, FLOAT32, MEAN_ROUNDINGS

Array = NDArray[np.float64]

# Roundings of float32 between the four values and Blender's matrix. The rotation goes through three Euler angles of up to π,
# each half a unit of 2⁻²² off (2 · 2⁻²⁴ relative to 1), and a float32 matrix product: 3 · 2 + 3. Measured: 1.3e-7 = 2.2 ·
# 2⁻²⁴.
_ROTATION = 9.0 * FLOAT32
# Blender keeps the location relative to the parent and multiplies in float32: a rounding of each of three products, and of
# the sum.
_LOCATION = 4.0 * FLOAT32
# Lens, sensor and pixel aspect are float32 each; the principal point is a shift times a size.
_LENS = 3.0 * FLOAT32
_SHIFT = 2.0 * FLOAT32


@dataclass(frozen=True)
class ConversionError:
    """Stated camera against camera read back, in pixels.

    largest : the largest displacement over corners, edges and center of the picture, at the depths seen.
    tolerance : the displacement that the float32 storage of matrix and lens allows there.
    share : the worst displacement / tolerance.
    """

    largest: float
    tolerance: float
    share: float

    @property
    def ok(self) -> bool:
        return self.share <= 1.0

    def to_json(self) -> dict:
        return {**asdict(self), "ok": self.ok, "unit": "px"}


@dataclass(frozen=True)
class Systematic:
    """The systematic part of the errors, the same for all pixels of the test picture, by least squares.

    shift_x, shift_y : pixels, to the right and upwards: the mean displacement at the picture's principal point.
    zoom_x, zoom_y : relative magnification, 0 for none.
    roll : radians, counter-clockwise.
    tolerance : pixels, for the mean displacement over all hits.
    mean : its length.
    """

    shift_x: float
    shift_y: float
    zoom_x: float
    zoom_y: float
    roll: float
    mean: float
    tolerance: float

    @property
    def ok(self) -> bool:
        return self.mean <= self.tolerance

    def to_json(self) -> dict:
        return {**asdict(self), "ok": self.ok}


def conversion_error(stated: Pinhole, read_back: Pinhole, depths: Array) -> ConversionError:
    """The distance at which the read-back camera shows what the stated camera sees elsewhere.

    depths : the planar depths to look at, world units; the nearest shows a displaced eye most.
    """
    width, height = stated.width, stated.height
    x, y, depth = (
        grid.ravel()
        for grid in np.meshgrid([0.0, width / 2, width], [0.0, height / 2, height], np.asarray(depths, float), indexing="ij")
    )
    directions = stated.ray_directions(x, y, 0.0, 0.0)
    along = -(directions @ stated.basis()[2])
    points = np.asarray(stated.eye) + directions * (depth / along)[:, None]
    column, row, _ = read_back.project(points)
    displacement = np.nan_to_num(np.hypot(column - x, row - y), nan=float(np.hypot(width, height)))
    tolerance = _storage_tolerance(stated, x, y, depth)
    worst = int(np.argmax(displacement / tolerance))
    return ConversionError(float(displacement.max()), float(tolerance[worst]), float(displacement[worst] / tolerance[worst]))


def systematic_error(
    pinhole: Pinhole, pixels: NDArray, off_x: Array, off_y: Array, one_rounding: Array, center: float = FILTER_BIAS
) -> Systematic:
    """Shift, zoom and roll that explain the displacements best.

    pixels : (n,) int, row after row.
    off_x, off_y : (n,) displacements there, pixels to the right and upwards.
    one_rounding : (n,) `position_shift`. A pixel weighs as much as it is certain, so that a few slender triangles do not hide
        what all the others share.
    center : pixels that the renderer's rays are beside the pixels' centers by design.
    """
    row, column = np.divmod(pixels, pinhole.width)
    x, y = column + 0.5 - pinhole.principal_point[0], row + 0.5 - pinhole.principal_point[1]
    weight = one_rounding.min() / one_rounding
    design = np.column_stack([weight, x * weight, y * weight])
    (shift_x, zoom_x, shear_x), (shift_y, shear_y, zoom_y) = (
        np.linalg.lstsq(design, off * weight, rcond=None)[0] for off in (off_x, off_y)
    )
    aspect = pinhole.distance[0] / pinhole.distance[1]
    roll = np.arctan2(shear_y * aspect - shear_x / aspect, 2.0 + zoom_x + zoom_y)
    mean_x, mean_y, typical = (np.average(values, weights=weight**2) for values in (off_x, off_y, one_rounding))
    figures = (shift_x, shift_y, zoom_x, zoom_y, roll, np.hypot(mean_x, mean_y), MEAN_ROUNDINGS * typical + center)
    return Systematic(*(float(figure) for figure in figures))


def _storage_tolerance(camera: Pinhole, x: Array, y: Array, depth: Array) -> Array:
    """(n,) pixels: what float32 matrix, lens and shift may displace at the picture positions x, y and the depths.

    A turn by ε moves a point at the distance ρ of the view plane's ray by at most ρ²/d · ε; a displaced eye by ρ/z for each
    unit; a wrong d by its relative error times the distance from the principal point.
    """
    distance = min(camera.distance)
    off_axis = np.hypot(x - camera.principal_point[0], y - camera.principal_point[1])
    ray = np.hypot(off_axis, max(camera.distance))
    turned = _ROTATION * ray**2 / distance
    moved = _LOCATION * np.linalg.norm(camera.eye) * ray / depth
    zoomed = _LENS * off_axis
    shifted = _SHIFT * (max(camera.width, camera.height) + np.max(np.abs(camera.principal_point)))
    return turned + moved + zoomed + shifted
