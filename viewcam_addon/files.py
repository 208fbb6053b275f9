"""The one writer of files: a file appears whole, or not at all. And how those are read that strangers send.

Every file that this project writes comes into being as a temporary file in the same folder and is renamed when its last byte
is on the disk. Blender's own writers (the .blend, Cycles' EXR) write to the temporary path that `written_whole` hands out.

Only a regular file is replaced, or nothing. A symbolic link stays, and the file that it leads to is replaced. What else may
stand there (/dev/null, a terminal, a pipe, standard output under its name /dev/stdout) is written to, when all of it is ready.
A disk, a socket and a folder are refused. Rejected: to follow links by hand, since the system may forbid to follow one that
another user has put in a folder that all may write to.
"""

import contextlib
import errno
import functools
import os
import re
import secrets
import shutil
import socket
import stat
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO

from .errors import FullDiskError, InputError

# The errors of a system when no more fits: on the disk, into a user's share of it, into the largest file that it allows.
_FULL = {errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC), errno.EFBIG}

_UNLOCKED_AT_MOST = 60.0
"""Seconds that a process may take from making a temporary folder to locking it."""

_unfinished: set[Path] = set()
"""The temporary files and folders of this process."""


@contextlib.contextmanager
def written_whole(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a temporary path beside `path`, and move what was written there to `path` at the end.

    The temporary path keeps the suffix of `path`, since some writers choose the format by it. Whatever is raised inside the
    block removes the temporary file and leaves an older file at `path` as it was.

    Raises InputError if the folder can't be written, or if `path` is a folder, a disk, a socket or a pipe that nobody reads;
    FullDiskError if the disk is full.
    """
    path = Path(path)
    with _in_a_sentence(path), contextlib.ExitStack() as ends:
        file = _replaceable(path)
        if file:
            file.parent.mkdir(parents=True, exist_ok=True)
            temporary = ends.enter_context(_temporary(_beside(file, file.parent)))
        else:
            temporary = ends.enter_context(temporary_folder()) / path.name
        yield temporary
        with open(temporary, "rb+") as written:
            os.fsync(written.fileno())
            if not file:
                with _opened_for_writing(path) as there:
                    shutil.copyfileobj(written, there)
        if file:
            os.replace(temporary, file)


@contextlib.contextmanager
def temporary_folder() -> Iterator[Path]:
    """A folder among the system's temporary ones, gone at the end of the block.

    Its process holds a lock on it, which ends with the process, however that ends. So the first one that a process makes also
    removes those that killed processes of this user and machine have left. On Windows, which has no such locks, they stay.

    Raises OSError if it can't be made.
    """
    _remove_abandoned()
    with tempfile.TemporaryDirectory(prefix=_prefix(), ignore_cleanup_errors=True) as name, contextlib.ExitStack() as ends:
        with contextlib.suppress(OSError):  # where there are no locks nothing is removed either
            ends.enter_context(_locked(Path(name)))
        yield ends.enter_context(_temporary(Path(name)))


def remove_unfinished() -> None:
    """Remove the temporary files and folders of this process, for a thread that is about to end it in the midst of its work."""
    for path in [*_unfinished]:
        _removed(path)


@contextlib.contextmanager
def _temporary(path: Path) -> Iterator[Path]:
    """A context at whose end the temporary file or folder is gone, or with this process (see `remove_unfinished`)."""
    _unfinished.add(path)
    try:
        yield path
    finally:
        _removed(path)
        _unfinished.discard(path)


def _prefix() -> str:
    """The beginning of temporary folders' names on this machine: of a folder that machines share, none sees another's locks."""
    return f"viewcam-{re.sub(r'[^A-Za-z0-9]', '_', socket.gethostname())[:40]}-"


@contextlib.contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """A context in which this process holds the folder's lock. Raises OSError if another does, or there are no locks."""
    if sys.platform == "win32":
        raise OSError(errno.ENOSYS, "folders have no locks")
    import fcntl

    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    finally:
        os.close(handle)


@functools.cache
def _remove_abandoned() -> None:
    """Remove the temporary folders that killed processes have left, once in a process. Nothing is said of those that stay."""
    if sys.platform == "win32":
        return
    for folder in Path(tempfile.gettempdir()).glob(f"{_prefix()}*"):
        with contextlib.suppress(OSError):
            there = os.lstat(folder)
            is_ours = stat.S_ISDIR(there.st_mode) and there.st_uid == os.geteuid()
            if is_ours and time.time() - there.st_mtime > _UNLOCKED_AT_MOST:
                with _locked(folder):
                    shutil.rmtree(folder, ignore_errors=True)


@contextlib.contextmanager
def written_together(folder: Path, name: str) -> Iterator[Path]:
    """A temporary folder whose files stand in `folder` when the block has ended well, in place of those there; else none does.

    name : the beginning of the temporary folder's name, which is hidden beside them: .NAME-1a2b3c4d.labels.

    Raises InputError if it can't be made there; FullDiskError if the disk is full.
    """
    temporary = folder / f".{name}-{secrets.token_hex(4)}.labels"
    with _in_a_sentence(folder), _temporary(temporary):
        temporary.mkdir()
        yield temporary
        for path in sorted(temporary.iterdir()):
            os.replace(path, folder / path.name)


@contextlib.contextmanager
def folder_written_whole(folder: Path, may_replace: Callable[[Path], bool] = lambda _: False) -> Iterator[Path]:
    """Give a temporary folder beside `folder`, and call it that when the block has ended well; else nothing of it stays.

    may_replace : a function: true if a folder that is there, and not empty, may go.

    Raises InputError if something stands there that is no empty folder and may not go, or it can't be written; FullDiskError if
    the disk is full.
    """
    folder = folder.absolute()
    with _in_a_sentence(folder):
        replaces = folder.is_dir() and any(folder.iterdir()) and may_replace(folder)
        if os.path.lexists(folder) and not replaces and not (folder.is_dir() and not any(folder.iterdir())):
            raise InputError(f"{folder} is there already: give the name of a new folder")
        folder.parent.mkdir(parents=True, exist_ok=True)
        with _temporary(folder.with_name(f".{folder.name}-{secrets.token_hex(4)}.labels")) as temporary:
            temporary.mkdir()
            yield temporary
            getattr(os, "sync", lambda: None)()  # thousands of small files: at once, and not one by one
            if replaces:
                former = temporary.with_suffix(".former")
                os.replace(folder, former)
                os.replace(temporary, folder)
                shutil.rmtree(former)
                return
            if folder.exists():
                folder.rmdir()
            os.replace(temporary, folder)


def read_bytes(path: str | os.PathLike[str]) -> bytes:
    """The content of a file.

    Raises OSError if it can't be read, or is no regular file: a pipe keeps its reader waiting for ever, a device may never end.
    """
    kind = stat.S_IFMT(os.stat(path).st_mode)
    if kind not in (stat.S_IFREG, stat.S_IFDIR):  # a folder's own error says more
        raise OSError(errno.EINVAL, "it is no file")
    return Path(path).read_bytes()


def check_writable(path: str | os.PathLike[str]) -> None:
    """Raise InputError if `written_whole` would, as far as that is known before anything is written; nothing stays behind.

    For what takes its time before it has something to write.
    """
    path = Path(path)
    with _in_a_sentence(path):
        file = _replaceable(path)
        if file:
            folder = next((folder for folder in file.absolute().parents if os.path.lexists(folder)), None)
            if folder is None:  # Windows alone
                raise InputError(
                    f"{path} is on the drive or share {file.absolute().anchor}, which is not there: choose another"
                )
            temporary = _beside(file, folder)
            try:
                temporary.touch(exist_ok=False)
            finally:
                _removed(temporary)
        elif not os.access(path, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))


