"""What a scene refuses, each in a sentence that names the object."""

import numpy as np
import pytest

from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.scene import Mesh, Object, Scene, Spheres

CAMERA = Pinhole((0, 0, 5), (0, 0, 0), (0, 1, 0), 100, 4, 4)


def triangle(**changes):
    arrays = {
        "vertices": np.eye(3),
        "triangles": np.array([[0, 1, 2]], np.int32),
        "materials": np.zeros(1, np.int32),
    }
    return Mesh(**(arrays | changes))


def beads(**changes):
    arrays = {"centers": np.zeros((2, 3)), "radii": np.ones(2), "materials": np.zeros(2, np.int32)}
    return Spheres(**(arrays | changes))


def placed(**changes):
    return Object(**({"name": "thing", "geometry": "mesh", "matrix": np.eye(4)} | changes))


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: triangle(vertices=np.zeros((3, 2))), ["vertices", "n × 3"]),
        (lambda: triangle(triangles=np.array([[0, 1, 3]], np.int32)), ["triangles", "0 … 2"]),
        (lambda: triangle(triangles=np.array([[0, 1, -1]], np.int32)), ["triangles", "0 … 2"]),
        (lambda: triangle(vertices=np.full((3, 3), np.nan)), ["vertices", "finite"]),
        (lambda: triangle(materials=np.zeros(2, np.int32)), ["materials", "1"]),
        (lambda: triangle(corner_normals=np.zeros((1, 3), np.float32)), ["corner_normals", "1 × 3 × 3"]),
        (lambda: triangle(corner_uvs=np.zeros((2, 3, 2), np.float32)), ["corner_uvs", "1 × 3 × 2"]),
        (lambda: beads(radii=np.array([1.0, -1.0])), ["radii", "negative"]),
        (lambda: beads(centers=np.full((2, 3), np.inf)), ["centers", "finite"]),
        (lambda: placed(matrix=np.eye(3)), ["thing", "4 × 4"]),
        (lambda: placed(matrix=np.full((4, 4), np.nan)), ["thing", "finite"]),
        (lambda: placed(matrix=np.diag([1.0, 1, 1, 2])), ["thing", "affine"]),
        (lambda: placed(material_indices=()), ["thing", "material_indices"]),
        (lambda: Scene(CAMERA, {}, (placed(),)), ["thing", "'mesh'"]),
        (lambda: Scene(CAMERA, {"mesh": triangle(materials=np.ones(1, np.int32))}, (placed(),)), ["thing", "1 … 1"]),
        (lambda: Scene(CAMERA, {"mesh": triangle(materials=-np.ones(1, np.int32))}, (placed(),)), ["thing", "-1"]),
        (lambda: Scene(CAMERA, {}, (), clip=(2, 1)), ["clip", "2 … 1"]),
        (lambda: Scene(CAMERA, {}, (), clip=(-1, 1)), ["clip"]),
        (lambda: Scene(CAMERA, {}, (), clip=(0, float("nan"))), ["clip"]),
        (lambda: Scene(CAMERA, {}, (), origin=(0.0, float("inf"), 0.0)), ["origin"]),
        (lambda: Scene(CAMERA, {}, (), origin=(0.0, 0.0)), ["origin", "three"]),
    ],
)
def test_what_is_wrong_is_named_in_one_sentence(build, words):
    with pytest.raises(InputError) as caught:
        build()
    message = str(caught.value)
    assert all(word in message for word in words), message
    assert "\n" not in message


def test_a_scene_that_is_right_is_taken():
    scene = Scene(CAMERA, {"mesh": triangle(), "beads": beads()}, (placed(), placed(geometry="beads")), clip=(1, 100))
    assert scene.clip == (1.0, 100.0) and isinstance(scene.clip[1], float)
