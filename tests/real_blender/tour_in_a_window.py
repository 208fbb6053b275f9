"""Runs inside a real Blender with a window: takes the tour (tour.py) by mouse and keys, and undoes and redoes each step.

blender --enable-event-simulate -p 0 0 1600 2000 --addons … --python tour_in_a_window.py -- [FOLDER [STEP…]]

FOLDER : a folder for the pictures of docs/artists.md; every step is taken by script then, for hands take ten times as long.
STEP : the name of a step; these alone are photographed.

Leaves with status 0, or 5 and a traceback.
"""

import sys
import tempfile
import time
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).parent))
import tour
import tour_step
from bpy_extras.view3d_utils import location_3d_to_region_2d
from hands import (
    SIDEBAR,
    VIEWPORT,
    begin,
    beside,
    lowest_button,
    move,
    photograph,
    push_undo,
    redo,
    region,
    start,
    survey_anew,
    undo,
    window,
)

FOLDER, *WANTED = sys.argv[sys.argv.index("--") + 1 :] or [None]
FOLDER = FOLDER and Path(FOLDER)
BEFORE, AFTER = (Path(tempfile.gettempdir(), f"{name}.png") for name in ("before", "after"))
MOUSE_AWAY = (200, 700)
BELOW_BUTTONS = 45  # pixels below the lowest button of a panel that a picture of it shows

_bottoms = {}  # bottoms of the panel's pictures, window coordinates, by whether the camera is in use


def draw_finely():
    """Steps until the viewport is drawn with smooth edges, which takes it several drawings."""
    system = bpy.context.preferences.system
    system.viewport_aa = "8"
    for area in window().screen.areas:
        area.tag_redraw()
    for _ in range(12):
        yield
    system.viewport_aa = "OFF"


def take(step):
    """The steps of a step: prepare, by hand, check, undo and redo."""
    step.prepare()
    yield
    push_undo("before")
    yield
    before = tour_step.state()
    yield from step.by_hand()
    yield
    after = tour_step.state()
    step.check()
    for _ in range(step.edits):
        yield from undo()
    assert not (lost := tour_step.differing(before, tour_step.state())), f"undo leaves {lost}"
    for _ in range(step.edits):
        yield from redo()
    assert not (lost := tour_step.differing(after, tour_step.state())), f"redo leaves {lost}"
    step.tidy()
    yield


def show(step):
    """The steps of a step that is taken by script, where that is possible, and photographed if that is wanted."""
    is_wanted = step.picture and (not WANTED or type(step).__name__ in WANTED)
    if step.needs_a_window and not is_wanted:
        return
    step.prepare()
    yield
    if is_wanted and step.with_before:
        yield from take_the_picture(step, BEFORE)
    if step.needs_a_window:
        yield from step.by_hand()
    else:
        push_undo("before")
        area, part = region(*VIEWPORT)
        with bpy.context.temp_override(window=window(), area=area, region=part):
            step.by_script()
        push_undo("after")
    yield
    if is_wanted:
        step.check()
        yield from take_the_picture(step, AFTER if step.with_before else FOLDER / step.picture)
        if step.with_before:
            beside(BEFORE, AFTER, FOLDER / step.picture)
    step.tidy()
    yield


def take_the_picture(step, path):
    """Steps that take what a step shows of the window as it is by now."""
    if step.shows == "sidebar" and _bottoms.get(tour_step.values().enabled) is None:
        yield from survey_anew(SIDEBAR)
        _bottoms[tour_step.values().enabled] = lowest_button() - BELOW_BUTTONS
    yield from step.pose_for_the_picture()
    move(*MOUSE_AWAY)
    yield from draw_finely()
    part, share = _area_and_share(step.shows)
    photograph(part, path, share)
    yield from step.after_the_picture()


def _area_and_share(name):
    """(left, bottom, width, height) of what a picture shows, and in how many percent of its size."""
    if name == "sidebar":
        _, sidebar = region("VIEW_3D", "UI")
        bottom = max(sidebar.y, _bottoms[tour_step.values().enabled])
        return (sidebar.x, bottom, sidebar.width, sidebar.y + sidebar.height - bottom), 100
    if name == "camera view":
        area, part = region(*VIEWPORT)
        matrix, data = tour_step.camera().matrix_world, tour_step.camera().data
        corners = [matrix @ corner for corner in data.view_frame(scene=bpy.context.scene)]
        xs, ys = zip(*(location_3d_to_region_2d(part, area.spaces.active.region_3d, each) for each in corners), strict=True)
        return (part.x + min(xs), part.y + min(ys), max(xs) - min(xs), max(ys) - min(ys)), 45
    area = max(window().screen.areas, key=lambda area: area.width * area.height)
    left, bottom, right, top = (0.0, 0.0, 1.0, 1.0) if name == "area" else name
    x, y = area.x + left * area.width, area.y + bottom * area.height
    return (x, y, (right - left) * area.width, (top - bottom) * area.height), 60


def steps():
    yield
    yield from begin()
    for each in tour.STEPS:
        started = time.perf_counter()
        yield from (show if FOLDER else take)(each())
        print(f"done: {each.__name__} in {time.perf_counter() - started:.1f} s", flush=True)
    print("done: the tour", flush=True)


start(steps)
