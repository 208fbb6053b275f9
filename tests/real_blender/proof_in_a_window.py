"""Runs inside a real Blender with a window: Compare with Cycles by mouse and keys, to its verdict and to every other end; and
Write Labels, to its files.

blender --enable-event-simulate -p 0 0 1600 1000 --addons … --python proof_in_a_window.py -- FILE FOLDER [PICTURES]

FILE : a small scene with a camera, saved.
FOLDER : a folder in which the script writes, when it quits Blender, which temporary folder the last comparison had.
PICTURES : a folder for pictures of the window; without it none are taken.

Leaves through Blender's own door with status 0, or with 5 and a traceback.
"""

import importlib
import os
import signal
import sys
import time
import webbrowser
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).parent))
from hands import NOWHERE, SIDEBAR, WAITING, click, keep_open, look, move, photograph, press, region, start, window

FILE, FOLDER, *PICTURES = map(Path, sys.argv[sys.argv.index("--") + 1 :])
ADDON = "bl_ext.user_default.virtual_pinhole"
PROOF, LABELS = (f"{ADDON}.viewcam_addon.blender.interface.{name}" for name in ("proof", "labels"))
ROW = 12  # pixels between two looks for a button, less than its height
PATIENCE = 600  # seconds that one comparison may take on a busy machine
LEFT, MIDDLE, RIGHT, CANCEL = 0.3, 0.5, 0.7, 0.83  # shares of the sidebar's width

opened = []
places = {}  # where each button stood the last time, without a verdict below and with one
proof = None  # the module PROOF, once the add-on is enabled


def button(operator, across=MIDDLE):
    """Steps that end with where the button stands, looked for from the bottom of the sidebar."""
    there = operator, proof.background.latest is None
    if there in places and (yield from look(*places[there], SIDEBAR)).startswith(operator):
        return places[there]
    area, part = region(*SIDEBAR)
    with bpy.context.temp_override(window=window(), area=area, region=part):
        for _ in range(10):
            bpy.ops.view2d.scroll_down(deltay=100)
    x = part.x + part.width * across
    move(*NOWHERE)
    yield
    for y in range(part.y + ROW, part.y + part.height, ROW):
        if (yield from look(x, y, SIDEBAR)).startswith(operator):
            places[there] = x, y + ROW / 3
            return places[there]
    raise AssertionError(f"no button of {operator}")


def push(operator, across=MIDDLE):
    """Steps that click a button, and end with where it stands."""
    x, y = yield from button(operator, across)
    yield from click(x, y)
    return x, y


def picture(name):
    if PICTURES:
        photograph((0, 0, window().width, window().height), PICTURES[0] / name)


def begin():
    """Steps that end with the comparison that a click has begun, and the height at which its progress is shown."""
    _, y = yield from push("viewcam.compare_with_cycles")
    ends = time.monotonic() + 5
    while not proof.background.running and time.monotonic() < ends:
        yield
    assert proof.background.running, "the click has begun nothing"
    return proof.background.running, y


def begin_and_stop():
    """`begin`, and its processes are stopped: it is on its way until it is ended, however quick machine and tracer are."""
    comparison, y = yield from begin()
    os.killpg(comparison._process._first.pid, signal.SIGSTOP)
    return comparison, y


def ended(comparison):
    """Steps until it has gone, without a trace."""
    ends = time.monotonic() + 5
    while (proof.background.running or proof._timer) and time.monotonic() < ends:
        yield
    assert proof.background.running is None and proof._timer is None and not comparison.folder.exists()
    assert comparison._process.status() is not None


def open_the_panel():
    """The file and the sidebar's tab; the sub-panel is open from the start."""
    bpy.ops.wm.open_mainfile(filepath=str(FILE), load_ui=False)
    yield
    view, sidebar = region(*SIDEBAR)
    view.spaces.active.show_region_ui = True
    window().view_layer.objects.active = bpy.context.scene.camera
    yield
    sidebar.active_panel_category = "Pinhole"
    view.tag_redraw()
    yield
    yield


def compare_to_the_verdict():
    with bpy.context.temp_override(window=window()):
        bpy.ops.ed.undo_push(message="before")
        bpy.context.scene.objects["Suzanne"].location.x = 0.25
        bpy.ops.ed.undo_push(message="an edit")
    yield
    before = _of_the_session()
    areas = [area.ui_type for area in window().screen.areas]
    started, steps = time.monotonic(), set()
    yield from begin()
    while proof.background.running and time.monotonic() < started + PATIENCE:
        words = proof.background.running.progress()[1]
        if words == "Tracing" and words not in steps:
            yield
            picture("running.png")
        steps.add(words)
        yield WAITING
    outcome = proof.background.latest
    assert outcome and outcome.answer == "same", outcome or "no verdict"
    print(f"verdict after {time.monotonic() - started:.1f} s: {outcome.verdict}", flush=True)
    assert "Rendering with Cycles" in steps, steps
    assert _of_the_session() == before
    assert [area.ui_type for area in window().screen.areas] == areas, "the artist's layout has changed"
    assert len(bpy.context.window_manager.windows) == 1, "a pass opens a window"
    assert "Virtual Pinhole Proof" not in bpy.data.images
    yield
    yield
    yield from push("viewcam.show_difference", across=LEFT)
    yield
    _, other = bpy.context.window_manager.windows
    assert other.screen.areas[0].spaces.active.image.name == "Virtual Pinhole Proof"
    yield from _filled(other.screen.areas[0])
    picture("all_three.png")
    bpy.context.window_manager.virtual_pinhole_proof.view = "SWIPE"
    yield from _filled(other.screen.areas[0])
    bpy.context.window_manager.virtual_pinhole_proof.swipe = 0.4
    yield
    yield
    picture("swipe.png")
    bpy.context.window_manager.virtual_pinhole_proof.property_unset("view")
    with bpy.context.temp_override(window=other):
        bpy.ops.wm.window_close()
    yield
    yield
    picture("verdict.png")


