"""The cost of following: the work for one camera among many, what is written, and what 10,000 updates leave behind.

What takes time is measured as a multiple of what Blender itself takes for the like in the same process, so that slow and busy
machines count on both sides; what matters is counted.
"""

import gc
import itertools
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import conversion, findings, pose, storage

pytestmark = pytest.mark.slow


def update():
    bpy.context.view_layer.update()


@pytest.fixture
def target(empty):
    """An empty at (1, 2, 3)."""
    return empty("Target", (1, 2, 3))


@pytest.fixture
def placed(monkeypatch):
    """The names of the cameras that are placed, in order, as long as the test lasts."""
    names, set_rotations = [], pose.set_rotations

    def counting(blocks, *rest):
        names.extend(each.name for each in blocks)
        return set_rotations(blocks, *rest)

    monkeypatch.setattr(pose, "set_rotations", counting)
    return names


@pytest.fixture
def two_hundred_cameras(posed_camera, scene):
    """200 cameras that are enabled, each with data of its own; the first of them is the posed one."""
    result = [posed_camera]
    for _ in range(199):
        twin = posed_camera.copy()
        twin.data = posed_camera.data.copy()
        scene.collection.objects.link(twin)
        result.append(twin)
    update()
    return result


def key_the_eye(camera_object):
    group = camera_object.virtual_pinhole
    for frame in (1, 101):
        group.eye = (7, -6, frame)
        group.keyframe_insert("eye", frame=frame)


def test_one_target_among_200_cameras_places_one_camera(two_hundred_cameras, scene, target, placed):
    two_hundred_cameras[0].virtual_pinhole.look_at_target = target
    update()
    placed.clear()
    target.location.x = 5
    update()
    assert placed == ["Camera"]


def test_one_keyed_camera_among_200_is_the_only_one_that_a_frame_places(two_hundred_cameras, scene, placed):
    key_the_eye(two_hundred_cameras[0])
    scene.frame_set(1)
    placed.clear()
    scene.frame_set(50)
    assert placed == ["Camera"]


def test_an_edit_among_200_cameras_places_one_camera(two_hundred_cameras, placed):
    two_hundred_cameras[0].virtual_pinhole.eye = (1, 1, 9)
    update()
    assert placed == ["Camera"]


def test_what_no_camera_depends_on_moves_without_placing_any(two_hundred_cameras, scene, target, empty, placed):
    two_hundred_cameras[0].virtual_pinhole.look_at_target = target
    other = empty("Other")
    update()
    placed.clear()
    other.location.x = 5
    update()
    scene.frame_set(7)
    assert placed == []


def test_a_frame_looks_at_nothing_but_what_blender_has_evaluated(two_hundred_cameras, scene, monkeypatch):
    """However many objects there are: the values of the keyed cameras alone are loaded."""
    keyed = two_hundred_cameras[:3]
    for each in keyed:
        key_the_eye(each)
    scene.frame_set(1)
    asked, raw = [], storage.raw
    monkeypatch.setattr(storage, "raw", lambda each: asked.append(each.name) or raw(each))
    scene.frame_set(50)
    assert sorted(asked) == sorted(each.name for each in keyed)


def updates_of(action):
    """The names of the objects and data that Blender evaluates after an action, as often as it asks the handlers."""
    seen = []

    def note(_scene, depsgraph):
        seen.append(sorted(each.id.name for each in depsgraph.updates))

    bpy.app.handlers.depsgraph_update_post.append(note)
    try:
        action()
        update()
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(note)
    return seen


def test_an_edit_of_the_eye_does_not_touch_the_lens(posed_camera):
    update()
    data = posed_camera.data
    for seen in updates_of(lambda: setattr(posed_camera.virtual_pinhole, "eye", (1, 1, 9))):
        assert seen == ["Camera"], f"{data.name} and {len(seen) - 1} more were evaluated again"


def test_a_camera_in_place_is_not_written_to(posed_camera, scene):
    cameras.CameraSync.of(posed_camera).edited(scene)
    update()
    assert updates_of(lambda: cameras.CameraSync.of(posed_camera).edited(scene)) == []


def test_a_camera_that_was_moved_out_of_place_is_put_back(posed_camera, scene):
    cameras.CameraSync.of(posed_camera).edited(scene)
    before = posed_camera.matrix_basis.copy()
    for name, value in (("location", (1, 2, 3)), ("rotation_euler", (1, 2, 3)), ("rotation_mode", "ZYX")):
        setattr(posed_camera, name, value)
        cameras.CameraSync.of(posed_camera).edited(scene)
        np.testing.assert_allclose(posed_camera.matrix_basis, before, atol=findings.LARGEST_TURN, err_msg=name)
    posed_camera.data.lens = 20
    cameras.CameraSync.of(posed_camera).edited(scene)
    assert posed_camera.data.lens == pytest.approx(1500 * 36 / 1920)


