"""Presets of cameras, as Blender's own: a popover in the panel's header, with what comes along and what an artist has added.

A preset is a Python file in a folder of that name, as all of Blender's are: it pastes a camera as text (clipboard.py), with all
digits of float64, and may say the lens alone or the view alone. Blender's operator that runs presets leaves no undo step; ours
does. Rejected: Blender's way to write a preset, which lists properties, in float32, and moves the camera at each of them.
"""

from pathlib import Path
from typing import ClassVar

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

from ...errors import InputError
from ...files import written_whole
from .. import datablocks
from . import clipboard

FOLDER = "virtual_pinhole"
# Where Blender looks for presets/FOLDER.
SHIPPED = Path(__file__).resolve().parent / "scripts"


class VIEWCAM_PT_presets(PresetPanel, bpy.types.Panel):
    bl_label = "Virtual Pinhole Presets"
    preset_subdir = FOLDER
    preset_operator = "viewcam.execute_preset"
    preset_add_operator = "viewcam.add_preset"


class VIEWCAM_OT_execute_preset(bpy.types.Operator):
    bl_idname = "viewcam.execute_preset"
    bl_label = "Apply Camera Preset"
    bl_description = "Set the camera by this preset. What the preset does not say stays as it is"
    bl_options: ClassVar[set[str]] = {"REGISTER", "UNDO", "INTERNAL"}

    filepath: bpy.props.StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE"})

    def execute(self, _context: bpy.types.Context) -> set[str]:
        try:
            bpy.utils.execfile(self.filepath)
        except OSError as error:
            self.report({"ERROR"}, f"The preset can't be read ({error.strerror}): remove it")
            return {"CANCELLED"}
        except RuntimeError as error:  # an operator's own report
            self.report({"ERROR"}, str(error).strip().removeprefix("Error: "))
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
            found = bpy.utils.preset_find(self.name, FOLDER, display_name=True)
            if found and SHIPPED in Path(found).resolve().parents:
                self.report({"WARNING"}, "This preset comes with the add-on: only your own can be removed")
                return {"CANCELLED"}
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
        """What Blender calls to write the preset."""
        with written_whole(path) as temporary:
            temporary.write_text(f"import bpy\n\nbpy.ops.viewcam.paste_camera(text={self._text!r})\n", encoding="utf-8")


CLASSES = (VIEWCAM_PT_presets, VIEWCAM_OT_execute_preset, VIEWCAM_OT_add_preset)


def register() -> None:
    bpy.utils.register_preset_path(str(SHIPPED))


def unregister() -> None:
    bpy.utils.unregister_preset_path(str(SHIPPED))
