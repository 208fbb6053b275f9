"""Compares the geometry passes of two pictures of the same camera.

The reference is the tracer's, the test usually Cycles'. Position is judged in pixels: the test's positions are projected
through the ideal camera, and must land on the centers of their pixels. That alone would not notice an object that is moved,
so depth, normal and UV are compared with the reference's, and indices and coverage must be the same. Combined is left alone
at this level.
"""

import itertools
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, listed
from ..image import BACKGROUND_DEPTH, Image
from ..pinhole import Pinhole
from . import tolerances
from .cameras import Systematic, conversion_error, systematic_error
from .mismatches import (
    KINDS,
    NOWHERE,
    PASSES,
    Errors,
    Mismatches,
    SurfaceAgreement,
    SurfacesAt,
    at,
    explain,
    kinds_of,
    largest_around,
    reach_of,
    settle,
)
from .renderers import CYCLES, Renderer, completed
from .statistics import PassErrors, compressed_with_loss, looks_turned, measure, plain
from .tolerances import Array, Seen, in_float32
from .verdict import GeometryComparison, allowed_unexplained, far_from_origin

# The passes that both pictures must have.
_NEEDED = ("Depth", "Position", "Object Index")
# Pixels whose centers are traced again, to see whether the reference shows the scene.
_ASKED_OF_THE_REFERENCE = 1000
# Pixels whose depths are read as distances from the eye, and the other way round.
_READ_ANEW = 1000
# The share of a picture's error that reading it otherwise leaves, at most, where it is to be read so.
_OF_THE_ERROR = 0.1
# That share where the unit is another: depths that hardly vary are near a multiple of any others.
_OF_A_UNIT = 1e-3
# The share of pixels that another reading must explain: others may lie at edges, where another object may be seen. Chosen.
_OF_ALL_PIXELS = 0.95
# Passes that only the reference has: what tolerances are evaluated with.
_FOR_TOLERANCES = ("Magnitude", "Facing")


@np.errstate(all="ignore")
def compare(
    reference: Image,
    test: Image,
    pinhole: Pinhole,
    surfaces_at: SurfacesAt | None = None,
    stated: Pinhole | None = None,
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0),
    renderer: Renderer = CYCLES,
    partial: bool = False,
) -> GeometryComparison:
    """Compare two pictures of one camera.

    pinhole : the camera that traced the reference.
    surfaces_at : re-traces sub-pixel positions of the reference's scene; without it no mismatch can be explained.
    stated : the camera as the four values state it; with it the conversion's error is measured too.
    origin : the point of the world from which both pictures count.
    renderer : the renderer that made the test picture.
    partial : true to let the test lack passes, all but one of Depth, Distance and Position; they are not judged then.

    Whatever float32 can hold may stand in the pictures: what can't be computed with is not within tolerance.

    Raises InputError if the sizes differ, a pass is missing, or the reference is not what `surfaces_at` sees.
    """
    measured = set(test.passes) | ({"Depth"} if "Distance" in test.passes else set())
    expected, seen = _passes(reference, test, pinhole, partial)
    _check_figures(reference.source, expected, pinhole)
    size = (pinhole.height, pinhole.width)
    hit = tolerances.is_hit(expected)
    shift = np.where(hit, tolerances.ray_shift(pinhole, expected), np.nan)
    off_x, off_y, along = _displacement(pinhole, seen)
    across = np.hypot(off_x, off_y) if "Position" in measured else np.zeros(len(off_x))
    agreement = SurfaceAgreement(pinhole, across, _slopes(expected, hit, size), renderer)

    kinds, in_one_place = kinds_of(expected, seen, agreement), NOWHERE
    if surfaces_at is not None:
        _check_reference(reference.source, expected, np.flatnonzero(kinds >= 0), agreement, surfaces_at)
        borders = tolerances.at_borders(np.where(hit, expected["Object Index"][:, 0], -1).reshape(size)).ravel()
        kinds, expected, agreement, in_one_place = settle(kinds, expected, seen, agreement, borders, surfaces_at)
    # At an edge the ray may meet either surface, so a re-traced one is judged by the steepest slope around.
    steepest = {name: largest_around(slope.reshape(size)).ravel() for name, slope in agreement.slopes.items()}
    # Where an edge has moved, a pixel shows the surface's plane beyond it: as far as edges move, and its slope's worth.
    beyond = replace(renderer, center=renderer.center + renderer.edges)
    around = replace(agreement, slopes=steepest, renderer=beyond)
    reach = reach_of(shift.reshape(size)).ravel() + renderer.edges
    mismatches = _mismatches(kinds, seen, reach, around, surfaces_at)

    chosen = np.flatnonzero(_compared(hit, kinds, mismatches, pinhole))
    errors, systematic = _errors(chosen, expected, seen, agreement, (off_x, off_y, along), measured)
    rows, maps = _measure(errors, chosen, size)

    depths = expected["Depth"][hit, 0]
    conversion = None
    if stated is not None and len(depths):
        conversion = conversion_error(stated, pinhole, np.percentile(depths, (0, 50, 100)))
    hits = (int(hit.sum()), int(tolerances.is_hit(seen).sum()))
    error, one_rounding, _ = errors[rows[0].name]
    roundings = error / one_rounding
    far = far_from_origin(pinhole, expected, chosen, rows[0]) if "Position" in measured else None
    lacking = tuple(name for name in PASSES if name in expected and name not in measured)
    return GeometryComparison(
        pinhole,
        stated,
        hits,
        rows,
        mismatches,
        systematic,
        conversion,
        maps,
        roundings,
        far,
        origin,
        lacking,
        in_one_place,
        renderer.name,
        mistaken=_mistaken(pinhole, expected, seen, test, measured, partial),
    )


