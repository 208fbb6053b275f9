"""The camera follows the picture's resolution, percentage and pixel aspect as they change.

Blender tells of such a change in `depsgraph_update_post`, whoever makes it: the scene is among the updates (measured: 4.2, 5.0
and 5.2), in the window, at a script's next evaluation, and before a render. A scene that is not the window's is told of by its
render only, in `frame_change_post`. Only the lens is set anew: the pose does not depend on the picture, and the artist may have
moved the camera. Rejected: message-bus subscriptions (they hear of the window's edits only, and not of scripts).

Whether a camera is set for the present picture is stored beside its values (storage.py), so that undo needs no care. A camera
that is set for another one of its scenes stays so, and the panel says it: one lens can't serve both.
"""

import contextlib
from collections.abc import Iterator
from dataclasses import replace

import bpy

from .. import intrinsics
from ..camera_values import FIELD_OF_VIEW, PIXELS, without_border
from ..errors import InputError
from . import datablocks, storage
from .camera import CameraSync

# The picture for which all cameras of a scene have been looked at, by the scene's name, with the scene's address: it is another
# scene after undo and in another file. Without it every change of a scene's settings would look at every object.
_seen: dict[str, tuple] = {}
is_paused = False


@contextlib.contextmanager
def lens_kept(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> Iterator[None]:
    """Allow a picture of another size within the block: no camera follows it, and this one's values go with its lens."""
    global is_paused
    values, was_paused = storage.load(camera_object), is_paused
    is_paused = True
    try:
        with storage.restored(camera_object, "keeps", "counted_in"):
            if values.keeps == PIXELS:
                picture = without_border(datablocks.frame_of(scene))
                storage.store(camera_object, replace(values, keeps=FIELD_OF_VIEW, counted_in=picture), "keeps", "counted_in")
            yield
    finally:
        is_paused = was_paused


def follow(scene: bpy.types.Scene) -> None:
    """Set the lenses of the scene's cameras for its picture, if it is another one than last time."""
    if is_paused:
        return
    with contextlib.suppress(InputError):  # no picture at all: the panel says so
        frame = datablocks.frame_of(scene)
        now = (scene.as_pointer(), without_border(frame))
        if _seen.get(scene.name_full) != now:
            _seen[scene.name_full] = now
            for camera_object in _set_for_another(scene, frame):
                with contextlib.suppress(InputError):
                    sync = CameraSync.of(camera_object)
                    sync.resized(scene)
                    sync.settled(frame)


def on_frame_change(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """In a render nothing but the lens is touched: the values are counted anew when the scene is next looked at."""
    if depsgraph.mode != "RENDER" or is_paused:
        return
    with contextlib.suppress(InputError):
        for camera_object in _set_for_another(scene, datablocks.frame_of(scene)):
            with contextlib.suppress(InputError):
                CameraSync.of(camera_object).resized(scene)
                camera_object.data.update_tag()


def _set_for_another(scene: bpy.types.Scene, frame: intrinsics.Frame) -> list[bpy.types.Object]:
    """The enabled cameras of a scene that were set for another picture, and for none of another of their scenes."""
    return [
        each
        for each in scene.objects
        if each.type == "CAMERA"
        and storage.is_enabled(each)
        and storage.load(each).set_for != without_border(frame)
        and not storage.scenes_it_is_set_for(each, scene)
    ]


def unregister() -> None:
    _seen.clear()
