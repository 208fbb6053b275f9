"""Blender's scene as the tracer's scene: what Cycles would render, frozen at the current frame.

Everything comes from the depsgraph of a render (depsgraph.py) through its object instances, as in Cycles' own synchronization
(intern/cycles/blender/object.cpp and geometry.cpp): modifiers, shape keys, armatures and drivers are evaluated; curves, text,
surfaces and metaballs arrive as meshes; collections, geometry nodes and particles as instances that share their data. A
geometry is stored once for each evaluated mesh, and an object once for all the places where an instance of it stands: a million
take seconds, since their matrices are read in one go and Python asks each only what it is an instance of. Rejected: `to_mesh`
per object, which sees no instances and copies each mesh.

What has no counterpart is noted in the ledger, with the remedy that takes it out of Cycles' render.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import bpy
import numpy as np
from numpy.typing import NDArray

from ...pinhole import Pinhole
from ...tracer.scene import Mesh, Object, Scene, Spheres, level_of
from ...tracer.scene.film import Bounces, Film
from ...tracer.scene.lamps import RAYS, Lamp, World
from ...tracer.scene.materials import PLAIN, Material, Picture
from .. import camera as cameras
from .. import versions
from . import cycles_attributes, export_geometry, features, film, lamps, linking, materials, world
from .depsgraph import visit_still
from .ledger import Ledger
from .shading import Shading

Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class Surface:
    """A visible surface that stands in the world once or many times; two that are equal are one.

    is_mesh : true for a mesh, false for a point cloud.
    key : a key that all surfaces have in common that share a geometry in Cycles.
    slots : the materials, evaluated, one or more.
    used : the indices of those that are seen.
    hidden_from : the kinds of rays that don't see it.
    color : the object's color with its alpha; for an instance, the color of what places it.
    receivers, blockers : the receivers and blockers of its light where it shines, see Object.
    """

    name: str
    is_mesh: bool
    key: tuple[int, int]
    object_index: int
    slots: tuple[bpy.types.Material | None, ...]
    used: tuple[int, ...]
    hidden_from: frozenset[str]
    color: tuple[float, float, float, float]
    receivers: frozenset[str] | None = None
    blockers: frozenset[str] | None = None

    @property
    def is_linked(self) -> bool:
        return self.receivers is not None or self.blockers is not None

    @property
    def materials(self) -> tuple[int, ...]:
        """The materials' pass indices."""
        return tuple(material.pass_index if material else 0 for material in self.slots)

    @property
    def used_slots(self) -> list[bpy.types.Material | None]:
        """The materials of `slots` that some face, or the points, have."""
        return [self.slots[index] for index in self.used]


@dataclass(frozen=True)
class Lighting:
    """The part of a Scene that gives light, and makes a picture of it."""

    lamps: tuple[Lamp, ...]
    world: World
    film: Film
    bounces: Bounces
    cycles: tuple[int, int] = versions.CYCLES


def export_scene(
    scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, camera_object: bpy.types.Object, ledger: Ledger, lit: bool = False
) -> Scene:
    """The scene as a render of this view layer through this camera sees it, at the scene's current frame.

    ledger : receives what could not come; afterwards it holds the remedies for Cycles' side.
    lit : true to bring along materials, lamps, world, film and bounces, for the levels above geometry.

    Raises InputError if the camera is no pinhole (orthographic, panoramic, sheared), or if Blender can't render the scene.
    """
    features.note_render(scene, view_layer, camera_object, ledger, lit)
    return visit_still(scene, view_layer, camera_object, lambda depsgraph: scene_in(depsgraph, camera_object, ledger, lit))


def survey(
    scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, camera_object: bpy.types.Object, ledger: Ledger, lit: bool = False
) -> Lighting | None:
    """Fill the ledger as `export_scene` does, without reading any geometry; returns the light of the scene, if wanted."""

    def look(depsgraph: bpy.types.Depsgraph) -> Lighting | None:
        placements(depsgraph, ledger, Shading() if lit else None)
        return light_in(depsgraph, ledger) if lit else None

    features.note_render(scene, view_layer, camera_object, ledger, lit)
    return visit_still(scene, view_layer, camera_object, look)


def level_needed(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, camera_object: bpy.types.Object) -> str:
    """The least level (tracer/scene) that models all light of what `export_scene` gives, found without reading any geometry."""

    def look(depsgraph: bpy.types.Depsgraph) -> str:
        ledger, shading = Ledger(), Shading()
        materials = [
            (source.name, shading.reading(slot).material if slot else PLAIN)
            for source, *_ in placements(depsgraph, ledger, shading)
            for slot in source.used_slots
        ]
        light = light_in(depsgraph, ledger, render=False)
        return level_of(light.lamps, light.world, light.bounces, materials)[0]

    return visit_still(scene, view_layer, camera_object, look)


