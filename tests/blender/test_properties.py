import json
import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import findings, preferences
from viewcam_addon.blender.interface import panel
from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole


def pose(camera_object):
    bpy.context.view_layer.update()
    return [tuple(row) for row in camera_object.matrix_world], camera_object.data.lens


def axes(camera_object):
    bpy.context.view_layer.update()
    return np.array(camera_object.matrix_world)[:3, :3]


def test_enabling_for_the_first_time_moves_nothing(camera_object):
    camera_object.location, camera_object.rotation_euler = (3, -4, 2), (1.2, 0.3, 0.5)
    before = pose(camera_object)
    camera_object.virtual_pinhole.enabled = True
    assert pose(camera_object) == before
    assert tuple(camera_object.virtual_pinhole.eye) == (3, -4, 2)


@pytest.mark.parametrize("times", [1, 3])
def test_enabling_again_reads_the_values_off_the_camera_each_time(posed_camera, times):
    group = posed_camera.virtual_pinhole
    for i in range(times):
        group.enabled = False
        posed_camera.location, posed_camera.rotation_euler, posed_camera.data.lens = (3, -4, i), (1.2, 0.3, i), 35 + i
        before = pose(posed_camera)
        group.enabled = True
        assert pose(posed_camera) == before, f"the {i + 1}th time"
        assert tuple(group.eye) == (3, -4, i) and group.distance == pytest.approx((35 + i) * 1920 / 36)


def test_enabling_again_a_camera_that_has_not_moved_keeps_every_digit(posed_camera):
    group = posed_camera.virtual_pinhole
    group.eye = (7.1, -6, 5)
    before = group.exact, tuple(group.eye), tuple(group.look_at), tuple(group.up), group.distance
    group.enabled = False
    group.enabled = True
    assert (group.exact, tuple(group.eye), tuple(group.look_at), tuple(group.up), group.distance) == before


def test_what_is_stated_while_the_values_are_off_counts_and_the_rest_is_read_off_the_camera(posed_camera):
    group = posed_camera.virtual_pinhole
    group.enabled = False
    posed_camera.location, posed_camera.data.lens = (3, -4, 2), 35
    group.look_at = (0, 0, 0)
    group.enabled = True
    bpy.context.view_layer.update()
    assert tuple(group.eye) == (3, -4, 2) and group.distance == pytest.approx(35 * 1920 / 36)
    w = np.array((3, -4, 2)) / math.sqrt(29)
    np.testing.assert_allclose(axes(posed_camera)[:, 2], w, atol=findings.LARGEST_TURN)


def test_a_camera_that_is_no_pinhole_can_not_be_enabled_and_the_reason_stays_the_same(camera_object, scene, empty):
    camera_object.parent = empty("Stretched", (1, 2, 3), rotation_euler=(0.1, 0.2, 0.3), scale=(1, 1, 3))
    camera_object.rotation_euler = (1, 0.5, 0.2)
    bpy.context.view_layer.update()
    before = [notice.sentence for notice in panel.notices(camera_object, scene)]
    assert before == [
        "Camera 'Camera' is oblique, its parent 'Stretched' is scaled non-uniformly: apply the scale of 'Stretched'"
    ]
    camera_object.virtual_pinhole.enabled = True
    bpy.context.view_layer.update()
    assert not camera_object.virtual_pinhole.enabled
    assert [notice.sentence for notice in panel.notices(camera_object, scene)] == before


def test_values_that_were_stated_before_enabling_are_applied(camera_object):
    group = camera_object.virtual_pinhole
    group.eye, group.look_at = (0, -5, 0), (0, 0, 0)
    group.enabled = True
    np.testing.assert_allclose(
        axes(camera_object), np.column_stack([(1, 0, 0), (0, 0, 1), (0, -1, 0)]), atol=findings.LARGEST_TURN
    )
    assert camera_object.data.lens == pytest.approx(50)


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("eye", (0, 0, 9), Pinhole((0, 0, 9), (0, 0, 1), (0, 0, 1), 1500.0, 1920, 1080)),
        ("look_at", (1, 1, 1), Pinhole((7, -6, 5), (1, 1, 1), (0, 0, 1), 1500.0, 1920, 1080)),
        ("up", (1, 0, 0), Pinhole((7, -6, 5), (0, 0, 1), (1, 0, 0), 1500.0, 1920, 1080)),
        ("distance", 800.0, Pinhole((7, -6, 5), (0, 0, 1), (0, 0, 1), 800.0, 1920, 1080)),
    ],
)
def test_editing_a_value_moves_the_camera_at_once(posed_camera, scene, name, value, expected):
    setattr(posed_camera.virtual_pinhole, name, value)
    assert cameras.stated(posed_camera, scene) == expected
    assert findings.differences(expected, cameras.read(posed_camera, scene), reach=10) == {}


