"""Runs inside a real Blender with a window: uses the panel as an artist does, by mouse and keyboard, and checks what happens.

blender --enable-event-simulate -p 0 0 1600 1000 --addons … --python panel_in_a_window.py

A timer takes one step at a time, so that Blender handles the events and draws in between. Buttons are found by moving the mouse
over them and asking Blender which property it is on: no coordinate is assumed. Operators are found by tour_hands.py.
Leaves with status 0, or 5 and a traceback.
"""

import contextlib
import os
import sys
import traceback
from pathlib import Path

import bpy
import numpy as np

KEYS = {"-": "MINUS", "0": "ZERO", "1": "ONE", "3": "THREE", "5": "FIVE", "7": "SEVEN", ".": "PERIOD"}
_found_at = {}  # where a button was: looked at first
NOWHERE = (600, 500)  # a place in the 3D viewport
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


def find(name, index, area_type="VIEW_3D", region_type="UI", across=0.6):
    """Steps that end with the window coordinates of the property's button."""
    area, where = region(area_type, region_type)
    x = where.x + where.width * across
    move(*NOWHERE)  # else the first look tells what was under the mouse before
    yield
    yield
    key = (name, index, area_type)
    last = [_found_at[key]] if key in _found_at else []
    for y in (*last, *range(where.y + where.height - ROW, where.y, -ROW)):
        move(x, y)
        yield
        with bpy.context.temp_override(window=window(), area=area, region=where):
            actual = bpy.context.property
        if actual and actual[0] == camera() and actual[1:] == (f"virtual_pinhole.{name}", index):
            _found_at[key] = y
            return x, y - ROW / 2
    raise AssertionError(f"no button of virtual_pinhole.{name}[{index}] in the {region_type} of the {area_type}")


def type_into(name, index, text):
    """Steps that click on a field, replace its text and confirm."""
    x, y = yield from find(name, index, across=0.5 if name == "distance" else 0.6)  # its unit stands beside it
    yield from click(x, y)
    press("A", x, y, ctrl=True)
    for character in text:
        key = KEYS[character]
        window().event_simulate(type=key, value="PRESS", unicode=character, x=int(x), y=int(y))
        window().event_simulate(type=key, value="RELEASE", x=int(x), y=int(y))
    press("RET", x, y)
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


def enable():
    before = state()
    x, y = yield from find("enabled", -1, across=0.13)
    yield from click(x, y)
    assert values().enabled, "the checkbox in the panel's header enables nothing"
    assert np.array_equal(state()[1], before[1]), "enabling moved the camera"


def edit_undo_redo():
    before = state()
    yield from type_into("eye", 2, "3.5")
    after = state()
    assert values().eye[2] == 3.5, f"typed 3.5, and the eye's z is {values().eye[2]}"
    is_at_its_values()
    yield from undo_and_redo(before, after)


def undo_and_redo(before, after):
    """Steps that take the last edit back and do it again."""
    press("Z", *NOWHERE, ctrl=True)
    yield
    yield
    assert same(state(), before), "undo did not bring values and camera back"
    press("Z", *NOWHERE, ctrl=True, shift=True)
    yield
    yield
    assert same(state(), after), "redo did not bring values and camera back"


def zoom():
    values().lens_unit = "PIXELS"
    yield from type_into("distance", -1, "750")
    assert values().distance == 750, f"typed 750, and the distance is {values().distance}"
    is_at_its_values()
    before = state()
    yield from type_into("zoom", -1, "3")
    assert (values().distance, values().zoom) == (750, 3), f"typed 3, and the zoom is {values().zoom}"
    is_at_its_values()
    yield from undo_and_redo(before, state())
    yield from type_into("zoom", -1, "1")


def roll():
    before = state()
    yield from type_into("roll", -1, "30")
    assert abs(values().roll - np.radians(30)) < 1e-6, f"typed 30, and the roll is {values().roll}"
    is_at_its_values()
    after = state()
    rolled = np.cos(np.pi / 6) * before[1][:3, 0] + np.sin(np.pi / 6) * before[1][:3, 1]
    np.testing.assert_allclose(after[1][:3, 0], rolled, atol=1e-6)
    yield from undo_and_redo(before, after)
    yield from type_into("roll", -1, "0")
    assert tuple(values().up) == (0, 0, 1), f"typed 0, and up is {tuple(values().up)}"
    np.testing.assert_allclose(state()[1], before[1], atol=1e-6)


def change_the_resolution():
    render, lens, distance = bpy.context.scene.render, camera().data.lens, values().distance
    for keeps, kept in (("PIXELS", (2 * lens, distance)), ("FIELD_OF_VIEW", (lens, distance / 2))):
        values().keeps = keeps
        render.resolution_x, render.resolution_y = 960, 540
        yield
        yield
        np.testing.assert_allclose((camera().data.lens, values().distance), kept, rtol=1e-6)
        render.resolution_x, render.resolution_y = 1920, 1080
        yield
        yield
        is_at_its_values()
    values().keeps = "PIXELS"


def fly_over_the_top():
    """The eye crosses the zenith in one step, typed, with the roll held: the picture hangs upside down, until roll is typed."""
    stated = tuple(values().eye), tuple(values().look_at)
    values().eye, values().look_at, values().up = (1, 0, 5), (0, 0, 0), (0, 0, 1)
    values().pole = "HOLD"
    with bpy.context.temp_override(window=window()):
        bpy.ops.ed.undo_push(message="Stated by the script")
    yield
    before = state()
    yield from type_into("eye", 0, "-1")
    after = state()
    assert abs(abs(values().held_roll) - np.pi) < 1e-6, f"the roll is {values().held_roll}"
    assert np.abs(after[1] - before[1])[:3, 1].max() < 0.5, "v flipped"
    press("Z", *NOWHERE, ctrl=True)
    yield
    yield
    assert same(state(), before) and values().held_roll == 0, "undo did not bring values, roll and camera back"
    press("Z", *NOWHERE, ctrl=True, shift=True)
    yield
    yield
    assert same(state(), after), "redo did not bring values, roll and camera back"
    yield from type_into("held_roll", -1, "0")
    assert values().held_roll == 0 and np.abs(state()[1] - before[1])[:3, 1].max() > 1.5, "typing 0 did not level the picture"
    values().pole, values().eye, values().look_at = "CANONICAL", *stated
    yield


