"""The error that Blender's float32 channels add to a pose, and to one in gimbal lock.

A camera rolled on its side looks along its own X axis, and the middle one of its three Euler angles comes near a right angle:
cos β is the distance from gimbal lock. The error is that of the largest entry of the matrix that Blender evaluates, after it
was set in each of the ways that Blender offers, and in ours: location and Euler angles or a quaternion, computed in float64.

`matrix_parent_inverse` stores the matrix itself and is the most exact of all. It was rejected, and has a league of its own,
because the location and rotation that the artist sees would then say nothing.
"""

from collections.abc import Callable

import bpy
import mathutils
import numpy as np
from numpy.typing import NDArray

from viewcam_addon.blender import camera as cameras
from viewcam_addon.pinhole import Pinhole

from ..charts import Chart, Curve
from .stage import empty_stage

Array = NDArray[np.float64]
Setter = Callable[[bpy.types.Scene, bpy.types.Object, Pinhole], None]

# Three angles of up to π or four numbers of a quaternion stored in float32, and the three products that make the matrix of
# them: 9 roundings (tests/blender/test_camera.py).
STORED = 9 * 2.0**-24


def charts(quick: bool = False) -> tuple[Chart, ...]:
    scene, camera = empty_stage()
    distances = 10.0 ** -np.arange(0.0, 9.0)
    trials = 4 if quick else 200
    poses = [_poses(distance, trials) for distance in distances]

    def curve(name: str, mode: str, setter: Setter, **more: object) -> Curve:
        return Curve(name, distances, [_largest_error(scene, camera, mode, setter, batch) for batch in poses], **more)

    curves = (
        curve("matrix_world =, XYZ", "XYZ", _matrix_world),
        curve("matrix_world =, quaternion", "QUATERNION", _matrix_world),
        curve("location and Matrix.to_euler", "XYZ", _to_euler),
        curve("matrix_parent_inverse", "XYZ", _parent_inverse, league="hides the channels"),
        curve("apply, Euler (ours)", "XYZ", _apply, ours=True),
        curve("apply, quaternion (ours)", "QUATERNION", _apply, ours=True),
    )
    reading = (
        "Read whether a curve rises to the right. Blender's own conversion turns the rounding of a matrix into the angles of "
        "an Euler camera near gimbal lock; ours stays at a few roundings of float32. matrix_parent_inverse is better still, "
        "but leaves the artist with channels that say nothing."
    )
    return (
        Chart(
            "pose-storage",
            "Storing a pose in Blender, towards gimbal lock",
            "cos β, the distance from gimbal lock",
            f"largest error of a matrix entry in {trials} poses",
            curves,
            reading,
            tie=STORED,
            reverse=True,
        ),
    )


def _poses(distance: float, trials: int) -> list[Pinhole]:
    """Random poses whose u has the world's Z as its component but for `distance`: the second Euler angle's cosine."""
    random = np.random.default_rng(2)
    poses = []
    for turn in random.uniform(-np.pi, np.pi, size=(trials, 2)):
        sine = np.sqrt(1 - distance**2)
        u = np.array([distance * np.cos(turn[0]), distance * np.sin(turn[0]), sine])
        across = np.cross(u, (np.cos(turn[1]), np.sin(turn[1]), 0.0))
        w = across / np.linalg.norm(across)
        eye = random.normal(0, 5, 3)
        poses.append(Pinhole(tuple(eye), tuple(eye - w), tuple(np.cross(w, u)), 1000.0, 1000, 1000))
    return poses


def _largest_error(scene: bpy.types.Scene, camera: bpy.types.Object, mode: str, setter: Setter, poses: list[Pinhole]) -> float:
    worst = 0.0
    for pinhole in poses:
        camera.rotation_mode = mode
        setter(scene, camera, pinhole)
        bpy.context.view_layer.update()
        values = np.array(camera.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world)[:3, :3]
        worst = max(worst, float(np.abs(values - np.column_stack(pinhole.basis())).max()))
        camera.matrix_parent_inverse.identity()
        camera.matrix_basis.identity()
    return worst


def _matrix(pinhole: Pinhole) -> mathutils.Matrix:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = np.column_stack(pinhole.basis()), pinhole.eye
    return mathutils.Matrix(matrix)


def _matrix_world(_scene: bpy.types.Scene, camera: bpy.types.Object, pinhole: Pinhole) -> None:
    camera.matrix_world = _matrix(pinhole)


def _to_euler(_scene: bpy.types.Scene, camera: bpy.types.Object, pinhole: Pinhole) -> None:
    camera.location, camera.rotation_euler = pinhole.eye, _matrix(pinhole).to_euler("XYZ")


def _parent_inverse(_scene: bpy.types.Scene, camera: bpy.types.Object, pinhole: Pinhole) -> None:
    """The parent is an empty that stands still at the origin."""
    if camera.parent is None:
        camera.parent = bpy.data.objects.new("Parent", None)
        camera.users_collection[0].objects.link(camera.parent)
    camera.location, camera.rotation_euler = (0, 0, 0), (0, 0, 0)
    camera.matrix_parent_inverse = _matrix(pinhole)


def _apply(scene: bpy.types.Scene, camera: bpy.types.Object, pinhole: Pinhole) -> None:
    camera.parent = None
    cameras.apply(camera, pinhole, scene)
