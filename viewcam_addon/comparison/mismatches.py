"""Pixels where the two pictures see another surface, and whether the tolerance explains it.

On a silhouette, or on a crease between two faces, the smallest shift of a ray decides what it sees. Whether such a shift is
within tolerance is proved by re-tracing: rays are sent around the pixel's center on rings that grow up to the tolerance, and
the pixel is explained by the first ring on which some ray sees what the test picture shows, in every pass.

One thing no exact ray sees: the back of a silhouette. Where a renderer's ray slips through the edge of the front face it
meets the face behind, at the same place but with another normal and UV. So on a silhouette (the ring sees something else,
too, or grazes the surface) the same object at the same depth is enough. That a steep surface is elsewhere on the ring is none.

Where several surfaces lie in one place, which of them a ray meets is rounding's choice, and any is a right answer: its own
object, material, normal and UV, all of the same one. In one place are those as far behind the nearest one as a ray may be off,
here and there, times the slope of the depth: the lesser one of the two, since where they cross at an angle the rings find it.

Rejected: accepting a pixel when a neighbor shows the test's object. Next to an edge that is so for any error below a pixel.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..pinhole import Pinhole
from . import tolerances
from .renderers import CYCLES, Renderer
from .tolerances import Array, Seen

# surfaces_at(columns, rows, px, py) -> what rays through n sub-pixel positions may see: (m,) which of them each surface is of,
# ascending, its nearest surface first; (m,) the objects' names; and dict of pass name to (m, channels) float32, perhaps with
# "UV Slope", "Normal Slope" and "Normal Enlargement". A ray that meets nothing has one entry, too. As Tracer.surfaces_at.
SurfacesAt = Callable[[NDArray, NDArray, Array | float, Array | float], tuple[NDArray, NDArray, Seen]]

# The error of n pixels, what one rounding causes, and what storage and the filter's bias cause, which may be one number.
Errors = tuple[Array, Array, Array | float]

KINDS = ("not a number", "coverage", "object index", "material index", "surface")

# One pixel in a million may stay unexplained (what was measured on 11.5 million), and none in smaller pictures.
PIXELS_PER_UNEXPLAINED = 1_000_000

# The rings, in roundings (tolerances.ROUNDINGS): the smallest that explains tells how far the ray was off.
_RINGS = (0.25, 0.5, 1.0, 2.0, 3.4, 6.0, tolerances.ROUNDINGS[-1])
_DIRECTIONS = 16
# A ray that sees a cosine below this is at the rim of what it grazes: √(2 a / r) for a ball of r = 100 pixels, a = 0.05
# pixels from its silhouette.
_RIM = 0.03
_BATCH = 1_000
# Pixels whose centers are traced again at a time.
_CENTERS = 50_000


@dataclass(frozen=True, eq=False)
class Mismatches:
    """The pixels that see another surface in the test picture than in the reference.

    columns, rows : (n,) int, rows from the bottom.
    kinds : (n,) int, index in KINDS.
    shifts : (n,) float64, pixels: the smallest shift that explains each; nan where none within tolerance does.
    reach : (n,) float64, pixels: the tolerance up to which shifts were tried.
    retraced : the number of pixels that were re-traced; 0 without a scene to trace.
    """

    columns: NDArray[np.intp]
    rows: NDArray[np.intp]
    kinds: NDArray[np.intp]
    shifts: Array
    reach: Array
    retraced: int

    @property
    def explained(self) -> NDArray[np.bool_]:
        return np.isfinite(self.shifts)

    @property
    def unexplained_count(self) -> int:
        return int((~self.explained).sum())

    def counts(self) -> dict[str, tuple[int, int]]:
        """Each kind → (number, number of them that are explained)."""
        return {
            kind: (int((self.kinds == i).sum()), int((self.explained & (self.kinds == i)).sum()))
            for i, kind in enumerate(KINDS)
        }

    def to_json(self) -> dict:
        """Counts for each kind, and the first hundred unexplained pixels."""
        counts = {kind: {"count": count, "explained": explained} for kind, (count, explained) in self.counts().items()}
        first = np.flatnonzero(~self.explained)[:100]
        unexplained = [
            {
                "column": int(self.columns[i]),
                "row": int(self.rows[i]),
                "kind": KINDS[self.kinds[i]],
                "tried_up_to_px": float(self.reach[i]),
            }
            for i in first
        ]
        largest = float(np.max(self.shifts[self.explained], initial=0.0))
        return {"kinds": counts, "retraced": self.retraced, "largest_shift_px": largest, "unexplained": unexplained}


@dataclass(frozen=True, eq=False)
class SurfaceAgreement:
    """Judges whether the test picture shows the surface that a ray sees, within the tolerance of the last percentile.

    across : (n,) pixels, how far each of the test's positions, projected, lies from the center of its pixel.
    slopes : pass name to (n,), how much Normal and UV change per pixel there (tolerances.slopes).
    renderer : the test's.
    enlargement : (n,) or a number, times the error of stored corner normals, that of the normal between them.
    """

    pinhole: Pinhole
    across: Array
    slopes: dict[str, Array]
    renderer: Renderer = CYCLES
    enlargement: Array | float = 1.0

    def at(self, chosen: NDArray) -> "SurfaceAgreement":
        """The agreement at some of the pixels, by their indices."""
        slopes = {name: slope[chosen] for name, slope in self.slopes.items()}
        enlargement = np.broadcast_to(self.enlargement, self.across.shape)[chosen]
        return replace(self, across=self.across[chosen], slopes=slopes, enlargement=enlargement)

    def slope(self, expected: Seen, name: str) -> Array:
        """The slope of a pass: the surface's own, where it is known."""
        own = expected.get(f"{name} Slope")
        return self.slopes[name] if own is None else own[..., 0]

    def errors(self, expected: Seen, seen: Seen) -> dict[str, Errors]:
        """The errors of each pass that both sides have; tolerances are taken at `expected`. Meaningless where either side
        missed."""
        there = [(name, each.errors) for name, each in PASSES.items() if name in expected and name in seen]
        return {name: errors(self, expected, seen) for name, errors in there if errors}

    def same_surface(self, expected: Seen, seen: Seen) -> NDArray[np.bool_]:
        """(n,) bool: equal indices, and every pass within tolerance; or a miss on both sides."""
        same = self.same_place(expected, seen)
        for name, figures in self.errors(expected, seen).items():
            if name != "Depth":
                same &= _within(*figures)
        return same | ~(tolerances.is_hit(expected) | tolerances.is_hit(seen))

    def roundings(self, expected: Seen, seen: Seen) -> Array:
        """(n,) how many roundings set normal and UV apart, the larger of the two. Meaningless as of `errors`."""
        errors = self.errors(expected, seen)
        apart = [
            (error - floor) / np.maximum(one_rounding, np.finfo(float).tiny)
            for error, one_rounding, floor in (errors[name] for name in self.slopes if name in errors)
        ]
        return np.max(apart, axis=0, initial=0.0) if apart else np.zeros(len(self.across))

    def same_place(self, expected: Seen, seen: Seen, aside: Array | float = 0.0) -> NDArray[np.bool_]:
        """(n,) bool: a hit on both sides, with equal indices and the same depth within tolerance.

        aside : (n,) pixels by which the rays are beside each other in any case.
        """
        same = tolerances.is_hit(expected) & tolerances.is_hit(seen)
        for name in ("Object Index", "Material Index"):
            if name in expected and name in seen:
                same &= expected[name][..., 0] == seen[name][..., 0]
        error, one_rounding, floor = self.errors(expected, seen)["Depth"]
        return same & _within(error, one_rounding, floor + aside * tolerances.depth_slope(self.pinhole, expected))


