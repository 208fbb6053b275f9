"""Runs in a process of its own with Blender: enables and disables the add-on ten times, and tells what is left behind.

leftovers.py [wheel | ZIP] [ROUNDS] [SABOTAGE]

wheel : register() and unregister() of the package on Python's path. ZIP : installs, enables, disables and removes the
extension. In between it is used a little.
SABOTAGE : Python that is run after each enabling, where `addon` is the package, to see that it is found.

What is compared is whatever a program can ask Blender and Python for, without a list of what the add-on is known to add: all
types and their properties, sets and lists on them, all menus' entries, operators, keymaps, handlers, every datablock, preset
paths and whatever else Python modules of Blender keep, threads, signals. And what can not be asked for, such as timers, draw
handlers and message bus subscriptions, keeps functions and classes of the package alive: after the package has been forgotten
nothing that it has defined may be left.
Prints one line for each difference, and leaves with status 1 if there are any.
"""

import gc
import importlib
import os
import signal
import sys
import threading
import types
import weakref
from pathlib import Path

import bpy

PACKAGE = "viewcam_addon"
EXTENSION = "bl_ext.user_default.virtual_pinhole"
# Things that Blender itself leaves of any extension that was installed and removed: its own cache, the folder of wheels on
# Python's path, and Ctrl-C as it is without Python.
_LEFT_BY_BLENDER = ("extensions/.cache/compat.dat in files", "site-packages in sys.path", f"{signal.SIGINT:d} 0 in signals")
_PLAIN = str | int | float | list | set | dict | tuple | frozenset


def snapshot():
    """Name of a place → what is there, as a set of texts."""
    result = {}
    for name in dir(bpy.types):
        each = getattr(bpy.types, name)
        if hasattr(each, "bl_rna"):
            result[f"properties of {name}"] = set(each.bl_rna.properties.keys())
            result[f"functions of {name}"] = set(each.bl_rna.functions.keys())
        draw = getattr(each, "draw", None)
        result[f"entries of {name}"] = {_named(function) for function in getattr(draw, "_draw_funcs", [draw])}
        for key, value in getattr(each, "__dict__", {}).items():
            if isinstance(value, list | set | dict) and not key.startswith("__"):
                result[f"{name}.{key}"] = _items(value)
    result["types"] = set(dir(bpy.types))
    result["classes"] = {_named(each) for each in _subclasses(bpy.types.bpy_struct) if _is_registered(each)}
    result["operators"] = {f"{module}.{name}" for module in dir(bpy.ops) for name in dir(getattr(bpy.ops, module))}
    for name in dir(bpy.app.handlers):
        value = getattr(bpy.app.handlers, name)
        if isinstance(value, list):
            result[f"handlers {name}"] = {_named(function) for function in value}
    for configuration in bpy.context.window_manager.keyconfigs:
        for keymap in configuration.keymaps:
            where = f"{configuration.name}: {keymap.name}"
            result[where] = {f"{item.idname} {item.to_string()} {i}" for i, item in enumerate(keymap.keymap_items)}
    for prop in bpy.data.bl_rna.properties:
        if prop.type == "COLLECTION":
            result[f"bpy.data.{prop.identifier}"] = {block.name_full for block in getattr(bpy.data, prop.identifier)}
    result["add-ons"] = set(bpy.context.preferences.addons.keys())
    result["driver names"] = set(bpy.app.driver_namespace)
    for module_name, module in list(sys.modules.items()):
        if _is_blenders(module_name, module):
            for key, value in getattr(module, "__dict__", {}).items():
                if isinstance(value, list | set | dict) and key not in ("__builtins__", "__annotations__"):
                    result[f"{module_name}.{key}"] = _items(value)
    result["threads"] = {thread.name for thread in threading.enumerate()}
    result["signals"] = {f"{number} {signal.getsignal(number)}" for number in signal.valid_signals()}
    result["sys.path"] = set(sys.path)
    result["import hooks"] = {_named(hook) for hook in (*sys.meta_path, *sys.path_hooks)}
    folder = Path(bpy.utils.resource_path("USER"))
    result["files"] = {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}
    result["environment"] = {f"{key}={value}" for key, value in os.environ.items()}
    return result


def _is_blenders(name, module):
    """True if a module is one of Blender's own scripts, which keep registries."""
    return name.split(".")[0] in {"bpy", "bpy_extras", "addon_utils", "bl_ui", "bl_operators", "bpy_types", "_bpy_types"}


def _items(value):
    """The items that a container holds, in a text each; of dictionaries the keys."""
    return {repr(each) if isinstance(each, _PLAIN) else _named(each) for each in list(value)}


def _named(each):
    return f"{getattr(each, '__module__', type(each).__module__)}.{getattr(each, '__qualname__', type(each).__qualname__)}"


def _subclasses(parent):
    for each in type.__subclasses__(parent):
        yield each
        yield from _subclasses(each)


