"""Normal maps and bumps, without noise: patches of every shader, and a smooth body, under a sun without a size.

Errors are relative to what the brightest pixel shows: bumps make light end anywhere, and there nothing is left to relate to.
"""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.jobs.job import Job

COLOR = (0.8, 0.5, 0.2, 1.0)
# p99, calibrated: heights are looked up a tenth of a pixel beside, as Cycles does from 4.4 on (1e-4), or a whole one (1.2e-5).
DISPLACED = 2e-4 if bpy.app.version >= (4, 4) else 2e-5
# p50, p99, where heights are looked up a tenth of a pixel beside and nowhere else: float32, as of the narrow filter.
HEIGHTS = {"p50": 2e-5, "p99": 2e-4} if (4, 4) <= bpy.app.version < (4, 5) else {}
# p50, p99: the tables' own differences, as in test_closures.py; since 5.1 normals are two numbers of 16 bits.
TILTED = (1e-4, 2e-3) if bpy.app.version >= (5, 1) else (3e-5, 1e-4)
SPACES = ("TANGENT", "OBJECT", "WORLD", "BLENDER_OBJECT", "BLENDER_WORLD")
DIFFUSE, GLOSSY, PRINCIPLED = "ShaderNodeBsdfDiffuse", "ShaderNodeBsdfGlossy", "ShaderNodeBsdfPrincipled"


def shaders():
    """(class, inputs, properties, which normals are mapped)."""
    yield DIFFUSE, {"Color": COLOR}, {}, ("Normal",)
    yield DIFFUSE, {"Color": COLOR, "Roughness": 0.7}, {}, ("Normal",)
    yield GLOSSY, {"Color": COLOR, "Roughness": 0.5}, {"distribution": "GGX"}, ("Normal",)
    yield "ShaderNodeBsdfGlass", {"Color": COLOR, "Roughness": 0.6}, {"distribution": "GGX"}, ("Normal",)
    yield PRINCIPLED, {"Base Color": COLOR}, {}, ("Normal",)
    yield PRINCIPLED, {"Base Color": COLOR, "Metallic": 1.0}, {}, ("Normal",)
    coat = {"Base Color": COLOR, "Coat Weight": 0.8, "Coat Roughness": 0.4}
    for mapped in (("Normal",), ("Coat Normal",), ("Normal", "Coat Normal")):
        yield PRINCIPLED, coat, {}, mapped
    if bpy.app.version >= (4, 3):
        yield "ShaderNodeBsdfMetallic", {"Roughness": 0.5}, {}, ("Normal",)


def map_normals(material, mapped, color, strength=1.0, space="TANGENT", image=None, uv=""):
    tree = material.node_tree
    for name in mapped:
        node = tree.nodes.new("ShaderNodeNormalMap")
        node.space, node.uv_map = space, uv
        node.inputs["Color"].default_value, node.inputs["Strength"].default_value = (*color, 1.0), strength
        if image:
            texture = tree.nodes.new("ShaderNodeTexImage")
            texture.image = image
            tree.links.new(texture.outputs["Color"], node.inputs["Color"])
        tree.links.new(node.outputs[0], tree.nodes["Shader"].inputs[name])


def hills(tree, vector):
    """A smooth height of a vector's three numbers."""
    add = tree.nodes.new("ShaderNodeMath")
    separate = tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(vector, separate.inputs[0])
    for number, operation in enumerate(("SINE", "COSINE")):
        wave, wider = tree.nodes.new("ShaderNodeMath"), tree.nodes.new("ShaderNodeMath")
        wave.operation, wider.operation, wider.inputs[1].default_value = operation, "MULTIPLY", 3.0
        tree.links.new(separate.outputs[number], wider.inputs[0])
        tree.links.new(wider.outputs[0], wave.inputs[0])
        tree.links.new(wave.outputs[0], add.inputs[number])
    return add.outputs[0]


OBJECT = "ShaderNodeTexCoord", "Object"


