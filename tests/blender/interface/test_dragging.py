"""Orbit, dolly, dolly zoom and truck as the mouse drags them."""

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender.interface import dragging, kept
from viewcam_addon.errors import InputError

REACH = math.dist((7, -6, 5), (0, 0, 1))


@pytest.mark.parametrize("kind", [dragging.ORBIT, dragging.DOLLY, dragging.DOLLY_ZOOM, dragging.TRUCK])
def test_a_drag_moves_visibly_there_and_back_and_cancelling_restores_every_bit(posed_camera, scene, kind):
    bpy.context.view_layer.update()
    before, start = kept.state(posed_camera), cameras.stated(posed_camera, scene)
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
    assert kept.state(posed_camera) == before


def test_a_dolly_zoom_keeps_the_size_at_the_look_at_point(posed_camera, scene):
    drag = dragging.Drag(posed_camera, scene, dragging.DOLLY_ZOOM)
    drag.move(120, 0)
    found = cameras.stated(posed_camera, scene)
    reach = math.dist(found.eye, found.look_at)
    assert reach < 0.7 * REACH
    assert found.distance[0] / reach == pytest.approx(1500 / REACH, rel=1e-12)


def test_a_truck_carries_the_look_at_point_along_under_the_mouse(posed_camera, scene):
    start = cameras.stated(posed_camera, scene)
    dragging.Drag(posed_camera, scene, dragging.TRUCK).move(100, -50)
    column, row, _ = cameras.stated(posed_camera, scene).project(np.array(start.look_at))
    assert (column, row) == pytest.approx((960 + 100, 540 - 50), abs=1e-6)


def test_a_typed_number_counts_instead_of_the_mouse(posed_camera, scene):
    drag = dragging.Drag(posed_camera, scene, dragging.DOLLY)
    drag.move(500, 0)
    drag.type("2.5")
    found = cameras.stated(posed_camera, scene)
    assert math.dist(found.eye, found.look_at) == pytest.approx(REACH + 2.5, rel=1e-12)
    drag.type("-")
    assert math.dist(cameras.stated(posed_camera, scene).eye, found.look_at) < REACH
    drag.type("-99")
    assert math.dist(cameras.stated(posed_camera, scene).eye, found.look_at) < REACH, "beyond the look-at point it waits"


def test_what_follows_an_object_is_not_dragged_away_from_it(posed_camera, scene, empty):
    posed_camera.virtual_pinhole.look_at_target = empty("Target")
    with pytest.raises(InputError, match="the look-at follows 'Target', and can't be dragged"):
        dragging.Drag(posed_camera, scene, dragging.TRUCK)
    dragging.Drag(posed_camera, scene, dragging.ORBIT).move(10, 0)
    assert posed_camera.virtual_pinhole.look_at_target is not None


def test_the_operator_does_the_same_by_numbers(posed_camera, scene):
    assert bpy.ops.viewcam.drag_camera(kind="DOLLY", amount=(1.0, 0.0)) == {"FINISHED"}
    found = cameras.stated(posed_camera, scene)
    assert math.dist(found.eye, found.look_at) == pytest.approx(REACH + 1)
