"""Processes of our own: a whole group ends, whoever in it was started by whom.

One that is asked answers, its errors arrive as they are, and neither side outlives the other.
"""

import os
import signal
import sys
import time

import psutil  # Dask brings it
import pytest

from viewcam_addon import child_process, errors
from viewcam_addon.child_process import ProcessEnded, ServerProcess

# A parent that starts a child which would sleep for a minute, and tells both numbers.
PARENT = """
import os, subprocess, sys, time
child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
print(os.getpid(), child.pid, flush=True)
"""


def is_there(process):
    """True if a process runs; one that has ended and whom nobody has asked for its status does not."""
    try:
        return psutil.Process(process).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def until(is_so, seconds=20):
    """The value of `is_so`, as soon as it is true or so many seconds have passed: far more than a busy machine needs."""
    ends = time.monotonic() + seconds
    while not (outcome := is_so()) and time.monotonic() < ends:
        time.sleep(0.02)
    return outcome


def test_grandchildren_end_with_the_child(tmp_path):
    log = tmp_path / "said.txt"
    group = child_process.ProcessGroup([sys.executable, "-c", PARENT + "time.sleep(60)"], log, os.environ)
    assert until(lambda: log.read_text().endswith("\n")), "the group has not started"
    members = [int(word) for word in log.read_text().split()]
    assert all(map(is_there, members)) and group.status() is None
    group.end()
    assert until(lambda: not any(map(is_there, members))), "a member runs on"
    assert group.status() == (1 if sys.platform == "win32" else -9)
    group.end()  # twice does no harm


def test_a_grandchild_ends_that_has_lost_its_parent(tmp_path):
    group = child_process.ProcessGroup([sys.executable, "-c", PARENT], tmp_path / "said.txt", os.environ)
    group.wait()
    grandchild = int((tmp_path / "said.txt").read_text().split()[1])
    assert group.status() == 0 and is_there(grandchild)
    group.end()
    assert until(lambda: not is_there(grandchild))


def test_what_a_child_says_stands_in_its_file(tmp_path):
    program = "import sys; print('out'); print('err', file=sys.stderr); sys.exit(3)"
    group = child_process.ProcessGroup([sys.executable, "-c", program], tmp_path / "said.txt", os.environ)
    group.wait()
    assert group.status() == 3
    assert sorted((tmp_path / "said.txt").read_text().split()) == ["err", "out"]


def test_a_child_has_our_modules_in_reach_and_what_else_it_is_told(tmp_path):
    variables = child_process.environment(TMPDIR=str(tmp_path))
    program = "import tempfile, viewcam_addon.cli, numpy; print(tempfile.gettempdir())"
    group = child_process.ProcessGroup([sys.executable, "-c", program], tmp_path / "said.txt", variables)
    group.wait()
    assert (tmp_path / "said.txt").read_text().strip() == str(tmp_path)


ECHO = """
import os, signal, sys, time
from viewcam_addon import errors
from viewcam_addon import child_process

def answers(request, tell):
    print("words that are nobody's business")
    if "die" in request:
        os.kill(os.getpid(), getattr(signal, "SIGKILL", signal.SIGTERM))
    if "raise" in request:
        raise getattr(errors, request["raise"])("the lamp is broken: mend it")
    if "bug" in request:
        return request["nothing of that name"]
    for number in range(request.get("tells", 0)):
        tell("progress", share=number)
    if "sleep" in request:
        time.sleep(request["sleep"])
    return {"heard": request, "process": os.getpid()}

child_process.serve(sys.argv[1], answers, idle=float(os.environ.get("IDLE", "600")))
"""
# Asks one thing, tells who answered, and waits to be killed.
ASKER = """
import sys, time
from viewcam_addon import child_process
from viewcam_addon.child_process import ServerProcess
echo = ServerProcess("the echo", [sys.executable, "-c", sys.argv[1]], child_process.environment())
print(echo.ask({})["process"], flush=True)
echo.ask({"sleep": float(sys.argv[2])})
time.sleep(60)
"""


