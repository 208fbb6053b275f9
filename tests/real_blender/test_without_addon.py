"""A file saved with the add-on, in a Blender without it: the same picture, and all values are there when the add-on returns."""

import json

import numpy as np
import pytest

from viewcam_addon import image

ADDON = ("--addons", "bl_ext.user_default.virtual_pinhole")
HAS_ADDON = "hasattr(bpy.types.Object, 'virtual_pinhole')"


@pytest.fixture(scope="module")
def folder(real_blender, tmp_path_factory):
    """scene.blend and its values.json, resaved.blend from a Blender without the add-on, and pictures of both."""
    folder = tmp_path_factory.mktemp("values")
    file, resaved = folder / "scene.blend", folder / "resaved.blend"
    real_blender.run_inside("set_all", file, folder / "values.json")
    render(real_blender, folder / "with", file, *ADDON, expected=True)
    render(real_blender, folder / "without", file, expected=False)
    run(real_blender, file, "--python-expr", f"import bpy; bpy.ops.wm.save_as_mainfile(filepath={str(resaved)!r})")
    render(real_blender, folder / "returned", resaved, *ADDON, expected=True)
    real_blender.run_inside("read_all", resaved, folder / "returned.json")
    return folder


def run(blender, *arguments):
    outcome = blender.run("-b", "--factory-startup", "--python-exit-code", "9", *arguments)
    output = outcome.stdout + outcome.stderr
    assert outcome.returncode == 0 and "Traceback" not in output, output
    return output


def render(blender, start, file, *addon, expected):
    """Render frame 1, in a Blender that has the add-on or has not, as expected."""
    check = f"import bpy; assert {HAS_ADDON} == {expected}"
    run(blender, *addon, file, "--python-expr", check, "-o", f"{start}_####", "-f", "1")


def picture(folder, name):
    return image.read(folder / f"{name}_0001.exr").passes


def test_a_file_opened_without_the_addon_renders_the_same_still_to_the_last_bit(folder):
    first, other = picture(folder, "with"), picture(folder, "without")
    assert first["Depth"].min() < 20 and first["Combined"].std() > 0
    for name in first:
        assert np.array_equal(first[name], other[name]), name


def test_all_values_come_back_after_a_resave_without_the_addon(folder):
    values, returned = (json.loads((folder / name).read_text()) for name in ("values.json", "returned.json"))
    for name in (
        "eye",
        "look_at",
        "up",
        "distance",
        "zoom",
        "roll",
        "held_roll",
        "keeps",
        "eye_target",
        "look_at_target",
        "exact",
    ):
        assert f"virtual_pinhole.{name}" in values
    assert values["virtual_pinhole.look_at_target"] == "Look-At"
    assert returned == values
    for name, passes in picture(folder, "with").items():
        assert np.array_equal(passes, picture(folder, "returned")[name]), name


def test_a_value_that_is_lost_would_be_noticed(folder, real_blender, tmp_path):
    lost = "import bpy; bpy.context.scene.camera.virtual_pinhole.property_unset('zoom'); bpy.ops.wm.save_mainfile()"
    file = tmp_path / "lost.blend"
    file.write_bytes((folder / "resaved.blend").read_bytes())
    run(real_blender, *ADDON, file, "--python-expr", lost)
    real_blender.run_inside("read_all", file, tmp_path / "lost.json")
    values, returned = (json.loads(path.read_text()) for path in (folder / "values.json", tmp_path / "lost.json"))
    assert {name for name in values if values[name] != returned[name]} >= {"virtual_pinhole.zoom"}
