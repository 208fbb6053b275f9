"""The camera object's pose: where it stands among its parent and delta transforms, and which channels bring it elsewhere.

Everything is float64 from Blender's float32 matrices on, each (4, 4) or (3, 3), for column vectors.

**Rotations in float32.** Of the two Euler triples `rotation.euler` takes the one whose sum is at most 3π/2: two of its angles
may lie above 2 and be rounded by 2⁻²³ each, and the third, below 1 then, by 2⁻²⁵. Rounding the matrix turns it by √3 · 2⁻²⁵ at
most. That is 3.2e-7 rad. Quaternions, and axis and angle, are worse: Blender normalises them in float32, which costs as much as
storing them, and up to 5.3e-7 rad were found. So `set_rotation` tries the neighbouring float32 numbers and asks Blender which
make the right matrix: 1.9e-7 rad at most in every mode. Rejected: Blender's float32 arithmetic done here once more (its
rounding differs from one processor to another).
"""

from collections.abc import Iterable, Iterator, Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from .. import rotation
from ..errors import InputError
from ..pinhole import Pinhole

Array = NDArray[np.float64]

# A chain of parents multiplies rotations in float32, each product within 4 roundings of 2⁻²⁴: 32 of them stay below. More is
# shear.
LARGEST_SKEW = 32 * 4 * 2.0**-24

_NO_PARENT = np.eye(4)


def float64(numbers: Iterable) -> Array:
    """The numbers of a Blender matrix or vector. From 5.0 on NumPy takes these for float32, and would compute in it."""
    return np.array(numbers, dtype=np.float64)


def channels(
    camera_object: bpy.types.Object, pinhole: Pinhole, depsgraph: bpy.types.Depsgraph
) -> tuple[tuple[float, ...], Array, tuple[float, ...]]:
    """Location, (3, 3) rotation and scale that bring the camera to the pose, relative to its parent and its delta transform."""
    parent = parent_matrix(camera_object, depsgraph)
    is_free = np.array_equal(parent, _NO_PARENT)  # as most cameras are, which need no linear algebra
    if not is_free and not _has_inverse(parent):
        raise no_size(camera_object)
    u, v, w = pinhole.basis()
    wanted = np.column_stack([-u if pinhole.mirrored else u, v, w])
    scale, signs = float64(camera_object.scale), _signs(camera_object)
    local = wanted if is_free else np.linalg.solve(parent[:3, :3], wanted)
    if (pinhole.mirrored if is_free else np.linalg.det(local) < 0) != (signs.prod() < 0):
        scale[0], signs[0] = -scale[0], -signs[0]
    turn = local * signs if is_free else rotation.nearest(local / np.linalg.norm(local, axis=0) * signs)
    eye = np.array(pinhole.eye)
    location = eye if is_free else np.linalg.solve(parent[:3, :3], eye - parent[:3, 3])
    location = location - float64(camera_object.delta_location)
    return tuple(location.tolist()), _delta_rotation(camera_object).T @ turn, tuple(scale.tolist())


def state(camera_object: bpy.types.Object) -> tuple:
    """All that says where the camera stands relative to what carries it."""
    block = camera_object
    triples = (block.location, block.scale, block.delta_location, block.delta_scale, block.delta_rotation_euler)
    turns = (block.rotation_euler, block.rotation_quaternion, block.rotation_axis_angle, block.delta_rotation_quaternion)
    return block.rotation_mode, *map(tuple, triples), *map(tuple, turns)


def rotation_channel(camera_object: bpy.types.Object) -> str:
    """The property that rotates the object in the mode it has."""
    names = {"QUATERNION": "rotation_quaternion", "AXIS_ANGLE": "rotation_axis_angle"}
    return names.get(camera_object.rotation_mode, "rotation_euler")


