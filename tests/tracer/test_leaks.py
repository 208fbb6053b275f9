"""Rays at shared edges and vertices of closed bodies: none gets through, and none is stopped by what it passes.

Bodies from 1e-6 to 1e6, up to 1e7 away from the world's origin, in the world's own hierarchy and as instances, and spheres.
VIEWCAM_LEAK_RAYS is the number of rays of each case; a run of 10⁹ in all takes `VIEWCAM_LEAK_RAYS=8000000` and 20 minutes.
"""

import os

import numpy as np
import pytest

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.native import CoreScene
from viewcam_addon.tracer.scene import Mesh, Object, Scene, Spheres

CAMERA = Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 10, 8, 8)
RAYS = int(os.environ.get("VIEWCAM_LEAK_RAYS", "10000"))
BATCH = 50_000
INSTANCES = 1 << 19
"""Triangles that the core writes out where instances could stand for them (core/scene.h); more are placed, not copied."""
# Where float64 leaves a body: 1e-6 at 1e7 is 500 numbers across.
PLACES = [(scale, offset) for scale in (1e-6, 1e-3, 1.0, 1e3, 1e6) for offset in (0.0, 1e3, 1e7) if scale > 1e-13 * offset]
TOWARDS = np.array([1.0, -0.7, 0.4])
BODIES = ["merged", "instance"]


class Body:
    """A closed ball, or a sphere, of radius 1 that a matrix places, in the core: alone, or as the first of many instances."""

    def __init__(self, geometry: Mesh | Spheres, body: str, matrix: np.ndarray) -> None:
        self.matrix, scale = matrix, np.abs(matrix[:3, :3]).max()
        count = INSTANCES // len(geometry.materials) + 2 if body == "instance" else 1
        objects = []
        for number in range(count):
            placed = matrix.copy()
            placed[0, 3] += 100 * scale * number
            objects.append(Object(f"body {number}", "body", placed))
        self.core = CoreScene(Scene(CAMERA, {"body": geometry}, tuple(objects)), 1)

    def world(self, points: np.ndarray) -> np.ndarray:
        return points @ self.matrix[:3, :3].T + self.matrix[:3, 3]

    def hits(self, origins: np.ndarray, ends: np.ndarray) -> int:
        """The number of rays to these ends that meet it: single, in packets and asking for a light, a third of them each."""
        rays = self.core.rays(origins, ends - origins, farthest=2.0)
        single, packets, lights = np.array_split(rays, 3)
        _, of_single, _ = self.core.closest(single, packets=False)
        _, of_packets, _ = self.core.closest(packets)
        return sum(int(met.sum()) for met in (of_single >= 0, of_packets >= 0, self.core.occluded(lights)))


def placing(scale: float, offset: float) -> np.ndarray:
    matrix = np.diag([scale, scale, scale, 1.0])
    matrix[:3, 3] = TOWARDS * offset
    return matrix


def batches(seed: int):
    """(random numbers, rays) until there were `RAYS`."""
    rng = np.random.default_rng(seed)
    for first in range(0, RAYS, BATCH):
        yield rng, min(BATCH, RAYS - first)


@pytest.mark.parametrize(("scale", "offset"), PLACES)
@pytest.mark.parametrize("body", [*BODIES, "turned instance"])
def test_no_ray_from_inside_a_closed_ball_leaves_it_at_an_edge_or_a_vertex(closed_ball, random_matrix, scale, offset, body):
    mesh, matrix = closed_ball(40 if body == "merged" else 60), placing(scale, offset)
    if body == "turned instance":
        matrix[:3, :3] = random_matrix(np.random.default_rng(3))[:3, :3] * scale
    placed = Body(mesh, body.removeprefix("turned "), matrix)
    leaks = 0
    for rng, count in batches(1):
        ends = mesh.vertices[mesh.triangles[rng.integers(len(mesh.triangles), size=count)]]
        share = rng.choice([0.0, 0.5, 1.0, -1.0], size=(count, 1), p=[0.3, 0.2, 0.2, 0.3])
        share = np.where(share < 0, rng.random((count, 1)), share)
        eyes = rng.uniform(-0.5, 0.5, (count, 3))
        leaks += count - placed.hits(placed.world(eyes), placed.world(ends[:, 0] * (1 - share) + ends[:, 1] * share))
    assert leaks == 0, f"{leaks} of {RAYS} rays leave the ball"


@pytest.mark.parametrize(("scale", "offset"), PLACES)
@pytest.mark.parametrize("body", [*BODIES, "sphere"])
def test_rays_that_graze_a_ball_meet_it_below_its_vertices_and_miss_it_above(closed_ball, make_spheres, scale, offset, body):
    mesh = closed_ball(40 if body == "merged" else 60)
    placed = Body(make_spheres([[0, 0, 0]], 1.0) if body == "sphere" else mesh, body, placing(scale, offset))
    # A vertex is moved by half an ulp of its coordinates, a ray's ends by one each, and where they pass each other by a few
    # more of their distance, which is 10 at most.
    apart = 16 * max(np.spacing(10.0), np.spacing(offset) / scale)
    for above in (False, True):
        met = 0
        for rng, count in batches(2):
            vertices = mesh.vertices[rng.integers(len(mesh.vertices), size=count)]
            along = np.cross(vertices, rng.normal(size=(count, 3)))
            along *= rng.uniform(2, 10, (count, 1)) / np.linalg.norm(along, axis=1, keepdims=True)
            passed = vertices * (1 + apart if above else 1 - apart)
            met += placed.hits(placed.world(passed - along), placed.world(passed + along))
        wrong = met if above else RAYS - met
        assert wrong == 0, f"{wrong} of {RAYS} rays that pass {'above' if above else 'below'} a vertex are wrong"
