"""Shader nodes as the tracer's material: what is exact is read, what is not has a stand-in and a reason.

Blender's images as pictures: each pixel as Blender has it, in as few bytes as hold it.
"""

import struct
import zlib
from dataclasses import replace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender.scenes import materials, shaders
from viewcam_addon.blender.scenes.images import picture_of
from viewcam_addon.blender.temporary_settings import overridden
from viewcam_addon.tracer.scene.colors import RGBE
from viewcam_addon.tracer.scene.materials import PLAIN_COLOR, Color, Material, sum_of
from viewcam_addon.tracer.scene.shader_nodes import KINDS, SHADERS, Node, node
from viewcam_addon.tracer.scene.value_nodes import bump_filter_width

RED, GREEN = (0.5, 0.25, 0.125), (0.0, 1.0, 0.5)


def color(rgb):
    return (*rgb, 1.0)


def link(material, kind, output, socket, node="Shader"):
    """Link a new node's output to an input of another node."""
    tree = material.node_tree
    added = tree.nodes.new(kind)
    tree.links.new(added.outputs[output], tree.nodes[node].inputs[socket])
    return added


def add_shader(material, kind, *sockets, **inputs):
    """A new shader node, whose inputs are fed by other nodes' first outputs."""
    tree = material.node_tree
    added = tree.nodes.new(kind)
    for name, value in inputs.items():
        added.inputs[name].default_value = value
    for number, feeding in sockets:
        tree.links.new(feeding.outputs[0], added.inputs[number])
    return added


def show(material, node):
    tree = material.node_tree
    tree.links.new(node.outputs[0], tree.nodes["Output"].inputs["Surface"])


def exactly(material):
    """The tracer's reading of a material that needs no stand-in."""
    reading = shaders.read(material)
    assert not reading.reasons, reading.reasons
    return reading.material


def approximately(material, *words):
    """The stand-in of a material, whose first reason holds these words."""
    reading = shaders.read(material)
    assert reading.reasons and all(word in reading.reasons[0] for word in words), reading.reasons
    return reading.material


NORMAL = node("geometry", output="normal")
# A width in pixels that nodes can be given, or have where they have no choice.
WIDTH = 1.0 if bpy.app.version >= (4, 5) else bump_filter_width(bpy.app.version[:2])
CHECKS = node("image", image=Color((1.0, 1.0, 1.0), "Checks"), extension="mirror", interpolation="cubic")
TEXTURED = node(
    "mix",
    factor=Color((1.0, 1.0, 1.0), "Checks"),
    first=node(
        "principled",
        base_color=Color(RED, "Checks", closest=True),
        roughness=0.25,
        coat_weight=0.5,
        normal=node("normal_map", color=CHECKS),
    ),
    second=node(
        "add",
        first=node(
            "glossy", color=Color(GREEN, vertex=True), roughness=Color((1.0, 1.0, 1.0), "Checks"), distribution="beckmann"
        ),
        second=node(
            "mix",
            first=node("sheen", color=RED, roughness=0.75, distribution="ashikhmin"),
            second=node("glossy", anisotropy=0.5, rotation=0.25, tangent=node("tangent", axis="x")),
        ),
    ),
)


