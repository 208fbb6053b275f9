"""Blender's lights as the tracer's lamps, and what Cycles must leave out so that both sides show the same.

Blender's world as the tracer's: constant as it is, else its mean; film and bounces beside it.
"""

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.blender.scenes.ledger import Ledger
from viewcam_addon.blender.scenes.world import world_of
from viewcam_addon.blender.temporary_settings import overridden
from viewcam_addon.errors import InputError
from viewcam_addon.jobs.job import Job
from viewcam_addon.tracer import render
from viewcam_addon.tracer.native import constant_value
from viewcam_addon.tracer.scene.film import Bounces, Film
from viewcam_addon.tracer.scene.lamps import Area, Point, Spot, Sun, World
from viewcam_addon.tracer.scene.shader_nodes import node


@pytest.fixture(autouse=True)
def camera_in_the_scene(camera_object):
    camera_object.location = (0, 0, 9)


@pytest.fixture
def export():
    """export() → (the lamps of the open file, what the ledger says that is not plain)."""

    def make():
        exported = jobs.export(Job(level="direct"))
        reasons = {entry.object: entry.reason for entry in exported.ledger if entry.status != "exported"}
        return exported.lamps, reasons

    return make


def close(values):
    return pytest.approx(values, rel=1e-6)


def test_a_sun_shines_along_its_axis(add_lamp, export):
    add_lamp("SUN", rotation=(0.5, 0, 0), energy=3.0, color=(1, 0.5, 0.25), angle=0.1)
    ((sun,), reasons) = export()
    assert isinstance(sun, Sun) and not reasons and sun.casts_shadow and not sun.hidden_from
    assert sun.irradiance == close((3.0, 1.5, 0.75)) and sun.angle == close(0.1)
    assert sun.towards == close((0.0, -math.sin(0.5), math.cos(0.5)))


def test_a_point_keeps_its_radius_under_scale(add_lamp, export):
    add_lamp("POINT", (1, 2, 3), energy=100.0, shadow_soft_size=0.25, use_soft_falloff=False).scale = (5, 5, 5)
    ((point,), reasons) = export()
    assert isinstance(point, Point) and not reasons
    assert (point.position, point.radius, point.power) == ((1.0, 2.0, 3.0), 0.25, (100.0,) * 3)
    assert not point.soft_falloff


def test_a_spot_brings_its_whole_matrix(add_lamp, export):
    block = add_lamp("SPOT", (1, 2, 3), (0.1, 0.2, 0.3), spot_size=1.2, spot_blend=0.4, shadow_soft_size=0.0)
    block.scale = (1, 2, 3)
    ((spot,), reasons) = export()
    assert isinstance(spot, Spot) and not reasons
    assert (spot.angle, spot.blend, spot.radius) == (close(1.2), close(0.4), 0.0)
    assert spot.matrix == pytest.approx(np.array(block.matrix_world), abs=1e-6)


@pytest.mark.parametrize(
    ("kinds", "angle", "roughness", "is_told"),
    [
        (("SUN", "POINT"), 0.1, 0.8, True),
        (("SUN", "POINT"), 0.1, 0.2, False),
        (("SUN", "POINT"), 0.0, 0.8, False),
        (("SUN",), 0.1, 0.8, False),
    ],
)
def test_very_rough_glass_is_told_where_rays_meet_one_of_several_lights(
    add, mesh_from, make_material, add_lamp, export, kinds, angle, roughness, is_told
):
    add(mesh_from("plane"), "Pane")
    bpy.data.objects["Pane"].data.materials.append(make_material("Glass", "ShaderNodeBsdfGlass", Roughness=roughness))
    for kind in kinds:
        add_lamp(kind, **({"angle": angle} if kind == "SUN" else {"shadow_soft_size": 0.0}))
    _, reasons = export()
    assert ("refracts so roughly" in reasons.get("Pane", "")) == is_told, reasons


