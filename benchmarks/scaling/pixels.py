"""Pixels: 0.1 to 33 million, of ground of 100,000 triangles.

A picture is traced in tiles of a fixed size, so that memory grows by the bytes of its passes and by nothing else.
"""

from functools import partial

from viewcam_addon.image import CHANNELS, GEOMETRY_PASSES, LIGHT_PASSES
from viewcam_addon.tracer.render import CENTRES

from ..charts import Chart
from . import growth, scenes
from .point import ADAPTIVE, DIRECT, ERROR, FILE, GEOMETRY, PREPARING, Work, measure

SIZES = ((426, 240), (640, 360), (1280, 720), (1920, 1080), (3840, 2160), (7680, 4320))
TRIANGLES = 100_000

BYTES_A_PIXEL = {
    GEOMETRY: 4 * sum(len(CHANNELS[name]) for name in GEOMETRY_PASSES),
    DIRECT: 4 * sum(len(CHANNELS[name]) for name in (*LIGHT_PASSES, *CENTRES)),
    ADAPTIVE: 4 * sum(len(CHANNELS[name]) for name in (*LIGHT_PASSES, *CENTRES, "Sample Count")),
}
"""Of the passes of a picture, float32."""

# Pictures of so many pixels fill the tiles of all threads: what they take beyond their passes does not grow.
_FULL = 900_000


def charts(quick: bool = False) -> tuple[Chart, ...]:
    sizes = SIZES[0:3:2] if quick else SIZES
    work = Work(samples=1 if quick else 4, file=True, adaptive=True, once=quick)
    make = partial(scenes.one_mesh, 1_000 if quick else TRIANGLES)
    sweep = [(width * height, measure(partial(make, (width, height)), work)) for width, height in sizes]
    times = growth.time_curves(sweep, (PREPARING, GEOMETRY, FILE, DIRECT, ADAPTIVE))
    memory = [
        curve for stage in (GEOMETRY, DIRECT, ADAPTIVE, FILE) for curve in growth.memory_curves(sweep, (stage,), league=stage)
    ]
    limits = []
    for stage, each in BYTES_A_PIXEL.items():
        full = [(pixels, measured.peak[stage] - each * pixels) for pixels, measured in sweep if pixels > _FULL]
        if full:
            name = f"a fixed amount and {each} bytes a pixel: {stage}"
            limits.append(growth.memory_limit([pixels for pixels, _ in full], full[0][1], each, name, stage))
    return (
        growth.chart(
            "pixels-time",
            "Time against pixels",
            "pixels",
            growth.SECONDS,
            times,
            "Read what a pixel more costs. The adaptive one is asked for an error of "
            f"{ERROR:g}. {growth.told(times, 'the pixels')}",
        ),
        growth.chart(
            "pixels-memory",
            "Memory against pixels",
            "pixels",
            growth.MEGABYTES,
            [*memory, *limits],
            "The dashed lines are what is allowed from the first picture on that fills the tiles of all threads: what this one "
            "takes beyond its passes, a quarter more, 32 MiB that the allocator may keep, and the bytes of the passes. A file "
            "is counted with the geometry picture in it. "
            f"{growth.told(memory, 'the pixels')}",
        ),
    )
