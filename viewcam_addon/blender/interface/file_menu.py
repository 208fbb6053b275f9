"""File › Import and File › Export: cameras of other programs (cameras/), and the scene as the reference tracer reads it.

**Cameras**, also as files dropped on a viewport. What a format leaves open is the scene's: its size where a file says none, and
for poses without a lens how its camera sees. glTF and USD are left to Blender's own importers when they are dropped.

**The scene** is exported as `viewcam export` does it, at the current frame through the scene's camera. What is not whole in the
ledger is summed up in a report and shown in a popup, as Blender's own glTF exporter does. Rejected: the ledger as a text
datablock, since exporting should change nothing in the file that is open.
"""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

import bpy
from bpy_extras.io_utils import ExportHelper, ImportHelper

from ... import cameras as formats
from ...errors import InputError, counted
from ...jobs import makers
from ...pinhole import ViewPlane
from ...tracer.scene import LedgerEntry
from .. import camera as cameras
from .. import datablocks, dataset_cameras, picture
from . import clipboard, readouts
from .camera_options import READING, ReadingOptions, WorldOptions
from .operators import ReportsErrors, possible

_SUFFIX = ".json"
_CAMERAS = "Cameras (COLMAP, fSpy, pbrt, …)"
_DROPPED = ".json;.txt;.bin;.xml;.yaml;.yml;.fspy;.sfm;.xmp;.out;.nvm;.npy;.npz;.csv;.log;.pbrt;.pov"
_MOST_NOTES = 12
_POPUP_ENTRIES = 12
_POPUP_WIDTH = 480


