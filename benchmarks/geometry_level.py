"""How fast the tracer's geometry level is: beside Cycles on the same picture, and as a share of bare Embree on the same rays.

    python -m benchmarks.geometry_level [--size 1920x1080] [--rounds 7] [--threads N] [--levels 3]

Three subdivided Suzannes (190k triangles), one sample, the same passes on both sides. Each round runs Cycles without and with
its file, then the tracer without and with its file. Cycles' time is that of the render call, the tracer's that of render() with
all of its preparation.

Needs bpy, embreex and OpenEXR.
"""

import argparse
import os
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from benchmarks import memory, race
from viewcam_addon import image
from viewcam_addon.tracer.rays import visibility
from viewcam_addon.tracer.rays.triangles import triangles_of
from viewcam_addon.tracer.rays.view import View
from viewcam_addon.tracer.render import TILE, Tracer, render
from viewcam_addon.tracer.scene import Scene, scene_file


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", default="1920x1080", help="pixels, WIDTHxHEIGHT")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1, help="of every contestant")
    parser.add_argument("--levels", type=int, default=3, help="of subdivision")
    options = parser.parse_args()
    width, height = map(int, options.size.split("x"))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with race.Contestant(prepare_cycles, folder, width, height, options.levels, options.threads) as blender:
            scene = scene_file.read(folder / "scene.json")
            times = race.run(blender.runners() | _tracer_runners(scene, folder, options.threads), options.rounds)
        megabytes = {side: (folder / f"{side}.exr").stat().st_size / 1e6 for side in ("cycles", "tracer")}
    peaks = {"tracer": memory.peak() / 1e6, "Cycles": blender.peak_memory}
    _report(times, megabytes, peaks, scene, options)
    return 0


def _tracer_runners(scene: Scene, folder: Path, threads: int) -> dict[str, race.Runner]:
    tracer = Tracer(scene, threads)

    def with_file() -> None:
        image.write(folder / "tracer.exr", image.Image(render(scene, threads=threads), scene.camera))

    return {
        "tracer": race.timed(lambda: render(scene, threads=threads)),
        "tracer and its file": race.timed(with_file),
        "tracing and refining": race.timed(tracer.render),
        "bare Embree": race.timed(_bare_embree(scene, threads)),
    }


def _bare_embree(scene: Scene, threads: int) -> Callable[[], object]:
    """Embree's work and nothing else: the same rays, made beforehand, in the same tiles, for the triangle's number alone."""
    camera, view = scene.camera, View(scene.camera)
    triangles = triangles_of([(placed, scene.geometries[placed.geometry]) for placed in scene.objects], view)
    embree = visibility.embree_scene(triangles.vertices.T, triangles.corners.T)
    rows, columns = np.divmod(np.arange(camera.width * camera.height), camera.width)
    directions = np.stack([*camera.view_plane(columns + 0.5, rows + 0.5), np.ones(len(rows))], axis=1).astype(np.float32)
    origins = directions * np.float32(scene.clip[0])

    def trace(first: int) -> None:
        embree.run(origins[first : first + TILE], directions[first : first + TILE])

    def work() -> None:
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(trace, range(0, len(directions), TILE)))

    return work


def prepare_cycles(folder: Path, width: int, height: int, levels: int, threads: int) -> dict[str, race.Runner]:
    """In Blender's process: write the scene, and offer Cycles' renders."""
    import viewcam_addon
    from benchmarks import suzannes
    from viewcam_addon.blender import cycles
    from viewcam_addon.blender.borrowing import borrowed, still_of_one_layer
    from viewcam_addon.blender.depsgraph import render_still
    from viewcam_addon.blender.export import export_scene
    from viewcam_addon.blender.ledger import Ledger

    viewcam_addon.register()
    scene, camera_object = suzannes.three(width, height, levels)
    view_layer = scene.view_layers[0]
    ledger = Ledger()
    scene_file.write(export_scene(scene, view_layer, camera_object, ledger), folder / "scene.json")
    remedies = list(ledger.remedies.values())

    def picture() -> float:
        with borrowed() as borrow:
            still_of_one_layer(borrow, scene, view_layer, camera_object)
            cycles.borrow_settings(borrow, scene, view_layer)
            borrow.set(scene.render, "threads_mode", "FIXED")
            borrow.set(scene.render, "threads", threads)
            for remedy in remedies:
                remedy(borrow)
            return race.timed(lambda: render_still(scene))()

    def with_file() -> None:
        cycles.render(scene, view_layer, camera_object, folder / "cycles.exr", remedies, threads)

    return {"Cycles": picture, "Cycles and its file": race.timed(with_file)}


def _report(times: dict, megabytes: dict, peaks: dict, scene: Scene, options: argparse.Namespace) -> None:
    median = race.medians(times)
    triangles = sum(len(scene.geometries[placed.geometry].triangles) for placed in scene.objects)
    rays = scene.camera.width * scene.camera.height
    print(f"{triangles} triangles, {options.size}, {options.threads} threads, {options.rounds} rounds\n")
    for name, seconds in times.items():
        spread = f"{min(seconds):.3f} … {max(seconds):.3f}"
        print(f"{name:22}{median[name]:7.3f} s  ({spread})  {rays / median[name] / 1e6:6.2f} M rays/s")

    def line(what: str, slower: str, faster: str, target: str, form: str) -> None:
        print(f"{what:44}{format(median[slower] / median[faster], form):>7}  {target}")

    print()
    line("tracer against Cycles, times as fast", "Cycles", "tracer", "at least 1.5", ".2f")
    line("the same with the files", "Cycles and its file", "tracer and its file", "at least 1", ".2f")
    line("share of bare Embree, tracing and refining", "bare Embree", "tracing and refining", "at least 40 %", ".0%")
    line("share of bare Embree, with all preparation", "bare Embree", "tracer", "", ".0%")
    print()
    print(f"files: tracer {megabytes['tracer']:.0f} MB, Cycles {megabytes['cycles']:.0f} MB")
    print(f"peak memory: tracer {peaks['tracer']:.0f} MB, Blender with Cycles {peaks['Cycles']:.0f} MB")


if __name__ == "__main__":
    sys.exit(main())
