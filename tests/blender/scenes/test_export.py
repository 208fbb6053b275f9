"""The tracer gets what Cycles sees: scenes of all kinds, each rendered by both and compared pass by pass."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from mathutils import Vector

from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.blender.scenes import materials
from viewcam_addon.blender.temporary_settings import overridden
from viewcam_addon.errors import NotModeledError
from viewcam_addon.jobs.job import Job
from viewcam_addon.tracer.scene import Mesh, Spheres


def entry(exported, name):
    return next(each for each in exported.ledger if each.object == name)


def test_render_settings_of_modifiers_count_and_not_those_of_the_viewport(monkey, both_sides):
    subdivision = monkey.modifiers.new("Subdivision", "SUBSURF")
    subdivision.levels, subdivision.render_levels = 0, 2
    hidden = monkey.modifiers.new("Decimate", "DECIMATE")
    hidden.ratio, hidden.show_render = 0.1, False
    sides = both_sides()
    sides.check()
    (mesh,) = sides.exported.geometries.values()
    assert len(mesh.triangles) == 15744, f"{len(mesh.triangles)} triangles, Suzanne has 968 and 15744 at level 2"


def test_what_is_hidden_in_the_viewport_only_is_rendered(add, both_sides, mesh_from):
    cube = mesh_from("cube")
    add(cube, "Here", location=(-1.5, 0, 0)).hide_viewport = True
    add(cube, "Gone", location=(1.5, 0, 0)).hide_render = True
    sides = both_sides()
    sides.check()
    assert [placed.name for placed in sides.exported.objects] == ["Here"]


def test_shape_keys_armatures_and_drivers_are_followed(monkey, scene, add, both_sides):
    monkey.shape_key_add(name="Basis")
    key = monkey.shape_key_add(name="Wide")
    for point in key.data:
        point.co.x *= 1.5
    key.value = 0.7
    bpy.ops.object.armature_add(location=(0, 0, -1))
    armature = bpy.context.object
    armature.pose.bones[0].rotation_mode = "XYZ"
    armature.pose.bones[0].rotation_euler = (0.2, 0.5, 0.1)
    upper = monkey.vertex_groups.new(name=armature.data.bones[0].name)
    upper.add([vertex.index for vertex in monkey.data.vertices if vertex.co.z > 0], 0.8, "REPLACE")
    monkey.modifiers.new("Armature", "ARMATURE").object = armature
    monkey.driver_add("scale", 2).driver.expression = "frame / 2"
    scene.frame_set(3)
    sides = both_sides()
    sides.check()
    largest = np.abs(next(iter(sides.exported.geometries.values())).vertices[:, 0]).max()
    assert largest > 1.4, f"the shape key is not there, x reaches {largest}"


def test_another_frame_is_evaluated_and_the_files_own_comes_back(monkey, scene, both_sides):
    monkey.keyframe_insert("location", frame=1)
    monkey.location = (2, 0, 0)
    monkey.keyframe_insert("location", frame=11)
    scene.frame_set(1)
    sides = both_sides(frame=11)
    sides.check()
    assert sides.exported.objects[0].matrix[0, 3] == pytest.approx(2)
    assert scene.frame_current == 1 and monkey.location.x == 0


def test_text_curves_surfaces_and_metaballs_arrive_as_meshes(add, both_sides):
    text = bpy.data.curves.new("Text", "FONT")
    text.body, text.extrude, text.bevel_depth = "Bg", 0.1, 0.02
    add(text, location=(-2, 0, 0), rotation_euler=(1.2, 0, 0))
    curve = bpy.data.curves.new("Curve", "CURVE")
    curve.dimensions, curve.bevel_depth = "3D", 0.15
    spline = curve.splines.new("BEZIER")
    spline.bezier_points.add(1)
    spline.bezier_points[1].co = (1, 1, 1)
    for point in spline.bezier_points:
        point.handle_left_type = point.handle_right_type = "AUTO"
    add(curve, location=(1, 0, 0))
    bpy.ops.surface.primitive_nurbs_surface_sphere_add(location=(0.5, -1, -0.5))
    ball = bpy.data.metaballs.new("Ball")
    ball.elements.new()
    ball.elements.new().co = (0.8, 0, 0)
    add(ball, location=(-1.5, 0.5, -1))
    sides = both_sides()
    sides.check()
    assert len(sides.exported.objects) == 4
    assert len(np.unique(sides.cycles["Object Index"])) == 5


def test_collection_instances_share_one_geometry(add, scene, both_sides, mesh_from):
    leaf = bpy.data.collections.new("Leaf")
    add(mesh_from("cone", radius1=0.3, depth=0.8), "Cone", collection=leaf)
    add(mesh_from("cube", size=0.3), "Cube", location=(0, 0, 0.5), collection=leaf)
    for i in range(5):
        add(
            None,
            f"Instancer {i}",
            location=(i - 2, 0, 0),
            rotation_euler=(0, 0, i),
            scale=(1, 1 + 0.2 * i, -1 if i == 3 else 1),
            instance_type="COLLECTION",
            instance_collection=leaf,
        )
    sides = both_sides()
    sides.check()
    assert len(sides.exported.geometries) == len(sides.exported.objects) == 2
    assert [len(placed.matrices) for placed in sides.exported.objects] == [5, 5]
    assert entry(sides.exported, "Cone").reason == "placed 5 times"


def test_instances_on_vertices_and_faces(add, both_sides, mesh_from):
    child = add(mesh_from("ico_sphere", radius=0.2), "Child")
    for kind, x in (("VERTS", -1.5), ("FACES", 1.5)):
        parent = add(mesh_from("cube", size=1.5), kind, location=(x, 0, 0), instance_type=kind)
        parent.show_instancer_for_render = kind == "FACES"
        copy = child.copy()
        bpy.context.scene.collection.objects.link(copy)
        copy.parent = parent
    bpy.data.objects.remove(child)
    sides = both_sides()
    sides.check()
    assert sorted(len(placed.matrices) for placed in sides.exported.objects) == [1, 6, 8]


def test_particles_are_instances(add, scene, both_sides, mesh_from):
    stone = add(mesh_from("ico_sphere", radius=0.15), "Stone", location=(0, 0, -50))
    ground = add(mesh_from("grid", size=5), "Ground")
    ground.modifiers.new("Particles", "PARTICLE_SYSTEM")
    settings = ground.particle_systems[0].settings
    settings.count, settings.frame_start, settings.frame_end, settings.lifetime = 60, 1, 1, 100
    settings.render_type, settings.instance_object = "OBJECT", stone
    settings.particle_size, settings.size_random, settings.use_rotations = 1.0, 0.7, True
    settings.physics_type, settings.normal_factor = "NO", 0
    scene.frame_set(2)
    sides = both_sides()
    sides.check()
    assert {placed.name: len(placed.matrices) for placed in sides.exported.objects} == {"Stone": 61, "Ground": 1}


def test_a_scatter_of_geometry_nodes(add, both_sides, mesh_from, node_group):
    """Points on a grid, each with an instance of a collection's objects, joined with the grid itself."""
    pebbles = bpy.data.collections.new("Pebbles")
    add(mesh_from("ico_sphere", radius=0.2), "Round", collection=pebbles)
    add(mesh_from("cube", size=0.3), "Square", collection=pebbles)
    ground = add(mesh_from("grid", size=5, x_subdivisions=6, y_subdivisions=6), "Ground")
    tree, source, target = node_group()
    collection = tree.nodes.new("GeometryNodeCollectionInfo")
    collection.inputs["Collection"].default_value = pebbles
    collection.inputs["Separate Children"].default_value = True
    collection.inputs["Reset Children"].default_value = True
    scatter, join = tree.nodes.new("GeometryNodeInstanceOnPoints"), tree.nodes.new("GeometryNodeJoinGeometry")
    scatter.inputs["Pick Instance"].default_value = True
    scatter.inputs["Rotation"].default_value = (0.3, 0.2, 0.1)
    tree.links.new(source.outputs[0], scatter.inputs["Points"])
    tree.links.new(collection.outputs[0], scatter.inputs["Instance"])
    tree.links.new(source.outputs[0], join.inputs[0])
    tree.links.new(scatter.outputs[0], join.inputs[0])
    tree.links.new(join.outputs[0], target.inputs[0])
    ground.modifiers.new("Scatter", "NODES").node_group = tree
    sides = both_sides()
    sides.check()
    counts = {placed.name: len(placed.matrices) for placed in sides.exported.objects}
    assert sum(counts.values()) == 50 and set(counts) == {"Ground", "Round", "Square"}
    assert len(sides.exported.geometries) == len(sides.exported.objects) == 3


