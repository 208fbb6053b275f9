"""A scene whose origin is a camera's eye, for as long as it is needed: what float32 can't tell apart far from the origin.

At 6.4e6 m, where geocentric coordinates lie, two neighboring float32 numbers are half a meter apart. Blender keeps matrices
and vertices so, and that can't be mended; but Cycles multiplies and subtracts them in float32 too, and loses pixels with it. So
everything that a render would show is placed anew, in a scene of its own: evaluated geometry is copied, once for each that
Cycles shares, and the difference to the eye is taken in float64.

- Instances stand at R, t − s, with s the eye. The matrix is the inverse of a parent at the origin, which Blender multiplies by
  ones and zeros: no rotation is taken apart, and shear survives.
- Vertices far from their object's own origin (a map in UTM coordinates) need more: each geometry moves by its point c that is
  nearest to the eye, v − c, and its instances by R c − s + t. Then no coordinate exceeds the distance and the size of what is
  seen.
- The camera is a new one at the origin. It shows the four values in float64, where the file's camera is what they say but for
  rounding; else what the file's camera shows.

Everything is then verified against the file: each matrix and each vertex that Blender evaluates there.

Rejected: an Empty at −s as the parent of all that has none. Whatever is computed in world space does not follow it (Child Of
and Limit constraints, baked particles, rigid bodies, drivers, noise in geometry nodes), maps keep their vertices, and children
and instances, which the file has rounded to half a meter, come out elsewhere than in the file.
"""

import contextlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields, replace
from typing import TypeAlias

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ...errors import InputError
from ...pinhole import Pinhole
from ...tracer.scene import Object
from ...tracer.scene.shader_nodes import KINDS
from .. import camera as cameras
from .. import conversion, datablocks, findings, pose
from ..temporary_settings import Overrides, overridden
from . import export_geometry, features, linking, materials
from .depsgraph import visit_still
from .export import Surface, light_in, placements
from .film import CYCLES_SETTINGS
from .ledger import Ledger
from .shading import Shading
from .world import shown_world

Array = NDArray[np.float64]
Geometry: TypeAlias = bpy.types.Mesh | bpy.types.PointCloud

# A number is rounded once when Blender stores it; twice that allows for a last place of its product with a 1.
_ROUNDING = 2.0**-23
_LEAST = float(np.finfo(np.float32).tiny)
# Nodes, and outputs of theirs, that tell where in the file something is, or which object.
_PLACES = {("object_info", "location"), ("object_info", "random"), ("geometry", "position"), ("texture_coordinate", "object")}

_UNLINKED = "light linking is off on both sides"  # it does not come along

# The render settings that make the picture's frame.
_FRAME = (
    "resolution_x",
    "resolution_y",
    "resolution_percentage",
    "pixel_aspect_x",
    "pixel_aspect_y",
    "use_border",
    "border_min_x",
    "border_max_x",
    "border_min_y",
    "border_max_y",
    "film_transparent",
)


@dataclass(frozen=True)
class Recentered:
    """A scene to render in place of the file's.

    origin : the file's point that is the origin here: the eye.
    names : object here → the object in the file that it shows.
    """

    scene: bpy.types.Scene
    camera: bpy.types.Object
    origin: tuple[float, float, float]
    names: dict[str, str]


@dataclass(frozen=True, eq=False)
class _Copy:
    """A geometry of the file, moved.

    points : (n, 3) float32, as the file has them.
    anchor : (3,), what was taken off them.
    """

    data: Geometry
    points: NDArray[np.float32]
    anchor: Array


@dataclass(frozen=True, eq=False)
class _Placed:
    """An object of the file in one place.

    data : the datablock that is shown.
    matrix : (4, 4), of `data` relative to the eye.
    """

    name: str
    data: bpy.types.ID
    matrix: Array
    object_index: int = 0
    hidden_from: frozenset[str] = frozenset()
    color: tuple[float, float, float, float] = Object.color


@dataclass(frozen=True, eq=False)
class _View:
    """The camera of the file that a recentered scene is seen through.

    actual : the pinhole to render.
    claimed : the pinhole that it is said to be. Both are in the file's world space.
    """

    actual: Pinhole
    claimed: Pinhole
    sensor_fit: str
    sensor: tuple[float, float]
    clip: tuple[float, float]


