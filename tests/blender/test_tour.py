"""The artist's tour (tests/real_blender/tour.py) by properties and operators, without a window. docs/artists.md shows it."""

import sys
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.append(str(ROOT / "tests" / "real_blender"))
import tour
import tour_step


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
        step.check()
        after = tour_step.state()
        assert (before != after) == bool(step.edits), f"{name} says that it makes {step.edits} undo steps"
        bpy.ops.ed.undo()
        assert not (lost := tour_step.differing(before, tour_step.state())), f"undoing {name} leaves {lost}"
        bpy.ops.ed.redo()
        assert not (lost := tour_step.differing(after, tour_step.state())), f"redoing {name} leaves {lost}"
        step.tidy()
