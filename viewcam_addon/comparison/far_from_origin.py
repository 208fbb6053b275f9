"""Pixels that the size of the coordinates costs, which another origin would give back.

The tolerance is 2⁻²⁴ · d · (M + t)/z · t/z for a rounding, and M holds the largest coordinate C of the eye and of what is seen.
With the origin at the eye that would be C′ = |P − e|: the difference is what the distance from the origin costs. What a long
lens, a slender triangle or a grazing view costs is in neither, and no other origin mends it.
"""

import math
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from ..pinhole import Pinhole
from . import tolerances
from .statistics import PassErrors
from .tolerances import ROUNDINGS, Array, Seen


@dataclass(frozen=True)
class FarFromOrigin:
    """error : pixels, the median. measured : whether it is that of the picture, or the tolerance where pixels can't be
    compared. away : how far the eye is from the origin, world units.
    """

    error: float
    measured: bool
    away: float

    @property
    def sentence(self) -> str:
        verb = "is" if self.measured else "may be"
        return (
            f"Cycles {verb} {self.error:.2g} px off here, because the camera stands {self.away:.1e} from the origin: "
            "check with --recenter."
        )

    def to_json(self) -> dict:
        return {**asdict(self), "unit": "px", "sentence": self.sentence}


def far_from_origin(pinhole: Pinhole, expected: Seen, compared: NDArray, position: PassErrors) -> FarFromOrigin | None:
    """The cost of the distance from the origin; None unless another origin would mend a visible error.

    expected : the reference's passes, (pixels, channels). compared : (n,), the pixels of `position`.
    """
    hits = compared if position.count else np.flatnonzero(tolerances.is_hit(expected))
    if not len(hits):
        return None
    there = {name: values[hits] for name, values in expected.items()}
    cost, allowed = (float(np.median(shift)) for shift in (_cost(pinhole, there), tolerances.ray_shift(pinhole, there)))
    error = position.values[0] if position.count else ROUNDINGS[0] * cost
    # An error beyond its tolerance has another cause, whatever the coordinates cost beside it.
    is_within_tolerance = not position.count or position.shares[0] <= 1
    if error <= tolerances.VISIBLE or not is_within_tolerance or cost <= allowed / 2:
        return None
    return FarFromOrigin(error, bool(position.count), math.hypot(*pinhole.eye))


def _cost(pinhole: Pinhole, seen: Seen) -> Array:
    """(n,) pixels: the part of tolerances.ray_shift that an origin at the eye would take away."""
    position = seen["Position"].astype(np.float64)
    relative = position - pinhole.eye
    excess = np.maximum(np.abs(position).max(axis=-1), np.abs(pinhole.eye).max()) - np.abs(relative).max(axis=-1)
    depth = np.maximum(seen["Depth"][..., 0].astype(np.float64), np.finfo(float).tiny)
    slant = np.linalg.norm(relative, axis=-1) / depth
    return tolerances.FLOAT32 * max(pinhole.distance) * np.maximum(excess, 0.0) / depth * slant
