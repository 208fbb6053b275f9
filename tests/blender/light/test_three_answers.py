"""A check of files that hold what is not modeled: amber where it is in the picture or lights it, green where it is not."""

import math

import pytest

bpy = pytest.importorskip("bpy")

import viewcam_addon as vp
from viewcam_addon.commands._options import ledger_lines

pytestmark = pytest.mark.slow

SIZE = "96x54"
BEHIND = (0.0, -60.0, 1.0)


@pytest.fixture
def stage(fresh_blender, tmp_path):
    """A ball on a floor below a lamp; a function that saves it and checks it."""
    scene = bpy.context.scene
    for _ in range(len(bpy.data.objects)):
        bpy.data.objects.remove(bpy.data.objects[0])
    bpy.ops.mesh.primitive_plane_add(size=20)
    bpy.context.object.data.materials.append(_material("Floor"))
    bpy.ops.mesh.primitive_uv_sphere_add(location=(0, 0, 1))
    bpy.context.object.name = "Ball"
    bpy.context.object.data.materials.append(_material("Skin"))
    bpy.ops.object.light_add(type="AREA", location=(2, -2, 5))
    bpy.context.object.data.energy = 500
    bpy.ops.object.camera_add(location=(0, -7, 2.5), rotation=(math.radians(78), 0, 0))
    scene.camera = bpy.context.object

    def check(level, samples=32, **options):
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "stage.blend"))
        return vp.check(tmp_path / "stage.blend", size=SIZE, level=level, samples=samples, **options)

    return check


def test_a_panel_that_shines_near_a_floor_is_the_same_at_a_thousand_samples(stage):
    """Cycles loses some of its light, many times the error of the mean; a light that is 0.3 % brighter would be found."""
    bpy.data.objects.remove(bpy.data.objects["Ball"])
    bpy.data.objects.remove(bpy.data.objects["Area"])
    bpy.ops.mesh.primitive_plane_add(size=2, location=(0, -4.5, 4), rotation=(math.radians(60), 0, 0))
    shader = _material("Panel").node_tree.nodes["Principled BSDF"]
    shader.inputs["Emission Strength"].default_value = 8.0
    bpy.context.object.data.materials.append(bpy.data.materials["Panel"])
    figures = stage("direct", samples=1024).figures
    assert figures["answer"] == "same", figures["sentence"]
    (combined,) = (row for row in figures["quantities"] if row["name"] == "Combined")
    assert 10 * combined["ratio_error"] < 1 - combined["ratio"] < 1e-3 and combined["visible"] < 3e-3, combined


def _material(name):
    material = bpy.data.materials.new(name)
    if not material.node_tree:  # new materials have one from 5.0 on
        material.use_nodes = True
    return material


def subsurface():
    shader = bpy.data.materials["Skin"].node_tree.nodes["Principled BSDF"]
    shader.inputs["Subsurface Weight"].default_value = 0.5


def glow_below_a_coat():
    """A glow that Cycles dims where a path goes on, and does not where it ends."""
    shader = bpy.data.materials["Skin"].node_tree.nodes["Principled BSDF"]
    shader.inputs["Emission Strength"].default_value, shader.inputs["Sheen Weight"].default_value = 5.0, 1.0
    shader.inputs["Coat Weight"].default_value = 1.0


def hair():
    settings = bpy.data.objects["Ball"].modifiers.new("Hair", "PARTICLE_SYSTEM").particle_system.settings
    settings.type, settings.count, settings.hair_length = "HAIR", 300, 0.6


def fog():
    bpy.ops.mesh.primitive_cube_add(size=2, location=(1.5, -1, 1))
    bpy.context.object.name = "Fog"
    material = _material("Fog")
    tree = material.node_tree
    tree.nodes.clear()
    output, volume = tree.nodes.new("ShaderNodeOutputMaterial"), tree.nodes.new("ShaderNodeVolumePrincipled")
    volume.inputs["Density"].default_value = 0.5
    tree.links.new(volume.outputs[0], output.inputs["Volume"])
    bpy.context.object.data.materials.append(material)


