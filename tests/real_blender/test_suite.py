"""The tests of viewcam_addon/blender once more, inside a real Blender: its own Python, its own NumPy, no wheel of bpy.

Without those of light against Cycles, which look at what the two render: the wheels' Cycles is that of the program; without
batches, which test_batch_command.py has as their users type them; without the tour, which test_window.py takes by hand; and
without what following costs, which is counted. With few examples of each property: `make test` has the many.
"""

import re


def test_the_tests_of_blender_pass_inside_it(real_blender, packages):
    left_out = ("light", "jobs", "test_light_by_light.py", "test_tour.py", "test_speed.py")
    without = [f"--ignore=tests/blender/{name}" for name in left_out]
    chosen = ("-m", "not exhaustive and not light and not speed")
    few = ("-q", "-p", "no:cacheprovider", "--hypothesis-profile=quick")
    message = real_blender.run_inside("pytest", packages, *few, *chosen, *without, "tests/blender")
    summary = message.strip().splitlines()[-1]
    print(summary)
    assert re.search(r"\d+ passed", summary), message
