"""The core as a library of this system: what it asks of the system's loader."""

import importlib.util
from pathlib import Path

import lief


def this_library() -> Path:
    """The core's library that this Python loads."""
    folder = Path(importlib.util.find_spec("viewcam_core").origin).parent
    (library,) = (path for path in folder.iterdir() if path.name != "__init__.py" and path.is_file())
    return library


def thread_storage(library: Path) -> tuple[int, int]:
    """(bytes, alignment) of the thread_local objects that each thread of the process is given with an ELF or PE library."""
    binary = lief.parse(library)
    if isinstance(binary, lief.PE.Binary):
        if not binary.has_tls:
            return 0, 1
        start, end = binary.tls.addressof_raw_data
        # IMAGE_SCN_ALIGN_*: bits 20 to 23 hold one more than the logarithm.
        return end - start + binary.tls.sizeof_zero_fill, 1 << max((binary.tls.characteristics >> 20 & 15) - 1, 0)
    (segment,) = [s for s in binary.segments if s.type == lief.ELF.Segment.TYPE.TLS] or [None]
    return (segment.virtual_size, segment.alignment) if segment else (0, 1)


def test_no_thread_local_object_of_the_core_asks_for_more_than_malloc_aligns_to():
    """wine 8's loader and that of Windows before 8.1 place thread storage at 16 bytes, whatever it asks for."""
    size, alignment = thread_storage(this_library())
    assert alignment <= 16, f"{alignment} bytes"
    assert 0 < size <= 4096, f"every thread of Blender is given {size} bytes"
