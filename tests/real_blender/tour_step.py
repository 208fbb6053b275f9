"""A step of the tour, the scene that it starts in, and what is compared.

A step is done by hand in a window (tour_in_a_window.py) and by script in a Blender without one (tests/blender/test_tour.py);
the check is the same. So the mouse and the operators can't drift apart, and docs/artists.md shows what is tested.
"""

import importlib
import math

import bpy
import numpy as np

SIZE = (640, 360)
# A part of the largest area: below there is nothing to see, since the window is as tall as the panel with all of its parts
# open.
UPPER_PART = (0.0, 0.35, 1.0, 1.0)


class Step:
    """One thing that an artist does.

    picture : file in docs/images/artists, taken when the step is done.
    shows : the part of the window, "sidebar", "area" (the largest), "camera view", or where in the largest area, as shares of
        it: left, bottom, right and top.
    with_before : the picture shows on its left what was there before.
    edits : the number of undo steps that it makes; each is undone and redone.
    needs_a_window : there is nothing to it without one.
    """

    picture: str | None = None
    shows = "sidebar"
    with_before = False
    edits = 1
    needs_a_window = False

    def prepare(self):
        """By script: what was there before."""

    def by_hand(self):
        """Steps by mouse and keys."""
        yield

    def by_script(self):
        """The step by properties and operators."""

    def check(self):
        """Fail unless what the step is for has happened."""

    def pose_for_the_picture(self):
        """Steps that bring what the picture is of onto the screen; nothing in them is checked or undone."""
        yield

    def after_the_picture(self):
        """Steps that take it from the screen again."""
        yield

    def tidy(self):
        """By script: leave the window as the next step wants it."""


def camera():
    return bpy.data.objects["Camera"]


def values():
    return camera().virtual_pinhole


def room(name):
    """A module of viewcam_addon.blender, whatever the name is under which Blender has the add-on."""
    package = bpy.types.VIEWCAM_PT_sidebar.__module__.removesuffix(".interface.panel")
    return importlib.import_module(f"{package}.{name}")


def is_at_its_values():
    """Fail unless the camera stands and looks as its values say."""
    bpy.context.view_layer.update()
    eye, look_at, _, distance = values().numbers()
    evaluated = camera().evaluated_get(bpy.context.evaluated_depsgraph_get())
    matrix = np.array(evaluated.matrix_world)
    ahead = np.subtract(look_at, eye)
    # float32: the coordinates are below 20, and a matrix entry is 17 roundings off at most (findings.py).
    np.testing.assert_allclose(matrix[:3, 3], eye, atol=9 * 2**-24 * 20)
    np.testing.assert_allclose(-matrix[:3, 2], ahead / np.linalg.norm(ahead), atol=17 * 2**-24)
    np.testing.assert_allclose(evaluated.data.lens, distance * evaluated.data.sensor_width / SIZE[0], rtol=3 * 2**-24)


def axes():
    """(3, 3): u, v and w of the camera as columns."""
    return np.array(camera().evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world)[:3, :3]


def state():
    """Everything that undo has to bring back, bit for bit, as a flat dict."""
    scene, render = bpy.context.scene, bpy.context.scene.render
    result = {"frame": scene.frame_current, "camera": getattr(scene.camera, "name", None)}
    result |= {name: getattr(render, name) for name in ("resolution_x", "resolution_y", "pixel_aspect_x", "pixel_aspect_y")}
    for block in bpy.context.scene.objects:
        result[block.name] = tuple(number for row in block.matrix_basis for number in row)
        if block.type == "CAMERA":
            result |= {f"{block.name} {name}": _plain(block.virtual_pinhole, name) for name in _stored(block.virtual_pinhole)}
            data = block.data
            result[data.name + "'s lens"] = (data.lens, data.shift_x, data.shift_y, data.sensor_width, data.sensor_height)
            action = block.animation_data and block.animation_data.action
            result[f"{block.name} action"] = action and action.name
            result[f"{block.name} keyframes"] = tuple(map(_keyframes, (block, data)))
            result[f"{block.name} constraints"] = tuple(each.name for each in block.constraints)
    return result


def _keyframes(block):
    return tuple(
        (curve.data_path, curve.array_index, tuple(tuple(point.co) for point in curve.keyframe_points))
        for curve in room("versions").action_curves(block)
    )


def _stored(group):
    """The roll is told from the others, as the preferences count it."""
    return [each.identifier for each in group.bl_rna.properties if each.identifier not in ("rna_type", "name", "roll")]


def _plain(group, name):
    value = getattr(group, name)
    if isinstance(value, bpy.types.ID):
        return value.name
    return value if isinstance(value, (int, float, str)) or value is None else tuple(value)


def differing(first, second):
    """The differences between two states, in words."""
    return {key: (first.get(key), second.get(key)) for key in first.keys() | second.keys() if first.get(key) != second.get(key)}


def make_the_scene():
    """A floor, a monkey, a ball and a cone of plain colors, a sun and a camera; the camera is active."""
    for block in list(bpy.data.objects):
        bpy.data.objects.remove(block)
    _mesh(bpy.ops.mesh.primitive_plane_add, "Floor", (0.55, 0.52, 0.48), size=9)
    _mesh(bpy.ops.mesh.primitive_monkey_add, "Suzanne", (0.1, 0.45, 0.42), location=(0, 0, 1), rotation=(-0.3, 0, 0))
    _mesh(bpy.ops.mesh.primitive_uv_sphere_add, "Ball", (0.85, 0.5, 0.1), radius=0.5, location=(2, -1, 0.5))
    _mesh(bpy.ops.mesh.primitive_cone_add, "Cone", (0.7, 0.2, 0.15), radius1=0.6, depth=1.6, location=(-2, 0.5, 0.8))
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.rotation_euler = 3, (0.7, 0.2, 0.4)
    stands = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    stands.location, stands.rotation_euler = (5, -6, 4), (math.radians(66), 0, math.radians(40))
    scene = bpy.context.scene
    for block in (sun, stands):
        scene.collection.objects.link(block)
    scene.camera = stands
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.frame_start, scene.frame_end = 1, 20
    scene.cycles.samples, scene.cycles.use_denoising = 4, False
    select("Camera")


def _mesh(add, name, color, **where):
    add(**where)
    block = bpy.context.object
    block.name = name
    if name != "Floor":
        bpy.ops.object.shade_smooth()
    material = bpy.data.materials.new(name)
    if not material.node_tree:  # new materials have one from 5.0 on
        material.use_nodes = True
    material.diffuse_color = (*color, 1)
    tree = material.node_tree
    tree.nodes.clear()
    diffuse, output = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeOutputMaterial")
    diffuse.inputs["Color"].default_value = (*color, 1)
    tree.links.new(diffuse.outputs["BSDF"], output.inputs["Surface"])
    block.data.materials.append(material)


def select(*names):
    """Select these objects; the first becomes the active one."""
    bpy.context.view_layer.update()  # it may hold on to what was removed
    for block in bpy.context.view_layer.objects:
        block.select_set(block.name in names)
    bpy.context.view_layer.objects.active = bpy.data.objects[names[0]]
    bpy.context.view_layer.update()
