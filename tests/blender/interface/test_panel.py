"""Camera presets: those that come along, and an artist's own."""

import itertools
import json
import math
import re
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import numpy as np
import pytest

from viewcam_addon.blender.interface import readouts
from viewcam_addon.pinhole import Pinhole

bpy = pytest.importorskip("bpy")

import viewcam_addon
from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import datablocks
from viewcam_addon.blender.interface import (
    baking,
    clipboard,
    comparing,
    labels,
    moving,
    operators,
    panel,
    photo_matching,
    presets,
    render_panels,
    scene_cameras,
    swipe,
)
from viewcam_addon.image import SETTINGS
from viewcam_addon.labels import KINDS
from viewcam_addon.labels import files as label_files


def contents(camera_object, scene):
    bpy.context.view_layer.update()
    warnings = [notice.sentence for notice in panel.notices(camera_object, scene)]
    return {row.label: " ".join(row.texts) for row in panel.readouts_of(camera_object, scene)}, warnings


def test_a_camera_that_is_well_shows_its_read_outs_and_no_warning(posed_camera, scene):
    rows, warnings = contents(posed_camera, scene)
    assert warnings == []
    assert rows["Focal Length"] == "28.125 mm"
    assert rows["To Look-At"] == "10.0499 m"
    angles = ["Horizontal FOV", "Vertical FOV", "Diagonal FOV"]
    assert list(rows) == ["Focal Length", "View Plane", *angles, "u", "v", "w", "To Look-At"]


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
    def remedies():
        bpy.context.view_layer.update()
        return [notice.remedy for notice in panel.notices(posed_camera, scene)]

    assert remedies() == []
    group = posed_camera.virtual_pinhole
    group.eye, group.look_at = (0.5, 0.25, 5), (0.5, 0.25, 0)
    assert remedies() == [("viewcam.choose_up", "Use Up (1, 0, 0)")]
    group.look_at = group.eye
    assert remedies() == [None]


def test_the_camera_datas_panel_stays_away_from_the_data_of_a_lamp(posed_camera):
    rows = [
        panel.VIEWCAM_PT_data.poll(SimpleNamespace(camera=data, active_object=posed_camera))
        for data in (posed_camera.data, None)
    ]
    assert rows == [True, False]


class Layout:
    """Stands in for Blender's, which draws in a window only: keeps what all layouts inside it draw, in order.

    drawn : ("prop" | "operator" | "label", its name or text, what else was said, the layout that drew it).
    """

    def __init__(self, drawn=None, above=None):
        self.drawn, self.above = [] if drawn is None else drawn, above
        self.active = self.enabled = True
        self.alert = self.is_row = False
        self.factor = None
        self.use_property_split = above is not None and above.use_property_split
        self.use_property_decorate = above is not None and above.use_property_decorate
        self.alignment = "EXPAND"

    def row(self, factor=None, **_look):
        below = Layout(self.drawn, self)
        below.is_row, below.factor = True, factor
        return below

    def column(self, **_look):
        return Layout(self.drawn, self)

    split = row

    def separator(self):
        pass

    def prop_decorator(self, owner, name):
        assert name in owner.bl_rna.properties, f"{owner} has no {name}"
        self._draw("decorator", name, {})

    def _draw(self, kind, name, look):
        known = {"decorator": "prop_decorator"}.get(kind, kind)
        unknown = set(look) - set(bpy.types.UILayout.bl_rna.functions[known].parameters.keys())
        assert not unknown, f"this Blender's {kind}() does not take {unknown}"
        properties = SimpleNamespace()
        self.drawn.append((kind, name, look, self, properties))
        return properties

    def menu(self, name, **look):
        self._draw("menu", name, look)

    def label(self, text, **look):
        self._draw("label", text, look)

    def prop(self, owner, name, **look):
        assert name in owner.bl_rna.properties, f"{owner} has no {name}"
        self._draw("prop", name, look)

    def prop_search(self, owner, name, source, names, **look):
        assert name in owner.bl_rna.properties and names in source.bl_rna.properties
        self.drawn.append(("prop_search", name, {**look, "source": names}, self, None))

    def operator(self, name, **look):
        return self._draw("operator", name, look)

    def is_all(self, name):
        """True if this layout and all around it are active, or enabled."""
        return getattr(self, name) and (self.above is None or self.above.is_all(name))


def drawn(each, width=300):
    """The layout that a panel draws for the camera that is shown."""
    layout = Layout()
    context = SimpleNamespace(
        scene=bpy.context.scene,
        active_object=bpy.context.active_object,
        region=SimpleNamespace(width=width),
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0)),
    )
    each.draw(SimpleNamespace(layout=layout), context)
    return layout.drawn


def properties_drawn(each):
    return {name: layout for kind, name, _, layout, _ in drawn(each) if kind == "prop"}


def test_both_panels_have_closed_sub_panels(posed_camera):
    for each, parent in (
        (panel.VIEWCAM_PT_data_move, "VIEWCAM_PT_data"),
        (panel.VIEWCAM_PT_data_readouts, "VIEWCAM_PT_data"),
        (panel.VIEWCAM_PT_sidebar_move, "VIEWCAM_PT_sidebar"),
        (panel.VIEWCAM_PT_sidebar_readouts, "VIEWCAM_PT_sidebar"),
    ):
        assert each.bl_parent_id == parent and "DEFAULT_CLOSED" in each.bl_options and each.poll(bpy.context)


def test_the_sub_panel_has_every_move_for_the_camera_that_is_shown(posed_camera):
    buttons = [each for each in drawn(panel.VIEWCAM_PT_sidebar_move) if each[0] == "operator"]
    # Dolly is a drag here; to a distance the menu has it, and asks for that.
    assert {name for _, name, *_ in buttons} == {each.bl_idname for each in moving.CLASSES} - {"viewcam.dolly_camera"}
    icons = bpy.types.UILayout.bl_rna.functions["operator"].parameters["icon"].enum_items
    for _, name, look, _, properties in buttons:
        assert properties.camera == "Camera"
        known = getattr(bpy.ops.viewcam, name.split(".")[1]).get_rna_type().properties
        assert set(vars(properties)) <= set(known.keys()), f"{name} knows not all of {vars(properties)}"
        assert look.get("icon", "NONE") in icons


