"""The answer of a comparison, one of three: the same, the same but for what is not modeled, or different.

Every place that tells it (shell, panel, report, contact sheet, JSON, JUnit, Python) has it from an `Answer`. Both sides leave
out or replace alike what is not modeled, so that the rest can be compared: two pictures that are the same need not be the
artist's then. It counts as far as it is in the picture: by the pixels that show it, and by those where Cycles' picture with
everything is another than the one with stand-ins, because it hides them, lights them or stands in their light.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import counted, several

SAME, SAME_BUT, DIFFERENT = "same", "same_but", "different"
ANSWERS = (SAME, SAME_BUT, DIFFERENT)

NOTHING = "Nothing to compare"
"""The headline where there is no answer: the two are DIFFERENT then, as far as whoever asked whether they are the same goes."""

COLORS = {SAME: "green", SAME_BUT: "amber", DIFFERENT: "red"}


@dataclass(frozen=True)
class NotModeled:
    """The part of a picture that the answer says nothing of.

    names : the objects that the ledger has as approximated or skipped and that are in the picture, or may be, and those whose
        light is a renderer's choice.
    share : the share of the pixels, 0 to 1, that show them or differ by them; None where it was not measured.
    visible : the share of the pixels that show them.
    in_one_place : the names among them of surfaces in one place.
    seen_otherwise : the names among them of what not all kinds of rays see, or see the shadows of.
    """

    names: tuple[str, ...] = ()
    share: float | None = 0.0
    visible: float = 0.0
    in_one_place: tuple[str, ...] = ()
    seen_otherwise: tuple[str, ...] = ()

    def sorted_by(self, in_one_place: Sequence[str], seen_otherwise: Sequence[str]) -> "NotModeled":
        """A copy that tells which of its objects are modeled."""
        one_place, otherwise = (tuple(name for name in self.names if name in group) for group in (in_one_place, seen_otherwise))
        return replace(self, in_one_place=one_place, seen_otherwise=otherwise)

    def to_json(self) -> dict[str, Any]:
        return {
            "count": len(self.names),
            "names": list(self.names),
            "share": self.share,
            "shown": self.visible,
            "in_one_place": list(self.in_one_place),
            "seen_otherwise": list(self.seen_otherwise),
        }


@dataclass(frozen=True)
class Answer:
    """The answer of comparing two pictures.

    answer : one of ANSWERS.
    headline : a few words.
    text : the figures that stand for it, or a clause that says what differs.
    not_modeled : the part of the picture that is not modeled, whatever the answer.
    """

    answer: str
    headline: str
    text: str
    not_modeled: NotModeled = field(default_factory=NotModeled)

    @property
    def passed(self) -> bool:
        """True if nothing differs of what is modeled."""
        return self.answer != DIFFERENT

    @property
    def color(self) -> str:
        return COLORS[self.answer]

    @property
    def sentence(self) -> str:
        return f"{self.headline}: {self.text}"

    def exit_status(self, strict: bool) -> int:
        """The status of a command that came to this."""
        return exit_status(self.answer, strict)

    def to_json(self) -> dict[str, Any]:
        return {
            "passed": self.passed,
            "answer": self.answer,
            "sentence": self.sentence,
            "not_modeled": self.not_modeled.to_json(),
        }


def exit_status(answer: str, strict: bool) -> int:
    """0, 1 where something differs, and 3 where that can't be said of all of the picture and `strict` asks for it.

    answer : one of ANSWERS.
    """
    return 1 if answer == DIFFERENT else 3 if strict and answer == SAME_BUT else 0


def answered(same: bool, headline: str, text: str, not_modeled: NotModeled) -> Answer:
    """The answer, whose headline names what is not modeled where the rest is the same.

    same : true if nothing differs.
    headline : without what is not modeled.
    """
    if not same:
        return Answer(DIFFERENT, headline, text, not_modeled)
    if not not_modeled.names:
        return Answer(SAME, headline, text, not_modeled)
    return Answer(SAME_BUT, f"{headline}, {but_for(not_modeled.to_json())} ({_named(not_modeled)})", text, not_modeled)


def in_the_picture(
    names: Sequence[str], surfaces: Mapping[str, NDArray[np.bool_]], changed: NDArray[np.bool_] | None, is_lit: bool
) -> NotModeled:
    """The part of a picture that is not modeled.

    names : the names of the objects that are not modeled.
    surfaces : name → (height, width), true for pixels that show the object, of those that are surfaces in the scene.
    changed : (height, width), true for pixels in which the picture with everything is another than the one with stand-ins; None
        where there is none.
    is_lit : true if light is compared, so that what is not seen may still light what is.
    """
    if changed is not None and not is_lit:  # bits tell what a stand-in changes, where there is no noise
        surfaces = {name: pixels & changed for name, pixels in surfaces.items()}
    seen = [name for name in names if name in surfaces and surfaces[name].any()]
    pixels = np.logical_or.reduce([surfaces[name] for name in seen]) if seen else np.False_
    unseen = [name for name in names if name not in seen and (is_lit or name not in surfaces)]
    share = float(np.mean(pixels))
    if changed is None:
        return NotModeled((*seen, *unseen), None if unseen else share, share)
    if not (changed & ~pixels).any():
        unseen = []
    elif not seen and not unseen:  # a surface that is not seen can fill with fog what is
        unseen = list(names)
    return NotModeled((*seen, *unseen), float(np.mean(changed | pixels)), share)


def but_for(not_modeled: Mapping[str, Any]) -> str:
    """but for 2 objects that are not modeled and 1 light or shadow that not all rays see

    not_modeled : see NotModeled.to_json.
    """
    one_place, otherwise = (not_modeled.get(key, ()) for key in ("in_one_place", "seen_otherwise"))
    modeled = {*one_place, *otherwise}
    kinds = [
        (
            [name for name in not_modeled["names"] if name not in modeled],
            "object that is not",
            "objects that are not",
            " modeled",
        ),
        (one_place, "object", "objects", " with surfaces in one place"),
        (otherwise, "light or shadow", "lights or shadows", " that not all rays see"),
    ]
    parts = [f"{counted(len(names), singular, plural)}{rest}" for names, singular, plural, rest in kinds if names]
    return f"but for {' and '.join(parts)}"


def percent_of(share: float) -> str:
    """12 %; 0.02 %; less than 0.01 %."""
    percent = 100.0 * share
    if 0.0 < percent < 0.01:
        return "less than 0.01 %"
    return f"{percent:.2g} %" if percent < 99.5 else f"{percent:.4g} %" if percent < 100.0 else "100 %"


def _named(not_modeled: NotModeled) -> str:
    named = several(not_modeled.names)
    if not_modeled.share is None:
        return f"{named}; on how much of the picture was not measured"
    return f"{named}; {percent_of(not_modeled.share)} of the picture"
