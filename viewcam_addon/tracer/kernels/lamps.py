"""Lamps and shining objects as rows of one table, and what light/bulbs.py, plates.py and glowing.py compute, for one point."""

import numpy as np
from numba.extending import register_jitable

from ..light import bulbs, glowing, lamps, plates
from ..light.bulbs import Bulbs, Suns
from ..light.plates import Rectangles
from .vectors import arcsine, axes_about, cosine_direction, difference, divided, dot, inlined, scaled, sum_of, turned

SUN, BULB, RECTANGLE, ELLIPSE, OBJECT = range(5)

# The columns of a row. A sun's place is where it shines from, its reach a sine, its second size one over its density.
_KIND, _COLOUR, _BRIGHTNESS, _PLACE, _REACH, _SIZE, _RADIANCE = 0, 1, 4, 5, 8, 9, 10
_FIRST, _SECOND, _NORMAL, _ACROSS, _ALONG = 11, 14, 17, 20, 21  # of plates, with the lengths of the half sides
_FLAG = 22  # plates that are askew, bulbs with a soft falloff
_SPOT, _INVERSE, _EDGE, _SLOPE, _AXIS, _OPENING = 23, 24, 33, 34, 35, 38
_COLUMNS = 39

_one_minus_cosine, _risen = register_jitable(bulbs.one_minus_cosine), register_jitable(bulbs.risen)
_MOST, _LARGEST = lamps.MOST, np.finfo(np.float64).max
_QUARTER_SPHERE, _LEAST_DENSITY, _LEAST_OF_A_WIDE_SPOT = (
    bulbs.QUARTER_SPHERE,
    bulbs.LEAST_DENSITY,
    bulbs.LEAST_OF_A_WIDE_SPOT,
)
_SMALLEST_ANGLE, _FAR, _SLANT = plates.SMALLEST_ANGLE, plates.FAR, plates.SLANT
_NO_DENSITY = glowing.LEAST_DENSITY


def table_of(lamps: "lamps.Lamps", shining: "glowing.Glowing") -> np.ndarray:
    """(k, _COLUMNS) float64: all lamps and then all shining objects, numbered as in `Emitters`."""
    rows = np.zeros((lamps.count + shining.count, _COLUMNS))
    for table, first in zip(lamps.tables, lamps.firsts, strict=True):
        part = rows[first : first + table.colours.shape[1]]
        part[:, _COLOUR : _COLOUR + 3] = table.colours.T
        part[:, _BRIGHTNESS] = [colour.mean() for colour in table.colours.T]
        fill = _fill_suns if isinstance(table, Suns) else _fill_bulbs if isinstance(table, Bulbs) else _fill_plates
        fill(part, table)
    part = rows[lamps.count :]
    if shining.count:
        part[:, _KIND] = OBJECT
        part[:, _PLACE : _PLACE + 3], part[:, _REACH] = shining.centres.T, shining.reach
        part[:, _BRIGHTNESS] = shining.brightness
    return rows


def _fill_suns(part, table):
    part[:, _KIND] = SUN
    part[:, _PLACE : _PLACE + 3] = table.towards.T
    part[:, _SIZE], part[:, _RADIANCE] = table.spread, table.over_density
    part[:, _REACH] = np.sqrt(table.spread * (2 - table.spread))


def _fill_bulbs(part, table):
    part[:, _KIND] = BULB
    part[:, _PLACE : _PLACE + 3], part[:, _REACH] = table.centres.T, table.radii
    part[:, _RADIANCE], part[:, _FLAG] = table.radiance, table.soft
    if table.cones is not None:
        cones = table.cones
        part[:, _SPOT], part[:, _EDGE], part[:, _SLOPE] = cones.is_spot, cones.edge, cones.slope
        part[:, _INVERSE : _INVERSE + 9], part[:, _AXIS : _AXIS + 3] = cones.inverse.T, cones.axes.T
        part[:, _OPENING] = cones.spread


