"""Makes and runs what the pages assume, with `bpy` or by `blender -b --python in_blender.py --`:

in_blender.py FOLDER                  makes the files that they speak of, small
in_blender.py FILE.blend PROGRAM.py   runs a program of theirs with a scene and its camera
"""

import os
import runpy
import sys
import traceback
from pathlib import Path

import bpy

CORNELL = Path(__file__).parents[2] / "sample_scenes" / "cornell.blend"


def save(path, width, height):
    path.parent.mkdir(exist_ok=True)
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
    render.filepath = "//frame_"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def make_shot(path):
    """A ball on a floor under a lamp, with two cameras. The scene's is called Camera, and its eye is animated."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, location=(0, 0, 1))
    bpy.ops.mesh.primitive_plane_add(size=20)
    lamp = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    scene.collection.objects.link(lamp)
    for name, eye in (("Camera", (7, -6, 4)), ("Camera.001", (-7, -6, 4))):
        camera = bpy.data.objects.new(name, bpy.data.cameras.new(name))
        scene.collection.objects.link(camera)
        scene.camera = scene.camera or camera
        values = camera.virtual_pinhole
        values.enabled = True
        values.eye, values.look_at, values.up, values.distance = eye, (0, 0, 1), (0, 0, 1), 60
    values = scene.camera.virtual_pinhole
    for frame, eye in ((1, (7, -6, 4)), (24, (6, -7, 4))):
        values.eye = eye
        values.keyframe_insert("eye", frame=frame)
    scene.frame_end = 24
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising = 1, False
    save(path, 64, 36)


def make_files(folder):
    if not hasattr(bpy.types.Object, "virtual_pinhole"):
        sys.path.append(str(CORNELL.parents[1]))
        import viewcam_addon

        viewcam_addon.register()
    make_shot(folder / "shot.blend")
    save(folder / "any.blend", 64, 36)
    bpy.ops.wm.open_mainfile(filepath=str(CORNELL))
    save(folder / "sample_scenes" / "cornell.blend", 16, 16)


def run(blend, program):
    """The status with which a program ends."""
    bpy.ops.wm.open_mainfile(filepath=os.path.abspath(blend))
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 1920, 1080  # the README's camera is for this size
    try:
        runpy.run_path(program, {"scene": scene, "camera_object": scene.camera})
    except BaseException:
        traceback.print_exc()
        return 1
    return 0


if __name__ == "__main__":
    first, *program = sys.argv[sys.argv.index("--") + 1 if "--" in sys.argv else 1 :]
    status = run(first, *program) if program else make_files(Path(first)) or 0
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)  # as __main__.py does, and why
