"""Runs inside a real Blender with a window: a picture rendered by a known camera is matched by dragging along its edges.

blender --enable-event-simulate -p 0 0 1600 1000 --addons … --python photo_in_a_window.py -- FOLDER [PICTURES]

FOLDER : where the rendered picture goes. PICTURES : where pictures of the window go; without it none are taken.
Leaves with status 0, or 5 and a traceback.
"""

import importlib
import math
import sys
from pathlib import Path

import bpy
import numpy as np
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector

sys.path.append(str(Path(__file__).parent))
from panel_in_a_window import NOWHERE, move, press, region, start, window
from tour_hands import photograph

FOLDER, *PICTURES = map(Path, sys.argv[sys.argv.index("--") + 1 :])
ADDON = "bl_ext.user_default.virtual_pinhole"
BOX = (1.5, 1.0, 0.75)  # half its sides
# (axis, start, end) in units of BOX.
EDGES = (
    ("X", (-1, -1, 1), (1, -1, 1)),
    ("X", (-1, 1, 1), (1, 1, 1)),
    ("X", (-1, -1, -1), (1, -1, -1)),
    ("Y", (1, -1, 1), (1, 1, 1)),
    ("Y", (-1, -1, 1), (-1, 1, 1)),
    ("Y", (1, -1, -1), (1, 1, -1)),
)


def make():
    """A box, rendered through a camera that is then turned away and given another lens."""
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    yield
    scene = bpy.context.scene
    cube = bpy.data.objects["Cube"]
    cube.scale = BOX
    camera = bpy.data.objects["Camera"]
    camera.location, camera.rotation_euler = (5.5, -6.5, 4.5), (math.radians(61), 0.02, math.radians(40))
    camera.data.lens = 42.0
    scene.render.engine, scene.render.filepath = "BLENDER_WORKBENCH", str(FOLDER / "photo.png")
    scene.render.resolution_x, scene.render.resolution_y = 960, 540
    bpy.context.view_layer.update()
    with bpy.context.temp_override(window=window()):
        bpy.ops.render.render(write_still=True)
    yield
    matrix = np.array(camera.matrix_world)
    places = [[np.multiply(end, BOX) for end in edge[1:]] for edge in EDGES]
    seen = [[world_to_camera_view(scene, camera, Vector(end))[:2] for end in pair] for pair in places]
    camera.rotation_euler, camera.data.lens = (math.radians(70), 0, math.radians(25)), 85.0
    background = camera.data.background_images.new()
    background.image = bpy.data.images.load(scene.render.filepath)
    camera.data.show_background_images, background.alpha = True, 1.0
    cube.hide_set(True)
    window().view_layer.objects.active = camera
    bpy.context.view_layer.update()
    return camera, matrix, seen


def steps():
    yield
    matching = importlib.import_module(f"{ADDON}.viewcam_addon.blender.interface.photo_matching")
    kept = importlib.import_module(f"{ADDON}.viewcam_addon.blender.interface.kept")
    camera, matrix, seen = yield from make()
    area, part = region("VIEW_3D", "WINDOW")
    area.spaces.active.region_3d.view_perspective = "CAMERA"
    for _ in range(5):
        yield
    with bpy.context.temp_override(window=window()):
        bpy.ops.ed.undo_push(message="before")
    before = kept.state(camera)

    def begin():
        move(*NOWHERE)
        yield
        with bpy.context.temp_override(window=window(), area=area, region=part):
            bpy.ops.viewcam.match_photo("INVOKE_DEFAULT")
        for _ in range(5):
            yield
        assert matching._drawn is not None and matching._drawn.frame is not None

    def draw():
        left, bottom, right, top = matching._drawn.frame
        for (axis, *_), ends in zip(EDGES, seen, strict=True):
            (x0, y0), (x1, y1) = [(part.x + left + u * (right - left), part.y + bottom + v * (top - bottom)) for u, v in ends]
            press(axis, *NOWHERE)
            yield
            move(x0, y0)
            yield
            window().event_simulate(type="LEFTMOUSE", value="PRESS", x=int(x0), y=int(y0))
            yield
            for share in (0.5, 1.0):
                move(x0 + share * (x1 - x0), y0 + share * (y1 - y0))
                yield
            window().event_simulate(type="LEFTMOUSE", value="RELEASE", x=int(x1), y=int(y1))
            yield
        for _ in range(4):
            yield

    yield from begin()
    yield from draw()
    assert len(matching._drawn.drawing.along) == len(EDGES), matching._drawn.drawing.along
    if PICTURES:
        photograph((0, 0, window().width, window().height), PICTURES[0] / "photo_match.png")
    press("ESC", *NOWHERE)
    yield
    yield
    assert matching._drawn is None and kept.state(camera) == before, "Escape leaves something"
    print("done: escape", flush=True)

    yield from begin()
    yield from draw()
    result = matching._drawn.result
    assert result is not None, matching._drawn.sentence
    press("RET", *NOWHERE)
    yield
    yield
    bpy.context.view_layer.update()
    low, high = result.distance_between
    off = np.degrees(np.arccos(np.clip((np.array(camera.matrix_world)[:3, 2] @ matrix[:3, 2]), -1, 1)))
    print(f"{camera.data.lens:.2f} mm of 42, {off:.3f}° off, d from {low:.1f} to {high:.1f} px", flush=True)
    true = 42.0 / 36.0 * 960
    assert abs(result.pinhole.distance[0] - true) < 3 * (high - low) / 2, "the lens is beyond three of its errors"
    assert off < 3 * math.degrees(result.pixels["look_at"] / true), "the view is beyond three of its errors"
    press("Z", *NOWHERE, ctrl=True)
    yield
    yield
    camera = bpy.data.objects["Camera"]
    assert kept.state(camera) == before, "one undo does not take it back"
    print("done: match the photo", flush=True)


start(steps)
