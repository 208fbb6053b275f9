"""A batch does all of its shots, whatever happens on the way, and its folder tells how far it came.

A batch that dies between any two steps: the folder tells the truth, and --resume ends as if nothing had been.

Random moments, with Blender, are in tests/test_batch_disturbed.py.
"""

import errno
import json
import os
import shutil
import subprocess
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.errors import FullDiskError, InputError
from viewcam_addon.jobs import run
from viewcam_addon.jobs.folder import Folder, Outputs

FULL = FullDiskError("a.exr can't be written (No space left on device): choose another folder or free some space")
UNCHECKED = {"checked": 0, "checks_failed": 0, "not_all_modeled": 0}


def test_a_batch_leaves_its_shots_a_summary_and_a_contact_sheet(tmp_path, painting):
    summary = painting.paint(tmp_path, 3)
    shots = {f"shot_00{i}.{suffix}" for i in range(3) for suffix in ("exr", "png", "json")}
    assert {path.name for path in tmp_path.iterdir()} == shots | {"summary.json", "contact-sheet.html", ".viewcam.lock"}
    assert summary.exit_status == 0
    assert summary.counts == {"shots": 3, "done": 3, "failed": 0, "left": 0, **UNCHECKED}
    assert json.loads((tmp_path / "summary.json").read_text(encoding="utf-8")) == summary.to_json()


def test_events_tell_what_happens(tmp_path, painting):
    events = painting.Listener()
    painting.paint(tmp_path, 2, events=events, painter=painting.Painter(broken={"shot_001": InputError("no light: add some")}))
    (first, begun), *shots, (last, end) = events.heard
    assert (first, begun) == ("batch_started", {"shots": 2, "kept": 0, "folder": tmp_path})
    done = {"shot": "shot_000", "seconds": shots[1][1]["seconds"], "image": tmp_path / "shot_000.exr", "passed": None}
    assert shots == [
        ("shot_started", {"shot": "shot_000"}),
        ("shot_done", done),
        ("shot_started", {"shot": "shot_001"}),
        ("shot_failed", {"shot": "shot_001", "error": "no light: add some"}),
    ]
    counts = {"done": 1, "kept": 0, "elsewhere": 0, "failed": 1, "left": 0, "exit_status": 4}
    assert (last, end) == ("batch_finished", counts | {"seconds": end["seconds"]})


@pytest.mark.parametrize(
    ("error", "sentence"),
    [
        (InputError("no light: add some"), "no light: add some"),
        (KeyError("light"), "this is a bug, please report it (KeyError"),
    ],
)
def test_a_shot_that_fails_is_reported_and_the_rest_go_on(tmp_path, painting, error, sentence):
    painter = painting.Painter(broken={"shot_001": error})
    summary = painting.paint(tmp_path, 4, painter=painter)
    assert painter.painted == ["shot_000", "shot_001", "shot_002", "shot_003"]
    assert summary.exit_status == 4 and summary.counts["done"] == 3 and summary.counts["failed"] == 1
    assert summary.shots[1]["state"] == "failed" and summary.shots[1]["error"].startswith(sentence)
    painter = painting.Painter()
    assert painting.paint(tmp_path, 4, painter=painter, resume=True).exit_status == 0
    assert painter.painted == ["shot_001"]


def test_what_is_there_is_neither_continued_nor_replaced_unasked(tmp_path, painting):
    painting.paint(tmp_path, 2)
    before = painting.contents(tmp_path)
    with pytest.raises(
        InputError, match=r"holds 2 of these shots already, as shot_000: --resume continues, --overwrite"
    ) as caught:
        painting.paint(tmp_path, 4)
    assert caught.value.exit_status == 2 and painting.contents(tmp_path) == before


