"""A Blender that crashes is a sentence and a status, for every command of the shell that starts one."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from viewcam_addon import cameras, child_process, crashes
from viewcam_addon.pinhole import Pinhole

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="Windows tells of a crash itself")


@pytest.fixture
def run(tmp_path):
    """A function: what Blender does as it is loaded, words of viewcam → the process."""
    (tmp_path / "file.blend").write_bytes(b"BLENDER-v402")
    dataset = cameras.write([cameras.Camera("1", Pinhole((0, -5, 0), (0, 0, 0), (0, 0, 1), 64, 64, 36))], "transforms")
    (tmp_path / "transforms.json").write_text(dataset)

    def start(does, *words):
        (tmp_path / "bpy.py").write_text(does)
        variables = child_process.environment()
        variables["PYTHONPATH"] = os.pathsep.join([str(tmp_path), variables["PYTHONPATH"]])
        variables.pop("VIEWCAM_BLENDER", None)
        options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, "cwd": tmp_path, "env": variables}
        return subprocess.Popen(child_process.viewcam(*words), start_new_session=True, preexec_fn=heeds_ctrl_c, **options)

    # A shell lets what it starts in the background ignore Ctrl-C, and all that these tests start would, too.
    def heeds_ctrl_c():
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    return start


CRASH = "import os, signal\nos.kill(os.getpid(), signal.SIGSEGV)"
WORDS = {
    "export": ["file.blend", "scene.json"],
    "cycles": ["file.blend", "out.exr"],
    "check": ["file.blend"],
    "demo": [],
    "batch": ["file.blend", "--orbit", "2", "--out", "out"],
    "audit": ["transforms.json", "--blend", "file.blend"],
    "batch --workers": ["file.blend", "--orbit", "2", "--out", "out", "--workers", "1"],
}


def test_every_command_that_opens_a_blend_is_looked_after():
    assert set(crashes.COMMANDS) == {command.split()[0] for command in WORDS}


@pytest.mark.parametrize(
    "command", ["check", *(pytest.param(each, marks=pytest.mark.exhaustive) for each in WORDS if each != "check")]
)
def test_a_blender_that_crashes_is_one_sentence_and_status_2(run, command):
    words, command = WORDS[command], command.split()[0]
    child = run(CRASH, command, *words)
    _, errors = child.communicate()
    assert child.returncode == 2, errors
    (sentence,) = errors.splitlines()
    assert sentence.startswith(f"viewcam {command}: ") and "see that the file is whole" in sentence
    assert "SIGSEGV" in sentence or "signal 11" in sentence
    assert ("studio" if command == "demo" else "file.blend") in sentence


def test_the_crash_is_in_the_json_and_among_the_events_too(run, tmp_path):
    child = run(CRASH, "check", "file.blend", "--json", "result.json", "--log-json")
    events = [json.loads(line)["event"] for line in child.communicate()[0].splitlines()]
    assert events == ["started", "error", "finished"]
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["exit_status"] == 2 and "SIGSEGV" in result["error"]


def test_a_status_of_its_own_is_passed_on(run):
    child = run("raise ImportError('no bpy for this Python')", "export", "file.blend", "scene.json")
    assert child.communicate()[1].count("viewcam export: ") == 1 and child.returncode == 2


WAIT = "import os, time\nopen('waits', 'w').write(str(os.getpid()))\nos.replace('waits', 'waiting')\ntime.sleep(600)"


@pytest.mark.parametrize("name", ["SIGTERM", "SIGKILL"])
def test_whoever_ends_the_command_ends_blender(run, tmp_path, name):
    number = getattr(signal, name)
    if number == signal.SIGKILL and sys.platform != "linux":
        pytest.skip("only Linux tells a process that its parent was killed")
    child = run(WAIT, "check", "file.blend")
    while not (tmp_path / "waiting").exists():
        time.sleep(0.02)
    blender = int((tmp_path / "waiting").read_text())
    assert blender != child.pid
    child.send_signal(number)
    child.communicate()
    assert child.returncode == (-number if number == signal.SIGKILL else 128 + number)
    while Path(f"/proc/{blender}").exists() and Path(f"/proc/{blender}/stat").read_text().rpartition(")")[2].split()[0] != "Z":
        time.sleep(0.02)


RENDER = """
import os, time
from viewcam_addon.files import temporary_folder, written_whole
with written_whole("picture.exr") as half, temporary_folder() as folder:
    half.touch()
    (folder / "scene.json").touch()
    os.symlink(folder, "waiting")
    while True:
        try:
            time.sleep(600)
        except BaseException:
            pass
"""


@pytest.mark.parametrize("send", [os.kill, getattr(os, "killpg", None)], ids=["kill", "terminal"])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_what_renders_at_once_and_leaves_nothing_half_written(run, tmp_path, send, number):
    """While Cycles rendered, Ctrl-C did nothing: Python hears of it afterwards, and Blender's handlers swallowed it."""
    child = run(RENDER, "check", "file.blend")
    while not (tmp_path / "waiting").exists():
        time.sleep(0.02)
    folder = (tmp_path / "waiting").resolve()
    assert folder.exists()
    send(child.pid, number)
    started = time.monotonic()
    assert child.communicate(timeout=60)[1] == "" and child.returncode == 128 + number
    assert time.monotonic() - started < 30
    (tmp_path / "waiting").unlink()
    left = {path.name for path in tmp_path.iterdir()}
    assert left <= {"file.blend", "transforms.json", "bpy.py", "__pycache__"} and not folder.exists(), left


@pytest.mark.parametrize("send", [os.kill, getattr(os, "killpg", None)], ids=["kill", "terminal"])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_to_a_batch_counts_once_whether_one_process_has_it_or_both(run, tmp_path, send, number):
    child = run(WAIT, "batch", "file.blend", "--orbit", "2", "--out", "out", "--log-json")
    while not (tmp_path / "waiting").exists():
        time.sleep(0.02)
    send(child.pid, number)
    output = (json.loads(line) for line in child.stdout)
    assert next(event for event in output if event["event"] == "stopping")["signal"] == number.name
    time.sleep(0.5)  # in which a second one would have ended it
    assert child.poll() is None
    send(child.pid, number)
    child.communicate()
    assert child.returncode == 128 + number


@pytest.mark.parametrize("command", ["batch", "check"])
def test_a_signal_that_comes_when_blender_has_ended_changes_no_status(command):
    late = f"""
import os, signal
from viewcam_addon import crashes
waitpid = os.waitpid
def wait_and_be_signaled(*process):
    ended = waitpid(*process)
    os.kill(os.getpid(), signal.SIGTERM)
    return ended
os.waitpid = wait_and_be_signaled
if crashes.survived([{command!r}]) is None:
    os._exit(143)
"""
    ended = subprocess.run(
        [sys.executable, "-c", late], env=child_process.environment(), capture_output=True, text=True, check=False
    )
    assert ended.returncode == 143, ended.stderr
