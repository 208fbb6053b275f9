"""The hands of an artist in a real Blender with a window: finds a button and clicks it, types, drags, looks at the screen.

Everything is a generator, of which a timer takes one step at a time (`start`), so that Blender handles the events and draws in
between. No coordinate of a button is assumed: the mouse moves over the panel, and Blender is asked which property or operator
it is on. Where a button stood the last time is looked at first.
"""

import math
import os
import subprocess
import sys
import time
import traceback

import bpy
import numpy as np
import tour_step
from bpy_extras.object_utils import world_to_camera_view
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Euler, Vector

# The scale of the interface and of all places here: a window of half the width and height is drawn in software in a third of
# the time.
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


def keep_open(panel):
    """Register a panel anew, open and above those that are closed; under a name of its own, since Blender remembers by its
    name that one was closed."""
    bpy.utils.unregister_class(panel)
    panel.bl_options, panel.bl_idname, panel.bl_order = set(), f"{panel.__name__}_open", 0
    bpy.utils.register_class(panel)


def open_the_panels():
    keep_open(bpy.types.VIEWCAM_PT_sidebar_options)
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


def strike_all(text):
    """Steps: one key after another over the viewport."""
    move(*NOWHERE)
    yield
    for character in text:
        strike(character)
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


SIDEBAR, PROPERTIES, VIEWPORT = ("VIEW_3D", "UI"), ("PROPERTIES", "WINDOW"), ("VIEW_3D", "WINDOW")
SCREEN_HEIGHT = 2000
_HEADER = int(60 * SCALE)  # pixels from the panel's top within which its checkbox stands
_LOOKS = 4  # at a button
_PATIENCE = 120  # seconds that something may take to happen
_ROW = int(18 * SCALE)  # pixels between two looks, less than a button's height
_NOTHING = 25  # rows without a button, more than a panel's texts and closed sub-panels are, below which there is none
# Where in a row its buttons are looked for, as shares of the panel's width; of operators there are many in a row.
LEFT, _MIDDLE, _CHECKBOX, _OPERATORS = 0.2, 0.5, 0.13, (0.31, 0.38, 0.46, 0.53, 0.6, 0.72, 0.85)
_KEYS = {"-": "MINUS", ".": "PERIOD", " ": "SPACE", "/": "SLASH", "=": "EQUAL", ",": "COMMA"}
_DIGITS = ("ZERO", "ONE", "TWO", "THREE", "FOUR", "FIVE", "SIX", "SEVEN", "EIGHT", "NINE")

# The corners of a mouse pointer, pixels right of and below its tip.
_ARROW = ((0, 0), (0, 17), (4, 13), (7, 19), (10, 18), (7, 12), (12, 12))

_places = {}


def begin(show=open_the_panels):
    """Steps to where the tour starts. show : the steps that open the sidebar."""
    tour_step.make_the_scene()
    bpy.context.preferences.system.viewport_aa = "OFF"  # drawn in software
    view, _ = region("VIEW_3D", "WINDOW")
    space = view.spaces.active
    space.shading.color_type = "MATERIAL"
    space.region_3d.view_rotation = Euler((math.radians(66), 0, math.radians(75))).to_quaternion()
    space.region_3d.view_location, space.region_3d.view_distance = (1.2, -2.2, 1.2), 13
    yield from show()


def under_the_mouse(where):
    """The use of the button under the mouse: 'virtual_pinhole.eye[2]', 'viewcam.dolly_camera(camera="Camera")' or ''."""
    area, part = region(*where)
    with bpy.context.temp_override(window=window(), area=area, region=part):
        if actual := bpy.context.property:
            _, path, index = actual
            return path if index < 0 else f"{path}[{index}]"
        if bpy.ops.ui.copy_python_command_button.poll():
            clipboard = bpy.context.window_manager.clipboard
            bpy.ops.ui.copy_python_command_button()
            command = bpy.context.window_manager.clipboard
            bpy.context.window_manager.clipboard = clipboard
            return command.removeprefix("bpy.ops.")
    return ""


def look(x, y, where):
    """Steps that end with what stands there: the first move leaves the button where the mouse was, the second notices this one.

    Both in one step, since Blender draws the window after each, and it is drawn in software.
    """
    move(x, y)
    move(x, y)
    yield
    return under_the_mouse(where)


def find(button, where=SIDEBAR):
    """Steps that end with the window coordinates of a button: its property, or how its operator's call begins."""
    place = yield from seek(button, where)
    assert place, f"there is no button {button} in the {where[1]} of the {where[0]}, but {sorted(_map(where))}"
    return place


