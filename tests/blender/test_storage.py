"""What files hold.

`saved/values.blend` was saved with Blender 4.2 by the last version without CameraValues; `saved/values.json` is what that read.
"""

import json
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import storage
from viewcam_addon.camera_values import CameraValues

SAVED = Path(__file__).parent / "saved"
READ_BY_THE_OLD_VERSION = json.loads((SAVED / "values.json").read_text(encoding="utf-8"))


def digits(camera_object):
    """What the values ask for, to the bit."""
    stated = cameras.stated(camera_object, bpy.context.scene)
    if stated is None:
        return None
    return [number.hex() for number in (*stated.eye, *stated.look_at, *stated.up, *stated.distance)]


@pytest.mark.parametrize("name", READ_BY_THE_OLD_VERSION)
def test_a_file_of_an_older_version_opens_with_the_same_values_to_the_bit(fresh_blender, name):
    fresh_blender.ops.wm.open_mainfile(filepath=str(SAVED / "values.blend"))
    camera_object = fresh_blender.data.objects[name]
    group, expected = camera_object.virtual_pinhole, READ_BY_THE_OLD_VERSION[name]
    assert digits(camera_object) == expected["stated"]
    assert group.precision() == expected["precision"]
    assert camera_object.data.lens.hex() == expected["lens"]
    group.zoom = 1.5
    assert digits(camera_object) == expected["edited"]
    assert camera_object.data.lens.hex() == expected["edited_lens"]
    assert (float(group.roll).hex(), group.held_roll.hex()) == (expected["roll"], expected["held_roll"])


def test_what_is_stored_is_loaded_again_to_the_bit(camera_object, scene):
    frame = cameras.datablocks.frame_of(scene)
    values = CameraValues(
        eye=(0.1, 1e-9, 1 / 3),
        look_at=(-0.1, 2 / 7, -1e20),
        up=(1e-30, 0.0, 0.7),
        distance=1234.56789,
        zoom=0.5,
        keeps="FIELD_OF_VIEW",
        counted_in=frame,
        set_for=frame,
        pole="HOLD",
        hold_within=0.25,
        held_roll=-0.75,
        view_when_set=((0.1, 0.2, 0.3), (0.4, 0.5, 0.6), (0.7, 0.8, 0.9)),
        precision=2.0**-53,
    )
    names = [name for name in vars(values) if name not in ("precision", "enabled")]
    storage.store(camera_object, values, *names)
    assert storage.load(camera_object) == values


def test_storing_moves_nothing(posed_camera):
    before = posed_camera.matrix_basis.copy(), posed_camera.data.lens
    values = storage.load(posed_camera)
    storage.store(posed_camera, CameraValues((1, 2, 3), values.look_at, values.up, 77.0), *storage.EXACT)
    assert (posed_camera.matrix_basis, posed_camera.data.lens) == before
    assert posed_camera.virtual_pinhole.numbers() == ((1, 2, 3), (0, 0, 1), (0, 0, 1), 77)


def test_what_is_restored_is_as_it_was_whatever_was_stored(posed_camera):
    group = posed_camera.virtual_pinhole
    group.counted_in, group.exact = (1.5, -3, 0, 1e-30, 7), "nonsense"  # what is no picture and no number, either
    with storage.restored(posed_camera, "keeps", "counted_in", "exact"):
        group.keeps, group.counted_in, group.exact = "FIELD_OF_VIEW", (1, 2, 3, 4, 5), "[]"
    assert (group.keeps, group.exact) == ("PIXELS", "nonsense")
    assert tuple(group.counted_in) == pytest.approx((1.5, -3, 0, 1e-30, 7))