@contextlib.contextmanager
def nobody_notices_moves():
    """Let another handler, so to say, move the camera after ours: else the values follow it at once."""
    handlers = bpy.app.handlers.depsgraph_update_post
    ours = next(each for each in handlers if each.__module__.endswith("viewcam_addon.blender.animation"))
    handlers.remove(ours)
    try:
        yield
    finally:
        handlers.append(ours)


def press_the_buttons():
    from tour_hands import push  # which has what is in here

    stated = values().numbers()
    with nobody_notices_moves():
        camera().location = (1, 2, 3)
        yield
        assert values().numbers() == stated and tuple(camera().location) == (1, 2, 3)
        yield from push("viewcam.apply_camera(")
        assert values().numbers() == stated
        is_at_its_values()
        camera().location = (1, 2, 3)
        yield
        yield from push("viewcam.adopt_camera(")
        assert tuple(values().eye) == (1, 2, 3), f"after Adopt Camera the eye is {tuple(values().eye)}"
        is_at_its_values()
    camera().location = (2, 1, 4)
    yield
    yield
    assert tuple(values().eye) == (2, 1, 4), f"the camera was moved, and the eye is {tuple(values().eye)}"
    is_at_its_values()


def take_the_view_of_the_viewport():
    """Its lens is that of the matrix with which the viewport was drawn, and nothing but a window draws one."""
    view, drawn = region("VIEW_3D", "WINDOW")
    with bpy.context.temp_override(window=window(), area=view, region=drawn):
        bpy.ops.viewcam.adopt_view()
    yield
    yield
    is_at_its_values()
    region_3d, size = view.spaces.active.region_3d, (1920, 1080)
    lens = [region_3d.window_matrix[i][i] * pixels / 2 for i, pixels in enumerate(size)]
    # float32: the matrix, its lens and sensor, and the property.
    np.testing.assert_allclose(values().distance, min(lens), rtol=8 * 2**-24)
    # A few roundings of float32 on both sides, of coordinates below 20.
    np.testing.assert_allclose(state()[1], np.array(region_3d.view_matrix.inverted()), atol=8 * 20 * 2**-24)


def use_another_up():
    """Close to up the panel offers another one, in a button below the warning at its top. It leaves the picture as it is."""
    from tour_hands import push

    stated = tuple(values().eye), tuple(values().look_at), tuple(values().up)
    values().look_at, values().up, values().eye = (0.3, 0.2, 0), (0.1, 0.2, 1), (0.8, 1.2, 5.0001)
    yield
    yield
    before, doubtful = state(), tuple(values().up)
    yield from push("viewcam.choose_up(")
    assert tuple(values().up) != doubtful, "the button offers no other up"
    assert abs(np.dot(state()[1][:3, 2], values().up)) < 1e-6, f"up {tuple(values().up)} is not perpendicular to the view"
    assert np.abs(state()[1] - before[1]).max() < 1e-6, "the picture has turned"
    values().eye, values().look_at, values().up = stated
    _found_at.clear()
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


def play_keyframes():
    for frame, height in ((1, 3), (40, 9)):
        values().eye[2] = height
        values().keyframe_insert("eye", frame=frame)
    bpy.context.scene.frame_set(1)
    view, _ = region("VIEW_3D", "UI")
    with bpy.context.temp_override(window=window(), area=view):
        bpy.ops.screen.animation_play()
    heights = set()
    while len(heights) < 4:
        yield
        heights.add(round(values().eye[2], 3))
        is_at_its_values()
    with bpy.context.temp_override(window=window(), area=view):
        bpy.ops.screen.animation_cancel()
    camera().animation_data_clear()
    yield


def draw_a_warning():
    values().look_at = values().eye
    yield
    yield
    values().look_at = (0, 0, 0)
    yield


def look_into_the_properties_editor():
    area, where = region("PROPERTIES", "WINDOW")
    with bpy.context.temp_override(window=window(), area=area, region=where):
        for _ in range(30):
            bpy.ops.view2d.scroll_down(deltay=100)
    yield
    yield
    yield from find("distance", -1, "PROPERTIES", "WINDOW")


def steps():
    yield
    for part in (
        open_the_panels,
        enable,
        edit_undo_redo,
        zoom,
        roll,
        change_the_resolution,
        fly_over_the_top,
        press_the_buttons,
        take_the_view_of_the_viewport,
        use_another_up,
        play_keyframes,
        draw_a_warning,
        look_into_the_properties_editor,
    ):
        yield from part()
        print(f"done: {part.__name__}", flush=True)


def take_a_step(running, interval):
    try:
        next(running)
    except StopIteration:
        os._exit(0)
    except BaseException:
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(5)
    return interval


def start(steps, interval=0.05):
    """Take one step after another from when Blender's window is there, whatever file is opened meanwhile.

    interval : seconds for Blender to handle what has happened, and to draw.
    """
    bpy.context.preferences.view.show_splash = False
    running = steps()
    bpy.app.timers.register(lambda: take_a_step(running, interval), first_interval=1.0, persistent=True)


if __name__ == "__main__":
    sys.path.append(str(Path(__file__).parent))
    start(steps)
