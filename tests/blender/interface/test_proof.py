"""The sub-panel Proof: what it starts from, and what is left without the add-on. What it does is in test_comparing.py."""

import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import preferences
from viewcam_addon.blender.interface import proof


def test_the_level_is_the_preferred_one_until_another_is_chosen(fresh_blender, monkeypatch):
    settings = bpy.context.window_manager.virtual_pinhole_proof
    assert settings.level == "GEOMETRY"
    monkeypatch.setattr(preferences, "get", lambda: preferences.Defaults(default_level="PATH"))
    assert settings.level == "PATH"
    settings.level = "AUTO"
    assert settings.level == "AUTO"
    settings.said = ""


def test_the_render_menu_and_the_status_bar_are_as_before_without_the_add_on(registered_addon):
    def entries():
        return [
            *bpy.types.TOPBAR_MT_render._dyn_ui_initialize(),
            *bpy.types.STATUSBAR_HT_header._dyn_ui_initialize(),
            *bpy.app.handlers.load_pre,
        ]

    ours = {proof._draw_render_menu, proof._draw_status_bar, proof._on_load}
    assert ours <= set(entries())
    for _ in range(3):
        registered_addon.unregister()
        without = [each for each in entries() if each in ours]
        registered_addon.register()
        assert without == [] and len([each for each in entries() if each in ours]) == 3
