"""`viewcam batch` of the studio still as processes that are killed, interrupted, run out of disk and run beside each other.

What is asserted is always the same: in the end the folder holds, byte for byte but for timings, what an undisturbed run leaves.
tests/test_batch_disturbed.py runs `Disturbances` with a wheel, tests/real_blender/test_batch_command.py in a real Blender.
"""

import json
import os
import random
import shlex
import signal
import subprocess
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest


def contents(folder: Path) -> dict[str, object]:
    """Name → what each file holds, documents without their timings."""
    result = {}
    for file in sorted(Path(folder).iterdir()):
        data = file.read_bytes()
        result[file.name] = _without_timings(json.loads(data)) if file.suffix == ".json" else data
    return result


def assert_same(folder: Path, undisturbed: Path) -> None:
    actual, wanted = contents(folder), contents(undisturbed)
    assert sorted(actual) == sorted(wanted), f"{sorted(actual)} in place of {sorted(wanted)}"
    unlike = [name for name in wanted if actual[name] != wanted[name]]
    assert not unlike, f"not as an undisturbed run leaves them: {unlike}"


def _without_timings(value: object) -> object:
    if isinstance(value, dict):
        return {key: _without_timings(item) for key, item in value.items() if key != "timing"}
    return [_without_timings(item) for item in value] if isinstance(value, list) else value


ROOT = Path(__file__).resolve().parent.parent
STUDIO = ROOT / "sample_scenes" / "studio.blend"

# Two engines, so that what is kept between shots is given up and made again.
_ENGINES = ("CYCLES", "CYCLES", "VIEWCAM")


