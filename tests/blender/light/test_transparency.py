"""Surfaces that light goes straight through: how many of them, what shadow they have, and how much of each, as in Cycles.

Panes lie over one another above a floor, and a sun without a size stands behind the camera: one sample has no noise. Where only
a part of the light goes through, what it does is chosen at random, and pictures are compared by their means.
"""

from dataclasses import replace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.jobs.job import Job
from viewcam_addon.tracer import render

FLOAT32 = 1e-6  # relative: colors are multiplied in float32, as often as there are panes, and cosines rounded
MOST = 4.0  # standard errors
PANES = 4
TINT = (0.9, 0.8, 0.6, 1)


@pytest.fixture
def stage(scene, camera, add, mesh_from, make_material, add_lamp, set_world):
    """stage(floor's shader, pane's shader) → the material of the panes, of which there are more from left to right."""

    def build(below="ShaderNodeBsdfDiffuse", above="ShaderNodeBsdfTransparent", panes=PANES):
        scene.render.resolution_x, scene.render.resolution_y = 40, 8
        camera.location, camera.rotation_euler, camera.data.lens = (0.0, 0.0, 10.0), (0, 0, 0), 70.0
        set_world((0.2, 0.4, 0.7), 1.0)
        sun = add_lamp("SUN", (0, 0, 20), angle=0.0)
        sun.rotation_euler = (0.01, 0.02, 0)
        if below:
            floor = add(mesh_from("plane", size=20), "Floor", (0, 0, -1))
            floor.data.materials.append(make_material("Floor", below, Color=(0.8, 0.7, 0.6, 1)))
        pane = make_material("Pane", above)
        width = 6.0 / (panes + 1)
        for number in range(panes):
            left = -3 + width * (number + 1)
            mesh = bpy.data.meshes.new("Pane")
            mesh.from_pydata([(left, -3, 0), (3, -3, 0), (3, 3, 0), (left, 3, 0)], [], [(0, 1, 2, 3)])
            mesh.materials.append(pane)
            add(mesh, f"Pane {number}", (0, 0, 0.5 * number))
        return pane

    return build


@pytest.fixture
def both(read_passes, tmp_path):
    """both(level, samples, count) → what is exported, our passes, and those of Cycles' pictures."""

    def make(level="path", samples=1, count=1):
        paths = [tmp_path / f"{number}.exr" for number in range(count)]
        exported = jobs.both_sides(Job(threads=2, level=level, samples=samples * count), paths)
        assert not [entry for entry in exported.ledger if entry.status != "exported"], exported.ledger
        return exported, render.render(exported, level, samples * count, threads=2), read_passes(paths)

    return make


def set_black(world):
    """A world that gives no light, which would be random on the floor."""
    next(node for node in world.node_tree.nodes if node.type == "BACKGROUND").inputs["Strength"].default_value = 0.0


def check(sides, names=("Combined",)):
    _, traced, (cycles,) = sides
    for name in names:
        off = np.abs(traced[name].astype(np.float64) - cycles[name])
        summary = "\n".join(
            f"{n} panes: {traced[name][4, 8 * n + 4]} for {cycles[name][4, 8 * n + 4]}" for n in range(PANES + 1)
        )
        assert off.max() <= FLOAT32 * max(cycles[name].max(), 1), f"{name} is off by {off.max():.2g}\n{summary}"


DIFFUSE, GLOWING = "ShaderNodeBsdfDiffuse", "ShaderNodeEmission"


@pytest.mark.parametrize(("below", "most"), [(DIFFUSE, 0), (DIFFUSE, 2), (DIFFUSE, 8), (GLOWING, 1), (GLOWING, 2), (None, 1)])
def test_as_many_panes_are_gone_through_as_in_cycles(stage, both, scene, below, most):
    pane = stage(below)
    pane.node_tree.nodes["Shader"].inputs["Color"].default_value = TINT
    scene.cycles.transparent_max_bounces = most
    scene.render.film_transparent = True
    if below == DIFFUSE:
        set_black(scene.world)
    sides = both("direct")
    check(sides, ("Combined", "Diffuse Color", "Environment"))
    passes = sides[1]["Combined" if below else "Environment"]
    assert sides[0].bounces.transparent == most and passes[..., :3].max() > 0.1


@pytest.mark.parametrize(("below", "above"), [(GLOWING, "ShaderNodeBsdfTransparent"), (None, GLOWING)])
def test_light_that_nodes_make_negative_is_that_as_in_cycles(stage, both, below, above):
    pane = stage(below, above)
    node = pane.node_tree.nodes.new("ShaderNodeCombineXYZ")
    for socket, value in zip(node.inputs, (-0.5, 0.9, 0.7), strict=True):
        socket.default_value = value
    pane.node_tree.links.new(node.outputs[0], pane.node_tree.nodes["Shader"].inputs["Color"])
    sides = both("direct")
    check(sides)
    assert (sides[1]["Combined"][4, :, 0] < -0.1).any()


@pytest.mark.parametrize("is_seen_through", [False, True])
def test_shadows_of_what_is_transparent(stage, both, scene, is_seen_through):
    """The floor lies in the panes' shadow, and light comes through them, or not."""
    pane = stage()
    pane.node_tree.nodes["Shader"].inputs["Color"].default_value = TINT
    pane.use_transparent_shadow = is_seen_through
    set_black(scene.world)
    sides = both("direct")
    check(sides)
    assert (sides[1]["Combined"][4, -4, 0] > 0.1) == is_seen_through


