"""The marks of a verdict, in colors that Blender's own icons lack: a green tick, two amber waves, a red cross."""

import itertools

import bpy
import bpy.utils.previews
import numpy as np

from ...comparison.answer import DIFFERENT, SAME, SAME_BUT

_SIZE = 32
_THICK = 2.6
_WAVE = [(5.0 + 2.0 * i, 3.0 * float(np.sin(i * np.pi / 5.5))) for i in range(12)]
# The color of each answer, and its strokes: corners in pixels from the lower left.
_MARKS = {
    SAME: ((0.24, 0.78, 0.36), [[(5.0, 16.0), (12.5, 8.5), (27.0, 24.0)]]),
    SAME_BUT: ((0.95, 0.65, 0.15), [[(x, y + middle) for x, y in _WAVE] for middle in (11.0, 21.0)]),
    DIFFERENT: ((0.93, 0.30, 0.26), [[(7.0, 7.0), (25.0, 25.0)], [(7.0, 25.0), (25.0, 7.0)]]),
}

_previews = None


def mark(answer: str) -> int:
    """The number of an answer's icon, for `icon_value`."""
    global _previews
    if _previews is None:
        _previews = bpy.utils.previews.new()
    if answer not in _previews:
        preview = _previews.new(answer)
        preview.icon_size = _SIZE, _SIZE
        preview.icon_pixels_float.foreach_set(_drawn(*_MARKS[answer]).ravel())
    return _previews[answer].icon_id


def forget() -> None:
    """Give them back to Blender."""
    global _previews
    if _previews is not None:
        bpy.utils.previews.remove(_previews)
    _previews = None


def _drawn(color: tuple[float, float, float], strokes: list[list[tuple[float, float]]]) -> np.ndarray:
    """(size, size, 4) float32, with soft edges."""
    pixels = np.stack(np.meshgrid(np.arange(_SIZE), np.arange(_SIZE)), axis=-1) + 0.5
    distance = np.full((_SIZE, _SIZE), np.inf)
    for start, end in (pair for corners in strokes for pair in itertools.pairwise(corners)):
        along = np.subtract(end, start)
        share = np.clip((pixels - start) @ along / (along @ along), 0.0, 1.0)
        distance = np.minimum(distance, np.linalg.norm(pixels - start - share[..., None] * along, axis=-1))
    drawn = np.empty((_SIZE, _SIZE, 4), np.float32)
    drawn[..., 3] = np.clip(_THICK + 0.5 - distance, 0.0, 1.0)
    drawn[..., :3] = np.array(color) * drawn[..., 3:]  # as Blender has it where a picture is see-through
    return drawn
