"""Pictures as a scene displays them: by its view transform, look, exposure, gamma and curves, as F12 does."""

from pathlib import Path

import bpy
import numpy as np

from ...files import written_whole
from .. import versions
from ..temporary_settings import overridden
from .cycles import override_whole


def write_png(scene: bpy.types.Scene, path: Path) -> None:
    """Write a PNG beside an array of NumPy, of the same name, and remove the array.

    path : of the array, (height, width, 3) float32, scene linear, rows from the bottom.

    Raises
    ------
    InputError
        if the PNG can't be written.
    """
    light = np.load(path, allow_pickle=False)
    height, width = light.shape[:2]
    image = bpy.data.images.new("Virtual Pinhole", width, height, float_buffer=True)
    try:
        image.pixels.foreach_set(np.concatenate([light, np.ones((height, width, 1), np.float32)], axis=-1).ravel())
        with overridden() as overrides, written_whole(path.with_suffix(".png")) as temporary:
            settings = scene.render.image_settings
            override_whole(overrides, settings)
            versions.set_preview_file(settings)
            settings.color_management = "FOLLOW_SCENE"
            image.save_render(str(temporary), scene=scene)
    finally:
        bpy.data.images.remove(image)
    path.unlink()
