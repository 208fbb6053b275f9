"""The values that files hold.

`saved/values.blend` was saved with Blender 4.2 by the last version without CameraValues; `saved/values.json` is what that read.
"""

import json
import math
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import datablocks, preferences, storage
from viewcam_addon.camera_values import CameraValues

SAVED = Path(__file__).parent / "saved"
READ_BY_THE_OLD_VERSION = json.loads((SAVED / "values.json").read_text(encoding="utf-8"))


def digits(camera_object):
    """The numbers that the values ask for, to the bit."""
    stated = cameras.stated(camera_object, bpy.context.scene)
    if stated is None:
        return None
    return [number.hex() for number in (*stated.eye, *stated.look_at, *stated.up, *stated.distance)]


@pytest.mark.parametrize("name", READ_BY_THE_OLD_VERSION)
def test_a_file_of_an_older_version_opens_with_the_same_values_to_the_bit(fresh_blender, name):
    fresh_blender.ops.wm.open_mainfile(filepath=str(SAVED / "values.blend"))
    camera_object = fresh_blender.data.objects[name]
    group, expected = camera_object.virtual_pinhole, READ_BY_THE_OLD_VERSION[name]
    assert digits(camera_object) == expected["stated"]
    assert group.precision() == expected["precision"]
    assert camera_object.data.lens.hex() == expected["lens"]
    group.zoom = 1.5
    assert digits(camera_object) == expected["edited"]
    assert camera_object.data.lens.hex() == expected["edited_lens"]
    assert (float(group.roll).hex(), group.held_roll.hex()) == (expected["roll"], expected["held_roll"])


def test_what_is_stored_is_loaded_again_to_the_bit(camera_object, scene):
    frame = cameras.datablocks.frame_of(scene)
    values = CameraValues(
        eye=(0.1, 1e-9, 1 / 3),
        look_at=(-0.1, 2 / 7, -1e20),
        up=(1e-30, 0.0, 0.7),
        distance=1234.56789,
        zoom=0.5,
        keeps="FIELD_OF_VIEW",
        counted_in=frame,
        set_for=frame,
        pole="HOLD",
        hold_within=0.25,
        held_roll=-0.75,
        view_when_set=((0.1, 0.2, 0.3), (0.4, 0.5, 0.6), (0.7, 0.8, 0.9)),
        precision=2.0**-53,
    )
    names = [name for name in vars(values) if name not in ("precision", "enabled")]
    storage.store(camera_object, values, *names)
    assert storage.load(camera_object) == values


def test_storing_moves_nothing(posed_camera):
    before = posed_camera.matrix_basis.copy(), posed_camera.data.lens
    values = storage.load(posed_camera)
    storage.store(posed_camera, CameraValues((1, 2, 3), values.look_at, values.up, 77.0), *storage.EXACT)
    assert (posed_camera.matrix_basis, posed_camera.data.lens) == before
    assert posed_camera.virtual_pinhole.numbers() == ((1, 2, 3), (0, 0, 1), (0, 0, 1), 77)


def test_what_is_restored_is_as_it_was_whatever_was_stored(posed_camera):
    group = posed_camera.virtual_pinhole
    group.counted_in, group.exact = (1.5, -3, 0, 1e-30, 7), "nonsense"  # what is no picture and no number, either
    with storage.restored(posed_camera, "keeps", "counted_in", "exact"):
        group.keeps, group.counted_in, group.exact = "FIELD_OF_VIEW", (1, 2, 3, 4, 5), "[]"
    assert (group.keeps, group.exact) == ("PIXELS", "nonsense")
    assert tuple(group.counted_in) == pytest.approx((1.5, -3, 0, 1e-30, 7))


# --- Datablocks


@pytest.mark.parametrize(
    ("system", "scale", "value", "words"),
    [
        ("METRIC", 1.0, 2.0, "2 m"),
        ("METRIC", 0.01, 2.0, "2 cm"),
        ("METRIC", 1.0, 1e-9, "1e-09"),  # Blender would say 0 m
        ("METRIC", 1.0, math.inf, "inf"),
        ("IMPERIAL", 1.0, 3.048, "10'"),
        ("NONE", 0.01, 2.0, "2"),
    ],
)
def test_a_length_is_said_in_the_scenes_units(scene, system, scale, value, words):
    scene.unit_settings.system, scene.unit_settings.scale_length = system, scale
    assert datablocks.length(value, scene) == words


def test_without_markers_a_render_takes_the_scenes_camera(camera_object, scene):
    scene.timeline_markers.new("Loose", frame=1)
    assert datablocks.render_camera(scene) == camera_object


@pytest.mark.parametrize(("frame", "chosen"), [(1, "A"), (5, "A"), (9, "A"), (10, "B"), (99, "B")])
def test_with_markers_a_render_takes_the_last_one_before_the_frame_or_the_first(add_camera, scene, frame, chosen):
    """And so does Blender, whose answer stands in the scene after a change of frame."""
    for name, at in (("B", 10), ("Unrendered", 7), ("A", 5)):
        scene.timeline_markers.new(name, frame=at).camera = add_camera(name)
    bpy.data.objects["Unrendered"].hide_render = True
    scene.frame_set(frame)
    assert datablocks.render_camera(scene).name == scene.camera.name == chosen


# --- Preferences


def test_without_an_add_on_there_are_the_defaults():
    assert preferences.get() == preferences.Defaults()
    assert preferences.up_axis() == (0, 0, 1)


def test_the_defaults_are_those_that_blender_shows():
    """One of each: what a person sees before the first change is what a script without an add-on gets."""
    properties = preferences.VIEWCAM_preferences.bl_rna.properties
    for name, default in vars(preferences.Defaults()).items():
        registered = properties[name].default_array if properties[name].type == "FLOAT" else properties[name].default
        assert registered == default if isinstance(default, str) else tuple(registered) == pytest.approx(default, rel=2**-24), (
            name
        )


@pytest.mark.parametrize(("name", "axis"), [("X", (1, 0, 0)), ("-Y", (0, -1, 0)), ("-Z", (0, 0, -1))])
def test_the_chosen_up_is_a_unit_vector(monkeypatch, name, axis):
    monkeypatch.setattr(preferences, "get", lambda: preferences.Defaults(default_up=name))
    assert preferences.up_axis() == axis


def test_every_up_that_can_be_chosen_is_an_axis(monkeypatch):
    names = [item.identifier for item in preferences.VIEWCAM_preferences.bl_rna.properties["default_up"].enum_items]
    assert len(names) == 6
    for name in names:
        monkeypatch.setattr(preferences, "get", lambda name=name: preferences.Defaults(default_up=name))
        assert sorted(map(abs, preferences.up_axis())) == [0, 0, 1]


def test_an_enabled_add_on_has_preferences_of_its_own(fresh_blender):
    addons = fresh_blender.context.preferences.addons
    addon = addons.new()
    try:
        addon.module = preferences.PACKAGE
        addon.preferences.default_up = "Y"
        assert preferences.up_axis() == (0, 1, 0)
        assert preferences.get().default_level == "GEOMETRY"
    finally:
        addons.remove(addon)
    assert preferences.get() == preferences.Defaults()
