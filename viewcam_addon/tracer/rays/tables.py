"""How the tables of a scene are filled: some thousand entries at a time, over threads, and no sooner than they are needed.

What one step of NumPy leaves, the next one still finds in a core's cache. Many small objects are filled together, since a call
of NumPy takes as long as some hundred of its numbers; a large one is filled in pieces. Each entry is computed alone, so that it
is the same however the work is cut.
"""

import contextvars
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..scene import Mesh, Object, Spheres
from .view import View

AT_A_TIME = 16384
"""Entries."""

Things = Sequence[tuple[Object, Mesh | Spheres]]
"""Objects with their geometries."""

Piece = tuple[int, slice]
"""Of an object, by its number, some of its vertices or triangles."""


class made_once:
    """An attribute that is made when it is first asked for, by one thread while the others wait."""

    def __init__(self, make: Callable[[Any], Any]) -> None:
        self._make, self.__doc__ = make, make.__doc__
        self._lock = threading.RLock()

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, instance: object | None, owner: type | None = None) -> Any:
        if instance is None:
            return self
        with self._lock:
            if self._name not in vars(instance):
                vars(instance)[self._name] = self._make(instance)
        return vars(instance)[self._name]


def parts(count: int) -> list[slice]:
    """So many entries, `AT_A_TIME`."""
    return [slice(first, min(first + AT_A_TIME, count)) for first in range(0, count, AT_A_TIME)]


def pieces(counts: Sequence[int]) -> Iterator[tuple[slice, list[Piece]]]:
    """The entries of all objects, one object after the other, `AT_A_TIME` at most: which of all, and of which objects.

    counts : how many entries each object has.
    """
    some, begin, end = [], 0, 0
    for number, count in enumerate(counts):
        for first in range(0, count, AT_A_TIME):
            more = min(AT_A_TIME, count - first)
            if end - begin + more > AT_A_TIME:
                yield slice(begin, end), some
                some, begin = [], end
            some.append((number, slice(first, first + more)))
            end += more
    if some:
        yield slice(begin, end), some


def joined(arrays: Sequence[NDArray], some: list[Piece]) -> NDArray:
    """The entries of some objects, (n, …). arrays : one for each object."""
    parts = [arrays[number][part] for number, part in some]
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def spread(values: NDArray, some: list[Piece]) -> NDArray:
    """What objects have, for each of the entries of some: (…, n), or (…, 1) where all are of one object.

    values : (…, objects).
    """
    numbers = [number for number, _ in some]
    if len(numbers) == 1:
        return values[..., numbers]
    return np.repeat(values[..., numbers], [part.stop - part.start for _, part in some], axis=-1)


def matrices(things: Things) -> Floats:
    """(3, 4, objects), to world space."""
    return np.array([placed.matrix[:3] for placed, _ in things]).reshape(-1, 3, 4).transpose(1, 2, 0)


def in_camera_space(things: Things, points: Sequence[Floats], view: View, threads: int = 1) -> Floats:
    """(3, n): the points of all objects. points : those of each, (k, 3), object space."""
    counts = [len(some) for some in points]
    places, placing = np.empty((3, sum(counts))), matrices(things)

    def fill(part: tuple[slice, list[Piece]]) -> None:
        where, some = part
        places[:, where] = view.points(spread(placing, some), joined(points, some))

    each(fill, pieces(counts), threads)
    return places


def by_material(things: Things, values: Sequence[Sequence], kind: type) -> NDArray:
    """(n,): what the materials of all triangles or spheres have. values : for each object, of each of its materials."""
    first = np.cumsum([0, *(len(some) for some in values)])[:-1]
    flat = np.array([value for some in values for value in some], kind)
    materials = [geometry.materials for _, geometry in things]
    counts = [len(some) for some in materials]
    found = np.empty(sum(counts), kind)
    for where, some in pieces(counts):
        found[where] = flat.take(joined(materials, some) + spread(first, some))
    return found


def each(work: Callable, items: Iterable, threads: int) -> list:
    """What `work` makes of each item, over threads with this one's context."""
    items = list(items)
    if threads == 1 or len(items) < 2:
        return [work(item) for item in items]
    with ThreadPoolExecutor(threads, "viewcam") as pool:
        return [made.result() for made in [pool.submit(contextvars.copy_context().run, work, item) for item in items]]
