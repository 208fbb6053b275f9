"""The kernel of light/scattering.py."""

import numpy as np

from .packets import kernel
from .vectors import cosine_direction as of_one
from .vectors import put, taken


@kernel
def _directions(normals, u, directions, densities):
    for ray in range(densities.size):
        direction, densities[ray] = of_one(taken(normals, ray), u[0, ray], u[1, ray])
        put(directions, ray, direction)


def cosine_direction(normal, u):
    directions, densities = np.empty(normal.shape), np.empty(normal.shape[1])
    _directions(np.ascontiguousarray(normal), np.ascontiguousarray(u), directions, densities)
    return directions, densities
