"""Lamps: 1 to 10,000, of no size and as squares, that give as much light together as one would."""

from functools import partial

from ..charts import Chart
from . import growth, scenes
from .point import DIRECT, FIRST_DIRECT, Work, measure


def charts(quick: bool = False) -> tuple[Chart, ...]:
    counts = (1, 100) if quick else (1, 10, 100, 1_000, 10_000)
    size, triangles, work = ((160, 90), 1_000, Work(once=True)) if quick else (scenes.SIZE, 10_000, Work())
    curves = []
    for kind, make in (("points", scenes.under_points), ("squares", scenes.under_areas)):
        sweep = [(count, measure(partial(make, count, triangles, size), work)) for count in counts]
        curves += growth.time_curves(sweep, (FIRST_DIRECT, DIRECT), f"{kind}: ")
    return (
        growth.chart(
            "lamps-time",
            f"Time against lamps, {size[0]} × {size[1]} pixels, {work.samples} samples",
            "lamps",
            growth.SECONDS,
            curves,
            "Read what a picture of many lamps takes beyond that of one. The first picture prepares them. "
            f"{growth.told(curves, 'the lamps')}",
        ),
    )
