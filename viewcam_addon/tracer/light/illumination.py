"""The levels of light, `direct` and `path`, for a tile of pixels: what is at their centres, and the mean of their samples.

Some samples of all pixels of the tile are traced at a time. Pixels share no sample: each has its own places on the film and its
own random numbers, so that their errors are independent of one another.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...image import BACKGROUND_DEPTH, CHANNELS, LIGHT_PASSES
from ..arrays import Floats, Indices
from ..rays.ellipsoids import Ellipsoids
from ..rays.outlines import Outlines
from ..rays.points import Surfaces
from ..rays.space import Space
from ..rays.surface import Passes
from ..rays.triangles import Planes, Triangles
from ..rays.view import View
from ..scene import Scene
from ..scene.film import NO_BOUNCES
from .emitters import Emitters
from .filters import offsets
from .paths import Paths
from .sampler import Sampler
from .sums import Light, Means, Sums
from .textures import Palette

# Paths that are traced at a time, twice as many where light bounces, and of how many samples of a pixel if there are as many.
# Fewer would fit a core's cache, and take a fifth longer: after some scatterings few are left, and NumPy is called as often for
# these.
PATHS, SAMPLES_AT_A_TIME = 65536, 16

# More lamps than these are sampled by chance, all of them at once.
_LAMPS = 8

CENTRES = ("Depth", "Object Index")
"""The passes that tell what is at the pixels' centres."""

Eye = Callable[[Floats, Floats, bool], tuple[Floats, Floats, Indices]]
"""What the eye sees at columns and rows, (n,) each: the rays' x and y and the primitives that they meet; and whether rays may
aim at corners of triangles, which takes care. Samples that are spread over their pixels don't: of such rays one in 10⁸ slips
through beside a corner, as many times as a pixel shows corners (corners.REACH, of which one in a hundred slips)."""


def dark(shape: tuple[int, ...]) -> Passes:
    """Passes of a picture without light and without surfaces. shape : all axes but the channels."""
    passes = {name: np.zeros((*shape, len(CHANNELS[name])), np.float32) for name in (*LIGHT_PASSES, *CENTRES)}
    passes["Depth"][...] = BACKGROUND_DEPTH
    return passes


def counted(shape: tuple[int, ...]) -> Passes:
    """The same with the pass that counts samples, one of each pixel."""
    return dark(shape) | {"Sample Count": np.ones((*shape, 1), np.float32)}


class Lit(NamedTuple):
    """What light needs of a scene, whatever the lamps and however it is sampled."""

    surfaces: Surfaces
    space: Space
    palette: Palette

    @staticmethod
    def by(scene: Scene, view: View, triangles: Triangles, planes: Planes, ellipsoids: Ellipsoids) -> "Lit":
        surfaces = Surfaces(scene, view, triangles, planes, ellipsoids)
        return Lit(surfaces, Space(surfaces), Palette(scene))


class Illumination:
    """Light in one scene.

    lit : what light needs of it. eye : what the eye sees. level : "direct" or "path". samples, seed : as in render.render.
    """

    def __init__(self, scene: Scene, view: View, lit: Lit, eye: Eye, level: str, samples: int, seed: int) -> None:
        self.camera, self.film, self.samples, self.eye = scene.camera, scene.film, samples, eye
        self._scene, self._view, self._clip = scene, view, scene.clip
        self.sampler = Sampler(seed, samples)
        self.surfaces, self._space, self.palette = lit
        self._bounces = scene.bounces if level == "path" else NO_BOUNCES
        self.paths_at_a_time = 2 * PATHS if self._bounces.total else PATHS
        self.paths = self._paths_in(scene)

    def _paths_in(self, scene: Scene) -> Paths:
        emitters = Emitters(scene, self._view, self.surfaces, self.palette)
        return Paths(self.surfaces, self._space, emitters, self.palette, self.sampler, self._bounces, self._clip)

    def paths_by_lamp(self) -> list[Paths] | None:
        """Paths of each lamp alone, none of which depends on chance; None where some do, or where there are too many."""
        if not self.paths.random:
            return [self.paths]
        lamps = [lamp for lamp in self._scene.lamps if not lamp.is_dark]
        if not 1 < len(lamps) <= _LAMPS:
            return None
        paths = [self._paths_in(replace(self._scene, lamps=(lamp,))) for lamp in lamps]
        return None if any(alone.random for alone in paths) else paths

    def edges(self, outlines: Outlines, depth: Floats, primitives: Indices) -> NDArray[np.bool_]:
        """(height, width): the pixels that an outline or the edge of a sharp shadow may cross.

        depth, primitives : (height, width), what is seen at the pixels' centres.
        """
        return outlines.edges(depth, self.surfaces, self._space, primitives)

    @property
    def largest_tile(self) -> int:
        """Pixels."""
        return self.paths_at_a_time // min(self.samples, SAMPLES_AT_A_TIME)

    def trace(self, passes: Passes, pixels: Indices, columns: Floats, rows: Floats, check: Callable[[], None]) -> None:
        """Write the light of n pixels into passes, name → (n, channels).

        columns, rows : (n,) of the pixels' lower left corners. check : called often; what it raises ends the work.
        """
        sums = self.sums(len(pixels), self.samples)
        at_a_time = max(1, self.paths_at_a_time // len(pixels))
        for first in range(0, self.samples, at_a_time):
            self.add(sums, np.arange(first, min(first + at_a_time, self.samples)), pixels, columns, rows, check)
        sums.write(passes, self.paths.random)

    def means(self, count: int) -> Means:
        """Means of so many pixels, none of which has samples yet."""
        return Means(count, self.paths.categories, self.film)

    def sums(self, count: int, samples: int) -> Sums:
        """Sums over no samples of so many pixels so far. samples : how many there will be."""
        return Sums(count, self.paths.categories, self.film, samples)

    def add(
        self, sums: Sums, samples: Indices, pixels: Indices, columns: Floats, rows: Floats, check: Callable[[], None]
    ) -> None:
        """Trace some samples, given by their numbers, of the sums' pixels, and add them; the rest as in `trace`."""
        sums.add(self.light(samples, pixels, columns, rows, check))

    def light(self, samples: Indices, pixels: Indices, columns: Floats, rows: Floats, check: Callable[[], None]) -> Light:
        """The light of some samples, given by their numbers, of pixels, pixel after pixel; the rest as in `trace`."""
        some, count = len(samples), len(pixels)
        spread = self.samples > 1
        px, py = offsets(self.film, self.sampler.grid(pixels, samples, 0, 2)) if spread else (0.5, 0.5)
        x, y, primitives = self.eye(np.repeat(columns, some) + px, np.repeat(rows, some) + py, not spread)
        return self.paths.trace(np.repeat(pixels, some), np.tile(samples, count), primitives, x, y, check)
