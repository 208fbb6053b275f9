"""Kernel of rays/triangles.py: where a ray from the eye meets a triangle."""

import numpy as np

from .vectors import inlined


@inlined
def linear(forms, row, triangle, x, y):
    """A linear form of one triangle, which begins at this row of the table, of the ray (x, y, 1)."""
    return forms[row, triangle] * x + forms[row + 1, triangle] * y + forms[row + 2, triangle]


@inlined
def hit(forms, span, triangle, x, y):
    """Depth and barycentric coordinates: Planes.hit, of one ray."""
    depth = np.fmin(np.fmax(1.0 / linear(forms, 0, triangle, x, y), span[0, triangle]), span[1, triangle])
    first = np.fmax(np.fmin(linear(forms, 3, triangle, x, y) * depth, 1.0), 0.0)
    second = np.fmax(np.fmin(linear(forms, 6, triangle, x, y) * depth, 1.0 - first), 0.0)
    return depth, first, second
