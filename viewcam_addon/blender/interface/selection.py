"""The selection's points in the world. Reads Blender, changes nothing.

Of objects it is the geometry that the viewport shows, modifiers, instances and all; an object without geometry is its origin.
In the edit modes of meshes, curves, surfaces, lattices and armatures, and in pose mode, it is the selected vertices, control
points and ends of bones, before modifiers, since that is what the artist picks. Rejected: bounding boxes (a diagonal stick
fills half of its box), but for the few kinds of objects that show their points to no script.
"""

from collections.abc import Callable, Iterable, Iterator
from typing import Any

import bmesh
import bpy
import numpy as np
from numpy.typing import NDArray

from ... import rotation
from ...errors import InputError
from ...pinhole import Triple
from ..scenes import export_geometry

Array = NDArray[np.float64]

_BOXED = ("ARMATURE", "LATTICE", "GREASEPENCIL", "GPENCIL", "VOLUME")


def objects(context: bpy.types.Context, camera_object: bpy.types.Object | None) -> list[bpy.types.Object]:
    """The objects that are selected, or edited in a mode that selects parts, without the camera itself."""
    blocks = context.objects_in_mode if context.mode in _PARTS else context.selected_objects
    return [block for block in blocks if block != camera_object]


def points(context: bpy.types.Context, camera_object: bpy.types.Object) -> Array:
    """(n, 3) float64, world space, n ≥ 1, all finite: the points of the selection without the camera itself.

    Raises InputError if nothing is selected.
    """
    blocks, depsgraph = objects(context, camera_object), context.evaluated_depsgraph_get()
    parts = _PARTS.get(context.mode)
    if parts:
        placed = [_placed(_rows(parts(block)), block.evaluated_get(depsgraph).matrix_world) for block in blocks]
    else:
        placed = list(_points_of_objects(blocks, depsgraph))
    everything = np.concatenate([np.empty((0, 3)), *placed])
    everything = everything[np.isfinite(everything).all(axis=1)]  # a point that is nowhere is drawn nowhere
    if not len(everything):
        what = "no vertex, control point or bone" if parts else "nothing but the camera, or nothing at all,"
        raise InputError(f"{what} is selected: select what the camera shall look at")
    return everything


def bounds_center(points: Array) -> Triple:
    """The middle of the box about the points, along the world's axes. Pure."""
    return tuple((points.min(axis=0) / 2 + points.max(axis=0) / 2).tolist())


def median(points: Array) -> Triple:
    """The mean of the points, which Blender calls their median. Pure."""
    return tuple(points.mean(axis=0).tolist())


def _points_of_objects(blocks: list[bpy.types.Object], depsgraph: bpy.types.Depsgraph) -> Iterator[Array]:
    wanted, empty = set(blocks), dict.fromkeys(blocks)
    for instance in depsgraph.object_instances:
        owner = (instance.parent if instance.is_instance else instance.object).original
        if owner in wanted:
            local = _local_points(instance.object)
            if len(local):
                empty.pop(owner, None)
                yield _placed(local, instance.matrix_world)
    for block in empty:
        yield rotation.float64(block.evaluated_get(depsgraph).matrix_world.translation)[None]


def _local_points(evaluated: bpy.types.Object) -> NDArray[Any]:
    """(n, 3): the points of an evaluated object, in its own space; none of an object without geometry."""
    if evaluated.type == "MESH":
        return export_geometry.read(evaluated.data.vertices, "co", np.float32, 3)
    if evaluated.type in ("CURVE", "SURFACE", "FONT", "META"):
        mesh = evaluated.to_mesh()
        vertices = export_geometry.read(mesh.vertices, "co", np.float32, 3) if mesh else _rows([])
        evaluated.to_mesh_clear()
        return vertices
    if evaluated.type in ("POINTCLOUD", "CURVES"):
        positions = evaluated.data.attributes.get("position")
        return export_geometry.read(positions.data, "vector", np.float32, 3) if positions else _rows([])
    return _rows(evaluated.bound_box if evaluated.type in _BOXED else [])


def _placed(local: NDArray[Any], matrix: bpy.types.bpy_prop_array) -> Array:
    """Points in an object's space, (n, 3), in the world."""
    matrix = rotation.float64(matrix)
    return local.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]


def _rows(vectors: Iterable[Any]) -> Array:
    """(n, 3) of any number of vectors."""
    return np.array([tuple(vector) for vector in vectors], dtype=np.float64).reshape(-1, 3)


def _vertices(block: bpy.types.Object) -> Iterator:
    return (vertex.co for vertex in bmesh.from_edit_mesh(block.data).verts if vertex.select and not vertex.hide)


def _control_points(block: bpy.types.Object) -> Iterator:
    for spline in block.data.splines:
        for point in spline.bezier_points:
            if point.select_control_point:
                yield point.co
            if point.select_left_handle:
                yield point.handle_left
            if point.select_right_handle:
                yield point.handle_right
        yield from (point.co[:3] for point in spline.points if point.select)


def _lattice_points(block: bpy.types.Object) -> Iterator:
    return (point.co_deform for point in block.data.points if point.select)


def _bone_ends(block: bpy.types.Object) -> Iterator:
    for bone in block.data.edit_bones:
        if bone.select_head:
            yield bone.head
        if bone.select_tail:
            yield bone.tail


def _posed_bones(block: bpy.types.Object) -> Iterator:
    for bone in bpy.context.selected_pose_bones or ():
        if bone.id_data == block:
            yield from (bone.head, bone.tail)


_PARTS: dict[str, Callable[[bpy.types.Object], Iterator]] = {
    "EDIT_MESH": _vertices,
    "EDIT_CURVE": _control_points,
    "EDIT_SURFACE": _control_points,
    "EDIT_LATTICE": _lattice_points,
    "EDIT_ARMATURE": _bone_ends,
    "POSE": _posed_bones,
}
