"""Instances: one mesh of a thousand triangles, placed 1 to 10,000 times."""

from functools import partial

from ..charts import Chart
from . import growth, scenes
from .point import DIRECT, FIRST_DIRECT, FIRST_GEOMETRY, GEOMETRY, PREPARING, Work, measure
from .triangles import BYTES_A_TRIANGLE

BYTES_AN_INSTANCE = 300
# Triangles that the core copies where instances could stand for them (WRITTEN_OUT in tracer/core/scene.h).
_COPIED = 1 << 19


def charts(quick: bool = False) -> tuple[Chart, ...]:
    counts = (1, 100) if quick else (1, 10, 100, 1_000, 10_000)
    size, work = ((160, 90), Work(once=True)) if quick else (scenes.SIZE, Work())
    sweep = [(count, measure(partial(scenes.instances, count, size), work)) for count in counts]
    stages = (PREPARING, FIRST_GEOMETRY, GEOMETRY, FIRST_DIRECT, DIRECT)
    times, memory = growth.time_curves(sweep, stages), growth.memory_curves(sweep, stages)
    fixed = max(sweep[0][1].peak.values()) + BYTES_A_TRIANGLE * _COPIED
    name = f"a fixed amount, half a million copied triangles, and {BYTES_AN_INSTANCE} bytes an instance"
    limit = growth.memory_limit(counts, fixed, BYTES_AN_INSTANCE, name)
    return (
        growth.chart(
            "instances-time",
            f"Time against instances of a thousand triangles, {size[0]} × {size[1]} pixels",
            "instances",
            growth.SECONDS,
            times,
            f"Read beside the chart of triangles, since an instance has a thousand. {growth.told(times, 'the instances')}",
        ),
        growth.chart(
            "instances-memory",
            f"Memory against instances of a thousand triangles, {size[0]} × {size[1]} pixels",
            "instances",
            growth.MEGABYTES,
            [*memory, limit],
            "The dashed line is what is allowed. Instances share their mesh, but for the first half a million triangles, "
            f"which are copied. {growth.told(memory, 'the instances')}",
        ),
    )
