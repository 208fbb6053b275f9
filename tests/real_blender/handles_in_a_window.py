"""Runs inside a real Blender with a window: drags the camera's handles in the viewport, and reads the diagram's pixels.

blender --enable-event-simulate -p 0 0 1000 700 --addons … --python handles_in_a_window.py

A timer takes one step at a time, as in hands.py. The window is small, since it is drawn in software.
Leaves with status 0, or 5 and a traceback.
"""

import importlib
import math
import sys
from pathlib import Path

import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Vector

sys.path.append(str(Path(__file__).parent))
from hands import NOWHERE, camera, is_at_its_values, move, press, region, start, state, values, window

ADDON = "bl_ext.user_default.virtual_pinhole"
NAMES = ("eye", "look_at", "up")
# float32, in which Blender keeps its view and the handle's place: a few roundings of lengths below 40.
CLOSE = 8 * 40 * 2**-24
SHARP = 0.01  # pixels: float32 costs Blender's view 0.002
CORNER = (1.0, -1.0, 1.0)  # the cube's


def room(name):
    return importlib.import_module(f"{ADDON}.viewcam_addon.blender.{name}")


def place(name):
    return room("interface.gizmos").place(camera(), name)


def views():
    """The regions of the 3D viewport that show the scene: four in a quad view."""
    area, _ = region("VIEW_3D", "WINDOW")
    return [each for each in area.regions if each.type == "WINDOW"]


def pixel_of(point, view=None):
    """Window coordinates of a point in world space, whole pixels as a mouse has them."""
    view = view or views()[-1]
    actual = location_3d_to_region_2d(view, view.data, Vector(point))
    return round(view.x + actual.x), round(view.y + actual.y)


def carried(point, from_pixel, to_pixel):
    """The point to which a mouse carries a point of the user's view: in the plane that faces the viewer.

    In float64: what bpy_extras gives is off by up to 0.06 pixels.
    """
    view = views()[-1]
    matrix = np.array(view.data.perspective_matrix, dtype=np.float64)
    pixels = np.subtract(to_pixel, from_pixel)
    return np.array(point) + np.linalg.inv(matrix)[:3, :2] @ (
        2 * pixels / (view.width, view.height) * (matrix[3] @ (*point, 1.0))
    )


def button(value, at, **modifiers):
    window().event_simulate(type="LEFTMOUSE", value=value, x=at[0], y=at[1], **modifiers)


def grip(at):
    """Steps: Blender draws a handle under the mouse as such before it takes the press."""
    move(*at)
    yield
    yield
    button("PRESS", at)
    yield


def pull(start, end, **modifiers):
    for share in (0.5, 1):
        x, y = (round(a + share * (b - a)) for a, b in zip(start, end, strict=True))
        window().event_simulate(type="MOUSEMOVE", value="NOTHING", x=x, y=y, **modifiers)
        yield


def let_go(at):
    """Steps: the drag becomes a step of undo a moment later."""
    button("RELEASE", at)
    while room("interface.gizmos")._drag:
        yield
    yield


def drag(start, end):
    yield from grip(start)
    yield from pull(start, end)
    yield from let_go(end)


def undo(**modifiers):
    press("Z", *NOWHERE, ctrl=True, **modifiers)
    yield
    yield
    yield


def everything():
    return values().exact, values().when_set, *map(tuple, (values().eye, values().look_at, values().up)), str(state())


def view_by(operator, **properties):
    area, _ = region("VIEW_3D", "WINDOW")
    with bpy.context.temp_override(window=window(), area=area, region=views()[-1]):
        getattr(bpy.ops.view3d, operator)(**properties)


def push_undo():
    with bpy.context.temp_override(window=window()):
        bpy.ops.ed.undo_push(message="Stated by the script")


def state_the_values():
    values().eye, values().look_at, values().up = (6.0, -6.0, 4.0), (0.0, 0.5, 0.25), (0.0, 0.0, 1.0)
    push_undo()


def open_the_view():
    """The cube, and a camera before it that is active. Nothing that takes time and shows nothing: smooth views and edges."""
    bpy.context.preferences.view.smooth_view = 0
    bpy.context.preferences.system.viewport_aa = "OFF"
    window().view_layer.objects.active = camera()
    for each in window().view_layer.objects:
        each.select_set(each == camera())
    values().enabled = True
    state_the_values()
    views()[-1].data.view_distance = 22
    yield
    yield


