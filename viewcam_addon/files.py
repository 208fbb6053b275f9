"""The one writer of files: a file appears whole, or not at all.

Every file that this project writes comes into being as a temporary file in the same folder and is renamed when its last byte
is on the disk. Blender's own writers (the .blend, Cycles' EXR) write to the temporary path that `written_whole` hands out.
"""

import contextlib
import errno
import os
import secrets
from collections.abc import Iterator
from pathlib import Path

from .errors import FullDiskError, InputError

# What a system says when no more fits: on the disk, into a user's share of it, into the largest file that it allows.
_FULL = {errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC), errno.EFBIG}


@contextlib.contextmanager
def written_whole(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a temporary path beside `path`, and move what was written there to `path` at the end.

    The temporary path keeps the suffix of `path`, since some writers choose the format by it. Whatever is raised inside the
    block removes the temporary file and leaves an older file at `path` as it was.

    Raises
    ------
    InputError
        if the folder can't be written; FullDiskError if the disk is full.
    """
    target = Path(path)
    if target.is_dir():
        raise InputError(f"{target} is a folder: give the name of a file")
    temporary = target.with_name(f".{target.stem}-{secrets.token_hex(4)}{target.suffix}")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        with open(temporary, "rb+") as written:
            os.fsync(written.fileno())
        os.replace(temporary, target)
    except OSError as error:
        kind = FullDiskError if error.errno in _FULL else InputError
        raise kind(
            f"{target} can't be written ({error.strerror or error}): choose another folder or free some space"
        ) from error
    finally:
        with contextlib.suppress(OSError):  # where it could not be written, it is not there either
            temporary.unlink()