def _mistaken(pinhole: Pinhole, expected: Seen, seen: Seen, test: Image, measured: set[str], is_strangers: bool = False) -> str:
    """The sentence that the test's passes are not what they are taken for; empty where they are.

    measured : the passes that the test has.
    is_strangers : true for a picture of another program, which may have axes, units and numbers of its own.
    """
    if is_strangers:
        sentences = [_mistaken_vectors(pinhole, expected, seen, name) for name in ("Position", "Normal") if name in measured]
        if sentence := next(filter(None, [*sentences, _mistaken_indices(expected, seen)]), ""):
            return sentence
    if "Position" not in measured:  # which tells by itself
        depths = [passes["Depth"].reshape(pinhole.height, pinhole.width).astype(np.float64) for passes in (expected, seen)]
        if turned := looks_turned(depths[0], depths[1], _unlike, _OF_THE_ERROR):
            return f"the picture looks {turned}"
    name = "Depth" if "Depth" in test.passes else "Distance"
    if name in test.passes:
        sentence = _mistaken_depth(pinhole, expected, seen, name) or _mistaken_background(expected, seen, test[name], name)
        if sentence:
            return sentence
    halves = sorted(test.halves & {"Depth", "Distance", "Position"})
    rounded = (
        f"{listed(halves)} {'is' if len(halves) == 1 else 'are'} in half floats, of 11 bits: write 32 bits" if halves else ""
    )
    return "; ".join(filter(None, (rounded, compressed_with_loss(test.lossy))))


def _unlike(reference: Array, test: Array) -> Array:
    """The difference of depths, from 0 to 1, where one alone is of a surface."""
    hit, test_hit = reference < BACKGROUND_DEPTH, test < BACKGROUND_DEPTH
    return np.where(hit & test_hit, np.minimum(np.abs(test / reference - 1), 1), hit ^ test_hit)


def _mistaken_background(expected: Seen, seen: Seen, depth: NDArray, name: str) -> str:
    """The sentence that the test has one depth, which no surface has, wherever nothing is."""
    hit = tolerances.is_hit(expected)
    alone, others = depth.ravel()[~hit], depth.ravel()[hit]
    if not len(alone) or not tolerances.is_hit(seen).all() or not (alone == alone[0]).all() or (others == alone[0]).any():
        return ""
    return f"{name} is {plain(float(alone[0]))} where nothing is: write 0, 1e10, inf or -1 there"


