"""A picture in tiles over threads, watched and stopped by whoever waits for it.

A tile is a run of pixels, row after row: the memory that a render takes beside the passes does not depend on the size of the
picture. Whoever computes it computes every pixel alone, so that threads and tiles change no bit of the result.
"""

import contextvars
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from typing import Protocol

import numpy as np

from .rays.surface import Passes

# The C library of Linux gives the memory of arrays back to the system as they are freed, and gets it again page by page: a
# third of the time that light takes. It keeps what is smaller than the largest piece that it ever got back, if that is less
# than 32 MiB; so it gets such a piece once.
_KEPT = 31 << 20
# So that all threads have something to do until the end.
_PER_THREAD = 4


class Stopped(Exception):
    """A render ended before its time because its watcher said so."""


class Watcher(Protocol):
    """Whoever waits for a picture."""

    def tile(self, passes: Passes, rows: range) -> None:
        """Some rows are finished. passes : the whole picture's. Called in the thread that called the renderer."""

    def stop(self) -> bool:
        """Whether to give up. Asked often, by any thread."""


def tiles(pixels: int, width: int, threads: int, smallest: int, largest: int) -> Iterator[range]:
    """Runs of pixels: whole rows where one is not too long, no more than `largest` and no fewer than `smallest` pixels."""
    size = max(smallest, min(largest, pixels // (_PER_THREAD * threads)))
    if size > width:
        size -= size % width
    return (range(first, min(first + size, pixels)) for first in range(0, pixels, size))


def over_threads(work: Callable[[range], None], tiles: Iterator[range], threads: int) -> Iterator[range]:
    """Call `work` with each tile, in some thread and this one's context; the tiles that are done.

    What `work` raises is raised here, when those that are under way have ended; the others are not begun.
    """
    np.empty(_KEPT, np.uint8)
    with ThreadPoolExecutor(threads) as pool:
        under_way = {}
        try:
            for tile in tiles:
                under_way[pool.submit(contextvars.copy_context().run, work, tile)] = tile
                if len(under_way) > 2 * threads:
                    yield from _done(under_way)
            while under_way:
                yield from _done(under_way)
        finally:
            pool.shutdown(cancel_futures=True)


def _done(under_way: dict) -> list[range]:
    done = wait(under_way, return_when=FIRST_COMPLETED).done
    for future in done:
        future.result()
    return [under_way.pop(future) for future in done]
