"""Render settings that make a picture of light: film and bounces."""

import bpy

from ...tracer.scene.film import Bounces, Film
from .ledger import Ledger

# Fields of Bounces → properties of `scene.cycles`.
BOUNCES = {
    "total": "max_bounces",
    "diffuse": "diffuse_bounces",
    "glossy": "glossy_bounces",
    "transmission": "transmission_bounces",
    "transparent": "transparent_max_bounces",
}
CAUSTICS = ("caustics_reflective", "caustics_refractive")

CYCLES_SETTINGS = ("pixel_filter_type", "filter_width", "film_exposure", *BOUNCES.values(), *CAUSTICS)
"""The settings of `scene.cycles` that are read here."""


def film_of(scene: bpy.types.Scene) -> Film:
    """The scene's film; that of Blender's factory settings where Cycles is disabled."""
    transparent = scene.render.film_transparent
    cycles = getattr(scene, "cycles", None)
    if cycles is None:
        return Film(transparent=transparent)
    return Film(cycles.pixel_filter_type, cycles.filter_width, transparent, cycles.film_exposure)


def bounces_of(scene: bpy.types.Scene, ledger: Ledger) -> Bounces:
    """The number of times that light may bounce in a render of the scene."""
    cycles = getattr(scene, "cycles", None)
    if cycles is None:
        return Bounces()
    if not all(getattr(cycles, name) for name in CAUSTICS):
        ledger.note(scene.name, "approximated", "caustics are on on both sides")
    if cycles.shading_system:  # which decodes images before it interpolates
        ledger.note(scene.name, "approximated", "Open Shading Language is off on both sides")
    is_coarse = cycles.texture_limit_render != "OFF" or getattr(cycles, "texture_resolution_render", 1.0) < 1.0
    if scene.render.use_simplify and is_coarse:
        ledger.note(scene.name, "approximated", "Simplify makes textures smaller, which have all of their pixels on both sides")
    bounces = Bounces(**{field: getattr(cycles, setting) for field, setting in BOUNCES.items()})
    if not bounces.parts_diffuse:
        reason = (
            "without diffuse bounces Cycles puts light of other closures into Diffuse Indirect, which level path leaves out"
        )
        ledger.note(scene.name, "exported", reason)
    return bounces
