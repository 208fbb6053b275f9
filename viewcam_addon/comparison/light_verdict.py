"""The verdict of a comparison of light, as figures, as one sentence, and as aligned lines for the shell."""

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..errors import counted, listed
from ..pinhole import Pinhole
from .answer import NOTHING, Answer, NotModeled, answered, percent_of
from .coincident import TakenOut
from .hypothesis_tests import CONTOURS, PIXELS, WHOLE, HypothesisTest, Place
from .noise_free import Edges
from .perception import Appearance
from .sides import CHANNEL_NAMES
from .statistics import PassErrors, compressed_with_loss, percentile_name, plain
from .tolerances import PERCENTILES, Array
from .verdict import mark, pairs_text, percent

FALSE_ALARMS = 0.01
"""The probability, at most, that two sides of the same light are called different; shared out evenly over the quantities."""

# Factors that tell what went wrong, and how well a factor has to fit one: a picture without noise tells it to some digits.
_TELLING = {
    "π": math.pi,
    "1/π": 1.0 / math.pi,
    "2": 2.0,
    "1/2": 0.5,
    "4": 4.0,
    "1/4": 0.25,
    "2π": 2.0 * math.pi,
    "4π": 4.0 * math.pi,
}
_FIT = 1e-4

_MOST_NAMED = 3

# After the point: what float64 leaves of a mean in percent.
_MOST_DIGITS = 12


@dataclass(frozen=True)
class LightRow:
    """The result for one quantity.

    reference, test : means over the picture and its channels.
    ratio : test over reference, nan where that is 0.
    ratio_error : its standard error.
    visible : the least relative bias of all that is compared that is found in 99 of 100 cases; inf where none is.
    hypothesis_tests : none where there is no noise.
    noise_free, edges : the exact comparison, None where there is noise.
    broken : pixels that are no numbers on one side or both.
    breaks : a flag for the reference and one for the test, true if some of them are its own.
    factor : the one that explains all of the difference, or None.
    """

    name: str
    reference: float
    test: float
    ratio_error: float
    visible: float
    broken: int
    breaks: tuple[bool, bool] = (False, False)
    hypothesis_tests: tuple[HypothesisTest, ...] = ()
    noise_free: PassErrors | None = None
    edges: Edges | None = None
    factor: float | None = None

    @property
    def without_noise(self) -> tuple[PassErrors, Edges]:
        """The comparison of light without noise, which it is; AssertionError of other light."""
        assert self.noise_free is not None and self.edges is not None
        return self.noise_free, self.edges

    @property
    def ratio(self) -> float:
        return self.test / self.reference if self.reference else float("nan")

    @property
    def ok(self) -> bool:
        exact = self.noise_free is None or all(each.ok for each in self.without_noise)
        return exact and not self.broken and all(test.ok for test in self.hypothesis_tests)

    def to_json(self) -> dict:
        names = ("name", "reference", "test", "ratio", "ratio_error", "visible", "broken", "factor", "ok")
        return {
            **{name: getattr(self, name) for name in names},
            "hypothesis_tests": [test.to_json() for test in self.hypothesis_tests],
            "noise_free": self.noise_free and self.noise_free.to_json(),
            "edges": self.edges and self.edges.to_json(),
        }


@dataclass(frozen=True)
class Search:
    """The state of a comparison in rounds that searches for a bias (sequential.py).

    find : the bias, a share of the light.
    least : the bias that would be found in 99 of 100 cases so far, if it is everywhere.
    least_in_blocks : the bias that would be found if it is in a typical block of 32 × 32 pixels alone; both are 0 without
        noise.
    samples : the samples of each side so far.
    rounds : the rounds so far.
    is_decided : true if that was the last.
    expected : the samples that the search is expected to take.
    following : the samples after the next round, if there is to be one; None after the last.
    """

    find: float
    least: float
    least_in_blocks: float
    samples: int
    rounds: int
    is_decided: bool
    expected: float
    following: int | None

    @property
    def reached(self) -> bool:
        """True if the bias that was asked for would have been found."""
        return self.least <= self.find

    def to_json(self) -> dict:
        least = {"least": self.least, "least_in_blocks": self.least_in_blocks}
        return {"wanted": self.find, "reached": self.reached, **least, "samples": self.samples, "rounds": self.rounds}


