"""Printed text shows itself and nothing else: no name from a file writes a line of its own or moves the cursor.

The events of a command on its way: JSON lines alone on standard output, sentences on standard error, a bar on a terminal.
"""

import ast
import json
import os
import re
import shlex
import subprocess
import sys
import unicodedata
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon import events
from viewcam_addon.cli import main
from viewcam_addon.terminal import plain, silent_libraries

PACKAGE = Path(__file__).resolve().parent.parent / "viewcam_addon"

FORGED = "All is well: passed"
HOSTILE = f"Wall\n{FORGED}\r\x1b[2K\x1b[1A\x9b31m\u2028{FORGED}\u202eklaw\u2066\x07\x08\x7f"
"""A name that ends its line, clears it, goes up, turns red, and turns the direction of the text."""


def assert_shows_itself(text):
    """Nothing but characters that show themselves, and no line that a name has written."""
    for line in text.splitlines():
        assert all(character.isprintable() for character in line), f"{line!r} does not show itself"
        assert not line.startswith(FORGED), f"a name has written the line {line!r}"


@given(st.text() | st.text(st.characters(categories=["C", "Z"])))
def test_what_is_plain_is_one_line_that_shows_itself_and_is_plain_already(text):
    escaped = plain(text)
    assert len(escaped.splitlines()) <= 1 and plain(escaped) == escaped
    assert all(unicodedata.category(character)[0] != "C" for character in escaped)
    escaped.encode("utf-8")  # a lone surrogate could not be printed


@given(st.text(st.characters(categories=["L", "M", "N", "P", "S", "Zs"])))
def test_what_people_write_stays_as_it_is(text):
    assert plain(text) == text


@pytest.mark.parametrize(
    ("text", "escaped"),
    [
        ("a\nb", r"a\nb"),
        ("\x1b[2K", r"\x1b[2K"),
        ("\x9b", r"\x9b"),
        ("\u202e", r"\u202e"),
        ("\u2028", r"\u2028"),
        ("\udcff", r"\udcff"),
        ("left\N{NO-BREAK SPACE}eye: 64 × 48, 10⁻⁶, 左, é", "left\N{NO-BREAK SPACE}eye: 64 × 48, 10⁻⁶, 左, é"),
    ],
)
def test_an_escape_says_which_character_it_was(text, escaped):
    assert plain(text) == escaped


def test_everything_is_printed_by_the_one_that_makes_it_plain():
    """`print` and the streams stand where they are plain, or where this list says why they need not be."""
    allowed = {
        "terminal.py": {"print", "stdout", "stderr"},  # say() and the streams themselves
        "events.py": set(),  # its streams are copies; what it writes is plain or JSON in ASCII
        "blender/animation.py": {"print", "stderr"},  # plain, as the test below sees
        "files.py": {"stdout", "stderr"},  # flushed
        "__main__.py": {"stdout", "stderr"},  # flushed
        "child_process.py": {"stdout", "stderr"},  # flushed; those of child processes
        "commands/_options.py": {"stdout"},  # flushed
    }
    result = {}
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            name = None
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
                name = node.func.id
            elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "sys":
                name = node.attr
            if name in ("print", "stdout", "stderr"):
                result.setdefault(path.relative_to(PACKAGE).as_posix(), set()).add(name)
    extra = {path: names - allowed.get(path, set()) for path, names in result.items()}
    assert not {path: names for path, names in extra.items() if names}, "print with terminal.say"


@pytest.fixture
def scene(tmp_path):
    """A scene file of strangers, with a name that is written to forge."""
    camera = {"eye": [0, -5, 0], "look_at": [0, 0, 0], "up": [0, 0, 1], "distance": 10, "width": 8, "height": 6}
    document = {
        "format": "virtual-pinhole-scene",
        "version": 1,
        "camera": camera,
        "geometries": {"ball": {"type": "spheres", "centers": [[0, 0, 0]], "radii": [1]}},
        "objects": [{"name": HOSTILE, "geometry": "ball"}],
        "ledger": [{"object": HOSTILE, "status": "skipped", "reason": HOSTILE}, {"object": HOSTILE, "status": "exported"}],
    }
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