def bump(material, mapped, vector=OBJECT, filter_width=1.0, invert=False, first=None, texture=None, **inputs):
    """first : the normal of a normal map before.
    texture : (class, its properties), which makes the height instead of hills.
    """
    tree = material.node_tree
    source = tree.nodes.new(vector[0])
    if vector[0] == "ShaderNodeVertexColor":
        source.layer_name = "Shades"
    node = tree.nodes.new("ShaderNodeBump")
    node.invert = invert
    for name, value in {"Distance": 0.2, "Filter Width": filter_width, **inputs}.items():
        if name in node.inputs:
            node.inputs[name].default_value = value
    if texture:
        texture_node = tree.nodes.new(texture[0])
        for name, value in texture[1].items():
            setattr(texture_node, name, value)
        tree.links.new(source.outputs[vector[1]], texture_node.inputs["Vector"])
        tree.links.new(texture_node.outputs[0], node.inputs["Height"])
    else:
        tree.links.new(hills(tree, source.outputs[vector[1]]), node.inputs["Height"])
    if first:
        turned = tree.nodes.new("ShaderNodeNormalMap")
        turned.inputs["Color"].default_value = (*first, 1.0)
        tree.links.new(turned.outputs[0], node.inputs["Normal"])
    for name in mapped:
        tree.links.new(node.outputs[0], tree.nodes["Shader"].inputs[name])


def displace(material, mapped, vector=OBJECT, kind="Displacement", space="WORLD", raw=False, height=0.0, **inputs):
    """Raise hills out of the material, on something as high.

    raw : true to bend by a vector alone.
    """
    tree = material.node_tree
    source = tree.nodes.new(vector[0])
    higher = tree.nodes.new("ShaderNodeMath")
    higher.inputs[1].default_value = height
    tree.links.new(hills(tree, source.outputs[vector[1]]), higher.inputs[0])
    height = higher.outputs[0]
    output = tree.get_output_node("CYCLES").inputs["Displacement"]
    if raw:
        combine = tree.nodes.new("ShaderNodeCombineXYZ")
        for name in "XZ":
            tree.links.new(height, combine.inputs[name])
        tree.links.new(combine.outputs[0], output)
        return
    node = tree.nodes.new(f"ShaderNode{kind}")
    node.space = space
    for name, value in {"Scale": 0.2, **inputs}.items():
        node.inputs[name].default_value = value
    tree.links.new(height, node.inputs[0])
    tree.links.new(node.outputs[0], output)
    if mapped:
        map_normals(material, mapped, (0.7, 0.4, 0.9))


@pytest.fixture
def render_pair(scene, camera, add_lamp, set_world, first_samples):
    """shown(size, level) → ours, theirs: (height, width, 3), and the number of the object that each pixel shows."""
    from mathutils import Vector

    set_world((0, 0, 0), 0.0)
    sun = add_lamp("SUN", angle=0.0)
    sun.data.energy, sun.rotation_mode = np.pi, "QUATERNION"
    sun.rotation_quaternion = Vector((0.6, 0.3, 0.75)).to_track_quat("Z", "Y")

    def show(size, level="direct"):
        scene.render.resolution_x = scene.render.resolution_y = size
        traced, cycles_passes = first_samples(level)
        first, other = (each["Combined"][..., :3].astype(np.float64) for each in (traced, cycles_passes))
        return first, other, traced["Object Index"][..., 0]

    return show


@pytest.fixture
def patches(render_pair, strewn, painted):
    """patches(cases, turn) → errors of each case's pixels. A case: a shader as above, and what `turn` is given."""

    def show(cases, turn=map_normals):
        materials, rng = [], np.random.default_rng(3)
        for (kind, inputs, properties, mapped), expected in cases:
            materials.append(painted(kind, inputs, properties))
            turn(materials[-1], mapped, **expected)
        for block in strewn(materials, backwards=lambda i: i % 5 == 4):
            shades = block.data.color_attributes.new("Shades", "FLOAT_COLOR", "CORNER")
            shades.data.foreach_set("color", rng.uniform(0, 1, 4 * len(block.data.loops)))
        traced, cycles, numbers = render_pair(144)
        result = []
        for number in range(1, len(cases) + 1):
            here = numbers == number
            assert here.sum() > 60 and cycles[here].max() > 0.01, (cases[number - 1], here.sum(), cycles[here].max())
            result.append(np.abs(traced - cycles)[here].max(axis=1) / cycles[here].max())
        return result

    return show


