"""The tracer's nodes that make values (tracer/scene/value_nodes.py) as Blender has them, to be read and to be made again."""

from dataclasses import dataclass, field
from pathlib import Path

import bpy
import numpy as np

from ...tracer.scene.shader_nodes import KINDS
from ...tracer.scene.value_nodes import LIGHT_PATH
from .nodes import Output


@dataclass(frozen=True)
class Value:
    """A type of node as Blender has it.

    kind : its type; class_name : its class. inputs : ours → the identifier of theirs. words, flags, names, numbers : ours → the
    property. outputs : the identifier of theirs → our word for it, None where we have one output. fixed : property → what it
    must be. before : of inputs that older versions lack, what these compute with.
    """

    kind: str
    class_name: str
    inputs: dict[str, str]
    outputs: dict[str, str | None]
    words: dict[str, str] = field(default_factory=dict)
    flags: dict[str, str] = field(default_factory=dict)
    fixed: dict[str, str | bool] = field(default_factory=dict)
    names: dict[str, str] = field(default_factory=dict)
    numbers: dict[str, str] = field(default_factory=dict)
    before: dict[str, float] = field(default_factory=dict)


def _same(*names: str) -> dict[str, str]:
    return {name.lower().replace(" ", "_"): name for name in names}


def _words(*names: str) -> dict[str, str | None]:
    return {name: name.lower().replace(" ", "_") for name in names}


