"""Colors and images, as data: what the inputs of materials are given.

Colors are linear, in the scene's own primaries; nobody here knows which.
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
        raise InputError(f"{name} is {checks.quoted(rgb)}: give three numbers from 0 to {LARGEST_RADIANCE:g}")
    return rgb


RGBE = np.dtype(np.uint32)
TEXELS = (*map(np.dtype, (np.float32, np.float16, np.uint8, np.uint16)), RGBE)
"""The types of a `Picture`'s pixels, as the core counts it (capi.h)."""
_ROWS = 1 << 20  # numbers that are looked at together: larger arrays would not stay in a processor's cache


@dataclass(frozen=True, eq=False)
class Picture:
    """An image that colors surfaces, laid out over UV (0, 0) to (1, 1) and repeated beyond.

    pixels : (height, width, 3), or 4 with an alpha, rows from the bottom; floats, half floats, or whole numbers of one byte or
        two, which are shares of 255 or 65535; anything else becomes float32. Encoded as sRGB where `srgb` is true, else linear.
        Or (height, width, 1) of `RGBE`, as Radiance's files have it: from the lowest a byte of red, green, blue and exponent;
        a color is its byte times 2^(exponent − 136).
        Between pixels the encoded values are interpolated, as Cycles does; with an alpha, after they are multiplied by it.
        Linear ones are not multiplied. The tracer reads them where they are: don't write to them.
    """

    pixels: NDArray
    srgb: bool = False

    def __post_init__(self) -> None:
        dtype = self.pixels.dtype.newbyteorder("=")
        is_rgbe = dtype == RGBE and self.pixels.shape[-1:] == (1,)
        if self.pixels.ndim != 3 or not (is_rgbe or self.pixels.shape[2] in (3, 4)) or not self.pixels.size:
            raise InputError(f"an image has the shape {self.pixels.shape} and must have height × width × 3 or 4: check it")
        with np.errstate(over="ignore"):  # too large a number for float32 becomes infinite, and is refused here
            pixels = np.ascontiguousarray(self.pixels, dtype if is_rgbe or dtype in TEXELS[:-1] else np.float32)
        object.__setattr__(self, "pixels", pixels)
        ends = _ends(pixels)
        if not np.isfinite(ends).all():
            raise InputError("an image holds a number that is not finite: check it")
        # Numbers that are encoded as sRGB are raised to the power of 2.4.
        most = LARGEST_RADIANCE ** (1 / 2.4) if self.srgb else LARGEST_RADIANCE
        largest = max(map(abs, ends))
        if largest > most:
            raise InputError(
                f"an image holds {largest:.3g}: give numbers up to {most:.3g}, so that its light can be computed with"
            )

    @classmethod
    def compact(cls, values: NDArray[np.float32], srgb: bool = False) -> "Picture":
        """The picture of some float32 values, in as few bytes as hold each of them to the bit.

        values : an array like `pixels`.
        """
        exact = (_exactly(values, dtype) for dtype in _SMALLEST_FIRST)
        return cls(next(pixels for pixels in exact if pixels is not None), srgb)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Height, width, and 3 channels or 4."""
        height, width, channels = self.pixels.shape
        return height, width, max(channels, 3)

    @property
    def values(self) -> NDArray[np.float32]:
        """The pixels as float32: a share of 255 is rounded as Blender and Cycles round it."""
        return _values(self.pixels)


_SMALLEST_FIRST: tuple[np.dtype, ...] = (np.dtype(np.uint8), RGBE, *map(np.dtype, (np.uint16, np.float16, np.float32)))


def _values(pixels: NDArray) -> NDArray[np.float32]:
    if pixels.dtype == RGBE:
        parts = pixels.view(np.uint8)
        return np.ldexp(parts[..., :3].astype(np.float32), parts[..., 3:].astype(np.int32) - 136)
    values = pixels.astype(np.float32, copy=False)
    return values if pixels.dtype.kind == "f" else values * (np.float32(1) / np.float32(np.iinfo(pixels.dtype).max))


def _exactly(values: NDArray[np.float32], dtype: np.dtype) -> NDArray | None:
    """Values as pixels of another type, None where not all of them are what these stand for."""
    if dtype == values.dtype:
        return values
    if dtype == RGBE and values.shape[2] != 3:
        return None
    result = np.empty((*values.shape[:2], 1) if dtype == RGBE else values.shape, dtype)
    rows = max(1, _ROWS // values[0].size)
    for first in range(0, len(values), rows):
        source, part = values[first : first + rows], result[first : first + rows]
        with np.errstate(over="ignore", invalid="ignore"):
            if dtype == RGBE:
                largest = np.maximum(np.maximum(source[..., 0], source[..., 1]), source[..., 2])
                parts, exponents = part.view(np.uint8), np.clip(np.frexp(largest)[1] + 128, 0, 255)
                parts[..., :3], parts[..., 3] = np.ldexp(source, 136 - exponents[..., None]), exponents
            else:
                part[:] = source if dtype.kind == "f" else np.rint(source * np.float32(np.iinfo(dtype).max))
        if not np.array_equal(_values(part).view(np.int32), source.view(np.int32)):
            return None
    return result


def _ends(pixels: NDArray) -> tuple[float, float]:
    """Numbers between which all are, without a copy of what may be gigabytes."""
    if pixels.dtype == RGBE:
        return 0.0, max(float(_values(row).max()) for row in pixels)
    if pixels.dtype.kind == "u":
        return 0.0, 1.0
    if pixels.dtype == np.float16:  # whose bits are compared several times as fast: of either sign they grow with the size
        most = pixels.view(np.int16).max(), pixels.view(np.uint16).max()
        least, largest = (float(np.array(bits).astype(np.uint16).view(np.float16)) for bits in most)
        return least, largest
    return float(pixels.min()), float(pixels.max())


@dataclass(frozen=True)
class Color:
    """A color, the same everywhere or times what an image or the mesh's own colors say.

    rgb : factors, not negative.
    image : key in `Scene.images`, looked up at the mesh's UV, or None.
    closest : the nearest pixel of the image instead of a linear interpolation between four.
    vertex : times the mesh's `corner_colors`.
    """

    rgb: tuple[float, float, float]
    image: str | None = None
    closest: bool = False
    vertex: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "rgb", radiance("a color", self.rgb))

    @property
    def is_black(self) -> bool:
        return not any(self.rgb)

    @property
    def varies(self) -> bool:
        """True if it is not the same everywhere."""
        return self.image is not None or self.vertex