def is_replaced(path: str | os.PathLike[str]) -> bool:
    """True if `written_whole` makes or replaces a regular file there, beside which others may stand.

    Raises InputError if nothing can be written there, as far as that is known.
    """
    path = Path(path)
    with _in_a_sentence(path):
        return _replaceable(path) is not None


def is_device(path: str | os.PathLike[str]) -> bool:
    """True if something stands there that `written_whole` writes to and does not replace."""
    return os.path.exists(path) and not os.path.isdir(path) and not is_replaced(path)


def is_printed_to(path: str | os.PathLike[str]) -> bool:
    """True if it is where standard output or standard error leads, so that what is written would mix with what is printed."""
    try:
        there = os.stat(path)
    except OSError:
        return False
    return _is_stream(there) and not os.path.samestat(there, os.stat(os.devnull))


def _replaceable(path: Path) -> Path | None:
    """The regular file that is to be replaced or made; None where something stands that is written to."""
    try:
        there = os.stat(path)
    except FileNotFoundError:
        there = None
    except ValueError as error:  # a character 0; on Windows, one that is too long, too
        raise InputError(f"{ascii(str(path))[:100]} is no name that a file can have: give another") from error
    if there is not None:
        kind = stat.S_IFMT(there.st_mode)
        if kind == stat.S_IFDIR:
            raise InputError(f"{path} is a folder: give the name of a file")
        if kind in (stat.S_IFBLK, stat.S_IFSOCK):
            raise InputError(f"{path} is {'a disk' if kind == stat.S_IFBLK else 'a socket'}: give the name of a file")
        if kind != stat.S_IFREG or _is_stream(there):
            return None
    return Path(os.path.realpath(path)) if path.is_symlink() else path


def _is_stream(there: os.stat_result) -> bool:
    return _is_open_as(1, there) or _is_open_as(2, there)


def _is_open_as(stream: int, there: os.stat_result) -> bool:
    """True if it is what standard output (1) or standard error (2) leads to."""
    try:
        return os.path.samestat(there, os.fstat(stream))
    except OSError:  # it is closed
        return False


def _opened_for_writing(path: Path) -> contextlib.AbstractContextManager[BinaryIO]:
    """The opened target that is no file to replace, behind what is printed already if it is one of our own streams."""
    there = os.stat(path)
    for number, stream in ((1, sys.stdout), (2, sys.stderr)):
        if _is_open_as(number, there):
            if stream is not None:
                stream.flush()
            return open(os.dup(number), "wb")
    try:
        handle = os.open(path, os.O_WRONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0))
    except OSError as error:
        if error.errno == errno.ENXIO:
            raise InputError(f"{path} is a pipe that nobody reads: start its reader first") from error
        raise
    if hasattr(os, "O_NONBLOCK"):  # nothing that is opened so keeps us for ever; but its reader may be slow
        os.set_blocking(handle, True)
    return open(handle, "wb")


def _beside(file: Path, folder: Path) -> Path:
    """A name in the folder that nothing has, with the file's suffix."""
    return folder / f".{file.stem}-{secrets.token_hex(4)}{file.suffix}"


def _removed(temporary: Path) -> None:
    """Remove a file, or a folder with all that is in it."""
    if temporary.is_dir():
        shutil.rmtree(temporary, ignore_errors=True)
        return
    with contextlib.suppress(OSError):  # where it could not be written, it is not there either
        temporary.unlink()


@contextlib.contextmanager
def _in_a_sentence(path: Path) -> Iterator[None]:
    """An OSError of the block as the error that a user is told."""
    try:
        yield
    except OSError as error:
        kind = FullDiskError if error.errno in _FULL else InputError
        raise kind(f"{path} can't be written ({error.strerror or error}): choose another folder or free some space") from error
