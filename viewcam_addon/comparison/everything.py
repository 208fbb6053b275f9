"""The part of a picture that is not modeled, measured by Cycles' picture with everything in it beside the one with stand-ins.

Of geometry two such pictures of one scene hold the same bits wherever the ray of a pixel meets the same surface: what a
stand-in changes is counted exactly. Of light both are noisy, with the same seed, and the tests of light ask of pixels and tiles
whether they differ by more than chance; the first size that finds any is what is counted, so that a small thing is a small
share.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..image import Image
from ..pinhole import Pinhole
from . import hypothesis_tests, noise_free
from .answer import NotModeled, in_the_picture
from .light_verdict import FALSE_ALARMS
from .radiance import VARIANCE_BATCHES
from .sides import Sides, all_sides, samples_of

# Cycles bends normals that graze by rules of its own, so that all of a picture's may be others.
_ALL_BUT_NORMALS = ("Depth", "Position", "UV", "Object Index", "Material Index")


def not_modeled(
    names: Sequence[str],
    pixels: Mapping[str, NDArray[np.bool_]],
    reference: Image,
    tests: Sequence[Image],
    everything: Image | None = None,
    pinhole: Pinhole | None = None,
) -> NotModeled:
    """The part of a picture that is not modeled.

    names : the names of the objects that are not modeled.
    pixels : name → (height, width), true for pixels that show the object, of those that are surfaces in the scene.
    reference, tests : the pictures that were compared.
    everything : Cycles' picture of the seed of the first test, with as many samples, or None where there is none.
    pinhole : the camera where light was compared, None where geometry was.
    """
    if not names:
        return NotModeled()
    changed = None
    if everything is not None and pinhole is not None:
        changed = _changed_light(reference, tests, everything, pinhole)
    elif everything is not None:
        surfaces = np.logical_or.reduce([*pixels.values(), np.zeros(reference["Depth"].shape[:2], bool)])
        changed = _changed_geometry(tests[0], everything, surfaces)
    return in_the_picture(names, pixels, changed, is_lit=pinhole is not None)


def _changed_geometry(test: Image, everything: Image, surfaces: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(height, width): the pixels where some pass has other bits.

    test, everything : the pictures of geometry with stand-ins and without.
    surfaces : (height, width), the pixels that show an object that is not modeled; of all others no normals count.
    """

    def differs(name: str) -> NDArray[np.bool_]:
        before, after = (image.passes[name].view(np.uint32) for image in (test, everything))
        return (before != after).any(axis=-1)

    there = [name for name in (*_ALL_BUT_NORMALS, "Normal") if name in test.passes and name in everything.passes]
    return np.logical_or.reduce([differs(name) & surfaces if name == "Normal" else differs(name) for name in there])


@np.errstate(all="ignore")
def _changed_light(reference: Image, tests: Sequence[Image], everything: Image, pinhole: Pinhole) -> NDArray[np.bool_]:
    """(height, width): the pixels or tiles where Combined differs by more than chance and rounding.

    reference : tells the noise where there is one test alone.
    """
    combined = next(iter(all_sides(reference, tests)))
    seeds = len(tests)
    variance = seeds * (combined.test_variance if seeds > 1 else combined.variance)
    before, after = (image["Combined"][..., :3].astype(np.float64) for image in (tests[0], everything))
    broken = ~(np.isfinite(before).all(axis=-1) & np.isfinite(after).all(axis=-1))
    before, after = (np.where(broken[..., None], 0.0, side) for side in (before, after))
    sides = Sides("Combined", before, after, variance, variance, broken)
    rounding = noise_free.Rounding(pinhole, reference, tests[0], samples_of(reference) or 1)
    freedom = seeds - 1 if seeds > 1 else VARIANCE_BATCHES - 1
    asked = hypothesis_tests.run(sides, rounding.of(sides), (freedom, freedom), FALSE_ALARMS)
    tiles = [test for test in asked if test.size != hypothesis_tests.CONTOURS]
    pixels, *larger = (hypothesis_tests.over_pixels(test.failing, broken.shape, test.size) for test in tiles)
    changed = pixels | broken
    return next((changed | differs for differs in larger if (changed | differs).any()), changed)
