"""Linux on arm64, under qemu: the same bits as here. `make test-arm64`."""

import pytest

pytestmark = [pytest.mark.platforms, pytest.mark.timeout(3600)]


def test_every_sample_scene_has_the_same_bits_at_all_levels(sample_scenes, hashes_here, hashes_there):
    there = hashes_there("linux-arm64", 2, sample_scenes)
    assert there.keys() == hashes_here.keys()
    assert {name.split()[1] for name in there if not name.startswith("function")} == {"geometry", "direct", "path"}
    assert {name.split()[0] for name in there} >= {path.stem for path in sample_scenes}
    different = [name for name in there if there[name] != hashes_here[name]]
    assert not different, f"{len(different)} of {len(there)} are different: {different}"


def test_the_functions_are_as_right_as_here(run_emulated):
    printed = run_emulated("linux-arm64", "-m", "pytest", "-q", "-p", "no:cacheprovider", "tests/tracer/test_trig.py")
    assert " passed" in printed and "failed" not in printed, printed
