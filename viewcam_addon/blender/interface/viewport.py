"""The 3D viewport's own view as a Pinhole.

Read from where the view stands (its pivot, rotation and distance) and from its lens, not from its matrices: those are made when
it is drawn, and lag behind until then.
"""

from dataclasses import replace

import bpy
import numpy as np

from ... import rotation
from ...errors import InputError
from ...pinhole import Pinhole
from .. import camera as cameras

# The larger side of a region shows what a sensor of twice Blender's usual 36 mm sees.
_SENSOR = 72.0


def area_in(context: bpy.types.Context) -> bpy.types.Area | None:
    """The 3D viewport that is meant: the one in which the mouse is, else the largest in the window."""
    if context.area and context.area.type == "VIEW_3D":
        return context.area
    areas = context.window.screen.areas if context.window else ()
    return max((area for area in areas if area.type == "VIEW_3D"), key=lambda area: area.width * area.height, default=None)


def pinhole_of(area: bpy.types.Area, like: Pinhole, scene: bpy.types.Scene) -> Pinhole:
    """The view of a 3D viewport, in the picture of `like`, its size, pixel aspect, principal point and mirroring.

    d is the largest with which the picture shows all that the viewport shows. Where the viewport looks through a camera, it is
    that camera's Pinhole, principal point and all.

    Raises InputError if the view is orthographic, or the camera that it looks through is none that `camera.read` can read.
    """
    space = area.spaces.active
    view = space.region_3d
    if view.view_perspective == "CAMERA":
        camera_object = space.camera if space.use_local_camera else scene.camera
        if camera_object is None:
            raise InputError("the viewport looks through a camera that is gone: leave the camera's view")
        return cameras.as_it_stands(camera_object, scene)
    if view.view_perspective == "ORTHO":
        raise InputError("the viewport is orthographic, no pinhole: switch it to perspective")
    _, v, w = rotation.from_quaternion(view.view_rotation).T
    pivot = _pivot(space)
    look_at, eye = tuple(pivot.tolist()), tuple((pivot + view.view_distance * w).tolist())
    region = [region for region in area.regions if region.type == "WINDOW"][-1]  # in a quad view the last one is the user's
    sides = zip((like.width, like.height), like.distance, (region.width, region.height), strict=True)
    largest = max(region.width, region.height)
    zoom = min(side / distance * space.lens / _SENSOR * largest / across for side, distance, across in sides)
    return replace(
        like,
        eye=eye,
        look_at=look_at,
        up=cameras.simplest_up(eye, look_at, v),
        distance=(zoom * like.distance[0], zoom * like.distance[1]),
    )


def _pivot(space: bpy.types.SpaceView3D) -> np.ndarray:
    """(3,): the point about which the view turns, and which it keeps in its middle."""
    if space.lock_object:
        matrix = rotation.float64(space.lock_object.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world)
        bone = space.lock_object.pose.bones.get(space.lock_bone) if space.lock_object.type == "ARMATURE" else None
        return matrix[:3, :3] @ rotation.float64(bone.head) + matrix[:3, 3] if bone else matrix[:3, 3]
    if space.lock_cursor:
        return rotation.float64(bpy.context.scene.cursor.location)
    return rotation.float64(space.region_3d.view_location)