def test_every_value_has_its_row_and_the_roll_is_the_one_that_counts(posed_camera):
    always = ["name", "eye_target", "eye", "look_at_target", "look_at", "up", "lens_unit", "focal_length"]
    assert list(properties_drawn(panel.VIEWCAM_PT_data)) == [*always, "roll"]
    for unit, name in (("DIAGONAL", "diagonal_fov"), ("PIXELS", "distance")):
        posed_camera.virtual_pinhole.lens_unit = unit
        always[-1] = name
        assert list(properties_drawn(panel.VIEWCAM_PT_data)) == [*always, "roll"]
    assert list(properties_drawn(panel.VIEWCAM_PT_data_options)) == ["zoom", "keeps", "pole"]
    posed_camera.virtual_pinhole.pole = "HOLD"
    assert list(properties_drawn(panel.VIEWCAM_PT_data)) == [*always, "held_roll"]
    assert list(properties_drawn(panel.VIEWCAM_PT_data_options)) == ["zoom", "keeps", "pole", "hold_within"]


def test_before_the_first_sub_panel_there_are_twelve_rows_below_the_camera_s_name(posed_camera):
    """A vector is three rows; what stands in one row with another, or beside a point, is none of its own."""
    fields = properties_drawn(panel.VIEWCAM_PT_sidebar)
    tall = [
        name for name in fields if getattr(type(posed_camera.virtual_pinhole).bl_rna.properties.get(name), "is_array", False)
    ]
    beside = [name for name in fields if name.endswith("_target") or name in ("lens_unit", "name")]
    rows = 3 * len(tall) + len(fields) - len(tall) - len(beside)
    buttons = [
        layout for kind, name, _, layout, _ in drawn(panel.VIEWCAM_PT_sidebar) if kind == "operator" and "camera" in name
    ]
    rows += len({id(layout.above) for layout in buttons}) - 1  # without those beside the name
    assert rows == 12


def test_the_values_of_all_rows_begin_at_one_edge(posed_camera):
    fields = properties_drawn(panel.VIEWCAM_PT_sidebar)
    for name in ("eye", "look_at", "up", "focal_length", "roll"):
        above = fields[name]
        while above.factor is None:
            above = above.above
        assert above.factor == 0.4, name


SHOWN = {
    "MILLIMETERS": "focal_length",
    "HORIZONTAL": "horizontal_fov",
    "VERTICAL": "vertical_fov",
    "DIAGONAL": "diagonal_fov",
    "PIXELS": "distance",
}


def test_nothing_but_a_dot_takes_room_from_the_lens(posed_camera):
    """A sidebar as Blender opens it would cut "39.375 mm" to "39.375 m"."""
    for unit in [item.identifier for item in fields()["lens_unit"].enum_items]:
        posed_camera.virtual_pinhole.lens_unit = unit
        widgets = drawn(panel.VIEWCAM_PT_sidebar, 292)
        name = SHOWN[posed_camera.virtual_pinhole.lens_unit]
        (row,) = (layout for kind, other, _, layout, _ in widgets if (kind, other) == ("prop", name))
        assert [each[:2] for each in widgets if is_within(each[3], row)] == [("prop", name), ("decorator", name)]


def is_within(layout, outer):
    return layout is outer or (layout.above is not None and is_within(layout.above, outer))


BLENDERS = {
    "eye": (bpy.types.Object, "location"),
    "look_at": (bpy.types.Object, "location"),
    "focal_length": (bpy.types.Camera, "lens"),
    "field_of_view": (bpy.types.Camera, "angle"),
    "roll": (bpy.types.Object, "rotation_euler"),
    "held_roll": (bpy.types.Object, "rotation_euler"),
}


def fields():
    return bpy.types.Object.bl_rna.properties["virtual_pinhole"].fixed_type.properties


@pytest.mark.parametrize("name", BLENDERS)
def test_a_field_is_dragged_and_shown_as_blenders_own_of_its_kind(fresh_blender, name):
    """A drag goes by the step, and the digits are the precision: as in the field beside which an artist learned it."""
    owner, blender_name = BLENDERS[name]
    own, blender_name = fields()[name], owner.bl_rna.properties[blender_name]
    assert (own.step, own.precision, own.unit) == (blender_name.step, blender_name.precision, blender_name.unit)


def test_the_lens_in_pixels_is_dragged_about_as_far_as_in_millimeters(fresh_blender):
    """A picture of 1920 pixels lies on a sensor of 36 mm. A pixel of the mouse is a hundredth of the step."""
    sensor = bpy.types.Camera.bl_rna.properties["sensor_width"].default
    pixels, millimeters = fields()["distance"].step, fields()["focal_length"].step
    assert pixels / millimeters == pytest.approx(1920 / sensor, rel=0.1)


def test_no_label_of_the_panel_reads_as_the_subjects_distance(posed_camera):
    """The lens is one, whatever its unit; a distance, to an artist, is that of what he looks at."""
    result = []
    for unit in [item.identifier for item in fields()["lens_unit"].enum_items]:
        posed_camera.virtual_pinhole.lens_unit = unit
        panels = (panel.VIEWCAM_PT_sidebar, panel.VIEWCAM_PT_sidebar_options, panel.VIEWCAM_PT_sidebar_move)
        for kind, name, look, *_ in [row for each in panels for row in drawn(each)]:
            result.append(look.get("text") or name)
            if kind == "prop" and name in fields():
                result += [fields()[name].name, *(item.name for item in getattr(fields()[name], "enum_items", ()))]
    assert {"Lens", "Lens mm", "Lens px", "Resize Keeps", "Lens in Pixels", "Selection"} <= set(result)
    assert "Distance" not in result


def box_is_offered():
    layout = Layout()
    panel.VIEWCAM_PT_sidebar.draw_header(SimpleNamespace(layout=layout), bpy.context)
    ((_, name, _, row, _),) = layout.drawn
    return name == "enabled" and row.is_all("enabled")


def test_the_box_does_not_tick_where_the_camera_is_no_pinhole(posed_camera):
    group = posed_camera.virtual_pinhole
    cases = ("PERSP", False, True), ("ORTHO", False, False), ("PANO", False, False), ("ORTHO", True, True)
    for kind, ticked, offered in cases:
        posed_camera.data.type, group.enabled = "PERSP", ticked
        posed_camera.data.type = kind
        assert box_is_offered() == offered, f"{kind}, ticked: {ticked}"


NARROWEST = 202  # pixels, below which Blender hides the sidebar


@pytest.mark.parametrize("target", ["MESH", "ARMATURE"])
def test_in_the_narrowest_sidebar_no_name_stands_beside_its_field(posed_camera, scene, target):
    """Beside them "270.3 mm" is cut, and "Canonical Axes" and "Resize Keeps", as anything of two fifths of so little."""
    block = bpy.data.objects.new("Target", bpy.data.meshes.new("") if target == "MESH" else bpy.data.armatures.new(""))
    scene.collection.objects.link(block)
    posed_camera.virtual_pinhole.look_at_target = block
    wide, narrow = (drawn(panel.VIEWCAM_PT_sidebar, width) for width in (300, NARROWEST))
    fields = [[each[1] for each in widgets if each[0].startswith("prop")] for widgets in (wide, narrow)]
    assert sorted(fields[0]) == sorted(fields[1]), "a field is missing"
    assert ("label", "Roll") in [each[:2] for each in wide]
    lacking = {"ENUM", "POINTER", "STRING"}  # without room for a name inside
    for before, (kind, name, look, layout, _) in itertools.pairwise(narrow):
        if not kind.startswith("prop") or name == "name":
            continue
        assert not layout.use_property_split, name
        described = type(posed_camera.virtual_pinhole).bl_rna.properties[name]
        if described.type in lacking:
            assert look["text"] == "" and before[0] == "label" and before[1], f"{name} has no name"