def write_list(path: Path, count: int) -> None:
    """A list of shots of 64 × 36 pixels, one sample each, around the still."""
    lines = ["name,eye,look_at,up,d,width,height,engine,samples,level"]
    for number in range(count):
        eye, engine = f"{-3 + number / 4} -9 2.5", _ENGINES[number % len(_ENGINES)]
        level = "geometry" if engine == "VIEWCAM" else ""
        lines.append(f"shot_{number:02d},{eye},0 0 1,0 0 1,80,64,36,{engine},1,{level}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


class Command:
    """A command line of `viewcam batch`.

    words : up to its options.
    variables : variables of its environment, beside this one's.
    """

    def __init__(self, words: Sequence[str | Path], variables: Mapping[str, str]) -> None:
        self._words, self._variables = [*map(str, words)], {**os.environ, **variables}

    def words(self, folder: Path, *options: str) -> list[str]:
        return [*self._words, "--out", str(folder), "--log-json", *options]

    def start(self, folder: Path, *options: str, limit: int | None = None) -> "Batch":
        """Start it, as a terminal does: in a group of processes of its own. limit : kilobytes of the largest file."""
        words = self.words(folder, *options)
        if limit is not None:
            words = ["bash", "-c", f"trap '' XFSZ; ulimit -f {limit}; exec {shlex.join(words)}"]
        return Batch(words, self._variables)

    def run(self, folder: Path, *options: str, limit: int | None = None) -> tuple[int, list[dict]]:
        """Its exit status and its events."""
        with self.start(folder, *options, limit=limit) as batch:
            return batch.end()

    def run_script(self, script: str) -> subprocess.CompletedProcess:
        """Run a shell script that may mount: in a namespace of its own, which goes with it."""
        words = ["unshare", "--map-root-user", "--mount", "sh", "-c", script]
        return subprocess.run(words, env=self._variables, cwd=ROOT, capture_output=True, text=True)


class Batch:
    """A batch that runs; killed at the end of a with block, if it still does."""

    def __init__(self, words: Sequence[str], variables: Mapping[str, str]) -> None:
        self.process = subprocess.Popen(
            words, env=variables, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, start_new_session=True
        )

    def __enter__(self) -> "Batch":
        return self

    def __exit__(self, *exception: object) -> None:
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()

    def until(self, event: str) -> dict | None:
        """Read its events up to the next of this name; None if it ends without."""
        return next((output for output in map(_event, self.process.stdout) if output.get("event") == event), None)

    def end(self) -> tuple[int, list[dict]]:
        """Wait for its end: exit status, and the events that were not read."""
        lines = self.process.communicate()[0].splitlines()
        return self.process.returncode, [event for event in map(_event, lines) if event]

    def signal_all(self, number: int) -> None:
        """Send a signal to it and to its children, as Ctrl-C in a terminal does."""
        os.killpg(self.process.pid, number)


def _event(line: str) -> dict:
    """The event of a line; nothing for a line of Blender's own, before the command begins."""
    return json.loads(line) if line.startswith("{") else {}


def kill_again_and_again(command: Command, folder: Path, kills: int, seed: int) -> None:
    """Start the batch and kill it, so many times.

    Each time it may do up to two shots, and is killed at a random moment of the next; every fifth time at a random moment of
    its first two seconds, Blender's start included.
    """
    chance = random.Random(seed)
    for number in range(kills):
        with command.start(folder, "--resume") as batch:
            if number % 5 == 4:
                time.sleep(chance.uniform(0, 2))
            else:
                batch.until("batch_started")
                for _ in range(chance.randrange(3)):
                    batch.until("shot_done")
                time.sleep(chance.uniform(0, 0.3))
            batch.process.send_signal(signal.SIGKILL)


class Disturbances:
    """The tests. A class that inherits them has a fixture `blender`: makes a Command of the path of a list of shots."""

    KILLS = 2

    @pytest.fixture(scope="class")
    @classmethod
    def command(cls, blender, tmp_path_factory) -> Command:
        path = tmp_path_factory.mktemp("list") / "shots.csv"
        write_list(path, 6)
        return blender(path)

    @pytest.fixture(scope="class")
    @classmethod
    def undisturbed(cls, command, tmp_path_factory) -> Path:
        """A folder that such a batch has made."""
        folder = tmp_path_factory.mktemp("undisturbed")
        status, events = command.run(folder)
        assert status == 0, events
        return folder

    def test_a_batch_that_was_killed_at_random_moments_ends_as_if_nothing_had_been(self, command, undisturbed, tmp_path):
        kill_again_and_again(command, tmp_path, self.KILLS, seed=1)
        left = 6 - len(list(tmp_path.glob("shot_*.json")))
        status, events = command.run(tmp_path, "--resume")
        assert status == 0, events
        print(f"{left} of 6 shots were left after {self.KILLS} kills")
        assert_same(tmp_path, undisturbed)

    @pytest.mark.exhaustive
    def test_two_batches_at_once_share_the_work_and_leave_what_one_leaves(self, command, undisturbed, tmp_path):
        with command.start(tmp_path, "--resume") as first, command.start(tmp_path, "--resume") as other:
            ends = [first.end(), other.end()]
        assert [status for status, _ in ends] == [0, 0], ends
        done = [sum(event["event"] == "shot_done" for event in events) for _, events in ends]
        assert sum(done) == 6, f"shots were rendered {sum(done)} times: {done[0]} by one, {done[1]} by the other"
        assert_same(tmp_path, undisturbed)

    @pytest.mark.exhaustive
    def test_of_two_batches_the_one_that_is_not_killed_does_all(self, command, undisturbed, tmp_path):
        with command.start(tmp_path, "--resume") as other, command.start(tmp_path, "--resume") as first:
            other.until("shot_started")
            other.process.kill()
            status, events = first.end()
        assert status == 0, events
        assert_same(tmp_path, undisturbed)

    @pytest.mark.parametrize("number", [pytest.param(signal.SIGINT, marks=pytest.mark.exhaustive), signal.SIGTERM])
    def test_a_signal_ends_the_batch_after_the_shot(self, command, undisturbed, tmp_path, number):
        with command.start(tmp_path) as batch:
            batch.until("shot_started")
            batch.signal_all(number)
            stopping = batch.until("stopping")
            status, events = batch.end()
        assert stopping and stopping["signal"] == number.name and status == 128 + number, (status, events)
        finished = next(event for event in events if event["event"] == "batch_finished")
        assert finished["done"] + finished["left"] == 6 and 1 <= finished["done"] < 6 and finished["failed"] == 0
        assert json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))["counts"]["done"] == finished["done"]
        assert command.run(tmp_path, "--resume")[0] == 0
        assert_same(tmp_path, undisturbed)

    @pytest.mark.exhaustive
    def test_a_signal_at_the_very_start_ends_the_batch_after_one_shot_at_most(self, command, tmp_path):
        with command.start(tmp_path) as batch:
            batch.until("started")
            time.sleep(0.3)  # into bpy's import or the file's reading; where Blender has read it already, into the shots
            batch.signal_all(signal.SIGINT)
            status, events = batch.end()
        assert status == 130, (status, events)
        entries = [event["event"] for event in events]
        assert entries[entries.index("stopping") :].count("shot_done") <= 1, entries

    @pytest.mark.exhaustive
    def test_a_second_signal_ends_it_at_once(self, blender, tmp_path):
        """The shot would take an hour or more."""
        long, folder = tmp_path / "shots.csv", tmp_path / "folder"
        write_list(long, 1)
        long.write_text(long.read_text(encoding="utf-8").replace(",64,36,CYCLES,1,", ",1920,1080,CYCLES,100000,"))
        with blender(long).start(folder) as batch:
            batch.until("shot_started")
            time.sleep(0.5)
            batch.signal_all(signal.SIGINT)
            assert batch.until("stopping")
            batch.signal_all(signal.SIGINT)
            assert batch.end()[0] == 130
        assert not list(folder.glob("shot*"))

    @pytest.mark.exhaustive
    @pytest.mark.parametrize("share", [0.3, 0.6])
    def test_a_full_disk_ends_the_batch_and_one_with_room_finishes_it(self, command, undisturbed, tmp_path, share):
        """A disk that has room for a share of what the batch writes, and is then made larger."""
        if not _can_mount(tmp_path):
            pytest.skip("nobody but root may have a small disk here; the next test limits files in place of the disk")
        size = round(share * sum(file.stat().st_size for file in undisturbed.iterdir()) / 1024)
        first, disk, words = tmp_path / "first.jsonl", tmp_path / "disk", shlex.join
        disk.mkdir()
        outcome = command.run_script(f"""
            mount -t tmpfs -o size={size}k none {disk} || exit 125
            {words(command.words(disk))} > {first}
            echo $?
            mount -o remount,size=100m {disk} || exit 125
            {words(command.words(disk, "--resume"))} > {tmp_path}/then.jsonl
            echo $?
            cp -a {disk} {tmp_path}/end
        """)
        assert outcome.stdout.split() == ["4", "0"], outcome
        entries = [_event(line) for line in first.read_text(encoding="utf-8").splitlines()]
        failed = [event["error"] for event in entries if event.get("event") == "shot_failed"]
        assert len(failed) == 1 and "No space left on device" in failed[0] and "free some space" in failed[0], failed
        assert_same(tmp_path / "end", undisturbed)

    @pytest.mark.exhaustive
    def test_pictures_beyond_a_limit_end_the_batch_and_without_it_resume_finishes_it(self, command, undisturbed, tmp_path):
        """A limit needs no right to mount: files may not be larger than the smallest of the pictures."""
        sizes = sorted(file.stat().st_size for file in undisturbed.glob("*.exr"))
        status, events = command.run(tmp_path, limit=(sizes[0] + sizes[-1]) // 2048)
        failed = [event["error"] for event in events if event["event"] == "shot_failed"]
        assert status == 4 and len(failed) == 1 and "File too large" in failed[0], (status, events)
        assert not list(tmp_path.glob(".shot*")), "half a file was left"
        assert command.run(tmp_path, "--resume")[0] == 0
        assert_same(tmp_path, undisturbed)


def _can_mount(folder: Path) -> bool:
    script = f"mount -t tmpfs none {shlex.quote(str(folder))}"
    words = ["unshare", "--map-root-user", "--mount", "sh", "-c", script]
    return subprocess.run(words, capture_output=True).returncode == 0