@pytest.mark.parametrize(
    ("shape", "size", "ellipse"),
    [("SQUARE", (2, 2), False), ("RECTANGLE", (2, 3), False), ("DISK", (2, 2), True), ("ELLIPSE", (2, 3), True)],
)
def test_an_area_light_has_one_of_four_shapes(add_lamp, export, shape, size, ellipse):
    add_lamp("AREA", shape=shape, size=2.0, size_y=3.0, energy=10.0)
    ((area,), reasons) = export()
    assert isinstance(area, Area) and not reasons
    assert (area.size, area.ellipse, area.power) == (size, ellipse, (10.0,) * 3)


@pytest.mark.skipif(bpy.app.version < (4, 5), reason="lights have exposure, normalize and temperature since 4.5")
@pytest.mark.parametrize("kind", ["SUN", "POINT", "SPOT", "AREA"])
def test_exposure_temperature_and_strength_by_area(add_lamp, export, kind):
    block = add_lamp(kind, energy=2.0, exposure=3.0)
    block.data.normalize = False
    if kind in ("POINT", "SPOT"):
        block.data.shadow_soft_size = 0.25
    if kind == "AREA":
        block.data.size, block.scale = 0.5, (2, 3, 1)
    ((lamp,), _) = export()
    factor = {
        "SUN": math.pi * math.sin(getattr(block.data, "angle", 0) / 2) ** 2,
        "AREA": 0.5 * 2 * 0.5 * 3,
    }.get(kind, 4 * math.pi * 0.25**2)
    strength = lamp.irradiance if kind == "SUN" else lamp.power
    assert strength == close((16.0 * factor,) * 3)
    block.data.normalize, block.data.use_temperature, block.data.temperature = True, True, 3000
    ((lamp,), _) = export()
    assert (lamp.irradiance if kind == "SUN" else lamp.power) == close(tuple(16.0 * x for x in block.data.temperature_color))


@pytest.mark.skipif(bpy.app.version < (4, 5), reason="lights have normalize since 4.5")
def test_lights_without_a_size_are_strong_without_an_area(add_lamp, export):
    add_lamp("POINT", energy=2.0, shadow_soft_size=0.0, normalize=False)
    add_lamp("SUN", energy=2.0, angle=0.0, normalize=False)
    (point, sun), _ = export()
    assert (point.power, sun.irradiance) == ((8.0,) * 3, (2.0,) * 3)


def test_what_a_light_hides_from_and_whether_it_casts_shadows(add_lamp, export):
    block = add_lamp("SUN", angle=0.0, use_shadow=False)
    block.visible_camera = block.visible_glossy = False
    ((sun,), reasons) = export()
    assert sun.hidden_from == {"camera", "glossy"} and not sun.casts_shadow and not reasons


def test_lights_come_through_instances_and_parents(add_lamp, export, add):
    block = add_lamp("POINT", (1, 0, 0))
    collection = bpy.data.collections.new("Lamps")
    bpy.context.scene.collection.objects.unlink(block)
    collection.objects.link(block)
    for x in (10, 20):
        empty = add(None, f"At {x}", (x, 0, 0))
        empty.instance_type, empty.instance_collection = "COLLECTION", collection
    lamps, reasons = export()
    assert sorted(lamp.position for lamp in lamps) == [(11.0, 0.0, 0.0), (21.0, 0.0, 0.0)] and not reasons


def test_nothing_comes_of_lights_that_give_none(add_lamp, export):
    add_lamp("POINT", name="Off", energy=0.0)
    add_lamp("AREA", name="Thin", size=0.0)
    add_lamp("AREA", name="Flat").scale = (0, 1, 1)
    add_lamp("AREA", name="Portal").data.cycles.is_portal = True
    add_lamp("SUN", name="Hidden").hide_render = True
    assert export() == ((), {})


def use_nodes(light):
    if not light.node_tree:
        light.use_nodes = True
    return light.node_tree


