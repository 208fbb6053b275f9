"""An artist's first day: a proof that passes, of two cameras, during playback."""

import time

import bpy
from artist_hands import FOLDER, picture, room
from hands_in_a_window import NOWHERE, WAITING, camera, press, window
from tour_hands import call, settle, until

PATIENCE = 120  # seconds that one comparison may take on a busy machine


def prove_two_cameras_during_playback():
    """Escape ends the playback and not the proof; a pass opens no window and touches no image; no report replaces another's."""
    scene, proof = bpy.context.scene, room("interface.proof")
    settings = bpy.context.window_manager.virtual_pinhole_proof
    scene.render.resolution_x, scene.render.resolution_y = 64, 36
    settings.folder = str(FOLDER / "reports")
    bpy.data.images.new("Viewer Node", 8, 8)
    other = bpy.data.objects.new("Close-Up", camera().data)
    scene.collection.objects.link(other)
    other.matrix_world = camera().matrix_world
    images = _of_all_images()
    for each in (camera(), other):
        window().view_layer.objects.active = each
        yield from settle()
        call(bpy.ops.viewcam.compare_with_cycles, camera=each.name)  # as Render › Compare with Cycles does
        yield from until(lambda: proof.background.running, f"the comparison of {each.name}")
        yield from _play_and_press_escape(proof)
        ends = time.monotonic() + PATIENCE
        while proof.background.running and time.monotonic() < ends:
            yield WAITING
        outcome = proof.background.latest
        assert outcome and outcome.answer == "same" and outcome.camera == each.name, outcome
        assert outcome.headline.startswith("Identical to ") and outcome.headline.endswith(" px"), outcome.headline
        assert len(bpy.context.window_manager.windows) == 1, "a pass opens a window"
        assert _of_all_images() == images, "a pass touches an image of the file's"
        assert (FOLDER / "reports") in outcome.report.parents and each.name in outcome.report.parent.name, outcome.report
        yield from settle()
    assert len(list((FOLDER / "reports").iterdir())) == 2, "the second camera's report has replaced the first's"
    yield from picture("proof")
    yield from _show_it(images)
    window().view_layer.objects.active = camera()
    bpy.data.objects.remove(other)
    scene.render.resolution_x, scene.render.resolution_y = 1920, 1080
    settings.property_unset("folder")
    yield


def _play_and_press_escape(proof):
    call(bpy.ops.screen.animation_play)
    yield
    assert window().screen.is_animation_playing and proof.background.running, (
        "the proof was over before Escape could be pressed"
    )
    press("ESC", *NOWHERE)
    yield from until(lambda: not window().screen.is_animation_playing, "the end of the playback")
    assert proof.background.running, "Escape during playback has canceled the proof"


def _show_it(images):
    """Show: Cycles, the tracer and what differs, in an image of their own."""
    call(bpy.ops.viewcam.show_difference)
    yield from until(lambda: len(bpy.context.window_manager.windows) == 2, "the window of Show")
    (area,) = bpy.context.window_manager.windows[1].screen.areas
    image = area.spaces.active.image
    assert image and image.name == "Virtual Pinhole Proof" and _of_all_images().items() >= images.items()
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[1], area=area, region=area.regions[-1]):
        bpy.ops.image.view_all()
    yield from settle()
    yield from picture("proof_shown")
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[1]):
        bpy.ops.wm.window_close()
    yield from settle()


def _of_all_images():
    return {each.name: (tuple(each.size), each.source, each.packed_file is None) for each in bpy.data.images}