def _position_errors(agreement: SurfaceAgreement, expected: Seen, _seen: Seen) -> Errors:
    return agreement.across, tolerances.position_shift(agreement.pinhole, expected), agreement.renderer.center


def _depth_errors(agreement: SurfaceAgreement, expected: Seen, seen: Seen) -> Errors:
    depth, renderer = expected["Depth"][..., 0].astype(np.float64), agreement.renderer
    floor = renderer.depth_storage(depth) + renderer.center * tolerances.depth_slope(agreement.pinhole, expected)
    return np.abs(seen["Depth"][..., 0] - depth) / depth, tolerances.depth_error(agreement.pinhole, expected), floor


def _normal_errors(agreement: SurfaceAgreement, expected: Seen, seen: Seen) -> Errors:
    slope, renderer = agreement.slope(expected, "Normal"), agreement.renderer
    one_rounding = tolerances.normal_error(agreement.pinhole, expected, slope)
    enlargement = expected["Normal Enlargement"][..., 0] if "Normal Enlargement" in expected else agreement.enlargement
    floor = renderer.normal * enlargement + renderer.center * slope
    return tolerances.angle_between(expected["Normal"], seen["Normal"]), one_rounding, floor


def _uv_errors(agreement: SurfaceAgreement, expected: Seen, seen: Seen) -> Errors:
    slope = agreement.slope(expected, "UV")
    apart = np.abs(expected["UV"][..., :2].astype(np.float64) - seen["UV"][..., :2]).max(axis=-1)
    floor = tolerances.uv_storage(expected) + agreement.renderer.center * slope
    return apart, tolerances.uv_error(agreement.pinhole, expected, slope), floor


