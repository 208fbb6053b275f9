"""Shots on several workers: the same files as from one process, whoever is killed. Dask is real, Blender is a stand-in.

And the workers' processes on this machine: what they run, and that none outlives the batch, however it ends.
"""

import asyncio
import contextlib
import logging
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from pathlib import Path

import pytest

dask = pytest.importorskip("dask")
pytest.importorskip("distributed")

from viewcam_addon import child_process, cli
from viewcam_addon.errors import InputError
from viewcam_addon.jobs import cluster, one, run, served_renderer
from viewcam_addon.jobs.folder import Folder, Outputs
from viewcam_addon.jobs.job import Job
from viewcam_addon.jobs.served_renderer import ServedRenderer

pytestmark = pytest.mark.slow


ROOT = Path(__file__).resolve().parents[2]
TIMING = re.compile(rb'"timing": \{[^}]*\}')


class Ear:
    """A listener that keeps each event that it is told."""

    def __init__(self):
        self.events = []

    def tell(self, event, **fields):
        self.events.append((event, fields))

    def all(self, event):
        return [fields for name, fields in self.events if name == event]


def shots(*names):
    return [Job(name, (0.1, -6.0, i), (0, 0, 1), (0, 0, 1), 400.0, None, 64, 36) for i, name in enumerate(names)]


def settings_of(listed):
    return {shot.name: f"hash of {shot.name}" for shot in listed}


MADE_FROM = {"blend": "a scene", "blender": "stand-in"}


def run_on(machines, blend, folder, listed, ear=None, check=False, made_from=MADE_FROM, interruption=None):
    """The summary of a batch on these workers."""
    folder = Folder(folder)
    work = machines.work(blend, folder, settings_of(listed), made_from, outputs=Outputs(check=check))
    options = {"resume": True, "outputs": Outputs(check=check), "interruption": interruption}
    return run.run(listed, folder, settings_of(listed), work, ear or Ear(), **options)


def contents(folder):
    """Name → bytes without timings of the shots' files."""
    names = [path for path in folder.iterdir() if path.suffix in (".exr", ".png", ".json", ".html") and path.name[0] != "."]
    return {path.name: TIMING.sub(b"", path.read_bytes()) for path in names if path.name != "summary.json"}


@pytest.fixture(scope="module")
def two_workers(stand_in_program):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("VIEWCAM_BLENDER", str(stand_in_program.program))
        with cluster.opened(None, 2) as machines:
            yield machines


@pytest.fixture
def machines(two_workers):
    """Two workers, both there again if a test before has killed one. Each test has a file of its own, which they open anew."""
    two_workers._client.wait_for_workers(2, timeout=60)
    return two_workers


def test_two_workers_write_the_bytes_of_one_process_and_each_loads_once(stand_in, machines, blend, tmp_path):
    listed = shots(*(f"shot_{i}" for i in range(12)))
    summary = run_on(machines, blend, tmp_path / "two", listed, check=True)
    assert summary.exit_status == 0 and summary.counts["done"] == 12, summary.to_json()
    opened = [words for words in stand_in.diary("open") if words[1] == str(blend)]
    assert len(opened) == 2 and len({words[-1] for words in opened}) == 2, f"loads: {opened}"
    workers = {words[-1] for words in stand_in.diary("render")}
    assert len(workers) == 2, "one worker did all the work"

    folder = Folder(tmp_path / "one")
    with ServedRenderer(blend) as renderer:
        work = one.in_turn(folder, renderer, settings_of(listed), Outputs(check=True))
        run.run(listed, folder, settings_of(listed), work, Ear(), outputs=Outputs(check=True))
    one_process, two_workers = contents(tmp_path / "one"), contents(tmp_path / "two")
    assert len(one_process) == 12 * 3 + 1
    assert one_process == two_workers


def test_a_difference_in_one_byte_would_be_seen(stand_in, machines, blend, tmp_path):
    run_on(machines, blend, tmp_path / "out", shots("a"))
    before = contents(tmp_path / "out")
    sidecar = tmp_path / "out" / "a.json"
    sidecar.write_bytes(sidecar.read_bytes().replace(b"400.0", b"400.1"))
    assert contents(tmp_path / "out") != before


