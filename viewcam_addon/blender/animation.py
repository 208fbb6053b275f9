"""Keyframed values and targets of `object.virtual_pinhole` move the camera, in the window and in a render.

Animation calls no update callback, and a render's dependency graph never writes what it evaluates back to the datablocks. So on
each frame the *evaluated* values place the *original* camera, and for a render it is tagged with its animation (TIME): without
the tag the camera's other animated channels would stay at the last frame. Driven values and targets are followed at updates as
well. Rejected: `frame_change_pre` and `depsgraph_update_post` alone (the camera stands still in a render), writing to evaluated
copies (children do not follow), drivers (without the add-on the camera falls to the origin).

Only the cameras that Blender has just evaluated are looked at, of whichever scene, so that the others cost nothing. Cameras
whose values are not animated are left alone: their artist may have moved them.
"""

import contextlib
import sys

import bpy
from bpy.app.handlers import persistent

from ..errors import InputError
from ..terminal import plain
from . import camera as cameras
from . import resolution, storage, targets, versions
from .datablocks import is_animated


@persistent
def on_frame_change(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None = None) -> None:
    depsgraph = depsgraph or bpy.context.evaluated_depsgraph_get()
    targets.forget_shapes(depsgraph)
    for block in [update.id.original for update in depsgraph.updates]:
        if _is_camera(block) and is_animated(block):
            _follow(block, scene, depsgraph)
        elif _is_camera(block) and depsgraph.mode != "RENDER":
            _adopt_move(block, scene, depsgraph)
    resolution.on_frame_change(scene, depsgraph)


@persistent
def on_update(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Values with a driver or a target change between frames too, as what they depend on is moved.

    Blender evaluates what this sets without calling it again, so that a constraint in the way makes no endless loop.
    """
    targets.forget_shapes(depsgraph)
    if depsgraph.id_type_updated("SCENE"):
        resolution.follow(scene)
    for block in [update.id.original for update in depsgraph.updates]:
        if _is_camera(block):
            is_driven = bool(block.animation_data) and _is_driven(block)
            is_moved = False
            if cameras.is_untouched(block, by_values=is_driven):
                cameras.end_move(block)
            else:
                is_moved = _adopt_move(block, scene, depsgraph)
            if is_driven and not is_moved:
                _follow(block, scene, depsgraph)


@persistent
def on_load(_path: str, _more: object = None) -> None:
    """Targets may have moved where the add-on was not, and Blender does not save the drivers of an override's own targets."""
    targets.forget_shapes()
    scene = bpy.context.scene
    watching = [each for each in scene.objects if each.type == "CAMERA" and targets.names(each)]
    for camera_object in watching:
        targets.connect(camera_object)
    for camera_object in watching:
        _follow(camera_object, scene, bpy.context.evaluated_depsgraph_get())


@persistent
def on_undo(_scene: bpy.types.Scene, _more: object = None) -> None:
    """Undo may bring back a camera's channels and not evaluate them, so that its values would follow where it was before."""
    targets.forget_shapes()
    for block in bpy.data.objects:
        if _is_camera(block) and not cameras.is_untouched(block, by_values=False):
            cameras.forget(block)
            block.update_tag(refresh={"OBJECT", "DATA"})


def _is_camera(block: bpy.types.ID) -> bool:
    return isinstance(block, bpy.types.Object) and block.type == "CAMERA" and storage.is_enabled(block)


def _adopt_move(camera_object: bpy.types.Object, scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> bool:
    if resolution.is_paused or cameras.is_being_set(camera_object):
        return False
    with contextlib.suppress(InputError):  # the panel finds the same error and shows it
        return cameras.adopt_move(camera_object, scene, depsgraph)
    return False


def _is_driven(camera_object: bpy.types.Object) -> bool:
    return any(curve.data_path.startswith("virtual_pinhole.") for curve in versions.drivers(camera_object))


def _follow(camera_object: bpy.types.Object, scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    evaluated = camera_object.evaluated_get(depsgraph)
    if not evaluated.is_evaluated or not storage.is_enabled(evaluated):
        return
    try:
        cameras.place(camera_object, cameras.stated(evaluated, scene), scene, depsgraph)
    except InputError as error:
        print(plain(f"viewcam: frame {scene.frame_current}: {camera_object.name}: {error}"), file=sys.stderr)
        return
    if depsgraph.mode == "RENDER":
        camera_object.update_tag(refresh={"OBJECT", "DATA", "TIME"})
        camera_object.data.update_tag(refresh={"TIME"})
    else:
        targets.connect(camera_object)  # one that was removed from the file leaves its driver
        targets.mirror(camera_object, evaluated)
        cameras.agree(camera_object)


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
    cameras.forget()
    targets.forget_shapes()
    bpy.app.handlers.depsgraph_update_post.remove(on_update)
    bpy.app.handlers.frame_change_post.remove(on_frame_change)
