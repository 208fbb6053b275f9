"""Tracing beside the thread that asked for it: bands arrive there, and canceling ends it."""

import gc
import queue
import threading
import time
import weakref
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("bpy")

from viewcam_addon.blender.rendering import tracing
from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer import render as renders
from viewcam_addon.tracer.scene import Scene

SCENE = Scene(Pinhole((0, 0, 5), (0, 0, 0), (0, 1, 0), 100, 40, 30), {}, ())


def bands(is_canceled=lambda: False, scene=SCENE):
    return tracing.bands(scene, "geometry", 1, 0, 2, is_canceled)


@pytest.fixture
def endless(monkeypatch):
    """Rendering shows one row and then never ends by itself; a list of what happened to it."""
    happened = []

    def render(scene, level, samples, seed, threads, watcher, **_):
        watcher.tile({"Depth": np.zeros((30, 40, 1), np.float32)}, range(1))
        happened.append("began")
        while not watcher.stop():
            time.sleep(0.001)
        happened.append("stopped")
        raise renders.Stopped

    monkeypatch.setattr(renders, "render", render)
    return happened


def test_every_row_arrives_once_and_in_this_thread():
    here, rows = threading.current_thread(), []
    for passes, received in bands(lambda: threading.current_thread() is not here):
        assert passes["Depth"].shape == (30, 40, 1)
        rows += received
    assert sorted(rows) == list(range(30))


def test_who_cancels_is_heard_before_the_next_band_and_gets_no_error(endless):
    asked = iter([False, False, False])
    received = list(bands(lambda: next(asked, True)))
    assert len(received) <= 1 and endless == ["began", "stopped"]


def test_whether_it_is_canceled_is_asked_every_twentieth_of_a_second(endless, monkeypatch):
    """A band that is waited for without end, or for longer, would hold Escape up."""
    asked, waits = [], []

    class Bands:
        put = staticmethod(lambda band: None)

        def get(self, timeout):
            waits.append((len(asked), timeout))
            raise queue.Empty

    monkeypatch.setattr(tracing, "queue", SimpleNamespace(SimpleQueue=Bands, Empty=queue.Empty))
    list(bands(lambda: asked.append(1) or len(asked) > 5))
    assert waits == [(number, 0.05) for number in range(1, 6)] and endless == ["began", "stopped"]


def test_who_takes_no_more_bands_leaves_no_thread_behind(endless):
    before = threading.active_count()
    received = bands()
    next(received)
    assert threading.active_count() > before
    received.close()
    assert endless == ["began", "stopped"] and threading.active_count() == before


def test_an_error_of_the_tracer_is_raised_here():
    with pytest.raises(InputError, match="the level is 'light'"):
        list(tracing.bands(SCENE, "light", 1, 0, 2, lambda: False))


def test_a_canceled_render_leaves_nothing_for_the_garbage_collector(monkeypatch):
    real, tracers = renders.Tracer, []

    class Tracer(real):
        def __init__(self, *arguments):
            super().__init__(*arguments)
            tracers.append(weakref.ref(self))

    monkeypatch.setattr(renders, "Tracer", Tracer)
    gc.disable()
    try:
        asked = iter([False])
        list(tracing.bands(SCENE, "direct", 10**6, 0, 2, lambda: next(asked, True)))
        assert tracers and not any(tracer() for tracer in tracers)
    finally:
        gc.enable()