@pytest.mark.parametrize("victim", ["worker", "blender"])
def test_what_is_killed_in_the_midst_of_a_shot_loses_nothing(stand_in, machines, blend, tmp_path, processes, victim):
    listed = shots("a", "slow_one", "b", "c", "d", "e")
    ear, outcome = Ear(), []
    batch = threading.Thread(target=lambda: outcome.append(run_on(machines, blend, tmp_path / "out", listed, ear)), daemon=True)
    batch.start()
    assert processes.until(lambda: stand_in.diary("waits")), "the shot was never begun"
    blender = int(stand_in.diary("waits")[0][-1])
    worker = int(Path(f"/proc/{blender}/stat").read_text().rpartition(")")[2].split()[1])
    os.kill(worker if victim == "worker" else blender, signal.SIGKILL)
    batch.join(60)
    assert outcome and outcome[0].exit_status == 0, ear.events
    assert outcome[0].counts["done"] == 6 and not ear.all("shot_failed")
    assert processes.until(lambda: not processes.run(blender)), "the killed worker's Blender goes on"
    assert len([words for words in stand_in.diary("render") if words[1] == "slow_one"]) == 2
    assert processes.run(worker) == (victim == "blender")


@pytest.mark.exhaustive
def test_a_worker_that_is_stopped_holds_no_batch_up_with_a_time_limit_or_without(
    stand_in, blend, tmp_path, processes, monkeypatch
):
    """The time limit is a Blender's; that a worker says nothing is the scheduler's to see."""
    monkeypatch.setattr(cluster, "_WORKERS_WITHIN", 5.0)
    listed, folder, ear, outcome = shots("a", "slow_one", "b", "c"), Folder(tmp_path / "out"), Ear(), []
    with cluster.opened(None, 2) as machines:
        work = machines.work(blend, folder, settings_of(listed), MADE_FROM, time_limit=40.0)
        batch = threading.Thread(
            target=lambda: outcome.append(run.run(listed, folder, settings_of(listed), work, ear)), daemon=True
        )
        batch.start()
        assert processes.until(lambda: stand_in.diary("waits")), "the shot was never begun"
        blender = int(stand_in.diary("waits")[0][-1])
        worker = int(Path(f"/proc/{blender}/stat").read_text().rpartition(")")[2].split()[1])
        os.kill(worker, signal.SIGSTOP)
        batch.join(60)
        with contextlib.suppress(ProcessLookupError):  # Dask has ended it
            os.kill(worker, signal.SIGKILL)
    assert outcome and outcome[0].counts["done"] == 4 and not ear.all("shot_failed"), ear.events
    assert len({words[-1] for words in stand_in.diary("render") if words[1] == "slow_one"}) == 2


@pytest.mark.exhaustive
def test_a_worker_that_takes_long_to_start_again_is_not_given_up(stand_in):
    """Dask takes a worker away for good that is not there again in time, 15 s by default, which a busy machine may need."""
    with dask.config.set({"distributed.deploy.lost-worker-timeout": "1 ms"}), cluster.opened(None, 1) as machines:
        machines._client.wait_for_workers(1, timeout=60)
        (worker,) = machines._client.run(os.getpid).values()
        time.sleep(0.5)  # Dask starts none anew that ends while it begins
        os.kill(worker, signal.SIGKILL)
        ends, others = time.monotonic() + 60, {worker}
        while others <= {worker} and time.monotonic() < ends:
            time.sleep(0.1)
            others = set(machines._client.run(os.getpid, on_error="ignore").values())
    assert others - {worker}, "no other worker came in its place"


def test_a_shot_that_always_crashes_blender_fails_and_the_rest_go_on(stand_in, machines, blend, tmp_path):
    ear = Ear()
    summary = run_on(machines, blend, tmp_path / "out", shots("a", "crash", "bad", "b", "c"), ear)
    assert summary.exit_status == 4
    failed = {fields["shot"]: fields["error"] for fields in ear.all("shot_failed")}
    assert set(failed) == {"crash", "bad"}
    assert f"{served_renderer.ATTEMPTS} times in a row" in failed["crash"] and failed["bad"] == "bad has no light: add some"
    assert {fields["shot"] for fields in ear.all("shot_done")} == {"a", "b", "c"}