@dataclass(frozen=True, eq=False)
class RadianceComparison:
    """The comparison of a reference with the mean of some test pictures, in light.

    samples : the samples of the reference, and of all test pictures together; None where the files do not tell.
    seeds : the number of test pictures, each of its own seed.
    is_noisy : true if chance had a part in it.
    rows : one for each quantity, Combined first.
    equal : further quantities, the same to the last bit.
    appearance : relMSE and FLIP.
    test : the mean of the test pictures' Combined, (height, width, 3).
    maps : name to (height, width) float32, rows from the bottom: what differs in Combined and in quantities that fail.
    not_modeled : the part of the picture that neither side models as it is.
    taken_out : the pixels of which the verdict says nothing.
    stated : the camera that was asked for, or None.
    search : the state of the search, of a comparison in rounds.
    turned : the way in which the test looks turned over, one of TURNS; empty if it does not.
    lossy : the compression that changed the test's pixels; empty if none has.
    """

    pinhole: Pinhole
    samples: tuple[int | None, int | None]
    seeds: int
    is_noisy: bool
    rows: tuple[LightRow, ...]
    equal: tuple[str, ...]
    appearance: Appearance
    test: Array
    maps: dict[str, NDArray[np.float32]]
    not_modeled: NotModeled = field(default_factory=NotModeled)
    taken_out: TakenOut = field(default_factory=TakenOut)
    stated: Pinhole | None = None
    search: Search | None = None
    turned: str = ""
    lossy: str = ""
    renderer = "Cycles"
    """The renderer of the test: light is compared with Cycles' alone."""

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """The names of two objects each that were found in one place."""
        return tuple(self.taken_out.pairs)

    @property
    def is_empty(self) -> bool:
        """True if nothing differs and next to nothing was compared, so that there is no answer."""
        return self.taken_out.is_nearly_all and all(row.ok for row in self.rows)

    @property
    def answer(self) -> Answer:
        """True if the light is the same, in one sentence, which says where and by how much where it is not."""
        combined = self.rows[0]
        worst = [row for row in self.rows if not row.ok]
        if worst:
            others = f"; {listed([row.name for row in worst[1:]])} too" if len(worst) > 1 else ""
            turned = f"the picture looks {self.turned}; " if self.turned else ""
            lossy = f"{compressed_with_loss(self.lossy)}; " if self.lossy else ""
            return answered(
                False,
                "Different here",
                f"{turned}{lossy}{_difference(worst[0])}{_hint(worst[0])}{others}{_without(self)}.",
                self.not_modeled,
            )
        if self.is_empty:
            return answered(False, NOTHING, _nothing_left(self.taken_out), self.not_modeled)
        if not self.is_noisy:
            row, _ = combined.without_noise
            text = (
                f"over {row.count:,} pixels without noise the light differs by {row.values[0]:.1e} of its "
                f"value in the median and by at most {row.values[-1]:.1e}, {percent(row.worst[1])} of what float32 allows"
                f"{_edges(combined)}{_without(self)}."
            )
            return answered(True, "The same picture", text, self.not_modeled)
        text = f"no pixel and no tile differs by more than chance; {_mean_text(combined, self.search)}{_without(self)}."
        return answered(True, f"The same within noise at {samples_text(self)}", text, self.not_modeled)

    @property
    def passed(self) -> bool:
        """True if nothing of what is modeled differs by more than chance and rounding. False, too, where next to nothing was
        compared."""
        return self.answer.passed

    @property
    def sentence(self) -> str:
        return self.answer.sentence

    def lines(self) -> list[str]:
        """A line for each quantity, aligned, what an eye sees, and the verdict last."""
        table = _noisy_lines(self) if self.is_noisy else _noise_free_lines(self)
        if self.equal:
            table.append(f"{'To the last bit':<17}{', '.join(self.equal)}")
        if self.taken_out.pairs:
            table.append(f"{'In one place':<17}{pairs_text(self.taken_out.pairs)}")
        if self.taken_out.seen_otherwise:
            table.append(f"{'Seen by some rays':<18}light or shadows of {_few(self.taken_out.seen_otherwise)}")
        if self.taken_out:
            table.append(f"{'Taken out':<17}{counted(self.taken_out.count, 'pixel')}")
        seen = self.appearance
        expected = "" if seen.expected_relmse is None else f", of which noise explains {seen.expected_relmse:.2e}"
        flip = "" if seen.flip is None else f"; FLIP {seen.flip:.4f}"
        table.append(f"{'To the eye':<17}relMSE {seen.relmse:.2e}{expected}{flip}")
        return [*table, self.sentence]

    def to_json(self) -> dict:
        """Everything but the pictures, as plain JSON values."""
        return {
            **self.answer.to_json(),
            "size": [self.pinhole.width, self.pinhole.height],
            "samples": {"reference": self.samples[0], "test": self.samples[1]},
            "seeds": self.seeds,
            "noisy": self.is_noisy,
            "false_alarms": FALSE_ALARMS,
            **({"find": self.search.to_json()} if self.search else {}),
            "quantities": [row.to_json() for row in self.rows],
            "equal": list(self.equal),
            "appearance": asdict(self.appearance),
            "in_one_place": self.taken_out.to_json(),
        }


