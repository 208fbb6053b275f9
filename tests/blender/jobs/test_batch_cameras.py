"""Cameras of another program as shots of a batch: their size, shift, pixel aspect and mirroring are those of the pictures."""

import json

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon import cameras, cli
from viewcam_addon.cameras import Camera, Options
from viewcam_addon.pinhole import Pinhole

GIVEN = {
    "plain": Pinhole((7, -6, 4), (0, 0, 1), (0, 0, 1), 60, 64, 36),
    "shifted": Pinhole((7, -6, 4), (0, 0, 1), (0, 0, 1), 60, 64, 36, (30, 20)),
    "wide_pixels": Pinhole((7, -6, 4), (0, 0, 1), (0, 0, 1), (60, 90), 64, 36, (40, 10)),
    "tall_pixels": Pinhole((7, -6, 4), (0, 0, 1), (0, 0, 1), (60, 45), 36, 64),
    "upright": Pinhole((3, 2, -5), (0, 0, 1), (1, -2, 0.5), 70, 40, 60),
}
MIRRORED = Pinhole((7, -6, 4), (0, 0, 1), (0, 0, 1), (60, 50), 64, 36, (30, 20), True)


@pytest.fixture
def blend(fresh_blender, scene, tmp_path):
    scene.render.engine = "VIEWCAM"
    scene.virtual_pinhole_reference.samples = 1
    scene.render.pixel_aspect_x = 2.5  # each camera says its own
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "file.blend"))
    return tmp_path / "file.blend"


def taken(folder, name):
    return Pinhole(**json.loads((folder / f"{name}.json").read_text())["camera"])


def close(have, wanted):
    """As Blender's float32 numbers have it: half a dozen roundings of 2⁻²⁴ of lengths of 10 seen from 10."""
    points = np.random.default_rng(1).uniform(-1, 1, (50, 3))
    ours, theirs = have.project(points), wanted.project(points)
    error = np.hypot(ours[0] - theirs[0], ours[1] - theirs[1]).max()
    assert error < 16 * 2.0**-24 * max(*wanted.distance, wanted.width), f"{error:.3g} pixels"
    assert (have.width, have.height, have.mirrored) == (wanted.width, wanted.height, wanted.mirrored)


def test_a_colmap_model_is_rendered_camera_by_camera_and_comes_back(blend, tmp_path):
    given = [Camera(name, pinhole) for name, pinhole in GIVEN.items()]
    cameras.save(given, tmp_path / "model", "colmap")
    out = tmp_path / "out"
    assert cli.main(["batch", str(blend), str(tmp_path / "model"), "--out", str(out), "--transforms"]) == 0
    for name, pinhole in GIVEN.items():
        close(taken(out, name), pinhole)
    sidecars = {camera.name: camera.pinhole for camera in cameras.read(out, format="sidecar")}
    for form in ("transforms", "colmap"):
        found = {camera.name: camera.pinhole for camera in cameras.read(out, format=form)}
        assert found.keys() == sidecars.keys() == GIVEN.keys()
        for name, pinhole in found.items():
            exact = sidecars[name]
            assert (pinhole.distance, pinhole.width, pinhole.height) == (exact.distance, exact.width, exact.height)
            assert np.abs(np.array(pinhole.axes()) - exact.axes()).max() < 1e-15
            assert np.abs(np.array(pinhole.eye) - exact.eye).max() <= (0 if form == "transforms" else 1e-14)


def test_a_mirrored_camera_with_y_up_in_centimetres_renders_as_such(blend, tmp_path):
    pytest.importorskip("pxr", reason="make test installs what reads USD")
    wanted = Options(axes="y_up", scale=0.01)
    cameras.save([Camera("left", MIRRORED)], tmp_path / "camera.usda", "usd", wanted)
    out = tmp_path / "out"
    words = ["batch", str(blend), str(tmp_path / "camera.usda"), "--axes", "y_up", "--scale", "0.01", "--out", str(out)]
    assert cli.main(words) == 0
    close(taken(out, "left"), MIRRORED)
    assert cli.main([*words, "--unmirrored", "--overwrite"]) == 0
    assert not taken(out, "left").mirrored


def test_a_list_may_say_principal_point_aspect_and_mirroring_itself(blend, tmp_path):
    (tmp_path / "shots.csv").write_text(
        "name,eye,look_at,up,d,width,height,principal_point,pixel_aspect,mirrored\n"
        f"left,7 -6 4,0 0 1,0 0 1,60,64,36,30 20,{50 / 60!r},true\n"
    )
    assert cli.main(["batch", str(blend), str(tmp_path / "shots.csv"), "--out", str(tmp_path / "out")]) == 0
    close(taken(tmp_path / "out", "left"), MIRRORED)
