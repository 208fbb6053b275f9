"""Who in a .blend may keep a camera from being what its four values say. Reads Blender, changes nothing."""

from collections.abc import Callable, Iterator

import bpy

from . import datablocks, pose, storage, versions
from .findings import APPLY_AGAIN, CENTRE, DELETE_KEYFRAMES, DISTANCE, EYE, LENS, POSE, REMEDY, VIEW, Cause


def causes(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> Iterator[Cause]:
    yield from _constraints(camera_object)
    yield from _drivers(camera_object)
    yield from _animation(camera_object)
    yield from _ancestors(camera_object)
    yield from _libraries(camera_object)
    yield from _locks(camera_object)
    yield from _sensor(camera_object.data)
    yield from _render_size(camera_object, scene)
    yield from _sharers(camera_object)


def held(camera_object: bpy.types.Object) -> set[str]:
    """What of EYE, VIEW, DISTANCE and CENTRE is decided by a constraint, a driver or a library, whatever the artist does.

    And by keyframes, where the four values have some as well.
    """
    holding = [*_libraries(camera_object), *_drivers(camera_object)]
    if not pose.is_carried_by_constraints(camera_object):
        holding += _constraints(camera_object)
    if datablocks.is_animated(camera_object):
        holding += _animation(camera_object)
    return set().union(*(cause.acts_on for cause in holding))


# Constraints that leave the eye or the view alone; all others act on both.
_MOVING = ("COPY_LOCATION", "LIMIT_LOCATION", "LIMIT_DISTANCE", "FLOOR")
_TURNING = ("TRACK_TO", "DAMPED_TRACK", "LOCKED_TRACK", "COPY_ROTATION", "LIMIT_ROTATION", "COPY_SCALE", "LIMIT_SCALE")
_CONSTRAINTS = dict.fromkeys(_MOVING, frozenset({EYE})) | dict.fromkeys(_TURNING, frozenset({VIEW}))


def _constraints(camera_object: bpy.types.Object) -> Iterator[Cause]:
    is_carried = pose.is_carried_by_constraints(camera_object)
    for constraint in pose.active_constraints(camera_object):
        name, camera = repr(constraint.name), repr(camera_object.name)
        if is_carried:  # what is set now takes it into account
            yield Cause(f"The constraint {name} has carried {camera} along", POSE, f"{APPLY_AGAIN}, or animate them")
        else:
            acts_on = _CONSTRAINTS.get(constraint.type, POSE)
            yield Cause(f"The constraint {name} moves {camera}", acts_on, "disable it, or the Virtual Pinhole")


# A channel by the start of its data path: what it acts on, and its name as a sentence says it.
_CHANNELS = {
    "location": (EYE, "location"),
    "delta_location": (EYE, "delta location"),
    "rotation_": (VIEW, "rotation"),
    "delta_rotation_": (VIEW, "delta rotation"),
    "scale": (VIEW, "scale"),
    "delta_scale": (VIEW, "delta scale"),
    "lens": (DISTANCE, "focal length"),
    "sensor_": (DISTANCE, "sensor"),
    "shift_": (CENTRE, "shift"),
}


def _channel(data_path: str) -> tuple[str | None, str]:
    return next((channel for start, channel in _CHANNELS.items() if data_path.startswith(start)), (None, ""))


def _paths(curves: list[bpy.types.FCurve]) -> list[str]:
    """What the curves that are not muted set."""
    return sorted({curve.data_path for curve in curves if not versions.is_muted(curve)})


def _drivers(camera_object: bpy.types.Object) -> Iterator[Cause]:
    for block in (camera_object, camera_object.data):
        for path in _paths(versions.drivers(block)):
            quantity, words = _channel(path)
            if quantity:
                clause = f"A driver sets the {words} of {block.name!r}"
                yield Cause(clause, frozenset({quantity}), "remove it, or disable the Virtual Pinhole")


def keyed(
    camera_object: bpy.types.Object, curves: Callable[[bpy.types.ID], list[bpy.types.FCurve]]
) -> list[tuple[bpy.types.ID, str]]:
    """Which of the camera's own channels keyframes set: (object or data, data path). curves : of a datablock."""
    blocks = camera_object, camera_object.data
    return [(block, path) for block in blocks for path in _paths(curves(block)) if _channel(path)[0] not in (None, CENTRE)]


def _animation(camera_object: bpy.types.Object) -> Iterator[Cause]:
    if found := keyed(camera_object, versions.animation_curves):
        channels = [_channel(path) for _, path in found]
        words = list(dict.fromkeys(words for _, words in channels))
        which = f"{', '.join(words[:-1])} and {words[-1]}" if len(words) > 1 else words[0]
        clause = f"Keyframes set the {which} of {camera_object.name!r}, and in a render they win over the four values"
        yield Cause(clause, frozenset(quantity for quantity, _ in channels), DELETE_KEYFRAMES, always=True)


def _ancestors(camera_object: bpy.types.Object) -> Iterator[Cause]:
    """Who carries the camera away. Where the four values are animated they are set anew at every frame, and nobody can."""
    if datablocks.is_animated(camera_object):
        return
    remedy = "animate the four values instead, or disable the Virtual Pinhole"
    for ancestor in pose.ancestors(camera_object):
        if _is_moved_by_animation(ancestor):
            clause = f"{ancestor.name!r} is animated and carries {camera_object.name!r} along"
            yield Cause(clause, POSE, remedy, always=True)
        elif any(pose.active_constraints(ancestor)):
            clause = f"{ancestor.name!r} is moved by its constraints and carries {camera_object.name!r} along"
            yield Cause(clause, POSE, remedy)


def _is_moved_by_animation(block: bpy.types.Object) -> bool:
    """Its own channels, the bones of an armature, or the time on a path."""
    blocks = filter(None, (block, block.data))
    paths = [path for each in blocks for path in _paths([*versions.animation_curves(each), *versions.drivers(each)])]
    return any(_channel(path)[0] in POSE or path.startswith("pose.bones") or path == "eval_time" for path in paths)


def _libraries(camera_object: bpy.types.Object) -> Iterator[Cause]:
    blocks = ((camera_object, "Camera", POSE), (camera_object.data, "The camera data", LENS))
    for block, kind, acts_on in blocks:
        if block.library:
            clause = f"{kind} {block.name!r} is linked from {block.library.name!r}, and what is set here is not saved"
            yield Cause(clause, acts_on, "make a library override of it", always=True)


def _locks(camera_object: bpy.types.Object) -> Iterator[Cause]:
    locked = {"location": any(camera_object.lock_location), "rotation": any(camera_object.lock_rotation)}
    names = [name for name, is_locked in locked.items() if is_locked]
    if names:
        channels = " and ".join(names)
        clause = f"{camera_object.name!r} is locked in its {channels}, and the Virtual Pinhole moves it all the same"
        yield Cause(clause, frozenset(), "unlock it, or disable the Virtual Pinhole", always=True)


def _sensor(camera: bpy.types.Camera) -> Iterator[Cause]:
    width, _ = datablocks.own_sensor(camera)
    if width != camera.sensor_width:
        growth = camera.sensor_width / width
        clause = (
            f"The lens would be {camera.lens / growth:.3g} mm, which Blender clamps to 1 mm, "
            f"so it and the sensor are {growth:g} times as large"
        )
        yield Cause(clause, frozenset(), "the picture is the same, nothing needs to be done", always=True)


def _render_size(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> Iterator[Cause]:
    frame = storage.load(camera_object).set_for
    if frame is None or frame.size == datablocks.frame_of(scene).size:
        return
    before, now = frame.size, datablocks.frame_of(scene).size
    if others := storage.scenes_it_is_set_for(camera_object, scene):
        clause = (
            f"The camera is set for the {before[0]} × {before[1]} px of scene {others[0].name!r}, "
            f"and scene {scene.name!r} renders {now[0]} × {now[1]}"
        )
        yield Cause(clause, LENS, "give both scenes the same resolution, or each a camera of its own")
    else:
        clause = f"The picture was {before[0]} × {before[1]} px and is {now[0]} × {now[1]} now"
        yield Cause(clause, LENS, REMEDY)


def _sharers(camera_object: bpy.types.Object) -> Iterator[Cause]:
    camera = camera_object.data
    if camera.users < 2:
        return
    others = [other.name for other in bpy.data.objects if other.data == camera and other.name != camera_object.name]
    if others:
        clause = f"The camera data {camera.name!r} is shared with {', '.join(map(repr, sorted(others)))}"
        yield Cause(clause, LENS, "make the data single-user, or give both the same distance")
