"""Rays in the order of their directions, some thousand at a time, so that those of a packet keep together."""

from .packets import kernel

# Rays that are sorted at a time, and into how many cells of each half of an octahedron's shadow on a square of directions.
RAYS = 4096
_CELLS = 8
KEYS = 2 * _CELLS * _CELLS


@kernel
def _key(x, y, z):
    """Which cell of the sphere of directions this is in."""
    size = (abs(x) + abs(y) + abs(z)) * (1 + 1e-9)
    if not size > 0:
        return 0
    column, row = int((x / size + 1) * (_CELLS / 2)), int((y / size + 1) * (_CELLS / 2))
    return (_CELLS * (z > 0) + column) * _CELLS + row


@kernel
def sort(directions, begin, end, keys, places, order):
    """Some rays in the order of their directions' cells, into `order`.

    keys, order : (RAYS,) int32. places : (KEYS + 1,) int32.
    """
    places[:] = 0
    for ray in range(begin, end):
        key = _key(directions[0, ray], directions[1, ray], directions[2, ray])
        keys[ray - begin] = key
        places[key + 1] += 1
    for key in range(KEYS):
        places[key + 1] += places[key]
    for ray in range(begin, end):
        key = keys[ray - begin]
        order[places[key]] = ray
        places[key] += 1
