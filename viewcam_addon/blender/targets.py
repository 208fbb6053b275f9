"""Eye and look-at as objects: the point is where its target stands, as long as one is set.

That is the place of the target's evaluated origin, of an armature's bone that is named its head, of a mesh's vertex group the
mean of its vertices by weight, deformed as they are: what a constraint of Blender takes for its target. Through parents,
constraints, drivers, modifiers and animation, at sub-frames, and in a render as the render has it. In Blender's float32, as all
that is evaluated.

**Being told.** Blender evaluates an object that is hidden, excluded, kept out of the render or in another scene only where
something visible depends on it, and a pointer in a property is no dependency: such a target would stand still, in the render
alone even. So each target also feeds a driver, of an element of the hidden property `followed`, whose value says nothing. By
it Blender keeps the target up to date, and tells animation.py of the camera whenever the target has moved. Rejected: drivers
of eye and look-at themselves (0 where the target is deleted), a constraint without influence (it stands among the artist's
own, and makes a loop of a target that hangs on the camera), looking at all cameras of the scene at every update. The one thing
of a mesh's shape on which a driver depends is its object's dimensions, so those feed `followed` where a vertex group counts.

Weights are no array to a script: those of a mesh of 100,000 vertices take 50 ms. So a group's place is kept until Blender has
evaluated some mesh anew (`forget_shapes`).

**Loops.** A target that the camera itself moves is not followed: the stored point counts, and `warnings` says how one hangs on
the other. A target that is such a camera stands at its own eye, so that two cameras may look at each other.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import bmesh
import bpy
import numpy as np
from mathutils import Vector

from ..camera_values import CameraValues
from ..pinhole import Triple
from . import datablocks, pose, storage, versions

POINTS = {"eye": "eye", "look_at": "look-at"}  # property → as a sentence says it
_HOOK = "virtual_pinhole.followed"
_SHAPE = "dimensions[0]"  # evaluated when the shape is

# (an evaluated target's pointer, vertex group) → its place in that object's space.
_shapes: dict[tuple[int, str], Vector | None] = {}


def values(camera_object: bpy.types.Object) -> CameraValues:
    """The values of a camera, with a followed point where its target is. The evaluated object may be given as well."""
    return followed(camera_object, storage.load(camera_object))


def followed(camera_object: bpy.types.Object, stored: CameraValues, as_evaluated: bool = False) -> CameraValues:
    """Stored values of a camera with a followed point where its target is. as_evaluated : see `place`."""
    places = {point: place(camera_object, point, as_evaluated) for point in stored.follows}
    more: dict[str, Any] = {point: at for point, at in places.items() if at}
    return replace(stored, **more)


def target_of(camera_object: bpy.types.Object, point: str) -> bpy.types.Object | None:
    """The object that a point ("eye" or "look_at") is set to follow."""
    return getattr(camera_object.virtual_pinhole, f"{point}_target")


def place(camera_object: bpy.types.Object, point: str, as_evaluated: bool = False) -> Triple | None:
    """World space: where the target of a point stands, or None where there is none to be followed.

    camera_object : an original, or the evaluated one of any depsgraph, which has evaluated targets.
    as_evaluated : true for where it stood when it was evaluated last, which is all that may be asked while Blender evaluates.
    """
    target = target_of(camera_object, point)
    if target is None or _loop(camera_object.original, point):
        return None
    if _is_led(target):
        return place(target, "eye", as_evaluated) or storage.load(target).eye
    if not target.is_evaluated:
        target = target.evaluated_get(datablocks.depsgraph_of(datablocks.scene_of(camera_object), as_evaluated))
    bone, group = bone_of(camera_object, point, target), group_of(camera_object, point, target)
    local = bone.head if bone else _middle(target, group) if group else None
    return tuple(target.matrix_world.translation if local is None else target.matrix_world @ local)


def bone_of(camera_object: bpy.types.Object, point: str, target: bpy.types.Object) -> bpy.types.PoseBone | None:
    """The bone of a point's target, evaluated or not, that is followed; None where it is no armature or has none so named."""
    name = getattr(camera_object.virtual_pinhole, f"{point}_bone")
    return target.pose.bones.get(name) if name and target.type == "ARMATURE" and target.pose else None


def group_of(camera_object: bpy.types.Object, point: str, target: bpy.types.Object) -> bpy.types.VertexGroup | None:
    """The vertex group of a point's target that is followed; None where it is no mesh or has none so named."""
    name = getattr(camera_object.virtual_pinhole, f"{point}_group")
    return target.vertex_groups.get(name) if name and target.type == "MESH" else None


def forget_shapes(depsgraph: bpy.types.Depsgraph | None = None) -> None:
    """Look at vertex groups anew. depsgraph : only where it has just evaluated a mesh object, as a render's always has."""
    if _shapes and (depsgraph is None or depsgraph.mode == "RENDER" or any(map(_is_deformed, depsgraph.updates))):
        _shapes.clear()


def _is_deformed(update: bpy.types.DepsgraphUpdate) -> bool:
    return update.is_updated_geometry and isinstance(update.id, bpy.types.Object) and update.id.type == "MESH"


