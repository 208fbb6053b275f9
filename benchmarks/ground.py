"""Hilly ground of any number of triangles under a low sun: the square from −1 to 1, with normals and UVs as artists' meshes
have them.
"""

import math
from collections.abc import Sequence

import numpy as np

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.scene import Mesh, Object, Scene
from viewcam_addon.tracer.scene.lamps import Lamp, Sun

SUN = Sun("Sun", towards=(-0.8, -0.3, 0.52), irradiance=(3.0, 3.0, 3.0))


def scene(triangles: int, size: tuple[int, int], lamps: Sequence[Lamp] = (SUN,)) -> Scene:
    """The ground in one mesh of about so many triangles, seen from its border. size : pixels across and down."""
    cells = max(1, round(math.sqrt(triangles / 2)))
    camera = Pinhole((0.3, -2.6, 1.9), (0, -0.05, 0), (0, 0, 1), 1.35 * size[0], *size)
    ground = Object("ground", "ground", np.eye(4))
    return Scene(camera, {"ground": _mesh(cells)}, (ground,), lamps=tuple(lamps))


def _mesh(cells: int) -> Mesh:
    """cells × cells squares of the ground, two triangles each."""
    along = np.linspace(-1, 1, cells + 1)
    x, y = (values.ravel() for values in np.meshgrid(along, along))
    height = 0.08 * np.sin(5 * x) * np.sin(4 * y) + 0.02 * np.sin(23 * x + 17 * y)
    slope_x = 0.4 * np.cos(5 * x) * np.sin(4 * y) + 0.46 * np.cos(23 * x + 17 * y)
    slope_y = 0.32 * np.sin(5 * x) * np.cos(4 * y) + 0.34 * np.cos(23 * x + 17 * y)
    normals = np.stack([-slope_x, -slope_y, np.ones_like(x)], axis=1)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).astype(np.int32).ravel()
    right, above = corner + np.int32(1), corner + np.int32(cells + 1)
    triangles = np.stack([corner, right, above, above, right, above + np.int32(1)], axis=1).reshape(-1, 3)
    return Mesh(
        np.stack([x, y, height], axis=1),
        triangles,
        np.zeros(len(triangles), np.int32),
        normals.astype(np.float32)[triangles],
        np.stack([x, y], axis=1).astype(np.float32)[triangles],
    )
