"""`blender -b FILE --command viewcam batch` as its users type it, with the extension that they install."""

import json
import os

import pytest

from viewcam_addon.commands.verification import DEMO_SCENE

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
    told = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    events = [event["event"] for event in told]
    assert events[:2] == ["started", "batch_started"] and events[-1] == "finished", done.stdout
    assert events.count("shot_done") == 2 and events.count("shot_failed") == 1
    assert told[-1]["exit_status"] == done.returncode == 4


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--out", "OUT"], "which shots is not said"),
        (["none.csv", "--out", "OUT"], "none.csv"),
        (["--out", "OUT", "none.csv"], "none.csv"),
        (["--orbit", "3"], "--out"),
        (["--orbit", "3", "--workers", "0", "--out", "OUT"], "'0'"),
        (["--orbit", "3", "--camera", "Camra", "--out", "OUT"], "'Camra'"),
        (["--orbit", "3", "--out", CORNELL], "can't be a folder"),
    ],
)
def test_each_wrong_word_is_one_sentence(real_blender, tmp_path, words, told):
    done = batch(real_blender, *(tmp_path / "out" if word == "OUT" else word for word in words))
    (sentence,) = [line for line in done.stderr.splitlines() if line.startswith("viewcam")]
    assert done.returncode == 2 and told in sentence and "bug" not in sentence, done.stderr
    assert "Traceback" not in done.stderr + done.stdout and not (tmp_path / "out").exists()


def test_on_a_terminal_a_bar_counts_the_shots(real_blender, tmp_path, on_a_terminal):
    """The extension brings tqdm along."""
    command = [*real_blender.command, "-q", "-b", CORNELL, "--command", "viewcam", "batch", *ORBIT, tmp_path]
    status, shown = on_a_terminal(command, {**os.environ, "BLENDER_USER_RESOURCES": str(real_blender.user_folder)})
    assert status == 0 and "| 0/3 [" in shown, shown
