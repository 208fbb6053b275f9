from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import datablocks, moving, panel


def contents(camera_object, scene):
    bpy.context.view_layer.update()
    rows, warnings = panel.contents(camera_object, scene)
    return {label: " ".join(texts) for label, *texts in rows}, warnings


def test_a_camera_that_is_well_shows_its_read_outs_and_no_warning(posed_camera, scene):
    rows, warnings = contents(posed_camera, scene)
    assert warnings == []
    assert rows["Focal Length"] == "28.125 mm"
    assert rows["To Look-At"] == "10.0499 m"
    assert list(rows) == ["Focal Length", "Horizontal FOV", "Vertical FOV", "Diagonal FOV", "u", "v", "w", "To Look-At"]


def test_a_camera_that_is_not_enabled_shows_what_it_is(camera_object, scene):
    rows, warnings = contents(camera_object, scene)
    assert rows["Focal Length"] == "50 mm"
    assert "To Look-At" not in rows
    assert warnings == []


@pytest.mark.parametrize(
    ("name", "value", "warning"),
    [
        ("look_at", (7, -6, 5), "Eye and look_at are the same point"),
        ("up", (0, 0, 0), "Up is (0, 0, 0)"),
        ("distance", 0.0, "Distance is 0 pixels"),
    ],
)
def test_values_that_make_no_camera_are_shown_as_the_sentence_of_their_error(posed_camera, scene, name, value, warning):
    setattr(posed_camera.virtual_pinhole, name, value)
    _, warnings = contents(posed_camera, scene)
    assert len(warnings) == 1
    assert warnings[0].startswith(warning)


def test_a_singular_pose_is_warned_of(posed_camera, scene):
    posed_camera.virtual_pinhole.eye = (0, 0, 9)
    assert "parallel to up" in contents(posed_camera, scene)[1][0]


def test_an_orthographic_camera_is_warned_of_once(posed_camera, scene):
    posed_camera.data.type = "ORTHO"
    rows, warnings = contents(posed_camera, scene)
    assert rows == {}
    assert warnings == ["Camera 'Camera' is orthographic, no pinhole: set its lens type to Perspective"]


def test_a_sheared_camera_is_warned_of_once(posed_camera, scene):
    parent = bpy.data.objects.new("Stretched", None)
    scene.collection.objects.link(parent)
    parent.scale = (1, 1, 3)
    posed_camera.parent = parent
    rows, warnings = contents(posed_camera, scene)
    assert rows == {}
    assert len(warnings) == 1


def test_what_is_more_than_a_pinhole_is_warned_of(posed_camera, scene):
    posed_camera.data.dof.use_dof = scene.render.use_multiview = scene.render.use_motion_blur = True
    _, warnings = contents(posed_camera, scene)
    assert [warning.split(" is on")[0] for warning in warnings] == ["Depth of field", "Stereoscopy", "Motion blur"]


def test_the_distance_to_look_at_is_in_the_scenes_units(posed_camera, scene):
    scene.unit_settings.system = "NONE"
    assert contents(posed_camera, scene)[0]["To Look-At"] == "10.0499"


def test_the_panel_means_the_active_camera_else_the_scenes(posed_camera, add_camera, scene):
    other = add_camera("Other")
    scene.camera = posed_camera
    bpy.context.view_layer.objects.active = None
    assert datablocks.camera_in(bpy.context) == posed_camera
    bpy.context.view_layer.objects.active = other
    assert datablocks.camera_in(bpy.context) == other


def test_an_up_in_doubt_comes_with_a_better_one_and_a_certain_one_does_not(posed_camera, scene):
    assert panel.better_up(posed_camera, scene) is None
    group = posed_camera.virtual_pinhole
    group.eye, group.look_at = (0.5, 0.25, 5), (0.5, 0.25, 0)
    assert panel.better_up(posed_camera, scene) == (1, 0, 0)
    group.look_at = group.eye
    assert panel.better_up(posed_camera, scene) is None


def test_the_camera_datas_panel_stays_away_from_the_data_of_a_lamp(posed_camera):
    shown = [panel.VIEWCAM_PT_data.poll(SimpleNamespace(camera=data)) for data in (posed_camera.data, None)]
    assert shown == [True, False]


class Layout:
    """Stands in for Blender's, which draws in a window only: keeps the buttons of all layouts inside it."""

    def __init__(self, buttons):
        self.buttons = buttons

    def row(self, align=False):
        return Layout(self.buttons)

    column = row

    def split(self, factor=0.0):
        return Layout(self.buttons)

    def label(self, text):
        pass

    def operator(self, name, **look):
        self.buttons.append((name, look, SimpleNamespace()))
        return self.buttons[-1][-1]


def test_both_panels_have_a_closed_sub_panel(posed_camera):
    for each, parent in (
        (panel.VIEWCAM_PT_data_move, "VIEWCAM_PT_data"),
        (panel.VIEWCAM_PT_sidebar_move, "VIEWCAM_PT_sidebar"),
    ):
        assert each.bl_parent_id == parent and "DEFAULT_CLOSED" in each.bl_options and each.poll(bpy.context)


def test_the_sub_panel_has_every_move_for_the_camera_that_is_shown(posed_camera):
    buttons = []
    panel.VIEWCAM_PT_sidebar_move.draw(SimpleNamespace(layout=Layout(buttons)), bpy.context)
    assert {name for name, _, _ in buttons} == {each.bl_idname for each in moving.CLASSES}
    icons = bpy.types.UILayout.bl_rna.functions["operator"].parameters["icon"].enum_items
    for name, look, properties in buttons:
        assert properties.camera == "Camera"
        known = getattr(bpy.ops.viewcam, name.split(".")[1]).get_rna_type().properties
        assert set(vars(properties)) <= set(known.keys()), f"{name} knows not all of {vars(properties)}"
        assert look.get("icon", "NONE") in icons
