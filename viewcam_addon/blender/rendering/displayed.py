"""Pictures as a scene displays them: by its view transform, look, exposure, gamma and curves, as F12 does."""

import tempfile
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ...files import written_whole
from .. import versions
from ..temporary_settings import overridden
from .cycles import override_whole


def write_png(scene: bpy.types.Scene, path: Path) -> None:
    """Write a PNG beside an array of NumPy, of the same name, and remove the array.

    path : the array's file, (height, width, 3) float32, scene linear, rows from the bottom.

    Raises InputError if the PNG can't be written.
    """
    _write(scene, np.load(path, allow_pickle=False), path.with_suffix(".png"))
    path.unlink()


def displayed(scene: bpy.types.Scene, light: NDArray[np.float32]) -> NDArray[np.float32]:
    """Light as the scene displays it, (height, width, 4), in steps of 1/255.

    light : an array like that of `write_png`.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "displayed.png")
        _write(scene, light, path)
        return stored(path)


def stored(path: Path) -> NDArray[np.float32]:
    """A PNG, (height, width, 4), rows from the bottom, as it is stored."""
    image = bpy.data.images.load(str(path))
    try:
        width, height = image.size
        pixels = np.empty(width * height * 4, np.float32)
        image.pixels.foreach_get(pixels)
    finally:
        bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)


def _write(scene: bpy.types.Scene, light: NDArray[np.float32], path: Path) -> None:
    height, width = light.shape[:2]
    image = bpy.data.images.new("Virtual Pinhole", width, height, float_buffer=True)
    try:
        image.pixels.foreach_set(np.concatenate([light, np.ones((height, width, 1), np.float32)], axis=-1).ravel())
        with overridden() as overrides, written_whole(path) as temporary:
            settings = scene.render.image_settings
            override_whole(overrides, settings)
            versions.set_preview_file(settings)
            settings.color_management = "FOLLOW_SCENE"
            image.save_render(str(temporary), scene=scene)
    finally:
        bpy.data.images.remove(image)
