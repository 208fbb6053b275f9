"""The levels of light, `direct` and `path`, for a tile of pixels: what is at their centres, and the mean of their samples.

Some samples of all pixels of the tile are traced at a time. Pixels share no sample: each has its own places on the film and its
own random numbers, so that their errors are independent of one another.
"""

from collections.abc import Callable

import numpy as np

from ...image import BACKGROUND_DEPTH, CHANNELS, LIGHT_PASSES
from ..arrays import Floats, Indices
from ..rays.points import Surfaces
from ..rays.space import Space
from ..rays.surface import Passes
from ..rays.view import View
from ..scene import Scene
from ..scene.film import NO_BOUNCES
from .emitters import Emitters
from .filters import offsets
from .paths import Paths
from .sampler import Sampler
from .sums import Sums
from .textures import Palette

# Paths that are traced at a time, twice as many where light bounces, and of how many samples of a pixel if there are as many.
# Fewer would fit a core's cache, and take a fifth longer: after some scatterings few are left, and NumPy is called as often for
# these.
PATHS, SAMPLES_AT_A_TIME = 65536, 16

CENTRES = ("Depth", "Object Index")
"""The passes that tell what is at the pixels' centres."""

Eye = Callable[[Floats, Floats], tuple[Floats, Floats, Indices]]
"""What the eye sees at columns and rows, (n,) each: the rays' x and y and the primitives that they meet."""


def dark(shape: tuple[int, ...]) -> Passes:
    """Passes of a picture without light and without surfaces. shape : all axes but the channels."""
    passes = {name: np.zeros((*shape, len(CHANNELS[name])), np.float32) for name in (*LIGHT_PASSES, *CENTRES)}
    passes["Depth"][...] = BACKGROUND_DEPTH
    return passes


class Illumination:
    """Light in one scene.

    eye : what the eye sees. level : "direct" or "path". samples, seed : as in render.render.
    """

    def __init__(self, scene: Scene, view: View, surfaces: Surfaces, eye: Eye, level: str, samples: int, seed: int) -> None:
        self._film, self._eye, self._samples = scene.film, eye, samples
        self._sampler = Sampler(seed, samples)
        palette, space = Palette(scene), Space(surfaces)
        emitters = Emitters(scene, view, surfaces, palette)
        bounces = scene.bounces if level == "path" else NO_BOUNCES
        self._paths_at_a_time = 2 * PATHS if bounces.total else PATHS
        self._paths = Paths(surfaces, space, emitters, palette, self._sampler, bounces, scene.clip)

    @property
    def largest_tile(self) -> int:
        """Pixels."""
        return self._paths_at_a_time // min(self._samples, SAMPLES_AT_A_TIME)

    def trace(self, passes: Passes, pixels: Indices, columns: Floats, rows: Floats, check: Callable[[], None]) -> None:
        """Write the light of n pixels into passes, name → (n, channels).

        columns, rows : (n,) of the pixels' lower left corners. check : called often; what it raises ends the work.
        """
        count = len(pixels)
        sums = Sums(count, self._paths.categories, self._film, self._samples)
        at_a_time = max(1, self._paths_at_a_time // count)
        for first in range(0, self._samples, at_a_time):
            some = np.arange(first, min(first + at_a_time, self._samples))
            pixel, sample = np.tile(pixels, len(some)), np.repeat(some, count)
            px, py = offsets(self._film, self._sampler.grid(pixels, some, 0, 2)) if self._samples > 1 else (0.5, 0.5)
            x, y, primitives = self._eye(np.tile(columns, len(some)) + px, np.tile(rows, len(some)) + py)
            sums.add(self._paths.trace(pixel, sample, primitives, x, y, check))
        sums.write(passes, self._paths.random)
