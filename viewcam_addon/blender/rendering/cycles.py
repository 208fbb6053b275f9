"""Cycles' side of a comparison, in 32 bits: the passes of geometry through each pixel's center, or those of light.

The settings are those under which Cycles follows a pinhole best. Its first sample stands in the middle of the pixel but for a
bias of the filter table, 3e-6 px at the narrowest Blackman-Harris filter; adaptive sampling, denoising and light thresholds
would make of it something else. A picture of light is what the scene's own film and bounces make of it, without all that trades
truth for less noise: clamping, filtered gloss, culled lights, guesses of indirect light. Everything is overridden and restored.
"""

import errno
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import bpy

from ...errors import InputError
from ...files import written_whole
from ...image import GEOMETRY_PASSES, LIGHT_PASSES, SETTINGS
from ...tracer.scene.film import Bounces, Film
from .. import versions
from ..scenes import film
from ..scenes.depsgraph import render_still
from ..scenes.ledger import Remedy
from ..temporary_settings import Overrides, overridden, still_of_one_layer
from .exr import is_whole
from .picture_files import override_formats

_SAMPLING = {
    "device": "CPU",
    "samples": 1,
    "use_adaptive_sampling": False,
    "use_denoising": False,
    "time_limit": 0.0,
    "sample_offset": 0,
    "use_sample_subset": False,
    "pixel_filter_type": "BLACKMAN_HARRIS",
    "filter_width": 0.01,
    "light_sampling_threshold": 0.0,
    "use_light_tree": False,
    "use_layer_samples": "IGNORE",
    "film_exposure": 1.0,
    "use_camera_cull": False,
    "use_distance_cull": False,
}
_PASSES_OF_CENTERS = ("Depth", "Object Index")

# Pixels independent of each other, and nothing left out or guessed.
_LIGHT = {
    "use_animated_seed": False,
    "sampling_pattern": "TABULATED_SOBOL",
    "scrambling_distance": 1.0,
    "auto_scrambling_distance": False,
    "min_light_bounces": 0,
    "min_transparent_bounces": 1024,
    "sample_clamp_direct": 0.0,
    "sample_clamp_indirect": 0.0,
    "blur_glossy": 0.0,
    "direct_light_sampling_type": "MULTIPLE_IMPORTANCE_SAMPLING",
    "use_fast_gi": False,
    "use_guiding": False,
    "film_transparent_glass": False,
}
# Settings that the tracer has no choice about; a picture with everything in it has the scene's.
_LIGHT_OF_SURFACES = {
    "volume_bounces": 0,
    "caustics_reflective": True,
    "caustics_refractive": True,
    "shading_system": False,
    "texture_limit_render": "OFF",
    "texture_resolution_render": 1.0,
}


@dataclass(frozen=True)
class LightSettings:
    """A picture of light. samples : a pixel, in all; one is the pixel's center."""

    film: Film
    bounces: Bounces
    samples: int
    seed: int = 0


def render(
    scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer,
    camera_object: bpy.types.Object | None,
    path: str | os.PathLike[str],
    remedies: Iterable[Remedy] = (),
    threads: int | None = None,
    light: LightSettings | None = None,
    keep: bool = False,
    device: str = "CPU",
    everything: bool = False,
    lasting: Overrides | None = None,
) -> None:
    """Render one view layer at the current frame to a multilayer EXR, whole or not at all.

    camera_object : the camera; where None, the one that Blender chooses itself, as markers bind it.
    remedies : the changes that take out what is not modeled, for the time of the render (ledger.py).
    threads : the number of threads, all by default.
    light : the settings of a picture of light; None for the passes of geometry.
    keep : true to let Cycles keep what it has built, for the next render.
    everything : true to show hair, volumes and whatever else the tracer does not model.
    lasting : the overrides of all renders that share what remedies make.

    Raises InputError if Cycles is disabled or reports an error, or if the file can't be written.
    """
    if not hasattr(scene, "cycles"):
        raise InputError("Cycles is disabled: enable the add-on Cycles Render Engine in Blender's preferences")
    with overridden(lasting) as overrides:
        override_settings(overrides, scene, view_layer, light, everything)
        if device != "CPU":
            _override_device(overrides, scene, device)
        render_file(overrides, scene, view_layer, camera_object, path, remedies, threads, keep)


