"""The add-on in a window, used by mouse and keyboard on a virtual screen: handles, a first day, files of cameras, Compare with
Cycles and the artist's tour (tour.py), whose pictures `make artist-pictures` keeps.

VIEWCAM_PICTURES : a folder for pictures of the window, laid out as docs/images; without it none are taken.
"""

import contextlib
import json
import math
import os
import subprocess
import sys
from pathlib import Path

import pytest

from viewcam_addon import cameras
from viewcam_addon.pinhole import Pinhole

ROOT = Path(__file__).resolve().parent.parent.parent
PICTURES = [each for each in [os.environ.get("VIEWCAM_PICTURES")] if each]

# A virtual screen on a busy machine may lose a click: one loss is no finding, two at different times are.
ATTEMPTS = 2
TALL = (1600, 2000)
MOST_FOR_PICTURES = 3 * 3600  # seconds


def go_through(real_blender, name, *arguments, expected="", attempts=ATTEMPTS, **options):
    """Run the script NAME_in_a_window.py, which ends well, and has printed `expected` by then."""
    for attempt in range(attempts):
        words = [each(attempt) if callable(each) else each for each in arguments]
        outcome = real_blender.run_in_a_window(Path(__file__).with_name(f"{name}_in_a_window.py"), *words, **options)
        if outcome.returncode == 0:
            break
        print(outcome.stdout + outcome.stderr)  # so that it is seen of each attempt which step has failed
    output = outcome.stdout + outcome.stderr
    assert outcome.returncode == 0 and expected in output, output
    assert "Traceback" not in output, output  # a failure in a panel, a drawing or a handle is only printed
    return output


def test_handles_drag_eye_look_at_and_up_and_the_diagram_is_drawn_where_it_belongs(real_blender):
    go_through(real_blender, "handles", expected="done: disable_and_enable", size=(1000, 700))


def test_what_an_artist_tries_on_the_first_day_goes_as_with_blenders_own_cameras(real_blender, tmp_path):
    def folder(attempt):
        (path := tmp_path / str(attempt)).mkdir()
        return path

    go_through(real_blender, "artist", folder, *PICTURES, expected="done: the day", scale=1 if PICTURES else 0.5)


def test_cameras_of_colmap_fspy_and_pbrt_come_in_by_the_file_browser_a_drop_and_a_paste(real_blender, tmp_path):
    from PIL import Image

    angles = [2 * math.pi * number / 100 for number in range(100)]
    eyes = {f"shot_{i:03d}": (6 * math.cos(a), 6 * math.sin(a), 2 + math.sin(3 * a)) for i, a in enumerate(angles)}
    around = [
        cameras.Camera(name, Pinhole(eye, (0, 0, 0), (0, 0, 1), 1400, 960, 540), image=f"{name}.png")
        for name, eye in eyes.items()
    ]
    cameras.save(around, tmp_path / "sparse", "colmap")
    for camera in around:  # a missing one, or one of another size, would be told in a popup, which takes the keys
        Image.new("L", (960, 540)).save(tmp_path / "sparse" / camera.image)
    (tmp_path / "cameras_of_colmap.json").write_text(json.dumps(eyes))
    go_through(real_blender, "cameras", tmp_path, *PICTURES, expected="done: paste_pbrt")


def test_rounds_of_enabling_and_disabling_leave_nothing_behind_in_a_window(real_blender):
    go_through(real_blender, "leftovers", expected="done: leave_nothing_behind", attempts=1, size=(1000, 700))


def test_compare_with_cycles_comes_to_a_verdict_and_ends_in_every_other_way_without_a_trace(real_blender, tmp_path):
    """With the extension as it is installed, wheels and all; the last one is on its way when Blender is quit."""
    real_blender.run_inside("make", tmp_path / "scene.blend")
    output = go_through(real_blender, "proof", tmp_path / "scene.blend", tmp_path, expected="done: quit_while_it_runs")
    assert "done: write_the_labels" in output, output
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


@pytest.mark.timeout(2 * MOST_FOR_PICTURES if PICTURES else 1200)
def test_the_tour_goes_through_and_each_of_its_steps_is_undone_and_redone(real_blender, tmp_path):
    """With VIEWCAM_PICTURES the pictures of docs/artists.md are taken instead."""
    if PICTURES:
        take_the_pictures(real_blender, tmp_path, ROOT / PICTURES[0])
    else:
        go_through(real_blender, "tour", size=TALL, scale=0.5)


def take_the_pictures(real_blender, scratch, images):
    """The tour's, the README's moving one, and those of docs/artists.md that no step of the tour takes."""
    artists = images / "artists"
    artists.mkdir(parents=True, exist_ok=True)
    go_through(real_blender, "tour", artists, attempts=1, size=TALL, patience=MOST_FOR_PICTURES)  # drawn finely
    make_the_moving_picture(real_blender, scratch / "frames", images / "moving.webp")
    photo = scratch / "photo.png"
    subprocess.run([sys.executable, Path(__file__).with_name("photo_of_a_room.py"), photo], check=True)
    go_through(real_blender, "pictures", images, photo, attempts=1)


def make_the_moving_picture(real_blender, frames, target):
    from PIL import Image

    frames.mkdir()
    go_through(real_blender, "moving_picture", frames, attempts=1)
    first, *rest = [Image.open(path).convert("RGB") for path in sorted(frames.glob("frame-*.png"))]
    first.save(target, save_all=True, append_images=rest, duration=90, loop=0, quality=48)
