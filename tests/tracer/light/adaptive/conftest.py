"""Small scenes for pictures of a wanted error."""

import numpy as np
import pytest

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.scene.lamps import Area, Sun, World
from viewcam_addon.tracer.scene.materials import Color, sum_of

CAMERA = Pinhole((0, -6, 3), (0, 0, 0.6), (0, 0, 1), 84, 72, 48)
SUN = Sun("sun", towards=(0.5, -0.6, 1), irradiance=(3, 3, 2.7))


@pytest.fixture(scope="session")
def floor(make_mesh):
    """floor(height) → Mesh: a square as large as anything here, at a height."""

    def build(height=0.0):
        corners = [(-50, -50, height), (50, -50, height), (50, 50, height), (-50, 50, height)]
        return make_mesh(corners, [(0, 1, 2), (0, 2, 3)])

    return build


@pytest.fixture(scope="session")
def sunny(make_lit, floor, make_spheres):
    """sunny(**light) → Scene: spheres on a floor, under a sun of no size."""
    things = (
        (floor(), sum_of(diffuse=Color((0.6, 0.7, 0.8)))),
        (
            make_spheres([(-1, 0, 0.8), (1, 0.5, 0.6)], [0.8, 0.6]),
            sum_of(diffuse=Color((0.8, 0.3, 0.2))),
        ),
    )

    def build(**light):
        return make_lit(light.pop("camera", CAMERA), *things, **{"lamps": (SUN,), **light})

    return build


@pytest.fixture(scope="session")
def soft(sunny):
    """The sunny scene under an area lamp and a sky."""
    matrix = np.eye(4)
    matrix[:3, 3] = (1, -1, 4)
    lamp = Area("area", matrix=matrix, size=(2, 2), power=(150, 150, 150))
    return sunny(lamps=(lamp,), world=World((0.2, 0.25, 0.3)))
