"""Surfaces under one sun and one sample: colors, textures and stand-ins, all without noise."""

import sys

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon import png
from viewcam_addon.blender import camera as blender_camera
from viewcam_addon.blender import versions
from viewcam_addon.blender.jobs import stage as stages
from viewcam_addon.blender.scenes import materials
from viewcam_addon.tracer.native import CoreScene
from viewcam_addon.tracer.scene import Object, Scene, Spheres

from tests.tracer.core_probes import refracted  # isort: skip


# Errors, as shares of the light that the brightest texture reflects. A cosine's rounding is 2e-7 at the 99th percentile
# (test_delta_lights.py); a texture adds what its UV is off: 1e-5 of the picture's width at most, in textures of a few pixels.
FLAT, TEXTURED = 4e-7, 1e-4
# Cycles has points as float32, and looks up how much its default surface reflects in a table.
POINTS = 1e-4
# The rounding by 5.2 of the bytes of corners, once decoded: it is off by as much as half floats are (they pass exactly before).
HALF = 2.0**-12


@pytest.fixture(autouse=True)
def sun(add_lamp):
    add_lamp("SUN", rotation=(0.4, 0.3, 0), angle=0.0, energy=3.0)


@pytest.fixture
def floor(stage):
    """The floor's material, and the nodes that it can be changed by."""
    return bpy.data.objects["Floor"].data.materials[0]


def check(sides, tolerance):
    """Assert the same light on both sides, but for a hundredth of the pixels, that lie on edges of textures."""
    for each in sides:
        traced, cycles = each.traced["Combined"], each.cycles[0]["Combined"]
        error = np.abs(traced - cycles)[..., :3].max(axis=-1) / cycles[..., :3].max()
        percentiles = np.percentile(error, [50, 90, 99, 100])
        assert percentiles[2] <= tolerance and cycles[..., :3].max() > 0.05, percentiles


def reasons(sides):
    return {entry.object: entry.reason for entry in sides[0].exported.ledger if entry.status != "exported"}


@pytest.fixture
def image(fresh_blender):
    """image(space, opacity, **options) → an image of 5 × 3 random pixels."""

    def make(space="sRGB", opacity=1.0, **options):
        block = bpy.data.images.new("Checks", 5, 3, **options)
        block.colorspace_settings.name = space
        pixels = np.random.default_rng(1).random((15, 4), np.float32)
        pixels[:, 3] = opacity
        block.pixels.foreach_set(pixels.ravel())
        block.update()
        return block

    return make


def texture(material, image, interpolation, output="Color"):
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image, node.interpolation = image, interpolation
    material.node_tree.links.new(node.outputs["Color"], material.node_tree.nodes["Shader"].inputs["Color"])
    return node


def test_a_principled_surface_without_gloss(pictures, make_material):
    for name in ("Monkey", "Floor"):
        data = bpy.data.objects[name].data
        data.materials[0] = make_material(
            name, "ShaderNodeBsdfPrincipled", Base_Color=(0.7, 0.4, 0.2, 1), Specular_IOR_Level=0.0, Roughness=0.3
        )
    sides = pictures(scenes=2)
    check(sides, FLAT)
    assert not reasons(sides)


def is_gloss(colors):
    """True if what scatters diffusely is another share at each angle; the plain material scatters the same everywhere."""
    return len(np.unique(colors[..., 0])) > 100


