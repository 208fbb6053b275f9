"""The materials and images of an export, each read once; where there is none of this class, level geometry is exported."""

import bpy

from ...tracer.scene.materials import Material, Picture
from . import images, shaders


class Shading:
    """materials, images : as in `Scene`, of all that was asked for."""

    def __init__(self) -> None:
        self.materials: dict[str, Material] = {}
        self.images: dict[str, Picture] = {}
        self._readings: dict[str, shaders.Reading] = {}

    def reading(self, material: bpy.types.Material) -> shaders.Reading:
        """What an evaluated material is to the tracer."""
        name = material.original.name_full
        if name not in self._readings:
            reading = self._readings[name] = shaders.read(material)
            self.materials[name] = reading.material
            self.images |= reading.tables
            for key, image in reading.images.items():
                if key not in self.images or key in reading.alphas:
                    self.images[key] = images.picture_of(image, key in reading.alphas)
        return self._readings[name]

    def names(self, slots: tuple[bpy.types.Material | None, ...]) -> tuple[str, ...]:
        """Keys in `materials`; "" is none."""
        for material in filter(None, slots):
            self.reading(material)
        return tuple(material.original.name_full if material else "" for material in slots)

    def vertex_colours(self, slots: tuple[bpy.types.Material | None, ...]) -> str | None:
        """The colour attribute that a mesh of these materials is coloured by, "" being the active one, or None."""
        readings = (self.reading(material) for material in filter(None, slots))
        return next((reading.vertex for reading in readings if reading.vertex is not None), None)