def test_editing_one_component_is_enough(posed_camera):
    posed_camera.virtual_pinhole.eye[2] = 12.0
    assert tuple(posed_camera.location) == (7, -6, 12)


def test_editing_what_is_not_enabled_moves_nothing(camera_object):
    before = pose(camera_object)
    camera_object.virtual_pinhole.eye = (1, 2, 3)
    assert pose(camera_object) == before


@pytest.mark.parametrize(("name", "value"), [("look_at", (7, -6, 5)), ("up", (0, 0, 0)), ("distance", 0.0), ("distance", -5.0)])
def test_values_that_make_no_camera_leave_it_where_it_was_and_raise_nothing(posed_camera, name, value):
    before = pose(posed_camera)
    setattr(posed_camera.virtual_pinhole, name, value)
    assert pose(posed_camera) == before
    assert np.allclose(getattr(posed_camera.virtual_pinhole, name), value)


def test_a_number_that_is_none_leaves_the_camera_where_it_was(posed_camera):
    before = pose(posed_camera)
    posed_camera.virtual_pinhole.eye[0] = math.nan
    assert pose(posed_camera) == before


def test_a_value_mended_afterwards_moves_the_camera_again(posed_camera):
    posed_camera.virtual_pinhole.distance = 0.0
    posed_camera.virtual_pinhole.distance = 3000.0
    assert posed_camera.data.lens == pytest.approx(3000 * 36 / 1920)


def test_float64_values_survive_the_float32_properties(camera_object, scene):
    pinhole = Pinhole((0.1, 1e-9, 1 / 3), (0.1, 0, -1), (0, 0, 1), 1234.56789, 1920, 1080)
    cameras.apply(camera_object, pinhole, scene)
    group = camera_object.virtual_pinhole
    assert group.numbers() == (pinhole.eye, pinhole.look_at, pinhole.up, 1234.56789)
    assert group.precision() == 2.0**-53


def test_an_edited_number_overrules_its_exact_one_and_the_others_stay(camera_object, scene):
    pinhole = Pinhole((0.1, 1e-9, 1 / 3), (0.1, 0, -1), (0, 0, 1), 1234.56789, 1920, 1080)
    cameras.apply(camera_object, pinhole, scene)
    camera_object.virtual_pinhole.eye[0] = 0.2
    assert camera_object.virtual_pinhole.numbers()[0] == (float(np.float32(0.2)), 1e-9, 1 / 3)


@pytest.mark.parametrize("text", ["", "nonsense", "[1, 2]", "{}", json.dumps([None] * 10), json.dumps(["a"] * 10)])
def test_whatever_stands_in_the_hidden_text_the_shown_values_count(posed_camera, text):
    group = posed_camera.virtual_pinhole
    group.exact = text
    assert group.numbers() == ((7, -6, 5), (0, 0, 1), (0, 0, 1), 1500)
    assert group.precision() == 2.0**-24


@pytest.mark.parametrize("zoom", [0.25, 1.0, 3.0])
def test_zoom_is_a_factor_on_the_distance(posed_camera, scene, zoom):
    group = posed_camera.virtual_pinhole
    group.zoom = zoom
    assert group.distance == 1500 and group.numbers()[3] == 1500 * zoom
    assert posed_camera.data.lens == pytest.approx(zoom * 1500 * 36 / 1920, rel=2.0**-23)
    assert findings.differences(cameras.stated(posed_camera, scene), cameras.read(posed_camera, scene), reach=10) == {}


