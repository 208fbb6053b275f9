"""Linux on arm64, under qemu: the same bits as here. `make test-arm64`."""

import json
from pathlib import Path

import pytest

pytestmark = [pytest.mark.platforms, pytest.mark.timeout(3600)]
HASHES = Path(__file__).with_name("picture_hashes.py")


def test_every_sample_scene_has_the_same_bits_at_all_levels(run_emulated, sample_scenes, hashes_here):
    there = json.loads(run_emulated("linux-arm64", HASHES, "2", *sample_scenes).splitlines()[-1])
    assert there.keys() == hashes_here.keys()
    assert {name.split()[1] for name in there if not name.startswith("function")} == {"geometry", "direct", "path"}
    assert {name.split()[0] for name in there} >= {path.stem for path in sample_scenes}
    different = [name for name in there if there[name] != hashes_here[name]]
    assert not different, f"{len(different)} of {len(there)} are different: {different}"


def test_the_functions_are_as_right_as_here(run_emulated):
    printed = run_emulated("linux-arm64", "-m", "pytest", "-q", "-p", "no:cacheprovider", "tests/tracer/test_trig.py")
    assert " passed" in printed and "failed" not in printed, printed
