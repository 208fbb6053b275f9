"""File › Export › Virtual Pinhole Scene: the scene as the tracer reads it, and what could not come along.

The export is that of `viewcam export` (job.py), at the current frame through the scene's camera. The ledger stands in the file,
is summed up in a report, and what is not whole in it is shown in a popup, as Blender's own glTF exporter does. Rejected: the
ledger as a text datablock, since exporting should change nothing in the file that is open.
"""

from collections.abc import Sequence
from pathlib import Path

import bpy
from bpy_extras.io_utils import ExportHelper

from ..errors import InputError
from ..tracer.scene import LedgerEntry
from . import datablocks, readouts

_SUFFIX = ".json"
_POPUP_ENTRIES = 12
_POPUP_WIDTH = 480


class VIEWCAM_OT_export_scene(ExportHelper, bpy.types.Operator):
    bl_idname = "viewcam.export_scene"
    bl_label = "Export Virtual Pinhole Scene"
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
        from ..tracer.scene import scene_file  # here, since Blender starts without
        from . import job

        path = Path(bpy.path.ensure_ext(bpy.path.abspath(self.filepath), _SUFFIX))
        try:
            if path.name == _SUFFIX:
                raise InputError("the scene has no file name: give one")
            scene = job.export(job.Request(level="path" if self.light else "geometry", recenter=self.recenter))
            scene_file.write(scene, path)
        except InputError as error:
            self.report({"ERROR"}, datablocks.sentence(error))
            return {"CANCELLED"}
        lacking = [entry for entry in scene.ledger if entry.status != "exported"]
        self.report({"WARNING" if lacking else "INFO"}, f"{path.name}: {summary(scene.ledger)}")
        if lacking and not bpy.app.background:
            _show(lacking, context)
        return {"FINISHED"}


def summary(ledger: Sequence[LedgerEntry]) -> str:
    """How many objects came along: one line for the status bar."""
    counts = {status: sum(entry.status == status for entry in ledger) for status in ("exported", "approximated", "skipped")}
    total = len(ledger)
    parts = [f"{counts['exported']} of {total} object{'' if total == 1 else 's'} exported whole"]
    parts += [f"{count} {status}" for status, count in counts.items() if count and status != "exported"]
    return ", ".join(parts)


def popup_lines(lacking: Sequence[LedgerEntry]) -> list[tuple[str, str]]:
    """(text, icon) of each line that tells what did not come along whole."""
    lines = []
    for entry in lacking[:_POPUP_ENTRIES]:
        icon = "CANCEL" if entry.status == "skipped" else "ERROR"
        for i, line in enumerate(readouts.wrapped(f"{entry.object}: {entry.status}, {entry.reason}", _POPUP_WIDTH)):
            lines.append((line, "BLANK1" if i else icon))
    more = len(lacking) - _POPUP_ENTRIES
    return [*lines, (f"and {more} more, all in the file's ledger", "BLANK1")] if more > 0 else lines


def _show(lacking: Sequence[LedgerEntry], context: bpy.types.Context) -> None:
    def draw(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
        for text, icon in popup_lines(lacking):
            menu.layout.label(text=text, icon=icon)

    context.window_manager.popup_menu(draw, title="What the Exported Scene Lacks", icon="INFO")


def _draw_export(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.operator("viewcam.export_scene", text="Virtual Pinhole Scene (.json)")


CLASSES = (VIEWCAM_OT_export_scene,)


def register() -> None:
    bpy.types.TOPBAR_MT_file_export.append(_draw_export)


def unregister() -> None:
    bpy.types.TOPBAR_MT_file_export.remove(_draw_export)
