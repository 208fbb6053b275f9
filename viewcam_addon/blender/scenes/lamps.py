"""Blender's lights as the tracer's lamps.

What the settings mean is Cycles' (light.cpp of intern/cycles/blender and of intern/cycles/scene): a light of the strength s, in
watts for all but suns, has the radiance s/(π A) if it is normalised, else s/π; a sun the irradiance s, else the radiance s.
The position and the angles are the matrix's, the radius is not scaled with it.
"""

import math
from collections.abc import Iterator
from dataclasses import replace

import bpy
import numpy as np

from ...tracer.scene.film import Bounces
from ...tracer.scene.lamps import LEAST_SPREAD, Area, Lamp, Point, Spot, Sun
from ...tracer.scene.materials import Picture
from ...tracer.scene.shader_nodes import Node
from .. import versions
from ..temporary_settings import Overrides
from . import features, images, lamp_nodes, linking, nodes, shaders, shading
from .ledger import Ledger
from .shaders import RGB

_WHITE = (1.0, 1.0, 1.0)
# Of the cosine between two axes of an area light; beyond it Cycles' own formulas contradict each other.
_SHEAR = 1e-5


def lamps_in(
    depsgraph: bpy.types.Depsgraph, bounces: Bounces, ledger: Ledger, pictures: dict[str, Picture] | None = None
) -> Iterator[Lamp]:
    """The lamps that a render of this depsgraph shows, and their remedies for Cycles.

    pictures : receives the images of their nodes.
    """
    links = linking.Links(depsgraph)
    for instance in depsgraph.object_instances:
        if instance.object.type == "LIGHT" and instance.show_self:
            placed = features.placed_by(instance)
            name, light = placed.name, placed.shown.data
            ledger.note(name, "exported", "a light")
            hidden_from = features.hidden_from(placed, depsgraph.view_layer_eval) - {"shadow"}
            matrix = np.array(instance.matrix_world, dtype=np.float64)
            _note(name, light, bounces, ledger)
            factor, emission, reading = _emission(name, light, matrix, ledger)
            lamp = _lamp(name, light, matrix, hidden_from, _strength(name, light, factor, ledger), ledger)
            if lamp is not None:
                receivers, blockers = links.of(placed, ledger)
                if pictures is not None and reading:
                    shading.add_pictures(reading, reading.alphas, pictures)
                yield replace(lamp, receivers=receivers, blockers=blockers, emission=emission)


def _lamp(
    name: str, light: bpy.types.Light, matrix: np.ndarray, hidden_from: frozenset[str], strength: RGB | None, ledger: Ledger
) -> Lamp | None:
    """The lamp, or None where there is no light."""
    if strength is None or not any(strength) or (light.type == "AREA" and light.cycles.is_portal):
        return None
    is_normalised = getattr(light, "normalize", True)
    common = {"name": name, "hidden_from": hidden_from, "casts_shadow": light.use_shadow}
    common["is_met"] = light.cycles.use_multiple_importance_sampling
    if light.type == "SUN":
        if not is_normalised and light.angle > 0:
            strength = _times(strength, math.pi * math.sin(light.angle / 2) ** 2)
        return Sun(towards=tuple(matrix[:3, 2]), irradiance=strength, angle=light.angle, **common)
    if light.type == "AREA":
        return _area(light, matrix, strength, is_normalised, common, ledger)
    radius = light.shadow_soft_size
    if not is_normalised:
        strength = _times(strength, 4 * math.pi * radius**2 if radius > 0 else 4.0)
    common |= {"power": strength, "radius": radius, "soft_falloff": light.use_soft_falloff}
    if light.type == "SPOT":
        return Spot(matrix=matrix, angle=light.spot_size, blend=light.spot_blend, **common)
    return Point(position=tuple(matrix[:3, 3]), **common)


