"""A room with a ball, a box and a tilted board, in two frames: the scenes that labels are tried on."""

import numpy as np
import pytest

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.scene import Mesh, Object, Scene, Spheres

CAMERA = Pinhole((1.0, -7.0, 3.0), (0.2, 0, 0.8), (0, 0, 1), (70, 75), 64, 48, principal_point=(30, 25))


def mesh(vertices, triangles):
    return Mesh(np.array(vertices, float), np.array(triangles, np.int32), np.zeros(len(triangles), np.int32))


def moved(x=0.0, y=0.0, z=0.0, turn=0.0, scale=1.0):
    matrix = np.eye(4)
    matrix[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    matrix[:3, :3] *= scale
    matrix[:3, 3] = x, y, z
    return matrix


CUBE = mesh(
    [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)],
    np.reshape(
        [0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1, 2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3], (-1, 3)
    ),
)
FLOOR = mesh([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], [(0, 1, 2), (0, 2, 3)])
BALL = Spheres(np.array([[0.0, 0, 0], [0, 0, 1.1]]), np.array([0.7, 0.4]), np.zeros(2, np.int32))


def room(camera=CAMERA, ball=None, cubes=None, geometries=None):
    """Cubes stand on the floor; one of them is behind the ball."""
    cubes = np.array([moved(1.6, 0.5, 0.4, 0.3, 0.4), moved(0, 2, 0.8, 0.1, 0.8)]) if cubes is None else cubes
    return Scene(
        camera,
        {"floor": FLOOR, "ball": BALL, "cube": CUBE} | (geometries or {}),
        (
            Object("Floor", "floor", np.eye(4), 1, (5,)),
            Object("Ball", "ball", moved(z=0.7) if ball is None else ball, 2, (6,)),
            Object("Cube", "cube", cubes, 3, (7,)),
        ),
        clip=(0.1, 100.0),
    )


@pytest.fixture
def scene():
    return room()
