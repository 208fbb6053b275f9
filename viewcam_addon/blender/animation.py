"""Keyframed values of `object.virtual_pinhole` move the camera, in the window and in a render.

Animation calls no update callback, and a render's dependency graph never writes what it evaluates back to the datablocks. So on
each frame the *evaluated* values place the *original* camera, and for a render it is tagged with its animation (TIME): without
the tag the camera's other animated channels would stay at the last frame. Driven values are followed at updates as well.
Rejected: `frame_change_pre` and `depsgraph_update_post` alone (the camera stands still in a render), writing to evaluated
copies (children do not follow), drivers (without the add-on the camera falls to the origin).

Cameras whose values are not animated are left alone: their artist may have moved them.
"""

import sys

import bpy
from bpy.app.handlers import persistent

from ..errors import InputError
from . import camera as cameras
from . import versions
from .hold import is_animated


@persistent
def on_frame_change(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None = None) -> None:
    depsgraph = depsgraph or bpy.context.evaluated_depsgraph_get()
    for camera_object in scene.objects:
        if camera_object.type == "CAMERA" and is_animated(camera_object):
            _follow(camera_object, scene, depsgraph)


@persistent
def on_update(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Values with a driver change between frames too, as what the driver reads is moved.

    Blender evaluates what this sets without calling it again, so that a constraint in the way makes no endless loop.
    """
    for update in depsgraph.updates:
        evaluated = update.id
        if isinstance(evaluated, bpy.types.Object) and evaluated.type == "CAMERA" and _is_driven(evaluated.original):
            _follow(evaluated.original, scene, depsgraph)


def _is_driven(camera_object: bpy.types.Object) -> bool:
    return any(curve.data_path.startswith("virtual_pinhole.") for curve in versions.drivers(camera_object))


def _follow(camera_object: bpy.types.Object, scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    evaluated = camera_object.evaluated_get(depsgraph)
    if not evaluated.is_evaluated or not evaluated.virtual_pinhole.enabled:
        return
    try:
        cameras.place(camera_object, cameras.stated(evaluated, scene), scene, depsgraph)
    except InputError as error:
        print(f"viewcam: frame {scene.frame_current}: {camera_object.name}: {error}", file=sys.stderr)
        return
    if depsgraph.mode == "RENDER":
        camera_object.update_tag(refresh={"OBJECT", "DATA", "TIME"})
        camera_object.data.update_tag(refresh={"TIME"})


def register() -> None:
    bpy.app.handlers.frame_change_post.append(on_frame_change)
    bpy.app.handlers.depsgraph_update_post.append(on_update)


def unregister() -> None:
    bpy.app.handlers.depsgraph_update_post.remove(on_update)
    bpy.app.handlers.frame_change_post.remove(on_frame_change)
