"""The render engine "Virtual Pinhole Reference": F12 and `blender -b FILE -E VIEWCAM -f 1` show what the tracer computes.

The scene is what the depsgraph holds that Blender hands to an engine, read as `viewcam export` reads it; nothing in it changes.
What goes wrong is reported, which ends `blender -b` with status 1 and without a file.

Level `geometry` knows no light: its Combined shows surfaces as a lamp at the eye would, by the cosine between ray and normal.

Light refines over the whole picture, step by step, the final one with the bits that it has at once.

What is prepared for one picture serves all passes of a frame, and the next frames as well where Blender's "Persistent Data" is
on, which keeps the engine. The scene is read anew for each, except in a batch (`keeps_scene`).

In the viewport's Rendered shading live_view.py traces; here it is told of scene and view, and its picture is drawn.

Rejected: a result that is begun once and updated, which Blender would copy whole for each band of rows.
"""

import contextlib
import queue
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ... import errors
from ...errors import InputError
from ...image import CHANNELS, GEOMETRY_PASSES, SETTINGS
from ...terminal import plain
from ...tracer.scene import Scene, least_level
from ...tracer.scene.film import LEVELS, refinement
from ...tracer.tiles import Passes
from .. import datablocks, versions
from ..scenes import export
from ..scenes.depsgraph import only_cameras_changed
from ..scenes.ledger import Ledger
from . import live_view
from .live_view import LiveView, lit_from_the_eye, of_clay

if TYPE_CHECKING:
    from ...tracer.render import Keeper

_PATIENCE = 0.05
"""Seconds between two looks at whether it is canceled."""


class _Watcher:
    """The receiver of what the tracer tells and asks, from its threads."""

    def __init__(self) -> None:
        self.bands: queue.SimpleQueue[tuple[Passes, range] | None] = queue.SimpleQueue()
        self.canceled = threading.Event()

    def tile(self, passes: Passes, rows: range) -> None:
        self.bands.put((passes, rows))

    def stop(self) -> bool:
        return self.canceled.is_set()


def keeper() -> "Keeper":
    """The store in which `bands` keeps what pictures share."""
    from ...tracer.render import Keeper  # loads the tracer, which Blender's start need not wait for

    return Keeper()


def bands(
    scene: Scene,
    level: str,
    samples: int,
    seed: int,
    threads: int,
    is_canceled: Callable[[], bool],
    keeper: "Keeper | None" = None,
    steps: Sequence[int] = (),
) -> Iterator[tuple[Passes, range]]:
    """Trace a scene in a thread of its own, and give what is finished: the passes of the whole picture, and the rows of them
    that are new.

    Blender may be spoken to only in the thread in which it calls an engine: that thread looks every few milliseconds whether
    the artist canceled, while the tracer's threads know nothing of Blender. Rejected: tracing in Blender's own thread, which
    can't ask for Escape before a band is finished.

    is_canceled : asked in the caller's thread. When it says so, or when the caller takes no more, tracing ends at once.
    keeper, steps : see tracer.render.render; with steps, all rows come again at each.

    Raises InputError as tracer.render.render does.
    """
    from ...tracer.render import render

    watcher = _Watcher()
    with ThreadPoolExecutor(1, "viewcam") as pool:
        tracing = pool.submit(render, scene, level, samples, seed, threads, watcher, keeper=keeper, steps=steps)
        tracing.add_done_callback(lambda _: watcher.bands.put(None))
        try:
            while not is_canceled():
                with contextlib.suppress(queue.Empty):
                    band = watcher.bands.get(timeout=_PATIENCE)
                    if band is None:
                        break
                    yield band
            else:
                return
        finally:
            watcher.canceled.set()
            # An error's frames hold the tracer, in a circle; where Python 3.14 broke it by itself, Blender 5.2 crashed.
            if error := tracing.exception():
                traceback.clear_frames(error.__traceback__)
    tracing.result()  # raises what was raised there


_GEOMETRY = LEVELS[0]


