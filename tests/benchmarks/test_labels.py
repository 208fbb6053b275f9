"""The race of labels: both ways make the same, what is not the same is told, and neither a slow nor a wrong one passes."""

import json

import numpy as np
import pytest

from benchmarks import labels
from viewcam_addon.labels import masks


def passes(seed=0, height=30, width=40):
    rng = np.random.default_rng(seed)
    index = np.repeat(np.arange(height)[:, None] // 10, width, axis=1)[..., None].astype(np.float32)
    depth = rng.uniform(2, 9, (height, width, 1)).astype(np.float32)
    places, normals = (rng.normal(size=(height, width, 3)).astype(np.float32) for _ in range(2))
    return {"Object Index": index, "Material Index": index.copy(), "Depth": depth, "Position": places, "Normal": normals}


def test_what_differs_by_less_than_the_tolerances_is_the_same_and_what_is_no_number_is_not():
    ours, expected = passes(), passes()
    expected["Depth"] = expected["Depth"] * np.float32(1 + 5e-5)
    assert labels.differences(ours, expected) == dict.fromkeys(labels.TOLERANCES, 0.0)
    for name, share in {"Depth": 1e-3, "Position": 2e-3, "Normal": 0.02, "Object Index": 1, "Material Index": 1}.items():
        for wrong in (share * 9, np.nan):
            expected = passes()
            expected[name][3, 4, -1] += wrong
            errors = labels.differences(ours, expected)
            assert errors.pop(name) == pytest.approx(1 / 1200) and not any(errors.values())


def test_the_slower_and_the_wrong_miss_what_is_wanted():
    good = dict.fromkeys(labels.TOLERANCES, 1e-4)
    seconds = {name: labels.Spent(wall, 1.0) for name, wall in {"ours": 10, "passes": 9, "made of them": 2}.items()}
    assert labels.judged(seconds, good)
    assert not labels.judged({**seconds, "ours": labels.Spent(11.5, 1.0)}, good)
    assert not labels.judged(seconds, {**good, "Normal": 2e-3})


@pytest.mark.exhaustive
def test_both_ways_label_the_studio_alike_and_a_camera_that_is_off_is_told(tmp_path):
    pytest.importorskip("bpy")
    shots = labels.orbit(labels.STILL.resized(160, 120), 3)
    seconds = labels.measured(shots, tmp_path)
    assert all(min(each) > 0 for each in seconds.values()) and len(list(labels.table(seconds, 3))) == 5
    assert max(labels.compared(shots, tmp_path).values()) <= labels.ON_EDGES
    ours = labels._ours(tmp_path / "ours", shots[0])
    for number, shot in enumerate(shots, 1):
        record = json.loads((tmp_path / "theirs" / f"{number:04d}.json").read_text())
        index = labels._ours(tmp_path / "ours", shot)["Object Index"][::-1, :, 0]
        for each in record:
            mask = masks.decoded(each["visible"]["segmentation"])
            assert (mask != (index == each["object_index"])).mean() <= labels.ON_EDGES
    shifted = {name: np.roll(values, 1, axis=1) for name, values in ours.items()}
    assert min(labels.differences(ours, shifted).values()) > 10 * labels.ON_EDGES