def _mistaken_vectors(pinhole: Pinhole, expected: Seen, seen: Seen, name: str) -> str:
    """The sentence that Position or Normal has other axes or another unit than the reference's; empty where it has not."""
    if name not in expected or not len(hits := _some_hits(expected, seen)):
        return ""
    reference, test = (passes[name][hits].astype(np.float64) for passes in (expected, seen))

    def off(read_anew: Array, right: Array) -> float:
        return float(np.quantile(np.linalg.norm(read_anew - right, axis=-1), _OF_ALL_PIXELS))

    def explains(read_anew: Array, right: Array) -> bool:
        return off(read_anew, right) < _OF_A_UNIT * off(test, reference)

    frame = np.array(pinhole.basis())
    of_camera = (reference - (pinhole.eye if name == "Position" else 0.0)) @ frame.T
    if explains(test, of_camera) or explains(test * (1, -1, -1), of_camera):
        return f"{name} is in the camera's axes: give it in world space"
    if name == "Normal":
        if explains(2 * test - 1, reference):
            return "Normal runs from 0 to 1: give it from -1 to 1"
        if explains(np.sign((test * reference).sum(axis=-1, keepdims=True)) * test, reference):
            return "Normal points away from the eye here and there: turn it towards the eye"
    scale = float(np.median(np.linalg.norm(test, axis=-1)) / np.median(np.linalg.norm(reference, axis=-1)))
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1, -1), repeat=3):
            if scale > 0 and explains(test / scale, reference[:, order] * signs):
                axes = ", ".join(f"{'-' * (sign < 0)}{'xyz'[axis]}" for sign, axis in zip(signs, order, strict=True))
                factor = "" if abs(scale - 1) < _OF_A_UNIT else f"{plain(scale, 6)} times "
                return f"{name} is {factor}({axes}) of the reference's: give it in the scene's axes and unit"
    return ""


def _mistaken_indices(expected: Seen, seen: Seen) -> str:
    """The sentence that objects or materials have other numbers, each another one; empty where they have the scene's."""
    hits = _some_hits(expected, seen)
    for name in ("Object Index", "Material Index"):
        if name in expected and name in seen and len(hits):
            both = np.stack([passes[name][hits, 0] for passes in (expected, seen)], axis=-1)
            pairs, counts = np.unique(both, axis=0, return_counts=True)
            renamed = dict(pairs[np.argsort(counts)].tolist())  # each as in most of its pixels
            share = np.mean([renamed[ours] == theirs for ours, theirs in both.tolist()])
            others = [(ours, theirs) for ours, theirs in renamed.items() if ours != theirs]
            if others and share > _OF_ALL_PIXELS and len({*renamed.values()}) == len(renamed):
                ours, theirs = (plain(number, 9) for number in min(others))
                return f"{name} has other numbers for the same, as {theirs} for {ours}: give the scene's, or leave it out"
    return ""


