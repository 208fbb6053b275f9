"""One shot: its sidecar says that the other two files are there, at any moment.

Labels beside a batch's shots: whole or not at all, resumed like the pictures, none of an older frame beside a newer one.
"""

import json
import os
from pathlib import Path

import pytest

from viewcam_addon.commands._carry_out import _refuse_names_of_labels
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
    monkeypatch.setattr(Path, "unlink", lambda path, **options: (look(), unlink(path, **options), look()))
    render_one(SHOT, folder, painting.Painter(seed=2), "newer", Outputs())
    look()
    assert seen[0] == "older" and None in seen and seen[-1] == "newer", seen


def _pictures(folder):
    return folder.image(SHOT.name).read_bytes(), folder.preview(SHOT.name).read_bytes()


LABELED = Job("left", camera="Camera")
DEPTH, MASKS = Outputs(labels=("depth",)), Outputs(labels=("masks",))
LABELS_ONLY = Outputs(picture=False, labels=("depth",))


def names(folder):
    return sorted(path.name for path in folder.path.iterdir())


def test_the_sidecar_says_which_labels_stand_beside_it(folder, painting):
    render_one(LABELED, folder, painting.Painter(), "a hash", DEPTH)
    assert names(folder) == ["left.depth.png", "left.exr", "left.json", "left.labels.json", "left.png"]
    record = json.loads(folder.sidecar("left").read_text())
    assert record["labels"] == {"kinds": ["depth"], "depth_steps": 1000.0, "files": ["left.depth.png", "left.labels.json"]}
    for key in record["labels"]["files"]:
        assert record["bytes"][key] == (folder.path / key).stat().st_size


def test_labels_alone_render_nothing(folder, painting):
    painter = painting.Painter()
    record = render_one(LABELED, folder, painter, "a hash", LABELS_ONLY)
    assert names(folder) == ["left.depth.png", "left.json", "left.labels.json"] and not painter.painted
    assert "image" not in record and "image" not in record["bytes"]
    assert folder.finished("left", "a hash", LABELS_ONLY) and not folder.finished("left", "a hash", DEPTH)


def test_labels_come_to_a_picture_that_is_there_without_another_render(tmp_path, painting):
    painting.paint(tmp_path / "both", 3, labels=("depth", "masks"))
    painter = painting.Painter()
    painting.paint(tmp_path / "one by one", 3, labels=("masks",), picture=False)
    painting.paint(tmp_path / "one by one", 3, resume=True)
    assert painting.paint(tmp_path / "one by one", 3, painter=painter, labels=("depth",), resume=True).counts["done"] == 3
    assert not painter.painted and len(painter.labeled) == 3
    assert painting.contents(tmp_path / "one by one") == painting.contents(tmp_path / "both")


def test_a_batch_with_labels_is_resumed_like_one_without(tmp_path, painting):
    error = {"shot_001": InputError("the disk is lame: buy one")}
    summary = painting.paint(tmp_path, 3, painter=painting.Painter(unlabeled=error), labels=("depth",))
    assert summary.counts["failed"] == 1 and not list(tmp_path.glob("*shot_001*")), "a shot without its labels is none"
    painter = painting.Painter()
    assert painting.paint(tmp_path, 3, painter=painter, labels=("depth",), resume=True).counts["done"] == 3
    assert painter.painted == ["shot_001"] and painter.labeled == [("shot_001", ("depth",))]


def test_labels_that_fail_leave_all_as_it_was(folder, painting):
    render_one(LABELED, folder, painting.Painter(seed=1), "older", DEPTH)
    before = painting.contents(folder.path)
    with pytest.raises(InputError, match="no room"):
        failing = painting.Painter(unlabeled={"left": InputError("no room: make some")})
        render_one(LABELED, folder, failing, "newer", DEPTH)
    assert painting.contents(folder.path) == before


@pytest.mark.parametrize("outputs", [Outputs(), MASKS, Outputs(picture=False, labels=("masks",))])
def test_nothing_made_from_other_settings_stays_beside_what_is_new(folder, painting, outputs):
    render_one(LABELED, folder, painting.Painter(seed=1), "older", DEPTH)
    render_one(LABELED, folder, painting.Painter(), "newer", outputs)
    new = Folder(folder.path / "new")
    render_one(LABELED, new, painting.Painter(), "newer", outputs)
    assert set(names(folder)) - {"new"} == set(names(new))


@pytest.mark.parametrize("spoil", ["cut", "removed"])
def test_a_shot_whose_labels_are_not_whole_is_not_finished(folder, painting, spoil):
    render_one(LABELED, folder, painting.Painter(), "a hash", DEPTH)
    assert folder.finished("left", "a hash", DEPTH) and not folder.finished("left", "a hash", MASKS)
    path = folder.path / "left.depth.png"
    path.unlink() if spoil == "removed" else path.write_text("half")
    assert not folder.finished("left", "a hash", DEPTH) and not folder.finished("left", "a hash")


@pytest.mark.parametrize("file", ["../left.depth.png", "left.png/../../x", "other.png", "left.\ud800.png", 7])
def test_a_sidecar_that_tells_of_files_elsewhere_is_somebody_elses(folder, painting, file):
    render_one(LABELED, folder, painting.Painter(), "a hash", DEPTH)
    record = json.loads(folder.sidecar("left").read_text())
    record["labels"]["files"] = [file]
    folder.sidecar("left").write_text(json.dumps(record))
    assert folder.record("left") is None


def test_steps_of_depth_are_another_label(folder, painting):
    render_one(LABELED, folder, painting.Painter(), "a hash", DEPTH)
    assert folder.finished("left", "a hash", Outputs(labels=("depth",), depth_steps=256.0)) is None


def test_what_a_killed_batch_left_of_labels_is_removed(tmp_path, painting):
    (tmp_path / ".shot_000-0123abcd.labels").mkdir(parents=True)
    (tmp_path / ".shot_000-0123abcd.labels" / "shot_000.depth.png").write_text("half")
    painting.paint(tmp_path, 1, labels=("depth",))
    assert not list(tmp_path.glob(".shot*"))


def test_shots_whose_labels_would_be_another_shots_picture_are_refused():
    with pytest.raises(InputError, match=r"'a' and 'A.depth'"):
        _refuse_names_of_labels([Job("a", camera="x"), Job("A.depth", camera="x"), Job("b", camera="x")])
    _refuse_names_of_labels([Job("a", camera="x"), Job("ab.depth", camera="x")])