@dataclass(frozen=True)
class ComparedPass:
    """A pass by which surfaces are told apart.

    channels : the number of channels that count, from the first on.
    unit : the unit of its figures.
    errors : the errors, see `SurfaceAgreement`; without them the passes must be equal.
    has_slope : true if its slope counts.
    """

    channels: int
    unit: str = ""
    errors: Callable[[SurfaceAgreement, Seen, Seen], Errors] | None = None
    has_slope: bool = False


PASSES = {
    "Position": ComparedPass(3, "px", _position_errors),
    "Depth": ComparedPass(1, "relative", _depth_errors),
    "Normal": ComparedPass(3, "°", _normal_errors, has_slope=True),
    "UV": ComparedPass(2, "absolute", _uv_errors, has_slope=True),  # the third channel is constant
    "Object Index": ComparedPass(1),
    "Material Index": ComparedPass(1),
}


def kinds_of(expected: Seen, seen: Seen, agreement: SurfaceAgreement) -> NDArray[np.intp]:
    """(n,) int: for each pixel the index in KINDS of what sets the two sides apart, −1 where nothing does."""
    kinds = np.where(agreement.same_surface(expected, seen), -1, KINDS.index("surface"))
    for name, kind in (("Material Index", "material index"), ("Object Index", "object index")):
        if name in expected and name in seen:
            kinds[expected[name][..., 0] != seen[name][..., 0]] = KINDS.index(kind)
    kinds[tolerances.is_hit(expected) != tolerances.is_hit(seen)] = KINDS.index("coverage")
    for values in seen.values():
        kinds[~np.isfinite(values).all(axis=-1)] = KINDS.index("not a number")
    return kinds


def reach_of(shift: Array) -> Array:
    """(height, width) pixels: how far a ray may be off, from tolerances.ray_shift of the reference (nan where nothing was hit).

    At an edge the ray may belong to either surface, so the largest of the 3 × 3 neighborhood counts; never the test's figures,
    which may be the fault that is looked for. Where nothing was hit around, the picture's median.
    """
    around = largest_around(np.nan_to_num(shift, nan=0.0))
    hits = shift[np.isfinite(shift)]
    around[around == 0.0] = np.median(hits) if hits.size else 0.0
    return tolerances.ROUNDINGS[-1] * around


def largest_around(values: Array) -> Array:
    """(height, width): the largest value of each pixel's 3 × 3 neighborhood."""
    height, width = values.shape
    padded = np.pad(values, 1, mode="edge")
    across = np.maximum(np.maximum(padded[:, :width], padded[:, 1 : width + 1]), padded[:, 2:])
    return np.maximum(np.maximum(across[:height], across[1 : height + 1]), across[2:])


def contrast(values: Array) -> Array:
    """(height, width, channels): the largest difference within each pixel's 3 × 3 neighborhood."""
    channels = np.moveaxis(values, -1, 0)
    return np.stack([largest_around(channel) + largest_around(-channel) for channel in channels], axis=-1)