@pytest.mark.parametrize("recenter", [False, True])
@pytest.mark.parametrize("is_shown", ["itself", "a collection", "nodes' instances", "nodes' geometry"])
def test_a_mesh_in_edit_mode_is_also_shown_by_others(add, both_sides, mesh_from, node_group, is_shown, recenter):
    """The mesh that was made of it was freed by the next one, and geometry nodes showed nothing."""
    group, mesh = bpy.data.collections.new("Group"), mesh_from("monkey")
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    for edge in mesh.edges:
        edge.use_edge_sharp = edge.index % 4 == 0
    for name in ("Red", "Green"):
        mesh.materials.append(bpy.data.materials.new(name))
    mesh.polygons.foreach_set("material_index", [face.index % 2 for face in mesh.polygons])
    edited = add(mesh, "Edited", collection=group)
    bpy.context.scene.collection.children.link(group)
    if is_shown == "a collection":
        for i in (-1, 1):
            add(None, f"Instancer {i}", location=(2 * i, 0, 0), instance_type="COLLECTION", instance_collection=group)
    elif is_shown != "itself":
        tree, source, target = node_group()
        info, scatter = tree.nodes.new("GeometryNodeObjectInfo"), tree.nodes.new("GeometryNodeInstanceOnPoints")
        info.inputs["Object"].default_value, info.inputs["As Instance"].default_value = edited, "instances" in is_shown
        tree.links.new(source.outputs[0], scatter.inputs["Points"])
        tree.links.new(info.outputs["Geometry"], scatter.inputs["Instance"])
        tree.links.new(scatter.outputs[0], target.inputs[0])
        add(mesh_from("plane", size=4), "Ground").modifiers.new("Scatter", "NODES").node_group = tree
    bpy.context.view_layer.objects.active = edited
    bpy.ops.object.mode_set(mode="EDIT")
    sides = both_sides(recenter=recenter)
    bpy.ops.object.mode_set(mode="OBJECT")
    sides.check()
    assert sum(len(placed.matrices) for placed in sides.exported.objects) == {"itself": 1, "a collection": 3}.get(is_shown, 5)
    assert set(np.unique(sides.cycles["Material Index"])) == {0, 1, 2}


