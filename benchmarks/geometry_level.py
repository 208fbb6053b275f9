"""How fast the tracer's geometry level is: beside Cycles on the same picture, and as a share of bare Embree on the same rays.

    python -m benchmarks.geometry_level [--size 1920x1080] [--rounds 7] [--threads N]

Three subdivided Suzannes (190k triangles), one sample, the same passes on both sides, each in a process of its own. The
picture: both sides have kept what they built for the frame before (Cycles' persistent data), and write no file. The whole job:
from the loaded scene to the EXR, nothing kept. What is wanted is said beside each figure; exit status 1 if one is missed.

Needs bpy, embreex and OpenEXR.
"""

import argparse
import contextlib
import functools
import os
import sys
import tempfile
from pathlib import Path

from benchmarks import race
from benchmarks.speed import bare_embree, tracer
from benchmarks.speed.stills import CYCLES, OURS, prepare_cycles

BARE = "bare Embree"
TIMES_CYCLES = {"picture": 3.0, "whole": 1.5}
SHARE_OF_EMBREE = 0.6
"""What is wanted at least."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", default="1920x1080", help="pixels, WIDTHxHEIGHT")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1, help="of every contestant")
    options = parser.parse_args()
    size = tuple(map(int, options.size.split("x")))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        times, megabytes, peaks = _measure(folder, size, options.rounds, options.threads)
    print(f"three Suzannes, {options.size}, {options.threads} threads, medians of {options.rounds} rounds\n")
    _show(times, size[0] * size[1])
    print("\nfiles:", ", ".join(f"{side} {size:.0f} MB" for side, size in megabytes.items()))
    print("peak memory:", ", ".join(f"{side} {peak:.0f} MB" for side, peak in peaks.items()), "\n")
    return 0 if _judge(race.medians(times)) else 1


def _measure(
    folder: Path, size: tuple[int, int], rounds: int, threads: int
) -> tuple[dict[tuple[str, str], list[float]], dict[str, float], dict[str, float]]:
    """Seconds of each side and figure in each round, and megabytes of files and of memory."""
    scene = folder / "scene.json"
    contestants = {}
    with contextlib.ExitStack() as processes:

        def start(side: str, *arguments: object, **options: object) -> None:
            contestants[side] = processes.enter_context(race.Contestant(*arguments, **options))

        start(CYCLES, prepare_cycles, "three suzannes", "geometry", size, scene, threads)  # writes the scene
        start(OURS, tracer.prepare, scene, "geometry", threads)
        runners = {
            (side, figure): functools.partial(runner, "samples", 1, 0, folder / f"{side}.exr")
            for figure in TIMES_CYCLES
            for side, contestant in contestants.items()
            for runner in [contestant.runners()[figure]]
        }
        start(BARE, bare_embree.prepare, scene, 0)
        runners[BARE, "picture"] = contestants[BARE].runners()["picture"]
        times = race.run(runners, rounds)
    megabytes = {path.stem: path.stat().st_size / 1e6 for path in sorted(folder.glob("*.exr"))}
    return times, megabytes, {side: contestant.peak_memory for side, contestant in contestants.items()}


def _show(times: dict[tuple[str, str], list[float]], rays: int) -> None:
    for (side, figure), seconds in times.items():
        median = race.medians(times)[side, figure]
        spread = f"{min(seconds):.3f} … {max(seconds):.3f}"
        print(f"{side:24}{figure:9}{median:7.3f} s  ({spread})  {rays / median / 1e6:6.2f} M rays/s")


def _judge(median: dict[tuple[str, str], float]) -> bool:
    """Say what is reached, and whether that is enough."""
    reached = [
        (f"{figure}, times as fast as Cycles", median[CYCLES, figure] / median[OURS, figure], wanted)
        for figure, wanted in TIMES_CYCLES.items()
    ]
    share = median[BARE, "picture"] / median[OURS, "picture"]
    reached.append(("picture, share of bare Embree's ray rate", share, SHARE_OF_EMBREE))
    for what, ratio, wanted in reached:
        print(f"{what:48}{ratio:6.2f}  at least {wanted:g}{'' if ratio >= wanted else ': MISSED'}")
    return all(ratio >= wanted for _, ratio, wanted in reached)


if __name__ == "__main__":
    sys.exit(main())
