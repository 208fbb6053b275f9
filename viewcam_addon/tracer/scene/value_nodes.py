"""Nodes that make the numbers, colors and vectors that shaders' inputs are given, as data.

The names and defaults are those of Blender's nodes, in small letters; what they compute stands in core/nodes. An input that
takes a number takes a color's luminance, and a vector's mean.
"""

from collections.abc import Callable, Iterator, Mapping
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

BLACK, GREY, WHITE = (0.0, 0.0, 0.0), (0.5, 0.5, 0.5), (1.0, 1.0, 1.0)

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

# Input → its default: a number, three, words to choose from (the first is the default), whether something holds, or one of
# those above.
KINDS: dict[str, Mapping[str, Default]] = {
    "image": {
        "image": IMAGE,
        "vector": UV,
        "interpolation": ("linear", "closest", "cubic"),
        "extension": ("repeat", "extend", "clip", "mirror"),
        "projection": ("flat", "sphere", "tube", "box"),
        "blend": 0.0,
        "straight": False,
        "output": ("color", "alpha"),
    },
    "environment": {
        "image": IMAGE,
        "vector": POSITION,
        "interpolation": ("linear", "closest", "cubic"),
        "projection": ("equirectangular", "mirror_ball"),
    },
    "texture_coordinate": {"output": ("uv", "generated", "object", "normal", "reflection", "camera", "window")},
    "attribute": {"name": NAME, "output": ("color", "vector", "number", "alpha")},
    "mapping": {
        "vector": BLACK,
        "location": BLACK,
        "rotation": BLACK,
        "scale": WHITE,
        "kind": ("point", "texture", "vector", "normal"),
    },
    "vector_rotate": {
        "vector": BLACK,
        "center": BLACK,
        "axis": (0.0, 0.0, 1.0),
        "angle": 0.0,
        "rotation": BLACK,
        "kind": ("axis_angle", "x_axis", "y_axis", "z_axis", "euler_xyz"),
        "invert": False,
    },
    "vector_transform": {
        "vector": GREY,
        "kind": ("vector", "point", "normal"),
        "from": ("world", "object", "camera"),
        "to": ("object", "world", "camera"),
    },
    "geometry": {"output": ("position", "normal", "true_normal", "incoming", "backfacing", "tangent", "parametric")},
    "ies": {"text": IES, "vector": INCOMING, "strength": 1.0},
    "tangent": {"kind": ("radial", "uv_map"), "axis": ("z", "x", "y"), "uv": NAME},
    "object_info": {"output": ("location", "object_index", "material_index", "color", "alpha", "random")},
    "light_path": {"output": tuple(LIGHT_PATH.split())},
    "wireframe": {"size": 0.01, "pixel_size": False},
    "fresnel": {"ior": 1.5, "normal": NORMAL},
    "layer_weight": {"blend": 0.5, "normal": NORMAL, "output": ("fresnel", "facing")},
    "normal_map": {
        "color": (0.5, 0.5, 1.0),
        "strength": 1.0,
        "space": ("tangent", "object", "world", "blender_object", "blender_world"),
        "uv": NAME,
        "convention": ("opengl", "directx"),
    },
    "bump": {
        "height": 1.0,
        "strength": 1.0,
        "distance": 0.001,
        "filter_width": 0.1,
        "normal": NORMAL,
        "invert": False,
    },
    "math": {"operation": tuple(MATH.split()), "a": 0.5, "b": 0.5, "c": 0.5, "clamp": False},
    "vector_math": {"operation": tuple(VECTOR_MATH.split()), "a": BLACK, "b": BLACK, "c": BLACK, "scale": 1.0},
    "map_range": {
        "value": 1.0,
        "from_min": 0.0,
        "from_max": 1.0,
        "to_min": 0.0,
        "to_max": 1.0,
        "steps": 4.0,
        "interpolation": INTERPOLATIONS,
        "clamp": True,
    },
    "map_range_vector": {
        "value": BLACK,
        "from_min": BLACK,
        "from_max": WHITE,
        "to_min": BLACK,
        "to_max": WHITE,
        "steps": (4.0, 4.0, 4.0),
        "interpolation": INTERPOLATIONS,
        "clamp": True,
    },
    "clamp": {"value": 1.0, "min": 0.0, "max": 1.0, "kind": ("minmax", "range")},
    "separate": {"color": BLACK, "output": ("x", "y", "z")},
    "combine_xyz": {"x": 0.0, "y": 0.0, "z": 0.0},
    "separate_color": {"color": (0.8, 0.8, 0.8), "mode": COLOR_MODES, "output": ("x", "y", "z")},
    "combine_color": {"x": 0.0, "y": 0.0, "z": 0.0, "mode": COLOR_MODES},
    "mix_color": {
        "factor": 0.5,
        "a": GREY,
        "b": GREY,
        "blend": tuple(BLENDS.split()),
        "clamp_factor": True,
        "clamp_result": False,
    },
    "mix_number": {"factor": 0.5, "a": 0.0, "b": 0.0, "clamp_factor": True},
    "mix_vector": {"factor": 0.5, "a": BLACK, "b": BLACK, "clamp_factor": True},
    "mix_components": {"factor": GREY, "a": BLACK, "b": BLACK, "clamp_factor": True},
    "rgb_curves": {"color": BLACK, **CURVES},
    "vector_curves": {"vector": BLACK, **CURVES},
    "float_curve": {"value": 1.0, **CURVES},
    "blackbody": {"temperature": 6500.0},
    "wavelength": {"wavelength": 500.0},
    "gamma": {"color": WHITE, "gamma": 1.0},
    "bright_contrast": {"color": WHITE, "bright": 0.0, "contrast": 0.0},
    "hue_saturation": {"hue": 0.5, "saturation": 1.0, "value": 1.0, "factor": 1.0, "color": (0.8, 0.8, 0.8)},
    "invert": {"factor": 1.0, "color": BLACK},
    "rgb_to_bw": {"color": GREY},
    "noise": {
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
    "white_noise": {"vector": BLACK, "w": 0.0, "dimensions": DIMENSIONS, "output": ("value", "color")},
    "checker": {
        "vector": GENERATED,
        "color1": (0.8, 0.8, 0.8),
        "color2": (0.2, 0.2, 0.2),
        "scale": 5.0,
        "output": ("color", "factor"),
    },
    "gradient": {
        "vector": GENERATED,
        "kind": ("linear", "quadratic", "easing", "diagonal", "spherical", "quadratic_sphere", "radial"),
    },
    "wave": {
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
    "magic": {"vector": GENERATED, "scale": 5.0, "distortion": 1.0, "depth": 2.0, "output": ("color", "factor")},
    "brick": {
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
    "voronoi": {
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
}


def attributes_of(kind: str, value_of: Callable[[str], Any]) -> Iterator[str]:
    """The names of the attributes that a node asks meshes for. kind : its type. value_of : input → its value."""
    if kind == "attribute":
        yield value_of("name")
    if kind == "normal_map" and value_of("space") == "tangent" and value_of("uv"):
        yield value_of("uv")
    if kind == "tangent":
        yield value_of("uv") if value_of("kind") == "uv_map" else "generated"
    if kind in ("texture_coordinate", "geometry") and value_of("output") in ("generated", "tangent"):
        yield "generated"
