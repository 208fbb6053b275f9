"""Scenes for the tracer's tests: builders, as fixtures, of what several modules trace; scene files, changed in one place."""

import copy
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import strategies as st

from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.scene import Mesh, Object, Scene, Spheres, scene_file

sys.path.insert(0, str(Path(__file__).parent))

from core_probes import SampledLight, Sampler, radiance_seen


@pytest.fixture(scope="session")
def ball():
    """A closed ball of triangles, smooth and with a UV map: ball(rings) → Mesh of radius 1."""

    def build(rings: int = 12) -> Mesh:
        theta, phi = np.meshgrid(np.linspace(0, np.pi, rings + 1), np.linspace(0, 2 * np.pi, 2 * rings + 1), indexing="ij")
        phi[:, -1] = 0  # the seam's vertices are the same on both sides, so that the ball is closed
        theta[-1] = np.pi
        vertices = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
        vertices[0], vertices[-1] = (0, 0, 1), (0, 0, -1)
        vertices = vertices.reshape(-1, 3)
        row = 2 * rings + 1
        first = (np.arange(rings)[:, None] * row + np.arange(2 * rings)).ravel()
        lower = np.stack([first, first + row, first + 1], axis=1)
        upper = np.stack([first + 1, first + row, first + row + 1], axis=1)
        triangles = np.concatenate([lower, upper]).astype(np.int32)
        return mesh(vertices, triangles, corner_normals=vertices[triangles], corner_uvs=vertices[triangles][..., :2])

    return build


@pytest.fixture(scope="session")
def closed_ball(ball):
    """closed_ball(rings) → Mesh: the same without its seam, vertices at one place being one, and without flat triangles."""

    def build(rings: int) -> Mesh:
        scene = ball(rings)
        vertices, place = np.unique(scene.vertices, axis=0, return_inverse=True)
        triangles = place.reshape(-1)[scene.triangles]
        return mesh(vertices, triangles[(triangles != np.roll(triangles, 1, axis=1)).all(axis=1)])

    return build


@pytest.fixture(scope="session")
def make_mesh():
    """make_mesh(vertices, triangles, **more) → Mesh with the array types that Mesh wants."""
    return mesh


def mesh(vertices, triangles, materials=None, corner_normals=None, corner_uvs=None) -> Mesh:
    triangles = np.array(triangles, np.int32).reshape(-1, 3)
    return Mesh(
        vertices=np.array(vertices, np.float64).reshape(-1, 3),
        triangles=triangles,
        materials=np.zeros(len(triangles), np.int32) if materials is None else np.array(materials, np.int32),
        corner_normals=None if corner_normals is None else np.array(corner_normals, np.float32),
        corner_uvs=None if corner_uvs is None else np.array(corner_uvs, np.float32),
    )


@pytest.fixture(scope="session")
def make_spheres():
    """make_spheres(centers, radii) → Spheres; one radius serves for all."""

    def build(centers, radii) -> Spheres:
        centers = np.array(centers, np.float64).reshape(-1, 3)
        return Spheres(centers, np.array(np.broadcast_to(radii, len(centers)), np.float64), np.zeros(len(centers), np.int32))

    return build


@pytest.fixture(scope="session")
def make_scene():
    """make_scene(camera, geometry, (geometry, matrix), …) → Scene; the objects' indices count from 1."""

    def build(camera: Pinhole, *bodies, clip=(0.0, float("inf"))) -> Scene:
        bodies = [body if isinstance(body, tuple) else (body, np.eye(4)) for body in bodies]
        names = {id(geometry): f"geometry {number}" for number, (geometry, _) in enumerate(bodies)}
        return Scene(
            camera=camera,
            geometries={names[id(geometry)]: geometry for geometry, _ in bodies},
            objects=tuple(
                Object(f"object {number}", names[id(geometry)], matrix, number)
                for number, (geometry, matrix) in enumerate(bodies, start=1)
            ),
            clip=clip,
        )

    return build


