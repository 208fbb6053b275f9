"""The cameras of a .blend: all of them, one at many frames, or those with which it rendered the pictures of a dataset.

Of a dataset, a picture that is called as a camera object is that camera's, at the frame in which the file was saved; else the
number at the end of its name is a frame, and its camera the one that Blender would render there. Rejected: the nearest
camera, which would hide the mistakes that an audit looks for.
"""

import os
import re
from collections.abc import Iterable, Sequence

import bpy

from .. import checks
from ..cameras import Camera
from ..cameras.camera import LeftOut
from ..errors import InputError
from . import camera as cameras
from . import datablocks
from .opening import opened

_NUMBER = re.compile(r"(\d{1,6})$")


def of_file(
    blend: str | os.PathLike[str], shots: Sequence[tuple[str, int]] | None = None, name: str | None = None, trust: bool = False
) -> list[Camera]:
    """The cameras of a .blend as it renders them.

    shots : (name, frame) of each; None for all cameras of the scene at the frame in which the file was saved.
    name : the name of the camera at these frames; None for the one that Blender would render there.
    trust : see `opened`.

    Raises InputError if there is none; as `opened` and `read` do.
    """
    with opened(blend, trust) as (_, notes):
        scene = bpy.context.scene
        objects = {each.name: each for each in scene.objects if each.type == "CAMERA"}
        if not objects or (name is not None and name not in objects):
            wrong = f"no camera {checks.quoted(name)}" if objects else "no camera"
            raise InputError(f"scene {scene.name!r} of {blend} has {wrong}: name one of {', '.join(objects) or 'another file'}")
        if shots is not None:
            return [camera.noted(*notes) for camera in of_frames(scene, shots, objects.get(name or ""))]
        left_out, result = LeftOut(InputError), []
        for called, camera_object in sorted(objects.items()):
            with left_out.unless_pinhole(called):
                result.append(Camera(called, cameras.read(camera_object, scene), notes=notes, image=f"{called}.png"))
        return left_out.with_notes(result)


def of_frames(
    scene: bpy.types.Scene, shots: Sequence[tuple[str, int]], camera_object: bpy.types.Object | None = None
) -> list[Camera]:
    """A camera at many frames as the scene renders it; the scene is at its own frame again afterwards.

    shots : (name, frame) of each.
    camera_object : None for the one that Blender would render there.

    Raises InputError if there is none at one of the frames; as `read` does.
    """
    before, result = (scene.frame_current, scene.frame_subframe), []
    try:
        for name, frame in shots:
            scene.frame_set(frame)
            if (taken := camera_object or datablocks.render_camera(scene)) is None:
                raise InputError(f"scene {scene.name!r} has no camera at frame {frame}: set one")
            time = frame * scene.render.fps_base / scene.render.fps
            result.append(Camera(name, cameras.read(taken, scene), image=f"{name}.png", time=time))
    finally:
        scene.frame_set(before[0], subframe=before[1])
    return result


def of_pictures(names: Iterable[str], blend: str | os.PathLike[str], trust: bool = False) -> list[Camera]:
    """The camera of each picture that the .blend has one for, as it renders it, with notes on what of the file is off.

    names : the pictures' names, without folder and suffix.
    trust : see `opened`.

    Raises InputError if there is none for any, or one that stands still for pictures of several frames; as `opened` and `read`
    do.
    """
    names = list(dict.fromkeys(names))
    with opened(blend, trust) as (_, notes):
        scene = bpy.context.scene
        objects = {each.name: each for each in scene.objects if each.type == "CAMERA"}
        if called := [name for name in names if name in objects]:
            return [Camera(name, cameras.read(objects[name], scene), notes=notes) for name in called]
        result = []
        for name in names:
            if number := _NUMBER.search(name):
                scene.frame_set(int(number[1]))
                camera_object = datablocks.render_camera(scene)
                if camera_object is None:
                    raise InputError(f"scene {scene.name!r} of {blend} has no camera: give the .blend that was rendered")
                result.append(Camera(name, cameras.read(camera_object, scene), notes=notes))
        if not result or (len(result) > 1 and len({camera.pinhole for camera in result}) == 1):
            why = "its camera stands still" if result else "its cameras are called otherwise, and no name ends with a frame"
            first_names = ", ".join(checks.quoted(name) for name in names[:3])
            raise InputError(
                f"{blend} does not tell which camera took {first_names}: {why}; give the true cameras with --against"
            )
        return result
