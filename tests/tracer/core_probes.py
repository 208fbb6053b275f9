"""The core's formulas of light, one by one, as its probes answer: what tests ask in NumPy's arrays, (components, n).

No formula is here: each function lays numbers out for the core and takes them back.
"""

import numpy as np

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer import native
from viewcam_addon.tracer.scene import Mesh, Object, Scene
from viewcam_addon.tracer.scene.colors import WHITE, Color
from viewcam_addon.tracer.scene.film import FILTERS, Film
from viewcam_addon.tracer.scene.lamps import Lamp
from viewcam_addon.tracer.scene.materials import Material, Picture
from viewcam_addon.tracer.scene.shader_nodes import Closure, Node, node

FILM, SCATTERING = 2, 8
"""The number of dimensions of the film, and of each scattering."""

FUNCTIONS = ("sin of turns", "cos of turns", "asin", "acos", "atan2", "pow", "fresnel")


def _at(array):
    return array.ctypes.data


class Sampler:
    def __init__(self, seed: int, samples: int) -> None:
        self._seed, self._samples = seed & 0xFFFFFFFF, samples

    def numbers(self, pixels, samples, first: int, count: int):
        """(count, n): the dimensions from `first` on of samples of n pixels."""
        pixels, samples = np.broadcast_arrays(np.asarray(pixels, np.int64), samples)
        pixels, samples = (np.ascontiguousarray(values, np.uint32) for values in (pixels & 0xFFFFFFFF, samples))
        return native.sobol(self._seed, self._samples, pixels, samples, first, count).T


def offsets(film: Film, u):
    """(2, n): pixels from a pixel's lower left corner, of (2, n) numbers."""
    rows = np.ascontiguousarray(np.asarray(u, np.float64).T)
    out = np.empty_like(rows)
    shape = FILTERS.index(film.filter)
    assert not native.core().probe_filter(shape, film.filter_width, len(rows), _at(rows), _at(out))
    return out.T


def function(name: str, a, b=0.0):
    """One of `FUNCTIONS` of n numbers."""
    a, b = (np.array(values, np.float64) for values in np.broadcast_arrays(a, b))
    out = np.empty(a.shape)
    assert not native.core().probe_function(FUNCTIONS.index(name), a.size, _at(a), _at(b), _at(out))
    return out


def fresnel(cosine, ratio):
    return function("fresnel", np.atleast_1d(cosine), ratio)


def specular(direction, normal, shading, ratio: float = 1.0):
    """Bent normals, and where mirrors and clear surfaces with these send rays: (3, n) each."""
    rows = np.ascontiguousarray(np.concatenate(np.broadcast_arrays(direction, normal, shading)).T, np.float64)
    out = np.empty_like(rows)
    assert not native.core().probe_specular(ratio, len(rows), _at(rows), _at(out))
    return out.T.reshape(3, 3, -1)


def specular_normal(direction, normal, shading):
    return specular(direction, normal, shading)[0]


def reflected(direction, normal):
    """By a mirror whose smooth normal is its true one, for rays that rise more than a rounding."""
    return specular(direction, normal, normal)[1]


def refracted(direction, normal, ratio: float):
    """The refracted directions, and True where a ray runs along the surface since all is reflected."""
    through = specular(direction, normal, normal, ratio)[2]
    across = direction - (direction * normal).sum(axis=0) * normal
    return through, ((across / ratio) ** 2).sum(axis=0) >= 1.0


class SampledLight:
    """One lamp, asked at points: (3, n) position and normal, unit, and (2, n) numbers."""

    def __init__(self, lamp: Lamp, position, normal, u) -> None:
        u = np.asarray(u, np.float64)
        rows = [np.broadcast_to(np.reshape(values, (3, -1)), (3, u.shape[1])) for values in (position, normal)]
        packed = np.ascontiguousarray(np.concatenate([*rows, u]).T)
        out = np.empty((len(packed), 11))
        assert not native.core().probe_sample_light(native.described_lamp(lamp), len(packed), _at(packed), _at(out))
        self.direction, self.distance, self.light = out[:, :3].T, out[:, 3], out[:, 4:7].T
        self.pdf, self.pdf_of_direction, self.cosine, self.estimate = out[:, 7:].T


def radiance_seen(lamp: Lamp, starts, directions, nearest=0.0, farthest=np.inf):
    """(3, n): what rays see of a lamp that they run into."""
    starts, directions = np.broadcast_arrays(starts, directions)
    count = directions.shape[1]
    ends = [np.broadcast_to(values, count) for values in (nearest, farthest, np.isinf(farthest))]
    rows = np.ascontiguousarray(np.concatenate([starts, directions, np.stack(ends)]).T, np.float64)
    out = np.empty((count, 3))
    assert not native.core().probe_light_le(native.described_lamp(lamp), count, _at(rows), _at(out))
    return out.T


def evaluated(value_node: Node, images=None, uv=(0.0, 0.0), incoming=(0.0, 0.0, -1.0), behind=False):
    """The value of a node on a floor, z up, at (2, n) UV, met along (3, n): (3, n), and as a number (n,)."""
    uv, incoming = np.asarray(uv, np.float64).reshape(2, -1), np.asarray(incoming, np.float64).reshape(3, -1)
    count = max(uv.shape[1], incoming.shape[1])
    flat = Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]]), np.zeros(1, np.int32))
    scene = Scene(
        Pinhole((0, 0, 5), (0, 0, 0), (0, 1, 0), 10, 8, 8),
        {"floor": flat},
        (Object("floor", "floor", np.eye(4), materials=("shown",)),),
        materials={"shown": Material(surface=node("emission", color=value_node))},
        images=images or {},
    )
    core = native.CoreScene(scene, 1)
    core.illuminate(scene)
    rows = [np.broadcast_to(each, (len(each), count)) for each in (incoming, uv, np.array([[float(behind)]]))]
    values, numbers = core.values(np.concatenate(rows).T)
    return values.T, numbers


def looked_up(picture: Picture, uv, closest: bool):
    """(3, n): the linear colors of an image at (2, n) UV."""
    image_node = node("image", image=Color(WHITE, "shown"), interpolation="closest" if closest else "linear")
    return evaluated(image_node, {"shown": picture}, uv)[0]


class ScatteredBy:
    """A shader node of one closure on a floor, z up: what it sends on of light from a direction, and what it samples.

    incoming, direction : (3, n), unit; incoming goes downwards.
    u : (3, n) numbers.
    behind : true if the floor is met from behind.
    """

    def __init__(self, shader, incoming, direction, u, behind=False, version=502) -> None:
        columns = np.asarray(u).shape[1]
        parts = [np.broadcast_to(np.reshape(each, (3, -1)), (3, columns)) for each in (incoming, direction)]
        rows = np.ascontiguousarray(np.concatenate([*parts, np.full((1, columns), float(behind)), u]).T, np.float64)
        out = np.empty((columns, 12))
        described = native.described_closure(Closure(shader), {}, {})
        assert not native.core().probe_bsdf(described, version, columns, _at(rows), _at(out))
        self.light, self.pdf, self.sampled, self.weight = out[:, :3].T, out[:, 3], out[:, 4:7].T, out[:, 7:10].T
        self.sampled_pdf, self.kind = out[:, 10], out[:, 11].astype(int)
