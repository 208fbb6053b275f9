"""docs/odd-blender.md can't rot: every row has its test, every test its row, and a row that is not true fails."""

import ast
import dataclasses
from pathlib import Path

import pytest

pytest.importorskip("bpy")


def found_tests():
    """The tests beside this one that take the fixture `odd`, by name: whether they ask it for what the row says."""
    result = {}
    for path in Path(__file__).parent.glob("test_odd_blender_*.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef) and any(argument.arg == "odd" for argument in node.args.args):
                body = ast.unparse(node)
                result[node.name] = "odd.check(" in body or "odd.later(" in body
    return result


def test_every_row_has_its_test_and_every_test_its_row(odd_rows):
    assert set(odd_rows) == set(found_tests())
    assert len(odd_rows) > 90


def test_every_test_holds_its_row_to_its_word():
    assert [name for name, asks in found_tests().items() if not asks] == []


@pytest.mark.parametrize(
    "untruth",
    [
        {"sentences": ["The camera is well."]},
        {"sticks": (False, True, True)},
        {"sticks": (True, False, True)},
        {"sticks": (True, True, False)},
    ],
)
def test_a_row_that_is_not_true_is_seen(posed_camera, odd_rows, untruth):
    row = odd_rows["test_in_every_rotation_mode_the_pose_sticks"]
    assert (row.sticks, row.sentences) == ((True, True, True), [])
    with pytest.raises(AssertionError):
        dataclasses.replace(row, **untruth).check(posed_camera)