_COLOR = {"Color": None}
_FACTOR_OR_COLOR = {"Color": "color", "Fac": "factor"}
VALUES: tuple[tuple[str, Value], ...] = (
    (
        "image",
        Value(
            "TEX_IMAGE",
            "ShaderNodeTexImage",
            {"vector": "Vector"},
            _words("Color", "Alpha"),
            {"interpolation": "interpolation", "extension": "extension", "projection": "projection"},
            numbers={"blend": "projection_blend"},
        ),
    ),
    (
        "environment",
        Value(
            "TEX_ENVIRONMENT",
            "ShaderNodeTexEnvironment",
            {"vector": "Vector"},
            _COLOR,
            {"interpolation": "interpolation", "projection": "projection"},
        ),
    ),
    (
        "texture_coordinate",
        Value(
            "TEX_COORD",
            "ShaderNodeTexCoord",
            {},
            _words("UV", "Generated", "Object", "Normal", "Reflection", "Camera", "Window"),
        ),
    ),
    (
        "attribute",
        Value(
            "ATTRIBUTE",
            "ShaderNodeAttribute",
            {},
            {"Color": "color", "Vector": "vector", "Fac": "number", "Alpha": "alpha"},
            names={"name": "attribute_name"},
            fixed={"attribute_type": "GEOMETRY"},
        ),
    ),
    (
        "attribute",
        Value(
            "VERTEX_COLOR",
            "ShaderNodeVertexColor",
            {},
            {"Color": "color", "Alpha": "alpha"},
            names={"name": "layer_name"},
        ),
    ),
    (
        "attribute",
        Value("UVMAP", "ShaderNodeUVMap", {}, {"UV": "vector"}, names={"name": "uv_map"}, fixed={"from_instancer": False}),
    ),
    (
        "mapping",
        Value(
            "MAPPING",
            "ShaderNodeMapping",
            _same("Vector", "Location", "Rotation", "Scale"),
            {"Vector": None},
            {"kind": "vector_type"},
        ),
    ),
    (
        "geometry",
        Value(
            "NEW_GEOMETRY",
            "ShaderNodeNewGeometry",
            {},
            _words("Position", "Normal", "True Normal", "Incoming", "Backfacing", "Tangent", "Parametric"),
        ),
    ),
    (
        "vector_rotate",
        Value(
            "VECTOR_ROTATE",
            "ShaderNodeVectorRotate",
            _same("Vector", "Center", "Axis", "Angle", "Rotation"),
            {"Vector": None},
            {"kind": "rotation_type"},
            {"invert": "invert"},
        ),
    ),
    (
        "vector_transform",
        Value(
            "VECT_TRANSFORM",
            "ShaderNodeVectorTransform",
            {"vector": "Vector"},
            {"Vector": None},
            {"kind": "vector_type", "from": "convert_from", "to": "convert_to"},
        ),
    ),
    (
        "light_path",
        Value(
            "LIGHT_PATH",
            "ShaderNodeLightPath",
            {},
            _words(*(name.replace("_", " ").title() for name in LIGHT_PATH.split())),
        ),
    ),
    (
        "object_info",
        Value(
            "OBJECT_INFO",
            "ShaderNodeObjectInfo",
            {},
            _words("Location", "Object Index", "Material Index", "Color", "Alpha", "Random"),
        ),
    ),
    (
        "tangent",
        Value(
            "TANGENT",
            "ShaderNodeTangent",
            {},
            {"Tangent": None},
            {"kind": "direction_type", "axis": "axis"},
            names={"uv": "uv_map"},
        ),
    ),
    (
        "normal_map",
        Value(
            "NORMAL_MAP",
            "ShaderNodeNormalMap",
            _same("Color", "Strength"),
            {"Normal": None},
            {"space": "space", "convention": "convention"},
            names={"uv": "uv_map"},
        ),
    ),
    (
        "bump",
        Value(
            "BUMP",
            "ShaderNodeBump",
            _same("Height", "Strength", "Distance", "Filter Width", "Normal"),
            {"Normal": None},
            flags={"invert": "invert"},
            before={"filter_width": 1.0},
        ),
    ),
    ("ies", Value("TEX_IES", "ShaderNodeTexIES", _same("Vector", "Strength"), {"Fac": None})),
    ("fresnel", Value("FRESNEL", "ShaderNodeFresnel", {"ior": "IOR", "normal": "Normal"}, {"Fac": None})),
    ("layer_weight", Value("LAYER_WEIGHT", "ShaderNodeLayerWeight", _same("Blend", "Normal"), _words("Fresnel", "Facing"))),
    (
        "math",
        Value(
            "MATH",
            "ShaderNodeMath",
            {"a": "Value", "b": "Value_001", "c": "Value_002"},
            {"Value": None},
            {"operation": "operation"},
            {"clamp": "use_clamp"},
        ),
    ),
    (
        "vector_math",
        Value(
            "VECT_MATH",
            "ShaderNodeVectorMath",
            {"a": "Vector", "b": "Vector_001", "c": "Vector_002", "scale": "Scale"},
            {"Vector": None, "Value": None},
            {"operation": "operation"},
        ),
    ),
    (
        "map_range",
        Value(
            "MAP_RANGE",
            "ShaderNodeMapRange",
            _same("Value", "From Min", "From Max", "To Min", "To Max", "Steps"),
            {"Result": None},
            {"interpolation": "interpolation_type"},
            {"clamp": "clamp"},
            {"data_type": "FLOAT"},
        ),
    ),
    (
        "map_range_vector",
        Value(
            "MAP_RANGE",
            "ShaderNodeMapRange",
            {
                "value": "Vector",
                "from_min": "From_Min_FLOAT3",
                "from_max": "From_Max_FLOAT3",
                "to_min": "To_Min_FLOAT3",
                "to_max": "To_Max_FLOAT3",
                "steps": "Steps_FLOAT3",
            },
            {"Vector": None},
            {"interpolation": "interpolation_type"},
            {"clamp": "clamp"},
            {"data_type": "FLOAT_VECTOR"},
        ),
    ),
    (
        "clamp",
        Value("CLAMP", "ShaderNodeClamp", _same("Value", "Min", "Max"), {"Result": None}, {"kind": "clamp_type"}),
    ),
    (
        "separate",
        Value("SEPXYZ", "ShaderNodeSeparateXYZ", {"color": "Vector"}, {"X": "x", "Y": "y", "Z": "z"}),
    ),
    (
        "separate_color",
        Value(
            "SEPARATE_COLOR",
            "ShaderNodeSeparateColor",
            {"color": "Color"},
            {"Red": "x", "Green": "y", "Blue": "z"},
            {"mode": "mode"},
        ),
    ),
    (
        "combine_xyz",
        Value("COMBXYZ", "ShaderNodeCombineXYZ", {"x": "X", "y": "Y", "z": "Z"}, {"Vector": None}),
    ),
    (
        "combine_color",
        Value(
            "COMBINE_COLOR",
            "ShaderNodeCombineColor",
            {"x": "Red", "y": "Green", "z": "Blue"},
            _COLOR,
            {"mode": "mode"},
        ),
    ),
    (
        "mix_color",
        Value(
            "MIX",
            "ShaderNodeMix",
            {"factor": "Factor_Float", "a": "A_Color", "b": "B_Color"},
            {"Result_Color": None},
            {"blend": "blend_type"},
            {"clamp_factor": "clamp_factor", "clamp_result": "clamp_result"},
            {"data_type": "RGBA"},
        ),
    ),
    (
        "mix_color",
        Value(
            "MIX_RGB",
            "ShaderNodeMixRGB",
            {"factor": "Fac", "a": "Color1", "b": "Color2"},
            _COLOR,
            {"blend": "blend_type"},
            {"clamp_result": "use_clamp"},
        ),
    ),
    (
        "mix_number",
        Value(
            "MIX",
            "ShaderNodeMix",
            {"factor": "Factor_Float", "a": "A_Float", "b": "B_Float"},
            {"Result_Float": None},
            {},
            {"clamp_factor": "clamp_factor"},
            {"data_type": "FLOAT"},
        ),
    ),
    (
        "mix_vector",
        Value(
            "MIX",
            "ShaderNodeMix",
            {"factor": "Factor_Float", "a": "A_Vector", "b": "B_Vector"},
            {"Result_Vector": None},
            {},
            {"clamp_factor": "clamp_factor"},
            {"data_type": "VECTOR", "factor_mode": "UNIFORM"},
        ),
    ),
    (
        "mix_components",
        Value(
            "MIX",
            "ShaderNodeMix",
            {"factor": "Factor_Vector", "a": "A_Vector", "b": "B_Vector"},
            {"Result_Vector": None},
            {},
            {"clamp_factor": "clamp_factor"},
            {"data_type": "VECTOR", "factor_mode": "NON_UNIFORM"},
        ),
    ),
    ("rgb_curves", Value("CURVE_RGB", "ShaderNodeRGBCurve", {"factor": "Fac", "color": "Color"}, _COLOR)),
    (
        "vector_curves",
        Value("CURVE_VEC", "ShaderNodeVectorCurve", {"factor": "Fac", "vector": "Vector"}, {"Vector": None}),
    ),
    (
        "float_curve",
        Value("CURVE_FLOAT", "ShaderNodeFloatCurve", _same("Factor", "Value"), {"Value": None}),
    ),
    ("blackbody", Value("BLACKBODY", "ShaderNodeBlackbody", _same("Temperature"), _COLOR)),
    ("wavelength", Value("WAVELENGTH", "ShaderNodeWavelength", _same("Wavelength"), _COLOR)),
    ("gamma", Value("GAMMA", "ShaderNodeGamma", _same("Color", "Gamma"), _COLOR)),
    (
        "bright_contrast",
        Value("BRIGHTCONTRAST", "ShaderNodeBrightContrast", _same("Color", "Bright", "Contrast"), _COLOR),
    ),
    (
        "hue_saturation",
        Value(
            "HUE_SAT",
            "ShaderNodeHueSaturation",
            _same("Color", "Hue", "Saturation", "Value") | {"factor": "Fac"},
            _COLOR,
        ),
    ),
    ("invert", Value("INVERT", "ShaderNodeInvert", {"color": "Color", "factor": "Fac"}, _COLOR)),
    (
        "noise",
        Value(
            "TEX_NOISE",
            "ShaderNodeTexNoise",
            _same("Vector", "W", "Scale", "Detail", "Roughness", "Lacunarity", "Offset", "Gain", "Distortion"),
            _FACTOR_OR_COLOR,
            {"dimensions": "noise_dimensions", "kind": "noise_type"},
            {"normalize": "normalize"},
        ),
    ),
    (
        "white_noise",
        Value(
            "TEX_WHITE_NOISE",
            "ShaderNodeTexWhiteNoise",
            _same("Vector", "W"),
            _words("Value", "Color"),
            {"dimensions": "noise_dimensions"},
        ),
    ),
    (
        "checker",
        Value("TEX_CHECKER", "ShaderNodeTexChecker", _same("Vector", "Color1", "Color2", "Scale"), _FACTOR_OR_COLOR),
    ),
    (
        "gradient",
        Value(
            "TEX_GRADIENT",
            "ShaderNodeTexGradient",
            _same("Vector"),
            {"Color": None, "Fac": None},
            {"kind": "gradient_type"},
        ),
    ),
    (
        "wave",
        Value(
            "TEX_WAVE",
            "ShaderNodeTexWave",
            _same("Vector", "Scale", "Distortion", "Detail", "Detail Scale", "Detail Roughness", "Phase Offset"),
            {"Color": None, "Fac": None},
            {"kind": "wave_type", "bands": "bands_direction", "rings": "rings_direction", "profile": "wave_profile"},
        ),
    ),
    (
        "magic",
        Value(
            "TEX_MAGIC",
            "ShaderNodeTexMagic",
            _same("Vector", "Scale", "Distortion"),
            _FACTOR_OR_COLOR,
            numbers={"depth": "turbulence_depth"},
        ),
    ),
    (
        "brick",
        Value(
            "TEX_BRICK",
            "ShaderNodeTexBrick",
            _same(
                "Vector",
                "Color1",
                "Color2",
                "Mortar",
                "Scale",
                "Mortar Size",
                "Mortar Smooth",
                "Bias",
                "Brick Width",
                "Row Height",
            ),
            _FACTOR_OR_COLOR,
            numbers={name: name for name in ("offset", "offset_frequency", "squash", "squash_frequency")},
        ),
    ),
    (
        "voronoi",
        Value(
            "TEX_VORONOI",
            "ShaderNodeTexVoronoi",
            _same("Vector", "W", "Scale", "Detail", "Roughness", "Lacunarity", "Smoothness", "Exponent", "Randomness"),
            _words("Distance", "Color", "Position", "W", "Radius"),
            {"dimensions": "voronoi_dimensions", "feature": "feature", "metric": "distance"},
            {"normalize": "normalize"},
        ),
    ),
    ("rgb_to_bw", Value("RGBTOBW", "ShaderNodeRGBToBW", {"color": "Color"}, {"Val": None})),
)
"""What we call each, and what it is; of what is one thing to us the first is made."""

