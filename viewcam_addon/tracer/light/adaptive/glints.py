"""Small things that shine, brighter than all that is lit: a part of a pixel that samples may miss, and most of its light.

Where a corner of a shining triangle or the centre of a shining sphere falls, and no centre of the pixels around shows what
shines, N samples may all have missed it: its part of the pixel is then about 1/N or less, and the pixel off by its radiance
over N. Hidden ones are told by the depths around. What shines between corners, as a wire does, is found by its outline, as a
wire that is lit.
"""

import numpy as np
from numpy.typing import NDArray

from ....pinhole import Pinhole
from ...arrays import Float32s, Floats, dot, gather
from ...rays.points import Surfaces
from ..textures import Palette

# So much farther than the farthest that is seen around, it is hidden.
_BEHIND = 1.01


def glints(camera: Pinhole, surfaces: Surfaces, palette: Palette, depth: Float32s, material: NDArray[np.int32]) -> Floats:
    """(height, width): the radiance of small shining things in and beside each pixel, squared, 0 where there are none.

    depth, material : (height, width), of what is seen at the pixels' centres. Of radiance the mean of the channels' squares.
    """
    found = np.zeros(depth.shape)
    shining = palette.having("emission")
    if not shining.any():
        return found
    colours = np.transpose([palette.mean("emission", number) for number in range(len(shining))])
    (x, y, z), radiance = _places(surfaces, shining, dot(colours, colours) / 3.0)
    with np.errstate(all="ignore"):
        column = np.floor(x / z * camera.distance[0] + camera.principal_point[0])
        row = np.floor(y / z * camera.distance[1] + camera.principal_point[1])
    height, width = depth.shape
    inside = np.flatnonzero((z > 0) & (column >= 0) & (column < width) & (row >= 0) & (row < height))
    pixel = row[inside].astype(np.intp), column[inside].astype(np.intp)
    shown = largest_around(gather(shining, material).astype(float))[pixel] > 0
    small = ~shown & (z[inside] <= _BEHIND * largest_around(depth)[pixel])
    np.maximum.at(found, (pixel[0][small], pixel[1][small]), radiance[inside][small])
    return largest_around(found)


def _places(surfaces: Surfaces, shining: NDArray[np.bool_], radiance: Floats) -> tuple[Floats, Floats]:
    """Corners and centres of what shines, (3, n), camera space, and how it does, (n,). shining, radiance : of each material."""
    triangles, balls = surfaces.triangles, surfaces.balls
    of_triangles, of_balls = surfaces.material[: triangles.count], surfaces.material[triangles.count :][balls.number]
    some, others = (np.flatnonzero(gather(shining, materials)) for materials in (of_triangles, of_balls))
    places = [*gather(triangles.vertices, triangles.corners[:, some]).transpose(1, 0, 2), gather(balls.centres, others)]
    found = np.concatenate([np.tile(gather(of_triangles, some), 3), gather(of_balls, others)])
    return np.concatenate(places, axis=1), gather(radiance, found)


def largest_around(values: Floats) -> Floats:
    """The largest in the 3 × 3 pixels round each."""
    for axis in (0, 1):
        padded = np.pad(values, [(1, 1) if axis == i else (0, 0) for i in (0, 1)])
        before, after = np.split(padded, [-2], axis)[0], np.split(padded, [2], axis)[1]
        values = np.maximum(np.maximum(before, after), values)
    return values
