"""Pythons of other platforms, emulated (.ci/emulated.py), and what this machine computes, to compare with."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / ".ci")]  # hatch_build, emulated, extension
HASHES = Path(__file__).with_name("picture_hashes.py")
LONGEST = 1500
"""Seconds: a machine of two cores that has other work, too."""


@pytest.fixture(scope="session")
def run_emulated():
    """run_emulated(platform, arguments…) → what Python printed there; fails the test if its exit status is another."""
    import emulated

    def run(platform, *arguments, status=0, **variables):
        child = emulated.start(platform, *arguments, **variables)
        printed = child.communicate(timeout=LONGEST)[0].decode("utf-8", "replace")
        assert child.returncode == status, f"status {child.returncode}: {printed}"
        return printed

    return run


@pytest.fixture(scope="session")
def sample_scenes(tmp_path_factory):
    """Scene files of all sample scenes."""
    folder = tmp_path_factory.mktemp("scenes")
    for blend in sorted((ROOT / "sample_scenes").glob("*.blend")):
        command = [sys.executable, "-m", "viewcam_addon", "export", blend, folder / f"{blend.stem}.json"]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return sorted(folder.glob("*.json"))


@pytest.fixture(scope="session")
def hashes_here(sample_scenes):
    """Hashes of the sample scenes' pictures and of the core's functions on this machine: 'scene level pass' → hash."""
    done = subprocess.run([sys.executable, HASHES, "2", *sample_scenes], check=True, capture_output=True, text=True)
    return json.loads(done.stdout)


@pytest.fixture(scope="session")
def hashes_there(run_emulated):
    """hashes_there(platform, threads, scene files): the same as hashes_here, on another platform."""

    def run(platform, threads, scenes):
        return json.loads(run_emulated(platform, HASHES, threads, *scenes).splitlines()[-1])

    return run