def focus():
    lens = bpy.context.scene.camera.data.dof
    lens.use_dof, lens.aperture_fstop, lens.focus_distance = True, 0.05, 4.0


@pytest.mark.parametrize(
    ("change", "level", "name"),
    [
        (subsurface, "path", "Ball"),
        (glow_below_a_coat, "direct", "Ball"),
        (glow_below_a_coat, "path", "Ball"),
        (hair, "geometry", "Ball"),
        (hair, "path", "Ball"),
        (fog, "path", "Fog"),
        (focus, "geometry", "Camera"),
        (focus, "path", "Camera"),
    ],
)
def test_what_is_not_modeled_and_in_the_picture_makes_it_amber(stage, change, level, name):
    change()
    check = stage(level)
    assert (check.answer, check.passed) == ("same_but", True), check.sentence
    names = check.figures["not_modeled"]
    assert names["names"] == [name] and 0.01 < names["share"] < 0.9, names
    assert f"but for 1 object that is not modeled ({name}; " in check.sentence


@pytest.mark.parametrize(
    ("change", "name", "level"), [(subsurface, "Ball", "path"), (hair, "Ball", "path"), (fog, "Fog", "path")]
)
def test_what_is_not_modeled_and_neither_seen_nor_lights_what_is_leaves_it_green(stage, change, name, level):
    change()
    bpy.data.objects[name].location = BEHIND
    check = stage(level)
    assert check.answer == "same" and check.figures["not_modeled"]["share"] == 0.0, check.sentence
    assert any(entry["status"] != "exported" for entry in check.figures["ledger"]), "it is in the ledger all the same"


def test_hair_that_is_not_seen_and_casts_a_shadow_into_the_picture_makes_it_amber(stage):
    hair()
    ball, lamp = bpy.data.objects["Ball"], bpy.data.objects["Area"]
    ball.location, lamp.location, lamp.data.size = (0, 0, 6), (0, 0, 9), 0.1  # above what the camera sees
    bpy.context.view_layer.update()
    figures = stage("path").figures
    assert figures["answer"] == "same_but" and figures["not_modeled"]["names"] == ["Ball"], figures["sentence"]
    assert figures["not_modeled"]["shown"] == 0.0 and figures["not_modeled"]["share"] > 0.005, figures["not_modeled"]


def test_surface_scattering_below_the_skin_is_no_matter_of_geometry(stage):
    subsurface()
    assert stage("geometry").answer == "same"


@pytest.mark.exhaustive  # another Blender renders the world
def test_a_world_that_varies_by_a_node_is_an_image_that_cycles_renders_which_is_green_and_said(stage):
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    if not world.node_tree:  # new worlds have one from 5.0 on
        world.use_nodes = True
    tree = world.node_tree
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs[1], background.inputs["Color"])
    check = stage("path", strict=True)
    assert (check.answer, check.passed) == ("same", True), check.sentence
    (entry,) = (entry for entry in check.figures["ledger"] if entry["object"] == "World")
    assert entry["status"] == "exported" and "both sides show an image of it, 2048 × 1024 pixels" in entry["reason"], entry
    (line,) = (line for line in ledger_lines(check.figures["ledger"]) if "World" in line)
    assert line == f"  World: exported, {entry['reason']}"


def test_strict_fails_what_is_amber_and_lets_pass_what_is_green(stage):
    hair()
    assert not stage("geometry", strict=True).passed
    bpy.data.objects["Ball"].location = BEHIND
    assert stage("geometry", strict=True).passed


def test_all_that_is_modeled_is_green_and_rendered_once(stage, tmp_path):
    assert stage("path", report=tmp_path / "report").answer == "same"
    assert not (tmp_path / "report" / "everything.exr").exists()