def keyed_by_a_dot(each, width):
    """The fields that Blender or the panel draws a dot beside."""
    widgets = drawn(each, width)
    columns = {
        name for kind, name, _, at, _ in widgets if kind == "prop" and at.use_property_split and at.use_property_decorate
    }
    return columns | {name for kind, name, *_ in widgets if kind == "decorator"}


@pytest.mark.parametrize("each", [panel.VIEWCAM_PT_data, panel.VIEWCAM_PT_sidebar])
def test_what_can_be_keyed_has_its_dot_however_narrow_the_panel_is(posed_camera, each):
    for posed_camera.virtual_pinhole.pole in ("CANONICAL", "HOLD"):
        for posed_camera.virtual_pinhole.lens_unit in ("MILLIMETERS", "PIXELS"):
            for part, least in ((each, {"eye", "look_at", "up"}), (panel.VIEWCAM_PT_sidebar_options, {"zoom"})):
                names = {name for kind, name, *_ in drawn(part) if kind == "prop" and name != "name"}
                keyed = {name for name in names if fields()[name].is_animatable}
                assert least <= keyed
                for width in (300, 249, NARROWEST):
                    assert keyed <= keyed_by_a_dot(part, width), f"at {width} pixels"


@pytest.mark.parametrize("each", [panel.VIEWCAM_PT_sidebar_move, panel.VIEWCAM_PT_sidebar_readouts])
def test_in_the_narrowest_sidebar_no_words_stand_beside_others(posed_camera, each):
    for width, is_beside in ((300, True), (NARROWEST, False)):
        rows = [layout for kind, name, look, layout, _ in drawn(each, width) if look.get("text", name) and layout.is_row]
        assert (len(rows) > len(set(map(id, rows)))) == is_beside, f"at {width} pixels"


def test_a_camera_that_is_not_enabled_shows_its_own_values_grayed_and_one_button(posed_camera):
    """Stored values are stale: its own are where it stands."""
    posed_camera.virtual_pinhole.enabled = False
    posed_camera.location, posed_camera.rotation_euler, posed_camera.data.lens = (0, -8, -1e-8), (math.pi / 2, 0, 0), 50
    bpy.context.view_layer.update()
    widgets = drawn(panel.VIEWCAM_PT_sidebar)
    texts = [
        look.get("text", name) for kind, name, look, layout, _ in widgets if kind == "label" and not layout.is_all("active")
    ]
    assert texts[:2] == ["Camera", "0   -8 m   0"], texts
    assert "50 mm" in texts and "0°" in texts and not any(text.startswith("-0") for text in texts)
    offered = {name: look for kind, name, look, layout, _ in widgets if kind == "prop" and layout.is_all("active")}
    assert list(offered) == ["name", "enabled"] and offered["enabled"] == {"text": "Use", "toggle": True}


@pytest.mark.parametrize("eye", [(7, -6, 5), (0, -8, 2)], ids=["where it was", "moved since"])
def test_a_camera_that_was_in_use_shows_the_look_at_point_that_use_and_copy_state(posed_camera, scene, eye):
    group = posed_camera.virtual_pinhole
    group.enabled = False
    posed_camera.location = eye
    bpy.context.view_layer.update()
    texts = dict(panel.standing(posed_camera, scene))["Look At"]
    copied = clipboard.camera_of(posed_camera, scene).pinhole.look_at
    group.enabled = True
    look_at = group.numbers()[1]
    assert math.dist(eye, look_at) == pytest.approx(math.dist((7, -6, 5), (0, 0, 1)))
    assert copied == pytest.approx(look_at, abs=1e-5)
    assert texts == tuple(datablocks.length(number, scene, digits=4) for number in readouts.rounded(look_at))


@pytest.mark.parametrize("width", [NARROWEST, 253, 300, 600])
def test_no_number_of_a_camera_that_is_not_enabled_is_cut_off(posed_camera, width):
    """Numbers that do not fit beside one another stand one below the other. A window of 1280 pixels has a panel of 253."""
    posed_camera.virtual_pinhole.enabled = False
    posed_camera.location = (-123.456, 2666.66, -0.0123)
    bpy.context.view_layer.update()
    texts = {look.get("text", name) for kind, name, look, *_ in drawn(panel.VIEWCAM_PT_sidebar, width) if kind == "label"}
    for _, numbers in panel.standing(posed_camera, bpy.context.scene):
        line = "   ".join(numbers)
        if line not in texts:
            assert set(numbers) <= texts, f"of {line} there is {texts}"
        elif len(numbers) > 1:
            assert readouts.fits(line, width - 60), line


def test_a_camera_that_is_no_pinhole_is_not_offered_to_be_used(posed_camera, empty):
    posed_camera.virtual_pinhole.enabled = False
    posed_camera.rotation_euler = (1.0, 0.2, 0.3)
    for scale, offered in (((1, 1, 1), True), ((1, 2, 1), False)):
        posed_camera.parent = empty("Stretched", scale=scale)
        bpy.context.view_layer.update()
        assert properties_drawn(panel.VIEWCAM_PT_sidebar)["enabled"].is_all("enabled") == offered, scale
        assert box_is_offered() == offered, f"the box in the header, {scale}"


def test_what_a_constraint_or_a_driver_places_is_read_only_with_a_word_why(posed_camera, empty):
    def locked():
        bpy.context.view_layer.update()
        widgets = properties_drawn(panel.VIEWCAM_PT_data) | properties_drawn(panel.VIEWCAM_PT_data_options)
        return [name for name, layout in widgets.items() if not layout.is_all("enabled")]

    def words():
        widgets = drawn(panel.VIEWCAM_PT_data)
        return [look.get("text", name) for kind, name, look, *_ in widgets if kind == "label" and look.get("icon") == "LOCKED"]

    constraint = posed_camera.constraints.new("TRACK_TO")
    assert locked() == [], "a constraint without a target places nothing"
    constraint.target = empty("Target", (5, 5, 5))
    assert locked() == ["look_at", "up", "roll"] and words() == ["Constraint"]
    posed_camera.data.driver_add("lens").driver.expression = "20.0 + 1.0"
    assert locked() == ["look_at", "up", "lens_unit", "focal_length", "roll", "zoom"] and words() == ["Constraint", "Driver"]
    posed_camera.constraints.clear()
    posed_camera.parent = parent = empty("Dolly")
    assert locked() == ["lens_unit", "focal_length", "zoom"], "a parent that stands still lets its camera be set"
    parent.keyframe_insert("location", frame=1)
    assert words() == ["Parent", "Parent", "Driver"]


