"""`viewcam camera`: what it lists, what it writes, and what it says in one sentence."""

import io
import json

import pytest

from viewcam_addon import cameras, cli
from viewcam_addon.cameras import Camera, Options
from viewcam_addon.pinhole import Pinhole

LEFT = Pinhole((7, -6, 4), (0, 0, 1), (0, 0, 1), (600, 500), 640, 360, (300, 200))
RIGHT = Pinhole((8, -6, 4), (1, 0, 1), (0, 0, 1), 600, 640, 360)


@pytest.fixture
def model(tmp_path):
    cameras.save([Camera("left", LEFT), Camera("right", RIGHT)], tmp_path / "model", "colmap")
    return tmp_path / "model"


def test_a_line_for_each_camera_says_what_it_is(model, capfd):
    assert cli.main(["camera", str(model), "--list"]) == 0
    left, right = capfd.readouterr().out.splitlines()
    assert left.startswith("left: 640 × 360, d = 600 × 500, principal point 300, 200, eye (7, -6, 4), look-at (")
    assert right.startswith("right: 640 × 360, d = 600, eye (8, -6, 4), look-at (")


def test_one_is_written_in_another_format_with_other_axes_and_scale(model, tmp_path, capfd):
    out = tmp_path / "right.gltf"
    words = ["camera", str(model), "--camera", "right", "--to", "gltf", "--out", str(out), "--out-axes", "y_up"]
    assert cli.main([*words, "--out-scale", "0.01", "--json", str(tmp_path / "result.json")]) == 0
    (back,) = cameras.read(out, options=Options(axes="y_up", scale=0.01))
    assert back.pinhole.eye == pytest.approx(RIGHT.eye, abs=1e-14) and back.pinhole.distance == pytest.approx((600, 600))
    (said,) = json.loads((tmp_path / "result.json").read_text())["cameras"]
    assert said["name"] == "right" and said["camera"]["eye"] == pytest.approx(RIGHT.eye, abs=1e-14)
    assert "right.gltf" in capfd.readouterr().out


def test_text_on_standard_input_is_answered_on_standard_output(monkeypatch, capfd):
    monkeypatch.setattr("sys.stdin", io.StringIO(cameras.write([Camera("left", LEFT)], "opencv")))
    assert cli.main(["camera", "-", "--to", "transforms"]) == 0
    told = capfd.readouterr()
    (back,) = cameras.read(told.out)
    assert back.pinhole.principal_point == LEFT.principal_point
    assert "half a pixel was added" in told.err, "how it was taken must be said, and not among what is written"


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["camera", "MODEL", "--camera", "middle"], "'left', 'right'"),
        (["camera", "MODEL", "--list", "--to", "gltf"], "--list and --to"),
        (["camera", "MODEL", "--out", "a"], "--to"),
        (["camera", "MODEL", "--to", "colmap"], "--out"),
        (["camera", "MODEL", "--to", "gltf", "--out", "a.gltf"], "shifted"),
        (["camera", "MODEL", "--to", "fspy"], "fspy"),
        (["camera", "MODEL", "--from", "gltf"], "not glTF"),
        (["camera", "MODEL", "--distance", "3"], "--size"),
        (["camera", "none.json"], "none.json"),
    ],
)
def test_what_is_wrong_is_one_sentence_and_nothing_is_written(model, tmp_path, monkeypatch, capfd, words, told):
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    assert cli.main([str(model) if word == "MODEL" else word for word in words]) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert line.startswith("viewcam camera: ") and told in line
    assert sorted(tmp_path.rglob("*")) == before
