"""Render › Render All Cameras: every camera of the scene in its own picture, as a batch in a process beside this one.

A copy of the file as it stands is rendered, as comparing.py does it, so that the artist works on; the pictures and the contact
sheet go into a new folder, named by file and time. What is there when it is canceled stays: each picture is written whole.
A timer looks how far it is; the status bar shows it, and has Cancel. Rejected: rendering in Blender's own process (a window
that waits, and a scene whose camera and resolution change under the artist's hands).
"""

from pathlib import Path

import bpy

from ...errors import InputError, counted
from ...file_names import distinct
from ...jobs.folder import Outputs
from ...jobs.job import Job
from .. import own_picture
from . import scene_cameras
from .background import Background, BackgroundBatch, Cancels, shot
from .operators import possible

_SHEET = "contact-sheet.html"

_sheet: Path | None = None  # the contact sheet of the last run, if it made one


def _looked(outcome: tuple[bool, str] | None) -> None:
    if bpy.context.workspace:
        bpy.context.workspace.status_text_set(None)
    if outcome:
        well, sentence = outcome

        def draw(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
            menu.layout.label(text=sentence, translate=False)
            if _sheet:
                menu.layout.operator("viewcam.open_contact_sheet", icon="URL")

        bpy.context.window_manager.popup_menu(draw, title="Render All Cameras", icon="CHECKMARK" if well else "ERROR")


background = Background(0.5, _looked)
"""The background job of all cameras, whose result is whether all went well, and a sentence."""


def shots(scene: bpy.types.Scene, animation: bool) -> list[Job]:
    """The list of shots: each camera that is rendered, in its own picture; of an animation each frame of its range.

    Raises InputError if there is none, or one has pixels of another shape than the scene, which a batch can't give it.
    """
    rows = []
    rendered = [each for each in scene_cameras.of_scene(scene) if not each.hide_render]
    for camera_object, name in zip(rendered, distinct(each.name for each in rendered), strict=True):
        picture = own_picture.of_camera(camera_object, scene)
        frames = range(int(picture["frame_start"]), int(picture["frame_end"]) + 1) if animation else (scene.frame_current,)
        rows += [shot(camera_object, scene, f"{name}_{frame:04d}" if animation else name, frame) for frame in frames]
    if not rows:
        raise InputError(f"scene {scene.name!r} has no camera that is rendered: add one, or show one in renders")
    return rows


class Rendering(BackgroundBatch):
    """The pictures on their way. Raises InputError as its base and `shots` do."""

    def __init__(self, scene: bpy.types.Scene, into: Path, animation: bool = False, check: bool = False) -> None:
        super().__init__(scene, into, "all cameras", shots(scene, animation), "*.exr", Outputs(check=check))

    def progress(self) -> tuple[float, str]:
        """The progress, from 0 to 1, and the picture that is being rendered."""
        return self.done / self.count, f"Rendering picture {min(self.done + 1, self.count)} of {self.count}"

    @property
    def sheet(self) -> Path:
        return self.folder / _SHEET

    def poll(self) -> tuple[bool, str] | None:
        """True if all went well, and a sentence; None while it runs."""
        global _sheet
        ended = self.ended()
        if ended is None:
            return None
        _sheet = self.sheet if self.sheet.is_file() else None
        status, sentence = ended
        pictures = counted(self.count, "picture")
        if status == 0:
            return True, f"{pictures} in {self.folder}"
        if self.sheet.is_file():
            return (
                False,
                f"{self.done} of {pictures} in {self.folder}: the contact sheet says what went wrong",
            )
        return False, sentence


class VIEWCAM_OT_render_all_cameras(bpy.types.Operator):
    bl_idname = "viewcam.render_all_cameras"
    bl_label = "Render All Cameras"
    bl_description = (
        "Render a picture through every camera of the scene, each in its own resolution if it has one, in the background, "
        "with a contact sheet"
    )

    directory: bpy.props.StringProperty(
        name="Folder", description="Where a folder for the pictures is made", subtype="DIR_PATH", options={"SKIP_SAVE"}
    )
    filter_folder: bpy.props.BoolProperty(default=True, options={"HIDDEN"})
    animation: bpy.props.BoolProperty(
        name="Animation", description="All frames of each camera's range, not only the current one", options={"SKIP_SAVE"}
    )
    check: bpy.props.BoolProperty(
        name="Prove Each Picture",
        description="Compare its geometry with the reference tracer's. The contact sheet tells the verdicts",
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        has_camera = context.scene and scene_cameras.of_scene(context.scene)
        is_free = possible(cls, not background.running, "The cameras are being rendered")
        return is_free and possible(cls, has_camera, "There is no camera")

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        def start() -> Rendering:
            if not self.directory:
                raise InputError("there is no folder for the pictures: name one")
            return Rendering(context.scene, Path(bpy.path.abspath(self.directory)), self.animation, self.check)

        return background.begin(self, start)


class VIEWCAM_OT_cancel_render_all(Cancels, bpy.types.Operator):
    bl_idname = "viewcam.cancel_render_all"
    bl_description = "End the rendering of all cameras. The pictures that are there stay"
    background = background


class VIEWCAM_OT_open_contact_sheet(bpy.types.Operator):
    bl_idname = "viewcam.open_contact_sheet"
    bl_label = "Open Contact Sheet"
    bl_description = "Open the last contact sheet of all cameras in the browser"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        return bool(_sheet and _sheet.is_file())

    def execute(self, _context: bpy.types.Context) -> set[str]:
        assert _sheet is not None  # as `poll` has seen
        return bpy.ops.wm.url_open(url=_sheet.absolute().as_uri())


def _draw_status_bar(header: bpy.types.Header, _context: bpy.types.Context) -> None:
    if background.running:
        share, words = background.running.progress()
        row = header.layout.row(align=True)
        row.ui_units_x = 14
        row.progress(factor=share, text=words)
        row.operator("viewcam.cancel_render_all", text="", icon="CANCEL")


def _draw_render_menu(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.operator_context = "INVOKE_DEFAULT"
    menu.layout.operator("viewcam.render_all_cameras", text="Render All Cameras…")
    menu.layout.operator("viewcam.open_contact_sheet")


CLASSES = (VIEWCAM_OT_render_all_cameras, VIEWCAM_OT_cancel_render_all, VIEWCAM_OT_open_contact_sheet)


def register() -> None:
    bpy.types.TOPBAR_MT_render.append(_draw_render_menu)
    bpy.types.STATUSBAR_HT_header.append(_draw_status_bar)
    background.register()


def unregister() -> None:
    background.unregister()
    bpy.types.STATUSBAR_HT_header.remove(_draw_status_bar)
    bpy.types.TOPBAR_MT_render.remove(_draw_render_menu)