def drag_each_handle():
    for name in NAMES:
        if name == "up":
            values().plane_at = 0.3  # moves its tip
            push_undo()
            yield
            yield
        before, gripped = everything(), place(name)
        start = pixel_of(gripped)
        end = start[0] + 60, start[1] - 35
        expected = carried(gripped, start, end)
        yield from drag(start, end)
        is_at_its_values()
        after = everything()
        close = SHARP * np.linalg.norm(carried(gripped, (0, 0), (1, 0)) - gripped)
        if name == "up":
            arrow = expected - np.array(values().eye)
            length = np.linalg.norm(arrow)
            expected, close = arrow / length, close / length
        np.testing.assert_allclose(getattr(values(), name), expected, rtol=0, atol=close, err_msg=name)
        yield from undo()
        assert everything() == before, f"undo did not bring back what was before the {name} was dragged"
        yield from undo(shift=True)
        assert everything() == after, f"redo did not bring back the dragged {name}"


def cancel_each_handle():
    """The camera is not at its values: there it has to come back to, and not to where they would put it."""
    camera().location.x += 0.123
    push_undo()
    yield
    for key, name in (("ESC", "eye"), ("ESC", "look_at"), ("ESC", "up"), ("RIGHTMOUSE", "eye")):
        before, start = everything(), pixel_of(place(name))
        end = start[0] + 40, start[1] + 25
        yield from grip(start)
        yield from pull(start, end)
        assert everything() != before, f"the {name} was not dragged"
        press(key, *end)
        yield
        yield from let_go(end)
        assert everything() == before, f"{key} did not bring back what was before the {name} was dragged"
    camera().location.y += 1
    moved = everything()
    yield
    yield from undo()
    assert everything() != moved and everything() != before, "a canceled drag has pushed a step of undo"
    yield from undo(shift=True)


def strike(key, character="", at=NOWHERE):
    for value in ("PRESS", "RELEASE"):
        letter = {"unicode": character} if character and value == "PRESS" else {}
        window().event_simulate(type=key, value=value, x=at[0], y=at[1], **letter)


def begin(kind):
    """Steps: a button of Drag is clicked, with the mouse where it is."""
    area, _ = region("VIEW_3D", "WINDOW")
    with bpy.context.temp_override(window=window(), area=area, region=views()[-1]):
        assert bpy.ops.viewcam.drag_camera("INVOKE_DEFAULT", True, camera="Camera", kind=kind) == {"RUNNING_MODAL"}
    yield
    assert [each.bl_idname for each in window().modal_operators] == ["VIEWCAM_OT_drag_camera"]


def drag_the_camera():
    """Orbit, dolly, dolly zoom and truck: with the mouse, by a number, confirmed, canceled; each is one step of undo."""
    there = (NOWHERE[0] + 40, NOWHERE[1] + 30)
    for kind in ("ORBIT", "DOLLY", "DOLLY_ZOOM", "TRUCK"):
        state_the_values()
        move(*NOWHERE)
        yield
        yield
        before, (eye, look_at, _, distance) = everything(), values().numbers()
        for key in ("ESC", "RIGHTMOUSE"):
            yield from begin(kind)
            yield from pull(NOWHERE, there)
            assert everything() != before, f"the mouse does not move the camera in {kind}"
            is_at_its_values()
            strike(key, at=there)
            yield
            yield
            assert everything() == before, f"{key} did not bring back what was before {kind}"
            assert not window().modal_operators
            move(*NOWHERE)
            yield
            yield
        for confirm, typed in (("LEFTMOUSE", ""), ("RET", ""), ("RET", "2.5")):
            yield from begin(kind)
            yield from pull(NOWHERE, there)
            for character, key in zip(typed, ("TWO", "PERIOD", "FIVE"), strict=bool(typed)):
                strike(key, character, there)
                yield
            strike(confirm, at=there)
            yield
            yield
            is_at_its_values()
            after, numbers = everything(), values().numbers()
            reach, former = math.dist(numbers[0], numbers[1]), math.dist(eye, look_at)
            if typed:
                moved = {"ORBIT": 0.0, "TRUCK": 0.0}.get(kind, 2.5)
                assert abs(reach - former - moved) < CLOSE, f"{kind} by 2.5 went from {former} to {reach}"
                assert kind != "TRUCK" or abs(math.dist(eye, numbers[0]) - 2.5) < CLOSE
                turned = 2 * former * math.sin(math.radians(2.5) / 2) * math.hypot(6, 6.5) / former
                assert kind != "ORBIT" or abs(math.dist(eye, numbers[0]) - turned) < CLOSE
            if kind == "DOLLY_ZOOM":
                assert abs(numbers[3] / reach / (distance / former) - 1) < CLOSE
            yield from undo()
            assert everything() == before, f"one step of undo did not take back {kind} confirmed by {confirm}"
            yield from undo(shift=True)
            assert everything() == after, f"redo did not bring back {kind}"
            yield from undo()
            move(*NOWHERE)
            yield
            yield


