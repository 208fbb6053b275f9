"""What people do with objects: duplicate, copy and paste, link, append, override, rename, delete, undo.

docs/odd-blender.md says what each test expects; the fixture `no_traceback` listens to the console.
"""

import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import datablocks, targets


@pytest.fixture
def aimed_camera(posed_camera, empty):
    """The posed camera with an object Target as look-at, which stands in for the point (0, 0, 1)."""
    posed_camera.virtual_pinhole.look_at_target = empty("Target", (0, 0, 1))
    bpy.context.view_layer.update()
    return posed_camera


@pytest.fixture
def carried_over(tmp_path):
    """A function that saves the file, opens an empty one and brings objects over: by "copy", "append" or "link"; the camera."""

    def carry(how, *names):
        path = str(tmp_path / "other.blend")
        if how == "copy":
            pick(*names)
            bpy.ops.view3d.copybuffer()
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        if how == "copy":
            bpy.ops.view3d.pastebuffer()
        else:
            directory = f"{path}/Object/"
            bring = bpy.ops.wm.append if how == "append" else bpy.ops.wm.link
            bring(directory=directory, files=[{"name": name} for name in names])
        bpy.context.scene.camera = bpy.data.objects["Camera"]
        bpy.context.view_layer.update()
        return bpy.data.objects["Camera"]

    return carry


def pick(*names):
    """Select these objects, the first one active."""
    bpy.ops.object.select_all(action="DESELECT")
    for name in names:
        bpy.data.objects[name].select_set(True)
    bpy.context.view_layer.objects.active = bpy.data.objects[names[0]]


def duplicate(*names, linked=False):
    """Shift-D or Alt-D: the copy of the first."""
    pick(*names)
    bpy.ops.object.duplicate(linked=linked)
    return bpy.data.objects[f"{names[0]}.001"]


def move(name, place):
    bpy.data.objects[name].location = place
    bpy.context.view_layer.update()


def place_of(name):
    return tuple(bpy.data.objects[name].evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world.translation)


def test_a_duplicate_follows_values_of_its_own(posed_camera, odd):
    group = duplicate("Camera").virtual_pinhole
    assert group.numbers() == posed_camera.virtual_pinhole.numbers()
    group.eye, group.distance = (1, 2, 3), 700
    bpy.context.view_layer.update()
    assert place_of("Camera") == (7, -6, 5) and place_of("Camera.001") == (1, 2, 3)
    assert posed_camera.data.lens == 1500 * 36 / 1920
    odd.check(bpy.data.objects["Camera.001"])


def test_of_linked_duplicates_the_one_that_was_set_last_has_its_lens(posed_camera, odd):
    twin = duplicate("Camera", linked=True)
    odd.check(posed_camera, then=lambda: setattr(twin.virtual_pinhole, "distance", 1000))


def test_a_duplicated_camera_looks_at_the_same_target(aimed_camera, odd):
    twin = duplicate("Camera")
    move("Target", (1, 1, 1))
    assert twin.virtual_pinhole.numbers()[1] == aimed_camera.virtual_pinhole.numbers()[1] == (1, 1, 1)
    odd.check(twin)


def test_duplicated_along_with_its_target_it_looks_at_the_new_one(aimed_camera, odd):
    twin = duplicate("Camera", "Target")
    move("Target.001", (1, 1, 1))
    assert twin.virtual_pinhole.numbers()[1] == (1, 1, 1) and aimed_camera.virtual_pinhole.numbers()[1] == (0, 0, 1)
    odd.check(twin)


@pytest.mark.parametrize("how", ["copy", "append"])
def test_a_camera_that_is_copied_or_appended_brings_its_values_along(posed_camera, carried_over, odd, how):
    camera_object = carried_over(how, "Camera")
    assert camera_object.virtual_pinhole.numbers() == ((7, -6, 5), (0, 0, 1), (0, 0, 1), 1500)
    odd.check(camera_object)