@pytest.mark.exhaustive
def test_a_shot_that_ends_one_worker_after_another_fails_and_the_rest_go_on(stand_in, blend, tmp_path):
    """On workers of its own: Dask may give up one that ends as it begins, and the other tests would wait for it."""
    ear = Ear()
    with cluster.opened(None, 2) as machines:
        summary = run_on(machines, blend, tmp_path / "out", shots("a", "poison", "b", "c"), ear)
    assert summary.exit_status == 4 and {fields["shot"] for fields in ear.all("shot_done")} == {"a", "b", "c"}
    ((failure),) = ear.all("shot_failed")
    assert failure["shot"] == "poison" and "every worker that took this shot ended in it" in failure["error"]
    assert len({words[-1] for words in stand_in.diary("render") if words[1] == "poison"}) == 4, "as docs/farm.md says"


def test_a_full_disk_ends_the_batch(stand_in, machines, blend, tmp_path):
    ear = Ear()
    summary = run_on(machines, blend, tmp_path / "out", shots("full", *(f"steady_{i}" for i in range(40))), ear)
    assert summary.exit_status == 4 and summary.counts["left"] > 20
    (failure,) = ear.all("shot_failed")
    assert "No space left on device" in failure["error"]


def test_workers_that_would_make_other_pictures_get_no_shots(stand_in, machines, blend, tmp_path):
    other = MADE_FROM | {"blender": "5.2.2"}
    with pytest.raises(InputError, match=r"the worker tls://\S+ can't render: .* another blender there: give all machines"):
        run_on(machines, blend, tmp_path / "out", shots("a", "b", "c"), made_from=other)
    assert not stand_in.diary("render")


def test_a_file_that_changed_between_two_batches_is_loaded_again(stand_in, machines, blend, tmp_path):
    def loads():  # this file's shots: one of the test before may have been under way
        return len([words for words in stand_in.diary("open") if words[1] == str(blend)])

    run_on(machines, blend, tmp_path / "out", shots("a", "b", "c", "d"))
    before = loads()
    assert before in (1, 2), "once for each worker that had a shot"
    blend.write_text("another scene")
    for name in ("e", "f"):
        run_on(machines, blend, tmp_path / "out2", shots(name), made_from=MADE_FROM | {"blend": "another scene"})
        assert before < loads() <= before + 2
    summary = run_on(machines, blend, tmp_path / "out2", shots("g", "h"), made_from=MADE_FROM | {"blend": "another scene"})
    assert summary.exit_status == 0 and loads() <= before + 2


@pytest.mark.exhaustive
def test_a_worker_without_a_blender_says_so_in_a_sentence(stand_in, blend, tmp_path, monkeypatch):
    monkeypatch.setenv("VIEWCAM_BLENDER", str(tmp_path / "ghost"))
    with cluster.opened(None, 1) as machines, pytest.raises(InputError, match=r"ghost can't be started"):
        run_on(machines, blend, tmp_path / "out", shots("a"))


@pytest.mark.exhaustive
def test_threads_are_the_cores_shared_among_the_workers(stand_in, blend, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster.machine, "cores", lambda: 7)
    with cluster.opened(None, 2) as machines:
        run_on(machines, blend, tmp_path / "out", shots("a"))
    assert [words[2] for words in stand_in.diary("render")] == ["3"]


def test_blender_computes_in_as_many_threads_as_without_dask(stand_in, machines, blend, tmp_path):
    """Dask makes the libraries of its workers compute in one, and what these add up may then be other bits."""
    assert os.environ.get("OMP_NUM_THREADS") != "1", "this test would see no difference"
    run_on(machines, blend, tmp_path / "out", shots("a"))
    assert stand_in.diary("one-thread")[0][1] == str(os.environ.get("OMP_NUM_THREADS"))


@pytest.mark.exhaustive
def test_nothing_of_dask_stays_in_this_process(stand_in, processes, monkeypatch):
    """Modules to be found and their order, variables, levels of logging, what Python's main program is; threads."""
    monkeypatch.syspath_prepend(str(ROOT))  # found already, before others

    def state():
        program = sys.modules["__main__"]
        logs = logging.root.manager.disable
        return program.__spec__, getattr(program, "__file__", None), list(sys.path), dict(os.environ), logs

    with cluster.opened(None, 1):  # starts threads that Python keeps for later
        pass
    before, threads = state(), threading.active_count()
    with cluster.opened(None, 1):
        pass
    assert state() == before
    assert processes.until(lambda: threading.active_count() <= threads), threading.enumerate()