def test_what_is_linked_can_not_be_set_by_buttons(posed_camera, link_camera):
    linked = link_camera()
    bpy.context.scene.camera = linked
    panels = panel.VIEWCAM_PT_data_options, panel.VIEWCAM_PT_data, panel.VIEWCAM_PT_data_move
    buttons = {name: layout for each in panels for kind, name, _, layout, _ in drawn(each) if kind == "operator"}
    live = {name for name, layout in buttons.items() if layout.is_all("enabled")}
    assert live == {"viewcam.copy_camera", "viewcam.step_camera", "viewcam.add_camera"}
    assert {"viewcam.apply_camera", "viewcam.adopt_camera", "viewcam.bake_camera", "viewcam.paste_camera"} < set(buttons)


def test_of_an_override_it_is_said_why_lens_and_roll_are_gray(posed_camera, link_camera):
    override = link_camera().override_create(remap_local_usages=True)
    bpy.context.scene.camera = override

    def words():
        widgets = drawn(panel.VIEWCAM_PT_data)
        return [look.get("text", name) for kind, name, look, *_ in widgets if kind == "label" and look.get("icon") == "LOCKED"]

    assert words() == ["Override: edit in px", "Override: edit Up"]
    override.virtual_pinhole.lens_unit = "PIXELS"
    assert words() == ["Override: edit Up"]


def test_a_point_that_follows_a_target_can_not_be_edited(posed_camera, empty):
    posed_camera.virtual_pinhole.look_at_target = empty("Target")
    locked = [name for name, layout in properties_drawn(panel.VIEWCAM_PT_data).items() if not layout.is_all("enabled")]
    assert locked == ["look_at"]


@pytest.mark.parametrize(("kind", "field"), [("MESH", "look_at_group"), ("ARMATURE", "look_at_bone"), ("EMPTY", None)])
def test_a_target_s_vertex_group_or_bone_is_chosen_below_it(posed_camera, scene, kind, field):
    data = {"MESH": bpy.data.meshes, "ARMATURE": bpy.data.armatures}
    target = bpy.data.objects.new("Target", data[kind].new("Target") if kind in data else None)
    scene.collection.objects.link(target)
    posed_camera.virtual_pinhole.look_at_target = target
    searched = [(name, look["source"]) for what, name, look, *_ in drawn(panel.VIEWCAM_PT_data) if what == "prop_search"]
    assert searched == ([(field, {"look_at_group": "vertex_groups", "look_at_bone": "bones"}[field])] if field else [])


def test_apply_again_is_not_offered_where_it_mends_nothing(posed_camera, scene):
    def is_marked():
        bpy.context.view_layer.update()
        return "viewcam.apply_camera" in [name for _, name, *_ in drawn(panel.VIEWCAM_PT_data)]

    assert not is_marked()
    for block, name, value in (
        (posed_camera, "location", (1, 2, 3)),
        (posed_camera, "rotation_euler", (1, 2, 3)),
        (posed_camera.data, "lens", 50),
    ):
        setattr(block, name, value)
        assert not is_marked(), f"{name} moves the values"
    posed_camera.constraints.new("LIMIT_LOCATION").use_min_z = True
    posed_camera.constraints[0].min_z = 9
    assert not is_marked(), "the values follow a constraint as well"
    assert panel.notices(posed_camera, scene) == [] and posed_camera.virtual_pinhole.eye[2] == 9


def test_a_notice_is_drawn_in_lines_that_fit_and_with_its_remedy_below(posed_camera):
    posed_camera.virtual_pinhole.eye = (0, 0, 5)
    widgets = drawn(panel.VIEWCAM_PT_sidebar, 200)
    lines = [(name, look["icon"]) for kind, name, look, *_ in widgets if kind == "label" and "icon" in look]
    assert " ".join(line for line, _ in lines).startswith("The view is parallel to up")
    assert [icon for _, icon in lines] == ["ERROR"] + ["BLANK1"] * (len(lines) - 1) and len(lines) > 2
    (remedy,) = (each for each in widgets if each[:2] == ("operator", "viewcam.choose_up"))
    assert remedy[4].camera == "Camera" and widgets.index(remedy) < [each[1] for each in widgets].index("eye"), (
        "it is at the top"
    )


def test_each_read_out_has_a_button_that_copies_it(posed_camera):
    widgets = drawn(panel.VIEWCAM_PT_data_readouts)
    buttons = [properties for kind, _, _, _, properties in widgets if kind == "operator"]
    assert [button.label for button in buttons] == [row.label for row in panel.readouts_of(posed_camera, bpy.context.scene)]
    assert buttons[-1].label == "To Look-At" and float(buttons[-1].text) == pytest.approx(10.0499, abs=1e-4)


def test_the_tooltip_of_a_copy_button_shows_what_is_copied():
    button = SimpleNamespace(label="u", text="(1.0, 0.0, 0.0)")
    described = clipboard.VIEWCAM_OT_copy_readout.description(bpy.context, button)
    assert described == f"{clipboard.VIEWCAM_OT_copy_readout.bl_description}: (1.0, 0.0, 0.0)"
    assert bpy.ops.viewcam.copy_readout(label="u", text="(1.0, 0.0, 0.0)") == {"FINISHED"}


def test_drawing_states_the_camera_once_and_reads_it_once_for_the_read_outs(posed_camera, monkeypatch):
    """With 10,000 frames of a held roll, stating it costs 30 ms."""
    calls = []
    for name in ("stated", "read"):
        real = getattr(cameras, name)
        monkeypatch.setattr(cameras, name, lambda *arguments, name=name, real=real: calls.append(name) or real(*arguments))
    drawn(panel.VIEWCAM_PT_data)
    assert sorted(calls) == ["read", "stated"]
    calls.clear()
    drawn(panel.VIEWCAM_PT_data_readouts)
    assert calls == ["read"]


def test_drawing_looks_at_no_other_camera(posed_camera, add_camera, monkeypatch):
    bpy.context.view_layer.objects.active = posed_camera
    for i in range(20):
        add_camera(f"Other {i}").virtual_pinhole.enabled = True
    bpy.context.view_layer.update()
    looked_at = set()
    for name in ("stated", "read"):
        real = getattr(cameras, name)
        monkeypatch.setattr(
            cameras, name, lambda block, *arguments, real=real: looked_at.add(block.name) or real(block, *arguments)
        )
    for each in (panel.VIEWCAM_PT_data, panel.VIEWCAM_PT_data_readouts):
        drawn(each)
    assert looked_at == {"Camera"}