@contextlib.contextmanager
def recentered(
    scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, camera_object: bpy.types.Object, ledger: Ledger, lit: bool = False
) -> Iterator[Recentered]:
    """Give what a render of this view layer shows, as a scene whose origin is the eye; it is gone at the end of the block.

    ledger : receives what could not come, see `export.survey`.
    lit : true to bring along what only other rays than the camera's see, for the levels above geometry.

    Raises InputError as `export.export_scene` does, and if something does not stand where it should.
    """
    features.note_render(scene, view_layer, camera_object, ledger, lit)
    with overridden() as overrides:
        keys = set(bpy.data.shape_keys)
        overrides.afterwards(_remove_keys_but, keys)
        view, placed, copies = visit_still(
            scene, view_layer, camera_object, lambda depsgraph: _seen(depsgraph, camera_object, ledger, overrides, lit)
        )
        _remove_keys_but(keys)
        temporary = _empty_scene(overrides, scene, view_layer)
        camera = _camera(overrides, temporary, view)  # before all others: it asks for a depsgraph
        copies_by_source = _place(overrides, temporary, placed)
        visit_still(temporary, temporary.view_layers[0], camera, lambda depsgraph: _verify(depsgraph, copies_by_source, copies))
        yield Recentered(
            temporary, camera, view.actual.eye, {each.name: source.name for each, source in copies_by_source.items()}
        )


def as_in_file(objects: Iterable[Object], names: Mapping[str, str]) -> tuple[Object, ...]:
    """The objects of an exported `Recentered` as the file's own export has them: by their names there, instances as one object.

    Here each place has an object of its own, and so a name of its own, that the exporter keeps apart.

    names : see `Recentered`.
    """
    result: dict[tuple, list[Object]] = {}
    for placed in (replace(each, name=names[each.name]) for each in objects):
        all_but_place = tuple(getattr(placed, each.name) for each in fields(placed) if each.name not in ("matrix", "random"))
        result.setdefault(all_but_place, []).append(placed)

    def together(same: list[Object]) -> Object:
        if len(same) == 1:
            return same[0]
        random = None if same[0].random is None else np.concatenate([each.random for each in same])
        return replace(same[0], matrix=np.concatenate([each.matrices for each in same]), random=random)

    return tuple(map(together, result.values()))


def _seen(
    depsgraph: bpy.types.Depsgraph, camera_object: bpy.types.Object, ledger: Ledger, overrides: Overrides, lit: bool
) -> tuple[_View, list[_Placed], dict[bpy.types.ID, _Copy]]:
    """The objects of the file that are rendered; geometries are copied, and the copies gone when the overrides end."""
    if lit:
        light_in(depsgraph, ledger, render=False)  # for what the ledger tells of the file's own lamps
    view = _view(depsgraph, camera_object)
    eye = np.array(view.actual.eye)
    plain = materials.plain(overrides)
    copies: dict[tuple[int, int], _Copy] = {}
    placed = []
    shading = Shading() if lit else None
    geometries: dict[tuple[int, int], Geometry] = {}

    def copy_of(source: Surface, evaluated: bpy.types.Object) -> None:
        if source.key not in geometries:
            with export_geometry.mesh_shown(evaluated) if source.is_mesh else contextlib.nullcontext(evaluated.data) as data:
                geometries[source.key] = data.copy()
            overrides.afterwards(bpy.data.batch_remove, [geometries[source.key]])

    placed_objects = placements(depsgraph, ledger, shading, copy_of)
    if shading is not None:
        for source, *_ in placed_objects:
            _note_places(source, shading, ledger)
            if source.is_linked:
                ledger.note(source.name, "approximated", _UNLINKED)
    for source, matrix in ((source, matrix) for source, matrices, _ in placed_objects for matrix in matrices):
        matrix[:3, 3] -= eye
        if source.key not in copies:
            data = geometries[source.key]
            _set_materials(data, [(material and material.original) or plain for material in source.slots])
            copies[source.key] = _moved(data, matrix)
        copy = copies[source.key]
        matrix[:3, 3] += matrix[:3, :3] @ copy.anchor
        placed.append(_Placed(source.name, copy.data, matrix, source.object_index, source.hidden_from, source.color))
    return view, [*placed, *_lights(depsgraph, eye, ledger)], {copy.data: copy for copy in copies.values()}