# Blender's words, where they are others than ours in capitals.
_WORDS = {
    **{(ours, word): word.title() for ours in ("image", "environment") for word in ("linear", "closest", "cubic")},
    ("vector_math", "fract"): "FRACTION",
}


def word_of(ours: str, word: str) -> str:
    """What Blender calls one of the words of a node."""
    return _WORDS.get((ours, word), word.upper())


def value_of(output: Output) -> tuple[str, Value] | None:
    """What makes the value of an output, or None where that is not modelled."""
    for ours, value in VALUES:
        is_it = value.kind == output.node.type and output.socket.identifier in value.outputs
        if is_it and all(getattr(output.node, name) == wanted for name, wanted in value.fixed.items()):
            return ours, value
    return None


def given_words(output: Output, ours: str, value: Value) -> dict[str, object] | str:
    """The words and flags of a node; or, where one is not modelled, that clause."""
    found: dict[str, object] = {name: bool(getattr(output.node, theirs)) for name, theirs in value.flags.items()}
    found |= {name: getattr(output.node, theirs) for name, theirs in value.names.items()}
    found |= {name: (float(getattr(output.node, theirs)),) * 3 for name, theirs in value.numbers.items()}
    for name, theirs in value.words.items():
        word = getattr(output.node, theirs, None)
        if word is None:  # an older version, in which it is what is the default here
            continue
        if name == "interpolation" and word == "Smart":
            word = "Cubic"
        choices = KINDS[ours].inputs[name]
        known = next((each for each in choices if word_of(ours, each) == word), None)
        if known is None:
            return f"has the {name} {word.lower()}"
        found[name] = known
    word = value.outputs[output.socket.identifier]
    return found if word is None else found | {"output": word}