def test_resume_renders_what_is_missing_and_what_was_made_from_other_settings(tmp_path, painting):
    painting.paint(tmp_path / "a", 5)
    undisturbed = painting.contents(tmp_path / "a")
    (tmp_path / "a" / "shot_001.json").unlink()
    (tmp_path / "a" / "shot_002.exr").write_bytes(b"spoilt")
    sidecar = tmp_path / "a" / "shot_003.json"
    sidecar.write_text(sidecar.read_text(encoding="utf-8").replace('"settings": "', '"settings": "0'), encoding="utf-8")
    painter, events = painting.Painter(), painting.Listener()
    summary = painting.paint(tmp_path / "a", 5, painter=painter, events=events, resume=True)
    assert painter.painted == ["shot_001", "shot_002", "shot_003"]
    assert (summary.rendered, summary.kept) == (3, 2) and events.heard[0][1]["kept"] == 2
    assert painting.contents(tmp_path / "a") == undisturbed


def test_resume_after_everything_was_done_renders_nothing(tmp_path, painting):
    painting.paint(tmp_path, 3)
    before, painter = painting.contents(tmp_path), painting.Painter()
    assert painting.paint(tmp_path, 3, painter=painter, resume=True).exit_status == 0
    assert painter.painted == [] and painting.contents(tmp_path) == before


def test_overwrite_renders_everything_anew(tmp_path, painting):
    painting.paint(tmp_path, 3)
    before, painter = painting.contents(tmp_path), painting.Painter()
    painting.paint(tmp_path, 3, painter=painter, overwrite=True)
    assert len(painter.painted) == 3 and painting.contents(tmp_path) == before


def test_a_check_that_fails_is_exit_status_1_also_when_it_is_kept(tmp_path, painting):
    unlike = painting.Painter(unlike=["shot_001"])
    summary = painting.paint(tmp_path, 2, painter=unlike, check=True)
    assert summary.exit_status == 1 and summary.counts["checks_failed"] == 1 and summary.counts["done"] == 2
    assert summary.shots[1]["passed"] is False and "<" in summary.shots[1]["verdict"]
    painter = painting.Painter()
    assert painting.paint(tmp_path, 2, painter=painter, check=True, resume=True).exit_status == 1
    assert not painter.painted


def test_a_check_asks_for_shots_that_were_not_checked(tmp_path, painting):
    painting.paint(tmp_path, 2)
    painter = painting.Painter()
    assert painting.paint(tmp_path, 2, painter=painter, check=True, resume=True).counts["done"] == 2
    assert len(painter.painted) == 2


def test_a_full_disk_ends_the_batch_and_resume_finishes_it(tmp_path, painting):
    painter, events = painting.Painter(broken={"shot_002": FULL}), painting.Listener()
    summary = painting.paint(tmp_path / "a", 6, painter=painter, events=events)
    assert painter.painted == ["shot_000", "shot_001", "shot_002"], "the disk is full, and the next shot was tried"
    assert summary.exit_status == 4
    assert summary.counts == {"shots": 6, "done": 2, "failed": 1, "left": 3, **UNCHECKED}
    assert [fields["error"] for event, fields in events.heard if event == "shot_failed"] == [str(FULL)]
    painting.paint(tmp_path / "a", 6, resume=True)
    painting.paint(tmp_path / "b", 6)
    painting.assert_same(tmp_path / "a", tmp_path / "b")


def test_where_the_disk_is_full_a_summary_that_does_not_fit_either_is_no_second_error(tmp_path, painting, monkeypatch):
    def full(path, document):
        raise FULL

    monkeypatch.setattr(run, "write_json", full)
    assert painting.paint(tmp_path / "a", 3, painter=painting.Painter(broken={"shot_001": FULL})).exit_status == 4
    with pytest.raises(FullDiskError):  # nobody has heard of it yet
        painting.paint(tmp_path / "b", 1)


