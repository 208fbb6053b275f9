"""Pictures of a scene, at level `geometry` and at the levels of light: what to compute, in tiles over threads.

At level `geometry` a pixel is one ray. At the others it is many paths, some samples at a time for all pixels of a tile, and
one ray more that tells what is at its centre. Every pixel is computed alone and its samples are summed in order, so that the
result is the same, bit for bit, for any number of threads.
"""

import math
import os
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from .arrays import Floats, Indices
from .compiled.standing import PATHS_WORTH_COMPILING, PIXELS_WORTH_COMPILING, uncompiled
from .rays.centres import Centres
from .rays.ellipsoids import ellipsoids_of
from .rays.joints import Joints
from .rays.outlines import Outlines
from .rays.surface import Passes, Surface, unwritten
from .rays.tables import made_once
from .rays.triangles import Planes, Triangles, triangles_of
from .rays.view import View
from .rays.visibility import visibility
from .scene import Mesh, Object, Scene, Spheres
from .scene.film import LEVELS, SAMPLES
from .scene.sameness import same_materials, same_things
from .tiles import Stopped, Watcher, over_threads, tiles

__all__ = ["Keeper", "Passes", "Stopped", "Tracer", "Watcher", "render"]

# Pixels. Small tiles make threads wait for one another's Python: with two, 16384 take a seventh longer than 65536, although
# their arrays stay in a core's cache. A small picture is cut into several tiles for each thread.
TILE, SMALLEST_TILE = 65536, 4096
# Pixels that get samples as long as their error is too large, some at a time.
SMALLEST_PART = 256
# For each triangle. A turned hierarchy's boxes are wider than those of a new one, so that a ray takes 17 ns longer, a tenth; to
# build takes 240 ns a triangle longer than to refit.
_MANY_RAYS = 14
# Of each sample at the levels of light, and samples of a pixel where their number is not known.
_RAYS, _USUAL_SAMPLES = 2, 8


