"""Light that is a renderer's choice, and the pixels that are taken out of a comparison for it.

Which of several surfaces in one place a ray of Cycles meets, and whether one of them shadows the other, is what float32
rounds: a ray leaves a surface at the distance 0, leaves out that one triangle (`intersection_skip_self` in kernel/bvh/util.h),
and meets another in the same place where Embree's rounding has it at a distance above 0. Rejected: doing what Cycles does,
which would be Embree's arithmetic to the bit, with fused products or without, as the processor has them.

Which part of its light a place gets where shadow rays see otherwise than scattered ones (an object that only some kinds of
rays see, a material that asks for the kind, a lamp without shadows) is Cycles' weights of multiple importance sampling
(`light_sample_mis_weight_forward` and `light_sample_mis_weight_nee` in kernel/light/sample.h): other ones with a light tree
than without, or with another lamp in the scene. So is which part it gets of a light that only some kinds of rays see, where a
surface scatters several kinds: each ray carries the light of all of them. Rejected: doing what Cycles does, since an artist's
own picture, with the light tree, has other weights than the one that is compared; and to switch importance sampling off on
both sides, which takes lamps out of mirrors.

So the tracer tells how much light is of these kinds, at most (core/integrators/path.h). Pixels in which it is a tenth of the
light or more are taken out; the others keep it as a tolerance.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..image import Image
from . import noise
from .sides import Sides, values_of
from .tolerances import Array

SAMPLES = 64
"""The samples of each pixel: what they leave uncertain counts as noise of the reference."""

# The share of a pixel's light from which on the pixel says nothing of the rest. Less is a tolerance. Chosen: with a smaller
# share more pixels are taken out that could still tell larger faults, with a larger one some stay that can tell nothing else.
_SHARE = 0.1

# The share of the pixels with light below which the rest of a comparison answers nothing. Calibrated: a room lit by a lamp in
# the plane of its ceiling has 0 to 4 % left, and scenes with other choices have a third or more.
_LEAST_LEFT = 0.1


@dataclass(frozen=True, eq=False)
class CoincidentLight:
    """The light that is a renderer's choice, at most.

    light : its passes.
    total : (height, width, 3), all light, traced with the same seed, which is not the reference's: pixels that were taken out
        because the reference is dark there would leave those where it is bright.
    pairs : two names in order of the alphabet → how often rays found these in one place.
    seen_otherwise : objects and lights that not all kinds of rays see, or see the shadows of → how often that made a
        difference; rough glass, too, where light comes in that no facet refracts.
    """

    light: Image
    total: NDArray[np.floating]
    pairs: Mapping[tuple[str, str], int]
    seen_otherwise: Mapping[str, int] = field(default_factory=dict)

    def __bool__(self) -> bool:
        return bool(self.pairs or self.seen_otherwise)

    def of(self, sides: Sides) -> Array:
        """(height, width): the most of this light that a quantity has, over its channels and in the mean around each pixel."""
        if sides.name == "Alpha":
            return np.zeros(sides.broken.shape)
        values = np.nan_to_num(values_of(self.light, sides.name))
        return np.maximum(values, noise.mean_around(values)).max(axis=-1)

    def rest(self, combined: Sides) -> "Rest":
        """The comparison without the pixels in which this light is _SHARE of all, or more."""
        light = self.of(combined)
        return Rest(self, (light > 0.0) & (light >= _SHARE * self.total.max(axis=-1)))


@dataclass(frozen=True, eq=False)
class Rest:
    """A comparison without the light that is a renderer's choice. out : (height, width) bool, pixels taken out."""

    coincident: CoincidentLight
    out: NDArray[np.bool_]

    def tolerance(self, sides: Sides) -> Array:
        """(height, width): the light of a quantity that may be there or not in the pixels that are left."""
        return np.where(self.out, 0.0, self.coincident.of(sides))

    def of(self, sides: Sides) -> Sides:
        """The sides, with the reference's values on both where pixels are taken out, and with the noise of this light added."""
        test = np.where(self.out[..., None], sides.reference, sides.test)
        variance = sides.variance
        if sides.name == "Combined":
            variance = variance + np.nan_to_num(self.coincident.light["Variance"].astype(np.float64))
        return replace(sides, test=test, variance=variance)


MakeCoincidentLight = Callable[[], CoincidentLight]


@dataclass(frozen=True, eq=False)
class TakenOut:
    """The pixels that were taken out of a comparison of light.

    pixels : (height, width) bool, true for pixels that show surfaces in one place or are lit by them, or past what not all
        kinds of rays see.
    pairs, seen_otherwise : see CoincidentLight.
    share_of_lit : their share among the pixels that have light on either side, 0 to 1.
    """

    pixels: NDArray[np.bool_] = field(default_factory=lambda: np.zeros((1, 1), bool))
    pairs: Mapping[tuple[str, str], int] = field(default_factory=dict)
    seen_otherwise: Mapping[str, int] = field(default_factory=dict)
    share_of_lit: float = 0.0

    def __bool__(self) -> bool:
        return bool(self.pairs or self.seen_otherwise)

    @property
    def is_nearly_all(self) -> bool:
        """True if the rest is too little to be called the same picture."""
        return self.share_of_lit > 1.0 - _LEAST_LEFT

    @property
    def count(self) -> int:
        return int(self.pixels.sum())

    @property
    def in_one_place(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(name for pair in self.pairs for name in pair))

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys((*self.in_one_place, *self.seen_otherwise)))

    def to_json(self) -> dict:
        """The figures of InOnePlace of geometry, and the names of what not all kinds of rays see."""
        return {
            "pixels": self.count,
            "share": float(self.pixels.mean()),
            "share_of_lit": self.share_of_lit,
            "pairs": [{"objects": list(pair)} for pair in self.pairs],
            "seen_otherwise": list(self.seen_otherwise),
        }