@pytest.mark.parametrize(
    "address", ["tcp://127.0.0.1:9", "nonsense://here:1", "tcp://no-such-host.invalid:8786", "127.0.0.1:x"]
)
def test_a_scheduler_that_can_not_be_reached_is_one_sentence_within_seconds(address):
    started = time.monotonic()
    with (
        pytest.raises(InputError, match=rf"^no Dask scheduler answers at {re.escape(address)}") as caught,
        cluster.opened(address, None),
    ):
        pass
    assert time.monotonic() < started + 5 * 10  # it is given 5 s
    assert "\n" not in str(caught.value)


def test_a_server_that_is_no_scheduler_is_one_sentence_too():
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        with pytest.raises(InputError, match=r"^no Dask scheduler answers"), cluster.opened(address, None):
            pass


@pytest.fixture
def farm(tmp_path, processes):
    """Starts a scheduler and workers as docs/farm.md says; gives (address, start a worker)."""
    family, scratch = [], tmp_path / "scratch"
    scratch.mkdir()

    def start(*words, until, **variables):
        """A process that has said that it is ready, and the address that it said."""
        message = scratch / f"{len(family)}.txt"
        family.append(
            child_process.ProcessGroup([sys.executable, "-m", "dask", *words], message, child_process.environment(**variables))
        )
        ready = re.compile(rf"{until}:\s+(tcp://\S+)")
        assert processes.until(lambda: ready.search(message.read_text())), message.read_text()
        return family[-1], ready.search(message.read_text())[1]

    _, address = start("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", until="Scheduler at")

    def worker(**variables):
        place = "--nthreads", "1", "--no-dashboard", "--local-directory", str(scratch)
        return start("worker", address, *place, until="Registered to", **variables)[0]

    yield address, worker, lambda: family[0].end()
    for each in family:
        each.end()


@pytest.mark.exhaustive
def test_a_scheduler_without_workers_is_one_sentence(farm):
    address, _, _ = farm
    with (
        pytest.raises(InputError, match=rf"the scheduler at {address} has no workers: start some"),
        cluster.opened(address, None),
    ):
        pass


@pytest.mark.exhaustive
def test_blender_of_a_farm_computes_in_all_threads_too(farm, stand_in, blend, tmp_path):
    address, worker, _ = farm
    worker()
    with cluster.opened(address, None) as machines:
        run_on(machines, blend, tmp_path / "out", shots("a"))
    assert stand_in.diary("one-thread")[0][1] == "None"


@pytest.mark.exhaustive
def test_workers_of_a_farm_keep_their_blender_from_batch_to_batch(farm, stand_in, blend, tmp_path):
    address, worker, _ = farm
    worker()
    for folder in ("one", "two"):
        with cluster.opened(address, None) as machines:
            assert run_on(machines, blend, tmp_path / folder, shots("a", "b", "c")).exit_status == 0
    assert len(stand_in.diary("open")) == 1
    assert {words[2] for words in stand_in.diary("render")} == {"None"}, "the machine's own threads"


@pytest.mark.exhaustive
def test_the_shots_of_a_machine_that_is_not_fit_are_rendered_by_another(farm, stand_in, blend, tmp_path):
    address, worker, _ = farm
    worker(VIEWCAM_BLENDER=str(tmp_path / "ghost"))
    worker()
    with cluster.opened(address, None) as machines:
        summary = run_on(machines, blend, tmp_path / "out", shots(*"abcdef"))
    assert summary.exit_status == 0 and summary.counts["done"] == 6


@pytest.mark.exhaustive
@pytest.mark.parametrize("hears", ["in time", "too late"])
def test_a_scheduler_that_dies_ends_the_batch_with_what_is_left(farm, stand_in, blend, tmp_path, processes, monkeypatch, hears):
    """Also where it dies before it could say that the first shot is done."""
    address, worker, kill_scheduler = farm
    worker()
    ear, outcome, heard = Ear(), cluster._Flight._outcome, threading.Event()

    def outcome_of(flight, future, shot):
        if hears == "too late":
            killer.join()
        message = outcome(flight, future, shot)
        heard.set()
        return message

    def kill():
        assert processes.until(lambda: stand_in.diary("waits"))
        if hears == "in time":
            heard.wait(30)
        kill_scheduler()

    monkeypatch.setattr(cluster._Flight, "_outcome", outcome_of)
    killer = threading.Thread(target=kill, daemon=True)
    with cluster.opened(address, None) as machines:
        killer.start()
        summary = run_on(machines, blend, tmp_path / "out", shots("a", "slow_one", "b", "c", "d", "e"), ear)
        killer.join()
    assert summary.exit_status == 4 and summary.counts["done"] == 1
    assert all("the scheduler is gone" in fields["error"] for fields in ear.all("shot_failed"))


