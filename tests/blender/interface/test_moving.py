"""The buttons that move a camera: what each does, what it says where it can't, and that undo takes it all back."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import preferences
from viewcam_addon.blender.interface import dragging, moving, selection, viewport
from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole

POINT = (1.5, -2.25, 3.125)  # numbers that float32 holds


@pytest.fixture
def selected_cube(posed_camera, scene):
    """A cube of side 2 about POINT, selected and active; the camera is the scene's."""
    bpy.ops.mesh.primitive_cube_add(location=POINT)
    bpy.context.view_layer.update()
    return bpy.context.object


@pytest.fixture
def stated(posed_camera, scene):
    """A function that gives the camera's stated Pinhole after checking that it is the camera that one reads."""

    def get():
        pinhole = cameras.stated(posed_camera, scene)
        assert cameras.check(posed_camera, pinhole, scene) == []
        return pinhole

    return get


# --- What each does ---------------------------------------------------------------------------------------------------------


def test_looks_at_the_selections_center(selected_cube, stated):
    before = stated()
    assert bpy.ops.viewcam.look_at_selection() == {"FINISHED"}
    after = stated()
    assert after.look_at == POINT
    assert (after.eye, after.up, after.distance) == (before.eye, before.up, before.distance)


def test_looks_at_the_median_of_the_vertices_if_that_is_asked_for(selected_cube, stated):
    for vertex in selected_cube.data.vertices:
        if vertex.co.x > 0 and not (vertex.co.y > 0 and vertex.co.z > 0):
            vertex.co.x = -1  # seven of eight corners on the left
    bpy.ops.viewcam.look_at_selection(center="MEDIAN")
    assert stated().look_at == pytest.approx((POINT[0] - 0.75, *POINT[1:]))
    bpy.ops.viewcam.look_at_selection(center="BOUNDS")
    assert stated().look_at == POINT


def test_looks_at_the_selected_vertices_in_edit_mode(selected_cube, stated):
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="DESELECT")
    bpy.ops.object.mode_set(mode="OBJECT")
    for vertex in selected_cube.data.vertices:
        vertex.select = vertex.co.z > 0
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.viewcam.look_at_selection()
    assert stated().look_at == (POINT[0], POINT[1], POINT[2] + 1)


@pytest.mark.parametrize("mode", ["SCULPT", "VERTEX_PAINT", "WEIGHT_PAINT", "TEXTURE_PAINT"])
def test_in_modes_that_select_nothing_the_selected_object_counts(selected_cube, stated, mode):
    bpy.ops.object.mode_set(mode=mode)
    assert bpy.context.mode != "OBJECT"
    bpy.ops.viewcam.look_at_selection()
    assert stated().look_at == POINT


def test_looks_at_the_cursor(stated, scene):
    scene.cursor.location = POINT
    bpy.ops.viewcam.look_at_cursor()
    assert stated().look_at == POINT


def test_looks_at_the_active_object_where_its_constraints_put_it(selected_cube, stated, empty):
    selected_cube.constraints.new("COPY_LOCATION").target = empty("There", (4, 5, 6))
    bpy.context.view_layer.objects.active = selected_cube
    bpy.ops.viewcam.look_at_active()
    assert stated().look_at == (4, 5, 6)


def test_dolly_goes_to_a_distance_and_without_one_stays_and_tells_it(stated):
    before = stated()
    assert bpy.ops.viewcam.dolly_camera() == {"FINISHED"}
    assert stated() == before
    bpy.ops.viewcam.dolly_camera(reach=2.5)
    after = stated()
    assert math.dist(after.eye, after.look_at) == pytest.approx(2.5, abs=64 * 2**-53)
    assert after.look_at == before.look_at
    np.testing.assert_allclose(after.basis(), before.basis(), atol=64 * 2**-53)


def test_orbit_goes_to_the_right_and_up_as_the_picture_shows_it(stated):
    before = stated()
    u, v, _ = before.basis()
    bpy.ops.viewcam.orbit_camera(around=0.1)
    assert np.subtract(stated().eye, before.eye) @ u > 0.5
    bpy.ops.viewcam.orbit_camera(around=-0.1, upwards=0.1)
    assert np.subtract(stated().eye, before.eye) @ v > 0.5


