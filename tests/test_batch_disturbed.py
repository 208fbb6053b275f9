"""Criterion of every batch: whatever disturbs it, nothing is lost. `viewcam batch` with the wheel of Blender (disturbed.py).

The comparison of two folders on which that stands sees what it is there to see.
"""

import json
import os
import signal
import sys
from pathlib import Path

import pytest

pytest.importorskip("bpy")
if sys.platform == "win32":
    pytest.skip("processes are killed and interrupted here as POSIX has it", allow_module_level=True)

sys.path.insert(0, str(Path(__file__).parent))
import disturbed
from disturbed import assert_same


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


@pytest.mark.exhaustive
class TestWheel(disturbed.Disturbances):
    KILLS = 8  # the fifth at the start

    @pytest.fixture(scope="class")
    @classmethod
    def blender(cls):
        def command(shots: Path) -> disturbed.Command:
            words = [sys.executable, "-m", "viewcam_addon", "batch", disturbed.STUDIO, shots]
            return disturbed.Command(words, {"PYTHONPATH": str(disturbed.ROOT)})

        return command

    @pytest.mark.exhaustive
    @pytest.mark.skipif(sys.platform != "linux", reason="the process in which Blender runs is found as Linux has it")
    def test_a_blender_that_crashes_is_told_and_resume_renders_what_is_left(self, command, undisturbed, tmp_path):
        with command.start(tmp_path) as batch:
            batch.until("shot_done")
            (blender,) = Path(f"/proc/{batch.process.pid}/task/{batch.process.pid}/children").read_text().split()
            os.kill(int(blender), signal.SIGSEGV)
            status, events = batch.end()
        entries = [event["text"] for event in events if event["event"] == "error"]
        assert status == 2 and len(entries) == 1 and "Blender has ended with SIGSEGV at " in entries[0], (status, events)
        assert 1 <= len(list(tmp_path.glob("shot_*.json"))) < 6
        assert command.run(tmp_path, "--resume")[0] == 0
        assert_same(tmp_path, undisturbed)