def test_a_lawn_of_ten_thousand_tufts_is_one_object_of_as_many_matrices(add, both_sides, mesh_from, node_group):
    tuft = add(mesh_from("ico_sphere", radius=0.03), "Tuft", location=(0, 0, -9))
    lawn = add(mesh_from("grid", size=5, x_subdivisions=99, y_subdivisions=99), "Lawn")
    corners = np.array([vertex.co for vertex in lawn.data.vertices])
    tree, source, target = node_group()
    object_info, scatter = tree.nodes.new("GeometryNodeObjectInfo"), tree.nodes.new("GeometryNodeInstanceOnPoints")
    object_info.inputs["Object"].default_value, object_info.inputs["As Instance"].default_value = tuft, True
    tree.links.new(source.outputs[0], scatter.inputs["Points"])
    tree.links.new(object_info.outputs["Geometry"], scatter.inputs["Instance"])
    tree.links.new(scatter.outputs[0], target.inputs[0])
    lawn.modifiers.new("Scatter", "NODES").node_group = tree
    sides = both_sides()
    sides.check()
    (tufts,) = sides.exported.objects
    places = {tuple(place) for place in tufts.matrices[:, :3, 3].astype(np.float32).tolist()}
    assert places == {*map(tuple, corners.astype(np.float32).tolist()), (0, 0, -9)}
    assert len(tufts.matrices) == 100 * 100 + 1 and entry(sides.exported, "Tuft").reason == "placed 10001 times"


def test_geometry_nodes_know_that_this_is_a_render(add, both_sides, mesh_from, node_group):
    block = add(mesh_from("cube"), "Switched")
    tree, source, target = node_group()
    viewport, switch = tree.nodes.new("GeometryNodeIsViewport"), tree.nodes.new("GeometryNodeSwitch")
    sphere, switch.input_type = tree.nodes.new("GeometryNodeMeshIcoSphere"), "GEOMETRY"
    tree.links.new(viewport.outputs[0], switch.inputs["Switch"])
    tree.links.new(source.outputs[0], switch.inputs["True"])
    tree.links.new(sphere.outputs[0], switch.inputs["False"])
    tree.links.new(switch.outputs[0], target.inputs[0])
    block.modifiers.new("Nodes", "NODES").node_group = tree
    sides = both_sides()
    sides.check()
    assert len(next(iter(sides.exported.geometries.values())).triangles) == 20


