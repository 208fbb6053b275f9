"""What each pixel's centre shows: the instance, its primitive and the point, in double precision."""

import hashlib
import itertools
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..pinhole import Pinhole
from ..tracer.native import CoreScene
from ..tracer.render import Tracer
from ..tracer.scene import Mesh, Object, Scene, Spheres

Array = NDArray[np.float64]

# What the tracer's float32 passes may differ from float64 where they show the same surface: one rounding, and its own.
_SAME_DEPTH = 2.0**-22

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


class Surfaces:
    """A scene's surfaces at the pixels' centres; rows from the bottom.

    depth : (height, width) planar depth z = −w·(P − e), inf where nothing is. instance, primitive : (height, width), −1 there:
    indices into `instances` and of the geometry's triangles or spheres.
    """

    def __init__(self, scene: Scene, threads: int | None = None) -> None:
        self.scene, self.camera, self.instances = scene, scene.camera, instances(scene)
        self._tracer = Tracer(scene, threads)
        self.depth, self.instance, self.primitive = self._tracer.hits()

    @cached_property
    def shown(self) -> list[tuple[Instance, NDArray[np.intp]]]:
        """Each instance that any pixel shows, and its pixels, by their numbers row by row."""
        order = np.argsort(self.instance, axis=None, kind="stable")
        numbers = self.instance.ravel()[order]
        starts = np.flatnonzero(np.diff(numbers, prepend=-2))
        parts = np.split(order, starts[1:])
        return [(self.instances[numbers[s]], part) for s, part in zip(starts, parts, strict=True) if numbers[s] >= 0]

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

    def normals(self) -> NDArray[np.float32]:
        """(height, width, 3): the shading normals, world space, unit length, on the camera's side; 0 where nothing is."""
        passes = self._tracer.render(names=("Depth", "Normal"))
        found, hit = passes["Normal"], np.isfinite(self.depth)
        found[~hit] = 0.0
        with np.errstate(invalid="ignore"):
            other = hit & ~(np.abs(passes["Depth"][..., 0] - self.depth) <= _SAME_DEPTH * self.depth)
        # A ray that meets two surfaces on their common outline may have met the other one here: then this one's own.
        for instance, pixels in self.shown if other.any() else ():
            chosen = pixels[other.ravel()[pixels]]
            if len(chosen):
                found.reshape(-1, 3)[chosen] = self._true_normals(instance, chosen)
        return found

    def _true_normals(self, instance: Instance, pixels: NDArray[np.intp]) -> Array:
        geometry, primitive = self.scene.geometries[instance.placed.geometry], self.primitive.ravel()[pixels]
        if isinstance(geometry, Spheres):
            normals = self.local_points(instance, pixels) - geometry.centers[primitive]
        else:
            a, b, c = np.moveaxis(geometry.vertices[geometry.triangles[primitive]], 1, 0)
            normals = np.cross(b - a, c - a)
        normals = normals @ instance.inverse[:3, :3]  # the transposed inverse, of rows
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        towards = np.array(self.camera.eye) - self.points.reshape(-1, 3)[pixels]
        return normals * np.where((normals * towards).sum(1, keepdims=True) < 0, -1.0, 1.0)

    def material_indices(self) -> NDArray[np.int64]:
        """(height, width): what the Material Index pass shows, 0 where nothing is."""
        found = np.zeros(self.instance.size, np.int64)
        for instance, pixels in self.shown:
            slots = self.scene.geometries[instance.placed.geometry].materials[self.primitive.ravel()[pixels]]
            found[pixels] = np.array(instance.placed.material_indices)[slots]
        return found.reshape(self.instance.shape)

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
        self._surfaces, self._cores, self._boxes = surfaces, {}, {}

    def pixels(self, instance: Instance, visible: NDArray[np.intp]) -> NDArray[np.intp]:
        """(n,), in order. visible : those that show it among the others, which belong to it in any case."""
        columns, rows = self._reach(instance)
        if not (len(columns) and len(rows)) or "camera" in instance.placed.hidden_from:
            return visible
        # In its object's space, so that a geometry is made ready once for all its instances; what is flattened, in the world.
        camera, (near, far) = self._surfaces.camera, self._surfaces.scene.clip
        is_flat = np.linalg.det(instance.matrix[:3, :3]) == 0
        turned, eye = np.eye(3), np.array([camera.eye])
        if not is_flat:
            turned, eye = instance.inverse[:3, :3].T, instance.local(eye)
        u, v, w = camera.basis()
        x, y = camera.view_plane(np.arange(*columns) + 0.5, 0.5)[0], camera.view_plane(0.5, np.arange(*rows) + 0.5)[1]
        axes = np.array([-u if camera.mirrored else u, v, -w]) @ turned
        directions = (x[:, None] * axes[0] + axes[2]) + (y[:, None] * axes[1])[:, None]
        core = self._core(instance.placed.geometry, instance.matrix if is_flat else np.eye(4))
        rays = core.rays(eye, directions.reshape(-1, 3), np.nextafter(near, 0.0), np.nextafter(far, np.inf))
        hit = np.flatnonzero(core.closest(rays)[1] >= 0)
        row, column = np.divmod(hit, len(x))
        return np.union1d((row + rows[0]) * camera.width + column + columns[0], visible)

    def _core(self, name: str, matrix: Array) -> CoreScene:
        if (key := (name, matrix.tobytes())) not in self._cores:
            alone = Object("", name, matrix)
            geometry = self._surfaces.scene.geometries[name]
            geometry = replace(geometry, materials=np.zeros_like(geometry.materials))
            middle = sum(self._box(name)) / 2
            away = tuple(middle + np.array([0, 0, 1 + np.abs(middle).max()]))
            camera = Pinhole(tuple(middle), away, (0, 1, 0), 1, 1, 1)  # only so that rendering space's origin is near
            self._cores[key] = CoreScene(Scene(camera, {name: geometry}, (alone,)), 1)
        return self._cores[key]

    def _box(self, name: str) -> tuple[Array, Array]:
        if name not in self._boxes:
            self._boxes[name] = box(self._surfaces.scene.geometries[name])
        return self._boxes[name]

    def _reach(self, instance: Instance) -> tuple[tuple[int, int], tuple[int, int]]:
        """From which column and row to before which an instance is at most, by the corners of its box."""
        camera, (least, greatest) = self._surfaces.camera, self._box(instance.placed.geometry)
        corners = np.array(list(itertools.product(*zip(least, greatest, strict=True))))
        column, row, depth = camera.project(corners @ instance.matrix[:3, :3].T + instance.matrix[:3, 3])
        if not (depth > 0).any():
            return (0, 0), (0, 0)
        if not ((depth > 0).all() and np.isfinite(column).all() and np.isfinite(row).all()):
            return (0, camera.width), (0, camera.height)
        # Half a pixel and more beyond the centres that lie within, for rounding.
        spans = [(np.floor(places.min()) - 1, np.ceil(places.max()) + 1) for places in (column, row)]
        return tuple(
            (int(min(max(first, 0), size)), int(min(max(last, 0), size)))
            for (first, last), size in zip(spans, (camera.width, camera.height), strict=True)
        )


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
