"""Keyframed values move the camera, in the window's dependency graph and in a render's."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import datablocks, findings


@pytest.fixture
def flying_camera(posed_camera):
    """The eye goes from (7, −6, 5) at frame 1 to (7, −6, 25) at frame 11, the distance from 1500 to 500."""
    group = posed_camera.virtual_pinhole
    for frame, height, distance in ((1, 5, 1500), (11, 25, 500)):
        group.eye, group.distance = (7, -6, height), distance
        group.keyframe_insert("eye", frame=frame)
        group.keyframe_insert("distance", frame=frame)
    return posed_camera


def test_the_camera_follows_keyframed_values(flying_camera, scene):
    for frame in (1, 4, 6, 11):
        scene.frame_set(frame)
        height = flying_camera.virtual_pinhole.eye[2]
        assert flying_camera.matrix_world.translation.z == pytest.approx(height, rel=1e-6)
        assert findings.differences(cameras.stated(flying_camera, scene), cameras.read(flying_camera, scene), reach=30) == {}
    assert flying_camera.matrix_world.translation.z == 25


def test_it_follows_at_subframes(flying_camera, scene):
    scene.frame_set(6, subframe=0.5)
    assert flying_camera.matrix_world.translation.z == pytest.approx(flying_camera.virtual_pinhole.eye[2], rel=1e-6)
    scene.frame_set(6)
    assert flying_camera.matrix_world.translation.z == pytest.approx(15, rel=1e-6)


def test_it_follows_a_driver(posed_camera, scene):
    posed_camera.virtual_pinhole.driver_add("eye", 2).driver.expression = "frame * 2.0"
    scene.frame_set(9)
    assert posed_camera.matrix_world.translation.z == pytest.approx(18)


@pytest.fixture
def zooming_camera(posed_camera):
    """The zoom goes from 1 at frame 1 to 3 at frame 11."""
    group = posed_camera.virtual_pinhole
    for frame, zoom in ((1, 1), (11, 3)):
        group.zoom = zoom
        group.keyframe_insert("zoom", frame=frame)
    return posed_camera


def test_it_follows_a_keyed_zoom_at_frames_and_sub_frames(zooming_camera, scene):
    group = zooming_camera.virtual_pinhole
    for frame, subframe in ((1, 0.0), (6, 0.0), (6, 0.5), (11, 0.0)):
        scene.frame_set(frame, subframe=subframe)
        assert zooming_camera.data.lens == pytest.approx(group.zoom * 1500 * 36 / 1920, rel=2.0**-22)
        assert findings.differences(cameras.stated(zooming_camera, scene), cameras.read(zooming_camera, scene), reach=10) == {}
    assert (group.distance, group.zoom) == (1500, 3)
    scene.frame_set(6)
    assert group.zoom == pytest.approx(2)


def test_it_follows_a_driven_zoom(posed_camera, scene):
    posed_camera.virtual_pinhole.driver_add("zoom").driver.expression = "frame / 2.0"
    scene.frame_set(5)
    assert posed_camera.data.lens == pytest.approx(2.5 * 1500 * 36 / 1920, rel=2.0**-22)


@pytest.mark.parametrize("is_driven", [False, True])
def test_a_still_amid_two_frames_of_a_zoom_has_that_moments_lens(
    posed_camera, scene, render_positions, picture_error, is_driven
):
    group = posed_camera.virtual_pinhole
    if is_driven:
        group.driver_add("zoom").driver.expression = "frame / 4.0"
    else:
        for frame, zoom in ((1, 1), (11, 3)):
            group.zoom = zoom
            group.keyframe_insert("zoom", frame=frame)
    scene.frame_set(6, subframe=0.5)
    expected, positions = cameras.stated(posed_camera, scene), render_positions()
    error, tolerance = picture_error(expected, positions)
    assert error <= tolerance, f"{error:.1e} px, and {tolerance:.1e} are rounding"
    scene.frame_set(6)
    other, _ = picture_error(cameras.stated(posed_camera, scene), positions)
    assert other > 100 * tolerance, f"the whole frame's zoom would pass, {other:.1e} px"


def test_a_zoom_rendered_in_one_go_is_that_of_each_frame(zooming_camera, scene, render_positions, picture_error):
    expected = {}
    for frame in (1, 11):
        scene.frame_set(frame)
        expected[frame] = cameras.stated(zooming_camera, scene)
    scene.frame_start, scene.frame_end, scene.frame_step = 1, 11, 10
    for frame, positions in render_positions(animation=True).items():
        error, tolerance = picture_error(expected[frame], positions)
        assert error <= tolerance, f"frame {frame}: {error:.1e} px, and {tolerance:.1e} are rounding"
        other, _ = picture_error(expected[12 - frame], positions)
        assert other > 100 * tolerance, f"frame {frame}: the other frame's zoom would pass, {other:.1e} px"


def test_a_camera_whose_values_stand_still_is_left_to_its_artist(posed_camera, scene):
    posed_camera.location = (1, 1, 1)
    scene.frame_set(5)
    assert tuple(posed_camera.location) == (1, 1, 1)
    assert not datablocks.is_animated(posed_camera)


def test_a_camera_that_is_not_enabled_is_left_alone(flying_camera, scene):
    flying_camera.virtual_pinhole.enabled = False
    flying_camera.location = (1, 1, 1)
    scene.frame_set(5)
    assert tuple(flying_camera.location) == (1, 1, 1)


def test_a_frame_whose_values_make_no_camera_leaves_it_and_says_so(posed_camera, scene, capfd):
    group = posed_camera.virtual_pinhole
    for frame, eye in ((1, (7, -6, 5)), (2, (0, 0, 1))):
        group.eye = eye
        group.keyframe_insert("eye", frame=frame)
    scene.frame_set(1)
    scene.frame_set(2)
    assert tuple(posed_camera.location) == (7, -6, 5)
    assert "viewcam: frame 2: Camera: eye and look_at are the same point" in capfd.readouterr().err


def test_an_animation_rendered_in_one_go_follows_the_values(flying_camera, scene, render_positions, picture_error):
    """The originals stand at frame 11 all the time: only what the render itself evaluates can bring the camera down."""
    expected = {}
    for frame in (1, 6, 11):
        scene.frame_set(frame)
        expected[frame] = cameras.stated(flying_camera, scene)
    scene.frame_start, scene.frame_end, scene.frame_step = 1, 11, 5
    for frame, positions in render_positions(animation=True).items():
        error, tolerance = picture_error(expected[frame], positions)
        assert error <= tolerance, f"frame {frame}: {error:.1e} px, and {tolerance:.1e} are rounding"


def test_the_picture_of_another_frame_would_be_noticed(flying_camera, scene, render_positions, picture_error):
    scene.frame_set(5)
    wrong = cameras.stated(flying_camera, scene)
    scene.frame_start = scene.frame_end = 6
    error, tolerance = picture_error(wrong, render_positions(animation=True)[6])
    assert error > 100 * tolerance


def test_what_hangs_on_the_camera_follows_in_a_render(flying_camera, scene, render_positions):
    bpy.ops.mesh.primitive_plane_add(size=0.5)
    child = bpy.context.object
    child.parent, child.location = flying_camera, (0, 0, -2)
    scene.frame_set(11)
    scene.frame_start = scene.frame_end = 6
    positions = render_positions(animation=True, also=[child])[6]
    scene.frame_set(6)
    pinhole = cameras.stated(flying_camera, scene)
    # 2 before the eye, in the pixel right and above of the middle: half a pixel off the axis.
    middle = positions[16, 16] - (np.array(pinhole.eye) - 2 * pinhole.basis()[2])
    assert np.abs(middle).max() <= 2 / min(pinhole.distance)


def test_it_follows_what_a_driver_reads_between_frames(posed_camera, scene):
    handle = bpy.data.objects.new("Handle", None)
    scene.collection.objects.link(handle)
    handle.location.z = 5
    driver = posed_camera.virtual_pinhole.driver_add("eye", 2).driver
    driver.type = "SUM"
    target = driver.variables.new().targets[0]
    target.id, target.data_path = handle, "location.z"
    scene.frame_set(1)
    for height in (8, 3):
        handle.location.z = height
        bpy.context.view_layer.update()
        assert posed_camera.matrix_world.translation.z == pytest.approx(height)


def test_a_constraint_in_the_way_of_a_driven_camera_makes_no_endless_loop(posed_camera, scene):
    posed_camera.virtual_pinhole.driver_add("eye", 2).driver.expression = "2.0 + 3.0"
    constraint = posed_camera.constraints.new("LIMIT_LOCATION")
    constraint.use_min_x, constraint.min_x = True, 9
    updates = []
    bpy.app.handlers.depsgraph_update_post.append(lambda *_: updates.append(None))
    try:
        posed_camera.update_tag()
        for _ in range(10):
            bpy.context.view_layer.update()
    finally:
        bpy.app.handlers.depsgraph_update_post.pop()
    assert len(updates) == 1
