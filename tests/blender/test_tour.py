"""The artist's tour (tests/real_blender/tour.py) by properties and operators, without a window. docs/artists.md shows it."""

import re
import sys
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.append(str(ROOT / "tests" / "real_blender"))
import tour
import tour_step

pytestmark = pytest.mark.slow

PAGE = ROOT / "docs" / "artists.md"
OTHER_PICTURES = ROOT / "tests" / "real_blender" / "pictures_in_a_window.py"


def test_every_step_does_what_it_is_for_and_is_undone_and_redone(fresh_blender):
    bpy.context.preferences.edit.use_global_undo = True
    tour_step.make_the_scene()
    for step in (each() for each in tour.STEPS if not each.needs_a_window):
        name = type(step).__name__
        step.prepare()
        bpy.context.view_layer.update()
        bpy.ops.ed.undo_push(message="before")
        before = tour_step.state()
        step.by_script()
        bpy.context.view_layer.update()
        bpy.ops.ed.undo_push(message="after")
        after = tour_step.state()
        step.check()
        assert (before != after) == bool(step.edits), f"{name} says that it makes {step.edits} undo steps"
        bpy.ops.ed.undo()
        assert not (lost := tour_step.differing(before, tour_step.state())), f"undoing {name} leaves {lost}"
        bpy.ops.ed.redo()
        assert not (lost := tour_step.differing(after, tour_step.state())), f"redoing {name} leaves {lost}"
        step.tidy()


def test_every_picture_of_the_page_is_taken_once_by_a_step_or_by_itself():
    present = set(re.findall(r"\(images/artists/([^)]+)\)", PAGE.read_text(encoding="utf-8")))
    by_itself = re.findall(r'"artists" / "([^"]+)"', OTHER_PICTURES.read_text(encoding="utf-8"))
    taken = [*(step.picture for step in tour.STEPS if step.picture), *by_itself]
    assert by_itself and len(taken) == len(set(taken)), f"one picture is taken twice, or none by itself: {sorted(taken)}"
    assert present == set(taken)
    folder = PAGE.parent / "images" / "artists"
    assert present == {path.name for path in folder.iterdir()}, "docs/images/artists holds other pictures than the page shows"
    assert sum((folder / name).stat().st_size for name in present) < 2.5e6, "the pictures are too large for a page"
