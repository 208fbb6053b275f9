"""Kernels of rays/points.py: points of triangles that rays meet, triangle by triangle."""

import numpy as np

from ..rays import points as plain
from .packets import kernel
from .vectors import cross, difference, divided, dot, inlined, put, scaled, sum_of, taken

_NO_NORMALS, _NO_WEIGHTS = np.empty((9, 0), np.float32), np.empty((2, 0))


@inlined
def _linear(forms, row, triangle, x, y):
    return forms[row, triangle] * x + forms[row + 1, triangle] * y + forms[row + 2, triangle]


@inlined
def _interpolated(corners, first, second, triangle, row):
    value = corners[row, triangle] * (1.0 - first - second)
    value += corners[row + 3, triangle] * first
    return value + corners[row + 6, triangle] * second


@inlined
def _looks_at(normal, side, way):
    """The normal, and its side; of what is no surface, but was found there, it looks at the ray."""
    if np.isfinite(normal[0] + normal[1] + normal[2]):
        return normal, side
    return divided((-way[0], -way[1], -way[2]), np.sqrt(dot(way, way))), 1.0


@inlined
def _smooth(corner_normals, axes, triangle, first, second, normal, side):
    """Surfaces._shading."""
    given = (
        _interpolated(corner_normals, first, second, triangle, 0),
        _interpolated(corner_normals, first, second, triangle, 1),
        _interpolated(corner_normals, first, second, triangle, 2),
    )
    smooth = (
        axes[0, 0] * given[0] + axes[0, 1] * given[1] + axes[0, 2] * given[2],
        axes[1, 0] * given[0] + axes[1, 1] * given[1] + axes[1, 2] * given[2],
        axes[2, 0] * given[0] + axes[2, 1] * given[1] + axes[2, 2] * given[2],
    )
    length = np.sqrt(dot(smooth, smooth))
    return scaled(smooth, side / length) if length > 0 else normal


@kernel
def _seen(tables, handedness, triangles, x, y, positions, normals, shadings, weights):
    forms, span, sides, corner_normals, axes, front, material_of, offset_of = tables
    backside, material, offset = np.empty(x.size, np.bool_), np.empty(x.size, np.int32), np.empty(x.size)
    for ray in range(x.size):
        triangle, right, up = triangles[ray], x[ray], y[ray]
        depth = 1.0 / _linear(forms, 0, triangle, right, up)
        depth = np.fmin(np.fmax(depth, span[0, triangle]), span[1, triangle])
        first = np.fmax(np.fmin(_linear(forms, 3, triangle, right, up) * depth, 1.0), 0.0)
        second = np.fmax(np.fmin(_linear(forms, 6, triangle, right, up) * depth, 1.0 - first), 0.0)
        plane = taken(forms, triangle)
        normal = divided(plane, -np.sqrt(dot(plane, plane)))
        normal, side = _looks_at(normal, sides[triangle] * handedness, (right, up, 1.0))
        put(positions, ray, (right * depth, up * depth, depth))
        put(normals, ray, normal)
        if corner_normals.size:
            put(shadings, ray, _smooth(corner_normals, axes, triangle, first, second, normal, side))
        if weights.size:
            weights[0, ray], weights[1, ray] = first, second
        backside[ray], material[ray], offset[ray] = side * front[triangle] < 0, material_of[triangle], offset_of[triangle]
    return backside, material, offset


@kernel
def _met(tables, triangles, origins, directions, positions, normals, shadings, weights, distances):
    vertices, corners, corner_normals, axes, front, material_of, offset_of = tables
    count = distances.size
    backside, material, offset = np.empty(count, np.bool_), np.empty(count, np.int32), np.empty(count)
    for ray in range(count):
        triangle, origin, way = triangles[ray], taken(origins, ray), taken(directions, ray)
        corner = taken(vertices, corners[0, triangle])
        b = difference(taken(vertices, corners[1, triangle]), corner)
        c = difference(taken(vertices, corners[2, triangle]), corner)
        normal = cross(b, c)
        distance = dot(normal, difference(corner, origin)) / dot(normal, way)
        inside = difference(sum_of(origin, scaled(way, distance)), corner)
        squared = dot(normal, normal)
        unit = divided(normal, squared)
        first = np.fmax(np.fmin(dot(cross(inside, c), unit), 1.0), 0.0)
        second = np.fmax(np.fmin(dot(cross(b, inside), unit), 1.0 - first), 0.0)
        position = sum_of(sum_of(corner, scaled(b, first)), scaled(c, second))
        distances[ray] = dot(difference(position, origin), way)
        side = -1.0 if dot(normal, way) > 0 else 1.0
        normal, side = _looks_at(scaled(normal, side / np.sqrt(squared)), side, way)
        put(positions, ray, position)
        put(normals, ray, normal)
        if corner_normals.size:
            put(shadings, ray, _smooth(corner_normals, axes, triangle, first, second, normal, side))
        if weights.size:
            weights[0, ray], weights[1, ray] = first, second
        backside[ray], material[ray], offset[ray] = side * front[triangle] < 0, material_of[triangle], offset_of[triangle]
    return backside, material, offset


def _points(surfaces, triangle, compute):
    """What `compute` makes of arrays for positions, normals, smooth normals and barycentric coordinates, as Points."""
    corner_normals = surfaces.triangles.corner_normals
    positions, normals = np.empty((2, 3, len(triangle)))
    shadings = normals if corner_normals is None else np.empty((3, len(triangle)))
    varies = surfaces.has_uv or surfaces.colours is not None
    weights = np.empty((2, len(triangle))) if varies else _NO_WEIGHTS
    common = surfaces.axes, surfaces.front, surfaces.material, surfaces.offset
    tables = (_NO_NORMALS if corner_normals is None else corner_normals, *common)
    backside, material, offset = compute(tables, positions, normals, shadings, weights)
    found = positions, normals, shadings, backside, material, triangle, offset
    return plain.Points(*found, *surfaces.varying(triangle, *weights)) if varies else plain.Points(*found, None, None)


def triangles_seen(surfaces, triangle, x, y):
    planes = surfaces.planes

    def compute(tables, *into):
        return _seen((planes.forms, planes.span, planes.side, *tables), surfaces.handedness, triangle, x, y, *into)

    return _points(surfaces, triangle, compute)


def triangles_met(surfaces, triangle, origins, ways):
    distances = np.empty(len(triangle))
    triangles = surfaces.triangles

    def compute(tables, *into):
        return _met((triangles.vertices, triangles.corners, *tables), triangle, origins, ways, *into, distances)

    return _points(surfaces, triangle, compute), distances
