"""Export and Cycles in the Blender that VIEWCAM_BLENDER names: the same words, and its status."""

import io
import json
import sys
from dataclasses import replace

import numpy as np
import pytest

import viewcam_addon as vp
from viewcam_addon import cameras, cli
from viewcam_addon.cameras import Camera, Options
from viewcam_addon.cli import main
from viewcam_addon.pinhole import Pinhole


@pytest.fixture
def named(tmp_path, monkeypatch):
    """A function that names a program, which writes its words down and ends with this status."""

    def name(status):
        written, program = tmp_path / "words.txt", tmp_path / "blender"
        text = f"import pathlib, sys\npathlib.Path({str(written)!r}).write_text('\\n'.join(sys.argv[1:]))\nsys.exit({status})\n"
        program.write_text(f"#!{sys.executable}\n{text}")
        program.chmod(0o755)
        if sys.platform == "win32":  # where no script is a program by its first line
            script, program = program, program.with_suffix(".cmd")
            program.write_text(f'@"{sys.executable}" "{script}" %*\n')
        monkeypatch.setenv("VIEWCAM_BLENDER", str(program))
        return lambda: written.read_text().splitlines()

    return name


@pytest.mark.parametrize("command", ["export", "cycles"])
@pytest.mark.parametrize("status", [0, 2, 3])
def test_the_named_blender_gets_the_file_and_the_other_words_and_its_status_is_ours(named, tmp_path, command, status):
    words, out = named(status), str(tmp_path / "out")
    assert main([command, "./shot one.blend", out, "--level", "path", "--samples", "8"]) == status
    after = ["--command", "viewcam", command, out, "--level", "path", "--samples", "8"]
    assert words() == ["-b", "--disable-autoexec", "shot one.blend", *after]


def test_a_trusted_file_is_opened_with_its_scripts(named, tmp_path):
    words = named(0)
    assert main(["export", "a.blend", str(tmp_path / "out"), "--trust"]) == 0
    assert words()[:2] == ["-b", "--enable-autoexec"] and words()[-1] == "--trust"


def test_a_blender_without_the_extension_or_none_at_all_is_one_sentence(named, tmp_path, monkeypatch, capfd):
    named(1)
    assert main(["export", "a.blend", str(tmp_path / "out")]) == 2
    assert "with the extension Virtual Pinhole" in capfd.readouterr().err
    monkeypatch.setenv("VIEWCAM_BLENDER", str(tmp_path / "none"))
    assert main(["cycles", "a.blend", str(tmp_path / "out")]) == 2
    assert "can't be started" in capfd.readouterr().err


# --- `viewcam camera`: what it lists, what it writes, and what it says in one sentence


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
    (record,) = json.loads((tmp_path / "result.json").read_text())["cameras"]
    assert record["name"] == "right" and record["camera"]["eye"] == pytest.approx(RIGHT.eye, abs=1e-14)
    assert "right.gltf" in capfd.readouterr().out


def test_text_on_standard_input_is_answered_on_standard_output(monkeypatch, capfd):
    monkeypatch.setattr("sys.stdin", io.StringIO(cameras.write([Camera("left", LEFT)], "opencv")))
    assert cli.main(["camera", "-", "--to", "transforms"]) == 0
    output = capfd.readouterr()
    (back,) = cameras.read(output.out)
    assert back.pinhole.principal_point == LEFT.principal_point
    assert "half a pixel was added" in output.err, "how it was taken must be said, and not among what is written"


@pytest.mark.parametrize(
    ("words", "sentence"),
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
def test_what_is_wrong_is_one_sentence_and_nothing_is_written(model, tmp_path, monkeypatch, capfd, words, sentence):
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    assert cli.main([str(model) if word == "MODEL" else word for word in words]) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert line.startswith("viewcam camera: ") and sentence in line
    assert sorted(tmp_path.rglob("*")) == before


# --- `import viewcam_addon as vp`: what a program gets is what the command line gets. The page's own examples are run as well


@pytest.fixture
def scene():
    from viewcam_addon.tracer.scene import Object, Scene, Spheres

    camera = vp.Pinhole((3, -5, 2), (0, 0, 1), (0, 0, 1), 60, 48, 32)
    ball = Spheres(np.array([[0.0, 0.0, 1.0]]), np.array([1.0]), np.zeros(1, np.int32))
    placed = Object("Ball", "ball", np.eye(4), object_index=1, material_indices=(1,))
    return Scene(camera, {"ball": ball}, (placed,))


def test_a_picture_and_itself_are_the_same_and_a_longer_lens_is_found(scene):
    picture = vp.render(scene, level="geometry")
    same = vp.compare(picture, vp.render(scene, level="geometry"), scene)
    assert same.passed and same.sentence.startswith("The same picture"), same.sentence
    longer = replace(scene.camera, distance=60.06)
    comparison = vp.compare(picture, vp.render(replace(scene, camera=longer), level="geometry"), scene)
    assert not comparison.passed and "magnified by 0.999001" in comparison.sentence, comparison.sentence


@pytest.mark.parametrize("bounces", [0, 1])
def test_indirect_light_of_diffuse_surfaces_is_compared_where_they_may_scatter_and_nowhere_else(scene, bounces):
    """Without diffuse bounces Cycles' pass is what a ray of a glossy lobe carries, and no picture's light is wrong by it."""
    from viewcam_addon.tracer.scene.film import Bounces
    from viewcam_addon.tracer.scene.lamps import Sun

    sun = Sun("sun", towards=(0.2, -0.6, 1.0), irradiance=(2.0,) * 3, angle=0.3)
    lit = replace(scene, lamps=(sun,), bounces=Bounces(total=2, diffuse=bounces))
    picture, others = vp.render(lit, level="path", samples=16), []
    for seed in (1, 2):
        image = vp.render(lit, level="path", samples=16, seed=seed)
        others.append(
            replace(image, passes=dict(image.passes) | {"Diffuse Indirect": image["Diffuse Direct"] * np.float32(0.5)})
        )
    assert vp.compare(picture, others, lit).passed == (bounces == 0)


def test_a_file_is_the_same_as_what_was_read_of_it(scene, tmp_path):
    from viewcam_addon import image
    from viewcam_addon.tracer.scene import scene_file

    scene_file.write(scene, tmp_path / "scene.json")
    picture = vp.render(tmp_path / "scene.json", level="geometry")
    np.testing.assert_array_equal(picture["Depth"], vp.render(scene, level="geometry")["Depth"])
    image.write(tmp_path / "a.exr", picture)
    assert vp.compare(tmp_path / "a.exr", str(tmp_path / "a.exr"), tmp_path / "scene.json").passed


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda scene, folder: vp.render(scene, level="all"), "the level is 'all'"),
        (lambda scene, folder: vp.render(folder / "none.json"), "none.json"),
        (
            lambda scene, folder: vp.compare(vp.Image({"Depth": np.zeros((2, 2, 1), np.float32)}), []),
            "does not tell its camera",
        ),
        (lambda scene, folder: vp.check(folder / "none.blend"), "none.blend"),
    ],
)
def test_what_is_wrong_is_one_sentence(scene, tmp_path, call, sentence):
    with pytest.raises(vp.InputError, match=sentence) as raised:
        call(scene, tmp_path)
    assert "\n" not in str(raised.value)
