"""Nodes that make values, without noise: a floor of patches that shine with what a node makes, one node each.

What is shown is a tenth of the value, kept between −3 and 3, and a half more, so that none is negative, in one sample a pixel.
The bound is absolute; where a value jumps (closest pixels, floors, divisions) Cycles' float32 may stand elsewhere, in a few.
"""

import itertools
import zlib

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
bmesh = pytest.importorskip("bmesh")

from viewcam_addon.blender import versions
from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.blender.scenes import cycles_attributes
from viewcam_addon.jobs.job import Job
from viewcam_addon.tracer import native
from viewcam_addon.tracer.scene.shader_nodes import KINDS

MOST, TYPICAL = 2e-5, 2e-6  # calibrated: float32 of UV up to 2, at images of 4 pixels, and 4.2 has another luminance by 1e-5
BYTES = 10 if bpy.app.version >= (5, 2) else 1  # calibrated: from 5.1 on Cycles has corners' colors of bytes in half floats
GLOW = 25 if bpy.app.version >= (5, 2) else 1  # calibrated: Cycles' red of 5.2 is another by up to 1e-4 than that of 4.2 to 5.0
JUMPS = 0.04  # share of the pixels
PARTS = 3  # in which the nodes are shown, so that each has pixels enough


class N:
    """A node by its class, inputs by their identifiers, properties; the output is the first enabled one or that of a name."""

    def __init__(self, kind, inputs=None, output=None, **properties):
        self.kind, self.inputs, self.output, self.properties = kind, inputs or {}, output, properties

    def add(self, tree):
        node = tree.nodes.new("ShaderNode" + self.kind)
        for name, value in self.properties.items():
            if name == "stops":
                for position, color in value:
                    node.color_ramp.elements.new(position).color = color
            elif name == "ramp":
                node.color_ramp.interpolation = value
            elif name == "curves":
                for curve, points in zip(node.mapping.curves, value, strict=False):
                    curve.points[0].location, curve.points[-1].location = points[0], points[-1]
                    for point in points[1:-1]:
                        curve.points.new(*point)
                node.mapping.update()
            elif name == "extend":
                node.mapping.extend = value
            else:
                setattr(node, name, value)
        for name, value in self.inputs.items():
            socket = next(each for each in node.inputs if each.identifier == name)
            if isinstance(value, N):
                tree.links.new(value.add(tree), socket)
            else:
                socket.default_value = value
        if self.output:
            return node.outputs[self.output]
        return next(socket for socket in node.outputs if socket.enabled)


class Constant(N):
    """A node whose output is its value."""

    def __init__(self, kind, value):
        self.kind, self.value = kind, value

    def add(self, tree):
        output = tree.nodes.new("ShaderNode" + self.kind).outputs[0]
        output.default_value = self.value
        return output


class InGroup(N):
    """A node in a group; one of its inputs is the group's, which has a value, or is fed by a node outside."""

    def __init__(self, node, name, fed, kind="Vector"):
        self.node, self.name, self.fed, self.kind = node, name, fed, kind

    def add(self, tree):
        inside = bpy.data.node_groups.new("Group", "ShaderNodeTree")
        inside.interface.new_socket("In", in_out="INPUT", socket_type="NodeSocket" + self.kind)
        inside.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketColor")
        output = self.node.add(inside)
        socket = next(each for each in output.node.inputs if each.identifier == self.name)
        inside.links.new(inside.nodes.new("NodeGroupInput").outputs[0], socket)
        inside.links.new(output, inside.nodes.new("NodeGroupOutput").inputs[0])
        group = tree.nodes.new("ShaderNodeGroup")
        group.node_tree = inside
        if isinstance(self.fed, N):
            tree.links.new(self.fed.add(tree), group.inputs[0])
        else:
            group.inputs[0].default_value = self.fed
        return group.outputs[0]


class Chosen(N):
    """The one of several nodes that a menu chooses, by name."""

    def __init__(self, name, **among):
        self.name, self.among = name, among

    def add(self, tree):
        node = tree.nodes.new("GeometryNodeMenuSwitch")
        node.data_type = "VECTOR"
        node.enum_items.clear()
        for name, each in self.among.items():
            node.enum_items.new(name)
            socket = next(socket for socket in node.inputs if socket.name == name)
            if isinstance(each, N):
                tree.links.new(each.add(tree), socket)
            else:
                socket.default_value = each
        node.inputs[0].default_value = self.name
        return node.outputs[0]


UV = N("TexCoord", output="UV")
U, V = N("SeparateXYZ", {"Vector": UV}, "X"), N("SeparateXYZ", {"Vector": UV}, "Y")
OBJECT = N("TexCoord", output="Object")


def two_colors():
    """Colors that vary over the mesh, one of them beyond 1."""
    less = N("Math", {"Value": V, "Value_001": 0.7}, operation="MULTIPLY")
    return tuple(N("CombineColor", {"Red": r, "Green": g, "Blue": b}) for r, g, b in ((U, V, 0.3), (0.4, U, less)))


ATTRIBUTES = (
    ("Weight", "FLOAT", "POINT", "value", 1),
    ("Tint", "FLOAT_COLOR", "CORNER", "color", 4),
    ("Byte", "BYTE_COLOR", "CORNER", "color", 4),
    ("Way", "FLOAT_VECTOR", "FACE", "vector", 3),
)
# Beside these: of edges, which Cycles asks for at vertices, and of four numbers that are no color.
MIXED = (
    ("Turn", "QUATERNION", "POINT", "value", 4),
    ("Edges", "FLOAT_VECTOR", "EDGE", "vector", 3),
    ("Rims", "BYTE_COLOR", "EDGE", "color", 4),
    ("Whole", "INT", "EDGE", "value", 1),
    ("Marked", "BOOLEAN", "EDGE", "value", 1),
)


