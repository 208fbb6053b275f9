"""One tracing process for all tests of a module that ask for it, since to start it takes as long as a test."""

import pytest

pytest.importorskip("bpy")

from viewcam_addon.blender.jobs import renderer as renderers
from viewcam_addon.jobs.tracing import Tracing


@pytest.fixture(scope="module")
def tracing():
    with Tracing() as tracing:
        yield tracing


@pytest.fixture
def one_process(tracing, monkeypatch):
    """Renderers ask the module's process, and never start one of their own."""

    class Kept(Tracing):
        ask = staticmethod(tracing.ask)

    monkeypatch.setattr(renderers, "Tracing", Kept)
