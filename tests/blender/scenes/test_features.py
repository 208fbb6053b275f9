"""Features that the tracer lacks are told, and taken out of Cycles' picture, so that the rest is the same on both sides."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from mathutils import Matrix

from viewcam_addon.blender import versions
from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.blender.scenes import materials
from viewcam_addon.comparison import geometry
from viewcam_addon.image import Image
from viewcam_addon.jobs.job import Job
from viewcam_addon.tracer import render

pytestmark = pytest.mark.slow


@pytest.fixture
def monkey(scene, camera_object):
    """Suzanne, smooth, before a camera."""
    camera_object.location = (0, 0, 5)
    bpy.ops.mesh.primitive_monkey_add(rotation=(-0.4, 0.1, 0.3))
    bpy.ops.object.shade_smooth()
    return bpy.context.object


@pytest.fixture
def material(monkey):
    """The monkey's material: a Principled surface, and nothing else."""
    material = bpy.data.materials.new("Skin")
    if not material.node_tree:  # new materials have one from 5.0 on
        material.use_nodes = True
    monkey.data.materials.append(material)
    return material


def add_node(material, kind, output, socket, node="Material Output"):
    """Link a new node's output to a socket of another node."""
    tree = material.node_tree
    added = tree.nodes.new(kind)
    tree.links.new(added.outputs[output], tree.nodes[node].inputs[socket])
    return added


def make_see_through(material):
    material.node_tree.nodes["Principled BSDF"].inputs["Alpha"].default_value = 0.5


def make_invisible(material):
    add_node(material, "ShaderNodeBsdfTransparent", "BSDF", "Surface")


def make_holdout(material):
    add_node(material, "ShaderNodeHoldout", "Holdout", "Surface")


def make_bumpy(material):
    bump = add_node(material, "ShaderNodeBump", "Normal", "Normal", "Principled BSDF")
    material.node_tree.links.new(material.node_tree.nodes.new("ShaderNodeTexNoise").outputs[0], bump.inputs["Height"])


def make_turned(material):
    vector = add_node(material, "ShaderNodeCombineXYZ", 0, "Normal", "Principled BSDF")
    vector.inputs[0].default_value = 1


def make_displaced(material):
    displacement = add_node(material, "ShaderNodeDisplacement", 0, "Displacement")
    displacement.inputs["Scale"].default_value, displacement.inputs["Height"].default_value = 1, 1
    material.displacement_method = "DISPLACEMENT"


def make_misty(material):
    add_node(material, "ShaderNodeVolumeScatter", 0, "Volume")


def make_volume_only(material):
    make_misty(material)
    material.node_tree.nodes.remove(material.node_tree.nodes["Principled BSDF"])


def make_without_output(material):
    material.node_tree.nodes.remove(material.node_tree.nodes["Material Output"])


def make_bumpy_in_a_group(material):
    group = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    group.interface.new_socket("Normal", in_out="OUTPUT", socket_type="NodeSocketVector")
    bump, target = group.nodes.new("ShaderNodeNormalMap"), group.nodes.new("NodeGroupOutput")
    bump.inputs["Color"].default_value = (1, 0.5, 0.5, 1)
    group.links.new(bump.outputs[0], target.inputs[0])
    node = material.node_tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    material.node_tree.links.new(node.outputs[0], material.node_tree.nodes["Principled BSDF"].inputs["Normal"])


DEPARTURES = {
    make_see_through: "is transparent",
    make_invisible: "is transparent",
    make_holdout: "is transparent",
    make_bumpy: "turns the normals",
    make_turned: "turns the normals",
    make_displaced: "is displaced",
    make_misty: "has a volume",
    make_without_output: "has no output",
    make_bumpy_in_a_group: "turns the normals",
}


@pytest.mark.parametrize("depart", DEPARTURES, ids=lambda depart: depart.__name__)
def test_a_plain_material_stands_in(monkey, material, both_sides, depart):
    depart(material)
    sides = both_sides()
    sides.check()
    (entry,) = sides.exported.ledger
    assert entry.status == "approximated" and DEPARTURES[depart] in entry.reason and "'Skin'" in entry.reason
    assert not any(node.type == "BSDF_DIFFUSE" for node in material.node_tree.nodes)


