"""Blender's lens, sensor, fit, shift, pixel aspect, percentage and border ↔ the view plane. Pure arithmetic, no Blender.

Blender says in millimeters on a sensor what the text says in pixels on the view plane. With W × H the picture at the resolution
percentage and n the number of square units along the side that the sensor fits,

    d_x = lens / sensor · n / pixel_aspect_x          c_x = W/2 − shift_x · n / pixel_aspect_x      from the left edge
    d_y = lens / sensor · n / pixel_aspect_y          c_y = H/2 − shift_y · n / pixel_aspect_y      from the bottom edge

Source: BKE_camera_params_compute_viewplane in Blender's source/blender/blenkernel/intern/camera.cc and blender_camera_viewplane
in Cycles' intern/cycles/blender/camera.cpp. Rejected: going through the field of view, which loses digits for wide angles and
is limited to one axis.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from . import checks
from .errors import InputError
from .pinhole import ViewPlane

# Blender clamps a shorter lens, silently (rna_camera.cc).
SHORTEST_LENS = 1.0
FITS = ("AUTO", "HORIZONTAL", "VERTICAL")
LENS_UNITS = ("MILLIMETERS", "HORIZONTAL", "VERTICAL", "DIAGONAL", "PIXELS")
_LENGTHS = ("MILLIMETERS", "PIXELS")
# Every number of a Blender camera is a float32, and within its range nothing below leaves float64's. A smaller relative
# difference can't be stored.
_SMALLEST, LARGEST_FLOAT32 = 2.0**-149, (2.0 - 2.0**-23) * 2.0**127
_FLOAT32_STEP = 2.0**-23


@dataclass(frozen=True)
class CameraData:
    """A perspective camera's data as Blender stores it. Lengths in millimeters, shift in units of the fitted side.

    Raises InputError if a length is not positive, if the fit is unknown, or if a number is beyond float32, which is what
    Blender stores.
    """

    lens: float
    sensor_width: float = 36.0
    sensor_height: float = 24.0
    sensor_fit: str = "AUTO"
    shift_x: float = 0.0
    shift_y: float = 0.0

    def __post_init__(self) -> None:
        for name in ("lens", "sensor_width", "sensor_height"):
            _set(self, name, checks.number(name, getattr(self, name), _SMALLEST, LARGEST_FLOAT32))
        for name in ("shift_x", "shift_y"):
            _set(self, name, checks.number(name, getattr(self, name), -LARGEST_FLOAT32, LARGEST_FLOAT32))
        if not isinstance(self.sensor_fit, str) or self.sensor_fit not in FITS:
            raise InputError(f"sensor_fit is {checks.quoted(self.sensor_fit)}: give one of {', '.join(FITS)}")


@dataclass(frozen=True)
class Frame:
    """The picture that a Blender scene renders.

    resolution_x, resolution_y : pixels at 100 %.
    percentage : whole per cent.
    pixel_aspect_x, pixel_aspect_y : width and height of a pixel, of which only the ratio counts.
    border : (left, bottom, right, top) as fractions of the picture, or None for the whole.
    crop : true to keep only the border.

    Raises InputError if a number is not whole and ≥ 1, an aspect not positive or beyond float32, or a border not between 0 and
    1 or reversed.
    """

    resolution_x: int
    resolution_y: int
    percentage: int = 100
    pixel_aspect_x: float = 1.0
    pixel_aspect_y: float = 1.0
    border: tuple[float, float, float, float] | None = None
    crop: bool = False

    def __post_init__(self) -> None:
        for name in ("resolution_x", "resolution_y", "percentage"):
            _set(self, name, checks.whole(name, getattr(self, name)))
        for name in ("pixel_aspect_x", "pixel_aspect_y"):
            _set(self, name, checks.number(name, getattr(self, name), _SMALLEST, LARGEST_FLOAT32))
        _set(self, "crop", checks.truth("crop", self.crop))
        if self.border is not None:
            _set(self, "border", checks.vector("border", self.border, 4))
            left, bottom, right, top = self.border
            if not (0 <= left <= right <= 1 and 0 <= bottom <= top <= 1):
                raise InputError(f"border is {self.border}: give left, bottom, right and top between 0 and 1, in this order")

    @property
    def size(self) -> tuple[int, int]:
        """(W, H): pixels of the whole picture at the percentage, rounded down as Blender does."""
        return self.resolution_x * self.percentage // 100, self.resolution_y * self.percentage // 100

    @property
    def border_window(self) -> tuple[int, int, int, int]:
        """(column, row, width, height) of the border in the whole picture, rows from the bottom; the whole without a border."""
        width, height = self.size
        if self.border is None:
            return 0, 0, width, height
        # Blender multiplies in float32 before it rounds down.
        size = (width, height, width, height)
        with np.errstate(under="ignore"):
            edges = np.floor(np.array(self.border, np.float32) * np.array(size, np.float32))
        left, bottom, right, top = (min(int(edge), most) for edge, most in zip(edges, size, strict=True))
        return left, bottom, right - left, top - bottom

    @property
    def window(self) -> tuple[int, int, int, int]:
        """(column, row, width, height) of what the image file holds: the border if it is cropped to, else the whole picture."""
        return self.border_window if self.crop else (0, 0, *self.size)


def _set(instance: object, name: str, value: object) -> None:
    object.__setattr__(instance, name, value)


def view_plane(camera: CameraData, frame: Frame) -> ViewPlane:
    """The view plane of a Blender camera in the picture of `frame` (its window, if it crops to a border).

    Raises InputError if the window holds no pixel.
    """
    width, height = frame.size
    column, row, window_width, window_height = frame.window
    if window_width < 1 or window_height < 1:
        raise InputError(
            f"the picture is {window_width} × {window_height} pixels: enlarge the resolution, percentage or border"
        )
    fitted_x, fitted_y = _fitted_pixels(camera.sensor_fit, frame)
    magnification = camera.lens / _fitted_sensor(camera)
    return ViewPlane(
        distance=(magnification * fitted_x, magnification * fitted_y),
        principal_point=(width / 2 - camera.shift_x * fitted_x - column, height / 2 - camera.shift_y * fitted_y - row),
        width=window_width,
        height=window_height,
    )


def camera_data(plane: ViewPlane, frame: Frame, sensor_width: float, sensor_height: float, sensor_fit: str) -> CameraData:
    """The Blender camera that has this view plane in the picture of `frame`, on the given sensor.

    A lens below Blender's 1 mm is never clamped: lens and sensor are doubled together until it fits.

    Raises InputError if the view plane has another size than the picture, if its two distances ask for another pixel aspect, or
    if the lens, the sensor or the shift would be beyond float32.
    """
    sensor = CameraData(SHORTEST_LENS, sensor_width, sensor_height, sensor_fit)
    column, row, *window_size = frame.window
    if [plane.width, plane.height] != window_size:
        raise InputError(
            f"the camera is for {plane.width} × {plane.height} pixels and the scene renders "
            f"{window_size[0]} × {window_size[1]}: set the scene's resolution, or give the camera the scene's size"
        )
    width, height = frame.size
    fitted_x, fitted_y = _fitted_pixels(sensor_fit, frame)
    magnification, other = plane.distance[0] / fitted_x, plane.distance[1] / fitted_y
    if abs(magnification - other) > _FLOAT32_STEP * magnification:
        raise InputError(
            f"the distances {plane.distance[0]:g} and {plane.distance[1]:g} pixels ask for pixels of aspect "
            f"{plane.distance[1] / plane.distance[0]:g} and the scene's have {fitted_y / fitted_x:g}: "
            "set the scene's pixel aspect"
        )
    lens = magnification * _fitted_sensor(sensor)
    if not _SMALLEST <= lens <= LARGEST_FLOAT32:
        raise InputError(_beyond_blender("distance", plane.distance[0], "lens", lens))
    with np.errstate(under="ignore"):
        stored = float(np.float32(lens))  # as Blender will round it
    growth = 2.0 ** max(0, math.ceil(math.log2(SHORTEST_LENS / stored)))
    largest_sensor = max(sensor.sensor_width, sensor.sensor_height) * growth
    if largest_sensor > LARGEST_FLOAT32:
        raise InputError(_beyond_blender("distance", plane.distance[0], "sensor", largest_sensor))
    shift_x = (width / 2 - plane.principal_point[0] - column) / fitted_x
    shift_y = (height / 2 - plane.principal_point[1] - row) / fitted_y
    for place, shift in zip(plane.principal_point, (shift_x, shift_y), strict=True):
        if abs(shift) > LARGEST_FLOAT32:
            raise InputError(_beyond_blender("principal point", place, "shift", shift))
    return replace(
        sensor,
        lens=lens * growth,
        sensor_width=sensor.sensor_width * growth,
        sensor_height=sensor.sensor_height * growth,
        shift_x=shift_x,
        shift_y=shift_y,
    )


def growth(sensor_fit: str, before: Frame, after: Frame) -> float:
    """The factor by which d, in pixel widths at 100 %, grows from one picture to another where lens and sensor stay."""
    was, now = (_fitted_pixels(sensor_fit, replace(frame, percentage=100))[0] for frame in (before, after))
    return now / was


def lens_in(unit: str, distance: float, frame: Frame, sensor: tuple[float, float], sensor_fit: str) -> float:
    """The lens that a distance is, in one of LENS_UNITS: millimeters, or an angle in radians of the whole picture, unshifted.

    distance : pixels of the picture of `frame` at 100 %.
    sensor : width and height in mm.
    """
    scaled = distance * _scale(unit, frame, sensor, sensor_fit)
    return scaled if unit in _LENGTHS else 2 * math.atan(0.5 / scaled)


def distance_by_lens(unit: str, value: float, frame: Frame, sensor: tuple[float, float], sensor_fit: str) -> float:
    """The distance that a lens is: the way back from `lens_in`.

    Raises InputError if there is none: an angle that is not between 0 and 180°, or a length that gives no distance that a
    camera can have.
    """
    if unit not in _LENGTHS:
        tangent = math.tan(value / 2) if 0 < value < math.pi else 0.0
        if not tangent > 0:
            raise InputError(f"field of view is {math.degrees(value):g}°: give an angle between 0 and 180°")
        value = 0.5 / tangent
    distance = value / _scale(unit, frame, sensor, sensor_fit)
    if not 0 < distance < math.inf:
        raise InputError(f"lens gives a distance of {distance:g} pixels: give one that is above 0 and finite")
    return distance


def _scale(unit: str, frame: Frame, sensor: tuple[float, float], sensor_fit: str) -> float:
    """The lens of a distance of one pixel: in the unit of a length, or for an angle as a part of the picture's side."""
    whole = replace(frame, percentage=100)
    if unit == "PIXELS":
        return 1.0
    if unit == "MILLIMETERS":
        return sensor[1 if sensor_fit == "VERTICAL" else 0] / _fitted_pixels(sensor_fit, whole)[0]
    width = float(whole.resolution_x)
    height = whole.resolution_y * (whole.pixel_aspect_y / whole.pixel_aspect_x)
    return 1 / {"HORIZONTAL": width, "VERTICAL": height, "DIAGONAL": math.hypot(width, height)}[unit]