@pytest.fixture(scope="session")
def make_lit():
    """make_lit(camera, (geometry, material), …, lamps=…, world=…, film=…, bounces=…) → Scene; no material is the plain one."""

    def build(camera: Pinhole, *bodies, **light) -> Scene:
        materials = {f"material {number}": material for number, (_, material) in enumerate(bodies) if material is not None}
        return Scene(
            camera=camera,
            geometries={f"geometry {number}": geometry for number, (geometry, _) in enumerate(bodies)},
            objects=tuple(
                Object(
                    f"object {number}",
                    f"geometry {number}",
                    np.eye(4),
                    number + 1,
                    materials=() if material is None else (f"material {number}",),
                )
                for number, (_, material) in enumerate(bodies)
            ),
            materials=materials,
            **light,
        )

    return build


@pytest.fixture(scope="session")
def random_matrix():
    """random_matrix(rng, spread) → (4, 4): rotated, scaled by axis from 0.3 to 2, often mirrored, sheared, moved."""

    def build(rng: np.random.Generator, spread: float = 1.5):
        matrix = np.eye(4)
        rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        matrix[:3, :3] = rotation @ np.diag(rng.uniform(0.3, 2, 3) * rng.choice([-1, 1], 3))
        matrix[0, 1] += rng.uniform(-0.5, 0.5)
        matrix[:3, 3] = rng.uniform(-spread, spread, 3)
        return matrix

    return build


@pytest.fixture(scope="session")
def random_scene(ball, make_scene, make_mesh, make_spheres, random_matrix):
    """random_scene(seed) → Scene of balls, a soup of triangles, spheres and ellipsoids round the origin, clipped a little."""

    def build(seed: int, width: int = 96, height: int = 54) -> Scene:
        rng = np.random.default_rng(seed)
        soup = make_mesh(rng.normal(size=(90, 3)) * 2, np.arange(90))
        spheres = make_spheres(rng.normal(size=(60, 3)), rng.uniform(0.02, 0.4, 60))
        shared = ball(8)
        eye = rng.normal(size=3)
        eye *= rng.uniform(2, 9) / np.linalg.norm(eye)
        camera = Pinhole(
            tuple(eye),
            tuple(rng.uniform(-0.5, 0.5, 3)),
            tuple(rng.normal(size=3)),
            (width * rng.uniform(0.4, 2), width * rng.uniform(0.4, 2)),
            width,
            height,
            (width * rng.uniform(0.3, 0.7), height * rng.uniform(0.3, 0.7)),
            bool(rng.integers(2)),
        )
        bodies = [(geometry, random_matrix(rng)) for geometry in (shared, shared, ball(5), soup, spheres)]
        return make_scene(camera, *bodies, clip=(rng.uniform(0, 1.5), rng.uniform(6, 14)))

    return build


class Lighting:
    """Lamps, asked in world space."""

    def __init__(self, *lamps) -> None:
        self._lamps = lamps

    def aimed(self, position, normal, count: int = 4096, seed: int = 1, skew: float = 1.0) -> tuple[SampledLight, np.ndarray]:
        """Samples of the only lamp at a point of a surface, and their cosines to its normal, 0 below the horizon.

        skew : a power of the first of two numbers, other than 1 for samples that are not spread evenly.
        """
        (lamp,) = self._lamps
        normal = np.reshape(normal, (3, -1)) / np.linalg.norm(np.reshape(normal, (3, -1)), axis=0)
        numbers = Sampler(seed, count).numbers(np.zeros(count), np.arange(count), 3, 2) ** [[skew], [1.0]]
        aimed = SampledLight(lamp, position, normal, numbers)
        return aimed, np.maximum((normal * aimed.direction).sum(axis=0), 0.0)

    def irradiance(self, position, normal, count: int = 4096, seed: int = 1, skew: float = 1.0) -> tuple[float, float]:
        """The mean of the first channel, and its standard error as if the samples were independent."""
        aimed, cosine = self.aimed(position, normal, count, seed, skew)
        values = aimed.light[0] * cosine
        return values.mean(), values.std() / np.sqrt(count)

    def seen(self, starts, directions, kind: str = "camera", nearest=0.0, farthest=np.inf) -> np.ndarray:
        """(3, n) radiance of all lamps that rays run into; starts, directions (3, n)."""
        lamps = [lamp for lamp in self._lamps if kind not in lamp.hidden_from and not lamp.is_dark]
        none = np.zeros(np.broadcast_shapes(np.shape(starts), np.shape(directions)))
        return sum((radiance_seen(lamp, starts, directions, nearest, farthest) for lamp in lamps), start=none)


