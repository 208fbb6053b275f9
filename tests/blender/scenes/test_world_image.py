"""Worlds that are not modeled as they are: the image that another Blender renders of them, and their suns."""

import math
import subprocess

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import another_blender
from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.blender.scenes import world_image
from viewcam_addon.blender.scenes.images import image_of
from viewcam_addon.jobs.job import Job
from viewcam_addon.tracer import render

pytestmark = pytest.mark.slow

NEWER = bpy.app.version >= (5, 0)
WITH_SUN = "SINGLE_SCATTERING" if NEWER else "NISHITA"


@pytest.fixture
def export(camera_object, monkeypatch):
    """export() → (the scene of the open file, what the ledger says of its world); the image is small."""
    monkeypatch.setattr(world_image, "WIDTH", 64)

    def make():
        exported = jobs.export(Job(level="direct"))
        return exported, "; ".join(entry.reason for entry in exported.ledger if entry.object == "World")

    return make


@pytest.fixture(params=["time", "no such program", "an error there"])
def other_blender_fails(request, monkeypatch):
    """The Blender that another one would start makes nothing, in each of the ways in which it may fail."""

    def fail(*arguments):
        if request.param == "time":
            raise subprocess.TimeoutExpired("blender", 1.0)
        if request.param == "no such program":
            raise FileNotFoundError

    monkeypatch.setattr(another_blender, "call", fail)


@pytest.fixture
def tree(set_world):
    """The nodes of a world, and add(kind, **properties) that adds one; color(socket) makes that its color."""
    nodes = set_world().node_tree

    class Tree:
        background = next(node for node in nodes.nodes if node.type == "BACKGROUND")

        def add(self, kind, **properties):
            node = nodes.nodes.new(kind)
            for name, value in properties.items():
                setattr(node, name, value)
            return node

        def link(self, output, socket):
            nodes.links.new(output, socket)

        def color(self, output):
            nodes.links.new(output, self.background.inputs["Color"])

    return Tree()


def shifted_direction(tree, coordinate="Generated"):
    """(x + 2, y + 2, z + 2) of a direction as a color."""
    shift = tree.add("ShaderNodeVectorMath", operation="ADD")
    shift.inputs[1].default_value = (2, 2, 2)
    tree.link(tree.add("ShaderNodeTexCoord").outputs[coordinate], shift.inputs[0])
    return shift.outputs[0]