@pytest.fixture
def echo():
    with ServerProcess("the echo", [sys.executable, "-c", ECHO], child_process.environment()) as server:
        yield server


def test_an_answer_is_what_was_asked_float_by_float(echo):
    asked = {"name": "Würfel", "numbers": [0.1, 1e308, -5e-324, 2**53 + 1], "nothing": None}
    assert [echo.ask(asked)["heard"] for _ in range(3)] == [asked] * 3


def test_events_are_told_on_the_way():
    heard = []

    class Ear:
        def tell(self, event, **fields):
            heard.append((event, fields))

    command = [sys.executable, "-c", ECHO]
    with ServerProcess("the echo", command, child_process.environment(), events=Ear()) as server:
        server.ask({"tells": 3})
    assert heard == [("progress", {"share": number}) for number in range(3)]


def test_one_process_answers_all(echo):
    assert len({echo.ask({})["process"] for _ in range(3)}) == 1


@pytest.mark.parametrize("kind", ["InputError", "FullDiskError", "NotModeledError"])
def test_an_error_is_raised_here_as_it_was_there(echo, kind):
    with pytest.raises(errors.InputError, match=r"^the lamp is broken: mend it$") as caught:
        echo.ask({"raise": kind})
    assert type(caught.value).__name__ == kind
    assert echo.ask({"and": "on"})["heard"] == {"and": "on"}


def test_a_bug_is_one_sentence_and_the_process_goes_on(echo):
    with pytest.raises(errors.InputError, match=r"this is a bug.*nothing of that name"):
        echo.ask({"bug": True})
    assert echo.ask({})["heard"] == {}


def test_a_process_that_was_killed_is_gone_and_says_how(echo):
    cause = f"status {signal.SIGTERM:d}" if sys.platform == "win32" else f"signal {signal.SIGKILL:d}"
    with pytest.raises(ProcessEnded, match=f"the echo has ended with {cause}"):
        echo.ask({"die": True})
    with pytest.raises(ProcessEnded, match="the echo has ended"):
        echo.ask({})


def test_a_process_that_never_listens_is_gone():
    command = [sys.executable, "-c", "import sys; sys.exit(3)"]
    with (
        ServerProcess("the deaf one", command, os.environ) as deaf,
        pytest.raises(ProcessEnded, match="has ended with status 3"),
    ):
        deaf.ask({})


def test_a_program_that_is_not_there_is_one_sentence(tmp_path):
    with pytest.raises(errors.InputError, match=r"the ghost can't be started \(.*\): check .*ghost"):
        ServerProcess("the ghost", [str(tmp_path / "ghost")], os.environ)


def test_what_it_prints_stands_in_its_log(tmp_path):
    with ServerProcess(
        "the echo", [sys.executable, "-u", "-c", ECHO], child_process.environment(), tmp_path / "log.txt"
    ) as echo:
        echo.ask({})
    assert (tmp_path / "log.txt").read_text() == "words that are nobody's business\n"


@pytest.mark.parametrize("answering", [0, 60])
def test_a_process_ends_with_whoever_asked_even_in_the_midst_of_an_answer(tmp_path, answering):
    log = tmp_path / "said.txt"
    asker = child_process.ProcessGroup([sys.executable, "-c", ASKER, ECHO, str(answering)], log, child_process.environment())
    assert until(lambda: log.read_text().strip().isdecimal()), log.read_text()
    process = psutil.Process(int(log.read_text()))
    psutil.Process(asker._first.pid).kill()
    asker.wait()
    gone = until(lambda: not process.is_running() or process.status() == psutil.STATUS_ZOMBIE)
    assert gone, "it waits for nobody"


def test_a_process_that_nobody_asks_for_long_ends_and_that_can_be_seen():
    with ServerProcess("the echo", [sys.executable, "-c", ECHO], child_process.environment(IDLE="0.5")) as echo:
        echo.ask({})
        assert until(lambda: not echo.is_there()), "it waits on"


def test_a_process_that_listens_is_there(echo):
    assert echo.is_there()
    echo.ask({})
    assert echo.is_there()
