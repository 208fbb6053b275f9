"""The findings about a camera after it was set: where it differs from what was asked, and who did it.

`differences` says what is off by more than float32 storage explains, `explain` says which causes (causes.py) explain it. Both
are pure and know no Blender. A cause is told of when what it acts on differs, so that a constraint which leaves the camera
where it belongs is never named; some (animation, libraries, locks) are told of always, since they act later. Rejected: to
remember what was set and when, which undo, linking and scripts would make stale.
"""

import enum
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from ..camera_values import PARTS
from ..pinhole import Pinhole

_FLOAT32 = 2.0**-24  # the relative error of storing a number as float32

# Roundings of 2⁻²⁴ between a float64 rotation and the float32 matrix: three angles of up to π, half of 2⁻²² off each (2 · 3),
# the product of three rotations (3), and for a parent the products with its inverse and with the local matrix (4 each).
LARGEST_TURN = 17 * _FLOAT32
# A location is rounded once, then multiplied by the parent's matrices, twice four roundings.
_LOCATION_ROUNDINGS = 9
# The roundings of a distance: lens, sensor and pixel aspect.
LARGEST_ZOOM = 3 * _FLOAT32
# The roundings of the shift: itself, and its product with the size.
_SHIFT_ROUNDINGS = 2

EYE, VIEW, DISTANCE, CENTER = *PARTS, "center"
POSE, LENS = frozenset({EYE, VIEW}), frozenset({DISTANCE, CENTER})
APPLY_OR_ADOPT = "apply the values again, or adopt the camera as it stands"


class Button(enum.Enum):
    """The remedy of a cause that a button of the panel offers."""

    APPLY_AGAIN = enum.auto()
    DELETE_KEYFRAMES = enum.auto()


@dataclass(frozen=True)
class Cause:
    """Something that may keep a camera from being what its four values say.

    clause : a clause that says what does this, such as "The shift was changed since".
    acts_on : some of EYE, VIEW, DISTANCE, CENTER.
    remedy : a sentence that says what to do about it.
    always : true to tell it even where nothing differs yet.
    mended_by : the button that does it, if there is one.
    """

    clause: str
    acts_on: frozenset[str]
    remedy: str
    always: bool = False
    mended_by: Button | None = None


@dataclass(frozen=True)
class Finding:
    """A finding about a camera.

    cause : None where the words say all.
    differing : in words, what of the camera it explains.
    """

    words: str = ""
    cause: Cause | None = None
    differing: tuple[str, ...] = ()

    @property
    def sentence(self) -> str:
        """The finding as it is printed."""
        if self.cause is None:
            return self.words
        figures = f", {' and '.join(self.differing)}" if self.differing else ""
        return f"{self.cause.clause}{figures}: {self.cause.remedy}"


# The causes where nothing that is known has moved the camera.
_MOVED = Cause("The camera or its parent was moved since", POSE, APPLY_OR_ADOPT, mended_by=Button.APPLY_AGAIN)
_LENS = Cause(
    "The lens, sensor or pixel aspect was changed since", frozenset({DISTANCE}), APPLY_OR_ADOPT, mended_by=Button.APPLY_AGAIN
)
_SHIFT = Cause("The shift was changed since", frozenset({CENTER}), APPLY_OR_ADOPT, mended_by=Button.APPLY_AGAIN)


def differences(
    wanted: Pinhole, read_back: Pinhole, reach: float, length: Callable[[float], str] = "{:.3g}".format
) -> dict[str, str]:
    """The differences beyond what Blender's float32 storage explains: its name → the figures, in words. Pure.

    reach : the largest coordinate that went into the camera's location, world units.
    length : a length in words, with its unit.
    """
    result = {}
    apart = math.dist(wanted.eye, read_back.eye)
    if apart > _LOCATION_ROUNDINGS * _FLOAT32 * reach:
        result[EYE] = f"the eye is {length(apart)} away"
    turn = np.column_stack(wanted.basis()) - np.column_stack(read_back.basis())
    if wanted.mirrored != read_back.mirrored:
        result[VIEW] = "the picture is mirrored"
    elif np.abs(turn).max() > LARGEST_TURN:
        angle = 2 * math.asin(min(1.0, float(np.linalg.norm(turn)) / math.sqrt(8)))
        result[VIEW] = f"the view is turned by {math.degrees(angle):.3g}°"
    if any(abs(a - b) > LARGEST_ZOOM * a for a, b in zip(wanted.distance, read_back.distance, strict=True)):
        result[DISTANCE] = f"the view plane is {read_back.distance[0]:.6g} px away and not {wanted.distance[0]:.6g}"
    allowed = _SHIFT_ROUNDINGS * _FLOAT32 * (max(wanted.width, wanted.height) + max(map(abs, wanted.principal_point)))
    off_center = math.dist(wanted.principal_point, read_back.principal_point)
    if off_center > allowed:
        result[CENTER] = f"the principal point is {off_center:.3g} px away"
    return result


def explain(differing: dict[str, str], causes: Iterable[Cause]) -> list[Finding]:
    """A finding for each cause that explains a difference, and for each difference that none explains. Pure."""
    result, unexplained = [], dict(differing)
    for cause in causes:
        explained = [name for name in differing if name in cause.acts_on]
        if explained or cause.always:
            result.append(Finding(cause=cause, differing=tuple(differing[name] for name in explained)))
        for name in explained:
            unexplained.pop(name, None)
    for cause in (_MOVED, _LENS, _SHIFT):
        left = [name for name in (EYE, VIEW, DISTANCE, CENTER) if name in cause.acts_on & unexplained.keys()]
        if left:
            result.append(Finding(cause=cause, differing=tuple(unexplained[name] for name in left)))
    return result
