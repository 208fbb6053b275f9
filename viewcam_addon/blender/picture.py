"""For which picture a camera was set, and in the pixels of which picture its distance counts.

`virtual_pinhole.picture` is the one for which it was set last, so that a new resolution is noticed (resolution.py). Where
`keeps` is FIELD_OF_VIEW the distance grows with the picture: it counts pixels of the one in `counted_in`, and each time the
camera is set it is counted anew in the present one. A distance with curves or a driver of its own stays as they say, and
`counted_in` with it. Rejected: to scale the curves (the artist's, and perhaps shared or linked), and never to count anew (the
panel would show a distance in pixels that are no longer those of the picture).
"""

import contextlib
from collections.abc import Sequence

import bpy

from .. import checks, intrinsics
from ..errors import InputError
from . import datablocks, versions


def shape(frame: intrinsics.Frame) -> tuple[float, ...]:
    """What is stored of a picture: resolution, percentage and pixel aspect."""
    return frame.resolution_x, frame.resolution_y, frame.percentage, frame.pixel_aspect_x, frame.pixel_aspect_y


def frame(stored: Sequence[float]) -> intrinsics.Frame | None:
    """The picture of which `shape` was stored, None where there is none."""
    with contextlib.suppress(InputError, ValueError, OverflowError):
        return intrinsics.Frame(*map(int, stored[:3]), *stored[3:])
    return None


def distance(group: bpy.types.PropertyGroup, now: intrinsics.Frame) -> float:
    """The effective distance in the picture `now` at 100 %, in float64: zoom, and what the resolution keeps, included.

    Raises
    ------
    InputError
        if zoom is no number above 0.
    """
    if checks.number("zoom", group.zoom) <= 0:
        raise InputError(f"zoom is {group.zoom:g}: give a factor above 0")
    return group.numbers()[3] * growth(group, now)


def growth(group: bpy.types.PropertyGroup, now: intrinsics.Frame) -> float:
    """The factor on the distance in the picture `now`: 1 unless the field of view of another picture is kept."""
    counted_in = frame(group.counted_in) if group.keeps == "FIELD_OF_VIEW" else None
    return intrinsics.growth(group.id_data.data.sensor_fit, counted_in, now) if counted_in else 1.0


def is_counted_in_earlier(group: bpy.types.PropertyGroup) -> bool:
    """Whether `counted_in` has to stay: the field of view is kept, and the distance is animated."""
    if group.keeps != "FIELD_OF_VIEW" or not frame(group.counted_in):
        return False
    curves = [*versions.animation_curves(group.id_data), *versions.drivers(group.id_data)]
    return any(curve.data_path == "virtual_pinhole.distance" for curve in curves)


def settle(group: bpy.types.PropertyGroup, now: intrinsics.Frame) -> None:
    """Take note that the camera has been set for the picture `now`, and count the distance in its pixels."""
    if not is_counted_in_earlier(group):
        factor = growth(group, now)
        if factor != 1:
            group.multiply_distance(factor)
        group.counted_in = shape(now)
    group.picture = shape(now)


def scenes_it_is_set_for(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> list[bpy.types.Scene]:
    """The other scenes of a camera, those that render the very picture for which it was set."""
    set_for = tuple(camera_object.virtual_pinhole.picture)
    return [each for each in camera_object.users_scene if each != scene and shape(datablocks.frame_of(each)) == set_for]
