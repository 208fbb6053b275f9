"""Keyed cameras that a frame carries in one pass stand where each by itself would, to the bit."""

import itertools

import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import conversion, storage
from viewcam_addon.blender.camera import CameraSync

MODES = (*("".join(order) for order in itertools.permutations("XYZ")), "QUATERNION", "AXIS_ANGLE")
FRAMES = range(2, 60, 7)
KEYS = {
    "eye": lambda i, frame: (7 - i, frame / 20 - 3, 5 + i / 3),
    "look_at": lambda i, frame: (frame / 30, i / 7, 1.0),
    "up": lambda i, frame: (i / 40, frame / 300, 1.0),
    "distance": lambda i, frame: 900.0 + 10 * i + frame,
    "zoom": lambda i, frame: 1.0 + frame / 100,
}


@pytest.fixture
def crowd(add_camera, scene):
    """Cameras in each rotation mode with each of the values keyed, some with deltas, mirrored, parented, held or focused."""
    result = []
    for i, mode in enumerate(MODES * 3):
        camera_object = add_camera(f"Camera {i}")
        camera_object.rotation_mode = mode
        group = camera_object.virtual_pinhole
        group.enabled, group.keeps = True, "PIXELS"
        for frame, name in itertools.product((1, 60), list(KEYS)[: 1 + i % len(KEYS)]):
            setattr(group, name, KEYS[name](i, frame))
            group.keyframe_insert(name, frame=frame)
        result.append(camera_object)
    result[1].delta_location = (1, 2, 3)
    result[2].scale = (-1, 1, 1)
    result[3].parent = result[0]
    result[4].virtual_pinhole.pole = "HOLD"
    result[5].virtual_pinhole.focus_on_look_at = True
    scene.frame_set(1)
    return result


def states(crowd):
    return [(conversion.state_of(each), storage.load(each), each.data.dof.focus_distance) for each in crowd]


def flight_of(crowd, scene):
    cameras.forget_all()
    scene.frame_set(1)
    flight = []
    for frame in FRAMES:
        scene.frame_set(frame)
        flight.append(states(crowd))
    return flight


def test_cameras_that_are_carried_together_stand_to_the_bit_where_each_by_itself_would(crowd, scene, monkeypatch):
    together = flight_of(crowd, scene)
    monkeypatch.setattr(CameraSync, "carry", lambda cameras, _scene, _depsgraph: [sync for sync, _ in cameras])
    alone = flight_of(crowd, scene)
    for frame, *flight in zip(FRAMES, together, alone, strict=True):
        for each, state, expected in zip(crowd, *flight, strict=True):
            assert state == expected, f"frame {frame}, {each.name}, {each.rotation_mode}"


def test_most_of_them_are_carried_together(crowd, scene, monkeypatch):
    left, carry = [], CameraSync.carry

    def counting(*arguments):
        syncs = carry(*arguments)
        left.append([sync.camera_object.name for sync in syncs])
        return syncs

    scene.frame_set(2)
    monkeypatch.setattr(CameraSync, "carry", counting)
    scene.frame_set(3)
    assert set(left[0]) == {f"Camera {i}" for i in (1, 2, 3, 4)}


def test_a_camera_whose_values_make_none_for_a_while_stays_and_goes_on(add_camera, scene, capfd):
    first, second = add_camera("First"), add_camera("Second")
    for camera_object, eyes in ((first, ((0, 0, 4), (0, 0, -4))), (second, ((0, 3, 4), (0, 3, -4)))):
        group = camera_object.virtual_pinhole
        group.eye, group.look_at, group.enabled = (0, 3, 4), (0, 0, 0), True
        for frame, eye in zip((1, 9), eyes, strict=True):
            group.eye = eye
            group.keyframe_insert("eye", frame=frame)
        for curve in _curves(camera_object):
            for point in curve.keyframe_points:
                point.interpolation = "LINEAR"
    for frame in (4, 5, 6):
        scene.frame_set(frame)
        assert second.location.z == pytest.approx(5 - frame, abs=1e-6)
        assert first.location.z == pytest.approx(5 - frame if frame != 5 else 1, abs=1e-6)
    assert "First" in capfd.readouterr().err


def _curves(camera_object):
    from viewcam_addon.blender import versions

    return versions.action_curves(camera_object)


def test_a_camera_that_was_moved_by_hand_is_brought_back_by_the_next_frame(crowd, scene):
    expected = flight_of(crowd, scene)[0]
    scene.frame_set(1)
    crowd[0].location.x += 1
    scene.frame_set(FRAMES[0])
    assert states(crowd)[0][0] == expected[0][0]
