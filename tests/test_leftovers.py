"""Enabling and disabling the add-on ten times leaves nothing behind, and what is left behind is found (leftovers.py).

Each in a process of its own, where nothing else has been registered. tests/real_blender does the same with the extension's zip.
"""

import subprocess
import sys
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parent.parent

# What an add-on may forget → the line that tells so.
FORGOTTEN = {
    "bpy.app.handlers.load_post.append(lambda *_: None)": "<lambda> in handlers load_post",
    "bpy.types.TOPBAR_MT_file.append(lambda *_: None)": "<lambda> in entries of TOPBAR_MT_file",
    "bpy.types.Scene.forgotten = bpy.props.IntProperty()": "more: forgotten in properties of Scene",
    "bpy.utils.register_class(type('FORGOTTEN_OT_it', (bpy.types.Operator,), {'bl_idname': 'forgotten.it', 'bl_label': ''}))": (
        "more: FORGOTTEN_OT_it in types"
    ),
    "bpy.types.RENDER_PT_format.COMPAT_ENGINES.add('FORGOTTEN')": "more: 'FORGOTTEN' in RENDER_PT_format.COMPAT_ENGINES",
    "bpy.utils.register_preset_path('/forgotten')": "more: '/forgotten' in bpy.utils._preset_path_registry",
    "bpy.data.texts.new('Forgotten')": "more: Forgotten in bpy.data.texts",
    "__import__('sys').path.append('/forgotten')": "more: /forgotten in sys.path",
    "__import__('threading').Thread(target=__import__('time').sleep, args=(60,), daemon=True, name='Forgotten').start()": (
        "more: Forgotten in threads"
    ),
}
# The same of what can't be asked for: it keeps its module alive.
HELD = [
    "bpy.app.timers.register(addon.register, first_interval=1e6)",
    "bpy.types.SpaceView3D.draw_handler_add(addon.register, (), 'WINDOW', 'POST_VIEW')",
    "bpy.msgbus.subscribe_rna(key=(bpy.types.Object, 'location'), owner=bpy, args=(), notify=addon.register)",
    "bpy.utils.register_cli_command('forgotten', addon.register)",
]


def leftovers(*arguments):
    return subprocess.run([sys.executable, "tests/leftovers.py", *arguments], cwd=ROOT, capture_output=True, text=True)


def test_ten_rounds_leave_nothing_behind():
    outcome = leftovers("wheel", "10")
    assert outcome.returncode == 0, outcome.stdout + outcome.stderr
    assert "0 left behind after 10 rounds" in outcome.stdout


def test_what_is_forgotten_is_found():
    outcome = leftovers("wheel", "1", "\n".join(FORGOTTEN))
    assert outcome.returncode == 1, outcome.stdout + outcome.stderr
    missed = [line for line in FORGOTTEN.values() if line not in outcome.stdout]
    assert not missed, f"not told: {missed}\n{outcome.stdout}{outcome.stderr}"


@pytest.mark.skipif(bpy.app.version < (4, 5), reason="Blender 4.2 keeps all classes of properties alive itself")
@pytest.mark.parametrize("held", [HELD[0], *(pytest.param(held, marks=pytest.mark.exhaustive) for held in HELD[1:])])
def test_what_blender_still_holds_is_found(held):
    outcome = leftovers("wheel", "1", held)
    assert outcome.returncode == 1, outcome.stdout + outcome.stderr
    assert "alive: viewcam_addon.register" in outcome.stdout, outcome.stdout + outcome.stderr
