"""A hash of what a picture was made from: the same settings give the same hash, on every machine and in every version.

Rejected: Python's hash (another in each process), pickle (another in each version), and floats of so many digits, of which
two may be one.
"""

import hashlib
import json
from collections.abc import Mapping

from .job import Job

_DECIDE_NOTHING = ("name", "blend", "threads")
_FORMAT = 1  # counts up when the same settings are to have another hash


def settings_hash(job: Job, made_from: Mapping[str, object]) -> str:
    """SHA-256, in hexadecimal, over all that decides the job's picture and its check.

    made_from : whatever else does: versions, the hash of the .blend's content and of what it links, seed, options. Of texts,
    numbers, truth values, None, and lists and dicts of these; 1 and 1.0 are not the same. Name, path and threads are
    left out: they decide nothing of the picture.

    Raises
    ------
    TypeError
        if there is anything else among them, which could not be told apart for certain.
    """
    settings = {key: value for key, value in job.to_json().items() if key not in _DECIDE_NOTHING}
    document = {"format": _FORMAT, "shot": settings, "made_from": made_from}
    text = json.dumps(_canonical(document), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode("ascii")).hexdigest()


def _canonical(value: object) -> object:
    """The value in JSON that is the same for equal values only; floats to the last bit."""
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return {"float": value.hex()}
    if isinstance(value, list | tuple):
        return [_canonical(item) for item in value]
    if isinstance(value, Mapping) and all(isinstance(key, str) for key in value):
        return {"dict": {key: _canonical(item) for key, item in value.items()}}
    raise TypeError(f"{value!r} has no canonical form: give texts, numbers, lists and dicts")