def depsgraph():
    return bpy.context.evaluated_depsgraph_get()


def seconds_each(action, count=100, rounds=3):
    """Seconds of the processor for each action, in the best of a few rounds: other programs take none of them."""
    durations = []
    for _ in range(rounds):
        start = time.process_time()
        for i in range(count):
            action(i)
        durations.append((time.process_time() - start) / count)
    return min(durations)


# Calibrated: point, moved, target on a busy machine with any Blender from 4.2 to 5.2, where Blender's own move takes 0.04 ms (a
# point 51 with 4.2 beside another suite); keyed twice the 32 of Blender 5.0, where it takes 0.011 ms (a frame change does more
# of Blender's own than a move does).
LARGEST_MULTIPLES = {"point": 70, "moved": 70, "target": 62, "keyed": 64}


def least_of_few(measured, allowed, attempts=3):
    """A figure that is measured again while it is too large: a machine may be busy each time, what is slow is slow."""
    figure = measured()
    for _ in range(attempts - 1):
        figure = figure if figure < allowed else min(figure, measured())
    return figure


def as_multiple_of_blenders_own_move(once, plain):
    """The time of an update, in moves of a plain camera."""

    def move(i):
        plain.location.x = 0.01 * i
        update()

    return seconds_each(once) / seconds_each(move)


def an_update(kind, camera_object, scene, target):
    """A function that makes the i-th of them."""
    group = camera_object.virtual_pinhole
    if kind == "target":
        group.look_at_target = target

        def once(i):
            target.location = (0.01 * i, 0, 1)
            update()

    elif kind == "keyed":
        key_the_eye(camera_object)
        once = scene.frame_set
    elif kind == "moved":

        def once(i):
            camera_object.location.x = 7 + 0.01 * i
            update()

    else:

        def once(i):
            group.eye = (7 + 0.01 * i, -6, 5)
            update()

    return once


@pytest.mark.parametrize("mode", ["XYZ", "QUATERNION"])
@pytest.mark.parametrize("kind", LARGEST_MULTIPLES)
def test_an_update_takes_a_few_dozen_of_blenders_own_moves(posed_camera, add_camera, scene, target, kind, mode):
    plain, scene.camera = add_camera("Plain"), posed_camera
    posed_camera.rotation_mode = mode
    once = an_update(kind, posed_camera, scene, target)
    multiple = least_of_few(lambda: as_multiple_of_blenders_own_move(once, plain), LARGEST_MULTIPLES[kind])
    assert multiple < LARGEST_MULTIPLES[kind], f"{multiple:.0f} moves"


def test_an_edit_that_places_its_camera_ten_times_would_be_noticed(posed_camera, add_camera, scene, target, monkeypatch):
    plain, scene.camera, place = add_camera("Plain"), posed_camera, conversion.place

    def ten_times(camera_object, pinhole, *rest):
        for _ in range(10):
            place(camera_object, replace(pinhole), *rest)

    monkeypatch.setattr(conversion, "place", ten_times)
    multiple = as_multiple_of_blenders_own_move(an_update("point", posed_camera, scene, target), plain)
    assert multiple > LARGEST_MULTIPLES["point"], f"{multiple:.0f} moves"


def others_cost(cameras_at_rest, target):
    """The time of another object's move where these are enabled, as a multiple of its time where they are plain cameras.

    Each the least of rounds that take turns, so that what else the machine does falls on both.
    """

    def move(i):
        target.location.x = 0.01 * i
        update()

    taken = {True: [], False: []}
    for is_enabled in [True, False] * 5:
        for each in cameras_at_rest:
            each.virtual_pinhole.enabled = is_enabled
        update()
        taken[is_enabled].append(seconds_each(move, 50, 2))
    return min(taken[True]) / min(taken[False])


def test_two_hundred_cameras_at_rest_cost_nothing(two_hundred_cameras, target):
    """But for what clocks and caches make of the same work, calibrated: from 0.92 to 1.01 was found."""
    assert least_of_few(lambda: others_cost(two_hundred_cameras, target), 1.15) < 1.15


def test_a_look_at_three_values_of_each_camera_at_rest_would_be_noticed(two_hundred_cameras, target):
    def look(_scene, _depsgraph):
        groups = [each.virtual_pinhole for each in two_hundred_cameras]
        return [(group.eye, group.look_at, group.up) for group in groups if group.enabled]

    bpy.app.handlers.depsgraph_update_post.append(look)
    try:
        assert others_cost(two_hundred_cameras, target) > 1.15
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(look)


