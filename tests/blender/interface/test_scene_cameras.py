"""The panel's camera, the way to the others, a new one."""

from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import datablocks
from viewcam_addon.blender.interface import panel, scene_cameras


def activate(block):
    bpy.context.view_layer.objects.active = block


def test_a_new_camera_is_enabled_selected_and_looks_at_the_cursor(scene):
    scene.cursor.location = (1, 2, 3)
    assert bpy.ops.viewcam.add_camera() == {"FINISHED"}
    added = bpy.context.active_object
    assert added.select_get() and scene.camera == added and added.virtual_pinhole.enabled
    assert tuple(added.virtual_pinhole.look_at) == (1, 2, 3)
    bpy.context.view_layer.update()
    assert cameras.check(added, cameras.stated(added, scene), scene) == []
    assert bpy.ops.viewcam.add_camera() == {"FINISHED"}
    assert scene.camera == added != bpy.context.active_object, "the scene's camera is changed where there was one"


def test_where_no_viewport_is_a_camera_from_view_is_refused_and_leaves_nothing(scene, monkeypatch):
    monkeypatch.setattr(scene_cameras.viewport, "area_in", lambda _context: None)
    with pytest.raises(RuntimeError, match="There is no 3D viewport in this window"):
        bpy.ops.viewcam.add_camera(from_view=True)
    assert len(bpy.data.cameras) == 0 and len(scene.objects) == 0


def test_a_broken_view_leaves_no_camera_behind(scene, monkeypatch):
    def refuse(*_):
        raise scene_cameras.InputError("the viewport is orthographic, no pinhole: switch it to perspective")

    monkeypatch.setattr(scene_cameras.viewport, "area_in", lambda _context: "an area")
    monkeypatch.setattr(scene_cameras.viewport, "pinhole_of", refuse)
    with pytest.raises(RuntimeError, match="The viewport is orthographic"):
        bpy.ops.viewcam.add_camera(from_view=True)
    assert len(bpy.data.cameras) == 0 and len(scene.objects) == 0


def test_next_and_previous_go_around_all_cameras_by_name(add_camera, scene):
    b, c, a = (add_camera(name) for name in "bca")
    activate(a)
    seen = []
    for step in (1, 1, 1, -1, -1):
        assert bpy.ops.viewcam.step_camera(step=step) == {"FINISHED"}
        seen.append(bpy.context.active_object)
        assert [each for each in scene.objects if each.select_get()] == [bpy.context.active_object]
    assert seen == [b, c, a, c, b] and scene.camera == a, "the scene's camera stays"


def test_make_active_is_the_scene_s_camera_and_nothing_else(add_camera, scene):
    first, second = add_camera("first"), add_camera("second")
    matrix = np.array(first.matrix_world)
    activate(second)
    assert bpy.ops.viewcam.make_camera_active(camera="first") == {"FINISHED"}
    assert scene.camera == first and bpy.context.active_object == second
    assert (np.array(first.matrix_world) == matrix).all()
    with pytest.raises(RuntimeError, match="has no camera 'third'"):
        bpy.ops.viewcam.make_camera_active(camera="third")


def test_the_list_has_the_cameras_and_chooses_by_a_click(add_camera, scene, empty):
    empty("between")
    first, second = add_camera("first"), add_camera("second")
    manager = bpy.context.window_manager
    activate(first)
    assert scene.objects[manager.virtual_pinhole_camera] == first
    manager.virtual_pinhole_camera = scene.objects.find("second")
    assert bpy.context.active_object == second
    listed = SimpleNamespace(filter_name="", bitflag_filter_item=1)
    flags = [1 if each.type == "CAMERA" else 0 for each in scene.objects]
    assert scene_cameras.VIEWCAM_UL_cameras.filter_items(listed, bpy.context, scene, "objects")[0] == flags
    listed.filter_name = "SEC"
    assert sum(scene_cameras.VIEWCAM_UL_cameras.filter_items(listed, bpy.context, scene, "objects")[0]) == 1


class Layout:
    """Keeps what is drawn in it; rows and columns are it."""

    def __init__(self):
        self.drawn = []

    def row(self, **_):
        return self

    column = row

    def label(self, text="", **_):
        self.drawn.append(text)

    def operator(self, name, **_):
        self.drawn.append(name)
        return SimpleNamespace()

    def prop(self, data, name, **_):
        self.drawn.append(f"{data.name}.{name}")


def drawing():
    """The context of a sidebar that is drawn."""
    preferences = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0))
    region = SimpleNamespace(width=202)
    return SimpleNamespace(
        scene=bpy.context.scene, active_object=bpy.context.active_object, region=region, preferences=preferences
    )


def test_the_sidebar_names_its_camera_and_says_so_where_it_is_not_the_active_object(add_camera, scene, empty):
    camera_object = add_camera("Hero")
    activate(camera_object)
    layout = Layout()
    scene_cameras.draw_header(layout, camera_object, drawing())
    assert "Hero.name" in layout.drawn and "viewcam.make_camera_active" not in layout.drawn
    activate(empty("Cube"))
    layout = Layout()
    scene_cameras.draw_header(layout, datablocks.camera_in(bpy.context), drawing())
    assert "Hero.name" in layout.drawn and "The scene's camera; Cube is active" in " ".join(layout.drawn)


def test_without_a_camera_the_sidebar_stays_and_offers_one(scene):
    assert panel.VIEWCAM_PT_sidebar.poll(bpy.context)
    layout = Layout()
    panel.VIEWCAM_PT_sidebar.draw(SimpleNamespace(layout=layout), bpy.context)
    assert layout.drawn == ["There is no camera", "viewcam.add_camera", "viewcam.add_camera"]
    panel.VIEWCAM_PT_sidebar.draw_header(SimpleNamespace(layout=None), bpy.context)


def test_add_camera_stands_in_blender_s_menu_and_goes_with_the_add_on(registered_addon):
    entries = bpy.types.VIEW3D_MT_camera_add._dyn_ui_initialize
    assert scene_cameras._draw_add_menu in entries()
    registered_addon.unregister()
    try:
        assert scene_cameras._draw_add_menu not in entries()
        assert not hasattr(bpy.types.WindowManager, "virtual_pinhole_camera")
    finally:
        registered_addon.register()


def test_an_added_camera_shows_the_same_in_a_larger_picture(scene):
    bpy.ops.viewcam.add_camera()
    added, render = bpy.context.object, scene.render
    before = added.data.lens
    render.resolution_x, render.resolution_y = 2 * render.resolution_x, 2 * render.resolution_y
    bpy.context.view_layer.update()
    assert added.virtual_pinhole.keeps == "FIELD_OF_VIEW" and added.data.lens == pytest.approx(before, rel=2.0**-21)
