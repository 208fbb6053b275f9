"""For everything that can keep a camera from its values, a scene in which it does, and the sentence that names it."""

from dataclasses import replace

import pytest

from viewcam_addon.blender.findings import CENTER, DISTANCE, EYE, POSE, VIEW, Cause, differences, explain
from viewcam_addon.pinhole import Pinhole

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as cameras


def findings_after_setting(camera_object, scene):
    return cameras.apply(camera_object, cameras.stated(camera_object, scene), scene)


def findings_after_moving(camera_object, scene):
    """The findings about a camera that is set elsewhere; the values follow afterwards."""
    return cameras.apply(camera_object, Pinhole((7, -6, 5), (0, 0, 1), (0, 0, 1), 1500, 1920, 1080), scene)


def findings_later(camera_object, scene):
    bpy.context.view_layer.update()
    return [finding.sentence for finding in cameras.check(camera_object, cameras.stated(camera_object, scene), scene)]


def add_empty(scene, name, location=(0, 0, 0)):
    empty = bpy.data.objects.new(name, None)
    scene.collection.objects.link(empty)
    empty.location = location
    bpy.context.view_layer.update()
    return empty


def test_a_camera_that_nothing_disturbs_has_no_findings(posed_camera, scene):
    assert findings_after_setting(posed_camera, scene) == []


def test_a_constraint_is_named(posed_camera, scene):
    constraint = posed_camera.constraints.new("TRACK_TO")
    constraint.target, constraint.name = add_empty(scene, "Target", (5, 5, 5)), "Watch the target"
    (finding,) = findings_after_moving(posed_camera, scene)
    assert finding.startswith("The constraint 'Watch the target' moves 'Camera', the view is turned by ")


@pytest.mark.parametrize("state", ["muted", "no influence", "no effect"])
def test_a_constraint_that_does_nothing_is_not_accused(posed_camera, scene, state):
    constraint = posed_camera.constraints.new("LIMIT_LOCATION" if state == "no effect" else "TRACK_TO")
    if state != "no effect":
        constraint.target = add_empty(scene, "Target", (5, 5, 5))
    constraint.mute, constraint.influence = state == "muted", 0 if state == "no influence" else 1
    assert findings_after_setting(posed_camera, scene) == []


def test_a_driver_on_the_location_is_named(posed_camera, scene):
    posed_camera.driver_add("location", 0).driver.expression = "1.0 + 1.0"
    (finding,) = findings_after_moving(posed_camera, scene)
    assert finding.startswith("A driver sets the location of 'Camera', the eye is 5 m away")


def test_a_driver_on_the_lens_is_named(posed_camera, scene):
    posed_camera.data.driver_add("lens").driver.expression = "20.0 + 1.0"
    (finding,) = findings_after_moving(posed_camera, scene)
    assert finding.startswith("A driver sets the focal length of 'Camera', the view plane is 1120 px away and not 1500")


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [("location", "eye", "location"), ("rotation_euler", "look_at", "rotation"), ("scale", "up", "scale")],
)
def test_keyframes_of_what_the_values_keyframes_decide_are_named(posed_camera, scene, path, value, words):
    posed_camera.keyframe_insert(path, frame=1)
    assert findings_after_setting(posed_camera, scene) == [], "the values follow them"
    posed_camera.virtual_pinhole.keyframe_insert(value, frame=1)
    (finding,) = findings_after_setting(posed_camera, scene)
    assert finding.startswith(f"Keyframes set the {words} of 'Camera', and in a render they win over the four values")


def test_keyframes_of_the_lens_are_named_beside_those_of_the_distance_and_not_of_the_eye(posed_camera, scene):
    posed_camera.data.keyframe_insert("lens", frame=1)
    posed_camera.virtual_pinhole.keyframe_insert("eye", frame=1)
    assert findings_after_setting(posed_camera, scene) == []
    posed_camera.virtual_pinhole.keyframe_insert("zoom", frame=1)
    (finding,) = findings_after_setting(posed_camera, scene)
    assert "Keyframes set the focal length of 'Camera'" in finding


def test_the_values_follow_keyframes_of_the_lens(posed_camera, scene):
    posed_camera.data.keyframe_insert("lens", frame=1)
    posed_camera.virtual_pinhole.distance = 3000.0
    scene.frame_set(2)
    assert findings_later(posed_camera, scene) == []
    assert posed_camera.virtual_pinhole.distance == 1500


def test_keyframes_in_the_nla_are_named(posed_camera, scene):
    posed_camera.keyframe_insert("rotation_euler", frame=1)
    data = posed_camera.animation_data
    data.nla_tracks.new().strips.new("Strip", 1, data.action)
    data.action = None
    posed_camera.virtual_pinhole.keyframe_insert("look_at", frame=1)
    (finding,) = findings_after_setting(posed_camera, scene)
    assert finding.startswith("Keyframes set the rotation of 'Camera'")


