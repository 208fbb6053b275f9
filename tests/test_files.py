"""A file appears whole or not at all, and the folder tells nothing of a failure."""

import pytest

from viewcam_addon.errors import InputError
from viewcam_addon.files import written_whole


def test_what_was_written_appears_under_its_name_alone(tmp_path):
    with written_whole(tmp_path / "new" / "file.txt") as temporary:
        temporary.write_text("whole")
        assert not (tmp_path / "new" / "file.txt").exists()
        assert temporary.suffix == ".txt"
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["file.txt"]
    assert (tmp_path / "new" / "file.txt").read_text() == "whole"


@pytest.mark.parametrize("failure", [KeyboardInterrupt, ValueError, MemoryError])
def test_a_failure_midway_leaves_the_older_file_and_nothing_else(tmp_path, failure):
    target = tmp_path / "file.txt"
    target.write_text("older")
    with pytest.raises(failure), written_whole(target) as temporary:
        temporary.write_text("half")
        raise failure
    assert [path.name for path in tmp_path.iterdir()] == ["file.txt"]
    assert target.read_text() == "older"


def test_a_folder_that_can_not_be_written_is_named_in_one_sentence(tmp_path):
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(InputError, match="can't be written") as caught, written_whole(tmp_path / "file" / "below.txt"):
        pass
    assert "below.txt" in str(caught.value) and "\n" not in str(caught.value)


def test_the_name_of_a_folder_is_no_name_of_a_file(tmp_path):
    with pytest.raises(InputError, match="is a folder"), written_whole(tmp_path):
        pass


def test_a_block_that_wrote_nothing_is_an_error(tmp_path):
    with pytest.raises(InputError, match=r"file\.txt can't be written"), written_whole(tmp_path / "file.txt"):
        pass
    assert not list(tmp_path.iterdir())
