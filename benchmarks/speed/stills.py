"""Pictures of light beside Cycles: six Suzannes, the studio still, in plain colors and in artists' materials, the sphere field
and the Cornell box.

Ours renders with a wanted error, and with a number of samples for all pixels; Cycles with a number of samples, and with its own
adaptive sampling. All make the same passes.
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

OURS, CYCLES = "ours", "Cycles"
POWERS = tuple(2.0**power for power in range(13))
ERRORS = (0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005)
NOISE_THRESHOLDS = (0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002)

_SUN = {0.003: (12, 8), 0.001: (12, 8)}
_SOFT = {0.003: (6, 6), 0.001: (6, 6)}
STILLS = (
    Still("suzannes", "Six Suzannes, one sun", "direct", (640, 360), _SUN, {OURS: 2048, CYCLES: 256}),
    Still("studio", "Studio still", "direct", (160, 90), _SOFT, {OURS: 4096, CYCLES: 1024}),
    Still(
        "dressed_studio", "Studio still in artists' materials", "path", (160, 90), {0.01: (3, 3)}, {OURS: 2048, CYCLES: 2048}
    ),
    Still("spheres", "Sphere field", "direct", (160, 90), _SOFT, {OURS: 4096, CYCLES: 4096}),
    Still("cornell", "Cornell box", "path", (120, 120), {0.01: (4, 4)}, {OURS: 2048, CYCLES: 2048}),
)
OUR_METHODS = (
    Method(f"{OURS}, adaptive", OURS, "error", ERRORS, ours=True, job=True),
    Method(f"{OURS}, uniform", OURS, "samples", POWERS, ours=True, job=True),
)
METHODS = (
    *OUR_METHODS,
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
        sides[OURS] = start(tracer.prepare, scene, still.level, threads)
        reference = references.reference(still.name, scene, sides, still.samples)
        return figures.charts(still, figures.WHOLE, sides, METHODS, reference, quick, Path(folder) / "picture.exr")


def start_contestant(processes: contextlib.ExitStack, *arguments: object, **options: object) -> dict[str, Runner]:
    """The runners that a process offers, which ends with the others."""
    return processes.enter_context(Contestant(*arguments, **options)).runners()


def prepare_cycles(*arguments: object) -> dict[str, Runner]:
    """In Blender's process, the only one that imports it."""
    from . import cycles

    return cycles.prepare(*arguments)
