"""A camera and its picture as Blender has them, in the plain classes of intrinsics.py. Nothing here changes anything."""

import functools
import math
import operator
from collections.abc import Iterable

import bpy
import numpy as np

from .. import intrinsics
from ..errors import InputError
from ..terminal import plain
from . import versions

# Meters: what is shorter, Blender calls zero.
_SHORTEST_WORD = 1e-6
_UNITS = {
    "KILOMETERS": "km",
    "METERS": "m",
    "CENTIMETERS": "cm",
    "MILLIMETERS": "mm",
    "MICROMETERS": "µm",
    "MILES": "mi",
    "FEET": "'",
    "INCHES": '"',
    "THOU": "thou",
}
_KINDS = {"ORTHO": "orthographic", "PANO": "panoramic", "CUSTOM": "a custom camera"}


def check_perspective(camera_object: bpy.types.Object) -> None:
    """Raise InputError, by name, if the object is no perspective camera."""
    if camera_object.type != "CAMERA" or camera_object.data.type != "PERSP":
        raise _no_perspective(camera_object)


def _no_perspective(camera_object: bpy.types.Object) -> InputError:
    if camera_object.type != "CAMERA":
        return InputError(f"object {camera_object.name!r} is no camera: choose a camera")
    kind = _KINDS.get(camera_object.data.type, camera_object.data.type)
    return InputError(f"camera {camera_object.name!r} is {kind}, no pinhole: set its lens type to Perspective")


_VALUES, _OWN = "virtual_pinhole", "virtual_pinhole."
# Properties that are another look at a value, which is what is kept → that value. They can be animated like any other.
LENSES = {
    "focal_length": "MILLIMETERS",
    "horizontal_fov": "HORIZONTAL",
    "vertical_fov": "VERTICAL",
    "diagonal_fov": "DIAGONAL",
}
LOOKS = dict.fromkeys(LENSES, "distance") | {"roll": "up"}


_known_curves: dict[int, bool] = {}  # by a camera's session_uid: `is_animated` when its action was last looked through


def is_animated(camera_object: bpy.types.Object) -> bool:
    """True if a keyframe, an NLA strip or a driver changes one of the values of the Virtual Pinhole, or a target does."""
    return any([path.startswith(_OWN) for path in [curve.data_path for curve in versions.all_curves(camera_object)]])


def is_known_as_animated(camera_object: bpy.types.Object) -> bool:
    """`is_animated`, in a tenth of the time: a camera's action is looked through once until `forget_curves`.

    For a frame change, before which Blender has told of curves, actions and drivers that are new: those that have been removed
    may be missed.
    """
    known = _known_curves.get(camera_object.session_uid)
    if known is None:
        known, data = is_animated(camera_object), camera_object.animation_data
        if not data or not (data.drivers or data.nla_tracks):
            _known_curves[camera_object.session_uid] = known
    return known


def forget_curves() -> None:
    """Take it that any camera may have another action now, or its action other curves."""
    _known_curves.clear()


def animated_values(camera_object: bpy.types.Object) -> set[str]:
    """The names of the values that keyframes, NLA strips or drivers change, or a look at them.

    A point that follows a target is one of them.
    """
    names = set()
    for curve in versions.all_curves(camera_object):
        owner, _, name = curve.data_path.partition(".")
        if owner == _VALUES and not versions.is_muted(curve):
            names.add(("eye", "look_at")[curve.array_index] if name == "followed" else LOOKS.get(name, name))
    return names


def has_driven_values(camera_object: bpy.types.Object) -> bool:
    """True if a driver, such as that of a target, has a say in the values."""
    return any(curve.data_path.startswith(f"{_VALUES}.") for curve in versions.drivers(camera_object))


# Numbers that were checked once are not checked again as a camera moves.
_known_frame = functools.lru_cache(maxsize=64)(intrinsics.Frame)
_known_camera = functools.lru_cache(maxsize=64)(intrinsics.CameraData)
view_plane = functools.lru_cache(maxsize=64)(intrinsics.view_plane)
camera_data = functools.lru_cache(maxsize=64)(intrinsics.camera_data)


def frame_of(scene: bpy.types.Scene) -> intrinsics.Frame:
    """The picture that the scene renders."""
    render = scene.render
    border = (render.border_min_x, render.border_min_y, render.border_max_x, render.border_max_y) if render.use_border else None
    return _known_frame(
        render.resolution_x,
        render.resolution_y,
        render.resolution_percentage,
        render.pixel_aspect_x,
        render.pixel_aspect_y,
        border,
        render.use_border and render.use_crop_to_border,
    )


def camera_data_of(camera_object: bpy.types.Object) -> intrinsics.CameraData:
    """The intrinsics of a camera as plain numbers; those of the evaluated object are what Cycles renders.

    Raises InputError if the object is no perspective camera, or if a script has stored what is no number of a camera.
    """
    if camera_object.type != "CAMERA" or camera_object.data.type != "PERSP":
        raise _no_perspective(camera_object)
    camera = camera_object.data
    try:
        return _known_camera(
            camera.lens, camera.sensor_width, camera.sensor_height, camera.sensor_fit, camera.shift_x, camera.shift_y
        )
    except InputError as error:
        raise InputError(f"camera data {camera.name!r}: {error}") from error