GERMAN = {
    "Use Up {up}": "Oben wird {up}",
    "The view is parallel to up, and the roll is undefined: the axes are the canonical ones": "Senkrecht",
}


def test_what_is_made_of_pieces_is_translated_before_the_pieces_go_in(posed_camera, monkeypatch):
    posed_camera.virtual_pinhole.eye = (0, 0, 5)
    monkeypatch.setattr(panel, "iface", lambda text: GERMAN.get(text, text))
    widgets = drawn(panel.VIEWCAM_PT_data)
    assert {"text": "Oben wird (1, 0, 0)", "translate": False} in [each[2] for each in widgets]
    assert ("label", "Senkrecht", {"icon": "ERROR", "translate": False}) in [each[:3] for each in widgets]


def test_numbers_are_never_translated(posed_camera):
    rows = {text for row in panel.readouts_of(posed_camera, bpy.context.scene) for text in row.texts}
    widgets = drawn(panel.VIEWCAM_PT_data_readouts)
    untranslated = {name for kind, name, look, *_ in widgets if kind == "label" and look.get("translate") is False}
    assert untranslated == rows


def test_every_property_and_operator_has_a_tooltip_without_the_dot_that_blender_adds():
    properties = bpy.types.Object.bl_rna.properties["virtual_pinhole"].fixed_type.properties
    described = [each for each in properties if not each.is_hidden and each.identifier not in ("rna_type", "name")]
    described += [getattr(bpy.ops.viewcam, name).get_rna_type() for name in dir(bpy.ops.viewcam)]
    for each in described:
        text = each.description
        assert len(text) > 20 and text[0].isupper() and not text.endswith("."), f"{each.identifier}: {text!r}"


BRITISH = re.compile(
    r"(colour|centre|grey|metre|ise\b|ising|isation|modell|labell|cancell|travell|favour|behaviour)", re.IGNORECASE
)
AMERICAN_TOO = ("raise", "otherwise", "precise", "noise", "exercise", "advise", "promise")


def test_everything_that_blender_shows_is_spelled_as_blender_spells():
    """Labels and tooltips of all operators, panels and properties, and those of what may be chosen."""
    result = {}
    for name in dir(bpy.types):
        kind = getattr(bpy.types, name, None)
        if not getattr(kind, "__module__", "").startswith("viewcam_addon"):
            continue
        texts = [getattr(kind, key, "") for key in ("bl_label", "bl_description")]
        for each in kind.bl_rna.properties:
            texts += [each.name, each.description]
            texts += [text for item in getattr(each, "enum_items", ()) for text in (item.name, item.description)]
        words = {word for text in texts for word in re.findall(r"[^\W_]+", text or "") if BRITISH.search(word)}
        result |= {name: wrong} if (wrong := {word for word in words if word.lower() not in AMERICAN_TOO}) else {}
    assert result == {}


def test_a_british_word_would_be_found():
    assert all(BRITISH.search(word) for word in ("Colours", "modelled", "millimetres", "Normalise", "cancelled"))


# --- The sub-panel Labels: what it says it will write is what is written, beside Blender, and nothing of it is in the file


# In place of the batch: it keeps what it was to do, and writes the last of a label's files.
STAND_IN = """
import json, pathlib, sys
written = json.loads(pathlib.Path(sys.argv[1]).read_text())
(shot,), folder = written["jobs"], pathlib.Path(written["plan"]["out"])
(folder / (shot["name"] + ".labels.json")).write_text(json.dumps([shot, written["plan"]["outputs"]]))
"""


@pytest.fixture
def settings(fresh_blender, tmp_path):
    group = bpy.context.window_manager.virtual_pinhole_labels
    group.folder = str(tmp_path / "out")
    yield group
    labels.background.end()
    for name in ("kinds", "depth_steps", "folder"):
        group.property_unset(name)


@pytest.fixture
def camera(add_camera, scene):
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 64, 48, 100
    scene.frame_current = 3
    return add_camera("Hero: close")


@pytest.fixture
def stand_in(monkeypatch):
    def command(_copy, _scene, written):
        return [sys.executable, "-c", STAND_IN, str(written)]

    monkeypatch.setattr(comparing, "command", command)


def test_each_label_can_be_chosen_and_none_is_unknown():
    assert tuple(name.lower() for name, *_ in labels._KINDS) == KINDS


def test_a_click_starts_a_batch_of_this_frame_with_labels_alone(settings, camera, stand_in, scene):
    settings.kinds, settings.depth_steps = {"FLOW", "DEPTH"}, 250
    bpy.data.objects["Hero: close"].select_set(True)
    assert bpy.ops.viewcam.write_labels(camera="Hero: close") == {"FINISHED"}
    folder, sentence = labels.background.latest
    assert folder.parent == Path(settings.folder) and sentence == f"Written to {folder}"
    assert folder.name.startswith("untitled Hero_ close 0003 labels 2")
    shot, outputs = json.loads((folder / "Hero_ close.labels.json").read_text())
    if not bpy.app.binary_path:  # else Blender is given the file, which is the job's then
        assert Path(shot.pop("blend")).name == "untitled.blend"
    assert shot == {"name": "Hero_ close", "camera": "Hero: close", "width": 64, "height": 48, "frame": 3}
    wanted = {"picture": False, "check": False, "labels": ["depth", "flow"], "depth_steps": 250.0, "report": False}
    assert outputs == wanted


def test_a_child_that_dies_leaves_no_folder_and_its_last_words_are_said(settings, camera, monkeypatch, tmp_path):
    monkeypatch.setattr(comparing, "command", lambda *_: [sys.executable, "-c", "print('out of memory'); raise SystemExit(9)"])
    with pytest.raises(RuntimeError, match="out of memory"):
        bpy.ops.viewcam.write_labels()
    folder, sentence = labels.background.latest
    assert folder is None and "out of memory" in sentence and list(Path(settings.folder).iterdir()) == []


def test_a_shot_that_fails_is_said_in_its_own_words(settings, camera, monkeypatch):
    summary = '{"shots": [{"name": "Hero", "error": "the disk is full"}]}'
    fails = "import json, pathlib, sys; out = json.loads(pathlib.Path(sys.argv[1]).read_text())['plan']['out'];"
    fails += "pathlib.Path(out, 'summary.json').write_text(sys.argv[2]); sys.exit(4)"
    monkeypatch.setattr(comparing, "command", lambda *arguments: [sys.executable, "-c", fails, str(arguments[2]), summary])
    with pytest.raises(RuntimeError, match="The disk is full"):
        bpy.ops.viewcam.write_labels()


