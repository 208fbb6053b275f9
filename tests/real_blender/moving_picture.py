"""Runs inside a real Blender with a window: photographs the panel and the viewport while the four values move the camera.

blender --enable-event-simulate -p 0 0 1600 1000 --addons … --python moving_picture.py -- FOLDER

FOLDER : where the pictures go, frame-000.png and so on; test_tour.py makes the README's moving picture of them.
Leaves with status 0, or 5 and a traceback.
"""

import math
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parent))
import tour_step
from panel_in_a_window import move, start, window
from tour_hands import begin, photograph

FOLDER = Path(sys.argv[sys.argv.index("--") + 1])
FRAMES = 36
MOUSE_AWAY = (200, 700)
WIDTH, HEIGHT = 1310, 800  # of the window, from its upper left corner: the viewport and its sidebar


def steps():
    yield
    yield from begin()
    values = tour_step.values()
    values.enabled = True
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
