"""Runs inside a real Blender with a window: takes the pictures of docs/artists.md that no step of the tour (tour.py) takes.

blender --enable-event-simulate -p 0 0 1600 1000 --addons … --python pictures_in_a_window.py -- FOLDER PHOTO [PART…]

FOLDER : docs/images.
PHOTO : the photograph that photo_of_a_room.py draws.
PART : the name of a function of STEPS; without any, all of them run.

test_window.py runs this. Leaves with status 0, or 5 and a traceback.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).parent))
from hands import (
    NOWHERE,
    SIDEBAR,
    VIEWPORT,
    call,
    hide_the_sidebar,
    match_photo,
    move,
    photograph,
    press,
    region,
    seen,
    settle,
    start,
    until,
    window,
)
from tour_step import room

FOLDER, PHOTO, *PARTS = sys.argv[sys.argv.index("--") + 1 :]
FOLDER, PHOTO = Path(FOLDER), Path(PHOTO)
STUDIO = Path(__file__).resolve().parent.parent.parent / "sample_scenes" / "studio.blend"
SAMPLES, PATIENCE = 8, 3000  # light's, and seconds until it is there
WIDER = 60  # pixels that the engine's settings take of the viewport for its picture
EDGE, LEGEND = 24, 70  # pixels around the pictures of a proof, and below them
# (axis, start, end) of edges of the room, world space.
EDGES = (
    ("X", (-0.1, 0.8, 0.78), (1.3, 0.8, 0.78)),
    ("X", (-0.6, 2.6, 0.0), (1.9, 2.6, 0.0)),
    ("Y", (2.6, 1.0, 0.0), (2.6, 2.55, 0.0)),
    ("Y", (1.3, 0.8, 0.78), (1.3, 1.6, 0.78)),
    ("Y", (-0.1, 0.8, 0.78), (-0.1, 1.6, 0.78)),
    ("Z", (2.6, 2.6, 0.1), (2.6, 2.6, 2.2)),
    ("Z", (0.0, 0.9, 0.02), (0.0, 0.9, 0.66)),
)


def photo_match():
    """Edges of the room, dragged over its picture, by a camera that looks elsewhere."""
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    yield
    scene, camera = bpy.context.scene, bpy.data.objects["Camera"]
    for name in ("Cube", "Light"):
        bpy.data.objects.remove(bpy.data.objects[name])
    photo = bpy.data.images.load(str(PHOTO))
    scene.render.resolution_x, scene.render.resolution_y = photo.size
    values = camera.virtual_pinhole
    values.enabled = True
    values.eye, values.look_at, values.up, values.distance = (-1.7, -1.9, 1.75), (0.75, 1.3, 0.95), (0, 0, 1), 800
    bpy.context.view_layer.update()
    edges = seen(camera, EDGES)
    values.look_at, values.distance = (0.0, 0.0, 1.5), 1100
    background = camera.data.background_images.new()
    background.image, background.alpha = photo, 1.0
    camera.data.show_background_images = True
    view, part = region(*VIEWPORT)
    overlay = view.spaces.active.overlay  # the world's axes have the colors of the edges
    overlay.show_floor = overlay.show_axis_x = overlay.show_axis_y = False
    view.spaces.active.region_3d.view_perspective = "CAMERA"
    yield from hide_the_sidebar()
    yield from settle()
    call(bpy.ops.view3d.view_center_camera)
    yield from settle()
    matching, mouse = yield from match_photo(edges)
    assert matching.result, matching.sentence
    _, part = region(*VIEWPORT)
    photograph((part.x, part.y, part.width, part.height), FOLDER / "photo-match.png", 60, mouse)
    press("ESC", *NOWHERE)
    yield from settle()


def export():
    """The list of what an exported scene lacks, over the scene: a haze, which is no surface."""
    yield from open_the_studio()
    (view, part), (name, at) = region(*VIEWPORT), ("Haze", (0.0, 1.0, 2.0))
    haze = bpy.data.materials.new(name)
    if not haze.node_tree:  # new materials have one from 5.0 on
        haze.use_nodes = True
    tree = haze.node_tree
    tree.nodes.clear()
    scatter, output = tree.nodes.new("ShaderNodeVolumeScatter"), tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(scatter.outputs["Volume"], output.inputs["Volume"])
    with bpy.context.temp_override(window=window(), area=view, region=part):
        bpy.ops.mesh.primitive_cube_add(size=1, location=at)
    bpy.context.object.name = name
    bpy.context.object.data.materials.append(haze)
    bpy.context.object.display_type = "WIRE"
    move(part.x + part.width * 0.35, part.y + part.height * 0.7)
    yield from settle()
    with tempfile.TemporaryDirectory() as scratch, bpy.context.temp_override(window=window(), area=view, region=part):
        bpy.ops.viewcam.export_scene(filepath=str(Path(scratch, STUDIO.with_suffix(".json").name)))
    yield from settle()
    photograph((part.x, part.y, part.width, part.height), FOLDER / "artists" / "export.png", 60)
    press("ESC", *NOWHERE)
    yield from settle()


def preferences():
    """The add-on's own, without the folder that it is installed in."""
    package = room("preferences").PACKAGE
    bpy.ops.preferences.addon_enable(module=package)  # Blender lists what was enabled there, not from the command line
    view, _ = region(*VIEWPORT)
    view.type = "PREFERENCES"
    bpy.context.preferences.active_section = "ADDONS"
    bpy.context.window_manager.addon_search = "Virtual Pinhole"
    with bpy.context.temp_override(window=window(), area=view):
        bpy.ops.preferences.addon_expand(module=package)
    yield from settle()
    picture = FOLDER / "artists" / "preferences.png"
    height = 0.46 * view.height  # below it is nothing
    photograph((view.x, view.y + view.height - height, view.width, height), picture, 60)
    over_the_folder = ("-fill", "rgb(40,39,38)", "-draw", "rectangle 110,127 775,141")
    subprocess.run(["convert", picture, *over_the_folder, picture], check=True)
    view.type = "VIEW_3D"
    yield from settle()


