"""The parts of a batch for several machines."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon.errors import InputError
from viewcam_addon.jobs.shards import shard


@given(st.integers(0, 200), st.integers(1, 50))
def test_all_shards_together_are_the_batch_and_none_has_much_more_than_another(total, count):
    parts = [shard(range(total), f"{number}/{count}") for number in range(1, count + 1)]
    assert sorted(item for part in parts for item in part) == list(range(total))
    assert max(map(len, parts)) - min(map(len, parts)) <= 1
    assert all(part == sorted(part) for part in parts)


def test_neighbours_go_to_different_shards():
    assert [shard("abcdefg", f"{number}/3") for number in (1, 2, 3)] == [["a", "d", "g"], ["b", "e"], ["c", "f"]]


@pytest.mark.parametrize("text", ["", "1", "0/4", "5/4", "0/0", "-1/4", "1/4/2", "1/", "a/b", "1.0/4", "١/٢", "1/9999999999"])
def test_a_shard_that_is_none_is_refused(text):
    with pytest.raises(InputError, match="write 1/8"):
        shard([1, 2, 3], text)
