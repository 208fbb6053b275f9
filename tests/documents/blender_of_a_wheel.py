"""A stand-in for the command `blender`, by a wheel, which has none: it does what the pages say of it."""

import os
import sys

import bpy

import viewcam_addon
from viewcam_addon import cli


def main(words):
    viewcam_addon.register()
    words = iter(words)
    for word in words:
        if word in ("-b", "--disable-autoexec"):
            continue
        elif word == "-E":
            bpy.context.scene.render.engine = next(words)
        elif word == "-f":
            bpy.context.scene.frame_set(int(next(words)))
            bpy.ops.render.render(write_still=True)
        elif word == "--python-expr":
            exec(next(words), {})
        elif word == "--command":
            assert next(words) == "viewcam"
            return cli.main([*words], blend_is_open=True)
        elif word.startswith("-"):
            raise SystemExit(f"{word} is no word that the pages use: say here what it does")
        else:
            bpy.ops.wm.open_mainfile(filepath=os.path.abspath(word))
    return 0


if __name__ == "__main__":
    status = main(sys.argv[1:])
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)  # as __main__.py does, and why
