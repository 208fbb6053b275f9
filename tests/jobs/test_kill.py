"""A batch that dies between any two steps: the folder tells the truth, and --resume ends as if nothing had been.

Random moments, with Blender, are in tests/test_batch_disturbed.py.
"""

import json
import shutil
import subprocess
import sys

import pytest

from viewcam_addon.jobs.folder import Folder

# Two shots, of a file each to wait for, remove and rename; then the page and the summary. More than there are, see below.
STEPS = 40


@pytest.fixture(scope="module")
def folders(tmp_path_factory, painting):
    """The shots as two settings leave them."""
    folders_made = [tmp_path_factory.mktemp("old"), tmp_path_factory.mktemp("new")]
    for seed, folder in enumerate(folders_made):
        painting.paint(folder, 2, painter=painting.Painter(seed))
    return folders_made


def pictures(folder, name):
    return folder.image(name).read_bytes(), folder.preview(name).read_bytes()


@pytest.mark.exhaustive
def test_a_batch_that_dies_before_any_step_is_continued_to_the_same_bytes(tmp_path, painting, folders):
    """The shots are there already, of other settings: whatever is replaced could be taken for what it is not."""
    hashes = [painting.hashes(painting.shots(2), seed) for seed in (0, 1)]
    died, done = 0, set()
    for step in range(STEPS):
        folder = Folder(tmp_path / str(step))
        shutil.copytree(folders[0], folder.path, dirs_exist_ok=True)
        options = json.dumps({"count": 2, "seed": 1, "resume": True, "dies": step})
        outcome = subprocess.run([sys.executable, painting.__file__, folder.path, options], capture_output=True, text=True)
        if outcome.returncode == 0:
            break
        assert outcome.returncode == painting.DIED, outcome
        died += 1
        for name in hashes[0]:
            for seed, target in enumerate(folders):
                if folder.finished(name, hashes[seed][name]):
                    assert pictures(folder, name) == pictures(Folder(target), name), f"step {step}: {name} is not what it says"
                    done.add((name, seed))
        assert painting.paint(folder.path, 2, painter=painting.Painter(seed=1), resume=True).exit_status == 0
        painting.assert_same(folder.path, folders[1])
    assert outcome.returncode == 0, f"the batch has more than {STEPS} steps"
    assert died >= 2 * 8 + 4 and len(done) == 4, f"died {died} times, found {sorted(done)}"
