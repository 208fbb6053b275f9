"""The guard of speed: the tracer's as a share of bare Embree's on the same rays, in one run, on any machine.

    python -m benchmarks.guard            # exit status 1 if a ratio has fallen by a third
    python -m benchmarks.guard --record   # write what is measured into guard.json, after a change that is meant

The yardstick is embreex alone, which this project does not change: rays that were made beforehand, in tiles over as many
threads. Tracer and yardstick take turns, and the median of their ratios counts, since a machine's speed drifts. Measured are:

- geometry: a picture of 1920 × 1080 with all passes. The yardstick traces a ray for each pixel.
- direct: light of a wide sun. The yardstick traces the eye's ray and the shadow ray of each sample.
- path: the same with interreflection, of a plain surface: what materials, textures and nodes can do must cost it nothing. The
  yardstick stays that of direct.
- adaptive: light of a sun without size, with a wanted error. The yardstick traces the rays of as many samples of each pixel as
  have, without a wanted error, the same RMS error.

Each is measured in a process of its own.
"""

import argparse
import json
import math
import multiprocessing
import os
import statistics
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from benchmarks import race
from viewcam_addon.files import written_whole
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import Tracer
from viewcam_addon.tracer.scene import Mesh, Object, Scene
from viewcam_addon.tracer.scene.lamps import Lamp, Sun

_SUN = Sun("Sun", towards=(-0.8, -0.3, 0.52), irradiance=(3.0, 3.0, 3.0))


def _ground(triangles: int, size: tuple[int, int], lamps: Sequence[Lamp] = (_SUN,)) -> Scene:
    """A hilly ground under a low sun: the square from −1 to 1 in one mesh of about so many triangles, seen from its border,
    with normals and UVs as artists' meshes have them. size : pixels across and down.
    """
    cells = max(1, round(math.sqrt(triangles / 2)))
    camera = Pinhole((0.3, -2.6, 1.9), (0, -0.05, 0), (0, 0, 1), 1.35 * size[0], *size)
    ground = Object("ground", "ground", np.eye(4))
    return Scene(camera, {"ground": _mesh(cells)}, (ground,), lamps=tuple(lamps))


def _mesh(cells: int) -> Mesh:
    """cells × cells squares of the ground, two triangles each."""
    along = np.linspace(-1, 1, cells + 1)
    x, y = (values.ravel() for values in np.meshgrid(along, along))
    height = 0.08 * np.sin(5 * x) * np.sin(4 * y) + 0.02 * np.sin(23 * x + 17 * y)
    slope_x = 0.4 * np.cos(5 * x) * np.sin(4 * y) + 0.46 * np.cos(23 * x + 17 * y)
    slope_y = 0.32 * np.sin(5 * x) * np.cos(4 * y) + 0.34 * np.cos(23 * x + 17 * y)
    normals = np.stack([-slope_x, -slope_y, np.ones_like(x)], axis=1)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).astype(np.int32).ravel()
    right, above = corner + np.int32(1), corner + np.int32(cells + 1)
    triangles = np.stack([corner, right, above, above, right, above + np.int32(1)], axis=1).reshape(-1, 3)
    return Mesh(
        np.stack([x, y, height], axis=1),
        triangles,
        np.zeros(len(triangles), np.int32),
        normals.astype(np.float32)[triangles],
        np.stack([x, y], axis=1).astype(np.float32)[triangles],
    )


Rays = NDArray[np.float32]
Ratios = dict[str, float]

RECORDED = Path(__file__).with_suffix(".json")

# A ratio that has fallen to less of what was recorded is a failure; the machine may be busy, so it is measured again.
LEAST, ATTEMPTS, ROUNDS = 2 / 3, 3, 5
_TRIANGLES, _TILE, _SIZE, _SAMPLES = 200_000, 65_536, (320, 180), 16
_WIDE_SUN = replace(_SUN, angle=0.2)
# A wanted error, the samples that it may take, those of the picture that it is measured against, and those on both sides of it.
_ERROR, _MOST, _CONVERGED, _FEW, _MANY = 0.01, 256, 128, 16, 64


def measure(names: Sequence[str], sabotage: Callable[[], None] | None = None) -> Ratios:
    """Each measured name → its ratio, in a process of its own. sabotage : picklable; called there before."""
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, spawn) as pool:
        return pool.submit(_measure, names, sabotage).result()


def fallen(measured: Ratios, recorded: Ratios) -> list[str]:
    """A sentence for each ratio that has fallen by a third or more."""
    return [
        f"{name}: {measured[name]:.2f} of the yardstick's speed, and {ratio:.2f} was recorded: it has fallen by a third"
        for name, ratio in recorded.items()
        if not measured[name] >= LEAST * ratio
    ]


def judged(recorded: Ratios) -> tuple[Ratios, list[str]]:
    """The best ratios of as many attempts as it takes, and what has fallen in all of them."""
    best: Ratios = dict.fromkeys(recorded, 0.0)
    for _ in range(ATTEMPTS):
        slow = [name for name in recorded if fallen(best, {name: recorded[name]})]
        best |= {name: max(best[name], ratio) for name, ratio in (measure(slow) if slow else {}).items()}
    return best, fallen(best, recorded)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--record", action="store_true", help=f"write {RECORDED.name}")
    options = parser.parse_args()
    if options.record:
        attempts = [measure(tuple(_MEASURES)) for _ in range(ATTEMPTS)]
        recorded = {name: round(statistics.median(ratios[name] for ratios in attempts), 2) for name in _MEASURES}
        with written_whole(RECORDED) as temporary:
            temporary.write_text(json.dumps(recorded, indent=2) + "\n", encoding="utf-8")
        print(json.dumps(recorded, indent=2))
        return 0
    recorded = json.loads(RECORDED.read_text(encoding="utf-8"))
    ratios, failed = judged(recorded)
    for name, ratio in ratios.items():
        print(f"{name}: {ratio:.2f} (recorded: {recorded[name]:.2f})")
    print(*failed, sep="\n", end="\n" if failed else "")
    return 1 if failed else 0