class VIEWCAM_RenderEngine(bpy.types.RenderEngine):
    bl_idname = "VIEWCAM"
    bl_label = "Virtual Pinhole Reference"
    bl_use_preview = False
    bl_use_eevee_viewport = True
    bl_use_shading_nodes_custom = False
    # For a batch: whether the scene, once it is read, serves all pictures until Blender tells of a change. An artist may change
    # what Blender does not tell of.
    keeps_scene = False
    # The level at which the last picture was traced, and what of it is not modeled as it is, one sentence each.
    level = _GEOMETRY
    warnings: tuple[str, ...] = ()
    _keeper = None
    _read = None  # true if light was read, and the scene
    # The tracer of a viewport, and what was drawn there last as a texture, with its picture.
    _live: LiveView | None = None
    _texture: tuple | None = None

    def update_render_passes(self, scene: bpy.types.Scene, renderlayer: bpy.types.ViewLayer) -> None:
        for name in _asked_for(scene, renderlayer):
            letters = CHANNELS[name]
            kind = "COLOR" if letters.startswith("RGB") else "VALUE" if len(letters) == 1 else "VECTOR"
            self.register_pass(scene, renderlayer, versions.pass_name(name), len(letters), letters, kind)

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        try:
            self._render(depsgraph)
        except InputError as error:
            self.report({"ERROR"}, datablocks.sentence(error))
        except Exception as error:  # Blender would print a traceback and call the render finished
            self.report({"ERROR"}, f"Virtual Pinhole: {errors.bug(error)}")
        finally:
            if not depsgraph.scene.render.use_persistent_data:  # else Blender keeps this engine for the next frame
                self._keeper = self._read = None

    def view_update(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        if self._live:
            self._live.scene_changed(depsgraph)

    def view_draw(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        try:
            self._show_view(context, depsgraph)
        except InputError as error:
            self.update_stats("", datablocks.sentence(error))
        except Exception as error:  # Blender would print a traceback at each draw
            self.update_stats("", f"Virtual Pinhole: {errors.bug(error)}")

    def _show_view(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        space = context.space_data
        self._live = self._live or LiveView()
        self._live.follow(depsgraph, context.region, context.region_data, (space.clip_start, space.clip_end))
        self._draw_picture(self._live, context, depsgraph.scene)

    def _draw_picture(self, live: LiveView, context: bpy.types.Context, scene: bpy.types.Scene) -> None:
        """Draw the latest picture over the region."""
        import gpu
        from gpu_extras.presets import draw_texture_2d

        live.drawn, picture = live.number, live.picture
        self.update_stats("", live.words())
        if picture is None:
            return
        if self._texture is None or self._texture[0] is not picture:
            height, width, _ = picture.shape
            pixels = gpu.types.Buffer("FLOAT", picture.size, picture.ravel())
            self._texture = picture, gpu.types.GPUTexture((width, height), format="RGBA16F", data=pixels)
        gpu.state.blend_set("ALPHA_PREMULT")
        self.bind_display_space_shader(scene)
        draw_texture_2d(self._texture[1], (0, 0), context.region.width, context.region.height)
        self.unbind_display_space_shader()
        gpu.state.blend_set("NONE")

    def __del__(self) -> None:
        if self._live:
            self._live.close()

    def _render(self, depsgraph: bpy.types.Depsgraph) -> None:
        self.update_stats("", "Reading the scene")
        settings = depsgraph.scene_eval.virtual_pinhole_reference
        scene = self._exported(depsgraph)
        level = least_level(scene)[0] if settings.level == "AUTO" else settings.level.lower()
        type(self).level = level
        words = f"Level {level}" if level == _GEOMETRY else f"Level {level}, {settings.samples} samples"
        self.update_stats("", words)
        width, height = scene.camera.width, scene.camera.height
        # Nobody looks at what comes before the last in a Blender without a window.
        steps = () if level == _GEOMETRY or bpy.app.background else refinement(settings.samples, width * height)
        taken = np.array([0, *(steps or [1])])  # samples after each step
        started, step = time.perf_counter(), np.zeros(height, int)  # steps that each row has come to
        for band, rows in self._bands(depsgraph, scene, level, steps):
            self._show(depsgraph, band, rows)
            step[rows.start : rows.stop] += 1
            share = taken[step].mean() / taken[-1]
            self.update_progress(share)
            remaining = round((time.perf_counter() - started) * (1 / share - 1))
            self.update_stats("", f"{words} | Remaining {remaining // 60}:{remaining % 60:02}")

    def _exported(self, depsgraph: bpy.types.Depsgraph) -> Scene:
        """The scene that is seen through the camera and the render border."""
        if depsgraph.scene.render.use_multiview:
            raise InputError("stereoscopy is on, and each eye has another camera: turn it off among the output properties")
        settings, camera_object = depsgraph.scene_eval.virtual_pinhole_reference, self.camera_override.original
        scene = self._read_scene(depsgraph, camera_object, settings.level != "GEOMETRY")
        scene = of_clay(scene) if settings.clay else scene
        frame = datablocks.frame_of(depsgraph.scene)
        if frame.border and not frame.crop:
            scene = replace(scene, camera=scene.camera.cropped(*replace(frame, crop=True).window))
        lacking = [(entry.object, entry.reason) for entry in scene.ledger if entry.status != "exported"]
        beyond = [(camera_object.name, sentence) for sentence in datablocks.beyond_pinhole(camera_object, depsgraph.scene)]
        words = [f"Not modeled as it is: {name!r}, {reason}" for name, reason in (*beyond, *lacking)]
        if words:
            others = f" (and {len(words) - 1} more, which viewcam export lists)" if len(words) > 1 else ""
            self.report({"WARNING"}, plain(words[0] + others))
        type(self).warnings = tuple(words)
        return scene

    def _read_scene(self, depsgraph: bpy.types.Depsgraph, camera_object: bpy.types.Object, lit: bool) -> Scene:
        """The scene that is seen through the camera."""
        former, self._read = self._read, None
        if former and former[0] == lit and self.keeps_scene and only_cameras_changed(depsgraph):
            scene = export.seen_from(former[1], depsgraph, camera_object)
        else:
            scene = export.scene_in(depsgraph, camera_object, Ledger(), lit)
        self._read = lit, scene
        return scene

    def _bands(
        self, depsgraph: bpy.types.Depsgraph, scene: Scene, level: str, steps: Sequence[int]
    ) -> Iterator[tuple[Passes, range]]:
        """Trace the scene: the passes of some rows, and which they are. What is where is that at the pixels' centers."""

        def traced(level: str, steps: Sequence[int] = ()) -> Iterator[tuple[Passes, range]]:
            return bands(scene, level, settings.samples, settings.seed, threads, self.test_break, self._keeper, steps)

        self._keeper = self._keeper or keeper()
        settings, threads = depsgraph.scene_eval.virtual_pinhole_reference, depsgraph.scene.render.threads
        centers: Passes = {}
        if level != _GEOMETRY and set(GEOMETRY_PASSES) & set(_asked_for(depsgraph.scene_eval, depsgraph.view_layer)):
            for passes, _ in traced(_GEOMETRY):
                centers = passes
        for passes, rows in traced(level, steps):
            band = {name: values[rows.start : rows.stop] for name, values in (centers | passes).items()}
            if level == _GEOMETRY:
                band["Combined"] = lit_from_the_eye(band)
            yield band, rows

    def _show(self, depsgraph: bpy.types.Depsgraph, band: Passes, rows: range) -> None:
        """Hand over some rows of the passes that are asked for."""
        _, width, _ = band["Combined"].shape
        result = self.begin_result(0, rows.start, width, len(rows), layer=depsgraph.view_layer.name)
        there = result.layers[0].passes
        for name in _asked_for(depsgraph.scene_eval, depsgraph.view_layer):
            if name in band:
                there[versions.pass_name(name)].rect.foreach_set(band[name].ravel())
        self.end_result(result)


def _asked_for(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> Iterator[str]:
    yield "Combined"
    yield from (name for name, setting in SETTINGS.items() if getattr(view_layer, setting))
    if scene.virtual_pinhole_reference.use_pass_variance:
        yield "Variance"


CLASSES = (VIEWCAM_RenderEngine,)
unregister = live_view.unregister
