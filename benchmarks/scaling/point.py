"""One point of a sweep: how long each stage takes on a scene, and how much memory, in a process of its own.

Memory is what the process takes beyond what it took before the scene was there, and beyond the scene's own arrays.
"""

import gc
import multiprocessing
import statistics
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TypeVar

from viewcam_addon import image
from viewcam_addon.tracer.render import Tracer
from viewcam_addon.tracer.scene import Scene

from .. import memory
from . import scenes

Result = TypeVar("Result")

PREPARING, FIRST_GEOMETRY, GEOMETRY, FILE = "preparing", "first geometry picture", "geometry picture", "its file"
FIRST_DIRECT, DIRECT, ADAPTIVE = "first direct picture", "direct picture", "adaptive picture"
"""The stages. A first picture makes what later ones keep; an adaptive one has a wanted error."""

# A stage is repeated as often, and as long, as it takes to know its time.
_ROUNDS, _SECONDS = 9, 2.0
# What an adaptive picture is asked for, scene-linear, and the samples that it may take.
ERROR, _MOST = 0.01, 64


@dataclass(frozen=True)
class Work:
    """What is measured, beside preparing and geometry pictures.

    samples : of direct pictures. threads : all cores if it is None. once : no stage is repeated.
    """

    samples: int = 4
    threads: int | None = None
    file: bool = False
    direct: bool = True
    adaptive: bool = False
    once: bool = False


@dataclass
class Measured:
    """seconds : stage → median. peak : stage → bytes beyond the scene's own arrays, `own`. triangles : of the scene."""

    own: int
    triangles: int
    seconds: dict[str, float] = field(default_factory=dict)
    peak: dict[str, int] = field(default_factory=dict)


def measure(make: Callable[[], Scene], work: Work) -> Measured:
    """Measure in a process that has seen nothing else. make : picklable; makes the scene there."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        return pool.submit(_measure, make, work).result()


def _measure(make: Callable[[], Scene], work: Work) -> Measured:
    _stages(scenes.one_mesh(2, (64, 64)), replace(work, samples=1, once=True), 0)  # what is loaded once is
    gc.collect()
    before = memory.resident()
    return _stages(make(), work, before)


def _stages(scene: Scene, work: Work, before: int) -> Measured:
    own = scenes.own_bytes(scene)
    measured = Measured(own, scenes.triangles_of(scene))

    def stage(name: str, run: Callable[[], Result], once: bool = work.once) -> Result:
        memory.forget_peak()
        seconds = []
        while not seconds or (not once and len(seconds) < _ROUNDS and sum(seconds) < _SECONDS):
            start = time.perf_counter()
            result = run()
            seconds.append(time.perf_counter() - start)
            if len(seconds) == 1:
                measured.peak[name] = memory.peak() - before - own
        measured.seconds[name] = statistics.median(seconds)
        return result

    tracer = stage(PREPARING, lambda: Tracer(scene, work.threads))
    stage(FIRST_GEOMETRY, tracer.render, once=True)
    picture = stage(GEOMETRY, tracer.render)
    if work.file:
        stage(FILE, partial(_write, image.Image(picture, scene.camera)))
    del picture, tracer  # so that light does not count them
    gc.collect()
    tracer = Tracer(scene, work.threads)
    if work.direct:
        stage(FIRST_DIRECT, lambda: tracer.render_light("direct", work.samples, 0), once=True)
        stage(DIRECT, lambda: tracer.render_light("direct", work.samples, 0))
    if work.adaptive:
        stage(ADAPTIVE, lambda: tracer.render_light("direct", _MOST, 0, error=ERROR))
    return measured


def _write(picture: image.Image) -> None:
    with tempfile.TemporaryDirectory() as folder:
        image.write(Path(folder) / "picture.exr", picture)