def set_rotation(camera_object: bpy.types.Object, turn: Array, before: Sequence[float] | None = None) -> None:
    """Rotate the camera, in its own mode, by the (3, 3) rotation that `channels` gives; its scale is set already.

    before : the numbers of the frame before, to be as near to as the rotation allows.
    """
    name = rotation_channel(camera_object)
    wanted = _delta_rotation(camera_object) @ turn * _signs(camera_object)
    numbers = rotation.numbers(turn, camera_object.rotation_mode, before)
    candidates = rotation.neighbours(numbers)
    made = []
    for candidate in candidates:
        setattr(camera_object, name, candidate)
        made.append(float64(camera_object.matrix_basis)[:3, :3])
    sizes = np.linalg.norm(made, axis=1, keepdims=True)
    with np.errstate(invalid="ignore"):  # a scale beyond all numbers
        errors = np.abs(made / np.where(sizes, sizes, 1.0) - wanted).max(axis=(1, 2))
    setattr(camera_object, name, candidates[np.argmin(errors)])


def _signs(camera_object: bpy.types.Object) -> Array:
    """(3,): −1 for each axis that the camera's own scale turns round."""
    return np.where(_full_scale(camera_object) < 0, -1.0, 1.0)


def _full_scale(block: bpy.types.Object) -> Array:
    """(3,): an object's own scale, delta included."""
    return float64(block.scale) * float64(block.delta_scale)


def _delta_rotation(camera_object: bpy.types.Object) -> Array:
    """The (3, 3) rotation that Blender applies after the object's own; for the mode AXIS_ANGLE Blender shows none."""
    mode = camera_object.rotation_mode
    if mode == "AXIS_ANGLE":
        return np.eye(3)
    numbers = camera_object.delta_rotation_quaternion if mode == "QUATERNION" else camera_object.delta_rotation_euler
    if not np.isfinite(numbers).all():
        raise no_size(camera_object)
    return rotation.from_quaternion(numbers) if mode == "QUATERNION" else rotation.from_euler(numbers, mode)


