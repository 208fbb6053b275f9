"""What each sub-command of `viewcam` does; cli.py knows its words. Each returns the exit status and what --json writes."""

from typing import Any

Result = tuple[int, dict[str, Any]]
