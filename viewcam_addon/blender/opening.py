"""Opening a .blend, for every command: what in it would run, or write files, is off unless the file is trusted.

Blender itself leaves registered texts and drivers in Python alone when it is told to (`use_scripts`). What it does not guard is
switched off here, before anything of the file is evaluated: `load_post` comes just before Blender's first evaluation, which
would write caches already. docs/security.md lists the ways, with the test of each.

Rejected: to switch things off where each is used (the batch had forgotten Freestyle, which export and Cycles remembered), and
to refuse such files (their cameras and geometry are wanted all the same).
"""

import contextlib
import os
import signal
import stat
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import bpy

from ..errors import InputError, operator_reason
from . import ensure_registered
from .temporary_settings import Overrides, overridden

# The first bytes of a .blend: its own, or those of a gzip or Zstandard stream.
_MAGIC = (b"BLENDER", b"\x1f\x8b", b"\x28\xb5\x2f\xfd")

# Settings by which a render writes files beside its picture: each pass for the compositor (in the temporary folder), images as
# tx (5.2).
_WRITING = ("use_render_cache", "use_auto_generate_texture_cache")

_WAITED = 5.0
"""Seconds for which Blender may wait for a pipe to be written to, in place of a library."""

_Put = Callable[[bpy.types.bpy_struct, str, Any], None]


@contextlib.contextmanager
def opened(blend: str | os.PathLike[str] | None, trust: bool = False) -> Iterator[tuple[Overrides, tuple[str, ...]]]:
    """Open a .blend, or take the file that is open (None), for the time of a job.

    trust : true if its scripts may run and write. A file that is open was opened by Blender, by its own `--enable-autoexec` or
        preference; here only the rest is decided.

    Gives a Overrides, and a sentence for each thing that is off and might be seen, or that Blender could not read.

    Raises InputError if there is no such file, if Blender can't read it at all, if a pipe or a device stands where it reads a
    file, or if it is trusted and was opened without its scripts.
    """
    ensure_registered()
    with overridden() as overrides:
        if blend is not None:
            off = open_blend(blend, trust)
            yield overrides, off
            return
        _check_files()
        if bpy.app.background:
            _leave_sculpt_mode()
        lacking = tuple(_without_cache(overrides.set))
        if not trust:
            off = (*lacking, *_without_trust(*_disarmed(overrides.set), *_unrun()))
        elif any(_unrun()):
            raise InputError(
                "Blender has opened the file without running what is in it: write --enable-autoexec before the file, or leave "
                "--trust out"
            )
        else:
            off = lacking
        yield overrides, off


def open_blend(path: str | os.PathLike[str], trust: bool = False) -> tuple[str, ...]:
    """Open a .blend; a sentence for each thing that is off or was not read and might be seen. Raises as `opened` does."""
    path = Path(path).absolute()
    if not path.is_file():
        raise InputError(f"{path} {'is no file' if path.exists() else 'does not exist'}: check the name of the .blend file")
    try:
        with open(path, "rb") as file:
            start = file.read(7)
    except OSError as error:
        raise InputError(f"{path} can't be read ({error.strerror}): check its permissions") from error
    if not start.startswith(_MAGIC):
        raise InputError(f"{path} is not a .blend file: give a file that Blender has saved")
    off: list[str] = []
    is_read = False

    def read() -> None:
        nonlocal is_read
        is_read = True
        _check_files()
        off.extend(_without_cache(setattr))
        if not trust:
            off.extend(_without_trust(*_disarmed(setattr)))

    with _not_kept_waiting(), _after_reading(read):
        try:
            bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False, use_scripts=trust)
        except RuntimeError as error:
            reason = operator_reason(error)
            if not is_read:
                raise InputError(
                    f"{path} can't be opened by Blender {bpy.app.version_string} ({reason}): save it again"
                ) from error
            off.append(f"Blender {bpy.app.version_string} has read the file but for something: {reason}")
    _leave_sculpt_mode()
    return (*off, *_without_trust(*_unrun()))


def _without_trust(*sentences: str) -> tuple[str, ...]:
    return tuple(f"{sentence} (without --trust)" for sentence in sentences)


@contextlib.contextmanager
def _after_reading(work: Callable[[], None]) -> Iterator[None]:
    """Call `work` when the file that is opened meanwhile is read and not yet evaluated. What it raises is raised at the end."""
    failures: list[BaseException] = []

    @bpy.app.handlers.persistent
    def read(*_: object) -> None:
        try:
            work()
        except BaseException as error:  # Blender would print it, and go on
            failures.append(error)

    bpy.app.handlers.load_post.insert(0, read)
    try:
        yield
    finally:
        bpy.app.handlers.load_post.remove(read)
    if failures:
        raise failures[0]


@contextlib.contextmanager
def _not_kept_waiting() -> Iterator[None]:
    """Call Blender back from waiting for a pipe in place of a library; it then goes on without, and the path is told.

    A signal does so, whose handler Python runs later; Windows, whose pipes are no files, and other threads have none. Whoever
    has set an alarm already has a time limit of their own.
    """
    has_alarms = hasattr(signal, "setitimer") and threading.current_thread() is threading.main_thread()
    if not has_alarms or signal.getitimer(signal.ITIMER_REAL)[0]:
        yield
        return
    handler = signal.signal(signal.SIGALRM, lambda *_: None)
    signal.setitimer(signal.ITIMER_REAL, _WAITED, _WAITED)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, handler)


