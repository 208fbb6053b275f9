"""The cameras with which a .blend rendered the pictures of a dataset, found by the pictures' names.

A picture that is called as a camera object is that camera's, at the frame in which the file was saved; else the number at the
end of its name is a frame, and its camera the one that Blender would render there. Rejected: the nearest camera, which would
hide the mistakes that an audit looks for.
"""

import os
import re
from collections.abc import Iterable

import bpy

from .. import checks
from ..cameras import Camera
from ..errors import InputError
from . import camera as cameras
from . import datablocks
from .opening import opened

_NUMBER = re.compile(r"(\d{1,6})$")


def of_pictures(names: Iterable[str], blend: str | os.PathLike[str], trust: bool = False) -> list[Camera]:
    """The camera of each picture that the .blend has one for, as it renders it, with notes on what of the file is off.

    names : of the pictures, without folder and suffix. trust : as `opened` has it.

    Raises
    ------
    InputError
        if there is none for any, or one that stands still for pictures of several frames; as `opened` and `read` do.
    """
    names = list(dict.fromkeys(names))
    with opened(blend, trust) as (_, notes):
        scene = bpy.context.scene
        objects = {each.name: each for each in scene.objects if each.type == "CAMERA"}
        if called := [name for name in names if name in objects]:
            return [Camera(name, cameras.read(objects[name], scene), notes=notes) for name in called]
        found = []
        for name in names:
            if number := _NUMBER.search(name):
                scene.frame_set(int(number[1]))
                camera_object = datablocks.render_camera(scene)
                if camera_object is None:
                    raise InputError(f"scene {scene.name!r} of {blend} has no camera: give the .blend that was rendered")
                found.append(Camera(name, cameras.read(camera_object, scene), notes=notes))
        if not found or (len(found) > 1 and len({camera.pinhole for camera in found}) == 1):
            why = "its camera stands still" if found else "its cameras are called otherwise, and no name ends with a frame"
            shown = ", ".join(checks.shown(name) for name in names[:3])
            raise InputError(f"{blend} does not tell which camera took {shown}: {why}; give the true cameras with --against")
        return found
