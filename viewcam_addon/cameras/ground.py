"""The ground of a data set's points, and its cameras in the world where that is z = 0.

The ground is the plane that most of the points are near, of those with cameras above and with up roughly as the cameras have
it: so a wall is none. Where the cameras have no common up, as above a field that is flown over to and fro, or no such plane has
its share of the points, it is the plane that they look down on. It is found by RANSAC: planes of three points, drawn by a seed,
so that a data set always has the same ground; the best is fitted to its points by least squares.

Rejected: the plane of most points alone (in a room it is a wall), and cameras' heights (a tripod's are all the same).

Source: M. A. Fischler and R. C. Bolles, Random Sample Consensus, Communications of the ACM 24 (6), 1981.
"""

from collections.abc import Sequence

import numpy as np

from ..errors import InputError
from . import axes, clouds
from .camera import Camera, Options
from .source import Source

_PLANES, _SEED = 2000, 0
_MOST_POINTS = 20_000  # to count by, drawn by the seed
_NEAR = 0.01  # share of the points' extent: how far from the plane a point of the ground is. Chosen, as those below
_TILT = np.cos(np.radians(45))  # the ground's normal against the cameras' up
_COMMON = 0.5  # length of the mean of the cameras' up from which on it is one
_SHARE = 0.05  # share of the points that a plane needs for being the ground


def leveled(cameras: Sequence[Camera], source: Source, options: Options) -> list[Camera]:
    """The cameras in a world that is turned by the least angle, and moved along z, so that the ground is z = 0; each says so.

    source : the data set, whose points are those of the world before `options.axes` and `options.scale`.

    Raises InputError if it has no points, or these no ground.
    """
    if options.original_world:
        raise InputError("the ground is that of points in the file's world: leave --original-world or --ground out")
    points = clouds.of(source)
    if points is None or len(points) < 3:
        raise InputError(
            f"{source.name} has no points to find the ground by: give a COLMAP model with points3D, or a data set with a .ply, "
            "or leave --ground out"
        )
    normal, height, share = plane(axes.moved_points(points, options), cameras)
    note = f"z = 0 is the ground, a plane near {share:.0%} of the points"
    return [camera.noted(note) for camera in axes.turned_up(cameras, normal.tolist(), "the ground's up", -height)]


def plane(points: np.ndarray, cameras: Sequence[Camera]) -> tuple[np.ndarray, float, float]:
    """The unit normal n, up, and height h of the ground, n · p = h, and its share of the points.

    points : (n, 3) in the cameras' world.

    Raises InputError if no plane has cameras above and its share of the points.
    """
    random = np.random.default_rng(_SEED)
    if len(points) > _MOST_POINTS:
        points = points[random.choice(len(points), _MOST_POINTS, replace=False)]
    low, high = np.quantile(points, [0.05, 0.95], axis=0)
    near = _NEAR * float(np.linalg.norm(high - low))
    eyes = np.array([camera.pinhole.eye for camera in cameras])
    basis = np.array([camera.pinhole.picture_axes() for camera in cameras])
    up, away = basis[:, 1].mean(axis=0), -basis[:, 2].mean(axis=0)
    normals, heights = _planes(points[random.integers(len(points), size=(_PLANES, 3))], eyes)
    counts = np.array([np.count_nonzero(np.abs(points @ n - h) <= near) for n, h in zip(normals, heights, strict=True)])
    upright = normals @ up >= _TILT * np.linalg.norm(up)
    if np.linalg.norm(up) >= _COMMON and np.max(counts, where=upright, initial=0) >= _SHARE * len(points):
        counts = np.where(upright, counts, 0)
    else:
        counts = np.where(normals @ away > 0, counts, 0)
    if not len(counts) or counts.max() < max(3, _SHARE * len(points)):
        raise InputError(f"no plane below the cameras has {_SHARE:.0%} of the points: leave --ground out")
    best = int(np.argmax(counts))
    normal, height = normals[best], heights[best]
    for _ in range(3):
        ground = points[np.abs(points @ normal - height) <= near]
        center = ground.mean(axis=0)
        fitted = np.linalg.svd(ground - center, full_matrices=False)[2][2]
        normal = fitted * np.sign(fitted @ normal)
        height = float(normal @ center)
    return normal, height, len(ground) / len(points)


def _planes(triples: np.ndarray, eyes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(m, 3) normals and (m) heights of planes through three points each (n, 3, 3), with more than half of the eyes above."""
    normals = np.cross(triples[:, 1] - triples[:, 0], triples[:, 2] - triples[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    fine = lengths > 0
    normals = normals[fine] / lengths[fine, None]
    heights = (normals * triples[fine, 0]).sum(axis=1)
    sides = np.sign(np.sign(normals @ eyes.T - heights[:, None]).sum(axis=1))
    return normals[sides != 0] * sides[sides != 0, None], heights[sides != 0] * sides[sides != 0]
