"""Light without noise: exact pictures, which may differ by what float32 rounds, and by what lies on the other side of an edge.

A pixel on the edge of a shadow or a silhouette is one or the other, and the smallest shift of a ray decides. Such pixels are
rare: an edge lies within δ of the center of a pixel beside it with the probability δ. So as many of them may differ as a shift
by the 99th percentile's tolerance would turn. What they show instead is not asked: it need not be what is beside them, for a
ray that slips through a silhouette meets the dark back of what it should have met. Rarer still are rays that slip through a
closed surface, so that a pixel amid a shadow is lit.

Rejected: accepting every pixel that shows what a neighbor shows; a picture shifted by a tenth of a pixel would pass.
"""

import re
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from ..image import BACKGROUND_DEPTH, Image
from ..pinhole import Pinhole
from . import tolerances
from .coincident import Rest
from .mismatches import contrast, largest_around
from .noise import poisson_allowance
from .sides import Sides
from .statistics import PassErrors, measure
from .tolerances import Array

# Pixels on edges are independent events; their number exceeds what is allowed once in a thousand pictures, and so do leaks,
# of which 64 pictures by Cycles of 57,600 pixels, each with one lamp, had one.
_RARELY = 1e-3
_LEAKS = 1e-6
# An edge between a pixel and each of its neighbors to the left, right, top and bottom.
_SIDES_OF_A_PIXEL = 4
# Roundings of what can't be rounded at all, such as black: beyond any limit, and a number still.
_BEYOND_COUNTING = 1e6
# The first Blender that stores smooth normals in 16 bits, and the quantities that show it.
_SHORT_NORMALS = (5, 2)
_SHADED = ("Combined", "Diffuse Direct")
_NOT_SCATTERED = ("Alpha", "Emission", "Environment")
# The passes of a quantity that is no pass alone.
_MADE_OF = {"Alpha": ("Combined",)} | {name: (name, "Diffuse Color") for name in ("Diffuse Direct", "Diffuse Indirect")}
_UNLIT = (*_NOT_SCATTERED, "Diffuse Color", "Glossy Color", "Transmission Color")
# Light of this share of the picture's brightest is nothing, whatever noise there is: 48 stops darker, where float32 rounds away
# what float32 rounds away of the brightest. A renderer's powers of small numbers end there, or go on to 10⁻³⁸.
_NOTHING = 2.0**-48
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


@dataclass(frozen=True, eq=False)
class Allowance:
    """The allowance for rounding in one quantity, each (height, width), the largest of its channels.

    moved : the error by the shift of the picture, for one rounding.
    value : the error by one rounding of the quantity's own figures.
    floor : the error by storage.
    shift : the shift of the picture for one rounding, pixels.
    """

    moved: Array
    value: Array
    floor: Array
    shift: Array

    @property
    def one_rounding(self) -> Array:
        """The change that one rounding of everything causes."""
        return self.moved + self.value

    @property
    def most(self) -> Array:
        """The bound that no pixel may go beyond."""
        return tolerances.ROUNDINGS[-1] * self.one_rounding + self.floor


class Rounding:
    """The rounding of the light of a picture.

    test : one of the test pictures, which tells its Blender.
    samples : the most samples of any picture.
    belongs : (height, width), the object of each pixel, 0 for none or where nobody knows.
    rest : the rest that is compared where light comes by surfaces in one place, else None.
    """

    def __init__(self, pinhole: Pinhole, reference: Image, test: Image, samples: int, rest: Rest | None = None) -> None:
        self._rest = rest
        self._shift = _ray_shift(pinhole, reference)
        self._samples = samples
        self.belongs: NDArray = np.zeros(self._shift.shape)
        if "Object Index" in reference.passes:
            self.belongs = reference["Object Index"][..., 0]
        # The light on a surface if it came from straight above, as far as the picture tells: the largest Diffuse Direct
        # anywhere, in the surface's color.
        self._brightest: Array | float = 0.0
        self._tables = tolerances.ALBEDO_TABLES if "albedo tables" in reference.attributes else 0.0
        self._triangles = tolerances.SHINING_TRIANGLES if "shining surfaces" in reference.attributes else 0.0
        self._halves = test.halves
        self._storage = tolerances.NORMAL_STORAGE if _blender_of(test) >= _SHORT_NORMALS else 0.0
        if "Diffuse Direct" in reference.passes and "Diffuse Color" in reference.passes:
            lit = float(np.nan_to_num(reference["Diffuse Direct"]).max())
            self._brightest = lit * reference["Diffuse Color"].max(axis=-1).astype(np.float64)

    def of(self, sides: Sides) -> Allowance:
        channels = np.split(sides.reference, sides.reference.shape[2], axis=2)
        slope = np.max([tolerances.slopes(channel, self.belongs) for channel in channels], axis=0)
        value = np.abs(sides.reference).max(axis=-1)
        error = tolerances.radiance_error(value, self._brightest, self._samples)
        floor = self._floor(sides.name, value) + _NOTHING * value.max(initial=0.0, where=np.isfinite(value))
        if self._rest is not None:
            floor = floor + self._rest.tolerance(sides)
        return Allowance(self._shift * slope, error, floor, self._shift)

    def _floor(self, name: str, value: Array) -> Array:
        """The amount that albedos from tables and triangles that shine may add, half floats, and the storage of smooth normals:
        the light from straight above times the cosine's change."""
        share = 0.0 if name in _NOT_SCATTERED else self._tables
        if name not in _UNLIT:
            share += self._triangles
        halves = tolerances.HALF * len({*_MADE_OF.get(name, (name,))} & self._halves)
        floor = share * value + halves * np.maximum(value, tolerances.LEAST_HALF)
        if not self._storage or name not in _SHADED:
            return floor
        return floor + self._storage * np.sqrt(np.maximum(self._brightest**2 - value**2, 0.0))