def test_a_constant_emission_is_a_factor(add_lamp, export):
    block = add_lamp("POINT", energy=10.0)
    emission = next(node for node in use_nodes(block.data).nodes if node.type == "EMISSION")
    emission.inputs["Color"].default_value, emission.inputs["Strength"].default_value = (1, 0.5, 0.25, 1), 3.0
    ((point,), reasons) = export()
    assert point.power == close((30.0, 15.0, 7.5)) and not reasons


def test_emissions_are_mixed_and_added_and_fall_off_as_light_does(add_lamp, export):
    tree = use_nodes(add_lamp("POINT", energy=10.0).data)
    first = next(node for node in tree.nodes if node.type == "EMISSION")
    second, mixed, falloff = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("Emission", "MixShader", "LightFalloff"))
    second.inputs["Color"].default_value, mixed.inputs[0].default_value = (0, 1, 0, 1), 0.25
    falloff.inputs["Strength"].default_value = 4.0
    tree.links.new(falloff.outputs["Quadratic"], first.inputs["Strength"])
    for number, shader in enumerate((first, second), start=1):
        tree.links.new(shader.outputs[0], mixed.inputs[number])
    tree.links.new(mixed.outputs[0], next(node for node in tree.nodes if node.type == "OUTPUT_LIGHT").inputs["Surface"])
    ((point,), reasons) = export()
    assert point.power == close((30.0, 32.5, 30.0)) and not reasons
    twice = tree.nodes.new("ShaderNodeMath")
    twice.operation, twice.inputs[0].default_value, twice.inputs[1].default_value = "MULTIPLY", 2.0, 4.0
    tree.links.new(twice.outputs[0], falloff.inputs["Strength"])
    assert export()[0][0].power == close((60.0, 62.5, 60.0))
    falloff.inputs["Smooth"].default_value = 1.0
    ((point,), reasons) = export()
    assert not reasons and point.emission is not None


def test_whatever_nodes_make_the_same_everywhere_colors_a_lamp(add_lamp, export):
    tree = use_nodes(add_lamp("POINT", energy=10.0).data)
    emission = next(node for node in tree.nodes if node.type == "EMISSION")
    warm, half = tree.nodes.new("ShaderNodeBlackbody"), tree.nodes.new("ShaderNodeGamma")
    warm.inputs[0].default_value, half.inputs["Gamma"].default_value = 2000.0, 0.5
    tree.links.new(warm.outputs[0], half.inputs["Color"])
    tree.links.new(half.outputs[0], emission.inputs["Color"])
    ((point,), reasons) = export()
    red, green, blue = (power / 10 for power in point.power)
    assert not reasons and red > green > blue > 0
    temperature_color = constant_value(node("blackbody", temperature=2000.0))[0]
    assert (red**2, green**2, blue**2) == pytest.approx(temperature_color, rel=1e-12)


@pytest.mark.parametrize(
    ("kind", "output", "words"),
    [
        ("TexIES", "Fac", "'IES Texture' that shows what is no text of an IES file"),
        ("TexCoord", "Camera", "says the Camera of a light"),
        ("UVMap", "UV", "says the UV of a sun"),
        ("LightPath", "Ray Depth", "says the Ray Depth of a light"),
        ("ObjectInfo", "Random", "says the Random of a light"),
        ("NewGeometry", "Pointiness", "says the Pointiness of a light"),
        ("TexSky", "Color", "'Sky Texture' that is not modeled"),
    ],
)
def test_what_a_lamps_nodes_say_that_is_not_modeled_is_named(add_lamp, export, kind, output, words):
    attach(add_lamp("SUN"), kind, output)
    reasons = export()[1]["Lamp"]
    assert words in reasons and "plain light" in reasons


