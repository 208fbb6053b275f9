"""A new resolution: what the camera keeps, and that it follows at once, in the window's graph, by script and in a render."""

import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import own_picture, resolution
from viewcam_addon.pinhole import Pinhole

PICTURES = [
    {"resolution_x": 960},
    {"resolution_x": 641, "resolution_y": 999},
    {"resolution_percentage": 37},
    {"pixel_aspect_x": 1.5, "resolution_y": 2500},
    {"resolution_y": 4000, "pixel_aspect_y": 2.0, "resolution_percentage": 150},
]


def change(scene, picture):
    for name, value in picture.items():
        setattr(scene.render, name, value)
    bpy.context.view_layer.update()


def warnings(camera_object, scene):
    pinhole = cameras.check(camera_object, cameras.stated(camera_object, scene), scene)
    return [finding.sentence for finding in pinhole]


@pytest.fixture
def wide_camera(posed_camera):
    """The posed camera, which keeps its field of view."""
    posed_camera.virtual_pinhole.keeps = "FIELD_OF_VIEW"
    return posed_camera


@pytest.mark.parametrize("fit", ["AUTO", "HORIZONTAL", "VERTICAL"])
@pytest.mark.parametrize("picture", PICTURES, ids=str)
def test_the_distance_in_pixels_is_kept_and_the_lens_follows(posed_camera, scene, picture, fit):
    posed_camera.data.sensor_fit = fit
    posed_camera.virtual_pinhole.distance = 1500
    change(scene, picture)
    assert posed_camera.virtual_pinhole.numbers()[3] == 1500
    assert warnings(posed_camera, scene) == []
    full = scene.render.resolution_x * scene.render.resolution_percentage // 100 / scene.render.resolution_x
    assert cameras.read(posed_camera, scene).distance[0] == pytest.approx(1500 * full, rel=2.0**-22)


@pytest.mark.parametrize("fit", ["AUTO", "HORIZONTAL", "VERTICAL"])
@pytest.mark.parametrize("picture", PICTURES, ids=str)
def test_the_field_of_view_is_kept_and_the_distance_follows(wide_camera, scene, picture, fit):
    wide_camera.data.sensor_fit = fit
    wide_camera.virtual_pinhole.distance = 1500
    lens = wide_camera.data.lens
    change(scene, picture)
    # The rows of a picture at a percentage are rounded down, each side by less than a pixel.
    rounded = 2 / (scene.render.resolution_y * scene.render.resolution_percentage / 100)
    assert wide_camera.data.lens == pytest.approx(lens, rel=rounded if "resolution_percentage" in picture else 2.0**-22)
    assert warnings(wide_camera, scene) == []


def test_the_same_picture_again_has_the_same_lens_and_distance(wide_camera, scene):
    before = wide_camera.data.lens, wide_camera.virtual_pinhole.numbers()[3]
    for width in (1921, 777, 1920):
        change(scene, {"resolution_x": width})
    assert wide_camera.data.lens == pytest.approx(before[0], rel=2.0**-23)
    assert wide_camera.virtual_pinhole.numbers()[3] == pytest.approx(before[1], rel=3 * 2.0**-53)


def test_a_script_that_sets_resolution_and_distance_means_the_new_pixels(wide_camera, scene):
    scene.render.resolution_x = 960
    wide_camera.virtual_pinhole.distance = 800
    bpy.context.view_layer.update()
    assert wide_camera.virtual_pinhole.numbers()[3] == 800
    assert cameras.read(wide_camera, scene).distance[0] == pytest.approx(800, rel=2.0**-22)


def test_choosing_what_is_kept_moves_nothing(posed_camera, scene):
    before = posed_camera.data.lens, posed_camera.virtual_pinhole.numbers()
    for keeps in ("FIELD_OF_VIEW", "PIXELS"):
        posed_camera.virtual_pinhole.keeps = keeps
        assert (posed_camera.data.lens, posed_camera.virtual_pinhole.numbers()) == before


def test_stating_a_pinhole_anew_counts_in_the_present_picture(wide_camera, scene):
    change(scene, {"resolution_x": 960})
    cameras.apply(wide_camera, Pinhole((0, -5, 0), (0, 0, 0), (0, 0, 1), 1 / 3, 960, 1080), scene)
    assert wide_camera.virtual_pinhole.numbers()[3] == 1 / 3