def own_sensor(current: tuple[float, float], before: tuple[float, float]) -> tuple[float, float]:
    """The sensor (width, height) in mm on which `camera_data` is to be asked: the one before it grew, unless changed since.

    before : the sensor before it grew, zeros where it never did.
    """
    if not all(before):
        return current
    growth = current[0] / before[0]
    has_grown = math.frexp(growth)[0] == 0.5 and growth > 1 and growth == current[1] / before[1]
    return before if has_grown else current


def lens_and_sensor(data: CameraData, own: tuple[float, float]) -> dict[str, float | tuple[float, float]]:
    """The values that Blender is to store, by its names: lens and sensor, and beside them the artist's own sensor if it had to
    grow."""
    before = own if data.sensor_width != own[0] else (0.0, 0.0)
    values = {name: getattr(data, name) for name in ("lens", "sensor_width", "sensor_height")}
    return values | {"virtual_pinhole_sensor": before}


def check_storable(camera: str, **numbers: tuple[float, ...]) -> None:
    """Raise InputError, by the camera's name, unless float32 holds all numbers."""
    for name, values in numbers.items():
        if not all(abs(value) <= LARGEST_FLOAT32 for value in values):
            largest = max(values, key=abs)
            raise InputError(f"the {name} of camera {camera!r} needs {largest:g}, beyond Blender's numbers: choose another")


def _beyond_blender(name: str, pixels: float, of_blender: str, value: float) -> str:
    problem = "too small" if abs(value) < 1 else "too large"
    return f"the {name} of {pixels:g} pixels needs a {of_blender} of {value:g}, {problem} for Blender's numbers: choose another"


def _fitted_pixels(sensor_fit: str, frame: Frame) -> tuple[float, float]:
    """n / pixel_aspect_x and n / pixel_aspect_y: the fitted side, in pixel widths and in pixel heights."""
    width, height = frame.size
    aspect = frame.pixel_aspect_x / frame.pixel_aspect_y
    across = sensor_fit == "HORIZONTAL" or (sensor_fit == "AUTO" and width * aspect >= height)
    return (float(width), width * aspect) if across else (height / aspect, float(height))


def _fitted_sensor(camera: CameraData) -> float:
    """The sensor's side that the lens refers to; with AUTO always its width, even of an upright picture."""
    return camera.sensor_height if camera.sensor_fit == "VERTICAL" else camera.sensor_width