@pytest.mark.parametrize("fits", range(14))
def test_the_disk_may_be_full_at_any_file(tmp_path, painting, monkeypatch, fits):
    """A batch of four shots waits for the disk with 14 files, of which so many still fit."""
    written = []

    def fsync(descriptor):
        written.append(descriptor)
        if len(written) > fits:
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", fsync)
    painter = painting.Painter()
    if fits < 12:
        assert painting.paint(tmp_path / "a", 4, painter=painter).exit_status == 4
        assert len(painter.painted) == fits // 3 + 1, "the disk is full, and the next shot was tried"
    else:  # all pictures are there, and what is missing is told nowhere else
        with pytest.raises(FullDiskError, match=r"contact-sheet|summary"):
            painting.paint(tmp_path / "a", 4, painter=painter)
    names = {path.name for path in (tmp_path / "a").iterdir()}
    assert not any(name.startswith(".shot") for name in names), f"half a file was left: {sorted(names)}"
    assert len([name for name in names if name.startswith("shot") and name.endswith(".json")]) == fits // 3
    monkeypatch.undo()
    painter = painting.Painter()
    assert painting.paint(tmp_path / "a", 4, painter=painter, resume=True).exit_status == 0
    assert len(painter.painted) == max(0, 4 - fits // 3)
    painting.paint(tmp_path / "b", 4)
    painting.assert_same(tmp_path / "a", tmp_path / "b")


def test_work_may_take_several_shots_and_give_them_back_in_any_order(tmp_path, painting):
    listed = painting.shots(7)
    folder, made_from = Folder(tmp_path / "a"), painting.hashes(listed)
    one_by_one = painting.one.in_turn(folder, painting.Painter(), made_from, Outputs())

    def work(shots):
        taken = list(shots)
        yield from one_by_one(iter(reversed(taken)))

    events = painting.Listener()
    assert run.run(listed, folder, made_from, work, events).exit_status == 0
    assert events.names("shot_done") == [shot.name for shot in reversed(listed)]
    painting.paint(tmp_path / "b", 7)
    painting.assert_same(tmp_path / "a", tmp_path / "b")


def test_work_that_ends_early_leaves_the_rest(tmp_path, painting):
    listed = painting.shots(3)
    summary = run.run(listed, Folder(tmp_path), painting.hashes(listed), lambda shots: iter([]), painting.Listener())
    assert summary.exit_status == 4 and summary.counts["left"] == 3


def test_two_parts_share_a_folder_and_together_they_are_the_whole(tmp_path, painting):
    listed = painting.shots(5)
    painting.paint(tmp_path / "a", listed[::2], part="1-of-2")
    painting.paint(tmp_path / "a", listed[1::2], part="2-of-2")
    painting.paint(tmp_path / "b", listed)
    parts, whole = painting.contents(tmp_path / "a"), painting.contents(tmp_path / "b")
    assert {name: data for name, data in parts.items() if "-of-" not in name} == {
        name: data for name, data in whole.items() if not name.startswith(("summary", "contact-sheet"))
    }
    assert parts["summary-1-of-2.json"]["counts"]["shots"] == 3 and parts["summary-2-of-2.json"]["counts"]["shots"] == 2


@settings(max_examples=25)  # each waits for the disk
@given(st.lists(st.sampled_from(["fails", "full", "seed", "loses"]), max_size=4), st.data())
def test_whatever_went_wrong_before_resume_ends_as_an_undisturbed_run(tmp_path_factory, painting, troubles, data):
    folder, undisturbed = tmp_path_factory.mktemp("a"), tmp_path_factory.mktemp("b")
    for trouble in troubles:
        name = f"shot_00{data.draw(st.integers(0, 3))}"
        error = {"fails": RuntimeError("a bug"), "full": FULL}.get(trouble)
        painter = painting.Painter(seed=int(trouble == "seed"), broken={name: error} if error else {})
        painting.paint(folder, 4, painter=painter, resume=True)
        if trouble == "loses":
            (folder / f"{name}.{data.draw(st.sampled_from(['exr', 'png', 'json']))}").unlink(missing_ok=True)
    assert painting.paint(folder, 4, resume=True).exit_status == 0
    painting.paint(undisturbed, 4)
    painting.assert_same(folder, undisturbed)


@pytest.mark.skipif(sys.platform == "win32", reason="on Windows a second batch is refused: test_folder.py")
@pytest.mark.parametrize("killed", [False, True])
def test_a_batch_waits_for_what_another_one_renders_and_takes_over_if_that_is_killed(tmp_path, painting, killed):
    program = [sys.executable, painting.__file__, tmp_path / "a", json.dumps({"count": 1, "pause": 0.1 if not killed else 60})]
    with subprocess.Popen([*map(str, program)], stdout=subprocess.PIPE, text=True) as other:
        try:
            while "shot_started" not in other.stdout.readline():
                assert other.poll() is None
            events, painter = painting.Listener(), painting.Painter()
            waited = []

            def work(shots):
                one_by_one = painting.one.in_turn(folder, painter, made_from, Outputs())
                return one_by_one(_watched(shots, waited, other, killed))

            listed = painting.shots(1)
            folder, made_from = Folder(tmp_path / "a"), painting.hashes(listed)
            summary = run.run(listed, folder, made_from, work, events, resume=True)
        finally:
            other.kill()
    assert waited, "the shot was claimed by the other batch, and this one did not wait"
    assert summary.exit_status == 0
    assert (summary.rendered, summary.elsewhere) == ((1, 0) if killed else (0, 1))
    assert events.names("shot_elsewhere") == ([] if killed else ["shot_000"])
    painting.paint(tmp_path / "b", 1)
    painting.assert_same(tmp_path / "a", tmp_path / "b")


def _watched(shots, waited, other, killed):
    for shot in shots:
        if shot is None:
            waited.append(shot)
            if killed:
                other.kill()
        yield shot


# Two shots, of a file each to wait for, remove and rename; then the page and the summary. More than there are, see below.
STEPS = 40


@pytest.fixture(scope="module")
def folders(tmp_path_factory, painting):
    """The shots as two settings leave them."""
    folders_made = [tmp_path_factory.mktemp("old"), tmp_path_factory.mktemp("new")]
    for seed, folder in enumerate(folders_made):
        painting.paint(folder, 2, painter=painting.Painter(seed))
    return folders_made


def pictures(folder, name):
    return folder.image(name).read_bytes(), folder.preview(name).read_bytes()


@pytest.mark.exhaustive
def test_a_batch_that_dies_before_any_step_is_continued_to_the_same_bytes(tmp_path, painting, folders):
    """The shots are there already, of other settings: whatever is replaced could be taken for what it is not."""
    hashes = [painting.hashes(painting.shots(2), seed) for seed in (0, 1)]
    died, done = 0, set()
    for step in range(STEPS):
        folder = Folder(tmp_path / str(step))
        shutil.copytree(folders[0], folder.path, dirs_exist_ok=True)
        options = json.dumps({"count": 2, "seed": 1, "resume": True, "dies": step})
        outcome = subprocess.run([sys.executable, painting.__file__, folder.path, options], capture_output=True, text=True)
        if outcome.returncode == 0:
            break
        assert outcome.returncode == painting.DIED, outcome
        died += 1
        for name in hashes[0]:
            for seed, target in enumerate(folders):
                if folder.finished(name, hashes[seed][name]):
                    assert pictures(folder, name) == pictures(Folder(target), name), f"step {step}: {name} is not what it says"
                    done.add((name, seed))
        assert painting.paint(folder.path, 2, painter=painting.Painter(seed=1), resume=True).exit_status == 0
        painting.assert_same(folder.path, folders[1])
    assert outcome.returncode == 0, f"the batch has more than {STEPS} steps"
    assert died >= 2 * 8 + 4 and len(done) == 4, f"died {died} times, found {sorted(done)}"