@pytest.mark.parametrize("slots", [0, 1, 2])
def test_no_material_is_cycles_own_default(pictures, slots):
    for name in ("Monkey", "Floor"):
        mesh = bpy.data.objects[name].data
        default = mesh.materials[0]
        mesh.materials.clear()
        for material in (None, default)[:slots]:
            mesh.materials.append(material)
        for face in mesh.polygons[: slots // 2 * len(mesh.polygons) // 2]:
            face.material_index = 1
    before = [len(bpy.data.objects[name].material_slots) for name in ("Monkey", "Floor")]
    sides = pictures(scenes=2)
    check(sides, POINTS)
    assert not reasons(sides) and before == [len(bpy.data.objects[name].material_slots) for name in ("Monkey", "Floor")]
    assert is_gloss(sides[0].traced["Diffuse Color"]) == (bpy.app.version >= (5, 0))


def test_an_empty_slot_of_an_object_is_as_cycles_has_it(pictures):
    """Since 5.1 its own default; before, the mesh's material."""
    for name in ("Monkey", "Floor"):
        slot = bpy.data.objects[name].material_slots[0]
        slot.link, slot.material = "OBJECT", None
    sides = pictures(scenes=2)
    check(sides, POINTS)
    assert not reasons(sides)
    assert is_gloss(sides[0].traced["Diffuse Color"]) == versions.EMPTY_SLOTS_OF_OBJECTS_STAY_EMPTY


def test_what_geometry_nodes_make_without_a_material_is_it_too(pictures, node_group):
    tree, _, end = node_group("Cube")
    tree.links.new(tree.nodes.new("GeometryNodeMeshCube").outputs[0], end.inputs[0])
    bpy.data.objects["Monkey"].modifiers.new("Cube", "NODES").node_group = tree
    sides = pictures(scenes=2)
    check(sides, POINTS)
    assert not reasons(sides) and is_gloss(sides[0].traced["Diffuse Color"]) == (bpy.app.version >= (5, 0))


def test_points_that_no_material_came_along_with_are_cycles_own_default(pictures, node_group):
    tree, start, end = node_group("Points")
    points = tree.nodes.new("GeometryNodeMeshToPoints")
    points.inputs["Radius"].default_value = 0.1
    tree.links.new(start.outputs[0], points.inputs["Mesh"])
    tree.links.new(points.outputs[0], end.inputs[0])
    bpy.data.objects["Monkey"].modifiers.new("Points", "NODES").node_group = tree
    sides = pictures(scenes=1)
    check(sides, POINTS)
    assert not reasons(sides)
    assert is_gloss(sides[0].traced["Diffuse Color"]) == (bpy.app.version >= (5, 0))


@pytest.mark.parametrize("interpolation", ["Linear", "Closest"])
@pytest.mark.parametrize(("space", "options"), [("sRGB", {}), ("Non-Color", {}), ("Non-Color", {"float_buffer": True})])
def test_images_of_bytes_and_floats(pictures, floor, image, interpolation, space, options):
    texture(floor, image(space, **options), interpolation)
    sides = pictures(scenes=2)
    check(sides, TEXTURED)
    assert not reasons(sides) and len(np.unique(sides[0].cycles[0]["Diffuse Color"])) > 10


@pytest.mark.parametrize("asked", ["by the same node", "by one that is alike", "by one with other pixels", "in vain"])
def test_a_color_is_divided_by_its_alpha_where_cycles_does_so(pictures, floor, image, asked):
    node = texture(floor, image(opacity=np.linspace(0.2, 1, 15), alpha=True), "Linear")
    tree = floor.node_tree
    other = node
    if asked.startswith("by one"):
        other = texture(floor, node.image, "Linear" if "alike" in asked else "Closest")
        tree.links.new(node.outputs["Color"], tree.nodes["Shader"].inputs["Color"])
    if asked == "in vain":
        tree.links.new(other.outputs["Alpha"], tree.nodes.new("ShaderNodeMath").inputs[0])
    else:
        mix = tree.nodes.new("ShaderNodeMixShader")
        tree.links.new(other.outputs["Alpha"], mix.inputs[0])
        tree.links.new(tree.nodes["Shader"].outputs[0], mix.inputs[2])
        tree.links.new(mix.outputs[0], tree.nodes["Output"].inputs["Surface"])
    sides = pictures(scenes=1)
    check(sides, TEXTURED)
    assert not reasons(sides)


@pytest.mark.parametrize(
    ("kind", "values", "alpha", "output", "to"),
    [
        ("Math", {1: 0.0}, 0, 0, "Roughness"),
        ("Mix", {0: 0.0}, 3, 0, "Roughness"),
        ("Mix", {0: 2.0}, 2, 0, "Roughness"),
        ("MixRGB", {0: 0.0}, 2, 0, "Roughness"),
        ("MixShader", {0: 1.0}, None, 0, None),
        ("BsdfPrincipled", {"Emission Strength": 0.0}, "Emission Color", 0, None),
    ],
)
def test_an_alpha_that_cycles_folds_away_divides_no_color(pictures, floor, image, kind, values, alpha, output, to):
    node, tree = texture(floor, image(opacity=np.linspace(0.2, 1, 15), alpha=True), "Linear"), floor.node_tree
    other, shader = tree.nodes.new(f"ShaderNode{kind}"), tree.nodes["Shader"]
    if kind == "Math":
        other.operation = "MULTIPLY"
    for name, value in values.items():
        other.inputs[name].default_value = value
    if kind == "MixShader":
        emission = tree.nodes.new("ShaderNodeEmission")
        tree.links.new(node.outputs["Alpha"], emission.inputs["Strength"])
        tree.links.new(emission.outputs[0], other.inputs[1])
        tree.links.new(shader.outputs[0], other.inputs[2])
    else:
        tree.links.new(node.outputs["Alpha"], other.inputs[alpha])
    if kind == "BsdfPrincipled":
        other.inputs["Roughness"].default_value, other.inputs["Specular IOR Level"].default_value = 1.0, 0.0
        tree.links.new(node.outputs["Color"], other.inputs["Base Color"])
    tree.links.new(other.outputs[output], shader.inputs[to] if to else tree.nodes["Output"].inputs["Surface"])
    sides = pictures(scenes=1)
    check(sides, TEXTURED)
    assert not reasons(sides)


@pytest.mark.parametrize("mode", ["STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE"])
@pytest.mark.parametrize("kind", ["PNG", "OPEN_EXR", "floats", "bytes"])
def test_a_color_beside_its_alpha_is_cycles_in_every_way_to_keep_it(pictures, floor, image, tmp_path, kind, mode):
    is_float = kind in ("OPEN_EXR", "floats")
    block = image("Non-Color" if is_float else "sRGB", np.linspace(0.2, 1, 15), float_buffer=is_float, alpha=True)
    if kind in ("PNG", "OPEN_EXR"):
        block.filepath_raw, block.file_format = str(tmp_path / "file"), kind
        block.save()
        block = bpy.data.images.load(str(tmp_path / "file"))
    elif is_float:  # linear all the same
        pixels = np.array(block.pixels[:], np.float32)
        block.colorspace_settings.name = "Linear Rec.709"
        block.pixels.foreach_set(pixels)
        block.update()
    block.alpha_mode = mode
    node, tree = texture(floor, block, "Linear"), floor.node_tree
    mix = tree.nodes.new("ShaderNodeMixShader")
    tree.links.new(node.outputs["Alpha"], mix.inputs[0])
    tree.links.new(tree.nodes["Shader"].outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.nodes["Output"].inputs["Surface"])
    sides = pictures(scenes=1)
    check(sides, TEXTURED)
    assert bool(reasons(sides)) == (mode == "PREMUL" and not is_float), reasons(sides)


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("kind", ["PNG", "OPEN_EXR", "HDR"])
@pytest.mark.parametrize("opacity", [1.0, 0.5])
def test_images_from_files(pictures, floor, image, tmp_path, kind, opacity, packed):
    block = image("sRGB" if kind == "PNG" else "Non-Color", opacity, float_buffer=kind != "PNG", alpha=True)
    block.filepath_raw, block.file_format = str(tmp_path / "file"), kind
    block.save()
    loaded = bpy.data.images.load(str(tmp_path / "file"))
    loaded.colorspace_settings.name = block.colorspace_settings.name
    if packed:
        loaded.pack()
    texture(floor, loaded, "Linear")
    sides = pictures(scenes=1)
    check(sides, TEXTURED)
    assert not reasons(sides)


@pytest.mark.parametrize("setting", ["smaller textures", "Open Shading Language"])
def test_an_image_has_all_of_its_pixels_and_its_encoding_whatever_the_scene_sets(pictures, floor, scene, tmp_path, setting):
    block = bpy.data.images.new("Checks", 256, 256)
    pixels = np.random.default_rng(2).random((256 * 256, 4), np.float32)
    pixels[:, 3] = 1
    block.pixels.foreach_set(pixels.ravel())
    block.filepath_raw, block.file_format = str(tmp_path / "file.png"), "PNG"
    block.save()
    texture(floor, bpy.data.images.load(block.filepath_raw), "Linear")
    if setting == "smaller textures":
        scene.render.use_simplify, scene.cycles.texture_limit_render = True, "128"
    else:
        scene.cycles.shading_system = True
    sides = pictures(scenes=1)
    colors = [each["Diffuse Color"] for each in (sides[0].traced, sides[0].cycles[0])]
    assert np.percentile(np.abs(colors[0] - colors[1]), 90) <= 2e-3  # calibrated: 256 pixels across a floor seen obliquely
    assert "Scene" in reasons(sides)


@pytest.mark.parametrize("space", ["sRGB", "Non-Color"])
@pytest.mark.parametrize("opacity", [65535, 40000])
def test_a_file_of_two_bytes_a_number(pictures, floor, tmp_path, space, opacity):
    levels = np.random.default_rng(4).integers(0, 65536, (3, 5, 4)).astype(np.uint16)
    levels[..., 3] = opacity
    (tmp_path / "levels.png").write_bytes(png.encoded(levels))
    loaded = bpy.data.images.load(str(tmp_path / "levels.png"))
    loaded.colorspace_settings.name = space
    texture(floor, loaded, "Closest")
    sides = pictures(scenes=1)
    check(sides, FLAT)
    (picture,) = sides[0].exported.images.values()
    assert picture.pixels.dtype == np.uint16 and not reasons(sides)
    assert [each.name for each in bpy.data.images if each.source == "FILE"] == ["levels.png"]


@pytest.mark.parametrize("domain", ["POINT", "CORNER"])
@pytest.mark.parametrize("kind", ["FLOAT_COLOR", "BYTE_COLOR"])
@pytest.mark.parametrize("name", ["Paint", ""])
def test_colors_of_the_mesh(pictures, floor, domain, kind, name):
    mesh = bpy.data.objects["Floor"].data
    mesh.color_attributes.new("Other", "FLOAT_COLOR", "POINT")
    attribute = mesh.color_attributes.new("Paint", kind, domain)
    values = np.random.default_rng(2).random((len(attribute.data), 4), np.float32)
    attribute.data.foreach_set("color", values.ravel())
    mesh.color_attributes.render_color_index = mesh.color_attributes.find("Paint")
    node = floor.node_tree.nodes.new("ShaderNodeVertexColor")
    node.layer_name = name
    floor.node_tree.links.new(node.outputs["Color"], floor.node_tree.nodes["Shader"].inputs["Color"])
    sides = pictures(scenes=1)
    is_half = bpy.app.version >= (5, 1) and (kind, domain) == ("BYTE_COLOR", "CORNER")
    check(sides, HALF if is_half else TEXTURED)
    assert not reasons(sides) and len(np.unique(sides[0].cycles[0]["Diffuse Color"])) > 1000


def test_materials_of_one_mesh_show_its_colors_of_any_name_with_their_alphas(pictures, floor):
    mesh = bpy.data.objects["Monkey"].data
    for seed, name in enumerate(("Paint", "Tint", "Shown")):
        attribute = mesh.color_attributes.new(name, "FLOAT_COLOR", "POINT")
        attribute.data.foreach_set("color", np.random.default_rng(seed).random(4 * len(attribute.data), np.float32))
    mesh.color_attributes.render_color_index = mesh.color_attributes.find("Shown")
    mesh.materials.clear()
    for color, alpha in (("Paint", "Tint"), ("Tint", ""), ("", "Paint")):
        material = floor.copy()
        mesh.materials.append(material)
        tree, shader = material.node_tree, material.node_tree.nodes["Shader"]
        mix, plain = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeBsdfDiffuse")
        for name, output, socket in ((color, "Color", shader.inputs["Color"]), (alpha, "Alpha", mix.inputs[0])):
            node = tree.nodes.new("ShaderNodeVertexColor")
            node.layer_name = name
            tree.links.new(node.outputs[output], socket)
        tree.links.new(plain.outputs[0], mix.inputs[1])
        tree.links.new(shader.outputs[0], mix.inputs[2])
        tree.links.new(mix.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
    for number, face in enumerate(mesh.polygons):
        face.material_index = number % 3
    sides = pictures(scenes=2)
    check(sides, TEXTURED)
    assert not reasons(sides) and len(np.unique(sides[0].cycles[0]["Diffuse Color"])) > 300


@pytest.mark.parametrize("extension", ["REPEAT", "EXTEND", "CLIP"])
def test_an_image_that_is_missing_is_magenta_and_a_plain_surface_where_it_is_clipped(pictures, floor, extension, tmp_path):
    missing = bpy.data.images.new("Gone", 4, 4)
    missing.source, missing.filepath = "FILE", str(tmp_path / "gone.png")
    texture(floor, missing, "Linear").extension = extension
    sides = pictures(scenes=1)
    check(sides, FLAT)
    assert bool(reasons(sides)) == (extension == "CLIP")


GIVEN = (0.25, 0.5, 0.75, 1)
ODD_TREES = {
    "a volume beside": ("add", "ShaderNodeVolumeAbsorption", None),
    "a volume in a mixture": ("mix", "ShaderNodeVolumePrincipled", None),
    "a shader of EEVEE": ("mix", "ShaderNodeEeveeSpecular", None),
    "a background": ("mix", "ShaderNodeBackground", None),
    "a color in place of a shader": ("mix", "ShaderNodeGamma", None),
    "a number in place of a shader": ("mix", "ShaderNodeNewGeometry", "Backfacing"),
    "a shader as a color": ("color", "ShaderNodeBsdfDiffuse", None),
    "a shader as a color, by EEVEE": ("color", "ShaderNodeShaderToRGB", None),
}


@pytest.mark.parametrize("odd", ODD_TREES)
def test_what_cycles_makes_of_odd_nodes(pictures, floor, odd):
    """Nothing of what it can't use; light of a color in place of a shader."""
    linked_to, kind, output = ODD_TREES[odd]
    tree, shader = floor.node_tree, floor.node_tree.nodes["Shader"]
    node = tree.nodes.new(kind)
    if "Color" in node.inputs:
        node.inputs["Color"].default_value = GIVEN
    output_socket = node.outputs[output or 0]
    if linked_to == "color":
        if kind == "ShaderNodeShaderToRGB":
            tree.links.new(tree.nodes.new("ShaderNodeBsdfDiffuse").outputs[0], node.inputs[0])
        mixed = tree.nodes.new("ShaderNodeGamma")
        mixed.inputs["Color"].default_value = GIVEN
        tree.links.new(output_socket, mixed.inputs["Color"])
        tree.links.new(mixed.outputs[0], shader.inputs["Color"])
    else:
        mixed = tree.nodes.new(f"ShaderNode{linked_to.title()}Shader")
        first, second = [socket for socket in mixed.inputs if socket.type == "SHADER"]
        tree.links.new(shader.outputs[0], first)
        tree.links.new(output_socket, second)
        tree.links.new(mixed.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
    sides = pictures(scenes=1)
    assert not reasons(sides)
    for name in ("Diffuse Color", "Emission"):
        cycles = sides[0].cycles[0][name]
        assert np.abs(sides[0].traced[name] - cycles).max() <= FLAT
    shines = linked_to == "mix" and kind in ("ShaderNodeBackground", "ShaderNodeGamma", "ShaderNodeNewGeometry")
    assert sides[0].cycles[0]["Emission"].any() == (shines and output is None)


MUTED = {
    "color": "ShaderNodeRGB",
    "coordinate": "ShaderNodeTexCoord",
    "attribute": "ShaderNodeAttribute",
    "shader": "ShaderNodeEmission",
    "a color that it passes on": "ShaderNodeInvert",
    "reroute": "NodeReroute",
}


@pytest.mark.parametrize("what", MUTED)
def test_a_muted_node_or_reroute_that_nothing_feeds_is_what_it_is_in_cycles(pictures, floor, what):
    """The floor has another color or shines where the node is not muted."""
    tree, shader = floor.node_tree, floor.node_tree.nodes["Shader"]
    node = tree.nodes.new(MUTED[what])
    if what == "shader":
        mixed = tree.nodes.new("ShaderNodeMixShader")
        for feeding, number in ((shader, 1), (node, 2)):
            tree.links.new(feeding.outputs[0], mixed.inputs[number])
        tree.links.new(mixed.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
    elif what == "coordinate":
        mapping, checker = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexChecker")
        mapping.inputs["Location"].default_value = (0.3, 0.3, 0.3)
        tree.links.new(node.outputs["Object"], mapping.inputs["Vector"])
        tree.links.new(mapping.outputs[0], checker.inputs["Vector"])
        tree.links.new(checker.outputs["Color"], shader.inputs["Color"])
    else:
        tree.links.new(node.outputs[0], shader.inputs["Color"])
    node.mute = True
    sides = pictures(scenes=1)
    assert not reasons(sides)
    for name in ("Diffuse Color", "Emission"):
        assert np.abs(sides[0].traced[name] - sides[0].cycles[0][name]).max() <= FLAT
    node.mute = False
    (other,) = pictures(scenes=1)
    differs = any(np.abs(other.traced[name] - sides[0].traced[name]).max() > 0.1 for name in ("Diffuse Color", "Emission"))
    assert differs == (what != "reroute")


@pytest.mark.parametrize("gloss", [0.0, 0.5])
def test_a_surface_that_shines_beside_a_displacement_lights_a_floor_as_in_cycles(pictures, floor, make_material, gloss):
    """In 5.2 Cycles would light it by a third of that: there it is shown without the displacement, and the ledger tells."""
    bpy.data.objects.remove(next(block for block in bpy.data.objects if block.type == "LIGHT"))
    glow = make_material("Glow", "ShaderNodeBsdfPrincipled", Emission_Color=(1, 1, 1, 1), Emission_Strength=2.0)
    glow.node_tree.nodes["Shader"].inputs["Specular IOR Level"].default_value = gloss
    raised = glow.node_tree.nodes.new("ShaderNodeDisplacement")
    glow.node_tree.links.new(raised.outputs[0], glow.node_tree.get_output_node("CYCLES").inputs["Displacement"])
    bpy.data.objects["Monkey"].data.materials[0] = glow
    (sides,) = pictures(scenes=1, samples=64)
    traced, cycles = (each["Diffuse Direct"].mean() for each in (sides.traced, sides.cycles[0]))
    assert traced == pytest.approx(cycles, rel=0.1)  # calibrated: five standard errors
    assert bool(reasons([sides])) == versions.LOSES_LIGHT_OF_BUMPED


def test_what_is_simulated_is_built_anew_for_each_picture(pictures, monkeypatch):
    """Particles that are kept turn into others: a check had 4 % more of their color."""
    kept, render = [], stages.cycles.render
    monkeypatch.setattr(stages.cycles, "render", lambda *arguments: (kept.append(arguments[7]), render(*arguments)))
    pictures(scenes=1, samples=2, count=2)
    bpy.data.objects["Monkey"].modifiers.new("Dust", "PARTICLE_SYSTEM")
    pictures(scenes=1, samples=2, count=2)
    assert kept == [True, True, False, False]


def test_links_that_go_in_a_circle_are_none_as_in_cycles(pictures, floor):
    lamp = bpy.data.lights[0]
    lamp.use_nodes = True
    trees = floor.node_tree, lamp.node_tree
    before = [len(tree.links) for tree in trees]
    for tree, kind, name in zip(trees, ("BsdfDiffuse", "Emission"), ("Color", "Strength"), strict=True):
        first, second = (tree.nodes.new("ShaderNodeMath") for _ in range(2))
        for node, number in ((first, 0.25), (second, 0.5)):
            node.inputs[0].default_value, node.inputs[1].default_value = number, 0.125
        tree.links.new(first.outputs[0], second.inputs[0])
        shader = next(node for node in tree.nodes if node.bl_idname == f"ShaderNode{kind}")
        tree.links.new(second.outputs[0], shader.inputs[name])
        tree.links.new(second.outputs[0], first.inputs[0])
    sides = pictures(scenes=1)
    check(sides, FLAT)
    for name in ("Floor", "Lamp"):
        assert ("go in a circle" in reasons(sides).get(name, "")) == versions.CIRCLES_ARE_BLACK
    for tree, links in zip(trees, before, strict=True):
        assert sorted(link.is_valid for link in tree.links) == [False, *[True] * (links + 2)]


def toon(material):
    tree = material.node_tree
    tree.links.new(tree.nodes.new("ShaderNodeBsdfToon").outputs[0], tree.nodes["Output"].inputs["Surface"])


def noisy(material):
    tree = material.node_tree
    tree.links.new(tree.nodes.new("ShaderNodeParticleInfo").outputs[0], tree.nodes["Shader"].inputs["Color"])


def bumpy(material):
    tree = material.node_tree
    bump = tree.nodes.new("ShaderNodeBump")
    bump.inputs["Distance"].default_value = 5.0
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Window"], bump.inputs["Height"])
    tree.links.new(bump.outputs[0], tree.nodes["Shader"].inputs["Normal"])


STAND_INS = {toon: "not modeled", noisy: "not modeled", bumpy: "'Texture Coordinate' that makes a height"}


@pytest.mark.parametrize("change", STAND_INS, ids=lambda change: change.__name__)
def test_a_stand_in_is_the_same_on_both_sides(pictures, floor, change):
    change(floor)
    sides = pictures(scenes=1)
    check(sides, TEXTURED)
    assert STAND_INS[change] in reasons(sides)["Floor"], reasons(sides)


@pytest.mark.parametrize("change", [toon, noisy, bumpy], ids=lambda change: change.__name__)
def test_without_its_stand_in_the_comparison_fails(pictures, floor, change, monkeypatch):
    """The test above must be able to fail."""
    change(floor)
    monkeypatch.setattr(materials, "stand_in", lambda overrides, material, reading: None)
    sides = pictures(scenes=1)
    with pytest.raises(AssertionError):
        check(sides, TEXTURED)


def test_another_uv_map_than_the_active_one_comes_along(pictures, floor, image):
    mesh = bpy.data.objects["Floor"].data
    second = mesh.uv_layers.new(name="Second")
    for each in second.uv:
        each.vector *= 3
    node = texture(floor, image(), "Linear")
    tree = floor.node_tree
    tree.links.new(tree.nodes.new("ShaderNodeUVMap").outputs[0], node.inputs["Vector"])
    tree.nodes["UV Map"].uv_map = "Second"
    sides = pictures(scenes=1)
    check(sides, TEXTURED)
    assert not reasons(sides)


def test_clay_covers_everything_alike(pictures, floor):
    noisy(floor)
    bpy.data.objects["Monkey"].data.materials.clear()
    layer = bpy.context.view_layer
    sides = pictures(scenes=2, clay=True)
    check(sides, FLAT)
    assert not reasons(sides) and layer.material_override is None
    assert np.unique(sides[0].cycles[0]["Diffuse Color"]).tolist() == pytest.approx([0, 0.8])


@pytest.mark.parametrize("hidden", ["camera", "shadow"])
def test_what_is_hidden_from_some_rays_is_there_for_others(pictures, hidden):
    monkey = bpy.data.objects["Monkey"]
    rendered = pictures(scenes=1)[0]
    setattr(monkey, f"visible_{hidden}", False)
    sides = pictures(scenes=1)
    check(sides, FLAT)
    assert next(each for each in sides[0].exported.objects if each.name == "Monkey").hidden_from == {hidden}
    assert np.abs(sides[0].traced["Combined"] - rendered.traced["Combined"]).max() > 0.1


def test_a_scene_seen_from_its_eye_is_lit_likewise(pictures, scene):
    scene.cycles.pixel_filter_type, scene.render.film_transparent = "BOX", True
    sides = pictures(scenes=2, recenter=True)
    check(sides, 3 * FLAT)  # coordinates are rounded once more
    assert sides[0].exported.film.transparent and sides[0].exported.film.filter == "BOX"


@pytest.mark.skipif(bpy.app.version >= (5, 0), reason="since 5.0 nodes always count")
def test_without_nodes_the_viewports_colors_count(pictures, floor, scene):
    floor.use_nodes, floor.diffuse_color = False, (0.7, 0.4, 0.2, 1)
    scene.world.use_nodes, scene.world.color = False, (0.1, 0.2, 0.3)
    scene.world.cycles_visibility.diffuse = False
    bpy.data.objects["Monkey"].hide_render = True
    sides = pictures(scenes=1)
    check(sides, FLAT)
    assert not reasons(sides) and sides[0].exported.materials["Floor"].surface["color"].rgb == pytest.approx((0.7, 0.4, 0.2))
    assert np.allclose(sides[0].traced["Environment"], sides[0].cycles[0]["Environment"], rtol=1e-6)
    assert sides[0].traced["Environment"].max() == pytest.approx(0.3)


@pytest.mark.parametrize("is_named", [True, False])
def test_images_that_are_missing_are_the_magenta_that_cycles_shows(pictures, floor, tmp_path, is_named):
    missing = bpy.data.images.new("Gone", 4, 4)
    missing.source, missing.filepath = "FILE", str(tmp_path / "gone.png")
    texture(floor, missing if is_named else None, "Linear")
    sides = pictures(scenes=1)
    check(sides, FLAT)
    assert not reasons(sides) and sides[0].exported.materials["Floor"].surface["color"].rgb == (1.0, 0.0, 1.0)
    (reason,) = (entry.reason for entry in sides[0].exported.ledger if entry.object == "Floor")
    assert ("'Gone', which is missing: magenta" if is_named else "without an image: magenta") in reason


# --- What Cycles does with light inside a point cloud's sphere: a ray is refracted on its way in, and never meets the far side


IOR = 1.5
SKY = 40.0  # the radius of what render_positions makes shine


@pytest.fixture
def drop(scene, camera, add, node_group):
    """A point of radius 1 at the origin, of clear glass that does not reflect."""
    data = bpy.data.meshes.new("Point")
    data.from_pydata([(0, 0, 0)], [], [])
    material = bpy.data.materials.new("Refraction")
    if not material.node_tree:
        material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    shader, output = nodes.new("ShaderNodeBsdfRefraction"), nodes.new("ShaderNodeOutputMaterial")
    shader.inputs["IOR"].default_value, shader.inputs["Roughness"].default_value = IOR, 0
    material.node_tree.links.new(shader.outputs[0], output.inputs["Surface"])
    tree, source, target = node_group()
    points, paint = tree.nodes.new("GeometryNodeMeshToPoints"), tree.nodes.new("GeometryNodeSetMaterial")
    points.inputs["Radius"].default_value, paint.inputs["Material"].default_value = 1, material
    for output, goal in ((source, points), (points, paint), (paint, target)):
        tree.links.new(output.outputs[0], goal.inputs[0])
    block = add(data, "Drop")
    block.modifiers.new("Nodes", "NODES").node_group = tree
    return block


def beyond(pinhole, scale) -> tuple[np.ndarray, np.ndarray]:
    """By the tracer: which pixels show the drop, (n,), and where their refracted rays reach the sky, (n, 3)."""
    scene = Scene(
        pinhole,
        {"drop": Spheres(np.zeros((1, 3)), np.ones(1), np.zeros(1, np.int32))},
        (Object("drop", "drop", np.diag([*scale, 1.0])),),
    )
    core = CoreScene(scene, 1)
    rows, columns = np.mgrid[: pinhole.height, : pinhole.width]
    rays = core.rays(np.array(pinhole.eye)[None], pinhole.ray_directions(columns.ravel(), rows.ravel()))
    pixels = np.flatnonzero(np.isfinite(core.closest(rays)[0]))
    rays = rays[pixels]
    points, normals, _, _, _ = core.leaving(rays, np.array([0.0, 0.0, 1.0]))
    way = refracted(rays[:, 3:6].T, normals.T, IOR)[0].T
    _, _, _, starts, _ = core.leaving(rays, way)
    met = np.isfinite(core.closest(core.rays(starts + core.origin, way), "transmission")[0])
    assert not met.any(), f"{met.sum()} rays meet the far side of the sphere that they are in"
    start = points + core.origin
    along = np.einsum("ij,ij->i", start, way)
    reach = -along + np.sqrt(along**2 - np.einsum("ij,ij->i", start, start) + SKY**2)
    return pixels, start + reach[:, None] * way


@pytest.mark.parametrize("scale", [(1, 1, 1), (0.6, 1.3, 1)])
def test_rays_are_refracted_once_by_a_sphere_and_by_an_ellipsoid_about_the_direction_from_its_center(
    scene, drop, camera, render_positions, scale
):
    drop.scale = scale
    positions = render_positions().reshape(-1, 3)
    pinhole = blender_camera.read(camera, scene)
    pixels, expected = beyond(pinhole, scale)
    assert len(pixels) > 20
    apart = np.linalg.norm(positions[pixels] - expected, axis=1)
    # The sky is an icosphere of sides up to 1.6: its faces lie up to 1.6² / (6 · 40) within the radius.
    assert apart.max() < 0.015, f"Cycles' rays reach the sky {apart.max():.2g} m elsewhere"


def test_rays_that_are_not_refracted_or_by_another_index_are_told_apart(monkeypatch, scene, drop, camera, render_positions):
    positions = render_positions().reshape(-1, 3)
    for ior in (1.0, 1.01 * IOR):
        monkeypatch.setattr(sys.modules[__name__], "IOR", ior)
        pixels, expected = beyond(blender_camera.read(camera, scene), (1, 1, 1))
        apart = np.linalg.norm(positions[pixels] - expected, axis=1)
        assert np.median(apart) > 0.03, (ior, np.median(apart))
