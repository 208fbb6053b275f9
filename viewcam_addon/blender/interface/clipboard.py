"""Copy and paste a camera as text (cameras/), through the clipboard of the system.

Blender has no clipboard without a window: there a script gives the text as the operator's own property. What is copied of a
camera whose roll is held is the up that gives the same picture. A text that says a whole camera replaces shift and mirror as
well; size and pixel aspect are the scene's, and where they differ it is told, or set if that is asked for.
"""

import contextlib
import dataclasses
from typing import ClassVar

import bpy
from bpy.app.translations import pgettext_iface as iface
from bpy.app.translations import pgettext_tip as tip

from ... import cameras as formats
from ...cameras import own
from ...errors import InputError
from ...intrinsics import Frame
from ...pinhole import Pinhole
from .. import camera as cameras
from .. import datablocks, targets
from .operators import CameraOperator

_NAMES = {"eye": "eye", "look_at": "look-at", "up": "up"}


class VIEWCAM_OT_copy_camera(CameraOperator, bpy.types.Operator):
    bl_idname = "viewcam.copy_camera"
    bl_label = "Copy Camera"
    bl_description = "Copy the camera as text, to paste on another camera, in another file or elsewhere"
    bl_options: ClassVar[set[str]] = {"REGISTER"}

    def work(self, camera_object: bpy.types.Object, scene: bpy.types.Scene) -> None:
        text = text_of(camera_object, scene)
        bpy.context.window_manager.clipboard = text
        self.report({"INFO"}, f"Copied {text}")


class VIEWCAM_OT_paste_camera(CameraOperator, bpy.types.Operator):
    bl_idname = "viewcam.paste_camera"
    bl_label = "Paste Camera"
    bl_description = (
        "Set the camera by the text on the clipboard: a copied camera, eye=… look_at=… up=… d=…, or what another program says "
        "of its camera. What the text does not say stays as it is"
    )

    text: bpy.props.StringProperty(
        name="Text", description="In place of what is on the clipboard", options={"HIDDEN", "SKIP_SAVE"}
    )
    set_size: bpy.props.BoolProperty(
        name="Set the Scene's Size",
        description="Give the scene the resolution and pixel aspect of the pasted camera, where the text says them",
        options={"SKIP_SAVE"},
    )
    unmirrored: bpy.props.BoolProperty(
        name="Unmirrored",
        description="Paste a camera whose picture is mirrored without that",
        options={"SKIP_SAVE"},
    )
    named: bpy.props.StringProperty(
        name="Camera's Name", description="Which one, where the text has several", options={"SKIP_SAVE"}
    )

    def work(self, camera_object: bpy.types.Object, scene: bpy.types.Scene) -> None:
        text, before = self.text or _clipboard(), _present(camera_object, scene)
        found = read(text, before, scene, self.unmirrored, self.named or None)
        findings = paste(found, before, camera_object, scene, self.set_size)
        self.report({"INFO"}, f"Pasted {_said(found.pinhole, before)} on {camera_object.name}")
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
    """A camera as text, in the picture at 100 %; where its values are not in use, those that `adopt` would state.

    Raises
    ------
    InputError
        if the values make no camera, or the object is no pinhole.
    """
    frame = datablocks.frame_of(scene)
    stated = cameras.stated(camera_object, scene)
    shown = stated or cameras.as_it_stands(camera_object, scene, in_use=False)
    whole = _at_full_size(shown, frame)
    if stated:  # as it was typed
        across = targets.values(camera_object).distance_at_full_size(frame, camera_object.data.sensor_fit)
        upwards = across * (frame.pixel_aspect_x / frame.pixel_aspect_y)
        whole = dataclasses.replace(whole, distance=(across, upwards))
    return own.write([formats.Camera(camera_object.name, whole)], formats.Options())


def read(text: str, present: Pinhole, scene: bpy.types.Scene, unmirrored: bool, name: str | None) -> formats.Camera:
    """The camera that a text says, in the picture that it states, else in the scene's at 100 %.

    present : what stands where the text says nothing.
    """
    frame = datablocks.frame_of(scene)
    aspect = frame.pixel_aspect_x / frame.pixel_aspect_y
    size = (frame.resolution_x, frame.resolution_y)
    options = formats.Options(size=size, pixel_aspect=aspect, base=_at_full_size(present, frame), unmirrored=unmirrored)
    return formats.choose(formats.read(text, options=options), name)