def test_a_comparison_prints_the_names_of_a_scene_plain(scene, tmp_path, capfd):
    picture = tmp_path / "picture.exr"
    assert main(["render", str(scene), str(picture), "--level", "path", "--samples", "1"]) == 0
    assert main(["render", str(scene), str(picture)]) == 0
    assert main(["compare", str(picture), str(picture), "--scene", str(scene), "--report", str(tmp_path / "report")]) == 0
    output = capfd.readouterr()
    assert_shows_itself(output.out + output.err)
    assert rf"skipped, Wall\n{FORGED}\r\x1b[2K" in output.out, "the test's name never reached the terminal"


@pytest.mark.parametrize("change", ["key", "name", "geometry", "path", "word", "suffix", "camera"])
def test_an_error_shows_what_it_names_plain(scene, tmp_path, capfd, change):
    document, words = json.loads(scene.read_text()), ["render", str(scene), str(tmp_path / "out.exr")]
    if change == "key":
        document[HOSTILE] = 1
    elif change == "name":
        document["objects"][0]["matrix"] = [[0] * 4] * 4
    elif change == "geometry":
        document["objects"][0]["geometry"] = HOSTILE
    elif change == "camera":
        document["camera"][HOSTILE] = HOSTILE
    elif change == "path":
        words[1] = str(tmp_path / HOSTILE)
    elif change == "word":
        words.append(f"--{HOSTILE}")
    else:
        words = ["batch", str(tmp_path / "a.blend"), str(tmp_path / f"shots.{HOSTILE}"), "--out", str(tmp_path / HOSTILE)]
    scene.write_text(json.dumps(document))
    for more in ([], ["--log-json"]):
        assert main([*words, *more]) == 2
        output = capfd.readouterr()
        assert output.err and len(output.err.splitlines()) == 1
        assert_shows_itself(output.out + output.err)


def test_a_list_of_problems_is_as_many_lines_as_problems(tmp_path, capfd):
    pytest.importorskip("bpy")
    rows = [
        {"name": HOSTILE, "camera": HOSTILE},
        {"name": "b", "camera": "None", HOSTILE: 1},
        {"name": "c", "eye": HOSTILE, "look_at": [0, 0, 0], "up": [0, 0, 1], "d": 1},
    ]
    path = tmp_path / "shots.json"
    path.write_text(json.dumps(rows))
    blend = PACKAGE.parent / "sample_scenes" / "cornell.blend"
    assert main(["batch", str(blend), str(path), "--out", str(tmp_path / "out"), "--json", str(tmp_path / "out.json")]) == 2
    output = capfd.readouterr().err
    assert_shows_itself(output)
    assert len(output.splitlines()) == 1 + len(json.loads((tmp_path / "out.json").read_text())["problems"])


@pytest.mark.exhaustive
def test_names_in_a_blend_are_printed_plain(fresh_blender, tmp_path):
    """Blender keeps any character in a name: what is exported, what a batch lists, and what a comparison leaves out."""
    bpy = fresh_blender
    name = HOSTILE[:60]
    data = bpy.data.cameras.new(name)
    camera = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    camera.location.z = 5
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.name = name
    bpy.context.object.modifiers.new(name, "PARTICLE_SYSTEM").particle_system.settings.type = "HAIR"
    bpy.context.object.particle_systems[0].settings.count = 3
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "names.blend"))
    for words in (
        ["export", "names.blend", "scene.json", "--size", "8x6"],
        ["check", "names.blend", "--size", "8x6"],
        ["export", "names.blend", "scene.json", "--camera", "None"],
        ["batch", "names.blend", "--cameras", "None*", "--out", "out"],
        ["batch", "names.blend", "--cameras", "*", "--out", "out"],
        ["batch", "names.blend", "--frames", "1..2", "--camera", "None", "--out", "out"],
    ):
        command = [sys.executable, "-m", "viewcam_addon", *words]
        environment = os.environ | {"PYTHONPATH": str(PACKAGE.parent)}
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, check=False, text=True)
        assert "bug" not in done.stderr, done.stderr
        assert_shows_itself(done.stdout + done.stderr)
        assert r"\x1b" in done.stdout + done.stderr or words[0] == "check", f"{words}: the name never reached the terminal"


