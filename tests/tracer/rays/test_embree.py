"""Embree's scenes: those made by its own functions answer as those that embreex makes, and refitted ones as new ones."""

import numpy as np
import pytest

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.rays import embree
from viewcam_addon.tracer.rays.triangles import triangles_of
from viewcam_addon.tracer.rays.view import View
from viewcam_addon.tracer.scene import Object

VIEW = View(Pinhole((0, 0, 9), (0, 0, 0), (0, 1, 0), 100.0, 100, 100))

pytestmark = pytest.mark.skipif(embree._EMBREE is None, reason="Embree's own functions are not there")


def soup(rng, count=2000):
    return rng.normal(size=(3 * count, 3)) * 3, np.arange(3 * count, dtype=np.int32).reshape(-1, 3)


def answers(scene, rng, count=20_000):
    origins, directions = rng.normal(size=(2, count, 3)).astype(np.float32)
    return scene.run(origins, directions, output=1)


def assert_same(one, other):
    for name in ("primID", "tfar"):
        differing = np.count_nonzero(one[name] != other[name])
        assert not differing, f"{differing} of {len(one[name])} rays have another {name}"


@pytest.mark.parametrize("moving", [False, True])
def test_scenes_give_the_answers_of_those_that_embreex_makes(moving, monkeypatch):
    vertices, triangles = soup(np.random.default_rng(1))
    own = embree.embree_scene(vertices, triangles, 0.5, moving)
    monkeypatch.setattr(embree, "_EMBREE", None)
    theirs = embree.embree_scene(vertices, triangles, 0.5)
    one = answers(own, np.random.default_rng(2))
    assert (one["primID"] >= 0).sum() > 5000
    assert_same(one, answers(theirs, np.random.default_rng(2)))


def test_a_refitted_scene_gives_the_answers_of_a_new_one():
    rng = np.random.default_rng(3)
    vertices, triangles = soup(rng)
    scene = embree.embree_scene(vertices, triangles, moving=True)
    before = answers(scene, np.random.default_rng(4))
    moved = vertices @ np.linalg.qr(rng.normal(size=(3, 3)))[0] + (0.5, -0.2, 0.1)
    for unit in (1.0, 0.25):
        embree._refit(scene, moved, unit)
        after = answers(scene, np.random.default_rng(4))
        assert_same(after, answers(embree.embree_scene(moved, triangles, unit), np.random.default_rng(4)))
    assert (before["primID"] != after["primID"]).sum() > 5000


def test_only_a_scene_that_leaves_out_the_same_triangles_is_refitted(make_mesh, monkeypatch):
    vertices, triangles = soup(np.random.default_rng(5), 30)
    refitted = []
    monkeypatch.setattr(embree, "_refit", lambda scene, *_: refitted.append(scene))

    def fresh():
        return triangles_of([(Object("soup", "mesh", np.eye(4)), make_mesh(vertices, triangles))], VIEW)

    former, left_out = fresh(), np.arange(30) == 7
    scene = embree.scene_of(former, left_out, 1.0)
    now = fresh()
    now.former_scenes.update(former.embree_scenes)
    assert embree.scene_of(now, ~left_out, 1.0) is not scene
    assert embree.scene_of(now, left_out, 2.0) is scene, "the unit is no reason to build"
    assert embree.scene_of(now, left_out, 1.0) is not scene, "it is taken"
    assert refitted == [scene]


def test_a_scene_without_memory_is_an_error(monkeypatch):
    monkeypatch.setattr(embree._EMBREE, "rtcSetNewGeometryBuffer", lambda *_: None)
    with pytest.raises(MemoryError):
        embree.embree_scene(*soup(np.random.default_rng(6), 2))
