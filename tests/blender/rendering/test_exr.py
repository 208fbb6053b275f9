"""A file that Blender wrote is whole or is seen not to be; attributes can be taken out of it, and nothing else."""

import os
import subprocess
import sys

import numpy as np
import pytest

from viewcam_addon.blender.rendering.exr import is_whole, strip
from viewcam_addon.image import Image, read, write


@pytest.fixture(params=[1, 15, 16, 17, 100])
def picture(request, tmp_path):
    """An EXR of one part, with as many rows."""
    noise = np.random.default_rng(1).random((request.param, 50, 1), np.float32)
    write(tmp_path / "picture.exr", Image({"Depth": noise}))
    return tmp_path / "picture.exr"


def test_a_whole_file_is_whole(picture):
    assert is_whole(picture)


def test_a_file_cut_short_is_not(picture):
    content = picture.read_bytes()
    for share in (0.0, 0.01, 0.1, 0.3, 0.9, 0.999):
        picture.write_bytes(content[: int(len(content) * share)])
        assert not is_whole(picture), f"{share} of the file"


def test_a_chunk_that_was_never_written_is_missed(picture):
    """OpenEXR leaves such a chunk behind on a full disk: its offset in the table is 0."""
    content = bytearray(picture.read_bytes())
    chunks = read(picture).size[1]  # of one row each, as RLE has them
    # The table ends where the first chunk begins, and its first entry says so.
    table = next(at for at in range(len(content)) if int.from_bytes(content[at : at + 8], "little") == at + 8 * chunks)
    content[table : table + 8] = bytes(8)
    picture.write_bytes(content)
    assert not is_whole(picture)


def test_what_is_no_exr_is_not_whole(tmp_path):
    (tmp_path / "text").write_text("nothing of the kind, but long enough for a header and more")
    assert not is_whole(tmp_path / "text") and not is_whole(tmp_path / "missing")


PARTS = """
import sys, numpy as np, OpenEXR
noise = np.random.default_rng(2).random((40, 30), np.float32)
parts = [
    OpenEXR.Part({"Date": "yesterday", "Note": name, "type": OpenEXR.scanlineimage}, {f"{name}.Z": noise + i}, name)
    for i, name in enumerate(sys.argv[2:])
]
OpenEXR.File(parts).write(sys.argv[1])
"""
TOLD = """
import sys, hashlib, OpenEXR
for part in OpenEXR.File(sys.argv[1], separate_channels=True).parts:
    print(sorted(set(part.header) & {"Date", "Note"}), *(hashlib.md5(c.pixels).hexdigest() for c in part.channels.values()))
"""


def outside(program, *arguments):
    """The text that a program prints that uses OpenEXR, in a process without Blender."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    return subprocess.run(
        [sys.executable, "-c", program, *map(str, arguments)], env=environment, check=True, text=True, capture_output=True
    ).stdout


@pytest.mark.parametrize("names", [["one"], ["one", "two", "three"]])
def test_an_attribute_is_taken_out_of_each_part_and_no_pixel_changes(tmp_path, names):
    path = tmp_path / "parts.exr"
    outside(PARTS, path, *names)
    before, size = outside(TOLD, path), path.stat().st_size
    strip(path, lambda name: name == "Date")
    assert outside(TOLD, path) == before.replace("'Date', ", "")
    # Name, type, size and value, the first two with a zero at their ends.
    assert size - path.stat().st_size == len(names) * len(b"Date\0string\0....yesterday")
    assert is_whole(path)


def test_what_is_unwanted_by_nobody_stays_byte_for_byte(picture):
    before = picture.read_bytes()
    strip(picture, lambda name: name == "Nothing")
    assert picture.read_bytes() == before