def graphs(image, straight):
    """name → what a patch shows."""
    result = {}
    a, b = two_colors()
    for word in KINDS["math"].inputs["operation"]:
        result[f"math {word}"] = N("Math", {"Value": U, "Value_001": V, "Value_002": 0.4}, operation=word.upper())
    warm = N("Gamma", {"Color": (0.8, 0.3, 0.1, 1.0), "Gamma": 1.2})
    result["a constant color as a number"] = N("Math", {"Value": warm, "Value_001": U}, operation="MULTIPLY")
    result["math clamp"] = N("Math", {"Value": U, "Value_001": V}, operation="ADD", use_clamp=True)
    for word in KINDS["vector_math"].inputs["operation"]:
        operations = {"fract": "FRACTION"}.get(word, word.upper())
        if operations not in bpy.types.ShaderNodeVectorMath.bl_rna.properties["operation"].enum_items:
            continue  # some came with 4.3
        inputs = {"Vector": OBJECT, "Vector_001": a, "Vector_002": (0.3, 0.2, 0.1), "Scale": 0.7}
        result[f"vector math {word}"] = N("VectorMath", inputs, operation=operations)
    for word in KINDS["mix_color"].inputs["blend"]:
        inputs = {"Factor_Float": 0.6, "A_Color": a, "B_Color": b}
        result[f"mix {word}"] = N("Mix", inputs, data_type="RGBA", blend_type=word.upper())
    result["mix clamped"] = N(
        "Mix", {"Factor_Float": U, "A_Color": a, "B_Color": b}, data_type="RGBA", blend_type="ADD", clamp_result=True
    )
    result["mix number"] = N("Mix", {"Factor_Float": V, "A_Float": U, "B_Float": a}, data_type="FLOAT", clamp_factor=False)
    for word in KINDS["map_range"].inputs["interpolation"]:
        inputs = {"Value": U, "From Min": 0.2, "From Max": 1.1, "To Min": 0.9, "To Max": 0.1, "Steps": 3.0}
        result[f"map range {word}"] = N("MapRange", inputs, interpolation_type=word.upper(), clamp=False)
        result[f"map range {word} clamped"] = N("MapRange", inputs, interpolation_type=word.upper(), clamp=True)
    for interpolation in ("Linear", "Closest", "Cubic", "Smart"):
        for extension in ("REPEAT", "EXTEND", "CLIP", "MIRROR"):
            if interpolation in ("Linear", "Cubic") or extension == "CLIP":
                image_node = {"image": image, "interpolation": interpolation, "extension": extension}
                result[f"image {interpolation} {extension}"] = N("TexImage", {"Vector": UV}, **image_node)
    place = N("Mapping", {"Vector": OBJECT, "Rotation": (0.3, -0.4, 1.1), "Location": (0.2, -0.3, 0.1)})
    for word in ("SPHERE", "TUBE"):
        result[f"image {word}"] = N("TexImage", {"Vector": place}, image=image, projection=word)
    for blend in (0.0, 0.3, 0.6, 1.0):
        properties = {"image": image, "projection": "BOX", "projection_blend": blend}
        result[f"turned box {blend}"] = N("TexImage", {"Vector": place}, **properties)
    for word in ("EQUIRECTANGULAR", "MIRROR_BALL"):
        result[f"environment {word}"] = N("TexEnvironment", {"Vector": place}, image=image, projection=word)
    result["environment of positions"] = N("TexEnvironment", image=image, interpolation="Cubic")
    result["alpha"] = N("TexImage", {"Vector": UV}, "Alpha", image=straight, extension="CLIP")
    result["premultiplied"] = N("TexImage", {}, "Color", image=straight)
    for word in ("POINT", "TEXTURE", "VECTOR", "NORMAL"):
        inputs = {"Vector": OBJECT, "Rotation": (0.3, -0.4, 1.1), "Scale": (1.5, 0.7, 2.0)}
        inputs |= {"Location": (0.2, -0.3, 0.1)} if word in ("POINT", "TEXTURE") else {}
        result[f"mapping {word}"] = N("Mapping", inputs, vector_type=word)
    for word in ("UV", "Generated", "Object", "Normal", "Reflection", "Camera", "Window"):
        result[f"coordinate {word}"] = N("TexCoord", output=word)
    result["coordinate of another"] = N("TexCoord", output="Object", object=bpy.data.objects["Camera"])
    for word in ("View Vector", "View Z Depth", "View Distance"):
        result[f"camera {word}"] = N("CameraData", output=word)
    result["second UV"] = N("UVMap", uv_map="Second")
    for name in ("Weight", "Tint", "Byte", "Way", "Second", "Nothing"):
        for word in ("Color", "Vector", "Fac", "Alpha"):
            result[f"attribute {name} {word}"] = N("Attribute", output=word, attribute_name=name)
    result["color attribute"] = N("VertexColor", output="Color", layer_name="Byte")
    result["color attribute alpha"] = N("VertexColor", output="Alpha", layer_name="Tint")
    result["alpha of no color attribute"] = N("VertexColor", output="Alpha", layer_name="Nothing")
    for word in ("Position", "Normal", "True Normal", "Incoming", "Backfacing", "Tangent", "Parametric"):
        result[f"geometry {word}"] = N("NewGeometry", output=word)
    for word in ("Pointiness", "Random Per Island"):
        result[f"geometry {word}"] = N("NewGeometry", output=word)
    result["geometry by its name"] = N("Attribute", output="Fac", attribute_name="random_per_island")
    for pixels, size in ((False, 0.02), (True, 1.1)):
        wide = N("Math", {"Value": U, "Value_001": size, "Value_002": size}, operation="MULTIPLY_ADD")
        result[f"wireframe {pixels}"] = N("Wireframe", {"Size": wide}, use_pixel_size=pixels)
    result["tangent round z"] = N("Tangent", direction_type="RADIAL")
    for layer in ("", "Second"):
        result[f"tangent along {layer}"] = N("Tangent", direction_type="UV_MAP", uv_map=layer)
    for word in ("Location", "Color", "Alpha", "Object Index", "Material Index", "Random"):
        result[f"object {word}"] = N("ObjectInfo", output=word)
    result["fresnel"] = N("Fresnel", {"IOR": 1.45})
    for word in ("Fresnel", "Facing"):
        for blend in (0.2, 0.5, 0.8):
            result[f"layer weight {word} {blend}"] = N("LayerWeight", {"Blend": blend}, word)
    stops = [(0.3, (0.9, 0.1, 0.2, 0.5)), (0.6, (0.1, 0.3, 0.8, 1.0))]
    for word in ("LINEAR", "CONSTANT", "EASE", "B_SPLINE"):
        result[f"ramp {word}"] = N("ValToRGB", {"Fac": U}, "Color", stops=stops, ramp=word)
    result["ramp alpha"] = N("ValToRGB", {"Fac": a}, "Alpha", stops=stops)
    result |= procedural()
    result["gamma"] = N("Gamma", {"Color": a, "Gamma": 1.7})
    result["bright"] = N("BrightContrast", {"Color": a, "Bright": 0.1, "Contrast": 0.4})
    result["hue"] = N("HueSaturation", {"Color": a, "Hue": 0.63, "Saturation": 1.2, "Value": 0.8, "Fac": 0.9})
    result["invert"] = N("Invert", {"Color": a, "Fac": 0.7})
    result["luminance"] = N("RGBToBW", {"Color": a})
    result["separate"] = N("SeparateColor", {"Color": b}, "Green")
    result |= curves(a)
    result |= conversions(a, b)
    result["clamp"] = N("Clamp", {"Value": U, "Min": 0.2, "Max": 0.8})
    result["number of a vector"] = N("Math", {"Value": OBJECT, "Value_001": a}, operation="ADD")
    return result


