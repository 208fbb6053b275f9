"""Blender's lens, sensor, fit, shift, pixel aspect, percentage and border ↔ the view plane. Pure arithmetic, no Blender.

Blender says in millimetres on a sensor what the text says in pixels on the view plane. With W × H the picture at the resolution
percentage and n the number of square units along the side that the sensor fits,

    d_x = lens / sensor · n / pixel_aspect_x          c_x = W/2 − shift_x · n / pixel_aspect_x      from the left edge
    d_y = lens / sensor · n / pixel_aspect_y          c_y = H/2 − shift_y · n / pixel_aspect_y      from the bottom edge

Source: BKE_camera_params_compute_viewplane in Blender's source/blender/blenkernel/intern/camera.cc and blender_camera_viewplane
in Cycles' intern/cycles/blender/camera.cpp. Rejected: going through the field of view, which loses digits for wide angles and
is limited to one axis.
"""

import math
from dataclasses import dataclass

import numpy as np

from .errors import InputError

# Blender clamps a shorter lens, silently (rna_camera.cc).
SHORTEST_LENS = 1.0
# Every number of a Blender camera is a float32: a smaller relative difference can't be stored.
_FLOAT32_STEP = 2.0**-23


@dataclass(frozen=True)
class CameraData:
    """A perspective camera's data as Blender stores it. Lengths in millimetres, shift in units of the fitted side."""

    lens: float
    sensor_width: float = 36.0
    sensor_height: float = 24.0
    sensor_fit: str = "AUTO"
    shift_x: float = 0.0
    shift_y: float = 0.0


@dataclass(frozen=True)
class Frame:
    """The picture that a Blender scene renders.

    resolution_x, resolution_y : pixels at 100 %. percentage : whole per cent.
    pixel_aspect_x, pixel_aspect_y : width and height of a pixel, each ≥ 1.
    border : (left, bottom, right, top) as fractions of the picture, or None for the whole. crop : whether only the border is
    kept.
    """

    resolution_x: int
    resolution_y: int
    percentage: int = 100
    pixel_aspect_x: float = 1.0
    pixel_aspect_y: float = 1.0
    border: tuple[float, float, float, float] | None = None
    crop: bool = False

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
        edges = np.float32(self.border) * np.float32((width, height, width, height))
        left, bottom, right, top = (int(edge) for edge in np.floor(edges))
        return left, bottom, right - left, top - bottom

    @property
    def window(self) -> tuple[int, int, int, int]:
        """(column, row, width, height) of what the image file holds: the border if it is cropped to, else the whole picture."""
        return self.border_window if self.crop else (0, 0, *self.size)


@dataclass(frozen=True)
class ViewPlane:
    """The part of a `Pinhole` that is not its pose.

    distance : (d_x, d_y) in pixels. principal_point : (c_x, c_y) in pixels from the left and the bottom edge.
    """

    distance: tuple[float, float]
    principal_point: tuple[float, float]
    width: int
    height: int


def view_plane(camera: CameraData, frame: Frame) -> ViewPlane:
    """The view plane of a Blender camera in the picture of `frame` (its window, if it crops to a border).

    Raises
    ------
    InputError
        if the window holds no pixel.
    """
    width, height = frame.size
    column, row, window_width, window_height = frame.window
    if window_width < 1 or window_height < 1:
        raise InputError(
            f"the picture is {window_width} × {window_height} pixels: enlarge the resolution, percentage or border"
        )
    fitted_x, fitted_y = _fitted_pixels(camera.sensor_fit, frame)
    magnification = camera.lens / _fitted_sensor(camera.sensor_fit, camera.sensor_width, camera.sensor_height)
    return ViewPlane(
        distance=(magnification * fitted_x, magnification * fitted_y),
        principal_point=(width / 2 - camera.shift_x * fitted_x - column, height / 2 - camera.shift_y * fitted_y - row),
        width=window_width,
        height=window_height,
    )


def camera_data(plane: ViewPlane, frame: Frame, sensor_width: float, sensor_height: float, sensor_fit: str) -> CameraData:
    """The Blender camera that has this view plane in the picture of `frame`, on the given sensor.

    A lens below Blender's 1 mm is never clamped: lens and sensor are doubled together until it fits.

    Raises
    ------
    InputError
        if the view plane has another size than the picture, if its two distances ask for another pixel aspect, or if they are
        too small for float32.
    """
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
    lens = magnification * _fitted_sensor(sensor_fit, sensor_width, sensor_height)
    if not np.float32(lens):
        raise InputError(f"the distance is {plane.distance[0]:g} pixels, too small for Blender's lens: enlarge it")
    growth = 2.0 ** max(0, math.ceil(math.log2(SHORTEST_LENS / np.float32(lens))))  # as Blender will round it
    return CameraData(
        lens=lens * growth,
        sensor_width=sensor_width * growth,
        sensor_height=sensor_height * growth,
        sensor_fit=sensor_fit,
        shift_x=(width / 2 - plane.principal_point[0] - column) / fitted_x,
        shift_y=(height / 2 - plane.principal_point[1] - row) / fitted_y,
    )


def _fitted_pixels(sensor_fit: str, frame: Frame) -> tuple[float, float]:
    """n / pixel_aspect_x and n / pixel_aspect_y: the fitted side, in pixel widths and in pixel heights."""
    width, height = frame.size
    across, upright = width * frame.pixel_aspect_x, height * frame.pixel_aspect_y
    fitted = {"HORIZONTAL": across, "VERTICAL": upright, "AUTO": max(across, upright)}[sensor_fit]
    return fitted / frame.pixel_aspect_x, fitted / frame.pixel_aspect_y


def _fitted_sensor(sensor_fit: str, sensor_width: float, sensor_height: float) -> float:
    """The sensor's side that the lens refers to; with AUTO always its width, even of an upright picture."""
    return sensor_height if sensor_fit == "VERTICAL" else sensor_width
