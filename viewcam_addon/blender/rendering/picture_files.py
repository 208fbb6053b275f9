"""Pictures as files: a render's multilayer EXR of 32-bit floats and its PNG, and light as the scene's view transform has it.

Blender writes all of them, as F12 does: with view transform, look, exposure, gamma and curves. What two renders of the same
can't have in common, the date, how long it took, on which computer and from which folder, is then taken out of a render's
files, so that the same picture is the same bytes. Rejected: the stamp's switches in Blender (Cycles writes its times whatever
they say) and OpenEXR (never in Blender's process).
"""

import errno
import os
import tempfile
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ... import png
from ...errors import InputError, operator_reason
from ...files import written_whole
from .. import versions
from ..temporary_settings import Overrides, overridden
from . import exr

_PASSING = ("Date", "Hostname", "Memory", "RenderTime")
_PROBE = bytes(2**20)


def override_formats(overrides: Overrides, scene: bpy.types.Scene) -> None:
    """Let formats be chosen until the overrides end, all of which follow the scene's color management.

    All settings of the file are given back together, since the kind of file changes what the others may be, those of videos
    too. A file may hold one that its kind of file does not know, which reads as "": nobody can set that, and Blender chooses
    another.
    """
    settings = scene.render.image_settings
    first = ("media_type", "file_format")  # Blender sets others of a video as it comes back to it, and these its colors
    owners = (settings, scene.render.ffmpeg)
    before = [(owner, p.identifier, p.type) for owner in owners for p in owner.bl_rna.properties if not p.is_readonly]
    before.sort(key=lambda each: first.index(each[1]) if each[1] in first else 2 + (each[0] == settings))
    values = [getattr(owner, name) for owner, name, _ in before]

    def give_back() -> None:
        for (owner, name, kind), value in zip(before, values, strict=True):
            is_unknown = kind == "ENUM" and value == ""
            if not is_unknown and getattr(owner, name) != value:
                setattr(owner, name, value)

    overrides.afterwards(give_back)
    settings.color_management = "FOLLOW_SCENE"


def write(scene: bpy.types.Scene, image: Path, preview: Path) -> None:
    """Write what was rendered last to these two paths.

    Raises InputError if Blender reports why a file can't be written. Raises OSError if the disk is full, or Blender did not
    finish a file and does not say why.
    """
    settings = scene.render.image_settings
    versions.set_multilayer_file(settings)
    _save_whole(scene, image, exr.is_whole)
    exr.strip(image, lambda attribute: attribute == "File" or is_passing(attribute))
    versions.set_preview_file(settings)
    _save_whole(scene, preview, png.is_whole)
    png.strip(preview)


def is_passing(attribute: str) -> bool:
    """True if an attribute of the EXR tells of the rendering and not of the picture."""
    return attribute in _PASSING or (attribute.startswith("cycles.") and attribute.endswith("_time"))


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
            override_formats(overrides, scene)
            versions.set_preview_file(scene.render.image_settings)
            image.save_render(str(temporary), scene=scene)
    finally:
        bpy.data.images.remove(image)


def _save_whole(scene: bpy.types.Scene, path: Path, is_whole: Callable[[Path], bool]) -> None:
    _save(scene, path)
    if not is_whole(path):
        _probe(path)
        raise OSError(errno.EIO, "Blender did not finish the file")


def _save(scene: bpy.types.Scene, path: Path) -> None:
    result = bpy.data.images["Render Result"]
    try:
        result.save_render(str(path.absolute()), scene=scene)
    except RuntimeError as error:
        _probe(path)
        raise InputError(f"{path} can't be written ({operator_reason(error)}): choose another folder") from error


def _probe(path: Path) -> None:
    """Raise the OSError that Blender met and did not tell, if it can still be met: a full disk, a quota."""
    with open(path, "ab") as file:
        file.write(_PROBE)
        file.flush()
        os.fsync(file.fileno())
