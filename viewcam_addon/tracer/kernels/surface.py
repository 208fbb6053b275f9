"""Kernel of rays/surface.py: what rays meet, written into all passes at once, as NumPy writes it, bit for bit."""

import numpy as np

from ...image import BACKGROUND_DEPTH
from ..rays import surface as plain
from .packets import kernel
from .triangles import hit
from .vectors import dot, inlined, scaled, taken

_ZERO, _ONE, _FAR = np.float32(0), np.float32(1), np.float32(BACKGROUND_DEPTH)
_UNWANTED, _NO_TABLE, _ALL = np.empty(0, np.float32), np.empty((0, 0), np.float32), np.empty(0, np.bool_)


@inlined
def _mean(corners, row, rows, triangle, a, b, c):
    """What a table of so many rows for each corner has in the mean."""
    return corners[row, triangle] * a + corners[row + rows, triangle] * b + corners[row + 2 * rows, triangle] * c


@inlined
def _normal(corner_normals, normals, sides, triangle, first, second):
    """surface._normal, of one ray."""
    if not corner_normals.size:
        return taken(normals, triangle)
    b, c = np.float32(first), np.float32(second)
    a = (_ONE - b) - c
    x = _mean(corner_normals, 0, 3, triangle, a, b, c)
    y = _mean(corner_normals, 1, 3, triangle, a, b, c)
    z = _mean(corner_normals, 2, 3, triangle, a, b, c)
    smooth, side = (x, y, z), np.float32(sides[triangle])
    length = np.sqrt(dot(smooth, smooth))
    if length > _ZERO:
        return scaled(smooth, side / length)
    return scaled(scaled(taken(normals, triangle), side), side)


@inlined
def _cosine(across, x, y):
    """surface._write_facing, of one ray."""
    x, y = np.float32(x), np.float32(y)
    cosine = np.float32(across) / np.sqrt((x * x + y * y) + _ONE)
    cosine = _ONE if cosine > _ONE else cosine
    return _ZERO if cosine < _ZERO else cosine


@kernel
def _write(targets, primitives, x, y, axes, eye, tables, smoothing, mapping, labels, eye_magnitude):
    """targets : the channels of all passes, (n,) each, or empty where nobody asks for them. The tables may be empty then."""
    depths, px, py, pz, nx, ny, nz, us, vs, has_uv, objects, materials, magnitudes, facings = targets
    forms, span, distances = tables
    corner_normals, normals, sides = smoothing
    uvs, mapped = mapping
    object_index, material_index, magnitude = labels
    for target in targets:
        target[:] = _ZERO
    depths[:] = _FAR
    for ray in range(primitives.size):
        triangle = primitives[ray]
        if triangle < 0 or triangle >= forms.shape[1]:
            continue
        right, up = x[ray], y[ray]
        depth, first, second = hit(forms, span, triangle, right, up)
        if depths.size:
            depths[ray] = depth
        if px.size:
            px[ray] = (axes[0, 0] * right + axes[1, 0] * up + axes[2, 0]) * depth + eye[0]
            py[ray] = (axes[0, 1] * right + axes[1, 1] * up + axes[2, 1]) * depth + eye[1]
            pz[ray] = (axes[0, 2] * right + axes[1, 2] * up + axes[2, 2]) * depth + eye[2]
        if nx.size:
            nx[ray], ny[ray], nz[ray] = _normal(corner_normals, normals, sides, triangle, first, second)
        if us.size:
            if uvs.size:
                third = 1.0 - first - second
                us[ray] = _mean(uvs, 0, 2, triangle, third, first, second)
                vs[ray] = _mean(uvs, 1, 2, triangle, third, first, second)
                has_uv[ray] = mapped[triangle] if mapped.size else True
            else:
                us[ray], vs[ray], has_uv[ray] = _ZERO, _ZERO, _ZERO
        if objects.size:
            objects[ray] = object_index[triangle]
        if materials.size:
            materials[ray] = material_index[triangle]
        if magnitudes.size:
            magnitudes[ray] = max(magnitude[triangle], eye_magnitude)
        if facings.size:
            facings[ray] = _cosine(distances[triangle] / depth, right, up)


def write_triangles(surface, passes, primitives, x, y):
    triangles, planes = surface.triangles, surface.planes
    targets = tuple(
        passes[name][:, channel] if name in passes else _UNWANTED
        for name, channels in plain.PASSES.items()
        for channel in range(channels)
    )
    if not all(target.flags.c_contiguous for target in targets):  # not from `unwritten`: no kernel for that
        plain.write_triangles.plain(surface, passes, primitives, x, y)
        return

    def one(name, owner, table):
        return getattr(owner, table) if name in passes else _UNWANTED

    smooth = "Normal" in passes and triangles.corner_normals is not None
    has_uv = "UV" in passes and triangles.corner_uvs is not None
    some_have = has_uv and triangles.mapped is not None
    mapping = triangles.corner_uvs if has_uv else _NO_TABLE, triangles.mapped if some_have else _ALL
    smoothing = (
        triangles.corner_normals if smooth else _NO_TABLE,
        planes.normals if "Normal" in passes else _NO_TABLE,
        planes.side,
    )
    labels = (
        one("Object Index", triangles, "object_index"),
        one("Material Index", triangles, "material_index"),
        one("Magnitude", planes, "magnitude"),
    )
    distances = planes.distance if "Facing" in passes else np.empty(0)
    tables = planes.forms, planes.span, distances
    axes, eye = surface.view.axes, surface.view.eye
    _write(targets, primitives, x, y, axes, eye, tables, smoothing, mapping, labels, surface.eye_magnitude)