@pytest.fixture(scope="session")
def make_lighting():
    """make_lighting(lamp, …) → Lighting."""
    return Lighting


@pytest.fixture(scope="session")
def off_by():
    """off_by((mean, error), expected, precision) → standard errors; fails where these are too large to tell anything.

    The sum of 4096 float64 numbers is off by less than 1e-12 of it.
    """

    def judge(actual: tuple[float, float], expected: float, precision: float = 0.02) -> float:
        mean, error = actual
        assert error <= precision * abs(expected), f"the standard error {error:.2g} of {expected:.6g} tells nothing"
        return (mean - expected) / max(error, 1e-12 * abs(expected), 1e-300)

    return judge


@pytest.fixture(scope="session")
def polygon_irradiance():
    """polygon_irradiance(corners (n, 3), normal) → the irradiance at the origin of a polygon of radiance 1, by Lambert (1760).

    Half the sum, over the sides, of the angle that a side fills times the cosine of its plane's normal, of what the horizon
    leaves of the polygon.
    """

    def irradiance(corners, normal) -> float:
        normal = np.array(normal) / np.linalg.norm(normal)
        heights = corners @ normal
        above = []
        for number, (corner, height) in enumerate(zip(corners, heights, strict=True)):
            before, low = corners[number - 1], heights[number - 1]
            if (height > 0) != (low > 0):
                above.append(before + (corner - before) * (low / (low - height)))
            if height > 0:
                above.append(corner)
        total = 0.0
        for first, second in zip(above, above[1:] + above[:1], strict=True):
            across = np.cross(first, second)
            length = np.linalg.norm(across)
            if length > 0:
                total += np.arctan2(length, first @ second) * (across @ normal) / length
        return abs(total) / 2

    return irradiance


@pytest.fixture
def read_document(tmp_path):
    """read_document(document) → Scene: write it as JSON, read it as a scene. document : parsed, or as text."""

    def read(document):
        path = tmp_path / "scene.json"
        path.write_text(document if isinstance(document, str) else json.dumps(document), encoding="utf-8")
        return scene_file.read(path)

    return read


@pytest.fixture(scope="session")
def changed():
    """changed(document, path, value) → a copy in which the value at the path is another, or gone where it is None."""

    def change(document, path, value):
        document = copy.deepcopy(document)
        inner = document
        for key in path[:-1]:
            inner = inner[key]
        if value is None:
            del inner[path[-1]]
        else:
            inner[path[-1]] = value
        return document

    return change


@pytest.fixture
def assert_refused(read_document):
    """assert_refused(document, words): reading it fails with one sentence that names the file and has these words."""

    def check(document, words):
        with pytest.raises(InputError) as caught:
            read_document(document)
        message = str(caught.value)
        assert all(word in message for word in ["scene.json: ", *words]), message
        assert "\n" not in message

    return check


@pytest.fixture(scope="session")
def meet_replaced(tmp_path_factory):
    """(example, draw, value): an example with a value at some place of it is read, or refused in a sentence."""
    file = tmp_path_factory.mktemp("replaced") / "scene.json"

    def meet(example, draw, value):
        inner, path = example, []
        while isinstance(inner, dict | list) and len(inner) and (not path or draw(st.booleans())):
            path.append(draw(st.sampled_from(sorted(inner) if isinstance(inner, dict) else range(len(inner)))))
            inner = inner[path[-1]]
        document = copy.deepcopy(example)
        target = document
        for key in path[:-1]:
            target = target[key]
        target[path[-1]] = value
        file.write_text(json.dumps(document), encoding="utf-8")
        try:
            scene_file.read(file)
        except InputError as error:
            assert "\n" not in str(error) and len(str(error)) < 400, str(error)

    return meet