def test_excluded_hidden_and_indirect_collections(add, scene, both_sides, mesh_from):
    cube = mesh_from("cube", size=0.8)
    layers = {}
    for i, name in enumerate(("Shown", "Excluded", "Hidden", "Disabled", "Indirect")):
        collection = bpy.data.collections.new(name)
        scene.collection.children.link(collection)
        add(cube, name, location=(i - 2, 0, 0), collection=collection)
        layers[name] = bpy.context.view_layer.layer_collection.children[name]
    layers["Excluded"].exclude = True
    layers["Hidden"].hide_viewport = True  # in the window only
    bpy.data.collections["Disabled"].hide_render = True
    layers["Indirect"].indirect_only = True
    sides = both_sides()
    sides.check()
    assert {placed.name for placed in sides.exported.objects} == {"Shown", "Hidden"}
    assert entry(sides.exported, "Indirect").reason == "not visible to the camera"


def test_ray_visibility_of_object_and_instancer(add, both_sides, mesh_from):
    cube = mesh_from("cube", size=0.8)
    add(cube, "Shown", location=(-1.5, 0, 0))
    add(cube, "Shadow only", location=(0, 0, 0)).visible_camera = False
    collection = bpy.data.collections.new("Instanced")
    add(cube, "Inside", collection=collection)
    add(
        None,
        "Instancer",
        location=(1.5, 0, 0),
        instance_type="COLLECTION",
        instance_collection=collection,
        visible_camera=False,
    )
    sides = both_sides()
    sides.check()
    assert [placed.name for placed in sides.exported.objects] == ["Shown"]


def test_holdouts_and_shadow_catchers_are_plain_objects_on_both_sides(add, scene, both_sides, mesh_from):
    cube = mesh_from("cube", size=0.8)
    add(cube, "Plain", location=(-2, 0, 0))
    add(cube, "Holdout", location=(-0.7, 0, 0)).is_holdout = True
    add(cube, "Catcher", location=(0.7, 0, 0)).is_shadow_catcher = True
    collection = bpy.data.collections.new("Held out")
    scene.collection.children.link(collection)
    add(cube, "In collection", location=(2, 0, 0), collection=collection)
    bpy.context.view_layer.layer_collection.children["Held out"].holdout = True
    sides = both_sides()
    sides.check()
    approximated = {each.object for each in sides.exported.ledger if each.status == "approximated"}
    assert approximated == {"Holdout", "Catcher", "In collection"}
    assert len(np.unique(sides.cycles["Object Index"])) == 5
    assert bpy.context.view_layer.layer_collection.children["Held out"].holdout and bpy.data.objects["Holdout"].is_holdout


def test_a_holdout_that_the_camera_does_not_see_is_hidden_on_both_sides(add, scene, both_sides, mesh_from):
    """Cycles shows the hole all the same, and a plain object in its place to other rays only."""
    cube = mesh_from("cube", size=0.8)
    add(cube, "Plain", location=(-1, 0, 0))
    collection = bpy.data.collections.new("Indirect")
    scene.collection.children.link(collection)
    add(cube, "Holdout", location=(1, 0, 0), collection=collection).is_holdout = True
    bpy.context.view_layer.layer_collection.children["Indirect"].indirect_only = True
    sides = both_sides()
    sides.check()
    assert {placed.name for placed in sides.exported.objects} == {"Plain"}


def test_objects_of_a_background_set_are_shown_and_its_holdouts_are_plain_on_both_sides(add, scene, both_sides, mesh_from):
    cube = mesh_from("cube", size=0.8)
    add(cube, "Own", location=(-1, 0, 0))
    scene.background_set = bpy.data.scenes.new("Set")
    for name, x in (("Plain", 0), ("Holdout", 1)):
        add(cube, name, location=(x, 0, 0), collection=scene.background_set.collection)
    bpy.data.objects["Holdout"].is_holdout = True
    sides = both_sides()
    sides.check()
    assert {placed.name for placed in sides.exported.objects} == {"Own", "Plain", "Holdout"}
    assert [each.object for each in sides.exported.ledger if each.status == "approximated"] == ["Holdout"]