def _note_places(source: Surface, shading: Shading, ledger: Ledger) -> None:
    """Name materials that say otherwise here than in the file: on both sides, which both are moved."""
    for material in filter(None, source.slots):
        places = {
            node.type
            for node in shading.reading(material).material.nodes
            if "output" in KINDS[node.type].inputs and (node.type, node["output"]) in _PLACES
        }
        if places:
            ledger.note(
                source.name,
                "approximated",
                f"material {material.name!r} asks where it is, or which object: another answer on both sides than in the file",
            )


def _remove_keys_but(keys: set[bpy.types.Key]) -> None:
    """Shape keys come along when a mesh is copied, although its points are evaluated ones; 4.2 does not say whose they are."""
    bpy.data.batch_remove([key for key in bpy.data.shape_keys if key not in keys])


def _lights(depsgraph: bpy.types.Depsgraph, eye: Array, ledger: Ledger) -> Iterator[_Placed]:
    """They leave no mark in the passes of geometry, and make the picture one that can be looked at."""
    for instance in depsgraph.object_instances:
        if instance.object.type == "LIGHT" and instance.show_self:
            matrix = np.array(instance.matrix_world, dtype=np.float64)
            matrix[:3, 3] -= eye
            placed = features.placed_by(instance)
            hidden_from = features.hidden_from(placed, depsgraph.view_layer_eval)
            if linking.is_linked(placed.real.original):
                ledger.note(placed.name, "approximated", _UNLINKED)
            yield _Placed(instance.object.original.name, instance.object.data.original, matrix, hidden_from=hidden_from)


def _view(depsgraph: bpy.types.Depsgraph, camera_object: bpy.types.Object) -> _View:
    camera = camera_object.evaluated_get(depsgraph)
    pinhole = cameras.read(camera, depsgraph.scene)
    stated = cameras.stated(camera, depsgraph.scene)
    if stated and not findings.differences(stated, pinhole, pose.reach(camera_object, depsgraph)):
        pinhole = stated
    return _View(
        actual=pinhole,
        claimed=stated or pinhole,
        sensor_fit=camera.data.sensor_fit,
        sensor=datablocks.own_sensor(camera.data),
        clip=(camera.data.clip_start, camera.data.clip_end),
    )


def _set_materials(data: Geometry, slots: list[bpy.types.Material]) -> None:
    """Give a geometry the materials that its object's slots have."""
    for index, material in enumerate(slots):
        if index == len(data.materials):
            data.materials.append(material)
        else:
            data.materials[index] = material


def _points_of(data: Geometry) -> tuple[bpy.types.bpy_prop_collection, NDArray[np.float32]]:
    """The points of a geometry as Blender has them, and as an array, (n, 3)."""
    elements = data.vertices if isinstance(data, bpy.types.Mesh) else data.points
    points = np.empty((len(elements), 3), np.float32)
    elements.foreach_get("co", points.ravel())
    return elements, points


def _moved(data: Geometry, matrix: Array) -> _Copy:
    """Take off a copied geometry the point of its bounding box that is nearest to the eye.

    matrix : (4, 4), of the first object that shows it, relative to the eye.
    """
    elements, points = _points_of(data)
    finite = points[np.isfinite(points).all(axis=1)].astype(np.float64)
    if not len(finite):
        return _Copy(data, points, np.zeros(3))
    eye = np.linalg.pinv(matrix[:3, :3]) @ -matrix[:3, 3]
    anchor = np.clip(eye, finite.min(axis=0), finite.max(axis=0))
    elements.foreach_set("co", (points - anchor).astype(np.float32).ravel())
    data.update_tag()
    return _Copy(data, points, anchor)