def render_file(
    overrides: Overrides,
    scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer,
    camera_object: bpy.types.Object | None,
    path: str | os.PathLike[str],
    remedies: Iterable[Remedy] = (),
    threads: int | None = None,
    keep: bool = False,
) -> None:
    """Render as `render` does, with the engine and the passes that are set already."""
    with written_whole(path) as temporary:
        still_of_one_layer(overrides, scene, view_layer, camera_object, keep)
        _override_file(overrides, scene, temporary)
        if threads:
            overrides.set(scene.render, "threads_mode", "FIXED")
            overrides.set(scene.render, "threads", threads)
        for remedy in remedies:
            remedy(overrides)
        render_still(scene, to_file=True)
        if not is_whole(temporary):
            raise OSError(errno.EIO, "Blender did not finish the file")


def override_settings(
    overrides: Overrides,
    scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer,
    light: LightSettings | None = None,
    everything: bool = False,
) -> None:
    """All settings but the file's; benchmarks render without one.

    light, everything : see `render`.
    """
    overrides.set(scene.render, "engine", "CYCLES")
    override_all(overrides, scene.cycles, _SAMPLING)
    passes = GEOMETRY_PASSES
    if light:
        overrides.set(scene.render, "film_transparent", light.film.transparent)
        override_all(overrides, scene.cycles, _LIGHT | _settings_of(light))
        passes = LIGHT_PASSES + (_PASSES_OF_CENTERS if light.samples == 1 else ())
    for setting in ("use_pass_combined", *(SETTINGS[name] for name in passes if name in SETTINGS)):
        overrides.set(view_layer, setting, True)
    if light and not light.bounces.parts_diffuse:
        overrides.set(view_layer, SETTINGS["Diffuse Indirect"], False)
    if not everything:
        override_all(overrides, scene.cycles, _LIGHT_OF_SURFACES if light else {})
        override_all(overrides, view_layer, {"use_strand": False, "use_volumes": False})


def _override_device(overrides: Overrides, scene: bpy.types.Scene, device: str) -> None:
    """Let Cycles render on all devices of a kind, and on no processor beside them."""
    preferences = bpy.context.preferences.addons["cycles"].preferences
    known = [kind for kind, *_ in preferences.get_device_types(bpy.context) if kind != "NONE"]
    devices = preferences.get_devices_for_type(device) if device in known else ()
    if not any(each.type == device for each in devices):
        others = f"those that this Blender knows are {', '.join(known)}" if known else "this Blender knows none"
        raise InputError(f"there is no {device} device that Cycles could render on ({others}): leave --device out, for the CPU")
    overrides.set(preferences, "compute_device_type", device)
    for each in devices:
        overrides.set(each, "use", each.type == device)
    overrides.set(scene.cycles, "device", "GPU")


def _settings_of(light: LightSettings) -> dict[str, object]:
    settings = {name: getattr(light.bounces, field) for field, name in film.BOUNCES.items()}
    settings |= {"samples": light.samples, "seed": light.seed % 2**31, "film_exposure": light.film.exposure}
    if light.samples > 1:
        settings |= {"pixel_filter_type": light.film.filter, "filter_width": light.film.filter_width}
        settings |= versions.without_first_sample(light.samples)
    return settings


def override_all(overrides: Overrides, owner: bpy.types.bpy_struct, settings: Mapping[str, object]) -> None:
    """Set the properties that this version has of those in `settings`."""
    for name, value in settings.items():
        if hasattr(owner, name):  # versions know fewer of them
            overrides.set(owner, name, value)


def _override_file(overrides: Overrides, scene: bpy.types.Scene, path: os.PathLike[str]) -> None:
    overrides.set(scene.render, "filepath", versions.literal_path(Path(path).absolute()))
    overrides.set(scene.render, "use_file_extension", False)
    overrides.set(scene.render, "use_overwrite", True)
    override_formats(overrides, scene)
    versions.set_multilayer_file(scene.render.image_settings)
