"""The tests of viewcam_addon/blender once more, inside a real Blender, its own Python and NumPy; and the examples of the pages.

Without those of light against Cycles, which look at what the two render: the wheels' Cycles is that of the program; without
batches, which test_batch_command.py has as their users type them; without the tour, which test_window.py takes by hand; and
without what following costs, which is counted. With few examples of each property: `make test` has the many.
"""

import importlib.util
import os
import re
from pathlib import Path

import pytest


def test_the_tests_of_blender_pass_inside_it(real_blender, packages):
    left_out = ("light", "jobs", "test_light_by_light.py", "test_tour.py", "test_speed.py")
    without = [f"--ignore=tests/blender/{name}" for name in left_out]
    chosen = ("-m", "not exhaustive and not light and not speed")
    few = ("-q", "-p", "no:cacheprovider", "--hypothesis-profile=quick")
    message = real_blender.run_inside("pytest", packages, *few, *chosen, *without, "tests/blender")
    summary = message.strip().splitlines()[-1]
    print(summary)
    assert re.search(r"\d+ passed", summary), message


_spec = importlib.util.spec_from_file_location("examples", Path(__file__).parents[1] / "documents" / "examples.py")
examples = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(examples)


@pytest.fixture(scope="module")
def reader(tmp_path_factory, real_blender, extension_zip):
    return examples.with_blender(
        tmp_path_factory.mktemp("reader"), os.environ["BLENDER"], real_blender.user_folder, extension_zip
    )


@pytest.mark.parametrize("page", examples.pages(real=True))
def test_the_examples_do_what_their_page_says(reader, page):
    reader.follow(page)


def test_an_example_that_does_not_work_is_found(reader):
    (example,) = examples.of_page("broken.md", "```python\nscene.camra\n```\n")
    with pytest.raises(AssertionError):
        reader.run(example)