VALUES = [
    CHECKS,
    node("image", image=Color((1.0, 1.0, 1.0), "Checks"), vector=node("mapping", vector=node("texture_coordinate"), scale=2.0)),
    node("image", image=Color((1.0, 1.0, 1.0), "Checks"), projection="box", blend=0.25, vector=node("geometry")),
    node("environment", image=Color((1.0, 1.0, 1.0), "Checks"), projection="mirror_ball", interpolation="cubic"),
    node("math", a=node("object_info", output="material_index")),
    node("math", a=CHECKS, b=-2.0, operation="smooth_max", clamp=True),
    node("vector_math", a=node("geometry", output="true_normal"), b=(0.5, -1.0, 2.0), operation="dot_product"),
    node("vector_math", a=CHECKS, operation="fract"),
    node("map_range", value=node("layer_weight", output="facing", blend=0.25), interpolation="stepped", clamp=False),
    node("mix_color", factor=node("fresnel", ior=1.25), a=CHECKS, b=Color((1.0, 1.0, 1.0), vertex=True), blend="dodge"),
    node("mix_number", a=node("separate", color=CHECKS, output="y"), clamp_factor=False),
    node("combine_color", x=node("rgb_to_bw", color=CHECKS), z=node("object_info", output="object_index")),
    node("attribute", name="Paint", output="alpha"),
    node("attribute", name="Paint", output="vertex_alpha"),
    node("wireframe", size=node("attribute", name="pointiness", output="number"), pixel_size=True),
    node("noise", scale=node("wave", profile="saw", kind="rings", rings="spherical"), kind="hetero_terrain", dimensions="4d"),
    node("checker", vector=node("texture_coordinate"), color1=node("gradient", kind="radial"), color2=GREEN, output="factor"),
    node(
        "brick",
        color1=RED,
        color2=node("magic", depth=5.0, output="factor"),
        mortar_size=0.0625,
        mortar_smooth=0.125,
        offset_frequency=3.0,
        squash=0.75,
    ),
    node("white_noise", vector=node("texture_coordinate", output="window"), output="color"),
    node("combine_xyz", y=node("clamp", value=node("geometry"), max=0.5)),
    node("separate_color", color=node("combine_color", y=0.5, mode="hsl"), mode="hsv", output="y"),
    node("clamp", value=node("light_path"), kind="range"),
    node("mix_vector", a=node("tangent", axis="y"), b=node("tangent", kind="uv_map", uv="Second")),
    node("mix_vector", a=node("geometry", output="tangent"), b=node("vector_rotate", angle=0.5, invert=True)),
    node("mix_components", factor=node("vector_rotate", rotation=(1.0, 2.0, 0.5), kind="euler_xyz"), b=(0.25, -1.0, 2.0)),
    node("map_range_vector", value=node("vector_transform", **{"from": "camera"}), interpolation="smoothstep"),
    node("voronoi", vector=node("geometry", output="parametric"), feature="smooth_f1", metric="chebychev", output="position"),
    node("math", a=node("blackbody", temperature=node("wavelength", wavelength=450.0)), operation="tanh"),
    node("layer_weight", normal=node("normal_map", color=CHECKS, strength=0.5, space="blender_object", uv="Second")),
    node(
        "layer_weight",
        normal=node(
            "bump",
            height=CHECKS,
            strength=0.5,
            distance=0.25,
            filter_width=WIDTH,
            invert=True,
            normal=NORMAL,
        ),
    ),
    node("hue_saturation", color=node("gamma", color=node("bright_contrast", color=node("invert", color=CHECKS)), gamma=0.5)),
]


@pytest.mark.parametrize("value", VALUES)
def test_the_stand_in_of_a_value_is_read_as_that_value(diffuse, image, value):
    material = Material(surface=node("emission", color=value, strength=2.0))
    with overridden() as overrides:
        materials.stand_in(overrides, diffuse, shaders.Reading(material, {"Checks": image}))
        read = exactly(diffuse)
    assert read == material


def test_every_node_that_makes_values_is_made_for_blender():
    def kinds(value):
        return {value.type}.union(*(kinds(each) for _, each in value.inputs if isinstance(each, Node)))

    assert set().union(*map(kinds, VALUES)) | {*CURVES, "ies"} == {name for name, kind in KINDS.items() if kind.is_value}


def test_an_ies_text_is_made_for_blender_and_gone_with_the_stand_in(diffuse):
    text = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 100\n0 90\n0\n100 50\n"
    material = Material(surface=node("emission", color=node("ies", text=text, strength=0.5)))
    before = len(bpy.data.texts)
    with overridden() as overrides:
        materials.stand_in(overrides, diffuse, shaders.Reading(material))
        read = shaders.read(diffuse)
        assert len(bpy.data.texts) == before + 1
    assert not read.reasons and read.material == material and len(bpy.data.texts) == before


def test_a_displacement_is_read_as_the_height_that_it_is_made_of(diffuse):
    """And as what it is made into along the normal, where it is a Vector Displacement, or goes along other axes."""
    height = node("noise", vector=node("texture_coordinate"), scale=3.0)
    material = sum_of(diffuse=Color(RED), displacement=height)
    with overridden() as overrides:
        materials.stand_in(overrides, diffuse, shaders.Reading(material))
        assert exactly(diffuse) == material
        raised = next(each for each in diffuse.node_tree.nodes if each.type == "DISPLACEMENT")
        raised.space, raised.inputs["Midlevel"].default_value, raised.inputs["Scale"].default_value = "OBJECT", 0.5, 0.25
        read_height = exactly(diffuse).displacement
        assert (read_height["operation"], read_height["b"].type, read_height["a"]["b"]) == (
            "multiply",
            "vector_math",
            (0.25,) * 3,
        )
        diffuse.displacement_method = "BOTH"
        assert exactly(diffuse).displacement is None and materials.departures(diffuse, lit=True) == ["is displaced"]
        diffuse.displacement_method = "BUMP"
        assert not materials.departures(diffuse, lit=True) and materials.departures(diffuse) == ["is displaced"]