def _is_registered(each):
    is_python = each.__module__ != "bpy.types"  # Blender's own for what is registered may stay, and is asked for by `types`
    return is_python and "bl_rna" in vars(each) and getattr(each, "is_registered", True)


def blender_lets_go():
    """True if Blender lets go of an unregistered class of properties. 4.2 never does, and with it keeps whole modules."""

    class Properties(bpy.types.PropertyGroup):
        pass

    bpy.utils.register_class(Properties)
    bpy.utils.unregister_class(Properties)
    there = weakref.ref(Properties)
    del Properties
    gc.collect()
    return there() is None


def survivors(package):
    """The objects that the package has defined and something still holds, once the package has been forgotten."""
    for name in [name for name in sys.modules if f"{name}.".startswith(f"{package}.")]:
        module = sys.modules.pop(name)
        parent, _, own = name.rpartition(".")
        if getattr(sys.modules.get(parent), own, None) is module:
            delattr(sys.modules[parent], own)
    module = None  # or this function itself would hold it
    for _ in range(3):
        gc.collect()
    kinds = (types.FunctionType, type, types.ModuleType)
    return sorted(
        f"{getattr(each, '__module__', '')}.{getattr(each, '__qualname__', each.__name__)}"
        for each in gc.get_objects()
        if isinstance(each, kinds) and str(getattr(each, "__module__", None) or each.__name__).startswith(package)
    )


def new_file():
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    return bpy.context.scene


def use():
    """Use the add-on so that it remembers things: cameras that follow an object, frames, other pictures, files, undo."""
    scene = new_file()
    camera, target = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera")), bpy.data.objects.new("Target", None)
    for block in (camera, target):
        scene.collection.objects.link(block)
    scene.camera = camera
    values = camera.virtual_pinhole
    values.enabled = True
    values.eye, values.look_at_target, values.distance = (3, -4, 5), target, 700
    values.keyframe_insert("distance", frame=1)
    for frame in (1, 2):
        target.location.x = frame
        scene.frame_set(frame)
    scene.render.resolution_x = 640
    bpy.context.view_layer.update()
    bpy.context.view_layer.objects.active = camera
    for operator in ("adopt_camera", "apply_camera", "swap_camera"):
        getattr(bpy.ops.viewcam, operator)()
    bpy.ops.ed.undo_push()
    new_file()


def rounds_of_the_wheel(count, sabotage):
    addon = importlib.import_module(PACKAGE)
    importlib.import_module(f"{PACKAGE}.blender")
    addon.blender._rooms()  # whatever of Blender's own the package imports is there from now on
    new_file()
    before = snapshot()
    for _ in range(count):
        addon.register()
        use()
        exec(sabotage, {"addon": addon, "bpy": bpy})
        addon.unregister()
    return before, PACKAGE


def rounds_of_the_zip(path, count, sabotage):
    new_file()
    before = snapshot()
    for _ in range(count):
        bpy.ops.extensions.package_install_files(filepath=path, repo="user_default", enable_on_install=True)
        if not hasattr(bpy.types.Object, "virtual_pinhole"):
            sys.exit("the extension did not install, or did not register")
        use()
        exec(sabotage, {"addon": sys.modules[f"{EXTENSION}.{PACKAGE}"], "bpy": bpy})
        bpy.ops.preferences.addon_disable(module=EXTENSION)
        bpy.ops.preferences.addon_enable(module=EXTENSION)
        bpy.ops.extensions.package_uninstall(repo_index=_repository(), pkg_id="virtual_pinhole")
    return before, EXTENSION


def _repository():
    return next(i for i, each in enumerate(bpy.context.preferences.extensions.repos) if each.module == "user_default")


def differences(before, after):
    """A line for each text that one snapshot has and the other has not."""
    return [
        f"{sign} {each} in {place}"
        for place in sorted(before.keys() | after.keys())
        for sign, first, other in (("more:", after, before), ("less:", before, after))
        for each in sorted(first.get(place, set()) - other.get(place, set()))
    ]


def main(what="wheel", count="10", sabotage=""):
    if what == "wheel":
        sys.path.insert(0, os.getcwd())
        before, package = rounds_of_the_wheel(int(count), sabotage)
    else:
        before, package = rounds_of_the_zip(what, int(count), sabotage)
    after = snapshot()
    left = differences(before, after)
    if what != "wheel":
        left = [
            line for line in left if not line.endswith(_LEFT_BY_BLENDER) and line != f"less: {signal.SIGINT:d} None in signals"
        ]
    if blender_lets_go():
        left += [f"alive: {each}" for each in survivors(package)]
    else:
        print("This Blender keeps all classes of properties alive: what is alive is not looked at")
    print(*left, f"{len(left)} left behind after {count} rounds", sep="\n", flush=True)
    os._exit(1 if left else 0)


if __name__ == "__main__":
    main(*(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]))
