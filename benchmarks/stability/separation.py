"""Eye and look-at close together and far apart: no overflow, no underflow.

The largest error of a component of (u, v, w) against |e − l|, whose powers of ten run over nearly all of float64. Eye and
look-at are about as far from the origin as from one another, and up points anywhere. What coordinates that are large beside
|e − l| cost is another sweep (far_from_origin.py).

Candidates: the text's formula in float32 and in float64, with the root of the sum of squares (`numpy.linalg.norm` is no other);
in float64 after a division by the largest component, the usual remedy; Blender's mathutils, which stores float32 and makes
|a| = 0 of a short vector; and ours, scaled by a power of two and compensated.
"""

from collections.abc import Callable

import bpy  # noqa: F401  (brings mathutils along)
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from viewcam_addon.pinhole import basis

from ..charts import Chart, Curve
from . import oracle

Array = NDArray[np.float64]
Basis = tuple[Array, Array, Array]
Method = Callable[[Array, Array, Array], Basis]

COMPUTED = 4e-16  # the bound of pinhole.py, at any scale


def charts(quick: bool = False) -> tuple[Chart, ...]:
    exponents = np.arange(-300, 301, 50 if quick else 10)
    trials = 5 if quick else 60
    poses = [_poses(10.0**exponent, trials) for exponent in exponents]
    curves = (
        Curve("text's formula, float32", exponents, _errors(_naive(np.float32), poses)),
        Curve("text's formula, float64", exponents, _errors(_naive(np.float64), poses)),
        Curve("largest component first, float64", exponents, _errors(_scaled, poses)),
        Curve("mathutils, Vector.normalized", exponents, _errors(_mathutils, poses)),
        Curve("power of two, compensated (ours)", exponents, _errors(basis, poses), ours=True),
    )
    reading = (
        "Read where a curve leaves the floor: squares leave float32's range beyond 1e±19 and float64's beyond 1e±154, and the "
        "axes are gone with them. Ours is flat, and closer than dividing by the largest component first, which is flat too."
    )
    return (
        Chart(
            "separation",
            "Eye and look-at close together and far apart",
            "log₁₀ |e − l|",
            f"largest error of an axis' component in {trials} poses",
            curves,
            reading,
            tie=COMPUTED,
            log_x=False,  # no axis of matplotlib's reaches from 1e-300 to 1e300
        ),
    )


def _poses(separation: float, trials: int) -> tuple[Array, Array, Array, Array]:
    """e, l and up, (n, 3) each, and the true axes (n, 3, 3), rounded to float64."""
    random = np.random.default_rng(1)
    eye, look_at, up = random.normal(size=(3, trials, 3))
    eye, look_at = eye * separation, look_at * separation
    axes = [oracle.axes(*pose) for pose in zip(eye, look_at, up, strict=True)]
    return eye, look_at, up, np.array(axes, dtype=np.float64)


def _errors(method: Method, poses: list) -> list[float]:
    """The largest error at each separation; nan where the method has no answer for some pose."""
    with np.errstate(all="ignore"):
        return [float(np.abs(np.stack(method(e, l, up), axis=1) - true).max()) for e, l, up, true in poses]


def _naive(dtype: type) -> Method:
    def axes(e: Array, l: Array, up: Array) -> Basis:
        e, l, up = (vector.astype(dtype) for vector in (e, l, up))
        return _from_view(e - l, up)

    return axes


def _scaled(e: Array, l: Array, up: Array) -> Basis:
    apart = e - l
    return _from_view(apart / np.abs(apart).max(axis=1)[:, None], up)


def _from_view(apart: Array, up: Array) -> Basis:
    w = apart / np.linalg.norm(apart, axis=1)[:, None]
    across = np.cross(up, w)
    u = across / np.linalg.norm(across, axis=1)[:, None]
    return u, np.cross(w, u), w


def _mathutils(e: Array, l: Array, up: Array) -> Basis:
    axes = []
    for eye, look_at, upward in zip(e, l, up, strict=True):
        w = (Vector(eye) - Vector(look_at)).normalized()
        u = Vector(upward).cross(w).normalized()
        axes.append((u, w.cross(u), w))
    return tuple(np.array(axes).transpose(1, 0, 2))
