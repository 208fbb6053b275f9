"""What reaches the terminal: our lines, and not those that libraries print past Python."""

import contextlib
import io
import os
import sys
from collections.abc import Iterator


@contextlib.contextmanager
def silent_libraries() -> Iterator[None]:
    """Send to nowhere what is printed inside the block, by Python or by C, to standard output and standard error.

    OpenEXR prints what it raises as well; Blender prints a line for each file, frame and step.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    kept = [os.dup(stream) for stream in (1, 2)]
    try:
        with contextlib.redirect_stdout(io.StringIO()), open(os.devnull, "w") as nowhere:
            for stream in (1, 2):
                os.dup2(nowhere.fileno(), stream)
            yield
    finally:
        for stream, copy in zip((1, 2), kept, strict=True):
            os.dup2(copy, stream)
            os.close(copy)
