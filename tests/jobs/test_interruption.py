"""One signal ends a batch after the shot, two end it at once; the folder is good either way."""

import json
import signal
import subprocess
import sys
import threading

import pytest

from viewcam_addon.jobs.interruption import Interruption

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows sends no such signals to a process")

SIGNALS = [signal.SIGINT, signal.SIGTERM]


class Batch:
    """painting.py as a process."""

    def __init__(self, painting, folder, **options):
        self.process = subprocess.Popen(
            [sys.executable, painting.__file__, folder, json.dumps(options)], stdout=subprocess.PIPE, text=True
        )

    def until(self, event):
        """Read its events up to the next of this name."""
        for line in self.process.stdout:
            if json.loads(line)["event"] == event:
                return json.loads(line)
        raise AssertionError(f"the batch ended with {self.process.wait()} and told no {event}")

    def end(self):
        rest = [json.loads(line) for line in self.process.communicate()[0].splitlines()]
        return self.process.returncode, rest


@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_ends_the_batch_after_the_shot_with_a_summary(tmp_path, painting, number):
    batch = Batch(painting, tmp_path / "a", count=4, pause=0.05)
    batch.until("shot_started")
    batch.process.send_signal(number)
    assert batch.until("stopping")["signal"] == number.name, "told at once, not after the shot"
    status, rest = batch.end()
    assert status == 128 + number
    assert [event["event"] for event in rest] == ["shot_done", "batch_finished"]
    assert (rest[1]["done"], rest[1]["left"], rest[1]["exit_status"]) == (1, 3, 128 + number)
    assert json.loads((tmp_path / "a" / "summary.json").read_text(encoding="utf-8"))["counts"]["left"] == 3
    painting.paint(tmp_path / "a", 4, resume=True)
    painting.paint(tmp_path / "b", 4)
    painting.assert_same(tmp_path / "a", tmp_path / "b")


@pytest.mark.parametrize("number", SIGNALS)
def test_the_second_signal_ends_it_at_once(tmp_path, painting, number):
    batch = Batch(painting, tmp_path / "a", count=2, pause=60.0)
    batch.until("shot_started")
    batch.process.send_signal(number)
    batch.until("stopping")
    batch.process.send_signal(number)
    status, rest = batch.end()  # which would take 8 minutes a shot
    assert (status, rest) == (128 + number, [])
    assert not list((tmp_path / "a").glob("shot*"))
    painting.paint(tmp_path / "a", 2, resume=True)
    painting.paint(tmp_path / "b", 2)
    painting.assert_same(tmp_path / "a", tmp_path / "b")


def test_signals_are_answered_as_before_when_the_batch_has_ended(tmp_path, painting):
    heard = []
    before = [signal.signal(number, lambda *_: heard.append(_[0])) for number in SIGNALS]
    wakeup = signal.set_wakeup_fd(-1)
    try:
        painting.paint(tmp_path, 1)
        for number in SIGNALS:
            signal.raise_signal(number)
        assert heard == SIGNALS and signal.set_wakeup_fd(-1) == -1
    finally:
        signal.set_wakeup_fd(wakeup)
        for number, answer in zip(SIGNALS, before, strict=True):
            signal.signal(number, answer)


def test_signals_of_others_do_not_count():
    before = signal.signal(signal.SIGUSR1, lambda *_: None)
    try:
        with Interruption(lambda signal: pytest.fail(f"{signal} was taken for an end")) as interruption:
            signal.raise_signal(signal.SIGUSR1)
        assert interruption.number is None
    finally:
        signal.signal(signal.SIGUSR1, before)


def test_outside_the_main_thread_a_batch_runs_without_listening(tmp_path, painting):
    statuses = []
    thread = threading.Thread(target=lambda: statuses.append(painting.paint(tmp_path, 1).exit_status), daemon=True)
    thread.start()
    thread.join()
    assert statuses == [0]
