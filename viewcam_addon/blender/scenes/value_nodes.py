"""The tracer's nodes that make values (tracer/scene/value_nodes.py) as Blender has them, to be read and to be made again."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...tracer.scene.shader_nodes import KINDS
from ...tracer.scene.value_nodes import IES, IMAGE, LIGHT_PATH, NAME
from .cycles_attributes import VERTEX_COLOR
from .nodes import Output


@dataclass(frozen=True)
class Value:
    """A type of node as Blender has it.

    kind : its type; class_name : its class. inputs : ours → the identifier of theirs. words, flags, names, numbers : ours → the
    property. outputs : the identifier of theirs → our word for it, None where we have one output. fixed : property → what it
    must be. before : of inputs that older versions lack, what these compute with. unnamed : what an empty name stands for.
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
    unnamed: str = ""


def _words(*names: str) -> dict[str, str | None]:
    return {name: name.lower().replace(" ", "_") for name in names}


def _as_they_are(*names: str) -> dict[str, str]:
    return {name: name for name in names}


def _value(
    ours: str, kind: str, name: str, outputs: dict[str, str | None], *, inputs: dict[str, str] | None = None, **more: Any
) -> tuple[str, Value]:
    """inputs : whose identifiers are others than our names, as titles. more : of `Value`."""
    identifiers = {}
    for each, default in KINDS[ours].inputs.items():
        is_no_socket = isinstance(default, bool) or (isinstance(default, tuple) and isinstance(default[0], str))
        if not (is_no_socket or default in (IMAGE, NAME, IES) or each in more.get("numbers", ()) or each in _OF_CURVES):
            identifiers[each] = (inputs or {}).get(each, each.replace("_", " ").title())
    return ours, Value(kind, f"ShaderNode{name}", identifiers, outputs, **more)


