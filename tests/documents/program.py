"""Runs a program of the pages as they assume it: `python program.py FILE.blend PROGRAM.py`, with a scene and its camera."""

import os
import runpy
import sys
import traceback

import bpy

if __name__ == "__main__":
    blend, program = sys.argv[-2:]
    bpy.ops.wm.open_mainfile(filepath=os.path.abspath(blend))
    scene, status = bpy.context.scene, 0
    scene.render.resolution_x, scene.render.resolution_y = 1920, 1080  # the README's camera is for this size
    try:
        runpy.run_path(program, {"scene": scene, "camera_object": scene.camera})
    except BaseException:
        traceback.print_exc()
        status = 1
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)  # as __main__.py does, and why