@pytest.mark.parametrize(
    ("kind", "output", "type"),
    [
        ("TexImage", "Color", "image"),
        ("TexChecker", "Color", "checker"),
        ("LightPath", "Is Camera Ray", "light_path"),
        ("LightFalloff", "Constant", "math"),
        ("TexCoord", "Normal", "vector_math"),
    ],
)
def test_what_makes_a_lamp_uneven_is_its_emission(add_lamp, export, kind, output, type):
    """The lamp keeps its own strength, which the node multiplies."""
    lamp = add_lamp("POINT", energy=10.0)
    socket = attach(lamp, kind, output, "Color")
    if kind == "TexImage":
        socket.image = bpy.data.images.new("Gobo", 2, 2)
    ((point,), reasons) = export()
    assert not reasons and point.power == (10.0,) * 3 and point.emission.type == type


def test_a_lamp_that_is_scaled_to_nearly_nothing_has_no_nodes(add_lamp, export):
    lamp = add_lamp("POINT")
    attach(lamp, "TexCoord", "UV")
    lamp.scale = (1e-30,) * 3
    ((point,), reasons) = export()
    assert point.emission is None and "nodes that are too much" in reasons["Lamp"]


def attach(block, kind, output, to="Strength"):
    tree = use_nodes(block.data)
    emission = next(node for node in tree.nodes if node.type == "EMISSION")
    new_node = tree.nodes.new(f"ShaderNode{kind}")
    tree.links.new(new_node.outputs[output], emission.inputs[to])
    return new_node


APPROXIMATED = {
    "nodes": (lambda block: attach(block, "ObjectInfo", "Random"), "'Object Info' that says the Random of a light"),
    "spread": (lambda block: setattr(block.data, "spread", 0.0), "spread"),
    "beam": (lambda block: setattr(block.data, "spread", math.radians(0.5)), "spread of 0.5°, 180° on both sides"),
    "bounces": (lambda block: setattr(block.data.cycles, "max_bounces", 1), "bounces are limited"),
    "shadows": (lambda block: setattr(block.data, "use_shadow", False), "casts no shadow"),
}


@pytest.mark.parametrize("what", APPROXIMATED)
def test_what_is_approximated_is_told(add_lamp, export, what):
    change, words = APPROXIMATED[what]
    bpy.context.scene.cycles.max_bounces = 12
    block = add_lamp("AREA")
    change(block)
    (_, reasons) = export()
    assert words in reasons["Lamp"], reasons


@pytest.mark.parametrize("energy", [-1.0, float("nan"), 1e30])
def test_strengths_that_light_can_not_have_are_left_out(add_lamp, export, energy):
    add_lamp("POINT", energy=energy)
    lamps, reasons = export()
    assert not lamps and "strength" in reasons["Lamp"]


@pytest.mark.parametrize("scale", [1.0003, 3])
def test_a_sheared_area_light_is_told_and_off_where_it_is_much(add_lamp, export, add, scale):
    parent = add(None, "Parent")
    parent.scale = (1, scale, 1)
    add_lamp("AREA", rotation=(0, 0, 0.5)).parent = parent
    bpy.context.view_layer.update()
    lamps, reasons = export()
    assert "sheared" in reasons["Lamp"] and bool(lamps) == (scale < 2)


@pytest.mark.parametrize(
    ("kind", "scale", "shines"),
    [
        ("SUN", (0, 0, 0), False),
        ("SUN", (0, 1, 1), True),
        ("SPOT", (1, 1, 0), False),
        ("AREA", (1, 1, 0), False),
        ("POINT", (0, 0, 0), True),
    ],
)
def test_a_light_that_its_scale_leaves_no_direction_is_off_on_both_sides(
    add_lamp, export, add, mesh_from, read_passes, tmp_path, kind, scale, shines
):
    add_lamp(kind, energy=30.0).scale = scale
    add(mesh_from("plane", size=20), "Floor")
    lamps, reasons = export()
    jobs.both_sides(Job(threads=2, level="direct", samples=1, width=48, height=32), [tmp_path / "cycles.exr"])
    (cycles,) = read_passes([tmp_path / "cycles.exr"])
    lit = cycles["Combined"][..., :3].max()
    assert (bool(lamps), "scaled to 0" in reasons.get("Lamp", ""), lit > 0) == (shines, not shines, shines), (reasons, lit)