def _filled(area):
    """Steps until the picture reaches from side to side or from top to bottom of its editor, but for the legend's margins."""
    part = next(part for part in area.regions if part.type == "WINDOW")
    share, ends = 0, time.monotonic() + PATIENCE
    while not 0.7 < share < 1 and time.monotonic() < ends:
        yield
        (left, bottom), (right, top) = (part.view2d.view_to_region(at, at, clip=False) for at in (0, 1))
        share = max((right - left) / part.width, (top - bottom) / part.height)
    assert 0.7 < share < 1, f"the picture has {share:.0%} of its editor"


def _of_the_session():
    """Name and state of the file, and the list of recent ones."""
    recent = Path(bpy.utils.user_resource("CONFIG"), "recent-files.txt")
    return bpy.data.filepath, bpy.data.is_dirty, recent.read_text() if recent.exists() else ""


def open_the_report():
    webbrowser.open = lambda url, *_, **__: opened.append(url) or True
    yield from push("viewcam.open_report", across=RIGHT)
    yield
    assert opened == [proof.background.latest.report.as_uri()], opened


def take_the_edit_back_and_show_the_difference_again():
    """The history has no step of ours: one undo takes back the edit. The image that came after it goes and comes again."""
    press("Z", *NOWHERE, ctrl=True)
    yield
    yield
    assert bpy.context.scene.objects["Suzanne"].location.x == 0, "one undo did not take back the edit"
    area = next(area for area in window().screen.areas if area.type == "DOPESHEET_EDITOR")
    area.ui_type = "IMAGE_EDITOR"
    yield
    yield from push("viewcam.show_difference", across=LEFT)
    yield
    assert len(bpy.context.window_manager.windows) == 1, "there was an Image Editor"
    assert area.spaces.active.image.name == "Virtual Pinhole Proof"


def press_escape():
    comparison, _ = yield from begin_and_stop()
    yield
    press("ESC", *NOWHERE)
    yield from ended(comparison)
    assert proof.background.latest.answer == "same", "the verdict before is forgotten"


def press_cancel():
    comparison, y = yield from begin_and_stop()
    yield
    _, part = region(*SIDEBAR)
    there = yield from look(part.x + part.width * CANCEL, y, SIDEBAR)
    assert there.startswith("viewcam.cancel_comparison"), f"where Cancel should be there is {there!r}"
    yield from click(part.x + part.width * CANCEL, y)
    yield from ended(comparison)


def undo_while_it_runs():
    comparison, _ = yield from begin_and_stop()
    press("Z", *NOWHERE, ctrl=True, shift=True)
    yield
    press("Z", *NOWHERE, ctrl=True)
    yield
    yield
    assert proof.background.running is comparison and comparison._process.status() is None
    press("ESC", *NOWHERE)
    yield from ended(comparison)


def open_a_file_while_it_runs():
    comparison, _ = yield from begin_and_stop()
    kept = proof.background.latest.temporary
    bpy.ops.wm.open_mainfile(filepath=str(FILE), load_ui=False)
    yield
    yield from ended(comparison)
    assert proof.background.latest is None and not kept.exists()


def turn_the_add_on_off_while_it_runs():
    global proof
    comparison, _ = yield from begin_and_stop()
    bpy.ops.preferences.addon_disable(module=ADDON)
    yield
    yield
    assert not comparison.folder.exists() and comparison._process.status() is not None
    bpy.ops.preferences.addon_enable(module=ADDON)
    proof = importlib.import_module(PROOF)
    yield


def write_the_labels():
    """By its button: Blender's timer looks after what that began, until the files are there, and the panel says where."""
    labels = importlib.import_module(LABELS)
    keep_open(labels.VIEWCAM_PT_sidebar_labels)
    settings = bpy.context.window_manager.virtual_pinhole_labels
    settings.folder = str(FOLDER)
    yield
    yield from push("viewcam.write_labels")
    ends = time.monotonic() + PATIENCE
    while labels.background.latest is None and time.monotonic() < ends:
        yield WAITING
    folder, sentence = labels.background.latest or (None, "nothing came of it")
    assert folder and folder.parent == FOLDER and sentence == f"Written to {folder}", sentence
    missing = {*labels.file_names(bpy.context.scene.camera, settings.chosen())} - {path.name for path in folder.iterdir()}
    assert not missing, missing
    yield
    yield
    yield from button("wm.path_open")
    picture("labels.png")


def quit_while_it_runs():
    comparison, _ = yield from begin_and_stop()
    (FOLDER / "last.txt").write_text(str(comparison.folder))
    yield


def steps():
    global proof
    yield
    proof = importlib.import_module(PROOF)
    for part in (
        open_the_panel,
        compare_to_the_verdict,
        open_the_report,
        take_the_edit_back_and_show_the_difference_again,
        press_escape,
        press_cancel,
        undo_while_it_runs,
        open_a_file_while_it_runs,
        open_the_panel,
        turn_the_add_on_off_while_it_runs,
        open_the_panel,
        write_the_labels,
        quit_while_it_runs,
    ):
        yield from part()
        print(f"done: {part.__name__}", flush=True)
    with bpy.context.temp_override(window=window()):
        bpy.ops.wm.quit_blender()
    while True:
        yield


start(steps, interval=0.05)
