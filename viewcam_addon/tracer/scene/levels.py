"""The least level that a scene needs: what it has not is not computed."""

from collections.abc import Sequence

from . import Object, Scene
from .film import LEVELS, Bounces
from .lamps import Lamp, World
from .materials import PLAIN, Material
from .shader_nodes import KINDS

_REFLECTS, _MIRRORS = "reflects light onto others", "mirrors"
_WHAT = {"diffuse": _REFLECTS, "principled": _REFLECTS, "glossy": _MIRRORS, "metallic": _MIRRORS}


def least_level(scene: Scene) -> tuple[str, str]:
    """The level (film.LEVELS) at which nothing is left out that this scene shows, and one sentence that says why."""
    materials = [(placed.name, material) for placed in scene.objects for material in _materials(scene, placed)]
    return level_of(scene.lamps, scene.world, scene.bounces, materials)


def level_of(
    lamps: Sequence[Lamp], world: World, bounces: Bounces, materials: Sequence[tuple[str, Material]]
) -> tuple[str, str]:
    """`least_level` of what gives light. materials : (object's name, material), of each material that some part of it uses."""
    geometry, direct, path = LEVELS
    light = _light(lamps, world, materials)
    if light is None:
        return geometry, "Nothing gives light: no lamp, no surface and not the world."
    if bounces.total == 0:
        return direct, f"Light comes from {light}, and the scene allows no bounces."
    scattering = [
        (name, closure.node.type)
        for name, material in materials
        for closure in material.closures
        if KINDS[closure.node.type].scatters
    ]
    if not scattering:
        return direct, f"Light comes from {light}, and nothing reflects it."
    for name, kind in scattering:
        if any(getattr(bounces, bounce) > 0 for bounce in KINDS[kind].scatters):
            return path, f"Light comes from {light}, and {name!r} {_WHAT.get(kind, 'is clear')}."
    return direct, f"Light comes from {light}, and the scene allows no bounces of the kinds that it has."


def _light(lamps: Sequence[Lamp], world: World, materials: Sequence[tuple[str, Material]]) -> str | None:
    """The first thing that gives light."""
    for lamp in lamps:
        if any(lamp.strength):
            return f"the lamp {lamp.name!r}"
    for name, material in materials:
        if material.shines:
            return f"the surface of {name!r}"
    return None if world.is_black else "the world"


def _materials(scene: Scene, placed: Object) -> list[Material]:
    """The materials of an object that some part of its geometry uses."""
    used = sorted(set(scene.geometries[placed.geometry].materials.tolist()))
    names = [placed.materials[index] if index < len(placed.materials) else "" for index in used]
    return [scene.materials[name] if name else PLAIN for name in names]
