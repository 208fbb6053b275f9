"""Renders the like of a photograph, for the page's picture of Match Photo: `python photo_of_a_room.py PHOTO.png`, with bpy.

The room is sample_scenes/materials.py's, through a camera that sees edges along all three axes.
"""

import sys
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "sample_scenes")]
import materials

import viewcam_addon
from viewcam_addon.blender import camera
from viewcam_addon.pinhole import Pinhole

VIEW = Pinhole((-1.7, -1.9, 1.75), (0.75, 1.3, 0.95), (0, 0, 1), 800, width=960, height=600)


def main():
    viewcam_addon.register()
    try:
        scene = materials.BUILDERS["interior"]()
        scene.render.resolution_x, scene.render.resolution_y = VIEW.width, VIEW.height
        camera.apply(scene.camera, VIEW, scene)
        scene.cycles.samples, scene.cycles.use_denoising = 48, True
        scene.render.filepath = sys.argv[1]
        bpy.ops.render.render(write_still=True)
    finally:
        viewcam_addon.unregister()


if __name__ == "__main__":
    main()
