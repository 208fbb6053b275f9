"""Six matte Suzannes beside Mitsuba 3, where it is installed: in a process with all loaded and compiled, and from a fresh one.

Both see the scene through a box filter, each with the best of its samplers. A fresh process finds on the disk what an earlier
one compiled: Python's bytecode, Dr.Jit's kernels (~/.drjit).
"""

import contextlib
import os
import tempfile
from pathlib import Path

from ..charts import Chart
from ..race import Contestant
from . import mitsuba3, references, tracer
from .contest import Method
from .mitsuba3 import LLVM, SCALAR
from .stills import FRESH, OUR_METHODS, OURS, Still, charts_of, prepare_cycles, start_contestant

STILL = Still(
    "mitsuba",
    "Six matte Suzannes beside Mitsuba",
    "direct",
    (640, 360),
    {0.003: (1.3, 1.5), 0.001: (2, 1.8)},
    {OURS: 1024, LLVM: 2048},
)
_SQUARES = (4.0, 9.0, 25.0, 49.0, 121.0, 289.0)  # squares of primes, as the orthogonal sampler wants them
_POWERS = (4.0, 16.0, 64.0, 256.0)
METHODS = (
    *OUR_METHODS,
    Method("Mitsuba llvm, independent", LLVM, "independent", _POWERS, rival=True),
    Method("Mitsuba llvm, multijitter", LLVM, "multijitter", _POWERS, rival=True, job=True),
    Method("Mitsuba llvm, orthogonal", LLVM, "orthogonal", _SQUARES, rival=True, job=True),
    Method("Mitsuba llvm, ldsampler", LLVM, "ldsampler", _POWERS, rival=True, job=True),
    Method("Mitsuba scalar, multijitter", SCALAR, "multijitter", _POWERS, job=True),
)


def charts(quick: bool) -> tuple[Chart, ...]:
    """The picture, and the job from a fresh process; nothing where Mitsuba's llvm variant does not run."""
    variants = mitsuba3.variants()
    if LLVM not in variants:
        print(
            "speed-mitsuba: left out, since Mitsuba's llvm variant does not run here: "
            "pip install '.[mitsuba]' in a clone, and LLVM 16 or newer"
        )
        return ()
    still = STILL.small() if quick else STILL
    threads = os.cpu_count() or 1
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as processes:
        scene, path = Path(folder) / "scene.json", Path(folder) / "picture.exr"
        with Contestant(prepare_cycles, "suzannes", still.level, still.size, scene, threads, True):
            pass  # it has written the scene
        sides = {}
        sides[OURS] = start_contestant(processes, tracer.prepare, scene, still.level, threads)
        sides[OURS]["fresh"] = tracer.fresh(scene, still.level, threads)
        for variant in variants:
            expected = Path(folder) / variant
            sides[variant] = start_contestant(processes, mitsuba3.prepare, scene, expected, variant, threads)
            sides[variant]["fresh"] = mitsuba3.fresh(expected, variant, threads)
        methods = tuple(method for method in METHODS if method.side in sides)
        reference = references.reference(still.name, scene, sides, still.samples)
        return charts_of(still, FRESH, sides, methods, reference, quick, path)