CURVES = {"rgb_curves": "color", "vector_curves": "vector", "float_curve": "value"}


@pytest.mark.parametrize("kind", CURVES)
@pytest.mark.parametrize("extrapolate", [False, True])
def test_curves_are_drawn_that_have_the_table_again(diffuse, image, kind, extrapolate):
    """They are straight lines between its entries. Calibrated: 5e-6, of float32 and the slope."""
    table = bpy.data.images.new("Table", 257, 1, float_buffer=True, is_data=True)
    wanted = np.sin(np.linspace(0, 4, 257)[None, :, None] * (1.0, 1.5, 2.0) + 0.3).astype(np.float32) * 1.5
    wanted[..., 1:] = wanted[..., :1] if kind == "float_curve" else wanted[..., 1:]
    table.pixels.foreach_set(np.append(wanted, np.ones((1, 257, 1), np.float32), axis=2).ravel())
    settings = {"table": Color((1.0, 1.0, 1.0), "Table"), "least": -0.25, "most": 1.5, "extrapolate": extrapolate}
    value = node(kind, **{CURVES[kind]: CHECKS}, factor=0.75, **settings)
    material = Material(surface=node("emission", color=value))
    with overridden() as overrides:
        materials.stand_in(overrides, diffuse, shaders.Reading(material, {"Checks": image, "Table": table}))
        read = shaders.read(diffuse)
    read_color = read.material.surface["color"]
    assert not read.reasons and {**dict(read_color.inputs), "table": None} == {**dict(value.inputs), "table": None}
    assert read.tables[read_color["table"].image].pixels == pytest.approx(wanted, abs=2e-5)


def test_what_light_path_says_of_light_is_named_where_both_ways_to_find_it_are_told_otherwise(diffuse, make_material):
    answers = link(diffuse, "ShaderNodeLightPath", "Is Diffuse Ray", "Color")
    assert exactly(diffuse).surface["color"] == node("light_path", output="is_diffuse_ray")
    lamp = make_material("Lamp", "ShaderNodeEmission")
    tree = lamp.node_tree
    for word, sure in (("Is Camera Ray", True), ("Is Diffuse Ray", False), ("Ray Depth", False), ("Ray Length", True)):
        answers = tree.nodes.new("ShaderNodeLightPath")
        tree.links.new(answers.outputs[word], tree.nodes["Shader"].inputs["Strength"])
        if sure:
            exactly(lamp)
        else:
            approximately(lamp, "'Light Path", word)


@pytest.mark.parametrize(("count", "both", "words"), [(150, False, "100 others in a row"), (20, True, "more than 500 others")])
def test_a_value_of_more_nodes_than_are_followed_is_named(diffuse, count, both, words):
    """Each of them feeds the next; or both of its inputs, so that 2^count are asked for."""
    tree = diffuse.node_tree
    value = tree.nodes.new("ShaderNodeTexCoord").outputs["UV"]
    for number in range(count):
        node = tree.nodes.new("ShaderNodeMath")
        for socket in node.inputs[: 1 + both]:
            tree.links.new(value, socket)
        value = node.outputs[0]
        if number == 6:
            tree.links.new(value, tree.nodes["Shader"].inputs["Color"])
            exactly(diffuse)
    tree.links.new(value, tree.nodes["Shader"].inputs["Color"])
    approximately(diffuse, "Math", words)


def test_a_normal_node_is_its_direction_and_how_far_another_goes_along_it(diffuse):
    added = link(diffuse, "ShaderNodeNormal", "Dot", "Color")
    added.outputs["Normal"].default_value = (0.0, 3.0, 4.0)
    diffuse.node_tree.links.new(diffuse.node_tree.nodes.new("ShaderNodeNewGeometry").outputs["Normal"], added.inputs[0])
    unit = {
        name: node("vector_math", operation="normalize", a=vector) for name, vector in (("a", (0.0, 3.0, 4.0)), ("b", NORMAL))
    }
    assert exactly(diffuse).surface["color"] == node("vector_math", operation="dot_product", **unit)


