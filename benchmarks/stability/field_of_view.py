"""The view-plane distance d that a camera really has, for the widest and the longest lenses.

A picture of 1000 × 1000 pixels with a field of view from 1e-4° to 179.9999°. The relative error of d is how much too large or
small the picture is: 500 times it is the displacement of the picture's edge in pixels.

Candidates: the lens alone, which Blender clamps to 1 mm without a word; `camera.angle`; and ours, lens and sensor growing
together. Their d is that of Blender's own projection matrix (Object.calc_matrix_camera), whose rounding is theirs. Cycles keeps
the field of view itself in float32: what it makes of our camera is measured in its picture, and has a league of its own.
"""

import math
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import bpy
import numpy as np
from numpy.typing import NDArray

from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender.rendering import cycles
from viewcam_addon.pinhole import Pinhole

from ..charts import Chart, Curve
from .stage import empty_stage, read_elsewhere

Array = NDArray[np.float64]
Setter = Callable[[bpy.types.Scene, bpy.types.Object, float], None]

SIZE, PIXELS = 1000, 32
# Lens, sensor and their quotient, and three roundings in the matrix, each 2⁻²⁴.
STORED = 6 * 2.0**-24


def charts(quick: bool = False) -> tuple[Chart, ...]:
    decades = np.arange(2, -5, -1.0)
    narrow = np.array([90.0, *10.0 ** decades[1:]])
    wide = np.array([90.0, 50.0, *10.0 ** decades[1:]])  # degrees that are missing to 180
    reading = (
        "Read whether a curve rises to the right. With lens and sensor growing together d is right to float32's rounding "
        "however {how} the lens; {others} Cycles rounds the field of view itself: {cycles}"
    )
    return (
        _chart(
            "field-of-view-wide",
            "Field of view towards 180°",
            "180° − field of view [°]",
            wide,
            180.0 - wide,
            reading.format(
                how="wide",
                others="the lens alone is clamped at 1 mm, and the picture stops growing wider.",
                cycles="d is then off by up to 2⁻²⁴ · π over the angle that is missing to 180°.",
            ),
            quick,
        ),
        _chart(
            "field-of-view-narrow",
            "Field of view towards 0°",
            "field of view [°]",
            narrow,
            narrow,
            reading.format(how="long", others="so is it with the lens alone.", cycles="no harm is done here."),
            quick,
        ),
    )


def _chart(name: str, title: str, label: str, x: Array, angles: Array, reading: str, quick: bool) -> Chart:
    # 180° − x has lost what makes the angle wide: the half angle's tangent from what is missing has not.
    missing = "180" in label
    half = np.radians(x) / 2
    distances = SIZE / 2 * (np.tan(half) if missing else 1 / np.tan(half))
    scene, camera = empty_stage(SIZE, SIZE)

    def curve(label: str, setter: Setter, measure: Callable = _matrix_distance, **more: object) -> Curve:
        errors = []
        for distance in distances:
            setter(scene, camera, distance)
            errors.append(abs(measure(scene, camera) / distance - 1))
            camera.data.sensor_width, camera.data.lens, camera.data.sensor_height = 36.0, 50.0, 24.0
        return Curve(label, x, errors, **more)

    curves = [
        curve("camera.lens =, clamped at 1 mm", _lens),
        curve("camera.angle =", _angle),
        curve("apply (ours)", _apply, ours=True),
    ]
    if not quick:
        curves.append(curve("Cycles' picture of our camera", _apply, _cycles_distance, league="Cycles"))
    return Chart(name, title, label, "relative error of d (× 500: pixels at the edge)", tuple(curves), reading, STORED, True)


def _apply(scene: bpy.types.Scene, camera: bpy.types.Object, distance: float) -> None:
    cameras.apply(camera, Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), distance, SIZE, SIZE), scene)


def _lens(_scene: bpy.types.Scene, camera: bpy.types.Object, distance: float) -> None:
    camera.data.lens = distance * camera.data.sensor_width / SIZE


def _angle(_scene: bpy.types.Scene, camera: bpy.types.Object, distance: float) -> None:
    camera.data.angle = 2 * math.atan(SIZE / 2 / distance)


def _matrix_distance(_scene: bpy.types.Scene, camera: bpy.types.Object) -> float:
    matrix = camera.calc_matrix_camera(bpy.context.evaluated_depsgraph_get(), x=SIZE, y=SIZE)
    return matrix[0][0] * SIZE / 2


def _cycles_distance(scene: bpy.types.Scene, camera: bpy.types.Object) -> float:
    """d as Cycles' picture shows it: where on a wall at z = −1 each of 32 × 32 pixels looks."""
    half = SIZE / 2 * camera.data.sensor_width / camera.data.lens / SIZE
    mesh = bpy.data.meshes.new("Wall")
    mesh.from_pydata([(x * half, y * half, -1) for x, y in ((-2, -2), (2, -2), (2, 2), (-2, 2))], [], [(0, 1, 2, 3)])
    wall = bpy.data.objects.new("Wall", mesh)
    scene.collection.objects.link(wall)
    camera.virtual_pinhole.enabled = False  # else its lens would follow the resolution
    scene.render.resolution_x = scene.render.resolution_y = PIXELS
    with TemporaryDirectory() as folder:
        cycles.render(scene, bpy.context.view_layer, camera, Path(folder, "wall.exr"))
        position = read_elsewhere(Path(folder, "wall.exr")).passes["Position"].astype(np.float64)
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    bpy.data.objects.remove(wall)
    from_center = np.arange(PIXELS) + 0.5 - PIXELS / 2
    return SIZE / PIXELS * float(np.mean(from_center / (position[..., 0] / -position[..., 2])))