@pytest.mark.parametrize(("zoom", "sentence"), [(0.0, "zoom is 0"), (-2.0, "zoom is -2"), (math.nan, "zoom is nan")])
def test_a_zoom_that_makes_no_camera_leaves_it_and_is_named(posed_camera, scene, zoom, sentence):
    before = pose(posed_camera)
    posed_camera.virtual_pinhole.zoom = zoom
    assert pose(posed_camera) == before
    with pytest.raises(InputError, match=sentence):
        cameras.stated(posed_camera, scene)


@pytest.mark.parametrize(
    ("zoom", "distance", "kept"),
    [(2.0, 1000.0, 2.0), (1 / 3, 1234.56789, 1 / 3), (0.0, 700.0, 1), (math.nan, 700.0, 1), (1e-30, 1e10, 1), (3e38, 1e-5, 1)],
)
def test_stating_a_distance_keeps_a_zoom_that_is_one(posed_camera, scene, zoom, distance, kept):
    group = posed_camera.virtual_pinhole
    group.zoom = zoom
    cameras.apply(posed_camera, Pinhole((0, -5, 0), (0, 0, 0), (0, 0, 1), distance, 1920, 1080), scene)
    assert group.zoom == np.float32(kept)
    # A quotient and a product, each rounded once: nothing where the zoom is 1.
    assert abs(group.numbers()[3] - distance) <= (0 if kept == 1 else 2.0**-52 * distance)
    assert findings.differences(cameras.stated(posed_camera, scene), cameras.read(posed_camera, scene), reach=10) == {}


# Up is known in float64 once roll is set, and the axes and the angle cost a dozen roundings; the angle itself is float32.
ROLL = 2.0**-48
ANGLES = [np.float32(angle) for angle in (0.5, -0.5, 3.0, -3.0, 1e-6)]


@pytest.mark.parametrize("eye", [(7, -6, 5), (0, 0, 9), (0, 0, -9), (1e-7, 0, 9)])
@pytest.mark.parametrize("angle", ANGLES)
def test_roll_turns_up_about_the_view(posed_camera, scene, eye, angle):
    group = posed_camera.virtual_pinhole
    group.eye = eye
    u, v, w = cameras.stated(posed_camera, scene).basis()
    group.roll = angle
    rolled, angle = cameras.stated(posed_camera, scene), float(angle)
    expected = [math.cos(angle) * u + math.sin(angle) * v, math.cos(angle) * v - math.sin(angle) * u, w]
    assert np.abs(np.array(rolled.basis()) - expected).max() <= ROLL
    assert group.roll == np.float32(angle)
    assert findings.differences(rolled, cameras.read(posed_camera, scene), reach=10) == {}
    group.roll = 0.0
    assert np.abs(np.array(cameras.stated(posed_camera, scene).basis()) - (u, v, w)).max() <= ROLL


def test_typing_no_roll_gives_back_the_worlds_z_as_up(posed_camera):
    group = posed_camera.virtual_pinhole
    group.up = (1, 2, 3)
    assert abs(group.roll) > 0.1
    group.roll = 0.0
    assert group.numbers()[2] == (0, 0, 1) and group.roll == 0.0


def test_a_roll_that_is_rounding_alone_is_0(posed_camera):
    group = posed_camera.virtual_pinhole
    for eye in ((-0.5, -7.6, 1.62), (3, 1, 4), (1e-3, 2, 9)):
        group.eye = eye
        assert str(group.roll) == "0.0"


def test_roll_says_how_far_a_stated_up_leans(posed_camera):
    group = posed_camera.virtual_pinhole
    group.eye, group.look_at, group.up = (0, -5, 0), (0, 0, 0), (-1, 0, 1)
    assert group.roll == pytest.approx(math.pi / 4, abs=2.0**-24)


def test_roll_counts_from_the_preferred_axis(posed_camera, monkeypatch):
    group = posed_camera.virtual_pinhole
    group.eye, group.look_at, group.up = (0, 0, 5), (0, 0, 0), (0, 1, 0)
    monkeypatch.setattr(preferences, "up_axis", lambda: (0.0, 1.0, 0.0))
    assert group.roll == 0.0
    group.up = (1, 0, 0)
    assert group.roll == pytest.approx(-math.pi / 2, abs=2.0**-23)
    group.roll = 0.0
    assert group.numbers()[2] == (0, 1, 0)