@pytest.mark.parametrize("below", [DIFFUSE, "ShaderNodeBsdfGlossy"])
def test_a_pane_is_told_of_the_ray_what_cycles_tells_it(stage, both, scene, below):
    """Its color is made of all that Light Path says: of the eye's rays, of those to the sun, and of those from a mirror."""
    pane = stage(below)
    tree = pane.node_tree
    light_path = tree.nodes.new("ShaderNodeLightPath")
    total = None
    weights = {"Ray Length": 0.01, "Is Camera Ray": 0.3, "Is Glossy Ray": 0.2, "Is Reflection Ray": 0.1, "Is Shadow Ray": 0.37}
    weights |= {"Is Singular Ray": 0.05, "Is Diffuse Ray": 0.8, "Is Transmission Ray": 0.9, "Ray Depth": 0.07}
    weights |= {"Diffuse Depth": 0.6, "Glossy Depth": 0.021, "Transparent Depth": 0.043, "Transmission Depth": 0.9}
    for name, weight in weights.items():
        term = tree.nodes.new("ShaderNodeMath")
        term.operation = "MULTIPLY_ADD"
        tree.links.new(light_path.outputs[name], term.inputs[0])
        term.inputs[1].default_value, term.inputs[2].default_value = weight, 0.2
        if total:
            tree.links.new(total.outputs[0], term.inputs[2])
        total = term
    tree.links.new(total.outputs[0], tree.nodes["Shader"].inputs["Color"])
    if below == DIFFUSE:
        set_black(scene.world)
    else:
        bpy.data.materials["Floor"].node_tree.nodes["Shader"].inputs["Roughness"].default_value = 0.0
        bpy.data.objects.remove(next(block for block in scene.objects if block.type == "LIGHT"))
    sides = both("path")
    check(sides)
    values = sides[1]["Combined"][4, 4::8, 0]
    assert len(set(np.round(values, 3))) == PANES + 1, values


def test_cut_out_leaves(stage, both, scene):
    """An image whose pixels are there or not, as a Principled surface's alpha: there is no chance in it."""
    leaf = stage(above="ShaderNodeBsdfPrincipled")
    tree = leaf.node_tree
    tree.nodes["Shader"].inputs["Base Color"].default_value = TINT
    tree.nodes["Shader"].inputs["Specular IOR Level"].default_value = 0.0
    image = bpy.data.images.new("Leaf", 4, 4, alpha=True, float_buffer=False)
    image.pixels = np.repeat([[0.2, 0.5, 0.1, 0.0], [0.2, 0.5, 0.1, 1.0]], 8, axis=0).ravel().tolist()
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.interpolation = image, "Closest"
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(coordinates.outputs["Object"], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Alpha"], tree.nodes["Shader"].inputs["Alpha"])
    set_black(scene.world)
    sides = both("direct")
    check(sides)
    color = sides[1]["Diffuse Color"][..., 0]
    assert 0.1 < np.mean(np.abs(color - TINT[0]) < 1e-3) < 0.9


def mixed(pane, factor):
    tree = pane.node_tree
    mix, diffuse = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeBsdfDiffuse")
    mix.inputs[0].default_value = factor
    tree.links.new(tree.nodes["Shader"].outputs[0], mix.inputs[1])
    tree.links.new(diffuse.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.nodes["Output"].inputs["Surface"])


def deviation(sides):
    """Standard errors between the means of both pictures and their alphas."""
    _, traced, cycles = sides
    pictures = np.array([passes["Combined"] for passes in cycles], np.float64)
    error = np.sqrt((pictures[..., :3].var(axis=0, ddof=1) / len(pictures)).sum() + traced["Variance"].sum())
    alphas = pictures[..., 3].mean(axis=(1, 2))
    off = (traced["Combined"][..., :3].sum(dtype=np.float64) - pictures[..., :3].mean(axis=0).sum()) / error
    return off, traced["Combined"][..., 3].mean() - alphas.mean(), alphas.std(ddof=1)


@pytest.mark.parametrize(("kind", "level"), [("alpha", "path"), ("mix", "direct")])
def test_what_lets_a_part_of_the_light_through(stage, both, scene, kind, level):
    """Under a sky and a sun, over a floor and nothing; the sky is found by chance and by rays to it alike."""
    pane = stage(above="ShaderNodeBsdfPrincipled" if kind == "alpha" else "ShaderNodeBsdfTransparent")
    if kind == "alpha":
        pane.node_tree.nodes["Shader"].inputs["Alpha"].default_value = 0.35
    else:
        mixed(pane, 0.6)
    bpy.data.objects["Floor"].scale = (0.1, 0.1, 1)
    scene.render.film_transparent = True
    off, alpha, spread = deviation(both(level, samples=32, count=4))
    assert abs(off) <= MOST and abs(alpha) <= MOST * max(spread, 1e-3), f"{off:+.1f} standard errors, alpha {alpha:+.4f}"


def test_two_percent_less_alpha_are_caught(stage, both, scene, monkeypatch):
    """The test above must be able to fail."""
    from viewcam_addon.tracer import native

    right = native.described_closure

    def thinner(closure, images, nodes):
        inputs = dict(closure.node.inputs)
        if "alpha" in inputs:
            inputs["alpha"] = replace(inputs["alpha"], rgb=(inputs["alpha"].rgb[0] - 0.02,) * 3)
        return right(replace(closure, node=replace(closure.node, inputs=tuple(inputs.items()))), images, nodes)

    monkeypatch.setattr(native, "described_closure", thinner)
    pane = stage(above="ShaderNodeBsdfPrincipled")
    pane.node_tree.nodes["Shader"].inputs["Alpha"].default_value = 0.35
    scene.render.film_transparent = True
    bpy.data.objects["Floor"].scale = (0.1, 0.1, 1)
    off, alpha, spread = deviation(both("direct", samples=32, count=4))
    assert abs(off) > MOST or abs(alpha) > MOST * max(spread, 1e-3)
