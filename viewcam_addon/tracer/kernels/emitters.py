"""The kernel of light/emitters.py: one emitter for each point."""

import numpy as np

from ..light import emitters as plain
from .lamps import OBJECT, colour_of, estimate, kind_of, limited, over, sample, sample_object, table_of
from .packets import kernel
from .vectors import dot, inlined, put, scaled, taken

_LONGEST_ODDS, _BELOW_1 = plain.LONGEST_ODDS, plain.BELOW_1
_NONE = np.empty(0)


@inlined
def _by_estimate(table, estimates, position, normal, u):
    """Emitters._choose where there are few."""
    total = 0.0
    for lamp in range(len(table)):
        estimates[lamp] = estimate(table, lamp, position, normal)
        total = total + estimates[lamp] if lamp else estimates[lamp]
    wanted = u * total
    which, share, before, reached = 0, estimates[0], 0.0, estimates[0]
    for lamp in range(1, len(table)):
        if wanted >= reached:
            which += 1
            share, before = estimates[lamp], reached
        reached += estimates[lamp]
    odds = np.minimum(total / share, _LONGEST_ODDS) if share > 0 else 0.0
    return which, odds, np.fmin((wanted - before) / share, _BELOW_1)


@inlined
def _by_chance(chances, reached, u):
    """Emitters._choose where there are many."""
    which = np.searchsorted(reached, u, side="right")
    chance = chances[which]
    return which, 1 / chance, np.minimum(np.maximum((u - (reached[which] - chance)) / chance, 0.0), _BELOW_1)


@kernel
def _aim(table, chances, reached_chances, objects, positions, normals, shadings, u, number, directions, distances, light, pdf):
    shapes, densities, primitives, reached, last, colours = objects
    count = len(table)
    first_object = count - len(last)
    estimates = np.empty(count)
    for point in range(positions.shape[1]):
        position, normal = taken(positions, point), taken(normals, point)
        which, odds, rest = 0, 1.0, u[0, point]
        if chances.size:
            which, odds, rest = _by_chance(chances, reached_chances, u[0, point])
        elif count > 1:
            which, odds, rest = _by_estimate(table, estimates, position, normal, u[0, point])
        if kind_of(table, which) == OBJECT:
            ahead, distance, density, picked = sample_object(
                shapes, densities, primitives, reached, last, which - first_object, position, rest, u[1, point], u[2, point]
            )
            colour, factor = taken(colours, picked), over(density)
        else:
            ahead, distance, factor = sample(table, which, position, taken(shadings, point), u[1, point], u[2, point])
            colour, factor, density = colour_of(table, which), limited(factor), np.inf
        brought = scaled(colour, factor)
        if count > 1:
            brought = scaled(brought, odds)
            density = density / odds if odds > 0 else np.inf
        put(directions, point, ahead)
        put(light, point, brought)
        distances[point], pdf[point], number[point] = distance, density, which


@kernel
def _find_brightest(table, positions, normals, brightest):
    for point in range(brightest.size):
        position, normal = taken(positions, point), taken(normals, point)
        most = 0.0
        for lamp in range(len(table)):
            most = max(most, estimate(table, lamp, position, normal))
        brightest[point] = most


def brightest_of(emitters, points):
    brightest = np.empty(points.count)
    _find_brightest(_rows(emitters), points.position, points.normal, brightest)
    return brightest


@kernel
def _aim_at(table, lamp, worth, positions, normals, shadings, u, brightest, directions, distances, light):
    """Emitters._aim_at."""
    nothing = (0.0, 0.0, 0.0)
    for point in range(distances.size):
        position = taken(positions, point)
        chance = np.minimum(estimate(table, lamp, position, taken(normals, point)) / (brightest[point] * worth), 1.0)
        if u[0, point] < chance:
            ahead, distance, factor = sample(table, lamp, position, taken(shadings, point), u[1, point], u[2, point])
            brought = scaled(colour_of(table, lamp), limited(factor))
            put(directions, point, ahead)
            put(light, point, scaled(brought, np.minimum(1.0 / chance, _LONGEST_ODDS)))
            distances[point] = distance
        else:
            put(directions, point, nothing)
            put(light, point, nothing)
            distances[point] = 1.0


def _rows(emitters):
    if emitters.rows is None:
        emitters.rows = table_of(emitters.lamps, emitters.glowing)
    return emitters.rows


def aimed(emitters, points, u, lamp=None, brightest=None):
    glowing = emitters.glowing
    if glowing.count and not glowing.plain:  # what textures make of each point is no loop
        return plain.aimed.plain(emitters, points, u, lamp, brightest)
    if lamp is not None:
        directions, light = np.empty((2, 3, points.count))
        distances, pdf = np.empty(points.count), np.broadcast_to(np.inf, points.count)
        given = points.position, points.normal, points.shading, u, brightest
        _aim_at(_rows(emitters), lamp, emitters.worth(lamp), *given, directions, distances, light)
        return plain.Aimed(directions, distances, light, pdf, np.broadcast_to(emitters.shadowed[lamp], points.count))
    objects = _NO_OBJECTS
    if glowing.count:
        objects = (glowing.shapes, glowing.densities, glowing.primitives, glowing.reached, glowing.last, glowing.colours)
    chances, reached = (_NONE, _NONE) if emitters.chances is None else (emitters.chances, emitters.reached)
    count = points.count
    number = np.empty(count, np.intp)
    directions, light = np.empty((2, 3, count))
    distances, pdf = np.empty((2, count))
    given = points.position, points.normal, points.shading, u
    _aim(_rows(emitters), chances, reached, objects, *given, number, directions, distances, light, pdf)
    shadowed = np.broadcast_to(True, count) if emitters.shadowed.all() else emitters.shadowed[number]
    return plain.Aimed(directions, distances, light, pdf, shadowed)


@kernel
def _receive(normals, shadings, directions, pdf, share, weighed, factors, bright):
    """Write which of the points may be lit; how many they are."""
    count = 0
    for point in range(factors.size):
        ahead = taken(directions, point)
        factor = dot(taken(shadings, point), ahead) / np.pi
        lit = factor > 0 and dot(taken(normals, point), ahead) > 0
        if weighed:
            ratio = np.fmax(share[point] * factor / pdf[point], 0.0)
            factor *= 1.0 / (1.0 + ratio * ratio)
        factors[point] = factor
        if lit:
            bright[count] = point
            count += 1
    return count


def received(points, aimed, share, weighed):
    factors, bright = np.empty(points.count), np.empty(points.count, np.intp)
    of_ways = _NONE if not weighed else aimed.pdf
    count = _receive(points.normal, points.shading, aimed.direction, of_ways, share, weighed, factors, bright)
    return factors, slice(None) if count == len(bright) else bright[:count]


_NO_OBJECTS = (np.empty((12, 0)), _NONE, np.empty(0, np.intp), _NONE, np.empty(0, np.intp), np.empty((3, 0)))
