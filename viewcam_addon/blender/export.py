"""Blender's scene as the tracer's scene: what Cycles would render, frozen at the current frame.

Everything comes from the depsgraph of a render (depsgraph.py) through its object instances, as in Cycles' own synchronisation
(intern/cycles/blender/object.cpp and geometry.cpp): modifiers, shape keys, armatures and drivers are evaluated; curves, text,
surfaces and metaballs arrive as meshes; collections, geometry nodes and particles as instances that share their data. A
geometry is stored once for each evaluated mesh. Rejected: `to_mesh` per object, which sees no instances and copies each mesh.

What has no counterpart is noted in the ledger, with the remedy that takes it out of Cycles' render.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..tracer.scene import Mesh, Object, Scene, Spheres
from . import camera as cameras
from . import export_geometry, features
from .borrowing import borrowed, still_of_one_layer
from .depsgraph import visit
from .ledger import Ledger

Matrix = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Source:
    """A visible surface that stands in the world once or many times.

    data : evaluated. key : the same for all that share a geometry in Cycles. slots : the materials, evaluated, at least 1.
    """

    name: str
    data: bpy.types.Mesh | bpy.types.PointCloud
    key: tuple[int, int]
    object_index: int
    slots: tuple[bpy.types.Material | None, ...]

    @property
    def materials(self) -> tuple[int, ...]:
        """The materials' pass indices."""
        return tuple(material.pass_index if material else 0 for material in self.slots)


def export_scene(
    scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, camera_object: bpy.types.Object, ledger: Ledger
) -> Scene:
    """The scene as a render of this view layer through this camera sees it, at the scene's current frame.

    ledger : notes what could not come; afterwards it holds the remedies for Cycles' side.

    Raises
    ------
    InputError
        if the camera is no pinhole (orthographic, panoramic, sheared), or if Blender can't render the scene.
    """
    features.note_render(scene, view_layer, camera_object, ledger)
    with borrowed() as borrow:
        still_of_one_layer(borrow, scene, view_layer, camera_object)
        return visit(scene, lambda depsgraph: scene_in(depsgraph, camera_object, ledger))


def survey(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, camera_object: bpy.types.Object, ledger: Ledger) -> None:
    """Fill the ledger as `export_scene` does, without reading any geometry."""
    features.note_render(scene, view_layer, camera_object, ledger)
    with borrowed() as borrow:
        still_of_one_layer(borrow, scene, view_layer, camera_object)
        visit(scene, lambda depsgraph: [None for _ in placements(depsgraph, ledger)])


def scene_in(depsgraph: bpy.types.Depsgraph, camera_object: bpy.types.Object, ledger: Ledger) -> Scene:
    """The scene in the depsgraph that a render engine is given."""
    names: dict[tuple[int, int], str] = {}
    geometries: dict[str, Mesh | Spheres] = {}
    objects = []
    for source, matrix in placements(depsgraph, ledger):
        if source.key not in names:
            geometry = _geometry(source, ledger)
            names[source.key] = _free_name(source.data.name, geometries)
            geometries[names[source.key]] = geometry
        objects.append(Object(source.name, names[source.key], matrix, source.object_index, source.materials))
    camera = camera_object.evaluated_get(depsgraph)
    return Scene(
        camera=cameras.read(camera, depsgraph.scene),
        geometries=geometries,
        objects=tuple(_drawn(objects, geometries, ledger)),
        stated_camera=cameras.stated(camera, depsgraph.scene),
        clip=(camera.data.clip_start, camera.data.clip_end),
        ledger=ledger.entries(),
    )


def placements(depsgraph: bpy.types.Depsgraph, ledger: Ledger) -> Iterator[tuple[Source, Matrix]]:
    """Each surface that the camera may see, and its (4, 4) matrix to world space, one for each instance."""
    known: dict[tuple[int, ...], Source | None] = {}
    for instance in depsgraph.object_instances:
        features.note_hair(instance, ledger)
        shown = instance.object
        if not instance.show_self or shown.data is None:
            continue
        real, parent = (instance.instance_object, instance.parent) if instance.is_instance else (shown, shown)
        identity = (real.as_pointer(), parent.as_pointer(), shown.data.as_pointer())
        if identity not in known:
            known[identity] = _source(features.Placed(shown, real, parent), depsgraph, ledger)
        source = known[identity]
        if source:
            ledger.placed(source.name)
            yield source, np.array(instance.matrix_world, dtype=np.float64)


def _source(placed: features.Placed, depsgraph: bpy.types.Depsgraph, ledger: Ledger) -> Source | None:
    """What one object shows, or None if the camera sees nothing of it."""
    if not features.is_surface(placed, ledger):
        return None
    shown, real, parent = placed
    layer = depsgraph.view_layer_eval
    hidden = not (shown.visible_camera and parent.visible_camera) or (
        parent.indirect_only_get(view_layer=layer) and not parent.holdout_get(view_layer=layer)
    )
    if hidden:
        ledger.note(placed.name, "exported", "not visible to the camera")
        return None
    data = shown.data
    if isinstance(data, bpy.types.Mesh):
        if data.is_editmode:  # the file is in edit mode: what is edited must be made a mesh first
            data = real.to_mesh()
        if not data.polygons:
            return None
        if not layer.use_solid:
            ledger.note(placed.name, "exported", "the view layer leaves out surfaces")
            return None
    override = layer.material_override
    slots = [override or slot.material for slot in shown.material_slots] or [override]
    features.note_object(placed, slots, depsgraph, ledger)
    # Cycles shares a geometry among objects unless a slot belongs to the object (BlenderSync::BKE_object_is_modified).
    own = any(slot.link == "OBJECT" for slot in shown.material_slots)
    return Source(
        name=placed.name,
        data=data,
        key=(data.as_pointer(), real.as_pointer() if own else 0),
        object_index=shown.pass_index,
        slots=tuple(slots),
    )


def _geometry(source: Source, ledger: Ledger) -> Mesh | Spheres:
    if not isinstance(source.data, bpy.types.Mesh):
        return export_geometry.spheres_of(source.data)
    mesh = export_geometry.mesh_of(source.data, len(source.materials))
    if nowhere := len(source.data.loop_triangles) - len(mesh.triangles):
        ledger.note(
            source.name, "exported", f"{nowhere} triangles have vertices that are not finite, and Cycles draws none of them"
        )
    return mesh


def _drawn(objects: list[Object], geometries: dict[str, Mesh | Spheres], ledger: Ledger) -> Iterator[Object]:
    """The objects without those that a scale of 0 flattens, of which Cycles draws only meshes that no other object uses."""
    users = Counter(placed.geometry for placed in objects)
    flat = np.linalg.det(np.array([placed.matrix[:3, :3] for placed in objects]).reshape(-1, 3, 3)) == 0
    for placed, is_flat in zip(objects, flat, strict=True):
        if is_flat and (users[placed.geometry] > 1 or isinstance(geometries[placed.geometry], Spheres)):
            ledger.note(placed.name, "exported", "flattened by its scale, and Cycles does not draw it")
        else:
            yield placed


def _free_name(name: str, taken: dict[str, Mesh | Spheres]) -> str:
    """`name`, with a number if another geometry has it."""
    candidate, number = name, 1
    while candidate in taken:
        number += 1
        candidate = f"{name} ({number})"
    return candidate