def light_in(
    depsgraph: bpy.types.Depsgraph, ledger: Ledger, images: dict[str, Picture] | None = None, render: bool = True
) -> Lighting:
    """The light of a depsgraph, and how it becomes a picture.

    images : receives the images of world and lamps.
    render : see world_of.
    """
    scene = depsgraph.scene
    bounces = film.bounces_of(scene, ledger)
    shown_world = world.shown_world(scene, depsgraph.view_layer_eval)
    seen, suns = world.world_of(depsgraph.scene_eval, shown_world, ledger, images, render)
    return Lighting(
        lamps=(*lamps.lamps_in(depsgraph, bounces, ledger, images), *suns),
        world=seen,
        film=film.film_of(scene),
        bounces=bounces,
    )


def scene_in(depsgraph: bpy.types.Depsgraph, camera_object: bpy.types.Object, ledger: Ledger, lit: bool = False) -> Scene:
    """The scene in the depsgraph that a render engine is given.

    lit : see `export_scene`.
    """
    return _scene(depsgraph, _view_in(depsgraph, camera_object), ledger, lit)


def scene_through(depsgraph: bpy.types.Depsgraph, camera: Pinhole, clip: tuple[float, float], lit: bool = False) -> Scene:
    """The scene in a depsgraph, through a camera that no object of it is, as a viewport's.

    lit : see `export_scene`.

    A viewport waits for it, and nothing is compared: doubles are not sought, which takes a quarter of the time.
    """
    return _scene(depsgraph, {"camera": camera, "stated_camera": None, "clip": clip}, Ledger(), lit, notes_doubles=False)


def _scene(
    depsgraph: bpy.types.Depsgraph, view: dict[str, Any], ledger: Ledger, lit: bool, notes_doubles: bool = True
) -> Scene:
    shading = Shading() if lit else None
    names: dict[tuple[int, int], str] = {}
    geometries: dict[str, Mesh | Spheres] = {}
    objects = []

    def read(source: Surface, evaluated: bpy.types.Object) -> None:
        if source.key not in names:
            names[source.key] = _free_name(evaluated.data.name, geometries)
            geometries[names[source.key]] = _geometry(source, evaluated, ledger, shading)

    for source, matrices, random in placements(depsgraph, ledger, shading, read):
        materials = shading.names(source.slots) if shading else ()
        placed = (source.object_index, source.materials, materials, source.hidden_from, source.color, random)
        links = source.receivers, source.blockers
        matrix = matrices if len(matrices) > 1 else matrices[0]
        objects.append(Object(source.name, names[source.key], matrix, *placed, *links))
    if notes_doubles:
        _note_doubles(objects, geometries, ledger)
    surfaces = {placed.name for placed in objects}
    light = _shown_by_light(depsgraph, ledger, shading, surfaces) if shading else {}
    if shading:
        _note_weighed_light(objects, light["lamps"], light["world"], light["materials"], ledger)
    return Scene(
        **view,
        geometries={name: geometries[name] for name in dict.fromkeys(placed.geometry for placed in objects)},
        objects=linking.among(objects, surfaces),
        **light,
        ledger=ledger.entries(),
    )


def _note_weighed_light(
    objects: list[Object], lamps: Sequence[Lamp], world: World | None, materials: dict[str, Material], ledger: Ledger
) -> None:
    """Note glass so rough that Cycles has light in it which only samples of lights find: with several lights, how much of that
    counts is a matter of how often Cycles chooses which.
    """
    shining = sum(2 for placed in objects for name in placed.materials if name and materials[name].shines)
    sky = world is not None and world.image is not None
    met_by_rays = sky or shining or any(lamp.is_sized and lamp.multiple_importance for lamp in lamps)
    if len(lamps) + sky + shining < 2 or not met_by_rays:
        return
    for placed in objects:
        name = next((name for name in placed.materials if name and materials[name].refracts_very_roughly), None)
        if name is not None:
            reason = "refracts so roughly that Cycles' choice among several lights shows in it: up to 5 % more or less"
            ledger.note(placed.name, "approximated", f"material {name!r} {reason}")


