"""The roll held through the pole while an artist drags: every edit carries the picture along."""

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import findings
from viewcam_addon.blender.interface import panel
from viewcam_addon.pinhole import Pinhole

pytestmark = pytest.mark.slow

TURN = findings.LARGEST_TURN  # what float32 storage makes of a rotation
UP = (0.0, 0.0, 1.0)


def axes(camera_object):
    bpy.context.view_layer.update()
    return np.array(camera_object.matrix_world)[:3, :3]


@pytest.mark.parametrize("miss", [0.0, 0.1, 1e-5, -3.0])
@pytest.mark.parametrize("step", [0.3, 1.0, 3.0])
def test_dragged_over_the_top_the_picture_turns_no_more_than_the_view(
    held_camera, scene, miss, step, over_the_top, turn_between
):
    group, before = held_camera.virtual_pinhole, None
    for degrees in np.arange(-20, 20 + step / 2, step):
        group.eye = over_the_top(degrees, miss)
        after, view = axes(held_camera), np.array(group.eye)
        if before is not None and min(before[1][2], view[2]) > 10 * math.cos(group.hold_within):
            own = math.asin(np.linalg.norm(np.cross(before[1], view)) / 100)
            assert turn_between(before[0], after) <= own + 2 * TURN, f"at {degrees:.1f}°"
        before = after, view
        assert findings.differences(cameras.stated(held_camera, scene), cameras.read(held_camera, scene), reach=10) == {}


def test_without_holding_the_same_drag_flips(held_camera, over_the_top, turn_between):
    group = held_camera.virtual_pinhole
    group.pole = "CANONICAL"
    group.eye = over_the_top(-1)
    before = axes(held_camera)
    group.eye = over_the_top(1)
    assert turn_between(before, axes(held_camera)) > math.radians(179)


def test_straight_over_the_top_the_picture_ends_upside_down(held_camera, over_the_top):
    for degrees in range(-20, 21):
        held_camera.virtual_pinhole.eye = over_the_top(degrees)
    # Of the forty steps those near the pole write the roll, each rounded to float32, π by 2⁻²³.
    assert abs(abs(held_camera.virtual_pinhole.held_roll) - math.pi) <= 40 * 2.0**-23
    assert axes(held_camera)[2, 1] < -0.3  # v points down


def test_dragged_back_the_picture_is_level_again(held_camera, over_the_top):
    for degrees in [*range(-20, 21), *range(20, -21, -1)]:
        held_camera.virtual_pinhole.eye = over_the_top(degrees)
    assert abs(held_camera.virtual_pinhole.held_roll) <= 80 * 2.0**-23


def test_the_roll_stays_in_half_a_turn_either_way(held_camera, over_the_top):
    for degrees in [*range(-20, 21), *range(20, 380)]:
        held_camera.virtual_pinhole.eye = over_the_top(degrees)
    assert abs(held_camera.virtual_pinhole.held_roll) <= math.pi + 2.0**-22


@pytest.mark.parametrize("roll", [0.0, 0.3])
def test_an_edit_far_from_the_pole_leaves_the_roll_as_it_is(held_camera, roll):
    group = held_camera.virtual_pinhole
    group.held_roll = roll
    before = group.held_roll
    group.eye, group.distance = (3, 3, 1), 700
    assert group.held_roll == before


def test_a_roll_that_is_typed_turns_the_picture_and_zero_levels_it(held_camera, scene, over_the_top):
    group = held_camera.virtual_pinhole
    group.eye = over_the_top(-5)
    level = axes(held_camera)
    group.held_roll = math.radians(30)
    assert group.held_roll == np.float32(math.radians(30))
    cosine, sine = math.cos(group.held_roll), math.sin(group.held_roll)
    np.testing.assert_allclose(axes(held_camera)[:, 0], cosine * level[:, 0] + sine * level[:, 1], atol=TURN)
    group.held_roll = 0.0
    np.testing.assert_allclose(axes(held_camera), level, atol=TURN)


def test_a_roll_that_is_no_number_leaves_the_camera_where_it_is_and_the_panel_says_so(held_camera, scene):
    before = axes(held_camera)
    held_camera.virtual_pinhole.held_roll = math.nan
    np.testing.assert_array_equal(axes(held_camera), before)
    assert panel.notices(held_camera, scene) == [panel.Notice("Roll is nan: give a finite angle")]


def test_canonical_axes_level_the_picture_at_once(held_camera):
    group = held_camera.virtual_pinhole
    level = axes(held_camera)
    group.held_roll = 1.0
    group.pole = "CANONICAL"
    assert group.held_roll == 0.0
    np.testing.assert_allclose(axes(held_camera), level, atol=TURN)