def test_a_flat_lights_nodes_count_where_they_say_the_same_everywhere(add_lamp, export):
    lamp = add_lamp("POINT", energy=100.0)
    lamp.scale, lamp.data.use_nodes = (0, 0, 0), True
    tree = lamp.data.node_tree
    emission = next(node for node in tree.nodes if node.type == "EMISSION")
    emission.inputs["Strength"].default_value = 0.25
    ((point,), reasons) = export()
    assert point.power == close((25.0,) * 3) and not reasons
    tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs[0], emission.inputs["Strength"])
    lamps, reasons = export()
    assert not lamps and "scaled to 0" in reasons["Lamp"], reasons


def test_a_light_whose_nodes_have_no_output_is_dark(add_lamp, export):
    lamp = add_lamp("POINT", energy=100.0)
    lamp.data.use_nodes = True
    lamp.data.node_tree.nodes.clear()
    lamps, reasons = export()
    assert not lamps and not reasons, (lamps, reasons)


@pytest.mark.parametrize("instanced", [False, True])
def test_who_shares_the_data_of_a_sheared_area_light_shines_on_both_sides(
    add_lamp, add, mesh_from, read_passes, tmp_path, instanced
):
    lamp = add_lamp("AREA", rotation=(0, 0, 0.5), energy=100)
    if instanced:  # itself unsheared, and sheared in another place: off in both
        collection = bpy.data.collections.new("Lamps")
        collection.objects.link(lamp)
        add(None, "Sheared", instance_type="COLLECTION", instance_collection=collection, scale=(1, 3, 1))
    else:
        lamp.parent = add(None, "Parent", scale=(1, 3, 1))
    other = add(lamp.data, "Other", (2, 0, 5))
    other.visible_camera = False
    add(mesh_from("plane", size=20), "Floor")
    job = Job(threads=2, level="direct", samples=16, width=48, height=32)
    exported = jobs.both_sides(job, [tmp_path / "cycles.exr"])
    traced, (cycles,) = render.render(exported, "direct", 16, threads=2), read_passes([tmp_path / "cycles.exr"])
    assert [lamp.name for lamp in exported.lamps] == ["Other"]
    ours, theirs = (passes["Combined"][..., :3].mean() for passes in (traced, cycles))
    assert ours == pytest.approx(theirs, rel=0.02)  # calibrated: 0.002


@pytest.fixture
def export_world(camera_object):
    """export() → (the scene of the open file, what the ledger says that is not plain)."""

    def make():
        exported = jobs.export(Job(level="direct"))
        return exported, {entry.object: entry.reason for entry in exported.ledger if entry.status != "exported"}

    return make


def background_of(world):
    return next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")


def test_no_world_is_dark(scene, export_world):
    scene.world = None
    exported, reasons = export_world()
    assert exported.world == World() and not reasons


def test_a_constant_background_is_the_world(set_world, export_world):
    set_world((1.0, 0.5, 0.25), 2.0)
    exported, reasons = export_world()
    assert exported.world.radiance == (2.0, 1.0, 0.5) and not reasons


def test_the_world_hides_from_rays_as_it_is_told_to(set_world, export_world):
    set_world().cycles_visibility.camera = False
    assert export_world()[0].world.hidden_from == {"camera"}


def test_the_view_layers_own_world_counts(set_world, scene, export_world):
    other = set_world((1, 0, 0))
    set_world((0, 1, 0))
    bpy.context.view_layer.world_override = other
    assert export_world()[0].world.radiance == (1.0, 0.0, 0.0)


def test_a_view_layer_that_leaves_the_world_out_is_dark(set_world, export_world):
    set_world((0, 1, 0))
    bpy.context.view_layer.use_sky = False
    assert export_world()[0].world == World()


