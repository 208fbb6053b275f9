"""Pictures of light beside Cycles: six Suzannes, the studio still, the sphere field and the Cornell box.

Ours is the tracer with numba's compiled loops where they are installed, and with NumPy and Embree alone; with a wanted error,
and with a number of samples for all pixels; and for comparison with random numbers in place of its sampler. Cycles renders
with a number of samples, and with its own adaptive sampling. All make the same passes.

Left out: NumPy without Embree, which takes a hundred times as long (18 s of a core for one sample of each pixel of the Cornell
box at 120 × 120) and converges as the others do.
"""

import contextlib
import functools
import os
import tempfile
from pathlib import Path

from ..charts import Chart
from ..race import Contestant, Runner
from . import figures, references, tracer
from .contest import Method
from .figures import Still

COMPILED, PLAIN, CYCLES = "ours, compiled", "ours, NumPy and Embree", "Cycles"
VARIANTS = {COMPILED: {"VIEWCAM_COMPILED": "1"}, PLAIN: {"VIEWCAM_COMPILED": "0"}}
"""The tracer's sides, and the environment that each is started in."""
POWERS = tuple(2.0**power for power in range(13))
EVERY_OTHER = POWERS[::2]
ERRORS = (0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005)
NOISE_THRESHOLDS = (0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002)

_DIRECT = {0.003: (8, 3), 0.001: (8, 3)}
STILLS = (
    Still("suzannes", "Six Suzannes, one sun", "direct", (640, 360), _DIRECT, {COMPILED: 2048, CYCLES: 256}),
    Still("studio", "Studio still", "direct", (160, 90), _DIRECT, {COMPILED: 4096, CYCLES: 1024}),
    Still("spheres", "Sphere field", "direct", (160, 90), _DIRECT, {COMPILED: 4096, CYCLES: 4096}),
    Still("cornell", "Cornell box", "path", (120, 120), {0.01: (1, 1)}, {COMPILED: 2048, CYCLES: 2048}),
)
OURS = (
    Method(f"{COMPILED}, adaptive", COMPILED, "error", ERRORS, ours=True, job=True),
    Method(f"{COMPILED}, uniform", COMPILED, "samples", POWERS, ours=True, job=True),
    Method(f"{PLAIN}, adaptive", PLAIN, "error", ERRORS, ours=True, job=True),
    Method(f"{PLAIN}, uniform", PLAIN, "samples", EVERY_OTHER, ours=True),
)
METHODS = (
    *OURS,
    Method("ours with random numbers", PLAIN, "random", EVERY_OTHER),
    Method(CYCLES, CYCLES, "samples", POWERS, rival=True, job=True),
    Method(f"{CYCLES}, adaptive", CYCLES, "error", NOISE_THRESHOLDS, rival=True, job=True),
)


def charts(still: Still, quick: bool) -> tuple[Chart, ...]:
    """The picture, and the whole job."""
    still = still.small() if quick else still
    threads = os.cpu_count() or 1
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as processes:
        scene = Path(folder) / "scene.json"
        start = functools.partial(start_contestant, processes)
        sides = {CYCLES: start(prepare_cycles, still.name, still.level, still.size, scene, threads)}  # writes the scene
        sides |= {side: start(tracer.prepare, scene, still.level, threads, environment=env) for side, env in VARIANTS.items()}
        reference = references.reference(still.name, scene, sides, still.samples)
        return figures.charts(still, figures.WHOLE, sides, METHODS, reference, quick, Path(folder) / "picture.exr")


def start_contestant(processes: contextlib.ExitStack, *arguments: object, **options: object) -> dict[str, Runner]:
    """What a process offers, which ends with the others."""
    return processes.enter_context(Contestant(*arguments, **options)).runners()


def prepare_cycles(*arguments: object) -> dict[str, Runner]:
    """In Blender's process, the only one that imports it."""
    from . import cycles

    return cycles.prepare(*arguments)
