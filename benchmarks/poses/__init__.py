"""The camera itself: how many poses a second become a basis, and how exact it is.

Every module is one sweep, as in benchmarks/stability, where the same methods are driven up to where they fail. `viewcam chart
poses` measures and draws all of them.
"""

import functools

from .. import charts

SWEEPS = ("basis",)

run = functools.partial(charts.run, __package__, SWEEPS)