def _without(comparison: RadianceComparison) -> str:
    taken_out = comparison.taken_out
    return f"; the {taken_out.count:,} pixels that {_which(taken_out)}, are taken out" if taken_out.count else ""


def _which(taken_out: TakenOut) -> str:
    which = []
    if taken_out.pairs:
        which.append(f"show surfaces in one place, or are lit by them ({pairs_text(taken_out.pairs)})")
    if taken_out.seen_otherwise:
        names = _few(taken_out.seen_otherwise)
        which.append(f"are lit by, or past, what some kinds of rays see and others do not ({names})")
    return ", and that ".join(which)


def _nothing_left(taken_out: TakenOut) -> str:
    remedies = ["move one of two that lie in one place aside"] if taken_out.pairs else []
    if taken_out.seen_otherwise:
        remedies.append("let all kinds of rays see what some see")
    return (
        f"{percent_of(taken_out.share_of_lit)} of the pixels with light {_which(taken_out)}, which is a renderer's choice: "
        f"{' and '.join(remedies)}, or check level geometry, where any such choice is right"
    )


def samples_text(comparison: RadianceComparison) -> str:
    """The numbers of samples: 1,024 samples; or 1,024 and 512 samples."""
    reference, test = comparison.samples
    if reference is None or test is None:
        return "unknown samples"
    return f"{reference:,} samples" if reference == test else f"{reference:,} and {test:,} samples"


def place_text(place: Place, size: int) -> str:
    """The place in words: in columns 32 to 63, rows 0 to 31."""
    if size == WHOLE:
        return "over the whole picture"
    if size == CONTOURS:
        return "along the contours"
    (left, right), (bottom, top) = place.columns, place.rows
    return f"in column {left}, row {bottom}" if size == PIXELS else f"in columns {left} to {right}, rows {bottom} to {top}"


def change_text(reference: float, test: float) -> str:
    """4.1 % darker; 3.1 times as bright; 0.12 instead of 0."""
    if reference <= 0.0 or test <= 0.0:
        return f"{test:.3g} instead of {reference:.3g}"
    ratio = test / reference
    if not 0.5 < ratio < 2.0:
        return f"{plain(ratio, 4)} times as bright"
    return f"{abs(ratio - 1.0):.2%} {'brighter' if ratio > 1.0 else 'darker'}".replace("%", " %")


def differs_text(test: HypothesisTest) -> str:
    """The difference at the worst place: 4.1 % darker; or softer, along contours."""
    if test.size == CONTOURS:
        return "sharper" if test.worst.errors > 0.0 else "softer"
    return change_text(test.worst.reference, test.worst.test)


def worst_test(row: LightRow) -> HypothesisTest | None:
    """The failed test that tells where: the smallest tiles, or the whole picture where half of them differ."""
    failing = [test for test in row.hypothesis_tests if not test.ok]
    if not failing:
        return None
    tiles = [test for test in failing if test.size not in (PIXELS, CONTOURS, WHOLE)] or failing
    whole = failing[-1] if failing[-1].size == WHOLE else None
    return whole if whole and (row.factor is not None or tiles[0].is_everywhere) else tiles[0]


def _noisy_lines(comparison: RadianceComparison) -> list[str]:
    names = [test.name for test in comparison.rows[0].hypothesis_tests]
    table = [f"{'standard errors':<17}{'ratio':>20}" + "".join(f"{name:>18}" for name in names)]
    for row in comparison.rows:
        cells = "".join(f"{_statistic(test):>18}" for test in row.hypothesis_tests)
        table.append(f"{row.name:<17}{f'{row.ratio:.5f} ± {row.ratio_error:.5f}':>20}{cells}  {mark(row.ok)}")
    return table


def _statistic(test: HypothesisTest) -> str:
    return "–" if test.is_open else f"{abs(test.worst.errors):.1f} of {test.limit:.1f}"


def _noise_free_lines(comparison: RadianceComparison) -> list[str]:
    head = "".join(f"{percentile_name(p):>10}" for p in PERCENTILES)
    table = [f"{'relative':<17}{'pixels':>11}{head}  of tolerance"]
    for row in comparison.rows:
        noise_free, _ = row.without_noise
        figures = "".join(f"{value:>10.1e}" for value in noise_free.values)
        percentile, share = noise_free.worst
        used = f"{percent(share):>7} at {percentile_name(percentile):<6}{mark(row.ok)}"
        table.append(f"{row.name:<17}{noise_free.count:>11,}{figures}  {used}{_edges(row)}")
    return table


