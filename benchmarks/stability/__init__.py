"""How stable each method is that the project uses or could have used: a chart for each way to fail.

Every module is one sweep towards a failure, with all candidates on it, and offers `charts(quick)`. The candidates that lost
live here and nowhere else; the method in use is called from viewcam_addon. `viewcam chart stability` measures and draws all of
them.
"""

import importlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from viewcam_addon.errors import InputError
from viewcam_addon.terminal import silent_libraries

from .. import charts

SWEEPS = (
    "roll",
    "separation",
    "far_from_home",
    "field_of_view",
    "pose_storage",
    "flight",
    "spheres",
    "triangles",
    "secondary_rays",
)
COMMAND = "viewcam chart stability"


def run(folder: Path, only: Sequence[str] = (), quick: bool = False) -> tuple[int, dict[str, Any]]:
    """Measure the sweeps and draw their charts into `folder`.

    only : names of SWEEPS, all if it is empty. quick : few trials, in seconds.

    Returns 0, or 1 if the method in use is behind another somewhere, and their figures.

    Raises
    ------
    InputError
        if there is no such sweep, or the folder can't be written to.
    """
    unknown = set(only) - set(SWEEPS)
    if unknown:
        raise InputError(f"there is no sweep {min(unknown)!r}: choose from {', '.join(SWEEPS)}")
    measured: dict[str, Any] = {}
    behind: list[str] = []
    for sweep in only or SWEEPS:
        for chart in _measured(sweep, quick):
            name = f"stability-{chart.name}"
            charts.draw(chart, folder / f"{name}.svg", f"{COMMAND} --only {sweep}{' --quick' if quick else ''}")
            print(f"{name}: {chart.reading}", flush=True)
            measured[name] = chart.figures()
            behind += chart.behind()
    for sentence in behind:
        print(sentence)
    return (1 if behind else 0), {"machine": charts.machine(), "behind": behind, "charts": measured}


def _measured(sweep: str, quick: bool) -> tuple[charts.Chart, ...]:
    with silent_libraries():  # Blender prints a line for each picture
        return importlib.import_module(f".{sweep}", __package__).charts(quick)
