"""The handles and Compare with Cycles in a window, used by mouse and keyboard on a virtual screen."""

import contextlib
import json
import math
import os
from pathlib import Path

from viewcam_addon import cameras
from viewcam_addon.pinhole import Pinhole

ROOT = Path(__file__).resolve().parent.parent.parent
HANDLES_SCRIPT = Path(__file__).with_name("handles_in_a_window.py")
PROOF_SCRIPT = Path(__file__).with_name("proof_in_a_window.py")

# A gray pixel.
PNG = bytes.fromhex(
    "89504e470d0a1a0a0000000d49484452000000010000000108000000003a7e9b55"
    "0000000a49444154789c636800000082008177cd72b60000000049454e44ae426082"
)

# A virtual screen on a busy machine may lose a click: one loss is no finding, two at different times are.
ATTEMPTS = 2


def last_of(attempts):
    """The first outcome that is well, or the last. What the others said is printed, so that it is seen which step failed."""
    for outcome in attempts:
        if outcome.returncode == 0:
            break
        print(outcome.stdout + outcome.stderr)
    return outcome


def test_handles_drag_eye_look_at_and_up_and_the_diagram_is_drawn_where_it_belongs(real_blender):
    outcome = last_of(real_blender.run_in_a_window(HANDLES_SCRIPT, size=(1000, 700)) for _ in range(ATTEMPTS))
    output = outcome.stdout + outcome.stderr
    assert outcome.returncode == 0 and "done: disable_and_enable" in output, output
    assert "Traceback" not in output, output  # what fails in a drawing or a handle is only printed


def test_what_an_artist_tries_on_the_first_day_goes_as_with_blenders_own_cameras(real_blender, tmp_path):
    """VIEWCAM_PICTURES : a folder for pictures of the window; without it none are taken."""
    folder = [each for each in [os.environ.get("VIEWCAM_PICTURES")] if each]
    script = Path(__file__).with_name("artist_in_a_window.py")
    folders = [tmp_path / str(attempt) for attempt in range(ATTEMPTS)]
    for each in folders:
        each.mkdir()
    outcome = last_of(real_blender.run_in_a_window(script, each, *folder, scale=1 if folder else 0.5) for each in folders)
    output = outcome.stdout + outcome.stderr
    assert outcome.returncode == 0 and "done: the day" in output, output
    assert "Traceback" not in output, output


def test_cameras_of_colmap_fspy_and_pbrt_come_in_by_the_file_browser_a_drop_and_a_paste(real_blender, tmp_path):
    """VIEWCAM_PICTURES : a folder for pictures of the window; without it none are taken."""
    angles = [2 * math.pi * number / 100 for number in range(100)]
    eyes = {f"shot_{i:03d}": (6 * math.cos(a), 6 * math.sin(a), 2 + math.sin(3 * a)) for i, a in enumerate(angles)}
    around = [
        cameras.Camera(name, Pinhole(eye, (0, 0, 0), (0, 0, 1), 1400, 960, 540), image=f"{name}.png")
        for name, eye in eyes.items()
    ]
    cameras.save(around, tmp_path / "sparse", "colmap")
    for camera in around:  # what is not found would be told in a popup, which takes the keys
        (tmp_path / "sparse" / camera.image).write_bytes(PNG)
    (tmp_path / "cameras_of_colmap.json").write_text(json.dumps(eyes))
    folder = [each for each in [os.environ.get("VIEWCAM_PICTURES")] if each]
    script = Path(__file__).with_name("cameras_in_a_window.py")
    outcome = last_of(real_blender.run_in_a_window(script, tmp_path, *folder) for _ in range(ATTEMPTS))
    output = outcome.stdout + outcome.stderr
    assert outcome.returncode == 0 and "done: paste_pbrt" in output, output
    assert "Traceback" not in output, output


def test_rounds_of_enabling_and_disabling_leave_nothing_behind_in_a_window(real_blender):
    outcome = real_blender.run_in_a_window(ROOT / "tests" / "real_blender" / "leftovers_in_a_window.py", size=(1000, 700))
    output = outcome.stdout + outcome.stderr
    assert outcome.returncode == 0 and "done: leave_nothing_behind" in output, output
    assert "Traceback" not in output, output


def test_compare_with_cycles_comes_to_a_verdict_and_ends_in_every_other_way_without_a_trace(real_blender, tmp_path):
    """With the extension as it is installed, wheels and all; the last one is on its way when Blender is quit."""
    real_blender.run_inside("make", tmp_path / "scene.blend")
    outcome = last_of(real_blender.run_in_a_window(PROOF_SCRIPT, tmp_path / "scene.blend", tmp_path) for _ in range(ATTEMPTS))
    output = outcome.stdout + outcome.stderr
    assert outcome.returncode == 0 and "done: write_the_labels" in output and "done: quit_while_it_runs" in output, output
    assert "Traceback" not in output, output
    folder = (tmp_path / "last.txt").read_text()
    assert not Path(folder).exists()
    assert [line for line in _command_lines() if folder in line] == []


def _command_lines():
    """The command lines of the processes that run."""
    lines = []
    for file in Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):  # it has just ended
            lines.append(file.read_bytes().decode(errors="replace"))
    return lines
