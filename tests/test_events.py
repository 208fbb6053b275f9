"""The events of a command on its way: JSON lines alone on standard output, sentences on standard error, a bar on a terminal."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from viewcam_addon import events
from viewcam_addon.cli import main
from viewcam_addon.terminal import silent_libraries

CAMERA = {"eye": [0, -5, 0], "look_at": [0, 0, 0], "up": [0, 0, 1], "distance": 100, "width": 64, "height": 48}
SCENE = {"format": "virtual-pinhole-scene", "version": 1, "camera": CAMERA, "geometries": {}, "objects": []}

BATCH = [
    ("batch_started", {"shots": 3, "kept": 0, "folder": "out"}),
    ("shot_started", {"shot": "left"}),
    ("shot_done", {"shot": "left", "seconds": 0.5, "image": "left.exr", "passed": None}),
    ("shot_started", {"shot": "right"}),
    ("shot_failed", {"shot": "right", "error": "the lens is too long, shorten it"}),
    ("stopping", {"signal": "SIGINT"}),
    ("batch_finished", {"done": 1, "kept": 0, "failed": 1, "left": 1, "seconds": 1.0, "exit_status": 130}),
]
TELL = f"""
from viewcam_addon import events
with events.opened(log_json=False) as told:
    for event, fields in {BATCH!r}:
        told.tell(event, **fields)
"""


def lines_of(text):
    return [json.loads(line) for line in text.splitlines()]


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(SCENE))
    return path


def test_each_event_is_a_line_of_json_with_its_time_and_nothing_else_is_on_standard_output(scene, tmp_path, capfd):
    assert main(["render", str(scene), str(tmp_path / "out.exr"), "--log-json"]) == 0
    output = capfd.readouterr()
    events_read = lines_of(output.out)
    started, message, finished = (event for event in events_read if event["event"] != "progress")
    assert [event["event"] for event in (started, message, finished)] == ["started", "message", "finished"]
    shares = [event["share"] for event in events_read if event["event"] == "progress"]
    assert shares[0] == 0 and shares[-1] == 1 and shares == sorted(set(shares)), shares
    assert started["command"] == "render" and "out.exr --log-json" in started["words"]
    assert message["text"].startswith("traced 64 × 48 pixels in ")
    assert finished["exit_status"] == 0 and 0 < finished["seconds"] < 600
    assert started["time"] <= message["time"] <= finished["time"] and started["time"].endswith("+00:00")
    assert output.err == ""


def test_an_error_is_an_event_and_a_sentence(tmp_path, capfd):
    assert main(["render", str(tmp_path / "none.json"), str(tmp_path / "out.exr"), "--log-json"]) == 2
    output = capfd.readouterr()
    _, error, finished = lines_of(output.out)
    assert error["event"] == "error" and finished["exit_status"] == 2
    assert output.err == f"viewcam render: {error['text']}\n" and "none.json" in error["text"]


@pytest.mark.parametrize(
    ("words", "command", "sentence"),
    [
        (["render", "a.json"], "render", "OUT.exr"),
        (["rendr"], "", "rendr"),
        (["batch", "a.blend", "--orbit", "x"], "batch", "'x'"),
    ],
)
def test_wrong_usage_is_an_event_and_a_sentence_too(capfd, words, command, sentence):
    assert main([*words, "--log-json"]) == 2
    output = capfd.readouterr()
    started, error, finished = lines_of(output.out)
    assert (started["event"], started["command"]) == ("started", command) and "--log-json" in started["words"]
    assert (error["event"], error["command"]) == ("error", command) and sentence in error["text"], error
    assert (finished["event"], finished["command"], finished["exit_status"]) == ("finished", command, 2)
    assert output.err == f"{'viewcam ' + command if command else 'viewcam'}: {error['text']}\n"
    assert main(words) == 2
    assert capfd.readouterr() == ("", output.err), "the sentence is the same without JSON"


def test_a_check_s_child_processes_tell_as_if_they_were_none(tmp_path, capfd):
    pytest.importorskip("bpy")
    from viewcam_addon.commands.demo import SCENE as DEMO_SCENE

    words = ["check", str(DEMO_SCENE), "--size", "64x36", "--json", str(tmp_path / "result.json"), "--log-json"]
    status = main(words)
    output = capfd.readouterr()
    events_read = lines_of(output.out)
    others = [event for event in events_read if event["event"] != "message"]
    assert (others[0]["event"], others[-1]["event"]) == ("started", "finished"), output.out
    assert [event["name"] for event in others if event["event"] == "step"] == ["rendering", "tracing", "comparing"], output.out
    assert [event["share"] for event in others if event["event"] == "progress"][-1] == 1, output.out
    assert {event["event"] for event in others[1:-1]} == {"progress", "step"}
    messages = "\n".join(event["text"] for event in events_read if event["event"] == "message")
    assert "exported and rendered" in messages and "traced 64 × 36" in messages and "objects exported whole" in messages
    assert events_read[-1]["exit_status"] == status == json.loads((tmp_path / "result.json").read_text())["exit_status"]
    assert output.err == ""


def test_events_are_heard_while_libraries_are_silent(capfd):
    with events.opened(log_json=True) as caught, silent_libraries():
        os.write(1, b"a library")
        print("a module")
        caught.tell("shot_started", shot="left")
    assert [event["shot"] for event in lines_of(capfd.readouterr().out)] == ["left"]


def test_what_goes_wrong_with_a_batch_is_said_where_there_is_no_terminal_and_nothing_else(capfd):
    with events.opened(log_json=False) as caught:
        for event, fields in BATCH:
            caught.tell(event, **fields)
    output = capfd.readouterr()
    assert output.out == ""
    failed, stopping = output.err.splitlines()
    assert failed == "viewcam batch: right: the lens is too long, shorten it"
    assert stopping.startswith("viewcam batch: SIGINT: this shot will be finished")


def program(text):
    """Words and environment that run a Python program with this project in reach."""
    return [sys.executable, "-c", text], os.environ | {"PYTHONPATH": str(Path(__file__).parent.parent)}


def test_a_terminal_shows_a_bar_and_sentences_above_it(on_a_terminal):
    pytest.importorskip("tqdm")
    status, output = on_a_terminal(*program(TELL))
    assert status == 0, output
    assert "left:" in output and "| 0/3 [" in output and "1 failed" in output
    assert "\rviewcam batch: right: the lens is too long, shorten it" in output.replace("\r\n", "\n")
    assert output.rstrip(" ").endswith("\r"), "the bar is still there at the end"


TRACE = """
import time
from viewcam_addon import events
with events.opened(log_json=False) as told:
    for percent in range(101):
        told.tell("progress", share=percent / 100)
        time.sleep({seconds} / 100)
    told.tell("error", command="render", text="the disk is full")
