"""Copy and paste a camera as text (camera_text.py), through the clipboard of the system.

Blender has no clipboard without a window: there a script gives the text as the operator's own property. What is copied of a
camera whose roll is held is the up that gives the same picture. Rejected: to copy shift, sensor or size as well, which are
Blender's and the scene's; the text says what the four values say.
"""

import contextlib
import dataclasses
from typing import ClassVar

import bpy
from bpy.app.translations import pgettext_iface as iface
from bpy.app.translations import pgettext_tip as tip

from ... import camera_text
from ...errors import InputError
from ...pinhole import Pinhole
from .. import camera as cameras
from .. import datablocks, targets
from .operators import CameraOperator

_NAMES = {"eye": "eye", "look_at": "look-at", "up": "up"}


class VIEWCAM_OT_copy_camera(CameraOperator, bpy.types.Operator):
    bl_idname = "viewcam.copy_camera"
    bl_label = "Copy Camera"
    bl_description = "Copy eye, look-at, up and distance as text, to paste on another camera, in another file or elsewhere"
    bl_options: ClassVar[set[str]] = {"REGISTER"}

    def work(self, camera_object: bpy.types.Object, scene: bpy.types.Scene) -> None:
        text = text_of(camera_object, scene)
        bpy.context.window_manager.clipboard = text
        self.report({"INFO"}, f"Copied {text}")


class VIEWCAM_OT_paste_camera(CameraOperator, bpy.types.Operator):
    bl_idname = "viewcam.paste_camera"
    bl_label = "Paste Camera"
    bl_description = (
        "Set the camera by the text on the clipboard: a copied camera, eye=… look_at=… up=… d=…, or a look-at line of pbrt, "
        "Mitsuba or POV-Ray. What the text does not say stays as it is"
    )

    text: bpy.props.StringProperty(
        name="Text", description="In place of what is on the clipboard", options={"HIDDEN", "SKIP_SAVE"}
    )

    def work(self, camera_object: bpy.types.Object, scene: bpy.types.Scene) -> None:
        found = camera_text.read(self.text or _clipboard())
        findings = paste(found, camera_object, scene)
        self.report({"INFO"}, f"Pasted {_said(found)} on {camera_object.name}")
        for finding in findings:  # after it, since the status bar shows what was reported last
            self.report({"WARNING"}, finding)


class VIEWCAM_OT_copy_readout(bpy.types.Operator):
    bl_idname = "viewcam.copy_readout"
    bl_label = "Copy Read-Out"
    bl_description = "Copy this read-out with all its digits and without its unit; a length as world units"
    bl_options: ClassVar[set[str]] = {"INTERNAL"}

    label: bpy.props.StringProperty(options={"SKIP_SAVE"})
    text: bpy.props.StringProperty(options={"SKIP_SAVE"})

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: bpy.types.OperatorProperties) -> str:
        return f"{tip(cls.bl_description)}: {properties.text}"

    def execute(self, context: bpy.types.Context) -> set[str]:
        context.window_manager.clipboard = self.text
        self.report({"INFO"}, f"{iface(self.label)} {self.text}")
        return {"FINISHED"}


def text_of(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> str:
    """The four values of a camera as text; where they are not in use, those that `adopt` would state.

    Raises
    ------
    InputError
        if the values make no camera, or the object is no pinhole.
    """
    frame = datablocks.frame_of(scene)
    stated = cameras.stated(camera_object, scene)
    shown = stated or cameras.as_it_stands(camera_object, scene, in_use=False)
    if stated:
        distance = targets.values(camera_object).distance_at_full_size(frame, camera_object.data.sensor_fit)
    else:
        distance = shown.distance[0] * (frame.resolution_x / frame.size[0])
    return camera_text.written(shown.eye, shown.look_at, shown.up, distance)


def paste(found: camera_text.CameraText, camera_object: bpy.types.Object, scene: bpy.types.Scene) -> list[str]:
    """State what a text says in the camera's values, and move it there; the other values stay, or are those of the camera.

    Returns what a reader should know, one sentence each.

    Raises
    ------
    InputError
        as `apply` does. Nothing has changed then.
    """
    frame = datablocks.frame_of(scene)
    given = {name: value for name in _NAMES if (value := getattr(found, name)) is not None}
    distance = found.distance_in(frame)
    if distance is not None:
        across = distance * (frame.size[0] / frame.resolution_x)
        given["distance"] = (across, across * (frame.pixel_aspect_x / frame.pixel_aspect_y))
    pinhole = dataclasses.replace(_present(camera_object, scene), **given)
    return [*found.notes, *cameras.apply(camera_object, pinhole, scene)]


def _present(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> Pinhole:
    """The camera as it is stated or, where nothing is or what is makes no camera, as it stands."""
    with contextlib.suppress(InputError):
        if stated := cameras.stated(camera_object, scene):
            return stated
    return cameras.as_it_stands(camera_object, scene, in_use=False)


def _said(found: camera_text.CameraText) -> str:
    names = [name for key, name in _NAMES.items() if getattr(found, key) is not None]
    if found.distance is not None or found.field_of_view is not None:
        names.append("distance")
    return ", ".join(names)


def _clipboard() -> str:
    try:
        return bpy.context.window_manager.clipboard
    except UnicodeDecodeError as error:
        raise InputError("the clipboard holds no text: copy a camera first") from error


def draw(layout: bpy.types.UILayout, camera_object: bpy.types.Object) -> None:
    """The row of both buttons, in the panel."""
    row = layout.row(align=True)
    row.operator("viewcam.copy_camera", text="Copy", icon="COPYDOWN").camera = camera_object.name
    row.operator("viewcam.paste_camera", text="Paste", icon="PASTEDOWN").camera = camera_object.name


CLASSES = (VIEWCAM_OT_copy_camera, VIEWCAM_OT_paste_camera, VIEWCAM_OT_copy_readout)
