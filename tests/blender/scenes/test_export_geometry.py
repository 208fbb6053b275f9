"""Meshes, normals, UV maps, materials and point clouds are read as Cycles reads them: rendered by both sides and compared."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from mathutils import Vector

from viewcam_addon.blender import versions
from viewcam_addon.tracer.scene import Spheres


def test_scales_that_mirror_stretch_and_shear_give_the_same_normals(add, both_sides, mesh_from):
    monkey = mesh_from("monkey")
    for polygon in monkey.polygons:
        polygon.use_smooth = polygon.index % 3 > 0
    add(monkey, "Mirrored", location=(-1.7, 0, 0), scale=(-1, 1, 1))
    add(monkey, "Stretched", location=(1.7, 0, 0), scale=(0.5, 1.7, 0.9), rotation_euler=(0.3, 0.4, 0.5))
    parent = add(None, "Parent", scale=(1, 0.4, 1), location=(0, 0.5, 1.6))
    add(monkey, "Sheared", rotation_euler=(0.5, 0.5, 0.5), parent=parent)
    sides = both_sides()
    sides.check()
    assert len(sides.exported.geometries) == 1


def test_the_last_row_of_a_matrix_which_cycles_never_reads_may_be_rounded(add, both_sides, mesh_from):
    parent = add(None, "Parent", location=(0, 0.5, 0))
    child = add(mesh_from("monkey"), "Child", parent=parent)
    inverse = child.matrix_parent_inverse.copy()
    inverse[3][0], inverse[3][3] = 1e-8, 1.0 + 2.0**-23
    child.matrix_parent_inverse = inverse
    bpy.context.view_layer.update()
    assert tuple(child.matrix_world[3]) != (0, 0, 0, 1)
    both_sides().check()


def test_objects_with_a_mesh_of_their_own_have_normals_as_if_applied(add, both_sides, mesh_from):
    """Cycles interpolates the normals of a mesh that one object uses in world space, of a shared one in object space."""
    monkey = mesh_from("monkey")
    monkey.polygons.foreach_set("use_smooth", [True] * len(monkey.polygons))
    add(monkey, scale=(0.5, 2.0, -0.9), rotation_euler=(0.3, 0.4, 0.5))
    both_sides().check()


def test_materials_of_object_and_data_have_their_own_indices(add, scene, both_sides, mesh_from):
    cube = mesh_from("cube")
    red, green, blue = (bpy.data.materials.new(name) for name in ("Red", "Green", "Blue"))
    red.pass_index, green.pass_index, blue.pass_index = 5, 7, 11
    for material in (red, green, None):
        cube.materials.append(material)
    cube.polygons.foreach_set("material_index", [0, 1, 2, 1, 0, 9])
    add(cube, "Data", location=(-1.5, 0, 0), rotation_euler=(0.5, 0.5, 0.5))
    own = add(cube, "Own", location=(1.5, 0, 0), rotation_euler=(2.5, 0.5, 0.5))
    own.material_slots[0].link, own.material_slots[0].material = "OBJECT", blue
    sides = both_sides()
    sides.check()
    assert set(np.unique(sides.cycles["Material Index"])) == {0, 5, 7, 11}
    assert {placed.name: placed.material_indices for placed in sides.exported.objects} == {"Data": (5, 7, 0), "Own": (11, 7, 0)}


def test_a_material_override_of_the_view_layer_overrides_the_index(monkey, both_sides):
    material = bpy.data.materials.new("Clay")
    material.pass_index = 3
    bpy.context.view_layer.material_override = material
    sides = both_sides()
    sides.check()
    assert set(np.unique(sides.cycles["Material Index"])) == {0, 3}


def test_custom_normals_beside_flat_faces(monkey, both_sides):
    mesh = monkey.data
    normals = np.repeat([face.normal for face in mesh.polygons], [face.loop_total for face in mesh.polygons], axis=0)
    normals += np.random.default_rng(1).normal(scale=0.3, size=normals.shape)
    mesh.normals_split_custom_set((normals / np.linalg.norm(normals, axis=1, keepdims=True)).tolist())
    mesh.polygons.foreach_set("use_smooth", [index % 4 > 0 for index in range(len(mesh.polygons))])
    both_sides().check()


def folded(mesh_from, seed, kinds):
    """A crumpled grid with what stops Blender's corner normals in random places.

    kinds : of "sharp edges", "flat faces", "flipped faces", "fins" (edges of three faces), "tips" (faces that share a vertex).
    """
    draw = np.random.default_rng(seed)
    mesh = mesh_from("grid", x_subdivisions=7, y_subdivisions=7, size=5)
    places = [
        (*vertex.co.xy, z) for vertex, z in zip(mesh.vertices, draw.normal(scale=0.3, size=len(mesh.vertices)), strict=True)
    ]
    faces = [tuple(face.vertices) for face in mesh.polygons]
    if "flipped faces" in kinds:
        faces = [face[::-1] if draw.random() < 0.2 else face for face in faces]
    for face in list(faces) if {"fins", "tips"} & {*kinds} else ():
        if draw.random() < 0.15:
            (first, second), above = face[:2], [(places[at][0], places[at][1], places[at][2] + 0.8) for at in face[:2]]
            new = len(places), len(places) + 1
            places += above
            faces.append((first, second, new[1], new[0]) if "fins" in kinds else (first, *new))
    made = bpy.data.meshes.new("Folded")
    made.from_pydata(places, [], faces)
    made.polygons.foreach_set("use_smooth", ["flat faces" not in kinds or draw.random() > 0.1 for _ in faces])
    for edge in made.edges if "sharp edges" in kinds else ():
        edge.use_edge_sharp = draw.random() < 0.15
    made.update()
    return made


FOLDS = [
    ("sharp edges",),
    ("flipped faces", "sharp edges"),
    ("fins", "sharp edges"),
    ("tips", "sharp edges"),
    ("flipped faces", "flat faces"),
    ("flipped faces", "fins", "flat faces", "sharp edges"),
]


@pytest.mark.parametrize("kinds", FOLDS, ids=" and ".join)
def test_corner_normals_stop_where_those_of_cycles_do(add, both_sides, mesh_from, kinds):
    """Blender's stop at each edge of faces that are wound against each other or not two; until 5.0 those of Cycles do not."""
    add(folded(mesh_from, 1, kinds))
    both_sides().check()


