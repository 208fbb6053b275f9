"""The camera object's pose: where it stands among its parent and delta transforms, and which channels bring it elsewhere.

Everything is float64 from Blender's float32 matrices on, each (4, 4) or (3, 3), for column vectors.

**Rotations in float32.** Of the two Euler triples `rotation.euler` takes the one whose sum is at most 3π/2: two of its angles
may lie above 2 and be rounded by 2⁻²³ each, and the third, below 1 then, by 2⁻²⁵. Rounding the matrix turns it by √3 · 2⁻²⁵ at
most. That is 3.2e-7 rad. Quaternions, and axis and angle, are worse: Blender normalizes them in float32, which costs as much as
storing them, and up to 5.3e-7 rad were found. So `set_rotation` asks Blender which matrix the rounded numbers make, and where
it is not right tries the neighboring ones: 1.9e-7 rad at most in every mode. Rejected: to try all always, which took a third
of an edit's time and makes a tenth of difference, and Blender's float32 arithmetic done here once more (its rounding differs
from one processor to another).
"""

import itertools
from collections.abc import Iterator, Sequence

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from .. import rotation
from ..errors import InputError
from ..rotation import Channels, float64
from . import versions

Array = NDArray[np.float64]

# A chain of parents multiplies rotations in float32, each product within 4 roundings of 2⁻²⁴: 32 of them stay below. More is
# shear.
LARGEST_SKEW = 32 * 4 * 2.0**-24

# The rounding of a matrix entry, which puts an axis off by √3 times that, 1.5e-7: rounded numbers that make no more will do.
_ROUNDING = 3 * 2.0**-25

# The property that rotates an object in the mode it has, and that of the rotation which Blender applies after it.
_ROTATIONS = {"QUATERNION": "rotation_quaternion", "AXIS_ANGLE": "rotation_axis_angle"}
_DELTA_ROTATIONS = {"QUATERNION": "delta_rotation_quaternion", "AXIS_ANGLE": None}


def rotation_channel(camera_object: bpy.types.Object) -> str:
    """The property that rotates the object in the mode it has."""
    return _ROTATIONS.get(camera_object.rotation_mode, "rotation_euler")


def channels_of(block: bpy.types.Object) -> Channels:
    """The channels of an object's transform."""
    mode = block.rotation_mode
    delta = _DELTA_ROTATIONS.get(mode, "delta_rotation_euler")
    return Channels(
        mode,
        block.location[:],
        getattr(block, _ROTATIONS.get(mode, "rotation_euler"))[:],
        block.scale[:],
        block.delta_location[:],
        getattr(block, delta)[:] if delta else (),
        block.delta_scale[:],
    )


def set_rotation(camera_object: bpy.types.Object, turn: Array, before: Sequence[float] | None = None) -> None:
    """Rotate the camera, in its own mode, by the (3, 3) rotation that `Channels.bringing_to` gives; its scale is set already.

    before : the numbers of the frame before, to be as near to as the rotation allows.
    """
    channels = channels_of(camera_object)
    numbers = rotation.numbers(turn, channels.mode, before)
    set_rotations([camera_object], channels.mode, numbers[None], (channels.delta @ turn * channels.signs)[None])


def set_rotations(
    cameras: Sequence[bpy.types.Object], mode: str, numbers: Array, axes: Array
) -> tuple[NDArray[np.float32], list[Matrix]]:
    """Rotate n cameras of one mode, each by its numbers or those beside them that float32 makes the better matrix of.

    numbers : (n, k), of the mode.
    axes : (n, 3, 3), those wanted, as columns.

    Returns the numbers that were set, and the cameras' matrices then.
    """
    name, best = _ROTATIONS.get(mode, "rotation_euler"), numbers.astype(np.float32)
    for camera_object, turn in zip(cameras, best.tolist(), strict=True):
        setattr(camera_object, name, turn)
    matrices = [camera_object.matrix_basis.copy() for camera_object in cameras]
    errors = rotation.largest_error(versions.numbers_of(matrices), axes)
    for i in np.flatnonzero(errors > _ROUNDING):
        best[i] = _set_better(cameras[i], name, best[i], axes[i], errors[i])
        matrices[i] = cameras[i].matrix_basis.copy()
    return best, matrices


def _set_better(
    camera_object: bpy.types.Object, name: str, rounded: NDArray[np.float32], axes: Array, least: float
) -> Sequence[float]:
    """Rotate a camera by the first numbers beside the rounded ones that are right, or the best of all; these numbers."""
    best, waiting, at_once = tuple(rounded.tolist()), rotation.neighbors(rounded), 2
    while least > _ROUNDING and (tried := list(itertools.islice(waiting, at_once))):
        matrices = []
        for turn in tried:
            setattr(camera_object, name, turn)
            matrices.append(camera_object.matrix_basis.copy())
        errors = rotation.largest_error(versions.numbers_of(matrices), axes)
        if errors.min() < least:
            best, least = tried[errors.argmin()], errors.min()
        at_once *= 2
    setattr(camera_object, name, best)
    return best


