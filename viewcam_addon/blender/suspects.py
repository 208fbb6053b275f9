"""Who in a .blend may keep a camera from being what its four values say. Reads Blender, changes nothing."""

from collections.abc import Iterator

import bpy

from . import datablocks, versions
from .findings import CENTRE, DISTANCE, EYE, POSE, REMEDY, VIEW, Suspect


def suspects(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> Iterator[Suspect]:
    yield from _constraints(camera_object)
    for block in (camera_object, camera_object.data):
        yield from _drivers(block)
        yield from _animation(block)
        yield from _libraries(block)
    yield from _locks(camera_object)
    yield from _sensor(camera_object.data)
    yield from _render_size(camera_object, scene)
    yield from _sharers(camera_object)


def _constraints(camera_object: bpy.types.Object) -> Iterator[Suspect]:
    for constraint in camera_object.constraints:
        if constraint.enabled and constraint.influence > 0:
            culprit = f"The constraint {constraint.name!r} moves {camera_object.name!r}"
            yield Suspect(culprit, POSE, "disable it, or the Virtual Pinhole")


# What a channel acts on, by the start of its data path.
_CHANNELS = {
    "location": EYE,
    "delta_location": EYE,
    "rotation_": VIEW,
    "delta_rotation_": VIEW,
    "scale": VIEW,
    "delta_scale": VIEW,
    "lens": DISTANCE,
    "sensor_": DISTANCE,
    "shift_": CENTRE,
}


def _acts_on(data_path: str) -> str | None:
    return next((quantity for start, quantity in _CHANNELS.items() if data_path.startswith(start)), None)


def _drivers(block: bpy.types.ID) -> Iterator[Suspect]:
    for curve in versions.drivers(block):
        if quantity := _acts_on(curve.data_path):
            yield Suspect(
                f"A driver sets {curve.data_path!r} of {block.name!r}",
                frozenset({quantity}),
                "remove it, or the Virtual Pinhole",
            )


def _animation(block: bpy.types.ID) -> Iterator[Suspect]:
    for path in sorted({curve.data_path for curve in versions.animation_curves(block)}):
        quantity = _acts_on(path)
        if quantity and quantity != CENTRE:
            culprit = f"{path!r} of {block.name!r} is animated and will change with the frame"
            yield Suspect(culprit, frozenset({quantity}), "animate the four values instead", always=True)


def _libraries(block: bpy.types.ID) -> Iterator[Suspect]:
    if block.library:
        culprit = f"{block.name!r} is linked from {block.library.name!r}, where nothing that is set here is saved"
        yield Suspect(culprit, frozenset(), "make a library override of it", always=True)


def _locks(camera_object: bpy.types.Object) -> Iterator[Suspect]:
    locked = {"location": any(camera_object.lock_location), "rotation": any(camera_object.lock_rotation)}
    names = [name for name, is_locked in locked.items() if is_locked]
    if names:
        channels = " and ".join(names)
        culprit = f"{camera_object.name!r} is locked in its {channels}, and the Virtual Pinhole moves it all the same"
        yield Suspect(culprit, frozenset(), "unlock it, or disable the Virtual Pinhole", always=True)


def _sensor(camera: bpy.types.Camera) -> Iterator[Suspect]:
    width, _ = datablocks.own_sensor(camera)
    if width != camera.sensor_width:
        growth = camera.sensor_width / width
        culprit = (
            f"The lens would be {camera.lens / growth:.3g} mm, which Blender clamps to 1 mm, "
            f"so it and the sensor are {growth:g} times as large"
        )
        yield Suspect(culprit, frozenset(), "the picture is the same, nothing needs to be done", always=True)


def _render_size(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> Iterator[Suspect]:
    before, now = tuple(camera_object.virtual_pinhole.size), datablocks.frame_of(scene).size
    if all(before) and before != now:
        culprit = f"The picture was {before[0]} × {before[1]} px and is {now[0]} × {now[1]} now"
        yield Suspect(culprit, frozenset({DISTANCE}), REMEDY)


def _sharers(camera_object: bpy.types.Object) -> Iterator[Suspect]:
    camera = camera_object.data
    if camera.users < 2:
        return
    others = sorted(other.name for other in bpy.data.objects if other.data == camera and other != camera_object)
    if others:
        culprit = f"The camera data {camera.name!r} is shared with {', '.join(map(repr, others))}"
        yield Suspect(culprit, frozenset({DISTANCE, CENTRE}), "make the data single-user, or give both the same distance")
