"""Blender's world as the tracer's: one color, an equirectangular image, or what stands in for what is not modeled."""

from dataclasses import replace
from typing import Any, NamedTuple

import bpy

from ...tracer.scene.lamps import Sun, World
from ...tracer.scene.materials import Picture
from .. import versions
from ..temporary_settings import Overrides
from . import images, nodes, shaders, value_nodes, world_image
from .ledger import Ledger
from .nodes import Input, Output
from .shaders import RGB

_RAYS = ("camera", "diffuse", "glossy", "transmission")


def shown_world(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> bpy.types.World | None:
    """The world that a view layer is rendered with, if any."""
    return (view_layer.world_override or scene.world) if view_layer.use_sky else None


def world_of(
    scene: bpy.types.Scene,
    world: bpy.types.World | None,
    ledger: Ledger,
    pictures: dict[str, Picture] | None = None,
    render: bool = True,
) -> tuple[World, tuple[Sun, ...]]:
    """The tracer's world, and suns that are part of it. What it approximates, Cycles is shown likewise.

    scene : the evaluated scene.
    pictures : receives its images.
    render : true to let another Blender render what is not modeled, which takes seconds; else what is returned stands for that.
    """
    if world is None:
        return World(), ()
    radiance, wrapped, reasons = _read(world, camera=False)
    backdrop, wrapped_there, reasons_there = _read(world, camera=True)
    reasons += [reason for reason in reasons_there if reason not in reasons]
    if _has_volume(world):
        ledger.note(world.name, "approximated", "the world has a volume, which is left out on both sides")
        ledger.call_for_cycles(world.original, _leave_out_volume)
    nodes.leave_out_circles(versions.node_tree(world), ledger, world.name, "the world has")
    missing = images.missing(versions.node_tree(world))
    for each in missing:
        ledger.note(world.name, "exported", f"the world {each}")
    original = world.original
    for owner, name, value in (
        (original.cycles, "max_bounces", 1024),
        (original.cycles, "is_caustics_light", False),
        (original.cycles, "use_shadows", True),
    ):
        if hasattr(owner, name):  # versions know fewer of them
            ledger.set_for_cycles(owner, name, value, stands_in=False)
    hidden_from = frozenset(ray for ray in _RAYS if not getattr(world.cycles_visibility, ray))
    rendered = _rendered(scene, world, reasons, ledger, render) if reasons else None
    if rendered:
        if pictures is not None:
            pictures |= rendered.pictures
        return replace(rendered.world, hidden_from=hidden_from), rendered.suns
    # Cycles samples the light of an image, even of one that is missing, which no constant world needs.
    is_constant = wrapped is None and (backdrop, wrapped_there) == (radiance, None)
    if reasons or (missing and is_constant):
        ledger.call_for_cycles(original, _make_constant, radiance)
    if reasons:
        return World(radiance, hidden_from), ()
    seen = None if (radiance, wrapped) == (backdrop, wrapped_there) else _world(backdrop, wrapped_there, pictures)
    return replace(_world(radiance, wrapped, pictures), hidden_from=hidden_from, backdrop=seen), ()


def _rendered(
    scene: bpy.types.Scene, world: bpy.types.World, reasons: list[str], ledger: Ledger, render: bool
) -> world_image.Rendered | None:
    """The image of a world that is no node of ours, which Cycles renders and both sides show; None where a constant one must
    stand in.

    Only a sun is another thing then than in the world: its disc shines evenly.
    """
    obstacle = world_image.obstacle(world)
    result = None
    if obstacle is None:
        result = world_image.rendered(world, scene) if render else world_image.Rendered(World((1.0, 1.0, 1.0)), (), {})
        obstacle = None if result else "can't be rendered by another Blender"
    if result is None:
        for reason in dict.fromkeys((*reasons, obstacle)):
            ledger.note(world.name, "approximated", f"the world {reason}, and a constant one stands in")
        return None
    width = world_image.width(world)
    image = f"an image of it, {width} × {width // 2} pixels," if result.pictures else "the color"
    image = f"both sides show {image} that Cycles renders"
    if result.suns:
        image += ", and lamps that shine evenly for its suns"
    for reason in reasons:
        ledger.note(world.name, "approximated" if result.suns else "exported", f"the world {reason}: {image}")
    if world_image.tells_rays_apart(world):
        ledger.note(
            world.name, "approximated", "the world tells kinds of rays apart, and all but the camera's see what diffuse ones do"
        )
    hidden = frozenset(ray for ray in _RAYS if not getattr(world.cycles_visibility, ray))
    if scene.render.film_transparent:
        hidden |= {"camera"}
    result = replace(result, suns=tuple(replace(sun, hidden_from=sun.hidden_from | hidden) for sun in result.suns))
    is_another = bool(result.suns) or world_image.tells_rays_apart(world)
    ledger.call_for_cycles(world.original, world_image.show, scene.original, result, stands_in=is_another)
    return result


def _world(radiance: RGB, wrapped: "_Wrapped | None", pictures: dict[str, Picture] | None) -> World:
    if wrapped is None:
        return World(radiance)
    if pictures is not None and wrapped.image.name_full not in pictures:
        pictures[wrapped.image.name_full] = images.picture_of(wrapped.image)
    return World(radiance, image=wrapped.image.name_full, closest=wrapped.closest, rotation=wrapped.rotation)


class _Wrapped(NamedTuple):
    """An image that is wrapped around the world, as World has it."""

    image: bpy.types.Image
    closest: bool
    rotation: tuple[float, float, float]


def _has_volume(world: bpy.types.World) -> bool:
    tree = versions.node_tree(world)
    output = tree and tree.get_output_node("CYCLES")
    return output is not None and output.inputs["Volume"].is_linked


def _leave_out_volume(overrides: Overrides, world: bpy.types.World) -> None:
    before = world.node_tree.get_output_node("CYCLES").inputs["Surface"]
    output, adder = nodes.override_output(overrides, world.node_tree, "ShaderNodeOutputWorld")
    for link in before.links:
        adder.link(link.from_socket, output.inputs["Surface"])


def _make_constant(overrides: Overrides, world: bpy.types.World, radiance: RGB) -> None:
    output, adder = nodes.override_output(overrides, world.node_tree, "ShaderNodeOutputWorld")
    background = adder.add("ShaderNodeBackground", Color=(*radiance, 1.0), Strength=1.0)
    adder.link(background.outputs[0], output.inputs["Surface"])


# A node that mixes, and what of it must be so → its factor and both sides.
_MIXES: tuple[tuple[str, dict[str, Any], tuple[str, ...]], ...] = (
    ("MIX_SHADER", {}, ("Fac", "Shader", "Shader_001")),
    ("MIX_RGB", {"blend_type": "MIX", "use_clamp": False}, ("Fac", "Color1", "Color2")),
    ("MIX", {"data_type": "RGBA", "blend_type": "MIX", "clamp_result": False}, ("Factor_Float", "A_Color", "B_Color")),
    ("MIX", {"data_type": "FLOAT"}, ("Factor_Float", "A_Float", "B_Float")),
)


def _unmixed(node_input: Input, camera: bool) -> Input:
    """An input or, where a mixture feeds it that is but one side of it to the camera, or to other rays, that side."""
    source = nodes.source(node_input)
    if not isinstance(source, Output):
        return node_input
    for kind, wanted, names in _MIXES:
        if source.node.type != kind or any(getattr(source.node, name) != value for name, value in wanted.items()):
            continue
        factor, *sides = (Input(value_nodes.input_of(source.node, name), source.groups) for name in names)
        asked = nodes.source(factor)
        share = shaders.constant_number_of(factor)
        if isinstance(asked, Output) and (asked.node.type, asked.socket.name) == ("LIGHT_PATH", "Is Camera Ray"):
            share = float(camera)
        if share in (0.0, 1.0):
            return _unmixed(sides[share == 1.0], camera)
    return node_input


def _read(world: bpy.types.World, camera: bool) -> tuple[RGB, _Wrapped | None, list[str]]:
    """The radiance, the image that it is multiplied by, and why it is only a mean. camera : to the camera, or to other rays."""
    tree = versions.node_tree(world)
    if tree is None:
        return tuple(world.color), None, []
    output = tree.get_output_node("CYCLES")
    if output is None:
        return (0.0, 0.0, 0.0), None, []
    reasons: list[str] = []
    surface = nodes.source(_unmixed(Input(output.inputs["Surface"]), camera))
    if not isinstance(surface, Output):
        return (0.0, 0.0, 0.0), None, reasons
    if surface.node.type not in ("BACKGROUND", "EMISSION"):
        return tuple(world.color), None, [*reasons, f"has a node {surface.node.name!r} that is not modeled"]
    color = _unmixed(surface.required("Color"), camera)
    rgb = shaders.constant_color_of(color)
    strength = shaders.constant_number_of(_unmixed(surface.required("Strength"), camera))
    wrapped = None
    feeding = nodes.source(color)
    if rgb is None:
        assert isinstance(feeding, Output)  # else it were constant
        source, factor = _factored(feeding)
        wrapped = _wrapped(source)
        rgb, reason = (factor, None) if wrapped else _mean(feeding, world)
        reasons += [reason] if reason else []
    if strength is None:
        strength = 1.0
        reasons.append("has a strength that varies")
    red, green, blue = (value * strength for value in rgb)
    radiance = shaders.possible((red, green, blue))
    if radiance is None:
        return (0.0, 0.0, 0.0), None, [*reasons, f"has the color {tuple(rgb)} and the strength {strength:g}"]
    if wrapped and reasons:  # a constant world stands in
        red, green, blue = (a * b for a, b in zip(radiance, images.mean(wrapped.image), strict=True))
        return (red, green, blue), None, reasons
    return radiance, wrapped, reasons


def _factored(source: Output) -> tuple[Output | Input, RGB]:
    """The factor that a Vector Math node multiplies by a constant, and that constant."""
    if source.node.type == "VECT_MATH" and source.node.operation == "MULTIPLY":
        factor = shaders.constant_color(source, 1)
        if factor is not None:
            return nodes.source(source.required(0)), factor
    return source, (1.0, 1.0, 1.0)


def _wrapped(source: Output | Input) -> _Wrapped | None:
    """The image of an Environment Texture that is wrapped around the world as it is, or turned by a Mapping node."""
    if not isinstance(source, Output):
        return None
    node = source.node
    if node.type != "TEX_ENVIRONMENT" or images.obstacle(node.image and node.image.original) is not None:
        return None
    if (
        node.projection != "EQUIRECTANGULAR"
        or node.interpolation not in ("Linear", "Closest")
        or not shaders.maps_plainly(node)
    ):
        return None
    rotation = _rotation(source.required("Vector"))
    return rotation and _Wrapped(node.image.original, node.interpolation == "Closest", rotation)


def _rotation(node_input: Input) -> tuple[float, float, float] | None:
    """The angles by which the directions that an input is given are turned, or None where more is done to them."""
    vector = nodes.source(node_input)
    if not isinstance(vector, Output):
        return (0.0, 0.0, 0.0) if nodes.is_left_alone(node_input) else None
    if vector.node.type == "TEX_COORD":
        is_direction = vector.socket.name == "Generated" or (vector.socket.name == "Object" and vector.node.object is None)
        return (0.0, 0.0, 0.0) if is_direction else None
    if vector.node.type != "MAPPING" or vector.node.vector_type not in ("POINT", "VECTOR"):
        return None
    turns: list[Any] = [
        shaders.constant_color(vector, name)
        for name in ("Location", "Rotation", "Scale")[vector.node.vector_type == "VECTOR" :]
    ]
    node_input = vector.required("Vector")
    inner = None if nodes.is_left_alone(node_input) else _rotation(node_input)
    if None in turns or inner is None or any(inner) or turns[-1] != (1.0, 1.0, 1.0) or (len(turns) == 3 and any(turns[0])):
        return None
    return turns[-2]


def _mean(source: Output, world: bpy.types.World) -> tuple[RGB, str]:
    """The mean that stands in for a color that varies, and what varies."""
    reason = f"has a node {source.node.name!r} that varies"
    if source.node.type == "TEX_ENVIRONMENT" and images.obstacle(source.node.image) is None:
        return images.mean(source.node.image), reason
    return tuple(world.color), reason
