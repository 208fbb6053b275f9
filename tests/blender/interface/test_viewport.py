import dataclasses
import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender.interface import viewport
from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole

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
    found = viewport.pinhole_of(area, LIKE, scene)
    # sqrt(½) in float32, and the quaternion is normalised in float32 again.
    np.testing.assert_allclose(found.eye, (0, -5, 2), atol=8 * 4 * 2**-24)
    assert found.look_at == (0, 3, 2) and found.up == (0, 0, 1)
    assert (found.width, found.height, found.principal_point) == (1920, 1080, (960, 540))


@pytest.mark.parametrize("size", [(1920, 1080), (1080, 1920), (1000, 1000), (4000, 100)])
@pytest.mark.parametrize("ratio", [1.0, 1.5])
def test_the_picture_shows_all_that_the_viewport_shows_and_no_more_than_it_must(area, scene, size, ratio):
    like = dataclasses.replace(LIKE, width=size[0], height=size[1], distance=(1, ratio), principal_point=None)
    found, region = viewport.pinhole_of(area, like, scene), region_of(area)
    assert found.distance[1] == ratio * found.distance[0]
    larger = max(region.width, region.height)
    shown = np.array([region.width / larger, region.height / larger])  # tangents: 45° to the larger side
    pictured = np.array(size) / 2 / found.distance
    assert (pictured / shown).min() == pytest.approx(1, rel=1e-15)


def test_a_tilted_view_takes_its_own_up(area, scene):
    area.spaces.active.region_3d.view_rotation = (0.5, 0.5, 0.5, 0.5)
    found = viewport.pinhole_of(area, LIKE, scene)
    np.testing.assert_allclose(np.array(found.basis()), [(0, 1, 0), (0, 0, 1), (1, 0, 0)], atol=8 * 2**-24)
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
    found, expected = viewport.pinhole_of(area, LIKE, scene), cameras.read(posed_camera, scene)
    assert (found.eye, found.distance, found.principal_point) == (expected.eye, expected.distance, expected.principal_point)
    np.testing.assert_allclose(found.look_at, (0, 0, 1), atol=1e-5)  # the values' distance along the camera's axis


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
