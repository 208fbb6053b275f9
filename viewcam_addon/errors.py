"""The errors that a user meets: one sentence that names what is wrong and says what to do.

Everything that a wrong input can cause is raised as one of these, so that the command line, the panel and the render engine
can show `str(error)` as it stands and need no knowledge of what went wrong. A rejected alternative: letting OSError, KeyError
and the like travel up and be translated at the top, where the object and the key are no longer known.
"""

import errno
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import TypeGuard

_MOST_NAMED = 3  # in a sentence

_OF_A_PATH = (errno.ENAMETOOLONG, errno.EACCES, errno.EPERM, errno.ELOOP, errno.EIO)
"""The errors of a system that a path can cause, or the disk behind it."""


class InputError(ValueError):
    """An error of input that can't be used. The message is one sentence: what is wrong (object, key, value), what to do."""

    exit_status = 2


class FullDiskError(InputError):
    """Nothing more can be written there, so that there is no use in trying the next."""


class NotModeledError(InputError):
    """Something in the scene has no counterpart in the model, and `--strict` does not let it pass."""

    exit_status = 3


def counted(count: int, singular: str, plural: str = "") -> str:
    """A number of things in a sentence: 1 camera, 2,000 cameras.

    plural : the word for several of them, where that takes more than an s.
    """
    return f"{count:,} {singular if count == 1 else plural or f'{singular}s'}"


def listed(names: Sequence[str]) -> str:
    """Names in a sentence: a, b and c."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def several(names: Sequence[str], most: int = _MOST_NAMED) -> str:
    """Names in a sentence, not too long a one: a, b, c and 2 more."""
    rest = len(names) - most
    return ", ".join(names[:most]) + (f" and {rest:,} more" if rest > 0 else "")


def message_of(error: Exception) -> str:
    """The message of any error for a user, in one sentence or, of a list of shots, in a list of them."""
    return str(error) if isinstance(error, InputError) else bug(error)


def operator_reason(error: RuntimeError) -> str:
    """The reason that an operator of Blender gives for its failure, as a part of a sentence."""
    return str(error).strip().splitlines()[0].removeprefix("Error: ").rstrip(".")


def is_of_a_path(error: Exception) -> TypeGuard[OSError]:
    """True if a system refuses the path of a file, whatever is in it."""
    return isinstance(error, OSError) and error.filename is not None and error.errno in _OF_A_PATH


def bug(error: Exception) -> str:
    """One sentence for an error that no input should have caused, and where in the code it came from.

    A file that the system refuses, as for a name that is too long or a folder that nobody may enter, is none of the code's.
    """
    if is_of_a_path(error):
        return f"{error.filename} can't be reached ({error.strerror}): check its name, and who may read its folder"
    place = traceback.extract_tb(error.__traceback__)[-1]
    what = f"{type(error).__name__} at {Path(place.filename).name}:{place.lineno}: {error}".splitlines()[0]
    return f"this is a bug, please report it ({what})"
