"""A PNG that Blender wrote is whole or is seen not to be; its texts can be taken out, and nothing else."""

import struct
import zlib

import pytest

from viewcam_addon.png import is_whole, strip


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


HEADER = chunk(b"IHDR", struct.pack(">IIBBBBB", 1, 1, 8, 2, 0, 0, 0))
PIXELS = chunk(b"IDAT", zlib.compress(b"\0\1\2\3"))
END = chunk(b"IEND", b"")
TEXTS = [chunk(b"tEXt", b"Date\x00yesterday"), chunk(b"tIME", bytes(7)), chunk(b"iTXt", b"RenderTime"), chunk(b"zTXt", b"File")]


@pytest.fixture
def png(tmp_path):
    """A function: chunks → the path of a PNG of them."""

    def write(*chunks):
        path = tmp_path / "picture.png"
        path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(chunks))
        return path

    return write


def test_texts_and_times_are_taken_out_and_all_else_stays(png):
    expected = png(HEADER, PIXELS, END).read_bytes()
    path = png(TEXTS[0], HEADER, TEXTS[1], PIXELS, *TEXTS[2:], END)
    strip(path)
    assert path.read_bytes() == expected


def test_a_whole_file_is_whole_and_any_part_of_it_is_not(png):
    path = png(HEADER, TEXTS[0], PIXELS, END)
    content = path.read_bytes()
    assert is_whole(path)
    for length in range(len(content)):
        path.write_bytes(content[:length])
        assert not is_whole(path), f"{length} of {len(content)} bytes"


def test_what_is_no_png_is_not_whole(png, tmp_path):
    path = png(HEADER, END)
    path.write_bytes(b"GIF89a.." + path.read_bytes()[8:])
    assert not is_whole(path) and not is_whole(tmp_path / "missing.png")
