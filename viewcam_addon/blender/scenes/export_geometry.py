"""Blender's evaluated meshes and point clouds as the tracer's arrays, read in bulk.

As Cycles reads them (intern/cycles/blender/mesh.cpp and pointcloud.cpp, and what its Normal pass shows): Blender's own
triangulation; material indices clamped to the slots; where all faces are flat, the normal of each triangle, else Blender's
corner normals, in which a flat face has one normal for all of its triangles.

Until 5.0 Cycles has one normal a vertex. A mesh that is smooth but for flat faces has the normals of its vertices, and flat
faces those of their triangles. Where an edge is sharp or a normal custom, Cycles splits the vertices first, along sharp edges
and those of flat faces (`is_split`), and reads all from the mesh that comes of it; each vertex has the normal of its last
corner. Blender's corner normals also stop at an edge whose faces are wound against each other, or are not two, and Cycles' do
not: there no vertex is split.

Where all edges are sharp, Blender has the normals of faces, and every Cycles those of vertices on faces that are marked smooth.
"""

import contextlib
from collections.abc import Collection, Iterator
from dataclasses import replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...tracer.scene import Mesh, Spheres
from ...tracer.scene.value_nodes import VERTEX_COLOR
from .. import versions
from . import cycles_attributes, images

# Type of an attribute → the field that has its values, and how many they are.
_ATTRIBUTES = {
    "FLOAT": ("value", 1),
    "INT": ("value", 1),
    "INT8": ("value", 1),
    "BOOLEAN": ("value", 1),
    "FLOAT2": ("vector", 2),
    "FLOAT_VECTOR": ("vector", 3),
    "FLOAT_COLOR": ("color", 4),
    "BYTE_COLOR": ("color", 4),
    "QUATERNION": ("value", 4),
}
# Cycles' radius of points that have none.
DEFAULT_RADIUS = 0.01

Array = NDArray[Any]


def mesh_of(mesh: bpy.types.Mesh, slot_count: int, has_colors: bool = False, attributes: Collection[str] = ()) -> Mesh:
    """The triangles of an evaluated mesh, object space; of one that `is_split`, once it has been.

    slot_count : the number of the object's material slots, which material indices are clamped to.
    has_colors : true to bring along the color attribute that is active for rendering, black where there is none.
    attributes : the names of attributes to bring along, see `Mesh`; of those that the mesh has not, nothing comes.
    """
    mesh.calc_loop_triangles()
    vertices = _positions(mesh).astype(np.float64)
    corner_vertices = _built_in(mesh, ".corner_vert", "value", np.int32, domain="CORNER")
    corners = read(mesh.loop_triangles, "loops", np.int32, 3)
    faces = read(mesh.loop_triangle_polygons, "value", np.int32)
    triangles = corner_vertices[corners]
    finite = np.isfinite(vertices).all(axis=1)
    if not finite.all():  # Cycles draws no triangle that is nowhere
        drawn = finite[triangles].all(axis=1)
        vertices[~finite], triangles, corners, faces = 0, triangles[drawn], corners[drawn], faces[drawn]
    return Mesh(
        vertices=vertices,
        triangles=triangles,
        materials=materials_of(mesh, slot_count)[faces],
        corner_normals=_corner_normals(mesh, vertices, corner_vertices, corners, faces),
        corner_uvs=_corner_uvs(mesh, corners),
        corner_colors=_corner_colors(mesh, triangles, corners, faces) if has_colors else None,
        attributes={
            name: values
            for name in sorted(attributes)
            if (values := _corner_values(mesh, name, triangles, corners, faces)) is not None
        },
    )


@contextlib.contextmanager
def mesh_shown(evaluated: bpy.types.Object, split: bool = False) -> Iterator[bpy.types.Mesh]:
    """The mesh of an object or an instance in a depsgraph, as it is there, or a copy that lasts as long as the context.

    What is edited is no mesh before it is copied. split : copies one that Cycles splits, too, and splits the copy.
    """
    mesh = evaluated.data
    if not (mesh.is_editmode or (split and is_split(mesh))):
        yield mesh
        return
    copy = evaluated.to_mesh()
    try:
        if split and is_split(copy):
            copy.split_faces()
        yield copy
    finally:
        evaluated.to_mesh_clear()


def spheres_of(points: bpy.types.PointCloud) -> Spheres:
    """The points of an evaluated point cloud, object space: those that Cycles draws, and all of its first material."""
    centers: Any = _attribute(points, "position", "vector", np.float32, 3)  # which every point cloud has
    radii = _attribute(points, "radius", "value", np.float32)
    if radii is None:
        radii = np.full(len(centers), DEFAULT_RADIUS, np.float32)
    drawn = np.isfinite(centers).all(axis=1) & np.isfinite(radii) & (radii >= 0)
    centers, radii = centers[drawn], radii[drawn]
    return Spheres(centers.astype(np.float64), radii.astype(np.float64), np.zeros(len(centers), np.int32))


