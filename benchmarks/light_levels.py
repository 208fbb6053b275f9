"""How fast light is: samples a second at `direct` and `path`, beside Cycles on the same scenes, and what is not needed.

    python -m benchmarks.light_levels [--rounds 5] [--threads N] [--only NAME …]

The same scene, samples, bounces and filter on both sides. Each round runs Cycles, then the tracer. Cycles' time is that of the
render call without a file, the tracer's that of render() with all of its preparation.

Needs bpy, embreex and OpenEXR.
"""

import argparse
import os
import platform
import sys
import tempfile
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from benchmarks import race
from viewcam_addon.tracer.render import render
from viewcam_addon.tracer.scene import Scene, scene_file
from viewcam_addon.tracer.scene.lamps import World

SCENES = Path(__file__).resolve().parent.parent / "sample_scenes"


@dataclass(frozen=True)
class Contest:
    """A scene at a level: one of the sample scenes, or "suzannes", six of them under one sun.

    least : how many times Cycles' samples a second are wanted.
    """

    scene: str
    level: str
    size: tuple[int, int]
    samples: int
    least: float


CONTESTS = (
    Contest("suzannes", "direct", (640, 360), 64, 2.0),
    Contest("studio", "direct", (640, 360), 64, 2.0),
    Contest("cornell", "direct", (480, 480), 64, 2.0),
    Contest("studio", "path", (640, 360), 16, 0.5),
    Contest("cornell", "path", (480, 480), 16, 0.5),
)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1, help="of every contestant")
    parser.add_argument("--only", nargs="+", default=[], help="these scenes")
    options = parser.parse_args()
    print(f"{options.threads} threads, {options.rounds} rounds, Python {platform.python_version()}\n")
    behind = [
        contest for contest in CONTESTS if contest.scene in (options.only or contest.scene) and not hold(contest, options)
    ]
    if not options.only:
        compare_needs(options)
    return 1 if behind else 0


def hold(contest: Contest, options: argparse.Namespace) -> bool:
    """Race both on one scene and say how it ended; whether as it is wanted."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.json"
        with race.Contestant(prepare_cycles, contest, path, options.threads) as blender:
            scene = scene_file.read(path)
            trace = partial(render, scene, contest.level, contest.samples, threads=options.threads)
            times = race.run({**blender.runners(), "tracer": race.timed(trace)}, options.rounds)
    median = race.medians(times)
    width, height = contest.size
    print(f"{contest.scene} at {contest.level}, {width} × {height}, {contest.samples} samples")
    for name, seconds in times.items():
        rate = width * height * contest.samples / median[name] / 1e6
        print(f"  {name:8}{median[name]:7.2f} s  ({min(seconds):.2f} … {max(seconds):.2f})  {rate:5.2f} M samples/s")
    ratio = median["Cycles"] / median["tracer"]
    print(f"  {ratio:.2f} times as fast as Cycles; wanted: at least {contest.least:g}\n", flush=True)
    return ratio >= contest.least


def prepare_cycles(contest: Contest, path: Path, threads: int) -> dict[str, race.Runner]:
    """In Blender's process: write the scene, and offer Cycles' render."""
    import bpy

    import viewcam_addon
    from benchmarks import suzannes
    from viewcam_addon.blender import opening
    from viewcam_addon.blender.rendering import cycles
    from viewcam_addon.blender.scenes.depsgraph import render_still
    from viewcam_addon.blender.scenes.export import export_scene
    from viewcam_addon.blender.scenes.ledger import Ledger
    from viewcam_addon.blender.temporary_settings import overridden, still_of_one_layer

    viewcam_addon.register()
    if contest.scene == "suzannes":
        suzannes.six(*contest.size)
    else:
        opening.open_blend(SCENES / f"{contest.scene}.blend")
    scene, ledger = bpy.context.scene, Ledger()
    view_layer, camera_object = scene.view_layers[0], scene.camera
    camera_object.virtual_pinhole.enabled = False  # else its lens would follow the resolution
    scene.render.resolution_x, scene.render.resolution_y = contest.size
    exported = export_scene(scene, view_layer, camera_object, ledger, lit=True)
    scene_file.write(exported, path)
    light = cycles.LightSettings(
        exported.film, exported.bounces.none if contest.level == "direct" else exported.bounces, contest.samples
    )

    def picture() -> float:
        with overridden() as overrides:
            still_of_one_layer(overrides, scene, view_layer, camera_object)
            cycles.override_settings(overrides, scene, view_layer, light)
            overrides.set(scene.render, "threads_mode", "FIXED")
            overrides.set(scene.render, "threads", threads)
            for remedy in ledger.remedies.values():
                remedy(overrides)
            return race.timed(lambda: render_still(scene))()

    return {"Cycles": picture}


def compare_needs(options: argparse.Namespace) -> None:
    """What a scene does not have costs nothing: its time beside that of the next lower level."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.json"
        with race.Contestant(prepare_cycles, Contest("studio", "direct", (640, 360), 1, 0), path, options.threads):
            scene = scene_file.read(path)
    dark = replace(scene, lamps=(), world=World())
    trace = partial(_trace, threads=options.threads)
    runners = {
        "geometry": trace(scene, "geometry", 1),
        "direct, nothing gives light, 64 samples": trace(dark, "direct", 64),
        "direct, 1 sample": trace(scene, "direct", 1),
        "path without bounces, 1 sample": trace(replace(scene, bounces=replace(scene.bounces, total=0)), "path", 1),
    }
    median = race.medians(race.run(runners, options.rounds))
    for name, seconds in median.items():
        print(f"{name:42}{seconds:7.3f} s  {seconds / median['geometry']:.2f} of level geometry")


def _trace(scene: Scene, level: str, samples: int, threads: int) -> race.Runner:
    return race.timed(lambda: render(scene, level, samples, threads=threads))


if __name__ == "__main__":
    sys.exit(main())