@dataclass(frozen=True, eq=False)
class InOnePlace:
    """The pixels where several surfaces lie in one place, and the test picture shows another of them than the reference.

    columns, rows : (n,) int, rows from the bottom.
    objects : (n, 2), the names of those that the reference and the test show, which may be the same.
    """

    columns: NDArray[np.intp]
    rows: NDArray[np.intp]
    objects: NDArray[np.object_]

    def pairs(self) -> dict[tuple[str, str], int]:
        """Names in order of the alphabet → how many pixels, the most first."""
        return dict(Counter(tuple(sorted(pair)) for pair in self.objects.tolist()).most_common())

    def to_json(self) -> dict:
        pairs = [{"objects": list(pair), "pixels": count} for pair, count in self.pairs().items()]
        return {"pixels": len(self.columns), "pairs": pairs}


NOWHERE = InOnePlace(np.empty(0, np.intp), np.empty(0, np.intp), np.empty((0, 2), object))


def settle(
    kinds: NDArray, expected: Seen, seen: Seen, agreement: SurfaceAgreement, borders: NDArray[np.bool_], surfaces_at: SurfacesAt
) -> tuple[NDArray, Seen, SurfaceAgreement, InOnePlace]:
    """Settle pixels that differ by what the scene tells at their centers: how steep the surface itself is, and what else is in
    its place. So it is asked, too, where normal or UV is off by more than half of all pixels may be.

    kinds : the kinds of all pixels, see `kinds_of`.
    borders : true for pixels of whose slopes the picture does not tell all.

    Returns the kinds and the reference's passes, in which pixels that show another surface in the same place show that; the
    agreement with their slopes; and which pixels these are.
    """
    width, differs = agreement.pinhole.width, (kinds >= 0) & (kinds != KINDS.index("not a number"))
    doubtful = agreement.roundings(expected, seen) > tolerances.ROUNDINGS[0]
    asked = np.flatnonzero((borders | differs | doubtful) & tolerances.is_hit(expected))
    kinds, expected = kinds.copy(), {name: values.copy() for name, values in expected.items()}
    slopes, enlargement = {name: slope.copy() for name, slope in agreement.slopes.items()}, np.ones(len(kinds))
    agreement = replace(agreement, slopes=slopes, enlargement=enlargement)
    pixels, objects = [NOWHERE.columns], [NOWHERE.objects]
    for start in range(0, len(asked), _CENTERS):
        batch = asked[start : start + _CENTERS]
        rays, names, traced = surfaces_at(batch % width, batch // width, *np.full((2, len(batch)), 0.5))
        nearest, pixel = np.searchsorted(rays, np.arange(len(batch))), batch[rays]
        here = agreement.at(pixel)
        rendered = at(seen, pixel)
        agrees = here.same_surface(traced, rendered) & in_one_place(agreement, rays, traced) & (differs | doubtful)[pixel]
        right = np.flatnonzero(agrees)
        steps = np.ceil(here.roundings(traced, rendered)[right] / tolerances.ROUNDINGS[0])  # as good as half of all pixels: one
        right = right[np.lexsort((right, steps, rays[right]))]
        right = right[np.unique(rays[right], return_index=True)[1]]  # the nearest of those that agree best
        kinds[pixel[right]] = -1
        other = right[right != nearest[rays[right]]]
        for name, values in expected.items():
            values[pixel[other]] = traced[name][other, : values.shape[1]]
        if "Normal Enlargement" in traced:
            enlargement[batch] = traced["Normal Enlargement"][nearest, 0]
        for name, slope in slopes.items():
            own = here.slope(traced, name)
            slope[batch] = np.maximum(slope[batch], own[nearest])
            slope[pixel[other]] = own[other]
        pixels.append(pixel[other])
        objects.append(np.stack([names[nearest[rays[other]]], names[other]], axis=1))
        if (kinds[batch] >= 0).sum() > len(batch) / 2:
            break  # as in `explain`
    others = np.concatenate(pixels)
    return kinds, expected, agreement, InOnePlace(others % width, others // width, np.concatenate(objects))


def in_one_place(agreement: SurfaceAgreement, rays: NDArray, traced: Seen) -> NDArray[np.bool_]:
    """(m,) bool: which of the surfaces of some rays are where the nearest one of their ray is, within tolerance.

    agreement : gives camera and renderer.
    rays, traced : see SurfacesAt.
    """
    nearest = np.searchsorted(rays, rays)
    depth, renderer = traced["Depth"][:, 0].astype(np.float64), agreement.renderer
    shift = tolerances.ROUNDINGS[-1] * tolerances.ray_shift(agreement.pinhole, traced) + renderer.center
    slope, storage = tolerances.depth_slope(agreement.pinhole, traced), renderer.depth_storage(depth) + np.zeros(len(depth))
    allowed = (shift + shift[nearest]) * np.minimum(slope, slope[nearest]) + storage + storage[nearest]
    return ~(depth - depth[nearest] > allowed * depth[nearest])


def explain(
    columns: NDArray, rows: NDArray, seen: Seen, reach: Array, agreement: SurfaceAgreement, surfaces_at: SurfacesAt
) -> tuple[Array, int]:
    """The smallest shift of the ray that explains what the test picture shows.

    columns, rows : (n,) the pixels.
    seen : the test's passes there.
    reach : (n,) pixels.
    agreement : the agreement of these pixels.

    Returns (n,) pixels, nan where no shift within reach explains it, and the number of pixels that were re-traced: all, unless
    most of a batch stays unexplained. Such a picture has failed, and tracing the rest of it would only take time.
    """
    shifts = np.full(len(columns), np.nan)
    for start in range(0, len(columns), _BATCH):
        batch = np.arange(start, min(start + _BATCH, len(columns)))
        pending = batch
        for ring in _RINGS:
            radius = reach[pending] * (ring / _RINGS[-1])
            explained = _explained_by(
                columns[pending], rows[pending], at(seen, pending), radius, agreement.at(pending), surfaces_at
            )
            shifts[pending[explained]] = radius[explained]
            pending = pending[~explained]
            if not len(pending):
                break
        if len(pending) > len(batch) / 2:
            return shifts, start + len(batch)
    return shifts, len(columns)


def _explained_by(
    columns: NDArray, rows: NDArray, seen: Seen, radius: Array, agreement: SurfaceAgreement, surfaces_at: SurfacesAt
) -> NDArray[np.bool_]:
    """(n,) bool: whether some ray on the ring of this radius sees the same."""
    angles = (np.arange(_DIRECTIONS) + 0.5) * (2.0 * np.pi / _DIRECTIONS)
    each = np.repeat(np.arange(len(columns)), _DIRECTIONS)
    px = 0.5 + np.outer(radius, np.cos(angles)).ravel()
    py = 0.5 + np.outer(radius, np.sin(angles)).ravel()
    rays, _, traced = surfaces_at(columns[each], rows[each], px, py)
    rendered, here = at(seen, each[rays]), agreement.at(each[rays])
    counts = in_one_place(agreement, rays, traced)
    nearest = np.searchsorted(rays, np.arange(len(each)))
    grazed = (tolerances.facing(agreement.pinhole, traced) < _RIM)[nearest].reshape(-1, _DIRECTIONS)
    # To the other side of a ring it is twice its radius, and the surface may bend on the way.
    aside = 3.0 * radius[each[rays]]
    same_surface, same_place, continues = (
        np.logical_or.reduceat(same & counts, nearest).reshape(-1, _DIRECTIONS)
        for same in (
            here.same_surface(traced, rendered),
            here.same_place(traced, rendered),
            here.same_place(traced, rendered, aside),
        )
    )
    on_silhouette = grazed.any(axis=1) | ~continues.all(axis=1)
    return same_surface.any(axis=1) | (same_place.any(axis=1) & on_silhouette)


def _within(error: Array, one_rounding: Array, floor: Array | float) -> NDArray[np.bool_]:
    return error <= tolerances.ROUNDINGS[-1] * one_rounding + floor


def at(seen: Seen, chosen: NDArray) -> Seen:
    """The passes at some of the pixels, by their indices."""
    return {name: values[chosen] for name, values in seen.items()}