def edge_text(edges: Edges) -> str:
    """12 pixels differ at edges (63 may) and 1 elsewhere (2 may)."""
    at_edges = f"{counted(edges.count, 'pixel differs', 'pixels differ')} at edges ({edges.allowed:,} may)"
    return f"{at_edges} and {edges.leaks:,} elsewhere ({edges.allowed_leaks:,} may)"


def _edges(row: LightRow) -> str:
    _, edges = row.without_noise
    return f"; {edge_text(edges)}" if edges.count or edges.leaks else ""


def _difference(row: LightRow) -> str:
    if row.broken:
        whose = {(True, False): "the reference", (False, True): RadianceComparison.renderer}.get(row.breaks, "both pictures")
        return f"{row.name} has {counted(row.broken, 'pixel')} without a number, in {whose}"
    test = worst_test(row)
    if test is None:
        noise_free, edges = row.without_noise
        if not edges.ok:
            return f"{row.name} differs by more than float32 allows: {edge_text(edges)}"
        percentile, share = noise_free.worst
        return f"{row.name} is off by {plain(share, 3)} times its tolerance at {percentile_name(percentile)}"
    place = test.worst
    failing, total = int(test.failing.sum()), test.failing.size
    many = f" and {failing - 1:,} more of {total:,}" if failing > 1 else ""
    channel = f" ({place.channel})" if place.channel else ""
    return (
        f"{place_text(place, test.size)}{many} {row.name}{channel} is {differs_text(test)}, "
        f"{abs(place.errors):.3g} standard errors where chance allows {test.limit:.3g}"
    )


def _hint(row: LightRow) -> str:
    if row.factor is None:
        return ""
    tolerance = max(_FIT, 4.0 * row.ratio_error / row.ratio)
    known = next((name for name, value in _TELLING.items() if abs(row.factor / value - 1.0) < tolerance), None)
    error = f" ± {row.ratio_error:.1g}" if row.ratio_error else ""
    return f" (all of it is a factor of {row.factor:.5g}{error}{f', which is {known}' if known else ''})"


def _mean_text(row: LightRow, search: Search | None = None) -> str:
    if not row.reference:
        return "both are black in the mean"
    error = 100.0 * row.ratio_error
    digits = 1 - math.floor(math.log10(error)) if 0.0 < error < math.inf else _MOST_DIGITS  # two of the error
    difference = round(100.0 * (row.ratio - 1.0), min(digits, _MOST_DIGITS))
    differs = (
        f"differs by {difference:+.{max(digits, 0)}f} %, with a standard error of".replace("-", "−")
        if difference
        else "is the same within a standard error of"
    )
    text = f"the mean {differs} {plain(error)} %"
    visible = search.least if search else row.visible
    if not math.isfinite(visible):
        return text
    text += f"; a picture {plain(100.0 * visible)} % brighter or darker throughout would have been found in 99 of 100 cases"
    text += _quietest_channel(row)
    if search and math.isfinite(search.least_in_blocks):
        text += f", and a typical block of 32 × 32 pixels alone that is {plain(100.0 * search.least_in_blocks)} % off"
    if search and not search.reached:
        text += f"; to find the {plain(100.0 * search.find)} % asked for takes too many samples"
        text += f", some {_rounded(search.expected):,} a pixel" if math.isfinite(search.expected) else ""
    return text


def _quietest_channel(row: LightRow) -> str:
    """, by its blue channel, which has the least noise: where another is so much noisier that the mean tells half as much."""
    by_channel = row.hypothesis_tests[-1].findable[0, 0] if row.hypothesis_tests else np.zeros(0)
    if len(by_channel) != len(CHANNEL_NAMES) or not by_channel.max() > 2.0 * by_channel.min():
        return ""
    return f" by its {CHANNEL_NAMES[int(by_channel.argmin())]} channel, which has the least noise"


def _rounded(number: float) -> int:
    """To one digit, as a forecast is worth."""
    power = 10 ** math.floor(math.log10(number))
    return math.ceil(number / power) * power


def _few(names: Iterable[str]) -> str:
    """'Sheet', 'Area' and 3 more."""
    quoted = [repr(name) for name in names]
    more = [f"{len(quoted) - _MOST_NAMED:,} more"] if len(quoted) > _MOST_NAMED else []
    return listed([*quoted[:_MOST_NAMED], *more])
