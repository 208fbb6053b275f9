"""The processes of a batch on this machine's workers: what they run, and that none outlives the batch, however it ends."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from viewcam_addon import child_process

pytest.importorskip("distributed")
if sys.platform == "win32":
    pytest.skip("Windows has neither groups of processes nor SIGKILL, and /proc is Linux's", allow_module_level=True)

# A batch on two workers in a process that can be killed. Arguments: the file, the folder, names of shots.
COORDINATOR = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
import test_cluster
from viewcam_addon.jobs import cluster
from viewcam_addon.jobs.interruption import Interruption
from viewcam_addon.terminal import silent_libraries
blend, folder, shots = Path(sys.argv[2]), Path(sys.argv[3]), test_cluster.shots(*sys.argv[4:])
heard = lambda signal: None
with silent_libraries(), Interruption(heard) as interruption, cluster.opened(None, 2) as machines:
    summary = test_cluster.run_on(machines, blend, folder, shots, interruption=interruption)
sys.exit(summary.exit_status)
"""


def offspring(process):
    """The numbers of all processes that descend from one."""
    parents = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            parents[int(path.parent.name)] = int(path.read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue
    result, frontier = set(), {process}
    while frontier:
        frontier = {child for child, parent in parents.items() if parent in frontier} - result
        result |= frontier
    return result


@pytest.mark.exhaustive
def test_a_script_that_has_workers_is_not_run_again_by_them(stand_in, blend, tmp_path):
    script = tmp_path / "script.py"  # as people write them: nothing asks for __main__
    script.write_text("print('run')" + COORDINATOR)
    command = [sys.executable, script, Path(__file__).parent, blend, tmp_path / "out", "a", "b"]
    done = subprocess.run(command, env=child_process.environment(), capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout == "run\n", done.stdout + done.stderr


@pytest.mark.parametrize(
    "how",
    [signal.SIGKILL, *(pytest.param(how, marks=pytest.mark.exhaustive) for how in ("finished", signal.SIGINT, signal.SIGTERM))],
)
def test_nothing_is_left_running_and_nothing_is_said(stand_in, blend, tmp_path, processes, how):
    """Also when the coordinator is killed, or when Ctrl-C reaches the whole group."""
    command = [sys.executable, "-c", COORDINATOR, str(Path(__file__).parent), str(blend), str(tmp_path / "out"), "a", "b"]
    slow = [] if how == "finished" else ["slow_one", "c", "d"]
    before = set(os.listdir(os.getcwd()))
    batch = subprocess.Popen(
        [*command, *slow],
        env=child_process.environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    )
    try:
        family = set()
        if slow:
            assert processes.until(lambda: stand_in.diary("waits")), "the slow shot was never begun"
            family = offspring(batch.pid)
            assert len(family) >= 4, "two workers and two Blenders"
            if how == signal.SIGKILL:
                batch.kill()
            else:
                os.killpg(batch.pid, how)
                os.kill(int(stand_in.diary("waits")[0][-1]), signal.SIGKILL)  # the slow shot shall not take a minute
        output, _ = batch.communicate(timeout=60)
        status = batch.returncode
    finally:
        batch.kill()
    blenders = {int(words[-1]) for words in stand_in.diary("open")}

    def left():
        return [process for process in family | blenders if processes.run(process)]

    assert processes.until(lambda: not left()), f"still running: {left()}"
    assert status == {"finished": 0, signal.SIGKILL: -9, signal.SIGINT: 130, signal.SIGTERM: 143}[how], output
    assert output == b""
    assert set(os.listdir(os.getcwd())) == before, "something was left in the user's folder"
