"""The tracer's scene as Blender's objects, in a collection of their own: what the exporter reads again as the same picture.

All of it or nothing: whatever has been made and set is taken back if anything fails.

**How things stand.** A matrix of the tracer is what Blender evaluated: rotation, scale and shear in float32. Location, Euler
angles and scale that give it to the last bit are looked for; where there are none the matrix becomes the parent's inverse of an
Empty at the origin, as Blender's own *Keep Transform* would have it. Rejected: `matrix_world =` (off by 5e-7, and without any
shear), and the Empty for all (the sidebar would show no location).

**What the artist has set stays**, unless asked: the scene's camera if it has one, its resolution, world, film and bounces.
"""

import contextlib
import dataclasses
import math
from collections.abc import Iterator
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ... import rotation
from ...pinhole import Pinhole
from ...tracer.scene import LedgerEntry, Mesh, Object, Scene
from ...tracer.scene.depths import visible_depths
from .. import camera as cameras
from .. import datablocks, findings, picture
from ..temporary_settings import LARGEST_INDEX, Overrides
from . import import_geometry, import_light, linking
from .ledger import Ledger

Array = NDArray[np.float64]

_MIRRORS = np.array([[-1, 1, 1], [1, -1, 1], [1, 1, -1], [-1, -1, -1]])  # the scales that mirror, each with its own rotation
_SHEAR = 2.0**-21  # what float32 may make of a rotation or of one scale for all axes
_PIXEL_ASPECT = 2.0**-23  # what float32 makes of a ratio of two distances


@dataclass(frozen=True)
class ImportedScene:
    """camera : the new one. objects : all that are new, the camera among them. ledger : what became of each thing."""

    camera: bpy.types.Object
    objects: tuple[bpy.types.Object, ...]
    ledger: tuple[LedgerEntry, ...]


def import_scene(
    made: Scene, name: str, scene: bpy.types.Scene, set_picture: bool = False, set_surroundings: bool = False
) -> ImportedScene:
    """Add a scene of the tracer to one of Blender's.

    name : of the collection, the camera and the world. set_picture : the scene shows the file's camera in its
    resolution. set_surroundings : it takes over the file's world, film and bounces, if the file says anything of light.

    Raises
    ------
    InputError
        if the camera, or a picture of its size, is beyond Blender's numbers. Nothing has changed then.
    """
    with contextlib.ExitStack() as undo:
        imported = _SceneImport(made, name, scene, Overrides(undo)).run(set_picture, set_surroundings)
        undo.pop_all()
    return imported


