"""Every pixel that a visible outline crosses is marked: against brute force, 256 rays a pixel.

A pixel holds an outline, says brute force, if two rays beside one another in it show two things, one of them clearly behind
the other: surfaces that penetrate one another, which are not asked for, meet at one depth.
"""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.rays.ellipsoids import ellipsoids_of
from viewcam_addon.tracer.rays.outlines import Outlines
from viewcam_addon.tracer.rays.triangles import Planes, triangles_of
from viewcam_addon.tracer.rays.view import View
from viewcam_addon.tracer.rays.visibility import visibility
from viewcam_addon.tracer.scene import Mesh, Spheres

FINE = 16  # rays along the side of a pixel
CLEARLY = 0.02  # of a depth: what is behind something else


class Picture:
    """A scene, its outlines, and what rays show."""

    def __init__(self, scene, **options) -> None:
        self.scene, self.camera = scene, scene.camera
        view = View(scene.camera)
        things = [(placed, scene.geometries[placed.geometry]) for placed in scene.objects]
        self.triangles = triangles_of([thing for thing in things if isinstance(thing[1], Mesh)], view)
        self.ellipsoids = ellipsoids_of([thing for thing in things if isinstance(thing[1], Spheres)], view)
        self.planes = Planes(self.triangles, view)
        self.visibility = visibility(self.triangles, self.planes, self.ellipsoids, scene.clip)
        self.outlines = Outlines(scene, view, self.triangles, self.planes, self.ellipsoids, self.visibility, **options)

    def rays(self, fine: int):
        """(height · fine, width · fine) what evenly spread rays meet, and how deep."""
        rows, columns = (np.mgrid[: self.camera.height * fine, : self.camera.width * fine] + 0.5) / fine
        x, y = self.camera.view_plane(columns.ravel(), rows.ravel())
        found = self.visibility.first(x, y)
        depth = np.full(len(x), 1e10)
        count = self.triangles.count
        for some, deep, first in (
            ((found >= 0) & (found < count), self.planes.depth, 0),
            (found >= count, self.ellipsoids.depth, count),
        ):
            depth[some] = deep(found[some] - first, x[some], y[some])
        return found.reshape(rows.shape), depth.reshape(rows.shape)

    def marked(self, known: bool = True):
        found, depth = self.rays(1)
        return self.outlines.seen(depth.astype(np.float32), found if known else None)

    def crossed(self, thing_of, fine: int = FINE):
        """(height, width): the pixels in which rays beside one another show two things, one behind the other.

        thing_of : (n,) for each primitive, which thing it is of.
        """
        found, depth = self.rays(fine)
        thing = np.append(thing_of, -1)[found]
        crossed = np.zeros((self.camera.height, self.camera.width), bool)
        for axis in (0, 1):
            ahead, back = (np.take(values, range(1, values.shape[axis]), axis) for values in (thing, depth)), None
            here = [np.take(values, range(values.shape[axis] - 1), axis) for values in (thing, depth)]
            ahead = list(ahead)
            differ = (here[0] != ahead[0]) & (np.abs(here[1] - ahead[1]) > CLEARLY * np.minimum(here[1], ahead[1]))
            rows, columns = np.nonzero(differ)
            at = (rows, columns)[axis]
            same_pixel = (at + 1) % fine != 0
            crossed[rows[same_pixel] // fine, columns[same_pixel] // fine] = True
        return crossed

    def things(self):
        """(n,) for each primitive, the object that it belongs to; of spheres each is its own."""
        meshes = np.repeat(np.arange(len(self.triangles.placed)), [len(mesh.triangles) for _, mesh in self.triangles.placed])
        return np.concatenate([meshes, 10000 + np.arange(self.ellipsoids.count)])


def camera(seed: int, width: int = 40, height: int = 24, zoom=None) -> Pinhole:
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


def wire(start, end, width: float):
    """A closed prism of three sides: vertices and triangles."""
    start, end = np.array(start, float), np.array(end, float)
    way = (end - start) / np.linalg.norm(end - start)
    aside = np.cross(way, (1, 0, 0) if abs(way[0]) < 0.9 else (0, 1, 0))
    aside /= np.linalg.norm(aside)
    third = np.cross(way, aside)
    ring = [width / 2 * (np.cos(a) * aside + np.sin(a) * third) for a in (0, 2 * np.pi / 3, 4 * np.pi / 3)]
    vertices = [point + offset for point in (start, end) for offset in ring]
    return vertices, [(0, 1, 4), (0, 4, 3), (1, 2, 5), (1, 5, 4), (2, 0, 3), (2, 3, 5), (0, 2, 1), (3, 4, 5)]


def missed(picture: Picture, fine: int = FINE, **how):
    crossed, marked = picture.crossed(picture.things(), fine), picture.marked(**how)
    return int((crossed & ~marked).sum()), int(crossed.sum()), float(marked.mean())


@pytest.fixture(scope="module")
def wires(make_mesh, make_scene):
    """wires(seed, thin) → Scene of wires that are so many pixels wide, before a wall."""

    def build(seed: int, thin: float, count: int = 12):
        rng = np.random.default_rng(seed)
        eye = camera(seed)
        things = []
        for _ in range(count):
            start, end = rng.uniform(-1.5, 1.5, (2, 3))
            depth = np.linalg.norm((start + end) / 2 - eye.eye)
            things.append(make_mesh(*wire(start, end, thin * depth / eye.distance[0])))
        wall = 12 * rng.normal(size=(3, 3)) - 6 * np.array(eye.eye)
        return make_scene(eye, *things, make_mesh(wall, [(0, 1, 2)]))

    return build


@given(st.integers(0, 10**6), st.floats(0.01, 1))
@settings(max_examples=25, deadline=None)
def test_no_wire_is_missed_however_thin_and_at_whatever_angle(wires, seed, thin):
    picture = Picture(wires(seed, thin))
    lost, of, share = missed(picture)
    assert not lost, f"{lost} of {of} pixels with wires {thin:.3g} pixels wide are missed, {share:.0%} are marked"
