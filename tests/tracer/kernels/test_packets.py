"""Embree's packets through embreex's scenes: proven before use, and ray by ray what embreex itself answers."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.tracer import compiled
from viewcam_addon.tracer.compiled import library
from viewcam_addon.tracer.rays.embree import EmbreeScene, embree_scene

ROOT = Path(__file__).resolve().parents[3]

needs_embree = pytest.mark.skipif(EmbreeScene is None, reason="embreex is not installed")


@pytest.fixture(scope="module")
def packets():
    """The module of packets, where it can be used."""
    pytest.importorskip("numba")
    assert library.PROVEN, "numba and embreex are installed, but packets were not proven"
    from viewcam_addon.tracer.kernels import packets

    return packets


def shards(rng, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Corners and indices of triangles here and there."""
    corners = rng.normal(size=(count, 3, 3)) * rng.choice([0.02, 0.2, 1]) + rng.normal(size=(count, 1, 3))
    return corners.reshape(-1, 3), np.arange(3 * count, dtype=np.int32).reshape(-1, 3)


@needs_embree
@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1), rays=st.integers(0, 100), coherent=st.booleans())
def test_packets_answer_as_embreex_does_ray_by_ray(packets, seed, rays, coherent):
    rng = np.random.default_rng(seed)
    scene = embree_scene(*shards(rng, 2000))
    origins, directions = rng.normal(size=(2, 3, rays)).astype(np.float32)
    directions[:, ::7] = directions[:, :1]  # some side by side
    lengths = np.where(rng.random(rays) < 0.5, rng.exponential(size=rays), packets.FARTHEST).astype(np.float32)
    found, blocked = np.empty(rays, np.intp), np.empty(rays, bool)
    packets.intersect(library.pointer_of(scene), origins, directions, lengths, coherent, found)
    packets.occluded(library.pointer_of(scene), origins, directions, lengths, coherent, blocked)
    rows = origins.T.copy(), directions.T.copy()
    assert np.array_equal(found, scene.run(*rows, dists=lengths.copy()))
    assert np.array_equal(blocked, scene.run(*rows, dists=lengths.copy(), query="OCCLUDED") >= 0)


@needs_embree
def test_packets_are_proven_where_embree_is():
    assert library.PROVEN


@needs_embree
def test_an_object_that_is_not_as_expected_is_not_taken(monkeypatch):
    monkeypatch.setattr(library, "_DEVICE", library._DEVICE - 8)  # what stands there is whether it is committed
    assert not library._is_proven()


@needs_embree
def test_a_packet_that_is_answered_wrongly_is_no_proof():
    functions = library.addresses()
    triangle = np.array([[0, 0, 1], [1, 0, 1], [0, 1, 1]])
    for shift, right in ((0.0, True), (0.2, False)):
        scene = embree_scene(triangle + shift, np.array([[0, 1, 2]], np.int32))
        assert library._traces(functions, library.pointer_of(scene)) == right, shift


@pytest.mark.parametrize("value", ["0", "1"])
def test_the_environment_turns_kernels_off(value):
    program = "from viewcam_addon.tracer import compiled; import sys; print(compiled.AVAILABLE, 'numba' in sys.modules)"
    environment = os.environ | {"VIEWCAM_COMPILED": value}
    outcome = subprocess.run([sys.executable, "-c", program], cwd=ROOT, env=environment, capture_output=True, text=True)
    available = value != "0" and library.PROVEN and compiled.importlib.util.find_spec("numba") is not None
    assert outcome.stdout.split() == [str(available), "False"], outcome.stderr


def test_kernels_work_where_no_cache_can_be_written(packets):
    program = (
        "from numba.core import caching; caching.CacheImpl._locator_classes = [];"
        "from viewcam_addon.tracer.kernels import packets;"
        "print(packets.new_packet(True).shape, type(packets.new_packet._cache).__name__)"
    )
    outcome = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True)
    assert outcome.stdout.strip() == f"({library.ROWS}, {library.LANES}) NullCache", outcome.stderr
