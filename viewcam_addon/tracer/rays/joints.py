"""Where triangles join: which two share an edge, which edges belong to one alone, and which are creases.

From any eye, a surface changes by leaps only at such edges: at the silhouettes, between a triangle that faces the eye and one
that faces away, at borders, and at creases. Which are silhouettes depends on the eye; all else is found once for a mesh.

An edge of a triangle is a number, 4 · triangle + side; side 0 runs from corner 0 to corner 1, and so on.

Pairs are found by sorting, edge and number packed into one integer, which takes NumPy a fifth of the time of sorting indices.
Vertices of borders that stand at one place, as at the seams of a UV map, are one. Where three triangles or more share an edge,
each has a border there.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Indices, dot, gather
from ..scene import Mesh
from .tables import each
from .triangles import Triangles

Edges = NDArray[np.int32]
"""(n,) numbers of edges, 4 · triangle + side."""


@dataclass(frozen=True, eq=False)
class _Joints:
    """Of one mesh.

    pairs : (2, n) int32, the same edge in two triangles. twisted : (n,) bool, where both run along it in one direction, so that
    one of them shows its front where the other shows its back. borders : (k,) int32. bends : (n,) float32, by how much the unit
    normals differ at the edge, in object space; inf where the materials differ.
    """

    pairs: Edges
    twisted: NDArray[np.bool_]
    borders: Edges
    bends: NDArray[np.float32]


class Joints:
    """Of a scene.

    pairs, twisted, borders : as of a mesh. creases : (c,) int32, which of the pairs are creases or changes of material.

    bend : the largest difference of unit normals that is no crease. A matte surface of albedo a on which light of irradiance E
        falls has the radiance a E cos θ / π, so what is no crease is a leap of radiance by a E · bend / π at most.
    """

    def __init__(self, triangles: Triangles, bend: float) -> None:
        meshes = {id(mesh): mesh for _, mesh in triangles.placed}
        found = dict(zip(meshes, each(_joints, meshes.values(), triangles.threads), strict=True))
        creased: dict[tuple[int, float], Indices] = {}
        pairs, twisted, borders, creases = [np.empty((2, 0), np.int32)], [np.empty(0, bool)], [np.empty(0, np.int32)], []
        triangle, pair = 0, 0
        for (_, mesh), stretch in zip(triangles.placed, _stretches(triangles), strict=True):
            key = id(mesh)
            joints = found[key]
            if (key, stretch) not in creased:
                creased[key, stretch] = np.flatnonzero(joints.bends * stretch > bend).astype(np.int32)
            shift = np.int32(4 * triangle)
            pairs.append(joints.pairs + shift)
            twisted.append(joints.twisted)
            borders.append(joints.borders + shift)
            creases.append(creased[key, stretch] + np.int32(pair))
            triangle += len(mesh.triangles)
            pair += len(joints.twisted)
        self.pairs: Edges = np.concatenate(pairs, axis=1)
        self.twisted: NDArray[np.bool_] = np.concatenate(twisted)
        self.borders: Edges = np.concatenate(borders)
        self.creases: NDArray[np.int32] = np.concatenate([np.empty(0, np.int32), *creases])

    def silhouettes(self, side: NDArray) -> Indices:
        """Which of the pairs are silhouettes.

        side : (m,) of the triangles, positive where their corners run one way round as seen from the eye, negative where they
            run the other; 0 or nan where they are seen edge-on, whose edges all count.

        One whose sign is wrong by rounding is seen as a line: the silhouette then passes along another of its edges, which
        lies in the same place.
        """
        signs = np.sign(np.nan_to_num(side)).astype(np.int8)
        first, second = (gather(signs, edges >> 2) for edges in self.pairs)
        first *= second
        first *= np.where(self.twisted, np.int8(-1), np.int8(1))
        return np.flatnonzero(first <= 0)


def _stretches(triangles: Triangles) -> list[float]:
    """By how much objects may widen the angle between normals: their longest axis over their shortest, a sixteenth on top."""
    matrices = np.array([placed.matrix[:3, :3] for placed, _ in triangles.placed]).reshape(-1, 3, 3)
    lengths = np.linalg.svd(matrices, compute_uv=False)
    with np.errstate(all="ignore"):
        stretch = np.nan_to_num(lengths[:, 0] / lengths[:, 2], nan=np.inf, posinf=np.inf)
    return (np.ceil(stretch * 16 - 2.0**-20) / 16).tolist()


def _joints(mesh: Mesh) -> _Joints:
    corners = mesh.triangles
    first, borders = _paired(corners, np.arange(4 * len(corners), dtype=np.int32).reshape(-1, 4)[:, :3].T.ravel())
    second, borders = _paired(_welded(mesh, borders), borders)
    pairs = np.concatenate([first, second], axis=1)
    twisted = np.concatenate([_twisted(corners, first), _twisted_in_space(mesh, second)])
    return _Joints(pairs, twisted, borders, _bends(mesh, pairs, twisted))


def _ends(corners: NDArray, edges: Edges) -> tuple[NDArray, NDArray]:
    """The vertices from and to which edges run. corners : (m, 3)."""
    flat, triangle, side = corners.ravel(), edges >> 2, edges & 3
    after = np.where(side == 2, 0, side + 1)
    return flat.take(triangle * 3 + side), flat.take(triangle * 3 + after)


def _paired(corners: NDArray, edges: Edges) -> tuple[Edges, Edges]:
    """(2, n) those of the edges that two triangles share, and (k,) all others that are longer than 0."""
    ends = _ends(corners, edges)
    least, greatest = np.minimum(*ends), np.maximum(*ends)
    if (least == greatest).any():
        long = np.flatnonzero(least != greatest)
        least, greatest, edges = least[long], greatest[long], edges[long]
    count = int(greatest.max(initial=0)) + 1
    edge = least.astype(np.int64) * count + greatest
    bits = int(edges.max(initial=0)).bit_length()
    if (count * count).bit_length() + bits < 64:
        edge <<= bits
        edge |= edges
        edge.sort()
        edges = (edge & ((1 << bits) - 1)).astype(np.int32)
        edge >>= bits
    else:
        order = np.argsort(edge, kind="stable")
        edge, edges = edge[order], edges[order]
    begins = np.flatnonzero(np.concatenate([[True], edge[1:] != edge[:-1]])) if len(edge) else np.empty(0, np.intp)
    users = np.diff(begins, append=len(edge))
    two = begins[users == 2]
    return np.stack([edges[two], edges[two + 1]]), edges[np.repeat(users != 2, users)]


def _twisted(corners: NDArray, pairs: Edges) -> NDArray[np.bool_]:
    return _ends(corners, pairs[0])[0] == _ends(corners, pairs[1])[0]


def _twisted_in_space(mesh: Mesh, pairs: Edges) -> NDArray[np.bool_]:
    first, second = (mesh.vertices[_ends(mesh.triangles, edges)[0]] for edges in pairs)
    return (first == second).all(axis=1)


def _welded(mesh: Mesh, borders: Edges) -> NDArray[np.int64]:
    """(m, 3) corners in which the vertices of borders that stand at one place are one."""
    number = np.arange(len(mesh.vertices))
    vertices = np.unique(np.concatenate(_ends(mesh.triangles, borders)))
    places = mesh.vertices[vertices]
    order = np.lexsort(places.T)
    vertices, places = vertices[order], places[order]
    alike = np.concatenate([[False], (places[1:] == places[:-1]).all(axis=1)]) if len(order) else np.empty(0, bool)
    number[vertices] = vertices[np.maximum.accumulate(np.where(alike, 0, np.arange(len(order))))]
    return number[mesh.triangles]


def _bends(mesh: Mesh, pairs: Edges, twisted: NDArray[np.bool_]) -> NDArray[np.float32]:
    first, second = pairs >> 2
    turn = np.where(twisted, np.float32(-1), np.float32(1))
    if mesh.corner_normals is None:
        normals = _face_normals(mesh)
        bends = _apart(gather(normals, first), gather(normals, second), turn)
    else:
        normals = mesh.corner_normals.reshape(-1, 3).T
        length = np.sqrt(dot(normals, normals))
        with np.errstate(all="ignore"):  # 0 stands for the face's own normal: a crease, for certain
            normals = np.ascontiguousarray(normals / length)
        (start, end), (other_start, other_end) = (_ends(np.arange(normals.shape[1]).reshape(-1, 3), edges) for edges in pairs)
        start, end = (gather(normals, corner) for corner in (start, end))
        other_start, other_end = (
            gather(normals, np.where(twisted, *two)) for two in ((other_start, other_end), (other_end, other_start))
        )
        bends = np.maximum(_apart(start, other_start, turn), _apart(end, other_end, turn))
    bends[gather(mesh.materials, first) != gather(mesh.materials, second)] = np.inf
    return bends


def _apart(first: NDArray, second: NDArray, turn: NDArray[np.float32]) -> NDArray[np.float32]:
    difference = first - turn * second
    return np.nan_to_num(np.sqrt(dot(difference, difference)), nan=np.inf, posinf=np.inf).astype(np.float32)


def _face_normals(mesh: Mesh) -> Floats:
    """(3, m) unit, object space, nan of triangles without area."""
    vertices = mesh.vertices.T
    a, b, c = (vertices.take(corner, axis=1) for corner in mesh.triangles.T)
    b -= a
    c -= a
    normal = np.stack([b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]])
    with np.errstate(all="ignore"):
        normal /= np.sqrt(dot(normal, normal))
    return normal


def corners_of(triangles: Triangles, edges: Edges) -> list[Floats]:
    """(3, n) each, camera space: both ends of edges, and the third corner of their triangles."""
    triangle, side = edges >> 2, edges & 3
    flat, corners = triangles.corners.ravel(), []
    for further in range(3):
        corner = side + np.int32(further)
        corner[corner > 2] -= 3
        corners.append(gather(triangles.vertices, flat.take(corner * np.intp(triangles.count) + triangle)))
    return corners
