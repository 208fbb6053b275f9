"""Runs inside a real Blender with a window: enables and disables the extension four times, and lets it draw in between.

blender --enable-event-simulate -p 0 0 1000 700 --addons … --python leftovers_in_a_window.py

The first round is not counted: in it Blender imports and draws for the first time. What it leaves is found by its name.
Leaves with status 0, or 5 and a traceback.
"""

import sys
from pathlib import Path

import bpy

sys.path += [str(Path(__file__).parent), str(Path(__file__).parent.parent)]
import leftovers
from hands import camera, move, region, start, window

EXTENSION = leftovers.EXTENSION
ROUNDS = 4


def enable(is_wanted):
    action = bpy.ops.preferences.addon_enable if is_wanted else bpy.ops.preferences.addon_disable
    with bpy.context.temp_override(window=window()):
        action(module=EXTENSION)


def steps():
    view, sidebar = region("VIEW_3D", "UI")
    view.spaces.active.show_region_ui = True
    region("PROPERTIES", "WINDOW")[0].spaces.active.context = "DATA"
    window().view_layer.objects.active = camera()
    camera().select_set(True)
    yield
    before = None
    for number in range(ROUNDS + 1):
        enable(True)
        yield
        sidebar.active_panel_category = "Pinhole"
        camera().virtual_pinhole.enabled = True  # not kept in a variable, which would keep its class
        camera().virtual_pinhole.eye.x = 7 + number / 10
        yield
        yield
        move(300 + number, 400)  # over the viewport, where handles light up
        yield
        enable(False)
        yield
        yield
        before = before or leftovers.snapshot()
    named = [f"{text} in {place}" for place, texts in before.items() for text in texts if EXTENSION in text]
    left = [*leftovers.differences(before, leftovers.snapshot()), *named, *leftovers.survivors(EXTENSION)]
    assert not left, left[:20]
    print("done: leave_nothing_behind", flush=True)


start(steps, interval=0.1)
