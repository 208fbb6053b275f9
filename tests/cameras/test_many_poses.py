"""Thousands of poses at once are those that are made one by one."""

import dataclasses

import numpy as np
import pytest

from viewcam_addon import cameras
from viewcam_addon.cameras import Options, axes
from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole

from .conftest import CAMERAS, PLAIN


def test_matrices_at_once_are_the_pinholes_and_the_notes_of_each():
    pinholes = [*CAMERAS.values()]  # mirrored ones among them, which are told
    matrices = np.array([axes.camera_to_world(pinhole) for pinhole in pinholes])[:, :3]
    matrices[0, :, :3] *= 1.5  # a scale, which is told
    matrices[1, 0, 1] += 5e-4  # few digits, likewise
    planes, names = [pinhole.plane for pinhole in pinholes], [*CAMERAS]
    together = axes.pinholes(matrices, planes, names)
    apart = [axes.pinhole(*each) for each in zip(matrices, planes, names, strict=True)]
    assert [notes for _, notes in together] == [notes for _, notes in apart]
    assert [bool(notes) for _, notes in together] == [
        name in names[:2] or pinhole.mirrored for name, pinhole in CAMERAS.items()
    ]
    for (first, _), (other, _) in zip(together, apart, strict=True):
        assert (first.eye, first.plane, first.mirrored) == (other.eye, other.plane, other.mirrored)
        assert np.abs(np.array(first.axes()) - other.axes()).max() < 2e-15
    matrices[4, :, 0] *= 2
    with pytest.raises(InputError, match=f"{names[4]} has axes of the lengths 2 by 1 by 1"):
        axes.pinholes(matrices, planes, names)


def test_pinholes_of_arrays_are_those_of_the_constructor():
    pinholes = [dataclasses.replace(pinhole, mirrored=False) for pinhole in CAMERAS.values()]
    points = [[getattr(pinhole, name) for pinhole in pinholes] for name in ("eye", "look_at", "up")]
    many = Pinhole.of_poses(*points, [pinhole.plane for pinhole in pinholes])
    assert many == pinholes and [hash(each) for each in many] == [hash(each) for each in pinholes]
    assert [each.axes() for each in many] == [each.axes() for each in pinholes]
    assert repr(dataclasses.replace(many[0], width=7)) == repr(dataclasses.replace(pinholes[0], width=7))
    points[0][2] = points[1][2]
    with pytest.raises(InputError, match="pose 2: "):
        Pinhole.of_poses(*points, [pinhole.plane for pinhole in pinholes])


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("3 1 2 x 0 0 0 1", "line 32 of"),
        ("3 1 2 3 0 0 0", "line 32 of .* has 7 numbers and others have 8"),
        ("3 1 2 3 0 0 0 1e999", "line 32 of"),
        ("3 1 2 nan 0 0 0 1", "line 32 of"),
        ("3 1 2 3 0 0 1 1", "quaternion of pose 30 has the length 1.41421"),
    ],
)
def test_a_wrong_line_of_a_trajectory_is_named(tmp_path, line, sentence):
    path = tmp_path / "groundtruth.txt"
    right = "".join(f"{second} 1 2 3 0 0 0 1\n" for second in range(30))  # by more lines than it is recognized by
    path.write_text(f"# timestamp tx ty tz qx qy qz qw\n{right}{line}\n")
    with pytest.raises(InputError, match=sentence):
        cameras.read(path, format="trajectories", options=Options(base=PLAIN))
