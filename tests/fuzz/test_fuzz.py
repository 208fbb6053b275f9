"""Files of strangers, by the thousand: each is read, or refused in a sentence, within 20 s and 4 GiB; files of cameras, labels
and scenes within 5 s and 1 GiB.

A few of each kind with every run, MUTANTS of each format of cameras and in proportion of the rest with `make test-exhaustive`
(MUTANTS=500 are 47,000 of all). One that fails is made again by its number:
`python tests/fuzz/targets.py KIND NUMBER 1 FOLDER keep` leaves its files in FOLDER.
"""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import targets

TARGETS = targets.__file__
CRASHES = {signal.SIGSEGV, signal.SIGABRT, signal.SIGBUS, signal.SIGFPE, signal.SIGILL}

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="address space is limited and alarms are set as Linux has it")


def failures(kind: str, count: int, folder: Path) -> list[str]:
    """Feed mutants 0 to count − 1; what is wrong with each. Where one ends the process, another goes on after it."""
    result: list[str] = []
    first = 0
    while first < count:
        words = [sys.executable, TARGETS, kind, str(first), str(count - first), folder]
        ran = subprocess.run(words, capture_output=True, text=True)
        result += (f"{kind} {output['mutant']}: {output['said']}" for output in map(json.loads, ran.stdout.splitlines()))
        current = folder / "current"
        reached = current.read_text() if current.exists() else "nothing"
        if ran.returncode == 0:
            break
        if kind == "blend" and reached.isdecimal() and -ran.returncode in CRASHES:
            result += as_a_user_sees(folder / f"blend-{reached}")
        else:
            result.append(f"{kind} {reached}: ended with status {ran.returncode}: {ran.stderr[-1000:]}")
        if not reached.isdecimal():
            break
        first = int(reached) + 1
        current.unlink()
    return result


def as_a_user_sees(mutant: Path) -> list[str]:
    """The faults of the command line's answer to a .blend that crashes Blender: a sentence and a status are right."""
    try:
        targets.command(mutant)
    except targets.Failure as error:
        return [f"{mutant.name}: {error}"]
    return []


def assert_met(kind: str, count: int, folder: Path) -> None:
    actual = failures(kind, count, folder)
    assert not actual, f"{len(actual)} of {count} mutants:\n" + "\n".join(actual[:20])


SAMPLE = {"scene": 60, "exr": 40, "shots": 200, "sidecar": 40, "labels": 60, "cameras-all": 225}
MUTANTS = int(os.environ.get("MUTANTS", "100"))
USD_MUTANTS = MUTANTS // 5
"""Each is read in a process of its own, which takes a second."""
TIMES = {"scene": 8, "exr": 4, "shots": 5, "sidecar": 2, "labels": 1, "blend": 1 / 3}


@pytest.mark.parametrize("kind", SAMPLE)
def test_a_hostile_file_is_read_or_refused_in_a_sentence(kind, tmp_path):
    assert_met(kind, SAMPLE[kind], tmp_path)


@pytest.mark.exhaustive
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("kind", TIMES)
def test_every_hostile_file_is_read_or_refused_in_a_sentence(kind, tmp_path):
    if kind == "blend":
        pytest.importorskip("bpy")
    assert_met(kind, round(TIMES[kind] * MUTANTS), tmp_path)


@pytest.mark.exhaustive
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", targets.CAMERAS)
def test_every_hostile_file_of_cameras_is_read_or_refused_in_a_sentence(name, tmp_path):
    is_usd = name.startswith("usd")
    if is_usd:
        pytest.importorskip("pxr")
    assert_met(f"cameras-{name}", USD_MUTANTS if is_usd else MUTANTS, tmp_path)


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("bug", "bug 2: a bug"),
        ("crash", "crash 2: ended with status -11"),
        ("hang", "hang 2: ended with status -14"),
        ("greedy", "greedy 2: MemoryError"),
    ],
)
def test_what_a_mutant_can_do_is_seen(kind, words, tmp_path):
    actual = failures(kind, 4, tmp_path)
    assert [each[: len(words)] for each in actual] == [words], actual
