"""Errors in the picture where camera and scene stand far from the origin, from 1 to 1e9 units.

A place at (K, K, K); the camera stands some ten units beside it, d = 150 px. Two leagues, in pixels, the median.

Arithmetic: 200 points of an object are projected, against 60 digits of mpmath on the same float64 numbers. Candidates: the
object's vertices taken to world space and then projected, in float32 (as a renderer does) and in float64; and ours, the
tracer's core, which takes an origin near the eye off the matrix before a vertex is added.

Cycles: two objects and a ground are rendered, and each pixel's position must project to its center (`viewcam check`): plain,
and with the origin moved to the eye (`viewcam check --recenter`). At 1e9 neighboring float32 numbers are 64 apart, and in the
plain picture nothing is left that could be compared.
"""

import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory

import bpy
import mpmath
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from viewcam_addon import image
from viewcam_addon.blender.camera import apply
from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.comparison.geometry import compare
from viewcam_addon.jobs.job import Job
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import Tracer, render
from viewcam_addon.tracer.scene import Mesh, Object, Scene

from ..charts import Chart, Curve
from .stage import empty_stage

Array = NDArray[np.float64]

WIDTH, HEIGHT, DISTANCE = 120, 90, 150
# Picture coordinates up to 120 in float64: x and z by three products and their sums each, one quotient, d and the center.
ARITHMETIC = 16 * 2.0**-53 * WIDTH
# The error by one rounding near the origin: 2⁻²⁴ · d · (M + t)/z with M and t of at most 30 and z of at least 5 units.
NEAR_ORIGIN = 2.0**-24 * DISTANCE * 60 / 5


def charts(quick: bool = False) -> tuple[Chart, ...]:
    places = 10.0 ** np.arange(0, 10, 3 if quick else 1)
    curves = [*_arithmetic(places, 20 if quick else 200), *_cycles(places)]
    reading = (
        "Read how the curves rise with the distance from the origin. What computes in world coordinates loses 2⁻²⁴ or 2⁻⁵³ of "
        "them, seen through d/z; Cycles is off by half a pixel at 1e6. The tracer takes the eye off first and stays as exact "
        "as it was, and moving the origin to the eye gives back all that Cycles lost."
    )
    return (
        Chart(
            "far-from-origin",
            "Far from the origin",
            "coordinates of camera and scene [units]",
            "median error [px], d = 150 px, 10 units away",
            tuple(curves),
            reading,
            NEAR_ORIGIN,
        ),
    )


def _pinhole(place: float) -> Pinhole:
    eye, look_at = (tuple(place + offset for offset in point) for point in ((6.2, -7.3, 4.1), (0.1, 0.2, 0.3)))
    return Pinhole(eye, look_at, (0.0, 0.0, 1.0), DISTANCE, WIDTH, HEIGHT)


def _arithmetic(places: Array, count: int) -> list[Curve]:
    points = np.random.default_rng(8).uniform(-2, 2, (count, 3))
    errors: dict[str, list[float]] = {}
    for place in places.tolist():
        pinhole, matrix = _pinhole(place), np.eye(4)
        matrix[:3, 3] = place
        exact = _exactly(pinhole, matrix, points)
        for name, method in METHODS.items():
            off = np.array(method(pinhole, matrix, points)) - exact
            errors.setdefault(name, []).append(float(np.median(np.hypot(*off))))
    return [
        Curve(name, places, values, ours="ours" in name, league="arithmetic", tie=ARITHMETIC) for name, values in errors.items()
    ]


_SMALL = 1e-7
"""The size of the triangles that stand for points: float32's digits of a place on one are 1e-14 units."""


def _relative_to_the_eye(pinhole: Pinhole, matrix: Array, points: Array) -> Array:
    """(2, n) columns and rows by the tracer: round each point stands a small triangle, whose UV tells what a pixel shows.

    What is seen where the point must be is as far from the point as the point's picture is from there.
    """
    u, v, _ = pinhole.basis()
    corners = points[:, None] + _SMALL * np.array([-u - v, 2 * u - v, 2 * v - u])
    uvs = np.tile(np.array([[0, 0], [1, 0], [0, 1]], np.float32), (len(points), 1, 1))
    places = _exactly(pinhole, matrix, points)
    result = []
    for triangle, uv, (column, row) in zip(corners, uvs, places.T, strict=True):
        mesh = Mesh(triangle, np.array([[0, 1, 2]], np.int32), np.zeros(1, np.int32), corner_uvs=uv[None])
        tracer = Tracer(Scene(pinhole, {"point": mesh}, (Object("point", "point", matrix),)), 1)
        (second, third, _), (depth,) = (tracer.surface_at([0], [0], column, row)[name][0] for name in ("UV", "Depth"))
        weights = [mpmath.mpf(1) - float(second) - float(third), mpmath.mpf(float(second)), mpmath.mpf(float(third))]
        with mpmath.workdps(60):
            seen = [mpmath.fdot(weights, [mpmath.mpf(float(x)) for x in triangle[:, axis]]) for axis in range(3)]
            result.append(_projected(pinhole, matrix, seen) if depth < image.BACKGROUND_DEPTH else (float("nan"),) * 2)
    return 2 * places - np.array(result).T


