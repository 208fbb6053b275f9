"""Threads: 1 to as many as the machine has cores."""

import os
from collections.abc import Sequence
from functools import partial

import numpy as np

from ..charts import Chart, Curve
from . import growth, scenes
from .point import DIRECT, FILE, GEOMETRY, PREPARING, Work, measure


def charts(quick: bool = False) -> tuple[Chart, ...]:
    cores = os.cpu_count() or 1
    counts = sorted({*(2**power for power in range(cores.bit_length())), cores})
    size, triangles = ((320, 180), 1_000) if quick else ((1280, 720), 100_000)
    make = partial(scenes.one_mesh, triangles, size)
    sweep = [(count, measure(make, Work(threads=count, file=True, once=quick))) for count in counts]
    return (chart(growth.time_curves(sweep, (PREPARING, GEOMETRY, DIRECT, FILE)), size, triangles),)


def chart(times: Sequence[Curve], size: tuple[int, int], triangles: int) -> Chart:
    """How many times as fast each stage is as with one thread. times : seconds over threads."""
    counts = times[0].x
    curves = [Curve(each.name, each.x, [each.y[0] / seconds for seconds in each.y]) for each in times]
    told = ", ".join(f"{curve.name} {curve.y[-1]:.2f} ({each.y[-1]:.3g} s)" for curve, each in zip(curves, times, strict=True))
    return Chart(
        "threads-time",
        f"Threads, {size[0]} × {size[1]} pixels, {triangles:,} triangles",
        "threads",
        "times as fast as with one thread",
        (Curve("work shared evenly", counts, counts, league="evenly", limit=True), *curves),
        f"Read how near pictures come to the dashed line. With {counts[-1]:g}: {told}.",
        tie=np.inf,
        log_x=False,
        log_y=False,
    )
