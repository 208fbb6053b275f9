"""The camera object's pose: where it stands among its parent and delta transforms, and which channels bring it elsewhere.

Everything is float64 from Blender's float32 matrices on, each (4, 4) or (3, 3), for column vectors.
"""

import bpy
import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..pinhole import Pinhole
from . import rotation

Array = NDArray[np.float64]

# A chain of parents multiplies rotations in float32, each product within 4 roundings of 2⁻²⁴: 32 of them stay below. More is
# shear.
LARGEST_SKEW = 32 * 4 * 2.0**-24


def channels(
    camera_object: bpy.types.Object, pinhole: Pinhole, depsgraph: bpy.types.Depsgraph
) -> tuple[tuple[float, ...], Array, tuple[float, ...]]:
    """Location, (3, 3) rotation and scale that bring the camera to the pose, relative to its parent and its delta transform."""
    parent = parent_matrix(camera_object, depsgraph)
    if np.linalg.det(parent[:3, :3]) == 0:
        raise InputError(f"the parent of camera {camera_object.name!r} is scaled to zero: give it a scale")
    u, v, w = pinhole.basis()
    wanted = np.column_stack([-u if pinhole.mirrored else u, v, w])
    scale = np.array(camera_object.scale)
    signs = np.where(scale * np.array(camera_object.delta_scale) < 0, -1.0, 1.0)
    local = np.linalg.solve(parent[:3, :3], wanted)
    if np.linalg.det(local) * signs.prod() < 0:
        scale[0], signs[0] = -scale[0], -signs[0]
    turn = rotation.nearest(local / np.linalg.norm(local, axis=0) * signs)
    location = np.linalg.solve(parent[:3, :3], np.array(pinhole.eye) - parent[:3, 3]) - np.array(camera_object.delta_location)
    return tuple(location.tolist()), _delta_rotation(camera_object).T @ turn, tuple(scale.tolist())


def _delta_rotation(camera_object: bpy.types.Object) -> Array:
    """The (3, 3) rotation that Blender applies after the object's own; for the mode AXIS_ANGLE Blender shows none."""
    mode = camera_object.rotation_mode
    if mode == "QUATERNION":
        return rotation.from_quaternion(camera_object.delta_rotation_quaternion)
    return np.eye(3) if mode == "AXIS_ANGLE" else rotation.from_euler(camera_object.delta_rotation_euler, mode)


def parent_matrix(camera_object: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Array:
    """(4, 4) float64: the matrix that takes the camera's own location, rotation and scale to world space."""
    parent = camera_object.parent
    if parent is None:
        return np.eye(4)
    inverse = np.array(camera_object.matrix_parent_inverse)
    if camera_object.parent_type == "OBJECT" and parent.type != "CURVE":
        return np.array(parent.evaluated_get(depsgraph).matrix_world) @ inverse
    # Bones, vertices and paths: what Blender itself takes for the parent's matrix.
    evaluated = camera_object.evaluated_get(depsgraph)
    return np.array(evaluated.matrix_world) @ np.linalg.inv(np.array(evaluated.matrix_local)) @ inverse


def who_shears(camera_object: bpy.types.Object) -> str:
    parent = camera_object.parent
    while parent:
        sizes = np.linalg.norm(np.array(parent.matrix_world)[:3, :3], axis=0)
        if sizes.max() > sizes.min() * (1 + LARGEST_SKEW):
            return f"its parent {parent.name!r} is scaled non-uniformly"
        parent = parent.parent
    return "its parents or constraints shear it"


def reach(camera_object: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> float:
    """The lengths that go into the camera's location, summed: its own, the parent's, and that of the parent's inverse."""
    matrix = parent_matrix(camera_object, depsgraph)
    own = np.linalg.norm(matrix[:3, :3], 2) * (camera_object.location + camera_object.delta_location).length
    parent = camera_object.parent
    if parent is None:
        return own
    world = np.array(parent.evaluated_get(depsgraph).matrix_world)
    inverse = np.array(camera_object.matrix_parent_inverse)
    offset = np.linalg.norm(world[:3, :3], 2) * np.linalg.norm(inverse[:3, 3]) + np.linalg.norm(world[:3, 3])
    return own + offset + np.linalg.norm(matrix[:3, 3])
