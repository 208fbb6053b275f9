"""Runs inside a real Blender with a window: renders with the engine as an artist does, and checks what happens.

blender [--enable-event-simulate] -p 0 0 1600 1000 --addons … --python engine_in_a_window.py -- PART FILE OUT

PART is `render`, with simulated events: picks the engine in the properties editor, looks into its panels, presses F12 and saves
the result to OUT. Or it is `cancel`, without them, since Blender then hears no others: makes FILE heavy, presses F12, then
Escape by xdotool, and writes the seconds until Blender says that the render was canceled to OUT, for each of some times. Or it
is `view`: turns the viewport in Rendered shading, and writes to OUT how many pictures a second there are, and how long Blender
waited for each call of the engine's.
Leaves with status 0, or 5 and a traceback.
"""

import json
import subprocess
import sys
import time
from pathlib import Path

import bpy
import numpy as np
from bpy.app.handlers import persistent

sys.path.append(str(Path(__file__).parent))
from hands import ROW, SCREEN_HEIGHT, move, region, start, window
from mathutils import Euler

PART, FILE, OUT = sys.argv[sys.argv.index("--") + 1 :]
TRACED_FOR = 2.0  # seconds that a heavy render goes on before it is canceled
TIMES_CANCELED = 6  # times
KINDS = ("images", "objects", "scenes", "meshes", "materials", "texts", "cameras", "node_groups")
TURNS = 20  # the view's
PATIENCE = 600  # seconds for all of them, on a busy machine

messages, ended = [], []


@persistent
def on_stats(words):
    messages.append(words)


@persistent
def on_complete(*_):
    ended.append("completed")


@persistent
def on_cancel(*_):
    ended.append("canceled")


def pick_the_engine():
    """Ctrl and the mouse wheel over the choice of the engine."""
    area, where = region("PROPERTIES", "WINDOW")
    area.spaces.active.context = "RENDER"
    yield
    x = where.x + where.width * 0.7
    for y in range(where.y + where.height - ROW, where.y, -ROW):
        move(x, y)
        yield
        with bpy.context.temp_override(window=window(), area=area, region=where):
            actual = bpy.context.property
        if actual and actual[1] == "render.engine":
            break
    for _ in range(len(bpy.types.RenderSettings.bl_rna.properties["engine"].enum_items) + 6):
        if bpy.context.scene.render.engine == "VIEWCAM":
            return
        window().event_simulate(type="WHEELDOWNMOUSE", value="PRESS", x=int(x), y=int(y), ctrl=True)
        yield
        yield
    raise AssertionError(f"the wheel brought {bpy.context.scene.render.engine} and not the engine")


def look_into_the_panels():
    area, _ = region("PROPERTIES", "WINDOW")
    looks = [(None, ("RENDER", "OUTPUT", "VIEW_LAYER", "WORLD")), ("MESH", ("MATERIAL", "OBJECT")), ("CAMERA", ("DATA",))]
    for kind, tabs in [*looks, ("LIGHT", ("DATA", "OBJECT"))]:
        if kind:
            window().view_layer.objects.active = next(each for each in bpy.context.scene.objects if each.type == kind)
            yield
        for tab in tabs:
            area.spaces.active.context = tab
            yield
            yield


