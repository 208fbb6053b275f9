"""Runs inside a real Blender with a window: an artist's first day, by mouse and keys, and what came of it.

blender --enable-event-simulate -p 0 0 1600 1000 --addons … --python artist_in_a_window.py -- FOLDER [PICTURES]

FOLDER : where rendered pictures and reports go. PICTURES : where pictures of the window go; without it none are taken.
What each part of the add-on does beyond that day is in tour_, handles_, proof_ and cameras_in_a_window.py.
Leaves with status 0, or 5 and a traceback.
"""

import sys
import time
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).parent))
import artist_cameras
import artist_lens
import artist_moves
import artist_photo
import artist_proof
from hands_in_a_window import open_the_panels, start

# What would send an artist away again, and what is tried of it. Each part goes on where the one before it has ended.
DAY = {
    "The lens can be set in the panel": (artist_lens.tick_the_box, artist_lens.choose_the_unit),
    "Fields go as far as Blender's own": (artist_lens.drag_the_fields,),
    "Whatever moves the camera moves its values": (
        artist_lens.type_millimeters,
        artist_moves.grab_and_turn,
        artist_moves.orbit_and_walk_in_the_cameras_view,
    ),
    "A larger picture shows the same": (artist_lens.double_the_resolution,),
    "Framed is in the middle, and a drag goes with the mouse": (artist_moves.frame_the_cube, artist_moves.dolly_by_a_button),
    "A proof that passes looks like one": (artist_proof.prove_two_cameras_during_playback,),
    "The panel knows its camera, and warns of what is wrong alone": (
        artist_cameras.bake_and_turn_on_again,
        artist_cameras.use_a_camera_on_a_rig,
        artist_cameras.convert_the_cameras_own_keyframes,
        artist_cameras.step_to_the_next_camera,
        artist_cameras.another_object_is_active,
        artist_cameras.tick_an_orthographic_camera,
        artist_cameras.look_for_copy_read_out,
        artist_cameras.look_straight_down,
    ),
    "What is drawn can be read": (artist_cameras.draw_on_light_and_dark,),
    "All cameras are rendered by one click": (artist_cameras.render_two_formats,),
    "There is always a way to a camera": (artist_cameras.add_a_camera_where_there_is_none,),
    "A photo gives its camera": (artist_photo.escape_from_a_match, artist_photo.match_a_photo),
}


def steps():
    yield
    bpy.context.preferences.system.viewport_aa = "OFF"  # drawn in software
    yield from open_the_panels()
    for promise, parts in DAY.items():
        for part in parts:
            started = time.process_time()
            yield from part()
            print(f"done: {part.__name__} in {time.process_time() - started:.1f} CPU s", flush=True)
        print(f"kept: {promise}", flush=True)
    print("done: the day", flush=True)


start(steps)