_TABLE = 256  # Cycles looks curves up in a table of one more


def curve_table(mapping: bpy.types.CurveMapping) -> tuple[np.ndarray, float, float]:
    """The table that Cycles makes of curves, (1, 257, 3) float32, and where it begins and ends.

    Of four curves the last changes the three channels before the others do; one is that of all.
    """
    mapping.update()  # as Cycles does: a change of how it goes on beyond its ends alone makes no new one
    curves = list(mapping.curves)
    least = min(curve.points[0].location[0] for curve in curves)
    most = max(curve.points[len(curve.points) - 1].location[0] for curve in curves)
    places = [least + i / _TABLE * (most - least) for i in range(_TABLE + 1)]
    if len(curves) == 4:
        common = curves.pop()
        places = [mapping.evaluate(common, place) for place in places]
    channels = [[mapping.evaluate(curve, place) for place in places] for curve in curves]
    return np.array([channels * (3 // len(channels))], np.float32).transpose(0, 2, 1), least, most


def ies_text(node: bpy.types.Node) -> str:
    """What an IES Texture shows; empty where it is missing."""
    if node.mode == "INTERNAL":
        return node.ies.as_string() if node.ies else ""
    try:
        return Path(bpy.path.abspath(node.filepath, library=node.id_data.library)).read_text("utf-8", "replace")
    except OSError:
        return ""


def draw_curves(mapping: bpy.types.CurveMapping, table: bpy.types.Image, least: float, most: float, extrapolate: bool) -> None:
    """Let curves go straight between a table's entries."""
    pixels = np.empty(len(table.pixels), np.float32)
    table.pixels.foreach_get(pixels)
    row = pixels.reshape(table.size[1], table.size[0], table.channels)[table.size[1] // 2]
    places = np.linspace(least, most, len(row))
    mapping.use_clip = False
    mapping.clip_min_x = -100.0  # Blender's own table reaches at least from one end to the other, which must not cross
    mapping.clip_max_x, mapping.clip_min_x = most, least
    mapping.extend = "EXTRAPOLATED" if extrapolate else "HORIZONTAL"
    for channel, curve in enumerate(mapping.curves):
        points = np.column_stack([places, places if channel == 3 else row[:, channel]]).tolist()
        if channel == 3 or len(points) == 1:
            points = [points[0], points[-1]]
        curve.points[0].location, curve.points[len(curve.points) - 1].location = points[0], points[-1]
        for x, y in points[1:-1]:
            curve.points.new(x, y)
        for point in curve.points:
            point.handle_type = "VECTOR"
    mapping.update()


def input_of(node: bpy.types.Node, identifier: str) -> bpy.types.NodeSocket | None:
    """An input by its identifier, or None where this version has none."""
    return next((socket for socket in node.inputs if socket.identifier == identifier), None)
