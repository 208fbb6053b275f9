"""Random numbers, independent of each other: what the sampler in use is measured against."""

import numpy as np
from numpy.typing import NDArray


class Noise:
    """Random numbers in the place of the sampler's."""

    def __init__(self, seed: int, samples: int) -> None:
        self._seed = seed

    def numbers(self, pixels: NDArray, samples: NDArray, first: int, count: int) -> NDArray[np.float64]:
        key = [self._seed, first, int(pixels[0]), int(np.ravel(samples)[0])] if len(pixels) else 0
        return np.random.default_rng(key).random((count, len(pixels)))

    def grid(self, pixels: NDArray, samples: NDArray, first: int, count: int) -> NDArray[np.float64]:
        return self.numbers(np.tile(pixels, len(samples)), samples, first, count)
