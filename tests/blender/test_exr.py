"""A file that Blender wrote is whole or is seen not to be."""

import numpy as np
import pytest

from viewcam_addon.blender.exr import is_whole
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
    """What OpenEXR leaves behind on a full disk: its offset in the table is 0."""
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
