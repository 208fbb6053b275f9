"""Copy and paste a camera as text (cameras/), through the clipboard of the system.

Blender has no clipboard without a window: there a script gives the text as the operator's own property. What is copied of a
camera whose roll is held is the up that gives the same picture. A text that says a whole camera replaces shift and mirror as
well; size and pixel aspect are the scene's, and where they differ it is told, or set if that is asked for.
"""

import contextlib
import dataclasses
import math
from typing import ClassVar

import bpy
from bpy.app.translations import pgettext_iface as iface
from bpy.app.translations import pgettext_tip as tip

from ... import cameras as formats
from ...errors import InputError
from ...pinhole import Pinhole
from .. import camera as cameras
from .. import datablocks, picture, preferences, targets
from ..temporary_settings import Overrides
from . import camera_options, readouts
from .camera_options import READING, ReadingOptions, WorldOptions
from .operators import CameraOperator

_DIALOG_WIDTH = 480
_ROUNDING = 1e-6  # pixels, of principal points that were computed
_Y_UP = (0.0, 1.0, 0.0)
_ANSWERED_BY = ": give --"  # behind which a sentence has an option of the shell
_NAMES = {"eye": "eye", "look_at": "look-at", "up": "up"}


def _writable() -> list[tuple[str, str, str]]:
    """The formats that are one text, as an enum has them; the project's own first."""
    names = [name for name in formats.writable() if formats.FORMATS[name].SUFFIX and name != "sidecar"]
    return [(name, formats.FORMATS[name].TITLE, "") for name in sorted(names, key=lambda name: name != OWN)]


OWN = "text"


class VIEWCAM_OT_copy_camera(WorldOptions, CameraOperator, bpy.types.Operator):
    bl_idname = "viewcam.copy_camera"
    bl_label = "Copy Camera"
    bl_description = "Copy the camera as text, to paste on another camera, in another file or in another program"
    bl_options: ClassVar[set[str]] = {"REGISTER"}

    format: bpy.props.EnumProperty(
        name="Format", description="Whose text it is", items=_writable(), default=OWN, options={"SKIP_SAVE"}
    )
    ask: bpy.props.BoolProperty(options={"HIDDEN", "SKIP_SAVE"})

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        return context.window_manager.invoke_props_dialog(self) if self.ask else self.execute(context)

    def draw(self, _context: bpy.types.Context) -> None:
        self.layout.use_property_split = True
        for name in ("format", "axes", "scale"):
            self.layout.prop(self, name)

    def work(self, camera_object: bpy.types.Object, scene: bpy.types.Scene) -> None:
        own = self.format == OWN
        text = text_of(camera_object, scene, self.format, formats.Options() if own and not self.ask else self.chosen())
        bpy.context.window_manager.clipboard = text
        conversion = "" if self.axes == "as_is" and self.scale == 1 else f", axes {self.axes}, scale {self.scale:.7g}"
        self.report({"INFO"}, f"Copied {text}" if own else f"Copied {camera_object.name} as {self._title()}{conversion}")

    def _title(self) -> str:
        return formats.FORMATS[self.format].TITLE


class VIEWCAM_MT_copy_camera_as(bpy.types.Menu):
    bl_idname = "VIEWCAM_MT_copy_camera_as"
    bl_label = "Copy as"

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.operator_context = "INVOKE_DEFAULT"
        camera_object = datablocks.camera_in(context)
        for name, title, _ in _writable():
            self._entry(camera_object, title).format = name
        self.layout.separator()
        self._entry(camera_object, "Axes and Scale …").ask = True

    def _entry(self, camera_object: bpy.types.Object | None, text: str) -> bpy.types.OperatorProperties:
        entry = self.layout.operator("viewcam.copy_camera", text=text)
        entry.camera = camera_object.name if camera_object else ""
        return entry


