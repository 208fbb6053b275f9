"""A camera that was made for another picture than a scene's: fitted into the scene's, or the scene's set to it.

Size and pixel aspect are the scene's, not a camera's. Fitted, a camera sees as much across; what that changes is said.
"""

import dataclasses
from typing import Any

import bpy

from ..errors import InputError
from ..intrinsics import Frame
from ..pinhole import Pinhole
from .temporary_settings import Overrides

_LARGEST, _LEAST = 65536, 4  # Blender's own limits
_LARGEST_ASPECT = 200
_SAME_ASPECT = 2.0**-20  # relative: a size that was rounded, or float32


def settings_of(pinhole: Pinhole) -> dict[str, Any]:
    """The render settings of the picture that a pinhole is for.

    Raises InputError if Blender has no pictures or pixels like that.
    """
    size, aspect = (pinhole.width, pinhole.height), pinhole.distance[1] / pinhole.distance[0]
    if min(size) < _LEAST or max(size) > _LARGEST:
        raise InputError(
            f"the camera's picture is {size[0]} × {size[1]} pixels and Blender's are {_LEAST} to {_LARGEST} wide and high: "
            "leave the scene's size as it is"
        )
    if max(aspect, 1 / aspect) > _LARGEST_ASPECT:
        raise InputError(f"the camera's pixels have aspect {aspect:g} and Blender's 1/200 to 200: leave the scene's as it is")
    return {
        "resolution_x": pinhole.width,
        "resolution_y": pinhole.height,
        "resolution_percentage": 100,
        "use_border": False,
        "pixel_aspect_x": max(1.0, aspect),
        "pixel_aspect_y": max(1.0, 1 / aspect),
    }


def at_full_size(pinhole: Pinhole, frame: Frame) -> Pinhole:
    """The camera in the picture at 100 %; of a part of the picture it stays as it is."""
    if (pinhole.width, pinhole.height) != frame.size or frame.size == (frame.resolution_x, frame.resolution_y):
        return pinhole
    return pinhole.resized(frame.resolution_x, frame.resolution_y)


def fitted(pinhole: Pinhole, frame: Frame) -> tuple[Pinhole, tuple[str, ...]]:
    """The camera in the picture of a scene, across which it sees as much, and what is to be said of it."""
    width, height = frame.size
    scale, aspect = width / pinhole.width, frame.pixel_aspect_x / frame.pixel_aspect_y
    across, upwards = (scale * d for d in pinhole.distance)
    same_aspect = abs(upwards / across / aspect - 1) < _SAME_ASPECT
    stretch = across * aspect / upwards
    notes: tuple[str, ...] = ()
    same_size = (width, height) == (pinhole.width, pinhole.height)
    off = abs(pinhole.height * scale * stretch / height - 1) * height
    if off > 1 or (same_size and not same_aspect):
        pixels = "" if same_aspect else f" of aspect {pinhole.distance[1] / pinhole.distance[0]:.6g}"
        scenes = "" if same_aspect else f" of aspect {aspect:.6g}"
        notes = (
            f"The camera is for {pinhole.width} × {pinhole.height} pixels{pixels} and the scene renders {width} × {height}"
            f"{scenes}: it sees as much across, set the scene's size for the same picture",
        )
    (c_x, c_y), (column, row, window_width, window_height) = pinhole.principal_point, frame.window
    point = (
        width / 2 + (c_x - pinhole.width / 2) * scale - column,
        height / 2 + (c_y - pinhole.height / 2) * scale * (1.0 if same_aspect else stretch) - row,
    )
    return (
        dataclasses.replace(
            pinhole, distance=(across, across * aspect), width=window_width, height=window_height, principal_point=point
        ),
        notes,
    )


def set_size(overrides: Overrides, scene: bpy.types.Scene, pinhole: Pinhole) -> None:
    """Let the scene render the picture that a pinhole is for; overrides restore what was, if that is called for."""
    for name, value in settings_of(pinhole).items():
        overrides.set(scene.render, name, value)