@pytest.mark.parametrize("surface", [TEXTURED, *(node(kind) for kind in SHADERS if kind not in ("mix", "add"))])
def test_the_stand_in_of_a_shader_is_read_as_that_shader(diffuse, image, surface):
    if surface.type == "metallic" and bpy.app.version < (4, 3):
        return  # it came with 4.3
    with overridden() as overrides:
        materials.stand_in(overrides, diffuse, shaders.Reading(Material(surface=surface), {"Checks": image}))
        read = exactly(diffuse)
    if surface.type in ("diffuse", "emission", "glass", "refraction"):  # which are components while they are not rough
        read = Material(surface=read.closures[0].node)
    for read_closure, wanted in zip(read.closures, Material(surface=surface).closures, strict=True):
        assert (read_closure.node.type, read_closure.factors) == (wanted.node.type, wanted.factors)
        for name in KINDS[wanted.node.type].inputs:
            assert name == "distribution" or rounded(read_closure.node[name]) == rounded(wanted.node[name]), name


def rounded(color):
    """A color, to what float32 holds."""
    return replace(color, rgb=tuple(float(np.float32(value)) for value in color.rgb)) if isinstance(color, Color) else color


@pytest.fixture
def diffuse(make_material):
    return make_material("Skin", "ShaderNodeBsdfDiffuse", Color=color(RED))


def test_the_shaders_that_are_components_are_read_as_they_are(make_material):
    assert exactly(make_material("d", "ShaderNodeBsdfDiffuse", Color=color(RED))) == sum_of(diffuse=Color(RED))
    emission = make_material("e", "ShaderNodeEmission", Color=color(RED), Strength=4.0)
    assert exactly(emission) == sum_of(emission=Color((2.0, 1.0, 0.5)))
    mirror = make_material("m", "ShaderNodeBsdfGlossy", Color=color(RED), Roughness=0.0)
    assert exactly(mirror) == sum_of(mirror=Color(RED))
    glass = make_material("g", "ShaderNodeBsdfGlass", Color=color(RED), Roughness=0.0, IOR=1.5)
    assert exactly(glass) == sum_of(glass=Color(RED), ior=1.5)
    clear = make_material("r", "ShaderNodeBsdfRefraction", Color=color(RED), Roughness=0.0, IOR=1.25)
    assert exactly(clear) == sum_of(refraction=Color(RED), ior=1.25)


@pytest.mark.parametrize(("socket", "value"), [("Specular IOR Level", 0.0), ("IOR", 1.0)])
def test_a_principled_surface_without_gloss_is_lamberts(make_material, socket, value):
    material = make_material("p", "ShaderNodeBsdfPrincipled", Base_Color=color(RED), Roughness=0.3, Anisotropic=0.5)
    inputs = material.node_tree.nodes["Shader"].inputs
    inputs[socket].default_value = value
    assert exactly(material) == sum_of(diffuse=Color(RED))
    inputs["Emission Color"].default_value, inputs["Emission Strength"].default_value = color(GREEN), 2.0
    assert exactly(material) == sum_of(diffuse=Color(RED), emission=Color((0.0, 2.0, 1.0)))


PRINCIPLED = {
    "metallic",
    "diffuse_roughness",
    "specular_ior_level",
    "transmission_weight",
    "coat_weight",
    "coat_ior",
    "sheen_weight",
    "sheen_roughness",
    "anisotropic",
    "anisotropic_rotation",
    "roughness",
}


@pytest.mark.parametrize("name", sorted(PRINCIPLED))
def test_a_principled_surface_is_read_with_what_it_is_given(make_material, name):
    material = make_material("p", "ShaderNodeBsdfPrincipled", Base_Color=color(RED))
    inputs = material.node_tree.nodes["Shader"].inputs
    socket = SHADERS["principled"].inputs[name]
    if socket not in inputs:  # Diffuse Roughness came with 4.3
        assert socket == "Diffuse Roughness" and bpy.app.version < (4, 3)
        return
    inputs[socket].default_value = 0.75
    read = exactly(material).surface
    expected = node("principled", base_color=RED, **{name: inputs[socket].default_value})
    assert (read[name], read["base_color"]) == (expected[name], expected["base_color"])


@pytest.mark.parametrize("socket", ["Subsurface Weight", "Thin Film Thickness"])
def test_what_a_principled_surface_is_beyond_that_is_named_and_left_out(make_material, socket):
    material = make_material("p", "ShaderNodeBsdfPrincipled", Base_Color=color(RED))
    plain = exactly(material)
    material.node_tree.nodes["Shader"].inputs[socket].default_value = 0.5
    assert approximately(material, "'Shader'", socket, "0.5") == plain


