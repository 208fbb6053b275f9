"""Processes of our own: a whole group ends, whoever in it was started by whom."""

import os
import sys
import time

import psutil  # Dask brings it

from viewcam_addon import child_process

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


def wait_until(is_so, seconds=20):
    ends = time.monotonic() + seconds
    while not (outcome := is_so()) and time.monotonic() < ends:
        time.sleep(0.02)
    return outcome


def test_grandchildren_end_with_the_child(tmp_path):
    log = tmp_path / "said.txt"
    group = child_process.ProcessGroup([sys.executable, "-c", PARENT + "time.sleep(60)"], log, os.environ)
    assert wait_until(lambda: log.read_text().endswith("\n")), "the group has not started"
    members = [int(word) for word in log.read_text().split()]
    assert all(map(is_there, members)) and group.status() is None
    group.end()
    assert wait_until(lambda: not any(map(is_there, members))), "a member runs on"
    assert group.status() == (1 if sys.platform == "win32" else -9)
    group.end()  # twice does no harm


def test_a_grandchild_ends_that_has_lost_its_parent(tmp_path):
    group = child_process.ProcessGroup([sys.executable, "-c", PARENT], tmp_path / "said.txt", os.environ)
    group.wait()
    grandchild = int((tmp_path / "said.txt").read_text().split()[1])
    assert group.status() == 0 and is_there(grandchild)
    group.end()
    assert wait_until(lambda: not is_there(grandchild))


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
