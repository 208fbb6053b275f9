"""Render › Render All Cameras: every camera of the scene in its own picture, by `viewcam batch` in a process beside this one.

A copy of the file as it stands is rendered, as comparing.py does it, so that the artist works on; the pictures and the contact
sheet go into a new folder, named by file and time. What is there when it is cancelled stays: each picture is written whole.
A timer looks how far it is; the status bar shows it, and has Cancel. Rejected: rendering in Blender's own process (a window
that waits, and a scene whose camera and resolution change under the artist's hands).
"""

import atexit
from pathlib import Path
from typing import Any

import bpy
from bpy.app.handlers import persistent

from ...errors import InputError
from ...shots.names import made_fit, one_file
from .. import datablocks, own_picture
from . import scene_cameras
from .background_batch import BackgroundBatch, shot

_SECONDS = 0.5  # between two looks
_SHEET = "contact-sheet.html"

_running: "Rendering | None" = None
_latest: Path | None = None  # the last contact sheet


def shots(scene: bpy.types.Scene, animation: bool) -> list[dict[str, Any]]:
    """The list of shots: each camera that is rendered, in its own picture; of an animation each frame of its range.

    Raises
    ------
    InputError
        if there is none, or one has pixels of another shape than the scene, which a batch can't give it.
    """
    rows, taken = [], set()
    for camera_object in scene_cameras.of_scene(scene):
        if camera_object.hide_render:
            continue
        name = made_fit(camera_object.name)
        while one_file(name) in taken:
            name += "_"
        taken.add(one_file(name))
        picture = own_picture.of_camera(camera_object, scene)
        frames = range(picture["frame_start"], picture["frame_end"] + 1) if animation else (scene.frame_current,)
        rows += [shot(camera_object, scene, f"{name}_{frame:04d}" if animation else name, frame) for frame in frames]
    if not rows:
        raise InputError(f"scene {scene.name!r} has no camera that is rendered: add one, or show one in renders")
    return rows


class Rendering(BackgroundBatch):
    """The pictures on their way. Raises InputError as its base and `shots` do."""

    def __init__(self, scene: bpy.types.Scene, into: Path, animation: bool = False, check: bool = False) -> None:
        words = ["--check"] if check else []
        super().__init__(scene, into, "all cameras", shots(scene, animation), "*.exr", words)

    def progress(self) -> tuple[float, str]:
        """How far it is, from 0 to 1, and what it is doing."""
        return self.done / self.count, f"Rendering picture {min(self.done + 1, self.count)} of {self.count}"

    @property
    def sheet(self) -> Path:
        return self.folder / _SHEET

    def poll(self) -> tuple[bool, str] | None:
        """Whether all went well, and a sentence; None while it runs."""
        ended = self.ended()
        if ended is None:
            return None
        status, sentence = ended
        if status == 0:
            return True, f"{self.count} picture{'s' if self.count > 1 else ''} in {self.folder}"
        if self.sheet.is_file():
            return False, f"{self.done} of {self.count} pictures in {self.folder}: the contact sheet says what went wrong"
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
        if _running:
            cls.poll_message_set("The cameras are being rendered")
            return False
        if context.scene and scene_cameras.of_scene(context.scene):
            return True
        cls.poll_message_set("There is no camera")
        return False

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        global _running
        try:
            if not self.directory:
                raise InputError("there is no folder for the pictures: name one")
            _running = Rendering(context.scene, Path(bpy.path.abspath(self.directory)), self.animation, self.check)
        except InputError as error:
            self.report({"ERROR"}, datablocks.sentence(error))
            return {"CANCELLED"}
        if not bpy.app.background:
            bpy.app.timers.register(_look, first_interval=_SECONDS)
            return {"FINISHED"}
        try:  # for scripts: wait for it
            _running.wait()
            well, sentence = _ended()
        except BaseException:  # Ctrl-C
            end()
            raise
        self.report({"INFO" if well else "ERROR"}, sentence)
        return {"FINISHED" if well else "CANCELLED"}


class VIEWCAM_OT_cancel_render_all(bpy.types.Operator):
    bl_idname = "viewcam.cancel_render_all"
    bl_label = "Cancel"
    bl_description = "End the rendering of all cameras. The pictures that are there stay"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        return _running is not None

    def execute(self, _context: bpy.types.Context) -> set[str]:
        end()
        _redraw()
        return {"FINISHED"}


class VIEWCAM_OT_open_contact_sheet(bpy.types.Operator):
    bl_idname = "viewcam.open_contact_sheet"
    bl_label = "Open Contact Sheet"
    bl_description = "Open the last contact sheet of all cameras in the browser"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        return bool(_latest and _latest.is_file())

    def execute(self, _context: bpy.types.Context) -> set[str]:
        return bpy.ops.wm.url_open(url=_latest.absolute().as_uri())


def end() -> None:
    """Cancel the rendering that goes on, if there is one."""
    global _running
    if _running:
        _running.cancel()
    _running = None


def _ended() -> tuple[bool, str] | None:
    global _running, _latest
    told = _running.poll()
    if told:
        _latest = _running.sheet if _running.sheet.is_file() else _latest
        _running = None
    return told


def _look() -> float | None:
    """Blender's timer asks again after so many seconds, as long as it goes on."""
    if _running is None:
        return None
    told = _ended()
    _redraw()
    if told is None:
        return _SECONDS
    well, sentence = told

    def draw(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
        menu.layout.label(text=sentence, translate=False)
        menu.layout.operator("viewcam.open_contact_sheet", icon="URL")

    bpy.context.window_manager.popup_menu(draw, title="Render All Cameras", icon="CHECKMARK" if well else "ERROR")
    return None


def _redraw() -> None:
    if bpy.context.workspace:
        bpy.context.workspace.status_text_set(None)


def _draw_status_bar(header: bpy.types.Header, _context: bpy.types.Context) -> None:
    if _running:
        share, words = _running.progress()
        row = header.layout.row(align=True)
        row.ui_units_x = 14
        row.progress(factor=share, text=words)
        row.operator("viewcam.cancel_render_all", text="", icon="CANCEL")


def _draw_render_menu(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.operator_context = "INVOKE_DEFAULT"
    menu.layout.operator("viewcam.render_all_cameras", text="Render All Cameras…")
    menu.layout.operator("viewcam.open_contact_sheet")


@persistent
def _on_load(*_: object) -> None:
    end()


CLASSES = (VIEWCAM_OT_render_all_cameras, VIEWCAM_OT_cancel_render_all, VIEWCAM_OT_open_contact_sheet)


def register() -> None:
    bpy.types.TOPBAR_MT_render.append(_draw_render_menu)
    bpy.types.STATUSBAR_HT_header.append(_draw_status_bar)
    bpy.app.handlers.load_pre.append(_on_load)
    atexit.register(end)


def unregister() -> None:
    end()
    atexit.unregister(end)
    if bpy.app.timers.is_registered(_look):
        bpy.app.timers.unregister(_look)
    bpy.app.handlers.load_pre.remove(_on_load)
    bpy.types.STATUSBAR_HT_header.remove(_draw_status_bar)
    bpy.types.TOPBAR_MT_render.remove(_draw_render_menu)
