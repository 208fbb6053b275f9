"""From which depth to which a renderer must see that needs finite, positive bounds, and keeps its depth buffer by them.

A scene file may say nothing of clipping. Blender's camera always clips, and its viewport tells depths apart the worse the
closer to the eye it starts. So the start is as far out as hides nothing, and the end no nearer than the farthest thing.
"""

import math

import numpy as np
from numpy.typing import NDArray

from . import Mesh, Object, Scene, Spheres

Array = NDArray[np.float64]

# Blender's own defaults, and its least start.
_STARTS = (0.1, 0.01, 1e-3, 1e-4, 1e-5)
_LEAST_START = 1e-6
_END = 1000.0


def visible_depths(scene: Scene) -> tuple[float, float]:
    """A finite (nearest, farthest) planar depth, at least 1e-6, that hides what the scene's `clip` hides and nothing else."""
    start, end = scene.clip
    eye = np.array(scene.camera.eye)
    if end == math.inf:
        farthest = max((_distances(_boxes(scene, placed), eye)[1].max(initial=0.0) for placed in scene.objects), default=0.0)
        end = max(_END, 10.0 ** math.ceil(math.log10(2 * max(farthest, 1.0))))
    if start < _LEAST_START:
        slopes = scene.camera.view_plane([0.0, scene.camera.width], [0.0, scene.camera.height])
        aslant = math.hypot(1.0, *np.abs(slopes).max(axis=1))  # the distance of what appears in a corner, over its depth
        nearest = min((_nearest(scene, placed, eye, 2 * _STARTS[0] * aslant) for placed in scene.objects), default=math.inf)
        start = next((depth for depth in _STARTS if 2 * depth * aslant < nearest), _LEAST_START)
    return start, end


def _nearest(scene: Scene, placed: Object, eye: Array, enough: float) -> float:
    """No more than the distance from the eye to an object; its parts are looked at if its box is not far `enough` away."""
    nearest = _distances(_boxes(scene, placed), eye)[0]
    parts = _parts(scene.geometries[placed.geometry])
    within = (_distances(_placed(parts, matrix), eye)[0] for matrix in placed.matrices[nearest <= enough])
    return min(
        [float(nearest[nearest > enough].min(initial=math.inf)), *(float(each.min(initial=math.inf)) for each in within)]
    )


def _boxes(scene: Scene, placed: Object) -> Array:
    """(n, 2, 3): the least and the largest coordinates of an object in each of its places, world space, or of boxes around."""
    parts = _parts(scene.geometries[placed.geometry])
    if not len(parts):
        return np.repeat(placed.matrices[:, None, :3, 3], 2, axis=1)
    return _placed(np.stack([parts[:, 0].min(axis=0), parts[:, 1].max(axis=0)]), placed.matrices)


def _parts(geometry: Mesh | Spheres) -> Array:
    """(n, 2, 3): the box of each triangle or sphere, object space."""
    if isinstance(geometry, Spheres):
        reach = geometry.radii[:, None]
        return np.stack([geometry.centers - reach, geometry.centers + reach], axis=1)
    corners = geometry.vertices[geometry.triangles]
    return np.stack([corners.min(axis=1), corners.max(axis=1)], axis=1)


def _placed(boxes: Array, matrices: Array) -> Array:
    """(n, 2, 3): boxes around the boxes, world space: of n boxes and one matrix, or of one box and n matrices."""
    linear = np.swapaxes(matrices[..., :3, :3], -1, -2)
    centre = (boxes.mean(axis=-2)[..., None, :] @ linear)[..., 0, :] + matrices[..., :3, 3]
    half = ((boxes[..., 1, :] - boxes[..., 0, :])[..., None, :] / 2 @ np.abs(linear))[..., 0, :]
    return np.stack([centre - half, centre + half], axis=-2)


def _distances(boxes: Array, eye: Array) -> tuple[Array, Array]:
    """(n,) each: from the eye to the nearest and to the farthest point of each box."""
    below, above = boxes[:, 0] - eye, boxes[:, 1] - eye
    nearest = np.linalg.norm(np.maximum(0.0, np.maximum(below, -above)), axis=1)
    return nearest, np.linalg.norm(np.maximum(np.abs(below), np.abs(above)), axis=1)