def _check_files() -> None:
    """Refuse a file that names what Blender would wait for: InputError with the path."""
    for path in bpy.utils.blend_paths(absolute=True, packed=False, local=False):
        size_of(Path(path))


def size_of(path: Path) -> int:
    """Bytes of a file that the open one reads, 0 where there is none. InputError for a pipe or a device: they may never end."""
    try:
        status = path.stat()
    except (OSError, ValueError):  # it is told as missing
        return 0
    if not (stat.S_ISREG(status.st_mode) or stat.S_ISDIR(status.st_mode)):
        raise InputError(f"the .blend reads {path}, which is no file: give a file, or take out what names it")
    return status.st_size


def _disarmed(put: _Put) -> Iterator[str]:
    """Switch off what Blender does not guard. put : sets a property."""
    for scene in bpy.data.scenes:  # the compositor renders others, too
        for name in _WRITING:
            if hasattr(scene.render, name):
                put(scene.render, name, False)
        for layer in scene.view_layers:
            if layer.use_freestyle and layer.freestyle_settings.mode == "SCRIPT":
                put(layer, "use_freestyle", False)
                if scene.render.use_freestyle:
                    yield f"Freestyle draws no lines in view layer {layer.name!r}: they are a script of the file"
        if getattr(getattr(scene, "cycles", None), "shading_system", False) and _has_script_nodes():
            put(scene.cycles, "shading_system", False)
            yield f"Open Shading Language is off in scene {scene.name!r}: script nodes are programs, and shade nothing"
    for camera in bpy.data.cameras:
        if camera.type == "CUSTOM":
            for name, nothing in (("custom_filepath", ""), ("custom_shader", None), ("custom_bytecode", "")):
                put(camera, name, nothing)
    for cache in _point_caches():
        if cache.use_disk_cache and not cache.is_baked:
            cache.use_disk_cache = False  # in memory until the end: to give it back would write it
    for each in bpy.data.objects:
        for modifier in filter(_writes_always, each.modifiers):
            put(modifier, "show_viewport", False)
            put(modifier, "show_render", False)
            yield f"the modifier {modifier.name!r} of {each.name!r} is off: it is not baked, and would write what it simulates"


def _without_cache(put: _Put) -> Iterator[str]:
    """Switch off the fluids that are baked, and whose cache is nowhere: Blender would abort as it evaluates them."""
    for each in bpy.data.objects:
        for modifier in each.modifiers:
            if modifier.type == "FLUID" and modifier.fluid_type == "DOMAIN" and not _writes_always(modifier):
                folder = modifier.domain_settings.cache_directory
                if not any(files for _, _, files in os.walk(bpy.path.abspath(folder, library=each.library))):
                    put(modifier, "show_viewport", False)
                    put(modifier, "show_render", False)
                    name = f"the modifier {modifier.name!r} of {each.name!r}"
                    yield f"{name} is off: its cache {folder} is missing, bake it again"


def _leave_sculpt_mode() -> None:
    """Put the objects of a file that was saved while they were sculpted into object mode.

    Sculpting weighs the normals of a vertex's faces alike, a mesh by their angles, and the first render has the mesh's and each
    further one the sculpture's: export and Cycles would see two of them. In a window the mode is the artist's, and stays.
    """
    objects = bpy.context.view_layer.objects
    active = objects.active
    for each in objects:
        if each.mode == "SCULPT":
            objects.active = each
            bpy.ops.object.mode_set(mode="OBJECT")
    objects.active = active


def _unrun() -> Iterator[str]:
    """The sentences of Blender about texts and drivers that it has not run."""
    if bpy.app.autoexec_fail:
        what = bpy.app.autoexec_fail_message
        yield f"Python of the file does not run ({what}), and drivers that need it keep their last values"


def _has_script_nodes() -> bool:
    kinds = (bpy.data.materials, bpy.data.worlds, bpy.data.lights, bpy.data.linestyles)
    trees = [*bpy.data.node_groups, *(block.node_tree for kind in kinds for block in kind if block.node_tree)]
    return any(node.bl_idname == "ShaderNodeScript" for tree in trees for node in tree.nodes)


def _point_caches() -> Iterator[bpy.types.PointCache]:
    """The caches of the simulations that can also keep theirs in memory."""
    for each in bpy.data.objects:
        for modifier in each.modifiers:
            if modifier.type in ("CLOTH", "SOFT_BODY"):
                yield modifier.point_cache
        yield from (system.point_cache for system in each.particle_systems)
    yield from (scene.rigidbody_world.point_cache for scene in bpy.data.scenes if scene.rigidbody_world)


def _writes_always(modifier: bpy.types.Modifier) -> bool:
    """True if it is simulated where a baked one would only be read, and knows nothing but files for it."""
    if modifier.type == "FLUID" and modifier.fluid_type == "DOMAIN":
        return modifier.domain_settings.cache_type == "REPLAY" or modifier.domain_settings.is_cache_baking_any
    if modifier.type == "DYNAMIC_PAINT" and modifier.canvas_settings:
        return not all(surface.point_cache.is_baked for surface in modifier.canvas_settings.canvas_surfaces)
    return False
