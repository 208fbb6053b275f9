"""Blender's world as the tracer's: the same light from everywhere, or its mean and why."""

import bpy

from ...tracer.scene.lamps import World
from .. import versions
from ..temporary_settings import Overrides
from . import images, nodes, shaders
from .ledger import Ledger
from .nodes import Input, Output
from .shaders import RGB

_RAYS = ("camera", "diffuse", "glossy", "transmission")


def shown_world(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> bpy.types.World | None:
    """The world that a view layer is rendered with."""
    return view_layer.world_override or scene.world


def world_of(world: bpy.types.World | None, ledger: Ledger) -> World:
    """The tracer's world. What it approximates, Cycles is shown likewise."""
    if world is None:
        return World()
    radiance, reasons = _read(world)
    for reason in reasons:
        ledger.note(world.name, "approximated", f"the world {reason}, and a constant one stands in")
    if reasons:
        ledger.call_for_cycles(world.original, _make_constant, radiance)
    original = world.original
    for owner, name, value in (
        (original.cycles, "max_bounces", 1024),
        (original.cycles, "is_caustics_light", False),
        (original.cycles, "use_shadows", True),
    ):
        if hasattr(owner, name):  # versions know fewer of them
            ledger.set_for_cycles(owner, name, value)
    return World(radiance, frozenset(ray for ray in _RAYS if not getattr(world.cycles_visibility, ray)))


def _make_constant(overrides: Overrides, world: bpy.types.World, radiance: RGB) -> None:
    output, adder = nodes.override_output(overrides, world.node_tree, "ShaderNodeOutputWorld")
    background = adder.add("ShaderNodeBackground", Color=(*radiance, 1.0), Strength=1.0)
    adder.link(background.outputs[0], output.inputs["Surface"])


def _read(world: bpy.types.World) -> tuple[RGB, list[str]]:
    """The radiance, and why it is only a mean."""
    tree = versions.node_tree(world)
    if tree is None:
        return tuple(world.color), []
    output = tree.get_output_node("CYCLES")
    if output is None:
        return (0.0, 0.0, 0.0), []
    reasons = ["has a volume"] if output.inputs["Volume"].is_linked else []
    surface = nodes.source(Input(output.inputs["Surface"]))
    if not isinstance(surface, Output):
        return (0.0, 0.0, 0.0), reasons
    if surface.node.type not in ("BACKGROUND", "EMISSION"):
        return tuple(world.color), [*reasons, f"has a node {surface.node.name!r} that is not modelled"]
    rgb = shaders.constant_colour(surface, "Color")
    strength = shaders.constant_number(surface, "Strength")
    if rgb is None:
        rgb, reason = _mean(surface, world)
        reasons.append(reason)
    if strength is None:
        strength = 1.0
        reasons.append("has a strength that varies")
    radiance = shaders.possible(tuple(value * strength for value in rgb))
    if radiance is None:
        return (0.0, 0.0, 0.0), [*reasons, f"has the colour {tuple(rgb)} and the strength {strength:g}"]
    return radiance, reasons


def _mean(surface: Output, world: bpy.types.World) -> tuple[RGB, str]:
    """What stands in for a colour that varies, and what varies."""
    source = nodes.source(surface.input("Color"))
    reason = f"has a node {source.node.name!r} that varies"
    if source.node.type == "TEX_ENVIRONMENT" and images.obstacle(source.node.image) is None:
        return images.mean(source.node.image), reason
    return tuple(world.color), reason