@pytest.mark.parametrize("encoding", ["cp1252", "cp437", "ascii"])
def test_a_name_that_a_code_page_has_no_characters_for_is_printed_as_escapes(encoding, tmp_path):
    """A redirected output has such a page on Windows, and nothing there says which."""
    (tmp_path / "日本.json").write_text('{"format": 0}', encoding="utf-8")
    for words in (["batch", "--help"], ["camera", "日本.json"], ["render", "日本.json", "日本.exr"]):
        environment = os.environ | {"PYTHONPATH": str(PACKAGE.parent), "PYTHONIOENCODING": f"{encoding}:strict"}
        command = [sys.executable, "-m", "viewcam_addon", *words]
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, check=False, encoding=encoding)
        assert "bug" not in done.stderr and "Traceback" not in done.stderr, done.stderr
        assert done.stdout or r"\u65e5\u672c" in done.stderr, done.stderr


def test_what_a_camera_can_not_be_at_a_frame_is_printed_plain(fresh_blender, capfd):
    bpy = fresh_blender
    camera = bpy.data.objects.new(HOSTILE[:60], bpy.data.cameras.new("Camera"))
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    camera.virtual_pinhole.enabled = True
    camera.virtual_pinhole.keyframe_insert("eye", frame=1)
    camera.virtual_pinhole.eye = camera.virtual_pinhole.look_at
    camera.virtual_pinhole.keyframe_insert("eye", frame=10)
    capfd.readouterr()
    bpy.context.scene.frame_set(10)
    output = capfd.readouterr().err
    assert "viewcam: frame 10" in output
    assert_shows_itself(output)


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
def plain_scene(tmp_path):
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(SCENE))
    return path


def test_each_event_is_a_line_of_json_with_its_time_and_nothing_else_is_on_standard_output(plain_scene, tmp_path, capfd):
    assert main(["render", str(plain_scene), str(tmp_path / "out.exr"), "--log-json"]) == 0
    output = capfd.readouterr()
    events_read = lines_of(output.out)
    started, message, finished = (event for event in events_read if event["event"] != "progress")
    assert [event["event"] for event in (started, message, finished)] == ["started", "message", "finished"]
    shares = [event["share"] for event in events_read if event["event"] == "progress"]
    assert shares[0] == 0 and shares[-1] == 1 and shares == sorted(set(shares)), shares
    assert started["command"] == "render" and shlex.split(started["words"])[-2:] == [str(tmp_path / "out.exr"), "--log-json"]
    assert message["text"].startswith("traced 64 × 48 pixels in ")
    assert finished["exit_status"] == 0 and 0 < finished["seconds"] < 600
    assert started["time"] <= message["time"] <= finished["time"] and started["time"].endswith("+00:00")
    assert output.err == ""


def test_an_error_is_an_event_and_a_sentence(tmp_path, capfd):
    assert main(["render", str(tmp_path / "none.json"), str(tmp_path / "out.exr"), "--log-json"]) == 2
    output = capfd.readouterr()
    _, error, finished = lines_of(output.out)
    assert error["event"] == "error" and finished["exit_status"] == 2
    assert output.err.splitlines() == [f"viewcam render: {error['text']}"] and "none.json" in error["text"]


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
    assert output.err.splitlines() == [f"{'viewcam ' + command if command else 'viewcam'}: {error['text']}"]
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
    with events.opened(log_json=False) as caught:
        caught.tell("started", command="check", words="check a.blend --frames 1..2")
        caught.tell("shot_failed", shot="right", error="its camera is none")
    assert capfd.readouterr().err == "viewcam check: right: its camera is none\n"


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


def test_lines_of_json_that_nobody_reads_end_no_command(plain_scene, tmp_path):
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "viewcam_addon", "render", plain_scene, tmp_path / "out.exr", "--log-json"]
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parent.parent)}
    done = subprocess.run(command, env=environment, stdout=writer, stderr=subprocess.PIPE, check=False)
    os.close(writer)
    assert (done.returncode, done.stderr) == (0, b"") and (tmp_path / "out.exr").stat().st_size
