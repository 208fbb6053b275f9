"""One shot: its sidecar says that the other two files are there, at any moment."""

import json
import os
from pathlib import Path

import pytest

from viewcam_addon.errors import InputError
from viewcam_addon.jobs.folder import Folder, Outputs
from viewcam_addon.jobs.job import Job
from viewcam_addon.jobs.one import render_one

SHOT = Job("left.v2", (-3, -6, 2.5), (0, 0, 1), (0, 0, 1), 400, frame=12)


@pytest.fixture
def folder(tmp_path):
    return Folder(tmp_path)


def test_a_shot_is_three_files_and_the_sidecar_says_what_they_are(folder, painting):
    record = render_one(SHOT, folder, painting.Painter(), "a hash", Outputs(check=True))
    assert sorted(path.name for path in folder.path.iterdir()) == ["left.v2.exr", "left.v2.json", "left.v2.png"]
    assert record == json.loads(folder.sidecar("left.v2").read_text(encoding="utf-8")) | {"shot": record["shot"]}
    assert record["shot"] == {
        "name": "left.v2",
        "eye": (-3, -6, 2.5),
        "look_at": (0, 0, 1),
        "up": (0, 0, 1),
        "d": 400,
        "frame": 12,
    }
    assert (record["settings"], record["image"], record["preview"]) == ("a hash", "left.v2.exr", "left.v2.png")
    assert record["bytes"] == {"image": 192, "preview": 64}
    assert record["check"] == {"passed": True, "answer": "same", "verdict": "as stated"}
    assert record["rendered"] == {"width": 4, "height": 3}
    assert set(record["timing"]) == {"seconds", "finished"}


def test_two_renders_of_a_shot_differ_in_their_timing_only(tmp_path, painting):
    for name in ("one", "two"):
        render_one(SHOT, Folder(tmp_path / name), painting.Painter(pause=0.001), "a hash", Outputs(check=True))
    painting.assert_same(tmp_path / "one", tmp_path / "two")


def test_without_a_check_there_is_none_in_the_sidecar(folder, painting):
    assert "check" not in render_one(SHOT, folder, painting.Painter(), "a hash", Outputs())


@pytest.mark.parametrize("error", [InputError("no such camera: give another"), RuntimeError("a bug"), KeyboardInterrupt()])
@pytest.mark.parametrize("there_already", [False, True])
def test_a_shot_that_fails_leaves_what_was_there(folder, painting, error, there_already):
    if there_already:
        render_one(SHOT, folder, painting.Painter(seed=1), "older", Outputs())
    before = painting.contents(folder.path)
    with pytest.raises(type(error)):
        render_one(SHOT, folder, painting.Painter(broken={SHOT.name: error}), "a hash", Outputs())
    assert painting.contents(folder.path) == before


def test_a_check_that_fails_to_be_made_leaves_nothing(folder, painting):
    class Blind(painting.Painter):
        def check(self, shot, *_):
            raise InputError("the scene can't be traced: simplify it")

    with pytest.raises(InputError, match="can't be traced"):
        render_one(SHOT, folder, Blind(), "a hash", Outputs(check=True))
    assert not list(folder.path.iterdir())


def test_a_picture_that_was_not_written_is_named(folder, painting):
    class Lazy(painting.Painter):
        def render(self, shot, image, preview):
            preview.write_bytes(b"1")
            return {}

    with pytest.raises(InputError, match=r"left\.v2\.exr can't be written"):
        render_one(SHOT, folder, Lazy(), "a hash", Outputs())
    assert not list(folder.path.iterdir())


def test_there_is_a_sidecar_only_while_both_files_are_those_it_was_written_for(folder, painting, monkeypatch):
    """A process may be killed before any rename or removal: at none of them is there a sidecar of other settings' files."""
    render_one(SHOT, folder, painting.Painter(seed=1), "older", Outputs())
    pictures = {"older": _pictures(folder)}
    render_one(SHOT, Folder(folder.path / "new"), painting.Painter(seed=2), "newer", Outputs())
    pictures["newer"] = _pictures(Folder(folder.path / "new"))
    assert pictures["older"] != pictures["newer"]
    seen = []

    def look():
        if folder.sidecar(SHOT.name).exists():
            record = json.loads(folder.sidecar(SHOT.name).read_text(encoding="utf-8"))["settings"]
            assert _pictures(folder) == pictures[record], f"the sidecar of {record} settings stands beside other files"
            seen.append(record)
        else:
            seen.append(None)

    replace, unlink = os.replace, Path.unlink
    monkeypatch.setattr(os, "replace", lambda *paths: (look(), replace(*paths), look()))
    monkeypatch.setattr(Path, "unlink", lambda path, **how: (look(), unlink(path, **how), look()))
    render_one(SHOT, folder, painting.Painter(seed=2), "newer", Outputs())
    look()
    assert seen[0] == "older" and None in seen and seen[-1] == "newer", seen


def _pictures(folder):
    return folder.image(SHOT.name).read_bytes(), folder.preview(SHOT.name).read_bytes()