def parent_matrix(camera_object: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Array:
    """(4, 4) float64: the matrix that takes the camera's own location, rotation and scale to world space.

    It is that of the parent and of the constraints, as long as all of these carry the camera as a parent does.

    Raises InputError if it is singular, or can't be told, since the camera or what carries it is scaled to zero.
    """
    parent = camera_object.parent
    inverse = float64(camera_object.matrix_parent_inverse)
    if not is_told_by_its_pose(camera_object):
        matrix = float64(parent.evaluated_get(depsgraph).matrix_world) @ inverse if parent else rotation.IDENTITY
        if not rotation.has_inverse(matrix):
            raise no_size(camera_object)
        return matrix
    evaluated = camera_object.evaluated_get(depsgraph)
    if is_carried_by_constraints(camera_object):
        own = float64(evaluated.matrix_basis)
    elif not rotation.has_inverse(inverse):
        raise no_size(camera_object)
    else:  # Blender's local matrix is relative to the bone, the vertices or the place on the path
        own = np.linalg.inv(inverse) @ float64(evaluated.matrix_local)
    if not rotation.has_inverse(own):
        raise no_size(camera_object)
    matrix = float64(evaluated.matrix_world) @ np.linalg.inv(own)
    if not rotation.has_inverse(matrix):
        raise no_size(camera_object)
    return matrix


def is_told_by_its_pose(camera_object: bpy.types.Object) -> bool:
    """True if only Blender knows the matrix that carries the camera, so that it is told from how the camera stands.

    It is told with the rounding of this pose: best from one close to that which is wanted.
    """
    parent = camera_object.parent
    is_plain = parent is None or (camera_object.parent_type == "OBJECT" and parent.type != "CURVE")
    return not is_plain or is_carried_by_constraints(camera_object)


def active_constraints(block: bpy.types.Object) -> Iterator[bpy.types.Constraint]:
    """The constraints that are neither muted nor without influence."""
    return (constraint for constraint in block.constraints if constraint.enabled and constraint.influence > 0)


def targets_of(constraint: bpy.types.Constraint) -> Iterator[bpy.types.Object]:
    """The objects by which a constraint places another."""
    several = getattr(constraint, "targets", ())
    yield from filter(None, (getattr(each, "target", None) for each in (constraint, *several)))


def is_carried_by_constraints(camera_object: bpy.types.Object) -> bool:
    """True if it has constraints, and each of them moves it as a parent does."""
    constraints = list(active_constraints(camera_object))
    return bool(constraints) and all(map(carries, constraints))


def carries(constraint: bpy.types.Constraint) -> bool:
    """True if a constraint moves an object as a parent does: it multiplies its matrix by one that does not depend on it."""
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
        if not all(channels_of(block).full_scale):
            who = "" if block == camera_object else f" by {block.name!r} above it"
            return InputError(f"camera {camera_object.name!r} is scaled to zero{who}: give {block.name!r} a scale of 1")
    return InputError(f"camera {camera_object.name!r} is scaled to zero, or beyond all numbers: set its scale to 1")


def who_shears(camera_object: bpy.types.Object) -> str:
    """The reason that the camera's axes are not perpendicular, and what to do about it: the end of a sentence."""
    for child in (camera_object, *ancestors(camera_object)):
        parent = child.parent
        if parent and parent.type == "ARMATURE" and child.parent_type == "BONE":
            bone = parent.pose.bones.get(child.parent_bone)
            if bone and not _is_uniform(bone.scale):
                return f"the bone {bone.name!r} above it is scaled non-uniformly: give the bone a uniform scale"
        if parent and not _is_uniform(channels_of(parent).full_scale):
            relation = "parent" if child == camera_object else "ancestor"
            return f"its {relation} {parent.name!r} is scaled non-uniformly: apply the scale of {parent.name!r}"
    for constraint in active_constraints(camera_object):
        return f"its constraint {constraint.name!r} shears it: disable it, or give its target a uniform scale"
    return "its parent inverse or a constraint above it shears it: clear the parent inverse, or the parent"


def _is_uniform(scale: Array) -> bool:
    sizes = np.abs(scale)
    return bool(sizes.max() <= sizes.min() * (1 + LARGEST_SKEW))


def ancestors(block: bpy.types.Object) -> Iterator[bpy.types.Object]:
    """The ancestors of an object: its parent, the parent's parent, and so on."""
    while block := block.parent:
        yield block


def reach(camera_object: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> float:
    """The lengths that go into the camera's location, summed: its own, the parent's, and that of the parent's inverse."""
    own, parent = (camera_object.location + camera_object.delta_location).length, camera_object.parent
    if parent is None and not camera_object.constraints:
        return own
    matrix = parent_matrix(camera_object, depsgraph)
    own = np.linalg.norm(matrix[:3, :3], 2) * own + np.linalg.norm(matrix[:3, 3])
    if parent is None:
        return own
    world = float64(parent.evaluated_get(depsgraph).matrix_world)
    inverse = float64(camera_object.matrix_parent_inverse)
    return own + np.linalg.norm(world[:3, :3], 2) * np.linalg.norm(inverse[:3, 3]) + np.linalg.norm(world[:3, 3])