def _in_world_space(kind: type) -> object:
    """A projection by world coordinates, in arithmetic of this kind; the basis is exact."""

    def project(pinhole: Pinhole, matrix: Array, points: Array) -> Array:
        world = points.astype(kind) @ matrix[:3, :3].T.astype(kind) + matrix[:3, 3].astype(kind)
        axes = np.stack(pinhole.basis()).astype(kind)
        right, up, back = axes @ (world - np.array(pinhole.eye, kind)).T
        with np.errstate(all="ignore"):  # the point may be rounded into the eye
            across, upward = right / -back, up / -back
        (cx, cy), (dx, dy) = pinhole.principal_point, pinhole.distance
        return np.stack([cx + dx * across, cy + dy * upward]).astype(np.float64)

    return project


METHODS = {
    "world space in float32": _in_world_space(np.float32),
    "world space in float64": _in_world_space(np.float64),
    "tracer: relative to the eye (ours)": _relative_to_the_eye,
}


def _exactly(pinhole: Pinhole, matrix: Array, points: Array) -> Array:
    """(2, n) columns and rows, rounded once."""
    return np.array([_projected(pinhole, matrix, point) for point in points.tolist()]).T


def _projected(pinhole: Pinhole, matrix: Array, point: list) -> tuple[float, float]:
    with mpmath.workdps(60):
        e, l, up = (mpmath.matrix(list(vector)) for vector in (pinhole.eye, pinhole.look_at, pinhole.up))
        w = _unit(e - l)
        u = _unit(_cross(up, w))
        v = _cross(w, u)
        relative = mpmath.matrix(point) + mpmath.matrix(matrix[:3, 3].tolist()) - e
        right, up_, forward = _dot(relative, u), _dot(relative, v), -_dot(relative, w)
        return float(WIDTH / 2 + DISTANCE * right / forward), float(HEIGHT / 2 + DISTANCE * up_ / forward)


def _dot(a: mpmath.matrix, b: mpmath.matrix) -> mpmath.mpf:
    return sum(a[i] * b[i] for i in range(3))


def _cross(a: mpmath.matrix, b: mpmath.matrix) -> mpmath.matrix:
    return mpmath.matrix([a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)])


def _unit(vector: mpmath.matrix) -> mpmath.matrix:
    return vector / mpmath.sqrt(_dot(vector, vector))


def _cycles(places: Array) -> list[Curve]:
    """The median of a check, plain and recentered; nan where no pixel can be compared."""
    methods = {"Cycles": False, "Cycles, recentered (ours)": True}
    exported = {}
    with TemporaryDirectory() as name:
        for number, place in enumerate(places.tolist()):
            _set_stage(place)
            for method, recenter in methods.items():
                path = Path(name, f"{number}-{recenter}.exr")
                exported[method, place] = path, jobs.both_sides(Job(recenter=recenter), [path])
        with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:  # where there is no Blender
            pictures = list(pool.map(image.read, [path for path, _ in exported.values()]))
    errors: dict[str, list[float]] = {method: [] for method in methods}
    for (method, _), (_, scene), picture in zip(exported, exported.values(), pictures, strict=True):
        position = compare(image.Image(render(scene)), picture, scene.camera).rows[0]
        errors[method].append(position.values[0] if position.count else float("nan"))
    return [Curve(method, places, errors[method], ours=recenter, league="Cycles") for method, recenter in methods.items()]


def _set_stage(place: float) -> None:
    """A ground, a monkey and a ball; the objects stand where float32 can hold it."""
    scene, camera = empty_stage(WIDTH, HEIGHT)
    where = (place, place, place)
    bpy.ops.mesh.primitive_grid_add(size=24, x_subdivisions=24, y_subdivisions=24, location=where)
    bpy.ops.mesh.primitive_monkey_add(size=4, location=where)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4, radius=3, location=where)
    bpy.context.object.data.transform(Matrix.Translation((-4, 2, 1)))
    apply(camera, _pinhole(place), scene)
