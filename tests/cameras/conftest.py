"""Cameras of all kinds that formats must hold, points to see them by, and what float arithmetic allows a picture to err."""

import contextlib
import json
import math
from collections.abc import Iterator

import numpy as np
import pytest

from viewcam_addon import usd_stage
from viewcam_addon.cameras import Camera, own
from viewcam_addon.pinhole import Pinhole

PLAIN = Pinhole((7, -6, 4), (0, 0, 1), (0, 0, 1), 600, 640, 360)
CAMERAS = {
    "plain": PLAIN,
    "at_the_origin": Pinhole((0, 0, 0), (0.3, 1, 0.1), (0, 0, 1), 800, 640, 480),
    "shifted": Pinhole((7, -6, 4), (0, 0, 1), (0, 0, 1), 600, 640, 360, (300, 200)),
    "off_the_picture": Pinhole((2, 3, 4), (0, 0, 1), (0.1, 0, 1), 900, 640, 360, (-420.25, 777.5)),
    "pixels_not_square": Pinhole((7, -6, 4), (0, 0, 1), (0, 0, 1), (600, 450), 640, 360),
    "shifted_and_not_square": Pinhole((-3, -6, 4), (0, 0, 1), (0.2, 0.1, 1), (612.5, 450.25), 641, 359, (311.125, 190.75)),
    "portrait": Pinhole((0, -9, 1.5), (0.5, 0, 1.4), (0, 0, 1), 1200, 1080, 1920),
    "telephoto": Pinhole((300, -400, 50), (1, 2, 3), (0, 0, 1), 60000, 1920, 1080),
    "wide": Pinhole((1, 1, 1), (0, 0, 0.5), (0, 0, 1), 120, 1280, 720),
    "rolled": Pinhole((3, 2, -5), (0.1, 0.2, 0.3), (1, -2, 0.5), 700, 800, 600),
    "straight_down": Pinhole((0, 0, 10), (0, 0, 0), (0, 0, 1), 500, 400, 300),
    "far_from_origin": Pinhole((1e6 + 7, -1e6 - 6, 1e6 + 4), (1e6, -1e6, 1e6 + 1), (0, 0, 1), 600, 640, 360),
    "tiny": Pinhole((0.002, -0.001, 0.003), (0, 0, 0), (0, 0, 1), 600, 640, 360),
    "mirrored": Pinhole((7, -6, 4), (0, 0, 1), (0, 0, 1), 600, 640, 360, None, True),
    "mirrored_and_shifted": Pinhole((7, -6, 4), (0, 0, 1), (0.3, 0, 1), (600, 500), 640, 360, (250, 250), True),
}


def camera(name: str) -> Camera:
    return Camera(name, CAMERAS[name], image=f"{name}.png")


@contextlib.contextmanager
def numbers_alone() -> Iterator[None]:
    """A format's own numbers are read and not the values beside them, which would hide what is read wrongly of the numbers."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(own, "pinholes_in", lambda text: [])
        yield


@pytest.fixture(scope="module")
def only_numbers():
    with numbers_alone():
        yield


@pytest.fixture
def openusd_in_this_process(monkeypatch, tmp_path):
    """Stages that are ours are read by the same code as others, without the process of half a second that test_usd.py has."""

    def read(name, path, text, size, values):
        pytest.importorskip("pxr")
        request = {"size": size, "values": values, "unpacked": str(tmp_path)}
        request |= {"path": str(path.absolute())} if path else {"text": text}
        return json.loads(json.dumps(usd_stage._read(request)))

    monkeypatch.setattr(usd_stage, "read", read)


def points_before(pinhole: Pinhole, count: int = 40, seed: int = 1) -> np.ndarray:
    """Points in the view, anywhere in the picture and around it."""
    random = np.random.default_rng(seed)
    column, row = random.uniform(-0.2, 1.2, count) * pinhole.width, random.uniform(-0.2, 1.2, count) * pinhole.height
    reach = math.dist(pinhole.eye, pinhole.look_at)
    depth = reach * np.exp(random.uniform(-1, 1.5, count))
    rays = pinhole.ray_directions(column, row, 0.0, 0.0)
    return np.array(pinhole.eye) + rays * depth[:, None]


def picture_error(pinhole: Pinhole, column: np.ndarray, row: np.ndarray, points: np.ndarray) -> float:
    """By how many pixels others see the points elsewhere than the pinhole; rows from the bottom."""
    ours = pinhole.project(points)
    return float(np.nanmax(np.hypot(ours[0] - column, ours[1] - row)))


def allowed(pinhole: Pinhole, points: np.ndarray, unit: float = 2.0**-53, operations: int = 16) -> float:
    """Pixels that so many roundings of `unit` can move a projection by: of coordinates as large as these, seen from there.

    operations : the number of operations in a chain of matrix, translation, division and principal point; calibrated, no bound
        was exceeded by 4.
    """
    size = max(np.abs(points).max(), max(map(abs, pinhole.eye)))
    depth = pinhole.project(points)[2].min()
    place = max(*pinhole.distance, *map(abs, pinhole.principal_point), pinhole.width, pinhole.height)
    return operations * unit * place * 3 * max(size / depth, 1)


@pytest.fixture(params=CAMERAS)
def any_camera(request) -> Camera:
    return camera(request.param)