def listening(process):
    """(address, port) of each TCP socket on which a process listens, and all that descend from it."""
    psutil = pytest.importorskip("psutil")  # Dask brings it
    family = [psutil.Process(process), *psutil.Process(process).children(recursive=True)]
    sockets = [each for member in family for each in member.net_connections(kind="tcp") if each.status == "LISTEN"]
    return {(each.laddr.ip, each.laddr.port) for each in sockets}


@pytest.mark.exhaustive
def test_nobody_else_on_this_machine_can_have_the_workers_run_anything(stand_in, machines, tmp_path):
    """Neither without credentials nor with others, at any port that scheduler, workers and nannies have."""
    import distributed

    mark = tmp_path / "mark"

    async def run(address, security):
        # A call as by Client.run, or as by workers and nannies among themselves.
        async with distributed.core.rpc(address, timeout=3, connection_args=security.get_connection_args("client")) as server:
            return await asyncio.wait_for(server.run(function=distributed.protocol.pickle.dumps(mark.mkdir)), 3)

    ports = listening(os.getpid())
    assert len(ports) >= 5, "a scheduler, two nannies, two workers"
    assert {address for address, _ in ports} <= {"127.0.0.1"}
    own = machines._client.security
    assert asyncio.run(run(machines.addresses()[0], own))["status"] == "OK" and mark.is_dir(), "the test could not fail"
    mark.rmdir()
    for _, port in ports:
        for security, scheme in ((distributed.Security(), "tcp"), (distributed.Security.temporary(), "tls")):
            with pytest.raises((OSError, TypeError)):
                asyncio.run(run(f"{scheme}://127.0.0.1:{port}", security))
    assert not mark.exists()
    for _, port in ports:
        with contextlib.suppress(OSError), urllib.request.urlopen(f"http://127.0.0.1:{port}/info/main/workers.html", timeout=3):
            raise AssertionError(f"port {port} tells everybody about the workers")


@pytest.mark.exhaustive
def test_a_farm_by_tls_as_the_page_says(stand_in, blend, tmp_path, processes):
    """The configuration of docs/farm.md, with an authority of this test's own; whoever has none is not let in."""
    import dask
    import distributed
    import yaml

    security = distributed.Security.temporary()
    for name, text in (("ca", security.tls_ca_file), ("farm", security.tls_worker_cert), ("farm-key", security.tls_worker_key)):
        (tmp_path / f"{name}.pem").write_text(text)
    page = (ROOT / "docs" / "farm.md").read_text(encoding="utf-8")
    settings = re.search(r"(?ms)^```yaml\n(.*?)^```$", page)[1].replace("/shared/tls", str(tmp_path))
    (tmp_path / "tls.yaml").write_text(settings)
    family = []

    def start(address, *words):
        variables = child_process.environment(
            DASK_CONFIG=str(tmp_path / "tls.yaml"), DASK_TEMPORARY_DIRECTORY=str(tmp_path / "dask")
        )
        family.append(child_process.ProcessGroup([sys.executable, "-m", "dask", *words], tmp_path / address, variables))
        return tmp_path / address

    try:
        message = start(
            "scheduler.txt", *["scheduler", "--protocol", "tls", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
        )
        assert processes.until(lambda: re.search(r"Scheduler at:\s+(tls://\S+)", message.read_text())), message.read_text()
        address = re.search(r"Scheduler at:\s+(tls://\S+)", message.read_text())[1]
        worker = start("worker.txt", "worker", address, "--nthreads", "1", "--no-dashboard")
        assert processes.until(lambda: "Registered to:" in worker.read_text()), worker.read_text()
        own = dask.config.merge(dask.config.config, yaml.safe_load(settings))
        with dask.config.set(own), cluster.opened(address, None) as machines:
            assert run_on(machines, blend, tmp_path / "out", shots("a", "b")).exit_status == 0
        with pytest.raises(InputError, match="no Dask scheduler answers"), cluster.opened(address, None):
            pass
    finally:
        for each in family:
            each.end()


@pytest.mark.parametrize(("address", "warned"), [("tcp://127.0.0.1:9", True), ("tls://127.0.0.1:9", False)])
def test_a_plain_scheduler_is_warned_of(stand_in, blend, tmp_path, capfd, address, warned):
    (tmp_path / "shots.csv").write_text("name,camera\na,Left\n")
    words = [str(blend), str(tmp_path / "shots.csv"), "--out", str(tmp_path / "out"), "--scheduler", address]
    assert cli.main(["batch", *words]) == 2
    sentence = f"viewcam batch: note: whoever reaches {address} can run any program on its workers: docs/farm.md says how TLS"
    assert (sentence in capfd.readouterr().err) == warned


@pytest.mark.exhaustive
@pytest.mark.parametrize("hangs", ["the loop", "the client"])
def test_a_cluster_is_closed_within_seconds_whatever_hangs(stand_in, processes, monkeypatch, hangs):
    monkeypatch.setattr(cluster, "_CLOSED_WITHIN", 1.0)
    released = threading.Event()
    try:
        with cluster.opened(None, 2) as machines:
            nannies = machines._client.cluster.workers.values()
            family = [nanny.pid for nanny in nannies]
            if hangs == "the loop":
                machines._client.loop.add_callback(released.wait)
            else:
                monkeypatch.setattr(type(machines._client), "close", lambda *_: released.wait())
        # Nothing here waits for Dask; were it waited for, this test's own time limit would end it.
        assert processes.until(lambda: not any(map(processes.run, family))), "workers go on"
        assert not released.is_set()
    finally:
        released.set()


def test_without_cryptography_a_sentence_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "cryptography", None)
    with (
        pytest.raises(InputError, match=r"need cryptography, to be safe from others .*: \S+ -m pip install cryptography"),
        cluster.opened(None, 2),
    ):
        pass