def paste(
    found: formats.Camera, present: Pinhole, camera_object: bpy.types.Object, scene: bpy.types.Scene, set_size: bool = False
) -> list[str]:
    """State what a text says in the camera's values, and move it there; its view plane as well, if the text says one.

    Returns what a reader should know, one sentence each.

    Raises
    ------
    InputError
        as `apply` does. Nothing has changed then.
    """
    frame = datablocks.frame_of(scene)
    before = _at_full_size(present, frame)
    if found.pinhole.distance == before.distance and found.pinhole.plane == before.plane:
        pinhole, notes = dataclasses.replace(present, **_pose(found.pinhole), mirrored=found.pinhole.mirrored), ()
        return [*found.notes, *notes, *cameras.apply(camera_object, pinhole, scene)]
    if not set_size:
        pinhole, notes = _fitted(found.pinhole, frame)
        return [*found.notes, *notes, *cameras.apply(camera_object, pinhole, scene)]
    render, kept = scene.render, {name: getattr(scene.render, name) for name in _SIZE}
    try:
        _set_size(render, found.pinhole)
        pinhole, notes = _fitted(found.pinhole, datablocks.frame_of(scene))
        return [*found.notes, *notes, *cameras.apply(camera_object, pinhole, scene)]
    except InputError:
        for name, value in kept.items():
            setattr(render, name, value)
        raise


_SIZE = ("resolution_x", "resolution_y", "resolution_percentage", "pixel_aspect_x", "pixel_aspect_y", "use_crop_to_border")


def _set_size(render: bpy.types.RenderSettings, pinhole: Pinhole) -> None:
    """The picture that a pinhole is for, in a scene's settings."""
    render.resolution_x, render.resolution_y, render.resolution_percentage = pinhole.width, pinhole.height, 100
    aspect = pinhole.distance[1] / pinhole.distance[0]
    render.pixel_aspect_x, render.pixel_aspect_y = max(1.0, aspect), max(1.0, 1 / aspect)
    render.use_crop_to_border = False


def _at_full_size(pinhole: Pinhole, frame: Frame) -> Pinhole:
    """The camera in the picture at 100 %; of a part of the picture it stays as it is."""
    if (pinhole.width, pinhole.height) != frame.size or frame.size == (frame.resolution_x, frame.resolution_y):
        return pinhole
    return pinhole.resized(frame.resolution_x, frame.resolution_y)


def _fitted(pinhole: Pinhole, frame: Frame) -> tuple[Pinhole, tuple[str, ...]]:
    """The camera in the picture of a scene, across which it sees as much, and what is to be said of it."""
    width, height = frame.size
    scale = width / pinhole.width
    across, upwards = (scale * d for d in pinhole.distance)
    (c_x, c_y), aspect = pinhole.principal_point, frame.pixel_aspect_x / frame.pixel_aspect_y
    notes: tuple[str, ...] = ()
    if abs(upwards / across / aspect - 1) < 2.0**-20:
        upwards = across * aspect  # of a size that was rounded
    shape = pinhole.height * scale / height * (across * aspect / upwards)
    if abs(shape - 1) * height > 1:
        notes = (
            f"The camera is for {pinhole.width} × {pinhole.height} pixels and the scene renders {width} × {height}: "
            "it sees as much across, set the scene's size for the same picture",
        )
    column, row, window_width, window_height = frame.window
    point = (
        width / 2 + (c_x - pinhole.width / 2) * scale - column,
        height / 2 + (c_y - pinhole.height / 2) * scale * (across * aspect / upwards) - row,
    )
    fitted = dataclasses.replace(
        pinhole, distance=(across, upwards), width=window_width, height=window_height, principal_point=point
    )
    return fitted, notes


def _pose(pinhole: Pinhole) -> dict[str, tuple]:
    return {name: getattr(pinhole, name) for name in _NAMES}


def _present(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> Pinhole:
    """The camera as it is stated or, where nothing is or what is makes no camera, as it stands."""
    with contextlib.suppress(InputError):
        if stated := cameras.stated(camera_object, scene):
            return stated
    return cameras.as_it_stands(camera_object, scene, in_use=False)


def _said(pinhole: Pinhole, before: Pinhole) -> str:
    """What differs now."""
    names = [name for key, name in _NAMES.items() if getattr(pinhole, key) != getattr(before, key)]
    names += ["distance"] if pinhole.distance != before.distance else []
    names += ["shift"] if pinhole.plane.principal_point != (pinhole.width / 2, pinhole.height / 2) else []
    names += ["mirror"] if pinhole.mirrored != before.mirrored else []
    return ", ".join(names) or "the same camera"


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
