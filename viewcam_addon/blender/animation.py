"""Keyframed values and targets of `object.virtual_pinhole` move the camera, in the window and in a render.

Animation calls no update callback, and a render's dependency graph never writes what it evaluates back to the datablocks. So on
each frame the *evaluated* values place the *original* camera, and for a render it is tagged with its animation (TIME): without
the tag the camera's other animated channels would stay at the last frame. Driven values and targets are followed at updates as
well. Rejected: `frame_change_pre` and `depsgraph_update_post` alone (the camera stands still in a render), writing to evaluated
copies (children do not follow), drivers (without the add-on the camera falls to the origin).

Only the cameras that Blender has just evaluated are looked at, of whichever scene, so that the others cost nothing.
"""

import contextlib
import sys
from collections.abc import Iterator

import bpy
from bpy.app.handlers import persistent

from ..errors import InputError
from ..terminal import plain
from . import camera as cameras
from . import datablocks, resolution, storage, targets
from .camera import CameraSync

_Object = bpy.types.Object  # to look it up takes as long as to ask a camera for its name


@persistent
def on_frame_change(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None = None) -> None:
    depsgraph = depsgraph or bpy.context.evaluated_depsgraph_get()
    targets.forget_shapes(depsgraph)
    if depsgraph.id_type_updated("SCENE"):
        datablocks.forget_curves()
    for sync in CameraSync.carry(_evaluated_cameras(depsgraph), scene, depsgraph):
        with _errors_told(sync.camera_object, scene):
            sync.at_frame(scene, depsgraph)
    resolution.on_frame_change(scene, depsgraph)


@persistent
def on_update(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Blender evaluates what this sets without calling it again, so that a constraint in the way makes no endless loop."""
    targets.forget_shapes(depsgraph)
    if depsgraph.id_type_updated("SCENE"):  # so it is, too, where what depends on what has changed, as by a new curve
        datablocks.forget_curves()
        resolution.follow(scene)
    for sync, *_ in _evaluated_cameras(depsgraph):
        with _errors_told(sync.camera_object, scene):
            if not resolution.is_paused:
                sync.updated(scene, depsgraph)
                continue
            sync.doubt()
            if datablocks.has_driven_values(sync.camera_object):
                sync.at_frame(scene, depsgraph)


@persistent
def on_load(_path: str, _more: object = None) -> None:
    """Targets may have moved where the add-on was not, Blender does not save the drivers of an override's own targets, and what
    was edited and not keyed is lost, as Blender will show what is keyed, and tells nobody."""
    targets.forget_shapes()
    cameras.forget_all()
    datablocks.forget_curves()
    scene = bpy.context.scene
    cameras_of_scene = [each for each in scene.objects if each.type == "CAMERA"]
    watching = [each for each in cameras_of_scene if targets.names(each)]
    for camera_object in watching:
        targets.connect(camera_object)
    led = [each for each in cameras_of_scene if storage.is_enabled(each) and (each.animation_data or each.data.animation_data)]
    for camera_object in led:
        cameras.tag_animation(camera_object)
    for camera_object in dict.fromkeys(watching + led):
        with _errors_told(camera_object, scene):
            CameraSync.of(camera_object).at_frame(scene, bpy.context.evaluated_depsgraph_get())


@persistent
def on_undo(_scene: bpy.types.Scene, _more: object = None) -> None:
    """Undo may bring back a camera's channels and not evaluate them, so that its values would follow where it was before."""
    targets.forget_shapes()
    datablocks.forget_curves()
    for block in bpy.data.objects:
        if _is_camera(block) and not CameraSync.of(block).is_untouched(by_values=False):
            CameraSync.of(block).forget()
            block.update_tag(refresh={"OBJECT", "DATA"})


def _is_camera(block: bpy.types.ID) -> bool:
    return type(block) is _Object and block.type == "CAMERA" and storage.is_enabled(block)


def _evaluated_cameras(depsgraph: bpy.types.Depsgraph) -> list[tuple[CameraSync, bpy.types.Object, bool]]:
    """The enabled cameras that Blender has just evaluated and that nobody is about to set, each with its evaluated object, and
    true where its data may be new."""
    updates = [(update.id, update) for update in depsgraph.updates]
    cameras = [(block, update) for block, update in updates if type(block) is _Object and block.type == "CAMERA"]
    known = [
        (CameraSync.of(block), block, update.is_updated_geometry)
        for block, update in cameras
        if storage.is_enabled(block.original)
    ]
    return [each for each in known if not each[0].is_being_set]


@contextlib.contextmanager
def _errors_told(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> Iterator[None]:
    """An error of a camera that goes on as it is, in the console: the panel shows it of the one that it is about alone."""
    try:
        yield
    except InputError as error:
        print(plain(f"viewcam: frame {scene.frame_current}: {camera_object.name}: {error}"), file=sys.stderr)


def register() -> None:
    bpy.app.handlers.frame_change_post.append(on_frame_change)
    bpy.app.handlers.depsgraph_update_post.append(on_update)
    bpy.app.handlers.load_post.append(on_load)
    bpy.app.handlers.undo_post.append(on_undo)
    bpy.app.handlers.redo_post.append(on_undo)


def unregister() -> None:
    bpy.app.handlers.redo_post.remove(on_undo)
    bpy.app.handlers.undo_post.remove(on_undo)
    bpy.app.handlers.load_post.remove(on_load)
    cameras.forget_all()
    targets.forget_shapes()
    bpy.app.handlers.depsgraph_update_post.remove(on_update)
    bpy.app.handlers.frame_change_post.remove(on_frame_change)
