"""What each pixel's centre shows: the instance, its primitive and the point, in double precision."""

import hashlib
import itertools
import os
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..pinhole import Pinhole
from ..tracer import render
from ..tracer.native import CoreScene
from ..tracer.scene import Mesh, Object, Scene, Spheres
from ..tracer.scene.sameness import same_things
from ..tracer.tiles import Passes, over_threads

Array = NDArray[np.float64]

_MOST_RAYS = 2**18
"""Of silhouettes that are traced at a time, 130 bytes each."""

_NONE = np.empty(0, np.intp)

_MOST_IDS = 2**24 - 1
"""What float32 counts to, and three bytes of a colour hold."""


@dataclass(frozen=True, eq=False)
class Instance:
    """One object in one place.

    key : (object's name, which one of those with this name): the same in every frame. id : a number for masks, 1 … 2²⁴ − 1.
    placed : the object. matrix, inverse : (4, 4), object space to world space, and back.
    """

    key: tuple[str, int]
    id: int
    placed: Object
    matrix: Array
    inverse: Array

    def local(self, points: Array) -> Array:
        """(n, 3) points in world space, in object space."""
        return (points - self.matrix[:3, 3]) @ self.inverse[:3, :3].T


def instances(scene: Scene) -> list[Instance]:
    """Those of a scene, in the order in which the tracer numbers them.

    An id is a hash of the key, so that it stays the same whatever else comes and goes; where two are equal (1 in 17 million for
    each pair) the later one takes the next that is free.
    """
    counts: dict[str, itertools.count] = {}
    taken: set[int] = set()
    found = []
    for placed in scene.objects:
        for matrix, inverse in zip(placed.matrices, _inverses(placed.matrices), strict=True):
            number = next(counts.setdefault(placed.name, itertools.count()))
            digest = hashlib.sha256(f"{number} {placed.name}".encode("utf-8", "surrogatepass")).digest()
            mark = int.from_bytes(digest[:3], "big")
            while mark in taken or mark == 0:
                mark = mark % _MOST_IDS + 1
            taken.add(mark)
            found.append(Instance((placed.name, number), mark, placed, matrix, inverse))
    return found


class Keeper:
    """Of scenes with the same things, what serves from one camera to the next: hierarchies, instances, boxes.

    The surfaces that it was last given for are those that can be traced.
    """

    def __init__(self, scene: Scene, threads: int | None = None) -> None:
        self.scene, self.instances, self.tracers = scene, instances(scene), render.Keeper()
        self.threads = threads or os.cpu_count() or 1
        self._alone: dict[tuple[str, bytes], CoreScene] = {}
        self._boxes: dict[str, tuple[Array, Array]] = {}
        self._corners: dict[int, Array] = {}

    def box(self, name: str) -> tuple[Array, Array]:
        """That of a geometry: see `box`."""
        if name not in self._boxes:
            self._boxes[name] = box(self.scene.geometries[name])
        return self._boxes[name]

    def corners(self, instance: Instance) -> Array:
        """(8, 3): those of an instance's box, world space."""
        if instance.id not in self._corners:
            corners = np.array(list(itertools.product(*zip(*self.box(instance.placed.geometry), strict=True))))
            self._corners[instance.id] = corners @ instance.matrix[:3, :3].T + instance.matrix[:3, 3]
        return self._corners[instance.id]

    def alone(self, name: str, matrix: Array) -> CoreScene:
        """One geometry in one place."""
        if (key := (name, matrix.tobytes())) not in self._alone:
            geometry = self.scene.geometries[name]
            geometry = replace(geometry, materials=np.zeros_like(geometry.materials))
            middle = sum(self.box(name)) / 2
            away = tuple(middle + np.array([0, 0, 1 + np.abs(middle).max()]))
            camera = Pinhole(tuple(middle), away, (0, 1, 0), 1, 1, 1)  # only so that rendering space's origin is near
            self._alone[key] = CoreScene(Scene(camera, {name: geometry}, (Object("", name, matrix),)), 1)
        return self._alone[key]


class Keepers:
    """The keepers of the last few scenes. most : how many."""

    def __init__(self, most: int = 1, threads: int | None = None) -> None:
        self._most, self._threads = most, threads
        self._kept: list[Keeper] = []

    def of(self, scene: Scene) -> Keeper:
        """That of the scene with the same things, the last one now."""
        found = next((each for each in self._kept if same_things(scene, each.scene)), None) or Keeper(scene, self._threads)
        self._kept = [*(each for each in self._kept if each is not found), found][-self._most :]
        return found