class _SceneImport:
    """One import while it runs. Its ledger tells of things by the names that they have in the file."""

    def __init__(self, made: Scene, name: str, scene: bpy.types.Scene, overrides: Overrides) -> None:
        self._made, self._name, self._scene, self._overrides = made, name, scene, overrides
        self._ledger = Ledger()
        self._paints = import_light.Paints(made, overrides, self._ledger)
        self._objects: list[bpy.types.Object] = []
        self._surfaces_named: dict[str, list[bpy.types.Object]] = {}
        self._root: bpy.types.Object | None = None
        self._collection = bpy.data.collections.new(name)
        overrides.afterwards(bpy.data.batch_remove, [self._collection])
        scene.collection.children.link(self._collection)

    def run(self, set_picture: bool, set_surroundings: bool) -> ImportedScene:
        made, scene, ledger = self._made, self._scene, self._ledger
        if set_picture:
            self._set_picture()
        camera = self._camera(set_picture or scene.camera is None)
        self._surfaces()
        for lamp in made.lamps:
            data, matrix = self._paints.light(lamp)
            block = self._placed(lamp.name, data, matrix)
            import_light.hide(block, lamp.hidden_from)
            linking.link([block], lamp, self._surfaces_named, self._overrides)
            ledger.placed(lamp.name)
        if import_light.has_light(made):
            if set_surroundings:
                import_light.set_surroundings(scene, made, self._name, self._overrides, ledger)
            else:
                ledger.note(scene.name, "approximated", "the scene keeps its own world, film and bounces")
        if any(made.origin):
            at = ", ".join(f"{value:.9g}" for value in made.origin)
            ledger.note(
                self._name, "approximated", f"its coordinates count from the point {at} of the world, and here from 0, 0, 0"
            )
        return ImportedScene(camera, tuple(self._objects), ledger.entries())

    def _new(self, name: str, data: bpy.types.ID | None) -> bpy.types.Object:
        block = bpy.data.objects.new(name, data)
        self._overrides.afterwards(bpy.data.batch_remove, [block])
        self._collection.objects.link(block)
        self._objects.append(block)
        return block

    # --- The camera

    def _set_picture(self) -> None:
        picture.set_size(self._overrides, self._scene, self._made.camera)

    def _camera(self, is_shown: bool) -> bpy.types.Object:
        data = bpy.data.cameras.new(self._name)
        self._overrides.afterwards(bpy.data.batch_remove, [data])
        block = self._new(self._name, data)
        pinhole = self._fitted(self._shown())
        depths = visible_depths(dataclasses.replace(self._made, camera=pinhole))
        for name, depth in zip(("clip_start", "clip_end"), depths, strict=True):
            self._ledger.store(data, name, depth, self._name)
        if is_shown:
            self._overrides.set(self._scene, "camera", block)
        for finding in cameras.apply(block, pinhole, self._scene):
            self._ledger.note(self._name, "approximated", finding)
        self._ledger.placed(self._name)
        return block

    def _shown(self) -> Pinhole:
        """The camera as the file states it, where that is what it shows."""
        shown, stated = self._made.camera, self._made.stated_camera
        if stated is None:
            return shown
        reach = max(map(abs, (*stated.eye, *shown.eye)))
        if not findings.differences(stated, shown, reach):
            return stated
        self._ledger.note(
            self._name, "approximated", "in the file it does not show what it states, and here it states what it shows"
        )
        return shown

    def _fitted(self, pinhole: Pinhole) -> Pinhole:
        """The camera of the scene's own picture that is as wide a view."""
        frame = datablocks.frame_of(self._scene)
        _, _, width, height = frame.window
        across = width / pinhole.width
        distance = pinhole.distance[0] * across, pinhole.distance[0] * across * frame.pixel_aspect_x / frame.pixel_aspect_y
        upwards = distance[1] / pinhole.distance[1]
        if (width, height) == (pinhole.width, pinhole.height) and abs(upwards - 1) <= _PIXEL_ASPECT:
            return pinhole
        sizes = f"its picture is {pinhole.width} × {pinhole.height} pixels and the scene's {width} × {height}"
        self._ledger.note(self._name, "approximated", f"{sizes}: it is as wide a view")
        centre_x, centre_y = pinhole.principal_point
        principal_point = centre_x * across, height / 2 + (centre_y - pinhole.height / 2) * upwards
        return dataclasses.replace(pinhole, distance=distance, width=width, height=height, principal_point=principal_point)

    # --- Surfaces

    def _surfaces(self) -> None:
        """Every object, those of one geometry sharing its data."""
        paints = self._paints
        data: dict[str, list[tuple[int, bpy.types.Mesh | bpy.types.PointCloud]]] = {}
        blocks: list[list[bpy.types.Object]] = []  # of each object
        for placed in self._made.objects:
            if placed.geometry not in data:
                data[placed.geometry] = self._data(placed.geometry)
            slots = [
                paints.material(placed.materials[i] if i < len(placed.materials) else "", index)
                for i, index in enumerate(placed.material_indices)
            ]
            blocks.append([])
            for first, block in data[placed.geometry]:
                shown = [slots[first]] if isinstance(block, bpy.types.PointCloud) else slots
                for matrix in placed.matrices:
                    one = dataclasses.replace(placed, matrix=matrix, random=None)
                    blocks[-1].append(self._surface(one, block, shown))
            if placed.random is not None:
                self._ledger.note(placed.name, "approximated", "its random numbers are Blender's own")
            self._ledger.placed(placed.name, len(placed.matrices))
        for placed, shown in zip(self._made.objects, blocks, strict=True):
            linking.link(shown, placed, self._surfaces_named, self._overrides)

    def _data(self, name: str) -> list[tuple[int, bpy.types.Mesh | bpy.types.PointCloud]]:
        """(first material, data) of each datablock that a geometry becomes."""
        geometry = self._made.geometries[name]
        if isinstance(geometry, Mesh):
            return [(0, import_geometry.mesh_from(geometry, name, self._overrides, self._ledger))]
        return [
            (first, import_geometry.points_from(part, name, self._overrides))
            for first, part in import_geometry.parts_of(geometry)
        ]

    def _surface(
        self,
        placed: Object,
        data: bpy.types.Mesh | bpy.types.PointCloud,
        slots: list[bpy.types.Material],
    ) -> bpy.types.Object:
        if not data.materials:
            for material in slots:
                data.materials.append(material)
        block = self._placed(placed.name, data, placed.matrix)
        for slot, material in zip(block.material_slots, slots, strict=False):
            if slot.material != material:  # another object of this geometry has others
                slot.link, slot.material = "OBJECT", material
        block.pass_index = min(placed.object_index, LARGEST_INDEX)
        if placed.object_index > LARGEST_INDEX:
            reason = f"its index is {placed.object_index}, and Blender's end at {LARGEST_INDEX}"
            self._ledger.note(placed.name, "approximated", reason)
        block.color = placed.color
        import_light.hide(block, placed.hidden_from)
        self._surfaces_named.setdefault(placed.name, []).append(block)
        return block

    def _placed(self, name: str, data: bpy.types.ID, matrix: Array) -> bpy.types.Object:
        """A new object that stands by a matrix, rounded to float32."""
        block = self._new(name, data)
        if not stands(block, matrix):
            if self._root is None:
                self._root = self._new(self._name, None)
            block.parent = self._root
            block.matrix_parent_inverse = Matrix(matrix)
        return block