@pytest.mark.parametrize("how", ["copy", "append"])
def test_a_camera_that_is_copied_or_appended_brings_its_target_along(aimed_camera, carried_over, odd, how):
    camera_object = carried_over(how, "Camera")
    move("Target", (1, 1, 1))
    assert camera_object.virtual_pinhole.numbers()[1] == (1, 1, 1)
    odd.check(camera_object)


@pytest.mark.parametrize("names", [("Camera", "Target"), ("Camera",)], ids=str)
def test_a_linked_camera_follows_its_linked_target(aimed_camera, carried_over, odd, names):
    """Of which Blender links the datablock too where only the camera is asked for, and shows it in no scene."""
    odd.check(carried_over("link", *names))


def test_an_override_of_a_camera_and_its_target_is_edited_here(aimed_camera, carried_over, odd):
    carried_over("link", "Camera", "Target")
    target = bpy.data.objects["Target"].override_create(remap_local_usages=True)
    camera_object = bpy.data.objects["Camera"].override_create(remap_local_usages=True)
    camera_object.data.override_create(remap_local_usages=True)
    camera_object.virtual_pinhole.look_at_target = target
    move(target.name, (1, 1, 1))
    camera_object.virtual_pinhole.eye = (7, -6, 6)
    odd.check(camera_object)
    camera_object = bpy.context.scene.camera
    assert camera_object.virtual_pinhole.numbers()[:2] == ((7, -6, 6), (1, 1, 1))


@pytest.mark.parametrize("data", [lambda: None, lambda: bpy.data.meshes.new("Mesh"), lambda: bpy.data.lights.new("Sun", "SUN")])
def test_all_values_of_what_is_no_camera_can_be_read_and_its_lens_set(scene, data):
    """Blender reads them as it looks for what an override has changed, and any script may."""
    group = bpy.data.objects.new("None", data()).virtual_pinhole
    names = [each.identifier for each in group.bl_rna.properties]
    before = {name: repr(getattr(group, name)) for name in names}
    assert group.focal_length == group.field_of_view == group.roll == 0
    group.focal_length, group.field_of_view = 50, 1
    assert {name: repr(getattr(group, name)) for name in names} == before


def test_renamed_all_goes_on(aimed_camera, odd):
    aimed_camera.name, aimed_camera.data.name, bpy.data.objects["Target"].name = "Shot", "Lens", "Aim"
    move("Aim", (1, 1, 1))
    assert aimed_camera.virtual_pinhole.numbers()[1] == (1, 1, 1)
    odd.check(aimed_camera)


def test_where_its_target_is_deleted_the_camera_stays(aimed_camera, odd):
    def delete():
        pick("Target")
        bpy.ops.object.delete()

    move("Target", (1, 1, 1))
    odd.check(aimed_camera, then=delete, reopened=False)
    assert aimed_camera.virtual_pinhole.numbers()[1] == (1, 1, 1)


def test_where_its_target_is_removed_for_good_the_camera_stays(aimed_camera, odd):
    move("Target", (1, 1, 1))
    odd.check(aimed_camera, then=lambda: bpy.data.objects.remove(bpy.data.objects["Target"]))
    assert tuple(bpy.context.scene.camera.virtual_pinhole.look_at) == (1, 1, 1)
    assert targets.names(bpy.context.scene.camera) == {}


def test_where_another_camera_is_deleted_nothing_happens(posed_camera, add_camera, scene, odd, draw_panels):
    def delete():
        pick("Other")
        bpy.ops.object.delete()
        draw_panels()

    add_camera("Other")
    scene.camera = posed_camera
    odd.check(posed_camera, then=delete)


def test_given_other_data_a_camera_has_its_lens_when_it_is_set_again(posed_camera, odd):
    odd.check(posed_camera, then=lambda: setattr(posed_camera, "data", bpy.data.cameras.new("New")))


def test_made_single_user_it_has_a_lens_of_its_own(posed_camera, odd):
    twin = duplicate("Camera", linked=True)
    pick("Camera.001")
    bpy.ops.object.make_single_user(object=True, obdata=True)
    twin.virtual_pinhole.distance = 1000
    odd.check(posed_camera)


