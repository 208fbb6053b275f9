"""One command, `viewcam`, over all of the project: in the shell, and inside Blender as `blender -b FILE --command viewcam`.

Exit status: 0 all well; 1 the comparison failed; 2 bad input or usage, with one line on stderr; 3 something could not be
modeled under --strict. No traceback reaches a user.

The commands, their options, and what they do, are in commands/.
"""

import argparse
import functools
import importlib
import json
import os
import shlex
import signal
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NoReturn

from . import argument_types as types
from . import commands, events
from .commands import Result
from .errors import InputError, bug
from .files import check_writable, is_device, is_printed_to, written_whole

_FOLDERS = ("yolo", "bop", "colmap", "kitti", "middlebury")
"""Datasets of labels that are folders, not files."""


def main(arguments: Sequence[str] | None = None, blend_is_open: bool = False, ended_by: int | None = None) -> int:
    """Run one sub-command and return its exit status.

    arguments : the words after `viewcam`, those of the shell by default.
    blend_is_open : true inside Blender, where FILE.blend is the file that is open.
    ended_by : the signal that has ended the process that ran it (crashes.py): then it is only told.
    """
    arguments = sys.argv[1:] if arguments is None else list(arguments)
    try:
        options = _parser(blend_is_open).parse_args(arguments)
    except SystemExit:  # argparse leaves after --help
        return 0
    except _UsageError as error:
        log_json = "--log-json" in arguments
        options = argparse.Namespace(command=error.command, run=error.raised, json=None, log_json=log_json, writes=())
    options.words = shlex.join(arguments)
    started = time.monotonic()
    with events.opened(options.log_json) as options.events:
        if ended_by is None:
            options.events.tell("started", command=options.command, words=options.words)
            status, result = _outcome(options)
        else:
            status, result = _failure(options, InputError.exit_status, _crash(options, ended_by))
        seconds = round(time.monotonic() - started, 3)
        if result:
            status = _write_result(options, status, {"exit_status": status, **result}, seconds) or status
        options.events.tell("finished", command=options.command, exit_status=status, seconds=seconds)
    return status


def _crash(options: argparse.Namespace, number: int) -> str:
    name = signal.Signals(number).name if number in set(signal.Signals) else number
    blend = options.blend or "no file"
    sentence = f"Blender has ended with {name} at {blend}: see that the file is whole, and that there is memory enough"
    if options.command != "batch":
        return sentence
    return f"{sentence}; what is finished is kept, and with --resume --workers 1 a shot that crashes it does not end the batch"


class _UsageError(InputError):
    """The words are no command. command : the sub-command, as far as it is known."""

    def __init__(self, message: str, command: str) -> None:
        super().__init__(message)
        self.command = command

    def raised(self, _: argparse.Namespace) -> NoReturn:
        """Raise what such a command raises when it is run."""
        raise self


class _OneLineParser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        command = self.prog.partition(" ")[2]
        raise _UsageError(f"{message}; {self.prog} --help tells how it is used", command)


class _CommandParser(_OneLineParser):
    """Takes files and options in any order: Python 3.11 alone would take no file after an option where one may be left out."""

    _is_intermixing = False
    add_words: Callable[[argparse.ArgumentParser], None]
    """Adds the command's words, once it is this command that was given: what they need is imported for no other."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:  # which intermixed parsing uses itself
        if self._is_intermixing:
            return super().parse_known_args(args, namespace)
        self._is_intermixing = True
        self.add_words(self)
        return self.parse_known_intermixed_args(args, namespace)


_SERVE = "_serve"


def _parser(blend_is_open: bool) -> argparse.ArgumentParser:
    parser = _OneLineParser(prog="viewcam", description="A camera from eye, look-at, up and distance, proven against Cycles.")
    subparsers = parser.add_subparsers(dest="command", required=True, metavar="COMMAND", parser_class=_CommandParser)

    def add_words(name: str, added: argparse.ArgumentParser) -> None:
        command = importlib.import_module(f".commands.{name}", __package__)
        added.set_defaults(run=command.run, writes=())
        if name != _SERVE:
            added.add_argument("--threads", type=types.threads, metavar="N", help="threads to use (default: all)")
            added.add_argument("--json", metavar="FILE", type=types.path, help="write the result as JSON")
            events_too = "tell on standard output a JSON object for each event"
            added.add_argument("--log-json", action="store_true", help=events_too)
        command.add_options(added, blend_is_open)

    for name in commands.names():
        text = commands.summary(name)
        subparsers.add_parser(name, help=text, description=text).add_words = functools.partial(add_words, name)
    # For our own processes: without a help, the list leaves it out.
    subparsers.add_parser("serve").add_words = functools.partial(add_words, _SERVE)
    return parser


def _outcome(options: argparse.Namespace) -> Result:
    """Exit status and result of the sub-command, whatever becomes of it; an error is told."""
    try:
        _check_outputs(options)
        return options.run(options)
    except InputError as error:
        return _failure(options, error.exit_status, str(error), getattr(error, "problems", ()))
    except KeyboardInterrupt:
        return 130, {"error": "interrupted"}
    except Exception as error:  # in one line, as every other error
        return _failure(options, 2, bug(error))


def _check_outputs(options: argparse.Namespace) -> None:
    """Raise InputError for what can't be written, before anything is traced or rendered."""
    for name in ("json", "junit"):
        if path := getattr(options, name, None):
            try:
                _check_output(path, is_text=not options.log_json)
            except InputError:
                setattr(options, name, None)  # where this error would be told as well
                raise
    for name in options.writes:
        if path := getattr(options, name):
            is_folder = name == "report" or getattr(options, "to", None) in _FOLDERS
            _check_output(path / "index.html" if is_folder else path, is_text=False)
    _check_distinct(options)


def _check_distinct(options: argparse.Namespace) -> None:
    """Refuse an output that would take the place of what the command reads, or of another output."""
    written = [name for name in ("json", "junit", *options.writes) if getattr(options, name, None)]
    others = [value for name, value in vars(options).items() if name not in written]
    named = [path for value in others for path in (value if isinstance(value, list) else [value]) if isinstance(path, Path)]
    for name in written:
        path = getattr(options, name)
        if any(os.path.realpath(path) == os.path.realpath(other) for other in named) and not is_device(path):
            options.json = options.junit = None  # where this error would be told as well
            raise InputError(f"{path} is named twice, and would be overwritten: give the name of another file to write")
        named.append(path)


def _check_output(path: Path, is_text: bool) -> None:
    """Refuse an output file that can't be written, or that is where viewcam prints.

    is_text : it may stand between the lines that are printed.
    """
    check_writable(path)
    if not is_text and is_printed_to(path):
        raise InputError(f"{path} is where viewcam prints: give the name of a file")


def _failure(options: argparse.Namespace, status: int, sentence: str, problems: Sequence[str] = ()) -> Result:
    several = {"problems": list(problems)} if problems else {}
    options.events.tell("error", command=options.command, text=sentence, **several)
    return status, {"error": sentence, **several}


def _write_result(options: argparse.Namespace, status: int, result: dict[str, Any], seconds: float) -> int:
    """Write the result where that was asked for; the exit status if that fails, else 0."""
    try:
        if options.json:
            from . import checks

            with written_whole(options.json) as temporary:
                temporary.write_text(
                    json.dumps(checks.for_json(result), indent=2, allow_nan=False) + "\n", encoding="utf-8", newline="\n"
                )
        if path := getattr(options, "junit", None):
            from . import junit

            junit.write(path, options.words, status, result, seconds)
    except InputError as error:
        return _failure(options, error.exit_status, str(error))[0]
    return 0
