"""A batch on two workers with Blender: the files of one process, byte for byte, whoever is killed; and nothing runs on."""

import json
import math
import os
import re
import signal
import threading
import time
from dataclasses import replace
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")
pytest.importorskip("distributed")

from viewcam_addon.blender.jobs.renderer import BlenderRenderer
from viewcam_addon.jobs import cluster, one, run
from viewcam_addon.jobs.folder import Folder, Outputs, settings_hash
from viewcam_addon.jobs.job import Job

pytestmark = [
    pytest.mark.exhaustive,
    pytest.mark.skipif(not Path("/proc/self").exists(), reason="whether a process runs is read off Linux's /proc"),
]

TIMING = re.compile(rb'"timing": \{[^}]*\}')
WAITS = 120
"""Seconds for what takes a few."""


def shot(name, turn, engine="CYCLES", samples=4):
    eye = (6 * math.cos(turn), 6 * math.sin(turn), 2.5)
    return Job(name, eye, (0, 0, 0.5), (0, 0, 1), 90.0, None, 96, 54, 1, engine, samples, "direct")


# The slow one takes some seconds, so that whoever renders it can be killed meanwhile.
SHOTS = [shot("slow", 0.1, samples=8192), *(shot(f"shot_{i}", i) for i in range(5)), shot("ours", 2.5, "VIEWCAM")]


@pytest.fixture(scope="module")
def blend(tmp_path_factory, registered_addon):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    bpy.ops.mesh.primitive_plane_add(size=12)
    bpy.ops.mesh.primitive_monkey_add(location=(0, 0, 1))
    bpy.ops.object.light_add(type="SUN", rotation=(0.6, 0.3, 0))
    path = tmp_path_factory.mktemp("scene") / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


class Ear:
    """A listener that keeps each event that it is told."""

    def __init__(self):
        self.events = []

    def tell(self, event, **fields):
        self.events.append((event, fields))

    def shots(self, event):
        return [fields["shot"] for name, fields in self.events if name == event]


@pytest.fixture(scope="module")
def alone(blend, tmp_path_factory):
    """(what the file is made from, the hashes of the shots, the files of one process)."""
    folder = Folder(tmp_path_factory.mktemp("alone"))
    with BlenderRenderer(blend) as renderer:
        made_from = renderer.made_from()
        settings = {each.name: settings_hash(each, made_from) for each in SHOTS}
        summary = run.run(SHOTS, folder, settings, one.in_turn(folder, renderer, settings, Outputs()), Ear())
    assert summary.exit_status == 0, summary.to_json()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    return made_from, settings, contents(folder.path)


def contents(folder):
    """Name → bytes without timings, of the shots' files and the contact sheet."""
    paths = [path for path in folder.iterdir() if path.suffix in (".exr", ".png", ".json", ".html")]
    return {path.name: TIMING.sub(b"", path.read_bytes()) for path in paths if path.name != "summary.json"}


def children_of(process):
    """The numbers of the processes that this one has started and that still run."""
    result = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, parent = path.read_text().rpartition(")")[2].split()[:2]
        except OSError:
            continue
        if int(parent) == process and state != "Z":
            result.append(int(path.parent.name))
    return result


def until(is_so):
    ends = time.monotonic() + WAITS
    while not (outcome := is_so()) and time.monotonic() < ends:
        time.sleep(0.05)
    return outcome


class Batch:
    """The shots on two workers, in a thread, so that the test can look and kill."""

    def __init__(self, machines, blend, alone, folder):
        self.machines, self.ear, self._outcome = machines, Ear(), []
        made_from, settings, _ = alone
        work = machines.work(blend, Folder(folder), settings, made_from)
        self._thread = threading.Thread(
            target=lambda: self._outcome.append(run.run(SHOTS, Folder(folder), settings, work, self.ear))
        )
        self._thread.start()

    def workers(self):
        """The process of each worker → those that it has started: its Blender."""
        return {process: children_of(process) for process in self.machines._client.run(os.getpid).values()}

    def has_done(self, count):
        """True if so many shots are done within the time; False at once if the batch has ended before."""
        done = self.ear.shots
        until(lambda: len(done("shot_done")) >= count or not self._thread.is_alive())
        return len(done("shot_done")) >= count

    def hold_the_slow_shot(self):
        """(the worker that renders it, its Blender), which is stopped, so that the shot is not done before it is killed."""
        tasks = self.machines._client.processing()
        (busy,) = (address for address, keys in tasks.items() if any(key.startswith("slow-") for key in keys))
        worker = self.machines._client.run(os.getpid, workers=[busy])[busy]
        (blender,) = children_of(worker)
        os.kill(blender, signal.SIGSTOP)
        return worker, blender

    def summary(self):
        self._thread.join(WAITS)
        assert self._outcome, self.ear.events
        return self._outcome[0]


def test_whoever_is_killed_the_files_are_those_of_one_process_and_each_worker_loads_once(blend, alone, tmp_path):
    with cluster.opened(None, 2, bpy.app.binary_path or None) as machines:
        batch = Batch(machines, blend, alone, tmp_path / "out")
        assert batch.has_done(1), batch.ear.events
        worker, blender = batch.hold_the_slow_shot()
        first = batch.workers()
        assert [len(blenders) for blenders in first.values()] == [1, 1], f"a Blender for each worker, not {first}"

        assert batch.has_done(len(SHOTS) - 1) and "slow" not in batch.ear.shots("shot_done"), batch.ear.events
        assert batch.workers() == first, "a Blender was started again, though nobody had ended one"
        os.kill(blender, signal.SIGKILL)
        assert until(lambda: [each for each in children_of(worker) if each != blender]), "Blender is not started again"
        os.kill(worker, signal.SIGKILL)

        summary = batch.summary()
        assert summary.exit_status == 0 and summary.counts["done"] == len(SHOTS), summary.to_json()
        assert not batch.ear.shots("shot_failed")
        last = batch.workers()
    assert worker not in last
    assert contents(tmp_path / "out") == alone[2]
    ran = {*first, *last, *(each for blenders in (*first.values(), *last.values()) for each in blenders)}
    running = [each for each in ran if each in children_of(os.getpid()) or Path(f"/proc/{each}/fd/0").exists()]
    assert until(lambda: not [each for each in running if Path(f"/proc/{each}/fd/0").exists()]), f"still running: {running}"


def test_the_files_of_another_seed_would_be_others(blend, alone, tmp_path):
    with BlenderRenderer(blend) as renderer:
        record = one.render_one(replace(SHOTS[1], seed=7), Folder(tmp_path), renderer, "hash", Outputs())
    assert json.dumps(record) and (tmp_path / "shot_0.exr").read_bytes() != alone[2]["shot_0.exr"]
