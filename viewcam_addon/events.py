"""Events that a command tells while it runs: errors as sentences, a bar on a terminal, or a line of JSON for each event.

An event is a name and fields. Of every command are told `started` (command, words), `message` (text: a line that it would have
printed), `error` (command, text, and `problems` where there are several), `note` (command, text: how something was taken, or
what to know) and `finished` (command, exit_status, seconds); a picture that is traced tells `progress` (share), as do labels
that become a scene of BOP's (work: written), a check each `step` (name: rendering, with number and of, tracing, comparing)
and, where it searches for a bias, `forecast` (samples: of a pixel in the end, taken: so far, following: after the next round,
seconds: left), and a batch tells of its shots (docs/batch.md). All of it goes to copies of standard output and standard error,
so it is heard while libraries are silent.

Rejected: Python's logging, whose levels, loggers and handlers are more than a line of JSON needs, and to which the libraries in
this process write as well.
"""

import contextlib
import datetime
import io
import json
from collections.abc import Iterator
from typing import Any, Protocol, TextIO

from .terminal import copy_of, plain

_PERCENT = "{desc} {percentage:.0f}%|{bar}| {elapsed}<{remaining}"


class Events(Protocol):
    """Whoever is told of events. The fields are what JSON can say, and paths."""

    def tell(self, event: str, **fields: Any) -> None: ...


class Sentences:
    """Sentences on standard error: one for all that goes wrong; nothing else."""

    def __init__(self, stream: TextIO) -> None:
        self._stream, self._command = stream, "batch"

    def tell(self, event: str, **fields: Any) -> None:
        self._command = fields.get("command", self._command)
        if sentence := _sentence(event, fields, f"viewcam {self._command}".rstrip()):  # none where there is no such command
            self._say(sentence)

    def _say(self, sentence: str) -> None:
        _write(self._stream, sentence)


class Bar(Sentences):
    """Sentences above a bar of a batch's shots or of the rows of a picture."""

    def __init__(self, stream: TextIO) -> None:
        super().__init__(stream)
        self._bar, self._failed = None, 0

    def tell(self, event: str, **fields: Any) -> None:
        super().tell(event, **fields)
        if event == "batch_started":
            self._open(total=fields["shots"], initial=fields["kept"], unit="shot")
        elif event == "progress":
            self._progress(100 * fields["share"], fields.get("work", "traced"))
        elif event == "shot_started" and self._bar is not None:
            self._bar.set_description_str(plain(fields["shot"]))
        elif event in ("shot_done", "shot_failed", "shot_elsewhere") and self._bar is not None:
            self._failed += event == "shot_failed"
            self._bar.set_postfix_str(f"{self._failed} failed" if self._failed else "", refresh=False)
            self._bar.update()
        elif event in ("batch_finished", "finished"):
            self._close()

    def _progress(self, percent: float, work: str) -> None:
        if percent == 0.0:  # and no bar for what takes half a second
            self._open(total=100, desc=work, bar_format=_PERCENT, miniters=0, delay=0.5)
        elif self._bar is not None:
            self._bar.update(percent - self._bar.n)
        if percent == 100.0:
            self._close()

    def _open(self, **what: Any) -> None:
        if draw := _tqdm():
            self._bar = draw(**what, file=self._stream, dynamic_ncols=True, leave=False)

    def _close(self) -> None:
        if self._bar is not None:
            self._bar.close()
            self._bar = None

    def _say(self, sentence: str) -> None:
        if self._bar is None:
            super()._say(sentence)
        else:
            self._bar.write(sentence, file=self._stream)


class JsonLines:
    """Events on standard output, each an object on a line of its own: `event`, `time` (UTC), its fields. Errors as ever."""

    def __init__(self, stream: TextIO, errors: Sentences) -> None:
        self._stream, self._errors = stream, errors

    def tell(self, event: str, **fields: Any) -> None:
        now = datetime.datetime.now(datetime.UTC).isoformat(timespec="milliseconds")
        _write(self._stream, json.dumps({"event": event, "time": now, **fields}, default=str))
        self._errors.tell(event, **fields)


@contextlib.contextmanager
def opened(log_json: bool) -> Iterator[Events]:
    """Whoever is to be told: by lines of JSON, in which what is printed inside the block becomes messages; else by sentences,
    with a bar if standard error is a terminal."""
    with contextlib.ExitStack() as streams:
        errors = streams.enter_context(_listening(2))
        if log_json:
            lines = JsonLines(streams.enter_context(_listening(1)), Sentences(errors))
            with contextlib.redirect_stdout(_Messages(lines)):
                yield lines
        else:
            yield Bar(errors) if errors.isatty() else Sentences(errors)


class _Messages(io.TextIOBase):
    """A text stream each line of which is told as a message."""

    def __init__(self, events: Events) -> None:
        self._events, self._begun = events, ""

    def write(self, text: str) -> int:
        *lines, self._begun = (self._begun + text).split("\n")
        for line in lines:
            self._events.tell("message", text=line)
        return len(text)


@contextlib.contextmanager
def _listening(stream: int) -> Iterator[TextIO]:
    copy = copy_of(stream)
    try:
        yield copy
    finally:
        with contextlib.suppress(OSError):  # events that could not be written are tried once more
            copy.close()


def _write(stream: TextIO, line: str) -> None:
    with contextlib.suppress(OSError):  # nobody listens any more: that ends no command
        stream.write(f"{line}\n")
        stream.flush()


def _tqdm() -> type | None:
    try:
        from tqdm import tqdm
    except ImportError:  # a clone linked into Blender's extensions has no wheels
        return None
    return type("tqdm", (tqdm,), {"monitor_interval": 0})  # no thread that wakes up every ten seconds


def _sentence(event: str, fields: dict[str, Any], command: str) -> str:
    """The sentence of an event where nobody reads JSON, plain; mostly none."""
    if event == "error":
        lines = fields["text"].split("\n") if fields.get("problems") else [fields["text"]]
        return "\n".join(map(plain, [f"{command}: {lines[0]}", *lines[1:]]))
    if event == "note":
        return plain(f"{command}: note: {fields['text']}")
    if event == "forecast":
        samples, taken, seconds = fields["samples"], fields["taken"], fields["seconds"]
        return f"{command}: some {samples:,} samples a pixel, about {seconds:.0f} s more ({taken:,} so far)"
    if event == "shot_failed":
        return plain(f"{command}: {fields['shot']}: {fields['error']}")
    if event == "stopping":
        return f"{command}: {fields['signal']}: this shot will be finished; a second one ends it at once"
    return ""