@pytest.mark.skipif(bpy.app.version >= (5, 0), reason="since 5.0 nodes always count")
def test_a_world_without_nodes_has_its_plain_color(set_world, export_world):
    world = set_world()
    world.use_nodes, world.color = False, (0.25, 0.5, 1.0)
    exported, reasons = export_world()
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


def test_an_image_is_wrapped_around_the_world(sky, export_world):
    exported, reasons = export_world()
    assert exported.world == World((2.0, 2.0, 2.0), image="Sky") and not reasons
    assert exported.images["Sky"].values[:, 0].tolist() == [[1.0, 0.0, 0.0], [0.0, 0.5, 0.0]]


def test_a_mapping_turns_the_image(sky, export_world):
    _, texture, feed = sky
    texture.interpolation = "Closest"
    mapping = feed("ShaderNodeMapping")
    mapping.inputs["Rotation"].default_value = (0.25, 0.5, 1.0)
    place = mapping.id_data.nodes.new("ShaderNodeTexCoord")
    mapping.id_data.links.new(place.outputs["Generated"], mapping.inputs["Vector"])
    exported, reasons = export_world()
    assert exported.world == World((2.0, 2.0, 2.0), image="Sky", closest=True, rotation=(0.25, 0.5, 1.0)) and not reasons