def check(errors, cases, p50=2e-6, p99=1e-4):
    summary = [
        f"{case}: p50 {np.median(each):.1e}, p99 {np.quantile(each, 0.99):.1e}, most {each.max():.1e}"
        for each, case in zip(errors, cases, strict=True)
        if not (np.median(each) <= p50 and np.quantile(each, 0.99) <= p99)
    ]
    assert not summary, "\n".join(summary)


def test_every_shader_is_bumped_as_in_cycles(patches):
    cases = [(shader, {"color": (0.7, 0.4, 0.9)}) for shader in shaders()]
    check(patches(cases), cases, p50=3e-5)  # the tables' own differences, as in test_closures.py


def test_every_space_and_strength_is_cycles(patches):
    lambert = (DIFFUSE, {"Color": COLOR}, {}, ("Normal",))
    cases = [
        (lambert, {"color": (0.7, 0.4, 0.9) if space in SPACES[:3] else (0.7, 0.4, 0.1), "strength": strength, "space": space})
        for space in SPACES
        for strength in (1.0, 0.4, 1.7)
    ]
    cases += [(lambert, {"color": (0.95, 0.4, 0.6)}), (lambert, {"color": (0.7, 0.4, 0.9), "uv": "Second"})]
    check(patches(cases), cases)


def test_every_shader_is_bumped_by_heights_as_in_cycles(patches):
    cases = [(shader, {}) for shader in shaders()]
    check(patches(cases, bump), cases, p50=3e-5)


def test_every_shader_is_bumped_by_its_displacement_as_in_cycles(patches):
    """It is the smooth normal that turns, with all that stands on it."""
    bare = [(kind, inputs, properties, ()) for kind, inputs, properties, _ in list(shaders())[:7] + list(shaders())[9:]]
    cases = [(shader, {}) for shader in bare]
    check(patches(cases, displace), cases, p50=3e-5, p99=DISPLACED)


def test_every_way_to_displace_is_cycles(patches):
    lambert = (DIFFUSE, {"Color": COLOR}, {}, ())
    cases = [(lambert, {name: value}) for name, value in (("Midlevel", 0.9), ("Scale", -0.3), ("Scale", 1.0))]
    cases += [(lambert, {"vector": vector}) for vector in (("ShaderNodeTexCoord", "UV"), ("ShaderNodeNewGeometry", "Position"))]
    cases += [(lambert, {"space": "OBJECT"}), (lambert, {"raw": True})]
    cases += [(lambert, {"kind": "VectorDisplacement", "space": space}) for space in ("OBJECT", "WORLD")]
    cases += [((DIFFUSE, {"Color": COLOR}, {}, ("Normal",)), {})]  # a map of the smooth normal, in which nothing is displaced
    check(patches(cases, displace), cases, p50=2e-5, p99=DISPLACED)


def test_what_differs_of_a_displacement_is_float32_which_counts_more_the_closer_places_are_and_the_larger_heights(
    render_pair, strewn, painted
):
    """Cycles rounds heights h to 2⁻²⁴ h, which is 2⁻²⁴ h/w of a slope over w: 4 times as much where pixels are a quarter as
    wide, or heights 4 times as large, as far between powers of two. Were a formula another, that would not be.
    """
    materials = []
    for height in (24.0, 96.0):
        materials.append(painted(DIFFUSE, {"Color": COLOR}))
        displace(materials[-1], (), height=height)
    strewn(materials, cells=6)
    apart = []
    for size in (72, 288):
        traced, cycles, numbers = render_pair(size)
        errors = (np.abs(traced - cycles)[numbers == number].max(axis=1) / cycles.max() for number in (1, 2))
        apart.append([np.quantile(each, 0.99) for each in errors])
    (low, high), (fine_low, fine_high) = apart
    assert [high / low, fine_low / low, fine_high / fine_low, fine_high / high] == pytest.approx([4.0] * 4, rel=0.3), apart


