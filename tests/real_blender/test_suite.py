"""The tests of viewcam_addon/blender once more, inside a real Blender: its own Python, its own NumPy, no wheel of bpy.

Without those of light against Cycles, which look at what the two render: the wheels' Cycles is that of the program. And with
few examples of each property, as in the matrix: `make test` has the many.
"""

import re


def test_the_tests_of_blender_pass_inside_it(real_blender, packages):
    without = ("--ignore=tests/blender/light", "--ignore=tests/blender/test_light_by_light.py")
    chosen = ("-m", "not exhaustive and not light and not speed")
    few = ("-q", "-p", "no:cacheprovider", "--hypothesis-profile=quick")
    message = real_blender.run_inside("pytest", packages, *few, *chosen, *without, "tests/blender")
    summary = message.strip().splitlines()[-1]
    print(summary)
    assert re.search(r"\d+ passed", summary), message