@pytest.mark.parametrize("by", ["a mapping of nothing", "a group"])
def test_an_image_that_is_looked_up_in_one_place_is_one_color(sky, export_world, by):
    world, texture, feed = sky
    if by == "a mapping of nothing":
        feed("ShaderNodeMapping").inputs["Location"].default_value = (1.0, 0.5, -0.5)
    else:
        group = bpy.data.node_groups.new("Group", "ShaderNodeTree")
        group.interface.new_socket("Vector", in_out="INPUT", socket_type="NodeSocketVector")
        group.interface.new_socket("Vector", in_out="OUTPUT", socket_type="NodeSocketVector")
        group.links.new(group.nodes.new("NodeGroupInput").outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
        node = world.node_tree.nodes.new("ShaderNodeGroup")
        node.node_tree = group
        node.inputs[0].default_value = (1.0, 0.5, -0.5)
        world.node_tree.links.new(node.outputs[0], texture.inputs["Vector"])
    exported, reasons = export_world()
    is_one = by == "a mapping of nothing" or bpy.app.version >= (5, 0)  # before, groups gave images no place
    assert (exported.world.image != "Sky") == is_one, (exported.world, reasons)


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


def test_what_the_camera_sees_may_be_another_world_than_what_lights(sky, export_world):
    world, _, _ = sky
    tree, background = world.node_tree, background_of(world)
    other = tree.nodes.new("ShaderNodeBackground")
    other.inputs["Color"].default_value = (1.0, 0.5, 0.25, 1.0)
    output = next(node for node in tree.nodes if node.type == "OUTPUT_WORLD")
    mixed = ask_for_camera(tree, "ShaderNodeMixShader", "Shader", background.outputs[0], other.outputs[0])
    tree.links.new(mixed, output.inputs["Surface"])
    exported, reasons = export_world()
    assert exported.world == World((2.0, 2.0, 2.0), image="Sky", backdrop=World((1.0, 0.5, 0.25))) and not reasons


@pytest.mark.parametrize("kind", ["ShaderNodeMix", "ShaderNodeMixRGB"])
def test_so_may_its_color_and_its_strength(set_world, export_world, kind):
    world = set_world()
    tree, background = world.node_tree, background_of(world)
    color = ask_for_camera(tree, kind, "Color", (1.0, 0.5, 0.25, 1.0), (0.0, 0.0, 1.0, 1.0))
    tree.links.new(color, background.inputs["Color"])
    if kind == "ShaderNodeMix":
        tree.links.new(ask_for_camera(tree, kind, "Strength", 4.0, 2.0), background.inputs["Strength"])
    exported, reasons = export_world()
    lit, seen = (4.0, 2.0) if kind == "ShaderNodeMix" else (1.0, 1.0)
    assert exported.world == World((lit, lit / 2, lit / 4), backdrop=World((0.0, 0.0, seen))) and not reasons


def test_an_image_in_a_coordinate_of_the_camera_is_its_mean_over_the_sphere(sky, export_world):
    _, _, feed = sky
    feed("ShaderNodeTexCoord", "Window")
    exported, reasons = export_world()
    assert exported.world.radiance == pytest.approx((1.0, 0.5, 0.0)) and exported.world.image is None
    assert "'Environment Texture' that varies" in reasons["World"] and "constant" in reasons["World"]


@pytest.mark.parametrize("is_named", [True, False])
def test_an_image_that_is_missing_is_the_magenta_that_cycles_shows(set_world, export_world, tmp_path, is_named):
    world = set_world(strength=2.0)
    texture = world.node_tree.nodes.new("ShaderNodeTexEnvironment")
    world.node_tree.links.new(texture.outputs["Color"], background_of(world).inputs["Color"])
    if is_named:
        texture.image = bpy.data.images.new("Gone", 4, 4)
        texture.image.source, texture.image.filepath = "FILE", str(tmp_path / "gone.hdr")
    exported, reasons = export_world()
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


def test_a_volume_in_the_world_is_left_out_and_its_light_is_not(set_world, export_world):
    world = set_world((1.0, 0.5, 0.25))
    output = next(node for node in world.node_tree.nodes if node.type == "OUTPUT_WORLD")
    world.node_tree.links.new(world.node_tree.nodes.new("ShaderNodeVolumeScatter").outputs[0], output.inputs["Volume"])
    exported, reasons = export_world()
    assert exported.world.radiance == (1.0, 0.5, 0.25) and "has a volume" in reasons["World"]


def test_film_and_bounces_are_the_scenes(scene, export_world):
    scene.cycles.pixel_filter_type, scene.cycles.film_exposure, scene.render.film_transparent = "BOX", 1.5, True
    scene.cycles.max_bounces, scene.cycles.diffuse_bounces = 7, 3
    scene.cycles.glossy_bounces, scene.cycles.transmission_bounces = 2, 5
    exported, reasons = export_world()
    assert exported.film == Film("BOX", scene.cycles.filter_width, True, 1.5)
    assert exported.bounces == Bounces(7, 3, 2, 5) and not reasons


def test_every_filter_of_cycles_is_modeled(scene, export_world):
    for each in type(scene.cycles).bl_rna.properties["pixel_filter_type"].enum_items:
        scene.cycles.pixel_filter_type = each.identifier
        exported, reasons = export_world()
        assert exported.film.filter == each.identifier and not reasons


def test_what_of_film_and_bounces_is_approximated_is_told(scene, export_world):
    scene.cycles.caustics_reflective = False
    assert "caustics" in export_world()[1]["Scene"]


@pytest.mark.skipif(bpy.app.version < (5, 0), reason="before 5.0 colors are always Rec. 709's")
def test_light_in_another_color_space_is_refused(set_world, export_world):
    set_world()
    bpy.ops.wm.set_working_color_space(working_space="ACEScg", convert_colors=False)
    try:
        with pytest.raises(InputError, match="ACEScg"):
            export_world()
    finally:
        bpy.ops.wm.set_working_color_space(working_space="Linear Rec.709", convert_colors=False)


def test_smaller_textures_and_open_shading_language_are_told(scene, export_world):
    scene.cycles.texture_limit_render = "128"
    assert not export_world()[1]
    scene.render.use_simplify = True
    assert "smaller" in export_world()[1]["Scene"]
    scene.cycles.shading_system = True
    assert "Open Shading Language" in export_world()[1]["Scene"]
