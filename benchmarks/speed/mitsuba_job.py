"""Mitsuba's whole job from a fresh process, and how it loads a scene. What this project would import takes time: nothing is.

python mitsuba_job.py FOLDER VARIANT SAMPLER SAMPLES SEED THREADS OUT.exr
"""

import json
import os
import sys
from pathlib import Path
from typing import Any

import drjit
import mitsuba

SCENE = "mitsuba.json"


def main() -> None:
    folder, variant, sampler, samples, seed, threads, path = sys.argv[1:]
    mitsuba.set_variant(variant)
    drjit.set_thread_count(int(threads))
    scene, camera = load(Path(folder)), sensor(Path(folder), sampler, int(samples))
    picture = mitsuba.render(scene, sensor=camera, spp=int(samples), seed=int(seed))
    mitsuba.Bitmap(picture).write(path)
    os._exit(0)


def load(folder: Path) -> Any:
    """Mitsuba's scene, without a sensor."""
    document = json.loads((folder / SCENE).read_text(encoding="utf-8"))
    scene: dict[str, Any] = {
        "type": "scene",
        # No ray is spent on finding by chance a sun that has no size.
        "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0},
    }
    for number, placed in enumerate(document["objects"]):
        color = {"type": "diffuse", "reflectance": {"type": "rgb", "value": placed["color"]}}
        scene[f"object {number}"] = {
            "type": "ply",
            "filename": str(folder / placed["file"]),
            "face_normals": not placed["smooth"],
            "bsdf": {"type": "twosided", "nested": color},
        }
    for number, sun in enumerate(document["suns"]):
        irradiance = {"type": "rgb", "value": sun["irradiance"]}
        scene[f"sun {number}"] = {"type": "directional", "direction": sun["direction"], "irradiance": irradiance}
    return mitsuba.load_dict(scene)


def sensor(folder: Path, sampler: str, samples: int) -> Any:
    camera = json.loads((folder / SCENE).read_text(encoding="utf-8"))["camera"]
    film = {key: camera[key] for key in ("width", "height")} | {"type": "hdrfilm", "pixel_format": "rgb"}
    film |= {"component_format": "float32", "rfilter": {"type": "box"}}
    return mitsuba.load_dict(
        {
            "type": "perspective",
            "to_world": mitsuba.ScalarTransform4f().look_at(camera["eye"], camera["look_at"], camera["up"]),
            "fov": camera["fov"],
            "fov_axis": "x",
            "near_clip": camera["clip"][0],
            "far_clip": camera["clip"][1],
            "film": film,
            "sampler": {"type": sampler, "sample_count": samples},
        }
    )


if __name__ == "__main__":
    main()
