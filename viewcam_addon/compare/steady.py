"""Light without noise: exact pictures, which may differ by what float32 rounds, and by what lies on the other side of an edge.

A pixel on the edge of a shadow or a silhouette is one or the other, and the smallest shift of a ray decides. Such pixels are
rare: an edge lies within δ of the centre of a pixel beside it with the probability δ. So as many of them may differ as a shift
by the law's 99th percentile would turn. What they show instead is not asked: it need not be what is beside them, for a ray
that slips through a silhouette meets the dark back of what it should have met. Rarer still are rays that slip through a closed
surface, so that a pixel amid a shadow is lit.

Rejected: accepting every pixel that shows what a neighbour shows; a picture shifted by a tenth of a pixel would pass.
"""

from dataclasses import asdict, dataclass

import numpy as np

from ..image import Image
from ..pinhole import Pinhole
from . import law
from .law import Array
from .mismatches import contrast, largest_around
from .noise import poisson_allowance
from .sides import Sides
from .statistics import Row, measure

# Pixels on edges are independent events; their number exceeds what is allowed once in a thousand pictures, and so do leaks,
# of which 120 pictures by Cycles of 57,600 pixels, each with one lamp, had one.
_RARELY = 1e-3
_LEAKS = 1e-6
# An edge between a pixel and each of its neighbours to the left, right, top and bottom.
_SIDES_OF_A_PIXEL = 4
# Errors are told relative to the value, or to this share of the mean where the value is less.
_DARK = 1e-3


@dataclass(frozen=True)
class Edges:
    """Pixels that differ by more than rounding: at edges, and how many may; elsewhere, and how many may."""

    count: int
    allowed: int
    leaks: int
    allowed_leaks: int

    @property
    def ok(self) -> bool:
        return self.count <= self.allowed and self.leaks <= self.allowed_leaks

    def to_json(self) -> dict:
        return {**asdict(self), "ok": self.ok}


class Rounding:
    """What one rounding of float32 causes in the light of a picture.

    shift : (height, width) pixels, law.ray_shift from the reference's depths; where nothing was hit the median.
    """

    def __init__(self, pinhole: Pinhole, reference: Image, samples: int) -> None:
        self.shift = _ray_shift(pinhole, reference)
        self._samples = samples
        self._belongs = np.zeros(self.shift.shape)
        if "Object Index" in reference.passes:
            self._belongs = reference["Object Index"][..., 0]
        # What the light on a surface would be if it came from straight above, as far as the picture tells: the largest
        # Diffuse Direct anywhere, in the surface's colour.
        self._brightest = 0.0
        if "Diffuse Direct" in reference.passes and "Diffuse Color" in reference.passes:
            self._brightest = np.nan_to_num(reference["Diffuse Direct"]).max() * reference["Diffuse Color"].max(axis=-1)

    def of(self, sides: Sides) -> Array:
        """(height, width) the error of a quantity, the largest of its channels."""
        slope = law.slopes(sides.reference, self._belongs)
        value = np.abs(sides.reference).max(axis=-1)
        return law.radiance_error(self.shift, slope, value, self._brightest, self._samples)


def compare(sides: Sides, one: Array, shift: Array) -> tuple[Row, Edges, Array]:
    """The figures of all pixels, those on edges, and the error of each pixel in roundings.

    one : (height, width) `Rounding.of` these sides. shift : that of the same.

    Returns the row, relative errors; the edges; (height, width) float64.
    """
    error = np.abs(sides.difference).max(axis=-1)
    most = law.ROUNDINGS[-1] * one
    apart, on_edge = error > most, contrast(sides.reference).max(axis=-1) > largest_around(most)
    turned = np.minimum(_SIDES_OF_A_PIXEL * law.ROUNDINGS[law.PERCENTILES.index(99.0)] * shift, 1.0)[on_edge].sum()
    edges = Edges(
        int((apart & on_edge).sum()),
        poisson_allowance(float(turned), _RARELY),
        int((apart & ~on_edge).sum()),
        poisson_allowance(_LEAKS * apart.size, _RARELY),
    )
    judged = ~sides.broken & ~(apart & edges.ok)
    size = np.abs(sides.reference).max(axis=-1)
    scale = np.maximum(size, max(_DARK * float(size.mean()), np.finfo(float).tiny))
    row = measure(sides.name, "relative", (error / scale)[judged], (one / scale)[judged])
    return row, edges, error / np.maximum(one, np.finfo(float).tiny)


def _ray_shift(pinhole: Pinhole, reference: Image) -> Array:
    depth = reference["Depth"].reshape(-1, 1)
    row, column = np.divmod(np.arange(len(depth)), pinhole.width)
    rays = pinhole.ray_directions(column, row)
    hit = depth[:, 0] < law.BACKGROUND_DEPTH
    along = -(rays @ pinhole.basis()[2])
    seen = {"Depth": depth, "Position": np.asarray(pinhole.eye) + rays * (depth[:, 0] / along)[:, None]}
    seen |= {"Magnitude": reference["Magnitude"].reshape(-1, 1)} if "Magnitude" in reference.passes else {}
    shift = law.ray_shift(pinhole, seen)
    typical = np.median(shift[hit]) if hit.any() else law.FLOAT32 * max(pinhole.distance)
    return np.where(hit, shift, typical).reshape(pinhole.height, pinhole.width)
