"""All labels of one frame: passes of a picture, what is told of each instance, and the motion to another frame."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cameras.distortion import Lens
from ..errors import InputError
from ..image import BACKGROUND_DEPTH, Image
from ..tracer.render import barycentric
from ..tracer.scene import Mesh, Scene, Spheres
from . import KINDS, coverage, masks
from .surfaces import Array, Instance, Keepers, Silhouettes, Surfaces

# A point and the ray to it are float64, and were each computed in a few dozen operations; slanted surfaces multiply that.
# Far below what a depth map of float32 can tell, far above 2⁻⁵³.
_SLACK = 1e-9


@dataclass(frozen=True, eq=False)
class Motion:
    """The motion of each pixel's point from one frame to another; nan where nothing is known. Rows from the bottom.

    flow : (height, width, 2), pixels to the right and **down**: where the point appears there, less the pixel's center here.
    displacement : (height, width, 3), world space.
    hidden : (height, width), whether the other frame's camera does not see the point: something is before it, or it lies beside
        the picture or beyond the clip.
    lost : names of objects that are not in the other frame, or have another topology there.
    """

    flow: NDArray[np.float64]
    displacement: Array
    hidden: NDArray[np.bool_]
    lost: tuple[str, ...]


def motion(here: Surfaces, there: Surfaces) -> Motion:
    """The motion from one frame to another, of the same size.

    The point is the same of the same primitive: of a triangle by its barycentric coordinates, of a sphere by its direction from
    the center. So rigid bodies, deforming meshes and moving cameras are one formula, and no flow is interpolated or searched.

    Raises InputError if their sizes differ.
    """
    if (here.camera.width, here.camera.height) != (there.camera.width, there.camera.height):
        raise InputError(
            f"the other frame has {there.camera.width} × {there.camera.height} pixels and this one {here.camera.width} × "
            f"{here.camera.height}: give frames of one size"
        )
    others = {instance.key: (number, instance) for number, instance in enumerate(there.instances)}
    points, owners = here.points.reshape(-1, 3), np.full(here.instance.size, -1)
    moved = np.full_like(points, np.nan)
    lost: dict[str, None] = {}  # in their order
    for instance, pixels in here.visible:
        number, other = others.get(instance.key, (-1, None))
        if other is None or not _is_alike(_geometry(here, instance), _geometry(there, other)):
            lost[instance.key[0]] = None
            continue
        moved[pixels], owners[pixels] = _carried(here, there, instance, other, pixels), number
    known = np.flatnonzero(owners >= 0)
    column, row, _ = there.project(moved[known])
    flow, hidden = np.full((len(points), 2), np.nan), np.zeros(len(points), bool)
    flow[known, 0] = column - (known % here.camera.width + 0.5)
    flow[known, 1] = known // here.camera.width + 0.5 - row
    hidden[known] = ~there.seen_first(moved[known], owners[known], here.primitive.ravel()[known], _SLACK)
    shape = here.instance.shape
    return Motion(flow.reshape(*shape, 2), (moved - points).reshape(*shape, 3), hidden.reshape(shape), tuple(lost))


def _geometry(surfaces: Surfaces, instance: Instance) -> Mesh | Spheres:
    return surfaces.scene.geometries[instance.placed.geometry]


def _is_alike(first: Mesh | Spheres, second: Mesh | Spheres) -> bool:
    """True if the primitives of two geometries are the same ones, wherever they stand."""
    if first is second:
        return True
    if isinstance(first, Mesh) and isinstance(second, Mesh):
        return np.array_equal(first.triangles, second.triangles)
    return isinstance(first, Spheres) and isinstance(second, Spheres) and len(first.radii) == len(second.radii)


def _carried(here: Surfaces, there: Surfaces, instance: Instance, other: Instance, pixels: NDArray[np.intp]) -> Array:
    """(n, 3): the points of an instance's pixels where they are in the other frame, world space."""
    before, after = _geometry(here, instance), _geometry(there, other)
    primitive = here.primitive.ravel()[pixels]
    is_rigid = before is after or all(
        np.array_equal(getattr(before, name), getattr(after, name))
        for name in (("vertices",) if isinstance(before, Mesh) else ("centers", "radii"))
    )
    if is_rigid and np.array_equal(instance.matrix, other.matrix):
        return here.points.reshape(-1, 3)[pixels]
    local = here.local_points(instance, pixels)
    if not is_rigid and isinstance(before, Spheres) and isinstance(after, Spheres):
        directions = (local - before.centers[primitive]) / before.radii[primitive, None]
        local = after.centers[primitive] + after.radii[primitive, None] * directions
    elif not is_rigid and isinstance(before, Mesh) and isinstance(after, Mesh):
        weights = barycentric(local, before.vertices[before.triangles[primitive]])
        local = (weights[..., None] * after.vertices[after.triangles[primitive]]).sum(axis=1)
    carried: Array = local @ other.matrix[:3, :3].T + other.matrix[:3, 3]
    return carried