def curves(color):
    """Curves of colors, vectors and numbers; beyond their ends either way."""
    bent = (((0.1, 0.9), (0.4, 0.2), (0.8, 1.3)), ((0.0, 0.0), (1.0, 0.6)), ((-0.2, 0.1), (0.5, 0.5), (0.9, -0.3)))
    common = ((0.0, 0.1), (0.7, 0.4), (1.0, 1.0))
    result = {}
    for word in ("EXTRAPOLATED", "HORIZONTAL"):
        result[f"rgb curves {word}"] = N("RGBCurve", {"Color": color, "Fac": 0.9}, curves=(*bent, common), extend=word)
        result[f"vector curves {word}"] = N("VectorCurve", {"Vector": OBJECT, "Fac": 1.0}, curves=bent, extend=word)
        result[f"float curve {word}"] = N("FloatCurve", {"Value": U, "Factor": V}, curves=bent[:1], extend=word)
    return result


def conversions(a, b):
    """Conversions between ways to write colors, of ranges, of vectors."""
    result = {}
    for mode in ("HSV", "HSL"):
        parts = N("SeparateColor", {"Color": a}, mode=mode)
        for word in ("Red", "Green", "Blue"):
            result[f"separate {mode} {word}"] = N("SeparateColor", {"Color": b}, word, mode=mode)
        result[f"combine {mode}"] = N("CombineColor", {"Red": parts, "Green": 0.7, "Blue": V}, mode=mode)
    for word in KINDS["map_range"].inputs["interpolation"]:
        ends = {"From_Min_FLOAT3": (0.2, 0.1, 1.0), "From_Max_FLOAT3": (1.1, 0.1, -0.4), "To_Min_FLOAT3": (0.9, -0.4, 0.1)}
        ends |= {"To_Max_FLOAT3": (0.1, 0.7, 0.8), "Steps_FLOAT3": (3.0, 2.0, 0.0)}
        for clamp in (False, True):
            settings = {"interpolation_type": word.upper(), "data_type": "FLOAT_VECTOR", "clamp": clamp}
            result[f"map range of vectors {word} {clamp}"] = N("MapRange", {"Vector": OBJECT} | ends, **settings)
    result["clamp range"] = N("Clamp", {"Value": U, "Min": 0.8, "Max": 0.2}, clamp_type="RANGE")
    for mode, factor in (("UNIFORM", {"Factor_Float": V}), ("NON_UNIFORM", {"Factor_Vector": UV})):
        for clamp in (False, True):
            inputs = factor | {"A_Vector": OBJECT, "B_Vector": (0.3, -0.4, 1.2)}
            settings = {"data_type": "VECTOR", "factor_mode": mode, "clamp_factor": clamp}
            result[f"mix vectors {mode} {clamp}"] = N("Mix", inputs, **settings)
    for word in KINDS["vector_rotate"].inputs["kind"]:
        inputs = {"Vector": OBJECT, "Center": (0.2, -0.1, 0.3)}
        inputs |= {"Rotation": (0.3, -0.4, 1.1)} if word == "euler_xyz" else {"Angle": 0.8}
        inputs |= {"Axis": (0.3, 0.5, -0.9)} if word == "axis_angle" else {}
        for invert in (False, True):
            result[f"vector rotate {word} {invert}"] = N("VectorRotate", inputs, rotation_type=word.upper(), invert=invert)
    for kind in ("POINT", "VECTOR", "NORMAL"):
        for start, end in itertools.permutations(("WORLD", "OBJECT", "CAMERA"), 2):
            words = {"vector_type": kind, "convert_from": start, "convert_to": end}
            result[f"vector transform {kind} {start} {end}"] = N("VectorTransform", {"Vector": OBJECT}, **words)
    kelvin = N("MapRange", {"Value": U, "To Min": 500.0, "To Max": 9000.0}, clamp=False)
    result["blackbody"] = N("Blackbody", {"Temperature": kelvin})
    nanometers = N("MapRange", {"Value": U, "To Min": 400.0, "To Max": 700.0}, clamp=False)
    result["wavelength"] = N("Wavelength", {"Wavelength": nanometers})
    for word in ("Normal", "Dot"):
        result[f"normal {word}"] = N("Normal", {"Normal": OBJECT}, word)
    for word in ("Is Camera Ray", "Is Shadow Ray", "Ray Length"):
        result[f"light path {word}"] = N("LightPath", output=word)
    return result


