"""The tracer's geometries as Blender's meshes and point clouds, as export_geometry.py reads them back to the last bit.

Spheres are point clouds, which Cycles draws as true spheres. Until 5.2 no script can give a point cloud its points; geometry
nodes can, in every version, and what they have made is copied: one way for all. Rejected: the mesh with such nodes itself (the
points' nodes would have to stay in the file, and radii in an attribute that nobody looks for), icospheres, which are none.
"""

import bpy
import numpy as np
from numpy.typing import NDArray

from ...tracer.scene import Mesh, Spheres
from .. import datablocks, versions
from ..temporary_settings import Overrides, overridden
from . import cycles_attributes
from .ledger import Ledger

Array = NDArray[np.generic]

UV_MAP, COLOURS = "UVMap", "Color"
RENAMED = {name: name.replace("_", " ").title() for name in (cycles_attributes.POINTINESS, cycles_attributes.RANDOM_PER_ISLAND)}
"""The attributes that are called otherwise, or Cycles would make it anew, of edges that triangles have and faces had not."""
# Numbers a corner → the type of an attribute, and the field that has its values.
_ATTRIBUTES = {1: ("FLOAT", "value"), 2: ("FLOAT2", "vector"), 3: ("FLOAT_VECTOR", "vector"), 4: ("FLOAT_COLOR", "color")}
# Of a unit vector's float32 components, three roundings by which Blender's arithmetic may be off.
_ROUNDING = 3 * 2.0**-23


def mesh_from(made: Mesh, name: str, overrides: Overrides, ledger: Ledger) -> bpy.types.Mesh:
    """A mesh of triangles, without materials. Triangles that name a vertex twice have no area, and are left out."""
    first, second, third = made.triangles.T
    drawn = (first != second) & (second != third) & (third != first)
    corners = np.ascontiguousarray(made.triangles[drawn]).ravel()
    mesh = bpy.data.meshes.new(name)
    overrides.afterwards(bpy.data.batch_remove, [mesh])
    mesh.vertices.add(len(made.vertices))
    mesh.vertices.foreach_set("co", made.vertices.astype(np.float32).ravel())
    mesh.loops.add(len(corners))
    mesh.loops.foreach_set("vertex_index", corners.astype(np.int32))
    mesh.polygons.add(len(corners) // 3)
    mesh.polygons.foreach_set("loop_start", np.arange(0, len(corners), 3, dtype=np.int32))
    mesh.polygons.foreach_set("material_index", made.materials[drawn].astype(np.int32))
    mesh.polygons.foreach_set("use_smooth", np.full(len(corners) // 3, made.corner_normals is not None))
    mesh.update(calc_edges=True)
    for attribute, values in made.attributes.items():
        if attribute not in (cycles_attributes.GENERATED, cycles_attributes.VERTEX_COLOR):  # made by Cycles; among the colours
            kind, field = _ATTRIBUTES[values.shape[2]]
            mesh.attributes.new(RENAMED.get(attribute, attribute), kind, "CORNER").data.foreach_set(
                field, values[drawn].ravel()
            )
    if made.corner_uvs is not None:
        layer = mesh.uv_layers.new(name=UV_MAP, do_init=False)
        layer.uv.foreach_set("vector", made.corner_uvs[drawn].ravel())
        layer.active_render = True
    if (colours := _colours(made)) is not None:
        attributes = mesh.color_attributes
        attributes.new(COLOURS, "FLOAT_COLOR", "CORNER").data.foreach_set("color", colours[drawn].ravel())
        attributes.render_color_index = len(attributes) - 1
    if made.corner_normals is not None and len(corners):
        off = _set_normals(mesh, made.corner_normals[drawn].reshape(-1, 3))
        if off > _ROUNDING:
            reason = (
                f"its normals are turned by up to {np.degrees(off):.2g}°, as this Blender stores them (4.5 and later keep them)"
            )
            ledger.note(name, "approximated", reason)
    return mesh


def _colours(made: Mesh) -> Array | None:
    """(triangles, 3, 4) float32: the mesh's colours, with the alpha of the attribute that Cycles calls as these, or None."""
    found = made.attributes.get(cycles_attributes.VERTEX_COLOR)
    if made.corner_colours is None and found is None:
        return None
    colours = np.ones((len(made.triangles), 3, 4), np.float32)
    for known in (found, made.corner_colours):
        if known is not None:
            colours[:, :, : known.shape[2]] = known
    return colours


def _set_normals(mesh: bpy.types.Mesh, normals: Array) -> float:
    """Give each corner its normal, (n, 3) float32; returns the radians by which the farthest is off."""
    if versions.MESHES_KEEP_NORMALS:
        mesh.attributes.new("custom_normal", "FLOAT_VECTOR", "CORNER").data.foreach_set("vector", normals.ravel())
        mesh.update()
        return 0.0
    mesh.normals_split_custom_set(normals.tolist())
    found = np.empty_like(normals)
    mesh.corner_normals.foreach_get("vector", found.ravel())
    return float(np.linalg.norm(found - normals, axis=1).max())


def points_from(made: Spheres, name: str, overrides: Overrides) -> bpy.types.PointCloud:
    """A point cloud whose points have these radii, without materials."""
    with overridden() as inner:
        block = _points_maker(made, inner)
        scene = bpy.data.scenes.new("Virtual Pinhole")
        inner.afterwards(bpy.data.scenes.remove, scene)
        scene.collection.objects.link(block)
        shown = (instance.object.data for instance in datablocks.depsgraph_of(scene).object_instances)
        points = next(data for data in shown if isinstance(data, bpy.types.PointCloud)).copy()
    overrides.afterwards(bpy.data.batch_remove, [points])
    points.name = name
    return points


def _points_maker(made: Spheres, inner: Overrides) -> bpy.types.Object:
    """An object whose vertices geometry nodes make points of."""
    mesh = bpy.data.meshes.new("Virtual Pinhole")
    inner.afterwards(bpy.data.batch_remove, [mesh])
    mesh.vertices.add(len(made.centers))
    mesh.vertices.foreach_set("co", made.centers.astype(np.float32).ravel())
    mesh.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", made.radii.astype(np.float32))
    tree = bpy.data.node_groups.new("Virtual Pinhole", "GeometryNodeTree")
    inner.afterwards(bpy.data.batch_remove, [tree])
    for direction in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    source, target = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    points, radius = tree.nodes.new("GeometryNodeMeshToPoints"), tree.nodes.new("GeometryNodeInputNamedAttribute")
    radius.data_type, radius.inputs["Name"].default_value = "FLOAT", "radius"
    tree.links.new(source.outputs[0], points.inputs[0])
    tree.links.new(radius.outputs["Attribute"], points.inputs["Radius"])
    tree.links.new(points.outputs[0], target.inputs[0])
    block = bpy.data.objects.new("Virtual Pinhole", mesh)
    inner.afterwards(bpy.data.batch_remove, [block])
    block.modifiers.new("Points", "NODES").node_group = tree
    return block


def parts_of(made: Spheres) -> list[tuple[int, Spheres]]:
    """(material, spheres of it) for each material: Cycles draws all of a point cloud's in its first."""
    used = np.unique(made.materials).tolist()
    return [
        (number, Spheres(made.centers[chosen], made.radii[chosen], np.zeros(chosen.sum(), np.int32)))
        for number in used
        for chosen in (made.materials == number,)
    ]
