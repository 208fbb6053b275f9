"""The judges: each gives a number for how different two pictures are, and 1 is where it says so by itself.

A picture is shown to each as it is used. Ours: geometry and light, the test being several pictures of few samples. The others:
the mean of these beside the reference, with the thresholds of the projects that use them.

- idiff: OpenImageIO's rule as Blender's tests use it, on what a screen shows in 8 bits: more than 1 % of the pixels differ in
  some channel by more than 0.016. Its own evaluation, since a number is wanted where idiff has a verdict.
- SSIM (Wang and others, 2004) on gray as a screen shows it, uniform windows of 7 × 7 as in scikit-image: below 0.97, the
  threshold that a broken build has passed.
- FLIP (Andersson and others, 2020), by its authors' own library: a mean of 0.05.
- z-test: as Mitsuba's tests have it: a z-test of each channel of each pixel by the reference's variance, with Šidák's
  correction for their number at a significance of 1 %; one in 400 may fail.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from statistics import NormalDist

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from viewcam_addon.comparison import geometry, perception, pictures, radiance
from viewcam_addon.image import Image

Array = NDArray[np.float64]

OURS = "ours"


def of_geometry(reference: Image, test: Image, surfaces_at: Callable) -> float:
    """Ours, of geometry: the largest share of what is allowed."""
    comparison = geometry.compare(reference, test, reference.camera, surfaces_at)
    shares = [share for row in comparison.rows for share in row.shares]
    if comparison.systematic:
        shares.append(comparison.systematic.mean / comparison.systematic.tolerance)
    if not (comparison.mismatches_ok and shares):
        shares.append(np.inf)
    return max(shares)


def of_light(reference: Image, tests: Sequence[Image]) -> float:
    """Ours, of light: the largest share of what is allowed."""
    shares = []
    for row in radiance.compare_quantities(reference, tests, reference.camera).rows:
        if row.broken or (row.noise_free and not row.noise_free.ok):
            shares.append(np.inf)
        shares += [float(np.nanmax(np.abs(test.errors) / test.allowed)) for test in row.hypothesis_tests]
    return max(shares)


def idiff(reference: Array, test: Array, _: Array, __: int) -> float:
    apart = np.abs(_screen(test) - _screen(reference)).max(axis=-1)
    return float(np.percentile(apart, 99.0)) / 0.016


def ssim(reference: Array, test: Array, _: Array, __: int) -> float:
    a, b = (sliding_window_view(_screen(side) @ (0.2125, 0.7154, 0.0721), (7, 7)).reshape(-1, 49) for side in (reference, test))
    mean_a, mean_b = a.mean(axis=1), b.mean(axis=1)
    covariance = ((a - mean_a[:, None]) * (b - mean_b[:, None])).sum(axis=1) / 48
    numerator = (2 * mean_a * mean_b + 1e-4) * (2 * covariance + 9e-4)
    denominator = (mean_a**2 + mean_b**2 + 1e-4) * (a.var(axis=1, ddof=1) + b.var(axis=1, ddof=1) + 9e-4)
    return float(1 - (numerator / denominator).mean()) / 0.03


def flip(reference: Array, test: Array, _: Array, __: int) -> float:
    return perception.flip(reference, np.nan_to_num(test))[0] / 0.05


def z_test(reference: Array, test: Array, variance: Array, samples: int) -> float:
    """The largest deviation of pixels, in standard errors, over what chance allows.

    variance : the variance of one sample.
    samples : the samples of the test picture.
    """
    z = np.abs(test - reference) * np.sqrt(samples / np.maximum(variance, 1e-4))
    alpha = 1 - (1 - 0.01) ** (1 / z.size)
    return float(np.percentile(np.nan_to_num(z, nan=np.inf), 99.75)) / NormalDist().inv_cdf(1 - alpha / 2)


RIVALS = {"FLIP": flip, "idiff": idiff, "SSIM": ssim, "z-test": z_test}


def _screen(color: Array) -> Array:
    """sRGB in 256 steps; what is no number is black, as a file of 8 bits has it."""
    return np.round(255 * pictures.on_screen(color, 0.9)) / 255


def without_the_tracers_own(picture: Image) -> Image:
    """The picture as another renderer's file has it."""
    own = ("Magnitude", "Facing", "Variance")
    return replace(picture, passes={name: values for name, values in picture.passes.items() if name not in own})
