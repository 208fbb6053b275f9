"""The stage of all sweeps that ask Blender: an empty file with one camera in it, and a reader of its pictures."""

import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import bpy

from viewcam_addon import image
from viewcam_addon.blender import ensure_registered


def empty_stage(width: int = 1000, height: int = 1000) -> tuple[bpy.types.Scene, bpy.types.Object]:
    """A fresh scene of so many pixels, and its camera. Whatever was open is gone."""
    ensure_registered()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = width, height
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    bpy.context.view_layer.update()
    return scene, camera


def read_elsewhere(path: Path) -> image.Image:
    """An EXR, read in a process without Blender, which has an OpenEXR library of its own."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        return pool.submit(image.read, path).result()