@pytest.fixture
def two_layers(add, scene, mesh_from):
    """View layers ViewLayer and Other, each with a cube of its own, First and Second."""
    cube = mesh_from("cube")
    first, second = bpy.data.collections.new("First"), bpy.data.collections.new("Second")
    for collection, x in ((first, -1.5), (second, 1.5)):
        scene.collection.children.link(collection)
        add(cube, collection.name, location=(x, 0, 0), collection=collection)
    other = scene.view_layers.new("Other")
    other.layer_collection.children["First"].exclude = True
    scene.view_layers[0].layer_collection.children["Second"].exclude = True
    return scene.view_layers[0], other


def test_one_view_layer_is_compared_and_the_others_are_told(two_layers, both_sides):
    sides = both_sides()
    sides.check()
    assert [placed.name for placed in sides.exported.objects] == ["First"]
    assert entry(sides.exported, "view layer Other").status == "exported"  # another picture, of which nothing is lost here
    assert all(layer.use for layer in two_layers)


def test_a_view_layer_that_is_not_rendered_is_not_compared(two_layers, both_sides):
    two_layers[0].use = False
    sides = both_sides()
    sides.check()
    assert [placed.name for placed in sides.exported.objects] == ["Second"]
    assert not two_layers[0].use


def test_strict_names_what_can_not_be_modeled(add, mesh_from):
    add(mesh_from("cube"), "Ghost").is_holdout = True
    with pytest.raises(NotModeledError, match="'Ghost' can't be modeled, a holdout"):
        jobs.export(Job(strict=True))


def test_hair_and_volumes_are_skipped_on_both_sides(add, monkey, both_sides):
    monkey.modifiers.new("Hair", "PARTICLE_SYSTEM")
    settings = monkey.particle_systems[0].settings
    settings.type, settings.count, settings.hair_length = "HAIR", 100, 2
    add(bpy.data.hair_curves.new("Curves"))
    add(bpy.data.volumes.new("Volume"))
    sides = both_sides()
    sides.check()
    assert (entry(sides.exported, monkey.name).status, entry(sides.exported, monkey.name).reason) == (
        "approximated",
        "particle hair is not modeled",
    )
    assert entry(sides.exported, "Curves").status == entry(sides.exported, "Volume").status == "skipped"
    assert isinstance(next(iter(sides.exported.geometries.values())), Mesh)


def test_hair_that_is_off_in_renders_is_not_told(monkey, both_sides):
    monkey.modifiers.new("Hair", "PARTICLE_SYSTEM").show_render = False
    monkey.particle_systems[0].settings.type = "HAIR"
    of_monkey = entry(both_sides().exported, monkey.name)
    assert of_monkey.status == "exported", of_monkey


# --- Meshes, normals, UV maps, materials and point clouds are read as Cycles reads them: rendered by both sides and compared


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


def test_an_empty_slot_of_an_object_beside_an_empty_one_of_its_mesh(add, both_sides, mesh_from):
    """Until 5.0 it shows the mesh's material, and the stand-in for what has none must not."""
    cube, red = mesh_from("cube"), bpy.data.materials.new("Red")
    red.pass_index = 5
    for material in (red, None):
        cube.materials.append(material)
    cube.polygons.foreach_set("material_index", [0, 1, 0, 1, 0, 1])
    own = add(cube, "Own", rotation_euler=(2.5, 0.5, 0.5))
    own.material_slots[0].link = "OBJECT"
    own.material_slots[0].material = None
    sides = both_sides()
    sides.check()
    indices = {0, 5} if bpy.app.version < (5, 1) else {0}
    assert set(np.unique(sides.cycles["Material Index"])) == indices


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

    kinds : some of "sharp edges", "flat faces", "flipped faces", "fins" (edges of three faces), "tips" (faces that share a
        vertex).
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
    folded_mesh = bpy.data.meshes.new("Folded")
    folded_mesh.from_pydata(places, [], faces)
    folded_mesh.polygons.foreach_set("use_smooth", ["flat faces" not in kinds or draw.random() > 0.1 for _ in faces])
    for edge in folded_mesh.edges if "sharp edges" in kinds else ():
        edge.use_edge_sharp = draw.random() < 0.15
    folded_mesh.update()
    return folded_mesh


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