def _fill_plates(part, table):
    part[:, _KIND] = RECTANGLE if isinstance(table, Rectangles) else ELLIPSE
    part[:, _PLACE : _PLACE + 3], part[:, _REACH] = table.centres.T, table.reach
    part[:, _FIRST : _FIRST + 3], part[:, _SECOND : _SECOND + 3] = table.first.T, table.second.T
    part[:, _NORMAL : _NORMAL + 3], part[:, _RADIANCE] = table.normals.T, table.radiance
    part[:, _ACROSS], part[:, _ALONG] = table.lengths
    if isinstance(table, Rectangles):
        part[:, _FLAG] = table.askew


@inlined
def kind_of(table, lamp):
    return table[lamp, _KIND]


@inlined
def colour_of(table, lamp):
    return table[lamp, _COLOUR], table[lamp, _COLOUR + 1], table[lamp, _COLOUR + 2]


@inlined
def _vector(table, lamp, column):
    return table[lamp, column], table[lamp, column + 1], table[lamp, column + 2]


@inlined
def _attenuation(table, lamp, ahead):
    x, y, z = (
        dot(_vector(table, lamp, _INVERSE), ahead),
        dot(_vector(table, lamp, _INVERSE + 3), ahead),
        dot(_vector(table, lamp, _INVERSE + 6), ahead),
    )
    cosine = z / np.sqrt(x * x + y * y + z * z)
    rise = np.minimum(np.maximum((cosine - table[lamp, _EDGE]) * table[lamp, _SLOPE], 0.0), 1.0)
    return rise * rise * (3 - 2 * rise)


@inlined
def estimate(table, lamp, position, normal):
    """About how much a lamp or an object brings to a point."""
    kind, reach, brightness = table[lamp, _KIND], table[lamp, _REACH], table[lamp, _BRIGHTNESS]
    if kind == SUN:
        return _risen(dot(normal, _vector(table, lamp, _PLACE)), 1.0, reach) * brightness
    way = difference(_vector(table, lamp, _PLACE), position)
    squared = dot(way, way)
    distance = np.sqrt(squared)
    if kind == BULB:
        falloff = brightness / (_QUARTER_SPHERE * np.maximum(distance, reach) ** 2)
        light = (falloff if distance + reach > 0 else 0.0) * _risen(dot(normal, way), distance, reach)
        if table[lamp, _SPOT]:
            seen = _attenuation(table, lamp, divided(way, distance))
            light *= np.fmax(seen, _LEAST_OF_A_WIDE_SPOT if reach > 0 else 0.0)
        return light
    if kind == OBJECT:
        risen = np.fmax(dot(normal, way) + reach, 0.0)
        return risen * (brightness / ((squared + reach * reach / 2) * (distance + reach)))
    before = -dot(way, _vector(table, lamp, _NORMAL))
    if not before > 0:
        return 0.0
    farthest = distance + reach
    light = np.fmax(dot(normal, way) + reach, 0.0) * (before + reach)
    return light * (brightness / np.pi / (farthest * farthest * (squared + reach * reach / 2)))


@inlined
def sample(table, lamp, position, shading, u, v):
    """A direction to a lamp, how far off, and what its colour is multiplied with."""
    kind = table[lamp, _KIND]
    if kind == SUN:
        ahead = _vector(table, lamp, _PLACE)
        if table[lamp, _SIZE] > 0:
            ahead, _ = _within_cone(ahead, table[lamp, _SIZE], u, v)
        return ahead, np.inf, table[lamp, _RADIANCE]
    way = difference(_vector(table, lamp, _PLACE), position)
    if kind == BULB:
        return _sample_bulb(table, lamp, way, shading, u, v)
    if kind == RECTANGLE:
        return _sample_rectangle(table, lamp, way, u, v)
    return _sample_ellipse(table, lamp, way, u, v)


@inlined
def limited(factor):
    return np.minimum(factor, _MOST)


