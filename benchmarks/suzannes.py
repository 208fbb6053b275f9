"""The scene of the benchmarks: Blender's monkey, subdivided, some of it. In Blender's process."""

import bpy

from viewcam_addon.blender import camera
from viewcam_addon.pinhole import Pinhole


def three(width: int, height: int, levels: int = 3) -> tuple[bpy.types.Scene, bpy.types.Object]:
    """Smooth Suzannes with UV maps and materials; returns the scene and the camera before them."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    for index in range(3):
        bpy.ops.mesh.primitive_monkey_add(location=(2.4 * index - 2.4, 0, 0), rotation=(0, 0, 0.3 * index - 0.3))
        suzanne = bpy.context.object
        suzanne.pass_index = index + 1
        suzanne.data.materials.append(bpy.data.materials.new(f"paint {index}"))
        suzanne.data.polygons.foreach_set("use_smooth", [True] * len(suzanne.data.polygons))
        modifier = suzanne.modifiers.new("Subdivision", "SUBSURF")
        modifier.levels = modifier.render_levels = levels
    camera_object = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera_object)
    scene.render.resolution_x, scene.render.resolution_y = width, height
    pinhole = Pinhole((0.4, -6, 1.1), (0, 0, -0.1), (0, 0, 1), 1.45 * width / 1.92, width, height)
    camera.apply(camera_object, pinhole, scene)
    scene.camera = camera_object
    return scene, camera_object


def six(width: int, height: int, levels: int = 3) -> tuple[bpy.types.Scene, bpy.types.Object]:
    """Two rows of them on a floor under a sun without size: 377,858 triangles at three levels, and the edges of shadows."""
    scene, camera_object = three(width, height, levels)
    for suzanne in [each for each in scene.objects if each.type == "MESH"]:
        copy = suzanne.copy()
        copy.data = suzanne.data.copy()
        copy.location = (suzanne.location.x, 2.5, 0.6)
        copy.pass_index += 3
        scene.collection.objects.link(copy)
    bpy.ops.mesh.primitive_plane_add(size=60, location=(0, 0, -1))
    bpy.ops.object.light_add(type="SUN", rotation=(0.8, 0.3, 0.2))
    sun = bpy.context.object.data
    sun.energy, sun.angle = 3, 0
    return scene, camera_object
