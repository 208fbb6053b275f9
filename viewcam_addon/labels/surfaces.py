"""The surfaces at the pixels' centers: the instance, its primitive and the point, in double precision."""

import hashlib
import itertools
import math
from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .. import machine
from ..cameras import distortion, undistortion
from ..errors import InputError
from ..pinhole import Pinhole
from ..tracer import render
from ..tracer.native import CoreScene
from ..tracer.scene import Mesh, Object, Scene, Spheres, same_things
from ..tracer.tiles import Passes, over_threads
from .masks import Window

Array = NDArray[np.float64]

_AT_ONCE = 2**16
"""Pixels of silhouettes that a thread traces at a time."""

_EDGES = np.array([(corner, corner | side) for corner in range(8) for side in (1, 2, 4) if not corner & side]).T
"""The edges of a box, whose corners differ in x by 4, in y by 2, in z by 1: their two ends."""

_MOST_IDS = 2**24 - 1
"""The largest number that float32 counts to, and three bytes of a color hold."""


@dataclass(frozen=True, eq=False)
class Instance:
    """An object in one place, an instance of it.

    key : (object's name, which one of those with this name): the same in every frame.
    id : a number for masks, 1 … 2²⁴ − 1.
    placed : the object.
    matrix, inverse : (4, 4), object space to world space, and back.
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
    """The instances of a scene, in the order in which the tracer numbers them.

    An id is a hash of the key, so that it stays the same whatever else comes and goes; where two are equal (1 in 17 million for
    each pair) the later one takes the next that is free.
    """
    counts: dict[str, itertools.count] = {}
    taken: set[int] = set()
    result = []
    for placed in scene.objects:
        for matrix, inverse in zip(placed.matrices, _inverses(placed.matrices), strict=True):
            number = next(counts.setdefault(placed.name, itertools.count()))
            digest = hashlib.sha256(f"{number} {placed.name}".encode("utf-8", "surrogatepass")).digest()
            mark = int.from_bytes(digest[:3], "big")
            while mark in taken or mark == 0:
                mark = mark % _MOST_IDS + 1
            taken.add(mark)
            result.append(Instance((placed.name, number), mark, placed, matrix, inverse))
    return result


class Keeper:
    """A store of what serves from one camera of a scene to the next: hierarchies, instances, boxes.

    The surfaces that it was last given for are those that can be traced.
    """

    def __init__(self, scene: Scene, threads: int | None = None) -> None:
        self.scene, self.instances, self.tracers = scene, instances(scene), render.Keeper()
        self.threads = threads or machine.cores()
        self._alone: dict[tuple[str, bytes], CoreScene] = {}
        self._boxes: dict[str, tuple[Array, Array]] = {}
        self._corners: dict[int, Array] = {}

    def box(self, name: str) -> tuple[Array, Array]:
        """The box of a geometry: see `box`."""
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
            low, high = self.box(name)
            middle = (low + high) / 2
            away = tuple(middle + np.array([0, 0, 1 + np.abs(middle).max()]))
            camera = Pinhole(tuple(middle), away, (0, 1, 0), 1, 1, 1)  # only so that rendering space's origin is near
            self._alone[key] = CoreScene(Scene(camera, {name: geometry}, (Object("", name, matrix),)), 1)
        return self._alone[key]


class Keepers:
    """The keepers of the last few scenes.

    most : the number of keepers.
    """

    def __init__(self, most: int = 1, threads: int | None = None) -> None:
        self._most, self._threads = most, threads
        self._kept: list[Keeper] = []

    def of(self, scene: Scene) -> Keeper:
        """The store that serves a scene, which is the last one now."""
        result = next((each for each in self._kept if same_things(scene, each.scene)), None) or Keeper(scene, self._threads)
        self._kept = [*(each for each in self._kept if each is not result), result][-self._most :]
        return result


class Surfaces:
    """A scene's surfaces at the pixels' centers, which are traced when they are asked for; rows from the bottom.

    depth : (height, width) planar depth z = −w·(P − e), inf where nothing is.
    instance, primitive : (height, width), −1 there: indices into `instances` and of the geometry's triangles or spheres.
    passes : passes of level `geometry` at the same points, those that were named when it was made.

    lens : the lens that bends the picture, whose own view plane the scene's camera then has; each of its pixels is one ray
        through the place that the lens shows there.
    """

    def __init__(
        self,
        scene: Scene,
        threads: int | None = None,
        keeper: "Keeper | None" = None,
        names: Collection[str] = (),
        lens: distortion.Lens | None = None,
    ) -> None:
        self.keeper, self.lens = keeper or Keeper(scene, threads), lens
        self.scene, self.camera, self.instances = scene, scene.camera, self.keeper.instances
        self._tracer, self._names = self.keeper.tracers.tracer(scene, threads), names

    @cached_property
    def _hits(self) -> tuple[Array, NDArray[np.int64], NDArray[np.int64], Passes]:
        return self._traced(names=self._names)

    def instances_at(self, place: tuple[float, float]) -> NDArray[np.int64]:
        """The instances seen through another place in the pixels than their centers."""
        return self._traced(place)[1]

    def _traced(
        self, place: tuple[float, float] = (0.5, 0.5), names: Collection[str] = ()
    ) -> tuple[Array, NDArray[np.int64], NDArray[np.int64], Passes]:
        if self.lens is None:
            return self._tracer.hits(names, place)
        (d_x, d_y), (c_x, c_y) = self.camera.distance, self.camera.principal_point
        x, y = self.view_plane if place == (0.5, 0.5) else self._view_plane(place)
        return self._tracer.hits_at(c_x + d_x * x, c_y + d_y * y, names)

    @cached_property
    def view_plane(self) -> tuple[Array, Array]:
        """(x, y) of the pixels' centers in the view plane at distance 1, which broadcast to (height, width)."""
        return self._view_plane((0.5, 0.5))

    def _view_plane(self, place: tuple[float, float]) -> tuple[Array, Array]:
        if self.lens is None:
            x, _ = self.camera.view_plane(np.arange(self.camera.width) + place[0], 0.5)
            _, y = self.camera.view_plane(0.5, np.arange(self.camera.height) + place[1])
            return x, y[:, None]
        points = undistortion.points(self.lens, self.camera.plane, (place[0], 1 - place[1]))[::-1]
        if not np.isfinite(points).all():
            raise InputError("the lens shows nothing at some of the picture's pixels: its model folds there, crop the picture")
        return points[..., 0], -points[..., 1]

    def project(self, points: Array) -> tuple[Array, Array, Array]:
        """The places in the picture at which points appear, and their depths, as Pinhole.project has them."""
        return distortion.project(self.camera, self.lens, points)

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
    def visible(self) -> list[tuple[Instance, NDArray[np.intp]]]:
        """Each instance that any pixel shows, and its pixels, by their numbers row by row."""
        return [(self.instances[number], pixels) for number, pixels in self.visible_numbers]

    @cached_property
    def visible_numbers(self) -> list[tuple[int, NDArray[np.intp]]]:
        """The pixels that show each instance, by the instances' numbers."""
        order = np.argsort(self.instance, axis=None, kind="stable")
        numbers = self.instance.ravel()[order]
        starts = np.flatnonzero(np.diff(numbers, prepend=-2))
        parts = np.split(order, starts[1:])
        return [(int(numbers[s]), part) for s, part in zip(starts, parts, strict=True) if numbers[s] >= 0]

    @cached_property
    def points(self) -> Array:
        """(height, width, 3), world space; 0 where nothing is."""
        right, up, forward = self.camera.picture_axes()
        x, y = self.view_plane
        depth = np.where(np.isfinite(self.depth), self.depth, 0.0)[..., None]
        points = (x[..., None] * right + forward) + y[..., None] * up
        points *= depth
        points += np.array(self.camera.eye)
        points[depth[..., 0] == 0.0] = 0.0
        return points

    def local_points(self, instance: Instance, pixels: NDArray[np.intp]) -> Array:
        """(n, 3): the points of an instance's pixels in its object's space."""
        return instance.local(self.points.reshape(-1, 3)[pixels])

    def seen_first(self, points: Array, owners: NDArray[np.int64], primitives: NDArray[np.int64], slack: float) -> NDArray:
        """True where the camera sees points of its scene's surfaces: (n,) bool, False beside the picture and beyond the clip.

        points : (n, 3), world space, each on the primitive of the instance that it is given with.
        slack : the distance by which its own surface may be found nearer than a point, as a share of its depth.
        """
        column, row, depth = self.project(points)
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

    def windows(self) -> list[Window | None]:
        """The part of the picture that holds each instance, in order; what shows it among the others belongs to it in
        any case. None where it isn't in the picture.

        Rays are traced in the objects' spaces, so that a geometry is made ready once for all its instances; what is flattened
        is traced in the world.
        """
        surfaces = self._surfaces
        if not surfaces.instances:
            return []
        visible = dict(surfaces.visible_numbers)
        camera = surfaces.camera
        matrices, inverses = (np.array([getattr(each, name) for each in surfaces.instances]) for name in ("matrix", "inverse"))
        is_flat = np.linalg.det(matrices[:, :3, :3]) == 0
        matrices[is_flat] = inverses[is_flat] = np.eye(4)
        eyes = (inverses[:, :3, :3] @ (np.array(camera.eye) - matrices[:, :3, 3])[..., None])[..., 0]
        axes = camera.picture_axes() @ inverses[:, :3, :3].swapaxes(1, 2)
        reaches = self._reaches()
        for number, pixels in visible.items():  # rounding may have left out a box that begins where the clip range does
            rows, columns = np.divmod(pixels, camera.width)
            first = np.minimum(reaches[number, :2], [columns.min(), rows.min()])
            last = np.maximum(reaches[number, :2] + reaches[number, 2:], [columns.max() + 1, rows.max() + 1])
            reaches[number] = *first, *(last - first)
        result: list[Window | None] = [None] * len(surfaces.instances)

        def trace(numbers: NDArray[np.intp]) -> None:
            for number in numbers.tolist():
                window = reaches[number].tolist()
                covered = self._covered(cores[number], eyes[number], axes[number], window)
                if number in visible:
                    rows, columns = np.divmod(visible[number], camera.width)
                    covered[rows - window[1], columns - window[0]] = True
                result[number] = window[0], window[1], covered

        seen = [number for number, each in enumerate(surfaces.instances) if "camera" not in each.placed.hidden_from]
        areas = reaches[seen, 2:].prod(axis=1)
        seen, areas = np.array(seen, np.intp)[areas > 0], areas[areas > 0]
        cores = {
            number: self._keeper.alone(each.placed.geometry, each.matrix if is_flat[number] else np.eye(4))
            for number, each in ((number, surfaces.instances[number]) for number in seen.tolist())
        }
        parts = np.cumsum(areas) // _AT_ONCE
        pieces = np.split(seen, np.flatnonzero(np.diff(parts)) + 1)
        for _ in over_threads(trace, pieces, self._keeper.threads, lambda: None, lambda: None):
            pass
        return result

    def _covered(self, core: CoreScene, eye: Array, axes: Array, window: tuple[int, int, int, int]) -> NDArray[np.bool_]:
        """True where an instance is seen in a part of the picture. eye, axes : the camera's in its space."""
        surfaces, clip = self._surfaces, self._surfaces.scene.clip
        if surfaces.lens is None:
            return core.silhouette(surfaces.camera, clip, eye, axes, window)
        left, low, width, height = window
        x, y = (each[low : low + height, left : left + width].ravel() for each in surfaces.view_plane)
        ends = math.nextafter(clip[0], 0.0), math.nextafter(clip[1], math.inf)
        rays = core.rays(eye, np.stack([x, y, np.ones_like(x)], axis=-1) @ axes, *ends)
        return np.isfinite(core.closest(rays)[0]).reshape(height, width)

    def _reaches(self) -> NDArray[np.intp]:
        """(n, 4): the first column and row that instances may have, and how many, by what of their boxes the clip leaves."""
        camera, near = self._surfaces.camera, self._surfaces.scene.clip[0]
        corners = np.stack([self._keeper.corners(each) for each in self._surfaces.instances])
        depth = (corners - np.array(camera.eye)) @ camera.picture_axes()[2]
        start, end = _EDGES
        is_beyond = depth >= near
        is_cut = is_beyond[:, start] != is_beyond[:, end]
        share = np.where(is_cut, near - depth[:, start], 0.0) / np.where(is_cut, depth[:, end] - depth[:, start], 1.0)
        cut = corners[:, start] + share[..., None] * (corners[:, end] - corners[:, start])
        places = np.stack(camera.project(np.concatenate([corners, cut], axis=1))[:2], axis=-1)
        is_seen = np.concatenate([is_beyond, is_cut], axis=1)
        is_known = (np.isfinite(places).all(axis=-1) | ~is_seen).all(axis=1)[:, None]
        if self._surfaces.lens is not None:
            return self._reaches_in_lens(places, is_seen, is_known)
        # Half a pixel and more beyond the centers that lie within, for rounding.
        size = np.array([camera.width, camera.height])
        least = np.where(is_seen[..., None], places, np.inf).min(axis=1)
        most = np.where(is_seen[..., None], places, -np.inf).max(axis=1)
        first = np.where(is_known, np.clip(np.floor(least) - 1, 0, size), 0)
        last = np.where(is_known, np.clip(np.ceil(most) + 1, 0, size), size)
        return np.concatenate([first, np.maximum(last - first, 0)], axis=1).astype(np.intp)

    def _reaches_in_lens(self, places: Array, is_seen: NDArray[np.bool_], is_known: NDArray[np.bool_]) -> NDArray[np.intp]:
        """`_reaches` of the pixels whose places in the pinhole's picture lie within the boxes there."""
        camera = self._surfaces.camera
        x, y = self._surfaces.view_plane
        at = np.stack([x, y], axis=-1) * camera.distance + camera.principal_point
        result = np.zeros((len(places), 4), np.intp)
        for number, (box_places, seen, known) in enumerate(zip(places, is_seen, is_known[:, 0], strict=True)):
            if known and not seen.any():
                continue
            within = np.ones(x.shape, bool)
            if known:
                least, most = box_places[seen].min(axis=0) - 1, box_places[seen].max(axis=0) + 1
                within = ((at >= least) & (at <= most)).all(axis=-1)
            rows, columns = (np.flatnonzero(within.any(axis=axis)) for axis in (1, 0))
            if len(rows):
                result[number] = columns[0], rows[0], columns[-1] + 1 - columns[0], rows[-1] + 1 - rows[0]
        return result


def box(geometry: Mesh | Spheres) -> tuple[Array, Array]:
    """The least and the greatest coordinates of a geometry, object space; zeros if it is empty."""
    if isinstance(geometry, Spheres):
        low, high = geometry.centers - geometry.radii[:, None], geometry.centers + geometry.radii[:, None]
    else:
        low = high = geometry.vertices[np.unique(geometry.triangles)]
    return (low.min(axis=0), high.max(axis=0)) if len(low) else (np.zeros(3), np.zeros(3))


def _inverses(matrices: Array) -> Array:
    """The inverses of (n, 4, 4) matrices; of one that flattens, which has none, the nearest thing."""
    try:
        return np.linalg.inv(matrices)
    except np.linalg.LinAlgError:
        return np.linalg.pinv(matrices)