def procedural():
    """Textures that are formulas: noise on whole coordinates, too, where hashes must be the same."""
    place = N("Mapping", {"Vector": OBJECT, "Rotation": (0.3, -0.4, 1.1), "Location": (0.2, -0.3, 0.1)})
    cells = N("VectorMath", {"Vector": N("VectorMath", {"Vector": place, "Scale": 7.0}, operation="SCALE")}, operation="FLOOR")
    result = {}
    for kind in KINDS["noise"].inputs["kind"]:
        inputs = {"Vector": place, "Scale": 1.7, "Detail": 2.5, "Roughness": 0.6, "Lacunarity": 2.2, "Offset": 0.3, "Gain": 1.4}
        result[f"noise {kind}"] = N("TexNoise", inputs, "Fac", noise_type=kind.upper())
    for dimensions in ("1D", "2D", "3D", "4D"):
        inputs = {"Vector": place, "W": U, "Scale": 2.0, "Detail": 1.0, "Distortion": 0.4}
        result[f"noise {dimensions}"] = N(
            "TexNoise", inputs, "Color", noise_dimensions=dimensions, normalize=dimensions == "2D"
        )
        whole = {
            "Vector": cells,
            "W": N("Math", {"Value": N("Math", {"Value": U, "Value_001": 5}, operation="MULTIPLY")}, operation="FLOOR"),
        }
        result[f"white noise {dimensions}"] = N("TexWhiteNoise", whole, "Color", noise_dimensions=dimensions)
    result["white noise value"] = N("TexWhiteNoise", {"Vector": cells}, "Value")
    for name in ("TexNoise", "TexWhiteNoise", "TexChecker", "TexMagic", "TexBrick", "TexGradient", "TexWave", "TexVoronoi"):
        result[f"{name} without a vector"] = N(name, {}, "Color" if name != "TexNoise" else "Fac")
    a, b = two_colors()
    for word in ("Color", "Fac"):
        result[f"checker {word}"] = N("TexChecker", {"Vector": place, "Color1": a, "Color2": b, "Scale": 3.3}, word)
        result[f"magic {word}"] = N("TexMagic", {"Vector": place, "Scale": 1.3, "Distortion": 1.2}, word, turbulence_depth=4)
        inputs = {
            "Vector": place,
            "Color1": a,
            "Color2": b,
            "Mortar": (0.9, 0.1, 0.3, 1),
            "Scale": 1.5,
            "Mortar Size": 0.07,
            "Bias": -0.2,
        }
        settings = {"offset": 0.3, "offset_frequency": 3, "squash": 0.6, "squash_frequency": 2}
        result[f"brick {word}"] = N("TexBrick", inputs, word, **settings)
    for kind in KINDS["gradient"].inputs["kind"]:
        result[f"gradient {kind}"] = N("TexGradient", {"Vector": place}, gradient_type=kind.upper())
    inputs = {"Vector": place, "Scale": 0.8, "Distortion": 0.7, "Detail": 1.5, "Detail Scale": 1.4, "Phase Offset": 0.3}
    for direction, profile in (("X", "SIN"), ("Y", "SAW"), ("Z", "TRI"), ("DIAGONAL", "SIN")):
        rings = direction.replace("DIAGONAL", "SPHERICAL")
        words = {"bands_direction": direction, "rings_direction": rings, "wave_profile": profile}
        result[f"wave bands {direction}"] = N("TexWave", inputs, "Color", **words)
        result[f"wave rings {direction}"] = N("TexWave", inputs | {"Distortion": 0.0}, "Fac", wave_type="RINGS", **words)
    return result | voronoi(place)


def voronoi(place):
    """Every feature in every dimension, by one metric after the other, and the metrics' own."""
    result, metrics = {}, itertools.cycle(("MINKOWSKI", "CHEBYCHEV", "MANHATTAN", "EUCLIDEAN"))
    words = {"DISTANCE_TO_EDGE": ("Distance",), "N_SPHERE_RADIUS": ("Radius",)}
    for feature in ("F1", "F2", "SMOOTH_F1", "DISTANCE_TO_EDGE", "N_SPHERE_RADIUS"):
        for dimensions in ("1D", "2D", "3D", "4D"):
            plain = feature not in words and dimensions in ("2D", "3D")
            for word in words.get(feature, ("Distance", "Color", "W" if dimensions in ("1D", "4D") else "Position")):
                inputs = {"Vector": place, "W": U, "Scale": 1.9, "Exponent": 1.7, "Randomness": 0.8, "Smoothness": 0.4}
                inputs |= {} if plain or word == "Radius" else {"Detail": 1.3, "Roughness": 0.6, "Lacunarity": 1.8}
                settings = {"feature": feature, "voronoi_dimensions": dimensions, "normalize": dimensions == "2D"}
                settings["distance"] = next(metrics)
                result[f"voronoi {feature} {dimensions} {word}"] = N("TexVoronoi", inputs, word, **settings)
    return result


@pytest.fixture
def floor(scene, strewn, make_material, set_world, first_samples):
    """floor(graphs) → name → (what the tracer shows of it, what Cycles shows), each (pixels, 3)."""

    def show(graphs):
        scene.render.resolution_x = scene.render.resolution_y = 144
        set_world((0, 0, 0), 0.0)
        materials = []
        for name, graph in graphs.items():
            materials.append(make_material(name, "ShaderNodeEmission"))
            tree = materials[-1].node_tree
            picture = graph
            for operation, *by in (("MINIMUM", 3), ("MAXIMUM", -3), ("MULTIPLY_ADD", 0.1, 0.5)):
                inputs = {"Vector": picture} | {f"Vector_00{i}": (value,) * 3 for i, value in enumerate(by, start=1)}
                picture = N("VectorMath", inputs, operation=operation)
            tree.links.new(picture.add(tree), tree.nodes["Shader"].inputs["Color"])
        rng, mixed_rng = np.random.default_rng(1), np.random.default_rng(2)
        blocks = strewn(materials, cells=30, width=3.0, backwards=lambda i: i % 2 == 0)
        for name, block in zip(graphs, blocks, strict=True):
            mesh = block.data
            block.active_material.pass_index, block.color = 3, (0.2, 1.4, 0.6, 0.7)
            for layer in ("UVMap", "Second"):
                mesh.uv_layers[layer].data.foreach_set("uv", rng.uniform(-0.7, 1.6, 2 * len(mesh.loops)))
            for attribute, kind, domain, field, width in ATTRIBUTES:
                values = mesh.attributes.new(attribute, kind, domain).data
                values.foreach_set(field, rng.uniform(0, 1, width * len(values)))
            for attribute, kind, domain, field, width in MIXED:
                values = mesh.attributes.new(attribute, kind, domain).data
                numbers = mixed_rng.uniform(0, 1, width * len(values))
                whole = {"INT": np.rint(numbers * 9).astype(int), "BOOLEAN": numbers < 0.3}
                values.foreach_set(field, whole.get(kind, numbers))
            if name.startswith(("vector transform", "turned")):  # the others stand in the world as they are in themselves
                block.location, block.rotation_euler, block.scale = (0.3, -0.2, 0.1), (0.5, 0.2, -0.4), (1.2, 0.7, -0.9)
                bpy.context.view_layer.update()
                mesh.transform(block.matrix_world.inverted())
        traced, cycles_passes = first_samples()
        indices = traced["Object Index"][..., 0]
        return {
            name: tuple(each["Combined"][indices == number][:, :3].astype(np.float64) for each in (traced, cycles_passes))
            for number, name in enumerate(graphs, start=1)
        }

    return show


