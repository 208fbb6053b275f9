"""The tests of viewcam_addon/blender once more, inside a real Blender: its own Python, its own NumPy, no wheel of bpy."""

import re


def test_the_tests_of_blender_pass_inside_it(real_blender, packages):
    said = real_blender.run_inside("pytest", packages, "-q", "-p", "no:cacheprovider", "tests/blender")
    summary = said.strip().splitlines()[-1]
    print(summary)
    assert re.search(r"\d+ passed", summary), said
