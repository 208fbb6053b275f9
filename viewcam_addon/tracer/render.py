"""A picture of a scene at level `geometry`: tiles over threads.

A tile is a run of pixels, row after row: the memory that a render takes beside the passes does not depend on the size of the
picture. Every pixel is computed alone, so that the result is the same, bit for bit, for any number of threads.
"""

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from .ellipsoids import ellipsoids_of
from .scene import Mesh, Scene, Spheres
from .surface import Passes, Surface, background
from .triangles import Planes, triangles_of
from .view import View
from .visibility import visibility

# Pixels. Small tiles make threads wait for one another's Python: with two, 16384 take a seventh longer than 65536, although
# their arrays stay in a core's cache. A small picture is cut into several tiles for each thread.
TILE, SMALLEST_TILE, TILES_PER_THREAD = 65536, 4096, 4


class Tracer:
    """A scene made ready for tracing from its camera.

    scene : what to trace. threads : how many threads to trace with, all cores if it is None.
    """

    def __init__(self, scene: Scene, threads: int | None = None) -> None:
        self._camera = scene.camera
        self._threads = threads or os.cpu_count() or 1
        self._view = View(scene.camera)
        placed = [(placed, scene.geometries[placed.geometry]) for placed in scene.objects]
        triangles = triangles_of([pair for pair in placed if isinstance(pair[1], Mesh)], self._view)
        ellipsoids = ellipsoids_of([pair for pair in placed if isinstance(pair[1], Spheres)], self._view)
        planes = Planes(triangles, self._view)
        self._visibility = visibility(triangles, planes, ellipsoids, scene.clip)
        self._surface = Surface(self._view, triangles, planes, ellipsoids)

    def render(self) -> Passes:
        """Pass name → (height, width, channels) float32, rows from the bottom: the surfaces at the pixel centres."""
        width, height = self._camera.width, self._camera.height
        try:
            passes = background((height, width))
        except (MemoryError, ValueError) as error:
            raise InputError(
                f"a picture of {width} × {height} pixels needs more memory than there is: choose a size"
            ) from error
        flat = {name: values.reshape(width * height, -1) for name, values in passes.items()}
        size = max(SMALLEST_TILE, min(TILE, width * height // (TILES_PER_THREAD * self._threads)))

        def trace(first: int) -> None:
            tile = slice(first, min(first + size, width * height))
            pixels = np.arange(tile.start, tile.stop)
            rows = pixels // width
            self._trace({name: values[tile] for name, values in flat.items()}, pixels - rows * width + 0.5, rows + 0.5)

        with ThreadPoolExecutor(self._threads) as pool:
            list(pool.map(trace, range(0, width * height, size)))  # the list hands on what a tile raised
        return passes

    def surface_at(self, columns: ArrayLike, rows: ArrayLike, px: ArrayLike = 0.5, py: ArrayLike = 0.5) -> Passes:
        """The surfaces at sample points of pixels.

        columns, rows : pixels from the left and from the bottom; px, py : the sample point in each pixel; broadcast to (n,).

        Returns pass name → (n, channels) float32.
        """
        column, row = np.broadcast_arrays(np.add(columns, px, dtype=np.float64), np.add(rows, py, dtype=np.float64))
        passes = background(column.shape)
        for first in range(0, len(column), TILE):
            tile = slice(first, first + TILE)
            self._trace({name: values[tile] for name, values in passes.items()}, column[tile], row[tile])
        return passes

    def _trace(self, passes: Passes, column: np.ndarray, row: np.ndarray) -> None:
        x, y = self._camera.view_plane(column, row)
        self._surface.write(passes, self._visibility.first(x, y), x, y)


def render(scene: Scene, threads: int | None = None) -> Passes:
    """Trace the scene: pass name → (height, width, channels) float32, rows from the bottom."""
    return Tracer(scene, threads).render()
