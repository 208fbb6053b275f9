"""The artist's tour in a window (tour.py), by mouse and keys on a virtual screen; `make artist-pictures` keeps its pictures."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
SCRIPT = Path(__file__).with_name("tour_in_a_window.py")
# A virtual screen on a busy machine may lose a click: one loss is no finding, two at different times are.
ATTEMPTS = 2
TALL = (1600, 2000)
MOVING_SCRIPT = Path(__file__).with_name("moving_picture.py")
PHOTO, PICTURES_SCRIPT = (Path(__file__).with_name(name) for name in ("photo_of_a_room.py", "pictures_in_a_window.py"))


def test_the_tour_goes_through_and_each_of_its_steps_is_undone_and_redone(real_blender, tmp_path):
    """VIEWCAM_PICTURES : a folder for the pictures of docs/artists.md, which are taken instead."""
    if folder := os.environ.get("VIEWCAM_PICTURES"):
        take_the_pictures(real_blender, tmp_path, ROOT / folder)
        return
    for _ in range(ATTEMPTS):
        outcome = real_blender.run_in_a_window(SCRIPT, size=TALL, scale=0.5)
        if outcome.returncode == 0:
            break
    assert_it_went_through(outcome)


def assert_it_went_through(outcome):
    output = outcome.stdout + outcome.stderr
    assert outcome.returncode == 0, output
    assert "Traceback" not in output, output  # what fails in a panel's draw() is only printed


def take_the_pictures(real_blender, scratch, folder):
    """The tour's, the README's moving one, and those of docs/artists.md that no step of the tour takes."""
    images = folder.parent
    assert_it_went_through(real_blender.run_in_a_window(SCRIPT, folder, size=TALL, patience=3 * 3600))  # drawn finely
    make_the_moving_picture(real_blender, scratch / "frames", images / "moving.webp")
    photo = scratch / "photo.png"
    subprocess.run([sys.executable, PHOTO, photo], check=True)
    assert_it_went_through(real_blender.run_in_a_window(PICTURES_SCRIPT, images, photo))


def make_the_moving_picture(real_blender, frames, target):
    from PIL import Image

    frames.mkdir()
    assert_it_went_through(real_blender.run_in_a_window(MOVING_SCRIPT, frames))
    first, *rest = [Image.open(path).convert("RGB") for path in sorted(frames.glob("frame-*.png"))]
    first.save(target, save_all=True, append_images=rest, duration=90, loop=0, quality=48)
