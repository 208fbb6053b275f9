"""The tools of what runs inside a real Blender with a window: steps of mouse and keyboard, and the camera that they act on.

A timer takes one step at a time, so that Blender handles the events and draws in between. Buttons are found by tour_hands.py.
"""

import os
import sys
import time
import traceback

import bpy
import numpy as np

KEYS = {"-": "MINUS", "0": "ZERO", "1": "ONE", "3": "THREE", "5": "FIVE", "7": "SEVEN", ".": "PERIOD"}
# Of the interface and of all places here: a window of half the width and height is drawn in software in a third of the time.
SCALE = float(os.environ.get("VIEWCAM_UI_SCALE", "1"))
NOWHERE = (int(600 * SCALE), int(500 * SCALE))  # a place in the 3D viewport
# A step that yields these seconds leaves the processors to what it waits for: where events are simulated, Blender never sleeps.
WAITING = 0.1
ROW = 9  # pixels between two looks for a button, less than half its height


def window():
    return bpy.context.window_manager.windows[0]


def region(area_type, region_type):
    area = next(area for area in window().screen.areas if area.type == area_type)
    return area, next(region for region in area.regions if region.type == region_type)


def camera():
    return bpy.data.objects["Camera"]


def values():
    return camera().virtual_pinhole


def move(x, y):
    window().event_simulate(type="MOUSEMOVE", value="NOTHING", x=int(x), y=int(y))


def press(key, x, y, **modifiers):
    for value in ("PRESS", "RELEASE"):
        window().event_simulate(type=key, value=value, x=int(x), y=int(y), **modifiers)


def click(x, y):
    """Steps: a button has to notice the mouse before it takes the click, and Blender to draw after it."""
    move(x, y)
    yield
    press("LEFTMOUSE", x, y)
    yield
    yield


def state():
    matrix = np.array(camera().evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world)
    return values().numbers(), matrix, camera().data.lens


def is_at_its_values():
    eye, look_at, _, distance = values().numbers()
    _, matrix, lens = state()
    ahead = np.array(look_at) - eye
    np.testing.assert_allclose(matrix[:3, 3], eye, rtol=1e-6)
    np.testing.assert_allclose(-matrix[:3, 2], ahead / np.linalg.norm(ahead), atol=1e-6)
    np.testing.assert_allclose(lens, distance * 36 / 1920, rtol=1e-6)


def same(first, second):
    return first[0] == second[0] and np.array_equal(first[1], second[1]) and first[2] == second[2]


def unfold(panel):
    """Register a panel anew, open and above those that are closed; under a name of its own, since Blender remembers by its
    name that one was closed."""
    bpy.utils.unregister_class(panel)
    panel.bl_options, panel.bl_idname, panel.bl_order = set(), f"{panel.__name__}_open", 0
    bpy.utils.register_class(panel)


def open_the_panels():
    unfold(bpy.types.VIEWCAM_PT_sidebar_options)
    yield from show_the_panel()


def show_the_panel():
    """Steps to the panel in the sidebar, and in the Properties editor."""
    view, sidebar = region("VIEW_3D", "UI")
    view.spaces.active.show_region_ui = True
    window().view_layer.objects.active = bpy.context.scene.camera
    yield
    sidebar.active_panel_category = "Pinhole"
    region("PROPERTIES", "WINDOW")[0].spaces.active.context = "DATA"
    view.tag_redraw()
    yield
    yield


def strike(text):
    """Steps: one key after another over the viewport."""
    move(*NOWHERE)
    yield
    for character in text:
        key = KEYS.get(character, character.upper())
        window().event_simulate(type=key, value="PRESS", unicode=character, x=NOWHERE[0], y=NOWHERE[1])
        window().event_simulate(type=key, value="RELEASE", x=NOWHERE[0], y=NOWHERE[1])
        yield


def take_a_step(running, interval):
    try:
        time.sleep(next(running) or 0)
    except StopIteration:
        os._exit(0)
    except BaseException:
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(5)
    return interval


def start(steps, interval=0.01):
    """Take one step after another from when Blender's window is there, whatever file is opened meanwhile.

    interval : seconds for Blender to handle what has happened, and to draw.
    """
    bpy.context.preferences.view.ui_scale = SCALE
    bpy.context.preferences.view.show_splash = False
    running = steps()
    bpy.app.timers.register(lambda: take_a_step(running, interval), first_interval=1.0, persistent=True)
