"""Lamps with nodes, without noise: of no size, or seen by the camera; here and in Cycles.

Errors are relative to the brightest pixel of a picture: nodes may make light end anywhere.
"""

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.tracer import native

pytestmark = pytest.mark.slow

# p50, p99. Calibrated: float32 of angles in Cycles, which tables and images are looked up by.
EXACT = 5e-7, 1e-5
TABLE = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 {} {} 1 2 0 0 0\n1 1 100\n{}\n{}\n{}\n"


def ies_text(across, up, seed=0):
    values = np.random.default_rng(seed).uniform(20, 1000, (len(across), len(up)))
    rows = (" ".join(f"{value:.6g}" for value in row) for row in values)
    return TABLE.format(len(up), len(across), " ".join(map(str, up)), " ".join(map(str, across)), "\n".join(rows))


def emission_of(lamp):
    """The nodes of a light, and the Emission among them."""
    if not lamp.data.node_tree:
        lamp.data.use_nodes = True
    lamp.data.use_nodes = True
    tree = lamp.data.node_tree
    return tree, next(node for node in tree.nodes if node.type == "EMISSION")


def falloff(lamp, output, smooth=0.0):
    tree, emission = emission_of(lamp)
    node = tree.nodes.new("ShaderNodeLightFalloff")
    node.inputs["Strength"].default_value, node.inputs["Smooth"].default_value = 0.7, smooth
    tree.links.new(node.outputs[output], emission.inputs["Strength"])


def ies(lamp, across=(0, 90), up=(0, 20, 45, 60, 90), by=None, path=None):
    """by : the output of a Texture Coordinate that it is looked up by."""
    tree, emission = emission_of(lamp)
    node = tree.nodes.new("ShaderNodeTexIES")
    if path:
        path.write_text(ies_text(across, up))
        node.mode, node.filepath = "EXTERNAL", str(path)
    else:
        node.ies = bpy.data.texts.new("web")
        node.ies.write(ies_text(across, up))
    node.inputs["Strength"].default_value = 0.02
    if by:
        tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs[by], node.inputs["Vector"])
    tree.links.new(node.outputs["Fac"], emission.inputs["Strength"])


def image(lamp, by=None, times=(1.0, 1.0, 1.0)):
    """A picture of random colors, smooth."""
    tree, emission = emission_of(lamp)
    picture = bpy.data.images.new("Gobo", 8, 8, float_buffer=True)
    picture.colorspace_settings.name = "Non-Color"
    picture.pixels.foreach_set(np.random.default_rng(1).uniform(0.1, 1, 256).astype(np.float32))
    picture.update()
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = picture
    if by:
        mapping = tree.nodes.new("ShaderNodeMapping")
        mapping.inputs["Scale"].default_value = times
        tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs[by], mapping.inputs["Vector"])
        tree.links.new(mapping.outputs[0], node.inputs["Vector"])
    tree.links.new(node.outputs["Color"], emission.inputs["Color"])


def image_by_a_map(lamp):
    """By a UV map of a name, which no light has."""
    image(lamp)
    tree, _ = emission_of(lamp)
    uv_map = tree.nodes.new("ShaderNodeUVMap")
    uv_map.uv_map = "Unwrapped"
    tree.links.new(uv_map.outputs[0], next(node for node in tree.nodes if node.type == "TEX_IMAGE").inputs["Vector"])


def noise(lamp):
    """In the coordinates that a texture is looked up by where nothing is given; mixed with a plain light, and another added."""
    tree, emission = emission_of(lamp)
    texture, plain, mix, add = (
        tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexWave", "Emission", "MixShader", "AddShader")
    )
    texture.inputs["Scale"].default_value = 0.3
    plain.inputs["Color"].default_value = (0.2, 0.5, 1.0, 1.0)
    output = next(node for node in tree.nodes if node.type == "OUTPUT_LIGHT")
    way = tree.nodes.new("ShaderNodeLightPath")
    tree.links.new(texture.outputs[0], mix.inputs[0])
    tree.links.new(emission.outputs[0], mix.inputs[1])
    tree.links.new(plain.outputs[0], mix.inputs[2])
    tree.links.new(way.outputs["Ray Length"], plain.inputs["Strength"])
    tree.links.new(mix.outputs[0], add.inputs[0])
    tree.links.new(plain.outputs[0], add.inputs[1])
    tree.links.new(add.outputs[0], output.inputs["Surface"])


def weight(lamp):
    """By where light goes."""
    tree, emission = emission_of(lamp)
    geometry, separate = tree.nodes.new("ShaderNodeNewGeometry"), tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(geometry.outputs["Incoming"], separate.inputs[0])
    absolute = tree.nodes.new("ShaderNodeMath")
    absolute.operation = "ABSOLUTE"
    tree.links.new(separate.outputs[0], absolute.inputs[0])
    tree.links.new(absolute.outputs[0], emission.inputs["Strength"])
    tree.links.new(geometry.outputs["Position"], emission.inputs["Color"])


