"""Dragging a handle changes values and camera. With mouse and keys: tests/real_blender/handles_in_a_window.py."""

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon import diagram
from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender.interface import gizmos
from viewcam_addon.pinhole import Pinhole

NAMES = ("eye", "look_at", "up")
ELSEWHERE = (3.25, -8.5, 2.125)  # numbers that float32 holds


@pytest.fixture(autouse=True)
def no_drag(fresh_blender):
    """No test leaves a drag behind that goes on."""
    yield
    gizmos.end_drag()
    if bpy.app.timers.is_registered(gizmos._end_if_over):
        bpy.app.timers.unregister(gizmos._end_if_over)


@pytest.fixture
def steps(monkeypatch):
    """The steps of undo that drags have pushed."""
    pushed = []
    monkeypatch.setattr(gizmos, "_push_undo", lambda message, window: pushed.append(message))
    return pushed


def everything(camera_object):
    """All that Blender stores of the camera and its values; floats bit by bit."""
    bpy.context.view_layer.update()
    result = {}
    for block in (camera_object, camera_object.data, camera_object.virtual_pinhole):
        for each in block.bl_rna.properties:
            if each.type in ("FLOAT", "INT", "BOOLEAN", "STRING"):
                value = getattr(block, each.identifier)
                result[block.bl_rna.identifier, each.identifier] = value if each.type == "STRING" else np.array(value).tobytes()
    return result


def check_messages(camera_object, scene):
    return cameras.check(camera_object, cameras.stated(camera_object, scene), scene)


@pytest.mark.parametrize("name", ["eye", "look_at"])
def test_a_dragged_point_is_where_the_handle_is(posed_camera, scene, steps, name):
    assert gizmos.place(posed_camera, name) == tuple(getattr(posed_camera.virtual_pinhole, name))
    gizmos.drag(posed_camera, name, ELSEWHERE)
    assert tuple(getattr(posed_camera.virtual_pinhole, name)) == gizmos.place(posed_camera, name) == ELSEWHERE
    assert check_messages(posed_camera, scene) == []


def test_a_dragged_up_points_to_the_handle_and_keeps_its_length(posed_camera, scene, steps):
    group = posed_camera.virtual_pinhole
    group.up = (0, 0, 2.5)
    gizmos.drag(posed_camera, "up", ELSEWHERE)
    eye, _, up, _ = group.numbers()
    arrow = np.subtract(ELSEWHERE, eye)
    # float32: three components, each rounded by 2⁻²⁴ of its size.
    np.testing.assert_allclose(up, 2.5 * arrow / np.linalg.norm(arrow), rtol=2**-24)
    assert check_messages(posed_camera, scene) == []
    tip = gizmos.place(posed_camera, "up")
    assert math.dist(tip, eye) == pytest.approx(math.dist(diagram.up_tip(*group.numbers()[:2], (0, 0, 1), group.plane_at), eye))


def test_up_dragged_into_the_eye_stays(posed_camera, steps):
    gizmos.drag(posed_camera, "up", ELSEWHERE)
    before = tuple(posed_camera.virtual_pinhole.up)
    gizmos.drag(posed_camera, "up", tuple(posed_camera.virtual_pinhole.eye))
    assert tuple(posed_camera.virtual_pinhole.up) == before


@pytest.mark.parametrize("mode", ["XYZ", "ZYX", "QUATERNION", "AXIS_ANGLE"])
@pytest.mark.parametrize("name", NAMES)
def test_canceling_restores_all_to_the_bit_though_the_camera_was_not_at_its_values(posed_camera, scene, steps, name, mode):
    posed_camera.rotation_mode = mode
    posed_camera.virtual_pinhole.pole = "HOLD"
    cameras.CameraSync.of(posed_camera).edited(scene)
    posed_camera.location, posed_camera.data.lens = (1.2345, 6.789, 0.1), 33.3
    before, start = everything(posed_camera), gizmos.place(posed_camera, name)
    for step in range(1, 5):
        gizmos.drag(posed_camera, name, tuple(np.add(start, (0.3 * step, -0.2 * step, 0.1)).tolist()))
    assert everything(posed_camera) != before
    gizmos.drag(posed_camera, name, tuple(np.float32(start).tolist()))
    after = everything(posed_camera)
    assert {key for key in before if after[key] != before[key]} == set()
    gizmos.end_drag()
    assert steps == [], "a canceled drag is no step of undo"


def test_what_was_stated_in_float64_comes_back_in_float64(posed_camera, scene, steps):
    group = posed_camera.virtual_pinhole
    cameras.apply(posed_camera, Pinhole((0.1, -7.2, 3.3), (0, 0, 0.7), (0, 0, 1), 1234.5678, 1920, 1080), scene)
    before = group.numbers()
    assert group.precision() == 2**-53
    gizmos.drag(posed_camera, "eye", ELSEWHERE)
    gizmos.drag(posed_camera, "eye", tuple(np.float32(before[0]).tolist()))
    assert group.numbers() == before and group.precision() == 2**-53