def check(pairs):
    result = []
    for name, (traced, cycles) in pairs.items():
        assert len(traced) > 20, (name, len(traced))
        apart = np.abs(traced - cycles).max(axis=1) / np.maximum(np.abs(cycles).max(axis=1), 1)
        scale = BYTES if name.startswith(("attribute Byte", "color attribute")) else GLOW if name == "blackbody" else 1
        apart /= scale
        if np.median(apart) > TYPICAL or (apart > MOST).mean() > JUMPS:
            result.append(
                f"{name}: p50 {np.median(apart):.1e}, {(apart > MOST).mean():.1%} above {MOST}, most {apart.max():.1e}"
            )
    assert not result, "\n".join(result)


@pytest.fixture
def images(fresh_blender):
    """An image of many colors, and one with an alpha that colors are multiplied by."""
    rng = np.random.default_rng(zlib.crc32(b"images"))
    result = []
    for name in ("many", "straight"):
        image = bpy.data.images.new(name, 4, 3, alpha=True)
        pixels = rng.random((12, 4)).astype(np.float32)
        if name == "many":
            pixels[:, 3] = 1
        image.pixels.foreach_set(pixels.ravel())
        image.update()
        image.pack()
        result.append(image)
    return result


def test_attributes_of_edges_are_mixed_as_in_cycles(floor):
    words = {name: N("Attribute", output="Color", attribute_name=name) for name, *_ in MIXED}
    pairs = floor(words | {f"{name} alpha": N("Attribute", output="Alpha", attribute_name=name) for name in ("Turn", "Rims")})
    check(pairs)
    assert all(np.ptp(traced) > 0.01 for traced, _ in pairs.values())


@pytest.mark.parametrize("part", range(PARTS))
def test_every_node_makes_what_cycles_makes(floor, images, part):
    check(floor(dict(list(graphs(*images).items())[part::PARTS])))


CORNER = (0.3, 0.4, 0.9)


def with_places(images):
    """name → (a node that looks at a place or a normal of the surface unless one is given, its input)."""
    return {
        "image": (N("TexImage", output="Color", image=images[0]), "Vector"),
        "environment": (N("TexEnvironment", output="Color", image=images[0]), "Vector"),
        "ball": (N("TexEnvironment", output="Color", image=images[0], projection="MIRROR_BALL"), "Vector"),
        "noise": (N("TexNoise", output="Color"), "Vector"),
        "checker": (N("TexChecker", output="Color"), "Vector"),
        "fresnel": (N("Fresnel"), "Normal"),
        "facing": (N("LayerWeight", output="Facing"), "Normal"),
    }


@pytest.mark.parametrize("value", [CORNER, (0.3, 0.3, 0.3), (0.0, 0.0, 0.0)])
def test_a_constant_that_is_given_counts_where_else_the_surface_has_a_value_of_its_own(floor, images, value):
    graphs = {}
    for name, (node, socket) in with_places(images).items():
        linked = (Constant("RGB", (*value, 1.0)), *([Constant("Value", value[0])] if len(set(value)) == 1 else []))
        for each in (*linked, N("CombineXYZ", dict(zip("XYZ", value, strict=True)))):
            graphs[f"{name} by {each.kind}"] = N(node.kind, {socket: each}, node.output, **node.properties)
        graphs[f"{name} by a node outside of its group"] = InGroup(node, socket, linked[0])
        graphs[f"{name} by its group"] = InGroup(node, socket, value)
        graphs[f"{name} by a color of its group"] = InGroup(node, socket, (*value, 1.0), "Color")
    check(floor(graphs))


def test_a_vector_that_is_the_same_everywhere_is_its_mean_as_a_number(floor):
    plus = N("Math", {"Value_001": N("TexCoord", output="Object")}, operation="ADD")
    check(floor({kind: InGroup(plus, "Value", value, kind) for kind, value in (("Vector", CORNER), ("Color", (*CORNER, 1.0)))}))


@pytest.mark.skipif(bpy.app.version < (5, 0), reason="shaders have had menus since 5.0")
def test_what_a_menu_chooses_is_shown(floor):
    a, b = N("TexCoord", output="Object"), N("TexNoise", output="Color")
    graphs = {f"the {name}": Chosen(name, first=a, second=b, third=CORNER) for name in ("first", "second", "third")}
    graphs["of a value that images are laid out by"] = N("TexChecker", {"Vector": Chosen("third", first=a, third=CORNER)})
    check(floor(graphs))


@pytest.mark.skipif(bpy.app.version < (5, 2), reason="shaders have had these nodes since 5.2")
def test_nodes_that_are_a_constant_are_that(floor):
    class Input(Constant):
        def add(self, tree):
            node = tree.nodes.new("FunctionNodeInput" + self.kind)
            setattr(node, {"Vector": "vector", "Int": "integer", "Bool": "boolean"}[self.kind], self.value)
            return node.outputs[0]

    check(floor({kind: Input(kind, value) for kind, value in (("Vector", CORNER), ("Int", 2), ("Bool", True))}))