def _note_doubles(objects: list[Object], geometries: dict[str, Mesh | Spheres], ledger: Ledger) -> None:
    """Note what lies exactly where something else does: which of the two a ray of Cycles meets or leaves is its rounding's
    choice.

    Triangles of what stands in the scene once are sought in the world; those of instances, and points, among their own;
    and instances of one geometry by their matrices. What overlaps otherwise is found where pictures differ.
    """
    tokens = {name: token for token, name in enumerate(geometries)}
    keys, owners, places, placed_by = [], [], [], []
    instanced = {
        placed.geometry for placed in objects if len(placed.matrices) > 1 or isinstance(geometries[placed.geometry], Spheres)
    }
    within = {name: len(_pairs(_keys(geometries[name]))) for name in instanced}
    for number, placed in enumerate(objects):
        geometry, several = geometries[placed.geometry], len(placed.matrices) > 1
        token = np.full((1, len(placed.matrices)), tokens[placed.geometry], np.uint64)
        places.append(_hashed(np.concatenate([token, _bits(placed.matrices.reshape(-1, 16)).T])))
        placed_by.append(np.full(len(placed.matrices), number))
        if isinstance(geometry, Mesh) and not several:
            keys.append(_keys(geometry, placed.matrices[0]))
            owners.append(np.full(len(keys[-1]), number))
        elif within[placed.geometry]:
            what = "triangles" if isinstance(geometry, Mesh) else "points"
            _note_double(ledger, placed.name, f"{within[placed.geometry]} {what}", "others of it")
    for numbers, owner, what in (keys, owners, "triangles"), (places, placed_by, "instances"):
        number = np.concatenate([np.empty(0, np.int64), *owner])
        pairs = _pairs(np.concatenate([np.empty(0, np.uint64), *numbers]))
        for (first, second), count in Counter(map(tuple, number[pairs].tolist())).items():
            if what == "instances" and all(len(objects[i].matrices) == 1 for i in (first, second)):
                continue  # its triangles tell
            whose = "others of it" if first == second else f"those of {objects[first].name!r}"
            _note_double(ledger, objects[second].name, f"{count} {what}", whose)


def _note_double(ledger: Ledger, name: str, what: str, whose: str) -> None:
    # All of it comes along: where it matters to a picture is the comparison's to find.
    ledger.note(
        name, "exported", f"{what} lie exactly where {whose} do: either may be seen, and in Cycles one shadows the other"
    )


def _keys(geometry: Mesh | Spheres, matrix: Matrix | None = None) -> NDArray[np.uint64]:
    """(n,): of each triangle that is one, or of each point, the same for those in one place."""
    if isinstance(geometry, Spheres):
        return _hashed(_bits(np.column_stack([geometry.centers, geometry.radii])).T)
    places = geometry.vertices if matrix is None else geometry.vertices @ matrix[:3, :3].T + matrix[:3, 3]
    corners = np.sort(_hashed(_bits(places).T)[geometry.triangles], axis=1)
    return _hashed(corners[(corners[:, :-1] != corners[:, 1:]).all(axis=1)].T)


def _bits(values: NDArray[np.float64]) -> NDArray[np.uint64]:
    """The bits of the numbers as float32 has them, 0 for −0."""
    return (values.astype(np.float32) + np.float32(0)).view(np.uint32).astype(np.uint64)


def _pairs(keys: NDArray[np.uint64]) -> NDArray[np.int64]:
    """(m, 2): the indices of two each that are equal and follow one another."""
    order = np.argsort(keys, kind="stable")
    equal = np.flatnonzero(keys[order[1:]] == keys[order[:-1]])
    return np.stack([order[equal], order[equal + 1]], axis=1)


