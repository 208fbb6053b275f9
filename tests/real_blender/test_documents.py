"""Every example of README.md and docs/ does what its page says in the real Blender, with the extension that its users install.

What the pages run in a shell as `viewcam COMMAND FILE.blend` runs here as `blender -b FILE.blend --command viewcam COMMAND`.
"""

import importlib.util
import os
from pathlib import Path

import pytest

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
    reader.follow(page, real=True)


def test_an_example_that_does_not_work_is_found(reader):
    for block in ("```sh\nviewcam batch shot.blend\n```\n", "```python\nscene.camra\n```\n"):
        (example,) = examples.of_page("broken.md", block)
        with pytest.raises(AssertionError):
            reader.run(example)
