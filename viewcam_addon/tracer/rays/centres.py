"""The rays through the centres of a picture's pixels: all of a column have one x, and all of a row one y."""

import numpy as np

from ...pinhole import Pinhole
from ..arrays import Floats, Indices
from .visibility import Visibility


class Centres:
    """Those of one camera, and which of them want care.

    width : how many there are in a row.
    """

    def __init__(self, camera: Pinhole, visibility: Visibility) -> None:
        self._x, _ = camera.view_plane(np.arange(camera.width) + 0.5, 0.5)
        _, self._y = camera.view_plane(0.5, np.arange(camera.height) + 0.5)
        self.width = camera.width
        self._close = visibility.close(self._x, self._y)

    def rays(self, tile: range) -> tuple[Floats, Floats, Indices | None]:
        """The rays (x, y, 1) of a run of pixels, (n,) each, and which of them want care, if that is known."""
        first, last = tile.start // self.width, (tile.stop - 1) // self.width + 1
        part = slice(tile.start - first * self.width, tile.stop - first * self.width)
        x = np.tile(self._x, last - first)[part]
        y = np.repeat(self._y[first:last], self.width)[part]
        if self._close is None:
            return x, y, None
        begin, end = np.searchsorted(self._close, [tile.start, tile.stop])
        return x, y, self._close[begin:end] - tile.start