def test_while_labels_are_written_there_is_cancel_and_no_second_start(settings, camera, monkeypatch, scene):
    monkeypatch.setattr(comparing, "command", lambda *_: [sys.executable, "-c", "import time; time.sleep(600)"])
    labels.background.running = writing = labels.Writing(camera, scene, settings)
    assert writing.poll() is None and not bpy.ops.viewcam.write_labels.poll()
    assert bpy.ops.viewcam.cancel_labels() == {"FINISHED"}
    assert not bpy.ops.viewcam.cancel_labels.poll() and not writing.folder.exists()
    assert writing._process.status() is not None


@pytest.mark.parametrize(
    ("kinds", "folder", "sentence"),
    [(set(), "out", "No label is chosen"), ({"DEPTH"}, "", "There is no folder for the labels, and the file is not saved")],
)
def test_what_can_not_be_begun_is_one_sentence(settings, camera, kinds, folder, sentence):
    settings.kinds, settings.folder = kinds, folder
    with pytest.raises(RuntimeError, match=sentence):
        bpy.ops.viewcam.write_labels()


def test_nothing_is_left_of_it_without_the_add_on(registered_addon):
    registered_addon.unregister()
    try:
        assert not hasattr(bpy.types.WindowManager, "virtual_pinhole_labels")
        assert labels.background.on_load not in bpy.app.handlers.load_pre
    finally:
        registered_addon.register()


@pytest.mark.exhaustive
def test_the_files_that_the_panel_shows_are_those_that_are_written(settings, monkey):
    settings.kinds = {kind.upper() for kind in KINDS}
    file_names = labels.file_names(bpy.context.scene.camera, settings.chosen())
    assert bpy.ops.viewcam.write_labels() == {"FINISHED"}
    folder, _ = labels.background.latest
    of_the_batch = {"summary.json", "contact-sheet.html"}
    assert {path.name for path in folder.glob("[!.]*")} - of_the_batch == set(file_names)
    document = label_files.read(folder / file_names[-1])
    assert "Suzanne" in {each["name"] for each in document["instances"]} and document["lost"] == {"forward": [], "backward": []}


# --- The render engine's panels, and those of Blender that it takes over: all gone with the add-on


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
def test_panels_of_what_is_not_modeled_or_is_shown_by_ours_are_not(name):
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
    pass_names = {name for names in (render_panels.GEOMETRY_PASSES, render_panels.LIGHT_PASSES) for name in names}
    assert set(SETTINGS) <= pass_names


# --- Operators


def test_apply_leaves_a_camera_where_its_values_are(posed_camera):
    assert bpy.ops.viewcam.apply_camera() == {"FINISHED"}
    assert tuple(posed_camera.location) == (7, -6, 5)


def test_adopt_takes_the_values_of_a_moved_camera(posed_camera):
    posed_camera.location = (1, 1, 1)
    bpy.context.view_layer.update()
    assert bpy.ops.viewcam.adopt_camera() == {"FINISHED"}
    assert tuple(posed_camera.virtual_pinhole.eye) == (1, 1, 1)
    assert tuple(posed_camera.location) == (1, 1, 1)


def test_another_up_keeps_the_picture_and_makes_its_roll_certain(posed_camera, scene):
    group = posed_camera.virtual_pinhole
    group.eye, group.look_at, group.up = (0.5, 0.25, 5), (0.5, 0.25, 0), (0, 0, 1)
    before, precision = cameras.stated(posed_camera, scene), 2.0**-24
    assert "roll" in readouts.roll_warning(before, precision)
    assert bpy.ops.viewcam.choose_up() == {"FINISHED"}
    after = cameras.stated(posed_camera, scene)
    assert after.up == (1, 0, 0) and after.basis()[0] == pytest.approx(before.basis()[0], abs=1e-15)
    assert readouts.roll_warning(after, precision) is None


def test_adopt_enables_a_camera(camera_object):
    bpy.ops.viewcam.adopt_camera()
    assert camera_object.virtual_pinhole.enabled


def test_a_camera_can_be_named(posed_camera, add_camera):
    other = add_camera("Other")
    posed_camera.virtual_pinhole.enabled = False
    bpy.ops.viewcam.adopt_camera(camera="Camera")
    assert posed_camera.virtual_pinhole.enabled and not other.virtual_pinhole.enabled


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: bpy.ops.viewcam.apply_camera(camera="Nobody"), "There is no camera 'Nobody'"),
        (lambda: bpy.ops.viewcam.apply_camera(), "is not enabled"),
        (lambda: bpy.ops.viewcam.choose_up(), "is not enabled"),
        (lambda: bpy.ops.viewcam.adopt_camera(camera="Lamp"), "'Lamp' is no camera"),
    ],
)
def test_errors_are_reported_in_one_sentence(camera_object, scene, call, message):
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    scene.collection.objects.link(lamp)
    with pytest.raises(RuntimeError, match=message) as error:
        call()
    assert "Traceback" not in str(error.value)


def test_without_a_camera_the_buttons_are_off(fresh_blender):
    assert not bpy.ops.viewcam.apply_camera.poll()
    assert not bpy.ops.viewcam.adopt_camera.poll()


def test_they_work_in_edit_mode_of_another_object(posed_camera, scene):
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.object.mode_set(mode="EDIT")
    posed_camera.virtual_pinhole.enabled = False
    bpy.ops.viewcam.adopt_camera(camera="Camera")
    assert posed_camera.virtual_pinhole.enabled


def test_applying_reports_what_did_not_stick(posed_camera, scene, capfd):
    posed_camera.virtual_pinhole.keyframe_insert("eye", frame=1)
    posed_camera.driver_add("location", 0).driver.expression = "1.0 + 1.0"
    bpy.ops.viewcam.apply_camera()
    assert cameras.check(posed_camera, cameras.stated(posed_camera, scene), scene)[0].sentence in capfd.readouterr().out


# --- View menu


def test_every_button_of_a_camera_stands_in_the_menu_which_the_search_reads(registered_addon):
    entries, drags, menus = [], [], []

    def operator(name, text=""):
        entries.append(name)
        drags.extend([text] if text else [])
        return SimpleNamespace()

    layout = SimpleNamespace(operator=operator, menu=menus.append, separator=lambda: None)
    panel.VIEWCAM_MT_cameras.draw(SimpleNamespace(layout=layout), bpy.context)
    classes = (*moving.CLASSES, *operators.CLASSES, *baking.CLASSES, *clipboard.IN_MENUS, *scene_cameras.OPERATORS)
    classes += (*photo_matching.OPERATORS, *swipe.CLASSES)
    assert set(entries) == {each.bl_idname for each in classes} and menus == ["VIEWCAM_MT_copy_camera_as"]
    assert "viewcam.copy_readout" not in entries, "without a text of its own, as from a menu, it would empty the clipboard"
    assert drags == ["Drag: Orbit", "Drag: Dolly", "Drag: Dolly Zoom", "Drag: Truck"]
    assert all(getattr(bpy.ops.viewcam, entry.split(".")[1]).get_rna_type() for entry in entries)


