"""The way of an edit, from the property to Blender's camera: as short as it can be read, and down only."""

import re
import sys
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")

import viewcam_addon

PACKAGE = Path(viewcam_addon.__file__).parent
# The layers, from below. All that is outside blender/ lies below them, and is plain mathematics here.
ROOMS = [
    *("versions", "datablocks", "preferences", "pose", "storage", "targets", "hold", "findings", "causes"),
    *("conversion", "camera", "resolution", "animation", "properties"),
]
BY_BLENDER = {
    "on_update",
    "_on_update",
    "on_frame_change",
    "_edit_of",
}  # called by Blender as it evaluates, and as a property is stored
MOST = 30


def walk_of(action):
    """The functions of this package that a call runs: ({(room, function)} of blender/, [calls from a room to one above it])."""
    functions, upward, stack = set(), [], [None]

    def note(frame, event, _argument):
        if event == "call":
            path, name = Path(frame.f_code.co_filename), frame.f_code.co_qualname.split(".<locals>")[0]
            caller = stack[-1]
            if PACKAGE not in path.parents:
                stack.append(caller)
                return
            inside = path.relative_to(PACKAGE).parts
            here = (inside[1].removesuffix(".py") if inside[0] == "blender" else "", name)
            if here[0]:
                functions.add(here)
            if caller and name not in BY_BLENDER and level(here[0]) > level(caller[0]):
                upward.append(f"{caller} → {here}")
            stack.append(here)
        elif event == "return" and len(stack) > 1:
            stack.pop()

    sys.setprofile(note)
    try:
        action()
    finally:
        sys.setprofile(None)
    return functions, upward


def level(room):
    return ROOMS.index(room) if room in ROOMS else len(ROOMS) if room else -1


EDITS = {"eye": (7, -6, 6), "look_at": (0, 1, 1), "up": (0, 1, 1), "distance": 800.0, "zoom": 2.0}


@pytest.mark.parametrize("name", EDITS)
@pytest.mark.parametrize("keeps", ["PIXELS", "FIELD_OF_VIEW"])
def test_an_edit_passes_few_functions_and_none_calls_upward(posed_camera, name, keeps):
    group = posed_camera.virtual_pinhole
    group.eye, group.keeps = (7, -6, 5.5), keeps
    bpy.context.view_layer.update()
    functions, upward = walk_of(lambda: setattr(group, name, EDITS[name]))
    assert ("conversion", "place") in functions
    assert not upward, upward
    assert len(functions) <= MOST, sorted(functions)


def calls_of(action):
    """(module, function) of this package as a call enters them, in order."""
    entered = []

    def note(frame, event, _argument):
        path = Path(frame.f_code.co_filename)
        if event == "call" and PACKAGE in path.parents:
            entered.append((path.stem, frame.f_code.co_name))

    sys.setprofile(note)
    try:
        action()
    finally:
        sys.setprofile(None)
    return entered


def test_an_edit_goes_the_way_that_contributing_says(posed_camera):
    posed_camera.virtual_pinhole.eye = (7, -6, 5.5)
    bpy.context.view_layer.update()
    page = (PACKAGE.parent / "CONTRIBUTING.md").read_text(encoding="utf-8")
    lines = page[page.index("An edit of a value") :].split("\n\n")[1].splitlines()
    way = [re.search(r"(\w+)\.py`: `(\w+)`", line).groups() for line in lines]
    assert len(way) == 5 and way[0][0] == "properties"
    entered = calls_of(lambda: setattr(posed_camera.virtual_pinhole, "eye", (7, -6, 6)))
    firsts = [entered.index(step) for step in way]
    assert firsts == sorted(firsts), f"{way} are entered at {firsts}"


def test_a_move_in_blender_comes_back_without_a_call_upward(posed_camera):
    posed_camera.virtual_pinhole.eye = (7, -6, 5.5)
    bpy.context.view_layer.update()
    posed_camera.location.x = 3
    functions, upward = walk_of(bpy.context.view_layer.update)
    assert ("camera", "CameraSync.updated") in functions and ("storage", "store") in functions
    assert not upward, upward


def test_no_edit_calls_upward_whatever_the_camera_is_set_to(posed_camera, empty):
    group = posed_camera.virtual_pinhole
    group.look_at_target = empty("Target", (1, 2, 3))
    group.pole, group.keeps = "HOLD", "FIELD_OF_VIEW"
    posed_camera.parent = empty("Parent", (0, 0, 1))
    bpy.context.view_layer.update()
    for name in ("eye", "distance", "roll"):
        value = 0.5 if name == "roll" else EDITS[name]
        functions, upward = walk_of(lambda name=name, value=value: setattr(group, name, value))
        assert ("conversion", "place") in functions and not upward, upward


def test_a_call_upward_is_seen(posed_camera, monkeypatch):
    from viewcam_addon.blender import camera, storage

    monkeypatch.setattr(storage, "_frame", lambda _: camera.CameraSync.of(posed_camera) and None)
    _, upward = walk_of(lambda: setattr(posed_camera.virtual_pinhole, "eye", (1, 2, 3)))
    assert any("camera" in each for each in upward)