def test_orbit_goes_to_the_right_of_a_mirrored_picture_too(posed_camera, stated):
    posed_camera.scale.x = -1
    bpy.ops.viewcam.apply_camera()
    before = stated()
    assert before.mirrored
    bpy.ops.viewcam.orbit_camera(around=0.1)
    middle = before.principal_point[0]
    assert before.project(stated().eye - 20 * before.basis()[2])[0] > middle


def test_orbit_over_the_pole_comes_down_upside_down_and_the_camera_takes_it(stated):
    bpy.ops.viewcam.orbit_camera(around=0.0, upwards=math.radians(120))
    after = stated()
    assert after.up == (0, 0, -1) and after.basis()[1][2] < 0
    bpy.ops.viewcam.orbit_camera(around=0.0, upwards=-math.radians(120))
    after = stated()
    assert after.up == (0, 0, 1)
    np.testing.assert_allclose(after.eye, (7, -6, 5), atol=4 * 10 * 2**-24)  # angles in float32, there and back


@pytest.mark.parametrize("by", ["EYE", "DISTANCE"])
@pytest.mark.parametrize("shift", [0.0, 0.2])
def test_framing_puts_the_selection_inside_the_margin_and_touches_it(selected_cube, posed_camera, stated, by, shift):
    posed_camera.data.shift_x = shift
    bpy.context.view_layer.update()
    before = stated()
    bpy.ops.viewcam.frame_selection(by=by, margin=10)
    after = stated()
    corners = np.array([POINT + np.array([x, y, z]) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    column, row, _ = after.project(corners)
    inside = np.array([column - 192, 1728 - column, row - 108, 972 - row])
    assert abs(inside.min()) < 1e-9, f"the nearest corner is {inside.min():.3g} px inside the margin"
    if by == "EYE":
        assert after.distance == before.distance and after.eye != before.eye
    else:
        assert after.eye == before.eye and after.distance != before.distance


@pytest.mark.parametrize("by", ["EYE", "DISTANCE"])
def test_framing_centers_the_selection_unless_that_is_turned_off_or_the_view_follows_an_object(
    selected_cube, posed_camera, stated, by, empty
):
    posed_camera.virtual_pinhole.look_at = (-1, 2, 0)
    direction = stated().basis()[2]
    bpy.ops.viewcam.frame_selection(by=by, center=False)
    assert stated().basis()[2] == pytest.approx(direction, abs=1e-6)
    bpy.ops.viewcam.frame_selection(by=by)
    column, row, _ = stated().project(np.array(POINT, dtype=float))
    assert (column, row) == pytest.approx((960, 540), abs=1e-6)
    if by == "EYE":
        assert stated().basis()[2] == pytest.approx(direction, abs=1e-6)
    posed_camera.virtual_pinhole.look_at_target = target = empty("Target", POINT + np.array([0.1, 0, 0]))
    bpy.ops.viewcam.frame_selection(by=by)
    assert posed_camera.virtual_pinhole.look_at_target == target


def test_swapping_looks_back(stated):
    bpy.ops.viewcam.swap_camera()
    assert (stated().eye, stated().look_at) == ((0, 0, 1), (7, -6, 5))


def test_leveling_makes_up_the_worlds_z(posed_camera, stated):
    posed_camera.virtual_pinhole.up = (1, 0.2, 0.3)
    bpy.ops.viewcam.level_camera()
    assert stated().up == (0, 0, 1)


def test_leveling_makes_up_the_axis_that_the_preferences_say(posed_camera, stated, monkeypatch):
    monkeypatch.setattr(preferences, "get", lambda: preferences.Defaults(default_up="-Y"))
    bpy.ops.viewcam.level_camera()
    assert stated().up == (0, -1, 0)


@pytest.mark.parametrize("up", [(0, 0, 1), (0, 1, 0), (1, 1, 0)])
def test_leveling_a_view_straight_down_leaves_no_doubt(posed_camera, stated, up):
    group = posed_camera.virtual_pinhole
    group.eye, group.look_at, group.up = (0, 0, 9), (0, 0, 0), up
    bpy.ops.viewcam.level_camera()
    after = stated()
    assert after.up == (1, 0, 0) and not after.is_singular  # the canonical axes of up = z say this up


def test_the_view_of_the_viewport_becomes_the_cameras(posed_camera, stated):
    view = viewport.area_in(bpy.context).spaces.active.region_3d
    view.view_perspective, view.view_location, view.view_distance = "PERSP", (0, 3, 2), 8.0
    view.view_rotation = (math.sqrt(0.5), math.sqrt(0.5), 0, 0)
    bpy.ops.viewcam.adopt_view()
    after = stated()
    np.testing.assert_allclose(after.eye, (0, -5, 2), atol=1e-5)
    assert (after.look_at, after.up) == ((0, 3, 2), (0, 0, 1))


def test_the_view_through_the_camera_itself_is_where_it_stands(posed_camera, stated):
    viewport.area_in(bpy.context).spaces.active.region_3d.view_perspective = "CAMERA"
    posed_camera.location.x += 1
    bpy.context.view_layer.update()
    before = np.array(posed_camera.matrix_world)
    bpy.ops.viewcam.adopt_view()
    assert stated().eye == (8, -6, 5)
    np.testing.assert_allclose(np.array(posed_camera.matrix_world), before, atol=8 * 2**-24)


# --- A camera that is not enabled, is named, keyed or linked ----------------------------------------------------------------


def test_a_camera_that_is_not_enabled_is_adopted_first(camera_object, scene):
    camera_object.location = (1, 2, 3)
    bpy.context.view_layer.update()
    before = cameras.read(camera_object, scene)
    bpy.ops.viewcam.dolly_camera(reach=4.0)
    after = cameras.stated(camera_object, scene)
    assert camera_object.virtual_pinhole.enabled
    np.testing.assert_allclose(after.eye, (1, 2, -3), atol=32 * 2**-53)  # 10 m before it is the plane of focus
    assert after.distance == pytest.approx(before.distance)


def test_what_was_stated_once_does_not_bring_a_disabled_camera_back(posed_camera, scene):
    posed_camera.virtual_pinhole.enabled = False
    posed_camera.location = (1, 2, 30)
    bpy.context.view_layer.update()
    bpy.ops.viewcam.look_at_cursor()
    assert tuple(posed_camera.virtual_pinhole.eye) == (1, 2, 30)


def test_a_move_that_fails_enables_nothing(camera_object, scene):
    scene.cursor.location = camera_object.location
    with pytest.raises(RuntimeError, match="Eye and look_at are the same point"):
        bpy.ops.viewcam.look_at_cursor()
    assert not camera_object.virtual_pinhole.enabled


def test_a_camera_can_be_named(posed_camera, add_camera, scene):
    add_camera("Other")
    bpy.ops.viewcam.swap_camera(camera="Camera")
    assert tuple(posed_camera.virtual_pinhole.eye) == (0, 0, 1)


def test_what_does_not_stick_is_reported(posed_camera, scene, capfd):
    posed_camera.driver_add("location", 0).driver.expression = "1.0 + 1.0"
    bpy.ops.viewcam.swap_camera()
    assert "A driver sets the location" in capfd.readouterr().out


def test_keyed_values_can_be_moved_and_keyed_again(posed_camera, scene):
    group = posed_camera.virtual_pinhole
    for frame in (1, 10):
        group.keyframe_insert("eye", frame=frame)
    bpy.ops.viewcam.swap_camera()
    bpy.context.view_layer.update()
    assert tuple(group.eye) == (0, 0, 1) and cameras.read(posed_camera, scene).eye == (0, 0, 1)
    group.keyframe_insert("eye", frame=5)
    scene.frame_set(10)
    assert tuple(group.eye) == (7, -6, 5)
    scene.frame_set(5)
    assert cameras.read(posed_camera, scene).eye == (0, 0, 1)


def test_a_linked_camera_is_moved_and_it_is_said_that_this_is_not_saved(posed_camera, link_camera, capfd):
    linked = link_camera()
    bpy.context.scene.camera = linked
    bpy.context.view_layer.update()
    bpy.ops.viewcam.swap_camera()
    assert tuple(linked.location) == (0, 0, 1)
    assert "what is set here is not saved" in capfd.readouterr().out


def test_a_held_roll_becomes_a_part_of_up(held_camera, scene, over_the_top):
    for degrees in (-10, 0, 10, 20):
        held_camera.virtual_pinhole.eye = over_the_top(degrees, 1.0)
    assert abs(held_camera.virtual_pinhole.held_roll) > 1
    bpy.context.view_layer.update()
    before = cameras.read(held_camera, scene)
    bpy.ops.viewcam.dolly_camera(reach=20.0)
    after = cameras.stated(held_camera, scene)
    assert held_camera.virtual_pinhole.held_roll == 0
    np.testing.assert_allclose(after.basis(), before.basis(), atol=32 * 2**-24)
    assert cameras.check(held_camera, after, scene) == []


def test_they_keep_float64(posed_camera, scene):
    bpy.ops.viewcam.orbit_camera(around=0.1)
    eye = cameras.stated(posed_camera, scene).eye
    assert posed_camera.virtual_pinhole.precision() == 2.0**-53
    rounded = np.float32(eye).tolist()
    assert rounded == list(posed_camera.virtual_pinhole.eye) and rounded != list(eye)


# --- What they say ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("operator", [each.bl_idname.split(".")[1] for each in moving.CLASSES])
def test_without_a_camera_the_buttons_are_off(fresh_blender, operator):
    assert not getattr(bpy.ops.viewcam, operator).poll()


@pytest.mark.parametrize(
    ("operator", "message"),
    [
        ("look_at_selection", "Nothing but the camera is selected"),
        ("frame_selection", "Nothing but the camera is selected"),
        ("look_at_active", "No object but the camera is active"),
    ],
)
def test_with_nothing_but_the_camera_the_buttons_say_what_is_missing(posed_camera, operator, message):
    posed_camera.select_set(True)
    bpy.context.view_layer.objects.active = posed_camera
    assert not getattr(bpy.ops.viewcam, operator).poll()
    with pytest.raises(RuntimeError, match=message):
        getattr(bpy.ops.viewcam, operator)()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: bpy.ops.viewcam.dolly_camera(reach=0.0), "give one above 0"),
        (lambda: bpy.ops.viewcam.look_at_active(camera="Cube"), "'Cube' is no camera"),
        (lambda: bpy.ops.viewcam.frame_selection(camera="Nobody"), "There is no camera 'Nobody'"),
    ],
)
def test_errors_are_one_sentence_and_change_nothing(selected_cube, posed_camera, scene, call, message):
    before = snapshot("Camera")
    with pytest.raises(RuntimeError, match=message) as error:
        call()
    assert "Traceback" not in str(error.value)
    assert snapshot("Camera") == before


