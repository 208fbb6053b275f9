"""Scripts that place a camera: what is read of their text is the camera that Blender makes by running them."""

import math

import pytest

bpy = pytest.importorskip("bpy")

import mathutils
import numpy as np

from viewcam_addon import cameras
from viewcam_addon.blender import camera as blender_camera

FLOAT32 = 2.0**-24
SIZE = "scene.render.resolution_x = 1920\nscene.render.resolution_y = 1080\n"
NEW = """
data = bpy.data.cameras.new("Shot")
obj = bpy.data.objects.new("Shot", data)
scene.collection.objects.link(obj)
bpy.context.scene.camera = bpy.data.objects["Shot"]
"""
SCRIPTS = {
    "new": NEW + SIZE + "obj.location = (7.36, -6.93, 4.96)\nobj.rotation_euler = (1.109, 0.1, 0.815)\ndata.lens = 35",
    "of an order": NEW + SIZE + "obj.rotation_mode = 'ZXY'\nobj.location = (1, 2, 3)\nobj.rotation_euler = (1.1, 0.3, -2)",
    "an Euler": NEW + SIZE + "obj.location = Vector((1, 2, 3))\nobj.rotation_euler = Euler((0.4, 0.2, math.pi / 3), 'ZXY')",
    "coordinates": NEW
    + SIZE
    + "fov = 50\nscene.camera.data.angle = math.radians(fov)\nscene.camera.location.x = 1\nscene.camera.location.y = 2\n"
    + "scene.camera.location.z = 30\nscene.camera.rotation_euler[0] = 0.1\n"
    + "scene.camera.rotation_euler[1] = 10 * math.pi / 180\nscene.camera.rotation_euler[2] = math.radians(20)",
    "added": "bpy.ops.mesh.primitive_cube_add(location=(9, 9, 9))\nbpy.ops.object.camera_add(location=(1, 2, 3), "
    "rotation=(math.radians(60), 0, math.radians(-30)))\nscene.camera = bpy.context.object\n" + SIZE,
    "active": "bpy.ops.object.camera_add()\nob = bpy.context.object\nscene.camera = ob\nob.location = (1, 2, 3)\n"
    "ob.rotation_euler = (1.2, 0, 2)\nob.data.sensor_fit = 'VERTICAL'\nob.data.sensor_height = 30\nob.data.angle = 0.7\n"
    + SIZE,
    "quaternion": NEW
    + SIZE
    + "obj.rotation_mode = 'QUATERNION'\nobj.rotation_quaternion = Quaternion((0.8, 0.6, 0, 0))\nobj.location = (0, -5, 1)",
    "axis and angle": NEW
    + SIZE
    + "obj.rotation_mode = 'AXIS_ANGLE'\nobj.rotation_axis_angle = (1.2, 2, 0, 1)\nobj.location = (0, -5, 1)",
    "shifted and stretched": NEW + SIZE + "obj.location = (0, -9, 1)\nobj.rotation_euler = (1.5, 0, 0)\ndata.shift_x = 0.1\n"
    "data.shift_y = -0.2\ndata.sensor_width = 24\nscene.render.pixel_aspect_y = 2\nscene.render.resolution_percentage = 50",
    "without brackets": NEW
    + SIZE
    + "place = 7.36, -6.93, 4.96\nobj.location = place\nobj.rotation_euler[:] = 1.109, 0.1, 0.815\ndata.lens = 35",
    "something else, too": NEW + SIZE + "cube = bpy.data.objects.new('Cube', None)\ncube.location = (9, 9, 9)\n"
    "obj.location = (1, 2, 3)\nobj.rotation_euler = (1, 0, 0)  # down\ncube.rotation_euler = (2, 2, 2)",
}


@pytest.mark.parametrize("name", SCRIPTS)
def test_what_is_read_of_a_script_is_the_camera_that_blender_makes(fresh_blender, name):
    scene = bpy.context.scene
    names = {each: getattr(mathutils, each) for each in ("Euler", "Quaternion", "Vector")}
    exec(SCRIPTS[name], {"bpy": bpy, "math": math, "scene": scene, **names})
    bpy.context.view_layer.update()
    expected = blender_camera.read(scene.camera, scene)
    (camera,) = cameras.read(SCRIPTS[name])
    ours = camera.pinhole
    assert (ours.width, ours.height) == (expected.width, expected.height)
    assert ours.distance == pytest.approx(expected.distance, rel=8 * FLOAT32)
    assert ours.principal_point == pytest.approx(expected.principal_point, abs=4096 * FLOAT32)
    assert ours.eye == pytest.approx(expected.eye, rel=2 * FLOAT32)
    off = np.abs(np.array(ours.axes()) - np.array(expected.axes())).max()
    assert off < 16 * FLOAT32, f"{name}: the axes differ by {off:.2g}"


def test_what_blenders_console_shows_of_a_camera_is_that_camera(fresh_blender):
    exec(SCRIPTS["of an order"], {"bpy": bpy, "scene": bpy.context.scene})
    obj = bpy.context.scene.camera
    bpy.context.view_layer.update()
    expected = blender_camera.read(obj, bpy.context.scene)
    options = cameras.Options(view_plane=expected.plane)
    of_console = f">>> C.object.location\n{obj.location!r}\n\n>>> C.object.rotation_euler\n{obj.rotation_euler!r}\n"
    printed = f"location: {obj.location}\nrotation_euler: {obj.rotation_euler}\n"
    for text, digits in ((of_console, 16 * FLOAT32), (printed, 1e-4)):
        (camera,) = cameras.read(text, options=options)
        assert np.abs(np.array(camera.pinhole.axes()) - np.array(expected.axes())).max() < digits
