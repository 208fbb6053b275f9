"""A renderer in a process of its own does what one in this process does, and outlives its crashes. Blender is a stand-in."""

import os
import signal
import stat
import threading
import time

import pytest

from viewcam_addon import child_process
from viewcam_addon.errors import FullDiskError, InputError
from viewcam_addon.jobs import one, served_renderer
from viewcam_addon.jobs.folder import Folder, Outputs
from viewcam_addon.jobs.job import Job
from viewcam_addon.jobs.served_renderer import ServedRenderer

pytestmark = pytest.mark.slow


def shot(name, eye=(0.1, -6.0, 1e-300)):
    return Job(name, eye, (0, 0, 1), (0, 0, 1), 400.0, None, 64, 36)


@pytest.fixture
def renderer(stand_in, blend):
    with ServedRenderer(blend) as renderer:
        yield renderer


def test_what_a_renderer_says_is_said_here(renderer, stand_in, blend, tmp_path):
    record = renderer.render(shot("a"), tmp_path / "a.exr", tmp_path / "a.png")
    assert record == {
        "camera": {"eye": [0.1, -6.0, 1e-300], "d": 400.0},
        "rendered": {"width": 64, "height": 36},
        "warnings": ["a warning"],
    }
    assert renderer.check(shot("a")) == {"passed": True, "verdict": "as it should be"}
    assert (tmp_path / "a.exr").stat().st_size == 32 and (tmp_path / "a.png").read_bytes() == b"preview"
    assert renderer.cameras == ("Left", "Right") and renderer.scene_camera == "Left"
    assert renderer.made_from() == {"blend": "a scene", "blender": "stand-in"}
    assert renderer.problems([shot("a"), shot("impossible")]) == ("impossible is impossible",)
    assert [words[1:-1] for words in stand_in.diary("open")] == [[str(blend)]], "one load for all of it"


def test_no_blender_is_started_before_it_is_needed(renderer, stand_in):
    assert stand_in.diary("open") == []
    renderer.open()
    renderer.open()
    assert len(stand_in.diary("open")) == 1


def test_it_ends_when_it_is_closed_and_starts_again_when_it_is_asked(renderer, stand_in, processes):
    renderer.open()
    process = stand_in.diary("open")[0][-1]
    assert processes.run(process)
    renderer.close()
    assert not processes.run(process)
    assert renderer.cameras and len(stand_in.diary("open")) == 2


def test_a_blender_that_crashes_once_is_started_again_and_the_shot_is_there(renderer, stand_in, tmp_path):
    renderer.render(shot("crashonce"), tmp_path / "a.exr", tmp_path / "a.png")
    assert (tmp_path / "a.exr").stat().st_size == 32
    assert len(stand_in.diary("open")) == 2


def test_a_blender_that_crashes_in_the_check_renders_the_shot_again_before_it_checks(renderer, stand_in, tmp_path):
    renderer.render(shot("checkcrash"), tmp_path / "a.exr", tmp_path / "a.png")
    assert renderer.check(shot("checkcrash"))["passed"]
    assert [len(stand_in.diary(word)) for word in ("open", "render", "check")] == [2, 2, 2]


def test_a_shot_in_which_blender_always_crashes_fails_and_the_next_one_is_rendered(renderer, stand_in, tmp_path):
    with pytest.raises(
        InputError, match=rf"^{served_renderer.ATTEMPTS} times in a row .*blender has ended with signal {signal.SIGKILL:d}"
    ):
        renderer.render(shot("crash"), tmp_path / "a.exr", tmp_path / "a.png")
    assert len(stand_in.diary("render")) == served_renderer.ATTEMPTS
    assert renderer.render(shot("b"), tmp_path / "b.exr", tmp_path / "b.png")


def test_a_blender_that_was_killed_between_two_shots_costs_no_attempt(renderer, stand_in, tmp_path, processes):
    for number in range(served_renderer.ATTEMPTS + 1):
        renderer.render(shot(f"a{number}"), tmp_path / "a.exr", tmp_path / "a.png")
        process = int(stand_in.diary("open")[-1][-1])
        os.kill(process, signal.SIGKILL)
        assert processes.until(lambda process=process: not processes.run(process))
    assert len(stand_in.diary("render")) == served_renderer.ATTEMPTS + 1