@pytest.mark.parametrize(
    "kind, operation, name, by",
    [
        ("Math", "MULTIPLY", "Value", N("Math", {"Value": 0.0, "Value_001": 0.5}, operation="MULTIPLY")),
        ("Math", "POWER", "Value", 0.0),
        ("Math", "DIVIDE", "Value_001", 0.0),
        ("VectorMath", "SCALE", "Vector", 0.0),
        ("VectorMath", "CROSS_PRODUCT", "Vector", (0.0, 0.0, 0.0)),
        ("VectorMath", "DOT_PRODUCT", "Vector", (0.0, 0.0, 0.0)),
    ],
)
def test_a_color_whose_alpha_counts_for_nothing_is_not_divided_by_it(floor, images, kind, operation, name, by):
    other = {"Value": "Value_001", "Value_001": "Value", "Vector": "Scale" if operation == "SCALE" else "Vector_001"}[name]

    class Both(N):
        def add(self, tree):
            image = tree.nodes.new("ShaderNodeTexImage")
            image.image = images[1]
            output = N(kind, {other: by}, operation=operation).add(tree)
            tree.links.new(image.outputs["Alpha"], next(each for each in output.node.inputs if each.identifier == name))
            plus = tree.nodes.new("ShaderNodeVectorMath")
            tree.links.new(image.outputs["Color"], plus.inputs[0])
            tree.links.new(output, plus.inputs[1])
            return plus.outputs[0]

    check(floor({"both": Both("")}))


@pytest.mark.parametrize("clamp", [True, False])
def test_a_range_that_maps_from_one_number_is_0_within_what_it_maps_to(floor, clamp):
    ends = {"From Min": 0.4, "From Max": 0.4, "To Min": 0.3, "To Max": 2.0}
    kinds = ("LINEAR", "STEPPED", "SMOOTHSTEP", "SMOOTHERSTEP")
    check(floor({kind: N("MapRange", {"Value": U, **ends}, interpolation_type=kind, clamp=clamp) for kind in kinds}))


def test_a_mapping_that_scales_by_0_drops_its_location_unless_all_of_it_is_constant(floor):
    place, there = N("TexCoord", output="Object"), {"Location": CORNER, "Scale": (0.0, 0.0, 0.0)}
    graphs = {kind: N("Mapping", {"Vector": place, **there}, vector_type=kind) for kind in ("POINT", "TEXTURE")}
    check(
        floor(
            graphs
            | {"constant": N("Mapping", there), "by a color": N("Mapping", {"Vector": Constant("RGB", (1.0,) * 4), **there})}
        )
    )


def test_bricks_without_a_width_have_the_mortar_that_they_have_in_cycles(floor):
    bricks = {"Vector": N("TexCoord", output="Object"), "Scale": 3.0, "Mortar Size": 0.05}
    graphs = {}
    for word in ("Color", "Fac"):
        graphs[f"narrow {word}"] = N("TexBrick", bricks | {"Brick Width": 0.0}, word)
        graphs[f"squashed {word}"] = N("TexBrick", bricks, word, squash=0.0)
    check(floor(graphs))


def test_the_strength_of_light_that_falls_off_is_a_number_even_of_a_color(floor):
    check(floor({"as it is": N("LightFalloff", {"Strength": N("TexCoord", output="Object")}, "Quadratic")}))


def test_numbers_beyond_what_nodes_are_made_for_make_what_cycles_makes_of_them(floor):
    place = N("TexCoord", output="Object")
    graphs = {"to the power of 0": N("Gamma", {"Color": place, "Gamma": 0.0})}
    for mode in ("HSV", "HSL"):
        turned = {"Red": place, "Green": 0.8, "Blue": 0.5}
        graphs[f"hues of {mode}"] = N("CombineColor", turned, mode=mode)
    for kind, word in (("Fresnel", None), ("LayerWeight", "Fresnel"), ("LayerWeight", "Facing")):
        graphs[f"{kind} {word} by no unit vector"] = N(kind, {"Normal": place}, word)
    check(floor(graphs))


@pytest.mark.skipif(versions.ROWS_NEED_HEIGHTS, reason="since 5.1 they are told, see the next test")
def test_bricks_without_a_height_are_what_they_are_in_cycles(floor):
    bricks = {"Vector": N("TexCoord", output="Object"), "Scale": 3.0, "Row Height": 0.0}
    check(floor({f"flat {word}": N("TexBrick", bricks, word) for word in ("Color", "Fac")}))


@pytest.mark.skipif(not versions.ROWS_NEED_HEIGHTS, reason="before 5.1 they are what they are in Cycles, see the test above")
def test_bricks_without_a_height_are_told(camera, add, mesh_from, make_material):
    material = make_material("Wall", "ShaderNodeBsdfDiffuse")
    tree = material.node_tree
    tree.links.new(N("TexBrick", {"Row Height": 0.0}, "Color").add(tree), tree.nodes["Shader"].inputs["Color"])
    add(mesh_from("plane"), "Wall").data.materials.append(material)
    (entry,) = jobs.export(Job(level="direct")).ledger
    assert entry.status == "approximated" and "rows without a height" in entry.reason


def test_a_color_whose_alpha_is_used_is_divided_by_it(floor, images):
    material = N("TexImage", {}, "Color", image=images[1])
    node = material.add

    def both(tree):
        color = node(tree)
        mix = tree.nodes.new("ShaderNodeMix")
        mix.data_type = "RGBA"
        tree.links.new(color.node.outputs["Alpha"], mix.inputs[0])
        tree.links.new(color, next(each for each in mix.inputs if each.identifier == "B_Color"))
        return next(socket for socket in mix.outputs if socket.enabled)

    material.add = both
    check(floor({"cut out": material}))


@pytest.mark.parametrize("wrong", ["math", "mix_color", "mapping", "image", "environment", "texture_coordinate"])
def test_a_node_that_is_a_little_wrong_is_found(floor, images, monkeypatch, wrong):
    """The test above must be able to fail."""
    from viewcam_addon.tracer import native

    right = native._described_node
    changes = {
        "math": ("a", lambda value: tuple(0.999 * each for each in value)),
        "mix_color": ("factor", lambda value: tuple(each + 0.001 for each in value)),
        "mapping": ("rotation", lambda value: (value[0], value[1], value[2] + 1e-3)),
        "image": ("interpolation", lambda value: "cubic"),
        "environment": ("projection", lambda value: "mirror_ball"),
        "texture_coordinate": ("output", lambda value: "normal"),
    }
    name, change = changes[wrong]

    def described(node, *numbers):
        if node.type == wrong:
            node = native.Node(node.type, (*node.inputs, (name, change(node[name]))))
        return right(node, *numbers)

    names = {
        "math": N("Math", {"Value": 0.7, "Value_001": U}, operation="ADD"),
        "mix_color": N("Mix", {"Factor_Float": 0.5, "A_Color": UV, "B_Color": (0.2, 0.9, 0.4, 1)}, data_type="RGBA"),
        "mapping": N("Mapping", {"Vector": UV, "Rotation": (0, 0, 0.2)}),
        "image": N("TexImage", {"Vector": UV}, image=images[0], extension="EXTEND"),
        "environment": N("TexEnvironment", {"Vector": OBJECT}, image=images[0]),
        "texture_coordinate": OBJECT,
    }
    monkeypatch.setattr(native, "_described_node", described)
    with pytest.raises(AssertionError, match="p50"):
        check(floor({wrong: names[wrong]}))


