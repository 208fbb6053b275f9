"""Two folders of batches compared: byte for byte, but for what their documents call `timing`."""

import json
from pathlib import Path


def contents(folder: Path) -> dict[str, object]:
    """Name → what each file holds, documents without their timings."""
    result = {}
    for file in sorted(Path(folder).iterdir()):
        data = file.read_bytes()
        result[file.name] = _without_timings(json.loads(data)) if file.suffix == ".json" else data
    return result


def assert_same(folder: Path, undisturbed: Path) -> None:
    actual, wanted = contents(folder), contents(undisturbed)
    assert sorted(actual) == sorted(wanted), f"{sorted(actual)} in place of {sorted(wanted)}"
    unlike = [name for name in wanted if actual[name] != wanted[name]]
    assert not unlike, f"not as an undisturbed run leaves them: {unlike}"


def _without_timings(value: object) -> object:
    if isinstance(value, dict):
        return {key: _without_timings(item) for key, item in value.items() if key != "timing"}
    return [_without_timings(item) for item in value] if isinstance(value, list) else value
