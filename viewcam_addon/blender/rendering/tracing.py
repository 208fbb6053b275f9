"""Tracing in a thread of its own, its finished bands of rows handed over in the thread that asked.

Blender may be spoken to only in the thread in which it calls an engine: here that thread looks every few milliseconds whether
the artist canceled, while the tracer's threads know nothing of Blender. Rejected: tracing in Blender's own thread, which can't
ask for Escape before a band is finished.
"""

import contextlib
import queue
import threading
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

from ...tracer.scene import Scene
from ...tracer.tiles import Passes

if TYPE_CHECKING:
    from ...tracer.render import Keeper

_PATIENCE = 0.05
"""Seconds between two looks at whether it is canceled."""


class _Watcher:
    """The receiver of what the tracer tells and asks, from its threads."""

    def __init__(self) -> None:
        self.bands: queue.SimpleQueue[tuple[Passes, range] | None] = queue.SimpleQueue()
        self.canceled = threading.Event()

    def tile(self, passes: Passes, rows: range) -> None:
        self.bands.put((passes, rows))

    def stop(self) -> bool:
        return self.canceled.is_set()


def keeper() -> "Keeper":
    """The store in which `bands` keeps what pictures share."""
    from ...tracer.render import Keeper  # loads the tracer, which Blender's start need not wait for

    return Keeper()


def bands(
    scene: Scene,
    level: str,
    samples: int,
    seed: int,
    threads: int,
    is_canceled: Callable[[], bool],
    keeper: "Keeper | None" = None,
    steps: Sequence[int] = (),
) -> Iterator[tuple[Passes, range]]:
    """Trace a scene, and give what is finished: the passes of the whole picture, and the rows of them that are new.

    is_canceled : asked in the caller's thread. When it says so, or when the caller takes no more, tracing ends at once.
    keeper, steps : as in tracer.render.render; with steps, all rows come again at each.

    Raises
    ------
    InputError
        as tracer.render.render does.
    """
    from ...tracer.render import render

    watcher = _Watcher()
    with ThreadPoolExecutor(1, "viewcam") as pool:
        tracing = pool.submit(render, scene, level, samples, seed, threads, watcher, keeper=keeper, steps=steps)
        tracing.add_done_callback(lambda _: watcher.bands.put(None))
        try:
            while not is_canceled():
                with contextlib.suppress(queue.Empty):
                    band = watcher.bands.get(timeout=_PATIENCE)
                    if band is None:
                        break
                    yield band
            else:
                return
        finally:
            watcher.canceled.set()
            # An error's frames hold the tracer, in a circle; where Python 3.14 broke it by itself, Blender 5.2 crashed.
            if error := tracing.exception():
                traceback.clear_frames(error.__traceback__)
    tracing.result()  # raises what was raised there