def test_an_orthographic_viewport_is_an_error_in_one_sentence(posed_camera):
    viewport.area_in(bpy.context).spaces.active.region_3d.view_perspective = "ORTHO"
    with pytest.raises(RuntimeError, match="The viewport is orthographic, no pinhole"):
        bpy.ops.viewcam.adopt_view()


def test_no_vertex_selected_is_an_error_in_one_sentence(selected_cube):
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="DESELECT")
    with pytest.raises(RuntimeError, match="No vertex, control point or bone is selected"):
        bpy.ops.viewcam.frame_selection()


@pytest.mark.parametrize("each", moving.CLASSES)
def test_every_button_teaches_and_can_be_undone(each):
    assert each.bl_options == {"REGISTER", "UNDO"}
    assert len(each.bl_description) > 30 and not each.bl_description.endswith(".")
    properties = getattr(bpy.ops.viewcam, each.bl_idname.split(".")[1]).get_rna_type().properties
    assert all(each.description for each in properties if each.identifier != "rna_type")


# --- Undo -------------------------------------------------------------------------------------------------------------------


def snapshot(name):
    """Everything of the camera that an operator could change, bit for bit."""
    camera_object = bpy.data.objects[name]
    group, data = camera_object.virtual_pinhole, camera_object.data
    values = {prop.identifier: getattr(group, prop.identifier) for prop in group.bl_rna.properties if not prop.is_readonly}
    values |= {key: getattr(camera_object, key) for key in ("location", "rotation_euler", "scale", "matrix_world")}
    values |= {key: getattr(data, key) for key in ("lens", "sensor_width", "sensor_height", "shift_x", "shift_y")}
    return {key: np.array(value).tolist() for key, value in values.items()}