KINDS = {
    "linear": ("POINT", lambda lamp: falloff(lamp, "Linear")),
    "constant": ("SPOT", lambda lamp: falloff(lamp, "Constant")),
    "smooth": ("POINT", lambda lamp: falloff(lamp, "Quadratic", 4.0)),
    "linear and smooth": ("AREA", lambda lamp: falloff(lamp, "Linear", 4.0)),
    "a sun's": ("SUN", lambda lamp: falloff(lamp, "Quadratic", 4.0)),
    "a quadrant": ("POINT", ies),
    "a round": ("SPOT", lambda lamp: ies(lamp, (0,), (0, 30, 90, 130, 180))),
    "half a round": ("AREA", lambda lamp: ies(lamp, (0, 40, 100, 180), (0, 45, 90))),
    "a whole, uneven round": ("POINT", lambda lamp: ies(lamp, (0, 50, 130, 260, 300, 360), (0, 10, 40, 75, 100))),
    "a part of a round": ("POINT", lambda lamp: ies(lamp, (30, 80, 130, 260, 300), (5, 10, 40, 75, 80))),
    "by its normal": ("POINT", lambda lamp: ies(lamp, by="Normal")),
    "a gobo on a spot": ("SPOT", image),
    "a gobo on a point": ("POINT", image),
    "a gobo by the normal": ("SPOT", lambda lamp: image(lamp, "Normal", (0.4, 0.7, 1.0))),
    "a gobo by UV": ("POINT", lambda lamp: image(lamp, "UV", (3.0, 2.0, 1.0))),
    "a gobo by a named map": ("POINT", image_by_a_map),
    "waves": ("POINT", noise),
    "waves on a spot": ("SPOT", noise),
    "the way of light": ("POINT", weight),
}


@pytest.fixture
def shone(pictures, add_lamp):
    """shone(kind of light, what gives it nodes) → scenes from both sides."""

    def show(kind, arrange, scenes=3):
        sized = {"SUN": {"angle": 0.0}, "AREA": {"shape": "DISK", "size": 3e-5}}
        lamp = add_lamp(kind, **sized.get(kind, {"shadow_soft_size": 0.0}))
        arrange(lamp)

        def place(rng):
            lamp.location, lamp.data.energy = (*rng.uniform(-1, 1, 2), rng.uniform(3, 6)), rng.uniform(1, 900)
            lamp.rotation_euler = (*rng.uniform(-0.4, 0.4, 2), rng.uniform(0, 6))
            if kind == "SPOT":
                lamp.data.spot_size, lamp.data.spot_blend = rng.uniform(1, 2.5), rng.uniform(0.15, 1)

        return pictures(place, scenes=scenes)

    return show


def check(sides, p50, p99):
    result = []
    for each in sides:
        assert all(entry.status == "exported" for entry in each.exported.ledger), each.exported.ledger
        traced, cycles = (passes["Combined"][..., :3].astype(np.float64) for passes in (each.traced, each.cycles[0]))
        lit = (traced > 0) | (cycles > 0)
        assert lit.sum() > 1500, lit.sum()
        result.append(np.abs(traced - cycles)[lit] / cycles.max())
    percentiles = np.percentile(np.concatenate(result), (50, 99, 100))
    assert percentiles[0] <= p50 and percentiles[1] <= p99, (
        f"p50 {percentiles[0]:.2g}, p99 {percentiles[1]:.2g}, most {percentiles[2]:.2g}"
    )


@pytest.mark.parametrize("what", KINDS)
def test_lamps_with_nodes_are_cycles(shone, what):
    check(shone(*KINDS[what]), *EXACT)


def test_a_web_in_a_file_is_read_as_cycles_reads_it(shone, tmp_path):
    check(shone("POINT", lambda lamp: ies(lamp, path=tmp_path / "web.ies"), scenes=1), *EXACT)


WRONG = {
    "linear": ("math", {"a": 0.7007}),
    "a quadrant": ("ies", {"strength": 0.02002}),
    "a gobo on a spot": ("image", {"interpolation": "cubic"}),
    "a gobo on a point": ("math", {"c": 0.502}),
}


@pytest.mark.parametrize("what", WRONG)
def test_nodes_of_a_lamp_that_are_a_little_wrong_are_found(shone, monkeypatch, what):
    """The tests above must be able to fail."""
    right, (kind, changes) = native._described_node, WRONG[what]

    def described(node, *numbers):
        is_it = node.type == kind and ("c" not in changes or (node["operation"], node["c"]) == ("multiply_add", (0.5,) * 3))
        if is_it and ("a" not in changes or isinstance(node["a"], tuple)):
            node = native.Node(node.type, (*node.inputs, *changes.items()))
        return right(node, *numbers)

    monkeypatch.setattr(native, "_described_node", described)
    with pytest.raises(AssertionError, match="p50"):
        check(shone(*KINDS[what], scenes=1), *EXACT)


@pytest.mark.parametrize("shape", ["RECTANGLE", "ELLIPSE"])
def test_a_panel_with_a_picture_shows_it(fresh_blender, scene, camera, add_lamp, set_world, shape, first_samples):
    """The camera sees it right at every place; the way there begins at the clip's start; the panel is turned, and stretched."""
    scene.render.resolution_x, scene.render.resolution_y = 48, 36
    set_world((0, 0, 0), 0.0)
    lamp = add_lamp("AREA", (0.1, 0.2, -3.0), (math.pi + 0.2, 0.1, 0.3), shape=shape, size=2.0, size_y=1.4)
    lamp.scale = (1.2, 0.9, 1.0)
    image(lamp)
    falloff(lamp, "Linear")
    camera.location, camera.rotation_euler, camera.data.lens = (0, 0, 0), (0, 0, 0), 40
    traced, cycles_passes = first_samples()
    first, other = (each["Combined"][..., :3].astype(np.float64) for each in (traced, cycles_passes))
    apart = np.abs(first - other)[other > 0] / other.max()
    summary = len(apart), *np.percentile(apart, (50, 99))
    assert len(apart) > 1000 and summary[1] < 1e-6 and summary[2] < 1e-4, summary
