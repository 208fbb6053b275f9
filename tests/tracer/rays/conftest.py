"""A scene made ready for rays from anywhere."""

from dataclasses import dataclass

import numpy as np
import pytest

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.compiled import standing
from viewcam_addon.tracer.rays import crowd, space, visibility
from viewcam_addon.tracer.rays.ellipsoids import ellipsoids_of
from viewcam_addon.tracer.rays.outlines import Outlines
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
        monkeypatch.setattr(standing, "AVAILABLE", False)

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


class Outlined:
    """A scene with its outlines, and what rays show of it."""

    CLEARLY = 1e-3
    """How much farther, of its depth, what is behind something else is: surfaces that penetrate one another meet at one."""

    def __init__(self, scene: Scene, **options) -> None:
        self.scene, self.camera, self.view = scene, scene.camera, View(scene.camera)
        things = [(placed, scene.geometries[placed.geometry]) for placed in scene.objects]
        self.triangles = triangles_of([thing for thing in things if isinstance(thing[1], Mesh)], self.view)
        self.ellipsoids = ellipsoids_of([thing for thing in things if isinstance(thing[1], Spheres)], self.view)
        self.planes = Planes(self.triangles, self.view)
        self.visibility = visibility.visibility(self.triangles, self.planes, self.ellipsoids, scene.clip)
        parts = scene, self.view, self.triangles, self.planes, self.ellipsoids
        self.surfaces = Surfaces(*parts)
        self.space = Space(self.surfaces)
        self.outlines = Outlines(*parts, self.visibility, **options)

    def rays(self, fine: int) -> tuple[np.ndarray, ...]:
        """x, y, what evenly spread rays meet and how deep, fine² in each pixel: (height · fine, width · fine) each."""
        rows, columns = (np.mgrid[: self.camera.height * fine, : self.camera.width * fine] + 0.5) / fine
        x, y = self.camera.view_plane(columns, rows)
        return x, y, *(values.reshape(x.shape) for values in self.seen_at(x.ravel(), y.ravel()))

    def seen_at(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What rays meet, and how deep, 1e10 where nothing."""
        found = self.visibility.first(x, y)
        depth, count = np.full(len(x), 1e10), self.triangles.count
        for which, table, first in (
            (np.flatnonzero((found >= 0) & (found < count)), self.planes, 0),
            (np.flatnonzero(found >= count), self.ellipsoids, count),
        ):
            depth[which] = table.depth(found[which] - first, x[which], y[which])
        return found, depth

    def marked(self, known: bool = True) -> np.ndarray:
        *_, found, depth = self.rays(1)
        return self.outlines.seen(depth.astype(np.float32), found if known else None)

    def shaded(self) -> np.ndarray:
        """(height, width) where edges of shadows are marked."""
        *_, found, depth = self.rays(1)
        return self.outlines.shadows(depth.astype(np.float32), self.surfaces, self.space, found)

    def things(self) -> np.ndarray:
        """(n,) which object each primitive belongs to; of spheres each is its own."""
        meshes = np.repeat(np.arange(len(self.triangles.placed)), self.triangles.counts)
        return np.concatenate([meshes, len(meshes) + np.arange(self.ellipsoids.count)])

    def crossed(self, thing_of: np.ndarray | None = None, fine: int = 16, clearly: float = CLEARLY) -> np.ndarray:
        """(height, width): the pixels in which rays beside one another show two things, one clearly behind the other."""
        x, y, found, depth = self.rays(fine)
        thing_of = np.append(self.things() if thing_of is None else thing_of, -1)
        pixels = np.zeros((self.camera.height, self.camera.width), bool)
        for one, other in beside(fine, x, y, thing_of[found], depth):
            differ = one[2] != other[2]
            if not differ.any():
                continue
            some = [values[differ] for values in one], [values[differ] for values in other]
            gap = self.gap(thing_of, *some) / np.minimum(some[0][3], some[1][3])
            pixels.ravel()[self.pixel_of(some[0][0], some[0][1])[gap > clearly]] = True
        return pixels

    def gap(self, thing_of: np.ndarray, one: list[np.ndarray], other: list[np.ndarray]) -> np.ndarray:
        """How far what rays show changes in depth just where another thing begins. one, other : x, y, thing and depth."""
        for _ in range(16):
            x, y = ((a + b) / 2 for a, b in zip(one[:2], other[:2], strict=True))
            found, depth = self.seen_at(x, y)
            same = thing_of[found] == one[2]
            middle = x, y, thing_of[found], depth
            one = [np.where(same, new, old) for new, old in zip(middle, one, strict=True)]
            other = [np.where(same, old, new) for new, old in zip(middle, other, strict=True)]
        return np.abs(one[3] - other[3])

    def pixel_of(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        (left, right), (low, high) = self.camera.view_plane([0, self.camera.width], [0, self.camera.height])
        column = np.floor((x - left) / (right - left) * self.camera.width).astype(int)
        row = np.floor((y - low) / (high - low) * self.camera.height).astype(int)
        return row * self.camera.width + column

    def pixels_with_leaps(self, values: np.ndarray, fine: int) -> np.ndarray:
        """(height, width): the pixels in which rays beside one another have different values, (height · fine, width · fine)."""
        x, y, *_ = self.rays(fine)
        pixels = np.zeros((self.camera.height, self.camera.width), bool)
        for one, other in beside(fine, x, y, values):
            differ = one[2] != other[2]
            pixels.ravel()[self.pixel_of(one[0][differ], one[1][differ])] = True
        return pixels


def beside(fine: int, *tables: np.ndarray):
    """The values of rays that lie beside one another in one pixel: of the one and of the other, (n,) each; along both axes."""
    for axis in (0, 1):
        place = np.arange(tables[0].shape[axis] - 1)
        together = place[(place + 1) % fine != 0]
        yield tuple([np.take(table, together + step, axis).ravel() for table in tables] for step in (0, 1))


@pytest.fixture(scope="session")
def outlined():
    """outlined(scene, crease=…) → Outlined."""
    return Outlined


@pytest.fixture(scope="session")
def some_camera():
    """some_camera(seed, width, height, zoom) → a camera that looks at the origin or so, askew, from 3 to 9 away."""

    def build(seed: int, width: int = 40, height: int = 24, zoom: float | None = None) -> Pinhole:
        rng = np.random.default_rng(seed)
        eye = rng.normal(size=3)
        eye *= rng.uniform(3, 9) / np.linalg.norm(eye)
        zoom = rng.uniform(0.3, 3) if zoom is None else zoom
        return Pinhole(
            tuple(eye),
            tuple(rng.uniform(-0.5, 0.5, 3)),
            tuple(rng.normal(size=3)),
            (width * zoom, width * zoom * rng.uniform(0.7, 1.4)),
            width,
            height,
            (width * rng.uniform(0.3, 0.7), height * rng.uniform(0.3, 0.7)),
            bool(rng.integers(2)),
        )

    return build


@pytest.fixture(scope="session")
def make_wire(make_mesh):
    """make_wire(start, end, width) → Mesh: a closed prism of three sides."""

    def build(start, end, width: float) -> Mesh:
        way = np.subtract(end, start) / np.linalg.norm(np.subtract(end, start))
        aside = np.cross(way, (1, 0, 0) if abs(way[0]) < 0.9 else (0, 1, 0))
        aside /= np.linalg.norm(aside)
        angles = np.array([0, 1, 2]) * (2 * np.pi / 3)
        ring = width / 2 * (np.cos(angles)[:, None] * aside + np.sin(angles)[:, None] * np.cross(way, aside))
        faces = [(0, 1, 4), (0, 4, 3), (1, 2, 5), (1, 5, 4), (2, 0, 3), (2, 3, 5), (0, 2, 1), (3, 4, 5)]
        return make_mesh(np.concatenate([start + ring, end + ring]), faces)

    return build
