"""Cycles as a contestant, in a process with Blender in it."""

import contextlib
import importlib
import sys
from dataclasses import replace
from pathlib import Path

import bpy

import viewcam_addon
from viewcam_addon.blender import camera, opening, versions
from viewcam_addon.blender.rendering import cycles
from viewcam_addon.blender.scenes.depsgraph import render_still
from viewcam_addon.blender.scenes.export import export_scene
from viewcam_addon.blender.scenes.ledger import Ledger, Remedy
from viewcam_addon.blender.temporary_settings import Overrides, still_of_one_layer
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.scene import scene_file

from .. import race

SCENES = Path(__file__).resolve().parents[2] / "sample_scenes"

# The most samples of a pixel where a noise threshold is asked for: Blender's own limit.
_MOST_SAMPLES = 4096


def prepare(
    scene_name: str, level: str, size: tuple[int, int], path: Path, threads: int, for_mitsuba: bool = False
) -> dict[str, race.Runner]:
    """In Blender's process: write the scene, and offer renders.

    scene_name : the name of a sample scene or of one of sample_scenes/materials.py, "suzannes" for six of them or "three
        suzannes".
    path : the file for the tracer's scene.
    for_mitsuba : through a box filter and without materials, which is what mitsuba3.py translates.
    """
    viewcam_addon.register()
    if scene_name in _SUZANNES:
        _SUZANNES[scene_name](*size)
    elif (blend := SCENES / f"{scene_name}.blend").exists():
        opening.open_blend(blend)
    else:
        sys.path.insert(0, str(SCENES))
        importlib.import_module("materials").BUILDERS[scene_name]()
    scene, ledger = bpy.context.scene, Ledger()
    view_layer, camera_object = scene.view_layers[0], scene.camera
    camera_object.virtual_pinhole.enabled = False  # else its lens would follow the resolution
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = *size, 100
    if for_mitsuba:
        scene.cycles.pixel_filter_type = "BOX"
    exported = export_scene(scene, view_layer, camera_object, ledger, lit=level != "geometry")
    if for_mitsuba:
        exported = replace(exported, objects=tuple(replace(placed, materials=()) for placed in exported.objects))
    scene_file.write(exported, path)

    def light(sampling: str, parameter: float, seed: int) -> cycles.LightSettings | None:
        if level == "geometry":
            return None
        samples = int(parameter) if sampling == "samples" else _MOST_SAMPLES
        return cycles.LightSettings(
            exported.film, exported.bounces.none if level == "direct" else exported.bounces, samples, seed
        )

    overrides = Overrides(contextlib.ExitStack())  # given back with the process
    still_of_one_layer(overrides, scene, view_layer, camera_object)
    overrides.set(scene.render, "threads_mode", "FIXED")
    overrides.set(scene.render, "threads", threads)
    for remedy in ledger.remedies.values():
        remedy(overrides)
    versions.set_multilayer_file(scene.render.image_settings)
    scene.render.use_persistent_data = True

    def picture(sampling: str, parameter: float, seed: int, file: Path) -> float:
        cycles.override_settings(overrides, scene, view_layer, light(sampling, parameter, seed))
        _adaptive(scene, sampling, parameter)(overrides)
        scene.update_tag()  # or the samples would be kept as well
        view_layer.update()
        seconds = race.timed(lambda: render_still(scene))()
        bpy.data.images["Render Result"].save_render(str(file), scene=scene)
        return seconds

    def whole(sampling: str, parameter: float, seed: int, file: Path) -> float:
        """Nothing is kept: the call switches that off for its time."""
        chosen, threshold = light(sampling, parameter, seed), _adaptive(scene, sampling, parameter)
        return race.timed(lambda: cycles.render(scene, view_layer, camera_object, file, [threshold], threads, chosen))()

    return {"picture": picture, "whole": whole}


def _adaptive(scene: bpy.types.Scene, sampling: str, parameter: float) -> Remedy:
    """Cycles' own adaptive sampling, where a noise threshold is asked for: settings that come after all others."""

    def set_all(overrides: Overrides) -> None:
        if sampling == "error":
            overrides.set(scene.cycles, "use_adaptive_sampling", True)
            overrides.set(scene.cycles, "adaptive_threshold", parameter)
            overrides.set(scene.cycles, "adaptive_min_samples", 0)  # Cycles' own choice, by the threshold
            overrides.set(scene.cycles, "use_sample_subset", False)
            overrides.set(scene.cycles, "samples", _MOST_SAMPLES)

    return set_all


def _three_suzannes(width: int, height: int) -> tuple[bpy.types.Scene, bpy.types.Object]:
    """Smooth Suzannes with UV maps and materials; returns the scene and the camera before them."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    for index in range(3):
        bpy.ops.mesh.primitive_monkey_add(location=(2.4 * index - 2.4, 0, 0), rotation=(0, 0, 0.3 * index - 0.3))
        suzanne = bpy.context.object
        suzanne.pass_index = index + 1
        suzanne.data.materials.append(bpy.data.materials.new(f"paint {index}"))
        suzanne.data.polygons.foreach_set("use_smooth", [True] * len(suzanne.data.polygons))
        modifier = suzanne.modifiers.new("Subdivision", "SUBSURF")
        modifier.levels = modifier.render_levels = 3
    camera_object = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera_object)
    scene.render.resolution_x, scene.render.resolution_y = width, height
    pinhole = Pinhole((0.4, -6, 1.1), (0, 0, -0.1), (0, 0, 1), 1.45 * width / 1.92, width, height)
    camera.apply(camera_object, pinhole, scene)
    scene.camera = camera_object
    return scene, camera_object


def _six_suzannes(width: int, height: int) -> tuple[bpy.types.Scene, bpy.types.Object]:
    """Two rows of them on a floor under a sun without size: 377,858 triangles, and the edges of shadows."""
    scene, camera_object = _three_suzannes(width, height)
    for suzanne in [each for each in scene.objects if each.type == "MESH"]:
        copy = suzanne.copy()
        copy.data = suzanne.data.copy()
        copy.location = (suzanne.location.x, 2.5, 0.6)
        copy.pass_index += 3
        scene.collection.objects.link(copy)
    bpy.ops.mesh.primitive_plane_add(size=60, location=(0, 0, -1))
    bpy.ops.object.light_add(type="SUN", rotation=(0.8, 0.3, 0.2))
    sun = bpy.context.object.data
    sun.energy, sun.angle = 3, 0
    return scene, camera_object


_SUZANNES = {"suzannes": _six_suzannes, "three suzannes": _three_suzannes}
