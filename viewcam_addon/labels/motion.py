"""The motion of what the pixels show to another frame: optical flow, scene flow, and what is hidden there.

The point is the same of the same primitive: of a triangle by its barycentric coordinates, of a sphere by its direction from the
center. So rigid bodies, deforming meshes and moving cameras are one formula, and no flow is interpolated or searched for.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..tracer.render import barycentric
from ..tracer.scene import Mesh, Spheres
from .surfaces import Array, Instance, Surfaces

# A point and the ray to it are float64, and were each computed in a few dozen operations; slanted surfaces multiply that.
# Far below what a depth map of float32 can tell, far above 2⁻⁵³.
_SLACK = 1e-9


@dataclass(frozen=True, eq=False)
class Motion:
    """The motion of each pixel's point from one frame to another; nan where nothing is known. Rows from the bottom.

    flow : (height, width, 2), pixels to the right and **down**: where the point appears there, less the pixel's center here.
    displacement : (height, width, 3), world space. hidden : (height, width), whether the other frame's camera does not see the
    point: something is before it, or it lies beside the picture or beyond the clip. lost : names of objects that are not in the
    other frame, or have another topology there.
    """

    flow: NDArray[np.float64]
    displacement: Array
    hidden: NDArray[np.bool_]
    lost: tuple[str, ...]


def motion(here: Surfaces, there: Surfaces) -> Motion:
    """The motion from one frame to another, of the same size.

    Raises
    ------
    InputError
        if their sizes differ.
    """
    if (here.camera.width, here.camera.height) != (there.camera.width, there.camera.height):
        raise InputError(
            f"the other frame has {there.camera.width} × {there.camera.height} pixels and this one {here.camera.width} × "
            f"{here.camera.height}: give frames of one size"
        )
    others = {instance.key: (number, instance) for number, instance in enumerate(there.instances)}
    points, owners = here.points.reshape(-1, 3), np.full(here.instance.size, -1)
    moved, lost = np.full_like(points, np.nan), {}
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
    elif not is_rigid:
        weights = barycentric(local, before.vertices[before.triangles[primitive]])
        local = (weights[..., None] * after.vertices[after.triangles[primitive]]).sum(axis=1)
    return local @ other.matrix[:3, :3].T + other.matrix[:3, 3]