def test_a_roll_counts_only_where_it_is_held(posed_camera):
    before = axes(posed_camera)
    posed_camera.virtual_pinhole.held_roll = 1.0
    np.testing.assert_array_equal(axes(posed_camera), before)


def test_always_held_a_walk_around_a_hill_tilts_the_horizon(held_camera):
    """By the solid angle that the view directions enclose."""
    group, slope = held_camera.virtual_pinhole, math.radians(50)
    group.hold_within = math.pi / 2
    group.eye = (10 * math.sin(slope), 0, 10 * math.cos(slope))
    group.held_roll = 0.0
    for azimuth in np.linspace(0, 2 * math.pi, 721)[1:]:
        group.eye = (10 * math.sin(slope) * math.cos(azimuth), 10 * math.sin(slope) * math.sin(azimuth), 10 * math.cos(slope))
    enclosed = 2 * math.pi * (1 - math.cos(slope))
    assert math.remainder(group.held_roll - enclosed, 2 * math.pi) == pytest.approx(0, abs=720 * 2.0**-23)


@pytest.mark.parametrize(("name", "value"), [("look_at", (-1, 0, 9)), ("up", (0, 0, 0)), ("distance", 0.0)])
def test_values_that_make_no_camera_leave_the_roll_and_the_next_ones_go_on_from_before(held_camera, name, value):
    group = held_camera.virtual_pinhole
    group.eye = (-1, 0, 9)
    group.held_roll = 0.4
    good, before, roll = getattr(group, name), axes(held_camera), group.held_roll
    good = tuple(good) if name != "distance" else good
    setattr(group, name, value)
    assert group.held_roll == roll
    setattr(group, name, good)
    assert group.held_roll == roll
    np.testing.assert_allclose(axes(held_camera), before, atol=TURN)


def test_a_camera_that_was_turned_by_hand_is_carried_on_from_there(held_camera, over_the_top):
    group = held_camera.virtual_pinhole
    group.eye = over_the_top(-5)
    held_camera.rotation_euler = (0.3, 1.2, -2.0)
    bpy.context.view_layer.update()
    roll, before = group.held_roll, axes(held_camera)
    assert roll != 0 and tuple(group.up) == UP
    group.distance *= 2
    assert group.held_roll == roll
    np.testing.assert_allclose(axes(held_camera), before, atol=TURN)


@pytest.mark.parametrize("text", ["", "nonsense", "[1, 2]", "[null, 0, 0, 0, 0, 0, 0, 0, 0]", "[0, 0, 0, 0, 0, 0, 0, 0, 1]"])
def test_whatever_stands_in_the_hidden_text_an_edit_moves_the_camera(held_camera, text, over_the_top):
    group = held_camera.virtual_pinhole
    group.when_set = text
    group.eye = over_the_top(30)
    np.testing.assert_allclose(held_camera.location, over_the_top(30), rtol=1e-6)
    assert group.held_roll == 0


def test_a_script_that_applies_a_pinhole_has_said_everything(held_camera, scene):
    group = held_camera.virtual_pinhole
    group.held_roll = 1.0
    pinhole = Pinhole((0.1, 0, 9), (0, 0, 0), (0.6, 0.8, 0), 1500.0, 1920, 1080)
    assert cameras.apply(held_camera, pinhole, scene) == []
    assert group.held_roll == 0.0
    assert cameras.stated(held_camera, scene) == pinhole


def test_adopting_a_camera_says_everything_too(held_camera, scene):
    held_camera.rotation_euler = (0.01, 0.02, 2.0)
    before = axes(held_camera)
    cameras.adopt(held_camera, scene)
    assert held_camera.virtual_pinhole.held_roll == 0.0
    np.testing.assert_allclose(np.column_stack(cameras.stated(held_camera, scene).basis()), before, atol=TURN)


def test_a_held_roll_outlasts_its_camera_being_off(held_camera):
    """Nobody asked for another up; adopting a camera that is on does."""
    group = held_camera.virtual_pinhole
    group.held_roll = 1.0
    before = axes(held_camera)
    group.enabled = False
    group.enabled = True
    assert (tuple(group.up), group.held_roll) == (UP, 1.0)
    np.testing.assert_array_equal(axes(held_camera), before)


def test_applying_again_keeps_up_and_roll(held_camera):
    group = held_camera.virtual_pinhole
    group.held_roll = 1.0
    before = axes(held_camera)
    assert bpy.ops.viewcam.apply_camera() == {"FINISHED"}
    assert (tuple(group.up), group.held_roll) == (UP, 1.0)
    np.testing.assert_array_equal(axes(held_camera), before)