@pytest.mark.skipif(bpy.app.version < (4, 5), reason="meshes keep custom normals as two angles of 16 bits")
def test_custom_normals_that_differ_about_a_vertex_are_those_of_cycles(add, both_sides, mesh_from):
    mesh = folded(mesh_from, 3, ())
    kept = mesh.attributes.new("custom_normal", "FLOAT_VECTOR", "CORNER")
    normals = np.random.default_rng(3).normal((0, 0, 1), 0.3, (len(mesh.loops), 3))
    kept.data.foreach_set("vector", (normals / np.linalg.norm(normals, axis=1, keepdims=True)).ravel())
    add(mesh)
    both_sides().check()


@pytest.mark.parametrize("are_smooth", ["all", "some", "none is marked"])
def test_faces_that_are_smooth_between_edges_that_are_all_sharp(monkey, both_sides, are_smooth):
    """Blender has the normals of faces there; Cycles those of vertices, unless no face is marked as smooth or flat."""
    mesh = monkey.data
    mesh.edges.foreach_set("use_edge_sharp", [True] * len(mesh.edges))
    mesh.polygons.foreach_set("use_smooth", [are_smooth == "all" or index % 3 > 0 for index in range(len(mesh.polygons))])
    if are_smooth == "none is marked":
        mesh.attributes.remove(mesh.attributes["sharp_face"])
    assert mesh.normals_domain == "FACE"
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


def test_points_without_a_place_or_a_radius_are_left_out_and_told(beads, both_sides, node_group):
    beads.data.vertices[0].co.x = float("nan")
    radius = beads.data.attributes.new("size", "FLOAT", "POINT")
    radius.data.foreach_set("value", [-0.2, -0.2, float("nan"), float("inf"), 0, *[0.2] * 31])
    tree, source, target = node_group()
    named, store = tree.nodes.new("GeometryNodeInputNamedAttribute"), tree.nodes.new("GeometryNodeStoreNamedAttribute")
    named.inputs["Name"].default_value, store.inputs["Name"].default_value = "size", "radius"
    tree.links.new(named.outputs[0], store.inputs["Value"])
    tree.links.new(source.outputs[0], store.inputs["Geometry"])
    tree.links.new(store.outputs[0], target.inputs[0])
    beads.modifiers.new("Sizes", "NODES").node_group = tree
    sides = both_sides()
    sides.check()
    assert "4 points have a place that is not finite or no radius" in entry(sides.exported, "Beads").reason


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
    center, size = corners.mean(axis=0), np.ptp(corners, axis=0).max()
    group = camera.virtual_pinhole
    group.look_at, group.eye, group.distance = center, center + size * np.array((0.9, -1.8, 0.9)), 640
    group.enabled = True
    camera.data.clip_start, camera.data.clip_end = size / 100, size * 100
    both_sides().check()


# --- Objects without a material in Cycles' render: one stand-in for all of them, so that their number is no square of time


def bare_objects(count):
    """Objects of one triangle without a material, each a mesh of its own."""
    objects = []
    for _ in range(count):
        mesh = bpy.data.meshes.new("Bare")
        mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
        objects.append(bpy.data.objects.new("Bare", mesh))
        bpy.context.scene.collection.objects.link(objects[-1])
    return objects


def test_all_objects_without_a_material_share_one_stand_in_which_is_removed_once(fresh_blender):
    objects = bare_objects(30)
    with overridden() as overrides:
        for each in objects:
            materials.fill_empty_slots(overrides, each)
        (stand_in,) = bpy.data.materials
        assert all([slot.material for slot in each.material_slots] == [stand_in] for each in objects)
    assert not bpy.data.materials and not any(each.material_slots for each in objects)


def test_empty_slots_are_filled_and_empty_again_beside_those_that_are_not(fresh_blender):
    (bare,) = bare_objects(1)
    own = bpy.data.materials.new("Own")
    bare.data.materials.append(None)
    bare.data.materials.append(own)
    with overridden() as overrides:
        materials.fill_empty_slots(overrides, bare)
        assert None not in [slot.material for slot in bare.material_slots]
    assert [slot.material for slot in bare.material_slots] == [None, own] and list(bpy.data.materials) == [own]


def test_each_loan_has_a_stand_in_of_its_own(fresh_blender):
    first, second = bare_objects(2)
    for each in (first, second):
        with overridden() as overrides:
            materials.fill_empty_slots(overrides, each)
            assert len(bpy.data.materials) == 1
    assert not bpy.data.materials
