"""The time and memory that a batch saves and takes: `BLENDER=… python -m benchmarks.batch speed|memory`, in the real Blender.

    speed    shots of the studio still by `viewcam batch` and by a loop of `blender -b … -f` a shot: seconds, and whether each
             pixel is the same
    memory   10,000 shots of 64 × 36 by one batch: what the process takes after 100, 1000 and all of them, and shots a second

The loop is what a pipeline writes: a script that sets the camera, then `-f`. It loads the file and builds all that Cycles needs
for each shot; a batch does that once. What remains is the rendering, the same for both, so the more samples a shot has, the
less a batch can save. Both take turns in one run. The extension is built from this checkout, and installed in a new folder.
"""

import argparse
import json
import os
import re
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenEXR

from viewcam_addon.jobs.job import Job
from viewcam_addon.jobs.makers import orbit
from viewcam_addon.pinhole import Pinhole

Seconds = np.ndarray
"""Two numbers: seconds on the clock, and of all processors. The second hardly depends on what else a machine has to do."""

ROOT = Path(__file__).resolve().parent.parent
STUDIO = ROOT / "sample_scenes" / "studio.blend"
STILL = Pinhole((-0.5, -7.6, 1.62), (0.0, 0.9, 1.38), (0.0, 0.0, 1.0), 395.0, 320, 180)

# A shot of the loop, as in a pipeline, but with this add-on's own camera, since only the same camera has the same pixels.
ONE_SHOT = """
import bpy, json
from bl_ext.user_default.virtual_pinhole.viewcam_addon.blender import camera, versions
from bl_ext.user_default.virtual_pinhole.viewcam_addon.pinhole import Pinhole
shot = json.loads({shot!r})
scene = bpy.context.scene
render, data = scene.render, bpy.data.cameras.new("loop")
render.engine, render.filepath, render.use_file_extension = shot["engine"], {image!r}, True
render.resolution_x, render.resolution_y, render.resolution_percentage = shot["width"], shot["height"], 100
scene.cycles.samples = scene.virtual_pinhole_reference.samples = shot["samples"]
scene.cycles.use_denoising = {denoise}
data.clip_start, data.clip_end = scene.camera.data.clip_start, scene.camera.data.clip_end
scene.camera = bpy.data.objects.new("loop", data)
scene.collection.objects.link(scene.camera)
camera.apply(scene.camera, Pinhole(shot["eye"], shot["look_at"], shot["up"], shot["d"], shot["width"], shot["height"]), scene)
versions.set_multilayer_file(render.image_settings)
"""