"""


@pytest.mark.parametrize("seconds", [0.0, 2.0])
def test_a_picture_that_takes_a_while_has_a_bar_on_a_terminal(on_a_terminal, seconds):
    pytest.importorskip("tqdm")
    status, output = on_a_terminal(*program(TRACE.format(seconds=seconds)))
    assert status == 0, output
    *drawn, last = output.replace("\r\n", "\n").split("\r")
    assert last == "viewcam render: the disk is full\n"
    assert any(re.match(r"traced \d+%\|", each) for each in drawn) == (seconds > 1), output
    assert not drawn or drawn[-1].strip() == "", f"the bar is still there when the error is told: {drawn[-1]!r}"


def test_without_tqdm_a_terminal_shows_the_sentences(on_a_terminal):
    status, output = on_a_terminal(*program("import sys; sys.modules['tqdm'] = None\n" + TELL))
    assert status == 0 and "%" not in output and len(output.splitlines()) == 2


def test_lines_of_json_that_nobody_reads_end_no_command(scene, tmp_path):
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "viewcam_addon", "render", scene, tmp_path / "out.exr", "--log-json"]
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parent.parent)}
    done = subprocess.run(command, env=environment, stdout=writer, stderr=subprocess.PIPE, check=False)
    os.close(writer)
    assert (done.returncode, done.stderr) == (0, b"") and (tmp_path / "out.exr").stat().st_size
