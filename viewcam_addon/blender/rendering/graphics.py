"""A check that Blender can draw with a GPU here, as EEVEE and the Workbench do.

Where there is neither display nor driver, Blender ends with a crash as soon as it is asked to (measured: 4.2, 5.0 and 5.2), so
a Blender of its own is asked: it draws a picture of 4 × 4 pixels of nothing. Rejected: `gpu.platform`, which says nothing in
the background.
"""

import functools
import subprocess

from .. import another_blender

_DRAW = """
import bpy
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.camera = bpy.data.objects.new("", bpy.data.cameras.new(""))
scene.collection.objects.link(scene.camera)
scene.render.engine, scene.render.resolution_x, scene.render.resolution_y = "BLENDER_WORKBENCH", 4, 4
bpy.ops.render.render()
"""
_LONGEST = 120  # seconds


@functools.cache
def are_there() -> bool:
    """True if a Blender like this one draws; asked once, which takes seconds."""
    try:
        return another_blender.run(_DRAW, _LONGEST).returncode == 0
    except (OSError, subprocess.TimeoutExpired):
        return False
