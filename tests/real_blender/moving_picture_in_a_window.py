"""Runs inside a real Blender with a window: photographs handles and fields that the mouse drags, and the camera that follows.

blender --enable-event-simulate -p 0 0 1600 1000 --addons … --python moving_picture_in_a_window.py -- FOLDER

FOLDER : a folder for the pictures, frame-000.png and so on; test_window.py makes the README's moving picture of them.

Leaves with status 0, or 5 and a traceback.
"""

import sys
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).parent))
import tour_step
from hands import VIEWPORT, begin, call, find, move, on_screen, photograph, region, show_the_panel, start, window

FOLDER = Path(sys.argv[sys.argv.index("--") + 1])
WIDTH = 1310  # the viewport's and its sidebar's

_taken = []
_mouse = [500, 250]


def take():
    """Steps that take the next picture, once the window shows what the mouse has done."""
    for area in window().screen.areas:
        area.tag_redraw()
    for _ in range(3):
        yield
    area, _ = region(*VIEWPORT)
    path = FOLDER / f"frame-{len(_taken):03d}.png"
    photograph((0, area.y, WIDTH, area.height), path, 60, _mouse)
    _taken.append(path)


def glide(place, pictures):
    """Steps that bring the mouse to a place, faster in the middle of its way."""
    start_of_way = tuple(_mouse)
    for number in range(1, pictures + 1):
        share = number / pictures
        eased = share * share * (3 - 2 * share)
        _mouse[:] = [a + eased * (b - a) for a, b in zip(start_of_way, place, strict=True)]
        move(*_mouse)
        yield
        yield from take()


def drag(place, *ways, pictures=6):
    """Steps that drag what is at a place, by so many pixels each way."""
    yield from glide(place, pictures)
    button("PRESS")
    yield
    for right, up in ways:
        yield from glide((_mouse[0] + right, _mouse[1] + up), pictures)
    button("RELEASE")
    yield
    yield from take()


def button(value):
    window().event_simulate(type="LEFTMOUSE", value=value, x=int(_mouse[0]), y=int(_mouse[1]))


def steps():
    yield
    bpy.context.preferences.view.smooth_view = 0
    bpy.context.preferences.view.show_tooltips = False
    bpy.context.preferences.inputs.use_mouse_continuous = False  # it would hide the pointer
    yield from begin(show_the_panel)
    values = tour_step.values()
    values.enabled = True
    values.eye, values.look_at, values.distance = (4, -6, 3.5), (0, 0, 1), 1500
    yield
    lens = yield from find("virtual_pinhole.focal_length")
    move(*_mouse)
    yield
    yield from take()
    yield from drag(on_screen(values.look_at), (70, 60), (20, -110), (-90, 50))
    yield from drag(on_screen(values.eye), (60, -60), (-90, 90))
    yield from drag(lens, (-45, 0))
    call(bpy.ops.view3d.view_camera)
    yield from take()
    yield from drag(lens, (60, 0))
    print("done: the moving picture", flush=True)


start(steps)
