"""Whether Blender can draw with a GPU here, as EEVEE and the Workbench do.

Where there is neither display nor driver, Blender ends with a crash as soon as it is asked to (measured: 4.2, 5.0 and 5.2), so
a Blender of its own is asked: it draws a picture of 4 × 4 pixels of nothing. Rejected: `gpu.platform`, which says nothing in
the background.
"""

import functools
import subprocess
import sys

import bpy

from ... import child_process

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
    """Whether a Blender like this one draws; asked once, which takes seconds."""
    if bpy.app.binary_path:
        command = [bpy.app.binary_path, "--background", "--factory-startup", "--python-exit-code", "1", "--python-expr", _DRAW]
    else:
        command = [sys.executable, "-c", _DRAW]
    # There stands a bpy that only this process can import.
    variables = child_process.environment(apart_from=bpy.utils.system_resource("SCRIPTS"))
    try:
        # In a session of its own: a Ctrl-C that is meant for the batch would end it, and look like no GPU.
        how = {"env": variables, "start_new_session": True, "capture_output": True, "timeout": _LONGEST}
        outcome = subprocess.run(command, **how, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return False
    return outcome.returncode == 0
