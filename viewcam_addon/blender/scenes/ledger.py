"""The ledger: what became of each thing that the exporter met, and what Cycles must leave out so that both sides show the same.

One entry an object, however often it is placed; its worst finding decides the status. A remedy is a change that, made for
Cycles' render, takes out of it what the tracer does not model, so that the rest can be compared. Some only make Cycles exact
(shadow terminators, bent normals): a picture with everything in it has these, and none of the stand-ins.
"""

from collections.abc import Callable, Mapping

import bpy

from ...errors import NotModeledError
from ...tracer.scene import LedgerEntry
from ..temporary_settings import Overrides

Remedy = Callable[[Overrides], None]

_WORSE = ("exported", "approximated", "skipped")


class Ledger:
    """The findings and remedies of a scene.

    bare : by name, the objects whose geometry nodes make surfaces without a material.
    """

    def __init__(self) -> None:
        self.bare: dict[str, bpy.types.Object] = {}
        self._findings: dict[str, dict[str, str]] = {}
        self._placed: dict[str, int] = {}
        self.remedies: dict[tuple, Remedy] = {}
        self._stand_ins: set[tuple] = set()

    def placed(self, name: str, times: int = 1) -> None:
        """The object is in the scene once more, or so many times."""
        self._placed[name] = self._placed.get(name, 0) + times

    def note(self, name: str, status: str, reason: str) -> None:
        """A finding, one clause, about the object; the same one again changes nothing."""
        self._findings.setdefault(name, {})[reason] = status

    def set_for_cycles(self, owner: bpy.types.bpy_struct, attribute: str, value: object, stands_in: bool = True) -> None:
        """The remedy is a property of an original datablock.

        stands_in : true if it shows a stand-in, which a picture with everything goes without.
        """
        self._remedy((owner.as_pointer(), attribute), lambda overrides: overrides.set(owner, attribute, value), stands_in)

    def call_for_cycles(
        self, owner: bpy.types.bpy_struct, remedy: Callable[..., None], *arguments: object, stands_in: bool = True
    ) -> None:
        """The remedy is a function (overrides, owner, *arguments).

        stands_in : true if it shows a stand-in, which a picture with everything goes without.
        """
        key = owner.as_pointer(), remedy.__name__
        self._remedy(key, lambda overrides: remedy(overrides, owner, *arguments), stands_in)

    @property
    def remedies_of_everything(self) -> list[Remedy]:
        """The remedies for a picture with everything in it: all but the stand-ins."""
        return [remedy for key, remedy in self.remedies.items() if key not in self._stand_ins]

    def add(self, other: "Ledger", names: Mapping[str, str]) -> None:
        """Note what another ledger found of objects that stand for these. names : object there → object here."""
        for stand_in, name in names.items():
            for reason, status in other._findings.get(stand_in, {}).items():
                self.note(name, status, reason)

    def entries(self) -> tuple[LedgerEntry, ...]:
        """One entry an object: the skipped ones first, then those that are approximated."""
        entries = []
        for name in dict.fromkeys((*self._findings, *self._placed)):
            findings = self._findings.get(name, {})
            status = self._status(name, set(findings.values()))
            reasons = list(findings)
            if self._placed.get(name, 0) > 1:
                reasons.append(f"placed {self._placed[name]} times")
            entries.append(LedgerEntry(name, status, "; ".join(reasons)))
        return tuple(sorted(entries, key=lambda entry: -_WORSE.index(entry.status)))

    def check_strict(self) -> None:
        """Raise NotModeledError, naming the first of them, if anything is approximated or skipped."""
        lacking = [entry for entry in self.entries() if not entry.is_modeled]
        if lacking:
            others = f" (and {len(lacking) - 1} more)" if len(lacking) > 1 else ""
            raise NotModeledError(
                f"{lacking[0].object!r} can't be modeled{others}, {lacking[0].reason}: take it out, or leave --strict out"
            )

    def _remedy(self, key: tuple, remedy: Remedy, stands_in: bool) -> None:
        self.remedies[key] = remedy
        if stands_in:
            self._stand_ins.add(key)

    def _status(self, name: str, statuses: set[str]) -> str:
        worst = max(statuses, key=_WORSE.index, default="exported")
        # An object that is there in part is approximated.
        return "approximated" if worst == "skipped" and name in self._placed else worst
