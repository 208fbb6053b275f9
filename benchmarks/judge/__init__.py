"""The quality of the judge: of faults that a renderer could have, how many it finds, and how often it blames a good picture.

`python -m benchmarks judge` injects the faults of faults.py, lets the rivals of rivals.py judge as well, and draws a chart
for each family of faults.
"""

import functools

from .. import charts

SWEEPS = ("detection",)

run = functools.partial(charts.run, __package__, SWEEPS)
