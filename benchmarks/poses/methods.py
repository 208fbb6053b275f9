"""Formulas of a basis, what they answer and how long each way to call them takes.

Each is given poses in numbers of its own: arrays, tuples, mathutils' float32 vectors, objects. Track To takes the time of one
view_layer.update for all of them, without that of placing them. What a truth of many digits takes is there for comparison.
"""

import math
from collections.abc import Callable

import bpy
import mathutils
import numpy as np
from numpy.typing import NDArray

from viewcam_addon.pinhole import Pinhole, basis

from .. import race
from ..stability import oracle
from ..stability.stage import empty_stage

Array = NDArray[np.float64]
Triple = tuple[float, float, float]
Axes = tuple[Triple, Triple, Triple]
Method = Callable[[Array, Array, Array], Array]
"""(n, 3) each of eye, look-at and up to (n, 3, 3): u, v and w."""

# Poses that are timed.
_AT_ONCE, _ONE_AT_A_TIME, _OBJECTS, _TRUTHS = 1_000_000, 2_000, 1_000, 100

OURS = "ours, compensated"
FLOAT64, FLOAT32, SINGLE = "text's formula, NumPy float64", "text's formula, NumPy float32", "text's formula, plain floats"
VECTOR, TRACK_QUAT, TRACK_TO = "text's formula, mathutils", "Vector.to_track_quat, up Z", "constraint Track To, up Z"
TRUTH = f"mpmath, {oracle.DIGITS} digits"
WORLD_Z = (TRACK_QUAT, TRACK_TO)


def _text(dtype: type) -> Method:
    def axes(e: Array, l: Array, up: Array) -> Array:
        e, l, up = (vectors.astype(dtype, copy=False) for vectors in (e, l, up))
        w = e - l
        w /= np.linalg.norm(w, axis=1)[:, None]
        u = np.cross(up, w)
        u /= np.linalg.norm(u, axis=1)[:, None]
        return np.stack([u, np.cross(w, u), w], axis=1)

    return axes


def _each(method: Callable, vector: Callable) -> Method:
    return lambda e, l, up: np.array(
        [method(*map(vector, pose)) for pose in zip(e.tolist(), l.tolist(), up.tolist(), strict=True)]
    )


def _ours_of_one(e: Triple, l: Triple, up: Triple) -> Axes:
    return Pinhole(e, l, up, 1000.0, 1920, 1080).axes()


def _text_of_one(e: Triple, l: Triple, up: Triple) -> Axes:
    w = _unit_of_one((e[0] - l[0], e[1] - l[1], e[2] - l[2]))
    u = _unit_of_one(_cross(up, w))
    return u, _cross(w, u), w


def _cross(a: Triple, b: Triple) -> Triple:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _unit_of_one(a: Triple) -> Triple:
    size = math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]) or math.nan
    return a[0] / size, a[1] / size, a[2] / size


def _text_of_vectors(e: mathutils.Vector, l: mathutils.Vector, up: mathutils.Vector) -> tuple[mathutils.Vector, ...]:
    w = (e - l).normalized()
    u = up.cross(w).normalized()
    return u, w.cross(u), w


def _track_quat(e: mathutils.Vector, l: mathutils.Vector, _up: mathutils.Vector) -> mathutils.Matrix:
    return (l - e).to_track_quat("-Z", "Y").to_matrix().transposed()


def _track_to(e: Array, l: Array, _up: Array) -> Array:
    update, objects = _tracking(e, l)
    update()
    return np.array([np.array(thing.matrix_world)[:3, :3].T for thing in objects])


def _tracking(e: Array, l: Array) -> tuple[Callable[[], None], list]:
    """Objects that track targets, in a scene of their own, and what evaluates all of them anew."""
    scene, _ = empty_stage()
    objects = []
    for eye, look_at in zip(e.tolist(), l.tolist(), strict=True):
        thing, target = (bpy.data.objects.new(name, None) for name in ("Eye", "Target"))
        for empty, place in ((thing, eye), (target, look_at)):
            scene.collection.objects.link(empty)
            empty.location = place
        constraint = thing.constraints.new("TRACK_TO")
        constraint.target, constraint.track_axis, constraint.up_axis = target, "TRACK_NEGATIVE_Z", "UP_Y"
        objects.append(thing)
    bpy.context.view_layer.update()

    def update() -> None:
        for thing in objects:
            thing.update_tag()
        bpy.context.view_layer.update()

    return update, objects


METHODS: dict[str, Method] = {
    OURS: lambda e, l, up: np.stack(basis(e, l, up), axis=1),
    FLOAT64: _text(np.float64),
    FLOAT32: _text(np.float32),
    SINGLE: _each(_text_of_one, tuple),
    VECTOR: _each(_text_of_vectors, mathutils.Vector),
    TRACK_QUAT: _each(_track_quat, mathutils.Vector),
    TRACK_TO: _track_to,
    TRUTH: lambda e, l, up: np.array([oracle.rounded(oracle.axes(*pose))[0] for pose in zip(e, l, up, strict=True)]),
}


def times(divisor: int, rounds: int) -> dict[str, dict[str, list[float]]]:
    """Method → way to call it → seconds of a pose in each round. divisor : of the numbers of poses."""
    rng = np.random.default_rng(4)
    many = rng.normal(size=(3, _AT_ONCE // divisor, 3))
    one, objects, truths = (many[:, : max(10, count // divisor)] for count in (_ONE_AT_A_TIME, _OBJECTS, _TRUTHS))
    tuples = [tuple(map(tuple, pose)) for pose in one.transpose(1, 0, 2).tolist()]
    vectors = [tuple(map(mathutils.Vector, pose)) for pose in tuples]
    update, _ = _tracking(objects[0], objects[1])

    def loop(method: Callable, poses: list) -> Callable[[], None]:
        def run() -> None:
            for e, l, up in poses:
                method(e, l, up)

        return run

    at_once, single = f"{len(many[0]):,} at once", "one at a time"
    ways = {
        (OURS, at_once): (lambda: basis(*many), many[0]),
        (OURS, single): (loop(_ours_of_one, tuples), tuples),
        (FLOAT64, at_once): (lambda: METHODS[FLOAT64](*many), many[0]),
        (FLOAT64, single): (loop(lambda *pose: METHODS[FLOAT64](*pose), list(one.transpose(1, 0, 2)[:, :, None])), tuples),
        (FLOAT32, at_once): (lambda: METHODS[FLOAT32](*many.astype(np.float32)), many[0]),
        (SINGLE, single): (loop(_text_of_one, tuples), tuples),
        (VECTOR, single): (loop(_text_of_vectors, vectors), vectors),
        (TRACK_QUAT, single): (loop(_track_quat, vectors), vectors),
        (TRACK_TO, f"{len(objects[0]):,} at once"): (update, objects[0]),
        (TRUTH, single): (loop(oracle.axes, list(truths.transpose(1, 0, 2))), truths[0]),
    }
    seconds = race.run({way: race.timed(work) for way, (work, _) in ways.items()}, rounds)
    measured: dict[str, dict[str, list[float]]] = {}
    for (method, way), (_, poses) in ways.items():
        measured.setdefault(method, {})[way] = [each / len(poses) for each in seconds[method, way]]
    return measured
