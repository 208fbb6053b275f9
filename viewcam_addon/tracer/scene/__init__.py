"""The scene that the tracer traces: meshes and spheres, the objects that place them in the world, the camera, and what gives
light.

A geometry is stored once, in its object's space, and placed by any number of objects. Nothing here knows files (scene_file.py)
or rays (native.py, core); the classes hold arrays and check their shapes. Materials, images, lamps, world, film and
bounces matter from level `direct` on; a scene of level `geometry` leaves them out.
"""

import dataclasses
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, is_dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ... import checks
from ...checks import quoted
from ...errors import InputError
from ...pinhole import Pinhole
from .film import LEVELS, Bounces, Film
from .lamps import MOST_LINKS, Lamp, World, hidden_from, linked
from .materials import PLAIN, Material, Picture
from .shader_nodes import KINDS

# Visibility is found in float32, which holds the square of nothing larger.
LARGEST = 1e18


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles in object space.

    vertices : (n, 3) float64, object space.
    triangles : (m, 3) int32, indices into `vertices`, counter-clockwise seen from the front.
    corner_normals : (m, 3, 3) float32, object space, unit length, or None where every face is flat. On a flat face of a mesh
        that has smooth ones, the three corners hold the face's own normal.
    corner_uvs : (m, 3, 2) float32, or None where the mesh has no UV map.
    corner_colors : (m, 3, 3) float32, linear, what `Color.vertex` stands for, or None.
    attributes : name → (m, 3, k) float32, k from 1 to 4, what nodes ask for by name. Those that Cycles makes have its names:
        "generated", where each corner is in the mesh's texture space; "pointiness"; "random_per_island"; "vertex_color",
        `corner_colors` with their alpha.
    materials : (m,) int32, the index of each triangle's material in `Object.material_indices`.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    materials: NDArray[np.int32]
    corner_normals: NDArray[np.float32] | None = None
    corner_uvs: NDArray[np.float32] | None = None
    corner_colors: NDArray[np.float32] | None = None
    attributes: dict[str, NDArray[np.float32]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        count = len(self.triangles)
        _check_shape("vertices", self.vertices, (None, 3))
        _check_shape("triangles", self.triangles, (None, 3))
        _check_shape("materials", self.materials, (count,))
        if self.corner_normals is not None:
            _check_shape("corner_normals", self.corner_normals, (count, 3, 3))
        if self.corner_uvs is not None:
            _check_shape("corner_uvs", self.corner_uvs, (count, 3, 2))
        if self.corner_colors is not None:
            _check_shape("corner_colors", self.corner_colors, (count, 3, 3))
        for name, values in self.attributes.items():
            _check_shape(f"attribute {quoted(name)}", values, (count, 3, None))
            if not 1 <= values.shape[2] <= 4:
                raise InputError(f"attribute {quoted(name)} has {values.shape[2]} numbers a corner: give 1 to 4")
        if count and not 0 <= self.triangles.min() <= self.triangles.max() < len(self.vertices):
            raise InputError(f"triangles name a vertex outside 0 … {len(self.vertices) - 1}: check the mesh")
        if not np.isfinite(self.vertices).all():
            raise InputError("vertices hold a number that is not finite: check the mesh")


@dataclass(frozen=True, eq=False)
class Spheres:
    """Exact spheres in object space; the object's matrix may make ellipsoids of them.

    centers : (n, 3) float64, object space.
    radii : (n,) float64, object space, not negative.
    materials : (n,) int32, as in `Mesh`.
    """

    centers: NDArray[np.float64]
    radii: NDArray[np.float64]
    materials: NDArray[np.int32]

    def __post_init__(self) -> None:
        _check_shape("centers", self.centers, (None, 3))
        _check_shape("radii", self.radii, (len(self.centers),))
        _check_shape("materials", self.materials, (len(self.centers),))
        if not (np.isfinite(self.centers).all() and np.isfinite(self.radii).all() and (self.radii >= 0).all()):
            raise InputError("centers and radii of spheres must be finite and radii not negative: check the spheres")


@dataclass(frozen=True, eq=False)
class Object:
    """One geometry, placed in the world, once or as many instances.

    geometry : the key in `Scene.geometries`.
    matrix : (4, 4) float64, object space to world space, affine; negative and non-uniform scale are welcome. Or (n, 4, 4), for
        n instances that differ by nothing else.
    object_index : the number that the Object Index pass shows.
    material_indices : the numbers that the Material Index pass shows, for each material of the geometry; at least one.
    materials : keys in `Scene.materials`, for each material of the geometry; "", and all that are missing, are `PLAIN`.
    hidden_from : the kinds of rays that don't see it (lights.RAYS).
    receivers, blockers : the names of the objects that it lights where it shines, and of those that can stand in that light;
        None is all objects. The eye sees it whatever it lights.
    color : red, green, blue and alpha, that materials may ask for.
    random : (n,) float32, 0 to 1, of each instance likewise, or None, which is 0.
    """

    name: str
    geometry: str
    matrix: NDArray[np.float64]
    object_index: int = 0
    material_indices: tuple[int, ...] = (0,)
    materials: tuple[str, ...] = ()
    hidden_from: frozenset[str] = frozenset()
    color: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    random: NDArray[np.float32] | None = None
    receivers: frozenset[str] | None = None
    blockers: frozenset[str] | None = None

    def __post_init__(self) -> None:
        _check_shape(f"the matrix of object {quoted(self.name)}", self.matrix, (None, 4, 4)[-max(self.matrix.ndim, 2) :])
        if not np.isfinite(self.matrix).all():
            raise InputError(f"the matrix of object {quoted(self.name)} holds a number that is not finite: check its transform")
        if not (self.matrices[:, 3] == (0, 0, 0, 1)).all():
            raise InputError(f"the matrix of object {quoted(self.name)} is not affine: its last row must be 0, 0, 0, 1")
        if not self.material_indices:
            raise InputError(
                f"object {quoted(self.name)} has no material_indices: give at least one, 0 where it has no material"
            )
        object.__setattr__(self, "hidden_from", hidden_from(f"object {quoted(self.name)}", self.hidden_from))
        object.__setattr__(self, "receivers", linked(self.receivers))
        object.__setattr__(self, "blockers", linked(self.blockers))
        object.__setattr__(self, "color", checks.vector(f"the color of object {quoted(self.name)}", self.color, 4))
        if self.random is not None:
            _check_shape(f"random of object {quoted(self.name)}", self.random, (len(self.matrices),))
            if not ((self.random >= 0) & (self.random <= 1)).all():
                raise InputError(f"random of object {quoted(self.name)} holds a number that is not from 0 to 1: correct it")

    @property
    def matrices(self) -> NDArray[np.float64]:
        """(n, 4, 4): of each place where it stands."""
        return self.matrix.reshape(-1, 4, 4)


@dataclass(frozen=True)
class LedgerEntry:
    """The fate of one thing that the exporter met.

    object : its name in Blender.
    status : "exported", "approximated" or "skipped".
    reason : one clause that says why, empty where it was exported whole.
    """

    object: str
    status: str
    reason: str = ""

    @property
    def is_modeled(self) -> bool:
        """True if it was exported whole, as it is."""
        return self.status == "exported"


def with_pairs(ledger: Sequence[LedgerEntry], pairs: Iterable[tuple[str, str]]) -> tuple[LedgerEntry, ...]:
    """A ledger in which each object tells with which others it lies in one place. pairs : the names of two each."""
    others: dict[str, list[str]] = {}
    for first, second in pairs:
        others.setdefault(first, []).append("itself" if first == second else repr(second))
        if first != second:
            others.setdefault(second, []).append(repr(first))
    entries = []
    for entry in ledger:
        if entry.object in others:
            shares = f"lies in one place with {', '.join(others[entry.object])} where pixels show it"
            entry = replace(entry, reason="; ".join(filter(None, (entry.reason, shares))))
        entries.append(entry)
    return tuple(entries)


@dataclass(frozen=True, eq=False)
class Scene:
    """A camera and what stands before it.

    camera : the camera to trace. For a scene from Blender, as read back from Blender's float32 matrix and lens.
    stated_camera : the camera as the four values state it, or None where nobody stated one.
    clip : nearest and farthest planar depth z = −w·(P − e) that is visible.
    origin : the point of the world from which all coordinates of the scene are counted: (0, 0, 0), or that of a recentered
        export.
    images : the images by the names that `Color.image` has.
    cycles : the version of Blender whose Cycles' materials are meant.
    """

    camera: Pinhole
    geometries: dict[str, Mesh | Spheres]
    objects: tuple[Object, ...]
    stated_camera: Pinhole | None = None
    clip: tuple[float, float] = (0.0, float("inf"))
    ledger: tuple[LedgerEntry, ...] = field(default=())
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    materials: dict[str, Material] = field(default_factory=dict)
    images: dict[str, Picture] = field(default_factory=dict)
    lamps: tuple[Lamp, ...] = ()
    world: World = field(default_factory=World)
    film: Film = field(default_factory=Film)
    bounces: Bounces = field(default_factory=Bounces)
    cycles: tuple[int, int] = (5, 2)

    @property
    def not_modeled(self) -> tuple[str, ...]:
        """The names of what its ledger has as approximated or skipped."""
        return tuple(entry.object for entry in self.ledger if not entry.is_modeled)

    def __post_init__(self) -> None:
        if len(self.origin) != 3 or not np.isfinite(self.origin).all():
            raise InputError(f"origin is {self.origin}: give three finite numbers")
        if len(self.cycles) != 2 or not all(type(number) is int and 0 <= number < 100 for number in self.cycles):
            raise InputError(f"cycles is {checks.quoted(self.cycles)}: give a version of Blender, as 5.2")
        start, end = (float(depth) for depth in self.clip)
        if not 0 <= start < end:
            raise InputError(f"clip is {start:g} … {end:g}: give a nearest depth of at least 0 and a greater farthest depth")
        object.__setattr__(self, "clip", (start, end))
        materials = {name: _material_range(geometry.materials) for name, geometry in self.geometries.items()}
        _check_camera(self.camera)
        reaches = {name: _reach(geometry) for name, geometry in self.geometries.items()}
        for placed in self.objects:
            if placed.geometry not in materials:
                raise InputError(
                    f"object {quoted(placed.name)} names the geometry {quoted(placed.geometry)}, which the scene does not have"
                )
            _check_reach(placed, reaches[placed.geometry])
            least, greatest = materials[placed.geometry]
            if least < 0 or greatest >= len(placed.material_indices):
                raise InputError(
                    f"object {quoted(placed.name)} has {len(placed.material_indices)} material_indices and its geometry "
                    f"{quoted(placed.geometry)} uses materials {least} … {greatest}: give one for each"
                )
            for name in placed.materials:
                if name and name not in self.materials:
                    raise InputError(
                        f"object {quoted(placed.name)} names the material {quoted(name)}, which the scene does not have"
                    )
        _check_links(self.lamps, self.objects)
        for image in self.world.images:
            if image not in self.images:
                raise InputError(f"the world names the image {quoted(image)}, which the scene does not have")
        named = [
            (f"{component} of material {quoted(name)}", color)
            for name, material in self.materials.items()
            for component, color in material.inputs
        ]
        named += [
            (f"the emission of light {quoted(lamp.name)}", color)
            for lamp in self.lamps
            if lamp.emission
            for color in lamp.emission.colors
        ]
        for what, color in named:
            if color.image is not None and color.image not in self.images:
                raise InputError(f"{what} names the image {quoted(color.image)}, which the scene does not have")


def _check_links(lamps: tuple[Lamp, ...], objects: tuple[Object, ...]) -> None:
    names = {placed.name for placed in objects}
    lights: tuple[Lamp | Object, ...] = (*lamps, *objects)
    for what, most in MOST_LINKS.items():
        sets = {getattr(light, what) for light in lights} - {None}
        if len(sets) > most:
            raise InputError(f"lights have {len(sets)} different sets of {what}: give at most {most}")
        for light in lights:
            unknown = sorted((getattr(light, what) or frozenset()) - names)
            if unknown:
                kind = "light" if isinstance(light, Lamp) else "object"
                raise InputError(
                    f"{what} of {kind} {quoted(light.name)} names the object {quoted(unknown[0])}, "
                    "which the scene does not have"
                )


def _check_camera(camera: Pinhole) -> None:
    if max(map(abs, camera.eye)) > LARGEST:
        raise InputError(f"the camera's eye is {camera.eye}: give coordinates below {LARGEST:g}")
    slopes = np.abs(camera.view_plane([0.0, camera.width], [0.0, camera.height]))
    if slopes.max() > LARGEST:
        raise InputError(
            f"the camera's distance of {min(camera.distance):g} pixels is {slopes.max():.3g} times smaller than its picture: "
            f"give one, and a principal point, that make it less than {LARGEST:g}"
        )


def _reach(geometry: Mesh | Spheres) -> float:
    """The largest |coordinate| of a geometry in its object's space, or what is no less."""
    if isinstance(geometry, Mesh):
        return float(np.abs(geometry.vertices).max(initial=0.0))
    return float(np.abs(geometry.centers).max(initial=0.0)) + float(geometry.radii.max(initial=0.0))


def _check_reach(placed: Object, reach: float) -> None:
    linear, translation = np.abs(placed.matrices[:, :3, :3]), np.abs(placed.matrices[:, :3, 3])
    largest = max(reach, linear.max(initial=0.0), translation.max(initial=0.0))
    if largest <= LARGEST:  # no product overflows
        largest = max(largest, (3 * reach * linear.max(axis=(1, 2)) + translation.max(axis=1)).max(initial=0.0))
    if largest > LARGEST:
        raise InputError(f"object {quoted(placed.name)} reaches as far as {largest:.3g}: give it coordinates below {LARGEST:g}")


def _material_range(materials: NDArray[np.int32]) -> tuple[int, int]:
    return (int(materials.min()), int(materials.max())) if len(materials) else (0, 0)


def _check_shape(name: str, array: NDArray[np.generic], shape: tuple[int | None, ...]) -> None:
    if array.ndim != len(shape) or any(want not in (None, have) for want, have in zip(shape, array.shape, strict=True)):
        wanted = " × ".join("n" if size is None else str(size) for size in shape)
        raise InputError(f"{name} has the shape {array.shape} and must have {wanted}: check the scene")


_FEW = 64  # numbers, below which NumPy takes longer to compare two arrays than to copy them


def same_things(first: Scene, second: Scene) -> bool:
    """True if the same geometries stand in the same places, made of materials of the same names.

    Nothing in a scene is ever changed in place, so that what is one object is the same without a look inside. Everything else
    is compared to the last bit. Rejected: fingerprints, which read all of both scenes where most of them is one object.
    """
    return same(first.objects, second.objects) and same(first.geometries, second.geometries)


def same(first: Any, second: Any) -> bool:
    """True if two values, of those that scenes are made of, are the same."""
    if first is second:
        return True
    if type(first) is not type(second):
        return False
    if isinstance(first, np.ndarray):
        return _same_array(first, second)
    if isinstance(first, dict):
        return list(first) == list(second) and all(same(value, second[key]) for key, value in first.items())
    if isinstance(first, tuple):
        return len(first) == len(second) and all(map(same, first, second))
    if is_dataclass(first):
        return all(same(getattr(first, field.name), getattr(second, field.name)) for field in dataclasses.fields(first))
    return bool(first == second)


def _same_array(first: NDArray[Any], second: NDArray[Any]) -> bool:
    if first.shape != second.shape or first.dtype != second.dtype:
        return False
    if first.size < _FEW:
        return first.tobytes() == second.tobytes()
    return np.array_equal(first, second)


_REFLECTS, _MIRRORS = "reflects light onto others", "mirrors"
_WHAT = {"diffuse": _REFLECTS, "principled": _REFLECTS, "glossy": _MIRRORS, "metallic": _MIRRORS}


def least_level(scene: Scene) -> tuple[str, str]:
    """The level (film.LEVELS) at which nothing is left out that this scene shows, and one sentence that says why."""
    materials = [(placed.name, material) for placed in scene.objects for material in _materials(scene, placed)]
    return level_of(scene.lamps, scene.world, scene.bounces, materials)


def level_of(
    lamps: Sequence[Lamp], world: World, bounces: Bounces, materials: Sequence[tuple[str, Material]]
) -> tuple[str, str]:
    """`least_level` of what gives light. materials : (object's name, material), of each material that some part of it uses."""
    geometry, direct, path = LEVELS
    light = _light(lamps, world, materials)
    if light is None:
        return geometry, "Nothing gives light: no lamp, no surface and not the world."
    if bounces.total == 0:
        return direct, f"Light comes from {light}, and the scene allows no bounces."
    scattering = [
        (name, closure.node.type)
        for name, material in materials
        for closure in material.closures
        if KINDS[closure.node.type].scatters
    ]
    if not scattering:
        return direct, f"Light comes from {light}, and nothing reflects it."
    for name, kind in scattering:
        if any(getattr(bounces, bounce) > 0 for bounce in KINDS[kind].scatters):
            return path, f"Light comes from {light}, and {name!r} {_WHAT.get(kind, 'is clear')}."
    return direct, f"Light comes from {light}, and the scene allows no bounces of the kinds that it has."


def _light(lamps: Sequence[Lamp], world: World, materials: Sequence[tuple[str, Material]]) -> str | None:
    """The first thing that gives light."""
    for lamp in lamps:
        if any(lamp.strength):
            return f"the lamp {lamp.name!r}"
    for name, material in materials:
        if material.shines:
            return f"the surface of {name!r}"
    return None if world.is_black else "the world"


def _materials(scene: Scene, placed: Object) -> list[Material]:
    """The materials of an object that some part of its geometry uses."""
    used = sorted(set(scene.geometries[placed.geometry].materials.tolist()))
    names = [placed.materials[index] if index < len(placed.materials) else "" for index in used]
    return [scene.materials[name] if name else PLAIN for name in names]
