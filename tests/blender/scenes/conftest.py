"""What tests of exports share."""

import subprocess

import pytest

pytest.importorskip("bpy")

from viewcam_addon.blender import another_blender


@pytest.fixture(params=["time", "no such program", "an error there"])
def other_blender_fails(request, monkeypatch):
    """The Blender that another one would start makes nothing, in each of the ways in which it may fail."""

    def fail(*arguments):
        if request.param == "time":
            raise subprocess.TimeoutExpired("blender", 1.0)
        if request.param == "no such program":
            raise FileNotFoundError

    monkeypatch.setattr(another_blender, "call", fail)
