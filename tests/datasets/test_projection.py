"""Whatever the pose, each format's reader sees points at the pixels where the pinhole itself sees them."""

import json

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from viewcam_addon.cameras import colmap, transforms
from viewcam_addon.cameras import sidecar as record
from viewcam_addon.cameras.camera import Camera
from viewcam_addon.pinhole import Pinhole

FILE = "images/one.png"

coordinates = st.floats(-100, 100)
triples = st.tuples(coordinates, coordinates, coordinates)


@st.composite
def poses(draw):
    """eye, look_at and up; every third straight down or up, exactly or nearly."""
    look_at, up = draw(triples), draw(triples)
    if draw(st.integers(0, 2)):
        return draw(triples), look_at, up
    eye = (look_at[0], look_at[1], look_at[2] + draw(st.sampled_from([-1.0, 1.0])) * draw(st.floats(0.5, 100)))
    return eye, look_at, (draw(st.sampled_from([0.0, 1e-12, -1e-6])), 0.0, draw(st.sampled_from([-2.0, 1.0])))


@st.composite
def pinholes(draw, mirrored=False):
    eye, look_at, up = draw(poses())
    assume(eye != look_at and any(up))
    size = draw(st.integers(1, 8192)), draw(st.integers(1, 8192))
    d = draw(st.floats(1, 1e5))
    distance = d if draw(st.booleans()) else (d, d * draw(st.floats(0.1, 10)))
    point = draw(st.none() | st.tuples(st.floats(-1e4, 1e4), st.floats(-1e4, 1e4)))
    return Pinhole(eye, look_at, up, distance, *size, point, mirrored=mirrored and draw(st.booleans()))


def points_before(pinhole, seed):
    """(16, 3) points at depths from 1/16 to 1000, within and beside the picture."""
    random = np.random.default_rng(seed)
    depth = 2 ** random.uniform(-4, 10, (16, 1))
    across = random.uniform(-2, 2, (16, 2))
    u, v, w = pinhole.basis()
    return np.array(pinhole.eye) + depth * (across[:, :1] * u + across[:, 1:] * v - w)


seeds = st.integers(0, 2**32 - 1)


@given(pinholes(), seeds)
def test_nerfstudio_sees_what_the_pinhole_sees(readers, hold_together, pinhole, seed):
    text = json.dumps(transforms.document([Camera("view", pinhole, image=FILE)]))
    hold_together(readers["transforms"](text)[FILE], pinhole, points_before(pinhole, seed))


@given(pinholes(), seeds)
def test_colmap_sees_what_the_pinhole_sees(readers, hold_together, pinhole, seed):
    texts = colmap.texts([Camera("view", pinhole, image=FILE)])
    hold_together(readers["colmap"](texts)[FILE], pinhole, points_before(pinhole, seed))


@given(pinholes(mirrored=True), seeds)
def test_the_matrices_of_a_sidecar_see_what_the_pinhole_sees_mirrored_or_not(readers, hold_together, pinhole, seed):
    document = json.loads(json.dumps(record.record(pinhole)))
    hold_together(readers["record"](document)[""], pinhole, points_before(pinhole, seed))


@pytest.mark.parametrize("height", [-5.0, 5.0])
def test_straight_down_and_up_are_among_the_poses(readers, hold_together, height):
    pinhole = Pinhole((1, 2, height), (1, 2, 0), (0, 0, 1), 500.0, 320, 180)
    assert pinhole.is_singular
    points = points_before(pinhole, 1)
    hold_together(readers["colmap"](colmap.texts([Camera("view", pinhole, image=FILE)]))[FILE], pinhole, points)
    hold_together(
        readers["transforms"](json.dumps(transforms.document([Camera("view", pinhole, image=FILE)])))[FILE], pinhole, points
    )
