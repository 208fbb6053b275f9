"""Whatever disturbs a batch, nothing is lost: `blender -b FILE --command viewcam batch` (disturbed.py)."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent.parent))
import disturbed


class TestRealBlender(disturbed.Disturbances):
    @pytest.fixture(scope="class")
    @classmethod
    def blender(cls, real_blender):
        def command(shots: Path) -> disturbed.Command:
            words = [*real_blender.command, "-b", disturbed.STUDIO, "--command", "viewcam", "batch", shots]
            return disturbed.Command(words, {"BLENDER_USER_RESOURCES": str(real_blender.user_folder)})

        return command