def test_a_box_of_fog_is_left_out_on_both_sides(monkey, material, both_sides):
    """An opaque box stood in for it, and around a scene both sides were black and called the same."""
    bpy.ops.mesh.primitive_cube_add(size=30)
    fog = bpy.data.materials.new("Fog")
    if not fog.node_tree:
        fog.use_nodes = True
    make_volume_only(fog)
    box = bpy.context.object
    box.data.materials.append(fog)
    sides = both_sides()
    sides.check()
    reasons = {entry.object: (entry.status, entry.reason) for entry in sides.exported.ledger}
    assert reasons[box.name] == ("skipped", "material 'Fog' is a volume without a surface, which is not modeled")
    assert [placed.name for placed in sides.exported.objects] == [monkey.name]
    assert fog.node_tree.nodes.get("Transparent BSDF") is None


def test_faces_of_fog_beside_others_are_left_out_on_both_sides(monkey, material, both_sides):
    fog = bpy.data.materials.new("Fog")
    if not fog.node_tree:
        fog.use_nodes = True
    make_volume_only(fog)
    monkey.data.materials.append(fog)
    everything = both_sides().comparison.hits[1]
    monkey.data.polygons.foreach_set("material_index", [face.index % 3 == 0 for face in monkey.data.polygons])
    sides = both_sides()
    sides.check()
    assert sides.comparison.hits[1] < everything
    assert [entry.status for entry in sides.exported.ledger] == ["approximated"]


def test_a_lamp_shines_through_a_box_of_fog_on_both_sides(monkey, material, add_lamp, read_passes, tmp_path):
    bpy.context.scene.render.resolution_x = bpy.context.scene.render.resolution_y = 32
    add_lamp("SUN", energy=2.0)
    bpy.ops.mesh.primitive_cube_add(size=3)
    fog = bpy.data.materials.new("Fog")
    if not fog.node_tree:
        fog.use_nodes = True
    make_volume_only(fog)
    bpy.context.object.data.materials.append(fog)
    exported = jobs.both_sides(Job(threads=2, level="direct", samples=16), [tmp_path / "lit.exr"])
    (cycles_passes,) = read_passes([tmp_path / "lit.exr"])
    traced = render.render(exported, "direct", 16, threads=2)
    means = [passes["Combined"][..., :3].mean() for passes in (traced, cycles_passes)]
    assert means[0] > 0.05 and means[0] == pytest.approx(means[1], rel=0.05), means  # 16 samples of 1,024 pixels


@pytest.mark.parametrize("depart", [make_invisible, make_bumpy, make_displaced], ids=lambda depart: depart.__name__)
def test_without_its_stand_in_the_comparison_fails(monkey, material, both_sides, depart, monkeypatch):
    """The tests above must be able to fail."""
    depart(material)
    monkeypatch.setattr(materials, "make_plain", lambda overrides, material: None)
    assert not both_sides().comparison.passed


@pytest.mark.parametrize("kind", ["Principled", "Glossy", "Glass", "Diffuse", "Toon", "Sheen", "Translucent", "Refraction"])
def test_opaque_shaders_need_no_stand_in(monkey, material, both_sides, kind):
    """Smooth surfaces seen at a grazing angle: Cycles would bend the normals of those that reflect."""
    if kind != "Principled":
        node = material.node_tree.nodes.new(f"ShaderNodeBsdf{kind}")
        material.node_tree.links.new(node.outputs["BSDF"], material.node_tree.nodes["Material Output"].inputs["Surface"])
    sides = both_sides()
    sides.check()
    assert [entry.status for entry in sides.exported.ledger] == ["exported"]


def test_an_emitting_surface_needs_no_stand_in(monkey, material, both_sides):
    add_node(material, "ShaderNodeEmission", 0, "Surface")
    sides = both_sides()
    sides.check()
    assert [entry.status for entry in sides.exported.ledger] == ["exported"]


