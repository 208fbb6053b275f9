"""Runs inside the Blender under test, real or wheel, with the extension installed: `… inside_blender.py -- COMMAND ARGUMENT…`.

install ZIP            installs and enables the extension, as the button in the preferences does
make FILE              a small scene whose camera is stated in the four values, saved
light FILE             adds lamps and a sky to FILE, and says how the render engine shall trace it
set_all FILE JSON      a file in which everything that the add-on stores has been set, saved; and all of it
read_all FILE JSON     writes everything that the add-on has stored in FILE
render FILE OUT        opens FILE with the extension enabled and renders its frame 1
trace FILE OUT         renders it with the extension's engine
apply FILE OUT JSON    turns the four values off, moves the camera away, applies the Pinhole in JSON instead, and renders
export FILE ARGUMENT…  opens FILE and runs `viewcam export` on it
viewcam ARGUMENT…      runs `viewcam` in a process of its own, as check does
pytest PACKAGES …      runs pytest with these arguments, from the checkout, with packages from the folder PACKAGES
"""

import importlib
import json
import os
import subprocess
import sys

import bpy

EXTENSION = "bl_ext.user_default.virtual_pinhole"
CAMERA = {"eye": (4.5, -3.25, 2.125), "look_at": (0.3, 0.1, -0.5), "up": (0.0, 0.5, 2.0), "distance": 15.25}
EXACT = [4.5, -3.25, 2.125, 0.3, 0.1, -0.5, 0.0, 0.5, 2.0, 15.25]  # float32 can't hold all of them


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
    scene = small_scene(320, 240)
    scene.render.resolution_percentage = 50
    values = scene.camera.virtual_pinhole
    values.enabled = True
    values.eye, values.look_at, values.up, values.distance = (4.5, -3.25, 2.125), (0.25, 0.125, -0.5), (0.0, 0.5, 2.0), 410.5
    bpy.ops.wm.save_as_mainfile(filepath=file)


def small_scene(width, height):
    """A monkey above a ground, in an empty file, and its camera."""
    enable()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_monkey_add()
    bpy.ops.mesh.primitive_plane_add(size=20, location=(0, 0, -1))
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    write_geometry(scene, width, height)
    return scene


def write_geometry(scene, width, height):
    """Let renders be multilayer EXRs by Cycles, of a sample a pixel, with the passes of geometry."""
    render, settings = scene.render, scene.render.image_settings
    render.engine, render.resolution_x, render.resolution_y = "CYCLES", width, height
    scene.cycles.samples, scene.cycles.use_denoising = 1, False
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format, settings.color_depth = "OPEN_EXR_MULTILAYER", "32"
    layer = scene.view_layers[0]
    layer.use_pass_z = layer.use_pass_position = layer.use_pass_normal = True


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


def set_all(file, json_file):
    scene = small_scene(96, 64)
    targets = [bpy.data.objects.new(name, None) for name in ("Eye", "Look-At")]
    for block in targets:
        scene.collection.objects.link(block)
    targets[0].location, targets[1].location = (4.75, -3.0, 2.25), (0.25, 0.0, 0.0)
    group = scene.camera.virtual_pinhole
    set_properties(group, CAMERA | {"enabled": True, "eye_target": targets[0], "look_at_target": targets[1], "pole": "HOLD"})
    group.exact = json.dumps(EXACT)
    set_properties(scene.virtual_pinhole_reference, {})
    bpy.context.view_layer.update()
    bpy.ops.wm.save_as_mainfile(filepath=file)
    read_all(file, json_file)


def set_properties(group, values):
    """Set each property of a group: to what is given, else to something that is not its default."""
    for name, value in values.items():
        setattr(group, name, value)
    for each in group.bl_rna.properties:
        is_free = not (each.is_readonly or each.is_hidden or each.type in ("POINTER", "STRING"))
        if not is_free or each.identifier in (*values, "roll"):  # roll is read off the others
            continue
        setattr(group, each.identifier, another(each))


def another(each):
    """A value of a property that is not its default."""
    if each.type == "ENUM":
        return next(item.identifier for item in each.enum_items if item.identifier != each.default)
    if getattr(each, "is_array", False):
        return [value + 1 + i for i, value in enumerate(each.default_array)]
    if each.type == "BOOLEAN":
        return not each.default
    value = each.default + 1 if each.type == "INT" else each.default * 1.5 + 0.125
    return value if value <= each.hard_max else (each.default + each.hard_min) / 2


def read_all(file, json_file):
    open_file(file)
    result = {}
    for block in (bpy.data.objects["Camera"], bpy.data.cameras["Camera"], bpy.context.scene):
        for name in (each.identifier for each in block.bl_rna.properties if each.identifier.startswith("virtual_pinhole")):
            value = getattr(block, name)
            if isinstance(value, bpy.types.PropertyGroup):
                members = (each.identifier for each in value.bl_rna.properties if each.identifier not in ("rna_type", "name"))
                result |= {f"{name}.{member}": plain(getattr(value, member)) for member in members}
            else:
                result[name] = plain(value)
    with open(json_file, "w") as stream:
        json.dump(result, stream)


def plain(value):
    """The value as JSON has it: a block by its name, a vector as a list."""
    if isinstance(value, bpy.types.ID):
        return value.name
    return value if value is None or isinstance(value, str | bool | int | float) else list(value)


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
    known = (install, make, light, set_all, read_all, render, trace, apply, export, viewcam)
    {"pytest": run_pytest, **{each.__name__: each for each in known}}[command](*arguments)
    sys.stdout.flush()
