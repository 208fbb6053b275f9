"""The materials and images of an export, each read once."""

from collections.abc import Iterable

import bpy

from ...tracer.scene.materials import Material, Picture
from ...tracer.scene.shader_nodes import Node
from .. import versions
from . import images, shaders

_DEFAULT = "Cycles' default surface"
"""The name of what has no material since 5.0 (intern/cycles/scene/shader.cpp, add_default)."""


def add_pictures(reading: shaders.Reading, alphas: set[str], to: dict[str, Picture]) -> None:
    """Read the images of a material, or a light, that are not there yet.

    alphas : the keys of the images whose alpha is asked for.
    """
    to |= reading.tables
    for key, image in reading.images.items():
        if key not in to or (key in alphas and to[key].shape[2] < 4):
            to[key] = images.picture_of(image, key in alphas)


class Shading:
    """The materials that an export has met so far. An export of level geometry has none of this class."""

    def __init__(self) -> None:
        self._readings: dict[str, shaders.Reading] = {}

    def reading(self, material: bpy.types.Material) -> shaders.Reading:
        """The reading of an evaluated material."""
        name = material.original.name_full
        if name not in self._readings:
            self._readings[name] = shaders.read(material)
        return self._readings[name]

    @property
    def materials(self) -> dict[str, Material]:
        """The materials that were asked for, as in `Scene`."""
        return {name: reading.material for name, reading in self._readings.items()}

    def pictures(self) -> dict[str, Picture]:
        """The images of all materials that were asked for, as in `Scene`; their pixels are read now."""
        result: dict[str, Picture] = {}
        alphas = {key for reading in self._readings.values() for key in reading.alphas}
        for reading in self._readings.values():
            add_pictures(reading, alphas, result)
        return result

    def names(self, slots: tuple[bpy.types.Material | None, ...]) -> tuple[str, ...]:
        """Keys in `materials`; "" is none, which until 5.0 Cycles draws as we do."""
        default = _DEFAULT if versions.DEFAULT_SURFACE_BENDS_NORMALS else ""
        if None in slots and default:
            self._readings[default] = shaders.Reading(Material(surface=Node("principled")))
        for material in filter(None, slots):
            self.reading(material)
        return tuple(material.original.name_full if material else default for material in slots)

    def attributes(self, slots: tuple[bpy.types.Material | None, ...]) -> set[str]:
        """The attributes that a mesh of these materials is asked for by name, as `Mesh.attributes` has it."""
        materials = [self.reading(material).material for material in filter(None, slots)]
        return {name for material in materials for name in material.attributes}

    def asks_for_random(self, slots: tuple[bpy.types.Material | None, ...]) -> bool:
        """True if one of these materials differs from instance to instance."""
        return any(self.reading(material).asks_for_random for material in filter(None, slots))

    def shines(self, slots: Iterable[bpy.types.Material | None]) -> bool:
        """True if one of these materials gives light."""
        return any(self.reading(material).material.shines for material in filter(None, slots))

    def asks_for_colors(self, slots: tuple[bpy.types.Material | None, ...]) -> bool:
        """True if a mesh of these materials is colored by its color attribute that is active for rendering."""
        materials = [self.reading(material).material for material in filter(None, slots)]
        return any(color.vertex for material in materials for _, color in material.inputs)
