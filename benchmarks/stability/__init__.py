"""The stability of each method that the project uses or could have used: a chart for each way to fail.

Every module is one sweep towards a failure, with all candidates on it, and offers `charts(quick)`. The candidates that lost
live here and nowhere else; the method in use is called from viewcam_addon. `python -m benchmarks stability` measures and
draws all of them.
"""

import functools

from .. import charts

SWEEPS = (
    "roll",
    "separation",
    "far_from_origin",
    "field_of_view",
    "pose_storage",
    "flight",
    "spheres",
    "triangles",
    "secondary_rays",
)

run = functools.partial(charts.run, __package__, SWEEPS)