def seek(button, where):
    """Steps that end with where the button stands, as of `find`, or None if there is no such button."""
    if place := _remembered(button, where):
        for _ in range(_LOOKS):  # the button that the mouse comes from may want to be left first
            if (yield from look(*place, where)).startswith(button):
                return place
    print(f"looking for {button}", flush=True)
    if not place and _map(where):
        yield from survey_the_rest(where, button)
    if not _remembered(button, where) or place:
        yield from survey_anew(where, button)
    return _remembered(button, where)


def survey_anew(where, wanted=None):
    """Look at all rows, whatever is remembered of them."""
    _map(where).clear()
    return (yield from survey(_top(where), where, wanted))


def survey_the_rest(where, wanted=None):
    """Look at all rows below those that are known."""
    return (yield from survey(min((y for _, y in _map(where).values()), default=_top(where)), where, wanted))


def survey(top, where, wanted=None):
    """Look at all rows from a height down, or until a wanted button is found, and remember them; whether there are any."""
    _, part = region(*where)
    before = len(_map(where))
    move(*NOWHERE)
    yield
    last = top
    for y in range(int(top) - _ROW, part.y, -_ROW):
        if last - y > _NOTHING * _ROW:
            break
        columns = [_MIDDLE]
        for share in columns:
            x = part.x + part.width * share
            there = yield from look(x, y, where)
            if there:
                last = y
                _map(where).setdefault(there, (x, y))
            if share == _MIDDLE and there.endswith("]"):  # a number of a point, beside which stands what that follows
                columns.append(LEFT)
            elif share == _MIDDLE and not there:
                columns += [_OPERATORS[0], _CHECKBOX] if y > _top(where) - _HEADER else [_OPERATORS[0]]
            elif len(columns) < len(_OPERATORS) and there.startswith("viewcam."):
                columns += sorted(set(_OPERATORS) - set(columns))
        if wanted and _remembered(wanted, where):
            break
    return len(_map(where)) > before


def _top(where):
    _, part = region(*where)
    return part.y + part.height


def _map(where):
    return _places.setdefault(where, {})


def _remembered(button, where):
    return next((place for there, place in _map(where).items() if there.startswith(button)), None)


def push(button, where=SIDEBAR):
    """Click a button."""
    x, y = yield from find(button, where)
    yield from click(x, y)


def unfold(button, where=SIDEBAR):
    """Open sub-panels, from the first on, until one has the button; the others are folded again.

    Headers are rows in which nothing answers, and so are labels in a panel that is open.
    """
    if _remembered(button, where) and (yield from seek(button, where)):
        return
    yield from survey_the_rest(where)
    if _remembered(button, where):
        return
    _, part = region(*where)
    known = dict(_map(where))
    y = min((y for _, y in known.values()), default=_top(where)) - _ROW
    while y > part.y:
        x = part.x + part.width * 0.35
        if (yield from look(x, y, where)):  # still the last button
            y -= _ROW / 2
            continue
        yield from click(x, y)
        if (yield from survey(y - _ROW / 2, where)):
            if _remembered(button, where):
                return
            yield from click(x, y)
            _places[where] = dict(known)
            y -= _ROW / 2
        y -= _ROW / 2
    raise AssertionError(f"no sub-panel has {button}, beside {sorted(_map(where))}")


def type_into(button, text, where=SIDEBAR):
    """Click a field, replace what stands in it and confirm."""
    x, y = yield from find(button, where)
    yield from click(x, y)
    yield from write(text)
    press("RET", x, y)
    yield
    yield


def write(text):
    """Replace the text of the field that is being edited."""
    press("A", *NOWHERE, ctrl=True)
    for character in text:
        strike(character)
    yield


def strike(character):
    """Press and release the key of a character."""
    key = _DIGITS[int(character)] if character.isdigit() else _KEYS.get(character, character.upper())
    for value in ("PRESS", "RELEASE"):
        letter = {"unicode": character} if value == "PRESS" else {}
        window().event_simulate(type=key, value=value, x=NOWHERE[0], y=NOWHERE[1], **letter)


def key_over(button, key, where=SIDEBAR, **modifiers):
    """Press a key with the mouse over a button, as I for a keyframe."""
    x, y = yield from find(button, where)
    for value in ("PRESS",) if key.startswith("WHEEL") else ("PRESS", "RELEASE"):
        window().event_simulate(type=key, value=value, x=int(x), y=int(y), **modifiers)
    yield
    yield


def push_undo(message):
    with bpy.context.temp_override(window=window()):
        bpy.ops.ed.undo_push(message=message)


