"""How time and memory grow with what a scene asks for: triangles, pixels, lamps, instances, threads and spheres.

Every module is one sweep, as in benchmarks/stability. Scenes are made by NumPy, each point is measured in a process of its own
(point.py), and the exponents of growth are fitted (growth.py). `viewcam chart scaling` measures and draws all of them.
"""

import functools

from .. import charts

SWEEPS = ("triangles", "pixels", "lamps", "instances", "threads", "spheres")

run = functools.partial(charts.run, __package__, SWEEPS)
