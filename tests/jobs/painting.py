"""A batch without Blender, and the same as a program: `painting.py FOLDER JSON` tells its events as lines of JSON.

A picture is bytes that come from the shot alone, written bit by bit, so that a kill may come in between.
"""

import functools
import hashlib
import itertools
import json
import os
import sys
import time
from pathlib import Path

TESTS = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(TESTS), str(TESTS.parent)]

from disturbed import assert_same, contents

from viewcam_addon.jobs import one
from viewcam_addon.jobs.folder import Folder, Outputs, settings_hash
from viewcam_addon.jobs.interruption import Interruption
from viewcam_addon.jobs.job import Job
from viewcam_addon.jobs.run import run as run_batch

__all__ = ["assert_same", "contents"]

DIED = 99  # exit status


class Painter:
    """A Renderer (jobs/one.py) that draws nothing.

    pause : seconds between the pieces of a file.
    broken : error by the name of the shot that meets it.
    unlike : names of shots whose check fails.
    unlabeled : error by the name of the shot whose labels meet it.
    """

    def __init__(self, seed=0, pause=0.0, broken=None, unlike=(), unlabeled=None):
        self.seed, self.pause, self.broken, self.unlike = seed, pause, broken or {}, unlike
        self.painted, self.labeled, self.unlabeled = [], [], unlabeled or {}

    def render(self, shot, image, preview):
        if image:
            self.painted.append(shot.name)
        piece = hashlib.sha256(repr((self.seed, shot)).encode()).digest()
        for path, pieces in ((image, 6), (preview, 2)) if image else ():
            with open(path, "wb") as file:
                for _ in range(pieces):
                    file.write(piece)
                    file.flush()
                    time.sleep(self.pause)
        if shot.name in self.broken:
            raise self.broken[shot.name]
        return {"rendered": {"width": 4, "height": 3}, "warnings": [], "versions": {"painter": "1"}}

    def label(self, shot, picture, kinds, depth_steps):
        self.labeled.append((shot.name, tuple(kinds)))
        if shot.name in self.unlabeled:
            raise self.unlabeled[shot.name]
        names = [f"{shot.name}.{kind}.png" for kind in kinds] + [f"{shot.name}.labels.json"]
        for name in names:
            picture.with_name(name).write_text(json.dumps([name, self.seed, depth_steps]))
        return names

    def check(self, shot, has_picture=True, written=None, keep=None):
        passed = shot.name not in self.unlike
        verdict = "as stated" if passed else "the left half is < the right half"
        return {"passed": passed, "answer": "same" if passed else "different", "verdict": verdict}


class Listener:
    """Events as they were told: [(event, fields)]."""

    def __init__(self):
        self.heard = []

    def tell(self, event, **fields):
        self.heard.append((event, fields))

    def names(self, event):
        return [fields["shot"] for heard, fields in self.heard if heard == event]


class Printer:
    def tell(self, event, **fields):
        print(json.dumps({"event": event, **fields}, default=str), flush=True)


def shots(count):
    return [Job(f"shot_{number:03d}", camera="Camera", frame=number) for number in range(count)]


def hashes(listed, seed=0):
    return {shot.name: settings_hash(shot, {"seed": seed}) for shot in listed}


def paint(path, count=5, painter=None, events=None, check=False, labels=(), picture=True, part="", **options):
    """Run a batch of `count` shots, or of those listed, in the folder of that path."""
    listed = shots(count) if isinstance(count, int) else count
    outputs = Outputs(picture, check, labels)
    painter, folder = painter or Painter(), Folder(Path(path), part)
    settings = hashes(listed, painter.seed)
    work, events = one.in_turn(folder, painter, settings, outputs), events or Listener()
    with Interruption(functools.partial(events.tell, "stopping")) as interruption:
        return run_batch(listed, folder, settings, work, events, outputs=outputs, interruption=interruption, **options)


def die_before(step):
    """Let this process end, as kill -9 ends it, before the step of that number: a rename, a removal, a wait for the disk."""
    steps = itertools.count()

    def dying(call):
        def called(*arguments, **options):
            if next(steps) == step:
                os._exit(DIED)
            return call(*arguments, **options)

        return called

    os.replace, os.unlink, os.fsync = dying(os.replace), dying(os.unlink), dying(os.fsync)


if __name__ == "__main__":
    wanted = json.loads(sys.argv[2])
    pause, seed = wanted.pop("pause", 0.0), wanted.pop("seed", 0)
    die_before(wanted.pop("dies", None))
    sys.exit(paint(sys.argv[1], painter=Painter(seed, pause), events=Printer(), **wanted).exit_status)
