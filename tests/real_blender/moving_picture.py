"""Runs inside a real Blender with a window: photographs the panel and the viewport while the four values move the camera.

blender --enable-event-simulate -p 0 0 1600 1000 --addons … --python moving_picture.py -- FOLDER

FOLDER : where the pictures go, frame-000.png and so on; test_tour.py makes the README's moving picture of them.
Leaves with status 0, or 5 and a traceback.
"""

import math
import sys
from pathlib import Path

import bpy
from mathutils import Euler

sys.path.append(str(Path(__file__).parent))
import tour_step
from panel_in_a_window import move, open_the_panels, region, start, window
from tour_hands import photograph

FOLDER = Path(sys.argv[sys.argv.index("--") + 1])
FRAMES = 36
MOUSE_AWAY = (200, 700)
WIDTH, HEIGHT = 1310, 800  # of the window, from its upper left corner: the viewport and its sidebar


def steps():
    yield
    tour_step.make_the_scene()
    bpy.context.preferences.system.viewport_aa = "OFF"  # drawn in software
    view, _ = region("VIEW_3D", "WINDOW")
    space = view.spaces.active
    space.shading.color_type = "MATERIAL"
    space.region_3d.view_rotation = Euler((math.radians(66), 0, math.radians(75))).to_quaternion()
    space.region_3d.view_location, space.region_3d.view_distance = (1.2, -2.2, 1.2), 13
    yield from open_the_panels()
    camera = bpy.data.objects["Camera"]
    values = camera.virtual_pinhole
    values.enabled = True
    window().view_layer.objects.active = camera
    camera.select_set(True)
    move(*MOUSE_AWAY)
    for number in range(FRAMES):
        turn = 2 * math.pi * number / FRAMES
        values.eye = (4 + 1.5 * math.sin(turn), -6 + 1.5 * math.cos(turn), 3.5)
        values.look_at = (0.8 * math.sin(2 * turn), 0, 1)
        values.up = (0.25 * math.sin(turn), 0, 1)
        values.distance = 2000 + 600 * math.sin(turn)
        for area in window().screen.areas:
            area.tag_redraw()
        for _ in range(3):
            yield
        photograph((0, window().height - HEIGHT, WIDTH, HEIGHT), FOLDER / f"frame-{number:03d}.png", 60)
    print("done: the moving picture", flush=True)


start(steps, interval=0.01)
