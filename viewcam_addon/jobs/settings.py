"""What a picture was made from, as one number: the same settings give the same hash, on every machine and in every version.

Rejected: Python's hash (another in each process), pickle (another in each version), and floats of so many digits, of which
two may be one.
"""

import dataclasses
import hashlib
import json
from collections.abc import Mapping

from .shot import Shot

_FORMAT = 1  # counts up when the same settings are to have another hash


def settings_hash(shot: Shot, made_from: Mapping[str, object]) -> str:
    """SHA-256, in hexadecimal, over all that decides the shot's picture.

    made_from : whatever else does: versions, the hash of the .blend's content and of what it links, seed, options. Of texts,
    numbers, truth values, None, and lists and dicts of these; 1 and 1.0 are not the same. The shot's name is left out: it
    decides nothing of the picture.

    Raises
    ------
    TypeError
        if there is anything else among them, which could not be told apart for certain.
    """
    settings = {key: value for key, value in dataclasses.asdict(shot).items() if key != "name" and value is not None}
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
