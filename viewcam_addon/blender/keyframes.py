"""Linear keyframes of many numbers at once: baked flights and imported trajectories."""

from collections.abc import Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from . import versions

_LINEAR = 1  # an enum's number, as foreach_set takes it


def linear(block: bpy.types.ID, path: str, at: Sequence[float], values: NDArray[np.float64]) -> None:
    """Put keyframes in the place of a property's curves; a single one for a number that stands still.

    at : frames, of the curves. values : (frames, numbers of the property).
    """
    versions.remove_curves(block, path)
    for index, column in enumerate(values.T):
        count = 1 if (column == column[0]).all() else len(column)
        curve = versions.new_curve(block, path, index)
        curve.keyframe_points.add(count)
        curve.keyframe_points.foreach_set("co", np.column_stack([at, column])[:count].ravel())
        curve.keyframe_points.foreach_set("interpolation", [_LINEAR] * count)
        curve.update()