def _some_hits(expected: Seen, seen: Seen) -> NDArray[np.intp]:
    """Pixels, by their numbers, that see a surface on both sides."""
    hits = np.flatnonzero(tolerances.is_hit(expected) & tolerances.is_hit(seen))
    return hits[:: max(len(hits) // _READ_ANEW, 1)]


def _mistaken_depth(pinhole: Pinhole, expected: Seen, seen: Seen, name: str) -> str:
    """The sentence that the test's Depth is the distance from the eye, or its Distance the depth, that it counts the other way,
    or in another unit; empty where it does not.

    name : the pass that the test's depths come from. It is the other one where reading it so leaves a tenth of the error.
    """
    hits = _some_hits(expected, seen)
    rows, columns = np.divmod(hits, pinhole.width)
    cosine = -pinhole.ray_directions(columns, rows) @ pinhole.basis()[2]
    ratio = seen["Depth"][hits, 0].astype(np.float64) / expected["Depth"][hits, 0]
    if not len(hits):
        return ""

    def explains(read_anew: Array, share: float = _OF_THE_ERROR) -> bool:
        return bool(np.median(np.abs(read_anew - 1)) < share * np.median(np.abs(ratio - 1)))

    if explains(ratio * cosine if name == "Depth" else ratio / cosine):
        if name == "Depth":
            return "Depth is the distance from the eye and not that along the view's axis: give it as distance"
        return "Distance is the depth along the view's axis and not that from the eye: give it as depth"
    if explains(-ratio):
        return f"{name} is below 0, as counted against the view: give it with the other sign"
    if (factor := float(np.median(ratio))) > 0 and explains(ratio / factor, _OF_A_UNIT):
        return f"{name} is {plain(factor, 6)} times the reference's, as in another unit: give it in the scene's"
    reference, test = (passes["Depth"][hits, 0].astype(np.float64) for passes in (expected, seen))
    for power, scale in ((1, "another scale"), (-1, "a scale of 1/depth, as of depth buffers and disparities")):
        offset, slope = _line(reference**power, test)
        if slope and explains(((test - offset) / slope) ** power / reference, _OF_A_UNIT):
            begins = f", with {plain(offset, 4)} where the reference's is 0" if power == 1 else ""
            return f"{name} is in {scale}{begins}: give it from the eye on, in the scene's unit"
    return ""


def _line(x: Array, y: Array) -> tuple[float, float]:
    """The offset and the slope of the line through points, by least squares; no slope where x has one value."""
    spread = x - x.mean()
    slope = float(spread @ y / total) if (total := spread @ spread) > 0 else 0.0
    return float(y.mean() - slope * x.mean()), slope


def _passes(reference: Image, test: Image, pinhole: Pinhole, partial: bool) -> tuple[Seen, Seen]:
    """The passes that both sides are compared in, each as (pixels, channels)."""
    for image in (reference, test):
        if image.size != (pinhole.width, pinhole.height):
            raise InputError(
                f"{image.source} has {image.size[0]} × {image.size[1]} pixels and the camera "
                f"{pinhole.width} × {pinhole.height}: compare pictures of the same size"
            )
    names = [name for name in PASSES if name in reference.passes or name in _NEEDED]
    expected = {name: reference[name] for name in names} | {
        name: reference[name] for name in _FOR_TOLERANCES if name in reference.passes
    }
    if partial:
        test = completed(test, pinhole)
    seen = {name: test[name] for name in names if not partial or name in test.passes}
    return _flattened(expected), _flattened(seen)


def _flattened(passes: Seen) -> Seen:
    channels = {name: each.channels for name, each in PASSES.items()}
    return {name: values.reshape(-1, values.shape[2])[:, : channels.get(name)] for name, values in passes.items()}


def _slopes(expected: Seen, hit: NDArray, size: tuple[int, int]) -> dict[str, Array]:
    belongs = np.where(hit, expected["Object Index"][:, 0], -1).reshape(size)
    names = [name for name, each in PASSES.items() if each.has_slope and name in expected]
    return {name: tolerances.slopes(expected[name].reshape(*size, -1), belongs).ravel() for name in names}


def _mismatches(
    kinds: NDArray, seen: Seen, reach: Array, agreement: SurfaceAgreement, surfaces_at: SurfacesAt | None
) -> Mismatches:
    pixels = np.flatnonzero(kinds >= 0)
    columns, rows = pixels % agreement.pinhole.width, pixels // agreement.pinhole.width
    shifts, retraced = np.full(len(pixels), np.nan), 0
    if surfaces_at is not None:
        numbers = kinds[pixels] != KINDS.index("not a number")
        traced = pixels[numbers]
        shifts[numbers], retraced = explain(
            columns[numbers], rows[numbers], at(seen, traced), reach[traced], agreement.at(traced), surfaces_at
        )
    return Mismatches(columns, rows, kinds[pixels], shifts, reach[pixels], retraced)


def _compared(hit: NDArray, kinds: NDArray, mismatches: Mismatches, pinhole: Pinhole) -> NDArray[np.bool_]:
    """True where a pixel's difference is an error of the passes.

    Pixels that are explained, or few enough to be let pass, are none; all others show in the passes' figures.
    """
    compared = hit & np.isin(kinds, (-1, KINDS.index("material index"), KINDS.index("surface")))
    settled = mismatches.explained | (mismatches.unexplained_count <= allowed_unexplained(pinhole))
    compared[mismatches.rows[settled] * pinhole.width + mismatches.columns[settled]] = False
    return compared


def _errors(
    chosen: NDArray,
    expected: Seen,
    seen: Seen,
    agreement: SurfaceAgreement,
    displacement: tuple[Array, Array, Array],
    measured: set[str],
) -> tuple[dict[str, Errors], Systematic | None]:
    """The errors of the chosen pixels in each pass that the test has, and what Position's have in common.

    displacement : see `_displacement`.
    """
    off_x, off_y, along = (offsets[chosen] for offsets in displacement)
    errors = agreement.at(chosen).errors(at(expected, chosen), at(seen, chosen))
    systematic = None
    if "Position" in measured:
        depth = expected["Depth"][chosen, 0].astype(np.float64)
        errors = {
            "Position": errors["Position"],
            "Position depth": (np.abs(along - depth) / depth, *errors["Depth"][1:]),
        } | errors
        if len(chosen):
            center = agreement.renderer.center
            systematic = systematic_error(agreement.pinhole, chosen, off_x, off_y, errors["Position"][1], center)
    else:
        del errors["Position"]
    if "Depth" not in measured:
        del errors["Depth"]
    return errors, systematic


def _check_figures(source: str, expected: Seen, pinhole: Pinhole) -> None:
    """Refuse a reference whose figures are no numbers or contradict one another: all tolerances are derived from them.

    A position and its depth are rounded once each, the position in three coordinates: 2 · 2⁻²⁴ times its largest two, and 2⁻²⁴
    times the depth. Twice as much is let pass.
    """
    broken = next((name for name, values in expected.items() if not np.isfinite(values).all()), None)
    if broken is not None:
        raise InputError(f"{source} holds what is no finite number in its pass {broken!r}: trace it again")
    hit = tolerances.is_hit(expected)
    depth, position = (expected[name][hit].astype(np.float64) for name in ("Depth", "Position"))
    along = -(position - pinhole.eye) @ pinhole.basis()[2]
    size = np.abs(position).max(axis=-1) + np.abs(pinhole.eye).max() + np.abs(depth[:, 0])
    apart = ~(np.abs(along - depth[:, 0]) <= 4.0 * tolerances.FLOAT32 * size)
    if apart.any():
        raise InputError(
            f"{source} contradicts itself in {int(apart.sum()):,} pixels, where Position is not at the Depth that its camera "
            "sees: trace it again"
        )


def _check_reference(
    source: str, expected: Seen, pixels: NDArray, agreement: SurfaceAgreement, surfaces_at: SurfacesAt
) -> None:
    """Refuse a reference that its own scene does not show, where it differs from the test.

    Else rays would be sent for each of its pixels, as far as its figures say that they may be off. One of an older version of
    the scene, or a damaged one, is not the same for most of them; a true one is for all.

    pixels : pixels that see another surface.
    """
    pixels = pixels[:: max(len(pixels) // _ASKED_OF_THE_REFERENCE, 1)]
    rows, columns = np.divmod(pixels, agreement.pinhole.width)
    rays, _, traced = surfaces_at(columns, rows, 0.5, 0.5)
    traced, stated = at(traced, np.searchsorted(rays, np.arange(len(pixels)))), at(expected, pixels)
    same = agreement.at(pixels).same_place(traced, stated) | ~(
        tolerances.is_hit(traced) | tolerances.is_hit(stated) | np.isnan(stated["Depth"][:, 0])
    )
    if len(pixels) and not same.mean() >= 0.5:
        raise InputError(f"{source} is not what the tracer sees in the scene: trace it again, or give the scene that it shows")


def _displacement(pinhole: Pinhole, seen: Seen) -> tuple[Array, Array, Array]:
    """The offsets of the positions, projected, from the centers of their pixels, to the right and upwards; and their depths."""
    row, column = np.divmod(np.arange(pinhole.width * pinhole.height), pinhole.width)
    # A position that is no number, like one behind the eye, has no picture: it counts as far off as the picture is large.
    numbers = np.isfinite(seen["Position"]).all(axis=-1, keepdims=True)
    seen_column, seen_row, along = pinhole.project(np.where(numbers, seen["Position"], pinhole.eye))
    diagonal = float(np.hypot(pinhole.width, pinhole.height))
    off_x, off_y = (np.nan_to_num(off, nan=diagonal) for off in (seen_column - column - 0.5, seen_row - row - 0.5))
    return off_x, off_y, along


def _measure(
    errors: dict[str, Errors], chosen: NDArray, size: tuple[int, int]
) -> tuple[tuple[PassErrors, ...], dict[str, NDArray[np.float32]]]:
    """The rows and the maps of the chosen pixels."""
    rows, maps = [], {}
    for name, of_pass in errors.items():
        unit = PASSES[name].unit if name in PASSES else "relative"
        # Tolerances are in radians, people of degrees.
        error, one_rounding, storage = (np.asarray(np.degrees(figure) if unit == "°" else figure) for figure in of_pass)
        rows.append(measure(name, unit, error, one_rounding, storage))
        flat = np.full(size[0] * size[1], np.nan, dtype=np.float32)
        flat[chosen] = in_float32(error)
        maps[name] = flat.reshape(size)
    return tuple(rows), maps