def test_muted_nodes_do_nothing(material):
    make_bumpy(material)
    make_invisible(material)
    for node in material.node_tree.nodes:
        node.mute = node.type in ("BUMP", "BSDF_TRANSPARENT")
    assert "is transparent" not in materials.departures(material)


def test_a_material_whose_shader_is_muted_has_no_surface(material):
    (shader,) = (node for node in material.node_tree.nodes if not node.type.startswith("OUTPUT"))
    shader.mute = True
    assert materials.departures(material) == ["has no surface"]


def test_adaptive_subdivision_is_subdivision_at_the_render_level(monkey, scene, both_sides):
    subdivision = monkey.modifiers.new("Subdivision", "SUBSURF")
    subdivision.levels, subdivision.render_levels = 0, 1
    if hasattr(subdivision, "use_adaptive_subdivision"):
        subdivision.use_adaptive_subdivision = True
    else:
        scene.cycles.feature_set, monkey.cycles.use_adaptive_subdivision = "EXPERIMENTAL", True
    sides = both_sides()
    sides.check()
    assert len(next(iter(sides.exported.geometries.values())).triangles) == 3936
    (entry,) = sides.exported.ledger
    assert entry.status == "approximated" and "adaptive subdivision" in entry.reason


def test_depth_of_field_stereo_and_motion_blur_are_off_on_both_sides(monkey, scene, camera_object, both_sides):
    camera_object.data.dof.use_dof, camera_object.data.dof.focus_distance = True, 1
    camera_object.data.dof.aperture_fstop = 0.1
    scene.render.use_multiview = scene.render.use_motion_blur = True
    monkey.keyframe_insert("location", frame=1)
    monkey.location = (3, 0, 0)
    monkey.keyframe_insert("location", frame=2)
    scene.frame_set(1)
    sides = both_sides()
    sides.check()
    (entry,) = [entry for entry in sides.exported.ledger if entry.status == "approximated"]
    assert entry.object == "Camera" and all(word in entry.reason for word in ("Depth of field", "Stereoscopy", "Motion blur"))


@pytest.mark.parametrize("driven", [False, True])
def test_what_is_off_on_both_sides_is_off_where_it_is_keyed_or_driven(monkey, scene, camera_object, both_sides, driven):
    dof = camera_object.data.dof
    dof.use_dof, dof.focus_distance, dof.aperture_fstop = True, 1, 0.1
    scene.cycles.film_exposure, monkey.is_shadow_catcher = 3, True
    settings = (camera_object.data, "dof.use_dof"), (scene, "cycles.film_exposure"), (monkey, "is_shadow_catcher")
    for owner, path in settings:
        if driven:
            owner.driver_add(path).driver.expression = "1"
        else:
            owner.keyframe_insert(path, frame=1)
    both_sides().check()
    assert not any(curve.mute for owner, _ in settings for curve in versions.all_curves(owner))


def test_a_world_full_of_fog_is_left_out(monkey, scene, both_sides):
    world = bpy.data.worlds.new("Fog")
    if not world.node_tree:
        world.use_nodes = True
    output = next(node for node in world.node_tree.nodes if node.type == "OUTPUT_WORLD")
    scatter = world.node_tree.nodes.new("ShaderNodeVolumeScatter")
    scatter.inputs["Density"].default_value = 1
    world.node_tree.links.new(scatter.outputs[0], output.inputs["Volume"])
    scene.world = world
    sides = both_sides()
    sides.check()
    assert [entry.object for entry in sides.exported.ledger if entry.status == "approximated"] == ["Fog"]
    assert scene.world == world


def test_lights_leave_no_mark(monkey, scene, both_sides):
    bpy.ops.object.light_add(type="AREA", radius=3, location=(0, 0, 2), rotation=(3.1, 0, 0))
    sides = both_sides()
    sides.check()
    (entry,) = [entry for entry in sides.exported.ledger if entry.object == "Area"]
    assert entry.status == "exported" and "a light" in entry.reason