def test_heights_of_all_that_varies_and_all_ways_to_bump_are_cycles(patches):
    lambert = (DIFFUSE, {"Color": COLOR}, {}, ("Normal",))
    vectors = [("ShaderNodeTexCoord", output) for output in ("Object", "Generated", "UV", "Camera")]
    vectors += [("ShaderNodeNewGeometry", "Position"), ("ShaderNodeUVMap", "UV"), ("ShaderNodeVertexColor", "Color")]
    cases = [(lambert, {"vector": vector}) for vector in vectors]
    cases += [(lambert, {name: value}) for name, value in (("Strength", 0.3), ("Strength", 1.6), ("Distance", -0.4))]
    cases += [(lambert, {"invert": True}), (lambert, {"first": (0.7, 0.4, 0.9)})]
    check(patches(cases, bump), cases, **HEIGHTS)


@pytest.mark.parametrize("value", [(0.0, 0.0, 0.0), (0.3, 0.3, 0.3), (0.4, 0.3, 0.8)])
def test_a_normal_that_is_given_as_a_value_counts_as_in_cycles(patches, value):
    """A normal of a group does since 5.0; bumps of a normal of 0 are none."""

    def give(material, mapped, by, bumped):
        tree = material.node_tree
        if by == "a group":
            inside = bpy.data.node_groups.new("Group", "ShaderNodeTree")
            inside.interface.new_socket("In", in_out="INPUT", socket_type="NodeSocketVector")
            inside.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketVector")
            inside.links.new(inside.nodes.new("NodeGroupInput").outputs[0], inside.nodes.new("NodeGroupOutput").inputs[0])
            node = tree.nodes.new("ShaderNodeGroup")
            node.node_tree, node.inputs[0].default_value = inside, value
        else:
            node = tree.nodes.new("ShaderNodeRGB")
            node.outputs[0].default_value = (*value, 1.0)
        normal = node.outputs[0]
        if bumped:
            bump(material, mapped)
            normal_input = next(each for each in tree.nodes if each.type == "BUMP").inputs["Normal"]
            tree.links.new(normal, normal_input)
        for name in () if bumped else mapped:
            tree.links.new(normal, tree.nodes["Shader"].inputs[name])

    shaders = [(DIFFUSE, {"Color": COLOR}, {}, ("Normal",)), (GLOSSY, {"Color": COLOR, "Roughness": 0.5}, {}, ("Normal",))]
    if any(value):  # else black: see below
        shaders.append((GLOSSY, {"Color": COLOR, "Roughness": 0.5, "Anisotropy": 0.7}, {}, ("Tangent",)))
    cases = [
        (shader, {"by": by, "bumped": bumped})
        for shader in shaders
        for by in ("a group", "a color")
        for bumped in ((False, True) if shader[3] == ("Normal",) else (False,))
    ]
    check(patches(cases, give), cases, p50=3e-5, p99=2e-4)


@pytest.mark.parametrize(
    ("fault", "words"), [("a tangent of 0", "a Tangent of 0"), ("bumps of a width below 0", "Width below 0")]
)
def test_normals_that_cycles_makes_no_number_of_are_told(scene, bare_body, fault, words):
    material = bare_body[1]
    if fault == "a tangent of 0":
        material.node_tree.nodes["Shader"].inputs["Anisotropic"].default_value = 0.8
        node = material.node_tree.nodes.new("ShaderNodeRGB")
        node.outputs[0].default_value = (0.0, 0.0, 0.0, 1.0)
        material.node_tree.links.new(node.outputs[0], material.node_tree.nodes["Shader"].inputs["Tangent"])
    else:
        if bpy.app.version < (4, 5):
            pytest.skip("nodes say a width since 4.5")
        bump(material, ("Normal",), filter_width=-0.5)
    noted = [entry.reason for entry in jobs.export(Job(level="direct")).ledger if entry.status == "approximated"]
    assert len(noted) == 1 and words in noted[0], noted


