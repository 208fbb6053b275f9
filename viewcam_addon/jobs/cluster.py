"""The shots of a batch on several workers: Dask hands them out, and hands them out again where a worker dies.

The workers are this machine's own for the time of a batch, or those of a scheduler that runs already (docs/farm.md). This
process keeps the claims on the folder and a few shots in flight; the workers render and write (worker.py). What a worker says
it did is believed when the shot is seen in the folder. A worker that can render none of the shots gets no more of them.

Rejected: a protocol of our own (Dask has retries, dead workers and farms already), pickled functions (a Blender calls this
package by another name than its workers do, and may have another Python), and pictures sent through the network beside a
folder that all share anyway.
"""

import contextlib
import dataclasses
import logging
import math
import os
import pkgutil
import queue
import signal
import sys
import threading
import time
import uuid
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import CancelledError
from pathlib import Path
from typing import Any

from .. import machine
from ..errors import FullDiskError, InputError, bug
from ..files import temporary_folder
from . import served_renderer
from .folder import Folder, Outputs
from .job import Job
from .one import Outcome, Work

_WORKER = "viewcam_addon.jobs.worker"  # as the workers know it

_MOMENT = 0.2  # seconds
_ANSWER_WITHIN = 5.0
"""Seconds for a scheduler to answer, for it to name a worker, and for a picture of another machine to be seen here."""
_WORKERS_WITHIN = 60.0
"""Seconds for a worker to come back when all are gone; and for a connection within this machine, however busy it is."""
_CLOSED_WITHIN = 10.0
"""Seconds for Dask to close what it has opened, which takes it a tenth of one; then it is left behind."""