def test_compositor_sequencer_and_film_do_not_matter(monkey, scene, both_sides):
    scene.render.film_transparent = True
    scene.cycles.film_exposure = 3
    strips = scene.sequence_editor_create()
    strips = strips.strips if hasattr(strips, "strips") else strips.sequences
    strips.new_effect("Color", "COLOR", 1, frame_start=1, **({"length": 9} if bpy.app.version >= (5, 0) else {"frame_end": 10}))
    both_sides().check()


def test_simplify_is_the_artists_on_both_sides_and_cycles_culls_nothing(monkey, scene, both_sides):
    subdivision = monkey.modifiers.new("Subdivision", "SUBSURF")
    subdivision.render_levels = 3
    scene.render.use_simplify, scene.render.simplify_subdivision_render = True, 1
    scene.cycles.use_distance_cull, scene.cycles.distance_cull_margin = True, 0.5
    monkey.cycles.use_distance_cull = True
    sides = both_sides()
    sides.check()
    assert len(next(iter(sides.exported.geometries.values())).triangles) == 3936


@pytest.mark.parametrize("shared", [False, True])
def test_a_surface_flattened_by_its_scale(scene, camera_object, both_sides, shared):
    camera_object.location = (0, 0, 5)
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=9, y_subdivisions=9)
    grid = bpy.context.object
    for vertex in grid.data.vertices:
        vertex.co.z = 0.2 * (vertex.index % 3)
    bpy.ops.object.shade_smooth()
    grid.scale, grid.rotation_euler = (1, 1, 0), (0.3, 0.2, 0)
    if shared:
        other = grid.copy()
        scene.collection.objects.link(other)
        other.location.x, other.scale.z = 2, 1
    sides = both_sides()
    sides.check()
    assert len(sides.exported.objects) == 1


def test_triangles_that_are_nowhere_are_left_out_and_told(monkey, both_sides):
    bpy.ops.mesh.primitive_cube_add(location=(1.3, 0.5, 1), size=0.5)
    bpy.context.object.data.vertices[7].co.x = float("nan")
    sides = both_sides()
    sides.check()
    (entry,) = [entry for entry in sides.exported.ledger if entry.object == "Cube"]
    assert "triangles have vertices that are not finite" in entry.reason
    assert len(sides.exported.geometries["Cube"].triangles) < 12


def test_objects_that_are_nowhere_are_left_out_and_told(monkey, both_sides):
    lost = monkey.copy()
    bpy.context.collection.objects.link(lost)
    lost.rotation_euler.x = float("nan")
    sides = both_sides()
    sides.check()
    (entry,) = [entry for entry in sides.exported.ledger if entry.object == lost.name]
    assert "has a transform that is not finite, and Cycles does not draw it" in entry.reason


def test_grease_pencil_is_skipped(monkey, both_sides, opengl):
    bpy.ops.object.grease_pencil_add(type="MONKEY") if bpy.app.version >= (4, 3) else bpy.ops.object.gpencil_add(type="MONKEY")
    pencil = bpy.context.object
    sides = both_sides()
    sides.check()
    (entry,) = [entry for entry in sides.exported.ledger if entry.object == pencil.name]
    assert (entry.status, entry.reason) == ("skipped", "Grease Pencil is not modeled")


