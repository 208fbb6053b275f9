"""The examples of the pages of `blender`'s commands do what they say in the real one, with the extension installed."""

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
    reader.follow(page)


def test_an_example_that_does_not_work_is_found(reader):
    (example,) = examples.of_page("broken.md", "```python\nscene.camra\n```\n")
    with pytest.raises(AssertionError):
        reader.run(example)
