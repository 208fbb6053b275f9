"""The summary of a batch: each shot as the folder has it at the end, the counts, the exit status."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from ..comparison.answer import ANSWERS, DIFFERENT, SAME, SAME_BUT
from .folder import Folder, Outputs


@dataclass(frozen=True)
class Result:
    """A shot at the end of a batch: `record` is its sidecar where it is done, `error` a sentence where it failed."""

    name: str
    record: Mapping[str, Any] | None = None
    error: str | None = None

    @property
    def state(self) -> str:
        return "done" if self.record else "failed" if self.error else "left"

    @property
    def check(self) -> Mapping[str, Any] | None:
        """The result of the check; None where there was none."""
        return self.record.get("check") if self.record else None

    @property
    def answer(self) -> str | None:
        """The answer of the check, one of comparison/answer.py's; None where there was none. Older sidecars have none."""
        if not self.check:
            return None
        answer = self.check.get("answer")
        return answer if answer in ANSWERS else SAME if self.check["passed"] else DIFFERENT

    def to_json(self) -> dict[str, Any]:
        result: dict[str, Any] = {"name": self.name, "state": self.state}
        if self.check:
            result |= {"passed": self.check["passed"], "answer": self.answer, "verdict": self.check["verdict"]}
        if self.error:
            result["error"] = self.error
        if self.record and self.record.get("warnings"):
            result["warnings"] = self.record["warnings"]
        if self.record:
            result["timing"] = {"seconds": self.record["timing"]["seconds"]}
        return result


def results(folder: Folder, settings: Mapping[str, str], outputs: Outputs, errors: Mapping[str, str]) -> Iterator[Result]:
    """Each shot of the list, in its order.

    settings : the hash of what each shot is made from, by its name.
    errors : a sentence for each shot that failed, by its name.
    """
    for name, made_from in settings.items():
        record = folder.finished(name, made_from, outputs)
        yield Result(name, record, None if record else errors.get(name))


@dataclass(frozen=True)
class Summary:
    """A batch at its end.

    rendered : the number of shots that this run rendered.
    kept : the number that were there already.
    elsewhere : the number that another batch did meanwhile.
    seconds : the seconds that it took.
    signal : the number of the signal that ended it.
    """

    shots: tuple[Mapping[str, Any], ...]
    rendered: int
    kept: int
    elsewhere: int
    seconds: float
    signal: int | None = None

    @property
    def counts(self) -> dict[str, int]:
        """The numbers of shots: all, done, failed, left, those that were checked, those whose check failed, and those of which
        it says that not all in the picture is modeled."""
        states = Counter(shot["state"] for shot in self.shots)
        answers = Counter(shot["answer"] for shot in self.shots if "answer" in shot)
        return {
            "shots": len(self.shots),
            **{state: states[state] for state in ("done", "failed", "left")},
            "checked": answers.total(),
            "checks_failed": answers[DIFFERENT],
            "not_all_modeled": answers[SAME_BUT],
        }

    @property
    def exit_status(self) -> int:
        """0 if all shots are there and every check passed, 1 if one failed, 4 if shots failed or are left, or the signal's."""
        counts = self.counts
        if self.signal is not None:
            return 128 + self.signal
        if counts["failed"] or counts["left"]:
            return 4
        return 1 if counts["checks_failed"] else 0

    def to_json(self) -> dict[str, Any]:
        """The content of summary.json. Only `timing` differs between a run and one that was interrupted and continued."""
        return {
            "exit_status": self.exit_status,
            "counts": self.counts,
            "timing": {
                "seconds": round(self.seconds, 3),
                "finished": datetime.now(UTC).isoformat(timespec="seconds"),
                "rendered": self.rendered,
                "kept": self.kept,
                "elsewhere": self.elsewhere,
            },
            "shots": list(self.shots),
        }