def open_the_studio():
    """Steps to the sample scene, through its camera, in the layout as it is."""
    bpy.ops.wm.open_mainfile(filepath=str(STUDIO), load_ui=False)
    yield
    scene, (view, _) = bpy.context.scene, region(*VIEWPORT)
    window().view_layer.objects.active = scene.camera
    view.spaces.active.region_3d.view_perspective = "CAMERA"
    view.spaces.active.overlay.show_overlays = False
    yield from settle()
    call(bpy.ops.view3d.view_center_camera)
    yield from settle()


def reference_over_eevee():
    """Swipe in Viewport."""
    yield from open_the_studio()
    view, part = region(*VIEWPORT)
    scene, shading = bpy.context.scene, view.spaces.active.shading
    scene.render.engine = bpy.types.RenderSettings.bl_rna.properties["engine"].default
    scene.virtual_pinhole_reference.samples = SAMPLES
    shading.type = "RENDERED"
    yield from settle()
    call(bpy.ops.viewcam.swipe_reference)
    swipe = room("interface.swipe")
    yield from until(lambda: swipe._running.live.samples == SAMPLES, "the light", PATIENCE)
    yield from settle()
    mouse = part.x + swipe._running.line(), part.y + part.height / 2
    photograph((part.x, part.y, part.width, part.height), FOLDER / "artists" / "swipe.png", 60, mouse)
    call(bpy.ops.viewcam.swipe_reference)
    shading.type = "SOLID"
    yield from settle()


def reference_in_the_viewport():
    """Rendered shading by the engine, beside its settings."""
    yield from open_the_studio()
    view, _ = region(*VIEWPORT)
    scene = bpy.context.scene
    scene.render.engine, scene.virtual_pinhole_reference.samples = "VIEWCAM", SAMPLES
    properties, _ = region("PROPERTIES", "WINDOW")
    properties.spaces.active.context = "RENDER"
    yield from widen(properties, WIDER)  # the engine's name has room
    view.spaces.active.shading.type = "RENDERED"
    live = room("rendering.live_view").LiveView
    yield from until(lambda: any(each.samples == SAMPLES for each in live._all), "the light", PATIENCE)
    yield from settle()
    right, bottom = properties.x + properties.width, view.y
    photograph((view.x, bottom, right - view.x, view.height), FOLDER / "engine.png", 60)
    view.spaces.active.shading.type = "SOLID"
    yield from widen(properties, -WIDER)


def widen(area, pixels):
    """Steps that move the left edge of an area, through whose neighbor the camera is seen."""
    edge = {"x": area.x - 1, "y": area.y + area.height // 2}
    move(**edge)  # with the mouse over an editor it is refused
    yield from settle()
    with bpy.context.temp_override(window=window()):
        bpy.ops.screen.area_move(**edge, delta=-pixels)
    yield from settle()
    call(bpy.ops.view3d.view_center_camera)
    yield from settle()


def proof():
    """The panel with its green tick, and what Show brings beside it."""
    yield from open_the_studio()
    camera = bpy.context.scene.camera
    camera.virtual_pinhole.enabled = True
    yield from hide_the_sidebar(hidden=False)
    background = room("interface.proof").background
    call(bpy.ops.viewcam.compare_with_cycles, camera=camera.name)
    yield from until(lambda: background.latest, "the verdict", PATIENCE)
    assert background.latest.answer == "same", background.latest.verdict
    view, sidebar = region(*SIDEBAR)
    with bpy.context.temp_override(window=window(), area=view, region=view.regions[-1]):
        share = 1.4 * sidebar.width / view.width  # Blender narrows a sidebar that is all of its viewport
        bpy.ops.screen.area_split(direction="VERTICAL", factor=1 - share)
    yield from settle()
    left, right = sorted((area for area in window().screen.areas if area.type == "VIEW_3D"), key=lambda area: area.x)
    left.type = "IMAGE_EDITOR"
    right.spaces.active.show_region_toolbar = False
    yield from settle()
    next(part for part in right.regions if part.type == "UI").active_panel_category = "Pinhole"
    call(bpy.ops.viewcam.show_difference)
    yield from fitted()
    part = next(part for part in left.regions if part.type == "WINDOW")
    (x0, y0), (x1, y1) = (part.view2d.view_to_region(at, at, clip=False) for at in (0, 1))
    whole = part.x + x0 - EDGE, part.y + y0 - LEGEND, x1 - x0 + 2 * EDGE, y1 - y0 + LEGEND + EDGE
    photograph(whole, FOLDER / "proof-pictures.png")
    bpy.context.window_manager.virtual_pinhole_proof.view = "SWIPE"
    yield from fitted()
    photograph((left.x, left.y, right.x + right.width - left.x, left.height), FOLDER / "artists" / "proof.png", 75)


def fitted():
    """Steps until a picture has the size of its editor, which it gets a moment later."""
    for _ in range(60):
        yield


def steps():
    yield
    bpy.context.preferences.system.viewport_aa = "OFF"  # drawn in software
    for each in STEPS:
        if not PARTS or each.__name__ in PARTS:
            yield from each()
            print(f"done: {each.__name__}", flush=True)
    print("done: the pictures", flush=True)


STEPS = (photo_match, preferences, export, reference_over_eevee, reference_in_the_viewport, proof)
start(steps)