def test_a_mirrored_and_parented_camera_is_held_as_well(held_camera, scene, over_the_top, turn_between):
    parent = bpy.data.objects.new("Parent", None)
    scene.collection.objects.link(parent)
    parent.location, parent.rotation_euler, parent.scale = (1, 2, 3), (0.3, 0.2, 0.1), (-2, -2, -2)
    held_camera.parent = parent
    bpy.context.view_layer.update()
    group = held_camera.virtual_pinhole
    group.eye, group.look_at, group.up, group.held_roll = over_the_top(-9), (0, 0, 0), UP, 0.0  # the parent carried them along
    for degrees in range(-9, 10):
        before = axes(held_camera)
        held_camera.virtual_pinhole.eye = over_the_top(degrees)
        assert turn_between(before / 2, axes(held_camera) / 2) <= math.radians(1) + 2 * TURN


def test_undo_and_redo_bring_roll_and_camera_together(held_camera, over_the_top):
    def state():
        item = bpy.data.objects["Camera"]
        group = item.virtual_pinhole
        return group.held_roll, group.when_set, tuple(group.eye), axes(item).tolist()

    held_camera.virtual_pinhole.eye = over_the_top(-5, 3)
    bpy.ops.ed.undo_push(message="before")
    before = state()
    held_camera.virtual_pinhole.eye = over_the_top(5, 3)
    bpy.ops.ed.undo_push(message="over the top")
    after = state()
    assert after[0] != before[0]
    bpy.ops.ed.undo()
    assert state() == before
    bpy.data.objects["Camera"].virtual_pinhole.eye = over_the_top(5, 3)  # the same step from the same pose
    assert state() == after
    bpy.ops.ed.undo_push(message="again")
    bpy.ops.ed.undo()
    bpy.ops.ed.redo()
    assert state() == after


def test_saving_and_opening_keep_the_roll_and_where_it_came_from(held_camera, tmp_path, over_the_top):
    held_camera.virtual_pinhole.eye = over_the_top(-2)
    path = str(tmp_path / "held.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    held_camera.virtual_pinhole.eye = over_the_top(2)
    expected = held_camera.virtual_pinhole.held_roll, axes(held_camera).tolist()
    bpy.ops.wm.open_mainfile(filepath=path)
    found = bpy.data.objects["Camera"]
    found.virtual_pinhole.eye = over_the_top(2)
    assert (found.virtual_pinhole.held_roll, axes(found).tolist()) == expected
    assert abs(expected[0]) > 3


def test_a_library_override_holds_and_keeps_its_roll(held_camera, tmp_path, over_the_top):
    held_camera.virtual_pinhole.eye = over_the_top(-2)
    library, shot = str(tmp_path / "library.blend"), str(tmp_path / "shot.blend")
    bpy.ops.wm.save_as_mainfile(filepath=library)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(library, link=True) as (_, names):
        names.objects = ["Camera"]
    linked = bpy.data.objects["Camera"]
    bpy.context.scene.collection.objects.link(linked)
    override = linked.override_create(remap_local_usages=True)
    override.data.override_create(remap_local_usages=True)
    override.virtual_pinhole.eye = over_the_top(2)
    roll, before = override.virtual_pinhole.held_roll, axes(override)
    assert abs(abs(roll) - math.pi) <= 2.0**-22
    bpy.ops.wm.save_as_mainfile(filepath=shot)
    bpy.ops.wm.open_mainfile(filepath=shot)
    found = next(item for item in bpy.data.objects if item.override_library)
    assert (found.virtual_pinhole.pole, found.virtual_pinhole.held_roll) == ("HOLD", roll)
    np.testing.assert_array_equal(axes(found), before)
    assert cameras.check(found, cameras.stated(found, bpy.context.scene), bpy.context.scene) == []


def test_a_check_at_another_size_sees_the_held_camera_and_leaves_it_as_it_was(held_camera, scene, both_sides, over_the_top):
    bpy.ops.mesh.primitive_monkey_add(size=8)
    group = held_camera.virtual_pinhole
    group.eye = over_the_top(-5)
    group.held_roll = 1.0
    group.when_set = group.when_set.replace("[", "[ ")  # as nobody but this test would write it
    expected, before = cameras.stated(held_camera, scene).basis(), (group.held_roll, group.when_set, axes(held_camera).tolist())
    found = both_sides(width=120, height=90)
    np.testing.assert_array_equal(found.exported.stated_camera.basis(), expected)
    found.check()
    assert (group.held_roll, group.when_set, axes(held_camera).tolist()) == before
