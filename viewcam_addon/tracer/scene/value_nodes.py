"""The table of the nodes that make the numbers, colors and vectors that shaders' inputs are given, as data.

Scene files, the checks of them, the reading of Blender's nodes and the making of them follow from it. The names and defaults
are those of Blender's nodes, in small letters; what they compute stands in core/nodes. An input that takes a number takes a
color's luminance, and a vector's mean.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

Vector = tuple[float, float, float]

IMAGE = "an image"
"""The default of an input that names an image."""
NAME = "a name"
"""The default of an input that names what a mesh has."""
UV = "uv"
"""The default of a vector that is the mesh's UV where nothing else is given."""

POSITION = "position"
"""The default of a vector that is the place in the world where nothing else is given."""

NORMAL = "normal"
"""The default of a normal that is the surface's own, smooth one where nothing else is given."""

TANGENT = "tangent"
"""The default of a tangent that runs round the z axis of the generated coordinates where nothing else is given."""

IES = "an IES text"
"""The default of an input that is the text of an IES file."""

INCOMING = "incoming"
"""The default of a vector that is the way that light leaves in, in the world, where nothing else is given."""

OWN = (NORMAL, TANGENT)
"""The vectors that surfaces have of themselves where no node makes another."""

GENERATED = "generated"
"""The default of a vector that is the place in the mesh's texture space where nothing else is given."""

Default = float | Vector | tuple[str, ...] | bool | str

BLACK, GRAY, WHITE = (0.0, 0.0, 0.0), (0.5, 0.5, 0.5), (1.0, 1.0, 1.0)

DIMENSIONS = ("3d", "1d", "2d", "4d")
MATH = (
    "add subtract multiply divide multiply_add power logarithm sqrt inverse_sqrt absolute exponent minimum maximum less_than "
    "greater_than sign compare smooth_min smooth_max round floor ceil trunc fract modulo floored_modulo wrap snap pingpong "
    "sine cosine tangent arcsine arccosine arctangent arctan2 sinh cosh tanh radians degrees"
)
VECTOR_MATH = (
    "add subtract multiply divide multiply_add cross_product project reflect refract faceforward dot_product distance length "
    "scale normalize absolute power sign minimum maximum round floor ceil fract modulo wrap snap sine cosine tangent"
)
BLENDS = (
    "mix darken multiply burn lighten screen dodge add overlay soft_light linear_light difference exclusion subtract divide "
    "hue saturation color value"
)

COLOR_MODES = ("rgb", "hsv", "hsl")
INTERPOLATIONS = ("linear", "stepped", "smoothstep", "smootherstep")
CURVES: dict[str, Default] = {"table": IMAGE, "least": 0.0, "most": 1.0, "extrapolate": True, "factor": 1.0}
LIGHT_PATH = (
    "is_camera_ray is_shadow_ray is_diffuse_ray is_glossy_ray is_singular_ray is_reflection_ray is_transmission_ray ray_length "
    "ray_depth diffuse_depth glossy_depth transparent_depth transmission_depth"
)


@dataclass(frozen=True)
class BlenderNode:
    """A node of Blender's that makes a value.

    kind : its type.
    name : its class, without "ShaderNode".
    outputs : the identifier of Blender's output → our word for it, None where we have one output.
    inputs : our name of an input → the identifier of Blender's; where a row leaves one out it is our name as a title.
    words, flags, names, numbers : our name of an input → the property.
    spelled : the words that are not ours in capitals → Blender's.
    fixed : property → the value that it must have.
    before : inputs that older versions lack, each with the function of the version that gives the number they compute with.
    unnamed : the name that an empty one stands for.
    """

    kind: str
    name: str
    outputs: Mapping[str, str | None]
    inputs: Mapping[str, str] = field(default_factory=dict)
    words: Mapping[str, str] = field(default_factory=dict)
    flags: Mapping[str, str] = field(default_factory=dict)
    names: Mapping[str, str] = field(default_factory=dict)
    numbers: Mapping[str, str] = field(default_factory=dict)
    spelled: Mapping[str, str] = field(default_factory=dict)
    fixed: Mapping[str, str | bool] = field(default_factory=dict)
    before: Mapping[str, Callable[[tuple[int, int]], float]] = field(default_factory=dict)
    unnamed: str = ""

    @property
    def class_name(self) -> str:
        return f"ShaderNode{self.name}"

    def word(self, ours: str) -> str:
        """Blender's name of one of our words."""
        return self.spelled.get(ours, ours.upper())