def _middle(target: bpy.types.Object, group: bpy.types.VertexGroup) -> Vector | None:
    """In the evaluated target's own space: the mean of a group's vertices by weight, or None where nothing weighs anything.

    In Edit Mode of the vertices as they are edited, without modifiers, as Blender's constraints have it.
    """
    key, index = (target.as_pointer(), group.name), group.index
    if key not in _shapes:
        if target.original.data.is_editmode:
            vertices = bmesh.from_edit_mesh(target.original.data).verts
            layer = vertices.layers.deform.active
            weighed = [(*each.co, each[layer].get(index, 0.0)) for each in vertices] if layer else []
        else:
            weighed = [(*v.co, each.weight) for v in target.data.vertices for each in v.groups if each.group == index]
        *places, weights = np.array(weighed, dtype=np.float64).reshape(-1, 4).T
        total = weights.sum()
        _shapes[key] = Vector([place @ weights / total for place in places]) if total else None
    return _shapes[key]


def mirror(camera_object: bpy.types.Object, evaluated: bpy.types.Object) -> None:
    """Store where the targets stand, so that the camera stays in place when they are cleared."""
    group = camera_object.virtual_pinhole
    with storage.without_callbacks():
        for point in POINTS:
            at = place(evaluated, point)
            if at is not None and at != tuple(getattr(group, point)):
                setattr(group, point, at)


def connect(camera_object: bpy.types.Object) -> None:
    """Make the drivers of `followed` those of the targets that are set."""
    for index, point in enumerate(POINTS):
        target = target_of(camera_object, point)
        drivers = (each for each in versions.drivers(camera_object) if each.data_path == _HOOK)
        curve = next((each for each in drivers if each.array_index == index), None)
        if target is None:
            if curve:
                camera_object.driver_remove(_HOOK, index)
            continue
        bone = bone_of(camera_object, point, target)
        paths: tuple[str, ...] = ()
        if target.type == "CAMERA":  # where it will be, its eye and its eye's target tell earlier than its transform
            paths = "virtual_pinhole.eye[0]", f"{_HOOK}[0]"
        elif group_of(camera_object, point, target):
            paths = (_SHAPE,)
        followed = [(target, bone.name if bone else "", ""), *((target, "", path) for path in paths)]
        aims = [variable.targets[0] for variable in curve.driver.variables] if curve else []
        if curve and followed != [(aim.id, aim.bone_target, aim.data_path) for aim in aims]:
            camera_object.driver_remove(_HOOK, index)
            curve = None
        if curve is None:
            _depend(camera_object.driver_add(_HOOK, index).driver, *followed)


def _depend(driver: bpy.types.Driver, *followed: tuple[bpy.types.Object, str, str]) -> None:
    """Make a driver depend on what its camera follows.

    followed : (object, bone, data path) each; without a path its transform.
    """
    driver.type = "SUM"
    for target, bone, path in followed:
        variable = driver.variables.new()
        if not path:
            variable.type = "TRANSFORMS"
        aim = variable.targets[0]
        aim.id, aim.bone_target, aim.data_path = target, bone, path


def bound(camera_object: bpy.types.Object) -> set[tuple[str, int]]:
    """(name, index) of the values' numbers that a target or a driver decides. An evaluated camera, or the original."""
    result = {
        (point, i) for point in POINTS for i in range(3) if target_of(camera_object, point) and place(camera_object, point)
    }
    for curve in versions.drivers(camera_object):
        owner, _, name = curve.data_path.partition(".")
        if owner == "virtual_pinhole" and curve.data_path != _HOOK and not versions.is_muted(curve):
            look = datablocks.LOOKS.get(name)
            result |= {(look, i) for i in range(3)} if look else {(name, curve.array_index)}
    return result


def names(camera_object: bpy.types.Object) -> dict[str, str]:
    """The targets' names by the words for the point: {"look-at": "Empty"}."""
    targets = ((words, target_of(camera_object, point)) for point, words in POINTS.items())
    return {words: target.name for words, target in targets if target}


def release(camera_object: bpy.types.Object, point: str) -> None:
    """Clear a target; the point stays as it is stored, and the camera where it is."""
    if target_of(camera_object, point):  # set to None again, Blender would build the relations of all objects anew
        with storage.without_callbacks():
            setattr(camera_object.virtual_pinhole, f"{point}_target", None)
            setattr(camera_object.virtual_pinhole, f"{point}_bone", "")
            setattr(camera_object.virtual_pinhole, f"{point}_group", "")
    connect(camera_object)


