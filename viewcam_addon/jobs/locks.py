"""Locks that tell who renders which shot, where several batches work in one folder.

The locks are the kernel's, on bytes of one file that stays. Byte 0 is shared by all live batches, so that whoever gets it for
himself is alone; byte 1 belongs to the one that sums up; and each shot has a byte of its own, by the hash of its name. A
process that has ended, however it did, holds none. Windows has no locks that several may share: one batch a folder there.

Where a file system has no locks every claim is granted, and nobody is alone: two batches then do the same work twice, end with
the same files, and leave those that kill -9 left.
Rejected: a lock file for each shot (what kill -9 left would be in the way), and flock (NFS had it late).
"""

import contextlib
import errno
import hashlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path

from .. import file_names as names
from ..errors import InputError

_ON_WINDOWS = sys.platform == "win32"
if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

_ALIVE, _SUMMING_UP, _FIRST_SHOT = 0, 1, 2
_TAKEN = {errno.EACCES, errno.EAGAIN}
_UNKNOWN = {errno.ENOLCK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP, errno.EINVAL}


class Claims:
    """The claims of a batch in its folder, a context manager.

    One at a time for each folder in a process: locks of this kind are the process's, and end with the first to be closed.

    Raises InputError if the file of the locks can't be written, or, on Windows, another batch is at work in the folder.
    """

    def __init__(self, path: Path) -> None:
        try:
            self._file = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        except OSError as error:
            raise InputError(f"{path} can't be written ({error.strerror}): choose another folder") from error
        if _ON_WINDOWS:
            self._be_the_only_one(path.parent)

    def __enter__(self) -> "Claims":
        return self

    def __exit__(self, *exception: object) -> None:
        os.close(self._file)

    @contextlib.contextmanager
    def alone(self) -> Iterator[bool]:
        """True if certainly no other batch is at work in the folder, and none can begin inside the block; then this one is."""
        alone = self._lock(_ALIVE)
        try:
            yield alone is True
        finally:
            self._lock(_ALIVE, shared=True, wait=True)

    @contextlib.contextmanager
    def summing_up(self) -> Iterator[None]:
        """Wait until no other batch sums up; the last one to do so finds all that the others have done."""
        self._lock(_SUMMING_UP, wait=True)
        try:
            yield
        finally:
            self._unlock(_SUMMING_UP)

    def take(self, shot: str) -> bool:
        """Claim a shot; False if another batch has it."""
        return self._lock(_byte(shot)) is not False

    def release(self, shot: str) -> None:
        """Give a shot back, done or not."""
        self._unlock(_byte(shot))

    def _lock(self, byte: int, shared: bool = False, wait: bool = False) -> bool | None:
        """True if this batch has the lock now, False if another one has it; None where the file system has no locks."""
        if _ON_WINDOWS:
            return True
        kind = fcntl.LOCK_SH if shared else fcntl.LOCK_EX
        try:
            fcntl.lockf(self._file, kind if wait else kind | fcntl.LOCK_NB, 1, byte)
        except OSError as error:
            if error.errno in _TAKEN:
                return False
            if error.errno not in _UNKNOWN:
                raise
            return None
        return True

    def _unlock(self, byte: int) -> None:
        if not _ON_WINDOWS:
            with contextlib.suppress(OSError):  # where there are no locks
                fcntl.lockf(self._file, fcntl.LOCK_UN, 1, byte)

    def _be_the_only_one(self, folder: Path) -> None:
        try:
            msvcrt.locking(self._file, msvcrt.LK_NBLCK, 1)  # type: ignore[name-defined, unused-ignore] # there on Windows alone
        except OSError as error:
            os.close(self._file)
            raise InputError(f"another batch works in {folder}: wait for it, or give another --out") from error


def _byte(shot: str) -> int:
    """The place of a shot's lock in the file, which may lie far behind the file's end."""
    digest = hashlib.sha256(names.one_file(shot).encode("utf-8")).digest()
    return _FIRST_SHOT + int.from_bytes(digest[:7], "big")  # below 2⁶³, where the kernel counts to
