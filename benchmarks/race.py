"""Races between renderers, each in a process of its own: Blender brings an OpenEXR that must not be loaded beside another, and
what is decided when a module is imported, as whether loops are compiled, can differ.

The rounds of a race are interleaved, since a machine's speed drifts, and what is reported are medians and their ratios.
"""

import functools
import multiprocessing
import os
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Mapping
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any
from unittest import mock

from viewcam_addon.errors import InputError, bug
from viewcam_addon.terminal import silent_libraries

Runner = Callable[..., float]


class Contestant:
    """A contestant in a process of its own, for the time of a `with` block.

    prepare : a function at the top of a module; it is called there with the arguments and returns what can be asked for: name →
        a function that does it once and returns its seconds.
    environment : variables that the process finds set.
    """

    def __init__(
        self, prepare: Callable[..., Mapping[str, Runner]], *arguments: object, environment: Mapping[str, str] | None = None
    ) -> None:
        context = multiprocessing.get_context("spawn")
        self._here, there = context.Pipe()
        self._process = context.Process(target=_serve, args=(there, prepare, arguments))
        # Blender, as a module of this process, would add folders of its own in which another bpy stands.
        search_path = [path for path in sys.path if "bpy" not in Path(path).parts]
        with mock.patch.dict(os.environ, environment or {}), mock.patch.object(sys, "path", search_path):
            self._process.start()
        there.close()
        self.names: list[str] = self._answer()

    def __enter__(self) -> "Contestant":
        return self

    def __exit__(self, kind: type | None, *_: object) -> None:
        if self._process.is_alive() and kind is None:
            self._here.send(None)
        else:
            self._process.terminate()
        self._process.join()

    def runners(self) -> dict[str, Runner]:
        """The functions of this process that can be asked for; their arguments are sent along."""
        return {name: functools.partial(self._ask, name) for name in self.names}

    def _ask(self, name: str, *arguments: object) -> float:
        self._here.send((name, arguments))
        return self._answer()

    def _answer(self) -> Any:
        """The answer that comes back; an error over there is raised here."""
        try:
            answer = self._here.recv()
        except EOFError:
            raise InputError("a contestant's process has ended by itself: run it alone to see why") from None
        if isinstance(answer, InputError):
            raise answer
        return answer


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


def _serve(asked: Connection, prepare: Callable[..., Mapping[str, Runner]], arguments: tuple) -> None:
    """Renderers keep their progress to themselves; what goes wrong is told in a sentence."""
    with silent_libraries():
        try:
            runners = prepare(*arguments)
            asked.send(list(runners))
            while (request := asked.recv()) is not None:
                name, parameters = request
                asked.send(runners[name](*parameters))
        except Exception as error:
            asked.send(error if isinstance(error, InputError) else InputError(f"a contestant failed: {bug(error)}"))
        asked.close()
        os._exit(0)  # bpy's own clean-up crashes in some versions