class Surfaces:
    """A scene's surfaces at the pixels' centres, which are traced when they are asked for; rows from the bottom.

    depth : (height, width) planar depth z = −w·(P − e), inf where nothing is. instance, primitive : (height, width), −1 there:
    indices into `instances` and of the geometry's triangles or spheres. passes : those of level `geometry` that were named
    when it was made, of the same points.
    """

    def __init__(
        self, scene: Scene, threads: int | None = None, keeper: "Keeper | None" = None, names: Collection[str] = ()
    ) -> None:
        self.keeper = keeper or Keeper(scene, threads)
        self.scene, self.camera, self.instances = scene, scene.camera, self.keeper.instances
        self._tracer, self._names = self.keeper.tracers.tracer(scene, threads), names

    @cached_property
    def _hits(self) -> tuple[Array, NDArray[np.int64], NDArray[np.int64], Passes]:
        return self._tracer.hits(self._names)

    def instances_at(self, place: tuple[float, float]) -> NDArray[np.int64]:
        """As `instance`, at another place in the pixels than their centres."""
        return self._tracer.hits(place=place)[1]

    @property
    def depth(self) -> Array:
        return self._hits[0]

    @property
    def instance(self) -> NDArray[np.int64]:
        return self._hits[1]

    @property
    def primitive(self) -> NDArray[np.int64]:
        return self._hits[2]

    @property
    def passes(self) -> Passes:
        return self._hits[3]

    @cached_property
    def shown(self) -> list[tuple[Instance, NDArray[np.intp]]]:
        """Each instance that any pixel shows, and its pixels, by their numbers row by row."""
        return [(self.instances[number], pixels) for number, pixels in self.shown_numbers]

    @cached_property
    def shown_numbers(self) -> list[tuple[int, NDArray[np.intp]]]:
        """The same, by the numbers of instances."""
        order = np.argsort(self.instance, axis=None, kind="stable")
        numbers = self.instance.ravel()[order]
        starts = np.flatnonzero(np.diff(numbers, prepend=-2))
        parts = np.split(order, starts[1:])
        return [(int(numbers[s]), part) for s, part in zip(starts, parts, strict=True) if numbers[s] >= 0]

    @cached_property
    def points(self) -> Array:
        """(height, width, 3), world space; 0 where nothing is."""
        u, v, w = self.camera.basis()
        x, _ = self.camera.view_plane(np.arange(self.camera.width) + 0.5, 0.5)
        _, y = self.camera.view_plane(0.5, np.arange(self.camera.height) + 0.5)
        depth = np.where(np.isfinite(self.depth), self.depth, 0.0)[..., None]
        points = (x[:, None] * (-u if self.camera.mirrored else u) - w) + (y[:, None] * v)[:, None]
        points *= depth
        points += np.array(self.camera.eye)
        points[depth[..., 0] == 0.0] = 0.0
        return points

    def local_points(self, instance: Instance, pixels: NDArray[np.intp]) -> Array:
        """(n, 3): the points of an instance's pixels in its object's space."""
        return instance.local(self.points.reshape(-1, 3)[pixels])

    def seen_first(self, points: Array, owners: NDArray[np.int64], primitives: NDArray[np.int64], slack: float) -> NDArray:
        """Whether the camera sees points of its scene's surfaces: (n,) bool, False beside the picture and beyond the clip.

        points : (n, 3), world space, each on the primitive of the instance that it is given with. slack : how much nearer than
        a point, as a share of its depth, its own surface may be found.
        """
        column, row, depth = self.camera.project(points)
        with np.errstate(invalid="ignore"):
            inside = (column >= 0) & (column < self.camera.width) & (row >= 0) & (row < self.camera.height)
            inside &= (depth >= self.scene.clip[0]) & (depth <= self.scene.clip[1])
        eye = np.array(self.camera.eye)
        directions = (points[inside] - eye) / depth[inside, None]
        t, instance, primitive = self._tracer.closest(np.broadcast_to(eye, directions.shape), directions)
        seen = t >= depth[inside] * (1 - slack)
        seen |= (instance == owners[inside]) & (primitive == primitives[inside])
        inside[inside] = seen
        return inside