def test_a_drag_is_one_step_of_undo(posed_camera, steps):
    for x in range(5):
        gizmos.drag(posed_camera, "eye", (x, -8, 2))
    assert steps == []
    gizmos.end_drag()
    assert steps == ["Drag Eye"]
    gizmos.end_drag()
    gizmos.drag(posed_camera, "look_at", ELSEWHERE)
    gizmos.end_drag()
    assert steps == ["Drag Eye", "Drag Look-At"]


def test_the_next_drag_ends_one_whose_end_nobody_has_seen_yet(posed_camera, steps):
    gizmos.drag(posed_camera, "eye", ELSEWHERE)
    start = gizmos.place(posed_camera, "look_at")
    gizmos.drag(posed_camera, "look_at", (1, 2, 3))
    assert steps == ["Drag Eye"]
    gizmos.drag(posed_camera, "look_at", start)
    group = posed_camera.virtual_pinhole
    assert (tuple(group.eye), tuple(group.look_at)) == (ELSEWHERE, start)


def test_a_drag_that_leads_nowhere_is_no_step_of_undo(posed_camera, steps):
    start = gizmos.place(posed_camera, "eye")
    gizmos.drag(posed_camera, "eye", start)
    gizmos.end_drag()
    assert steps == []


def test_a_camera_that_is_deleted_while_it_is_dragged_ends_the_drag(posed_camera, steps):
    gizmos.drag(posed_camera, "eye", ELSEWHERE)
    bpy.data.objects.remove(posed_camera)
    gizmos.end_drag()
    assert steps == [] and gizmos._drag is None


@pytest.mark.parametrize("automatic", [False, True])
@pytest.mark.parametrize("keyed", ["eye", "look_at"])
def test_auto_keying_keys_what_is_animated(posed_camera, scene, steps, automatic, keyed):
    """A value without a curve gets none, as with Blender's own fields."""
    group = posed_camera.virtual_pinhole
    group.keyframe_insert(keyed, frame=1)
    group.keyframe_insert(keyed, frame=20)
    scene.frame_set(10)
    scene.tool_settings.use_keyframe_insert_auto = automatic
    gizmos.drag(posed_camera, "eye", ELSEWHERE)
    gizmos.end_drag()
    scene.frame_set(11)
    scene.frame_set(10)
    is_kept = keyed != "eye" or automatic
    assert (tuple(group.eye) == ELSEWHERE) == is_kept
    assert steps == ["Drag Eye"]


@pytest.mark.parametrize("name", ["eye", "look_at"])
def test_a_point_that_an_object_has_can_not_be_dragged(posed_camera, empty, name):
    setattr(posed_camera.virtual_pinhole, f"{name}_target", empty("There", (1, 2, 3)))
    assert gizmos.place(posed_camera, name) is None
    assert all(gizmos.place(posed_camera, other) for other in NAMES if other != name)


def test_values_that_make_no_camera_can_be_dragged_apart(posed_camera, scene, steps):
    group = posed_camera.virtual_pinhole
    group.look_at = group.eye
    assert gizmos.place(posed_camera, "up") is None
    gizmos.drag(posed_camera, "look_at", ELSEWHERE)
    assert check_messages(posed_camera, scene) == []


def test_there_are_no_handles_where_there_is_no_viewport(posed_camera):
    handles = bpy.context.window_manager.virtual_pinhole_handles
    before = everything(posed_camera)
    assert [tuple(getattr(handles, name)) for name in NAMES] == [(0, 0, 0)] * 3
    handles.eye = ELSEWHERE
    assert everything(posed_camera) == before


def test_nothing_is_left_behind(posed_camera, steps):
    def keymaps():
        keyconfigs = bpy.context.window_manager.keyconfigs
        return [(each.name, keymap.name, len(keymap.keymap_items)) for each in keyconfigs for keymap in each.keymaps]

    before = keymaps()
    gizmos.drag(posed_camera, "eye", ELSEWHERE)
    for each in reversed(gizmos.CLASSES):
        if each is gizmos.Handles:
            gizmos.unregister()
        bpy.utils.unregister_class(each)
    try:
        assert gizmos._drag is None and not bpy.app.timers.is_registered(gizmos._end_if_over)
        assert not hasattr(bpy.types.WindowManager, "virtual_pinhole_handles")
        assert not hasattr(bpy.types, "VIEWCAM_GGT_handles")
    finally:
        for each in gizmos.CLASSES:
            bpy.utils.register_class(each)
        gizmos.register()
    assert keymaps() == before
