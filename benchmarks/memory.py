"""What a process takes of the machine's memory: now, and at most since it was told to forget.

Linux tells the peak in two places. `ru_maxrss` of a new process begins with what the process that started it had taken, so
that a small one would seem as large as its parent; VmHWM of /proc/self/status is the process's own, and can be set back.
Elsewhere `ru_maxrss` has to do, and nothing is forgotten. Rejected: tracemalloc, which sees NumPy's arrays and not the core's.
"""

import re
import resource
import sys
from pathlib import Path

_STATUS, _FORGET = Path("/proc/self/status"), Path("/proc/self/clear_refs")


def resident() -> int:
    """Bytes that the process takes now."""
    return _status("VmRSS")


def peak() -> int:
    """The most bytes that the process took since `forget_peak`, or since its start."""
    return _status("VmHWM")


def forget_peak() -> None:
    """Measure the peak from now on."""
    if sys.platform == "linux":
        _FORGET.write_text("5")


def _status(name: str) -> int:
    if sys.platform == "linux":
        return 1024 * int(re.search(rf"^{name}:\s*(\d+) kB$", _STATUS.read_text(), re.MULTILINE)[1])
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
