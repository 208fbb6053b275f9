"""A camera that owns its picture: the scene has it while the camera is active, and its own to the bit before and after."""

import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import own_picture

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
    found = add_camera("Square")
    scene.camera = plain
    found.virtual_pinhole_picture.use = True
    for name, value in SQUARE.items():
        setattr(found.virtual_pinhole_picture, name, value)
    bpy.context.view_layer.update()
    return found


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
    told = []

    def note(_scene, depsgraph):
        told.extend(update.id.name for update in depsgraph.updates)

    bpy.app.handlers.depsgraph_update_post.append(note)
    try:
        for each in scene.objects:
            if each.type != "CAMERA":
                each.location.x += 1
        bpy.context.view_layer.update()
        bpy.context.view_layer.update()
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(note)
    assert "Square" not in told and "Plain" not in told, told


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
