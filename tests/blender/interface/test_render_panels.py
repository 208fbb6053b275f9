"""The render engine's panels, and those of Blender that it takes over: all gone with the add-on."""

import pytest

bpy = pytest.importorskip("bpy")

import viewcam_addon
from viewcam_addon.blender.interface import render_panels
from viewcam_addon.image import SETTINGS


def engines_of_panels():
    return {
        each.__name__: set(each.COMPAT_ENGINES) for each in bpy.types.Panel.__subclasses__() if hasattr(each, "COMPAT_ENGINES")
    }


def test_the_add_on_comes_and_goes_and_leaves_blenders_panels_as_they_were(scene):
    viewcam_addon.unregister()
    before = engines_of_panels()
    try:
        assert not [name for name, engines in before.items() if "VIEWCAM" in engines and not name.startswith("VIEWCAM")]
        assert not hasattr(bpy.types.Scene, "virtual_pinhole_reference")
        for _ in range(3):
            viewcam_addon.register()
            assert "VIEWCAM" in engines_of_panels()["RENDER_PT_format"]
            viewcam_addon.unregister()
            assert engines_of_panels() == before
            with pytest.raises(TypeError):
                scene.render.engine = "VIEWCAM"
    finally:
        viewcam_addon.register()
    scene.render.engine = "VIEWCAM"


@pytest.mark.parametrize(
    "name",
    [
        *(
            "RENDER_PT_format",
            "RENDER_PT_frame_range",
            "RENDER_PT_output",
            "RENDER_PT_stereoscopy",
            "RENDER_PT_post_processing",
        ),
        *("RENDER_PT_color_management", "VIEWLAYER_PT_layer", "DATA_PT_lens", "DATA_PT_camera", "OBJECT_PT_visibility"),
        *(
            "EEVEE_MATERIAL_PT_context_material",
            "EEVEE_MATERIAL_PT_surface",
            "EEVEE_WORLD_PT_surface",
            "WORLD_PT_context_world",
        ),
    ],
)
def test_blenders_panels_that_matter_are_shown(name):
    assert "VIEWCAM" in engines_of_panels()[name]


@pytest.mark.parametrize("name", ["DATA_PT_light", "DATA_PT_spot", "RENDER_PT_simplify", "RENDER_PT_freestyle"])
def test_panels_of_what_is_not_modelled_or_is_shown_by_ours_are_not(name):
    assert "VIEWCAM" not in engines_of_panels()[name]


@pytest.mark.parametrize("kind", ["POINT", "SUN", "SPOT", "AREA"])
def test_what_the_lamps_panel_shows_is_there_and_named_once(scene, kind):
    lamp = bpy.data.lights.new(kind, kind)
    names = list(render_panels.lamp_settings(lamp))
    assert {"color", "energy", "use_shadow"} < set(names) and len(set(names)) == len(names)
    assert not [name for name in names if not hasattr(lamp, name)]


def test_passes_in_the_panel_are_those_that_the_tracer_computes(scene):
    layer = scene.view_layers[0]
    assert not [name for name in SETTINGS.values() if not hasattr(layer, name)]
    shown = {name for names in (render_panels.GEOMETRY_PASSES, render_panels.LIGHT_PASSES) for name in names}
    assert set(SETTINGS) <= shown
