"""The speed of each renderer at each accuracy: error against time, every method a curve and every parameter a point.

Two figures of every picture. The *picture*: acceleration structures built and kept (a Tracer, Cycles with persistent data, a
loaded scene of Mitsuba), and no file. The *whole job*: from the loaded scene to the EXR on the disk.

- contest.py: how methods are raced: they take turns, round after round.
- tracer.py, cycles.py, mitsuba3.py: the contestants, each in a process of its own.
- references.py: what errors are measured against, made by two of them together, and how far off it is itself.
- standings.py: from points to the time that an error takes, and who is ahead.
- stills.py: both figures of a picture, and their charts; with against_mitsuba.py and geometry.py the sweeps.

`python -m benchmarks speed` measures and draws all of them.
"""

import functools

from .. import charts
from . import against_mitsuba, geometry, stills

SWEEPS = {still.name: functools.partial(stills.charts, still) for still in stills.STILLS} | {
    "mitsuba": against_mitsuba.charts,
    "geometry": geometry.charts,
}

run = functools.partial(charts.run_all, "speed", SWEEPS)
