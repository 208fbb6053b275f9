"""File › Export: Virtual Pinhole Scene, and what could not come along; the entries of camera_files.py as well.

The export is that of `viewcam export` (job.py), at the current frame through the scene's camera. What is not whole in the
ledger is summed up in a report and shown in a popup, as Blender's own glTF exporter does. Rejected: the ledger as a text
datablock, since exporting should change nothing in the file that is open.
"""

from collections.abc import Sequence
from pathlib import Path

import bpy
from bpy_extras.io_utils import ExportHelper, ImportHelper

from ...errors import InputError
from ...tracer.scene import LedgerEntry
from .. import datablocks
from . import readouts

_SUFFIX = ".json"
_CAMERAS = "Cameras (COLMAP, fSpy, pbrt, …)"
_POPUP_ENTRIES = 12
_POPUP_WIDTH = 480


class VIEWCAM_OT_export_scene(ExportHelper, bpy.types.Operator):
    bl_idname = "viewcam.export_scene"
    bl_label = "Export Scene"  # on its button, which is narrow
    bl_description = "Write the scene at the current frame, through the scene's camera, as the reference tracer reads it"

    filename_ext = _SUFFIX
    filter_glob: bpy.props.StringProperty(default=f"*{_SUFFIX}", options={"HIDDEN"})
    light: bpy.props.BoolProperty(
        name="Light", description="Materials, lamps, world and film as well; without it geometry alone", default=True
    )
    recenter: bpy.props.BoolProperty(
        name="Origin at the Eye",
        description="Count coordinates from the eye, for scenes in map or geocentric coordinates, where float32 loses pixels",
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if context.scene and datablocks.render_camera(context.scene):
            return True
        cls.poll_message_set("The scene has no camera")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ...jobs.job import Job
        from ...tracer.scene import scene_file  # here, since Blender starts without
        from ..jobs import renderer

        path = Path(bpy.path.ensure_ext(bpy.path.abspath(self.filepath), _SUFFIX))
        try:
            if path.name == _SUFFIX:
                raise InputError("the scene has no file name: give one")
            scene = renderer.export(Job(level="path" if self.light else "geometry", recenter=self.recenter))
            scene_file.write(scene, path)
        except InputError as error:
            self.report({"ERROR"}, text(datablocks.sentence(error)))
            return {"CANCELLED"}
        _tell(self, scene.ledger, path, context)
        return {"FINISHED"}


class IntoScene(ImportHelper):
    """An operator that adds to the scene what a file holds."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if context.scene and not context.scene.library:
            return True
        cls.poll_message_set("The scene is linked from another file")
        return False


def select(objects: Sequence[bpy.types.Object], active: bpy.types.Object, context: bpy.types.Context) -> None:
    for block in context.selected_objects:
        block.select_set(False)
    for block in objects:
        block.select_set(True)
    context.view_layer.objects.active = active


def _tell(operator: bpy.types.Operator, ledger: Sequence[LedgerEntry], path: Path, context: bpy.types.Context) -> None:
    """Report what became of a scene, and show what lacks in it."""
    lacking = [entry for entry in ledger if entry.status != "exported"]
    operator.report({"WARNING" if lacking else "INFO"}, text(f"{path.name}: {summary(ledger)}"))
    if lacking and not bpy.app.background:
        show(popup_lines(lacking), "What the Exported Scene Lacks", context)


def text(name: str) -> str:
    """The part of a file's name that Blender can show, whose bytes may be no text."""
    return name.encode("utf-8", "replace").decode()


def summary(ledger: Sequence[LedgerEntry]) -> str:
    """The number of objects that came along: one line for the status bar."""
    counts = {status: sum(entry.status == status for entry in ledger) for status in ("exported", "approximated", "skipped")}
    total = len(ledger)
    parts = [f"{counts['exported']} of {total} object{'' if total == 1 else 's'} exported whole"]
    parts += [f"{count} {status}" for status, count in counts.items() if count and status != "exported"]
    return ", ".join(parts)


def popup_lines(lacking: Sequence[LedgerEntry]) -> list[tuple[str, str]]:
    """(text, icon) of each line that tells what did not come along whole."""
    icons = {"skipped": "CANCEL"}
    return lines_of([(f"{each.object}: {each.status}, {each.reason}", icons.get(each.status, "ERROR")) for each in lacking])


def lines_of(sentences: Sequence[tuple[str, str]]) -> list[tuple[str, str]]:
    """(text, icon) of each line of a popup. sentences : likewise, of any length and number."""
    lines = []
    for sentence, icon in sentences[:_POPUP_ENTRIES]:
        lines += [(line, "BLANK1" if i else icon) for i, line in enumerate(readouts.wrapped(sentence, _POPUP_WIDTH))]
    more = len(sentences) - _POPUP_ENTRIES
    return [*lines, (f"and {more} more", "BLANK1")] if more > 0 else lines


def show(lines: Sequence[tuple[str, str]], title: str, context: bpy.types.Context) -> None:
    """Tell lines of (text, icon) in a popup."""

    def draw(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
        for line, icon in lines:
            menu.layout.label(text=line, icon=icon)

    context.window_manager.popup_menu(draw, title=title, icon="INFO")


def _draw_export(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.operator("viewcam.export_scene", text="Virtual Pinhole Scene (.json)")
    menu.layout.operator("viewcam.export_cameras", text=_CAMERAS)


def _draw_import(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.operator("viewcam.import_cameras", text=_CAMERAS)


CLASSES = (VIEWCAM_OT_export_scene,)


def register() -> None:
    bpy.types.TOPBAR_MT_file_export.append(_draw_export)
    bpy.types.TOPBAR_MT_file_import.append(_draw_import)


def unregister() -> None:
    bpy.types.TOPBAR_MT_file_import.remove(_draw_import)
    bpy.types.TOPBAR_MT_file_export.remove(_draw_export)