class VIEWCAM_OT_paste_camera(ReadingOptions, CameraOperator, bpy.types.Operator):
    bl_idname = "viewcam.paste_camera"
    bl_label = "Paste Camera"
    bl_description = (
        "Set the camera by the text on the clipboard: a copied camera, eye=… look_at=… up=… d=…, or what another program says "
        "of its camera. What the text does not say stays as it is"
    )

    axes: camera_options.axes(options={"SKIP_SAVE"})
    scale: camera_options.scale(options={"SKIP_SAVE"})
    text: bpy.props.StringProperty(
        name="Text", description="In place of what is on the clipboard", options={"HIDDEN", "SKIP_SAVE"}
    )
    set_size: bpy.props.BoolProperty(
        name="Set the Scene's Size",
        description="Give the scene the resolution and pixel aspect of the pasted camera, where the text says them",
        options={"SKIP_SAVE"},
    )
    named: bpy.props.StringProperty(
        name="Camera's Name",
        description="Which one, where the text has several",
        options={"SKIP_SAVE"},
        search=lambda operator, _context, _typed: operator.names,
    )
    names: ClassVar[list[str]] = []
    question: ClassVar[str] = ""
    asked: ClassVar[list[str]] = []  # the properties that answer it

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: bpy.types.OperatorProperties) -> str:
        sized = f". {tip(cls.bl_rna.properties['set_size'].description)}" if properties.set_size else ""
        return tip(cls.bl_description) + sized

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Paste at once; where something must be chosen first, ask for it with the sentence that says what."""
        cls = type(self)
        try:
            text = self.text or _clipboard()
            formats.recognized(text)
        except InputError:
            return self.execute(context)
        camera_object = bpy.data.objects.get(self.camera) or datablocks.camera_in(context)
        scene, cls.question, cls.asked, cls.names = datablocks.scene_of(camera_object), "", [], []
        try:
            read = self._cameras_of(text, camera_object, scene)
            if len(read) == 1 or self.named:
                return self.execute(context)
        except InputError as error:
            # Without the words of the shell: what can be chosen stands below it.
            cls.question, _, answer = datablocks.sentence(error).partition(_ANSWERED_BY)
            cls.asked = [name for name in READING if answer.startswith(name.replace("_", "-"))][:1]
            read = []
            if cls.asked == ["pose"]:  # whichever way it goes, which cameras there are is the same, and is asked at once
                with contextlib.suppress(InputError):
                    read = self._cameras_of(text, camera_object, scene, pose=next(iter(formats.POSES)))
        if len(read) > 1:
            cls.names, several = [camera.name for camera in read], f"the text has {len(read)} cameras: name one of them"
            cls.question = f"{cls.question}, and {several}" if cls.question else several[:1].upper() + several[1:]
            cls.asked.append("named")
        return context.window_manager.invoke_props_dialog(self, width=_DIALOG_WIDTH)

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.layout
        lines = readouts.wrapped(self.question, _DIALOG_WIDTH - 60) if self.question else []
        for i, line in enumerate(lines):
            layout.label(text=line, icon="BLANK1" if i else "QUESTION", translate=False)
        layout.use_property_split = True
        names: tuple[str, ...] = ("set_size", *READING)
        if self.question and self.asked:
            for name in self.asked:
                layout.prop(self, name)
            layout.separator()
            names = tuple(name for name in names if name not in self.asked)
        for name in names:
            layout.prop(self, name)

    def work(self, camera_object: bpy.types.Object, scene: bpy.types.Scene) -> None:
        # It is answered, and the panel of the last operation shows the same properties.
        type(self).question, type(self).asked = "", []
        text = self.text or _clipboard()
        camera = formats.choose(self._cameras_of(text, camera_object, scene), self.named or None)
        before = _present(camera_object, scene)
        findings = paste(camera, before, camera_object, scene, self.set_size)
        self.report({"INFO"}, f"Pasted {_differences(camera.pinhole, before)} on {camera_object.name}")
        is_lying = camera.pinhole.up == _Y_UP != before.up == preferences.up_axis()
        if is_lying and self.axes == "as_is" and formats.recognized(text) != OWN:
            findings.append("In this text y is up, and in the scene it is not: the arrow beside Paste has Paste Upright")
        for finding in findings:  # after it, since the status bar shows what was reported last
            self.report({"WARNING"}, finding)

    def _cameras_of(
        self, text: str, camera_object: bpy.types.Object, scene: bpy.types.Scene, **answers: str
    ) -> list[formats.Camera]:
        """The cameras of a text, in the picture that it states, else in the scene's at 100 %.

        What stands where the text says nothing is the camera as it is.

        answers : options that count over those that are chosen.
        """
        frame = datablocks.frame_of(scene)
        options = self.chosen(
            size=(frame.resolution_x, frame.resolution_y),
            size_fits=True,
            pixel_aspect=frame.pixel_aspect_x / frame.pixel_aspect_y,
            base=picture.at_full_size(_present(camera_object, scene), frame),
            **answers,
        )
        return formats.read(text, options=options)


class VIEWCAM_MT_paste_camera_as(bpy.types.Menu):
    bl_idname = "VIEWCAM_MT_paste_camera_as"
    bl_label = "Paste as"

    def draw(self, context: bpy.types.Context) -> None:
        camera_object = datablocks.camera_in(context)
        for text, properties in (
            ("Paste Upright: Y Is Up in the Text", {"axes": "y_up"}),
            ("Paste and Set the Scene's Size", {"set_size": True}),
            ("Paste Upright and Set the Scene's Size", {"axes": "y_up", "set_size": True}),
        ):
            entry = self.layout.operator("viewcam.paste_camera", text=text)
            entry.camera = camera_object.name if camera_object else ""
            for name, value in properties.items():
                setattr(entry, name, value)


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


def camera_of(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> formats.Camera:
    """A camera in the picture at 100 %; where its values are not in use, those that `adopt` would state.

    Raises InputError if the values make no camera, or the object is no pinhole.
    """
    frame = datablocks.frame_of(scene)
    stated = cameras.stated(camera_object, scene)
    pinhole = stated or cameras.as_it_stands(camera_object, scene)
    whole = picture.at_full_size(pinhole, frame)
    if stated:  # as it was typed
        across = targets.values(camera_object).distance_at_full_size(frame, camera_object.data.sensor_fit)
        upwards = across * (frame.pixel_aspect_x / frame.pixel_aspect_y)
        whole = dataclasses.replace(whole, distance=(across, upwards))
    return formats.Camera(camera_object.name, whole)


def text_of(
    camera_object: bpy.types.Object, scene: bpy.types.Scene, format: str = OWN, options: formats.Options | None = None
) -> str:
    """A camera as a program's text. Raises InputError as `camera_of` does, or if the format can't say what the camera is."""
    text = formats.write([camera_of(camera_object, scene)], format, options)
    assert isinstance(text, str)  # the formats of the clipboard are no folders
    return text


def paste(
    camera: formats.Camera, present: Pinhole, camera_object: bpy.types.Object, scene: bpy.types.Scene, set_size: bool = False
) -> list[str]:
    """State what a text says in the camera's values, and move it there; its view plane as well, if the text says one.

    Returns what a reader should know, one sentence each.

    Raises InputError as `apply` does. Nothing has changed then.
    """
    frame = datablocks.frame_of(scene)
    if camera.pinhole.plane == picture.at_full_size(present, frame).plane:  # the text says none
        pose = {name: getattr(camera.pinhole, name) for name in (*_NAMES, "mirrored")}
        pinhole = dataclasses.replace(present, **pose)
        return [*camera.notes, *cameras.apply(camera_object, pinhole, scene)]
    with contextlib.ExitStack() as undo:
        if set_size:
            picture.set_size(Overrides(undo), scene, camera.pinhole)
        pinhole, notes = picture.fitted(camera.pinhole, datablocks.frame_of(scene))
        messages = [*camera.notes, *notes, *cameras.apply(camera_object, pinhole, scene)]
        undo.pop_all()
    return messages


def _present(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> Pinhole:
    """The camera as it is stated or, where nothing is or what is makes no camera, as it stands."""
    try:
        return cameras.current(camera_object, scene)
    except InputError:
        return cameras.as_it_stands(camera_object, scene)


def _differences(pinhole: Pinhole, before: Pinhole) -> str:
    """The differences of the new camera, in words."""
    names = [name for key, name in _NAMES.items() if getattr(pinhole, key) != getattr(before, key)]
    names += ["distance"] if pinhole.distance != before.distance else []
    shift = math.dist(pinhole.plane.principal_point, (pinhole.width / 2, pinhole.height / 2))
    names += ["shift"] if shift > _ROUNDING else []
    names += ["mirror"] if pinhole.mirrored != before.mirrored else []
    return ", ".join(names) or "the same camera"


def _clipboard() -> str:
    try:
        return bpy.context.window_manager.clipboard
    except UnicodeDecodeError as error:
        raise InputError("the clipboard holds no text: copy a camera first") from error


def draw(layout: bpy.types.UILayout, camera_object: bpy.types.Object) -> None:
    """The row of these buttons, in the panel."""
    row = layout.row(align=True)
    copy, paste = row.row(align=True), row.row(align=True)
    copy.operator("viewcam.copy_camera", text="Copy", icon="COPYDOWN").camera = camera_object.name
    copy.menu("VIEWCAM_MT_copy_camera_as", text="", icon="DOWNARROW_HLT")
    paste.enabled = camera_object.library is None
    paste.operator("viewcam.paste_camera", text="Paste", icon="PASTEDOWN").camera = camera_object.name
    paste.menu("VIEWCAM_MT_paste_camera_as", text="", icon="DOWNARROW_HLT")


IN_MENUS = (VIEWCAM_OT_copy_camera, VIEWCAM_OT_paste_camera)  # a read-out is copied by its own button
CLASSES = (VIEWCAM_MT_copy_camera_as, VIEWCAM_MT_paste_camera_as, *IN_MENUS, VIEWCAM_OT_copy_readout)
