"""The examples of the pages that a shell is enough for do what they say, with the wheel of Blender that is installed."""

import importlib.util
from pathlib import Path

import pytest

pytest.importorskip("bpy")

_spec = importlib.util.spec_from_file_location("examples", Path(__file__).with_name("examples.py"))
examples = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(examples)

ALL = examples.examples()


@pytest.fixture(scope="module")
def reader(tmp_path_factory):
    return examples.with_wheel(tmp_path_factory.mktemp("reader"))


@pytest.mark.exhaustive
@pytest.mark.parametrize("page", examples.pages(real=False))
def test_the_examples_do_what_their_page_says(reader, page):
    reader.follow(page)


def test_what_is_not_run_is_still_in_the_pages_and_has_a_reason():
    commands = {each.text for each in ALL if each.language == "sh"}
    listed = examples.NOT_RUN
    assert not listed.keys() - commands, f"listed, and in no page: {sorted(listed.keys() - commands)}"
    assert all(len(reason) > 10 for reason in [*listed.values(), *examples.WRITTEN.values()])
    assert examples.WRITTEN.keys() <= {(each.page, each.language) for each in ALL}


def test_every_page_is_read_and_most_of_it_is_run():
    assert {"README.md", "docs/batch.md", "docs/light.md", "docs/baking.md"} <= {each.page for each in ALL}
    assert examples.pages(real=True) == ["README.md", "docs/baking.md"]
    run = [each for each in ALL if examples.is_run(each)]
    assert len(run) >= 30 and {"sh", "python", "csv", "json", "jsonl"} <= {each.language for each in run}


@pytest.mark.exhaustive
@pytest.mark.parametrize(
    "block",
    [
        "```sh\nviewcam paint shot.blend\n```\n",
        "```sh\nfalse  # indeed\n```\n",
        "```toml\na = 1\n```\n",
        "```\nwhat is this\n```\n",
        "```python\nscene.camra\n```\n",
        '```json\n{"format": "another"}\n```\n',
        "```csv\nname,eye\na,1\n```\n",
    ],
)
def test_an_example_that_does_not_work_is_found(reader, block):
    (example,) = examples.of_page("broken.md", f"Text.\n\n{block}\nMore.\n")
    assert examples.is_run(example)
    with pytest.raises((AssertionError, ValueError)):
        reader.run(example)


def test_a_block_of_commands_is_as_many_examples_and_a_shown_text_is_none():
    page = "1. So:\n\n   ```sh\n   viewcam a \\\n     b   # why\n   viewcam c#1\n   ```\n\n```text\nsaid\n```\n"
    assert [each.text for each in examples.of_page("page.md", page)] == ["viewcam a b", "viewcam c#1"]
