"""A picture in tiles over threads, watched and stopped by whoever waits for it.

Each pixel is computed by itself, so that threads and tiles change no bit of the result.
"""

import contextvars
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

Passes = dict[str, NDArray[np.float32]]
"""Pass name → (height, width, channels)."""

# Seconds between two questions whether to stop while tiles are traced.
_ASKED_EVERY = 0.05

Tile = TypeVar("Tile")


class Stopped(Exception):
    """A render ended before its time because its watcher said so."""


class Watcher(Protocol):
    """Whoever waits for a picture."""

    def tile(self, passes: Passes, rows: range) -> None:
        """Some rows are finished. passes : the whole picture's. Called in the thread that called the renderer."""

    def stop(self) -> bool:
        """True if rendering is to stop. Asked often, by any thread."""


class Progress:
    """A watcher that tells `progress`, with the share of the rows that are done, at each whole percent.

    tell : called with the event's name and fields.
    rows : the number of the picture's rows.
    """

    def __init__(self, tell: Callable[..., None], rows: int) -> None:
        self._tell, self._done, self._percent = tell, bytearray(rows), 0
        tell("progress", share=0.0)

    def tile(self, passes: Passes, rows: range) -> None:
        self._done[rows.start : rows.stop] = b"\1" * len(rows)
        percent = 100 * sum(self._done) // len(self._done)
        if percent > self._percent:
            self._percent = percent
            self._tell("progress", share=percent / 100)

    def stop(self) -> bool:
        return False


def over_threads(
    work: Callable[[Tile], None], tiles: Iterable[Tile], threads: int, ask: Callable[[], None], give_up: Callable[[], None]
) -> Iterator[Tile]:
    """Call `work` with each tile, in some thread and this one's context; the tiles that are done.

    ask : called every so often; what it raises ends the work.
    give_up : called before what `ask` or `work` raises is raised here, so that those that are under way end soon; this is when
        they have ended, and the others are not begun.
    """
    with ThreadPoolExecutor(threads) as pool:
        under_way: dict[Future, Tile] = {}
        try:
            for tile in tiles:
                under_way[pool.submit(contextvars.copy_context().run, work, tile)] = tile
                if len(under_way) > 2 * threads:
                    yield from _done(under_way, ask)
            while under_way:
                yield from _done(under_way, ask)
        except BaseException:
            give_up()
            raise
        finally:
            pool.shutdown(cancel_futures=True)


def _done(under_way: "dict[Future, Tile]", ask: Callable[[], None]) -> list[Tile]:
    while not (done := wait(under_way, _ASKED_EVERY, FIRST_COMPLETED).done):
        ask()
    for future in done:
        future.result()
    return [under_way.pop(future) for future in done]