def _area(
    light: bpy.types.Light, matrix: np.ndarray, strength: RGB, is_normalised: bool, common: dict, ledger: Ledger
) -> Area | None:
    name = common["name"]
    size = (light.size, light.size if light.shape in ("SQUARE", "DISK") else light.size_y)
    ellipse = light.shape in ("DISK", "ELLIPSE")
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    area = lengths[0] * size[0] * lengths[1] * size[1] * (math.pi / 4 if ellipse else 1.0)
    if not area > 0:
        ledger.note(name, "exported", "has no size and gives no light")
        return None
    axes = matrix[:3, :3] / np.where(lengths > 0, lengths, 1.0)
    if np.abs(axes.T @ axes - np.diag(np.diag(axes.T @ axes))).max() > _SHEAR:
        ledger.note(name, "approximated", "is sheared, which Cycles takes for one shape here and another there")
    spread = light.spread
    if spread < LEAST_SPREAD:
        ledger.note(name, "approximated", f"has a spread of {math.degrees(spread):.2g}°, 180° on both sides")
        ledger.set_for_cycles(light.original, "spread", math.pi)
        spread = math.pi
    power = strength if is_normalised else _times(strength, area)
    return Area(matrix=matrix, size=size, ellipse=ellipse, spread=spread, power=power, **common)


def _strength(name: str, light: bpy.types.Light, emission: RGB, ledger: Ledger) -> RGB | None:
    """Energy, colour, exposure and what nodes make of them everywhere, or None where light can have no such."""
    factor = light.energy * 2.0 ** getattr(light, "exposure", 0.0)
    strength = _times(tuple(light.color), factor)
    if getattr(light, "use_temperature", False):
        strength = tuple(a * b for a, b in zip(strength, light.temperature_color, strict=True))
    strength = tuple(a * b for a, b in zip(strength, emission, strict=True))
    possible = shaders.possible(strength)
    if possible is None:
        ledger.note(name, "skipped", f"a light of the strength {', '.join(f'{value:g}' for value in strength)}")
        ledger.set_for_cycles(light.original, "energy", 0.0)
    return possible


def _emission(
    name: str, light: bpy.types.Light, matrix: np.ndarray, ledger: Ledger
) -> tuple[RGB, Node | None, shaders.Reading | None]:
    """The factor that a light's nodes are everywhere, or the node that makes it, with what that asks for."""
    tree = versions.light_tree(light)
    output = tree and tree.get_output_node("CYCLES")
    if not output or not np.linalg.det(matrix[:3, :3]):
        return _WHITE, None, None
    for missing in images.missing(tree):
        ledger.note(name, "exported", missing)
    emission, reading = lamp_nodes.emission(light, matrix, output)
    if reading.reasons:
        ledger.note(name, "approximated", f"{'; '.join(reading.reasons)}: plain light stands in")
        ledger.call_for_cycles(light.original, _make_plain)
        return _WHITE, None, None
    return (_WHITE, emission, reading) if isinstance(emission, Node) else (emission, None, None)


def _make_plain(overrides: Overrides, light: bpy.types.Light) -> None:
    output, adder = nodes.override_output(overrides, light.node_tree, "ShaderNodeOutputLight")
    adder.link(adder.add("ShaderNodeEmission", Strength=1.0).outputs[0], output.inputs["Surface"])


def _note(name: str, light: bpy.types.Light, bounces: Bounces, ledger: Ledger) -> None:
    """What else Cycles does to a light, which both sides leave out."""
    settings = light.original.cycles
    if (
        not light.use_shadow and settings.use_multiple_importance_sampling and _size(light) > 0
    ):  # then Cycles shows a part of its light behind what would block it
        ledger.note(name, "approximated", "casts no shadow although it has a size: Cycles shows less of it in the shadows")
    if light.cycles.max_bounces < bounces.total:
        ledger.note(name, "approximated", "its bounces are limited, and are not on both sides")
        ledger.set_for_cycles(settings, "max_bounces", 1024)
    ledger.set_for_cycles(settings, "is_caustics_light", False)


def _size(light: bpy.types.Light) -> float:
    return getattr(light, {"SUN": "angle", "AREA": "size"}.get(light.type, "shadow_soft_size"))


def _times(rgb: RGB, factor: float) -> RGB:
    return tuple(value * factor for value in rgb)
