"""The least level that a scene needs: what it has not is not computed."""

from . import Object, Scene
from .film import LEVELS
from .lamps import World
from .materials import PLAIN, Material
from .shader_nodes import KINDS

_REFLECTS, _MIRRORS = "reflects light onto others", "mirrors"
_WHAT = {"diffuse": _REFLECTS, "principled": _REFLECTS, "glossy": _MIRRORS, "metallic": _MIRRORS}


def least_level(scene: Scene) -> tuple[str, str]:
    """The level (film.LEVELS) at which nothing is left out that this scene shows, and one sentence that says why."""
    geometry, direct, path = LEVELS
    light = _light(scene)
    if light is None:
        return geometry, "Nothing gives light: no lamp, no surface and not the world."
    bounces = scene.bounces
    if bounces.total == 0:
        return direct, f"Light comes from {light}, and the scene allows no bounces."
    shown = [(placed, material) for placed in scene.objects for material in _materials(scene, placed)]
    scattering = [
        (placed, closure.node.type)
        for placed, material in shown
        for closure in material.closures
        if KINDS[closure.node.type].scatters
    ]
    if not scattering:
        return direct, f"Light comes from {light}, and nothing reflects it."
    for placed, kind in scattering:
        if any(getattr(bounces, bounce) > 0 for bounce in KINDS[kind].scatters):
            return path, f"Light comes from {light}, and {placed.name!r} {_WHAT.get(kind, 'is clear')}."
    return direct, f"Light comes from {light}, and the scene allows no bounces of the kinds that it has."


def _light(scene: Scene) -> str | None:
    """The first thing that gives light."""
    for lamp in scene.lamps:
        if any(getattr(lamp, "irradiance", ()) or getattr(lamp, "power", ())):
            return f"the lamp {lamp.name!r}"
    for placed in scene.objects:
        if any(closure.node.is_shining for material in _materials(scene, placed) for closure in material.closures):
            return f"the surface of {placed.name!r}"
    return "the world" if scene.world.radiance != World().radiance else None


def _materials(scene: Scene, placed: Object) -> list[Material]:
    """The materials of an object that some part of its geometry uses."""
    used = sorted(set(scene.geometries[placed.geometry].materials.tolist()))
    names = [placed.materials[index] if index < len(placed.materials) else "" for index in used]
    return [scene.materials[name] if name else PLAIN for name in names]