@contextlib.contextmanager
def opened(scheduler: str | None, workers: int | None, blender: str | None = None) -> Iterator["Cluster"]:
    """A cluster for a batch: that of a scheduler (`tcp://host:port`), or one of `workers` processes of this machine.

    blender : the Blender that processes of this machine run, unless VIEWCAM_BLENDER names one.

    The processes of this machine talk by TLS with credentials that exist in their memory alone, so that nobody else on it can
    have them run anything. Rejected: Unix sockets, which Dask does not have.

    Raises InputError if Dask is not installed, or the scheduler does not answer or has no workers.
    """
    distributed = _distributed()
    import dask

    ways = {
        "distributed.comm.timeouts.connect": f"{_ANSWER_WITHIN if scheduler else _WORKERS_WITHIN} s",
        "distributed.deploy.lost-worker-timeout": "1 day",  # a busy machine takes longer than 15 s to start one anew
        "distributed.nanny.pre-spawn-environ": {},  # it would be this process's, too, and for good
        "distributed.scheduler.allowed-failures": 1,  # a shot's workers, until it is tried alone
        "distributed.scheduler.worker-ttl": f"{_WORKERS_WITHIN} s",  # a worker that is stopped says nothing
        "distributed.scheduler.http.routes": [],  # pages of ours that others on this machine could read
        "distributed.worker.http.routes": [],
    }
    with _without_logs(), dask.config.set(ways):
        if scheduler:
            with _connected(distributed, scheduler) as client:
                yield Cluster(client, None)
            return
        count = workers or min(2, machine.cores())
        with temporary_folder() as scratch, _processes_of_this_package():
            local = distributed.LocalCluster(
                n_workers=count,
                threads_per_worker=1,
                processes=True,
                memory_limit=None,  # it is Blender, another process, that needs memory
                security=_credentials(distributed),
                dashboard_address="127.0.0.1:0",
                scheduler_kwargs={"dashboard": False},
                local_directory=str(scratch),
                silence_logs=logging.CRITICAL,
                preload=[_WORKER],
                env={served_renderer.BLENDER: os.environ.get(served_renderer.BLENDER) or blender or ""},
            )
            with _ending(local), _ending(distributed.Client(local, set_as_default=False)) as client:
                yield Cluster(client, max(1, machine.cores() // count))


class Cluster:
    """Workers that a scheduler knows.

    threads : the number of threads of each, unless the command line says.
    """

    def __init__(self, client: Any, threads: int | None) -> None:
        self._client, self.threads = client, threads
        self._seen, self._asked = (), -math.inf

    def work(
        self,
        blend: Path,
        folder: Folder,
        settings: Mapping[str, str],
        made_from: Mapping[str, Any],
        outputs: Outputs | None = None,
        trust: bool = False,
        time_limit: float | None = None,
    ) -> Work:
        """The work of the workers on one file; the same bytes as one.in_turn's but for `timing`.

        settings : the hash of what each shot is made from, by its name.
        made_from : a record of what the file is made from, which must be the same for each worker.

        The work raises InputError if no worker can render any of the shots. If all are lost later, the shots in flight fail
        and no more are taken.
        """
        scene = {"blend": str(blend.absolute()), "trust": trust, "time_limit": time_limit, "made_from": dict(made_from)}
        return lambda shots: _Flight(self, scene, folder, settings, outputs or Outputs()).outcomes(shots)

    def addresses(self) -> tuple[str, ...]:
        """The workers, as of a moment ago."""
        if time.monotonic() > self._asked + 1:
            with _scheduler_asked():
                self._seen, self._asked = tuple(self._client.nthreads()), time.monotonic()
        return self._seen

    def submit(self, name: str, *arguments: Any, workers: tuple[str, ...] | None) -> Any:
        """A future of worker.render with these arguments, on one of these workers, or on any. name : on Dask's own pages."""
        key = f"{name}-{uuid.uuid4().hex}"
        with _scheduler_asked():
            return self._client.submit(_Render(), *arguments, key=key, workers=workers, pure=False)

    def where(self, future: Any) -> tuple[str, ...]:
        """The workers that have a result."""
        with _scheduler_asked():
            return tuple(self._client.who_has([future]).get(future.key, ()))


class _LostError(Exception):
    """The workers are lost; the message is a sentence."""


@contextlib.contextmanager
def _scheduler_asked() -> Iterator[None]:
    """Dask's errors where the scheduler does not answer any more become the sentence that says so."""
    try:
        yield
    except (OSError, CancelledError) as error:
        raise _LostError("the scheduler is gone: start it and its workers again, and continue with --resume") from error


class _Flight:
    """The shots of one batch, from when they are submitted until their outcome is known."""

    def __init__(self, cluster: Cluster, scene: dict, folder: Folder, settings: Mapping[str, str], outputs: Outputs) -> None:
        self._cluster, self._scene, self._folder = cluster, scene, folder
        self._settings, self._outputs = settings, outputs
        self._pending: dict[str, tuple[Any, Job]] = {}
        self._finished: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._suspects: list[Job] = []
        self._unfit: dict[str, str] = {}
        self._without_workers_since: float | None = None
        self._fruitful = False

    def outcomes(self, shots: Iterator[Job | None]) -> Iterator[tuple[Job, Outcome]]:
        try:
            for shot in shots:
                if shot is None:
                    yield from self._next()
                    continue
                self._submit(shot)
                # One more than there are workers, so that none waits for us between two shots.
                while len(self._pending) > max(1, len(self._fit())):
                    yield from self._next()
            yield from self._rest()
            for shot in self._suspects:
                self._submit(shot)
                yield from self._rest()
        except _LostError as lost:
            yield from self._lost(InputError(str(lost)))
        finally:
            for future, _ in self._pending.values():
                future.cancel()

    def _lost(self, error: InputError) -> Iterator[tuple[Job, Outcome]]:
        """The outcomes of the shots in flight when no worker can say more: what stands in the folder is done.

        Raises the error if no shot ever was.
        """
        shots = [shot for _, shot in self._pending.values()]
        records = [self._record(shot) for shot in shots]
        if not self._fruitful and not any(records):
            raise error
        for shot, record in zip(shots, records, strict=True):
            yield shot, record or error

    def _rest(self) -> Iterator[tuple[Job, Outcome]]:
        while self._pending:
            yield from self._next()

    def _submit(self, shot: Job) -> None:
        fields = {**shot.to_json(), "threads": shot.threads or self._cluster.threads}
        arguments = (
            self._scene,
            str(self._folder.path.absolute()),
            fields,
            self._settings[shot.name],
            dataclasses.asdict(self._outputs),
        )
        future = self._cluster.submit(shot.name, *arguments, workers=self._fit() if self._unfit else None)
        self._pending[future.key] = future, shot
        future.add_done_callback(self._finished.put)

    def _fit(self) -> tuple[str, ...]:
        """The workers that may have a shot. Raises _LostError if there are workers, and none of them may."""
        addresses = self._cluster.addresses()
        fit = tuple(address for address in addresses if address not in self._unfit)
        if addresses and not fit:
            raise _LostError("; ".join(dict.fromkeys(self._unfit[address] for address in addresses)))
        return fit

    def _next(self) -> Iterator[tuple[Job, Outcome]]:
        """The next outcome, if there is one within a moment."""
        try:
            future = self._finished.get(timeout=_MOMENT)
        except queue.Empty:
            self._look_after_workers()
            return
        _, shot = self._pending[future.key]
        outcome = self._outcome(future, shot)
        if outcome is not None:
            self._fruitful = True
            del self._pending[future.key]
            yield shot, outcome

    def _look_after_workers(self) -> None:
        if self._fit() or not self._pending:
            self._without_workers_since = None
        elif self._without_workers_since is None:
            self._without_workers_since = time.monotonic()
        elif time.monotonic() > self._without_workers_since + _WORKERS_WITHIN:
            raise _LostError("all workers are gone: start some, and continue with --resume")

    def _outcome(self, future: Any, shot: Job) -> Outcome | None:
        """The outcome of the shot; None if it flies on."""
        with _scheduler_asked():
            try:
                answer = future.result(timeout=_ANSWER_WITHIN)
            except TimeoutError:  # the worker died with the result, and another one renders the shot again
                future.add_done_callback(self._finished.put)
                return None
            except (OSError, CancelledError):
                raise
            except Exception as error:  # worker.render raises none
                return self._refused(error, future, shot)
        if "full" in answer:
            return FullDiskError(answer["full"])
        if "failed" in answer:
            return InputError(answer["failed"])
        unfit = answer.get("unfit")
        if unfit is None:
            record = self._seen(shot)
            if record is not None:
                return record
            unfit = f"{self._folder.path} is another folder there: share the folder of the pictures among the machines"
        for address in self._cluster.where(future):
            self._unfit[address] = f"the worker {address} can't render: {unfit}"
        del self._pending[future.key]
        self._submit(shot)
        return None

    def _refused(self, error: Exception, future: Any, shot: Job) -> Outcome | None:
        """The outcome of an error that is Dask's."""
        if isinstance(error, ImportError):
            raise _LostError(f"a worker can't load viewcam ({error}): pip install virtual-pinhole there") from error
        if type(error).__name__ != "KilledWorker":
            return InputError(bug(error))
        if shot not in self._suspects:  # Dask means every shot that these workers had: at the end each is tried alone
            self._suspects.append(shot)
            del self._pending[future.key]
            return None
        return InputError("every worker that took this shot ended in it: see whether their machines have memory enough")

    def _seen(self, shot: Job) -> dict[str, Any] | None:
        """The sidecar, which a folder of another machine may show a little later."""
        ends = time.monotonic() + _ANSWER_WITHIN
        while True:
            record = self._record(shot)
            if record is not None or time.monotonic() > ends:
                return record
            time.sleep(_MOMENT)

    def _record(self, shot: Job) -> dict[str, Any] | None:
        return self._folder.finished(shot.name, self._settings[shot.name], self._outputs)


class _Render:
    """worker.render by its name alone, which becomes the function itself where it arrives."""

    def __call__(self, *_: object) -> None:
        raise AssertionError("it is called where it arrives")

    def __reduce__(self) -> tuple[Callable[[str], Any], tuple[str]]:
        return pkgutil.resolve_name, (f"{_WORKER}:render",)


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        raise InputError(f"several workers need Dask, which is not here: {sys.executable} -m pip install distributed") from None
    return distributed


def _credentials(distributed: Any) -> Any:
    """The credentials of this cluster alone, made anew."""
    try:
        return distributed.Security.temporary()
    except ImportError:
        install = f"{sys.executable} -m pip install cryptography"
        raise InputError(f"several workers need cryptography, to be safe from others on this machine: {install}") from None


@contextlib.contextmanager
def _ending(opened: Any) -> Iterator[Any]:
    """Close Dask's client or cluster at the end, within seconds: where its loop is stuck, its own close waits for ever."""
    try:
        yield opened
    finally:
        # Its loop may be what hangs, so their numbers are asked for before.
        processes = [nanny.pid for nanny in getattr(opened, "workers", {}).values()]
        closing = threading.Thread(target=_close, args=(opened,), daemon=True)
        closing.start()
        closing.join(_CLOSED_WITHIN)
        if closing.is_alive():
            for process in filter(None, processes):
                with contextlib.suppress(OSError):
                    os.kill(process, signal.SIGTERM if sys.platform == "win32" else signal.SIGKILL)


def _close(opened: Any) -> None:
    with contextlib.suppress(Exception):  # there is nobody who could do anything about it
        opened.close()


@contextlib.contextmanager
def _processes_of_this_package() -> Iterator[None]:
    """Let the processes that start meanwhile import this package by its own name, which inside Blender is another, and not run
    again the program that this process runs: it may be any script, and none that a worker needs."""
    parent, program = str(Path(__file__).parents[2]), vars(sys.modules["__main__"])
    kept: dict[str, Any] = {name: program.pop(name) for name in ("__file__", "__spec__") if name in program}
    program["__spec__"] = None
    absent = parent not in sys.path
    if absent:
        sys.path.append(parent)
    try:
        yield
    finally:
        if absent:
            sys.path.remove(parent)
        program.update(kept)


@contextlib.contextmanager
def _connected(distributed: Any, scheduler: str) -> Iterator[Any]:
    """A client of the scheduler, which has workers."""
    answers: queue.SimpleQueue[Any] = queue.SimpleQueue()

    def connect() -> None:
        try:
            answers.put(distributed.Client(scheduler, timeout=_ANSWER_WITHIN, set_as_default=False))
        except Exception as error:  # whatever keeps it from a scheduler is the answer
            answers.put(error)

    # Dask would wait for ever for what listens there and is no scheduler.
    threading.Thread(target=connect, daemon=True).start()
    try:
        client = answers.get(timeout=2 * _ANSWER_WITHIN)
    except queue.Empty:
        client = TimeoutError("what is there says nothing")
    if isinstance(client, Exception):
        reason = str(client).splitlines()[0] if str(client) else type(client).__name__
        raise InputError(
            f"no Dask scheduler answers at {scheduler} ({reason}): see whether it runs there, or give --workers N without it"
        ) from client
    with _ending(client):
        try:
            client.wait_for_workers(1, timeout=_ANSWER_WITHIN)
        except TimeoutError as error:
            raise InputError(
                f"the scheduler at {scheduler} has no workers: start some with `dask worker {scheduler} --nthreads 1`"
            ) from error
        yield client


@contextlib.contextmanager
def _without_logs() -> Iterator[None]:
    """Dask and tornado log what a user can do nothing about, and what we tell in a sentence."""
    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        yield
    finally:
        logging.disable(before)