@pytest.mark.parametrize(
    ("name", "kind", "sentence"),
    [("bad", InputError, "^bad has no light: add some$"), ("bug", InputError, "this is a bug"), ("full", OSError, "No space")],
)
def test_an_error_arrives_as_it_is_and_costs_no_blender(renderer, stand_in, tmp_path, name, kind, sentence):
    with pytest.raises(kind, match=sentence):
        renderer.render(shot(name), tmp_path / "a.exr", tmp_path / "a.png")
    assert renderer.render(shot("b"), tmp_path / "b.exr", tmp_path / "b.png")
    assert len(stand_in.diary("open")) == 1


def test_a_full_disk_there_is_one_here_and_nothing_is_left_in_the_folder(renderer, tmp_path):
    folder = Folder(tmp_path / "out")
    with pytest.raises(FullDiskError, match=r"full\.\w+ can't be written \(No space left on device\)"):
        one.render_one(shot("full"), folder, renderer, "hash", Outputs())
    assert list(folder.path.iterdir()) == []


def test_a_file_that_is_not_there_is_one_sentence(stand_in, tmp_path):
    with ServedRenderer(tmp_path / "ghost.blend") as renderer, pytest.raises(InputError, match=r"ghost\.blend is not there"):
        renderer.open()


def test_a_blender_that_is_not_there_is_one_sentence(monkeypatch, blend, tmp_path):
    monkeypatch.setenv("VIEWCAM_BLENDER", str(tmp_path / "ghost"))
    with ServedRenderer(blend) as renderer, pytest.raises(InputError, match=r"ghost can't be started \(No such file"):
        renderer.open()


def test_a_program_that_does_not_serve_is_one_sentence(monkeypatch, blend, tmp_path):
    program = tmp_path / "other"
    program.write_text("#!/bin/sh\necho unknown command viewcam\nexit 1\n")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("VIEWCAM_BLENDER", str(program))
    with (
        ServedRenderer(blend) as renderer,
        pytest.raises(InputError, match=r"other has ended with status 1 as it opened .* extension"),
    ):
        renderer.open()


def test_where_there_is_no_blender_at_all_a_sentence_says_how_to_have_one(monkeypatch, blend):
    monkeypatch.delenv("VIEWCAM_BLENDER", raising=False)
    monkeypatch.setattr(served_renderer.importlib.util, "find_spec", lambda name: None)
    with ServedRenderer(blend) as renderer, pytest.raises(InputError, match="name one in VIEWCAM_BLENDER, or pip install bpy"):
        renderer.open()


def test_a_blender_that_is_stopped_in_a_shot_is_ended_and_the_shot_rendered_by_another(stand_in, blend, tmp_path, monkeypatch):
    monkeypatch.setattr(child_process, "HEARTBEAT_TIMEOUT", 3.0)
    stopping = threading.Thread(target=lambda: os.kill(int(waits(stand_in)), signal.SIGSTOP), daemon=True)
    stopping.start()
    with ServedRenderer(blend) as renderer:
        renderer.render(shot("slow_one"), tmp_path / "a.exr", tmp_path / "a.png")
    stopping.join()
    assert (tmp_path / "a.exr").stat().st_size == 32 and len(stand_in.diary("open")) == 2


def waits(stand_in):
    """The process that waits in a slow shot."""
    while not (outcome := stand_in.diary("waits")):
        time.sleep(0.02)
    return outcome[0][-1]


def test_a_shot_that_takes_long_is_left_alone_while_its_blender_gives_signs_of_life(stand_in, blend, tmp_path, monkeypatch):
    monkeypatch.setattr(child_process, "HEARTBEAT_TIMEOUT", 5.0)
    stopping = threading.Thread(
        target=lambda: (waits(stand_in), time.sleep(8), os.kill(int(waits(stand_in)), signal.SIGKILL)), daemon=True
    )
    stopping.start()
    with ServedRenderer(blend) as renderer:
        renderer.render(shot("slow_one"), tmp_path / "a.exr", tmp_path / "a.png")
    stopping.join()
    assert [words[1] for words in stand_in.diary("render")] == ["slow_one", "slow_one"], "it was ended before it was killed"


def test_a_shot_beyond_its_time_limit_fails_in_a_sentence_and_the_next_one_is_rendered(stand_in, blend, tmp_path, processes):
    with ServedRenderer(blend, time_limit=2.0) as renderer:
        with pytest.raises(InputError, match=r"^the shot took longer than the time limit of 2 s, .* give --time-limit more"):
            renderer.render(shot("slow_one"), tmp_path / "a.exr", tmp_path / "a.png")
        assert not processes.run(stand_in.diary("waits")[0][-1])
        assert renderer.render(shot("b"), tmp_path / "b.exr", tmp_path / "b.png")
    assert len(stand_in.diary("render")) == 2, "it is not tried again"