def test_the_menu_stands_under_view_cameras(registered_addon):
    menus = []
    layout = SimpleNamespace(menu=menus.append, separator=lambda: None)
    panel._draw_menu(SimpleNamespace(layout=layout), bpy.context)
    assert menus == ["VIEWCAM_MT_cameras"] and hasattr(bpy.types, menus[0])
    assert panel._draw_menu in bpy.types.VIEW3D_MT_view_cameras._dyn_ui_initialize()


def test_the_menu_goes_with_the_add_on(registered_addon):
    functions = bpy.types.VIEW3D_MT_view_cameras._dyn_ui_initialize
    count = len(functions())
    viewcam_addon.unregister()
    try:
        assert len(functions()) == count - 1 and not hasattr(bpy.types, "VIEWCAM_MT_cameras")
    finally:
        viewcam_addon.register()
    assert len(functions()) == count


LENSES = [24, 35, 50, 85]

# The frames of the canonical axes as DESIGN's text has them, u, v, w; along the third axis as everywhere else.
FRAMES = {
    "Y Up, Along -Z": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "Y Up, Looking Down": ((0, 0, 1), (1, 0, 0), (0, 1, 0)),
    "Y Up, Looking Up": ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
    "Z Up, Along Y": ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
    "Z Up, Looking Down": ((0, -1, 0), (1, 0, 0), (0, 0, 1)),
    "Z Up, Looking Up": ((1, 0, 0), (0, -1, 0), (0, 0, -1)),
}


@pytest.fixture
def own_presets(tmp_path, monkeypatch):
    """The folder that presets are saved in and looked for."""
    folder = tmp_path / "presets" / presets.FOLDER
    folder.mkdir(parents=True)
    monkeypatch.setattr(bpy.utils, "user_resource", lambda *_arguments, **_options: str(folder))
    monkeypatch.setattr(bpy.utils, "preset_paths", lambda _subdir: [str(folder)])
    return folder


def execute(name):
    return bpy.ops.viewcam.execute_preset(shipped=name)


def values(camera_object):
    return camera_object.virtual_pinhole.numbers()


def test_those_that_come_along_are_the_texts_views_and_four_lenses():
    assert presets.SHIPPED.keys() == {f"Lens {lens} mm" for lens in LENSES} | FRAMES.keys()


def listed():
    """The texts that the list shows."""

    class Shown:
        layout = MagicMock()
        path_menu = presets.VIEWCAM_PT_presets.path_menu

    presets.VIEWCAM_PT_presets.draw(Shown(), bpy.context)
    return [call.kwargs["text"] for call in Shown.layout.mock_calls if call.kwargs.get("text")]


def test_the_list_shows_those_that_come_along_then_ones_own_and_misses_no_folder(posed_camera, own_presets, monkeypatch):
    assert listed() == [*presets.SHIPPED]
    bpy.ops.viewcam.add_preset(name="Mine")
    assert listed() == [*presets.SHIPPED, "Mine"]
    monkeypatch.setattr(bpy.utils, "preset_paths", lambda _subdir: [])
    assert listed() == [*presets.SHIPPED]


@pytest.mark.parametrize("name", FRAMES)
def test_a_view_is_the_texts_own_to_the_last_bit_and_leaves_the_lens(posed_camera, scene, name):
    execute(name)
    stated = cameras.stated(posed_camera, scene)
    assert np.array_equal(stated.basis(), FRAMES[name]), f"u, v, w are {stated.basis()}"
    assert np.linalg.norm(stated.eye) == 10 and stated.look_at == (0, 0, 0) and stated.distance[0] == 1500
    assert np.abs(np.subtract(cameras.read(posed_camera, scene).basis(), FRAMES[name])).max() < 1e-6


@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.parametrize("size", [(1920, 1080), (1080, 1920), (333, 333)])
def test_a_lens_has_its_angle_in_any_picture_and_leaves_the_view(posed_camera, scene, lens, size):
    scene.render.resolution_x, scene.render.resolution_y = size
    before = values(posed_camera)[:3]
    execute(f"Lens {lens} mm")
    assert values(posed_camera)[:3] == before
    # An angle in degrees, its half in radians and its tangent: each is rounded once, and the tangent takes on their errors.
    assert values(posed_camera)[3] == pytest.approx(max(size) * lens / 36, rel=8 * 2.0**-53)
    data = posed_camera.data
    assert (data.lens, data.sensor_width) == (pytest.approx(lens, rel=2.0**-23), 36)


@pytest.mark.parametrize("name", [name for name in FRAMES if "Looking" in name])
def test_no_preset_warns_of_itself(posed_camera, scene, name):
    execute(name)
    assert panel.notices(posed_camera, scene) == []


def test_a_preset_enables_a_camera_that_was_set_otherwise(camera_object, scene):
    camera_object.location = (1, 2, 3)
    execute("Lens 50 mm")
    assert camera_object.virtual_pinhole.enabled and values(camera_object)[0] == (1, 2, 3)


def test_what_is_saved_comes_back_in_float64(posed_camera, own_presets, scene, add_camera):
    exact = ((1 / 3, -math.e, 0.1), (0.7, math.pi, 1e-7), (0.1, 0.2, 0.97), 1234.56789012345)
    cameras.apply(posed_camera, Pinhole(*exact, 1920, 1080), scene)
    assert bpy.ops.viewcam.add_preset(name="My View: 1/3") == {"FINISHED"}
    (saved,) = own_presets.glob("*.py")
    other = add_camera("Other")
    bpy.context.view_layer.objects.active = other
    bpy.ops.viewcam.execute_preset(filepath=str(saved))
    assert values(other) == exact


def test_an_own_preset_can_be_removed(posed_camera, own_presets):
    bpy.ops.viewcam.add_preset(name="Mine")
    assert bpy.ops.viewcam.add_preset(name="Mine", remove_name=True) == {"FINISHED"}
    assert list(own_presets.iterdir()) == []


def test_errors_are_one_sentence_and_leave_no_file(camera_object, own_presets, scene, tmp_path):
    camera_object.data.type = "ORTHO"
    with pytest.raises(RuntimeError, match="is orthographic, no pinhole") as error:
        bpy.ops.viewcam.add_preset(name="Mine")
    assert "Traceback" not in str(error.value) and list(own_presets.iterdir()) == []
    with pytest.raises(RuntimeError, match="is orthographic, no pinhole") as error:
        execute("Lens 35 mm")
    assert "Traceback" not in str(error.value)
    bpy.data.objects.remove(camera_object)
    with pytest.raises(RuntimeError, match="There is no camera"):
        bpy.ops.viewcam.add_preset(name="Mine")