class Blender:
    """The real one, with the extension in a user folder of its own."""

    def __init__(self, folder: Path) -> None:
        self._program = os.environ["BLENDER"]
        self._environment = os.environ | {"BLENDER_USER_RESOURCES": str(folder / "user")}
        build = [sys.executable, ROOT / ".ci" / "extension.py", self._program, folder / "dist", "linux-x64"]
        subprocess.run(build, check=True, capture_output=True)
        (built,) = (folder / "dist").glob("*.zip")
        self.run("--command", "extension", "install-file", "-r", "user_default", "-e", built)

    def start(self, *arguments: object) -> subprocess.Popen:
        command = [self._program, *map(str, arguments)]
        return subprocess.Popen(command, env=self._environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    def run(self, *arguments: object) -> Seconds:
        """The seconds that the command took; SystemExit if it failed."""
        started, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
        process = self.start(*arguments)
        output, _ = process.communicate()
        if process.returncode:
            sys.exit(output)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        return np.array([time.perf_counter() - started, cpu])


def by_loop(blender: Blender, shots: list[Job], blend: Path, folder: Path, denoise: bool) -> Seconds:
    seconds = np.zeros(2)
    for shot in shots:
        image = str(folder / f"{shot.name}_####")
        script = ONE_SHOT.format(shot=json.dumps(shot.to_json()), image=image, denoise=denoise)
        seconds += blender.run("-b", blend, "--python-exit-code", "1", "--python-expr", script, "-f", 1)
    return seconds


def by_batch(blender: Blender, shots: list[Job], blend: Path, folder: Path) -> Seconds:
    folder.mkdir(parents=True)
    (folder / "shots.json").write_text(json.dumps([shot.to_json() for shot in shots]), encoding="utf-8")
    return blender.run("-b", blend, "--command", "viewcam", "batch", folder / "shots.json", "--out", folder)


def without_denoising(blender: Blender, folder: Path) -> Path:
    """A copy of the still whose picture is as Cycles sampled it."""
    path = folder / "plain.blend"
    script = f"import bpy; bpy.context.scene.cycles.use_denoising = False; bpy.ops.wm.save_as_mainfile(filepath={str(path)!r})"
    blender.run("-b", STUDIO, "--python-exit-code", "1", "--python-expr", script)
    return path


def same_pixels(shots: list[Job], loop: Path, batch: Path) -> int:
    """The number of shots that are the same to the bit in every channel."""

    def channels(path: Path) -> dict[str, np.ndarray]:
        parts = OpenEXR.File(str(path), separate_channels=True).parts
        return {name: channel.pixels for part in parts for name, channel in part.channels.items()}

    def is_same(name: str) -> bool:
        first, other = channels(loop / f"{name}_0001.exr"), channels(batch / f"{name}.exr")
        return first.keys() == other.keys() and all(np.array_equal(first[key], other[key]) for key in first)

    return sum(is_same(shot.name) for shot in shots)


def speed(count: int, in_loop: int, cases: list[tuple[str, int, bool]], blender: Blender, folder: Path) -> Iterator[str]:
    """A row of the table for each case (engine, samples, denoising)."""
    yield "| engine | samples | `-f` a shot, CPU | batch, first | each further | 100 shots: faster, less CPU | same pixels |"
    yield "|---|---|---|---|---|---|---|"
    plain = without_denoising(blender, folder)
    for engine, samples, denoise in cases:
        blend = STUDIO if denoise else plain
        shots = [replace(shot, engine=engine, samples=samples) for shot in orbit(STILL, count)]
        to = folder / f"{engine}-{samples}-{denoise}"
        sample = shots[:in_loop]
        loop = by_loop(blender, sample, blend, to / "loop", denoise) / in_loop
        first = by_batch(blender, shots[:1], blend, to / "one")
        all_shots = by_batch(blender, shots, blend, to / "batch")
        further = (all_shots - first) / (count - 1)
        ratio = 100 * loop / (first + 99 * further)
        same = same_pixels(sample, to / "loop", to / "batch")
        name = f"{engine}, denoised" if denoise and engine == "CYCLES" else engine
        seconds = " | ".join(f"{wall:.2f} s, {cpu:.2f} s" for wall, cpu in (loop, first, further))
        yield f"| {name} | {samples} | {seconds} | {ratio[0]:.1f}, {ratio[1]:.1f} times | {same} of {in_loop} |"


def memory(count: int, engine: str, blender: Blender, folder: Path) -> Iterator[str]:
    """A line for each stage of the batch: the memory that its process takes."""
    still = STILL.resized(64, 36)
    shots = [replace(shot, engine=engine, samples=1) for shot in orbit(still, count)]
    (folder / "shots.json").write_text(json.dumps([shot.to_json() for shot in shots]), encoding="utf-8")
    arguments = ["--command", "viewcam", "batch", folder / "shots.json", "--out", folder / "out", "--log-json"]
    process = blender.start("-b", without_denoising(blender, folder), *arguments)
    done, started = 0, time.perf_counter()
    for line in process.stdout:
        if '"shot_done"' not in line:
            continue
        done += 1
        if done in (1, 10, 100, 1000, count) or done % 1000 == 0:
            seconds = time.perf_counter() - started
            yield f"{done} shots: {_resident(process.pid) / 2**20:.0f} MiB, {done / seconds:.2f} shots a second so far"
    yield f"exit status {process.wait()}"


def _resident(process: int) -> int:
    """Bytes of the largest process of a family: Blender's, whatever wrapper started it."""
    largest = 0
    for status in Path("/proc").glob("[0-9]*/status"):
        try:
            text = status.read_text()
        except OSError:  # it has ended
            continue
        is_ours = _descends(int(status.parent.name), process)
        if is_ours and (match := re.search(r"^VmRSS:\s*(\d+) kB$", text, re.MULTILINE)):
            largest = max(largest, 1024 * int(match[1]))
    return largest


def _descends(process: int, ancestor: int) -> bool:
    while process > 1:
        if process == ancestor:
            return True
        try:
            process = int(re.search(r"^PPid:\s*(\d+)$", Path(f"/proc/{process}/status").read_text(), re.MULTILINE)[1])
        except OSError:
            return False
    return False


def main() -> None:
    parser = argparse.ArgumentParser(prog="benchmarks.batch")
    parser.add_argument("what", choices=["speed", "memory"])
    parser.add_argument("--shots", type=int, help="default: 100 for speed, 10000 for memory")
    parser.add_argument("--loop", type=int, default=10, help="so many of them by the loop as well")
    parser.add_argument("--samples", type=int, nargs="*", default=[1, 4, 16])
    parser.add_argument("--engine", nargs="*", default=["CYCLES", "VIEWCAM"])
    parser.add_argument("--denoise", action="store_true", help="as the still has it")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="viewcam-batch-") as folder:
        blender = Blender(Path(folder))
        if options.what == "speed":
            cases = [(engine, samples, options.denoise) for engine in options.engine for samples in options.samples]
            lines = speed(options.shots or 100, options.loop, cases, blender, Path(folder))
        else:
            lines = memory(options.shots or 10000, options.engine[0], blender, Path(folder))
        for line in lines:
            print(line, flush=True)


if __name__ == "__main__":
    main()
