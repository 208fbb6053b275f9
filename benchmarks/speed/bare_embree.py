"""The yardstick: Embree's work on the same rays, made beforehand, and nothing else."""

from pathlib import Path

import numpy as np

from viewcam_addon.tracer.scene import scene_file

from .. import race
from ..guard import Yardstick


def prepare(scene_path: Path, samples: int) -> dict[str, race.Runner]:
    """Runners: through the pixels' centers; or, of so many samples a pixel, the eye's and those to the first lamp, a sun."""
    scene = scene_file.read(scene_path)
    yardstick = Yardstick(scene)
    if not samples:
        directions = yardstick.eye_rays(0.5, 0.5)
        eyes = yardstick.eyes(directions)
        return {"picture": race.timed(lambda: yardstick.trace(eyes, directions))}
    rng = np.random.default_rng(0)
    pixels = scene.camera.width * scene.camera.height
    directions = np.concatenate([yardstick.eye_rays(*rng.random((2, pixels))) for _ in range(samples)])
    eyes, points = yardstick.eyes(directions), yardstick.points(directions)
    towards = yardstick.towards(scene.lamps[0], len(points))

    def light() -> None:
        yardstick.trace(eyes, directions)
        yardstick.trace(points, towards, "OCCLUDED")

    return {"picture": race.timed(light)}
