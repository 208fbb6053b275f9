"""Runs inside the Blender under test, real or wheel, with the extension installed: `… inside_blender.py -- COMMAND ARGUMENT…`.

install ZIP            installs and enables the extension, as the button in the preferences does
make FILE              a small scene whose camera is stated in the four values, saved
light FILE             adds lamps and a sky to FILE, and says how the render engine shall trace it
render FILE OUT        opens FILE with the extension enabled and renders its frame 1
trace FILE OUT         the same with the extension's engine
export FILE ARGUMENT…  opens FILE and runs `viewcam export` on it
viewcam ARGUMENT…      runs `viewcam` in a process of its own, as check does
apply FILE OUT JSON    the same, but turns the four values off, moves the camera away and applies the Pinhole in JSON instead
pytest PACKAGES …      runs pytest with these arguments, from the checkout, with packages from the folder PACKAGES
"""

import importlib
import json
import os
import subprocess
import sys

import bpy

EXTENSION = "bl_ext.user_default.virtual_pinhole"


def enable():
    """The package inside the installed extension, enabled."""
    if EXTENSION not in bpy.context.preferences.addons:
        bpy.ops.preferences.addon_enable(module=EXTENSION)
    return importlib.import_module(f"{EXTENSION}.viewcam_addon")


def install(zip_path):
    bpy.ops.extensions.package_install_files(filepath=zip_path, repo="user_default", enable_on_install=True)
    if EXTENSION not in bpy.context.preferences.addons or not hasattr(bpy.types.Object, "virtual_pinhole"):
        sys.exit("the extension did not install, or did not register")


def make(file):
    enable()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_monkey_add()
    bpy.ops.mesh.primitive_plane_add(size=20, location=(0, 0, -1))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    render = scene.render
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y, render.resolution_percentage = 320, 240, 50
    if hasattr(render.image_settings, "media_type"):
        render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
    render.image_settings.color_depth = "32"
    scene.cycles.samples = 1
    scene.cycles.use_denoising = False
    layer = scene.view_layers[0]
    layer.use_pass_z = layer.use_pass_position = layer.use_pass_normal = True
    values = camera.virtual_pinhole
    values.enabled = True
    values.eye, values.look_at, values.up, values.distance = (4.5, -3.25, 2.125), (0.25, 0.125, -0.5), (0.0, 0.5, 2.0), 410.5
    bpy.ops.wm.save_as_mainfile(filepath=file)


def light(file):
    _, scene = open_file(file)
    for kind, energy in (("SUN", 2.0), ("AREA", 300.0)):
        lamp = bpy.data.objects.new(kind, bpy.data.lights.new(kind, kind))
        lamp.data.energy, lamp.location = energy, (2, -3, 5)
        scene.collection.objects.link(lamp)
    scene.world = bpy.data.worlds.new("Sky")
    settings = scene.virtual_pinhole_reference
    settings.level, settings.samples, settings.seed = "PATH", 4, 7
    bpy.ops.wm.save_as_mainfile(filepath=file)


def open_file(file):
    addon = enable()
    bpy.ops.wm.open_mainfile(filepath=file)
    return addon, bpy.context.scene


def render(file, output):
    open_file(file)
    write_frame(output)


def trace(file, output):
    _, scene = open_file(file)
    scene.render.engine = "VIEWCAM"
    write_frame(output)


def export(file, *arguments):
    addon, _ = open_file(file)
    sys.exit(importlib.import_module(f"{addon.__name__}.cli").main(["export", *arguments], blend_is_open=True))


def viewcam(*arguments):
    child_process = importlib.import_module(f"{enable().__name__}.child_process")
    sys.exit(subprocess.run(child_process.viewcam(*arguments), env=child_process.environment()).returncode)


def apply(file, output, pinhole):
    addon, scene = open_file(file)
    camera = scene.camera
    camera.virtual_pinhole.enabled = False
    camera.rotation_euler, camera.location, camera.data.lens = (1.0, 2.0, 3.0), (7.0, 8.0, 9.0), 11.0
    Pinhole = importlib.import_module(f"{addon.__name__}.pinhole").Pinhole
    findings = importlib.import_module(f"{addon.__name__}.blender.camera").apply(camera, Pinhole(**json.loads(pinhole)), scene)
    if findings:
        sys.exit(f"the camera did not stick: {findings}")
    write_frame(output)


def write_frame(output):
    bpy.context.scene.frame_set(1)
    bpy.context.scene.render.filepath = output
    bpy.ops.render.render(write_still=True)


def run_pytest(packages, *arguments):
    sys.path += [packages, os.getcwd()]
    os.environ["PYTHONPATH"] = packages
    import pytest

    sys.exit(pytest.main(list(arguments)))


if __name__ == "__main__":
    command, *arguments = sys.argv[sys.argv.index("--") + 1 :]
    known = (install, make, light, render, trace, export, viewcam, apply)
    {"pytest": run_pytest, **{each.__name__: each for each in known}}[command](*arguments)
    sys.stdout.flush()