@pytest.mark.parametrize(
    ("operator", "options"),
    [
        ("adopt_view", {}),
        ("look_at_selection", {}),
        ("look_at_cursor", {}),
        ("look_at_active", {}),
        ("dolly_camera", {"reach": 3.0}),
        ("orbit_camera", {"around": 0.3, "upwards": 2.0}),
        ("frame_selection", {"by": "EYE"}),
        ("frame_selection", {"by": "DISTANCE"}),
        ("swap_camera", {}),
        ("level_camera", {}),
    ],
)
@pytest.mark.parametrize("enabled", [True, False])
def test_undo_restores_values_and_camera_bit_for_bit(posed_camera, selected_cube, scene, operator, options, enabled):
    scene.cursor.location = (0.1, 0.2, 0.3)
    posed_camera.virtual_pinhole.up = (0.1, 0.2, 0.7)
    posed_camera.virtual_pinhole.enabled = enabled
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="before")
    before = snapshot("Camera")
    getattr(bpy.ops.viewcam, operator)(**options)
    bpy.context.view_layer.update()
    after = snapshot("Camera")
    assert after != before, "it did nothing"
    bpy.ops.ed.undo_push(message="moved")
    bpy.ops.ed.undo()
    assert snapshot("Camera") == before
    bpy.ops.ed.redo()
    assert snapshot("Camera") == after


