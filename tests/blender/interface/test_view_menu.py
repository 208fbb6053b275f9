from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy")

import viewcam_addon
from viewcam_addon.blender.interface import baking, clipboard, moving, operators, photo_matching, scene_cameras, view_menu


def test_every_button_of_a_camera_stands_in_the_menu_which_the_search_reads(registered_addon):
    entries, drags, menus = [], [], []

    def operator(name, text=""):
        entries.append(name)
        drags.extend([text] if text else [])
        return SimpleNamespace()

    layout = SimpleNamespace(operator=operator, menu=menus.append, separator=lambda: None)
    view_menu.VIEWCAM_MT_cameras.draw(SimpleNamespace(layout=layout), bpy.context)
    classes = (*moving.CLASSES, *operators.CLASSES, *baking.CLASSES, *clipboard.IN_MENUS, *scene_cameras.OPERATORS)
    classes += photo_matching.OPERATORS
    assert set(entries) == {each.bl_idname for each in classes} and menus == ["VIEWCAM_MT_copy_camera_as"]
    assert "viewcam.copy_readout" not in entries, "without a text of its own, as from a menu, it would empty the clipboard"
    assert drags == ["Drag: Orbit", "Drag: Dolly", "Drag: Dolly Zoom", "Drag: Truck"]
    assert all(getattr(bpy.ops.viewcam, entry.split(".")[1]).get_rna_type() for entry in entries)


def test_the_menu_stands_under_view_cameras(registered_addon):
    menus = []
    layout = SimpleNamespace(menu=menus.append, separator=lambda: None)
    view_menu._draw(SimpleNamespace(layout=layout), bpy.context)
    assert menus == ["VIEWCAM_MT_cameras"] and hasattr(bpy.types, menus[0])
    assert view_menu._draw in bpy.types.VIEW3D_MT_view_cameras._dyn_ui_initialize()


def test_the_menu_goes_with_the_add_on(registered_addon):
    functions = bpy.types.VIEW3D_MT_view_cameras._dyn_ui_initialize
    count = len(functions())
    viewcam_addon.unregister()
    try:
        assert len(functions()) == count - 1 and not hasattr(bpy.types, "VIEWCAM_MT_cameras")
    finally:
        viewcam_addon.register()
    assert len(functions()) == count