@dataclass(frozen=True)
class ValueNode:
    """A row of the table.

    inputs : name → its default: a number, three, words to choose from (the first is the default), whether something holds, or
        one of those above.
    blender : the nodes of Blender's that are this one.
    """

    inputs: Mapping[str, Default]
    blender: tuple[BlenderNode, ...]


def bump_filter_width(version: tuple[int, int]) -> float:
    """The distance in pixels at which the Cycles of a version takes the slopes of heights, unless a node says another.

    Nodes can say it since 4.5.
    """
    return 0.1 if version >= (4, 4) else 1.0


def _row(inputs: Mapping[str, Default], *blender: BlenderNode) -> ValueNode:
    """A row of nodes whose `inputs` name those alone that are called otherwise."""
    return ValueNode(inputs, tuple(replace(each, inputs=_sockets(inputs, each)) for each in blender))


def _sockets(inputs: Mapping[str, Default], node: BlenderNode) -> dict[str, str]:
    """Our name of each input that is a socket of a node → its identifier."""
    sockets = {}
    for name, default in inputs.items():
        is_chosen = isinstance(default, bool) or (isinstance(default, tuple) and isinstance(default[0], str))
        if not (is_chosen or default in (IMAGE, NAME, IES) or name in node.numbers or name in _DRAWN):
            sockets[name] = node.inputs.get(name, name.replace("_", " ").title())
    return sockets


def _words(*names: str) -> dict[str, str | None]:
    return {name: name.lower().replace(" ", "_") for name in names}


def _as_they_are(*names: str) -> dict[str, str]:
    return {name: name for name in names}


_DRAWN = ("table", "least", "most")  # the curves' fields that are drawn
_COLOR: dict[str, str | None] = {"Color": None}
_FACTOR_OR_COLOR: dict[str, str | None] = {"Color": "color", "Fac": "factor"}
_TITLES = {word: word.title() for word in ("linear", "closest", "cubic")}
VERTEX_COLOR = "vertex_color"
"""Cycles' name of the color attribute that is active for rendering."""

