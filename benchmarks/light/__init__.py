"""The convergence of light: error against samples, for each method that the tracer uses or could have used.

Every module is one sweep, as in benchmarks/stability. `python -m benchmarks light` measures and draws all of them.
"""

import functools

from .. import charts

SWEEPS = ("convergence", "pictures")

run = functools.partial(charts.run, __package__, SWEEPS)
