"""All that is wrong with a list of shots, gathered, so that it is put right in one go."""

import contextlib
from collections.abc import Iterator

from ..errors import InputError
from ..terminal import plain

MOST_SHOWN = 100


class ShotsError(InputError):
    """A list of shots that can't be used. The message is the list of problems; `problems` has all, one sentence each."""

    def __init__(self, source: str, problems: tuple[str, ...]) -> None:
        super().__init__(source, problems)
        self.source, self.problems = source, problems

    def __str__(self) -> str:
        count = len(self.problems)
        lines = [f"{plain(self.source)}: {'one problem' if count == 1 else f'{count} problems'}, nothing is rendered"]
        lines += [f"  {plain(problem)}" for problem in self.problems[:MOST_SHOWN]]
        if count > MOST_SHOWN:
            lines.append(f"  … and {count - MOST_SHOWN} more")
        return "\n".join(lines)


class Problems:
    """The problems found so far, each sentence once."""

    def __init__(self, source: str) -> None:
        self._source = source
        self._sentences: dict[str, None] = {}

    def add(self, sentence: str) -> None:
        self._sentences[sentence] = None

    @contextlib.contextmanager
    def caught(self) -> Iterator[None]:
        """Keep the InputError of the block, and go on after it."""
        try:
            yield
        except InputError as error:
            self.add(str(error))

    def raise_any(self) -> None:
        """Raise ShotsError if there are any."""
        if self._sentences:
            raise ShotsError(self._source, tuple(self._sentences))
