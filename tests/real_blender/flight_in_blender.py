"""Runs inside the Blender under test, with the extension installed: `… flight_in_blender.py -- COMMAND ARGUMENT…`.

make FILE JSON      a flight of 250 frames, saved; and the Pinhole of each frame: as it is stated and as the live camera stands
render FILE FOLDER  renders each fifth frame as F12 does
bake FILE BAKED     bakes all cameras, and saves; prints what the report says
"""

import dataclasses
import importlib
import json
import sys
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).parent))
from inside_blender import enable, write_geometry

FRAMES = range(1, 251)
SECOND = 126  # the first frame of the second camera


def room(name):
    """A module of the installed extension, enabled."""
    return importlib.import_module(f"{enable().__name__}.{name}")


def make(file, json_file):
    cameras, datablocks = room("blender.camera"), room("blender.datablocks")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=5, radius=30)
    small_exact_pictures(scene)
    tracker, holder = add_camera("Tracker"), add_camera("Holder")
    track_over(tracker, add_moving_target(), middle=63)
    hold_over(holder, middle=188)
    scene.frame_start, scene.frame_end = FRAMES[0], FRAMES[-1]
    for frame, camera in ((FRAMES[0], tracker), (SECOND, holder)):
        scene.timeline_markers.new(camera.name, frame=frame).camera = camera
    scene.frame_set(1)
    bpy.ops.wm.save_as_mainfile(filepath=file)
    pinholes = {}
    for frame in FRAMES:
        scene.frame_set(frame)
        camera = datablocks.render_camera(scene)
        both = cameras.stated(camera, scene), cameras.read(camera, scene)
        pinholes[frame] = [dataclasses.asdict(pinhole) for pinhole in both]
    with open(json_file, "w") as stream:
        json.dump(pinholes, stream)


def small_exact_pictures(scene):
    write_geometry(scene, 64, 36)
    scene.render.use_compositing = scene.render.use_sequencer = False
    cycles = scene.cycles
    cycles.use_adaptive_sampling = False
    cycles.pixel_filter_type, cycles.filter_width = "BLACKMAN_HARRIS", 0.01


def add_camera(name):
    camera = bpy.data.objects.new(name, bpy.data.cameras.new(name))
    bpy.context.scene.collection.objects.link(camera)
    camera.virtual_pinhole.enabled = True
    return camera


def add_moving_target():
    """An empty on a dolly that drives and turns."""
    dolly, target = (bpy.data.objects.new(name, None) for name in ("Dolly", "Target"))
    for block in (dolly, target):
        bpy.context.scene.collection.objects.link(block)
    target.parent, target.location = dolly, (1.5, 0.0, 0.5)
    for frame, x, turn in ((1, -4.0, 0.0), (60, 1.0, 2.0), (130, 5.0, -1.0), (250, -4.0, 3.0)):
        dolly.location, dolly.rotation_euler = (x, x / 3, 0.0), (0.1 * turn, 0.0, turn)
        dolly.keyframe_insert("location", frame=frame)
        dolly.keyframe_insert("rotation_euler", frame=frame)
    return target


def track_over(camera, target, middle):
    """Canonical axes and a target: straight above it, exactly along up, at the frame `middle`."""
    group, scene = camera.virtual_pinhole, bpy.context.scene
    group.pole, group.look_at_target = "CANONICAL", target
    scene.frame_set(middle)
    above = (*target.matrix_world.translation[:2], 9.0)
    flight = [(1, (9, -7, 3), (0, 0, 1), 60), (30, (4, -5, 8), (0.3, 0, 1), 45), (middle, above, (0, 0, 1), 70)]
    flight += [(100, (-6, 5, 7), (0, 0.4, 1), 100), (180, (8, 8, 2), (0, 0, 1), 50), (250, (-9, 4, 5), (0.2, 0.2, 1), 80)]
    key(group, flight)


def hold_over(camera, middle):
    """The roll is held through the pole, which is at the frame `middle`; eye, look-at, up and d are keyed."""
    group = camera.virtual_pinhole
    group.pole = "HOLD"
    for frame, place in ((1, (2, 1, 0)), (middle, (0.25, 0.5, 0)), (250, (-3, 0, 1))):
        group.look_at = place
        group.keyframe_insert("look_at", frame=frame)
    flight = [(1, (5, -8, 2), (0, 0, 1), 55), (126, (1, -9, 6), (0.1, 0, 1), 90), (middle, (0.25, 0.5, 10), (0, 0, 1), 48)]
    flight += [(250, (-1, 9, 5), (0, 0.2, 1), 120)]
    key(group, flight)


def key(group, flight):
    for frame, eye, up, distance in flight:
        group.eye, group.up, group.distance = eye, up, distance
        for name in ("eye", "up", "distance"):
            group.keyframe_insert(name, frame=frame)


def render(file, folder):
    room("blender.camera")
    bpy.ops.wm.open_mainfile(filepath=file)
    scene = bpy.context.scene
    for frame in FRAMES[2::5]:
        scene.frame_set(frame)
        scene.render.filepath = f"{folder}/{frame:04d}.exr"
        bpy.ops.render.render(write_still=True)


def bake(file, baked):
    room("blender.camera")
    bpy.ops.wm.open_mainfile(filepath=file)
    scene = bpy.context.scene
    cameras = [block for block in scene.objects if block.type == "CAMERA"]
    for camera in cameras:
        camera.select_set(True)
    bpy.context.view_layer.objects.active = cameras[0]
    bpy.ops.viewcam.bake_camera(selected=True)
    if any(camera.virtual_pinhole.enabled for camera in cameras):
        sys.exit("not all cameras were baked")
    bpy.ops.wm.save_as_mainfile(filepath=baked)


if __name__ == "__main__":
    command, *arguments = sys.argv[sys.argv.index("--") + 1 :]
    {each.__name__: each for each in (make, render, bake)}[command](*arguments)
    sys.stdout.flush()
