"""`blender -b FILE --command viewcam batch` as its users type it, with the extension that they install."""

import json
import os
import re
import sys
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

sys.path.insert(0, str(Path(__file__).parent.parent))
import disturbed

from viewcam_addon.commands.demo import SCENE as DEMO_SCENE

CORNELL = DEMO_SCENE.with_name("cornell.blend")
ORBIT = ("--orbit", "3", "--size", "16x16", "--samples", "1", "--out")


def batch(blender, *words):
    return blender.run("-q", "-b", CORNELL, "--command", "viewcam", "batch", *words)


def test_shots_come_out_of_it_and_again_only_those_that_are_missing(real_blender, tmp_path):
    done = batch(real_blender, *ORBIT, tmp_path)
    assert done.returncode == 0 and "3 shots, in " in done.stdout, done
    assert {"orbit_000.exr", "orbit_001.png", "orbit_002.json", "summary.json"} < {path.name for path in tmp_path.iterdir()}
    (tmp_path / "orbit_001.png").unlink()
    assert "3 shots, 2 of them kept" in batch(real_blender, *ORBIT, tmp_path, "--resume").stdout


def test_what_stands_in_braces_is_an_event_and_the_last_tells_the_status(real_blender, tmp_path):
    (tmp_path / "file").touch()
    (tmp_path / "orbit_001.png").symlink_to(tmp_path / "file" / "picture.png")  # which is no folder
    done = batch(real_blender, *ORBIT, tmp_path, "--log-json")
    output = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    events = [event["event"] for event in output]
    assert events[:2] == ["started", "batch_started"] and events[-1] == "finished", done.stdout
    assert events.count("shot_done") == 2 and events.count("shot_failed") == 1
    assert output[-1]["exit_status"] == done.returncode == 4


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--orbit", "3", "--workers", "0", "--out", "OUT"], "'0'"),  # before the file is looked at
        (["--orbit", "3", "--camera", "Camra", "--out", "OUT"], "'Camra'"),
    ],
)
def test_each_wrong_word_is_one_sentence(real_blender, tmp_path, words, message):
    done = batch(real_blender, *(tmp_path / "out" if word == "OUT" else word for word in words))
    (sentence,) = [line for line in done.stderr.splitlines() if line.startswith("viewcam")]
    assert done.returncode == 2 and message in sentence and "bug" not in sentence, done.stderr
    assert "Traceback" not in done.stderr + done.stdout and not (tmp_path / "out").exists()


def test_on_a_terminal_a_bar_counts_the_shots(real_blender, tmp_path, on_a_terminal):
    """The extension brings tqdm along."""
    command = [*real_blender.command, "-q", "-b", CORNELL, "--command", "viewcam", "batch", *ORBIT, tmp_path]
    status, printed = on_a_terminal(command, {**os.environ, "BLENDER_USER_RESOURCES": str(real_blender.user_folder)})
    assert status == 0 and "| 0/3 [" in printed, printed


# --- `blender -b FILE --command viewcam batch --workers 2`: each worker another Blender, the files those of one process


WORDS = ("--orbit", "4", "--size", "96x54", "--samples", "2", "--engine", "CYCLES")


def run_batch(blender, folder, *words, python=()):
    return blender.run(
        "-b", *python, "sample_scenes/studio.blend", "--command", "viewcam", "batch", *WORDS, "--out", folder, *words
    )


def contents(folder):
    """Name → bytes without timings, of the shots' files and the contact sheet."""
    paths = [path for path in folder.iterdir() if path.suffix in (".exr", ".png", ".json", ".html")]
    bare = {path.name: re.sub(rb'"timing": \{[^}]*\}', b"", path.read_bytes()) for path in paths}
    return {name: data for name, data in bare.items() if name != "summary.json"}


def test_two_blenders_write_the_bytes_of_one(real_blender, packages, tmp_path, monkeypatch):
    alone = run_batch(real_blender, tmp_path / "one")
    assert alone.returncode == 0, alone.stdout + alone.stderr
    monkeypatch.setenv("PYTHONPATH", str(packages))
    both = run_batch(real_blender, tmp_path / "two", "--workers", "2", python=["--python-use-system-env"])
    assert both.returncode == 0, both.stdout + both.stderr
    assert len(contents(tmp_path / "one")) == 4 * 3 + 1
    assert contents(tmp_path / "one") == contents(tmp_path / "two")
    words = both.stdout + both.stderr
    assert not re.search("distributed|tornado|nanny|worker|traceback", words, re.IGNORECASE), words


def test_a_blender_without_dask_says_what_to_install_and_renders_nothing(real_blender, tmp_path):
    outcome = run_batch(real_blender, tmp_path / "out", "--workers", "2")
    assert outcome.returncode == 2
    assert re.search(
        r"viewcam batch: several workers need Dask, which is not here: \S+ -m pip install distributed", outcome.stderr
    )
    assert not list(tmp_path.glob("out/*.exr"))


