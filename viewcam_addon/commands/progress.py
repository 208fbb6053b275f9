"""How much of a picture is traced, told while it is."""

from typing import TYPE_CHECKING

from ..events import Events

if TYPE_CHECKING:
    from ..tracer.tiles import Passes  # brings what the other commands need not wait for


class Progress:
    """A tracer's watcher that tells `progress`, with the share of the rows that are done, at each whole percent.

    rows : how many the picture has.
    """

    def __init__(self, events: Events, rows: int) -> None:
        self._events, self._done, self._percent = events, bytearray(rows), 0
        events.tell("progress", share=0.0)

    def tile(self, passes: "Passes", rows: range) -> None:
        self._done[rows.start : rows.stop] = b"\1" * len(rows)
        percent = 100 * sum(self._done) // len(self._done)
        if percent > self._percent:
            self._percent = percent
            self._events.tell("progress", share=percent / 100)

    def stop(self) -> bool:
        return False
