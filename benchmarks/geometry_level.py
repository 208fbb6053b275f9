"""How fast the tracer's geometry level is: beside Cycles on the same picture, and as a share of bare Embree on the same rays.

    python benchmarks/geometry_level.py [--size 1920x1080] [--rounds 7] [--threads N] [--levels 3]

Three subdivided Suzannes (190k triangles), one sample, the same passes on both sides. The rounds are interleaved, since a
machine's speed drifts: each runs Cycles without and with its file, then the tracer without and with its file, and the ratios
are those of the medians. Cycles runs in a process of its own, because OpenEXR must not be loaded beside Blender's own; its time
is that of the render call, the tracer's that of render() with all of its preparation.

Needs bpy, embreex and OpenEXR.
"""

import argparse
import multiprocessing
import os
import resource
import statistics
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

from viewcam_addon import image
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.terminal import silent_libraries
from viewcam_addon.tracer import scene_file, visibility
from viewcam_addon.tracer.render import TILE, Tracer, render
from viewcam_addon.tracer.scene import Scene
from viewcam_addon.tracer.triangles import triangles_of
from viewcam_addon.tracer.view import View


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", default="1920x1080", help="pixels, WIDTHxHEIGHT")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1, help="of every contestant")
    parser.add_argument("--levels", type=int, default=3, help="of subdivision")
    options = parser.parse_args()
    width, height = map(int, options.size.split("x"))
    context = multiprocessing.get_context("spawn")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        here, there = context.Pipe()
        blender = context.Process(target=_serve_cycles, args=(there, folder, width, height, options.levels, options.threads))
        blender.start()
        there.close()
        here.recv()
        scene = scene_file.read(folder / "scene.json")
        times = _race(here, scene, folder, options)
        megabytes = {side: (folder / f"{side}.exr").stat().st_size / 1e6 for side in ("cycles", "tracer")}
        here.send("stop")
        memory = {"tracer": _peak_memory(), "Cycles": here.recv()}
        blender.join()
    _report(times, megabytes, memory, scene, options)
    return 0


def _race(blender: Connection, scene: Scene, folder: Path, options: argparse.Namespace) -> dict[str, list[float]]:
    """Seconds of each contestant in each round, after one to warm up."""
    tracer = Tracer(scene, options.threads)
    bare = _bare_embree(scene, options.threads)
    times = defaultdict(list)

    def timed(name: str, work: Callable[[], object]) -> None:
        start = time.perf_counter()
        work()
        times[name].append(time.perf_counter() - start)

    for _ in range(options.rounds + 1):
        for name in ("Cycles", "Cycles and its file"):
            blender.send(name)
            times[name].append(blender.recv())
        timed("tracer", lambda: render(scene, threads=options.threads))
        timed(
            "tracer and its file",
            lambda: image.write(folder / "tracer.exr", image.Image(render(scene, threads=options.threads), scene.camera)),
        )
        timed("tracing and refining", tracer.render)
        timed("bare Embree", bare)
    return {name: seconds[1:] for name, seconds in times.items()}


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


def _serve_cycles(*arguments) -> None:
    """The process with Blender in it, which keeps its progress to itself."""
    with silent_libraries():
        _answer_with_cycles(*arguments)


def _answer_with_cycles(asked: Connection, folder: Path, width: int, height: int, levels: int, threads: int) -> None:
    """Write the scene, render when asked, and answer with the seconds."""
    import bpy

    import viewcam_addon
    from viewcam_addon.blender import cycles
    from viewcam_addon.blender.borrowing import borrowed, still_of_one_layer
    from viewcam_addon.blender.depsgraph import render_still
    from viewcam_addon.blender.export import export_scene
    from viewcam_addon.blender.ledger import Ledger

    viewcam_addon.register()
    scene, camera_object = _suzannes(width, height, levels)
    view_layer = scene.view_layers[0]
    ledger = Ledger()
    scene_file.write(export_scene(scene, view_layer, camera_object, ledger), folder / "scene.json")
    remedies = list(ledger.remedies.values())
    asked.send(bpy.app.version_string)
    while (name := asked.recv()) != "stop":
        start = time.perf_counter()
        if name == "Cycles":
            with borrowed() as borrow:
                still_of_one_layer(borrow, scene, view_layer, camera_object)
                cycles.borrow_settings(borrow, scene, view_layer)
                borrow.set(scene.render, "threads_mode", "FIXED")
                borrow.set(scene.render, "threads", threads)
                for remedy in remedies:
                    remedy(borrow)
                start = time.perf_counter()
                render_still(scene)
        else:
            cycles.render(scene, view_layer, camera_object, folder / "cycles.exr", remedies, threads)
        asked.send(time.perf_counter() - start)
    asked.send(_peak_memory())
    sys.stdout.flush()
    os._exit(0)  # bpy's own clean-up crashes in some versions


def _suzannes(width: int, height: int, levels: int):
    """Three smooth Suzannes with UV maps and materials, and a camera before them."""
    import bpy

    from viewcam_addon.blender import camera

    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    for index in range(3):
        bpy.ops.mesh.primitive_monkey_add(location=(2.4 * index - 2.4, 0, 0), rotation=(0, 0, 0.3 * index - 0.3))
        suzanne = bpy.context.object
        suzanne.pass_index = index + 1
        suzanne.data.materials.append(bpy.data.materials.new(f"paint {index}"))
        suzanne.data.polygons.foreach_set("use_smooth", [True] * len(suzanne.data.polygons))
        modifier = suzanne.modifiers.new("Subdivision", "SUBSURF")
        modifier.levels = modifier.render_levels = levels
    camera_object = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera_object)
    scene.render.resolution_x, scene.render.resolution_y = width, height
    pinhole = Pinhole((0.4, -6, 1.1), (0, 0, -0.1), (0, 0, 1), 1.45 * width / 1.92, width, height)
    camera.apply(camera_object, pinhole, scene)
    return scene, camera_object


def _peak_memory() -> float:
    """Megabytes; the operating system counts them in kilobytes, macOS in bytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e6 if sys.platform == "darwin" else 1e3)


def _report(times: dict, megabytes: dict, memory: dict, scene: Scene, options: argparse.Namespace) -> None:
    median = {name: statistics.median(seconds) for name, seconds in times.items()}
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
    print(f"peak memory: tracer {memory['tracer']:.0f} MB, Blender with Cycles {memory['Cycles']:.0f} MB")


if __name__ == "__main__":
    sys.exit(main())