def own_sensor(camera: bpy.types.Camera) -> tuple[float, float]:
    """The artist's sensor (width, height) in mm: what it was before `place` grew it, unless the artist has changed it since."""
    return intrinsics.own_sensor((camera.sensor_width, camera.sensor_height), tuple(camera.virtual_pinhole_sensor))


def length(value: float, scene: bpy.types.Scene, digits: int = 6) -> str:
    """A length in world units as the scene's units say it; a bare number without them, and where Blender would say zero."""
    units = scene.unit_settings
    meters = value * units.scale_length
    if units.system == "NONE" or not _SHORTEST_WORD <= abs(meters) < math.inf:
        return f"{value:.{digits}g}"
    if (unit := _UNITS.get(units.length_unit)) is None:  # adaptive: the largest that leaves something before the point
        return bpy.utils.units.to_string(units.system, "LENGTH", meters, precision=digits)
    in_meters = float(
        f"{bpy.utils.units.to_value(units.system, 'LENGTH', '1', str_ref_unit=unit):.7g}"
    )  # Blender's are float32
    number = meters / in_meters
    text = f"{number:.{digits}g}" if abs(number) < 10**digits else f"{number:.0f}"
    return f"{text}{unit}" if unit in "'\"" else f"{text} {unit}"


def render_camera(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """The camera that a render of the current frame takes: where markers are bound to cameras, theirs and not the scene's."""
    return bound_camera(bindings_of(scene), time_of_markers(scene, scene.frame_current, scene.frame_subframe)) or scene.camera


def require_render_camera(scene: bpy.types.Scene) -> bpy.types.Object:
    """`render_camera`, or InputError where there is none."""
    camera_object = render_camera(scene)
    if camera_object is None:
        raise InputError(f"scene {scene.name!r} has no camera: add one, or name one with --camera")
    return camera_object


def bindings_of(scene: bpy.types.Scene) -> list[tuple[bpy.types.TimelineMarker, bpy.types.Object]]:
    """The markers that are bound to cameras, and these."""
    return [(marker, marker.camera) for marker in scene.timeline_markers if marker.camera]


def time_of_markers(scene: bpy.types.Scene, frame: int, subframe: float = 0.0) -> int:
    """The frame at which Blender looks for markers as it renders a frame: in the time that the scene stretches, cut off."""
    stretched = np.float32(scene.render.frame_map_old) / np.float32(scene.render.frame_map_new)
    return int(np.float32(frame + subframe) * stretched)


def bound_camera(bindings: Iterable[tuple[bpy.types.TimelineMarker, bpy.types.Object]], frame: int) -> bpy.types.Object | None:
    """The camera that markers bind at a frame, as Blender has it: the last one's before it, else the first one's of all.

    frame : see time_of_markers.

    Those that are hidden in renders bind nothing. None where no marker does.
    """
    bound = [(marker.frame, camera_object) for marker, camera_object in bindings if not camera_object.hide_render]
    before = [each for each in bound if each[0] <= frame]
    if not bound:
        return None
    by_frame = operator.itemgetter(0)
    return (max(before, key=by_frame) if before else min(bound, key=by_frame))[1]


def depsgraph_of(scene: bpy.types.Scene, as_evaluated: bool = False) -> bpy.types.Depsgraph:
    """The scene's dependency graph, of the current view layer, or the first one of another scene.

    as_evaluated : true for the graph as Blender has evaluated it last, if it ever has, or else it is brought up to date.
    """
    is_current = bpy.context.scene == scene
    layer = bpy.context.view_layer if is_current else scene.view_layers[0]
    if as_evaluated and layer.depsgraph:
        return layer.depsgraph
    if is_current:
        return bpy.context.evaluated_depsgraph_get()
    layer.update()
    return layer.depsgraph


def scene_of(camera_object: bpy.types.Object) -> bpy.types.Scene:
    """The current scene if the object is in it, else the first one that it is in."""
    scenes = camera_object.users_scene
    return bpy.context.scene if bpy.context.scene in scenes or not scenes else scenes[0]


def camera_in(context: bpy.types.Context) -> bpy.types.Object | None:
    """The camera that is meant: that of the shown (perhaps pinned) camera data, else the active one, else the scene's."""
    active = context.active_object
    data = getattr(context, "camera", None)
    if data:
        if active and active.data == data:
            return active
        return next((item for item in context.scene.objects if item.data == data), None)
    return active if active and active.type == "CAMERA" else context.scene.camera


def beyond_pinhole(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> list[str]:
    """One sentence for each feature in use that makes the render something else than a pinhole's picture."""
    sentences = []
    if camera_object.data.dof.use_dof:
        sentences.append("Depth of field is on, and a pinhole has none: the picture is blurred off the plane of focus")
    if scene.render.use_multiview:
        sentences.append("Stereoscopy is on: each eye has another camera")
    if scene.render.use_motion_blur:
        sentences.append("Motion blur is on: the picture of whatever moves is a mean over the shutter's time")
    return sentences


def sentence(error: InputError) -> str:
    """An error's message with a capital, plain, as it stands alone in a panel or a report, which Blender prints as well."""
    message = plain(str(error))
    return message[:1].upper() + message[1:]