def snap_to_a_corner():
    start, corner = pixel_of(place("look_at")), pixel_of(CORNER)
    yield from grip(start)
    window().event_simulate(type="LEFT_CTRL", value="PRESS", x=start[0], y=start[1], ctrl=True)
    yield from pull(start, (corner[0] + 3, corner[1] + 2), ctrl=True)
    is_at_its_values()
    assert tuple(values().look_at) == CORNER, f"with Ctrl the look-at point is at {tuple(values().look_at)}"
    window().event_simulate(type="LEFT_CTRL", value="RELEASE", x=corner[0] + 3, y=corner[1] + 2)
    yield
    press("ESC", *corner)
    yield
    yield from let_go(corner)


def drag_in_a_quad_view():
    """Seen from above, up's tip lies over the eye, and it is the eye that is dragged."""
    state_the_values()
    area, _ = region("VIEW_3D", "WINDOW")
    with bpy.context.temp_override(window=window(), area=area, region=views()[-1]):
        bpy.ops.screen.region_quadview()
    yield
    yield
    yield
    for view in views():
        before = values().numbers()
        start = pixel_of(place("eye"), view)
        yield from drag(start, (start[0] + 20, start[1] + 10))
        after = values().numbers()
        assert after[0] != before[0] and after[1:] == before[1:], f"{view.data.view_rotation}: {before} became {after}"
        along = np.array(view.data.view_rotation.to_matrix())[:, 2]
        assert abs(np.dot(np.subtract(after[0], before[0]), along)) < CLOSE, "the eye was dragged towards the viewer"
    with bpy.context.temp_override(window=window(), area=area, region=views()[-1]):
        bpy.ops.screen.region_quadview()
    yield
    yield


def frame_point():
    """The middle of the view plane's lower edge."""
    group = values()
    stated = room("camera").stated(camera(), bpy.context.scene)
    figure = room("interface.overlay").diagrams.diagram(stated, tuple(group.up), group.plane_at)
    return np.add(stated.eye, figure.plane[:2].mean(axis=0))


def is_drawn(point):
    """Steps that end with whether the view plane's frame is drawn there: blue, where everything else is gray."""
    import gpu

    result = []

    def look():
        at = location_3d_to_region_2d(bpy.context.region, bpy.context.region_data, Vector(point))
        pixels = gpu.state.active_framebuffer_get().read_color(round(at.x) - 1, round(at.y) - 1, 3, 3, 4, 0, "FLOAT")
        pixels.dimensions = 9 * 4
        result.append(np.array(pixels).reshape(-1, 4))

    handler = bpy.types.SpaceView3D.draw_handler_add(look, (), "WINDOW", "POST_PIXEL")
    region("VIEW_3D", "WINDOW")[0].tag_redraw()
    while not result:
        yield
    bpy.types.SpaceView3D.draw_handler_remove(handler, "WINDOW")
    return bool((result[-1][:, 2] - result[-1][:, 0] > 0.25).any())


def hide_the_diagram():
    group, (area, _) = values(), region("VIEW_3D", "WINDOW")
    state_the_values()
    space = area.spaces.active
    other = bpy.data.objects["Cube"]
    yield
    point = frame_point()
    switches = {
        "overlays": lambda on: setattr(space.overlay, "show_overlays", on),
        "show_overlay": lambda on: setattr(group, "show_overlay", on),
        "enabled": lambda on: setattr(group, "enabled", on),
        "visible": lambda on: camera().hide_set(not on),
        "kind": lambda on: setattr(space, "show_object_viewport_camera", on),
        "meant": lambda on: (
            camera().select_set(on),
            setattr(window().view_layer.objects, "active", camera() if on else other),
        ),
    }
    assert (yield from is_drawn(point)), "the view plane is not drawn"
    for name, switch in switches.items():
        switch(False)
        yield
        assert not (yield from is_drawn(point)), f"the view plane is drawn though {name} is off"
        switch(True)
        yield
        assert (yield from is_drawn(point)), f"the view plane is not drawn again when {name} is on"