def test_in_a_full_copy_of_the_scene_the_camera_is_another(aimed_camera, odd):
    bpy.ops.scene.new(type="FULL_COPY")
    scene = bpy.context.scene
    move("Target.001", (1, 1, 1))
    scene.render.resolution_x = 1280
    bpy.context.view_layer.update()
    assert aimed_camera.virtual_pinhole.numbers()[1] == (0, 0, 1) and aimed_camera.data.lens == 1500 * 36 / 1920
    assert scene.camera.virtual_pinhole.numbers()[1] == (1, 1, 1)
    odd.check(scene.camera, scene=scene)


def test_when_its_scene_is_deleted_the_camera_stays_well_in_the_other(posed_camera, odd):
    def delete():
        bpy.ops.scene.new(type="LINK_COPY")
        bpy.data.scenes.remove(bpy.context.scene)

    odd.check(posed_camera, then=delete)


def duplicate_it():
    duplicate("Camera")


def delete_the_target():
    pick("Target")
    bpy.ops.object.delete()


def delete_the_camera():
    pick("Camera")
    bpy.ops.object.delete()


def remove_the_data():
    bpy.data.cameras.remove(bpy.data.cameras["Camera"])


def forget_the_scenes_camera():
    bpy.context.scene.camera = None


def unlink():
    bpy.context.scene.collection.objects.unlink(bpy.data.objects["Camera"])


def exclude():
    collection = bpy.data.collections.new("Cameras")
    bpy.context.scene.collection.children.link(collection)
    collection.objects.link(bpy.data.objects["Camera"])
    unlink()
    bpy.context.view_layer.layer_collection.children["Cameras"].exclude = True


def edit_another_object():
    bpy.ops.mesh.primitive_monkey_add()
    bpy.ops.object.mode_set(mode="EDIT")


def clear_its_location():
    pick("Camera")
    bpy.ops.object.location_clear()


def rename():
    bpy.data.objects["Camera"].name, bpy.data.objects["Target"].name = "Shot", "Aim"


def parent_the_target_to_it():
    bpy.data.objects["Target"].parent = bpy.data.objects["Camera"]


def new_view_layer():
    bpy.context.scene.view_layers.new("Second").layer_collection.exclude = True


ACTIONS = (
    duplicate_it,
    delete_the_target,
    delete_the_camera,
    remove_the_data,
    forget_the_scenes_camera,
    unlink,
    exclude,
    edit_another_object,
    clear_its_location,
    rename,
    parent_the_target_to_it,
    new_view_layer,
)


@pytest.mark.parametrize("action", ACTIONS, ids=lambda action: action.__name__)
def test_undo_brings_camera_target_and_values_back(aimed_camera, action, draw_panels):
    bpy.context.preferences.edit.use_global_undo = True
    pick("Camera")
    bpy.ops.ed.undo_push(message="before")
    before = _everything()
    action()
    bpy.context.view_layer.update()
    draw_panels()
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    draw_panels()
    assert _everything() == before
    move("Target", (1, 1, 1))
    assert datablocks.camera_in(bpy.context).virtual_pinhole.numbers()[1] == (1, 1, 1), "the target is not followed any more"
    bpy.ops.ed.undo_push(message="moved")
    bpy.ops.ed.undo()
    assert _everything() == before


def _everything():
    bpy.context.view_layer.update()
    found = {"camera": bpy.context.scene.camera and bpy.context.scene.camera.name}
    for block in bpy.context.scene.objects:
        found[block.name] = (tuple(map(tuple, block.matrix_world)), block.parent and block.parent.name)
        if block.type == "CAMERA":
            found[block.name] += (block.virtual_pinhole.numbers(), targets.names(block), block.data.lens)
    return found


def test_the_panel_of_data_that_no_object_of_the_scene_has_stays_away(posed_camera, draw_panels):
    """Pinned in the properties editor, while its object is deleted."""
    lonely = bpy.data.cameras.new("Lonely")
    assert not any(name.startswith("VIEWCAM_PT_data") for name in draw_panels(camera=lonely))
    assert "VIEWCAM_PT_data" in draw_panels(camera=posed_camera.data)
