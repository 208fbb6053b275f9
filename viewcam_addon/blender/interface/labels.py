"""The sub-panel "Labels": what is true of the camera's picture, written at this frame by one click.

It shows which files there will be before they are written. They are a batch of one shot with labels alone, in the background,
in a new folder that is named by file, camera, frame and time: nothing is written over, and the artist's scene is not touched,
though flow needs the frames before and after. What it came to belongs to this session of Blender.
"""

import contextlib
import json
from pathlib import Path
from typing import Any

import bpy

from ...errors import InputError
from ...file_names import made_fit
from ...jobs.folder import Outputs
from ...labels import DEPTH_STEPS, KINDS, PASSES, endings
from .. import datablocks
from . import panel_rows
from .background import Background, BackgroundBatch, Cancels, StartsForCamera, shot
from .panel_rows import SubPanel

_SUMMARY = "summary.json"

_KINDS = (
    ("DEPTH", "Depth", "Along the camera's axis and along the rays; in a PNG of 16 bits as well"),
    ("NORMALS", "Normals", "In world space, and as the camera sees them"),
    ("POSITION", "Position", "In world space, and in each object's own coordinates"),
    ("MASKS", "Masks", "Which object and which material each pixel shows; areas, boxes and run lengths of what is visible"),
    ("AMODAL", "Amodal", "Areas, boxes and run lengths of each object as if it stood alone"),
    ("FLOW", "Flow", "Where each point is in the next and in the previous frame, and whether it is hidden there"),
    ("COVERAGE", "Coverage", "How much of each pixel each object has, as Cryptomatte: for soft masks"),
)


def _looked(_: object) -> None:
    if background.running is None:
        panel_rows.redraw()


background = Background(0.2, _looked)
"""The background job of labels, whose result is the folder of the labels (None where there are none), and a sentence."""


class LabelSettings(bpy.types.PropertyGroup):
    """`window_manager.virtual_pinhole_labels`: which labels, and where they go."""

    kinds: bpy.props.EnumProperty(
        name="Labels", description="What is written", items=_KINDS, options={"ENUM_FLAG"}, default={"DEPTH", "MASKS"}
    )
    depth_steps: bpy.props.FloatProperty(
        name="Depth Steps",
        description="Steps of the PNG's depth in a scene unit: 1000 are millimeters of meters. Beyond 65535 of them it is 0",
        default=DEPTH_STEPS,
        min=1e-6,
        soft_min=1.0,
        soft_max=10000.0,
    )
    folder: bpy.props.StringProperty(
        name="Folder",
        description="Where a folder is made for the labels, named by file, camera, frame and time. Without it, beside the file",
        subtype="DIR_PATH",
    )

    def chosen(self) -> list[str]:
        """The chosen ones of labels.KINDS, in order."""
        return [kind for kind in KINDS if kind.upper() in self.kinds]

    def into(self) -> Path:
        """The folder. Raises InputError where none is said, and the file has none."""
        if not self.folder and not bpy.data.filepath:
            raise InputError("there is no folder for the labels, and the file is not saved: choose one, or save it")
        return Path(bpy.path.abspath(self.folder or "//"))


def file_names(camera_object: bpy.types.Object, kinds: list[str]) -> list[str]:
    """The names of the files that a click writes, but for the batch's own: the camera first."""
    name = made_fit(camera_object.name)
    passes = [each for kind in kinds for each in PASSES[kind]]
    return [f"{name}.json", *(f"{name}.{ending}" for ending in endings(passes))]


