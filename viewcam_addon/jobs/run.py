"""All shots of a batch: claimed, rendered, counted, whatever happens on the way.

Which shots are to be done is read from the folder, again after each claim, since another batch may have been faster. A shot
that fails is told and the rest go on; a full disk ends the batch, as a signal does. Shots that another batch has claimed come
last, and are rendered here if that one is killed.
"""

import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence

from ..errors import FullDiskError, InputError, message_of
from ..events import Events
from . import sheet, summary
from .folder import Folder, Outputs, write_json
from .interruption import Interruption
from .job import Job
from .locks import Claims
from .one import Work
from .summary import Summary


def run(
    shots: Sequence[Job],
    folder: Folder,
    settings: Mapping[str, str],
    work: Work,
    events: Events,
    *,
    resume: bool = False,
    overwrite: bool = False,
    outputs: Outputs | None = None,
    interruption: Interruption | None = None,
) -> Summary:
    """Render the shots into the folder; at the end it has a summary and a contact sheet of all of them.

    settings : the hash of what each is made from (folder.settings_hash), by name.
    work : a function that renders them (one.in_turn, or a cluster's).
    resume : true to keep what is there from the same settings.
    overwrite : true to keep nothing; with neither of them nothing may be there.
    outputs : the files that a finished shot has; by default its picture.
    interruption : once it is heard, no more shots are begun.

    Tells batch_started(shots, kept, folder), then for each shot_started(shot) and shot_done(shot, seconds, image, passed), or
    shot_failed(shot, error), or shot_elsewhere(shot); batch_finished(done, kept, elsewhere, failed, left, seconds,
    exit_status).

    Raises InputError if some of these shots are there already and neither is said, or if the folder can't be written.
    """
    folder.refuse_what_is_in_the_way([shot.name for shot in shots], outputs or Outputs())
    batch = _Batch(shots, folder, settings, events, outputs or Outputs(), interruption)
    with Claims(folder.lock) as claims:
        batch.begin(resume, overwrite)
        batch.tidy(claims)
        for shot, outcome in work(batch.claimed(claims)):
            batch.note(shot, outcome)
            claims.release(shot.name)
        batch.tidy(claims)  # after another batch, killed meanwhile
        with claims.summing_up():
            return batch.sum_up()


class _Batch:
    def __init__(
        self,
        shots: Sequence[Job],
        folder: Folder,
        settings: Mapping[str, str],
        events: Events,
        outputs: Outputs,
        interruption: Interruption | None,
    ) -> None:
        self._shots, self._folder, self._events, self._outputs = shots, folder, events, outputs
        self._interruption = interruption
        self._settings = {shot.name: settings[shot.name] for shot in shots}
        self._started = time.monotonic()
        self._todo: deque[Job] = deque()
        self._errors: dict[str, str] = {}
        self._full = False
        self._rendered = self._kept = self._elsewhere = 0

    def begin(self, resume: bool, overwrite: bool) -> None:
        """Find what is to be done."""
        present = [shot.name for shot in self._shots if self._folder.sidecar(shot.name).exists()]
        if present and not resume and not overwrite:
            raise InputError(
                f"{self._folder.path} holds {len(present)} of these shots already, as {present[0]}: "
                "--resume continues, --overwrite renders anew"
            )
        if overwrite:
            for name in present:
                self._folder.remove_former(name, self._folder.record(name) or {}, of_labels_only=self._outputs.picture)
        self._todo.extend(shot for shot in self._shots if not self._is_there(shot))
        self._kept = len(self._shots) - len(self._todo)
        self._events.tell("batch_started", shots=len(self._shots), kept=self._kept, folder=self._folder.path)

    def tidy(self, claims: Claims) -> None:
        """Remove what killed batches have left, unless another one is writing."""
        with claims.alone() as alone:
            if alone:
                self._folder.remove_leftovers(self._settings)

    def claimed(self, claims: Claims) -> Iterator[Job | None]:
        """The shots to render, each claimed when it is asked for; None while all that are left are another batch's."""
        missed = 0
        while self._todo and not self._full and self._signal is None:
            shot = self._todo.popleft()
            if not claims.take(shot.name):
                self._todo.append(shot)
                missed += 1
                if missed == len(self._todo):
                    missed = 0
                    yield None
                continue
            missed = 0
            if self._is_there(shot):
                claims.release(shot.name)
                self._elsewhere += 1
                self._events.tell("shot_elsewhere", shot=shot.name)
            else:
                self._events.tell("shot_started", shot=shot.name)
                yield shot

    def note(self, shot: Job, outcome: dict | Exception) -> None:
        """Count a shot that was rendered or failed."""
        if isinstance(outcome, Exception):
            error = message_of(outcome)
            self._full = self._full or isinstance(outcome, FullDiskError)
            self._errors[shot.name] = error
            self._events.tell("shot_failed", shot=shot.name, error=error)
            return
        self._rendered += 1
        seconds, passed = outcome["timing"]["seconds"], outcome.get("check", {}).get("passed")
        image = self._folder.image(shot.name) if "image" in outcome else None
        self._events.tell("shot_done", shot=shot.name, seconds=seconds, image=image, passed=passed)

    def sum_up(self) -> Summary:
        """Write the summary and the contact sheet of what the folder now holds."""
        pictures, rows = [], []
        for result in summary.results(self._folder, self._settings, self._outputs, self._errors):
            pictures.append(sheet.picture(result))
            rows.append(result.to_json())
        seconds = time.monotonic() - self._started
        outcome = Summary(tuple(rows), self._rendered, self._kept, self._elsewhere, seconds, self._signal)
        try:
            sheet.write(self._folder.contact_sheet, pictures, outcome.counts)
            write_json(self._folder.summary, outcome.to_json())
        except FullDiskError:
            if not self._full:  # else it is told already, and what there is can be continued without them
                raise
        counts = outcome.counts
        self._events.tell(
            "batch_finished",
            done=self._rendered,
            kept=self._kept,
            elsewhere=self._elsewhere,
            failed=counts["failed"],
            left=counts["left"],
            seconds=round(seconds, 3),
            exit_status=outcome.exit_status,
        )
        return outcome

    @property
    def _signal(self) -> int | None:
        return self._interruption.number if self._interruption else None

    def _is_there(self, shot: Job) -> bool:
        return self._folder.finished(shot.name, self._settings[shot.name], self._outputs) is not None