def test_a_narrow_filter_shows_what_float32_leaves_of_it(patches):
    """Cycles' heights are rounded by 2⁻²⁴ of up to 2; places a tenth of a pixel of 1/36 away make 4e-5 of that in a slope."""
    lambert = (DIFFUSE, {"Color": COLOR}, {}, ("Normal",))
    cases = [(lambert, {"filter_width": width}) for width in (0.1, 10.0)]
    check(patches(cases, bump), cases, p50=2e-5, p99=2e-4)


def test_textures_make_heights(patches):
    lambert = (DIFFUSE, {"Color": COLOR}, {}, ("Normal",))
    noise = ("ShaderNodeTexNoise", {"noise_dimensions": "2D"})
    cases = [
        (lambert, {"texture": texture, "Distance": 0.05})
        for texture in (noise, ("ShaderNodeTexWave", {}), ("ShaderNodeTexGradient", {}))
    ]
    check(patches(cases, bump), cases, p50=2e-5, p99=5e-4)


# The most by which the median pixel of the body below differs: from 5.1 on normals are two numbers of 16 bits.
USUAL = 1e-4 if bpy.app.version >= (5, 1) else 1e-5


@pytest.fixture
def body(camera, add, mesh_from, make_material):
    """A smooth monkey, stretched, whose UV map crosses its seams, with a picture of normals."""
    mesh = mesh_from("monkey")
    for polygon in mesh.polygons:
        polygon.use_smooth = True
    layer = mesh.uv_layers.new(name="UVMap")
    for loop in mesh.loops:
        x, y, z = mesh.vertices[loop.vertex_index].co
        layer.data[loop.index].uv = (abs(x) + 0.2 * y, z + 0.1 * x * y)
    image = bpy.data.images.new("Normals", 4, 4, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    pixels = np.random.default_rng(1).uniform(0.3, 0.7, (16, 4)).astype(np.float32)
    pixels[:, 2:] = 0.9, 1.0
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    material = make_material("Skin", PRINCIPLED, Base_Color=COLOR)
    mesh.materials.append(material)
    monkey = add(mesh, "Monkey", pass_index=1)
    monkey.scale, monkey.rotation_euler = (1.2, 0.8, 1.0), (0.2, 0.1, 0.4)
    camera.location, camera.rotation_euler, camera.data.lens = (0.2, -4.0, 0.3), (1.5, 0.0, 0.05), 50.0
    return material, image


def errors_of_the_body(render_pair):
    """The number of its pixels, and percentiles 50, 90, 99 and 100 of their differences, as shares of the brightest."""
    traced, cycles, numbers = render_pair(96)
    here = (numbers == 1) & (cycles.max(axis=-1) > 0) & (traced.max(axis=-1) > 0)
    apart = np.abs(traced - cycles)[here].max(axis=1) / cycles.max()
    return here.sum(), *np.percentile(apart, (50, 90, 99, 100))


@pytest.mark.parametrize(
    "turned_by", ["a map", "heights", "heights on a map", "a displacement", "a displacement of the object", "both"]
)
def test_a_smooth_body_has_normals_of_its_own(render_pair, body, turned_by):
    """The map's stand on the tangents of MikkTSpace."""
    material, image = body
    if turned_by == "a map":
        map_normals(material, ("Normal",), (0, 0, 0), image=image)
    elif "displacement" in turned_by or turned_by == "both":
        displace(material, (), space="OBJECT" if "object" in turned_by else "WORLD")
        if turned_by == "both":
            bump(material, ("Normal",), Distance=0.1)
    else:
        bump(material, ("Normal",), first=(0.6, 0.4, 0.9) if "map" in turned_by else None, Distance=0.1)
    summary = errors_of_the_body(render_pair)
    assert summary[0] > 200 and summary[1] < USUAL and summary[3] < 2e-3, summary


@pytest.mark.parametrize("flat", ["all", "a line", "below", "some faces"])
@pytest.mark.parametrize("smooth", [True, False])
def test_a_map_stands_on_cycles_tangents_where_the_uv_map_has_no_area(render_pair, body, flat, smooth):
    """The UV map of what was never unwrapped, or in part."""
    mesh = bpy.data.objects["Monkey"].data
    for polygon in mesh.polygons:
        polygon.use_smooth = smooth
        is_flat = {"all": True, "a line": True, "below": polygon.center.z < 0.1, "some faces": polygon.index % 3 == 0}[flat]
        for loop in polygon.loop_indices if is_flat else ():
            uv = mesh.uv_layers[0].data[loop].uv
            uv[1] = 0.0
            uv[0] = uv[0] if flat == "a line" else 0.0
    map_normals(body[0], ("Normal",), (0.8, 0.35, 0.85))
    summary = errors_of_the_body(render_pair)
    assert summary[0] > 200 and summary[1] < USUAL and summary[3] < 2e-3, summary


@pytest.mark.parametrize("tangent", ["X", "Y", "Z", "UV_MAP", None])
def test_a_smooth_body_is_stretched_along_tangents_of_its_own(render_pair, body, tangent):
    """Round axes of its generated coordinates, which are none of the world's, along its UV map, and by default."""
    material, _ = body
    tree = material.node_tree
    shader = tree.nodes["Shader"]
    for name, value in {"Anisotropic": 0.8, "Anisotropic Rotation": 0.1, "Metallic": 1.0, "Roughness": 0.6}.items():
        shader.inputs[name].default_value = value
    shader.distribution = "GGX"
    if tangent:
        node = tree.nodes.new("ShaderNodeTangent")
        node.direction_type = tangent if tangent == "UV_MAP" else "RADIAL"
        node.axis = tangent if len(tangent) == 1 else "Z"
        tree.links.new(node.outputs[0], shader.inputs["Tangent"])
    summary = errors_of_the_body(render_pair)
    assert summary[0] > 300 and summary[1] < USUAL and summary[3] < 2e-3, summary


@pytest.fixture
def bare_body(body):
    """The monkey without a UV map, and its material."""
    monkey = bpy.data.objects["Monkey"]
    while monkey.data.uv_layers:
        monkey.data.uv_layers.remove(monkey.data.uv_layers[0])
    return monkey, body[0]


@pytest.mark.parametrize("asked_by", ["a map", "a tangent", "a map of the object", "what has a UV map"])
def test_tangents_of_a_uv_map_that_is_not_there_are_told(scene, tmp_path, bare_body, asked_by):
    monkey, material = bare_body
    if asked_by == "a tangent":
        shader = material.node_tree.nodes["Shader"]
        shader.inputs["Anisotropic"].default_value = 0.8
        node = material.node_tree.nodes.new("ShaderNodeTangent")
        node.direction_type = "UV_MAP"
        material.node_tree.links.new(node.outputs[0], shader.inputs["Tangent"])
    else:
        map_normals(material, ("Normal",), (0.7, 0.4, 0.9), space="OBJECT" if "object" in asked_by else "TANGENT")
    if asked_by == "what has a UV map":
        monkey.data.uv_layers.new(name="Other")
    exported = jobs.both_sides(Job(threads=2, level="direct", samples=1), [tmp_path / "told.exr"])
    noted = [entry for entry in exported.ledger if entry.status != "exported"]
    expected = [("Monkey", True)] if asked_by in ("a map", "a tangent") else []
    assert [(entry.object, "UV map" in entry.reason) for entry in noted] == expected


def test_a_map_of_a_uv_map_that_is_named_and_missing_turns_no_normal(render_pair, bare_body):
    map_normals(bare_body[1], ("Normal",), (0.7, 0.4, 0.9), uv="Lost")
    summary = errors_of_the_body(render_pair)
    assert summary[0] > 300 and summary[1] < USUAL and summary[4] < 2e-3, summary


def test_a_pixel_seen_in_mirrors_is_as_wide_as_its_way_is_long(scene, render_pair, camera, add, make_material):
    floor, mirror = make_material("Floor", DIFFUSE, Color=COLOR), make_material("Mirror", GLOSSY, Roughness=0.0)
    bump(floor, ("Normal",), Distance=0.3)
    for name, material, corners in (
        ("Floor", floor, [(-6, -6, 0), (6, -6, 0), (6, 6, 0), (-6, 6, 0)]),
        ("Mirror", mirror, [(-3, 4, 0.1), (3, 4, 0.1), (3, 3, 4), (-3, 3, 4)]),
    ):
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata(corners, [], [range(4)])
        mesh.materials.append(material)
        add(mesh, name, pass_index=1 if name == "Floor" else 2)
    camera.location, camera.rotation_euler, camera.data.lens = (0.1, -3.0, 2.0), (1.5, 0.0, 0.0), 50.0
    scene.cycles.max_bounces = scene.cycles.glossy_bounces = 2
    traced, cycles, numbers = render_pair(48, "path")
    here = (numbers == 2) & (cycles.max(axis=-1) > 0)
    apart = np.abs(traced - cycles)[here].max(axis=1) / cycles.max()
    summary = here.sum(), *np.percentile(apart, (50, 99))
    assert here.sum() > 200 and summary[1] < 5e-6 and summary[2] < 1e-4, summary


def test_light_that_the_smooth_surface_has_before_it_counts_where_the_true_one_has_it_behind(
    tilted,
):
    """Shadow rays leave below the surface, where scattered ones are lost."""
    errors, kinds = tilted()
    check(errors, kinds, *TILTED)


def test_a_smooth_normal_that_is_a_little_wrong_is_found(tilted, monkeypatch):
    from viewcam_addon.blender.scenes import export_geometry

    def turned(*arguments):
        normals = right(*arguments) + np.float32((0.01, 0, 0))
        return normals / np.linalg.norm(normals, axis=-1, keepdims=True)

    right = export_geometry._corner_normals
    monkeypatch.setattr(export_geometry, "_corner_normals", turned)
    errors, kinds = tilted()
    for each, kind in zip(errors, kinds, strict=True):
        with pytest.raises(AssertionError, match="p50"):
            check([each], [kind], *TILTED)


@pytest.fixture
def tilted(render_pair, camera, add, painted):
    """tilted() → errors of patches of each shader, tilted at random, whose normals are tilted, too; and the shaders."""
    rough, bare = {"Roughness": 0.6}, {"Specular IOR Level": 0.0}
    kinds = [
        (DIFFUSE, {}, {}),
        (DIFFUSE, rough, {}),
        ("ShaderNodeBsdfTranslucent", {}, {}),
        *((f"ShaderNodeBsdf{kind}", rough, {"distribution": "GGX"}) for kind in ("Glossy", "Glass", "Refraction")),
        *(
            (PRINCIPLED, inputs, {})
            for inputs in (
                bare,
                {},
                {"Metallic": 1.0},
                {"Transmission Weight": 0.7},
                {"Coat Weight": 0.8, "Coat Roughness": 0.4},
            )
        ),
    ]

    def show():
        camera.location, camera.rotation_euler, camera.data.lens = (0.013, 0.029, 4.0), (0, 0, 0), 36.0
        cells, rng = 12, np.random.default_rng(3)
        side = 4.0 / cells
        around = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]) * 0.3 * side
        for number, (kind, inputs, properties) in enumerate(kinds):
            material = painted(kind, inputs, properties)
            vertices, normals = [], []
            for place in range(number, cells * cells, len(kinds)):
                turned = np.linalg.qr(rng.normal(size=(3, 3)))[0]
                turned[:, 2] *= np.sign(turned[2, 2])
                vertices += list(
                    around @ turned.T + ((place % cells - cells / 2 + 0.5) * side, (place // cells - cells / 2 + 0.5) * side, 0)
                )
                normals += list(turned[:, 2] + rng.normal(0, 0.45, (4, 3)))
            mesh = bpy.data.meshes.new(f"P{number}")
            mesh.from_pydata(vertices, [], [range(i, i + 4) for i in range(0, len(vertices), 4)])
            mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
            if hasattr(mesh, "use_auto_smooth"):
                mesh.use_auto_smooth = True
            mesh.normals_split_custom_set([normals[loop.vertex_index] for loop in mesh.loops])
            mesh.materials.append(material)
            add(mesh, f"P{number}", pass_index=number + 1)
        traced, cycles, numbers = render_pair(144)
        errors = [
            np.abs(traced - cycles)[numbers == k + 1].max(axis=1) / cycles[numbers == k + 1].max() for k in range(len(kinds))
        ]
        assert min(map(len, errors)) > 200
        return errors, kinds

    return show


@pytest.mark.parametrize("wrong", ["strength", "convention", "uv"])
def test_a_normal_that_is_a_little_wrong_is_found(patches, monkeypatch, wrong):
    """The tests above must be able to fail."""
    from viewcam_addon.tracer import native

    right, changes = native._described_node, {"strength": (1.001,) * 3, "convention": "directx", "uv": "Second"}

    def described(node, *numbers):
        if node.type == "normal_map":
            node = native.Node(node.type, (*node.inputs, (wrong, changes[wrong])))
        return right(node, *numbers)

    cases = [((DIFFUSE, {"Color": COLOR}, {}, ("Normal",)), {"color": (0.7, 0.4, 0.9)})]
    if wrong == "uv":
        cases.append(((DIFFUSE, {"Color": COLOR}, {}, ("Normal",)), {"color": (0.7, 0.4, 0.9), "uv": "Second"}))
    monkeypatch.setattr(native, "_described_node", described)
    with pytest.raises(AssertionError, match="p50"):
        check(patches(cases), cases)


@pytest.mark.parametrize("wrong", ["filter_width", "height"])
def test_a_displacement_that_is_a_little_wrong_is_found(patches, monkeypatch, wrong):
    """The tests above must be able to fail."""
    from viewcam_addon.tracer import native

    right = native._described_node

    def described(node, *numbers):
        if (
            node.type == "math"
            and node["operation"] == "multiply"
            and node["b"] == (float(np.float32(0.2)),) * 3
            and wrong == "height"
        ):
            node = native.Node("math", (*node.inputs, ("b", 0.2004)))
        if node.type == "bump" and wrong == "filter_width":
            node = native.Node("bump", (*node.inputs, (wrong, 1.3)))
        return right(node, *numbers)

    cases = [((DIFFUSE, {"Color": COLOR}, {}, ()), {})]
    monkeypatch.setattr(native, "_described_node", described)
    with pytest.raises(AssertionError, match="p50"):
        check(patches(cases, displace), cases, p50=2e-5, p99=2e-4)


WRONG = {"strength": 0.999, "distance": 0.2002, "filter_width": 1.01, "invert": True}


@pytest.mark.parametrize("name", WRONG)
def test_a_bump_that_is_a_little_wrong_is_found(patches, monkeypatch, name):
    """The tests above must be able to fail."""
    from viewcam_addon.tracer import native

    right = native._described_node

    def described(node, *numbers):
        if node.type == "bump":
            node = native.Node(node.type, (*node.inputs, (name, True if name == "invert" else (WRONG[name],) * 3)))
        return right(node, *numbers)

    cases = [((DIFFUSE, {"Color": COLOR}, {}, ("Normal",)), {})]
    monkeypatch.setattr(native, "_described_node", described)
    with pytest.raises(AssertionError, match="p50"):
        check(patches(cases, bump), cases)