def warnings(camera_object: bpy.types.Object) -> list[str]:
    """One sentence for each target that can't be followed as one would expect."""
    sentences = []
    for point, words in POINTS.items():
        target = target_of(camera_object, point)
        if target is None:
            continue
        start = f"The {words} target {target.name!r}"
        if chain := _loop(camera_object, point):
            through = "".join(f" by {each.name!r}," for each in chain[1:-1])
            fault = "is the camera itself" if len(chain) == 1 else f"is moved{through} by the camera itself"
            sentences.append(f"{start} {fault}, and is not followed: choose another, or clear it")
        elif missing := _missing(camera_object, point, target):
            sentences.append(f"{start} has no {missing}, and its origin is followed: choose another, or clear it")
        elif not target.users_scene and not target.library:  # a linked one may well be in its own file's scene alone
            sentences.append(f"{start} is in no scene, deleted perhaps: clear it, or choose another")
        elif late := None if _is_led(target) else next(filter(_is_led, _carriers(target, set())), None):
            sentences.append(
                f"{start} is moved by {late.name!r}, whose own values are animated, and is followed a step late: "
                f"make {late.name!r} the target, or let it not be moved by that camera"
            )
    return sentences


def _missing(camera_object: bpy.types.Object, point: str, target: bpy.types.Object) -> str | None:
    """The bone or the vertex group that is named and not there."""
    values = camera_object.virtual_pinhole
    bone, group = (getattr(values, f"{point}_{part}") for part in ("bone", "group"))
    if target.type == "ARMATURE" and bone and not bone_of(camera_object, point, target):
        return f"bone {bone!r}"
    if target.type == "MESH" and group:
        evaluated = target.evaluated_get(datablocks.depsgraph_of(datablocks.scene_of(camera_object)))
        present = group_of(camera_object, point, evaluated)
        if present is None or _middle(evaluated, present) is None:
            return f"vertex in a group {group!r}"
    return None


def can_be_target(camera_object: bpy.types.Object, candidate: bpy.types.Object) -> bool:
    """True if an object may be chosen: the camera does not move it."""
    return not _chain(candidate, camera_object)


def _is_led(block: bpy.types.Object) -> bool:
    """True if it is a camera that its values place anew, so that Blender's dependency graph does not know where it will be."""
    return block.type == "CAMERA" and storage.is_enabled(block) and datablocks.is_animated(block)


def _loop(camera_object: bpy.types.Object, point: str) -> list[bpy.types.Object]:
    """`_chain` of a point's target, whose shape counts where a vertex group is followed. The original camera."""
    target = target_of(camera_object, point)
    return _chain(target, camera_object, bool(group_of(camera_object, point, target)))


def _chain(target: bpy.types.Object, camera_object: bpy.types.Object, is_shape: bool = False) -> list[bpy.types.Object]:
    """Objects from the target to the camera, each moved, or the first deformed, by the next; empty without the camera in it.

    Originals.
    """
    if target == camera_object:
        return [target]
    seen = {target}
    waiting = [[target, each] for each in (*_movers(target, is_place=True), *(_shapers(target) if is_shape else ()))]
    while waiting:
        path = waiting.pop()
        if path[-1] == camera_object:
            return path
        if path[-1] not in seen:
            seen.add(path[-1])
            waiting += [[*path, each] for each in _movers(path[-1])]
    return []


def _carriers(target: bpy.types.Object, seen: set[bpy.types.Object]) -> Iterator[bpy.types.Object]:
    """All that moves a target, near ones first."""
    waiting = [target]
    for block in waiting:
        new = [each for each in _movers(block) if each not in seen]
        seen.update(new)
        waiting += new
        yield from new


def _movers(block: bpy.types.Object, is_place: bool = False) -> Iterator[bpy.types.Object]:
    """The objects that an object's pose depends on directly. is_place : its place alone counts, not where it looks."""
    if _is_led(block):
        points = ("eye",) if is_place else POINTS
        yield from filter(None, (target_of(block, point) for point in points))
    else:
        if block.parent:
            yield block.parent
        yield from _aims(block.constraints)
        if block.type == "ARMATURE" and block.pose:
            for bone in block.pose.bones:
                yield from _aims(bone.constraints)
    for curve in versions.drivers(block):
        if curve.data_path != _HOOK:
            yield from (each for each in _ids(curve) if each != block)


def _shapers(block: bpy.types.Object) -> Iterator[bpy.types.Object]:
    """The objects that a mesh's shape depends on directly: the objects of its modifiers, and of the drivers of its shape
    keys."""
    for modifier in block.modifiers:
        settings = [getattr(modifier, each.identifier) for each in modifier.bl_rna.properties]
        if modifier.type == "NODES" and modifier.node_group:
            items = modifier.node_group.interface.items_tree
            settings += (versions.modifier_input(modifier, each.identifier) for each in items if each.item_type == "SOCKET")
        yield from (each for each in settings if isinstance(each, bpy.types.Object))
    keys = block.data.shape_keys
    for curve in versions.drivers(keys) if keys else ():
        yield from _ids(curve)


def _ids(driver: bpy.types.FCurve) -> list[bpy.types.Object]:
    """The objects that a driver looks at."""
    ids = (each.id for variable in driver.driver.variables for each in variable.targets)
    return [each for each in ids if isinstance(each, bpy.types.Object)]


def _aims(constraints: bpy.types.bpy_prop_collection) -> Iterator[bpy.types.Object]:
    for constraint in constraints:
        yield from pose.targets_of(constraint)