def test_dolly_in_a_menu_asks_for_the_distance_and_does_nothing_before(posed_camera, stated, monkeypatch):
    """A click on it, while it stood in the panel, was followed by nothing that could be seen."""
    before, asked = stated(), []
    operator = moving.VIEWCAM_OT_dolly_camera
    properties = SimpleNamespace(is_property_set=lambda name: False)
    window_manager = SimpleNamespace(invoke_props_dialog=lambda each: asked.append(each.reach) or {"RUNNING_MODAL"})
    clicked = SimpleNamespace(target_camera=lambda context: posed_camera, properties=properties, reach=0.0)
    assert operator.invoke(clicked, SimpleNamespace(window_manager=window_manager), None) == {"RUNNING_MODAL"}
    assert asked == [math.dist(before.eye, before.look_at)] and stated() == before


# --- Orbit, dolly, dolly zoom and truck as the mouse drags them


REACH = math.dist((7, -6, 5), (0, 0, 1))


@pytest.mark.parametrize("kind", [dragging.ORBIT, dragging.DOLLY, dragging.DOLLY_ZOOM, dragging.TRUCK])
def test_a_drag_moves_visibly_there_and_back_and_canceling_restores_every_bit(posed_camera, scene, kind):
    bpy.context.view_layer.update()
    before, start = dragging.state(posed_camera), cameras.stated(posed_camera, scene)
    drag = dragging.Drag(posed_camera, scene, kind)
    drag.move(80, 20)
    bpy.context.view_layer.update()
    there = cameras.stated(posed_camera, scene)
    assert math.dist(there.eye, start.eye) > 0.05 * REACH
    drag.move(-80, -20)
    assert cameras.stated(posed_camera, scene).eye == pytest.approx(start.eye, abs=1e-9)
    drag.move(33, 7, precise=True)
    drag.cancel()
    bpy.context.view_layer.update()
    assert dragging.state(posed_camera) == before


def test_a_dolly_zoom_keeps_the_size_at_the_look_at_point(posed_camera, scene):
    drag = dragging.Drag(posed_camera, scene, dragging.DOLLY_ZOOM)
    drag.move(120, 0)
    pinhole = cameras.stated(posed_camera, scene)
    reach = math.dist(pinhole.eye, pinhole.look_at)
    assert reach < 0.7 * REACH
    assert pinhole.distance[0] / reach == pytest.approx(1500 / REACH, rel=1e-12)


def test_a_truck_carries_the_look_at_point_along_under_the_mouse(posed_camera, scene):
    start = cameras.stated(posed_camera, scene)
    dragging.Drag(posed_camera, scene, dragging.TRUCK).move(100, -50)
    column, row, _ = cameras.stated(posed_camera, scene).project(np.array(start.look_at))
    assert (column, row) == pytest.approx((960 + 100, 540 - 50), abs=1e-6)


def test_a_typed_number_counts_instead_of_the_mouse(posed_camera, scene):
    drag = dragging.Drag(posed_camera, scene, dragging.DOLLY)
    drag.move(500, 0)
    drag.type("2.5")
    pinhole = cameras.stated(posed_camera, scene)
    assert math.dist(pinhole.eye, pinhole.look_at) == pytest.approx(REACH + 2.5, rel=1e-12)
    drag.type("-")
    assert math.dist(cameras.stated(posed_camera, scene).eye, pinhole.look_at) < REACH
    drag.type("-99")
    assert math.dist(cameras.stated(posed_camera, scene).eye, pinhole.look_at) < REACH, "beyond the look-at point it waits"