def test_roll_keeps_the_digits_of_the_other_values(posed_camera, scene):
    pinhole = Pinhole((0.1, 1e-9, 1 / 3), (0.1, 0, -1), (0, 0, 1), 1234.56789, 1920, 1080)
    cameras.apply(posed_camera, pinhole, scene)
    posed_camera.virtual_pinhole.roll = 0.5
    eye, look_at, _, distance = posed_camera.virtual_pinhole.numbers()
    assert (eye, look_at, distance) == (pinhole.eye, pinhole.look_at, 1234.56789)
    assert posed_camera.virtual_pinhole.precision() == 2.0**-53


def test_roll_of_a_held_camera_changes_what_is_held(held_camera, scene):
    group = held_camera.virtual_pinhole
    up, before = tuple(group.up), group.roll
    group.roll = before + 0.25
    assert tuple(group.up) == up
    assert group.held_roll == pytest.approx(0.25, abs=2.0**-23)
    assert group.roll == pytest.approx(before + 0.25, abs=2.0**-23)


@pytest.mark.parametrize(("name", "value"), [("eye", (0, 0, 1)), ("up", (0, 0, 0)), ("eye", (math.nan, 0, 0))])
def test_roll_of_values_that_make_no_camera_is_0_and_can_not_be_set(posed_camera, name, value):
    group = posed_camera.virtual_pinhole
    setattr(group, name, value)
    before = group.numbers()
    group.roll = 0.5
    assert group.roll == 0.0
    np.testing.assert_array_equal(np.hstack(group.numbers()), np.hstack(before))


def test_roll_of_a_camera_that_is_not_enabled_turns_up_and_leaves_it(camera_object):
    group = camera_object.virtual_pinhole
    group.eye, before = (0, -5, 0), pose(camera_object)
    group.roll = 0.5
    assert group.roll == pytest.approx(0.5) and pose(camera_object) == before and not group.enabled


def test_percentage_shows_the_same_picture(posed_camera, scene):
    at_full_size = cameras.stated(posed_camera, scene)
    scene.render.resolution_percentage = 50
    assert cameras.stated(posed_camera, scene) == at_full_size.resized(960, 540)
    assert findings.differences(cameras.stated(posed_camera, scene), cameras.read(posed_camera, scene), reach=10) == {}


def test_undo_and_redo_bring_values_and_camera_together(posed_camera, fresh_blender):
    def state():
        item = bpy.data.objects["Camera"]
        return pose(item), item.virtual_pinhole.numbers()

    fresh_blender.ops.ed.undo_push(message="stated")
    before = state()
    posed_camera.virtual_pinhole.eye = (0, 0, 20)
    fresh_blender.ops.ed.undo_push(message="edited")
    after = state()
    assert after != before
    fresh_blender.ops.ed.undo()
    assert state() == before
    fresh_blender.ops.ed.redo()
    assert state() == after


