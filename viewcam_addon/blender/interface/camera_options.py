"""The options with which other programs' cameras are read or written (cameras.Options), as an operator's properties.

Blender remembers axes and scale from one use to the next where they are on show before it; so not in Paste, a single click.
Its floats are float32; a scale of up to seven digits is meant as it is shown.
"""

from typing import Any

import bpy

from ... import cameras as formats
from ...cameras import Options

_UNSTATED = "UNSTATED"
_AXES = {"as_is": "As They Are", "y_up": "Y Up to Z Up", "y_down": "Y Down to Z Up"}
_POSES = {
    "w2c_opencv": "World to Camera, OpenCV's Axes",
    "c2w_opencv": "Camera to World, OpenCV's Axes",
    "w2c_opengl": "World to Camera, OpenGL's Axes",
    "c2w_opengl": "Camera to World, OpenGL's Axes",
}
_MAY_BE_STATED = ("up_from", "angle_unit", "pixel", "pose")


def axes(**look: Any) -> Any:
    """The property "axes" of an operator."""
    return bpy.props.EnumProperty(
        name="Axes",
        description="Which axis is up in the other program",
        items=[(key, _AXES[key], formats.AXES[key]) for key in _AXES],
        **look,
    )


def scale(**look: Any) -> Any:
    """The property "scale" of an operator."""
    return bpy.props.FloatProperty(
        name="Scale",
        description="World units here of one unit there, as 0.001 for millimeters",
        default=1.0,
        min=1e-12,
        max=1e12,
        precision=6,
        **look,
    )


class WorldOptions:
    """Axes and scale, in both directions."""

    axes: axes()
    scale: scale()

    def chosen(self, **more: Any) -> Options:
        """The options that are chosen.

        more : further fields of Options, which the scene decides.
        """
        return Options(axes=self.axes, scale=float(f"{self.scale:.7g}"), **more)


class ReadingOptions(WorldOptions):
    """The options with which cameras are read, beside axes and scale."""

    up_from: bpy.props.EnumProperty(
        name="Level by",
        description="By what a world is turned upright that knows no up, as a reconstruction's",
        items=[
            (_UNSTATED, "Nothing", "Leave the world as it is"),
            *((key, {"cameras": "Cameras", "ground": "Ground of the Points"}[key], text) for key, text in formats.UPS.items()),
        ],
        options={"SKIP_SAVE"},
    )
    unmirrored: bpy.props.BoolProperty(
        name="Unmirrored",
        description="Take a camera whose picture is mirrored without that; else its scale becomes negative",
        options={"SKIP_SAVE"},
    )
    without_distortion: bpy.props.BoolProperty(
        name="Without Distortion",
        description="Take a camera without its lens distortion, which no pinhole has",
        options={"SKIP_SAVE"},
    )
    angle_unit: bpy.props.EnumProperty(
        name="Angles",
        description="The unit of angles where none is stated",
        items=[
            (_UNSTATED, "Stated", "Refuse an angle that may be in degrees or radians"),
            *((key, label, "") for key, label in formats.ANGLES.items()),
        ],
        options={"SKIP_SAVE"},
    )
    pixel: bpy.props.EnumProperty(
        name="Pixels Count from",
        description="Where (0, 0) lies in the picture",
        items=[
            (_UNSTATED, "Habit of the Format", ""),
            *((key, {"corner": "Corner", "center": "Center of the First"}[key], text) for key, text in formats.PIXELS.items()),
        ],
        options={"SKIP_SAVE"},
    )

    pose: bpy.props.EnumProperty(
        name="Matrix Goes",
        description="Which way a matrix goes, and by whose axes, where its name does not say it",
        items=[
            (_UNSTATED, "As Its Name Says", "Refuse a matrix that may go either way"),
            *((key, _POSES[key], text) for key, text in formats.POSES.items()),
        ],
        options={"SKIP_SAVE"},
    )

    def chosen(self, **more: Any) -> Options:
        stated = {name: None if getattr(self, name) == _UNSTATED else getattr(self, name) for name in _MAY_BE_STATED}
        return super().chosen(unmirrored=self.unmirrored, without_distortion=self.without_distortion, **(stated | more))


READING = ("axes", "scale", "up_from", "unmirrored", "without_distortion", *_MAY_BE_STATED[1:])
"""The names of all of them, in the order in which they are shown."""