def parent_matrix(camera_object: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Array:
    """(4, 4) float64: the matrix that takes the camera's own location, rotation and scale to world space.

    It is that of the parent and of the constraints, as long as all of these carry the camera as a parent does.

    Raises
    ------
    InputError
        if it can't be told, since the camera is scaled to zero.
    """
    parent = camera_object.parent
    inverse = float64(camera_object.matrix_parent_inverse)
    if not is_told_by_its_pose(camera_object):
        return float64(parent.evaluated_get(depsgraph).matrix_world) @ inverse if parent else _NO_PARENT
    evaluated = camera_object.evaluated_get(depsgraph)
    if is_carried_by_constraints(camera_object):
        own = float64(evaluated.matrix_basis)
    elif not _has_inverse(inverse):
        raise no_size(camera_object)
    else:  # Blender's local matrix is relative to the bone, the vertices or the place on the path
        own = np.linalg.inv(inverse) @ float64(evaluated.matrix_local)
    if not _has_inverse(own):
        raise no_size(camera_object)
    return float64(evaluated.matrix_world) @ np.linalg.inv(own)


def is_told_by_its_pose(camera_object: bpy.types.Object) -> bool:
    """Whether only Blender knows the matrix that carries the camera, so that it is told from how the camera stands.

    It is told with the rounding of this pose: best from one close to that which is wanted.
    """
    parent = camera_object.parent
    is_plain = parent is None or (camera_object.parent_type == "OBJECT" and parent.type != "CURVE")
    return not is_plain or is_carried_by_constraints(camera_object)


def _has_inverse(matrix: Array) -> bool:
    return bool(np.isfinite(matrix).all() and np.linalg.det(matrix) != 0)


def mirrors(matrix: Iterable) -> bool:
    """Whether a (4, 4) matrix of Blender's mirrors; one that is not finite does nothing."""
    matrix = float64(matrix)
    return bool(np.isfinite(matrix).all() and np.linalg.det(matrix[:3, :3]) < 0)


def active_constraints(block: bpy.types.Object) -> Iterator[bpy.types.Constraint]:
    """The constraints that are neither muted nor without influence."""
    return (constraint for constraint in block.constraints if constraint.enabled and constraint.influence > 0)


def is_carried_by_constraints(camera_object: bpy.types.Object) -> bool:
    """Whether it has constraints, and each of them moves it as a parent does."""
    constraints = list(active_constraints(camera_object))
    return bool(constraints) and all(map(_carries, constraints))


def _carries(constraint: bpy.types.Constraint) -> bool:
    """Whether a constraint moves an object as a parent does: it multiplies its matrix by one that does not depend on it."""
    if constraint.type == "COPY_LOCATION":
        return constraint.use_offset and constraint.owner_space == "WORLD"
    if constraint.influence < 1:
        return False
    if constraint.type == "ARMATURE":
        return not constraint.use_current_location
    if constraint.type == "FOLLOW_PATH" and constraint.target:
        # The path's scale acts on the location alone.
        sizes = np.linalg.norm(float64(constraint.target.matrix_world)[:3, :3], axis=0)
        return bool(np.abs(sizes - 1).max() <= LARGEST_SKEW)
    return constraint.type == "CHILD_OF"


def no_size(camera_object: bpy.types.Object) -> InputError:
    """The error of a camera whose matrix is singular or not finite, naming whose transform it is."""
    for block in (camera_object, *ancestors(camera_object)):
        if not np.isfinite(float64([block.matrix_basis, block.matrix_parent_inverse])).all():
            return InputError(
                f"the transform of {block.name!r} holds a number that is not finite: clear it, with its deltas and parent"
            )
        if not all(_full_scale(block)):
            who = "" if block == camera_object else f" by {block.name!r} above it"
            return InputError(f"camera {camera_object.name!r} is scaled to zero{who}: give {block.name!r} a scale of 1")
    return InputError(f"camera {camera_object.name!r} is scaled to zero, or beyond all numbers: set its scale to 1")


def who_shears(camera_object: bpy.types.Object) -> str:
    """Why the camera's axes are not perpendicular, and what to do about it: the end of a sentence."""
    for child in (camera_object, *ancestors(camera_object)):
        parent = child.parent
        if parent and parent.type == "ARMATURE" and child.parent_type == "BONE":
            bone = parent.pose.bones.get(child.parent_bone)
            if bone and not _is_uniform(bone.scale):
                return f"the bone {bone.name!r} above it is scaled non-uniformly: give the bone a uniform scale"
        if parent and not _is_uniform(_full_scale(parent)):
            relation = "parent" if child == camera_object else "ancestor"
            return f"its {relation} {parent.name!r} is scaled non-uniformly: apply the scale of {parent.name!r}"
    for constraint in active_constraints(camera_object):
        return f"its constraint {constraint.name!r} shears it: disable it, or give its target a uniform scale"
    return "its parent inverse or a constraint above it shears it: clear the parent inverse, or the parent"


def _is_uniform(scale: Array) -> bool:
    sizes = np.abs(scale)
    return bool(sizes.max() <= sizes.min() * (1 + LARGEST_SKEW))


def ancestors(block: bpy.types.Object) -> Iterator[bpy.types.Object]:
    """Its parent, the parent's parent, and so on."""
    while block := block.parent:
        yield block


def reach(camera_object: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> float:
    """The lengths that go into the camera's location, summed: its own, the parent's, and that of the parent's inverse."""
    matrix = parent_matrix(camera_object, depsgraph)
    own = np.linalg.norm(matrix[:3, :3], 2) * (camera_object.location + camera_object.delta_location).length
    own += np.linalg.norm(matrix[:3, 3])
    parent = camera_object.parent
    if parent is None:
        return own
    world = float64(parent.evaluated_get(depsgraph).matrix_world)
    inverse = float64(camera_object.matrix_parent_inverse)
    return own + np.linalg.norm(world[:3, :3], 2) * np.linalg.norm(inverse[:3, 3]) + np.linalg.norm(world[:3, 3])
