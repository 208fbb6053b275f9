"""Spheres: 1e2 to 1e5 exact ones, which cover the same part of the picture."""

from functools import partial

from ..charts import Chart
from . import growth, scenes
from .point import DIRECT, FIRST_DIRECT, FIRST_GEOMETRY, GEOMETRY, PREPARING, Work, measure


def charts(quick: bool = False) -> tuple[Chart, ...]:
    counts = (100, 1_000) if quick else (100, 1_000, 10_000, 100_000)
    size, work = ((160, 90), Work(once=True)) if quick else (scenes.SIZE, Work())
    sweep = [(count, measure(partial(scenes.spheres, count, size), work)) for count in counts]
    stages = (PREPARING, FIRST_GEOMETRY, GEOMETRY, FIRST_DIRECT, DIRECT)
    times, memory = growth.time_curves(sweep, stages), growth.memory_curves(sweep, stages)
    each = max(sweep[-1][1].peak[DIRECT] - sweep[0][1].peak[DIRECT], 0) / (counts[-1] - counts[0])
    return (
        growth.chart(
            "spheres-time",
            f"Time against spheres, {size[0]} × {size[1]} pixels",
            "spheres",
            growth.SECONDS,
            times,
            f"Read what pictures of more spheres take. {growth.told(times, 'the spheres')}",
        ),
        growth.chart(
            "spheres-memory",
            f"Memory against spheres, {size[0]} × {size[1]} pixels",
            "spheres",
            growth.MEGABYTES,
            memory,
            f"Read that spheres take {each:.0f} bytes each, light included. {growth.told(memory, 'the spheres')}",
        ),
    )
