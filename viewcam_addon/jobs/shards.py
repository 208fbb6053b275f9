"""The shots of a batch that one of several machines renders, without any word between them."""

import re
from collections.abc import Sequence
from typing import TypeVar

from .. import checks
from ..errors import InputError

Item = TypeVar("Item")

_SHARD = re.compile(r"(\d{1,9})/(\d{1,9})", re.ASCII)


def shard(items: Sequence[Item], text: str) -> list[Item]:
    """The items of shard "I/N": every N-th from the I-th on, in their order. All N together have each exactly once, and no two
    differ by more than one in number.

    Neighbors go to different shards, since neighbors cost alike. A shard may be empty.

    Raises
    ------
    InputError
        if the text is none with 1 ≤ I ≤ N.
    """
    match = _SHARD.fullmatch(text.strip())
    if not match or not 1 <= int(match[1]) <= int(match[2]):
        raise InputError(f"shard {checks.quoted(text)} is none: write 1/8 to 8/8 for the parts of eight")
    number, count = int(match[1]), int(match[2])
    return list(items[number - 1 :: count])