class VIEWCAM_OT_import_cameras(ReadingOptions, ReportsErrors, ImportHelper, bpy.types.Operator):
    bl_idname = "viewcam.import_cameras"
    bl_label = "Import Cameras"
    bl_description = "Add the cameras of another program's file, or of the folder that is shown, in a collection of their own"
    bl_options: ClassVar[set[str]] = {"REGISTER", "UNDO"}

    directory: bpy.props.StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})
    files: bpy.props.CollectionProperty(type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"})
    import_as: bpy.props.EnumProperty(
        name="As",
        description="What becomes of several cameras",
        items=[
            ("BY_FILE", "By the File", "A camera each; of a trajectory one that flies"),
            ("EACH", "A Camera Each", ""),
            ("FLIGHT", "One That Flies", "One camera with a keyframe for each"),
        ],
        options={"SKIP_SAVE"},
    )
    backgrounds: bpy.props.BoolProperty(
        name="Pictures as Backgrounds",
        description="Show each camera's picture behind it, where the file names one",
        default=True,
    )
    set_size: bpy.props.BoolProperty(
        name="Set the Scene's Size",
        description="Give the scene the resolution and pixel aspect of the first camera",
        options={"SKIP_SAVE"},
    )
    distance: bpy.props.FloatProperty(
        name="Distance",
        description="The view-plane distance in pixels, for trajectories, which have none; 0 for that of the scene's camera",
        min=0.0,
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return possible(cls, context.scene and not context.scene.library, "The scene is linked from another file")

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Ask for the file, or of a dropped one for the options. A scene without a camera takes the file's size."""
        if not self.properties.is_property_set("set_size"):
            self.set_size = context.scene.camera is None
        return self.invoke_popup(context)

    def draw(self, _context: bpy.types.Context) -> None:
        self.layout.use_property_split = True
        for name in ("import_as", "set_size", "backgrounds", *READING, "distance"):
            self.layout.prop(self, name)

    def run(self, context: bpy.types.Context) -> None:
        from ..scenes import import_cameras  # here, since Blender starts without

        paths = self._paths()
        read_cameras: list[formats.Camera] = []
        notes: list[str] = []
        kinds = set()
        for path in paths:
            kinds.add(formats.recognized(path))
            more, more_notes = read(path, context.scene, self.distance, self)
            read_cameras, notes = read_cameras + more, notes + more_notes
        as_flight = self.import_as == "FLIGHT" or (self.import_as == "BY_FILE" and kinds == {"trajectories"})
        folder = paths[0] if paths[0].is_dir() else paths[0].parent
        imported = import_cameras.import_cameras(
            read_cameras,
            text(paths[0].stem) or "Cameras",
            context.scene,
            folder if self.backgrounds else None,
            self.set_size,
            as_flight,
        )
        if context.mode == "OBJECT":
            select(imported.objects, imported.objects[0], context)
        notes = list(dict.fromkeys((*notes, *imported.notes)))
        title = ", ".join(formats.FORMATS[kind].TITLE for kind in sorted(kinds))
        what = f"a flight of {len(read_cameras)} poses" if as_flight else counted(len(read_cameras), "camera")
        pictures = f", {imported.pictures} with pictures" if imported.pictures else ""
        noted = f"; {counted(len(notes), 'note')}" if notes else ""
        for note in notes[:_MOST_NOTES]:
            self.report({"WARNING"}, text(note))
        self.report({"INFO"}, text(f"{paths[0].name}: {what}{pictures} ({title}){noted}"))
        if notes and not bpy.app.background:
            show(lines_of([(note, "INFO") for note in notes]), "Imported Cameras", context)

    def _paths(self) -> list[Path]:
        names = [each.name for each in self.files if each.name]
        if len(names) > 1:
            return [Path(bpy.path.abspath(self.directory), name) for name in names]
        path = bpy.path.abspath(self.filepath or self.directory)
        if not path:
            raise InputError("no file is chosen: choose a file or folder of cameras")
        return [Path(path)]


def read(
    path: Path, scene: bpy.types.Scene, distance: float, properties: ReadingOptions
) -> tuple[list[formats.Camera], list[str]]:
    """The cameras of a file or folder, and what was taken from the scene.

    distance : the view plane's distance in pixels, where the file says none; 0 for that of the scene's camera.

    Raises InputError as `cameras.read` does.
    """
    frame, notes, plane = datablocks.frame_of(scene), [], None
    width, height = size = (frame.resolution_x, frame.resolution_y)
    aspect = frame.pixel_aspect_x / frame.pixel_aspect_y
    base = None
    if distance > 0:
        plane = ViewPlane((distance, distance * aspect), (width / 2, height / 2), width, height)
    elif formats.recognized(path) == "trajectories":
        camera_object = datablocks.render_camera(scene)
        if camera_object is None:
            raise InputError(f"{path.name} says where the camera is but not how it sees: give the Distance in pixels")
        base = cameras.read(camera_object, scene)
        notes.append(f"Where the file does not say how the camera sees, it sees as {camera_object.name}")
    options = properties.chosen(size=size, size_fits=True, pixel_aspect=aspect, view_plane=plane, base=base)
    read_cameras = formats.read(path, options=options)
    if base is None and plane is None and not all(camera.size_stated for camera in read_cameras):
        notes.append(f"The file does not say how many pixels its pictures have: {width} × {height} of the scene were taken")
    return read_cameras, notes


class VIEWCAM_OT_export_cameras(WorldOptions, ReportsErrors, ExportHelper, bpy.types.Operator):
    bl_idname = "viewcam.export_cameras"
    bl_label = "Export Cameras"
    bl_description = "Write cameras for another program, in the picture at 100 %"

    filename_ext = ""
    check_extension = None
    format: bpy.props.EnumProperty(
        name="Format",
        description="Whose file or folder it is",
        items=[(name, formats.FORMATS[name].TITLE, "") for name in formats.writable()],
        default="transforms",
    )
    which: bpy.props.EnumProperty(
        name="Cameras",
        description="Which cameras",
        items=[
            ("SCENE", "The Scene's", "The camera that a render takes"),
            ("SELECTED", "Selected", "All selected cameras"),
            ("ALL", "All", "All cameras of the scene"),
            ("FRAMES", "The Scene's, Each Frame", "The camera that a render takes at each frame from Start to End"),
        ],
        default="ALL",
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        has_camera = context.scene and any(each.type == "CAMERA" for each in context.scene.objects)
        return possible(cls, has_camera, "The scene has no camera")

    def draw(self, _context: bpy.types.Context) -> None:
        self.layout.use_property_split = True
        for name in ("format", "which", "axes", "scale"):
            self.layout.prop(self, name)

    def run(self, context: bpy.types.Context) -> None:
        suffix = formats.FORMATS[self.format].SUFFIX
        path = Path(bpy.path.abspath(self.filepath))
        if not path.name:
            raise InputError("the cameras have no file name: give one")
        if suffix and self.format != "sidecar" and not path.suffix:
            path = path.with_suffix(suffix)
        exported = self._at_each_frame(context.scene) if self.which == "FRAMES" else self._cameras(context)
        written = formats.save(exported, path, self.format, self.chosen())
        files = "" if len(written) == 1 else f", {len(written)} files"
        count = counted(len(exported), "camera")
        self.report({"INFO"}, text(f"{path.name}: {count} ({formats.FORMATS[self.format].TITLE}{files})"))

    def _at_each_frame(self, scene: bpy.types.Scene) -> list[formats.Camera]:
        frames = makers.frames(f"{scene.frame_start}..{scene.frame_end}")[:: scene.frame_step]
        result = dataset_cameras.of_frames(scene, [(job.name, job.frame) for job in frames if job.frame is not None])
        frame = datablocks.frame_of(scene)
        return [dataclasses.replace(each, pinhole=picture.at_full_size(each.pinhole, frame)) for each in result]

    def _cameras(self, context: bpy.types.Context) -> list[formats.Camera]:
        return [clipboard.camera_of(each, context.scene) for each in self._chosen_objects(context)]

    def _chosen_objects(self, context: bpy.types.Context) -> list[bpy.types.Object]:
        if self.which == "SCENE":
            result = [datablocks.render_camera(context.scene)]
        else:
            objects = context.selected_objects if self.which == "SELECTED" else context.scene.objects
            result = [each for each in objects if each.type == "CAMERA"]
        if result in ([], [None]):
            raise InputError("there is no such camera: select one, or choose All")
        return sorted(result, key=lambda each: each.name)


class VIEWCAM_FH_cameras(bpy.types.FileHandler):
    """The handler of a file of cameras that is dropped on a viewport."""

    bl_idname = "VIEWCAM_FH_cameras"
    bl_label = "Cameras"
    bl_import_operator = "viewcam.import_cameras"
    bl_file_extensions = _DROPPED

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        return context.area is not None and context.area.type == "VIEW_3D"


class VIEWCAM_OT_export_scene(ReportsErrors, ExportHelper, bpy.types.Operator):
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
        return possible(cls, context.scene and datablocks.render_camera(context.scene), "The scene has no camera")

    def run(self, context: bpy.types.Context) -> None:
        from ...jobs.job import Job
        from ...tracer.scene import scene_file  # here, since Blender starts without
        from ..jobs import renderer

        path = Path(bpy.path.ensure_ext(bpy.path.abspath(self.filepath), _SUFFIX))
        if path.name == _SUFFIX:
            raise InputError("the scene has no file name: give one")
        scene = renderer.export(Job(level="path" if self.light else "geometry", recenter=self.recenter))
        scene_file.write(scene, path)
        _tell(self, scene.ledger, path, context)


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
    parts = [f"{counts['exported']} of {counted(total, 'object')} exported whole"]
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


CLASSES = (VIEWCAM_OT_export_scene, VIEWCAM_OT_import_cameras, VIEWCAM_OT_export_cameras, VIEWCAM_FH_cameras)


def register() -> None:
    bpy.types.TOPBAR_MT_file_export.append(_draw_export)
    bpy.types.TOPBAR_MT_file_import.append(_draw_import)


def unregister() -> None:
    bpy.types.TOPBAR_MT_file_import.remove(_draw_import)
    bpy.types.TOPBAR_MT_file_export.remove(_draw_export)