def sphere_of_nodes():
    """A tree of geometry nodes that make a smooth sphere without a material: (tree, its output)."""
    tree = bpy.data.node_groups.new("Sphere", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    sphere, shade = tree.nodes.new("GeometryNodeMeshUVSphere"), tree.nodes.new("GeometryNodeSetShadeSmooth")
    target = tree.nodes.new("NodeGroupOutput")
    tree.links.new(sphere.outputs[0], shade.inputs[0])
    tree.links.new(shade.outputs[0], target.inputs[0])
    return tree, shade.outputs[0]


@pytest.mark.parametrize("is_instanced", [False, True])
def test_what_geometry_nodes_make_without_a_material_has_one_for_a_while(monkey, both_sides, is_instanced):
    """Since 5.0 Cycles bends the normals of what has none where they graze."""
    tree, output = sphere_of_nodes()
    if is_instanced:
        line, place = tree.nodes.new("GeometryNodeMeshLine"), tree.nodes.new("GeometryNodeInstanceOnPoints")
        line.inputs["Count"].default_value = 2
        tree.links.new(line.outputs[0], place.inputs["Points"])
        tree.links.new(output, place.inputs["Instance"])
        tree.links.new(place.outputs[0], next(node for node in tree.nodes if node.type == "GROUP_OUTPUT").inputs[0])
    monkey.modifiers.new("Nodes", "NODES").node_group = tree
    sides = both_sides()
    sides.check()
    assert {entry.status for entry in sides.exported.ledger} == {"exported"}, sides.exported.ledger
    assert [modifier.name for modifier in monkey.modifiers] == ["Nodes"] and list(bpy.data.node_groups) == [tree]


@pytest.mark.skipif(bpy.app.version < (5, 0), reason="nothing is bent where there is no material")
def test_what_nodes_make_beside_other_objects_that_they_place_is_told(monkey, both_sides, add, mesh_from):
    """A node that sets materials would make these the object's own."""
    other = add(mesh_from("cube", size=0.5), "Other", location=(2, 0, 0))
    tree, output = sphere_of_nodes()
    line, place, join = (tree.nodes.new(f"GeometryNode{kind}") for kind in ("MeshLine", "InstanceOnPoints", "JoinGeometry"))
    source = tree.nodes.new("GeometryNodeObjectInfo")
    source.inputs["Object"].default_value, source.inputs["As Instance"].default_value = other, True
    tree.links.new(line.outputs[0], place.inputs["Points"])
    tree.links.new(source.outputs["Geometry"], place.inputs["Instance"])
    for each in (output, place.outputs[0]):
        tree.links.new(each, join.inputs[0])
    tree.links.new(join.outputs[0], next(node for node in tree.nodes if node.type == "GROUP_OUTPUT").inputs[0])
    monkey.modifiers.new("Nodes", "NODES").node_group = tree
    sides = both_sides()
    rows = {row.name: row.ok for row in sides.comparison.rows}
    assert all(ok for name, ok in rows.items() if name != "Normal"), rows
    (reason,) = [entry.reason for entry in sides.exported.ledger if entry.status == "approximated"]
    assert "may bend its normals" in reason, reason


def test_an_empty_slot_that_no_face_uses_is_not_told(monkey, both_sides, node_group):
    """Geometry nodes leave one before the slot of the material that they set."""
    tree, source, target = node_group()
    paint = tree.nodes.new("GeometryNodeSetMaterial")
    paint.inputs["Material"].default_value = bpy.data.materials.new("Paint")
    tree.links.new(source.outputs[0], paint.inputs["Geometry"])
    tree.links.new(paint.outputs[0], target.inputs[0])
    monkey.modifiers.new("Nodes", "NODES").node_group = tree
    sides = both_sides()
    sides.check()
    (entry,) = sides.exported.ledger
    assert entry.status == "exported", entry.reason


@pytest.mark.parametrize("kind", ["shared data", "copied data", "one mesh"])
def test_triangles_that_lie_exactly_where_others_do_are_told(monkey, scene, add_lamp, kind):
    from viewcam_addon.blender.jobs import renderer as jobs
    from viewcam_addon.jobs.job import Job

    def reasons(level="direct"):
        ledger = jobs.export(Job(level=level)).ledger
        assert all(entry.status == "exported" for entry in ledger), "where it matters is the comparison's to find"
        return [entry.reason for entry in ledger if "lie exactly" in entry.reason]

    add_lamp("SUN")
    assert not reasons()
    double = monkey.copy()
    if kind != "shared data":
        double.data = monkey.data.copy()
    scene.collection.objects.link(double)
    if kind == "one mesh":
        with bpy.context.temp_override(active_object=monkey, selected_editable_objects=[monkey, double]):
            bpy.ops.object.join()
    for level in ("direct", "geometry"):
        (reason,) = reasons(level)
        assert ("others of it" if kind == "one mesh" else "those of") in reason
    if kind != "one mesh":
        double.location.x += 1e-5
        assert not reasons()


def test_instances_in_one_place_and_doubles_within_them_are_told(monkey, scene, add):
    from viewcam_addon.blender.jobs import renderer as jobs
    from viewcam_addon.jobs.job import Job

    def reasons():
        reasons = [entry.reason for entry in jobs.export(Job(level="geometry")).ledger]
        return [clause.partition(":")[0] for reason in reasons for clause in reason.split("; ") if "lie exactly" in clause]

    def instance(number, location):
        place = add(None, f"Place {number}", location=location)
        place.instance_type, place.instance_collection = "COLLECTION", collection

    collection = bpy.data.collections.new("Instanced")
    scene.collection.objects.unlink(monkey)
    collection.objects.link(monkey)
    instance(1, (1, 0, 0))
    instance(2, (-1, 0, 0))
    assert not reasons()
    instance(3, (1, 0, 0))
    assert reasons() == ["1 instances lie exactly where others of it do"]
    bpy.data.objects["Place 3"].location.x = 0
    with bpy.context.temp_override():
        mesh = monkey.data
        vertices = np.empty(3 * len(mesh.vertices))
        mesh.vertices.foreach_get("co", vertices)
        faces = [list(face.vertices) for face in mesh.polygons]
        count = len(mesh.vertices)
        doubled = bpy.data.meshes.new("Doubled")
        twins = [[index + count for index in face] for face in faces[:5]]
        doubled.from_pydata(np.tile(vertices.reshape(-1, 3), (2, 1)).tolist(), [], faces + twins)
        monkey.data = doubled
    (reason,) = reasons()
    assert reason.endswith("triangles lie exactly where others of it do") and 5 <= int(reason.split()[0]) <= 10


def test_triangles_of_a_lattice_are_no_doubles_of_one_another(scene, add_lamp, add):
    """Sums of their coordinates, weighted by the roots of 2 and 3, are the same for 1,442 of these."""
    from viewcam_addon.blender.jobs import renderer as jobs
    from viewcam_addon.jobs.job import Job

    random = np.random.default_rng(7)
    corners = random.integers(0, 20, (40_000, 1, 3)) + random.integers(-1, 2, (40_000, 3, 3))
    names = np.sort(corners @ (1_000_000, 1_000, 1), axis=1)
    _, first = np.unique(names, axis=0, return_index=True)
    first = first[(names[first, :-1] != names[first, 1:]).all(axis=1)]
    vertices, triangles = np.unique(corners[first].reshape(-1, 3), axis=0, return_inverse=True)
    mesh = bpy.data.meshes.new("Lattice")
    mesh.from_pydata(vertices.tolist(), [], triangles.reshape(-1, 3).tolist())
    add(mesh, "Lattice")
    add_lamp("SUN")

    def reasons():
        return [entry.reason for entry in jobs.export(Job(level="direct")).ledger if "lie exactly" in entry.reason]

    assert len(mesh.polygons) > 30_000 and not reasons()


# --- Surfaces in one place and things of a pixel, rendered by Cycles: either is right, and each has its own slope


SPHERES = Path(__file__).resolve().parents[3] / "sample_scenes" / "spheres.blend"
SQUARE = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
TILTED = (0.3, 0.2, 0.1)


@pytest.fixture
def sheet(add):
    """sheet(name, vertices, faces, slots) adds a mesh of flat faces, tilted, with a UV map in which face follows face."""

    def make(name, vertices=SQUARE, faces=((0, 1, 2, 3),), slots=(), **properties):
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata(vertices, [], faces)
        layer = mesh.uv_layers.new()
        for loop in mesh.loops:
            layer.data[loop.index].uv = mesh.vertices[loop.vertex_index].co.xy * (1 + loop.index // 4)
        for number in range(max(slots, default=0) + 1):
            mesh.materials.append(bpy.data.materials.new(f"{name} {number}"))
        for face, slot in zip(mesh.polygons, slots, strict=False):
            face.material_index = slot
        return add(mesh, name, **{"rotation_euler": TILTED} | properties)

    return make


def objects(sheet, add):
    sheet("First")
    sheet("Second")
    return ("First", "Second")


def faces_of_one_mesh(sheet, add):
    sheet("Doubled", SQUARE + SQUARE, [(0, 1, 2, 3), (4, 5, 6, 7)], [0, 1])
    return ("Doubled", "Doubled")


def a_decal(sheet, add):
    sheet("Decal", [*SQUARE, (-0.61, -0.53, 0), (0.57, -0.49, 0), (0.59, 0.47, 0)], [(0, 1, 2, 3), (4, 5, 6)], [0, 1])
    return ("Decal", "Decal")


def other_triangles(sheet, add):
    sheet("Floor")
    across = np.linspace(-0.9, 0.9, 4)
    vertices = [(x + 0.03 * y, y, 0) for y in across for x in across]
    faces = [(4 * j + i, 4 * j + i + 1, 4 * j + i + 5, 4 * j + i + 4) for j in range(3) for i in range(3)]
    sheet("Carpet", vertices, faces)
    return ("Carpet", "Floor")


def a_crossing_at_a_hair(sheet, add):
    sheet("Level")
    sheet("Upright", [(0, -1, -1), (0, 1, -1), (0, 1, 1), (0, -1, 1)])
    sheet("Inclined", [(x, y, 1e-7 * x) for x, y, _ in SQUARE])
    return ("Inclined", "Level")


def doubles_in_instances(sheet, add):
    doubled = sheet("Source", SQUARE + SQUARE, [(0, 1, 2, 3), (4, 5, 6, 7)], [0, 1])
    collection = bpy.data.collections.new("Instanced")
    collection.objects.link(doubled)
    bpy.context.scene.collection.objects.unlink(doubled)
    for number in range(6):
        place = add(None, f"Place {number}", location=(number % 3 - 1, number // 3 - 0.5, 0), scale=(0.3,) * 3)
        place.instance_type, place.instance_collection = "COLLECTION", collection
    return ("Source", "Source")


def instances_in_one_place(sheet, add):
    single = sheet("Source", slots=[0])
    collection = bpy.data.collections.new("Instanced")
    collection.objects.link(single)
    bpy.context.scene.collection.objects.unlink(single)
    for number in range(3):
        place = add(None, f"Place {number}", location=(0.1, 0.2, 0.3), rotation_euler=(0, 0, number * np.pi / 2))
        place.instance_type, place.instance_collection = "COLLECTION", collection
    single.rotation_euler = (0, 0, 0)
    return ("Source", "Source")


IN_ONE_PLACE = [
    objects,
    faces_of_one_mesh,
    a_decal,
    other_triangles,
    a_crossing_at_a_hair,
    doubles_in_instances,
    instances_in_one_place,
]


@pytest.mark.parametrize("kind", IN_ONE_PLACE, ids=lambda kind: kind.__name__)
def test_either_of_two_surfaces_in_one_place_is_the_same_picture(both_sides, sheet, add, kind):
    pair = kind(sheet, add)
    sides = both_sides()
    sides.check()
    pairs = set(sides.comparison.in_one_place.pairs())
    assert pairs <= {pair}, f"{pairs} are named, and only {pair} are in one place"


@pytest.mark.parametrize("kind", IN_ONE_PLACE, ids=lambda kind: kind.__name__)
def test_whichever_surface_cycles_had_shown_would_have_been_right_and_no_third_one(both_sides, sheet, add, kind):
    """Cycles' choice may be the tracer's: so each pixel is made to show the last of those that the tracer knows there."""
    pair = kind(sheet, add)
    sides = both_sides()
    camera, tracer = sides.exported.camera, render.Tracer(sides.exported, 2)
    rows, columns = (places.ravel() for places in np.mgrid[: camera.height, : camera.width])
    rays, _, passes = tracer.surfaces_at(columns, rows, within=1e-7)
    last = np.searchsorted(rays, rays, side="right")[np.searchsorted(rays, np.arange(len(rows)))] - 1
    size = (camera.height, camera.width, -1)
    other = {name: passes[name][last].reshape(size) for name in sides.cycles if name in passes}

    def compared(test):
        return geometry.compare(Image(sides.traced), Image(test), camera, tracer.surfaces_at)

    comparison = compared(other)
    assert comparison.passed and set(comparison.in_one_place.pairs()) == {pair}, "\n".join(comparison.lines())
    row, column = comparison.in_one_place.rows[0], comparison.in_one_place.columns[0]
    wrong = {**other, "Material Index": other["Material Index"].copy()}
    wrong["Material Index"][row, column] += 7
    assert not compared(wrong).passed


def sprinkles(sheet, add, mesh_from):
    ball = mesh_from("ico_sphere", subdivisions=2, radius=0.025)
    ball.shade_smooth()
    return ball


def leaves(sheet, add, mesh_from):
    return sheet("Leaf", [(0.02 * x, 0.02 * y, 0) for x, y, _ in SQUARE]).data


def needles(sheet, add, mesh_from):
    return mesh_from("cone", vertices=7, radius1=0.006, depth=0.4)


def facets(sheet, add, mesh_from):
    return mesh_from("ico_sphere", subdivisions=3, radius=0.05)


# The largest change of UV that is compared: of needles thinner than a pixel it changes by a whole map with each pixel, of which
# a ray's rounding is some ten thousandths.
@pytest.mark.parametrize(("kind", "apart"), [(sprinkles, 1e-4), (leaves, 1e-4), (needles, 1e-3), (facets, 1e-4)])
def test_things_of_a_pixel_are_the_same_picture(both_sides, sheet, add, mesh_from, kind, apart):
    mesh, random = kind(sheet, add, mesh_from), np.random.default_rng(5)
    for number in range(400):
        rotation = Matrix.Rotation(random.uniform(0, 6), 4, random.normal(size=3).tolist()).to_euler()
        add(mesh, f"{kind.__name__} {number}", location=random.uniform(-2, 2, 3).tolist(), rotation_euler=rotation)
    sides = both_sides()
    sides.check()
    pixels = np.flatnonzero(sides.traced["Object Index"] > 0)
    off = {name: values.copy() for name, values in sides.cycles.items()}
    off["UV"].reshape(-1, off["UV"].shape[-1])[pixels, :2] += np.float32(apart)
    tracer = render.Tracer(sides.exported, 2)
    comparison = geometry.compare(Image(sides.traced), Image(off), sides.exported.camera, tracer.surfaces_at)
    assert not comparison.passed, "\n".join(comparison.lines())
    flipped = replace(Image(sides.cycles), passes={**sides.cycles, "Normal": sides.cycles["Normal"].copy()})
    flipped["Normal"].reshape(-1, 3)[pixels[len(pixels) // 2]] *= -1
    assert not geometry.compare(Image(sides.traced), flipped, sides.exported.camera, tracer.surfaces_at).passed


@pytest.mark.parametrize(("width", "height"), [(16, 9), (32, 18)])
def test_thousands_of_spheres_in_a_few_pixels_are_the_same_picture(both_sides, width, height):
    """Nearly every pixel is at a silhouette, where the neighbors tell too little of how fast the normal turns."""
    bpy.ops.wm.open_mainfile(filepath=str(SPHERES))
    sides = both_sides(width=width, height=height)
    assert sides.comparison.passed, "\n".join(sides.comparison.lines())
    turned = np.roll(sides.cycles["Normal"], 1, axis=1)  # each pixel has its neighbor's
    wrong = Image({**sides.cycles, "Normal": turned})
    tracer = render.Tracer(sides.exported, 1)
    assert not geometry.compare(Image(sides.traced), wrong, sides.exported.camera, tracer.surfaces_at).passed
