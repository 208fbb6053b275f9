"""Threads: 1 to as many as the machine has cores."""

import os
from functools import partial

from ..charts import Chart
from . import growth, scenes
from .point import DIRECT, FILE, GEOMETRY, PREPARING, Work, measure


def charts(quick: bool = False) -> tuple[Chart, ...]:
    cores = os.cpu_count() or 1
    counts = sorted({*(2**power for power in range(cores.bit_length())), cores})
    size, triangles = ((320, 180), 1_000) if quick else ((1280, 720), 100_000)
    make = partial(scenes.one_mesh, triangles, size)
    sweep = [(count, measure(make, Work(threads=count, file=True, once=quick))) for count in counts]
    curves = growth.time_curves(sweep, (PREPARING, GEOMETRY, DIRECT, FILE))
    powers = ", ".join(f"{curve.name} {growth.slope(curve.x, curve.y):.2f}" for curve in curves) if cores > 1 else "one core"
    return (
        growth.chart(
            "threads-time",
            f"Time against threads, {size[0]} × {size[1]} pixels, {triangles:,} triangles",
            "threads",
            growth.SECONDS,
            curves,
            f"Read how near pictures come to −1, the power of threads that would share the work evenly. Fitted: {powers}.",
        ),
    )