def test_what_follows_an_object_is_not_dragged_away_from_it(posed_camera, scene, empty):
    posed_camera.virtual_pinhole.look_at_target = empty("Target")
    with pytest.raises(InputError, match="the look-at follows 'Target', and can't be dragged"):
        dragging.Drag(posed_camera, scene, dragging.TRUCK)
    dragging.Drag(posed_camera, scene, dragging.ORBIT).move(10, 0)
    assert posed_camera.virtual_pinhole.look_at_target is not None


def test_the_operator_does_the_same_by_numbers(posed_camera, scene):
    assert bpy.ops.viewcam.drag_camera(kind="DOLLY", amount=(1.0, 0.0)) == {"FINISHED"}
    pinhole = cameras.stated(posed_camera, scene)
    assert math.dist(pinhole.eye, pinhole.look_at) == pytest.approx(REACH + 1)


# --- Selection


CUBE = np.array([[x, y, z] for x in (-1.0, 1) for y in (-1.0, 1) for z in (-1.0, 1)])


@pytest.fixture
def points(posed_camera):
    """A function that gives the selection's points, sorted."""

    def sorted_points():
        bpy.context.view_layer.update()
        positions = selection.points(bpy.context, posed_camera)
        return positions[np.lexsort(positions.round(3).T[::-1])]

    return sorted_points


def select_only(*blocks):
    for block in bpy.context.scene.objects:
        block.select_set(block in blocks)


def test_a_mesh_is_its_vertices_in_the_world(points):
    bpy.ops.mesh.primitive_cube_add(location=(1, 2, 3), rotation=(0, 0, math.pi / 2), scale=(1, 1, 2))
    expected = CUBE * (1, 1, 2) + (1, 2, 3)
    np.testing.assert_allclose(points(), expected[np.lexsort(expected.T[::-1])], atol=8 * 2**-24)


def test_modifiers_and_constraints_count(points, empty):
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    array = cube.modifiers.new("Array", "ARRAY")
    array.use_relative_offset, array.use_constant_offset, array.constant_offset_displace = False, True, (10, 0, 0)
    cube.constraints.new("COPY_LOCATION").target = empty("There", (0, 0, 100))
    positions = points()
    assert len(positions) == 16
    np.testing.assert_allclose(selection.bounds_center(positions), (5, 0, 100), atol=200 * 2**-24)


def test_the_instances_of_a_collection_count(points, scene):
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    collection = bpy.data.collections.new("Cubes")
    collection.objects.link(cube)
    scene.collection.objects.unlink(cube)
    instancer = bpy.data.objects.new("Instancer", None)
    scene.collection.objects.link(instancer)
    instancer.instance_type, instancer.instance_collection, instancer.location = "COLLECTION", collection, (5, 0, 0)
    select_only(instancer)
    np.testing.assert_allclose(points(), CUBE + np.array([5, 0, 0]), atol=8 * 2**-24)


@pytest.mark.parametrize("kind", ["curve.primitive_bezier_circle", "surface.primitive_nurbs_surface_sphere", "object.text"])
def test_curves_surfaces_and_text_are_what_is_drawn(points, kind):
    room, name = kind.split(".")
    getattr(getattr(bpy.ops, room), f"{name}_add")(location=(0, 0, 7))
    positions = points()
    assert len(positions) > 8 and np.abs(positions - (0, 0, 7)).max() < 3


def test_metaballs_are_what_is_drawn(points):
    bpy.ops.object.metaball_add(type="BALL", location=(0, 0, 7))
    positions = points()
    assert len(positions) > 20
    np.testing.assert_allclose(selection.bounds_center(positions), (0, 0, 7), atol=0.1)


def test_what_has_no_geometry_is_its_origin(points, empty, add_lamp):
    there = empty("There", (1, 2, 3))
    lamp = add_lamp("POINT", (4, 5, 6))
    select_only(there, lamp)
    np.testing.assert_array_equal(points(), [(1, 2, 3), (4, 5, 6)])


@pytest.mark.parametrize("kind", ["armature", "lattice"])
def test_armatures_and_lattices_are_their_boxes(points, kind):
    if kind == "armature":
        bpy.ops.object.armature_add(location=(3, 0, 0))
        middle = (3, 0, 0.5)
    else:
        bpy.ops.object.add(type="LATTICE", location=(3, 0, 0))
        middle = (3, 0, 0)
    np.testing.assert_allclose(selection.bounds_center(points()), middle, atol=0.11)


def test_the_camera_itself_does_not_count(points, posed_camera, empty):
    there = empty("There", (1, 2, 3))
    select_only(there, posed_camera)
    np.testing.assert_array_equal(points(), [(1, 2, 3)])


