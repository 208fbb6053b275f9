"""Before and after a set is built: an empty file, the camera from its four values, render settings, saving.

Everything here is the same for all scenes, so that the scenes' own modules hold nothing but scenery.
"""

import math
from pathlib import Path

import bpy

from viewcam_addon.blender import camera as virtual_pinhole
from viewcam_addon.pinhole import Pinhole


def fresh_scene(name: str, width: int, height: int):
    """Start an empty file with Cycles set to modest, clean settings and a picture of that many pixels."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    scene.name = name
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.filepath = f"//{name}"
    scene.cycles.samples, scene.cycles.preview_samples = 128, 16
    scene.cycles.use_denoising = True
    scene.view_settings.view_transform = "AgX"
    scene.view_settings.look = "AgX - Medium High Contrast"
    return scene


def distance_for(field_of_view: float, pixels: int) -> float:
    """The view-plane distance, in pixels, at which that many pixels span that angle in degrees."""
    return pixels / 2 / math.tan(math.radians(field_of_view) / 2)


def state_camera(scene, eye, look_at, distance: float, up=(0, 0, 1), principal_point=None):
    """Add the scene's camera and state it by its four values. Pixels that are not square have a distance per axis."""
    data = bpy.data.cameras.new("Virtual Pinhole")
    obj = bpy.data.objects.new("Virtual Pinhole", data)
    scene.collection.objects.link(obj)
    scene.camera = obj
    data.clip_start, data.clip_end = 0.01, 1000.0
    render = scene.render
    distances = (distance, distance * render.pixel_aspect_x / render.pixel_aspect_y)
    size = {"width": render.resolution_x, "height": render.resolution_y}
    pinhole = Pinhole(eye, look_at, up, distances, principal_point=principal_point, **size)
    did_not_stick = virtual_pinhole.apply(obj, pinhole, scene)
    if did_not_stick:
        raise RuntimeError(f"{scene.name}: {' '.join(did_not_stick)}")
    return obj


def save(scene, about: str, path: Path) -> None:
    """Leave a note about the scene, look through its camera in every 3D viewport, and write a small file."""
    note = bpy.data.texts.new("About this scene")
    note.from_string(about.strip() + "\n")
    note.use_fake_user = True
    for space in (space for screen in bpy.data.screens for area in screen.areas for space in area.spaces):
        if space.type == "VIEW_3D":
            space.region_3d.view_perspective = "CAMERA"
        elif space.type == "TEXT_EDITOR":
            space.text = note
        elif space.type == "FILE_BROWSER" and space.params:
            space.params.directory = b"//"  # in place of the home folder of whoever made the file
    bpy.ops.outliner.orphans_purge(do_recursive=True)
    bpy.context.preferences.filepaths.save_version = 0
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True, check_existing=False)