@dataclass(frozen=True, eq=False)
class Labels:
    """The ground truth of a picture.

    image : the passes that were asked for, rows from the bottom, with the camera; docs/labels.md says what each holds.
    instances : plain JSON values of each instance of which a pixel is shown or, with amodal masks, would be if it stood alone,
        or with coverage is shown in part.
    lost : "forward" and "backward", the other frames → names of visible objects that have no counterpart there.
    lens : the lens that bends the picture.
    """

    image: Image
    instances: list[dict[str, Any]]
    lost: dict[str, list[str]]
    lens: Lens | None = None


def label(
    scene: Scene,
    kinds: Collection[str] = ("depth", "normals", "position", "masks", "amodal"),
    previous: Scene | None = None,
    next: Scene | None = None,
    threads: int | None = None,
    keepers: Keepers | None = None,
    lens: Lens | None = None,
    annotations: Mapping[str, Mapping[str, Any]] | None = None,
) -> Labels:
    """The labels of a scene's picture.

    The other parameters are those of api.label.

    keepers : keep what other scenes share with this one.
    lens : the lens that bends the picture of all frames, whose cameras have its own view plane.
    annotations : an object's name → its `category`, its `keypoints`, which are (x, y, z) in the object's coordinates by their
        names, and its `bones`: a keypoint's name → the name of the one that it hangs on.
    """
    if unknown := [kind for kind in kinds if kind not in KINDS]:
        raise InputError(f"there is no label {unknown[0]!r}: give some of {', '.join(KINDS)}")
    others = {"Forward": next, "Backward": previous}
    if "flow" in kinds and not any(others.values()):
        raise InputError("flow goes to another frame: give the scene of the next or of the previous one")
    keepers = keepers or Keepers(threads=threads)
    needed = {"normals": "Normal", "masks": "Material Index"}
    names = [name for kind, name in needed.items() if kind in kinds]
    surfaces = Surfaces(scene, threads, keepers.of(scene), names, lens)
    passes: dict[str, NDArray[Any]] = {}
    shape = surfaces.depth.shape  # traced now: of another frame with the same things the surfaces would use up this tracer
    if "depth" in kinds:
        passes |= _depths(surfaces)
    if "normals" in kinds:
        normals = surfaces.passes["Normal"]
        right, up, forward = scene.camera.picture_axes()
        passes |= {"Normal": normals, "Camera Normal": normals @ np.stack([right, -up, forward], axis=1)}
    if "position" in kinds:
        local = np.zeros_like(surfaces.points)
        for instance, pixels in surfaces.visible:
            local.reshape(-1, 3)[pixels] = surfaces.local_points(instance, pixels)
        passes |= {"Position": surfaces.points, "Object Position": local}
    if "masks" in kinds:
        ids = np.array([*(instance.id for instance in surfaces.instances), 0])  # the last is that of −1
        passes |= {"Instance": ids[surfaces.instance], "Material Index": surfaces.passes["Material Index"]}
    covered = coverage.coverage(surfaces) if "coverage" in kinds else None
    lost = {}
    if "flow" in kinds:
        for name, other in others.items():
            if other is not None:
                moved = motion(surfaces, Surfaces(other, threads, keepers.of(other), lens=lens))
                passes |= {f"{name} Flow": moved.flow, f"{name} Motion": moved.displacement, f"{name} Hidden": moved.hidden}
                lost[name.lower()] = list(moved.lost)
    if covered:
        passes |= covered.passes
    planes = {name: np.asarray(values, np.float32).reshape(*shape, -1) for name, values in passes.items()}
    records = _instances(surfaces, covered, annotations or {}, with_masks="masks" in kinds, with_amodal="amodal" in kinds)
    header = {"software": "Virtual Pinhole", **(covered.header if covered else {})}
    return Labels(Image(planes, scene.camera, header), records, lost, lens)


