"""The plan of a batch: into which folder, by which processes, and what becomes of what is there already.

What another process is to do stands in a file (`write`, `read`): its jobs, and a plan or the files of one check.
"""

import dataclasses
import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Self, TypeVar

from .. import checks
from ..errors import InputError
from ..files import written_whole
from .folder import Outputs
from .job import Job


@dataclasses.dataclass(frozen=True)
class Plan:
    """The plan by which the jobs of one file are carried out.

    out : the folder for all files.
    outputs : the files that are made of each job.
    blend, trust : the file, see Job.
    resume : true to keep what is there from the same settings. `resume_known` does so only where all that it was made from is
        known.
    overwrite : true to keep nothing. With none of these three, nothing may be there.
    shard : "I/N", every N-th job from the I-th on.
    transforms : the pictures of a dataset that is written of all jobs, "png" or "exr".
    test : the pictures that the dataset holds out for tests, see dataset.write.
    time_limit : the seconds that a job may take.
    workers : the number of processes of this machine to work in.
    scheduler : the address of a Dask cluster, "" for one of this machine.
    command : the command that sentences speak of.
    """

    out: Path
    outputs: Outputs = dataclasses.field(default_factory=Outputs)
    blend: Path | None = None
    trust: bool = False
    resume: bool = False
    resume_known: bool = False
    overwrite: bool = False
    shard: str | None = None
    transforms: str | None = None
    test: str | None = None
    time_limit: float | None = None
    workers: int | None = None
    scheduler: str | None = None
    command: str = "batch"

    @property
    def is_on_cluster(self) -> bool:
        return self.scheduler is not None or self.workers is not None

    def to_json(self) -> dict[str, Any]:
        """The plan, as JSON can hold it."""
        return {**dataclasses.asdict(self), "out": str(self.out), "blend": self.blend and str(self.blend)}

    @classmethod
    def from_json(cls, document: Mapping[str, Any]) -> Self:
        """The plan that `to_json` gave."""
        outputs = Outputs(**{**document["outputs"], "labels": tuple(document["outputs"]["labels"])})
        blend = document["blend"] and Path(document["blend"])
        return cls(**{**document, "out": Path(document["out"]), "outputs": outputs, "blend": blend})


def write(path: Path, jobs: Sequence[Job], plan: Plan | None = None, files: Mapping[str, str] | None = None) -> None:
    """Write what another process is to do.

    plan : the plan of how the jobs are carried out. Without it there is one job, which is checked, with these files (Written)
        beside its result, for which `result_of` has the place.

    Raises InputError if it can't be written.
    """
    document = {"jobs": [job.to_json() for job in jobs], "plan": plan and plan.to_json(), "files": dict(files or {})}
    with written_whole(path) as temporary:
        temporary.write_text(json.dumps(document), encoding="utf-8", newline="\n")


def read(path: Path) -> tuple[list[Job], Plan | None, dict[str, str]]:
    """The jobs, plan and files that were written."""
    document = json.loads(path.read_text(encoding="utf-8"))
    jobs = [Job.from_json(job) for job in document["jobs"]]
    return jobs, document["plan"] and Plan.from_json(document["plan"]), document["files"]


def result_of(path: Path) -> Path:
    """The path of the result of a check that was to be done by this file."""
    return path.with_name("result.json")


Item = TypeVar("Item")

_SHARD = re.compile(r"(\d{1,9})/(\d{1,9})", re.ASCII)


def shard(items: Sequence[Item], text: str) -> list[Item]:
    """The items of shard "I/N": every N-th from the I-th on, in their order. All N together have each exactly once, and no two
    differ by more than one in number: so several machines share a batch without any word between them.

    Neighbors go to different shards, since neighbors cost alike. A shard may be empty.

    Raises InputError if the text is none with 1 ≤ I ≤ N.
    """
    match = _SHARD.fullmatch(text.strip())
    if not match or not 1 <= int(match[1]) <= int(match[2]):
        raise InputError(f"shard {checks.quoted(text)} is none: write 1/8 to 8/8 for the parts of eight")
    number, count = int(match[1]), int(match[2])
    return list(items[number - 1 :: count])