class Tracer:
    """A scene made ready for tracing from its camera.

    scene : what to trace. threads : how many threads to trace with, all cores if it is None. kept : the tracer of another
    scene, as a frame before this one, which is used up. Where the same things stand before the same camera, however long its
    lens and however large its picture, nothing is made anew; where the camera was moved, Embree's hierarchy is refitted, unless
    so many rays are expected that a new one pays. rays : how many, about.

    No array of a scene may be changed while there is a tracer of it.
    """

    def __init__(self, scene: Scene, threads: int | None = None, kept: "Tracer | None" = None, rays: int = 0) -> None:
        self._scene, self._camera = scene, scene.camera
        self._threads = threads or os.cpu_count() or 1
        self._view = View(scene.camera)
        self._joints = None  # of the triangles, where another tracer found them
        self._edges = None  # the pixels that they may cross, once they are asked for
        former = None if kept is None else kept._used_up(scene)
        if former is None:
            self._triangles = triangles_of(_placed(scene, Mesh), self._view, self._threads)
        elif self._view.is_same(former._view):
            self._take_over(former)
            return
        else:
            self._triangles, self._joints = former._moved(self._view, rays), former._known_joints()
            del former  # before there are as many tables again
        self._ellipsoids = ellipsoids_of(_placed(scene, Spheres), self._view)
        self._planes = Planes(self._triangles, self._view)
        self._see()

    def _see(self) -> None:
        self._visibility = visibility(self._triangles, self._planes, self._ellipsoids, self._scene.clip)
        self._surface = Surface(self._view, self._triangles, self._planes, self._ellipsoids)

    def _take_over(self, former: "Tracer") -> None:
        """Everything of a tracer whose camera stands where this one's does, before the same things."""
        self._triangles, self._ellipsoids, self._planes = former._triangles, former._ellipsoids, former._planes
        self._joints = former._known_joints()
        if self._scene.clip == former._scene.clip:
            self._visibility, self._surface = former._visibility, former._surface
        else:
            self._see()
        if "_lit" in vars(former) and same_materials(self._scene, former._scene):
            self._lit = former._lit

    def _used_up(self, scene: Scene) -> "Tracer | None":
        """All that this tracer has, in another one, if the same things are in `scene`; this one can't trace any more."""
        heir = object.__new__(Tracer)
        vars(heir).update(vars(self))
        vars(self).clear()
        return heir if same_things(scene, heir._scene) else None

    def _moved(self, view: View, rays: int) -> Triangles:
        return self._triangles.moved(view, refit=rays < _MANY_RAYS * self._triangles.count)

    def _known_joints(self) -> Joints | None:
        outlines = vars(self).get("_outlines")
        return self._joints if outlines is None else vars(outlines).get("joints")

    @made_once
    def _lit(self) -> Any:
        """What light needs, whatever its level and samples (`Lit`)."""
        from .light.illumination import Lit

        return Lit.by(self._scene, self._view, self._triangles, self._planes, self._ellipsoids)

    @made_once
    def _centres(self) -> Centres:
        return Centres(self._camera, self._visibility)

    @made_once
    def _outlines(self) -> Outlines:
        things = self._triangles, self._planes, self._ellipsoids
        return Outlines(self._scene, self._view, *things, self._visibility, joints=self._joints)

    def render(self, watcher: Watcher | None = None) -> Passes:
        """Pass name → (height, width, channels) float32, rows from the bottom: the surfaces at the pixel centres."""
        passes = self._blank(unwritten)
        centres = self._centres

        def trace(passes: Passes, tile: range) -> None:
            x, y, close = centres.rays(tile)
            self._surface.write(passes, self._visibility.first(x, y, close, centres.width), x, y)

        return self._traced(passes, trace, SMALLEST_TILE, TILE, watcher)

    def render_light(
        self,
        level: str,
        samples: int,
        seed: int,
        watcher: Watcher | None = None,
        error: float | None = None,
    ) -> Passes:
        """The same of light, and what is at the pixel centres: Depth and Object Index.

        error : as in `render`; then there is the pass Sample Count, too.
        """
        from .light.adaptive.rounds import Rounds
        from .light.illumination import CENTRES, Illumination, counted, dark

        passes = self._blank(dark if error is None else counted)
        illumination = Illumination(self._scene, self._view, self._lit, self._eye, level, samples, seed)
        centres = self._centres

        def check() -> None:
            _stop_if_asked(watcher)

        def trace_centres(passes: Passes, tile: range) -> Indices:
            x, y, close = centres.rays(tile)
            primitives = self._visibility.first(x, y, close, centres.width)
            self._surface.write({name: passes[name] for name in CENTRES}, primitives, x, y)
            return primitives

        def trace(passes: Passes, tile: range) -> None:
            columns, rows = self._corners(tile)
            trace_centres(passes, tile)
            illumination.trace(passes, np.arange(tile.start, tile.stop), columns, rows, check)

        if error is None or samples == 1:
            largest = illumination.largest_tile
            return self._traced(passes, trace, min(largest, SMALLEST_TILE), largest, watcher)
        primitives = np.empty((self._camera.height, self._camera.width), np.int32)

        def see(passes: Passes, tile: range) -> None:
            check()
            primitives.ravel()[tile.start : tile.stop] = trace_centres(passes, tile)

        self._traced(passes, see, SMALLEST_TILE, TILE, None)
        depth = passes["Depth"][..., 0]
        if self._edges is None:
            self._edges = illumination.edges(self._outlines, depth, primitives)
        rounds = Rounds(illumination, error, self._edges, depth, primitives, self._in_parts, check)
        for rows in rounds.bands():
            rounds.trace({name: values[rows.start : rows.stop] for name, values in passes.items()}, rows)
            if watcher is not None:
                watcher.tile(passes, rows)
        return passes

    def surface_at(self, columns: ArrayLike, rows: ArrayLike, px: ArrayLike = 0.5, py: ArrayLike = 0.5) -> Passes:
        """The surfaces at sample points of pixels.

        columns, rows : pixels from the left and from the bottom; px, py : the sample point in each pixel; broadcast to (n,).

        Returns pass name → (n, channels) float32.
        """
        column, row = np.broadcast_arrays(np.add(columns, px, dtype=np.float64), np.add(rows, py, dtype=np.float64))
        passes = unwritten(column.shape)
        for first in range(0, len(column), TILE):
            tile = slice(first, first + TILE)
            x, y, primitives = self._eye(column[tile], row[tile])
            self._surface.write({name: values[tile] for name, values in passes.items()}, primitives, x, y)
        return passes

    def _eye(self, column: Floats, row: Floats, careful: bool = True) -> tuple[Floats, Floats, Indices]:
        """The rays (x, y, 1) through points of the film, and the primitives that they meet.

        careful : whether some may aim at corners of triangles.
        """
        x, y = self._camera.view_plane(column, row)
        return x, y, self._visibility.first(x, y, None if careful else np.empty(0, np.intp))

    def _blank(self, make: Callable[[tuple[int, int]], Passes]) -> Passes:
        """A picture's passes, before anything else takes memory for it."""
        width, height = self._camera.width, self._camera.height
        try:
            return make((height, width))
        except (MemoryError, ValueError) as error:
            raise InputError(
                f"a picture of {width} × {height} pixels needs more memory than there is: choose a size"
            ) from error

    def _traced(
        self, passes: Passes, trace: Callable[[Passes, range], None], smallest: int, largest: int, watcher: Watcher | None
    ) -> Passes:
        """Passes that `trace` has written into, tile by tile."""
        width, height = self._camera.width, self._camera.height
        flat = {name: values.reshape(width * height, -1) for name, values in passes.items()}

        def work(tile: range) -> None:
            _stop_if_asked(watcher)
            trace({name: values[tile.start : tile.stop] for name, values in flat.items()}, tile)

        runs = tiles(width * height, width, self._threads, smallest, largest)
        for tile in over_threads(work, runs, self._threads):
            if watcher is not None:
                watcher.tile(passes, range(tile.start // width, (tile.stop - 1) // width + 1))
        return passes

    def _in_parts(self, work: Callable[[slice], None], count: int, largest: int) -> None:
        """Call `work` with slices of so many things, each of no more than `largest`, in threads."""
        runs = tiles(count, 1, self._threads, min(largest, SMALLEST_PART), largest)
        for _ in over_threads(lambda run: work(slice(run.start, run.stop)), runs, self._threads):
            pass

    def _corners(self, tile: range) -> tuple[Indices, Indices]:
        """Columns and rows of a tile's pixels, which are their lower left corners as well."""
        rows, columns = np.divmod(np.arange(tile.start, tile.stop), self._camera.width)
        return columns, rows


class Keeper:
    """Of scenes that are traced one after the other, what the next one may share with the one before: see `Tracer`."""

    def __init__(self) -> None:
        self._tracer: Tracer | None = None

    def tracer(self, scene: Scene, threads: int | None = None, rays: int = 0) -> Tracer:
        """That of a scene. The one before can't trace any more."""
        former, self._tracer = self._tracer, None
        self._tracer = Tracer(scene, threads, former, rays)
        return self._tracer


def render(
    scene: Scene,
    level: str = "geometry",
    samples: int = SAMPLES,
    seed: int = 0,
    threads: int | None = None,
    watcher: Watcher | None = None,
    error: float | None = None,
    keeper: Keeper | None = None,
) -> Passes:
    """Trace the scene: pass name → (height, width, channels) float32, rows from the bottom.

    level : one of film.LEVELS. samples : of each pixel, at the levels of light; the only one is at its centre.
    seed : another for other noise. error : the standard error that each pixel's Combined may have, scene-linear: the root of
    the mean of its channels' variances. Then pixels get as few samples as that takes, `samples` at most; Sample Count tells.
    keeper : of what this scene may share with others that it has traced, or will.

    Raises
    ------
    InputError
        if there is no such level or error, or not enough memory.
    Stopped
        when the watcher says so.
    """
    if level not in LEVELS:
        raise InputError(f"the level is {level!r}: give one of {', '.join(LEVELS)}")
    if samples < 1:
        raise InputError(f"the number of samples is {samples}: give at least 1")
    if error is not None and not 0.0 < error < math.inf:
        raise InputError(f"the error is {error}: give a number above 0")
    pixels = scene.camera.width * scene.camera.height
    paths = pixels * (samples if error is None else min(samples, _USUAL_SAMPLES))
    try:
        if level == "geometry":
            with uncompiled(keeper is None and pixels < PIXELS_WORTH_COMPILING):
                return (keeper or Keeper()).tracer(scene, threads, pixels).render(watcher)
        with uncompiled(keeper is None and paths < PATHS_WORTH_COMPILING):
            tracer = (keeper or Keeper()).tracer(scene, threads, _RAYS * paths)
            return tracer.render_light(level, samples, seed, watcher, error)
    except MemoryError as error:
        raise InputError("the scene needs more memory than there is: take some of it out, or give fewer threads") from error


def _placed(scene: Scene, kind: type) -> list[tuple[Object, Mesh | Spheres]]:
    """The objects that are meshes or spheres, with their geometries."""
    placed = [(placed, scene.geometries[placed.geometry]) for placed in scene.objects]
    return [thing for thing in placed if isinstance(thing[1], kind)]


def _stop_if_asked(watcher: Watcher | None) -> None:
    if watcher is not None and watcher.stop():
        raise Stopped