_OF_CURVES = ("table", "least", "most")  # which are no sockets, but what is drawn
_COLOR: dict[str, str | None] = {"Color": None}
_FACTOR_OR_COLOR: dict[str, str | None] = {"Color": "color", "Fac": "factor"}
VALUES: tuple[tuple[str, Value], ...] = (
    _value(
        "image",
        "TEX_IMAGE",
        "TexImage",
        _words("Color", "Alpha"),
        words=_as_they_are("interpolation", "extension", "projection"),
        numbers={"blend": "projection_blend"},
    ),
    _value("environment", "TEX_ENVIRONMENT", "TexEnvironment", _COLOR, words=_as_they_are("interpolation", "projection")),
    _value(
        "texture_coordinate",
        "TEX_COORD",
        "TexCoord",
        _words("UV", "Generated", "Object", "Normal", "Reflection", "Camera", "Window"),
    ),
    _value(
        "attribute",
        "ATTRIBUTE",
        "Attribute",
        {"Color": "color", "Vector": "vector", "Fac": "number", "Alpha": "alpha"},
        fixed={"attribute_type": "GEOMETRY"},
        names={"name": "attribute_name"},
    ),
    _value(
        "attribute",
        "VERTEX_COLOR",
        "VertexColor",
        _words("Color", "Alpha"),
        names={"name": "layer_name"},
        unnamed=VERTEX_COLOR,
    ),
    _value("attribute", "UVMAP", "UVMap", {"UV": "vector"}, fixed={"from_instancer": False}, names={"name": "uv_map"}),
    _value("mapping", "MAPPING", "Mapping", {"Vector": None}, words={"kind": "vector_type"}),
    _value(
        "geometry",
        "NEW_GEOMETRY",
        "NewGeometry",
        _words("Position", "Normal", "True Normal", "Incoming", "Backfacing", "Tangent", "Parametric"),
    ),
    _value(
        "vector_rotate",
        "VECTOR_ROTATE",
        "VectorRotate",
        {"Vector": None},
        words={"kind": "rotation_type"},
        flags=_as_they_are("invert"),
    ),
    _value(
        "vector_transform",
        "VECT_TRANSFORM",
        "VectorTransform",
        {"Vector": None},
        words={"kind": "vector_type", "from": "convert_from", "to": "convert_to"},
    ),
    _value("light_path", "LIGHT_PATH", "LightPath", _words(*(name.replace("_", " ").title() for name in LIGHT_PATH.split()))),
    _value(
        "object_info",
        "OBJECT_INFO",
        "ObjectInfo",
        _words("Location", "Object Index", "Material Index", "Color", "Alpha", "Random"),
    ),
    _value(
        "tangent",
        "TANGENT",
        "Tangent",
        {"Tangent": None},
        words={"kind": "direction_type", "axis": "axis"},
        names={"uv": "uv_map"},
    ),
    _value(
        "normal_map",
        "NORMAL_MAP",
        "NormalMap",
        {"Normal": None},
        words=_as_they_are("space", "convention"),
        names={"uv": "uv_map"},
    ),
    _value("bump", "BUMP", "Bump", {"Normal": None}, flags=_as_they_are("invert"), before={"filter_width": 1.0}),
    _value("ies", "TEX_IES", "TexIES", {"Fac": None}),
    _value("wireframe", "WIREFRAME", "Wireframe", {"Fac": None}, flags={"pixel_size": "use_pixel_size"}),
    _value("fresnel", "FRESNEL", "Fresnel", {"Fac": None}, inputs={"ior": "IOR"}),
    _value("layer_weight", "LAYER_WEIGHT", "LayerWeight", _words("Fresnel", "Facing")),
    _value(
        "math",
        "MATH",
        "Math",
        {"Value": None},
        inputs={"a": "Value", "b": "Value_001", "c": "Value_002"},
        words=_as_they_are("operation"),
        flags={"clamp": "use_clamp"},
    ),
    _value(
        "vector_math",
        "VECT_MATH",
        "VectorMath",
        {"Vector": None, "Value": None},
        inputs={"a": "Vector", "b": "Vector_001", "c": "Vector_002"},
        words=_as_they_are("operation"),
    ),
    _value(
        "map_range",
        "MAP_RANGE",
        "MapRange",
        {"Result": None},
        words={"interpolation": "interpolation_type"},
        flags=_as_they_are("clamp"),
        fixed={"data_type": "FLOAT"},
    ),
    _value(
        "map_range_vector",
        "MAP_RANGE",
        "MapRange",
        {"Vector": None},
        inputs={
            "value": "Vector",
            "from_min": "From_Min_FLOAT3",
            "from_max": "From_Max_FLOAT3",
            "to_min": "To_Min_FLOAT3",
            "to_max": "To_Max_FLOAT3",
            "steps": "Steps_FLOAT3",
        },
        words={"interpolation": "interpolation_type"},
        flags=_as_they_are("clamp"),
        fixed={"data_type": "FLOAT_VECTOR"},
    ),
    _value("clamp", "CLAMP", "Clamp", {"Result": None}, words={"kind": "clamp_type"}),
    _value("separate", "SEPXYZ", "SeparateXYZ", _words("X", "Y", "Z"), inputs={"color": "Vector"}),
    _value(
        "separate_color", "SEPARATE_COLOR", "SeparateColor", {"Red": "x", "Green": "y", "Blue": "z"}, words=_as_they_are("mode")
    ),
    _value("combine_xyz", "COMBXYZ", "CombineXYZ", {"Vector": None}),
    _value(
        "combine_color",
        "COMBINE_COLOR",
        "CombineColor",
        _COLOR,
        inputs={"x": "Red", "y": "Green", "z": "Blue"},
        words=_as_they_are("mode"),
    ),
    _value(
        "mix_color",
        "MIX",
        "Mix",
        {"Result_Color": None},
        inputs={"factor": "Factor_Float", "a": "A_Color", "b": "B_Color"},
        words={"blend": "blend_type"},
        flags=_as_they_are("clamp_factor", "clamp_result"),
        fixed={"data_type": "RGBA"},
    ),
    _value(
        "mix_color",
        "MIX_RGB",
        "MixRGB",
        _COLOR,
        inputs={"factor": "Fac", "a": "Color1", "b": "Color2"},
        words={"blend": "blend_type"},
        flags={"clamp_result": "use_clamp"},
    ),
    _value(
        "mix_number",
        "MIX",
        "Mix",
        {"Result_Float": None},
        inputs={"factor": "Factor_Float", "a": "A_Float", "b": "B_Float"},
        flags=_as_they_are("clamp_factor"),
        fixed={"data_type": "FLOAT"},
    ),
    _value(
        "mix_vector",
        "MIX",
        "Mix",
        {"Result_Vector": None},
        inputs={"factor": "Factor_Float", "a": "A_Vector", "b": "B_Vector"},
        flags=_as_they_are("clamp_factor"),
        fixed={"data_type": "VECTOR", "factor_mode": "UNIFORM"},
    ),
    _value(
        "mix_components",
        "MIX",
        "Mix",
        {"Result_Vector": None},
        inputs={"factor": "Factor_Vector", "a": "A_Vector", "b": "B_Vector"},
        flags=_as_they_are("clamp_factor"),
        fixed={"data_type": "VECTOR", "factor_mode": "NON_UNIFORM"},
    ),
    _value("rgb_curves", "CURVE_RGB", "RGBCurve", _COLOR, inputs={"factor": "Fac"}),
    _value("vector_curves", "CURVE_VEC", "VectorCurve", {"Vector": None}, inputs={"factor": "Fac"}),
    _value("float_curve", "CURVE_FLOAT", "FloatCurve", {"Value": None}),
    _value("blackbody", "BLACKBODY", "Blackbody", _COLOR),
    _value("wavelength", "WAVELENGTH", "Wavelength", _COLOR),
    _value("gamma", "GAMMA", "Gamma", _COLOR),
    _value("bright_contrast", "BRIGHTCONTRAST", "BrightContrast", _COLOR),
    _value("hue_saturation", "HUE_SAT", "HueSaturation", _COLOR, inputs={"factor": "Fac"}),
    _value("invert", "INVERT", "Invert", _COLOR, inputs={"factor": "Fac"}),
    _value(
        "noise",
        "TEX_NOISE",
        "TexNoise",
        _FACTOR_OR_COLOR,
        words={"dimensions": "noise_dimensions", "kind": "noise_type"},
        flags=_as_they_are("normalize"),
    ),
    _value(
        "white_noise", "TEX_WHITE_NOISE", "TexWhiteNoise", _words("Value", "Color"), words={"dimensions": "noise_dimensions"}
    ),
    _value("checker", "TEX_CHECKER", "TexChecker", _FACTOR_OR_COLOR),
    _value("gradient", "TEX_GRADIENT", "TexGradient", {"Color": None, "Fac": None}, words={"kind": "gradient_type"}),
    _value(
        "wave",
        "TEX_WAVE",
        "TexWave",
        {"Color": None, "Fac": None},
        words={"kind": "wave_type", "bands": "bands_direction", "rings": "rings_direction", "profile": "wave_profile"},
    ),
    _value("magic", "TEX_MAGIC", "TexMagic", _FACTOR_OR_COLOR, numbers={"depth": "turbulence_depth"}),
    _value(
        "brick",
        "TEX_BRICK",
        "TexBrick",
        _FACTOR_OR_COLOR,
        numbers=_as_they_are("offset", "offset_frequency", "squash", "squash_frequency"),
    ),
    _value(
        "voronoi",
        "TEX_VORONOI",
        "TexVoronoi",
        _words("Distance", "Color", "Position", "W", "Radius"),
        words={"dimensions": "voronoi_dimensions", "feature": "feature", "metric": "distance"},
        flags=_as_they_are("normalize"),
    ),
    _value("rgb_to_bw", "RGBTOBW", "RGBToBW", {"Val": None}),
)
"""Our name of each value, and the value; of what is one thing to us the first is made."""

# Blender's words, where they are others than ours in capitals.
_WORDS = {
    **{(ours, word): word.title() for ours in ("image", "environment") for word in ("linear", "closest", "cubic")},
    ("vector_math", "fract"): "FRACTION",
}


def word_of(ours: str, word: str) -> str:
    """Blender's name of one of the words of a node."""
    return _WORDS.get((ours, word), word.upper())


def value_of(output: Output) -> tuple[str, Value] | None:
    """Our name and value of an output's node, or None where that is not modeled."""
    for ours, value in VALUES:
        is_it = value.kind == output.node.type and output.socket.identifier in value.outputs
        if is_it and all(getattr(output.node, name) == wanted for name, wanted in value.fixed.items()):
            return ours, value
    return None


def given_words(output: Output, ours: str, value: Value) -> dict[str, object] | str:
    """The words and flags of a node; or, where one is not modeled, that clause."""
    found: dict[str, object] = {name: bool(getattr(output.node, theirs)) for name, theirs in value.flags.items()}
    found |= {name: getattr(output.node, theirs) or value.unnamed for name, theirs in value.names.items()}
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
    """The text of an IES Texture; empty where it is missing."""
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
