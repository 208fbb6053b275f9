"""The part of the machine that this process may use: cores, and memory, asked before what a file claims to hold is allocated.

Rejected: to allocate and see. Linux promises more than it has, and ends the process that then uses it.
"""

import ctypes
import os
import sys
from pathlib import Path

from .errors import InputError

_GROUPS = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")


def cores() -> int:
    """The cores that this process may use, which a container or `taskset` may have made fewer."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def most() -> int:
    """Bytes that a process may have at most: the machine's, its container's, or those of its own limit (ulimit -v)."""
    return min(_machine(), *_limits())


def check(what: str, size: int, remedy: str) -> None:
    """Refuse what needs more bytes than a process may have.

    what : begins a sentence and has a plural's verb ("the arrays of scene.npz").
    remedy : ends it.

    Raises InputError with both numbers.
    """
    if size > (limit := most()):
        raise InputError(f"{what} need {size / 2**30:,.3g} GiB of memory and there are {limit / 2**30:,.3g} GiB: {remedy}")


def _machine() -> int:
    if sys.platform != "win32":
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    kilobytes = ctypes.c_ulonglong()
    ctypes.windll.kernel32.GetPhysicallyInstalledSystemMemory(ctypes.byref(kilobytes))
    return kilobytes.value * 1024 or sys.maxsize  # 0 where the firmware does not tell


def _limits() -> list[int]:
    result = [sys.maxsize]
    for file in map(Path, _GROUPS):
        try:
            result.append(int(file.read_text()))
        except (OSError, ValueError):  # no such group, or "max"
            continue
    if sys.platform != "win32":
        import resource

        limit, _ = resource.getrlimit(resource.RLIMIT_AS)
        if limit != resource.RLIM_INFINITY:
            result.append(limit)
    return result
