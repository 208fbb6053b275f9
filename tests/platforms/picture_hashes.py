"""Hashes of what the core computes on this machine: `python picture_hashes.py THREADS SCENE.json…` prints it as JSON.

For each scene and level the SHA-256 of every pass, and that of the core's own functions. Needs NumPy alone.
"""

import hashlib
import json
import sys
from dataclasses import replace
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "tracer")]

import core_probes
import numpy as np

from viewcam_addon.tracer.render import render
from viewcam_addon.tracer.scene import scene_file

SIZE, SAMPLES, SEED = (64, 36), 2, 1


def sha256(values: np.ndarray) -> str:
    return hashlib.sha256(np.ascontiguousarray(values).tobytes()).hexdigest()[:16]


def hashes_of_pictures(path: Path, threads: int) -> dict[str, str]:
    """'scene level pass' → its hash."""
    scene = scene_file.read(path)
    scene = replace(scene, camera=scene.camera.resized(*SIZE))
    return {
        f"{path.stem} {level} {name}": sha256(values)
        for level in ("geometry", "direct", "path")
        for name, values in render(scene, level, SAMPLES, SEED, threads).items()
    }


def hashes_of_functions() -> dict[str, str]:
    """Function → the hash of its values, also beyond where it is stated to be right."""
    special = [0.0, 0.5, 1.0, 2.0, 1e-300, 1e300, 5e-324, 1e9, np.inf, np.nan, 1 / 3, 2000.0]
    numbers = np.array([*special, *(-x for x in special)])
    rng = np.random.default_rng(1)
    # Not by NumPy's own powers, whose last bits differ among processors.
    spread = np.ldexp(rng.uniform(1, 2, 2000) * rng.choice([-1, 1], 2000), rng.integers(-100, 100, 2000, np.int32))
    angles = np.concatenate([rng.uniform(-1, 1, 2000), [-1, -0.5, 0, 0.5, 1]])
    first, second = (each.ravel() for each in np.meshgrid(np.abs(numbers), numbers))
    with np.errstate(invalid="ignore"):
        values = {
            "sin of turns": core_probes.function("sin of turns", 1e6 * angles),
            "cos of turns": core_probes.function("cos of turns", 1e6 * angles),
            "asin": core_probes.function("asin", angles),
            "acos": core_probes.function("acos", angles),
            "atan2": core_probes.function("atan2", spread, np.roll(spread, 7)),
            "pow": core_probes.function("pow", np.abs(spread), np.roll(spread, 5) % 16),
            "pow of special numbers": core_probes.function("pow", first, second),
            "fresnel": core_probes.function("fresnel", np.abs(angles), 1 + np.abs(np.roll(angles, 3))),
        }
    # nan has many bit patterns, which mean the same.
    return {f"function {name}": sha256(np.where(np.isnan(each), np.nan, each)) for name, each in values.items()}


def main() -> None:
    threads, *scenes = sys.argv[1:]
    hashes = hashes_of_functions()
    for path in map(Path, scenes):
        hashes |= hashes_of_pictures(path, int(threads))
    print(json.dumps(hashes))


if __name__ == "__main__":
    main()