def test_keyed_distances_keep_their_curves_and_the_field_of_view(wide_camera, scene):
    group = wide_camera.virtual_pinhole
    for frame, distance in ((1, 1000), (11, 3000)):
        group.distance = distance
        group.keyframe_insert("distance", frame=frame)
    lenses = []
    for width in (1920, 960):
        change(scene, {"resolution_x": width, "resolution_y": width // 2})
        for frame in (1, 6, 11):
            scene.frame_set(frame)
            assert warnings(wide_camera, scene) == []
            lenses.append(wide_camera.data.lens)
    assert lenses[3:] == pytest.approx(lenses[:3], rel=2.0**-22)
    assert group.distance == 3000
    cameras.apply(wide_camera, Pinhole((0, -5, 0), (0, 0, 0), (0, 0, 1), 700, 960, 480), scene)
    assert cameras.stated(wide_camera, scene).distance[0] == 700 and group.distance == 1400


@pytest.mark.parametrize("keeps", ["PIXELS", "FIELD_OF_VIEW"])
def test_a_pose_that_the_artist_has_changed_stays_when_the_picture_changes(posed_camera, scene, keeps):
    posed_camera.virtual_pinhole.keeps = keeps
    posed_camera.location = (1, 1, 1)
    change(scene, {"resolution_x": 960})
    assert tuple(posed_camera.location) == (1, 1, 1)
    assert warnings(posed_camera, scene) == [] and tuple(posed_camera.virtual_pinhole.eye) == (1, 1, 1)


def test_a_camera_that_is_not_enabled_keeps_its_lens(camera_object, scene):
    change(scene, {"resolution_x": 960})
    assert camera_object.data.lens == 50 and not any(camera_object.virtual_pinhole.picture)


def test_values_that_make_no_camera_leave_the_lens_until_they_are_mended(posed_camera, scene):
    lens = posed_camera.data.lens
    posed_camera.virtual_pinhole.distance = 0
    change(scene, {"resolution_x": 960, "resolution_y": 540})
    assert posed_camera.data.lens == lens
    posed_camera.virtual_pinhole.distance = 750
    assert posed_camera.data.lens == pytest.approx(lens, rel=2.0**-23)


@pytest.mark.parametrize("keeps", ["PIXELS", "FIELD_OF_VIEW"])
def test_undo_and_redo_of_a_resolution_bring_the_camera_along(posed_camera, fresh_blender, scene, keeps):
    posed_camera.virtual_pinhole.keeps = keeps

    def state():
        bpy.context.view_layer.update()
        item = bpy.data.objects["Camera"]
        assert warnings(item, bpy.context.scene) == []
        return item.data.lens, item.virtual_pinhole.numbers()

    bpy.context.view_layer.update()
    fresh_blender.ops.ed.undo_push(message="before")
    before = state()
    scene.render.resolution_x = 640
    fresh_blender.ops.ed.undo_push(message="resolution")  # as the window does it: before anything is evaluated
    after = state()
    assert after != before
    fresh_blender.ops.ed.undo()
    assert state() == before
    fresh_blender.ops.ed.redo()
    assert state() == after


def test_a_picture_that_a_script_renders_at_once_is_of_the_new_resolution(posed_camera, scene, render_positions, picture_error):
    scene.render.resolution_x, scene.render.resolution_y = 48, 24
    positions = render_positions()
    pinhole = cameras.stated(posed_camera, scene)
    assert (pinhole.width, pinhole.height) == positions.shape[1::-1]
    error, tolerance = picture_error(pinhole, positions)
    assert error <= tolerance, f"{error:.1e} px, and {tolerance:.1e} are rounding"


def test_a_scene_that_is_not_shown_is_rendered_with_the_lens_of_its_new_resolution(
    fresh_blender, scene, posed_camera, monkeypatch
):
    """Nothing but its render tells of it. What the camera has in the render is what a handler after ours sees there."""
    other = bpy.data.scenes.new("Other")
    scene.collection.objects.unlink(posed_camera)
    other.collection.objects.link(posed_camera)
    other.camera, other.render.engine, other.cycles.samples = posed_camera, "CYCLES", 1
    lens, seen = posed_camera.data.lens, []
    other.render.resolution_x, other.render.resolution_y = 48, 27

    def look(_scene, depsgraph):
        if depsgraph.mode == "RENDER":
            seen.append(bpy.data.objects["Camera"].data.lens)

    bpy.app.handlers.frame_change_post.append(look)
    try:
        bpy.ops.render.render(scene="Other")
    finally:
        bpy.app.handlers.frame_change_post.remove(look)
    assert seen == pytest.approx([lens * 1920 / 48], rel=2.0**-22)


def test_a_camera_of_two_scenes_stays_set_for_the_one_that_has_not_changed(posed_camera, scene):
    other = bpy.data.scenes.new("Other")
    other.collection.objects.link(posed_camera)
    lens = posed_camera.data.lens
    change(scene, {"resolution_x": 960})
    assert posed_camera.data.lens == lens
    (warning,) = warnings(posed_camera, scene)
    assert "The camera is set for the 1920 × 1080 px of scene 'Other', and scene 'Scene' renders 960 × 1080" in warning
    posed_camera.virtual_pinhole.keeps = "FIELD_OF_VIEW"
    posed_camera.virtual_pinhole.distance = 750
    other.render.resolution_x = 640
    change(scene, {"resolution_x": 1920})
    assert [warnings(posed_camera, each) for each in (scene, other)] == [[], []]


def test_nothing_is_looked_at_until_the_picture_changes(posed_camera, scene, monkeypatch):
    bpy.context.view_layer.update()
    looked = []
    monkeypatch.setattr(resolution, "_set_for_another", lambda *_: looked.append(None) or [])
    for _ in range(3):
        scene.frame_start += 1
        scene.render.fps += 1
        posed_camera.location.x += 1
        bpy.context.view_layer.update()
    assert looked == []
    change(scene, {"resolution_x": 960})
    assert len(looked) == 1


def test_a_job_of_another_size_leaves_the_other_cameras_alone(posed_camera, add_camera, scene):
    other = add_camera("Other")
    other.virtual_pinhole.enabled, other.virtual_pinhole.distance = True, 777.7
    lens, exact = other.data.lens, other.virtual_pinhole.exact
    with resolution.lens_kept(posed_camera, scene):
        change(scene, {"resolution_x": 480, "resolution_y": 270})
        assert (other.data.lens, posed_camera.data.lens) == (lens, 28.125)
        assert cameras.stated(posed_camera, scene).distance[0] == 375
        scene.render.resolution_x, scene.render.resolution_y = 1920, 1080
    bpy.context.view_layer.update()
    assert (other.data.lens, other.virtual_pinhole.exact) == (lens, exact)
    assert (posed_camera.virtual_pinhole.keeps, posed_camera.virtual_pinhole.distance) == ("PIXELS", 1500)


def test_a_lens_that_did_not_follow_would_be_noticed(posed_camera, scene, monkeypatch):
    monkeypatch.setattr(resolution, "is_paused", True)
    change(scene, {"resolution_x": 960})
    (warning,) = warnings(posed_camera, scene)
    assert "The picture was 1920 × 1080 px and is 960 × 1080 now" in warning


@pytest.mark.parametrize("by", ["the tick-box", "Adopt", "values and the tick-box"])
def test_a_new_camera_keeps_its_field_of_view_and_a_file_what_it_has(camera_object, scene, by):
    group = camera_object.virtual_pinhole
    if by == "Adopt":
        bpy.ops.viewcam.adopt_camera()
    else:
        if by != "the tick-box":
            group.eye, group.look_at, group.up, group.distance = (7, -6, 5), (0, 0, 1), (0, 0, 1), 2000
        group.enabled = True
    lens = camera_object.data.lens
    change(scene, {"resolution_x": 3840})
    assert group.keeps == "FIELD_OF_VIEW" and camera_object.data.lens == pytest.approx(lens, rel=2.0**-22)
    group.property_unset("keeps")  # as a file of before has it
    group.enabled = False
    group.enabled = True
    assert group.keeps == "PIXELS"


# --- A camera that owns its picture: the scene has it while the camera is active, and its own to the bit before and after


SQUARE = {"resolution_x": 512, "resolution_y": 512, "resolution_percentage": 50}
SQUARE |= {"pixel_aspect_x": 1.1, "pixel_aspect_y": 1.0, "frame_start": 300, "frame_end": 320}


@pytest.fixture
def plain(add_camera, scene):
    """A camera without a picture of its own; the scene's numbers are odd ones."""
    scene.render.resolution_x, scene.render.resolution_y, scene.render.pixel_aspect_y = 1001, 701, 1.3
    scene.frame_start, scene.frame_end = 7, 9
    return add_camera("Plain")


@pytest.fixture
def square(plain, add_camera, scene):
    """A camera with one, which is not the scene's."""
    square_camera = add_camera("Square")
    scene.camera = plain
    square_camera.virtual_pinhole_picture.use = True
    for name, value in SQUARE.items():
        setattr(square_camera.virtual_pinhole_picture, name, value)
    bpy.context.view_layer.update()
    return square_camera


def activate(camera_object, scene):
    scene.camera = camera_object
    bpy.context.view_layer.update()


def test_the_picture_changes_with_the_active_camera_and_comes_back_to_the_bit(plain, square, scene):
    before = own_picture._numbers(scene)
    for _ in range(3):
        activate(square, scene)
        assert own_picture._numbers(scene) == pytest.approx(SQUARE) and own_picture.owner(scene) == square
        activate(plain, scene)
        assert own_picture._numbers(scene) == before and own_picture.owner(scene) is None


def test_what_is_edited_while_it_is_active_is_the_camera_s(plain, square, scene):
    before = own_picture._numbers(scene)
    activate(square, scene)
    scene.render.resolution_x, scene.frame_end = 640, 999
    activate(plain, scene)
    assert own_picture._numbers(scene) == before
    activate(square, scene)
    assert (scene.render.resolution_x, scene.frame_end) == (640, 999)


@pytest.mark.parametrize("linked", [False, True])
def test_a_duplicate_of_the_active_camera_has_its_picture_as_it_is_now_and_then_one_of_its_own(plain, square, scene, linked):
    activate(square, scene)
    scene.render.resolution_x, scene.frame_end = 640, 999
    bpy.context.view_layer.update()
    for each in scene.objects:
        each.select_set(each == square)
    bpy.context.view_layer.objects.active = square
    bpy.ops.object.duplicate(linked=linked)
    twin = bpy.context.object
    assert own_picture.of_camera(twin, scene) == own_picture.of_camera(square, scene)
    activate(twin, scene)
    assert (scene.render.resolution_x, scene.frame_end) == (640, 999) and own_picture.owner(scene) == twin
    scene.render.resolution_x = 320
    activate(square, scene)
    assert scene.render.resolution_x == 640


def test_a_camera_at_rest_is_not_written_to(plain, square, scene):
    activate(square, scene)
    result = []

    def note(_scene, depsgraph):
        result.extend(update.id.name for update in depsgraph.updates)

    bpy.app.handlers.depsgraph_update_post.append(note)
    try:
        for each in scene.objects:
            if each.type != "CAMERA":
                each.location.x += 1
        bpy.context.view_layer.update()
        bpy.context.view_layer.update()
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(note)
    assert "Square" not in result and "Plain" not in result, result


def test_from_one_own_picture_to_another_and_back_to_the_scene_s(plain, square, add_camera, scene):
    before = own_picture._numbers(scene)
    activate(square, scene)
    tall = add_camera("Tall")
    bpy.context.view_layer.update()
    assert own_picture._numbers(scene) == before
    tall.virtual_pinhole_picture.use = True
    assert own_picture._numbers(scene) == before, "it begins with the scene's"
    scene.render.resolution_y = 3000
    activate(square, scene)
    assert own_picture._numbers(scene) == pytest.approx(SQUARE)
    activate(tall, scene)
    assert scene.render.resolution_y == 3000
    tall.virtual_pinhole_picture.use = False
    assert own_picture._numbers(scene) == before and own_picture.owner(scene) is None


def test_a_camera_that_is_deleted_gives_the_scene_its_own_back(plain, square, scene):
    before = own_picture._numbers(scene)
    activate(square, scene)
    bpy.data.objects.remove(square)
    bpy.context.view_layer.update()
    assert own_picture._numbers(scene) == before and own_picture.owner(scene) is None


def test_what_is_put_aside_is_saved_with_the_file(plain, square, scene, tmp_path):
    before = own_picture._numbers(scene)
    activate(square, scene)
    path = str(tmp_path / "file.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    scene = bpy.context.scene
    assert own_picture._numbers(scene) == pytest.approx(SQUARE)
    activate(bpy.data.objects["Plain"], scene)
    assert own_picture._numbers(scene) == before


def test_the_picture_of_any_camera_is_known_whichever_is_active(plain, square, scene):
    before = own_picture._numbers(scene)
    for active in (plain, square):
        activate(active, scene)
        assert own_picture.of_camera(plain, scene) == before
        assert own_picture.of_camera(square, scene) == pytest.approx(SQUARE)


def test_cameras_that_have_none_change_nothing(plain, add_camera, scene):
    before = own_picture._numbers(scene)
    activate(add_camera("Other"), scene)
    assert own_picture._numbers(scene) == before and not scene.virtual_pinhole_picture.is_lent
