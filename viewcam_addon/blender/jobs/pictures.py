"""A render as files: a multilayer EXR of 32-bit floats, and a PNG as the scene's view transform shows it.

Blender writes both, as a render of its own would. What two renders of the same can't have in common, the date, how long it
took, on which computer and from which folder, is then taken out of the files, so that the same picture is the same bytes.
Rejected: the stamp's switches in Blender (Cycles writes its times whatever they say) and OpenEXR (never in Blender's process).
"""

import errno
import os
from pathlib import Path

import bpy

from ... import png
from ...errors import InputError
from .. import versions
from ..rendering import exr
from ..rendering.cycles import override_whole
from ..temporary_settings import Overrides

_PASSING = ("Date", "Hostname", "Memory", "RenderTime")
_PROBE = bytes(2**20)


def override_formats(overrides: Overrides, scene: bpy.types.Scene) -> None:
    """Let `write` choose formats until the overrides end. Both follow the scene's color management."""
    override_whole(overrides, scene.render.image_settings)
    scene.render.image_settings.color_management = "FOLLOW_SCENE"


def write(scene: bpy.types.Scene, image: Path, preview: Path) -> None:
    """Write what was rendered last to these two paths.

    Raises InputError if Blender reports why a file can't be written. Raises OSError if the disk is full, or Blender did not
    finish a file and does not say why.
    """
    settings = scene.render.image_settings
    versions.set_multilayer_file(settings)
    _save(scene, image)
    if not exr.is_whole(image):
        _probe(image)
        raise OSError(errno.EIO, "Blender did not finish the file")
    exr.strip(image, lambda attribute: attribute == "File" or is_passing(attribute))
    versions.set_preview_file(settings)
    _save(scene, preview)
    if not png.is_whole(preview):
        _probe(preview)
        raise OSError(errno.EIO, "Blender did not finish the file")
    png.strip(preview)


def is_passing(attribute: str) -> bool:
    """True if an attribute of the EXR tells of the rendering and not of the picture."""
    return attribute in _PASSING or (attribute.startswith("cycles.") and attribute.endswith("_time"))


def _save(scene: bpy.types.Scene, path: Path) -> None:
    result = bpy.data.images["Render Result"]
    try:
        result.save_render(str(path.absolute()), scene=scene)
    except RuntimeError as error:
        _probe(path)
        reason = str(error).strip().splitlines()[0].removeprefix("Error: ").rstrip(".")
        raise InputError(f"{path} can't be written ({reason}): choose another folder") from error


def _probe(path: Path) -> None:
    """Raise the OSError that Blender met and did not tell, if it can still be met: a full disk, a quota."""
    with open(path, "ab") as file:
        file.write(_PROBE)
        file.flush()
        os.fsync(file.fileno())