def _empty_scene(overrides: Overrides, scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> bpy.types.Scene:
    """A scene that renders pictures of the same frame and film, with the same world."""
    temporary = bpy.data.scenes.new("Virtual Pinhole")
    overrides.afterwards(bpy.data.scenes.remove, temporary)
    for name in _FRAME:
        setattr(temporary.render, name, getattr(scene.render, name))
    temporary.render.use_crop_to_border = scene.render.use_border  # as in temporary_settings.still_of_one_layer
    if hasattr(scene, "cycles"):
        for name in CYCLES_SETTINGS:
            setattr(temporary.cycles, name, getattr(scene.cycles, name))
    temporary.world = shown_world(scene, view_layer)
    temporary.frame_current = scene.frame_current
    return temporary


def _place(overrides: Overrides, temporary: bpy.types.Scene, placed: list[_Placed]) -> dict[bpy.types.Object, _Placed]:
    """An object for each of these, all of them children of one at the origin."""
    root = bpy.data.objects.new("Virtual Pinhole", None)
    objects = [root]
    overrides.afterwards(bpy.data.batch_remove, objects)
    temporary.collection.objects.link(root)
    result = {}
    for each in placed:
        block = bpy.data.objects.new(each.name, each.data)
        objects.append(block)
        block.parent = root
        block.matrix_parent_inverse = Matrix(each.matrix)
        block.pass_index, block.color = each.object_index, each.color
        for ray in each.hidden_from:
            setattr(block, f"visible_{ray}", False)
        temporary.collection.objects.link(block)
        result[block] = each
    return result


def _camera(overrides: Overrides, temporary: bpy.types.Scene, view: _View) -> bpy.types.Object:
    """A camera that shows `view.actual`, and states `view.claimed`."""
    data = bpy.data.cameras.new("Virtual Pinhole")
    overrides.afterwards(bpy.data.batch_remove, [data])
    block = bpy.data.objects.new("Virtual Pinhole", data)
    overrides.afterwards(bpy.data.batch_remove, [block])
    temporary.collection.objects.link(block)
    temporary.camera = block
    data.sensor_fit, (data.sensor_width, data.sensor_height) = view.sensor_fit, view.sensor
    data.clip_start, data.clip_end = view.clip
    actual, claimed = (_relative(pinhole, view.actual.eye) for pinhole in (view.actual, view.claimed))
    conversion.place(block, actual, temporary, datablocks.depsgraph_of(temporary))
    frame = datablocks.frame_of(temporary)
    distance = claimed.distance[0] * frame.resolution_x / frame.size[0]
    cameras.CameraSync.of(block).state(claimed.eye, claimed.look_at, claimed.up, distance, frame)
    return block


def _relative(pinhole: Pinhole, origin: tuple[float, ...]) -> Pinhole:
    """The pinhole where `origin` is (0, 0, 0)."""
    x, y, z = origin
    eye, look_at = ((p[0] - x, p[1] - y, p[2] - z) for p in (pinhole.eye, pinhole.look_at))
    return replace(pinhole, eye=eye, look_at=look_at)


def _verify(depsgraph: bpy.types.Depsgraph, placed: dict[bpy.types.Object, _Placed], copies: dict[bpy.types.ID, _Copy]) -> None:
    """Raise InputError, by name, unless everything stands relative to the eye as in the file, each number rounded once."""
    missing = dict(placed)
    verified = set()
    for instance in depsgraph.object_instances:
        block = instance.object.original
        if block not in missing:
            continue
        each = missing.pop(block)
        _compare(each.name, np.array(instance.matrix_world), each.matrix)
        if each.data in copies and each.data not in verified:
            verified.add(each.data)
            copy, (_, points) = copies[each.data], _points_of(instance.object.data)
            _compare(each.name, points, copy.points - copy.anchor)
    for each in missing.values():
        raise InputError(f"object {each.name!r} is missing in the scene that was moved to the eye: leave --recenter out")


def _compare(name: str, actual: NDArray, wanted: Array) -> None:
    if actual.shape == wanted.shape and np.allclose(actual, wanted, rtol=_ROUNDING, atol=_LEAST, equal_nan=True):
        return
    raise InputError(
        f"object {name!r} did not follow when the scene was moved to the eye, perhaps an add-on moves it: leave --recenter out"
    )
