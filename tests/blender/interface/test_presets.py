"""Camera presets: those that come along, and an artist's own."""

import math
from unittest.mock import MagicMock

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender.interface import panel, presets
from viewcam_addon.pinhole import Pinhole

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
    with pytest.raises(RuntimeError, match="The preset can't be read"):
        bpy.ops.viewcam.execute_preset(filepath=str(tmp_path / "gone.py"))
    bpy.data.objects.remove(camera_object)
    with pytest.raises(RuntimeError, match="There is no camera"):
        bpy.ops.viewcam.add_preset(name="Mine")
