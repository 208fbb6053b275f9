"""A scene made ready for rays from anywhere."""

from dataclasses import dataclass

import numpy as np
import pytest

from viewcam_addon.tracer.rays import crowd, space, visibility
from viewcam_addon.tracer.rays.ellipsoids import ellipsoids_of
from viewcam_addon.tracer.rays.points import Points, Surfaces
from viewcam_addon.tracer.rays.space import Space
from viewcam_addon.tracer.rays.triangles import Planes, triangles_of
from viewcam_addon.tracer.rays.view import View
from viewcam_addon.tracer.scene import Mesh, Scene, Spheres


@dataclass
class Stage:
    """A scene made ready, and the points that its camera sees at the centres of `pixels`."""

    scene: Scene
    view: View
    surfaces: Surfaces
    space: Space
    points: Points
    pixels: np.ndarray


@pytest.fixture(scope="session")
def stage_of():
    """stage_of(scene) → Stage."""

    def build(scene: Scene) -> Stage:
        view = View(scene.camera)
        things = [(placed, scene.geometries[placed.geometry]) for placed in scene.objects]
        triangles = triangles_of([thing for thing in things if isinstance(thing[1], Mesh)], view)
        ellipsoids = ellipsoids_of([thing for thing in things if isinstance(thing[1], Spheres)], view)
        planes = Planes(triangles, view)
        surfaces = Surfaces(scene, view, triangles, planes, ellipsoids)
        rows, columns = np.mgrid[: scene.camera.height, : scene.camera.width]
        x, y = scene.camera.view_plane(columns.ravel() + 0.5, rows.ravel() + 0.5)
        found = visibility.visibility(triangles, planes, ellipsoids, scene.clip).first(x, y)
        met = np.flatnonzero(found >= 0)
        return Stage(scene, view, surfaces, Space(surfaces), surfaces.seen(found[met], x[met], y[met]), met)

    return build


@pytest.fixture(scope="session")
def without_embree():
    """without_embree(monkeypatch): all rays do without, from now on."""

    def patch(monkeypatch) -> None:
        for module in (visibility, space, crowd):
            monkeypatch.setattr(module, "EmbreeScene", None)

    return patch


@pytest.fixture(params=["Embree", "NumPy"])
def finder(request, monkeypatch, without_embree):
    """Both ways to find what rays meet."""
    if request.param == "NumPy":
        without_embree(monkeypatch)
    elif space.EmbreeScene is None:
        pytest.skip("embreex is not installed")
    return request.param


@pytest.fixture(scope="session")
def outwards():
    """outwards(points, rng) → (3, n) unit directions, evenly over the side that the normals are on."""

    def build(points: Points, rng) -> np.ndarray:
        directions = rng.normal(size=(3, points.count))
        directions /= np.linalg.norm(directions, axis=0)
        return directions * np.where((directions * points.normal).sum(axis=0) < 0, -1.0, 1.0)

    return build