def _measure(names: Sequence[str], sabotage: Callable[[], None] | None) -> Ratios:
    if sabotage is not None:
        sabotage()
    return {name: _MEASURES[name]() for name in names}


def _geometry() -> float:
    scene = _ground(_TRIANGLES, (1920, 1080))
    return _share(Yardstick(scene).of_geometry(), Tracer(scene).render)


def _light(level: str) -> float:
    scene = _ground(_TRIANGLES, _SIZE, [_WIDE_SUN])
    tracer = Tracer(scene)
    return _share(Yardstick(scene).of_light(_SAMPLES), lambda: tracer.render_light(level, _SAMPLES, 0))


def _adaptive() -> float:
    scene = _ground(_TRIANGLES, _SIZE, [_SUN])
    tracer = Tracer(scene)

    def light(samples: int, seed: int, error: float | None = None) -> NDArray[np.float64]:
        return tracer.render_light("direct", samples, seed, error=error)["Combined"].astype(np.float64)

    converged = light(_CONVERGED, 1)
    few, many, adaptive = (
        math.log(np.square(light(*effort) - converged).mean()) for effort in ((_FEW, 0), (_MANY, 0), (_MOST, 0, _ERROR))
    )
    worth = _FEW * (_MANY / _FEW) ** ((few - adaptive) / (few - many))
    return worth / _SAMPLES * _share(Yardstick(scene).of_light(_SAMPLES), lambda: light(_MOST, 0, _ERROR))


_MEASURES = {"geometry": _geometry, "direct": partial(_light, "direct"), "path": partial(_light, "path"), "adaptive": _adaptive}


def _share(yardstick: Callable[[], object], work: Callable[[], object]) -> float:
    """The median of the yardstick's time over that of the work, in rounds of both."""
    times = race.run({"yardstick": race.timed(yardstick), "work": race.timed(work)}, ROUNDS)
    return statistics.median(bare / ours for bare, ours in zip(times["yardstick"], times["work"], strict=True))


class Yardstick:
    """embreex and nothing else: a scene of meshes, counted from the eye, in float32."""

    def __init__(self, scene: Scene) -> None:
        self._camera, eye = scene.camera, np.array(scene.camera.eye)
        self._embree = EmbreeScene(robust=True)
        for placed in scene.objects:
            mesh = scene.geometries[placed.geometry]
            for matrix in placed.matrices:
                vertices = mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3]
                TriangleMesh(self._embree, (vertices - eye).astype(np.float32), mesh.triangles)
        self._embree.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))  # builds the hierarchy

    def of_geometry(self) -> Callable[[], None]:
        """A function that traces the eye's rays through the pixels' centers."""
        directions = self._eye_rays(0.5, 0.5)
        eyes = np.zeros_like(directions)
        return lambda: self._trace(eyes, directions)

    def of_light(self, samples: int, sun: Sun = _WIDE_SUN) -> Callable[[], None]:
        """A function that traces the rays of so many samples of each pixel, the eye's and those towards a sun."""
        rng = np.random.default_rng(0)
        pixels = self._camera.width * self._camera.height
        directions = np.concatenate([self._eye_rays(*rng.random((2, pixels))) for _ in range(samples)])
        eyes, points = np.zeros_like(directions), self._points(directions)
        towards = self._towards(sun, len(points))

        def trace() -> None:
            self._trace(eyes, directions)
            self._trace(points, towards, "OCCLUDED")

        return trace

    def _eye_rays(self, px: float | NDArray[np.float64], py: float | NDArray[np.float64]) -> Rays:
        """Directions through points of all pixels, row by row."""
        rows, columns = np.divmod(np.arange(self._camera.width * self._camera.height), self._camera.width)
        return self._camera.ray_directions(columns, rows, px, py).astype(np.float32)

    def _points(self, directions: Rays) -> Rays:
        """Points where rays from the eye meet the mesh, a little before it; those that meet nothing are left out."""
        actual = self._embree.run(np.zeros_like(directions), directions, output=True)
        met = actual["geomID"] >= 0
        return directions[met] * (actual["tfar"][met, None] * np.float32(1 - 1e-4))

    def _towards(self, sun: Sun, count: int) -> Rays:
        """Directions into the disc of a sun."""
        aside = np.random.default_rng(1).normal(size=(count, 3)) * math.tan(sun.angle / 4)
        return (np.array(sun.towards) + aside).astype(np.float32)

    def _trace(self, origins: Rays, directions: Rays, query: str = "INTERSECT") -> None:
        """All rays, in tiles over all cores."""

        def tile(first: int) -> None:
            batch = slice(first, first + _TILE)
            self._embree.run(origins[batch], directions[batch], query=query)

        with ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(tile, range(0, len(origins), _TILE)))


if __name__ == "__main__":
    sys.exit(main())