@pytest.mark.parametrize("kind", ["diffuse", "glossy", "glass", "refraction"])
def test_rough_shaders_are_read_as_shaders(make_material, kind):
    material = make_material("rough", SHADERS[kind].class_name, Color=color(RED), Roughness=0.25)
    read = exactly(material).surface
    assert read.type == kind and read["color"] == Color(RED) and read["roughness"] == Color((0.25,) * 3)


def test_what_is_stretched_across_a_tangent_is_stretched_along_one_a_quarter_further(make_material):
    material = make_material("g", "ShaderNodeBsdfGlossy", Roughness=0.25, Anisotropy=-0.5, Rotation=0.875)
    read = exactly(material).surface
    assert (read["anisotropy"].rgb[0], read["rotation"].rgb[0], read["tangent"]) == (0.5, 0.125, None)


def test_a_tangent_counts_only_where_something_is_stretched_along_it(make_material):
    material = make_material("g", "ShaderNodeBsdfGlossy", Roughness=0.25)
    tree = material.node_tree
    tangent = tree.nodes.new("ShaderNodeTangent")
    tangent.direction_type, tangent.uv_map = "UV_MAP", "Second"
    tree.links.new(tangent.outputs[0], tree.nodes["Shader"].inputs["Tangent"])
    assert exactly(material).surface["tangent"] is None and not exactly(material).attributes
    tree.nodes["Shader"].inputs["Anisotropy"].default_value = 0.5
    assert exactly(material).surface["tangent"] == node("tangent", kind="uv_map", uv="Second")
    assert exactly(material).attributes == {"Second"}
    tree.links.clear()
    tree.links.new(tree.nodes["Shader"].outputs[0], tree.nodes["Output"].inputs["Surface"])
    assert exactly(material).attributes == {"generated"}


@pytest.mark.parametrize("word", ["GGX", "BECKMANN", "MULTI_GGX", "ASHIKHMIN_SHIRLEY"])
def test_distributions_are_read_by_name(make_material, word):
    material = make_material("rough", "ShaderNodeBsdfGlossy", Roughness=0.25)
    material.node_tree.nodes["Shader"].distribution = word
    if word == "ASHIKHMIN_SHIRLEY":
        approximately(material, "'Shader'", word)
    else:
        assert shaders.word_of(exactly(material).surface["distribution"]) == word


def test_shaders_are_mixed_and_added_by_constant_factors(diffuse):
    nodes = diffuse.node_tree.nodes
    glow = add_shader(diffuse, "ShaderNodeEmission", Color=color((1, 1, 1)), Strength=2.0)
    mirror = add_shader(diffuse, "ShaderNodeBsdfGlossy", Color=color(GREEN), Roughness=0.0)
    added = add_shader(diffuse, "ShaderNodeAddShader", (0, glow), (1, mirror))
    mixed = add_shader(diffuse, "ShaderNodeMixShader", (1, nodes["Shader"]), (2, added))
    mixed.inputs[0].default_value = 0.25
    show(diffuse, mixed)
    assert exactly(diffuse) == sum_of(
        diffuse=Color((0.375, 0.1875, 0.09375)), emission=Color((0.5,) * 3), mirror=Color((0.0, 0.25, 0.125))
    )
    both = add_shader(diffuse, "ShaderNodeAddShader", (0, mixed), (1, nodes["Shader"]))
    show(diffuse, both)
    assert exactly(diffuse).surface["first"]["second"]["color"] == Color((0.875, 0.4375, 0.21875)), "two of a kind add up"


@pytest.mark.parametrize(("factor", "left"), [(0.0, "first"), (-1.0, "first"), (1.0, "second"), (7.0, "second")])
def test_what_has_no_weight_in_a_mixture_is_not_looked_at(diffuse, factor, left):
    toon = add_shader(diffuse, "ShaderNodeBsdfToon")
    pair = [diffuse.node_tree.nodes["Shader"], toon]
    mixed = add_shader(diffuse, "ShaderNodeMixShader", *enumerate(pair if left == "first" else pair[::-1], start=1))
    mixed.inputs[0].default_value = factor
    show(diffuse, mixed)
    assert exactly(diffuse) == sum_of(diffuse=Color(RED))


