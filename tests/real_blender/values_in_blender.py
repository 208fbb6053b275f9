"""Runs inside the Blender under test, with the extension installed: `… values_in_blender.py -- COMMAND FILE JSON`.

make FILE JSON   a file in which everything that the add-on stores has been set, saved; and all of it
read FILE JSON   the same of an existing file
"""

import json
import sys

import bpy

EXTENSION = "bl_ext.user_default.virtual_pinhole"
CAMERA = {"eye": (4.5, -3.25, 2.125), "look_at": (0.3, 0.1, -0.5), "up": (0.0, 0.5, 2.0), "distance": 15.25}
EXACT = [4.5, -3.25, 2.125, 0.3, 0.1, -0.5, 0.0, 0.5, 2.0, 15.25]  # float32 can't hold all of them


def make(file, json_file):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_monkey_add()
    bpy.ops.mesh.primitive_plane_add(size=20, location=(0, 0, -1))
    targets = [bpy.data.objects.new(name, None) for name in ("Eye", "Look-At")]
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    for block in (*targets, camera):
        scene.collection.objects.link(block)
    targets[0].location, targets[1].location = (4.75, -3.0, 2.25), (0.25, 0.0, 0.0)
    small_picture(scene)
    scene.camera = camera
    group = camera.virtual_pinhole
    set_all(group, CAMERA | {"enabled": True, "eye_target": targets[0], "look_at_target": targets[1], "pole": "HOLD"})
    group.exact = json.dumps(EXACT)
    set_all(scene.virtual_pinhole_reference, {})
    bpy.context.view_layer.update()
    bpy.ops.wm.save_as_mainfile(filepath=file)
    read(file, json_file)


def small_picture(scene):
    render = scene.render
    render.engine, render.resolution_x, render.resolution_y = "CYCLES", 96, 64
    scene.cycles.samples, scene.cycles.use_denoising = 1, False
    if hasattr(render.image_settings, "media_type"):
        render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR_MULTILAYER", "32"
    layer = scene.view_layers[0]
    layer.use_pass_z = layer.use_pass_position = layer.use_pass_normal = True


def set_all(group, values):
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


def read(file, json_file):
    """All that the add-on has in the file's blocks."""
    bpy.ops.wm.open_mainfile(filepath=file)
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


if __name__ == "__main__":
    bpy.ops.preferences.addon_enable(module=EXTENSION)
    command, *arguments = sys.argv[sys.argv.index("--") + 1 :]
    {"make": make, "read": read}[command](*arguments)
    sys.stdout.flush()
