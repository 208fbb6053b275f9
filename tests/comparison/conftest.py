"""A scene on paper: a ground plane and spheres in closed form, seen by any pinhole, with every pass that Cycles writes.

Its pictures are what a perfect renderer would write; `rendered` moves each ray by a random error that follows the tolerance
law, which is what a float32 renderer does.
"""

import functools
from dataclasses import dataclass, replace

import numpy as np
import pytest

from viewcam_addon.comparison import tolerances
from viewcam_addon.image import Image
from viewcam_addon.pinhole import Pinhole

# Rayleigh's distribution with this scale has its median at 0.41, its 99th percentile at 1.06 and its maximum over 10⁵ pixels
# near 1.7 roundings: inside tolerances.ROUNDINGS (0.7, 3.0 and 20), as Cycles is.
ROUNDINGS_OF_A_RENDERER = 0.35


@dataclass(frozen=True)
class PaperScene:
    """A ground z = 0, a disc of the given radius, and spheres (x, y, z, radius) on it, all moved by offset."""

    pinhole: Pinhole
    spheres: tuple[tuple[float, float, float, float], ...] = (
        (0.0, 0.0, 1.0, 1.0),
        (2.2, 1.0, 0.7, 0.7),
        (-1.6, -1.4, 0.5, 0.5),
    )
    radius: float = 12.0
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def surface_at(self, columns, rows, px=0.5, py=0.5):
        """The values that rays through sub-pixel positions see: pass name → (n, channels) float32."""
        origin = np.array(self.pinhole.eye)
        directions = self.pinhole.ray_directions(np.asarray(columns), np.asarray(rows), px, py)
        count = len(directions)
        offset = np.array(self.offset)
        with np.errstate(all="ignore"):
            distance = (offset[2] - origin[2]) / directions[:, 2]
            flat = np.linalg.norm((origin + distance[:, None] * directions - offset)[:, :2], axis=1)
        distance = np.where((distance > 0) & (flat < self.radius), distance, np.inf)
        actual = np.where(np.isfinite(distance), 0, -1)
        for i, (*center, radius) in enumerate(self.spheres):
            to_center = np.array(center) + offset - origin
            middle = directions @ to_center
            half = radius**2 - ((middle[:, None] * directions - to_center) ** 2).sum(axis=1)
            with np.errstate(invalid="ignore"):
                near = middle - np.sqrt(half)
            closer = (half > 0) & (near > 0) & (near < distance)
            distance, actual = np.where(closer, near, distance), np.where(closer, i + 1, actual)

        hit = actual >= 0
        position = np.where(hit[:, None], origin + np.where(hit, distance, 0.0)[:, None] * directions, 0.0)
        centers = np.array([(0.0, 0.0, 0.0), *(sphere[:3] for sphere in self.spheres)])[actual] + offset
        radii = np.array([self.radius, *(sphere[3] for sphere in self.spheres)])[actual]
        normal = np.where((actual == 0)[:, None], (0.0, 0.0, 1.0), (position - centers) / radii[:, None]) * hit[:, None]
        local = (position - offset) / self.radius
        away = np.linalg.norm(position - origin, axis=1)
        passes = {
            "Depth": np.where(hit, -(position - origin) @ self.pinhole.basis()[2], 1e10)[:, None],
            "Position": position,
            "Normal": normal,
            "UV": np.column_stack([local[:, :2], np.ones(count)]) * hit[:, None],
            "Object Index": np.where(hit, actual + 1, 0)[:, None],
            "Material Index": np.where(hit, 10 + actual % 2, 0)[:, None],
            "Magnitude": (np.maximum(np.abs(centers).max(axis=1) + radii, np.abs(origin).max()) + away)[:, None] * hit[:, None],
            "Facing": np.abs((normal * directions).sum(axis=1))[:, None],
        }
        return {name: values.astype(np.float32) for name, values in passes.items()}

    def surfaces_at(self, columns, rows, px=0.5, py=0.5):
        """The surfaces that rays meet, as of a scene where no two are in one place."""
        seen = self.surface_at(columns, rows, px, py)
        names = np.array(["", "ground", *(f"sphere {i}" for i in range(len(self.spheres)))], dtype=object)
        return np.arange(len(columns)), names[seen["Object Index"][:, 0].astype(int)], seen

    def picture(self, px=0.5, py=0.5) -> Image:
        """The exact picture, seen through the given sample point of every pixel."""
        return _copy_of(_centered(self)) if np.isscalar(px) and px == py == 0.5 else self._seen_through(px, py)

    def _seen_through(self, px, py) -> Image:
        rows, columns = np.mgrid[: self.pinhole.height, : self.pinhole.width]
        size = columns.shape
        px, py = (np.broadcast_to(p, size).ravel() for p in (px, py))
        seen = self.surface_at(columns.ravel(), rows.ravel(), px, py)
        return Image({name: values.reshape(*size, -1) for name, values in seen.items()}, camera=self.pinhole)

    def rendered(self, roundings: float = ROUNDINGS_OF_A_RENDERER, seed: int = 0) -> Image:
        """The picture of a float32 renderer: every ray is off by so many roundings. Without the tracer's own passes."""
        return _copy_of(_rendered(self, roundings, seed))

    def _rendered(self, roundings: float, seed: int) -> Image:
        exact = _centered(self)
        shift = tolerances.ray_shift(self.pinhole, exact.passes)
        missed = exact["Object Index"][..., 0] == 0
        shift[missed] = np.median(shift[~missed])
        dx, dy = roundings * shift * np.random.default_rng(seed).normal(size=(2, *shift.shape))
        image = self.picture(0.5 + dx, 0.5 + dy)
        return replace(
            image, passes={name: values for name, values in image.passes.items() if name not in ("Magnitude", "Facing")}
        )

    def seen_by(self, pinhole: Pinhole) -> "PaperScene":
        return replace(self, pinhole=pinhole)


@functools.lru_cache(8)
def _centered(scene: PaperScene) -> Image:
    return scene._seen_through(0.5, 0.5)


@functools.lru_cache(8)
def _rendered(scene: PaperScene, roundings: float, seed: int) -> Image:
    return scene._rendered(roundings, seed)


def _copy_of(image: Image) -> Image:
    """A picture that a test may change."""
    return replace(image, passes={name: values.copy() for name, values in image.passes.items()})


def _pinhole(offset=(0.0, 0.0, 0.0), width=320, height=200, distance=300.0) -> Pinhole:
    eye, look_at = np.array([5.0, -7.0, 4.0]) + offset, np.array([0.2, 0.1, 0.6]) + offset
    return Pinhole(tuple(eye), tuple(look_at), (0.0, 0.0, 1.0), distance, width, height)


@pytest.fixture(scope="session")
def paper_scene() -> PaperScene:
    """Three spheres on a ground, 320 × 200 pixels, with background above the horizon."""
    return PaperScene(_pinhole())


@pytest.fixture(scope="session")
def far_scene() -> PaperScene:
    """The scene 5 km from the origin: float32 moves its rays by a hundredth of a pixel, so that many of them cross an edge."""
    offset = (5000.0, 0.0, 0.0)
    return PaperScene(_pinhole(offset), offset=offset)
