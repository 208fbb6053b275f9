"""The roll of the picture as the view comes near to up.

The error of u about the true view axis, against the angle θ between the view and up. The eye is at θ · p and the look-at point
at −up, p being perpendicular to up: so e − l is known to all digits, and θ may be smaller than float64's rounding of e − l.

Candidates, up in any direction: the text's formula in float32 and in float64, Gram–Schmidt (v = up − (up·w) w, u = v × w) in
float64, and ours, compensated. Blender's own are told no up but the world's Z: Vector.to_track_quat and the constraint Track
To. What Blender stores after `apply` is ours rounded to float32, and has a league of its own with them.
"""

from collections.abc import Callable

import bpy
import mathutils
import mpmath
import numpy as np
from numpy.typing import NDArray

from viewcam_addon.blender import camera as cameras
from viewcam_addon.pinhole import Pinhole, basis

from ..charts import Chart, Curve
from . import oracle
from .stage import empty_stage

Array = NDArray[np.float64]
Method = Callable[[Array, Array, Array], Array]

# Both bounds hold at every angle: the basis (pinhole.py), and three angles stored as float32 (tests/blender/test_camera.py).
COMPUTED, STORED = 4e-16, 4e-7
_Z = np.array([0.0, 0.0, 1.0])


def charts(quick: bool = False) -> tuple[Chart, ...]:
    angles = 10.0 ** -np.arange(0, 18)
    trials = 3 if quick else 60
    any_up, z_up = _poses(angles, trials, None), _poses(angles, trials, _Z)
    scene, camera = empty_stage()
    curves = (
        Curve("text's formula, float32", angles, _errors(_naive(np.float32), any_up)),
        Curve("text's formula, float64", angles, _errors(_naive(np.float64), any_up)),
        Curve("Gram–Schmidt, float64", angles, _errors(_gram_schmidt, any_up)),
        Curve("compensated (ours)", angles, _errors(lambda e, l, up: basis(e, l, up)[0], any_up), True),
        Curve("Vector.to_track_quat, up Z", angles, _errors(_each(_track_quat), z_up), league="Blender"),
        Curve("constraint Track To, up Z", angles, _errors(_each(_track_to(camera)), z_up), league="Blender"),
        Curve(
            "Blender's matrix after apply (ours)",
            angles,
            _errors(_each(_applied(scene, camera)), any_up),
            True,
            "Blender",
            STORED,
        ),
    )
    reading = (
        "Read how far to the right a curve stays low. Ours is flat: however close to vertical, the roll is right to the last "
        "bits, and what Blender stores of it to a rounding of float32. Track To is as good, for an up of Z; "
        "the text's formula loses in float64 what the angle costs, and in float32 it has no answer at all."
    )
    return (
        Chart(
            "roll",
            "Roll against the angle from vertical",
            "angle θ between view and up [rad]",
            f"largest error of the roll in {trials} poses [rad]",
            curves,
            reading,
            tie=COMPUTED,
            reverse=True,
        ),
    )


def _poses(angles: Array, trials: int, up: Array | None) -> list[tuple[Array, Array, Array, list]]:
    """Poses of each angle: e, l and up, (n, 3), and the true axes of each, in many digits. up : any direction if None."""
    random = np.random.default_rng(1)
    poses = []
    for angle in angles:
        ups = random.normal(size=(trials, 3)) if up is None else np.tile(up, (trials, 1))
        across = np.cross(ups, random.normal(size=(trials, 3)))
        eyes = angle * across / np.linalg.norm(across, axis=1)[:, None]
        poses.append((eyes, -ups, ups, [oracle.axes(*pose) for pose in zip(eyes, -ups, ups, strict=True)]))
    return poses


def _errors(method: Method, poses: list) -> list[float]:
    """The largest roll error at each angle; nan where the method has no answer for some pose."""
    with np.errstate(all="ignore"):
        result = [method(e, l, up) for e, l, up, _ in poses]
    return [
        max(_roll_error(u, *axes) for u, axes in zip(us, true, strict=True)) if np.isfinite(us).all() else np.nan
        for us, (*_, true) in zip(result, poses, strict=True)
    ]


def _roll_error(u: Array, true_u: oracle.Axis, true_v: oracle.Axis, _true_w: oracle.Axis) -> float:
    with mpmath.workdps(oracle.DIGITS):
        across, upward = (sum(float(a) * b for a, b in zip(u, axis, strict=True)) for axis in (true_u, true_v))
        return float(abs(mpmath.atan2(upward, across)))


def _naive(dtype: type) -> Method:
    def u(e: Array, l: Array, up: Array) -> Array:
        e, l, up = (vector.astype(dtype) for vector in (e, l, up))
        w = (e - l) / np.linalg.norm(e - l, axis=1)[:, None]
        across = np.cross(up, w)
        return across / np.linalg.norm(across, axis=1)[:, None]

    return u


def _gram_schmidt(e: Array, l: Array, up: Array) -> Array:
    w = (e - l) / np.linalg.norm(e - l, axis=1)[:, None]
    v = up - (up * w).sum(axis=1)[:, None] * w
    return np.cross(v / np.linalg.norm(v, axis=1)[:, None], w)


def _each(method: Callable[[Array, Array, Array], Array]) -> Method:
    return lambda e, l, up: np.array([method(*pose) for pose in zip(e, l, up, strict=True)])


def _track_quat(e: Array, l: Array, _up: Array) -> Array:
    quaternion = mathutils.Vector(l - e).to_track_quat("-Z", "Y")
    return np.array(quaternion.to_matrix())[:, 0]


def _track_to(camera: bpy.types.Object) -> Callable[[Array, Array, Array], Array]:
    target = bpy.data.objects.new("Target", None)
    camera.users_collection[0].objects.link(target)

    def u(e: Array, l: Array, _up: Array) -> Array:
        constraint = camera.constraints.new("TRACK_TO")
        constraint.target, constraint.track_axis, constraint.up_axis = target, "TRACK_NEGATIVE_Z", "UP_Y"
        camera.location, target.location = e, l
        actual = _evaluated_u(camera)
        camera.constraints.remove(constraint)
        return actual

    return u


def _applied(scene: bpy.types.Scene, camera: bpy.types.Object) -> Callable[[Array, Array, Array], Array]:
    def u(e: Array, l: Array, up: Array) -> Array:
        size = scene.render.resolution_x, scene.render.resolution_y
        cameras.apply(camera, Pinhole(tuple(e), tuple(l), tuple(up), 1000.0, *size), scene)
        return _evaluated_u(camera)

    return u


def _evaluated_u(camera: bpy.types.Object) -> Array:
    bpy.context.view_layer.update()
    return np.array(camera.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world)[:3, 0]
