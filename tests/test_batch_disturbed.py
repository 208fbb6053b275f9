"""Criterion of every batch: whatever disturbs it, nothing is lost. `viewcam batch` with the wheel of Blender (disturbed.py)."""

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
from batch_folders import assert_same


@pytest.mark.exhaustive
class TestWheel(disturbed.Disturbances):
    KILLS = 8  # of which the fifth is at the start

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
