"""Attributes that Cycles makes of a mesh where a shader asks for them, by formulas of vertices and edges, and its hash of
whole numbers.

As in attr_create_pointiness and attr_create_random_per_island of intern/cycles/blender/mesh.cpp, and in util/hash.h.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

GENERATED, POINTINESS, RANDOM_PER_ISLAND = "generated", "pointiness", "random_per_island"
"""Cycles' names of them; an Attribute node that names one asks for it, too."""

_EPSILON = float(np.finfo(np.float32).eps)
_ROTATIONS = (14, 11, 25, 16, 4, 14, 24)


def hashed(*words: ArrayLike) -> NDArray[np.uint32]:
    """The 32 bits that Cycles draws for one, two or three whole numbers, each an array or one of them."""
    start = np.uint32(0xDEADBEEF + 4 * len(words) + 13)
    with np.errstate(over="ignore"):
        a, b, c = (start + np.asarray(word, np.uint32) for word in (*words, 0, 0)[:3])
        for rotation in _ROTATIONS:
            c = (c ^ b) - (b << np.uint32(rotation) | b >> np.uint32(32 - rotation))
            a, b, c = b, c, a
    return b


def unit_number(bits: NDArray[np.uint32]) -> NDArray[np.float32]:
    """Numbers from 0 to 1, as Cycles makes them of 32 bits."""
    return bits.astype(np.float32) * np.float32(2.0**-32)


def random_per_island(edges: NDArray[np.int32], count: int) -> NDArray[np.float32]:
    """(count,): for each vertex, a number that all have that edges connect with it.

    It is hashed from the vertex that Cycles' sets end up with, which depends on the order of the edges. edges : (n, 2).
    """
    parents, ranks = list(range(count)), [0] * count
    for first, second in edges.tolist():
        while parents[first] != first:
            parents[first] = first = parents[parents[first]]
        while parents[second] != second:
            parents[second] = second = parents[parents[second]]
        if first != second:
            if ranks[first] < ranks[second]:
                first, second = second, first
            parents[second] = first
            ranks[first] += ranks[first] == ranks[second]
    return unit_number(hashed(_ends(np.array(parents, np.int64))))


def pointiness(places: NDArray[np.float32], normals: NDArray[np.float32], edges: NDArray[np.int32]) -> NDArray[np.float32]:
    """(n,): for each vertex, how pointed the surface is there: ½ where it is flat, more where it is convex.

    The angle between the normal and the mean way along the edges that leave, in half turns; then its mean with the neighbors'.
    Vertices in one place are one.
    places, normals : (n, 3).
    edges : (m, 2).
    """
    count, same = len(places), _welded(places)
    ends = same[edges]
    _, first = np.unique(np.sort(ends, axis=1), axis=0, return_index=True)
    start, end = ends[np.sort(first)].T
    with np.errstate(divide="ignore", invalid="ignore"):
        ways = _unit(places[end].astype(np.float64) - places[start])
        ways = _summed(start, ways, count) + _summed(end, -ways, count)
        degrees = np.bincount(start, minlength=count) + np.bincount(end, minlength=count)
        cosines = np.einsum("ij,ij->i", _unit(_summed(same, normals, count)), ways) / degrees
        angles = np.arccos(np.clip(np.where(cosines > -1, cosines, -1), -1, 1)) / np.pi
    angles[degrees == 0] = 0
    near = np.bincount(start, angles[end], count) + np.bincount(end, angles[start], count)
    return ((angles + near) / (degrees + 1)).astype(np.float32)[same]


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def _summed(at: NDArray[np.integer], vectors: NDArray[np.floating], count: int) -> NDArray[np.float64]:
    """(count, 3): the sum of the vectors of each number in `at`."""
    return np.column_stack([np.bincount(at, column, count) for column in vectors.T])


def _welded(places: NDArray[np.float32]) -> NDArray[np.int64]:
    """(n,): the first of the vertices that stand in one place with each, as Cycles sees it."""
    sums = places[:, 0] + places[:, 1] + places[:, 2]
    order = np.lexsort((-np.arange(len(places)), sums))
    places, sums = places[order], sums[order]
    target, left, ahead = np.arange(len(places)), np.arange(len(places)), 1
    while len(left):
        left = left[left + ahead < len(places)]
        left = left[sums[left + ahead] - sums[left] <= 3 * _EPSILON]
        apart = places[left + ahead] - places[left]
        is_same = np.einsum("ij,ij->i", apart, apart) < _EPSILON
        target[left[is_same]] = left[is_same] + ahead
        left, ahead = left[~is_same], ahead + 1
    welded = np.empty_like(order)
    welded[order] = order[_ends(target)]
    return welded


def _ends(target: NDArray[np.int64]) -> NDArray[np.int64]:
    """(n,): the last number that each gets to from target to target."""
    while not np.array_equal(further := target[target], target):
        target = further
    return target