def of_slots(mesh: Mesh, slots: Collection[int]) -> Mesh:
    """The triangles of these material slots."""
    kept = np.isin(mesh.materials, list(slots))
    if kept.all():
        return mesh
    of_corners = ("triangles", "materials", "corner_normals", "corner_uvs", "corner_colors")
    arrays = {name: values[kept] for name in of_corners if (values := getattr(mesh, name)) is not None}
    return replace(mesh, attributes={name: values[kept] for name, values in mesh.attributes.items()}, **arrays)


def used_slots(mesh: bpy.types.Mesh, slot_count: int) -> set[int]:
    """The material slots that some face of a mesh uses; geometry nodes leave an unused first one."""
    # np.unique would load masked arrays first, which takes as long as to read a scene.
    return set(np.flatnonzero(np.bincount(materials_of(mesh, slot_count))).tolist())


def materials_of(mesh: bpy.types.Mesh, slot_count: int) -> Array:
    """(faces,) int32: each face's index among the material slots."""
    indices = _attribute(mesh, "material_index", "value", np.int32, domain="FACE")
    if indices is None:
        return np.zeros(len(mesh.polygons), np.int32)
    return np.clip(indices, 0, max(slot_count - 1, 0))


def is_split(mesh: bpy.types.Mesh) -> bool:
    """True if Cycles splits the vertices of an evaluated mesh, as `mesh.split_faces()` does, or would if they were not yet."""
    return versions.CYCLES_HAS_VERTEX_NORMALS and mesh.normals_domain == "CORNER" and not _only_faces_are_sharp(mesh)


def _corner_normals(
    mesh: bpy.types.Mesh, vertices: Array, corner_vertices: Array, corners: Array, faces: Array
) -> Array | None:
    """(triangles, 3, 3) float32, or None where all faces are flat."""
    sharp: Any = _attribute(mesh, "sharp_face", "value", np.bool_, domain="FACE")
    if mesh.normals_domain == "FACE" and (sharp is None or sharp.all()):
        return None
    if is_split(mesh):
        return read(mesh.corner_normals, "vector", np.float32, 3)[_last_of_each(corner_vertices)][corners]
    if mesh.normals_domain == "POINT" or (mesh.normals_domain == "CORNER" and not versions.CYCLES_HAS_VERTEX_NORMALS):
        return read(mesh.corner_normals, "vector", np.float32, 3)[corners]
    triangles = corner_vertices[corners]
    normals = read(mesh.vertex_normals, "vector", np.float32, 3)[triangles]
    flat = sharp[faces]
    first, second, third = np.moveaxis(vertices[triangles[flat]], 1, 0)
    across = np.cross(second - first, third - first)
    lengths = np.linalg.norm(across, axis=1, keepdims=True)
    normals[flat] = (across / np.where(lengths > 0, lengths, 1.0))[:, np.newaxis].astype(np.float32)
    return normals


def _last_of_each(numbers: Array) -> Array:
    """(n,) the index of the last that has the same number."""
    _, first, which = np.unique(numbers[::-1], return_index=True, return_inverse=True)
    return (len(numbers) - 1 - first)[which.ravel()][::-1]


def _only_faces_are_sharp(mesh: bpy.types.Mesh) -> bool:
    """True if in a mesh of corner normals flat faces stand beside smooth ones, without sharp edges and custom normals."""
    if mesh.has_custom_normals:
        return False
    edges = _attribute(mesh, "sharp_edge", "value", np.bool_, domain="EDGE")
    return edges is None or not edges.any()


def _corner_uvs(mesh: bpy.types.Mesh, corners: Array) -> Array | None:
    """(triangles, 3, 2) float32: the UV map that is active for rendering, or None where there is none."""
    layer = next((layer for layer in mesh.uv_layers if layer.active_render), None)
    return None if layer is None else read(layer.uv, "vector", np.float32, 2)[corners]


def _corner_colors(mesh: bpy.types.Mesh, triangles: Array, corners: Array, faces: Array) -> Array:
    """(triangles, 3, 3) float32, linear: the colors that are active for rendering; black, as in Cycles, where none are."""
    colors = _corner_values(mesh, VERTEX_COLOR, triangles, corners, faces)
    return np.zeros((*corners.shape, 3), np.float32) if colors is None else np.ascontiguousarray(colors[:, :, :3])


