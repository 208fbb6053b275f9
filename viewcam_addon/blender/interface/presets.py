"""Presets of cameras, as Blender's own: a popover in the panel's header, with what comes along and what an artist has added.

A preset pastes a camera as text (clipboard.py), with all digits of float64, and may say the lens alone or the view alone. What
comes along is a table; what an artist adds is a Python file in a folder of that name, as all of Blender's are. Blender's
operator that runs presets leaves no undo step; ours does. Rejected: Blender's way to write a preset, which lists properties, in
float32, and moves the camera at each of them.
"""

import math
import os
from typing import ClassVar

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

from ...errors import InputError
from ...files import written_whole
from .. import datablocks
from . import clipboard

FOLDER = "virtual_pinhole"


def _lens(millimeters: float) -> str:
    """The angle of 36 mm, the longer side of a full frame."""
    return f"fov={math.degrees(2 * math.atan(18 / millimeters))!r} axis=larger"


SHIPPED = {
    "Lens 24 mm": _lens(24),
    "Lens 35 mm": _lens(35),
    "Lens 50 mm": _lens(50),
    "Lens 85 mm": _lens(85),
    "Y Up, Along -Z": "eye=(0, 0, 10) look_at=(0, 0, 0) up=(0, 1, 0)",
    "Y Up, Looking Down": "eye=(0, 10, 0) look_at=(0, 0, 0) up=(1, 0, 0)",
    "Y Up, Looking Up": "eye=(0, -10, 0) look_at=(0, 0, 0) up=(0, 0, 1)",
    "Z Up, Along Y": "eye=(0, -10, 0) look_at=(0, 0, 0) up=(0, 0, 1)",
    "Z Up, Looking Down": "eye=(0, 0, 10) look_at=(0, 0, 0) up=(1, 0, 0)",
    "Z Up, Looking Up": "eye=(0, 0, -10) look_at=(0, 0, 0) up=(0, -1, 0)",
}
"""The presets that come along, by the name that is shown."""


class VIEWCAM_PT_presets(PresetPanel, bpy.types.Panel):
    bl_label = "Virtual Pinhole Presets"

    def draw(self, _context: bpy.types.Context) -> None:
        self.layout.emboss = "PULLDOWN_MENU"
        self.layout.operator_context = "EXEC_DEFAULT"
        column = self.layout.column(align=True)
        for name in SHIPPED:
            column.operator(VIEWCAM_OT_execute_preset.bl_idname, text=name).shipped = name
        self.path_menu(
            iter(bpy.utils.preset_paths(FOLDER)),  # with a list of none Blender would say that paths are missing
            VIEWCAM_OT_execute_preset.bl_idname,
            filter_ext=lambda suffix: suffix == ".py",
            add_operator=VIEWCAM_OT_add_preset.bl_idname,
        )


class VIEWCAM_OT_execute_preset(bpy.types.Operator):
    bl_idname = "viewcam.execute_preset"
    bl_label = "Apply Camera Preset"
    bl_description = "Set the camera by this preset. What the preset does not say stays as it is"
    bl_options: ClassVar[set[str]] = {"REGISTER", "UNDO", "INTERNAL"}

    filepath: bpy.props.StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE"})
    shipped: bpy.props.EnumProperty(items=[(name, name, "") for name in SHIPPED], options={"HIDDEN", "SKIP_SAVE"})

    def execute(self, _context: bpy.types.Context) -> set[str]:
        try:
            if self.filepath:
                bpy.utils.execfile(self.filepath)
            else:
                bpy.ops.viewcam.paste_camera(text=SHIPPED[self.shipped])
        except RuntimeError as error:  # an operator's own report
            self.report({"ERROR"}, str(error).strip().removeprefix("Error: "))
            return {"CANCELLED"}
        except Exception as error:  # a preset is a program, of whoever wrote it
            reason = getattr(error, "strerror", None) or str(error) or type(error).__name__
            self.report({"ERROR"}, f"The preset {os.path.basename(self.filepath)!r} can't be run ({reason}): remove it")
            return {"CANCELLED"}
        return {"FINISHED"}


class VIEWCAM_OT_add_preset(AddPresetBase, bpy.types.Operator):
    bl_idname = "viewcam.add_preset"
    bl_label = "Add Camera Preset"
    bl_description = "Keep this camera's eye, look-at, up and distance as a preset, or remove one"
    preset_menu = "VIEWCAM_PT_presets"
    preset_subdir = FOLDER

    _text = ""

    def execute(self, context: bpy.types.Context) -> set[str]:
        if self.remove_name or self.remove_active:
            return super().execute(context)
        try:
            camera_object = datablocks.camera_in(context)
            if camera_object is None:
                raise InputError("there is no camera: select one")
            self._text = clipboard.text_of(camera_object, context.scene)
            return super().execute(context)
        except InputError as error:
            self.report({"ERROR"}, datablocks.sentence(error))
            return {"CANCELLED"}

    def add(self, _context: bpy.types.Context, path: str) -> None:
        """Write the preset, as Blender calls it."""
        with written_whole(path) as temporary:
            temporary.write_text(
                f"import bpy\n\nbpy.ops.viewcam.paste_camera(text={self._text!r})\n", encoding="utf-8", newline="\n"
            )


CLASSES = (VIEWCAM_PT_presets, VIEWCAM_OT_execute_preset, VIEWCAM_OT_add_preset)
