"""The one icon that Blender lacks: a tick that is green. Blender's own are of one colour each, and a label has no colour."""

import itertools

import bpy
import bpy.utils.previews
import numpy as np

_SIZE = 32
_GREEN = np.array([0.24, 0.78, 0.36])
_CORNERS = ((5.0, 16.0), (12.5, 8.5), (27.0, 24.0))  # of the tick, pixels from the lower left
_THICK = 2.6

_previews = None


def tick() -> int:
    """The icon's number, for `icon_value`."""
    global _previews
    if _previews is None:
        _previews = bpy.utils.previews.new()
        preview = _previews.new("tick")
        preview.icon_size = _SIZE, _SIZE
        preview.icon_pixels_float.foreach_set(_drawn().ravel())
    return _previews["tick"].icon_id


def forget() -> None:
    """Give it back to Blender."""
    global _previews
    if _previews is not None:
        bpy.utils.previews.remove(_previews)
    _previews = None


def _drawn() -> np.ndarray:
    """(size, size, 4) float32, with soft edges."""
    pixels = np.stack(np.meshgrid(np.arange(_SIZE), np.arange(_SIZE)), axis=-1) + 0.5
    distance = np.full((_SIZE, _SIZE), np.inf)
    for start, end in itertools.pairwise(_CORNERS):
        along = np.subtract(end, start)
        share = np.clip((pixels - start) @ along / (along @ along), 0.0, 1.0)
        distance = np.minimum(distance, np.linalg.norm(pixels - start - share[..., None] * along, axis=-1))
    drawn = np.empty((_SIZE, _SIZE, 4), np.float32)
    drawn[..., 3] = np.clip(_THICK + 0.5 - distance, 0.0, 1.0)
    drawn[..., :3] = _GREEN * drawn[..., 3:]  # as Blender has it where a picture is see-through
    return drawn
