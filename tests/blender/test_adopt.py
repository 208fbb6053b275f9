import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import findings
from viewcam_addon.pinhole import Pinhole


def pose(camera_object):
    bpy.context.view_layer.update()
    return [tuple(row) for row in camera_object.matrix_world], camera_object.data.lens


def test_adopting_keeps_the_digits_of_values_that_the_camera_has(posed_camera, scene):
    posed_camera.virtual_pinhole.look_at = (0.1, 0.2, 0.3)
    before = posed_camera.virtual_pinhole.numbers()
    cameras.adopt(posed_camera, scene)
    assert posed_camera.virtual_pinhole.numbers() == before


def test_no_number_that_is_nothing_but_rounding_is_shown_as_minus_zero(camera_object, scene):
    """Such a remainder is kept where it is known, and the field shows 0."""
    pinhole = Pinhole((7, -1e-9, -0.0), (0, 3e-8, -1e-10), (-4.4e-8, 0, 1), 1000.0, 1920, 1080)
    cameras.apply(camera_object, pinhole, scene)
    group = camera_object.virtual_pinhole
    shown = [*group.eye, *group.up]
    assert [math.copysign(1, number) for number in shown if number == 0] == [1, 1, 1, 1]
    assert cameras.stated(camera_object, scene) == pinhole
    camera_object.rotation_euler = (math.pi / 2, 0, math.pi)
    bpy.context.view_layer.update()
    cameras.adopt(camera_object, scene)
    for number in (*group.eye, *group.look_at, *group.up):
        assert number == 0 or abs(number) > 1e-6, f"{number} is shown as a zero with a sign"


@pytest.mark.parametrize("seed", range(10))
def test_adopting_moves_nothing_and_applying_afterwards_neither(camera_object, scene, seed):
    random = np.random.default_rng(seed)
    camera_object.location, camera_object.rotation_euler = random.normal(0, 5, 3), random.normal(0, 2, 3)
    before = pose(camera_object)
    cameras.adopt(camera_object, scene)
    assert pose(camera_object) == before
    assert cameras.apply(camera_object, cameras.stated(camera_object, scene), scene) == []
    moved = np.abs(np.array(pose(camera_object)[0]) - np.array(before[0])).max()
    assert moved <= findings.LARGEST_TURN, f"{moved:.1e}"


def test_a_level_camera_is_given_the_worlds_up_and_a_rolled_one_its_own(camera_object, scene):
    camera_object.rotation_euler = (1.1, 0, 0.7)
    bpy.context.view_layer.update()
    cameras.adopt(camera_object, scene)
    assert tuple(camera_object.virtual_pinhole.up) == (0, 0, 1)
    camera_object.rotation_euler = (1.1, 1e-5, 0.7)
    bpy.context.view_layer.update()
    cameras.adopt(camera_object, scene)
    _, v, _ = cameras.read(camera_object, scene).basis()
    np.testing.assert_allclose(camera_object.virtual_pinhole.up, v, atol=1e-7)


def test_a_camera_in_use_keeps_the_distance_to_its_look_at_point(posed_camera, scene):
    reach = math.dist((7, -6, 5), (0, 0, 1))
    posed_camera.location = (20, 0, 0)
    bpy.context.view_layer.update()
    cameras.adopt(posed_camera, scene)
    eye, look_at, *_ = posed_camera.virtual_pinhole.numbers()
    assert eye == (20, 0, 0)
    assert math.dist(eye, look_at) == pytest.approx(reach, rel=1e-15)


def test_a_new_camera_looks_at_its_plane_of_focus(camera_object, scene):
    camera_object.data.dof.focus_distance = 4.0
    cameras.adopt(camera_object, scene)
    np.testing.assert_allclose(camera_object.virtual_pinhole.look_at, (0, 0, -4))


@pytest.mark.parametrize(("where", "depth"), [((3, 0, -6), 6), ((0, 0, 6), 10)])
def test_a_focus_object_counts_if_it_stands_before_the_camera(camera_object, scene, where, depth):
    focus = bpy.data.objects.new("Focus", None)
    scene.collection.objects.link(focus)
    focus.location = where
    bpy.context.view_layer.update()
    camera_object.data.dof.focus_object, camera_object.data.dof.focus_distance = focus, 10
    cameras.adopt(camera_object, scene)
    np.testing.assert_allclose(camera_object.virtual_pinhole.look_at, (0, 0, -depth))


@pytest.mark.parametrize("percentage", [100, 33])
def test_the_distance_counts_pixels_at_100_percent(camera_object, scene, percentage):
    scene.render.resolution_percentage = percentage
    cameras.adopt(camera_object, scene)
    assert camera_object.virtual_pinhole.numbers()[3] == pytest.approx(1920 * 50 / 36, rel=1e-15)
