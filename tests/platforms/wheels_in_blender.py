"""Installs wheels by the rules of the Blender that is this Python's module: `python wheels_in_blender.py FOLDER WHEEL…`

Prints the folder of modules, and what of them can't be imported.
"""

import importlib
import sys
from pathlib import Path

import bpy  # noqa: F401 - its own scripts are on the path then
from _bpy_internal.extensions import wheel_manager


def main(folder: str, *wheels: str) -> None:
    site_packages = Path(folder, "lib", "site-packages")
    site_packages.mkdir(parents=True)
    wheel_manager.apply_action(
        local_dir=folder,
        local_dir_site_packages=str(site_packages),
        wheel_list=[("user_default.virtual_pinhole", list(wheels))],
        error_fn=print,
        remove_error_fn=print,
        debug=False,
    )
    sys.path.append(str(site_packages))
    print("FOLDER", site_packages)
    for name in ("OpenEXR", "markupsafe._speedups", "jinja2", "tqdm", "viewcam_core"):
        try:
            importlib.import_module(name)
        except ImportError as error:
            print("MISSING", name, error)


if __name__ == "__main__":
    main(*sys.argv[1:])