def test_generated_coordinates_are_those_of_the_mesh_before_it_was_deformed(scene, camera, add, make_material, first_samples):
    """A modifier bends one grid; the other has a texture space of its own."""
    scene.render.resolution_x = scene.render.resolution_y = 48
    camera.location, camera.rotation_euler, camera.data.lens = (0.013, 0.029, 4.0), (0, 0, 0), 40.0
    material = make_material("Generated", "ShaderNodeEmission")
    tree = material.node_tree
    tree.links.new(N("TexCoord", output="Generated").add(tree), tree.nodes["Shader"].inputs["Color"])
    for place, own in ((-0.8, False), (0.8, True)):
        rows = 12
        points = [(x / rows - 0.5, y / rows - 0.5, 0.1 * (x * y % 3)) for y in range(rows + 1) for x in range(rows + 1)]
        starts = [x + y * (rows + 1) for y in range(rows) for x in range(rows)]
        mesh = bpy.data.meshes.new("Grid")
        mesh.from_pydata(points, [], [(i, i + 1, i + rows + 2, i + rows + 1) for i in starts])
        mesh.materials.append(material)
        block = add(mesh, f"Grid {own}")
        block.location = (place, 0, 0)
        if own:
            mesh.use_auto_texspace = False
            mesh.texspace_location, mesh.texspace_size = (-0.2, -0.1, 0.1), (0.6, 0.7, 0.9)
        else:
            bend = block.modifiers.new("Bend", "SIMPLE_DEFORM")
            bend.deform_method, bend.angle, bend.deform_axis = "TWIST", 0.7, "X"
    traced, cycles_passes = first_samples()
    met = traced["Depth"][..., 0] < 100
    apart = np.abs(traced["Combined"] - cycles_passes["Combined"])[met]
    summary = met.sum(), *np.percentile(apart, (50, 99, 100))
    # Calibrated: 3e-7, 7e-6, and where the grid is seen edge-on 4.5e-5, of Cycles' barycentric coordinates in float32.
    assert met.sum() > 300 and summary[1] < 1e-6 and summary[2] < 1e-5 and summary[3] < 1e-4, summary


@pytest.fixture
def thrown(scene, camera, add, mesh_from, make_material, set_world, images, first_samples):
    """thrown(blend) → errors where a smooth, stretched body shows an image that is thrown on it along its axes."""

    def show(blend):
        scene.render.resolution_x = scene.render.resolution_y = 64
        set_world((0, 0, 0), 0.0)
        camera.location, camera.rotation_euler, camera.data.lens = (0.2, -4.0, 0.3), (1.5, 0.0, 0.05), 45.0
        material = make_material("Thrown", "ShaderNodeEmission")
        tree = material.node_tree
        projected = N("TexImage", {"Vector": OBJECT}, image=images[0], projection="BOX", projection_blend=blend)
        tree.links.new(projected.add(tree), tree.nodes["Shader"].inputs["Color"])
        mesh = mesh_from("monkey")
        for polygon in mesh.polygons:
            polygon.use_smooth = True
        mesh.materials.append(material)
        monkey = add(mesh, "Monkey", pass_index=1)
        monkey.scale, monkey.rotation_euler = (1.2, 0.8, 1.0), (0.2, 0.1, 0.4)
        traced, cycles_passes = first_samples()
        here = traced["Object Index"][..., 0] == 1
        assert here.sum() > 500
        return np.abs(traced["Combined"] - cycles_passes["Combined"])[here].max(axis=1)

    return show


# Calibrated: where the image is steep float32 leaves 2e-5 of the place; since 5.1 normals are two numbers of 16 bits.
THROWN = (5e-6, 1e-3) if bpy.app.version >= (5, 1) else (2e-6, 2e-5)


@pytest.mark.parametrize("blend", [0.0, 0.3, 0.7, 1.0])
def test_an_image_is_thrown_on_a_body_along_its_axes(thrown, blend):
    percentiles = np.percentile(thrown(blend), (50, 97))
    assert (percentiles <= THROWN).all(), percentiles


def test_a_blend_between_axes_that_is_a_little_wrong_is_found(thrown, monkeypatch):
    from viewcam_addon.tracer import native

    right = native._described_node

    def described(node, *numbers):
        if node.type == "image":
            node = native.Node(node.type, (*node.inputs, ("blend", (0.75,) * 3)))
        return right(node, *numbers)

    monkeypatch.setattr(native, "_described_node", described)
    assert np.percentile(thrown(0.7), 97) > THROWN[1]


def test_each_instance_has_a_random_number_and_the_color_of_what_places_it(
    scene, camera, add, mesh_from, make_material, set_world, first_samples
):
    scene.render.resolution_x = scene.render.resolution_y = 48
    set_world((0, 0, 0), 0.0)
    material = make_material("Random", "ShaderNodeEmission")
    tree = material.node_tree
    tree.links.new(N("ObjectInfo", output="Random").add(tree), tree.nodes["Shader"].inputs["Strength"])
    tree.links.new(N("ObjectInfo", output="Color").add(tree), tree.nodes["Shader"].inputs["Color"])
    grid = mesh_from("grid", x_subdivisions=5, y_subdivisions=5, size=4)
    parent = add(grid, "Grid", color=(0.3, 0.9, 0.6, 1))
    plate = add(mesh_from("plane", size=0.5), "Plate", color=(0.7, 0.1, 0.2, 1))
    plate.parent, parent.instance_type, parent.show_instancer_for_render = parent, "VERTS", False
    alone = add(plate.data, "Plätze", location=(1, 1, 0.5), color=(1, 0.5, 0.2, 1))
    for block in (plate, alone):
        block.data.materials.clear()
        block.data.materials.append(material)
    camera.location, camera.rotation_euler, camera.data.lens = (0, 0, 5), (0, 0, 0), 36
    traced, cycles_passes = first_samples()
    apart = np.abs(traced["Combined"] - cycles_passes["Combined"])[..., :3].max(axis=-1)
    assert apart.max() < 1e-6
    drawn = np.unique(np.round(cycles_passes["Combined"][..., 0].astype(np.float64), 6))
    assert len(drawn) > 30, drawn  # 36 instances, the one alone, and nothing