@inlined
def _within_cone(axis, spread, u, v):
    """bulbs.within_cone."""
    right, up = axes_about(axis)
    short = u * spread
    sine = np.sqrt(short * (2.0 - short))
    x, y = turned(v)
    return sum_of(sum_of(scaled(axis, 1.0 - short), scaled(right, sine * x)), scaled(up, sine * y)), short


@inlined
def _sample_bulb(table, lamp, way, shading, u, v):
    radius, soft = table[lamp, _REACH], table[lamp, _FLAG]
    squared = dot(way, way)
    distance = np.sqrt(squared)
    axis = divided(way, distance) if distance > 0 else (0.0, 0.0, 1.0)
    if radius == 0:
        factor = 1 / (_QUARTER_SPHERE * squared) if distance > 0 else 0.0
        return axis, distance, factor * _attenuation(table, lamp, axis) if table[lamp, _SPOT] else factor
    if not soft and distance <= radius:
        ahead, density = cosine_direction(shading, u, v)
        along = dot(way, ahead)
        reached = along + np.sqrt(np.maximum(radius * radius - dot(way, way) + along * along, 0.0))
        return ahead, reached, table[lamp, _RADIANCE] / np.maximum(density, _LEAST_DENSITY)
    radius_squared, squared = radius * radius, distance * distance
    to_edge = squared + (radius_squared if soft else 0.0)
    spread, factor = 0.0, 0.0
    if to_edge > 0:
        spread = _one_minus_cosine(np.minimum(radius_squared / to_edge, 1.0))
        factor = 1 / ((2 - spread) * (2 * np.pi * to_edge))
    if not soft and table[lamp, _SPOT] and table[lamp, _OPENING] < spread:
        ahead, _ = _within_cone(_vector(table, lamp, _AXIS), table[lamp, _OPENING], u, v)
        along = dot(way, ahead)
        root = radius * radius - (dot(way, way) - along * along)
        hit = root >= 0 and along > 0
        reached = along - np.sqrt(np.maximum(root, 0.0))
        factor = hit * table[lamp, _RADIANCE] * (2 * np.pi * table[lamp, _OPENING])
        return ahead, reached, factor * _attenuation(table, lamp, ahead)
    ahead, short = _within_cone(axis, spread, u, v)
    along = distance * (1 - short)
    if soft:
        reached = np.minimum(np.fmax(squared / along, 0.0), _LARGEST)
    else:
        reached = along - np.sqrt(np.maximum(radius_squared - squared * short * (2 - short), 0.0))
    return ahead, reached, factor * _attenuation(table, lamp, ahead) if table[lamp, _SPOT] else factor


@inlined
def _by_area(table, lamp, way, across, along):
    """plates._by_area."""
    first, second = (
        scaled(_vector(table, lamp, _FIRST), table[lamp, _ACROSS] * across),
        scaled(_vector(table, lamp, _SECOND), table[lamp, _ALONG] * along),
    )
    to = sum_of(sum_of(way, first), second)
    squared = dot(to, to)
    distance = np.sqrt(squared)
    to = divided(to, distance)
    factor = dot(_vector(table, lamp, _NORMAL), to) / squared
    return to, distance, np.fmax(factor * (-1 / np.pi), 0.0)


@inlined
def _by_angle(table, lamp, way, u, v):
    """plates._by_angle: also the coordinates along the half sides."""
    first, second, normal = _vector(table, lamp, _FIRST), _vector(table, lamp, _SECOND), _vector(table, lamp, _NORMAL)
    across, along, depth = dot(first, way), dot(second, way), dot(normal, way)
    x, y, solid_angle = _on_rectangle(
        across - table[lamp, _ACROSS],
        across + table[lamp, _ACROSS],
        along - table[lamp, _ALONG],
        along + table[lamp, _ALONG],
        depth,
        u,
        v,
    )
    distance = np.sqrt(x * x + y * y + depth * depth)
    ahead = divided(sum_of(sum_of(scaled(first, x), scaled(second, y)), scaled(normal, depth)), distance)
    factor = solid_angle * table[lamp, _RADIANCE] if depth < 0 else 0.0
    return ahead, distance, factor, (x - across) / table[lamp, _ACROSS], (y - along) / table[lamp, _ALONG]