class Silhouettes:
    """Whole instances of a scene, each as if it stood alone before the camera."""

    def __init__(self, surfaces: Surfaces) -> None:
        self._surfaces, self._keeper = surfaces, surfaces.keeper

    def pixels(self) -> list[NDArray[np.intp]]:
        """Of each instance (n,), in order; what shows it among the others belongs to it in any case.

        Rays are traced in the objects' spaces, so that a geometry is made ready once for all its instances, and those of many
        instances at a time; what is flattened is traced in the world.
        """
        surfaces = self._surfaces
        shown = {number: pixels for number, pixels in surfaces.shown_numbers}
        found = [shown.get(number, _NONE) for number in range(len(surfaces.instances))]
        if not surfaces.instances:
            return found
        is_flat = np.linalg.det(np.array([each.matrix[:3, :3] for each in surfaces.instances])) == 0
        first, last = self._reaches()
        groups: dict[tuple[str, int | None], list[int]] = {}
        for number, instance in enumerate(surfaces.instances):
            if (last[number] > first[number]).all() and "camera" not in instance.placed.hidden_from:
                groups.setdefault((instance.placed.geometry, number if is_flat[number] else None), []).append(number)
        pieces = []
        for (name, flat), numbers in groups.items():
            core = self._keeper.alone(name, np.eye(4) if flat is None else surfaces.instances[flat].matrix)
            areas = (last[numbers] - first[numbers]).prod(axis=1)
            parts = np.cumsum(areas) // _MOST_RAYS
            pieces += [(core, np.array(numbers)[parts == part], flat is not None) for part in np.unique(parts)]

        def trace(piece: tuple[CoreScene, NDArray[np.intp], bool]) -> None:
            core, numbers, is_flat = piece
            for number, hit in self._hits(core, numbers, is_flat, first, last):
                found[number] = np.union1d(found[number], hit) if len(found[number]) else hit

        for _ in over_threads(trace, pieces, self._keeper.threads, lambda: None, lambda: None):
            pass
        return found

    def _hits(
        self, core: CoreScene, numbers: NDArray[np.intp], is_flat: bool, first: NDArray[np.intp], last: NDArray[np.intp]
    ) -> Iterator[tuple[int, NDArray[np.intp]]]:
        """The pixels of some instances that rays meet in what the core has. first, last : of `_reaches`."""
        camera, (near, far) = self._surfaces.camera, self._surfaces.scene.clip
        eye, (u, v, w) = np.array(camera.eye), camera.basis()
        axes = np.array([-u if camera.mirrored else u, v, -w])
        turned, eyes = np.broadcast_to(axes, (len(numbers), 3, 3)), np.broadcast_to(eye, (len(numbers), 3))
        if not is_flat:
            some = [self._surfaces.instances[number] for number in numbers]
            turned = axes @ np.array([each.inverse[:3, :3].T for each in some])
            eyes = np.array([each.local(eye) for each in some])
        x, y = (
            camera.view_plane(np.arange(camera.width) + 0.5, 0.5)[0],
            camera.view_plane(0.5, np.arange(camera.height) + 0.5)[1],
        )
        directions = []
        for (left, low), (right, high), (across, up, ahead) in zip(first[numbers], last[numbers], turned, strict=True):
            row = x[left:right, None] * across + ahead
            directions.append((row + (y[low:high, None] * up)[:, None]).reshape(-1, 3))
        origins = np.repeat(eyes, [len(each) for each in directions], axis=0)
        rays = core.rays(origins, np.concatenate(directions), np.nextafter(near, 0.0), np.nextafter(far, np.inf))
        ends = np.cumsum([len(each) for each in directions])[:-1]
        for number, hit in zip(numbers.tolist(), np.split(core.closest(rays)[1] >= 0, ends), strict=True):
            rows, columns = np.divmod(np.flatnonzero(hit), last[number, 0] - first[number, 0])
            yield number, (rows + first[number, 1]) * camera.width + columns + first[number, 0]

    def _reaches(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """From which column and row to before which instances are at most, by their boxes' corners: each (n, 2)."""
        camera = self._surfaces.camera
        size = np.array([camera.width, camera.height])
        corners = np.stack([self._keeper.corners(each) for each in self._surfaces.instances])
        column, row, depth = camera.project(corners)
        places = np.stack([column, row], axis=-1)
        is_before = (depth > 0).any(axis=1)
        is_whole = (depth > 0).all(axis=1) & np.isfinite(places).all(axis=(1, 2))
        places = np.where(is_whole[:, None, None], places, 0.0)
        # Half a pixel and more beyond the centres that lie within, for rounding.
        first = np.where(is_whole[:, None], np.floor(places.min(axis=1)) - 1, 0)
        last = np.where(is_whole[:, None], np.ceil(places.max(axis=1)) + 1, size)
        first, last = np.clip(first, 0, size), np.where(is_before[:, None], np.clip(last, 0, size), 0)
        return first.astype(np.intp), last.astype(np.intp)


def box(geometry: Mesh | Spheres) -> tuple[Array, Array]:
    """The least and the greatest coordinates of a geometry, object space; zeros if it is empty."""
    if isinstance(geometry, Spheres):
        low, high = geometry.centers - geometry.radii[:, None], geometry.centers + geometry.radii[:, None]
    else:
        low = high = geometry.vertices[np.unique(geometry.triangles)]
    return (low.min(axis=0), high.max(axis=0)) if len(low) else (np.zeros(3), np.zeros(3))


def _inverses(matrices: Array) -> Array:
    """Of (n, 4, 4) matrices; of one that flattens, which has none, the nearest thing."""
    try:
        return np.linalg.inv(matrices)
    except np.linalg.LinAlgError:
        return np.linalg.pinv(matrices)
