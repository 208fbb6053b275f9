"""The verdict of a comparison of geometry, as figures, as one sentence, and as aligned lines for the shell."""

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..errors import counted
from ..pinhole import Pinhole
from . import tolerances
from .answer import NOTHING, Answer, NotModeled, answered
from .cameras import ConversionError, Systematic
from .mismatches import KINDS, NOWHERE, PIXELS_PER_UNEXPLAINED, InOnePlace, Mismatches
from .statistics import PassErrors, percentile_name, plain
from .tolerances import PERCENTILES, ROUNDINGS, Array, Seen


@dataclass(frozen=True)
class FarFromOrigin:
    """The pixels that the size of the coordinates costs, which another origin would give back.

    The tolerance is 2⁻²⁴ · d · (M + t)/z · t/z for a rounding, and M holds the largest coordinate C of the eye and of what is
    seen. With the origin at the eye that would be C′ = |P − e|: the difference is what the distance from the origin costs. What
    a long lens, a slender triangle or a grazing view costs is in neither, and no other origin mends it.

    error : the median error, pixels.
    measured : true if it was measured in the picture, false if it is the tolerance where pixels can't be compared.
    away : the eye's distance from the origin, world units.
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

    expected : the reference's passes, (pixels, channels).
    compared : (n,), the pixels of `position`.
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


# A sentence with more faults is not read; the table has them all.
_MOST_FAULTS = 2
_MOST_PAIRS = 3

NOTHING_TO_COMPARE = (
    "no pixel of either picture shows an object: point the camera at one, and see that frame, view layer and clipping leave "
    "it there"
)


@dataclass(frozen=True, eq=False)
class GeometryComparison:
    """The comparison of a reference with a test picture.

    pinhole : the camera of the reference.
    stated : the camera that was asked for, or None.
    hits : pixels that hit something in (reference, test).
    rows : one for each measured pass.
    mismatches : pixels that see another surface.
    systematic : the error that is the same for all pixels, None where nothing was compared.
    conversion : the camera's own error, None where nobody stated a camera.
    maps : pass name to (height, width) float32, rows from the bottom: the error of each pixel in the unit of the pass's row,
        nan where it was not compared.
    roundings : (n,) float64, the error of each compared position over what one rounding of float32 causes there.
    far_from_origin : the error by the distance from the origin, None where it is too small to speak of.
    origin : the point of the world from which the coordinates of both pictures are counted.
    lacking : passes that only the reference has.
    in_one_place : pixels that show another of several surfaces in one place, which is as right as the reference's.
    renderer : the name of the renderer that made the test picture.
    not_modeled : the part of the picture that neither side models as it is.
    mistaken : the sentence that the test's passes are not what they are taken for; empty where they are.
    """

    pinhole: Pinhole
    stated: Pinhole | None
    hits: tuple[int, int]
    rows: tuple[PassErrors, ...]
    mismatches: Mismatches
    systematic: Systematic | None
    conversion: ConversionError | None
    maps: dict[str, NDArray[np.float32]]
    roundings: Array
    far_from_origin: FarFromOrigin | None = None
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    lacking: tuple[str, ...] = ()
    in_one_place: InOnePlace = NOWHERE
    renderer: str = "Cycles"
    not_modeled: NotModeled = field(default_factory=NotModeled)
    mistaken: str = ""

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """The names of two objects each that were found in one place."""
        return tuple(self.in_one_place.pairs())

    @property
    def pixels(self) -> int:
        return self.pinhole.width * self.pinhole.height

    @property
    def allowed_unexplained(self) -> int:
        """The number of mismatches that may stay unexplained in a picture of this size."""
        return allowed_unexplained(self.pinhole)

    @property
    def mismatches_ok(self) -> bool:
        not_a_number = self.mismatches.counts()["not a number"][0]
        return not_a_number == 0 and self.mismatches.unexplained_count <= self.allowed_unexplained

    @property
    def is_empty(self) -> bool:
        """True if no pixel of either picture shows an object, so that there is nothing to compare."""
        return self.hits == (0, 0)

    @property
    def answer(self) -> Answer:
        """True if the two are the same picture, in one sentence, which names the gravest fault where there is one."""
        if self.is_empty:
            return answered(False, NOTHING, NOTHING_TO_COMPARE, self.not_modeled)
        systematic_ok = self.systematic is None or self.systematic.ok  # where nothing is compared no row is
        conversion_ok = self.conversion is None or self.conversion.ok
        same = systematic_ok and conversion_ok and self.mismatches_ok and all(row.ok for row in self.rows)
        if same:
            return answered(True, "The same picture", _agreement(self), self.not_modeled)
        return answered(False, "Not the same picture", "; ".join(_faults(self)[:_MOST_FAULTS]) + ".", self.not_modeled)

    @property
    def passed(self) -> bool:
        """True if nothing differs of what is modeled. False, too, where there was nothing to compare."""
        return self.answer.passed

    @property
    def sentence(self) -> str:
        return self.answer.sentence

    def lines(self) -> list[str]:
        """One line for each pass, aligned, and the verdict last."""
        head = (
            f"{'pass':<16}{'pixels':>11}"
            + "".join(f"{percentile_name(p):>10}" for p in PERCENTILES)
            + f"  {'unit':<10}{'of tolerance':<16}"
        )
        table = [head.rstrip(), *(_row_line(row) for row in self.rows)]
        mismatches = self.mismatches
        table.append(
            f"{'Mismatches':<16}{len(mismatches.kinds):>11,}  {_explained(self)}; "
            f"unexplained {mismatches.unexplained_count} of "
            f"{self.allowed_unexplained} allowed  {mark(self.mismatches_ok)}"
        )
        table += [
            f"  {kind:<14}{count:>11,}  {explained:,} explained"
            for kind, (count, explained) in mismatches.counts().items()
            if count
        ]
        if self.systematic:
            s = self.systematic
            table.append(
                f"{'Systematic':<16}{'':>11}  shift {s.shift_x:+.1e}, {s.shift_y:+.1e} px; zoom {s.zoom_x:+.1e}, "
                f"{s.zoom_y:+.1e}; roll {s.roll:+.1e} rad; mean {s.mean:.1e} of {s.tolerance:.1e} px  {mark(s.ok)}"
            )
        if self.conversion:
            c = self.conversion
            table.append(
                f"{'Conversion':<16}{'':>11}  stated camera against the one read back: {c.largest:.1e} px, {c.share:.0%} of "
                f"what float32 storage allows  {mark(c.ok)}"
            )
        if self.lacking:
            table.append(f"{'Not compared':<16}{'':>11}  {', '.join(self.lacking)}: the test picture has none")
        if len(self.in_one_place.columns):
            table.append(f"{'In one place':<16}{len(self.in_one_place.columns):>11,}  {in_one_place_text(self.in_one_place)}")
        if self.far_from_origin:
            table.append(self.far_from_origin.sentence)
        return [*table, self.sentence]

    def to_json(self) -> dict:
        """Everything but the maps, as plain JSON values."""
        return {
            **self.answer.to_json(),
            "size": [self.pinhole.width, self.pinhole.height],
            "hits": {"reference": self.hits[0], "test": self.hits[1]},
            "passes": [row.to_json() for row in self.rows],
            "mismatches": {
                **self.mismatches.to_json(),
                "allowed_unexplained": self.allowed_unexplained,
                "ok": self.mismatches_ok,
            },
            "systematic": self.systematic and self.systematic.to_json(),
            "conversion": self.conversion and self.conversion.to_json(),
            "far_from_origin": self.far_from_origin and self.far_from_origin.to_json(),
            "origin": list(self.origin),
            "not_compared": list(self.lacking),
            "in_one_place": self.in_one_place.to_json(),
        }


def allowed_unexplained(pinhole: Pinhole) -> int:
    """The number of mismatches that may stay unexplained in a picture of this size."""
    return pinhole.width * pinhole.height // PIXELS_PER_UNEXPLAINED


def in_one_place_text(in_one_place: InOnePlace) -> str:
    """The sentence: pixels show another of several surfaces in one place: 'Floor' and 'Carpet', and 2 more pairs."""
    show = "pixel shows" if len(in_one_place.columns) == 1 else "pixels show"
    return f"{show} another of several surfaces in one place: {pairs_text(in_one_place.pairs())}"


def pairs_text(pairs: Iterable[tuple[str, str]]) -> str:
    """'Floor' and 'Carpet', two of 'Leaves', and 2 more pairs."""
    named = [f"two of {first!r}" if first == second else f"{first!r} and {second!r}" for first, second in pairs]
    more = f", and {len(named) - _MOST_PAIRS:,} more pairs" if len(named) > _MOST_PAIRS else ""
    return ", ".join(named[:_MOST_PAIRS]) + more


def _row_line(row: PassErrors) -> str:
    if not row.count:
        return f"{row.name:<16}{0:>11}  nothing was compared  {mark(False)}"
    figures = "".join(f"{value:>10.1e}" for value in row.values)
    percentile, share = row.worst
    used = f"{percent(share):>7} at {percentile_name(percentile):<6}"
    return f"{row.name:<16}{row.count:>11,}{figures}  {row.unit:<10}{used}{mark(row.ok)}"


def _agreement(comparison: GeometryComparison) -> str:
    first = comparison.rows[0]
    count = len(comparison.mismatches.kinds)
    edges = f"; {count:,} on edges, {_explained(comparison)}" if count else ""
    if coincident := len(comparison.in_one_place.columns):
        edges += f"; {coincident:,} {in_one_place_text(comparison.in_one_place)}"
    median, nearly_all = (first.values[PERCENTILES.index(p)] for p in (50.0, 99.9))
    unit = first.unit if first.name == "Position" else "of the depth"
    return (
        f"over {first.count:,} pixels the median is {median:.1e} {unit} off and 99.9 % are within "
        f"{nearly_all:.1e} {unit}; every one stays within {percent(first.worst[1])} of what float32 allows there{edges}."
    )


def _faults(comparison: GeometryComparison) -> list[str]:
    """The faults, the gravest first."""
    faults = [comparison.mistaken] if comparison.mistaken else []
    position, rest = comparison.rows[0], comparison.rows[1:]
    if position.name != "Position":
        rest = comparison.rows
    elif position.count and not (position.ok and (comparison.systematic is None or comparison.systematic.ok)):
        i = PERCENTILES.index(position.worst[0])
        faults.append(
            f"positions are {plain(position.values[i])} px off at {percentile_name(PERCENTILES[i])}, "
            f"{_share(position.shares[i])} their tolerance, and {_cause(comparison)}"
        )
    mismatches = comparison.mismatches
    if not comparison.mismatches_ok:
        kinds = ", ".join(
            f"{count - explained:,} of {kind}" for kind, (count, explained) in mismatches.counts().items() if count > explained
        )
        seen = counted(mismatches.unexplained_count, "pixel sees", "pixels see")
        faults.append(f"{seen} another surface ({kinds}), {_why_unexplained(comparison)}")
    for row in rest:
        if row.count and not row.ok:
            percentile, share = row.worst
            value = row.values[PERCENTILES.index(percentile)]
            faults.append(
                f"{row.name} is {plain(value)} {row.unit} off at {percentile_name(percentile)}, {_share(share)} its tolerance"
            )
    if not position.count:
        faults.append("no pixel shows the same object in both")
    if comparison.conversion and not comparison.conversion.ok:
        c = comparison.conversion
        faults.append(f"the camera in Blender is {plain(c.largest)} px from the stated one ({plain(c.tolerance)} px allowed)")
    return faults


def _cause(comparison: GeometryComparison) -> str:
    """The likely cause of the systematic part: the largest of shift, zoom and roll, in pixels at the picture's border."""
    s = comparison.systematic
    assert s is not None  # as positions are off
    radius = max(comparison.pinhole.width, comparison.pinhole.height) / 2
    if s.zoom_x < -1 and s.zoom_y < -1:
        return "the picture looks turned by half a turn"
    if s.zoom_x < -1:
        return "the picture looks mirrored left to right"
    if s.zoom_y < -1:
        return "the picture looks upside down"
    zoom = max(s.zoom_x, s.zoom_y, key=abs)
    effects = {
        f"the picture is shifted by ({s.shift_x:+.3g}, {s.shift_y:+.3g}) px": np.hypot(s.shift_x, s.shift_y),
        f"the picture is magnified by {1 + s.zoom_x:.8g} × {1 + s.zoom_y:.8g}": abs(zoom) * radius,
        f"the picture is rolled by {s.roll:+.3g} rad": abs(s.roll) * radius,
    }
    cause, effect = max(effects.items(), key=lambda pair: pair[1])
    return cause if effect > s.tolerance else "the error has no common direction"


def _explained(comparison: GeometryComparison) -> str:
    mismatches = comparison.mismatches
    explained = int(mismatches.explained.sum())
    if not explained:
        return "none explained" if len(mismatches.kinds) else "none"
    return f"{explained:,} explained by a shift of at most {np.max(mismatches.shifts[mismatches.explained]):.1e} px"


def _why_unexplained(comparison: GeometryComparison) -> str:
    if (comparison.mismatches.kinds == KINDS.index("not a number")).all():
        return "where the test picture holds no number"
    if not comparison.mismatches.retraced:
        return "which may be edges: give the scene too, so that they can be re-traced"
    return "and no shift within tolerance explains it"


def percent(share: float) -> str:
    """87%; 12 times; 1,680 times."""
    return f"{share:.0%}" if share < 10 else f"{plain(share, 3)} times"


def _share(share: float) -> str:
    return f"{percent(share)} of" if share < 10 else percent(share)


def mark(ok: bool) -> str:
    """The last word of a line."""
    return "ok" if ok else "FAILED"
