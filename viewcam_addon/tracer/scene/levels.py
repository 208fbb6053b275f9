"""The least level that a scene needs: what it has not is not computed."""

from . import Object, Scene
from .film import LEVELS
from .lamps import World
from .materials import PLAIN, Material

_COUNTED_AS = {
    "diffuse": ("diffuse",),
    "mirror": ("glossy",),
    "glass": ("glossy", "transmission"),
    "refraction": ("transmission",),
}


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
        (placed, component) for placed, material in shown for component in material.colours if component in _COUNTED_AS
    ]
    if not scattering:
        return direct, f"Light comes from {light}, and nothing reflects it."
    for placed, component in scattering:
        if any(getattr(bounces, kind) > 0 for kind in _COUNTED_AS[component]):
            what = {"diffuse": "reflects light onto others", "mirror": "mirrors"}.get(component, "is clear")
            return path, f"Light comes from {light}, and {placed.name!r} {what}."
    return direct, f"Light comes from {light}, and the scene allows no bounces of the kinds that it has."


def _light(scene: Scene) -> str | None:
    """The first thing that gives light."""
    for lamp in scene.lamps:
        if any(getattr(lamp, "irradiance", ()) or getattr(lamp, "power", ())):
            return f"the lamp {lamp.name!r}"
    for placed in scene.objects:
        if any("emission" in material.colours for material in _materials(scene, placed)):
            return f"the surface of {placed.name!r}"
    return "the world" if scene.world.radiance != World().radiance else None


def _materials(scene: Scene, placed: Object) -> list[Material]:
    """The materials of an object that some part of its geometry uses."""
    used = sorted(set(scene.geometries[placed.geometry].materials.tolist()))
    names = [placed.materials[index] if index < len(placed.materials) else "" for index in used]
    return [scene.materials[name] if name else PLAIN for name in names]