def look_through_the_camera():
    view = views()[-1].data
    drawn, before = room("interface.overlay"), room("interface.overlay")._batches.cache_info()
    view.view_perspective = "CAMERA"
    yield
    yield
    values().eye[0] += 0.01
    yield
    yield
    assert drawn._batches.cache_info() == before, "a viewport that looks through the camera draws its diagram"
    yield from drag_the_look_at_point_that_is_looked_at()
    view.view_perspective = "PERSP"
    yield
    yield


def drag_the_look_at_point_that_is_looked_at():
    """Its handle is the only one, and pans: the point follows the mouse, and the camera turns to it."""
    push_undo()
    before, (eye, look_at, up, distance) = everything(), values().numbers()
    start = pixel_of(look_at)
    u, v = room("camera").stated(camera(), bpy.context.scene).basis()[:2]
    for end, key in (((start[0] + 30, start[1] + 20), "ESC"), ((start[0] + 30, start[1] + 20), "")):
        yield from grip(start)
        yield from pull(start, end)
        if key:
            press(key, *end)
            yield
        yield from let_go(end)
        assert key == "" or everything() == before, f"{key} did not bring back what was before the view was panned"
    is_at_its_values()
    actual = values().numbers()
    moved = np.subtract(actual[1], look_at)
    assert actual[0] == eye and actual[2:] == (up, distance) and moved @ u > 0.05 and moved @ v > 0.03, f"panned by {moved}"
    yield from undo()
    assert everything() == before


def look_into_local_view():
    camera().select_set(False)
    bpy.data.objects["Cube"].select_set(True)
    point = frame_point()
    view_by("localview", frame_selected=False)
    yield
    yield
    assert not (yield from is_drawn(point)), "the diagram is drawn in the local view of something else"
    view_by("localview", frame_selected=False)
    yield
    yield
    assert (yield from is_drawn(point))


def count_what_is_made():
    """Lines are sent to the graphics card once, however often they are drawn, and nothing draws while nothing changes."""
    batches, drawings = room("interface.overlay")._batches, []
    handler = bpy.types.SpaceView3D.draw_handler_add(lambda: drawings.append(1), (), "WINDOW", "POST_PIXEL")
    move(*NOWHERE)
    for _ in range(6):
        yield
    drawings.clear()
    for _ in range(20):
        yield
    assert not drawings, f"the viewport was drawn {len(drawings)} times while nothing happened"
    before = batches.cache_info().misses
    for _ in range(20):
        region("VIEW_3D", "WINDOW")[0].tag_redraw()
        yield
    assert len(drawings) >= 10 and batches.cache_info().misses == before
    values().eye[0] += 0.25
    for _ in range(3):
        region("VIEW_3D", "WINDOW")[0].tag_redraw()
        yield
    misses = batches.cache_info().misses - before
    assert misses == 1, f"the lines were made {misses} times for one change"
    bpy.types.SpaceView3D.draw_handler_remove(handler, "WINDOW")


def disable_and_enable():
    bpy.ops.preferences.addon_disable(module=ADDON)
    yield
    yield
    assert not hasattr(bpy.types.WindowManager, "virtual_pinhole_handles")
    bpy.ops.preferences.addon_enable(module=ADDON)
    yield
    yield
    assert (yield from is_drawn(frame_point())), "the diagram is gone after disabling and enabling"


PARTS = (
    open_the_view,
    drag_each_handle,
    cancel_each_handle,
    drag_the_camera,
    snap_to_a_corner,
    drag_in_a_quad_view,
    hide_the_diagram,
    look_through_the_camera,
    look_into_local_view,
    count_what_is_made,
    disable_and_enable,
)


def steps():
    yield
    for part in PARTS:
        yield from part()
        print(f"done: {part.__name__}", flush=True)


if __name__ == "__main__":
    start(steps)
