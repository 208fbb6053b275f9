"""Scenes, view layers, units and pictures around an enabled camera. docs/odd-blender.md says what each test expects."""

import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import datablocks
from viewcam_addon.blender.interface import panel
from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.jobs.job import Job


@pytest.fixture
def collected(posed_camera, scene):
    """The layer collection that alone holds the camera."""
    collection = bpy.data.collections.new("Cameras")
    scene.collection.children.link(collection)
    collection.objects.link(posed_camera)
    scene.collection.objects.unlink(posed_camera)
    return bpy.context.view_layer.layer_collection.children["Cameras"]


@pytest.fixture
def other_scene(posed_camera):
    """A function that adds a scene of another size with the camera in it."""

    def add(width, height):
        other = bpy.data.scenes.new("Other")
        other.collection.objects.link(posed_camera)
        other.camera = posed_camera
        other.render.resolution_x, other.render.resolution_y = width, height
        return other

    return add


def hidden_in(collected, how):
    if how == "excluded":
        collected.exclude = True
    elif how == "disabled":
        collected.collection.hide_viewport = True
    elif how == "hidden":
        collected.hide_viewport = True
    else:
        collected.collection.hide_render = True


@pytest.mark.parametrize("how", ["excluded", "disabled", "hidden", "not rendered"])
def test_the_scenes_camera_sticks_whatever_becomes_of_its_collection(posed_camera, collected, odd, how):
    hidden_in(collected, how)
    odd.check(posed_camera)


@pytest.mark.parametrize("how", ["excluded", "disabled"])
def test_another_camera_in_an_excluded_or_disabled_collection_takes_no_part(posed_camera, collected, add_camera, odd, how):
    add_camera("Other")
    hidden_in(collected, how)
    odd.check(posed_camera)


@pytest.mark.parametrize("how", ["hidden", "not rendered"])
def test_another_camera_in_a_hidden_collection_sticks(posed_camera, collected, add_camera, odd, how):
    add_camera("Other")
    hidden_in(collected, how)
    odd.check(posed_camera)


def test_a_camera_that_takes_no_part_stands_right_as_soon_as_it_does(posed_camera, add_camera, scene):
    add_camera("Other")
    posed_camera.hide_viewport = True
    posed_camera.virtual_pinhole.eye = (1, 2, 3)
    posed_camera.hide_viewport = False
    bpy.context.view_layer.update()
    assert cameras.check(posed_camera, cameras.stated(posed_camera, scene), scene) == []


@pytest.mark.parametrize("how", ["in the view layer", "in viewports", "in renders"])
def test_a_hidden_camera_that_is_the_scenes_sticks(posed_camera, odd, how):
    if how == "in the view layer":
        posed_camera.hide_set(True)
    elif how == "in viewports":
        posed_camera.hide_viewport = True
    else:
        posed_camera.hide_render = True
    odd.check(posed_camera)


def test_another_camera_that_is_disabled_in_viewports_takes_no_part(posed_camera, add_camera, odd):
    add_camera("Other")
    posed_camera.hide_viewport = True
    odd.check(posed_camera)


def test_a_camera_that_only_another_view_layer_shows_sticks_as_the_scenes(posed_camera, collected, scene, odd):
    scene.view_layers.new("Second").layer_collection.children["Cameras"].exclude = False
    collected.exclude = True
    odd.check(posed_camera)


def test_of_a_camera_in_an_instanced_collection_the_object_itself_sticks(posed_camera, collected, empty, scene, odd):
    collection = collected.collection
    scene.collection.children.unlink(collection)
    instance = empty("Instance", (9, 9, 9))
    instance.instance_type, instance.instance_collection = "COLLECTION", collection
    odd.check(posed_camera)


def test_local_view_and_another_objects_edit_mode_do_no_harm(posed_camera, odd):
    bpy.ops.mesh.primitive_monkey_add()
    area = next((area for area in bpy.context.window.screen.areas if area.type == "VIEW_3D"), None)
    if area:
        with bpy.context.temp_override(area=area, region=area.regions[-1]):
            bpy.ops.view3d.localview()
            assert area.spaces.active.local_view and not posed_camera.local_view_get(area.spaces.active)
    bpy.ops.object.mode_set(mode="EDIT")
    odd.check(posed_camera)


def test_two_scenes_of_one_resolution_share_a_camera(posed_camera, other_scene, odd):
    other_scene(1920, 1080)
    odd.check(posed_camera)
    assert panel.notices(bpy.data.objects["Camera"], bpy.data.scenes["Other"]) == []


def test_in_a_second_scene_of_another_resolution_the_lens_is_wrong(posed_camera, other_scene, scene, odd):
    other = other_scene(960, 540)
    odd.apply(posed_camera, scene)
    odd.later(posed_camera, other, "in the other scene")
    odd.render(posed_camera, other)
    odd.later(*odd.reopen(posed_camera, other), "saved and opened again")


def test_a_camera_of_another_scene_sticks_there(add_camera, other_scene, scene, odd):
    """It is in that scene only; the panel of this scene does not show it."""
    camera_object = bpy.data.objects["Camera"]
    other = other_scene(800, 600)
    scene.collection.objects.unlink(camera_object)
    add_camera("Here")
    odd.check(camera_object, scene=other)


def test_with_shared_data_the_camera_that_was_set_last_has_its_lens(posed_camera, scene, odd):
    twin = bpy.data.objects.new("Twin", posed_camera.data)
    scene.collection.objects.link(twin)
    group = twin.virtual_pinhole
    group.eye, group.look_at, group.up, group.distance = (5, 5, 5), (0, 0, 1), (0, 0, 1), 1000
    odd.check(posed_camera, then=lambda: setattr(group, "enabled", True))


