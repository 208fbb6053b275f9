"""Two batches in one folder never have the same shot at the same time, and a killed one has none."""

import errno
import subprocess
import sys
from pathlib import Path

import pytest

from viewcam_addon.errors import InputError
from viewcam_addon.jobs import locks
from viewcam_addon.jobs.locks import Claims

posix = pytest.mark.skipif(sys.platform == "win32", reason="Windows has one batch a folder: the tests at the end")

ROOT = Path(__file__).resolve().parent.parent.parent
HOLDER = """
import sys
from pathlib import Path
from viewcam_addon.jobs.locks import Claims
with Claims(Path(sys.argv[1])) as claims:
    with claims.alone() as alone:
        print(alone, flush=True)
    for line in sys.stdin:
        words = line.split()
        print(getattr(claims, words[0])(words[1]), flush=True)
"""


class Other:
    """A batch in another process."""

    def __init__(self, path):
        command = [sys.executable, "-c", HOLDER, str(path)]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT)
        self.alone = self.process.stdout.readline().strip() == "True"

    def ask(self, *words):
        print(*words, file=self.process.stdin, flush=True)
        return self.process.stdout.readline().strip()

    def kill(self):
        self.process.kill()
        self.process.communicate()


@pytest.fixture
def path(tmp_path):
    return tmp_path / ".viewcam.lock"


@pytest.fixture
def another(path):
    others = []

    def start():
        others.append(Other(path))
        return others[-1]

    yield start
    for other in others:
        other.kill()


def alone(claims):
    with claims.alone() as is_alone:
        return is_alone


@posix
def test_a_shot_is_one_batchs_until_it_is_released(path, another):
    other = another()
    assert other.alone
    with Claims(path) as claims:
        assert other.ask("take", "left") == "True"
        assert not claims.take("left") and claims.take("right")
        assert other.ask("take", "right") == "False"
        other.ask("release", "left")
        claims.release("right")
        assert claims.take("left") and other.ask("take", "right") == "True"


@posix
def test_names_that_are_one_file_are_one_claim(path, another):
    with Claims(path) as claims:
        assert claims.take("Größe") and another().ask("take", "GRÖSSE") == "False"


@posix
def test_a_killed_batch_has_no_claims(path, another):
    other = another()
    other.ask("take", "left")
    with Claims(path) as claims:
        assert not alone(claims) and not claims.take("left")
        other.kill()
        assert alone(claims) and claims.take("left")


@posix
def test_only_the_first_of_several_batches_is_alone(path, another):
    with Claims(path) as claims:
        assert alone(claims) and alone(claims)
        assert [another().alone, another().alone] == [False, False]
        assert not alone(claims)


@posix
def test_no_batch_begins_while_another_is_told_that_it_is_alone(path):
    with Claims(path) as claims, claims.alone() as is_alone:
        assert is_alone
        command = [sys.executable, "-c", HOLDER, str(path)]
        beginner = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT)
        with pytest.raises(subprocess.TimeoutExpired):
            beginner.wait(2)
    assert beginner.communicate("")[0].strip() == "False", "it was not alone when it asked"


@posix
def test_ten_thousand_names_have_ten_thousand_bytes_of_their_own():
    places = {locks._byte(f"shot_{number}") for number in range(10_000)}
    assert len(places) == 10_000 and min(places) > 1 and max(places) < 2**63


@posix
@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOTSUP])
def test_where_there_are_no_locks_every_claim_is_granted_and_nobody_is_alone(path, monkeypatch, number):
    def refuse(*_):
        raise OSError(number, "No locks available")

    monkeypatch.setattr(locks.fcntl, "lockf", refuse)
    with Claims(path) as claims, claims.summing_up():
        assert claims.take("left") and claims.take("left") and not alone(claims)
        claims.release("left")


@posix
def test_an_error_that_is_none_of_locks_is_not_taken_for_one(path, monkeypatch):
    def fail(*_):
        raise OSError(errno.EIO, "Input/output error")

    with Claims(path) as claims:
        monkeypatch.setattr(locks.fcntl, "lockf", fail)
        with pytest.raises(OSError, match="Input/output"):
            claims.take("left")


def test_a_folder_that_can_not_be_written_is_named(tmp_path):
    with pytest.raises(InputError, match=r"lock can't be written .*: choose another folder"):
        Claims(tmp_path / "missing" / ".viewcam.lock")


class OneAtATime:
    """msvcrt, which Windows alone has: a byte of a file is locked once."""

    LK_NBLCK = 2
    locked = False

    def locking(self, file, kind, count):
        if self.locked:
            raise OSError(errno.EACCES, "Permission denied")
        self.locked = True


def test_on_windows_a_second_batch_in_a_folder_is_refused(path, monkeypatch):
    monkeypatch.setattr(locks, "_ON_WINDOWS", True)
    monkeypatch.setattr(locks, "msvcrt", OneAtATime(), raising=False)
    with Claims(path) as claims, claims.summing_up():
        assert alone(claims) and claims.take("left")
        claims.release("left")
        with pytest.raises(InputError, match=r"another batch works in .*: wait for it, or give another --out"):
            Claims(path)
