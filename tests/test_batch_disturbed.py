"""Criterion of every batch: whatever disturbs it, nothing is lost. `viewcam batch` with the wheel of Blender (disturbed.py)."""

import sys
from pathlib import Path

import pytest

pytest.importorskip("bpy")
if sys.platform == "win32":
    pytest.skip("processes are killed and interrupted here as POSIX has it", allow_module_level=True)

sys.path.insert(0, str(Path(__file__).parent))
import disturbed


class TestWheel(disturbed.Disturbances):
    @pytest.fixture(scope="class")
    @classmethod
    def blender(cls):
        def command(shots: Path) -> disturbed.Command:
            words = [sys.executable, "-m", "viewcam_addon", "batch", disturbed.STUDIO, shots]
            return disturbed.Command(words, {"PYTHONPATH": str(disturbed.ROOT)})

        return command