def leftovers(once, count, rounds=3):
    """(blocks of memory of Python's, bytes of the process, datablocks) that `count` updates leave.

    Each the least of a few rounds: a leak is there in every one, a cache or a thread of something else in one.
    """
    for i in range(50):
        once(i)
    all_kept = [kept()]
    for _ in range(rounds):
        for i in range(count):
            once(50 + i)
        all_kept.append(kept())
    grown = [[there - here for here, there in zip(*pair, strict=True)] for pair in itertools.pairwise(all_kept)]
    return [min(each, key=abs) for each in zip(*grown, strict=True)]


def kept():
    """Allocated blocks, memory and datablocks without what is remembered for a while, which is a fixed number of entries."""
    cameras.forget_all()
    storage._parsed.cache_clear()
    gc.collect()
    return sys.getallocatedblocks(), largest_memory(), count_of_datablocks()


def largest_memory():
    """Bytes: the most that this process has ever had. 0 on Windows, where nothing can be said of it."""
    if sys.platform == "win32":
        return 0
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def count_of_datablocks():
    return sum(len(each) for each in (bpy.data.objects, bpy.data.cameras, bpy.data.actions)) + sum(
        len(each.animation_data.drivers) for each in bpy.data.objects if each.animation_data
    )


@pytest.mark.parametrize(
    ("kind", "count"),
    [("point", 200), ("target", 200), ("keyed", 200), pytest.param("target", 3000, marks=pytest.mark.exhaustive)],
)
def test_updates_leave_nothing_behind(posed_camera, scene, target, kind, count):
    group = posed_camera.virtual_pinhole
    if kind == "target":
        group.look_at_target = target

        def once(i):
            target.location = (1e-3 * i, 0, 1)
            update()

    elif kind == "keyed":
        key_the_eye(posed_camera)

        def once(i):
            scene.frame_set(i % 100)
    else:

        def once(i):
            group.eye = (7 + 1e-3 * i, -6, 5)
            update()

    python, process, datablocks = leftovers(once, count)
    assert python < count / 2, f"{python} blocks of Python's memory are left by {count} updates"
    assert process < 16 * 2**20, f"the process has grown by {process / 2**20:.1f} MiB"
    assert datablocks == 0, f"{datablocks} datablocks are left"


def test_a_leak_of_one_number_an_update_would_be_noticed(posed_camera):
    leaked = []

    def once(i):
        posed_camera.virtual_pinhole.eye = (7 + 1e-3 * i, -6, 5)
        update()
        leaked.append(float(i))

    python, *_ = leftovers(once, 200)
    assert python >= 200 / 2, f"{python} blocks"


def key_eye_and_look_at(camera_object, number):
    group = camera_object.virtual_pinhole
    for frame, away in ((1, 7), (101, 9)):
        group.eye, group.look_at = (away, -6 - number / 50, frame / 9), (number / 70, frame / 99, 1)
        group.keyframe_insert("eye", frame=frame)
        group.keyframe_insert("look_at", frame=frame)


def key_the_pose(camera_object, number=0):
    for frame in (1, 101):
        camera_object.location, camera_object.rotation_euler = (7, -6 - number / 50, frame), (1, 0, frame / 30)
        camera_object.keyframe_insert("location", frame=frame)
        camera_object.keyframe_insert("rotation_euler", frame=frame)


# Calibrated: half of what it takes while each camera is placed, or followed, by itself (62 and 119 times on one machine, 55 and
# 89 on another). In one pass 4.2 takes 9 to 22 times Blender's own, by machine and what else runs. Below 2.5 it can't be: a
# camera that is set as a frame changes is copied and evaluated by Blender a second time.
LARGEST_MULTIPLE_OF_KEYED = 30


def seconds_of_a_frame(scene):
    scene.frame_set(1)
    return seconds_each(lambda i: scene.frame_set(2 + i), 30)


def multiple_of_keyed(keyed_cameras, scene, kind):
    """A frame of cameras in use whose values are keyed, or location and rotation, in frames of as many plain ones."""
    for number, each in enumerate(keyed_cameras):
        each.virtual_pinhole.enabled = True
        if kind == "values":
            key_eye_and_look_at(each, number)
        else:
            key_the_pose(each, number)
    keyed = seconds_of_a_frame(scene)
    for number, each in enumerate(keyed_cameras):
        each.virtual_pinhole.enabled = False
        each.animation_data_clear()
        key_the_pose(each, number)
    return keyed / seconds_of_a_frame(scene)


@pytest.mark.parametrize("kind", ["values", "pose"])
def test_two_hundred_keyed_cameras_are_carried_in_one_pass(two_hundred_cameras, scene, kind):
    multiple = least_of_few(lambda: multiple_of_keyed(two_hundred_cameras, scene, kind), LARGEST_MULTIPLE_OF_KEYED, 2)
    assert multiple < LARGEST_MULTIPLE_OF_KEYED, f"{multiple:.1f} times Blender's own"
