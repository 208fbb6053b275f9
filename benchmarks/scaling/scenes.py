"""Scenes of any size: hilly ground under a low sun, and what stands on it or shines above it.

The ground fills the square from −1 to 1. As one mesh or cut into many it is the same surface, so that what differs is the
number of its objects alone. Meshes have normals and UVs, as those of artists do: 76 bytes a triangle and 24 a vertex.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.scene import Mesh, Object, Scene, Spheres
from viewcam_addon.tracer.scene.lamps import Area, Lamp, Point, Sun

Array = NDArray[np.float64]

SIZE = 640, 360
_SUN = Sun("Sun", towards=(-0.8, -0.3, 0.52), irradiance=(3.0, 3.0, 3.0))


def one_mesh(triangles: int, size: tuple[int, int] = SIZE, lamps: Sequence[Lamp] = (_SUN,)) -> Scene:
    """The ground in one mesh of about so many triangles."""
    return _scene({"ground": _patch(_cells(triangles), (-1, 1), (-1, 1))}, [_placed("ground")], size, lamps)


def many_meshes(triangles: int, size: tuple[int, int] = SIZE) -> Scene:
    """The same ground, cut into meshes of about a thousand triangles."""
    side = max(1, round(math.sqrt(triangles / 1000)))
    borders = np.linspace(-1, 1, side + 1)
    cells = _cells(triangles / side**2)
    geometries = {f"{i} {j}": _patch(cells, borders[i : i + 2], borders[j : j + 2]) for i in range(side) for j in range(side)}
    return _scene(geometries, [_placed(name) for name in geometries], size)


def instances(count: int, size: tuple[int, int] = SIZE) -> Scene:
    """One mesh of a thousand triangles, placed so many times side by side."""
    side = math.ceil(math.sqrt(count))
    row, column = np.divmod(np.arange(count), side)
    matrices = np.tile(np.diag([1 / side, 1 / side, 1 / side, 1.0]), (count, 1, 1))
    matrices[:, 0, 3], matrices[:, 1, 3] = (2 * column + 1) / side - 1, (2 * row + 1) / side - 1
    return _scene({"patch": _patch(_cells(1000), (-1, 1), (-1, 1))}, [Object("patch", "patch", matrices)], size)


def spheres(count: int, size: tuple[int, int] = SIZE) -> Scene:
    """So many exact spheres over flat ground, of which they cover always the same part."""
    rng = np.random.default_rng(1)
    radius = 0.6 / math.sqrt(count)
    centres = rng.uniform(-1, 1, (count, 3)) * [1, 1, 0.1] + [0, 0, 0.2]
    geometries = {
        "ground": _patch(1, (-1, 1), (-1, 1)),
        "spheres": Spheres(centres, np.full(count, radius), np.zeros(count, np.int32)),
    }
    return _scene(geometries, [_placed(name) for name in geometries], size)


def under_points(count: int, triangles: int, size: tuple[int, int] = SIZE) -> Scene:
    """The ground under so many lamps of no size, that give as much light together as one would."""
    lamps = [Point(f"{i}", position=place, power=(20 / count,) * 3) for i, place in enumerate(_lattice(count))]
    return one_mesh(triangles, size, lamps)


def under_areas(count: int, triangles: int, size: tuple[int, int] = SIZE) -> Scene:
    """The same with lamps that are squares and face down, together as large as one would be."""
    side = 0.5 / math.sqrt(count)
    lamps = [
        Area(f"{i}", matrix=_matrix(1.0, place), size=(side, side), power=(20 / count,) * 3)
        for i, place in enumerate(_lattice(count))
    ]
    return one_mesh(triangles, size, lamps)


def triangles_of(scene: Scene) -> int:
    """How many triangles its objects have, those of shared meshes counted each time."""
    counts = {name: len(mesh.triangles) for name, mesh in scene.geometries.items() if isinstance(mesh, Mesh)}
    return sum(counts.get(placed.geometry, 0) * len(placed.matrices) for placed in scene.objects)


def own_bytes(scene: Scene) -> int:
    """Of the scene's own arrays."""
    return sum(
        values.nbytes
        for geometry in scene.geometries.values()
        for values in vars(geometry).values()
        if isinstance(values, np.ndarray)
    )


def _scene(geometries: dict, objects: list[Object], size: tuple[int, int], lamps: Sequence[Lamp] = (_SUN,)) -> Scene:
    camera = Pinhole((0.3, -2.6, 1.9), (0, -0.05, 0), (0, 0, 1), 1.35 * size[0], *size)
    return Scene(camera, geometries, tuple(objects), lamps=tuple(lamps))


def _placed(geometry: str, scale: float = 1.0, place: Sequence[float] = (0, 0, 0)) -> Object:
    return Object(geometry, geometry, _matrix(scale, place))


def _matrix(scale: float, place: Sequence[float]) -> Array:
    matrix = np.diag([scale, scale, scale, 1.0])
    matrix[:3, 3] = place
    return matrix


def _lattice(count: int) -> list[tuple[float, float, float]]:
    """Places above the ground."""
    side = math.ceil(math.sqrt(count))
    return [((2 * (i % side) + 1) / side - 1, (2 * (i // side) + 1) / side - 1, 0.8) for i in range(count)]


def _cells(triangles: float) -> int:
    """Squares along the side of a patch of so many triangles."""
    return max(1, round(math.sqrt(triangles / 2)))


def _patch(cells: int, x_range: Sequence[float], y_range: Sequence[float]) -> Mesh:
    """cells × cells squares of the ground, two triangles each."""
    y, x = (np.linspace(*ends, cells + 1) for ends in (y_range, x_range))
    x, y = (values.ravel() for values in np.meshgrid(x, y))
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
