import math

import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import datablocks


@pytest.mark.parametrize(
    ("system", "scale", "value", "words"),
    [
        ("METRIC", 1.0, 2.0, "2 m"),
        ("METRIC", 0.01, 2.0, "2 cm"),
        ("METRIC", 1.0, 1e-9, "1e-09"),  # Blender would say 0 m
        ("METRIC", 1.0, math.inf, "inf"),
        ("IMPERIAL", 1.0, 3.048, "10'"),
        ("NONE", 0.01, 2.0, "2"),
    ],
)
def test_a_length_is_said_in_the_scenes_units(scene, system, scale, value, words):
    scene.unit_settings.system, scene.unit_settings.scale_length = system, scale
    assert datablocks.length(value, scene) == words


def test_without_markers_a_render_takes_the_scenes_camera(camera_object, scene):
    scene.timeline_markers.new("Loose", frame=1)
    assert datablocks.render_camera(scene) == camera_object


@pytest.mark.parametrize(("frame", "chosen"), [(1, "A"), (5, "A"), (9, "A"), (10, "B"), (99, "B")])
def test_with_markers_a_render_takes_the_last_one_before_the_frame_or_the_first(add_camera, scene, frame, chosen):
    """And so does Blender, whose answer stands in the scene after a change of frame."""
    for name, at in (("B", 10), ("Unrendered", 7), ("A", 5)):
        scene.timeline_markers.new(name, frame=at).camera = add_camera(name)
    bpy.data.objects["Unrendered"].hide_render = True
    scene.frame_set(frame)
    assert datablocks.render_camera(scene).name == scene.camera.name == chosen