def _corner_values(mesh: bpy.types.Mesh, name: str, triangles: Array, corners: Array, faces: Array) -> Array | None:
    """(triangles, 3, k) float32: an attribute as Cycles has it, or None where the mesh has none of this name."""
    if name == cycles_attributes.GENERATED:
        return _generated(mesh)[triangles]
    if name in (cycles_attributes.POINTINESS, cycles_attributes.RANDOM_PER_ISLAND):
        return _of_edges(mesh, name)[triangles, np.newaxis]
    if name == VERTEX_COLOR and mesh.color_attributes.render_color_index >= 0:
        name = mesh.color_attributes[mesh.color_attributes.render_color_index].name
    attribute = mesh.attributes.get(name)
    if attribute is None or attribute.data_type not in _ATTRIBUTES:
        return None
    if attribute.domain == "EDGE":
        return _at_points(mesh, attribute)[triangles]
    at = {"POINT": triangles, "CORNER": corners, "FACE": np.repeat(faces[:, np.newaxis], 3, axis=1)}.get(attribute.domain)
    if at is None:
        return None
    return np.ascontiguousarray(_stored(attribute, *_ATTRIBUTES[attribute.data_type]).astype(np.float32)[at])


def _stored(attribute: bpy.types.Attribute, field: str, width: int) -> Array:
    """(n, width): the numbers of a field of an attribute's elements."""
    dtype = {"BOOLEAN": np.bool_, "INT": np.int32, "INT8": np.int32}.get(attribute.data_type, np.float32)
    return read(attribute.data, field, dtype, width).reshape(-1, width)


def _at_points(mesh: bpy.types.Mesh, attribute: bpy.types.Attribute) -> Array:
    """(vertices, k) float32: the mean of an attribute of the edges that each vertex has, 0 where it has none.

    As Blender's BKE_attribute_math.hh mixes it: of what is true or not, whether it is of any; whole numbers are rounded; bytes
    of colors are mixed as they are encoded, and cut off.
    """
    kind = attribute.data_type
    field, width = ("color_srgb", 4) if kind == "BYTE_COLOR" else _ATTRIBUTES[kind]
    values = _stored(attribute, field, width).astype(np.float64)
    ends = _edges(mesh)
    counts = np.bincount(ends.ravel(), minlength=len(mesh.vertices))[:, np.newaxis]
    sums = np.column_stack([np.bincount(ends.ravel(), np.repeat(column, 2), len(mesh.vertices)) for column in values.T])
    means = sums / np.maximum(counts, 1)
    if kind == "BOOLEAN":
        means = (sums > 0).astype(np.float64)
    elif kind in ("INT", "INT8"):
        means = np.copysign(np.floor(np.abs(means) + 0.5), means)
    elif kind == "BYTE_COLOR":
        encoded = np.floor(np.rint(sums * 255) / np.maximum(counts, 1)) / 255
        means = np.column_stack([images.linear(encoded[:, :3]), encoded[:, 3]])
    return means.astype(np.float32)


def _generated(mesh: bpy.types.Mesh) -> Array:
    """(vertices, 3) float32: where vertices are in the texture space, before anything deformed them."""
    size = np.array(mesh.texspace_size, np.float32)
    with np.errstate(divide="ignore"):
        scale = np.where(size != 0, np.float32(0.5) / size, np.float32(0))
    places = read(mesh.vertices, "undeformed_co", np.float32, 3)
    return places * scale - (np.array(mesh.texspace_location, np.float32) * scale - np.float32(0.5))


def _of_edges(mesh: bpy.types.Mesh, name: str) -> Array:
    """(vertices,) float32: what edges say of the vertices that they connect."""
    edges = _edges(mesh)
    if name == cycles_attributes.RANDOM_PER_ISLAND:
        return cycles_attributes.random_per_island(edges, len(mesh.vertices))
    normals = read(mesh.vertex_normals, "vector", np.float32, 3)
    return cycles_attributes.pointiness(_positions(mesh), normals, edges)


def _positions(mesh: bpy.types.Mesh) -> Array:
    return _built_in(mesh, "position", "vector", np.float32, 3)


def _edges(mesh: bpy.types.Mesh) -> Array:
    """(edges, 2): the vertices at the ends of each."""
    return _built_in(mesh, ".edge_verts", "value", np.int32, 2, "EDGE")


def _built_in(mesh: bpy.types.Mesh, name: str, field: str, dtype: type, width: int = 1, domain: str = "POINT") -> Array:
    """An attribute that each mesh has of the elements that it has; it is read a hundred times as fast as element by element."""
    values = _attribute(mesh, name, field, dtype, width, domain)
    return np.empty((0, width) if width > 1 else 0, dtype) if values is None else values


def _attribute(owner: bpy.types.ID, name: str, field: str, dtype: type, width: int = 1, domain: str = "POINT") -> Array | None:
    """An attribute's values, or None where there is none of this name and domain."""
    attribute = owner.attributes.get(name)
    return read(attribute.data, field, dtype, width) if attribute and attribute.domain == domain else None


def read(collection: bpy.types.bpy_prop_collection, field: str, dtype: type, width: int = 1) -> Array:
    """(items,) or (items, width) of `dtype`."""
    values: Array = np.empty(len(collection) * width, dtype)
    collection.foreach_get(field, values)
    return values.reshape(-1, width) if width > 1 else values
