"""What renders a shot, as a batch sees it: a Blender in this process, or one in another."""

from pathlib import Path
from typing import Any, Protocol

from ..shots import Shot


class Renderer(Protocol):
    """Holds one scene open, and renders its shots one after another.

    Both methods raise InputError if this shot can't be had, and FullDiskError if nothing more can be written; the next shot
    may then still be asked for.
    """

    def render(self, shot: Shot, image: Path, preview: Path) -> dict[str, Any]:
        """Write the picture (EXR) and its preview (PNG) to these two paths.

        Both paths are temporary, in the batch's folder: the caller renames them, and removes them after an error.

        Returns what the sidecar says of it: the keys of datasets.record, and `stated`, `rendered`, `warnings`, `versions`.
        The same shot gives the same bytes and the same values each time.
        """
        ...

    def check(self, shot: Shot) -> dict[str, Any]:
        """Compare the shot that was just rendered with the tracer: `passed` (bool), `verdict` (a sentence), and figures."""
        ...