def test_custom_normals_stop_where_those_of_cycles_do(add, both_sides, mesh_from):
    mesh = folded(mesh_from, 2, ("flipped faces", "sharp edges"))
    normals = [(vertex := mesh.vertices[loop.vertex_index]).normal + vertex.co / 4 for loop in mesh.loops]
    mesh.normals_split_custom_set([normal.normalized() for normal in normals])
    add(mesh)
    both_sides().check()


@pytest.mark.skipif(not versions.MESHES_KEEP_NORMALS, reason="meshes keep no custom normals as they are given")
def test_custom_normals_that_differ_about_a_vertex_are_those_of_cycles(add, both_sides, mesh_from):
    mesh = folded(mesh_from, 3, ())
    kept = mesh.attributes.new("custom_normal", "FLOAT_VECTOR", "CORNER")
    normals = np.random.default_rng(3).normal((0, 0, 1), 0.3, (len(mesh.loops), 3))
    kept.data.foreach_set("vector", (normals / np.linalg.norm(normals, axis=1, keepdims=True)).ravel())
    add(mesh)
    both_sides().check()


def test_bent_flat_faces_beside_a_smooth_one(add, both_sides, mesh_from):
    grid = mesh_from("grid", x_subdivisions=8, y_subdivisions=8, size=5)
    heights = np.random.default_rng(2).normal(scale=0.3, size=len(grid.vertices))
    for vertex, height in zip(grid.vertices, heights, strict=True):
        vertex.co.z = height
    grid.polygons[0].use_smooth = True
    add(grid)
    both_sides().check()