class Writing(BackgroundBatch):
    """The labels of a camera at the scene's frame, on their way. Raises InputError as its base does, or if there are none."""

    def __init__(self, camera_object: bpy.types.Object, scene: bpy.types.Scene, settings: LabelSettings) -> None:
        datablocks.check_perspective(camera_object)
        if not (kinds := settings.chosen()):
            raise InputError("no label is chosen: choose some")
        frame = scene.frame_current
        row = shot(camera_object, scene, made_fit(camera_object.name), frame)
        outputs = Outputs(picture=False, labels=tuple(kinds), depth_steps=float(f"{settings.depth_steps:.7g}"))
        super().__init__(scene, settings.into(), f"{camera_object.name} {frame:04d} labels", [row], "*.labels.json", outputs)

    def poll(self) -> tuple[Path | None, str] | None:
        """The folder of the labels, and a sentence; None while it runs."""
        ended = self.ended()
        if ended is None:
            return None
        status, sentence = ended
        if status == 0:
            return self.folder, f"Written to {self.folder}"
        with contextlib.suppress(OSError, ValueError, LookupError):  # why that one shot failed
            sentence = json.loads((self.folder / _SUMMARY).read_text(encoding="utf-8"))["shots"][0]["error"]
        return None, sentence[:1].upper() + sentence[1:]


class VIEWCAM_OT_write_labels(StartsForCamera, bpy.types.Operator):
    bl_idname = "viewcam.write_labels"
    bl_label = "Write Labels"
    bl_description = (
        "Write what is true of this camera's picture at this frame, as the reference tracer finds it, in the background. The "
        "file stays as it is, and its unsaved edits count"
    )
    background, busy = background, "Labels are being written"

    def execute(self, context: bpy.types.Context) -> set[str]:
        settings = context.window_manager.virtual_pinhole_labels
        return background.begin(self, lambda: Writing(self.required_camera(context), context.scene, settings))


class VIEWCAM_OT_cancel_labels(Cancels, bpy.types.Operator):
    bl_idname = "viewcam.cancel_labels"
    bl_description = "End the writing of labels"
    background = background


class _LabelsPanel(SubPanel):
    bl_label = "Labels"

    def draw(self, context: bpy.types.Context) -> None:
        camera_object: Any = datablocks.camera_in(context)
        settings, layout = context.window_manager.virtual_pinhole_labels, self.layout
        panel_rows.begin(layout, context)
        column = layout.column()
        column.active = background.running is None
        panel_rows.field(column.column(align=True), settings, "kinds")
        if "DEPTH" in settings.kinds:
            column.prop(settings, "depth_steps")
        panel_rows.field(column, settings, "folder")
        if settings.kinds:
            names = layout.column(align=True)
            names.active = False
            for i, name in enumerate(file_names(camera_object, settings.chosen())):
                names.label(text=name, icon="BLANK1" if i else "FILE", translate=False)
        row = layout.row(align=True)
        if background.running:
            row.label(text="Writing labels", icon="SORTTIME")
            row.operator("viewcam.cancel_labels", text="", icon="CANCEL")
        else:
            row.operator("viewcam.write_labels", icon="PLAY").camera = camera_object.name
        if background.latest:
            _draw_latest(layout, context, *background.latest)


def _draw_latest(layout: bpy.types.UILayout, context: bpy.types.Context, folder: Path | None, sentence: str) -> None:
    column = layout.column(align=True)
    panel_rows.sentence(column, context, sentence, "CHECKMARK" if folder else "ERROR")
    if folder:
        column.operator("wm.path_open", text="Open Folder", icon="FILE_FOLDER").filepath = str(folder)


VIEWCAM_PT_data_labels, VIEWCAM_PT_sidebar_labels = panel_rows.in_both_places("labels", _LabelsPanel)


CLASSES = (VIEWCAM_OT_write_labels, VIEWCAM_OT_cancel_labels, VIEWCAM_PT_data_labels, VIEWCAM_PT_sidebar_labels)


def register() -> None:
    bpy.utils.register_class(LabelSettings)
    bpy.types.WindowManager.virtual_pinhole_labels = bpy.props.PointerProperty(type=LabelSettings)
    background.register()


def unregister() -> None:
    background.unregister()
    del bpy.types.WindowManager.virtual_pinhole_labels
    bpy.utils.unregister_class(LabelSettings)