def press_f12():
    """The operator that the key is bound to: in a virtual screen without a window manager the key may find no window."""
    while bpy.app.is_job_running("RENDER"):  # a canceled one takes a while to go
        yield
    ended.clear()
    with bpy.context.temp_override(window=window()):
        assert bpy.ops.render.render("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
    yield


def render():
    yield from pick_the_engine()
    yield from look_into_the_panels()
    yield from press_f12()
    yield from wait_for("completed")
    bpy.data.images["Render Result"].save_render(OUT)


def cancel():
    scene = bpy.context.scene
    scene.render.engine = "VIEWCAM"
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 1920, 1080, 100
    scene.virtual_pinhole_reference.samples = 1024
    seconds = []
    for _ in range(TIMES_CANCELED):
        messages.clear()
        yield from press_f12()
        while not any("Level path" in words for words in messages):
            yield
        started = time.perf_counter()
        while time.perf_counter() - started < TRACED_FOR:
            yield
        assert not ended, f"the render has {ended} already: make it heavier"
        pressed = time.perf_counter()
        subprocess.run(["xdotool", "key", "Escape"], check=True)
        yield from wait_for("canceled")
        seconds.append(time.perf_counter() - pressed)
    Path(OUT).write_text(json.dumps(seconds))


def view():
    """Rendered shading: surfaces while the view turns, light once it rests, and no step of Blender's waits for it."""
    bpy.context.scene.render.engine = "VIEWCAM"
    area, part = region("VIEW_3D", "WINDOW")
    space = area.spaces.active
    space.region_3d.view_perspective = "CAMERA"
    yield
    package = type(bpy.context.scene.virtual_pinhole_reference).__module__.removesuffix("render_settings")
    pictures, engine = (sys.modules[f"{package}rendering.{name}"] for name in ("live_view", "engine"))
    calls = timed(engine.VIEWCAM_RenderEngine, ("view_update", "view_draw"))
    space.shading.type = "RENDERED"
    ends = time.monotonic() + PATIENCE
    while not any(each.samples > 1 for each in pictures.LiveView._all) and time.monotonic() < ends:
        yield
    (live,) = pictures.LiveView._all
    assert live.picture.shape[:2] == (part.height, part.width) and live.samples > 1
    space.region_3d.view_perspective = "PERSP"
    started, number = time.monotonic(), live.number
    for _ in range(TURNS):
        yield from turn(area, live, ends)
    seconds = time.monotonic() - started
    figures = {"pictures": (live.number - number) / seconds, "calls": list(calls)}
    while live.samples < 2 and time.monotonic() < ends:
        yield
    assert live.samples >= 2, "the light does not come back"
    calls.clear()
    follow = type(live).follow

    def waits(self, *arguments):
        follow(self, *arguments)
        while self._is_at_work:
            time.sleep(0.001)

    type(live).follow = waits
    for _ in range(3):
        yield from turn(area, live, ends)
    type(live).follow = follow
    Path(OUT).write_text(json.dumps({**figures, "calls_that_wait": list(calls)}))
    space.shading.type = "SOLID"
    yield
    yield


def turn(area, live, ends):
    """Steps from one view to the next one's picture."""
    area.spaces.active.region_3d.view_rotation.rotate(Euler((0.0, 0.0, 0.02)))
    area.tag_redraw()
    before = live.number
    while live.number == before and time.monotonic() < ends:
        yield


def timed(engine, names):
    """The calls of an engine's methods from now on, each as its seconds by the clock and of this thread's processor."""
    calls = []

    def timing(method):
        def call(self, context, depsgraph):  # Blender counts them
            started = time.monotonic(), time.thread_time()
            method(self, context, depsgraph)
            calls.append((time.monotonic() - started[0], time.thread_time() - started[1]))

        return call

    for name in names:
        setattr(engine, name, timing(getattr(engine, name)))
    return calls


def swipe():
    """The reference left of a line: as the scene displays it, before the theme's background where nothing is, dragged, and gone
    without a trace."""
    scene = bpy.context.scene
    scene.render.film_transparent = True
    area, part = region("VIEW_3D", "WINDOW")
    space = area.spaces.active
    scene.virtual_pinhole_reference.samples = 16
    space.region_3d.view_perspective, space.shading.type = "CAMERA", "SOLID"
    space.overlay.show_overlays = space.show_gizmo = False
    yield
    package = type(scene.virtual_pinhole_reference).__module__.removesuffix("blender.render_settings")
    module = sys.modules[f"{package}blender.interface.swipe"]
    files = sys.modules[f"{package}blender.rendering.picture_files"]
    with bpy.context.temp_override(window=window(), area=area, region=part):
        before = datablocks()
        assert bpy.ops.viewcam.swipe_reference("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
    running, ends = module._running, time.monotonic() + 140
    longest = 0.0
    while running.live.samples < 16 and time.monotonic() < ends:
        step = time.monotonic()
        yield
        longest = max(longest, time.monotonic() - step)
    for _ in range(10):
        yield
    screen = screenshot("before")[part.y : part.y + part.height, part.x : part.x + part.width]
    light, alpha = np.split(running.live.picture, [3], axis=-1)
    straight = np.divide(light, alpha, out=np.zeros_like(light), where=alpha > 0)
    behind = np.array(bpy.context.preferences.themes[0].view_3d.space.gradients.high_gradient)
    expected = files.displayed(scene, straight)[..., :3] * alpha + behind * (1 - alpha)
    line = round(running.line())
    rows, columns = slice(60, part.height - 80), slice(120, line - 20)  # between header, tools and words
    left = np.abs(screen[rows, columns, :3] - expected[rows, columns, :3])
    right = np.abs(screen[rows, line + 20 :, :3] - expected[rows, line + 20 :, :3])
    y = part.y + part.height // 2
    move(part.x + line, y)
    yield
    window().event_simulate(type="LEFTMOUSE", value="PRESS", x=part.x + line, y=y)
    yield
    for step in range(1, 5):
        move(part.x + line + 50 * step, y)
        yield
    window().event_simulate(type="LEFTMOUSE", value="RELEASE", x=part.x + line + 200, y=y)
    yield
    moved = running.line() - line
    yield
    screenshot("dragged")
    number = running.live.number
    space.region_3d.view_perspective = "PERSP"
    space.region_3d.view_rotation.rotate(Euler((0.0, 0.0, 0.3)))
    area.tag_redraw()
    while (running.live.number == number or running.live.samples < 16) and time.monotonic() < ends:
        yield
    for _ in range(10):
        yield
    screenshot("turned")
    window().event_simulate(type="ESC", value="PRESS", x=part.x + 100, y=y)
    yield
    window().event_simulate(type="ESC", value="RELEASE", x=part.x + 100, y=y)
    yield
    assert module._running is None, "Escape does not end it"
    assert datablocks() == before, "it leaves something in the file"
    figures = {"left": float(left.mean() * 255), "right": float(right.mean() * 255), "moved": moved, "longest": longest}
    Path(OUT).write_text(json.dumps(figures))


def datablocks():
    return {name: [block.name for block in getattr(bpy.data, name)] for name in dir(bpy.data) if name in KINDS}


def screenshot(name):
    """The window, (height, width, 4), rows from the bottom; also a file beside OUT."""
    path, height = f"{OUT}-{name}.png", window().height
    crop = f"{window().width}x{height}+0+{SCREEN_HEIGHT - height}"
    subprocess.run(["import", "-window", "root", "-crop", crop, "+repage", "-depth", "8", path], check=True)
    image = bpy.data.images.load(path)
    width, height = image.size
    pixels = np.array(image.pixels[:], np.float32).reshape(height, width, 4)
    bpy.data.images.remove(image)
    return pixels


def wait_for(end):
    while not ended:
        yield
    assert ended == [end], ended


def steps():
    yield
    bpy.ops.wm.open_mainfile(filepath=FILE, load_ui=False)
    bpy.app.handlers.render_stats.append(on_stats)
    bpy.app.handlers.render_complete.append(on_complete)
    bpy.app.handlers.render_cancel.append(on_cancel)
    yield
    yield from {"render": render, "cancel": cancel, "view": view, "swipe": swipe}[PART]()


start(steps, interval=0.05)
