"""Triangles: 1e3 to 1e7, in one mesh and in many of a thousand each, in the same picture."""

from functools import partial

from ..charts import Chart
from . import growth, scenes
from .point import DIRECT, FIRST_DIRECT, FIRST_GEOMETRY, GEOMETRY, PREPARING, Work, measure

# Beyond the scene's own arrays: the hierarchy, what building it takes, and light's tables.
BYTES_A_TRIANGLE = 200


def charts(quick: bool = False) -> tuple[Chart, ...]:
    counts = (1_000, 100_000) if quick else (1_000, 10_000, 100_000, 1_000_000, 3_000_000, 10_000_000)
    size, work = ((160, 90), Work(once=True)) if quick else (scenes.SIZE, Work())
    one, many = (
        [(measured.triangles, measured) for measured in (measure(partial(make, count, size), work) for count in counts)]
        for make in (scenes.one_mesh, scenes.many_meshes)
    )
    times = growth.time_curves(one, (PREPARING, FIRST_GEOMETRY, GEOMETRY, FIRST_DIRECT, DIRECT), "one mesh: ")
    times += growth.time_curves(many, (PREPARING, FIRST_DIRECT, DIRECT), "many meshes: ")
    memory = growth.memory_curves(one, (PREPARING, FIRST_GEOMETRY, GEOMETRY, FIRST_DIRECT, DIRECT), "one mesh: ")
    memory += growth.memory_curves(many, (PREPARING, FIRST_DIRECT), "many meshes: ")
    x, largest = [x for x, _ in one], one[-1][1]
    # What the least scene takes is the picture's and its tiles'.
    fixed = max(one[0][1].peak.values())
    limit = growth.memory_limit(x, fixed, BYTES_A_TRIANGLE, f"a fixed amount and {BYTES_A_TRIANGLE} bytes a triangle")
    stages = PREPARING, FIRST_GEOMETRY, GEOMETRY, FIRST_DIRECT, DIRECT
    each = {stage: (largest.peak[stage] - one[0][1].peak[stage]) / largest.triangles for stage in stages}
    told = ", ".join(f"{stage} {count:.0f}" for stage, count in each.items())
    return (
        growth.chart(
            "triangles-time",
            f"Time against triangles, {size[0]} × {size[1]} pixels",
            "triangles",
            growth.SECONDS,
            times,
            f"Read what a picture of more triangles takes beyond preparing. {growth.told(times, 'the triangles')}",
        ),
        growth.chart(
            "triangles-memory",
            f"Memory against triangles, {size[0]} × {size[1]} pixels",
            "triangles",
            growth.MEGABYTES,
            [*memory, limit],
            "The dashed line is what is allowed: what the least scene's picture takes, a quarter more, 32 MiB that the "
            f"allocator may keep, and {BYTES_A_TRIANGLE} bytes a triangle. "
            f"Bytes a triangle, of {largest.triangles:,} in one mesh: {told}.",
        ),
    )