def test_saving_and_opening_keep_values_and_camera(posed_camera, scene, tmp_path):
    pinhole = Pinhole((1 / 3, 2 / 3, 4), (0, 0, 1 / 7), (0, 0, 1), 10.0, 1920, 1080)
    cameras.apply(posed_camera, pinhole, scene)
    before = pose(posed_camera), posed_camera.virtual_pinhole.numbers()
    path = str(tmp_path / "camera.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.wm.open_mainfile(filepath=path)
    camera_object, scene = bpy.data.objects["Camera"], bpy.context.scene
    assert (pose(camera_object), camera_object.virtual_pinhole.numbers()) == before
    cameras.apply(camera_object, Pinhole((1, 2, 4), (0, 0, 0), (0, 0, 1), 1000.0, 1920, 1080), scene)
    assert camera_object.data.sensor_width == 36  # the sensor that grew before saving comes back


def test_renaming_changes_nothing(posed_camera, scene):
    posed_camera.name, posed_camera.data.name = "Renamed", "Data"
    posed_camera.virtual_pinhole.eye = (0, -9, 0)
    assert tuple(posed_camera.location) == (0, -9, 0)
    assert findings.differences(cameras.stated(posed_camera, scene), cameras.read(posed_camera, scene), reach=10) == {}


def test_a_linked_duplicate_stands_by_values_of_its_own_and_shares_lens_and_distance(posed_camera, scene):
    twin = posed_camera.copy()
    scene.collection.objects.link(twin)
    assert twin.virtual_pinhole.numbers() == posed_camera.virtual_pinhole.numbers()
    twin.virtual_pinhole.eye = (0, -9, 0)
    assert tuple(posed_camera.location) == (7, -6, 5)
    twin.virtual_pinhole.distance = 700.0
    bpy.context.view_layer.update()
    assert posed_camera.virtual_pinhole.distance == pytest.approx(700)
    assert cameras.check(posed_camera, cameras.stated(posed_camera, scene), scene) == []
    assert cameras.check(twin, cameras.stated(twin, scene), scene) == []


def test_linked_duplicates_share_the_artists_sensor(posed_camera, scene):
    twin = posed_camera.copy()
    scene.collection.objects.link(twin)
    posed_camera.virtual_pinhole.distance = 8.0
    assert twin.data.sensor_width == 288
    twin.virtual_pinhole.distance = 1000.0
    assert twin.data.sensor_width == 36


def test_a_library_override_keeps_its_values(posed_camera, tmp_path, link_camera):
    override = link_camera().override_create(remap_local_usages=True)
    override.data.override_create(remap_local_usages=True)
    group = override.virtual_pinhole
    group.eye, group.roll, group.zoom, group.keeps = (0, -9, 0), 0.5, 2, "FIELD_OF_VIEW"
    assert tuple(override.location) == (0, -9, 0)
    before = group.roll, group.numbers(), override.data.lens
    shot = str(tmp_path / "shot.blend")
    bpy.ops.wm.save_as_mainfile(filepath=shot)
    bpy.ops.wm.open_mainfile(filepath=shot)
    camera_object = next(item for item in bpy.data.objects if item.override_library)
    assert tuple(camera_object.virtual_pinhole.eye) == (0, -9, 0)
    assert tuple(camera_object.location) == (0, -9, 0)
    group = camera_object.virtual_pinhole
    assert (group.roll, group.numbers(), camera_object.data.lens) == before and group.keeps == "FIELD_OF_VIEW"


def test_the_properties_work_in_edit_mode_of_another_object(posed_camera, scene):
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.object.mode_set(mode="EDIT")
    posed_camera.virtual_pinhole.eye = (0, -9, 0)
    assert tuple(posed_camera.location) == (0, -9, 0)


@pytest.mark.parametrize("fit", ["AUTO", "HORIZONTAL", "VERTICAL"])
@pytest.mark.parametrize("size", [(1920, 1080), (600, 999)])
def test_the_lens_is_said_in_any_unit_and_is_one_distance(posed_camera, scene, size, fit):
    scene.render.resolution_x, scene.render.resolution_y = size
    posed_camera.data.sensor_fit = fit
    bpy.context.view_layer.update()
    group, data = posed_camera.virtual_pinhole, posed_camera.data
    group.zoom = 2.0
    group.lens_unit = "MILLIMETERS"
    group.focal_length = 35
    assert data.lens == pytest.approx(35, rel=1e-6) and group.zoom == 2
    for unit, side in (("HORIZONTAL", size[0]), ("VERTICAL", size[1]), ("DIAGONAL", math.hypot(*size))):
        group.lens_unit = unit
        assert group.field_of_view == pytest.approx(2 * math.atan(side / 2 / (2 * group.distance)), rel=1e-6)
        group.field_of_view = math.radians(60)
        assert 2 * group.distance == pytest.approx(side / 2 / math.tan(math.radians(30)), rel=1e-6)
        pinhole = cameras.read(posed_camera, scene).distance[0]
        assert pinhole == pytest.approx(2 * group.distance, rel=1e-6)
    before = group.distance
    group.field_of_view = math.radians(200)
    assert group.distance == before, "no lens has this angle"