def directions(width):
    """The directions of the pixels of an equirectangular image, (width / 2, width, 3)."""
    azimuth = (0.5 - (np.arange(width) + 0.5) / width) * 2 * np.pi
    height = ((np.arange(width // 2) + 0.5) / (width // 2) - 0.5)[:, None] * np.pi
    return np.stack([np.cos(height) * np.cos(azimuth), np.cos(height) * np.sin(azimuth), np.sin(height) + 0 * azimuth], axis=-1)


def test_each_pixel_is_what_the_world_shows_in_the_middle_of_its_directions(tree, export):
    tree.color(shifted_direction(tree))
    exported, reasons = export()
    pixels = exported.images[exported.world.image].pixels
    assert exported.world.radiance == (1, 1, 1) and exported.world.backdrop is None and not exported.lamps
    assert np.abs(pixels - directions(64) - 2).max() < 1e-6  # float32, and 3e-6 of a pixel
    assert "both sides show an image of it, 64 × 32 pixels, that Cycles renders" in reasons
    assert not exported.not_modeled


def test_a_camera_that_sees_another_world_is_shown_another_image(tree, export):
    add = tree.add("ShaderNodeMixRGB", blend_type="ADD")
    tree.link(tree.add("ShaderNodeLightPath").outputs["Is Camera Ray"], add.inputs[0])
    tree.link(shifted_direction(tree), add.inputs[1])
    add.inputs[2].default_value = (1, 2, 3, 1)
    tree.color(add.outputs[0])
    exported, _ = export()
    lights, seen = (exported.images[each.image].pixels for each in (exported.world, exported.world.backdrop))
    assert np.abs(lights - directions(64) - 2).max() < 1e-6
    assert np.abs(seen - directions(64) - (3, 4, 5)).max() < 1e-6


def test_a_world_that_tells_other_rays_apart_is_what_diffuse_ones_see_and_is_named(tree, export):
    mix = tree.add("ShaderNodeMixRGB")
    tree.link(tree.add("ShaderNodeLightPath").outputs["Is Diffuse Ray"], mix.inputs[0])
    mix.inputs[1].default_value, mix.inputs[2].default_value = (0, 0, 1, 1), (0.5, 0, 0, 1)
    tree.color(mix.outputs[0])
    exported, reasons = export()
    assert exported.world.radiance == (0.5, 0, 0) and exported.world.backdrop.radiance == (0, 0, 1) and not exported.images
    assert "all but the camera's see what diffuse ones do" in reasons


def test_a_world_whose_nodes_do_not_vary_is_one_color_and_no_image(tree, export):
    """Cycles samples the light of an image, and that of one color by no table."""
    invert = tree.add("ShaderNodeInvert")
    invert.inputs["Color"].default_value = (0.75, 0.5, 0.25, 1)
    tree.color(invert.outputs[0])
    exported, reasons = export()
    assert exported.world.radiance == (0.25, 0.5, 0.75) and exported.world.image is None and not exported.images
    assert "both sides show the color that Cycles renders" in reasons and not exported.not_modeled


def test_the_sun_of_a_sky_is_a_lamp_of_its_direction_and_size(tree, export):
    sky = tree.add("ShaderNodeTexSky", sky_type=WITH_SUN, sun_elevation=0.5, sun_rotation=1.0, sun_size=0.02)
    tree.color(sky.outputs[0])
    exported, reasons = export()
    (sun,) = exported.lamps
    stated = (math.cos(0.5) * math.sin(1.0), math.cos(0.5) * math.cos(1.0), math.sin(0.5))
    # The middle of a disc of some 200 × 200 pixels in the picture from near.
    assert np.abs(np.subtract(sun.towards, stated)).max() < 1e-5
    assert sun.angle == pytest.approx(0.02, rel=1e-6) and sun.name == "World (sun)" and not sun.hidden_from
    # No pixel of the image has the disc, whose radiance is thousands of times that of the sky.
    assert exported.images[exported.world.image].pixels.max() < 0.01 * min(sun.irradiance) / (math.pi * 0.01**2)
    assert "lamps that shine evenly for its suns" in reasons


def test_the_light_of_a_sun_goes_with_what_is_done_to_the_sky(tree, export):
    sky = tree.add("ShaderNodeTexSky", sky_type=WITH_SUN, sun_elevation=0.5)
    tree.color(sky.outputs[0])
    (sun,) = export()[0].lamps
    tree.background.inputs["Strength"].default_value = 0.25
    sky.sun_size *= 2  # as much light, from a larger disc
    (weaker,) = export()[0].lamps
    assert np.allclose(weaker.irradiance, np.multiply(sun.irradiance, 0.25), rtol=2e-3)  # colors vary over the disc


def test_links_that_go_in_a_circle_are_none(tree, export):
    first, second = (tree.add("ShaderNodeMath") for _ in range(2))
    for node, number in ((first, 0.25), (second, 0.5)):
        node.inputs[0].default_value, node.inputs[1].default_value = number, 0.125
    tree.link(first.outputs[0], second.inputs[0])
    tree.color(second.outputs[0])
    tree.link(second.outputs[0], first.inputs[0])
    exported, reasons = export()
    assert exported.world.radiance == (0.5, 0.5, 0.5)
    assert ("go in a circle" in reasons) == NEWER


def test_neither_export_nor_render_changes_what_is_open(tree, export, scene, tmp_path):
    sky = tree.add("ShaderNodeTexSky", sky_type=WITH_SUN)
    tree.color(sky.outputs[0])
    kinds = ("worlds", "objects", "lights", "scenes", "cameras", "libraries")

    def state():
        names = {kind: sorted(block.name for block in getattr(bpy.data, kind)) for kind in kinds}
        names["images"] = [image.name for image in bpy.data.images if image.type != "RENDER_RESULT"]
        links = [(link.from_node.name, link.to_node.name) for link in sky.id_data.links]
        return names, links, [node.name for node in sky.id_data.nodes], sky.sun_disc, sky.sun_size

    before = state()
    scene.render.resolution_x, scene.render.resolution_y = 8, 8
    export()
    jobs.both_sides(Job(level="direct", samples=1), [tmp_path / "sky.exr"])
    assert state() == before


def test_a_transparent_film_shows_no_sun(tree, export, scene):
    tree.color(tree.add("ShaderNodeTexSky", sky_type=WITH_SUN).outputs[0])
    scene.render.film_transparent = True
    assert [lamp.hidden_from for lamp in export()[0].lamps] == [{"camera"}]


@pytest.mark.usefixtures("other_blender_fails")
def test_where_no_other_blender_renders_it_a_constant_world_stands_in(tree, export):
    tree.color(tree.add("ShaderNodeTexSky").outputs[0])
    exported, reasons = export()
    assert exported.world.image is None and "can't be rendered by another Blender" in reasons and "constant" in reasons


@pytest.mark.parametrize("obstacle", ["a coordinate of the camera", "painted pixels", "a script"])
def test_what_an_image_cannot_stand_in_for_is_named(tree, export, obstacle, monkeypatch):
    monkeypatch.setattr(another_blender, "call", lambda *_: pytest.fail("another Blender was asked to render it"))
    if obstacle == "a script":
        node = tree.add("ShaderNodeScript", script=bpy.data.texts.new("shader.osl"))
        node.outputs.new("NodeSocketColor", "Color")
        tree.color(node.outputs[0])
    elif obstacle == "painted pixels":
        node = tree.add("ShaderNodeTexEnvironment", projection="MIRROR_BALL")
        node.image = bpy.data.images.new("Painted", 4, 2)
        node.image.pixels[0] = 0.5
        tree.color(node.outputs[0])
    else:
        tree.color(shifted_direction(tree, "Camera"))
    exported, reasons = export()
    assert exported.world.image is None and "that more than a direction and the file decides" in reasons


@pytest.mark.parametrize("kind", ["PREETHAM", "HOSEK_WILKIE", WITH_SUN])
def test_cycles_shows_the_same_image_and_nearly_the_sky_itself(tree, camera_object, scene, read_passes, tmp_path, kind):
    """The image differs from the sky between two pixels by its curvature there; the mean tells what a surface is lit by."""
    sky = tree.add("ShaderNodeTexSky", sky_type=kind, sun_disc=False)
    tree.color(sky.outputs[0])
    scene.render.resolution_x, scene.render.resolution_y = 64, 48
    camera_object.rotation_euler, camera_object.data.lens = (math.radians(115), 0, 0.3), 25
    exported = jobs.both_sides(Job(level="direct", samples=1), [tmp_path / "image.exr"])
    from viewcam_addon.blender.rendering import cycles
    from viewcam_addon.tracer.scene.film import Bounces

    picture = cycles.LightSettings(exported.film, Bounces(0, 0, 0, 0), 1)
    cycles.render(scene, bpy.context.view_layer, camera_object, tmp_path / "sky.exr", light=picture)
    environment, true = (passes["Environment"] for passes in read_passes([tmp_path / "image.exr", tmp_path / "sky.exr"]))
    traced = render.render(exported, "direct", 1, threads=2)["Environment"]
    error = np.abs(traced - environment) / environment
    assert np.percentile(error, 50) <= 1e-6 and np.percentile(error, 99) <= 2e-5
    # Calibrated, at the horizon: 2e-3 (Hosek and Wilkie) and 2e-5.
    assert np.percentile(np.abs(environment - true) / true, 99) < 5e-3 and abs(environment.mean() / true.mean() - 1) < 1e-4
    turned = np.abs(np.roll(traced, 1, axis=1) - environment) / environment  # by a pixel
    assert np.percentile(turned, 50) > 1e-6


def test_each_of_many_renders_shows_the_camera_its_own_image(tree, camera_object, scene, read_passes, tmp_path, monkeypatch):
    """Else one that is made anew for each may lie where the other one lay, and Cycles shows that."""
    monkeypatch.setattr(world_image, "WIDTH", 64)
    add = tree.add("ShaderNodeMixRGB", blend_type="ADD")
    tree.link(tree.add("ShaderNodeLightPath").outputs["Is Camera Ray"], add.inputs[0])
    tree.link(shifted_direction(tree), add.inputs[1])
    add.inputs[2].default_value = (5, 5, 5, 1)
    tree.color(add.outputs[0])
    addresses = []

    def watched(*arguments, **options):
        image = image_of(*arguments, **options)
        addresses.append(image.as_pointer())
        return image

    monkeypatch.setattr(world_image.images, "image_of", watched)
    scene.render.resolution_x, scene.render.resolution_y = 16, 9
    paths = [tmp_path / f"{seed}.exr" for seed in range(4)]
    jobs.both_sides(Job(level="direct", samples=8), paths)
    means = [passes["Environment"][..., :3].mean(axis=(0, 1)) for passes in read_passes(paths)]
    assert np.allclose(means, means[0], rtol=0.1), means
    assert len(addresses) == 8 and len({*addresses}) == 2, "Cycles tells images by their address"
