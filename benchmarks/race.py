"""Races between Cycles and the tracer. Blender has a process of its own: OpenEXR must not be loaded beside the one it brings.

The rounds of a race are interleaved, since a machine's speed drifts, and what is reported are medians and their ratios.
"""

import multiprocessing
import os
import resource
import statistics
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Mapping
from multiprocessing.connection import Connection

from viewcam_addon.terminal import silent_libraries

Runner = Callable[[], float]


class Blender:
    """A process with Blender in it, for the time of a `with` block.

    prepare : a function at the top of a module; it is called there with the arguments and returns what can be asked for:
    name → a function that does it once and returns its seconds.
    """

    def __init__(self, prepare: Callable[..., Mapping[str, Runner]], *arguments: object) -> None:
        context = multiprocessing.get_context("spawn")
        self._here, there = context.Pipe()
        self._process = context.Process(target=_serve, args=(there, prepare, arguments))
        self._process.start()
        there.close()
        self.names: list[str] = self._here.recv()
        self.peak_memory = 0.0

    def __enter__(self) -> "Blender":
        return self

    def __exit__(self, *_: object) -> None:
        self._here.send(None)
        self.peak_memory = self._here.recv()
        self._process.join()

    def runners(self) -> dict[str, Runner]:
        """What can be asked for, as functions of this process."""
        return {name: lambda name=name: self._ask(name) for name in self.names}

    def _ask(self, name: str) -> float:
        self._here.send(name)
        return self._here.recv()


def run(runners: Mapping[str, Runner], rounds: int) -> dict[str, list[float]]:
    """Seconds of each runner in each round, after a round to warm up."""
    times = defaultdict(list)
    for _ in range(rounds + 1):
        for name, runner in runners.items():
            times[name].append(runner())
    return {name: seconds[1:] for name, seconds in times.items()}


def timed(work: Callable[[], object]) -> Runner:
    """A runner that is timed as a whole."""

    def runner() -> float:
        start = time.perf_counter()
        work()
        return time.perf_counter() - start

    return runner


def medians(times: Mapping[str, list[float]]) -> dict[str, float]:
    return {name: statistics.median(seconds) for name, seconds in times.items()}


def peak_memory() -> float:
    """Megabytes; the operating system counts them in kilobytes, macOS in bytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e6 if sys.platform == "darwin" else 1e3)


def _serve(asked: Connection, prepare: Callable[..., Mapping[str, Runner]], arguments: tuple) -> None:
    """Blender keeps its progress to itself."""
    with silent_libraries():
        runners = prepare(*arguments)
        asked.send(list(runners))
        while (name := asked.recv()) is not None:
            asked.send(runners[name]())
        asked.send(peak_memory())
        asked.close()
        os._exit(0)  # bpy's own clean-up crashes in some versions
