"""The things in a .blend that may keep a camera from being what its four values say. Reads Blender, changes nothing."""

from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import replace

import bpy

from ..camera_values import DECIDES
from ..errors import listed
from . import datablocks, pose, storage, versions
from .findings import APPLY_OR_ADOPT, CENTER, DISTANCE, EYE, LENS, POSE, VIEW, Button, Cause


def causes(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> Iterator[Cause]:
    yield from _constraints(camera_object)
    yield from _drivers(camera_object)
    yield from _animation(camera_object)
    yield from _libraries(camera_object)
    yield from _locks(camera_object)
    yield from _sensor(camera_object.data)
    yield from _render_size(camera_object, scene)
    yield from _sharers(camera_object)


def decided_by(names: Iterable[str]) -> frozenset[str]:
    """The parts of EYE, VIEW and DISTANCE that values, by their names, decide."""
    return frozenset().union(*(DECIDES.get(name, frozenset()) for name in names))


def decided_by_values(camera_object: bpy.types.Object) -> frozenset[str]:
    """The parts of EYE, VIEW and DISTANCE that keyframes, drivers or targets of the four values decide at every frame."""
    return decided_by(datablocks.animated_values(camera_object))


def held(camera_object: bpy.types.Object) -> set[str]:
    """The parts of EYE, VIEW, DISTANCE and CENTER that the values can't follow as the camera is moved.

    A library's, which would not be saved, and what the animation of the values decides and something else as well.
    """
    holding = [*_libraries(camera_object)]
    if decided := decided_by_values(camera_object):
        others = [*_drivers(camera_object), *_animation(camera_object)]
        if not pose.is_carried_by_constraints(camera_object):
            others += _constraints(camera_object)
        holding += [replace(cause, acts_on=cause.acts_on & decided) for cause in others]
    return set().union(*(cause.acts_on for cause in holding))


def followed(camera_object: bpy.types.Object) -> dict[str, str]:
    """The parts of EYE, VIEW and DISTANCE that something else than the artist places at every frame: the name → one word why.

    The values follow it there, and an edit of them would not last.
    """
    placing = [("Parent", POSE)] if any(map(_is_moving, pose.ancestors(camera_object))) else []
    for constraint in pose.active_constraints(camera_object):
        if _places(constraint, camera_object):
            placing.append(("Constraint", _CONSTRAINTS.get(constraint.type, POSE)))
    placing += [("Driver", cause.acts_on) for cause in _drivers(camera_object)]
    decided = decided_by_values(camera_object) | {CENTER}
    return {name: word for word, acts_on in placing for name in acts_on if name not in decided}


# Constraints that leave the eye or the view alone; all others act on both.
_MOVING = ("COPY_LOCATION", "LIMIT_LOCATION", "LIMIT_DISTANCE", "FLOOR")
_TURNING = ("TRACK_TO", "DAMPED_TRACK", "LOCKED_TRACK", "COPY_ROTATION", "LIMIT_ROTATION", "COPY_SCALE", "LIMIT_SCALE")
_CONSTRAINTS = dict.fromkeys(_MOVING, frozenset({EYE})) | dict.fromkeys(_TURNING, frozenset({VIEW}))
# The constraints that leave a camera within their limits to who moves it.
_LIMITING = ("LIMIT_LOCATION", "LIMIT_ROTATION", "LIMIT_SCALE", "LIMIT_DISTANCE", "FLOOR", "COPY_SCALE")


def fed(camera_object: bpy.types.Object) -> frozenset[str]:
    """The parts of EYE and VIEW that a constraint makes of the camera's own channels and adds to: to set them would move it
    on."""
    adding = [
        constraint
        for constraint in pose.active_constraints(camera_object)
        if not pose.carries(constraint)
        and (constraint.type not in (*_CONSTRAINTS, "COPY_TRANSFORMS") or constraint.influence < 1)
    ]
    return frozenset().union(*(_CONSTRAINTS.get(constraint.type, POSE) for constraint in adding))


def may_move(camera_object: bpy.types.Object, parts: Collection[str]) -> bool:
    """True if Blender may move one of these parts of the camera from frame to frame: a quick look, and no verdict."""
    if EYE in parts or VIEW in parts:
        return True
    return DISTANCE in parts and camera_object.data.animation_data is not None


def _places(constraint: bpy.types.Constraint, camera_object: bpy.types.Object) -> bool:
    """True if a constraint decides at every frame where the camera is: one that carries it, only if it moves itself."""
    goals = list(pose.targets_of(constraint))
    if constraint.type in _LIMITING or (hasattr(constraint, "target") and not goals):
        return False
    if not pose.carries(constraint):
        return True
    own = f"{constraint.path_from_id()}."
    curves = [*versions.animation_curves(camera_object), *versions.drivers(camera_object)]
    moving = any(_is_moving(each) for goal in goals for each in (goal, *pose.ancestors(goal)))
    return moving or any(path.startswith(own) for path in _paths(curves))


def _constraints(camera_object: bpy.types.Object) -> Iterator[Cause]:
    is_carried = pose.is_carried_by_constraints(camera_object)
    for constraint in pose.active_constraints(camera_object):
        name, camera = repr(constraint.name), repr(camera_object.name)
        if is_carried:  # values set now take it into account
            remedy = "apply the values again, or animate them"
            yield Cause(f"The constraint {name} has carried {camera} along", POSE, remedy, mended_by=Button.APPLY_AGAIN)
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
    "shift_": (CENTER, "shift"),
}


