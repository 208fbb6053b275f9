"""An artist's first day: the camera moved by Blender's own ways, framed, and dragged."""

import math

import bpy
import numpy as np
from artist_hands import PULL, picture, warnings
from bpy_extras.object_utils import world_to_camera_view
from hands_in_a_window import NOWHERE, camera, is_at_its_values, move, press, region, same, state, strike, values, window
from tour_hands import find, push, unfold


def grab_and_turn():
    """G X 1 and R Z 30 move the values and not only the camera; under a target the view stays on it, and Escape gives back
    every bit."""
    values().eye, values().look_at, values().up = (4, -6, 3.5), (0.5, 0.2, 1), (0, 0, 1)
    for each in window().view_layer.objects:
        each.select_set(each == camera())
    for target in (None, bpy.data.objects["Cube"]):
        values().look_at_target = target
        yield
        yield
        for typed, by in (("gx1", (1, 0, 0)), ("rz30", (0, 0, 0))):
            before = state()
            for key in ("ESC", "RET"):
                yield from strike(typed)
                press(key, *NOWHERE)
                yield
                yield
                assert key != "ESC" or same(state(), before), f"Escape leaves {state()} of {before}"
            moved = np.subtract(state()[0][0], before[0][0])
            np.testing.assert_allclose(moved, by, atol=1e-5, err_msg=f"the values are not where {typed} has put the camera")
            is_at_its_values()
            assert warnings() == [], f"after {typed} the panel warns"
            if target:
                assert values().numbers()[1] == (0, 0, 0), f"after {typed} the view has left the target"
    values().look_at_target = None
    values().eye[2] += 1
    is_at_its_values()
    np.testing.assert_allclose(values().numbers()[0], (6, -6, 4.5), atol=1e-5, err_msg="an edit has thrown the moves away")


def orbit_and_walk_in_the_cameras_view():
    """*Lock Camera to View* by a drag of the middle mouse button, and walk navigation by W: the values go along."""
    area, part = region("VIEW_3D", "WINDOW")
    view = area.spaces.active
    view_before = view.region_3d.view_rotation.copy(), view.region_3d.view_location.copy(), view.region_3d.view_distance
    view.lock_camera, view.region_3d.view_perspective = True, "CAMERA"
    move(*NOWHERE)
    yield
    yield
    before = state()
    window().event_simulate(type="MIDDLEMOUSE", value="PRESS", x=NOWHERE[0], y=NOWHERE[1])
    for by in (20, 40, 60):
        yield
        move(NOWHERE[0] + by, NOWHERE[1] + by / 2)
    yield
    window().event_simulate(type="MIDDLEMOUSE", value="RELEASE", x=NOWHERE[0] + 60, y=NOWHERE[1] + 30)
    yield
    yield
    after = state()
    assert np.linalg.norm(np.subtract(after[0][0], before[0][0])) > 0.5, f"orbited, and the eye went from {before} to {after}"
    is_at_its_values()
    yield from picture("lock_to_view")
    view.lock_camera = False
    with bpy.context.temp_override(window=window(), area=area, region=part):
        assert bpy.ops.view3d.walk("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
    yield
    window().event_simulate(type="W", value="PRESS", x=NOWHERE[0], y=NOWHERE[1])
    for _ in range(6):
        yield
    window().event_simulate(type="W", value="RELEASE", x=NOWHERE[0], y=NOWHERE[1])
    yield
    press("RET", *NOWHERE)
    yield
    yield
    walked = np.subtract(state()[0][0], after[0][0])
    assert np.linalg.norm(walked) > 0.01, "walked, and the eye is where it was"
    is_at_its_values()
    view.region_3d.view_perspective = "PERSP"
    view.region_3d.view_rotation, view.region_3d.view_location, view.region_3d.view_distance = view_before
    yield


def frame_the_cube():
    """It is in the middle of the picture then, and fills it but for the margin."""
    cube = bpy.data.objects["Cube"]
    cube.location = (1, 2, 0.5)
    cube.select_set(True)
    values().look_at = (-1, 0, 0)
    yield
    yield from unfold("viewcam.frame_selection(")
    for by in ("EYE", "DISTANCE"):
        yield from push(f"viewcam.frame_selection(camera=\"Camera\", by='{by}'")
        seen = [world_to_camera_view(bpy.context.scene, camera(), cube.matrix_world @ each.co) for each in cube.data.vertices]
        middle = world_to_camera_view(bpy.context.scene, camera(), cube.location)
        np.testing.assert_allclose(middle[:2], (0.5, 0.5), atol=1e-5, err_msg=f"framed by {by}")
        room = min(min(x, y, 1 - x, 1 - y) for x, y, _ in seen)
        assert abs(room - 0.05) < 1e-4, f"framed by {by}, the margin is {room:.5f} of the picture and not 5 %"
        is_at_its_values()
    cube.select_set(False)


def dolly_by_a_button():
    """A click takes hold of the camera, the mouse moves it, a click lets it go."""
    button = "viewcam.drag_camera(camera=\"Camera\", kind='DOLLY')"
    yield from unfold("viewcam.drag_camera(")
    x, y = yield from find(button)
    eye, look_at = tuple(values().eye), tuple(values().look_at)
    yield from push(button)
    for by in (30, 60, PULL):
        move(x - by, y)
        yield
    yield from picture("dolly", mouse=(x - PULL, y))
    press("LEFTMOUSE", x - PULL, y)
    yield
    yield
    moved = math.dist(eye, values().eye) / math.dist(eye, look_at)
    assert moved > 0.3 and tuple(values().look_at) == look_at, f"dolly moved the eye by {100 * moved:.1f} %"
    is_at_its_values()