def test_a_vertex_that_is_nowhere_does_not_count(points):
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.data.vertices[0].co.x = math.nan
    assert len(points()) == 7


def test_nothing_selected_is_said(points, posed_camera):
    select_only(posed_camera)
    with pytest.raises(InputError, match="nothing but the camera, or nothing at all, is selected"):
        points()


def test_in_edit_mode_the_selected_vertices_count_without_modifiers(points):
    bpy.ops.mesh.primitive_cube_add(location=(0, 0, 10))
    cube = bpy.context.object
    cube.modifiers.new("Array", "ARRAY")
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="DESELECT")
    with pytest.raises(InputError, match="no vertex, control point or bone is selected"):
        points()
    bpy.ops.object.mode_set(mode="OBJECT")
    for vertex in cube.data.vertices:
        vertex.select = vertex.co.z > 0
    bpy.ops.object.mode_set(mode="EDIT")
    assert len(points()) == 4 and (points()[:, 2] == 11).all()


def test_in_edit_mode_of_a_curve_the_selected_points_count(points):
    bpy.ops.curve.primitive_bezier_curve_add(location=(0, 0, 10))
    curve = bpy.context.object
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.curve.select_all(action="DESELECT")
    curve.data.splines[0].bezier_points[0].select_control_point = True
    np.testing.assert_array_equal(points(), [(-1, 0, 10)])


def test_in_edit_mode_of_a_surface_the_selected_points_count(points):
    bpy.ops.surface.primitive_nurbs_surface_sphere_add(location=(0, 0, 10))
    surface = bpy.context.object
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.curve.select_all(action="DESELECT")
    point = surface.data.splines[0].points[3]
    point.select = True
    np.testing.assert_allclose(points(), [np.add(point.co[:3], (0, 0, 10))], atol=16 * 2**-24)


def test_in_edit_mode_of_a_lattice_the_selected_points_count(points):
    bpy.ops.object.add(type="LATTICE", location=(0, 0, 10))
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.lattice.select_all(action="SELECT")
    np.testing.assert_allclose(points(), CUBE / 2 + (0, 0, 10), atol=16 * 2**-24)


def test_in_edit_mode_of_an_armature_the_selected_ends_count(points):
    bpy.ops.object.armature_add(location=(0, 0, 10))
    bpy.ops.object.mode_set(mode="EDIT")
    bone = bpy.context.object.data.edit_bones[0]
    bone.select_head, bone.select_tail = False, True
    np.testing.assert_allclose(points(), [(0, 0, 11)], atol=16 * 2**-24)


def test_in_pose_mode_the_selected_bones_count_as_they_are_posed(points):
    bpy.ops.object.armature_add(location=(0, 0, 10))
    bpy.ops.object.mode_set(mode="POSE")
    bpy.ops.pose.select_all(action="SELECT")
    bpy.context.object.pose.bones[0].location = (5, 0, 0)
    np.testing.assert_allclose(points(), [(5, 0, 10), (5, 0, 11)], atol=32 * 2**-24)


def test_the_median_is_the_mean_and_the_center_is_that_of_the_box():
    cloud = np.array([[0.0, 0, 0], [0, 0, 0], [3, 6, -9]])
    assert selection.median(cloud) == (1, 2, -3)
    assert selection.bounds_center(cloud) == (1.5, 3, -4.5)


# --- Viewport


LIKE = Pinhole((9, 9, 9), (0, 0, 0), (0, 0, 1), 1, 1920, 1080)


@pytest.fixture
def area(posed_camera):
    """The 3D viewport, looking from (0, −5, 2) along y at (0, 3, 2) with a lens of 36 mm: 90° across its larger side."""
    area = viewport.area_in(bpy.context)
    space = area.spaces.active
    view, space.lens = space.region_3d, 36.0
    view.view_perspective, view.view_location, view.view_distance = "PERSP", (0, 3, 2), 8.0
    view.view_rotation = (math.sqrt(0.5), math.sqrt(0.5), 0, 0)
    return area


def region_of(area):
    return next(region for region in area.regions if region.type == "WINDOW")