def test_generated_coordinates_of_a_point_cloud_are_named_since_they_do_not_come_along(
    scene, camera, add, make_material, node_group
):
    material = make_material("Generated", "ShaderNodeEmission")
    nodes = material.node_tree
    nodes.links.new(N("TexCoord", output="Generated").add(nodes), nodes.nodes["Shader"].inputs["Color"])
    data = bpy.data.meshes.new("Point")
    data.from_pydata([(0, 0, 0)], [], [])
    tree, source, target = node_group()
    points, paint = tree.nodes.new("GeometryNodeMeshToPoints"), tree.nodes.new("GeometryNodeSetMaterial")
    paint.inputs["Material"].default_value = material
    for output, goal in ((source, points), (points, paint), (paint, target)):
        tree.links.new(output.outputs[0], goal.inputs[0])
    add(data, "Drop").modifiers.new("Nodes", "NODES").node_group = tree
    (entry,) = jobs.export(Job(level="direct")).ledger
    assert (entry.object, entry.status) == ("Drop", "approximated") and "'generated'" in entry.reason, entry


@pytest.fixture
def pointed(scene, camera, add, mesh_from, make_material, set_world, first_samples):
    """pointed() → |tracer − Cycles|, (pixels, 3), of a head that shows how pointed it is, its islands and its edges.

    Its edges are split, so that vertices stand in one place, and one vertex has edges without a face.

    by : a modifier that splits them or, until 5.0, Cycles itself where they are sharp.
    """

    def show(by="a modifier"):
        scene.render.resolution_x = scene.render.resolution_y = 96
        set_world((0, 0, 0), 0.0)
        camera.location, camera.rotation_euler, camera.data.lens = (0.2, -4.0, 0.3), (1.5, 0.0, 0.05), 45.0
        material = make_material("Pointed", "ShaderNodeEmission")
        inputs = {
            "Red": N("NewGeometry", output="Pointiness"),
            "Green": N("NewGeometry", output="Random Per Island"),
            "Blue": N("Wireframe", {"Size": 1.3}, use_pixel_size=True),
        }
        tree = material.node_tree
        tree.links.new(N("CombineColor", inputs).add(tree), tree.nodes["Shader"].inputs["Color"])
        head = bmesh.new()
        head.from_mesh(mesh_from("monkey"))
        head.verts.ensure_lookup_table()
        head.edges.new((head.verts[0], head.verts.new((0.0, 0.0, 2.0))))
        mesh = bpy.data.meshes.new("Head")
        head.to_mesh(mesh)
        mesh.materials.append(material)
        block = add(mesh, "Head", pass_index=1, scale=(1.2, 0.8, 1.0), rotation_euler=(0.2, 0.1, 0.4))
        if by == "a modifier":
            split = block.modifiers.new("Split", "EDGE_SPLIT")
            split.split_angle = 0.4
        else:
            mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
            mesh.set_sharp_from_angle(angle=0.4)
        traced, cycles_passes = first_samples()
        here = traced["Object Index"][..., 0] == 1
        assert here.sum() > 2000 and len(np.unique(cycles_passes["Combined"][here][:, 1])) >= 2
        return np.abs(traced["Combined"] - cycles_passes["Combined"])[here][:, :3]

    return show


def differs(apart):
    """In which of the three a picture differs from that of Cycles."""
    wrong = [bool(np.percentile(column, 99.5) > 1e-5) for column in apart.T[:2]]  # calibrated: 1e-6 but for grazed edges
    return *wrong, bool((apart[:, 2] > 0).mean() > JUMPS)


@pytest.mark.parametrize("by", ["a modifier", "Cycles"])
def test_how_pointed_a_mesh_is_and_its_islands_and_edges_are_those_of_cycles(pointed, by):
    apart = pointed(by)
    assert differs(apart) == (False, False, False), np.percentile(apart, (50, 99, 99.5, 100), axis=0)


WRONG = ("doubles apart", "edges in another order", "half as wide")


@pytest.mark.parametrize("wrong", WRONG)
def test_a_formula_of_edges_that_is_a_little_wrong_is_found(pointed, monkeypatch, wrong):
    right = cycles_attributes.random_per_island, native._described_node
    if wrong == "doubles apart":
        monkeypatch.setattr(cycles_attributes, "_welded", lambda places: np.arange(len(places)))
    elif wrong == "edges in another order":
        monkeypatch.setattr(cycles_attributes, "random_per_island", lambda edges, count: right[0](edges[::-1], count))
    else:

        def described(node, *numbers):
            if node.type == "wireframe":
                node = native.Node(node.type, (*node.inputs, ("size", (0.65,) * 3)))
            return right[1](node, *numbers)

        monkeypatch.setattr(native, "_described_node", described)
    assert differs(pointed()) == tuple(wrong == each for each in WRONG)


def test_a_grid_that_is_flat_is_half_pointed_and_one_island():
    rows = 40
    places = np.array([(x, y, 0) for y in range(rows) for x in range(rows)], np.float32)
    number = np.arange(rows * rows).reshape(rows, rows)
    edges = np.concatenate(
        [np.stack(pair, -1).reshape(-1, 2) for pair in ((number[:, 1:], number[:, :-1]), (number[1:], number[:-1]))]
    )
    normals = np.broadcast_to(np.float32((0, 0, 1)), places.shape)
    assert np.abs(cycles_attributes.pointiness(places, normals, edges.astype(np.int32)) - 0.5).max() < 1e-7
    assert len(np.unique(cycles_attributes.random_per_island(edges, len(places)))) == 1
    assert len(np.unique(cycles_attributes.random_per_island(edges[:0], len(places)))) == len(places)
