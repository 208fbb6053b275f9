"""Fixtures of the tests of Bake: a flight straight over the look-at point, and all that a bake may touch, in numbers."""

import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import versions

CHANNELS = ("location", "rotation_euler", "rotation_quaternion", "rotation_axis_angle", "scale")


@pytest.fixture
def over_the_target(posed_camera, scene, over_the_top):
    """A camera that flies over the origin from frame 1 to 21, is straight above it at frame 11, and zooms all the way."""
    scene.render.resolution_x, scene.render.resolution_y = 64, 36
    group = posed_camera.virtual_pinhole
    group.look_at = (0, 0, 0)
    for frame in range(1, 22):
        group.eye, group.up, group.distance = over_the_top(6 * (frame - 11)), (0, 0.01 * frame, 1), 30 + frame
        for name in ("eye", "up", "distance"):
            group.keyframe_insert(name, frame=frame)
    # Exactly straight above, up included.
    group.eye, group.up = (0, 0, 10), (0, 0, 1)
    for name in ("eye", "up"):
        group.keyframe_insert(name, frame=11)
    scene.frame_start, scene.frame_end = 1, 21
    scene.frame_set(1)
    return posed_camera


@pytest.fixture
def curves():
    """A function that gives the curves of a block's action by data path and index."""

    def of(block):
        return {(curve.data_path, curve.array_index): curve for curve in versions.action_curves(block)}

    return of


@pytest.fixture
def everything(curves):
    """A function that gives all that a bake may touch, in numbers: channels, data, values and curves."""

    def of(camera_object):
        blocks = (camera_object, camera_object.data)
        keys = {
            (type(block).__name__, *name): [(*point.co, point.interpolation) for point in curve.keyframe_points]
            for block in blocks
            for name, curve in curves(block).items()
        }
        data, group = camera_object.data, camera_object.virtual_pinhole
        return (
            [tuple(getattr(camera_object, name)) for name in CHANNELS],
            (data.lens, data.sensor_width, data.sensor_height, data.shift_x, data.shift_y),
            (group.enabled, group.numbers()),
            keys,
            tuple(getattr(block.animation_data, "action", None) is None for block in blocks),
        )

    return of