def compare(sides: Sides, allowed: Allowance, belongs: NDArray) -> tuple[PassErrors, Edges, Array]:
    """The figures of all pixels, those on edges, and the error of each pixel in roundings.

    allowed : the allowance for rounding on these sides.
    belongs : the object of each pixel.

    Returns the row, relative errors; the edges; (height, width) float64.
    """
    error = np.abs(sides.difference).max(axis=-1)
    apart, on_edge = error > allowed.most, _on_edge(sides.reference, belongs, allowed.most)
    turned = np.minimum(_SIDES_OF_A_PIXEL * tolerances.ROUNDINGS[tolerances.PERCENTILES.index(99.0)] * allowed.shift, 1.0)[
        on_edge
    ].sum()
    edges = Edges(
        int((apart & on_edge).sum()),
        poisson_allowance(float(turned), _RARELY),
        int((apart & ~on_edge).sum()),
        poisson_allowance(_LEAKS * apart.size, _RARELY),
    )
    judged = ~sides.broken & ~(apart & edges.ok)
    size = np.abs(sides.reference).max(axis=-1)
    scale = np.maximum(size, max(_DARK * float(size.mean()), float(np.finfo(float).tiny)))
    row = measure(
        sides.name, "relative", (error / scale)[judged], (allowed.one_rounding / scale)[judged], (allowed.floor / scale)[judged]
    )
    return row, edges, np.minimum(error / np.maximum(allowed.one_rounding, np.finfo(float).tiny), _BEYOND_COUNTING)


def _on_edge(values: Array, belongs: NDArray, most: Array) -> NDArray[np.bool_]:
    """(height, width): pixels beside a silhouette, or beside a step of the light rather than on a slope of it.

    A step bends the light by its own height from one pixel to the next, a slope by little of what it changes over three pixels.
    """
    change = contrast(values).max(axis=-1)
    bend = np.zeros(values.shape)
    for axis in (0, 1):
        if values.shape[axis] > 2:
            inner = tuple(slice(1, -1) if i == axis else slice(None) for i in range(3))
            bend[inner] = np.maximum(bend[inner], np.abs(np.diff(values, 2, axis=axis)))
    is_step = largest_around(bend.max(axis=-1)) > change / 4
    return (change > largest_around(most)) & (is_step | (contrast(belongs[..., None])[..., 0] > 0))


def _blender_of(image: Image) -> tuple[int, ...]:
    """The version of Blender that wrote a picture, as its file tells from 5.0 on."""
    version = re.match(r"Blender (\d+)\.(\d+)", image.attributes.get("Software", ""))
    return tuple(map(int, version.groups())) if version else ()


def _ray_shift(pinhole: Pinhole, reference: Image) -> Array:
    depth = reference["Depth"].reshape(-1, 1)
    row, column = np.divmod(np.arange(len(depth)), pinhole.width)
    rays = pinhole.ray_directions(column, row)
    hit = depth[:, 0] < BACKGROUND_DEPTH
    along = -(rays @ pinhole.basis()[2])
    seen = {"Depth": depth, "Position": np.asarray(pinhole.eye) + rays * (depth[:, 0] / along)[:, None]}
    seen |= {"Magnitude": reference["Magnitude"].reshape(-1, 1)} if "Magnitude" in reference.passes else {}
    shift = tolerances.ray_shift(pinhole, seen)
    typical = np.median(shift[hit]) if hit.any() else tolerances.FLOAT32 * max(pinhole.distance)
    return np.where(hit, shift, typical).reshape(pinhole.height, pinhole.width)