def test_keyframes_on_the_four_values_are_not_named(posed_camera, scene):
    posed_camera.virtual_pinhole.keyframe_insert("eye", frame=1)
    assert findings_after_setting(posed_camera, scene) == []


def test_locked_channels_are_told(posed_camera, scene):
    posed_camera.lock_location[0] = posed_camera.lock_rotation[2] = True
    (finding,) = findings_after_setting(posed_camera, scene)
    assert finding.startswith("'Camera' is locked in its location and rotation")


def test_a_parent_that_is_scaled_non_uniformly_is_named(posed_camera, scene):
    parent = add_empty(scene, "Stretched")
    parent.scale = (1, 1, 3)
    posed_camera.parent = parent
    (finding,) = findings_after_setting(posed_camera, scene)
    assert "oblique" in finding
    assert "'Stretched' is scaled non-uniformly" in finding


def test_blenders_clamp_is_told_with_what_was_done_about_it(posed_camera, scene):
    posed_camera.virtual_pinhole.distance = 8.0
    (finding,) = findings_later(posed_camera, scene)
    assert finding.startswith(
        "The lens would be 0.15 mm, which Blender clamps to 1 mm, so it and the sensor are 8 times as large"
    )


def test_a_changed_size_that_leaves_the_camera_right_is_not_told(posed_camera, scene):
    scene.render.resolution_percentage = 50
    assert findings_later(posed_camera, scene) == []


def test_a_linked_camera_is_told_once_with_its_library_and_so_are_linked_data_of_a_local_one(posed_camera, link_camera):
    linked, scene = link_camera(), bpy.context.scene
    (of_both,) = findings_later(linked, scene)
    assert of_both.startswith("Camera 'Camera' is linked from 'library.blend'")
    local = linked.copy()
    scene.collection.objects.link(local)
    (of_data,) = findings_later(local, scene)
    assert of_data.startswith("The camera data 'Camera' is linked from 'library.blend'")


WANTED = Pinhole((7.0, -6.0, 5.0), (0.0, 0.0, 1.0), (0.0, 0.0, 1.0), 1500.0, 1920, 1080)
REACH = 10.0


def test_a_camera_does_not_differ_from_itself():
    assert differences(WANTED, WANTED, REACH) == {}


@pytest.mark.parametrize(
    ("quantity", "read_back"),
    [
        (EYE, replace(WANTED, eye=(7.0, -6.0, 5.0001), look_at=(0.0, 0.0, 1.0001))),
        (VIEW, replace(WANTED, up=(0.0, 1e-5, 1.0))),
        (VIEW, replace(WANTED, mirrored=True)),
        (DISTANCE, replace(WANTED, distance=1500.001)),
        (DISTANCE, replace(WANTED, distance=(1500.0, 1500.001))),
        (CENTER, replace(WANTED, principal_point=(960.001, 540.0))),
    ],
)
def test_what_is_off_by_more_than_float32_is_named_and_nothing_else(quantity, read_back):
    assert list(differences(WANTED, read_back, REACH)) == [quantity]


def test_what_float32_rounding_explains_is_no_difference():
    rounding = 2.0**-24
    read_back = replace(
        WANTED,
        eye=(7.0 * (1 + rounding), -6.0 * (1 - rounding), 5.0 * (1 + rounding)),
        up=(rounding, 0.0, 1.0),
        distance=1500.0 * (1 + 2 * rounding),
        principal_point=(960.0 * (1 + rounding), 540.0),
    )
    assert differences(WANTED, read_back, REACH) == {}


def test_far_from_the_origin_more_is_rounding():
    read_back = replace(WANTED, eye=(7.001, -6.0, 5.0), look_at=(0.001, 0.0, 1.0))
    assert EYE in differences(WANTED, read_back, REACH)
    assert differences(WANTED, read_back, reach=1e5) == {}


def sentences(differing, causes):
    return [finding.sentence for finding in explain(differing, causes)]


def test_only_a_suspect_that_acts_on_a_difference_is_blamed():
    track = Cause("The constraint 'Track' moves 'Camera'", POSE, "disable it")
    driver = Cause("A driver sets 'lens'", frozenset({DISTANCE}), "remove it")
    findings_found = sentences({VIEW: "the view is turned by 3°"}, [track, driver])
    assert findings_found == ["The constraint 'Track' moves 'Camera', the view is turned by 3°: disable it"]


def test_a_difference_that_nobody_explains_is_told_with_what_to_do():
    (eye, lens, shift) = sentences({EYE: "the eye is 1 away", DISTANCE: "d is 5", CENTER: "off"}, [])
    assert "moved since, the eye is 1 away" in eye
    assert "lens" in lens
    assert "shift" in shift
    assert all("adopt" in sentence for sentence in (eye, lens, shift))


def test_what_will_act_later_is_told_though_nothing_differs():
    later = Cause("'lens' is animated", frozenset({DISTANCE}), "animate the four values instead", always=True)
    assert sentences({}, [later]) == ["'lens' is animated: animate the four values instead"]
    assert sentences({}, [Cause("The constraint", POSE, "disable it")]) == []
