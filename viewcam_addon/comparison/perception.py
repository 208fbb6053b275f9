"""The difference to an eye: figures that are told, and judge nothing.

relMSE is what papers on rendering compare noise by: the mean of (test − reference)² / (reference² + ε), here with an ε of a
hundredth of the mean square, so that it does not depend on the exposure. FLIP (Andersson et al., FLIP: A Difference Evaluator
for Alternating Images, 2020) estimates what is noticed when two pictures are swapped on a screen, as the report does: so it is
given what the report shows, one exposure for both, in sRGB. Rejected: its HDR variant, whose library ends the process at a
black picture.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import pictures
from .sides import Sides
from .tolerances import Array


@dataclass(frozen=True)
class Appearance:
    """The difference of two pictures as an eye sees it.

    relmse : the relMSE of Combined.
    expected_relmse : the relMSE of the noise that both sides tell of, None where one does not tell.

    flip : FLIP's mean over the picture, 0 to 1; None where the package flip-evaluator is not installed.
    """

    relmse: float
    expected_relmse: float | None
    flip: float | None


def appearance(combined: Sides) -> tuple[Appearance, NDArray[np.float32] | None]:
    """The figures, and FLIP's map (height, width)."""
    mean, by_pixel = flip(combined.reference, combined.test)
    noise = combined.variance + combined.test_variance
    expected = _relative(noise, combined.reference) if np.isfinite(noise).all() else None
    return Appearance(_relative(combined.difference**2, combined.reference), expected, mean), by_pixel


def _relative(squares: Array, reference: Array) -> float:
    power = reference**2
    return float((squares / np.maximum(power + 0.01 * power.mean(), np.finfo(float).tiny)).mean())


def flip(reference: Array, test: Array) -> tuple[float | None, NDArray[np.float32] | None]:
    """FLIP of light (height, width, 3): its mean, and its map (height, width)."""
    try:
        import flip_evaluator
    except ImportError:
        return None, None
    bright = pictures.brightness(reference)
    on_screen = [pictures.on_screen(side, bright).astype(np.float32) for side in (reference, test)]
    by_pixel, mean, _ = flip_evaluator.evaluate(*on_screen, "LDR", applyMagma=False)
    return float(mean), by_pixel[..., 0]