def _depths(surfaces: Surfaces) -> dict[str, NDArray[Any]]:
    hit, (x, y) = np.isfinite(surfaces.depth), surfaces.view_plane
    distance = surfaces.depth * np.sqrt(x * x + (y * y + 1))
    return {
        "Depth": np.where(hit, surfaces.depth, BACKGROUND_DEPTH),
        "Distance": np.where(hit, distance, BACKGROUND_DEPTH),
    }


def _instances(
    surfaces: Surfaces,
    covered: coverage.Coverage | None,
    annotations: Mapping[str, Mapping[str, Any]],
    with_masks: bool,
    with_amodal: bool,
) -> list[dict[str, Any]]:
    camera, all_of_them = surfaces.camera, surfaces.instances
    if not all_of_them:
        return []
    visible = masks.of_picture(surfaces.instance, len(all_of_them))
    amodal = masks.of_windows(Silhouettes(surfaces).windows(), (camera.height, camera.width)) if with_amodal else visible
    to_camera = np.eye(4)  # x right, y down, z forward
    to_camera[:3, :3] = camera.picture_axes() * [[1], [-1], [1]]
    to_camera[:3, 3] = -to_camera[:3, :3] @ np.array(camera.eye)
    matrices = np.stack([each.matrix for each in all_of_them])
    in_world, in_camera = matrices.tolist(), (to_camera @ matrices).tolist()
    result = []
    for number, (instance, seen, whole) in enumerate(zip(all_of_them, visible, amodal, strict=True)):
        share = coverage.entry(covered, number) if covered else None
        if whole is None and share is None:
            continue
        least, greatest = surfaces.keeper.box(instance.placed.geometry)
        figures: dict[str, Any] = {
            "id": instance.id,
            "name": instance.key[0],
            "number": instance.key[1],
            "object_index": instance.placed.object_index,
            "object_to_world": in_world[number],
            "object_to_camera": in_camera[number],
            "box": {"min": least.tolist(), "max": greatest.tolist()},
        }
        about = annotations.get(instance.key[0], {})
        if "category" in about:
            figures["category"] = about["category"]
        if about.get("keypoints"):
            figures["keypoints"] = _keypoints(surfaces, number, about["keypoints"], about.get("bones", {}))
        if with_masks:
            figures["visible"] = seen
        if with_amodal:
            figures["amodal"] = whole
            figures["visible_fraction"] = seen["area"] / whole["area"] if seen and whole else 0.0
        if covered:
            figures["coverage"] = share
        result.append(figures)
    return result


def _keypoints(surfaces: Surfaces, number: int, points: Mapping[str, Any], bones: Mapping[str, str]) -> list[dict[str, Any]]:
    """The places of an instance's keypoints in the picture, from its upper left corner, and COCO's figure of what is seen.

    It is 2 where the pixel shows the instance itself, which a joint is inside of, or nothing that is nearer than the point; 1
    where something else hides it; and 0, with a place of 0, 0, where it is not in the picture.
    """
    camera, matrix = surfaces.camera, surfaces.instances[number].matrix
    column, row, depth = surfaces.project(np.array([*points.values()], float) @ matrix[:3, :3].T + matrix[:3, 3])
    near, far = surfaces.scene.clip
    with np.errstate(invalid="ignore"):
        inside = (column >= 0) & (column < camera.width) & (row >= 0) & (row < camera.height) & (depth >= near) & (depth <= far)
    pixels = tuple(np.where(inside, place, 0).astype(int) for place in (row, column))
    seen = (surfaces.instance[pixels] == number) | (surfaces.depth[pixels] >= depth)
    visible = np.where(inside, 1 + seen, 0)
    x, y = (np.where(inside, place, 0.0) for place in (column, camera.height - row))
    return [
        {"name": name, "x": float(x[i]), "y": float(y[i]), "visible": int(visible[i])}
        | ({"parent": bones[name]} if name in bones else {})
        for i, name in enumerate(points)
    ]