def _channel(data_path: str) -> tuple[str | None, str]:
    return next((channel for start, channel in _CHANNELS.items() if data_path.startswith(start)), (None, ""))


def _paths(curves: list[bpy.types.FCurve]) -> list[str]:
    """The paths of the properties that the curves which are not muted set."""
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
    """The camera's own channels that keyframes set: (object or data, data path).

    curves : a function: datablock → its curves.
    """
    blocks = camera_object, camera_object.data
    return [(block, path) for block in blocks for path in _paths(curves(block)) if _channel(path)[0] not in (None, CENTER)]


def _animation(camera_object: bpy.types.Object) -> Iterator[Cause]:
    """Keyframes of what the four values' own animation decides as well. Others move the values along, as a hand does."""
    decided = decided_by_values(camera_object)
    channels = [_channel(path) for _, path in keyed(camera_object, versions.animation_curves)]
    if channels := [(quantity, words) for quantity, words in channels if quantity in decided]:
        words = list(dict.fromkeys(words for _, words in channels))
        clause = f"Keyframes set the {listed(words)} of {camera_object.name!r}, and in a render they win over the four values"
        acts_on, remedy = frozenset(quantity for quantity, _ in channels), "delete them, and key the four values instead"
        is_deletable = bool(keyed(camera_object, versions.action_curves))
        yield Cause(clause, acts_on, remedy, always=True, mended_by=Button.DELETE_KEYFRAMES if is_deletable else None)


def _is_moving(block: bpy.types.Object) -> bool:
    """True if constraints, keyframes or drivers move an object, the bones of an armature, or what is on a path."""
    bones = block.pose.bones if block.pose else ()
    if any(True for each in (block, *bones) for _ in pose.active_constraints(each)):
        return True
    blocks = filter(None, (block, block.data))
    paths = [path for each in blocks for path in _paths([*versions.animation_curves(each), *versions.drivers(each)])]
    return any(_channel(path)[0] in POSE or path.startswith("pose.bones") or path == "eval_time" for path in paths)


def _libraries(camera_object: bpy.types.Object) -> Iterator[Cause]:
    data = camera_object.data
    blocks = [(camera_object, "Camera", POSE), (data, "The camera data", LENS)]
    if camera_object.library == data.library:  # one sentence is enough
        blocks = [(camera_object, "Camera", POSE | LENS)]
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
        yield Cause(clause, LENS, APPLY_OR_ADOPT, mended_by=Button.APPLY_AGAIN)


def _sharers(camera_object: bpy.types.Object) -> Iterator[Cause]:
    camera = camera_object.data
    if camera.users < 2:
        return
    others = [other.name for other in bpy.data.objects if other.data == camera and other.name != camera_object.name]
    if others:
        clause = f"The camera data {camera.name!r} is shared with {', '.join(map(repr, sorted(others)))}"
        yield Cause(clause, LENS, "make the data single-user, or give both the same distance")