def test_two_cameras_of_one_distance_share_their_data(posed_camera, scene, odd):
    twin = bpy.data.objects.new("Twin", posed_camera.data)
    scene.collection.objects.link(twin)
    group = twin.virtual_pinhole
    group.eye, group.look_at, group.up, group.distance = (5, 5, 5), (0, 0, 1), (0, 0, 1), 1500
    group.enabled = True
    odd.check(posed_camera)


def keep_above(camera_object, height):
    """Though the values say otherwise, at every frame."""
    camera_object.virtual_pinhole.keyframe_insert("eye", frame=1)
    constraint = camera_object.constraints.new("LIMIT_LOCATION")
    constraint.use_min_z, constraint.min_z = True, height


def test_a_smaller_scale_of_units_changes_nothing_but_the_words(posed_camera, scene, odd):
    """A distance of 2 units is 2 cm here."""
    scene.unit_settings.scale_length = 0.01
    odd.check(posed_camera, then=lambda: keep_above(posed_camera, 7))


def test_feet_change_nothing_but_the_words(posed_camera, scene, odd):
    scene.unit_settings.system, scene.unit_settings.length_unit = "IMPERIAL", "FEET"
    rows = {row.label: row.shown for row in panel.shown(posed_camera, scene)}
    assert rows["To Look-At"] == ("32.972'",)  # √(7² + 6² + 4²) m
    odd.check(posed_camera, then=lambda: keep_above(posed_camera, 7))


def test_without_units_a_length_is_a_bare_number(posed_camera, scene, odd):
    scene.unit_settings.system = "NONE"
    odd.check(posed_camera, then=lambda: keep_above(posed_camera, 7))


def test_another_resolution_keeps_the_distance_in_pixels(posed_camera, scene, odd):
    odd.check(posed_camera, then=lambda: setattr(scene.render, "resolution_x", 1280))
    assert bpy.data.objects["Camera"].virtual_pinhole.distance == 1500


def test_another_resolution_keeps_the_field_of_view_if_it_shall(posed_camera, scene, odd):
    posed_camera.virtual_pinhole.keeps = "FIELD_OF_VIEW"
    lens = posed_camera.data.lens
    odd.check(posed_camera, then=lambda: setattr(scene.render, "resolution_x", 1280))
    assert bpy.data.cameras["Camera"].lens == lens


def test_another_percentage_shows_the_same_picture(posed_camera, scene, odd):
    odd.check(posed_camera, then=lambda: setattr(scene.render, "resolution_percentage", 50))


def test_a_cropped_border_shows_its_part_of_the_picture(posed_camera, scene, odd):
    def crop():
        scene.render.use_border = scene.render.use_crop_to_border = True
        scene.render.border_min_x, scene.render.border_max_y = 0.25, 0.75

    odd.check(posed_camera, then=crop)


def test_pixels_that_become_wider_keep_the_distance(posed_camera, scene, odd):
    odd.check(posed_camera, then=lambda: setattr(scene.render, "pixel_aspect_x", 2))


def test_pixels_that_become_much_higher_keep_the_distance(posed_camera, scene, odd):
    odd.check(posed_camera, then=lambda: setattr(scene.render, "pixel_aspect_y", 2))


def test_stereoscopy_is_told(posed_camera, scene, odd):
    scene.render.use_multiview = True
    odd.check(posed_camera)


def test_a_marker_chooses_the_camera_of_its_frame(both_sides, posed_camera, add_camera, scene, odd):
    """What a render shows from the marker's frame on, and what `viewcam check --frame` takes."""
    other = add_camera("Other")
    other.location = (0, 0, 8)
    bpy.ops.mesh.primitive_monkey_add(size=3)
    for frame, camera_object in ((2, other), (4, posed_camera)):
        scene.timeline_markers.new(camera_object.name, frame=frame).camera = camera_object
    scene.frame_set(3)
    scene.camera = posed_camera  # by hand, which a render does not mind
    assert datablocks.render_camera(scene) == other
    sides = both_sides()
    sides.check()
    assert sides.exported.camera.eye == (0, 0, 8)
    for request, eye in (({"frame": 4}, (7, -6, 5)), ({"frame": 1}, (0, 0, 8)), ({"camera": "Camera"}, (7, -6, 5))):
        assert jobs.export(Job(**request)).camera.eye == eye
        assert (scene.camera, scene.frame_current) == (posed_camera, 3)
    assert [marker.camera for marker in scene.timeline_markers] == [other, posed_camera]
    scene.frame_set(4)
    odd.check(posed_camera)


def test_a_camera_that_blender_would_not_choose_at_its_marker_is_a_difference(
    both_sides, posed_camera, add_camera, scene, monkeypatch
):
    """Cycles was given the camera that the tracer had."""
    other = add_camera("Other")
    other.location = (0, 0, 8)
    bpy.ops.mesh.primitive_monkey_add(size=3)
    scene.timeline_markers.new("Other", frame=1).camera = other
    both_sides().check()
    monkeypatch.setattr(datablocks, "bound_camera", lambda *_: posed_camera)
    with pytest.raises(AssertionError):
        both_sides().check()


def test_a_camera_that_is_named_is_rendered_though_a_marker_chooses_another(both_sides, posed_camera, add_camera, scene):
    other = add_camera("Other")
    bpy.ops.mesh.primitive_monkey_add(size=3)
    scene.timeline_markers.new("Other", frame=1).camera = other
    sides = both_sides(camera="Camera")
    sides.check()
    assert sides.exported.camera.eye == (7, -6, 5)