@pytest.mark.parametrize(("socket", "weight"), [("Coat Roughness", "Coat Weight"), ("Sheen Tint", "Sheen Weight")])
def test_what_makes_an_input_that_does_not_count_is_not_followed(make_material, socket, weight):
    material = make_material("p", "ShaderNodeBsdfPrincipled", Base_Color=color(RED))
    link(material, "ShaderNodeAmbientOcclusion", 0, socket)
    exactly(material)
    material.node_tree.nodes["Shader"].inputs[weight].default_value = 0.5
    approximately(material, "'Ambient Occlusion'", "not modeled")


@pytest.mark.parametrize("kind", ["AmbientOcclusion", "TexGabor", "RadialTiling", "TexSky", "Bevel"])
def test_a_texture_that_is_not_modeled_leaves_the_color_of_the_viewport_and_is_named(diffuse, kind):
    if not hasattr(bpy.types, f"ShaderNode{kind}"):
        pytest.skip(f"Blender {bpy.app.version_string} has no {kind}")
    diffuse.diffuse_color = (*RED, 1.0)
    link(diffuse, f"ShaderNode{kind}", 0, "Color")
    assert approximately(diffuse, "not modeled") == sum_of(diffuse=Color(RED))


def test_a_factor_that_is_not_modeled_is_a_half(diffuse):
    mixed = add_shader(diffuse, "ShaderNodeMixShader", (1, diffuse.node_tree.nodes["Shader"]))
    mixed.name = "Blend"
    link(diffuse, "ShaderNodeAmbientOcclusion", 0, 0, "Blend")
    show(diffuse, mixed)
    (closure,) = approximately(diffuse, "'Ambient Occlusion'", "not modeled").closures
    assert closure.node["color"] == Color(tuple(value / 2 for value in RED)) and not closure.factors


def test_other_shaders_are_lamberts_of_their_color(make_material):
    toon = make_material("t", "ShaderNodeBsdfToon", Color=color(RED))
    assert approximately(toon, "'Shader'", "not modeled") == sum_of(diffuse=Color(RED))


def test_what_has_no_color_has_the_viewports(make_material):
    unknown = make_material("s", "ShaderNodeBsdfDiffuse")
    link(unknown, "ShaderNodeAmbientOcclusion", 0, "Color").name = "Wires"
    unknown.diffuse_color = color(GREEN)
    assert approximately(unknown, "'Wires'", "not modeled") == sum_of(diffuse=Color(GREEN))


def test_constant_nodes_reroutes_muted_nodes_and_groups_are_looked_through(diffuse):
    tree = diffuse.node_tree
    group = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    group.interface.new_socket("Tint", in_out="INPUT", socket_type="NodeSocketColor")
    group.interface.new_socket("Power", in_out="INPUT", socket_type="NodeSocketFloat")
    group.interface.new_socket("Surface", in_out="OUTPUT", socket_type="NodeSocketShader")
    start, glow, end = (group.nodes.new(kind) for kind in ("NodeGroupInput", "ShaderNodeEmission", "NodeGroupOutput"))
    group.links.new(start.outputs["Tint"], glow.inputs["Color"])
    group.links.new(start.outputs["Power"], glow.inputs["Strength"])
    group.links.new(glow.outputs[0], end.inputs[0])
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    node.inputs["Power"].default_value = 2.0
    rgb, reroute = tree.nodes.new("ShaderNodeRGB"), tree.nodes.new("NodeReroute")
    rgb.outputs[0].default_value = color(RED)
    muted = tree.nodes.new("ShaderNodeInvert")
    muted.mute = True
    tree.links.new(rgb.outputs[0], muted.inputs["Color"])
    tree.links.new(muted.outputs[0], reroute.inputs[0])
    tree.links.new(reroute.outputs[0], node.inputs["Tint"])
    show(diffuse, node)
    assert exactly(diffuse) == sum_of(emission=Color((1.0, 0.5, 0.25)))


def test_a_value_is_a_gray_and_a_color_has_a_luminance(make_material):
    material = make_material("e", "ShaderNodeEmission")
    link(material, "ShaderNodeValue", 0, "Color").outputs[0].default_value = 0.5
    link(material, "ShaderNodeRGB", 0, "Strength").outputs[0].default_value = color((0.0, 1.0, 0.0))
    assert exactly(material).surface["color"].rgb == pytest.approx((0.5 * 0.7151687,) * 3)


@pytest.fixture
def image(fresh_blender):
    block = bpy.data.images.new("Checks", 4, 2)
    block.pixels.foreach_set([0.5, 0.25, 1.0, 1.0] * 8)
    return block


