"""PNGs in and out, OpenCV beside: all filters of the format, all kinds of grays and colors, and damaged files."""

import random
import struct
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon import png

KINDS = {(1, 8): 0, (2, 8): 4, (3, 8): 2, (4, 8): 6, (1, 16): 0, (3, 16): 2, (4, 16): 6}
"""(channels, bits) → the kind of color."""


def chunk(name, data):
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def filtered(pixels, filters):
    """A PNG each row of which has the filter that is named, by the specification's section 9.2."""
    height, width, channels = pixels.shape
    step = channels * pixels.itemsize
    raw = pixels.astype(pixels.dtype.newbyteorder(">")).view(np.uint8).reshape(height, -1).astype(int)
    rows, above = [], np.zeros(width * step, int)
    for row, number in zip(raw, filters, strict=True):
        left, corner = (np.concatenate([np.zeros(step, int), each[:-step]]) for each in (row, above))
        p = left + above - corner
        to_left, to_above, to_corner = np.abs(p - left), np.abs(p - above), np.abs(p - corner)
        nearest = (to_left <= to_above) & (to_left <= to_corner)
        paeth = np.where(nearest, left, np.where(to_above <= to_corner, above, corner))
        guess = [0 * row, left, above, (left + above) // 2, paeth][number]
        rows.append(bytes([number]) + ((row - guess) & 255).astype(np.uint8).tobytes())
        above = row
    header = struct.pack(">IIBBBBB", width, height, 8 * pixels.itemsize, KINDS[channels, 8 * pixels.itemsize], 0, 0, 0)
    data = zlib.compress(b"".join(rows))
    half = len(data) // 2
    parts = (b"IHDR", header), (b"tEXt", b"a\0b"), (b"IDAT", data[:half]), (b"IDAT", data[half:]), (b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunk(*part) for part in parts)


@given(
    st.sampled_from(sorted(KINDS)), st.integers(1, 7), st.lists(st.integers(0, 4), min_size=1, max_size=8), st.integers(0, 99)
)
def test_every_filter_is_undone_as_opencv_undoes_it(kind, width, filters, seed):
    cv2 = pytest.importorskip("cv2")
    channels, bits = kind
    shape = (len(filters), width, channels)
    pixels = np.random.default_rng(seed).integers(0, 2**bits, shape).astype(f"u{bits // 8}")
    content = filtered(pixels, filters)
    decoded = png.decoded(content)
    assert decoded.dtype == pixels.dtype and np.array_equal(decoded, pixels)
    if channels != 2:
        theirs = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED).reshape(shape)
        order = {1: [0], 3: [2, 1, 0], 4: [2, 1, 0, 3]}[channels]
        assert np.array_equal(decoded, theirs[..., order])


@pytest.mark.parametrize("shape", [(5, 7), (5, 7, 3), (5, 7, 4)])
@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_our_own_come_back(shape, kind):
    pixels = np.random.default_rng(1).integers(0, np.iinfo(kind).max, shape, dtype=kind, endpoint=True)
    assert np.array_equal(png.decoded(png.encoded(pixels)).reshape(shape), pixels)


def test_what_is_damaged_or_another_png_is_a_value_error():
    whole = filtered(np.arange(48, dtype=np.uint8).reshape(4, 4, 3), [0, 1, 3, 4])
    palette = png.encoded(np.zeros((4, 4), np.uint8), bytes(6))
    for content in (b"", b"no picture", palette, whole[:20], *(whole[:cut] for cut in range(8, len(whole) - 12, 7))):
        with pytest.raises(ValueError):
            png.decoded(content)
    largest = whole[:16] + b"\xff" * 8 + whole[24:]
    with pytest.raises(ValueError):
        png.decoded(largest)
    dice = random.Random(1)
    for _ in range(500):
        mutant = bytearray(whole)
        for _ in range(dice.randint(1, 4)):
            mutant[dice.randrange(len(mutant))] = dice.randrange(256)
        try:
            decoded = png.decoded(bytes(mutant))
        except ValueError:
            continue
        assert decoded.ndim == 3 and decoded.nbytes < 10**6