def stands(block: bpy.types.Object, matrix: Array) -> bool:
    """Set location, rotation and scale of an object without a parent to those that give a matrix, rounded to float32.

    Returns False, and leaves the object at the origin, if none do to the last bit.
    """
    wanted = matrix.astype(np.float32)
    sizes = np.linalg.norm(matrix[:3, :3], axis=0)
    if not sizes.all() or rotation.skew(matrix[:3, :3]) > _SHEAR:
        return False
    block.location = wanted[:3, 3]
    mirrors = _MIRRORS if np.linalg.det(matrix[:3, :3]) < 0 else np.ones((1, 3))
    for signed in mirrors * sizes:
        angles = rotation.euler(rotation.nearest(matrix[:3, :3] / signed), "XYZ")
        for scale in _likely_scales(signed):
            block.scale = scale
            for each in _likely_angles(angles):
                block.rotation_euler = each
                if np.array_equal(np.array(block.matrix_basis, dtype=np.float32), wanted):
                    return True
    block.location, block.rotation_euler, block.scale = (0, 0, 0), (0, 0, 0), (1, 1, 1)
    return False


def _likely_angles(angles: tuple[float, ...]) -> Iterator[Array]:
    """Euler angles that may be meant, about x, then y, then z: of few digits in degrees, or as they are; both triples."""
    x, y, z = angles
    other = (x - math.copysign(math.pi, x), math.copysign(math.pi, y) - y, z - math.copysign(math.pi, z))
    for triple in (angles, other):
        yield np.radians(np.round(np.degrees(triple), 3))
    for triple in (angles, other):
        yield from rotation.neighbours(triple)


def _likely_scales(sizes: Array) -> list[tuple[float, ...]]:
    """Scales that may be meant: with few digits, the same along all axes, or as they are."""
    likely = [sizes]
    if np.ptp(np.abs(sizes)) <= _SHEAR * np.abs(sizes).max():
        likely.insert(0, np.copysign(np.abs(sizes).mean(), sizes))
    likely = [*([float(f"{size:.6g}") for size in scale] for scale in likely), *likely]
    return list(dict.fromkeys(tuple(np.float32(scale).tolist()) for scale in likely))