def undo():
    press("Z", *NOWHERE, ctrl=True)
    yield
    yield


def redo():
    press("Z", *NOWHERE, ctrl=True, shift=True)
    yield
    yield


def on_screen(place):
    """Window coordinates of a point of the world in the 3D viewport."""
    area, part = region(*VIEWPORT)
    x, y = location_3d_to_region_2d(part, area.spaces.active.region_3d, Vector(place))
    return part.x + x, part.y + y


def drag(start, by, **modifiers):
    """Steps that drag from one place of the window by so many pixels."""
    x, y = start
    move(x - 3, y)
    yield
    move(x, y)
    yield
    yield
    window().event_simulate(type="LEFTMOUSE", value="PRESS", x=int(x), y=int(y))
    yield
    for share in (0.25, 0.5, 0.75, 1.0, 1.0):
        move(x + by[0] * share, y + by[1] * share)
        yield
    window().event_simulate(type="LEFTMOUSE", value="RELEASE", x=int(x + by[0]), y=int(y + by[1]), **modifiers)
    yield
    yield


def seen(camera_object, edges):
    """Edges (axis, start, end) of the world as a camera sees them now: shares of the picture, from its lower left corner."""
    scene = bpy.context.scene
    return [(axis, *(world_to_camera_view(scene, camera_object, Vector(end))[:2] for end in ends)) for axis, *ends in edges]


def match_photo(edges):
    """Steps that begin Match Photo in camera view, and drag along edges of the picture, as `seen` gives them.

    They end with the operator, which goes on, and where the mouse is.
    """
    move(*NOWHERE)
    yield
    call(bpy.ops.viewcam.match_photo)
    yield from settle()
    matching = tour_step.room("interface.photo_matching")._drawn
    assert matching is not None and matching.frame is not None, "Match Photo has not begun"
    _, part = region(*VIEWPORT)
    left, bottom, right, top = matching.frame
    for axis, *ends in edges:
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
    yield from settle()
    assert len(matching.drawing.along) == len(edges), matching.drawing.along
    return matching, (x1, y1)


def call(operator, where=VIEWPORT, **properties):
    """Run an operator as its key or its place in a menu does, in a part of the window."""
    area, part = region(*where)
    with bpy.context.temp_override(window=window(), area=area, region=part):
        return operator("INVOKE_DEFAULT", True, **properties)  # with its undo step


def until(is_so, what, patience=_PATIENCE, seconds=0):
    """Steps until something has happened: none is counted on to take a time.

    patience : seconds, many times what it takes on a quiet machine.
    seconds : the seconds of each step, where it does take some.
    """
    ends = time.monotonic() + patience
    while not is_so():
        assert time.monotonic() < ends, f"{what} does not happen within {patience} s"
        yield seconds


def settle():
    for _ in range(6):
        yield


def lowest_button(where=SIDEBAR):
    """The height in the window of the lowest button that was found."""
    return min(y for _, y in _map(where).values())


def hide_the_sidebar(hidden=True):
    """Steps that hide the viewport's sidebar, or bring it back."""
    area, _ = region(*VIEWPORT)
    area.spaces.active.show_region_ui = not hidden
    for _ in range(30):  # it slides
        yield


def photograph(where, path, share=100, pointer=None):
    """Save what the screen shows of (left, bottom, width, height), in percent of its size and few colors.

    pointer : the mouse's place, window coordinates, at which its arrow is drawn: simulated events move none.
    """
    left, bottom, width, height = map(int, where)
    screen = ("import", "-window", "root", "-crop", f"{width}x{height}+{left}+{SCREEN_HEIGHT - bottom - height}", "+repage")
    arrow = ()
    if pointer:
        x, y = pointer[0] - left, bottom + height - pointer[1]
        corners = " ".join(f"{x + 1.6 * right:.0f},{y + 1.6 * down:.0f}" for right, down in _ARROW)
        arrow = ("-fill", "white", "-stroke", "black", "-strokewidth", "1.5", "-draw", f"polygon {corners}")
    few = ("-resize", f"{share}%", "+dither", "-colors", "192", "-depth", "8", "-strip")
    shot = subprocess.run([*screen, "png:-"], check=True, capture_output=True).stdout
    subprocess.run(["convert", "png:-", *arrow, *few, str(path)], input=shot, check=True)


def beside(before, after, path):
    """Save two pictures as one, with a gap between them."""
    few = ("+dither", "-colors", "192", "-depth", "8", "-strip")
    subprocess.run(["convert", before, "(", "-size", "12x1", "xc:none", ")", after, "+append", *few, path], check=True)