# --- A batch's pictures are those of `blender -b FILE -f N`, to the bit in every channel: what a pipeline rendered before it


# Small, few samples, 32 bits; everything else as the artist has it.
SMALL = """
import bpy
scene = bpy.context.scene
render, file = scene.render, scene.render.image_settings
render.resolution_x, render.resolution_y, render.resolution_percentage = 96, 54, 100
render.engine, scene.cycles.samples, scene.virtual_pinhole_reference.samples = {engine!r}, 2, 2
scene.view_layers[0].use_pass_z = scene.view_layers[0].use_pass_normal = True
file.media_type, file.file_format, file.color_depth = "MULTI_LAYER_IMAGE", "OPEN_EXR_MULTILAYER", "32"
bpy.ops.wm.save_as_mainfile(filepath={blend!r})
"""


def channels(path):
    parts = OpenEXR.File(str(path), separate_channels=True).parts
    return {name: channel.pixels for part in parts for name, channel in part.channels.items()}


@pytest.mark.parametrize("engine", ["CYCLES", "VIEWCAM"])
def test_frames_of_a_batch_are_those_of_f(real_blender, tmp_path, engine):
    """The camera moves by its keyed values."""
    blend, frames = tmp_path / "small.blend", (3, 40)
    script = SMALL.format(engine=engine, blend=str(blend))
    check(real_blender.run("-b", "sample_scenes/flight.blend", "--python-exit-code", "9", "--python-expr", script))
    check(real_blender.run("-b", blend, "-o", tmp_path / "f_###", "-f", "{},{}".format(*frames)))
    shots = tmp_path / "shots.csv"
    # Backwards and once more: what is kept from one frame is in the way of another, if it is.
    rows = [f"{place}_{frame:03},Virtual Pinhole,{frame}" for place, frame in enumerate((*frames, frames[0]))]
    shots.write_text("\n".join(["name,camera,frame", *rows]))
    check(real_blender.run("-b", blend, "--command", "viewcam", "batch", shots, "--out", tmp_path / "batch"))
    for place, frame in enumerate((*frames, frames[0])):
        by_f, other = channels(tmp_path / f"f_{frame:03}.exr"), channels(tmp_path / "batch" / f"{place}_{frame:03}.exr")
        assert by_f.keys() == other.keys() and len(by_f) >= 8
        others = {key: int((by_f[key] != other[key]).sum()) for key in by_f if not np.array_equal(by_f[key], other[key])}
        assert not others, f"frame {frame}: pixels that differ, by channel: {others}"
    first, second = (channels(tmp_path / f"f_{frame:03}.exr") for frame in frames)
    assert any(not np.array_equal(first[key], second[key]) for key in first), "two frames are one picture"


def check(outcome):
    assert outcome.returncode == 0, outcome.stdout + outcome.stderr


def test_a_calibrated_lens_bends_picture_and_labels_alike(real_blender, tmp_path):
    """The box's left edge is straight: the lens shows its middle two pixels farther out than its ends."""
    (tmp_path / "cameras.txt").write_text("1 OPENCV 640 360 600 600 320 180 -0.25 0.06 0 0\n")
    (tmp_path / "images.txt").write_text("1 1 0 0 0 0 0 0 1 a.png\n\n")
    words = ["--orbit", "1", "--samples", "4", "--labels", "depth", "--transforms", "--distort", tmp_path]
    done = batch(real_blender, *words, "--out", tmp_path / "out")
    assert done.returncode == 0, done
    document = json.loads((tmp_path / "out" / "transforms.json").read_text())
    assert (document["camera_model"], document["k1"], document["k2"], document["w"]) == ("OPENCV", -0.25, 0.06, 640)
    pixels = {}
    for name, channel in (("orbit_000.exr", "Combined.R"), ("orbit_000.labels.exr", "Depth.Z")):
        with OpenEXR.File(str(tmp_path / "out" / name), separate_channels=True) as file:
            pixels[channel] = file.channels()[f"ViewLayer.{channel}"].pixels
    is_box = pixels["Depth.Z"] < 1e9
    assert ((pixels["Combined.R"] > 0.005) == is_box).mean() > 0.98  # at its outline a pixel is of both
    ends = np.flatnonzero(is_box.any(axis=1))[[4, -5]]
    left = [int(np.flatnonzero(is_box[row])[0]) for row in (*ends, 180)]
    assert left[2] <= min(left[:2]) - 1, left


class TestWhateverDisturbsIt(disturbed.Disturbances):
    @pytest.fixture(scope="class")
    @classmethod
    def blender(cls, real_blender):
        def command(shots: Path) -> disturbed.Command:
            words = [*real_blender.command, "-b", disturbed.STUDIO, "--command", "viewcam", "batch", shots]
            return disturbed.Command(words, {"BLENDER_USER_RESOURCES": str(real_blender.user_folder)})

        return command
