"""Colours and images, as data: what the inputs of materials are given.

Colours are linear, in the scene's own primaries; nobody here knows which.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ... import checks
from ...errors import InputError

WHITE = (1.0, 1.0, 1.0)

# Float32 passes and float64 sums hold products of these.
LARGEST_RADIANCE = 1e18


def radiance(name: str, values: object) -> tuple[float, float, float]:
    """Three numbers that light can have: finite, not negative, not beyond `LARGEST_RADIANCE`; InputError with `name`."""
    rgb = checks.vector(name, values, 3)
    if not all(0.0 <= value <= LARGEST_RADIANCE for value in rgb):
        raise InputError(f"{name} is {checks.shown(rgb)}: give three numbers from 0 to {LARGEST_RADIANCE:g}")
    return rgb


@dataclass(frozen=True, eq=False)
class Picture:
    """An image that colours surfaces, laid out over UV (0, 0) to (1, 1) and repeated beyond.

    pixels : (height, width, 3) float32, or 4 with an alpha, rows from the bottom; encoded as sRGB where `srgb` is true, else
        linear. Between pixels the encoded values are interpolated, as Cycles does; with an alpha, after they are multiplied by
        it. Linear ones are not multiplied.
    """

    pixels: NDArray[np.float32]
    srgb: bool = False

    def __post_init__(self) -> None:
        if self.pixels.ndim != 3 or self.pixels.shape[2] not in (3, 4) or not self.pixels.size:
            raise InputError(f"an image has the shape {self.pixels.shape} and must have height × width × 3 or 4: check it")
        ends = float(self.pixels.min()), float(self.pixels.max())  # without a copy of what may be gigabytes
        if not np.isfinite(ends).all():
            raise InputError("an image holds a number that is not finite: check it")
        # What is encoded as sRGB is raised to the power of 2.4.
        most = LARGEST_RADIANCE ** (1 / 2.4) if self.srgb else LARGEST_RADIANCE
        largest = max(map(abs, ends))
        if largest > most:
            raise InputError(
                f"an image holds {largest:.3g}: give numbers up to {most:.3g}, so that its light can be computed with"
            )


@dataclass(frozen=True)
class Colour:
    """A colour, the same everywhere or times what an image or the mesh's own colours say.

    rgb : factors, not negative. image : key in `Scene.images`, looked up at the mesh's UV, or None. closest : the nearest pixel
    of the image instead of a linear interpolation between four. vertex : times the mesh's `corner_colours`.
    """

    rgb: tuple[float, float, float]
    image: str | None = None
    closest: bool = False
    vertex: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "rgb", radiance("a colour", self.rgb))

    @property
    def is_black(self) -> bool:
        return not any(self.rgb)

    @property
    def varies(self) -> bool:
        """Whether it is not the same everywhere."""
        return self.image is not None or self.vertex
