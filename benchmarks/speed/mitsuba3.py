"""Mitsuba 3 as a contestant, where it is installed: the tracer's scene as Mitsuba's own files, loaded by a process of its own.

Meshes with Lambert surfaces under suns without size, which is all that six Suzannes need. mitsuba_job.py loads what is written
here, and is the whole job from a fresh process. Mitsuba has no filter of Blackman and Harris's: it is raced with the box, for
which a sample belongs to one pixel.

The variant llvm_ad_rgb needs LLVM 16 or newer (Debian's libllvm19, or DRJIT_LIBLLVM_PATH).
"""

import importlib.util
import json
import math
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewcam_addon import image
from viewcam_addon.errors import InputError
from viewcam_addon.tracer.scene import Mesh, Scene, scene_file
from viewcam_addon.tracer.scene.lamps import Sun
from viewcam_addon.tracer.scene.materials import PLAIN

from .. import race

LLVM, SCALAR = "llvm_ad_rgb", "scalar_rgb"
JOB = Path(__file__).with_name("mitsuba_job.py")


def variants() -> tuple[str, ...]:
    """The variants that run here, none without Mitsuba. LLVM ends the process where it can't be used: so in another."""
    if importlib.util.find_spec("mitsuba") is None:
        return ()
    return tuple(variant for variant in (LLVM, SCALAR) if _runs(variant))


def _runs(variant: str) -> bool:
    program = f"import mitsuba as m; m.set_variant({variant!r}); import numpy; "
    program += "numpy.array(m.render(m.load_dict(m.cornell_box()), spp=1))"
    return subprocess.run([sys.executable, "-c", program], capture_output=True, check=False).returncode == 0


def prepare(scene_path: Path, folder: Path, variant: str, threads: int) -> dict[str, race.Runner]:
    """In the contestant's process.

    folder : the folder for Mitsuba's files.
    """
    import drjit
    import mitsuba

    from . import mitsuba_job

    mitsuba.set_variant(variant)
    drjit.set_thread_count(threads)
    write(scene_file.read(scene_path), folder)
    scene, camera = mitsuba_job.load(folder), scene_file.read(scene_path).camera
    compiled = set()

    def picture(sampling: str, parameter: float, seed: int, path: Path) -> float:
        sampler = "multijitter" if sampling == "samples" else sampling
        sensor = mitsuba_job.sensor(folder, sampler, int(parameter))

        def render(number: int) -> NDArray[np.float32]:
            return np.array(mitsuba.render(scene, sensor=sensor, spp=int(parameter), seed=number))

        if (sampling, parameter) not in compiled:  # its kernels differ by their numbers
            render(0)
            compiled.add((sampling, parameter))
        started = time.perf_counter()
        pixels = render(seed)
        seconds = time.perf_counter() - started
        rgb = pixels[::-1, :, :3]
        image.write(path, image.Image({"Combined": np.dstack([rgb, np.ones_like(rgb[..., :1])])}, camera))
        return seconds

    return {"picture": picture}


def fresh(folder: Path, variant: str, threads: int) -> race.Runner:
    """A runner from a fresh process to the EXR."""

    def runner(sampling: str, parameter: float, seed: int, path: Path) -> float:
        expected = path.with_name("mitsuba.exr")
        arguments = [folder, variant, sampling, int(parameter), seed, threads, expected]
        started = time.perf_counter()
        subprocess.run([sys.executable, JOB, *map(str, arguments)], check=True, stdout=subprocess.DEVNULL)
        seconds = time.perf_counter() - started
        _as_combined(expected, path)
        return seconds

    return runner


def write(scene: Scene, folder: Path) -> None:
    """Mitsuba's files of a scene, for mitsuba_job.load.

    Raises InputError if the scene has anything that is not translated here.
    """
    import mitsuba

    from . import mitsuba_job

    folder.mkdir(exist_ok=True)
    document: dict[str, Any] = {"camera": _camera(scene), "objects": [], "suns": []}
    for number, placed in enumerate(scene.objects):
        geometry = scene.geometries[placed.geometry]
        material = scene.materials.get(placed.materials[0], PLAIN) if placed.materials else PLAIN
        is_matte = [each.node.type for each in material.closures] == ["diffuse"]
        if not isinstance(geometry, Mesh) or not is_matte or len(set(placed.materials)) > 1:
            raise InputError(f"object {placed.name!r} is more than one matte mesh: race Mitsuba on another scene")
        smooth = geometry.corner_normals is not None
        for place, matrix in enumerate(placed.matrices):
            file = folder / f"{number}.{place}.ply"
            _mesh(mitsuba, geometry, placed.name, matrix).write_ply(str(file))
            document["objects"].append({"file": file.name, "smooth": smooth, "color": material.surface["color"].rgb})
    for lamp in scene.lamps:
        if not isinstance(lamp, Sun) or lamp.angle:
            raise InputError(f"light {lamp.name!r} is no sun without size: race Mitsuba on another scene")
        document["suns"].append({"direction": [-x for x in lamp.towards], "irradiance": list(lamp.irradiance)})
    (folder / mitsuba_job.SCENE).write_text(json.dumps(document), encoding="utf-8")


def _camera(scene: Scene) -> dict[str, Any]:
    camera = scene.camera
    if camera.principal_point != (camera.width / 2, camera.height / 2) or camera.distance[0] != camera.distance[1]:
        raise InputError("the camera is shifted or its pixels are not square: race Mitsuba on another scene")
    fov = math.degrees(2 * math.atan(camera.width / 2 / camera.distance[0]))
    pose = {name: list(getattr(camera, name)) for name in ("eye", "look_at", "up")}
    return pose | {"fov": fov, "width": camera.width, "height": camera.height, "clip": list(scene.clip)}


def _mesh(mitsuba: Any, geometry: Mesh, name: str, matrix: NDArray[np.float64]) -> Any:
    """World space; a vertex for each normal that it has."""
    linear, offset = matrix[:3, :3], matrix[:3, 3]
    corners, normals = geometry.triangles, None
    if geometry.corner_normals is not None:
        turned = geometry.corner_normals.reshape(-1, 3) @ np.linalg.inv(linear)
        keys = np.column_stack([corners.reshape(-1, 1), turned.astype(np.float32).view(np.int32)])
        keys, corners = np.unique(keys, axis=0, return_inverse=True)
        vertices, normals = geometry.vertices[keys[:, 0]], np.ascontiguousarray(keys[:, 1:], np.int32).view(np.float32)
        normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    else:
        vertices = geometry.vertices
    mesh = mitsuba.Mesh(name, len(vertices), corners.size // 3, has_vertex_normals=normals is not None)
    parameters = mitsuba.traverse(mesh)
    parameters["vertex_positions"] = _flat(vertices @ linear.T + offset)
    parameters["faces"] = corners.reshape(-1).astype(np.uint32)
    if normals is not None:
        parameters["vertex_normals"] = _flat(normals)
    parameters.update()
    return mesh


def _flat(values: NDArray[np.floating]) -> NDArray[np.float32]:
    return np.ascontiguousarray(values, np.float32).reshape(-1)


def _as_combined(mitsuba_picture: Path, path: Path) -> None:
    """Mitsuba's R, G and B as our Combined."""
    import OpenEXR

    channels = OpenEXR.File(str(mitsuba_picture), separate_channels=True).channels()
    rgb = np.dstack([channels[letter].pixels for letter in "RGB"])[::-1]
    image.write(path, image.Image({"Combined": np.dstack([rgb, np.ones_like(rgb[..., :1])])}))
