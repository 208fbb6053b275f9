"""The comparison that tests of batches stand on sees what it is there to see."""

import json
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from batch_folders import assert_same


@pytest.fixture
def folders(tmp_path):
    """Two that differ in their timings only."""
    for name, seconds in (("one", 1.5), ("other", 2.5)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "a.exr").write_bytes(b"picture")
        record = {"settings": "0f", "shots": [{"name": "a", "timing": {"seconds": seconds}}], "timing": {"seconds": seconds}}
        (tmp_path / name / "a.json").write_text(json.dumps(record))
    return tmp_path / "one", tmp_path / "other"


def test_timings_do_not_count(folders):
    assert_same(*folders)


@pytest.mark.parametrize(
    "change",
    [
        lambda folder: (folder / "a.exr").write_bytes(b"pictura"),
        lambda folder: (folder / "a.json").write_text((folder / "a.json").read_text().replace("0f", "0e")),
        lambda folder: (folder / "a.json").write_text((folder / "a.json").read_text().replace('"a"', '"b"')),
        lambda folder: (folder / ".a-0123abcd.exr").touch(),
        lambda folder: (folder / "a.exr").unlink(),
    ],
    ids=["a byte", "a setting", "a name", "a leftover", "a missing file"],
)
def test_whatever_else_differs_is_seen(folders, change):
    change(folders[0])
    with pytest.raises(AssertionError):
        assert_same(*folders)