def test_an_image_and_the_meshs_colors_are_factors(diffuse, image):
    texture = link(diffuse, "ShaderNodeTexImage", 0, "Color")
    texture.image, texture.interpolation = image, "Closest"
    assert exactly(diffuse) == sum_of(diffuse=Color((1.0, 1.0, 1.0), "Checks", closest=True))
    link(diffuse, "ShaderNodeVertexColor", 0, "Color")
    assert exactly(diffuse) == sum_of(diffuse=Color((1.0, 1.0, 1.0), vertex=True))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda node: setattr(node.texture_mapping, "scale", (2, 1, 1)), "mapping of its own"),
        (lambda node: setattr(node.color_mapping, "brightness", 0.5), "mapping of its own"),
        (lambda node: setattr(node.image, "source", "TILED"), "no single still image"),
    ],
)
def test_how_an_image_is_used_otherwise_is_named(diffuse, image, change, words):
    texture = link(diffuse, "ShaderNodeTexImage", 0, "Color")
    texture.image = image
    change(texture)
    approximately(diffuse, "'Image Texture'", words)


def test_an_image_is_laid_out_by_what_the_mesh_has(diffuse, image):
    texture = link(diffuse, "ShaderNodeTexImage", 0, "Color")
    texture.image = image
    coordinates = link(diffuse, "ShaderNodeTexCoord", "UV", "Vector", texture.name)
    exactly(diffuse)
    diffuse.node_tree.links.new(coordinates.outputs["Generated"], texture.inputs["Vector"])
    assert exactly(diffuse).attributes == {"generated"}
    link(diffuse, "ShaderNodeUVMap", 0, "Vector", texture.name).uv_map = "Second"
    assert exactly(diffuse).attributes == {"Second"}
    coordinates.from_instancer = True
    diffuse.node_tree.links.new(coordinates.outputs["UV"], texture.inputs["Vector"])
    approximately(diffuse, "'Texture Coordinate'", "instancer")


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1e30])
def test_colors_that_light_can_not_have_are_named(diffuse, value):
    diffuse.node_tree.nodes["Shader"].inputs["Color"].default_value = (value, 0.5, 0.5, 1)
    approximately(diffuse, "'Shader'", "Color")


def test_a_principled_surface_that_takes_light_away_is_named(make_material):
    material = make_material("p", "ShaderNodeBsdfPrincipled", Emission_Color=color(RED), Emission_Strength=-1.0)
    approximately(material, "'Shader'", "Emission Strength of -1")


def test_without_nodes_or_without_an_output_the_viewports_color_counts(diffuse):
    diffuse.diffuse_color = color(GREEN)
    diffuse.node_tree.nodes.remove(diffuse.node_tree.nodes["Output"])
    assert shaders.read(diffuse).material == sum_of(diffuse=Color(GREEN))


def test_the_stand_in_of_everything_is_read_as_what_it_stands_for(diffuse, image):
    """Cycles is shown the nodes that the tracer has, or the shader below would be another."""
    material = sum_of(
        diffuse=Color(RED),
        emission=Color((1.0, 2.0, 3.0)),
        mirror=Color(GREEN),
        glass=Color((1.0, 1.0, 1.0)),
        refraction=Color(RED),
        ior=1.25,
    )
    before = [node.name for node in diffuse.node_tree.nodes]
    with overridden() as overrides:
        materials.stand_in(overrides, diffuse, shaders.Reading(material))
        assert exactly(diffuse) == material
    assert [node.name for node in diffuse.node_tree.nodes] == before
    assert exactly(diffuse) == sum_of(diffuse=Color(RED))


def test_products_of_colors_are_read_as_what_they_stand_for(diffuse, image):
    material = sum_of(
        diffuse=Color((0.5, 0.25, 0.0), image.name_full, closest=True, vertex=True),
        emission=Color((4.0, 2.0, 1.0), vertex=True),
        mirror=Color((0.5, 0.5, 0.5), image.name_full),
    )
    with overridden() as overrides:
        materials.stand_in(overrides, diffuse, shaders.Reading(material, {image.name_full: image}))
        assert exactly(diffuse) == material


def test_the_plain_material_is_the_tracers(fresh_blender):
    with overridden() as overrides:
        assert exactly(materials.plain(overrides)).surface["color"].rgb == pytest.approx(PLAIN_COLOR.rgb, rel=2.0**-24)
    assert not bpy.data.materials