KINDS: dict[str, ValueNode] = {
    "image": _row(
        {
            "image": IMAGE,
            "vector": UV,
            "interpolation": ("linear", "closest", "cubic"),
            "extension": ("repeat", "extend", "clip", "mirror"),
            "projection": ("flat", "sphere", "tube", "box"),
            "blend": 0.0,
            "straight": False,
            "output": ("color", "alpha"),
        },
        BlenderNode(
            "TEX_IMAGE",
            "TexImage",
            _words("Color", "Alpha"),
            words=_as_they_are("interpolation", "extension", "projection"),
            numbers={"blend": "projection_blend"},
            spelled=_TITLES,
        ),
    ),
    "environment": _row(
        {
            "image": IMAGE,
            "vector": POSITION,
            "interpolation": ("linear", "closest", "cubic"),
            "projection": ("equirectangular", "mirror_ball"),
        },
        BlenderNode(
            "TEX_ENVIRONMENT", "TexEnvironment", _COLOR, words=_as_they_are("interpolation", "projection"), spelled=_TITLES
        ),
    ),
    "texture_coordinate": _row(
        {"output": ("uv", "generated", "object", "normal", "reflection", "camera", "window")},
        BlenderNode("TEX_COORD", "TexCoord", _words("UV", "Generated", "Object", "Normal", "Reflection", "Camera", "Window")),
    ),
    "attribute": _row(
        {"name": NAME, "output": ("color", "vector", "number", "alpha", "vertex_alpha")},
        BlenderNode(
            "ATTRIBUTE",
            "Attribute",
            {"Color": "color", "Vector": "vector", "Fac": "number", "Alpha": "alpha"},
            fixed={"attribute_type": "GEOMETRY"},
            names={"name": "attribute_name"},
        ),
        BlenderNode(
            "VERTEX_COLOR",
            "VertexColor",
            {"Color": "color", "Alpha": "vertex_alpha"},  # which is 0, and not 1, where a mesh has no such attribute
            names={"name": "layer_name"},
            unnamed=VERTEX_COLOR,
        ),
        BlenderNode("UVMAP", "UVMap", {"UV": "vector"}, fixed={"from_instancer": False}, names={"name": "uv_map"}),
    ),
    "mapping": _row(
        {
            "vector": BLACK,
            "location": BLACK,
            "rotation": BLACK,
            "scale": WHITE,
            "kind": ("point", "texture", "vector", "normal"),
        },
        BlenderNode("MAPPING", "Mapping", {"Vector": None}, words={"kind": "vector_type"}),
    ),
    "vector_rotate": _row(
        {
            "vector": BLACK,
            "center": BLACK,
            "axis": (0.0, 0.0, 1.0),
            "angle": 0.0,
            "rotation": BLACK,
            "kind": ("axis_angle", "x_axis", "y_axis", "z_axis", "euler_xyz"),
            "invert": False,
        },
        BlenderNode(
            "VECTOR_ROTATE", "VectorRotate", {"Vector": None}, words={"kind": "rotation_type"}, flags=_as_they_are("invert")
        ),
    ),
    "vector_transform": _row(
        {
            "vector": GRAY,
            "kind": ("vector", "point", "normal"),
            "from": ("world", "object", "camera"),
            "to": ("object", "world", "camera"),
        },
        BlenderNode(
            "VECT_TRANSFORM",
            "VectorTransform",
            {"Vector": None},
            words={"kind": "vector_type", "from": "convert_from", "to": "convert_to"},
        ),
    ),
    "geometry": _row(
        {"output": ("position", "normal", "true_normal", "incoming", "backfacing", "tangent", "parametric")},
        BlenderNode(
            "NEW_GEOMETRY",
            "NewGeometry",
            _words("Position", "Normal", "True Normal", "Incoming", "Backfacing", "Tangent", "Parametric"),
        ),
    ),
    "ies": _row({"text": IES, "vector": INCOMING, "strength": 1.0}, BlenderNode("TEX_IES", "TexIES", {"Fac": None})),
    "tangent": _row(
        {"kind": ("radial", "uv_map"), "axis": ("z", "x", "y"), "uv": NAME},
        BlenderNode(
            "TANGENT", "Tangent", {"Tangent": None}, words={"kind": "direction_type", "axis": "axis"}, names={"uv": "uv_map"}
        ),
    ),
    "object_info": _row(
        {"output": ("location", "object_index", "material_index", "color", "alpha", "random")},
        BlenderNode(
            "OBJECT_INFO", "ObjectInfo", _words("Location", "Object Index", "Material Index", "Color", "Alpha", "Random")
        ),
    ),
    "light_path": _row(
        {"output": tuple(LIGHT_PATH.split())},
        BlenderNode("LIGHT_PATH", "LightPath", _words(*(name.replace("_", " ").title() for name in LIGHT_PATH.split()))),
    ),
    "wireframe": _row(
        {"size": 0.01, "pixel_size": False},
        BlenderNode("WIREFRAME", "Wireframe", {"Fac": None}, flags={"pixel_size": "use_pixel_size"}),
    ),
    "fresnel": _row({"ior": 1.5, "normal": NORMAL}, BlenderNode("FRESNEL", "Fresnel", {"Fac": None}, inputs={"ior": "IOR"})),
    "layer_weight": _row(
        {"blend": 0.5, "normal": NORMAL, "output": ("fresnel", "facing")},
        BlenderNode("LAYER_WEIGHT", "LayerWeight", _words("Fresnel", "Facing")),
    ),
    "normal_map": _row(
        {
            "color": (0.5, 0.5, 1.0),
            "strength": 1.0,
            "space": ("tangent", "object", "world", "blender_object", "blender_world"),
            "uv": NAME,
            "convention": ("opengl", "directx"),
        },
        BlenderNode(
            "NORMAL_MAP", "NormalMap", {"Normal": None}, words=_as_they_are("space", "convention"), names={"uv": "uv_map"}
        ),
    ),
    "bump": _row(
        {
            "height": 1.0,
            "strength": 1.0,
            "distance": 0.001,
            "filter_width": 0.1,
            "normal": NORMAL,
            "invert": False,
        },
        BlenderNode("BUMP", "Bump", {"Normal": None}, flags=_as_they_are("invert"), before={"filter_width": bump_filter_width}),
    ),
    "math": _row(
        {"operation": tuple(MATH.split()), "a": 0.5, "b": 0.5, "c": 0.5, "clamp": False},
        BlenderNode(
            "MATH",
            "Math",
            {"Value": None},
            inputs={"a": "Value", "b": "Value_001", "c": "Value_002"},
            words=_as_they_are("operation"),
            flags={"clamp": "use_clamp"},
        ),
    ),
    "vector_math": _row(
        {"operation": tuple(VECTOR_MATH.split()), "a": BLACK, "b": BLACK, "c": BLACK, "scale": 1.0},
        BlenderNode(
            "VECT_MATH",
            "VectorMath",
            {"Vector": None, "Value": None},
            inputs={"a": "Vector", "b": "Vector_001", "c": "Vector_002"},
            words=_as_they_are("operation"),
            spelled={"fract": "FRACTION"},
        ),
    ),
    "map_range": _row(
        {
            "value": 1.0,
            "from_min": 0.0,
            "from_max": 1.0,
            "to_min": 0.0,
            "to_max": 1.0,
            "steps": 4.0,
            "interpolation": INTERPOLATIONS,
            "clamp": True,
        },
        BlenderNode(
            "MAP_RANGE",
            "MapRange",
            {"Result": None},
            words={"interpolation": "interpolation_type"},
            flags=_as_they_are("clamp"),
            fixed={"data_type": "FLOAT"},
        ),
    ),
    "map_range_vector": _row(
        {
            "value": BLACK,
            "from_min": BLACK,
            "from_max": WHITE,
            "to_min": BLACK,
            "to_max": WHITE,
            "steps": (4.0, 4.0, 4.0),
            "interpolation": INTERPOLATIONS,
            "clamp": True,
        },
        BlenderNode(
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
    ),
    "clamp": _row(
        {"value": 1.0, "min": 0.0, "max": 1.0, "kind": ("minmax", "range")},
        BlenderNode("CLAMP", "Clamp", {"Result": None}, words={"kind": "clamp_type"}),
    ),
    "separate": _row(
        {"color": BLACK, "output": ("x", "y", "z")},
        BlenderNode("SEPXYZ", "SeparateXYZ", _words("X", "Y", "Z"), inputs={"color": "Vector"}),
    ),
    "combine_xyz": _row({"x": 0.0, "y": 0.0, "z": 0.0}, BlenderNode("COMBXYZ", "CombineXYZ", {"Vector": None})),
    "separate_color": _row(
        {"color": (0.8, 0.8, 0.8), "mode": COLOR_MODES, "output": ("x", "y", "z")},
        BlenderNode("SEPARATE_COLOR", "SeparateColor", {"Red": "x", "Green": "y", "Blue": "z"}, words=_as_they_are("mode")),
    ),
    "combine_color": _row(
        {"x": 0.0, "y": 0.0, "z": 0.0, "mode": COLOR_MODES},
        BlenderNode(
            "COMBINE_COLOR", "CombineColor", _COLOR, inputs={"x": "Red", "y": "Green", "z": "Blue"}, words=_as_they_are("mode")
        ),
    ),
    "mix_color": _row(
        {
            "factor": 0.5,
            "a": GRAY,
            "b": GRAY,
            "blend": tuple(BLENDS.split()),
            "clamp_factor": True,
            "clamp_result": False,
        },
        BlenderNode(
            "MIX",
            "Mix",
            {"Result_Color": None},
            inputs={"factor": "Factor_Float", "a": "A_Color", "b": "B_Color"},
            words={"blend": "blend_type"},
            flags=_as_they_are("clamp_factor", "clamp_result"),
            fixed={"data_type": "RGBA"},
        ),
        BlenderNode(
            "MIX_RGB",
            "MixRGB",
            _COLOR,
            inputs={"factor": "Fac", "a": "Color1", "b": "Color2"},
            words={"blend": "blend_type"},
            flags={"clamp_result": "use_clamp"},
        ),
    ),
    "mix_number": _row(
        {"factor": 0.5, "a": 0.0, "b": 0.0, "clamp_factor": True},
        BlenderNode(
            "MIX",
            "Mix",
            {"Result_Float": None},
            inputs={"factor": "Factor_Float", "a": "A_Float", "b": "B_Float"},
            flags=_as_they_are("clamp_factor"),
            fixed={"data_type": "FLOAT"},
        ),
    ),
    "mix_vector": _row(
        {"factor": 0.5, "a": BLACK, "b": BLACK, "clamp_factor": True},
        BlenderNode(
            "MIX",
            "Mix",
            {"Result_Vector": None},
            inputs={"factor": "Factor_Float", "a": "A_Vector", "b": "B_Vector"},
            flags=_as_they_are("clamp_factor"),
            fixed={"data_type": "VECTOR", "factor_mode": "UNIFORM"},
        ),
    ),
    "mix_components": _row(
        {"factor": GRAY, "a": BLACK, "b": BLACK, "clamp_factor": True},
        BlenderNode(
            "MIX",
            "Mix",
            {"Result_Vector": None},
            inputs={"factor": "Factor_Vector", "a": "A_Vector", "b": "B_Vector"},
            flags=_as_they_are("clamp_factor"),
            fixed={"data_type": "VECTOR", "factor_mode": "NON_UNIFORM"},
        ),
    ),
    "rgb_curves": _row({"color": BLACK, **CURVES}, BlenderNode("CURVE_RGB", "RGBCurve", _COLOR, inputs={"factor": "Fac"})),
    "vector_curves": _row(
        {"vector": BLACK, **CURVES}, BlenderNode("CURVE_VEC", "VectorCurve", {"Vector": None}, inputs={"factor": "Fac"})
    ),
    "float_curve": _row({"value": 1.0, **CURVES}, BlenderNode("CURVE_FLOAT", "FloatCurve", {"Value": None})),
    "blackbody": _row({"temperature": 6500.0}, BlenderNode("BLACKBODY", "Blackbody", _COLOR)),
    "wavelength": _row({"wavelength": 500.0}, BlenderNode("WAVELENGTH", "Wavelength", _COLOR)),
    "gamma": _row({"color": WHITE, "gamma": 1.0}, BlenderNode("GAMMA", "Gamma", _COLOR)),
    "bright_contrast": _row(
        {"color": WHITE, "bright": 0.0, "contrast": 0.0}, BlenderNode("BRIGHTCONTRAST", "BrightContrast", _COLOR)
    ),
    "hue_saturation": _row(
        {"hue": 0.5, "saturation": 1.0, "value": 1.0, "factor": 1.0, "color": (0.8, 0.8, 0.8)},
        BlenderNode("HUE_SAT", "HueSaturation", _COLOR, inputs={"factor": "Fac"}),
    ),
    "invert": _row({"factor": 1.0, "color": BLACK}, BlenderNode("INVERT", "Invert", _COLOR, inputs={"factor": "Fac"})),
    "rgb_to_bw": _row({"color": GRAY}, BlenderNode("RGBTOBW", "RGBToBW", {"Val": None})),
    "noise": _row(
        {
            "vector": GENERATED,
            "w": 0.0,
            "scale": 5.0,
            "detail": 2.0,
            "roughness": 0.5,
            "lacunarity": 2.0,
            "offset": 0.0,
            "gain": 1.0,
            "distortion": 0.0,
            "dimensions": DIMENSIONS,
            "kind": ("fbm", "multifractal", "hybrid_multifractal", "ridged_multifractal", "hetero_terrain"),
            "normalize": True,
            "output": ("factor", "color"),
        },
        BlenderNode(
            "TEX_NOISE",
            "TexNoise",
            _FACTOR_OR_COLOR,
            words={"dimensions": "noise_dimensions", "kind": "noise_type"},
            flags=_as_they_are("normalize"),
        ),
    ),
    "white_noise": _row(
        {"vector": BLACK, "w": 0.0, "dimensions": DIMENSIONS, "output": ("value", "color")},
        BlenderNode("TEX_WHITE_NOISE", "TexWhiteNoise", _words("Value", "Color"), words={"dimensions": "noise_dimensions"}),
    ),
    "checker": _row(
        {
            "vector": GENERATED,
            "color1": (0.8, 0.8, 0.8),
            "color2": (0.2, 0.2, 0.2),
            "scale": 5.0,
            "output": ("color", "factor"),
        },
        BlenderNode("TEX_CHECKER", "TexChecker", _FACTOR_OR_COLOR),
    ),
    "gradient": _row(
        {
            "vector": GENERATED,
            "kind": ("linear", "quadratic", "easing", "diagonal", "spherical", "quadratic_sphere", "radial"),
        },
        BlenderNode("TEX_GRADIENT", "TexGradient", {"Color": None, "Fac": None}, words={"kind": "gradient_type"}),
    ),
    "wave": _row(
        {
            "vector": GENERATED,
            "scale": 5.0,
            "distortion": 0.0,
            "detail": 2.0,
            "detail_scale": 1.0,
            "detail_roughness": 0.5,
            "phase_offset": 0.0,
            "kind": ("bands", "rings"),
            "bands": ("x", "y", "z", "diagonal"),
            "rings": ("x", "y", "z", "spherical"),
            "profile": ("sin", "saw", "tri"),
        },
        BlenderNode(
            "TEX_WAVE",
            "TexWave",
            {"Color": None, "Fac": None},
            words={"kind": "wave_type", "bands": "bands_direction", "rings": "rings_direction", "profile": "wave_profile"},
        ),
    ),
    "magic": _row(
        {"vector": GENERATED, "scale": 5.0, "distortion": 1.0, "depth": 2.0, "output": ("color", "factor")},
        BlenderNode("TEX_MAGIC", "TexMagic", _FACTOR_OR_COLOR, numbers={"depth": "turbulence_depth"}),
    ),
    "brick": _row(
        {
            "vector": GENERATED,
            "color1": (0.8, 0.8, 0.8),
            "color2": (0.2, 0.2, 0.2),
            "mortar": BLACK,
            "scale": 5.0,
            "mortar_size": 0.02,
            "mortar_smooth": 0.1,
            "bias": 0.0,
            "brick_width": 0.5,
            "row_height": 0.25,
            "offset": 0.5,
            "offset_frequency": 2.0,
            "squash": 1.0,
            "squash_frequency": 2.0,
            "output": ("color", "factor"),
        },
        BlenderNode(
            "TEX_BRICK",
            "TexBrick",
            _FACTOR_OR_COLOR,
            numbers=_as_they_are("offset", "offset_frequency", "squash", "squash_frequency"),
        ),
    ),
    "voronoi": _row(
        {
            "vector": GENERATED,
            "w": 0.0,
            "scale": 5.0,
            "detail": 0.0,
            "roughness": 0.5,
            "lacunarity": 2.0,
            "smoothness": 1.0,
            "exponent": 0.5,
            "randomness": 1.0,
            "dimensions": DIMENSIONS,
            "feature": ("f1", "f2", "smooth_f1", "distance_to_edge", "n_sphere_radius"),
            "metric": ("euclidean", "manhattan", "chebychev", "minkowski"),
            "normalize": False,
            "output": ("distance", "color", "position", "w", "radius"),
        },
        BlenderNode(
            "TEX_VORONOI",
            "TexVoronoi",
            _words("Distance", "Color", "Position", "W", "Radius"),
            words={"dimensions": "voronoi_dimensions", "feature": "feature", "metric": "distance"},
            flags=_as_they_are("normalize"),
        ),
    ),
}
"""Our name of each → what it is; of several nodes of Blender's that are one to us the first is what is made."""


def attributes_of(kind: str, value_of: Callable[[str], Any]) -> Iterator[str]:
    """The names of the attributes that a node asks meshes for.

    kind : its type.
    value_of : input → its value.
    """
    if kind == "attribute":
        yield value_of("name")
    if kind == "normal_map" and value_of("space") == "tangent" and value_of("uv"):
        yield value_of("uv")
    if kind == "tangent":
        yield value_of("uv") if value_of("kind") == "uv_map" else "generated"
    if kind in ("texture_coordinate", "geometry") and value_of("output") in ("generated", "tangent"):
        yield "generated"
