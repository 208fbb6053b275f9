"""This project's tracer as a contestant, in a process of its own."""

import os
import subprocess
import sys
import time
from pathlib import Path

from viewcam_addon import image
from viewcam_addon.tracer.render import Tracer, render
from viewcam_addon.tracer.scene import scene_file
from viewcam_addon.tracer.scene.film import MOST_SAMPLES

from .. import race

ROOT = Path(__file__).resolve().parents[2]


def prepare(scene_path: Path, level: str, threads: int) -> dict[str, race.Runner]:
    """In the contestant's process."""
    scene = scene_file.read(scene_path)
    tracer = Tracer(scene, threads)

    def picture(sampling: str, parameter: float, seed: int, path: Path) -> float:
        started = time.perf_counter()
        if level == "geometry":
            passes = tracer.render()
        else:
            passes = tracer.render_light(level, seed=seed, **_effort(sampling, parameter))
        seconds = time.perf_counter() - started
        image.write(path, image.Image(passes, scene.camera))
        return seconds

    def whole(sampling: str, parameter: float, seed: int, path: Path) -> float:
        started = time.perf_counter()
        passes = render(scene, level, seed=seed, threads=threads, **_effort(sampling, parameter))
        image.write(path, image.Image(passes, scene.camera))
        return time.perf_counter() - started

    return {"picture": picture, "whole": whole}


def fresh(scene_path: Path, level: str, threads: int) -> race.Runner:
    """A runner from a fresh process to the EXR, as in a shell. The first leaves bytecode, which an installed package has."""
    bytecode = {"PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": str(scene_path.with_name("bytecode"))}
    modules = {"PYTHONPATH": os.pathsep.join([str(ROOT), *filter(None, sys.path)])}

    def runner(sampling: str, parameter: float, seed: int, path: Path) -> float:
        options = ["--error", str(parameter)] if sampling == "error" else ["--samples", str(int(parameter))]
        command = [sys.executable, "-m", "viewcam_addon", "render", scene_path, path, "--level", level, *options]
        command += ["--seed", str(seed), "--threads", str(threads)]
        started = time.perf_counter()
        subprocess.run(command, env=os.environ | bytecode | modules, check=True, stdout=subprocess.DEVNULL)
        return time.perf_counter() - started

    return runner


def _effort(sampling: str, parameter: float) -> dict[str, float]:
    """The options of render()."""
    return {"samples": MOST_SAMPLES, "error": parameter} if sampling == "error" else {"samples": int(parameter)}
