import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import preferences


def test_without_an_add_on_there_are_the_defaults():
    assert preferences.get() == preferences.Defaults()
    assert preferences.up_axis() == (0, 0, 1)


def test_the_defaults_are_those_that_blender_shows():
    """One of each: what a person sees before the first change is what a script without an add-on gets."""
    shown = preferences.VIEWCAM_preferences.bl_rna.properties
    for name, default in vars(preferences.Defaults()).items():
        found = shown[name].default_array if shown[name].type == "FLOAT" else shown[name].default
        assert found == default if isinstance(default, str) else tuple(found) == pytest.approx(default, rel=2**-24), name


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