def test_workers_that_write_into_another_folder_are_told_and_nothing_is_believed(
    stand_in, machines, blend, tmp_path, monkeypatch
):
    monkeypatch.setattr(cluster, "_ANSWER_WITHIN", 1.0)
    monkeypatch.setattr(Folder, "finished", lambda *_: None)
    with pytest.raises(InputError, match="is another folder there: share the folder"):
        run_on(machines, blend, tmp_path / "out", shots("a"))


def test_without_dask_a_sentence_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with (
        pytest.raises(InputError, match=r"need Dask, which is not here: \S+ -m pip install distributed"),
        cluster.opened(None, 2),
    ):
        pass


needs_posix = pytest.mark.skipif(
    sys.platform == "win32", reason="Windows has neither groups of processes nor SIGKILL, and /proc is Linux's"
)
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


@needs_posix
@pytest.mark.exhaustive
def test_a_script_that_has_workers_is_not_run_again_by_them(stand_in, blend, tmp_path):
    script = tmp_path / "script.py"  # as people write them: nothing asks for __main__
    script.write_text("print('run')" + COORDINATOR)
    command = [sys.executable, script, Path(__file__).parent, blend, tmp_path / "out", "a", "b"]
    done = subprocess.run(command, env=child_process.environment(), capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout == "run\n", done.stdout + done.stderr


@needs_posix
@pytest.mark.parametrize(
    "end", ["SIGKILL", *(pytest.param(end, marks=pytest.mark.exhaustive) for end in ("finished", "SIGINT", "SIGTERM"))]
)
def test_nothing_is_left_running_and_nothing_is_said(stand_in, blend, tmp_path, processes, end):
    """Also when the coordinator is killed, or when Ctrl-C reaches the whole group."""
    command = [sys.executable, "-c", COORDINATOR, str(Path(__file__).parent), str(blend), str(tmp_path / "out"), "a", "b"]
    slow = [] if end == "finished" else ["slow_one", "c", "d"]
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
            if end == "SIGKILL":
                batch.kill()
            else:
                os.killpg(batch.pid, getattr(signal, end))
                os.kill(int(stand_in.diary("waits")[0][-1]), signal.SIGKILL)  # the slow shot shall not take a minute
        output, _ = batch.communicate(timeout=60)
        status = batch.returncode
    finally:
        batch.kill()
    blenders = {int(words[-1]) for words in stand_in.diary("open")}

    def left():
        return [process for process in family | blenders if processes.run(process)]

    assert processes.until(lambda: not left()), f"still running: {left()}"
    assert status == {"finished": 0, "SIGKILL": -9, "SIGINT": 130, "SIGTERM": 143}[end], output
    assert output == b""
    assert set(os.listdir(os.getcwd())) == before, "something was left in the user's folder"