@pytest.fixture
def make_image(fresh_blender):
    """image(pixels (height, width, 4), space, **options) → an image of these."""

    def make(pixels, space="Non-Color", **options):
        block = bpy.data.images.new("Made", pixels.shape[1], pixels.shape[0], **options)
        block.colorspace_settings.name = space
        block.pixels.foreach_set(np.float32(pixels).ravel())
        block.update()
        return block

    return make


def in_blender(make_image):
    """(height, width, 3): the pixels as floats."""
    pixels = np.empty(len(make_image.pixels), np.float32)
    make_image.pixels.foreach_get(pixels)
    return np.ascontiguousarray(pixels.reshape(make_image.size[1], make_image.size[0], make_image.channels)[..., :3])


def opaque(*values):
    return np.stack([*values, np.ones_like(values[0])], axis=-1)


@pytest.mark.parametrize("space", ["sRGB", "Non-Color"])
def test_an_image_of_bytes_keeps_its_bytes_which_stand_for_the_floats_that_blender_shows(make_image, space):
    levels = np.arange(256).reshape(8, 32)
    block = make_image(opaque(levels, levels[::-1], levels[:, ::-1]) / [255, 255, 255, 1], space)
    picture = picture_of(block)
    assert picture.pixels.dtype == np.uint8 and picture.srgb == (space == "sRGB")
    assert np.array_equal(picture.pixels[..., 0], levels)
    assert picture.values.tobytes() == in_blender(block).tobytes()


def test_bytes_are_multiplied_by_their_alpha_in_whole_bytes(make_image):
    levels = np.arange(256).reshape(8, 32)
    block = make_image(np.stack([levels] * 3 + [levels[::-1]], axis=-1) / 255, "sRGB", alpha=True)
    block.alpha_mode = "STRAIGHT"
    multiplied = picture_of(block).pixels
    assert multiplied.dtype == np.uint8 and np.array_equal(multiplied[..., 1], levels * levels[::-1] // 255)
    with_alpha = picture_of(block, alpha=True)
    assert with_alpha.pixels.dtype == np.uint8 and np.array_equal(with_alpha.pixels[..., 3], levels[::-1])


@pytest.mark.parametrize(("bits", "dtype"), [(11, np.float16), (12, np.float32)])
def test_floats_are_half_ones_where_these_hold_their_bits(make_image, bits, dtype):
    odd = np.random.default_rng(0).integers(2 ** (bits - 1), 2**bits, (3, 4, 5)) | 1
    block = make_image(opaque(*odd / 128), float_buffer=True)
    picture = picture_of(block)
    assert picture.pixels.dtype == dtype
    assert picture.values.tobytes() == in_blender(block).tobytes()


def test_a_file_of_radiance_keeps_its_four_bytes_where_half_floats_are_too_small_and_too_coarse(fresh_blender, tmp_path):
    """From a night's 2⁻³⁰ to a sun."""
    levels = np.random.default_rng(0).integers(128, 256, (4, 5, 4)).astype(np.uint8)
    levels[..., 3] = np.arange(20).reshape(4, 5) * 3 + 106
    path = tmp_path / "sky.hdr"
    path.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 5\n" + levels[::-1].tobytes())
    block = bpy.data.images.load(str(path))
    picture = picture_of(block)
    assert picture.pixels.dtype == RGBE and np.array_equal(picture.pixels.view(np.uint8), levels)
    assert picture.values.tobytes() == in_blender(block).tobytes()
    assert picture_of(block, alpha=True).values[..., :3].tobytes() == picture.values.tobytes()


def test_a_png_of_two_bytes_keeps_them(fresh_blender, tmp_path):
    levels = np.arange(65536, dtype=">u2").reshape(256, 256)
    rows = b"".join(b"\0" + row.tobytes() for row in np.repeat(levels[::-1, :, None], 3, axis=2))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", 256, 256, 16, 2, 0, 0, 0)
    parts = chunk(b"IHDR", header), chunk(b"IDAT", zlib.compress(rows)), chunk(b"IEND", b"")
    path = tmp_path / "levels.png"
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(parts))
    block = bpy.data.images.load(str(path))
    block.colorspace_settings.name = "Non-Color"
    picture = picture_of(block)
    assert picture.pixels.dtype == np.uint16 and np.array_equal(picture.pixels[..., 2], levels)
    assert picture.values.tobytes() == in_blender(block).tobytes()