@pytest.mark.parametrize(
    ("text", "reason"), [(None, "No such file or directory"), ("1 +", "invalid syntax"), ("bpy = 1 / 0", "division by zero")]
)
def test_a_preset_that_is_no_program_is_named_in_a_sentence(posed_camera, tmp_path, text, reason):
    path = tmp_path / "mine.py"
    if text is not None:
        path.write_text(text, encoding="utf-8")
    with pytest.raises(RuntimeError, match=rf"The preset 'mine.py' can't be run \({reason}.*\): remove it") as error:
        bpy.ops.viewcam.execute_preset(filepath=str(path))
    assert "Traceback" not in str(error.value)


LEVEL = Pinhole((0, -5, 0), (0, 0, 0), (0, 0, 1), 50.0, 100, 60)


def test_readouts_are_the_camera_in_words():
    readings = readouts.readouts(LEVEL, 18.0, 50.0, ("5 m", 5.0))
    rows = {row.label: " ".join(row.texts) for row in readings}
    assert rows["Focal Length"] == "18 mm"
    assert rows["Horizontal FOV"] == "90.0000°"
    assert rows["Vertical FOV"] == f"{2 * math.degrees(math.atan(30 / 50)):.4f}°"
    assert rows["Diagonal FOV"] == f"{2 * math.degrees(math.atan(math.hypot(50, 30) / 50)):.4f}°"
    assert rows["u"] == "+1.00000 +0.00000 +0.00000"
    assert rows["v"] == "+0.00000 +0.00000 +1.00000"
    assert rows["w"] == "+0.00000 -1.00000 +0.00000"
    assert rows["View Plane"] == "50 px"
    assert rows["To Look-At"] == "5 m"


def test_what_is_copied_has_all_its_digits():
    camera = replace(LEVEL, eye=(1 / 3, -5, 0.1))
    for row in readouts.readouts(camera, 18.1, 1 / 3, ("5 m", math.pi)):
        numbers = eval(row.exact, {})
        if row.label in "uvw":
            np.testing.assert_array_equal(numbers, camera.axes()["uvw".index(row.label)])
        else:
            names = ("Horizontal FOV", "Vertical FOV", "Diagonal FOV")
            angles = dict(zip(names, map(math.degrees, camera.field_of_view()), strict=True))
            lengths = {"Focal Length": 18.1, "View Plane": 1 / 3, "To Look-At": math.pi}
            assert numbers == (angles | lengths)[row.label]


def test_a_camera_without_stated_values_has_no_distance_to_a_look_at_point():
    assert "To Look-At" not in [row.label for row in readouts.readouts(LEVEL, 18.0, 50.0, None)]


def above(angle):
    """Looks down within `angle` of an up that has no zeros, so that every number of the pose is rounded."""
    up = np.array((0.48, 0.6, 0.64))
    across = np.cross(up, (1, 0, 0))
    eye = tuple(up + math.tan(angle) * across / np.linalg.norm(across))
    return Pinhole(eye, (0, 0, 0), tuple(up), 1000.0, 1920, 1080)


def warnings_of(camera, precision):
    return [sentence for sentence in (readouts.roll_warning(camera, precision), readouts.distance_warning(camera)) if sentence]


def test_a_singular_pose_is_said_to_be_so():
    (warning,) = warnings_of(Pinhole((0, 0, 5), (0, 0, 0), (0, 0, 1), 50.0, 100, 60), 2.0**-24)
    assert "parallel to up" in warning


def test_the_roll_is_called_uncertain_where_a_corner_moves_a_tenth_of_a_pixel_and_not_before():
    corner = math.hypot(960, 540)
    for angle in (3e-2, 1e-2, 3e-3, 1e-3, 3e-4):
        camera = above(angle)
        moved = camera.roll_uncertainty() * corner
        assert bool(warnings_of(camera, 2.0**-24)) == (moved > 0.1), f"{angle:g} rad: {moved:.2g} px"
    assert warnings_of(above(3e-2), 2.0**-24) == []
    assert warnings_of(above(3e-4), 2.0**-24)


def test_the_roll_warning_tells_the_angle_and_the_roll():
    angle = math.radians(0.001)
    (sentence,) = warnings_of(above(angle), 2.0**-24)
    roll = math.degrees(above(angle).roll_uncertainty())
    assert sentence == f"The view is within 0.001° of up: the roll is uncertain by {float(f'{roll:.0e}'):g}°"
    assert "any roll is possible" in warnings_of(above(1e-8), 2.0**-24)[0]


def test_values_known_in_float64_leave_the_roll_certain():
    assert warnings_of(above(1e-5), precision=2.0**-53) == []


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 0.1])
def test_the_proposed_up_gives_the_same_picture_and_is_certain(angle):
    camera = above(angle) if angle else Pinhole((0.48, 0.6, 0.64), (0, 0, 0), (0.48, 0.6, 0.64), 1000.0, 1920, 1080)
    proposed = replace(camera, up=readouts.certain_up(camera))
    assert proposed.sine_to_up == pytest.approx(1, abs=1e-12)
    assert np.abs(np.stack(proposed.basis()) - np.stack(camera.basis())).max() < 1e-15
    assert not any("roll" in sentence for sentence in warnings_of(proposed, 2.0**-24))


def test_a_coordinate_axis_is_proposed_where_it_is_one():
    assert readouts.certain_up(Pinhole((0, 0, 5), (0, 0, 0), (0, 0, 1), 50.0, 100, 60)) == (1, 0, 0)
    assert readouts.certain_up(Pinhole((0, 1e-7, 5), (0, 0, 0), (0, 0, 1), 50.0, 100, 60)) == (0, -1, 0)


def test_far_from_the_origin_the_rounding_is_told_in_pixels():
    def warnings(far):
        return warnings_of(Pinhole((far, 0, 0), (far, 10, 0), (0, 0, 1), 1000.0, 1920, 1080), 2.0**-24)

    assert warnings(1e4) == []  # 2⁻²⁴ · 1000 px · 1e4 / 10 = 0.06 px
    assert "may be 0.2 px off" in warnings(4e4)[-1]
    assert "may be 40 px off" in warnings(6.4e6)[-1]


def test_long_sentences_are_wrapped_to_the_width_of_the_region():
    lines = readouts.wrapped("one two three four five six seven eight nine ten", 150)
    assert len(lines) > 1
    assert max(map(len, lines)) <= 22