def test_the_uv_map_is_the_one_active_for_rendering(monkey, both_sides):
    mesh = monkey.data
    mirrored = mesh.uv_layers.new(name="Render")
    first = np.empty(2 * len(mesh.loops), np.float32)
    mesh.uv_layers[0].uv.foreach_get("vector", first)
    mirrored.uv.foreach_set("vector", 1 - first)
    mirrored.active_render = True
    mesh.uv_layers.active_index = 0
    both_sides().check()
    mesh.uv_layers[0].active_render = True
    sides = both_sides()
    sides.check()
    seen = sides.cycles["UV"][sides.cycles["Object Index"][..., 0] > 0]
    assert np.ptp(seen[:, 0]) > 0.1


def test_a_mesh_without_uv_map_has_none_on_both_sides(add, both_sides, mesh_from):
    mesh = mesh_from("ico_sphere", subdivisions=3)
    while mesh.uv_layers:
        mesh.uv_layers.remove(mesh.uv_layers[0])
    add(mesh)
    sides = both_sides()
    sides.check()
    assert not sides.cycles["UV"].any() and not sides.traced["UV"].any()


@pytest.fixture
def beads(add, mesh_from, node_group):
    """36 points, radii from 0.1 to 0.45, of one material with index 4."""
    block = add(mesh_from("grid", size=4, x_subdivisions=5, y_subdivisions=5), "Beads", rotation_euler=(0.5, 0.1, 0))
    material = bpy.data.materials.new("Bead")
    material.pass_index = 4
    tree, source, target = node_group()
    points, index = tree.nodes.new("GeometryNodeMeshToPoints"), tree.nodes.new("GeometryNodeInputIndex")
    radius, paint = tree.nodes.new("ShaderNodeMath"), tree.nodes.new("GeometryNodeSetMaterial")
    radius.operation, radius.inputs[1].default_value, radius.inputs[2].default_value = "MULTIPLY_ADD", 0.01, 0.1
    paint.inputs["Material"].default_value = material
    for output, target_input in (
        (index.outputs[0], radius.inputs[0]),
        (radius.outputs[0], points.inputs["Radius"]),
        (source.outputs[0], points.inputs[0]),
        (points.outputs[0], paint.inputs[0]),
        (paint.outputs[0], target.inputs[0]),
    ):
        tree.links.new(output, target_input)
    block.modifiers.new("Nodes", "NODES").node_group = tree
    return block


def test_point_clouds_are_spheres_of_their_radii(beads, both_sides):
    sides = both_sides()
    sides.check()
    (spheres,) = sides.exported.geometries.values()
    assert isinstance(spheres, Spheres) and np.allclose(spheres.radii, 0.1 + 0.01 * np.arange(36), atol=1e-6)
    assert set(np.unique(sides.cycles["Material Index"])) == {0, 4}


def test_stretched_point_clouds_are_ellipsoids(beads, both_sides):
    beads.scale = (0.5, 1.5, 1)
    both_sides().check()


@pytest.mark.exhaustive
@pytest.mark.parametrize("name", ["spot", "stanford-bunny", "teapot"])
def test_real_models(scene, camera, both_sides, models_folder, name):
    bpy.ops.wm.obj_import(filepath=str(models_folder / f"{name}.obj"))
    (model,) = bpy.context.selected_objects
    model.data.polygons.foreach_set("use_smooth", [True] * len(model.data.polygons))
    scene.render.resolution_x, scene.render.resolution_y = 640, 480
    corners = np.array([model.matrix_world @ Vector(corner) for corner in model.bound_box])
    centre, size = corners.mean(axis=0), np.ptp(corners, axis=0).max()
    group = camera.virtual_pinhole
    group.look_at, group.eye, group.distance = centre, centre + size * np.array((0.9, -1.8, 0.9)), 640
    group.enabled = True
    camera.data.clip_start, camera.data.clip_end = size / 100, size * 100
    both_sides().check()