@inlined
def _on_rectangle(x0, x1, y0, y1, depth, u, v):
    """plates.on_rectangle."""
    squared = depth * depth
    bottom, right = -y0 / np.sqrt(squared + y0 * y0), x1 / np.sqrt(squared + x1 * x1)
    top, left = y1 / np.sqrt(squared + y1 * y1), -x0 / np.sqrt(squared + x0 * x0)
    behind = arcsine(top * left) + arcsine(left * bottom)
    solid_angle = arcsine(bottom * right) + arcsine(right * top) + behind
    cosine, sine = turned((u * solid_angle - behind) / (2 * np.pi))
    rest = cosine * bottom + top
    slope = np.sqrt(np.maximum(rest * rest - sine * sine * (squared / (squared + y0 * y0)), 0.0))
    x = np.minimum(np.fmax(np.copysign(depth, rest) * sine / slope, x0), x1)
    squared = x * x + squared
    low, high = y0 / np.sqrt(squared + y0 * y0), y1 / np.sqrt(squared + y1 * y1)
    elevation = low + v * (high - low)
    y = np.minimum(np.fmax(elevation * np.sqrt(squared / np.maximum(1 - elevation * elevation, 0.0)), y0), y1)
    return x, y, np.fmax(solid_angle, 0.0)


@inlined
def _sample_rectangle(table, lamp, way, u, v):
    squared = dot(way, way)
    apart = (
        abs(dot(_vector(table, lamp, _FIRST), way)) * table[lamp, _ACROSS]
        + abs(dot(_vector(table, lamp, _SECOND), way)) * table[lamp, _ALONG]
    )
    near = apart > _SLANT * squared or squared < (_FAR * max(table[lamp, _ACROSS], table[lamp, _ALONG])) ** 2
    if near and not table[lamp, _FLAG]:
        ahead, distance, factor, _, _ = _by_angle(table, lamp, way, u, v)
        if factor >= _SMALLEST_ANGLE * table[lamp, _RADIANCE]:
            return ahead, distance, factor
    return _by_area(table, lamp, way, 2 * u - 1, 2 * v - 1)


@inlined
def _sample_ellipse(table, lamp, way, u, v):
    if dot(way, way) < (_FAR * table[lamp, _ACROSS]) ** 2:
        ahead, distance, factor, across, along = _by_angle(table, lamp, way, u, v)
        return ahead, distance, factor if across * across + along * along <= 1 else 0.0
    radius = np.sqrt(u)
    x, y = turned(v)
    return _by_area(table, lamp, way, radius * x, radius * y)


@inlined
def sample_object(shapes, densities, primitives, reached, last, number, position, part, u, v):
    """A direction to a shining object, how far off, the density by solid angle, and which of its triangles."""
    picked = min(np.searchsorted(reached, number + part, side="right"), last[number])
    far = np.sqrt(u)
    along = far * v
    across = far - along
    to = (
        shapes[0, picked] + shapes[3, picked] * across + shapes[6, picked] * along - position[0],
        shapes[1, picked] + shapes[4, picked] * across + shapes[7, picked] * along - position[1],
        shapes[2, picked] + shapes[5, picked] * across + shapes[8, picked] * along - position[2],
    )
    squared = dot(to, to)
    distance = np.sqrt(squared)
    ahead = divided(to, distance)
    facing = abs(shapes[9, picked] * ahead[0] + shapes[10, picked] * ahead[1] + shapes[11, picked] * ahead[2])
    return ahead, distance, np.fmax(densities[primitives[picked]] * squared / facing, 0.0), picked


@inlined
def over(density):
    """What a shining triangle's colour is multiplied with."""
    return 1 / density if density > _NO_DENSITY else 0.0
