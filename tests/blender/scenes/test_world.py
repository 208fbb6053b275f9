"""Blender's world as the tracer's: constant as it is, else its mean; film and bounces beside it."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.blender.scenes.ledger import Ledger
from viewcam_addon.blender.scenes.world import world_of
from viewcam_addon.blender.temporary_settings import overridden
from viewcam_addon.jobs.job import Job
from viewcam_addon.tracer.scene.film import Bounces, Film
from viewcam_addon.tracer.scene.lamps import World


@pytest.fixture
def export(camera_object):
    """export() → (the scene of the open file, what the ledger says that is not plain)."""

    def make():
        exported = jobs.export(Job(level="direct"))
        return exported, {entry.object: entry.reason for entry in exported.ledger if entry.status != "exported"}

    return make


def background_of(world):
    return next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")


def test_no_world_is_dark(scene, export):
    scene.world = None
    exported, reasons = export()
    assert exported.world == World() and not reasons


def test_a_constant_background_is_the_world(set_world, export):
    set_world((1.0, 0.5, 0.25), 2.0)
    exported, reasons = export()
    assert exported.world.radiance == (2.0, 1.0, 0.5) and not reasons


def test_the_world_hides_from_rays_as_it_is_told_to(set_world, export):
    set_world().cycles_visibility.camera = False
    assert export()[0].world.hidden_from == {"camera"}


def test_the_view_layers_own_world_counts(set_world, scene, export):
    other = set_world((1, 0, 0))
    set_world((0, 1, 0))
    bpy.context.view_layer.world_override = other
    assert export()[0].world.radiance == (1.0, 0.0, 0.0)


@pytest.mark.skipif(bpy.app.version >= (5, 0), reason="since 5.0 nodes always count")
def test_a_world_without_nodes_has_its_plain_color(set_world, export):
    world = set_world()
    world.use_nodes, world.color = False, (0.25, 0.5, 1.0)
    exported, reasons = export()
    assert exported.world.radiance == (0.25, 0.5, 1.0) and not reasons


@pytest.fixture
def sky(set_world):
    """A world of a small image, the Environment Texture that shows it, and a function that puts a node before that."""
    world = set_world(strength=2.0)
    image = bpy.data.images.new("Sky", 4, 2, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    pixels = np.zeros((2, 4, 4), np.float32)
    pixels[0, :, 0], pixels[1, :, 1] = 1.0, 0.5
    image.pixels.foreach_set(pixels.ravel())
    texture = world.node_tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = image
    world.node_tree.links.new(texture.outputs[0], background_of(world).inputs["Color"])

    def feed(kind, output=0):
        node = world.node_tree.nodes.new(kind)
        world.node_tree.links.new(node.outputs[output], texture.inputs["Vector"])
        return node

    return world, texture, feed


def test_an_image_is_wrapped_around_the_world(sky, export):
    exported, reasons = export()
    assert exported.world == World((2.0, 2.0, 2.0), image="Sky") and not reasons
    assert exported.images["Sky"].values[:, 0].tolist() == [[1.0, 0.0, 0.0], [0.0, 0.5, 0.0]]


def test_a_mapping_turns_the_image(sky, export):
    _, texture, feed = sky
    texture.interpolation = "Closest"
    feed("ShaderNodeMapping").inputs["Rotation"].default_value = (0.25, 0.5, 1.0)
    exported, reasons = export()
    assert exported.world == World((2.0, 2.0, 2.0), image="Sky", closest=True, rotation=(0.25, 0.5, 1.0)) and not reasons


def ask_for_camera(tree, kind, name, *sides):
    """A mixture that is its last side to the camera. sides : sockets or values."""
    mix = tree.nodes.new(kind)
    if kind == "ShaderNodeMix":
        mix.data_type = "RGBA" if "Color" in name else "FLOAT"
    tree.links.new(tree.nodes.new("ShaderNodeLightPath").outputs["Is Camera Ray"], mix.inputs[0])
    inputs = [socket for socket in mix.inputs if socket.enabled][-2:]
    for socket, side in zip(inputs, sides, strict=True):
        if isinstance(side, bpy.types.NodeSocket):
            tree.links.new(side, socket)
        else:
            socket.default_value = side
    return next(socket for socket in mix.outputs if socket.enabled)


def test_what_the_camera_sees_may_be_another_world_than_what_lights(sky, export):
    world, _, _ = sky
    tree, background = world.node_tree, background_of(world)
    other = tree.nodes.new("ShaderNodeBackground")
    other.inputs["Color"].default_value = (1.0, 0.5, 0.25, 1.0)
    output = next(node for node in tree.nodes if node.type == "OUTPUT_WORLD")
    mixed = ask_for_camera(tree, "ShaderNodeMixShader", "Shader", background.outputs[0], other.outputs[0])
    tree.links.new(mixed, output.inputs["Surface"])
    exported, reasons = export()
    assert exported.world == World((2.0, 2.0, 2.0), image="Sky", backdrop=World((1.0, 0.5, 0.25))) and not reasons


@pytest.mark.parametrize("kind", ["ShaderNodeMix", "ShaderNodeMixRGB"])
def test_so_may_its_color_and_its_strength(set_world, export, kind):
    world = set_world()
    tree, background = world.node_tree, background_of(world)
    color = ask_for_camera(tree, kind, "Color", (1.0, 0.5, 0.25, 1.0), (0.0, 0.0, 1.0, 1.0))
    tree.links.new(color, background.inputs["Color"])
    if kind == "ShaderNodeMix":
        tree.links.new(ask_for_camera(tree, kind, "Strength", 4.0, 2.0), background.inputs["Strength"])
    exported, reasons = export()
    lit, seen = (4.0, 2.0) if kind == "ShaderNodeMix" else (1.0, 1.0)
    assert exported.world == World((lit, lit / 2, lit / 4), backdrop=World((0.0, 0.0, seen))) and not reasons


def test_an_image_in_a_coordinate_of_the_camera_is_its_mean_over_the_sphere(sky, export):
    _, _, feed = sky
    feed("ShaderNodeTexCoord", "Window")
    exported, reasons = export()
    assert exported.world.radiance == pytest.approx((1.0, 0.5, 0.0)) and exported.world.image is None
    assert "'Environment Texture' that varies" in reasons["World"] and "constant" in reasons["World"]


@pytest.mark.parametrize("is_named", [True, False])
def test_an_image_that_is_missing_is_the_magenta_that_cycles_shows(set_world, export, tmp_path, is_named):
    world = set_world(strength=2.0)
    texture = world.node_tree.nodes.new("ShaderNodeTexEnvironment")
    world.node_tree.links.new(texture.outputs["Color"], background_of(world).inputs["Color"])
    if is_named:
        texture.image = bpy.data.images.new("Gone", 4, 4)
        texture.image.source, texture.image.filepath = "FILE", str(tmp_path / "gone.hdr")
    exported, reasons = export()
    assert exported.world.radiance == (2.0, 0.0, 2.0) and exported.world.image is None and not reasons
    (reason,) = (entry.reason for entry in exported.ledger if entry.object == world.name)
    assert reason.startswith("the world ") and reason.endswith("magenta, as Cycles has it")


def test_cycles_is_shown_a_constant_world_where_the_image_is_missing(set_world):
    """Sampled as light, it would give some that scattered rays lose."""
    world = set_world(strength=2.0)
    texture = world.node_tree.nodes.new("ShaderNodeTexEnvironment")
    world.node_tree.links.new(texture.outputs["Color"], background_of(world).inputs["Color"])
    ledger = Ledger()
    world_of(bpy.context.scene, world, ledger)
    with overridden() as overrides:
        for remedy in ledger.remedies.values():
            remedy(overrides)
        surface = world.node_tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node
        assert not surface.inputs["Color"].is_linked and tuple(surface.inputs["Color"].default_value) == (2.0, 0.0, 2.0, 1.0)
    assert background_of(world).inputs["Color"].is_linked


def test_cycles_is_shown_no_constant_world_where_the_camera_sees_another(set_world):
    world = set_world(strength=2.0)
    tree, lights = world.node_tree, background_of(world)
    seen, mixed = tree.nodes.new("ShaderNodeBackground"), tree.nodes.new("ShaderNodeMixShader")
    tree.links.new(tree.nodes.new("ShaderNodeTexEnvironment").outputs["Color"], lights.inputs["Color"])
    tree.links.new(tree.nodes.new("ShaderNodeLightPath").outputs["Is Camera Ray"], mixed.inputs[0])
    tree.links.new(lights.outputs[0], mixed.inputs[1])
    tree.links.new(seen.outputs[0], mixed.inputs[2])
    tree.links.new(mixed.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
    ledger = Ledger()
    assert world_of(bpy.context.scene, world, ledger)[0].backdrop is not None
    with overridden() as overrides:
        for remedy in ledger.remedies.values():
            remedy(overrides)
        assert tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node == mixed


def test_a_volume_in_the_world_is_left_out_and_its_light_is_not(set_world, export):
    world = set_world((1.0, 0.5, 0.25))
    output = next(node for node in world.node_tree.nodes if node.type == "OUTPUT_WORLD")
    world.node_tree.links.new(world.node_tree.nodes.new("ShaderNodeVolumeScatter").outputs[0], output.inputs["Volume"])
    exported, reasons = export()
    assert exported.world.radiance == (1.0, 0.5, 0.25) and "has a volume" in reasons["World"]


def test_film_and_bounces_are_the_scenes(scene, export):
    scene.cycles.pixel_filter_type, scene.cycles.film_exposure, scene.render.film_transparent = "BOX", 1.5, True
    scene.cycles.max_bounces, scene.cycles.diffuse_bounces = 7, 3
    scene.cycles.glossy_bounces, scene.cycles.transmission_bounces = 2, 5
    exported, reasons = export()
    assert exported.film == Film("BOX", scene.cycles.filter_width, True, 1.5)
    assert exported.bounces == Bounces(7, 3, 2, 5) and not reasons


def test_every_filter_of_cycles_is_modeled(scene, export):
    for each in type(scene.cycles).bl_rna.properties["pixel_filter_type"].enum_items:
        scene.cycles.pixel_filter_type = each.identifier
        exported, reasons = export()
        assert exported.film.filter == each.identifier and not reasons


def test_what_of_film_and_bounces_is_approximated_is_told(scene, export):
    scene.cycles.caustics_reflective = False
    assert "caustics" in export()[1]["Scene"]