def test_the_view_of_the_viewport_on_paper(area, scene):
    pinhole = viewport.pinhole_of(area, LIKE, scene)
    # sqrt(½) in float32, and the quaternion is normalized in float32 again.
    np.testing.assert_allclose(pinhole.eye, (0, -5, 2), atol=8 * 4 * 2**-24)
    assert pinhole.look_at == (0, 3, 2) and pinhole.up == (0, 0, 1)
    assert (pinhole.width, pinhole.height, pinhole.principal_point) == (1920, 1080, (960, 540))


@pytest.mark.parametrize("size", [(1920, 1080), (1080, 1920), (1000, 1000), (4000, 100)])
@pytest.mark.parametrize("ratio", [1.0, 1.5])
def test_the_picture_shows_all_that_the_viewport_shows_and_no_more_than_it_must(area, scene, size, ratio):
    like = dataclasses.replace(LIKE, width=size[0], height=size[1], distance=(1, ratio), principal_point=None)
    pinhole, region = viewport.pinhole_of(area, like, scene), region_of(area)
    assert pinhole.distance[1] == ratio * pinhole.distance[0]
    larger = max(region.width, region.height)
    half_angles = np.array([region.width / larger, region.height / larger])  # tangents: 45° to the larger side
    pictured = np.array(size) / 2 / pinhole.distance
    assert (pictured / half_angles).min() == pytest.approx(1, rel=1e-15)


def test_a_tilted_view_takes_its_own_up(area, scene):
    area.spaces.active.region_3d.view_rotation = (0.5, 0.5, 0.5, 0.5)
    pinhole = viewport.pinhole_of(area, LIKE, scene)
    np.testing.assert_allclose(np.array(pinhole.basis()), [(0, 1, 0), (0, 0, 1), (1, 0, 0)], atol=8 * 2**-24)
    area.spaces.active.region_3d.view_rotation = (1, 0, 0, 0)
    assert viewport.pinhole_of(area, LIKE, scene).up == (0, 1, 0)


def test_a_view_locked_to_an_object_or_the_cursor_looks_at_that(area, scene, empty):
    space = area.spaces.active
    space.lock_cursor, scene.cursor.location = True, (1, 2, 3)
    assert viewport.pinhole_of(area, LIKE, scene).look_at == (1, 2, 3)
    space.lock_object = empty("There", (4, 5, 6))
    assert viewport.pinhole_of(area, LIKE, scene).look_at == (4, 5, 6)


def test_a_view_locked_to_a_bone_looks_at_its_head(area, scene):
    bpy.ops.object.armature_add(location=(4, 5, 6))
    armature = bpy.context.object
    armature.pose.bones[0].location = (0, 2, 0)
    bpy.context.view_layer.update()
    area.spaces.active.lock_object, area.spaces.active.lock_bone = armature, armature.pose.bones[0].name
    np.testing.assert_allclose(viewport.pinhole_of(area, LIKE, scene).look_at, (4, 5, 8), atol=16 * 2**-24)


def test_a_view_through_a_camera_is_that_camera(area, scene, posed_camera):
    posed_camera.data.shift_x = 0.1
    bpy.context.view_layer.update()
    area.spaces.active.region_3d.view_perspective = "CAMERA"
    pinhole, expected = viewport.pinhole_of(area, LIKE, scene), cameras.read(posed_camera, scene)
    assert (pinhole.eye, pinhole.distance, pinhole.principal_point) == (
        expected.eye,
        expected.distance,
        expected.principal_point,
    )
    np.testing.assert_allclose(pinhole.look_at, (0, 0, 1), atol=1e-5)  # the values' distance along the camera's axis


def test_a_viewport_with_a_camera_of_its_own_looks_through_that(area, scene, posed_camera, add_camera):
    other = add_camera("Other")
    other.location = (1, 2, 3)
    scene.camera = posed_camera
    bpy.context.view_layer.update()
    space = area.spaces.active
    space.use_local_camera, space.camera = True, other
    space.region_3d.view_perspective = "CAMERA"
    assert viewport.pinhole_of(area, LIKE, scene).eye == (1, 2, 3)


def test_an_orthographic_view_is_no_pinhole(area, scene):
    area.spaces.active.region_3d.view_perspective = "ORTHO"
    with pytest.raises(InputError, match="orthographic, no pinhole: switch it to perspective"):
        viewport.pinhole_of(area, LIKE, scene)


def test_a_view_through_no_camera_is_said(area, scene):
    area.spaces.active.region_3d.view_perspective = "CAMERA"
    scene.camera = None
    with pytest.raises(InputError, match="a camera that is gone"):
        viewport.pinhole_of(area, LIKE, scene)