def _hashed(columns: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """(n,) of (k, n): of each k numbers 64 bits, the same for the same ones, and for others in one pair of 2⁶⁴.

    Splitmix64 (Steele, Lea and Flood, Fast Splittable Pseudorandom Number Generators, 2014), number after number.
    """
    key = np.zeros(columns.shape[1], np.uint64)
    for column in columns:
        key = (key ^ column) + np.uint64(0x9E3779B97F4A7C15)
        for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
            key = (key ^ key >> np.uint64(shift)) * np.uint64(factor)
        key ^= key >> np.uint64(31)
    return key


def _shown_by_light(depsgraph: bpy.types.Depsgraph, ledger: Ledger, shading: Shading, surfaces: set[str]) -> dict[str, Any]:
    """The part of a Scene that makes its light, and what shows it. surfaces : the names of its objects."""
    images = shading.pictures()
    light = light_in(depsgraph, ledger, images)
    return vars(light) | {"lamps": linking.among(light.lamps, surfaces), "materials": shading.materials, "images": images}


def seen_from(scene: Scene, depsgraph: bpy.types.Depsgraph, camera_object: bpy.types.Object) -> Scene:
    """The scene that was read from a depsgraph in which nothing has changed since but cameras."""
    return replace(scene, **_view_in(depsgraph, camera_object))


def _view_in(depsgraph: bpy.types.Depsgraph, camera_object: bpy.types.Object) -> dict[str, Any]:
    """The part of a Scene that is its camera's."""
    camera = camera_object.evaluated_get(depsgraph)
    return {
        "camera": cameras.read(camera, depsgraph.scene),
        "stated_camera": cameras.stated(camera, depsgraph.scene),
        "clip": (camera.data.clip_start, camera.data.clip_end),
    }


class Placement(NamedTuple):
    """The placement of a surface: where it is drawn.

    matrices : (n, 4, 4), to world space, one for each instance.
    random : (n,), or None where no material asks for it.
    """

    source: Surface
    matrices: Matrix
    random: NDArray[np.float32] | None


def placements(
    depsgraph: bpy.types.Depsgraph,
    ledger: Ledger,
    shading: Shading | None = None,
    read: Callable[[Surface, bpy.types.Object], None] | None = None,
) -> list[Placement]:
    """Each surface that the camera may see.

    shading : reads the materials, where there shall be light; then other rays than the camera's may see a surface.
    read : is called with each surface as it is met first, and the object or instance that shows it, which is gone afterwards.
    """
    matrices = export_geometry.read(depsgraph.object_instances, "matrix_world", np.float32, 16)
    rows: dict[Surface, list[int]] = {}
    known: dict[tuple[int, ...], list[int]] = {}
    placing: set[bpy.types.Object] = set()
    links = linking.Links(depsgraph) if shading else None
    for number, instance in enumerate(depsgraph.object_instances):
        features.note_hair(instance, ledger)
        evaluated = instance.object
        data = evaluated.data
        if not instance.show_self or data is None:
            continue
        placed = features.placed_by(instance)
        identity = placed.real.as_pointer(), placed.parent.as_pointer(), data.as_pointer()
        if identity not in known:
            source = _source(placed, depsgraph, ledger, shading, links)
            if read and source and source not in rows:
                read(source, evaluated)
            known[identity] = rows.setdefault(source, []) if source else []
            if placed.real != placed.parent:
                placing.add(placed.parent.original)
        known[identity].append(number)
    features.note_bare(ledger, placing)
    for source, numbers in rows.items():
        ledger.placed(source.name, len(numbers))
    draws = _draws(depsgraph) if shading and any(shading.asks_for_random(source.slots) for source in rows) else None
    result: list[Placement] = []
    for source, numbers in rows.items():
        random = None
        if draws and shading and shading.asks_for_random(source.slots):
            draw = np.where(draws[0][numbers], draws[1][numbers], random_number(source.name))
            random = cycles_attributes.unit_number(draw.astype(np.uint32))
        result.append(Placement(source, _by_rows(matrices[numbers]), random))
    return list(_drawn(result, ledger))


def _draws(depsgraph: bpy.types.Depsgraph) -> tuple[NDArray[np.bool_], NDArray[np.uint32]]:
    """True if what the depsgraph shows is an instance, and what Cycles draws for it then."""
    instances = depsgraph.object_instances
    return export_geometry.read(instances, "is_instance", bool), export_geometry.read(instances, "random_id", np.int32).view(
        "u4"
    )


def random_number(name: str) -> int:
    """The 32 bits that Cycles draws for an object of this name (hash_string and hash_uint2 of intern/cycles/util/hash.h)."""
    key = 0
    for byte in name.encode():
        key = (37 * key + byte) & 0xFFFFFFFF
    return int(cycles_attributes.hashed(key, 0))


def _drawn(placed: list[Placement], ledger: Ledger) -> Iterator[Placement]:
    """The placements that Cycles draws: those that are somewhere, and of those that a scale of 0 flattens meshes that no other
    object uses."""
    users: Counter[tuple[int, int]] = Counter()
    for source, matrices, _ in placed:
        users[source.key] += len(matrices)
    for source, matrices, random in placed:
        is_somewhere = np.isfinite(matrices).all(axis=(1, 2))
        if not is_somewhere.all():
            ledger.note(source.name, "exported", "has a transform that is not finite, and Cycles does not draw it")
            matrices, random = matrices[is_somewhere], random if random is None else random[is_somewhere]
        is_flat = np.linalg.det(matrices[:, :3, :3]) == 0
        if is_flat.any() and (users[source.key] > 1 or not source.is_mesh):
            ledger.note(source.name, "exported", "flattened by its scale, and Cycles does not draw it")
            matrices, random = matrices[~is_flat], random if random is None else random[~is_flat]
        if len(matrices):
            yield Placement(source, matrices, random)


def _by_rows(matrices: NDArray[np.float32]) -> Matrix:
    """(n, 4, 4) of (n, 16), as Blender has them: by columns. The last row, which Cycles never reads, may be a rounding off."""
    by_rows = np.ascontiguousarray(np.swapaxes(matrices.reshape(-1, 4, 4), 1, 2), np.float64)
    by_rows[:, 3] = 0.0, 0.0, 0.0, 1.0
    return by_rows


def _source(
    placed: features.Placed,
    depsgraph: bpy.types.Depsgraph,
    ledger: Ledger,
    shading: Shading | None,
    links: linking.Links | None,
) -> Surface | None:
    """The source of what one object shows, or None if nothing of it is seen."""
    if not features.is_surface(placed, ledger, shading):
        return None
    evaluated, real, _ = placed
    layer = depsgraph.view_layer_eval
    features.note_holdout(placed, depsgraph, ledger)
    hidden_from = features.hidden_from(placed, layer)
    if "camera" in hidden_from:
        ledger.note(placed.name, "exported", "not visible to the camera")
        if not shading or len(hidden_from) == len(RAYS):
            return None
    is_mesh = isinstance(evaluated.data, bpy.types.Mesh)
    if is_mesh and not layer.use_solid:
        ledger.note(placed.name, "exported", "the view layer leaves out surfaces")
        return None
    override = layer.material_override
    slots = [override] * max(len(evaluated.material_slots), 1) if override else _materials(evaluated, real.original) or [None]
    used = {0}
    if is_mesh:
        with export_geometry.mesh_shown(evaluated) as mesh:
            used = export_geometry.used_slots(mesh, len(slots))
        if not used:  # it has no faces
            return None
    features.note_object(placed, slots, used, depsgraph, ledger, shading)
    used = {index for index in used if not materials.is_volume_alone(slots[index])}
    if not used:
        return None
    receivers, blockers = None, None
    if links and shading and linking.is_linked(placed.real.original) and shading.shines(slots):
        receivers, blockers = links.of(placed, ledger, True)
    # Cycles shares a geometry among objects unless a slot belongs to the object (BlenderSync::BKE_object_is_modified).
    own = any(slot.link == "OBJECT" for slot in evaluated.material_slots)
    return Surface(
        name=placed.name,
        is_mesh=is_mesh,
        key=(evaluated.data.as_pointer(), real.as_pointer() if own else 0),
        object_index=evaluated.pass_index,
        slots=tuple(slots),
        used=tuple(sorted(used)),
        hidden_from=hidden_from if shading else frozenset(),
        color=tuple(placed.parent.color) if shading else Object.color,
        receivers=receivers,
        blockers=blockers,
    )


def _materials(evaluated: bpy.types.Object, original: bpy.types.Object) -> list[bpy.types.Material | None]:
    """The materials that Cycles finds in the slots of an evaluated object.

    A slot of the object itself that is empty shows the mesh's material, where it is evaluated.
    """
    slots = [slot.material for slot in evaluated.material_slots]
    if versions.EMPTY_SLOTS_OF_OBJECTS_STAY_EMPTY:
        for number, (slot, own) in enumerate(zip(evaluated.material_slots, original.material_slots, strict=False)):
            if slot.link == own.link == "OBJECT" and own.material is None:
                slots[number] = None
    return slots


def _geometry(source: Surface, evaluated: bpy.types.Object, ledger: Ledger, shading: Shading | None) -> Mesh | Spheres:
    if not source.is_mesh:
        spheres = export_geometry.spheres_of(evaluated.data)
        if nowhere := len(evaluated.data.points) - len(spheres.radii):
            reason = f"{nowhere} points have a place that is not finite or no radius, and Cycles draws none of them"
            ledger.note(source.name, "exported", reason)
        return spheres
    has_colors = shading is not None and shading.asks_for_colors(source.slots)
    attributes = shading.attributes(source.slots) if shading else ()
    with export_geometry.mesh_shown(evaluated, split=True) as data:
        mesh = export_geometry.mesh_of(data, len(source.materials), has_colors, attributes)
        nowhere = len(data.loop_triangles) - len(mesh.triangles)
    if nowhere:
        ledger.note(
            source.name, "exported", f"{nowhere} triangles have vertices that are not finite, and Cycles draws none of them"
        )
    return export_geometry.of_slots(mesh, source.used)


def _free_name(name: str, taken: dict[str, Mesh | Spheres]) -> str:
    """`name`, with a number if another geometry has it."""
    candidate, number = name, 1
    while candidate in taken:
        number += 1
        candidate = f"{name} ({number})"
    return candidate
