"""Embree: the one place that knows whether it is there, in which unit it is given coordinates, and who shares its scenes."""

import math

import numpy as np
from numpy.typing import NDArray

from ..arrays import Float32s, Floats
from .triangles import Triangles

try:
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene
except ImportError:  # no wheel for this machine: NumPy gives the same answers, slowly
    EmbreeScene = None

# Embree multiplies three coordinates: with none larger than this, and those of what is seen not less than its 10⁻²⁰ part, no
# product leaves float32's range.
_LARGEST = 2.0**30


def unit_of(largest: float) -> float:
    """Embree's units in one of the world: the power of two that makes the largest |coordinate| about `_LARGEST`."""
    return math.ldexp(_LARGEST, -math.frexp(largest or 1.0)[1])


def rows(vectors: Floats) -> Float32s:
    """(n, 3) float32 of (3, n): what Embree takes."""
    return np.ascontiguousarray(vectors.T, np.float32)


def embree_scene(vertices: Floats, triangles: NDArray[np.int32]) -> "EmbreeScene":
    """A scene of triangles, ready for any thread. vertices : (v, 3). triangles : (m, 3) indices."""
    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, np.ascontiguousarray(vertices, dtype=np.float32), np.ascontiguousarray(triangles))
    scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))  # builds the hierarchy, once, before threads come
    return scene


def scene_of(triangles: Triangles, left_out: NDArray[np.bool_], unit: float) -> "EmbreeScene | None":
    """The scene of triangles without some, in a unit; made once, and None where there are none.

    left_out : (m,). They keep their numbers and are never met.
    """
    key = (np.packbits(left_out).tobytes(), unit)
    if key not in triangles.embree_scenes:
        corners = triangles.corners.T.copy()
        corners[left_out] = 0  # points
        triangles.embree_scenes[key] = None if left_out.all() else embree_scene(triangles.vertices.T * unit, corners)
    return triangles.embree_scenes[key]
