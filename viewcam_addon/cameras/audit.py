"""An audit of a dataset's cameras: what is wrong with them, told by what their pictures show.

Each mistake that people make has an inverse. All inverses are tried on the cameras, and the evidence says which of them, if
any, makes the cameras true:

    tracks    points of the scene with the pixels in which pictures show them: a COLMAP model's, or any true cameras' own
    depths    what one picture's depth map says of the scene, seen in another's

A mistake is named only if its inverse explains the evidence far better than the cameras as they are, and leaves errors that
pictures may have; what explains it as well is named beside it. Else it is said that nothing is wrong, or that something is,
of an unknown kind. Robust costs (Cauchy's) let outliers and hidden points be.

Rejected: fitting free parameters, which explains whatever is there (but for a principal point or a lens that was left out,
and one factor of all focal lengths), and judging poses by their looks (do cameras look at their middle?), which is right for
most and a false alarm for the rest.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import counted
from . import axes
from .camera import Camera
from .distortion import Lens, opencv

Array = NDArray[np.float64]

# log likelihood by which one explanation must beat another: e¹⁴ : 1, whatever the number of mistakes that are tried.
_SURE, _TIED = 14.0, 10.0
_FEWEST = 40  # observations
_LEFT_OUT = 2.0  # pixels: less may be anything's,
_SEEN = 4.0  # but for a lens that moves pictures by so many times what is left over with it
_ROUNDS = 10  # times that outliers are weighed anew
_LENS_FITS = 1.0  # pixels: a lens that was left out explains the evidence to this, or is none
_FITTED_LENSES = (  # projection, terms and whether the focal length is fitted, too: the simpler ones first
    ("pinhole", 2, False),
    ("pinhole", 5, False),
    ("equidistant", 5, False),
    ("pinhole", 5, True),
    ("equidistant", 5, True),
)
_BETTER = 0.95  # a further term's error must be below this share of the simpler lens's
_FITTED_TO = 20_000  # observations, about: more tell no more of a few numbers
# For depth maps: from where to where values are tried, how many of them first, and how finely the best is told. The first is
# the logarithm of a factor of the focal length.
_LOG_OF_FACTOR = (-math.log(8), math.log(8), 25, 1e-5)
_K1 = (-0.4, 0.4, 21, 1e-3)
_EXPLAINED = 1e-4  # share of the depth: steps of millimeters at ten meters; a fit as good needs no lens
_COUNTED = 2000  # at most: a systematic error repeats in each, so more of them add no certainty
_FARTHEST = 1e6  # times the usual error: what is behind the camera counts as that
_Y_TO_Z = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
_OPENCV = np.array([1.0, -1, -1])


@dataclass(frozen=True)
class Views:
    """All cameras of a dataset as arrays.

    axes : (n, 3, 3), columns u, v, w; their determinants may be −1.
    eye : (n, 3).
    focal : (n, 2), pixels.
    center : (n, 2), the principal point from the left and the top.
    size : (n, 2), pixels.
    depth_scale : the world units in one unit of the depth maps.
    along_ray : true where depth is the distance from the eye, false where it is counted along w.
    shifted : the number of pictures by which the cameras are late.
    lenses : each camera's lens; without any all are pinholes.
    """

    axes: Array
    eye: Array
    focal: Array
    center: Array
    size: Array
    depth_scale: float = 1.0
    along_ray: bool = False
    shifted: int = 0
    lenses: tuple[Lens | None, ...] = ()

    def project(self, which: NDArray, points: Array) -> tuple[Array, Array]:
        """(m, 2) pixels from the left and the top, and (m,) depth, of points (m, 3) in cameras (m,)."""
        which = (which + self.shifted) % len(self.eye)
        x, y, z = np.einsum("mij,mi->jm", self.axes[which], points - self.eye[which])
        with np.errstate(all="ignore"):
            in_plane = self._through_lens(which, np.stack([x / -z, -y / -z], axis=-1), Lens.distort)
            places = self.center[which] + self.focal[which] * in_plane
        return places, -z

    def points(self, which: NDArray, places: Array, depth: Array) -> Array:
        """(m, 3): what cameras (m,) see at places (m, 2), at depths (m,) of their depth maps."""
        which = (which + self.shifted) % len(self.eye)
        x, y = self._through_lens(which, (places - self.center[which]) / self.focal[which], Lens.undistort).T
        rays = np.stack([x, -y, -np.ones_like(x)], axis=-1)
        if self.along_ray:
            rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
        rays = np.einsum("mij,mj->mi", self.axes[which], rays)
        return self.eye[which] + (self.depth_scale * depth)[:, None] * rays

    def _through_lens(self, which: NDArray, points: Array, move: Callable[[Lens, Array], Array]) -> Array:
        """Points (m, 2) in the view planes at distance 1 of cameras (m,), moved by their lenses."""
        for lens in {lens for lens in self.lenses if lens is not None}:
            of_it = np.array([each == lens for each in self.lenses])[which]
            points[of_it] = move(lens, points[of_it])
        return points


def views_of(cameras: Sequence[Camera]) -> Views:
    """The cameras of a dataset as arrays."""
    matrices = np.array([axes.camera_to_world(camera.pinhole) for camera in cameras])
    k = np.array([axes.intrinsics(camera.pinhole) for camera in cameras])
    size = np.array([(camera.pinhole.width, camera.pinhole.height) for camera in cameras], float)
    lenses = tuple(camera.lens for camera in cameras)
    return Views(matrices[:, :3, :3], matrices[:, :3, 3], k[:, [0, 1], [0, 1]], k[:, :2, 2], size, lenses=lenses)


# ---- evidence


@dataclass(frozen=True)
class Tracks:
    """Points and where pictures show them.

    which : (m,), the number of the picture.
    places : (m, 2), pixels from the left and the top.
    points : (m, 3), world space.
    floor : the least error, in pixels, that such places have.
    part : the part of the errors whose largest is the usual one.
    plausible : the largest usual error that right cameras have.
    """

    which: NDArray
    places: Array
    points: Array
    floor: float = 0.02
    unit: str = "pixels"
    plausible: float = 4.0
    part: float = 0.5

    def errors(self, views: Views) -> Array:
        """(m,) pixels; infinite behind the camera."""
        places, depth = views.project(self.which, self.points)
        with np.errstate(all="ignore"):
            errors = np.hypot(*(places - self.places).T)
        return np.where((depth > 0) & np.isfinite(errors), errors, np.inf)


_SAMPLES, _NEIGHBORS = 60, 4  # points of a picture, and how many of the next pictures each is looked up in


class Depths:
    """Depth maps, one a picture: (height, width), rows from the top, not finite or ≤ 0 where nothing is."""

    # Pictures of depth may see little in common: the lowest fifth of the errors are those of what both see, if anything is.
    floor, unit, plausible, part = 1e-6, "of the depth", 0.02, 0.2

    def __init__(self, maps: Sequence[Array]) -> None:
        self.maps = [np.asarray(depth, dtype=np.float64) for depth in maps]
        random = np.random.default_rng(0)
        count = len(self.maps)
        self.pairs = [(i, (i + step) % count) for i in range(count) for step in range(1, min(_NEIGHBORS, count - 1) + 1)]
        self.samples = []
        chosen: Any
        for depth in self.maps:
            rows, columns = np.nonzero(np.isfinite(depth) & (depth > 0))
            chosen = random.choice(len(rows), min(_SAMPLES, len(rows)), replace=False) if len(rows) else []
            self.samples.append((columns[chosen] + 0.5, rows[chosen] + 0.5, depth[rows[chosen], columns[chosen]]))

    def errors(self, views: Views) -> Array:
        """The error of each sample in each pair of pictures: by which part the two depths differ; ½ where the other picture
        lacks it."""
        result = []
        for i, j in self.pairs:
            columns, rows, depth = self.samples[i]
            many = np.full(len(columns), i)
            points = views.points(many, np.stack([columns, rows], axis=-1), depth)
            places, z = views.project(np.full(len(columns), j), points)
            if views.along_ray:
                z = np.where(z > 0, np.linalg.norm(points - views.eye[(j + views.shifted) % len(views.eye)], axis=-1), z)
            there = _between(self.maps[j], places) * views.depth_scale
            with np.errstate(all="ignore"):
                error = np.abs(np.log(there / z))
            result.append(np.where((z > 0) & np.isfinite(error), np.minimum(error, 0.5), 0.5))
        return np.concatenate(result) if result else np.zeros(0)


def _between(depth: Array, places: Array) -> Array:
    """The depth between four pixels' centers: of planes exact, since 1/depth is linear there; nan outside and across edges."""
    height, width = depth.shape
    with np.errstate(all="ignore"):
        x, y = (np.where(np.isfinite(p), p, -9) - 0.5 for p in places.T)
        left, top = np.floor(x), np.floor(y)
        inside = (left >= 0) & (top >= 0) & (left < width - 1) & (top < height - 1)
        i, j = (np.where(inside, p, 0).astype(int) for p in (top, left))
        four = np.stack([1 / depth[i, j], 1 / depth[i, j + 1], 1 / depth[i + 1, j], 1 / depth[i + 1, j + 1]])
        a, b = x - left, y - top
        value = (four[0] * (1 - a) + four[1] * a) * (1 - b) + (four[2] * (1 - a) + four[3] * a) * b
        smooth = four.max(axis=0) < 1.1 * four.min(axis=0)
        return np.where(inside & smooth & (value > 0), 1 / value, np.nan)


def tracks_through(true: Sequence[Camera]) -> Tracks:
    """The tracks that true cameras, as a .blend's, have of points before them: evidence for cameras that should be the same."""
    random = np.random.default_rng(0)
    views = views_of(true)
    farthest = np.linalg.norm(views.eye - views.eye.mean(axis=0), axis=1).max()
    reach = max(farthest, 1e-6 * float(np.abs(views.eye).max()), 1.0 if len(true) == 1 else 0.0) or 1.0
    which = np.repeat(np.arange(len(true)), _SAMPLES)
    places = random.uniform(0, 1, (len(which), 2)) * views.size[which]
    points = views.points(which, places, reach * random.uniform(0.5, 2, len(which)))
    seen = np.isfinite(points).all(axis=-1)  # and not beyond what a lens shows
    return Tracks(which[seen], places[seen], points[seen])


# ---- mistakes


def _scaled(views: Views, focal: float = 1.0, center: float = 1.0) -> Views:
    return replace(views, focal=views.focal * focal, center=views.center * center)


def _inverted(views: Views, before: bool, after: bool) -> Views:
    """The inverse of the matrices; before, after: with OpenCV's axes in what is inverted, in what comes out."""
    turn = views.axes * _OPENCV if before else views.axes
    turned = np.swapaxes(turn, 1, 2)
    eye = -np.einsum("nij,nj->ni", turned, views.eye)
    return replace(views, axes=turned * _OPENCV if after else turned, eye=eye)


def _flipped(*signs: float) -> Callable[[Views], Views]:
    return lambda views: replace(views, axes=views.axes * np.array(signs))


def _translation_as_eye(views: Views, opencv: bool) -> Views:
    turn = views.axes * _OPENCV if opencv else views.axes
    return replace(views, eye=-np.einsum("nij,nj->ni", turn, views.eye))


def _eye_as_translation(views: Views) -> Views:
    """COLMAP's t was the eye."""
    turn = np.swapaxes(views.axes * _OPENCV, 1, 2)
    return replace(views, eye=-np.einsum("nij,nj->ni", turn, views.eye))


def _reordered(views: Views, order: tuple[int, ...]) -> Views:
    """World to camera's quaternion, w x y z as read, in another order; the translation stays as it is in the file."""
    turn = np.swapaxes(views.axes * _OPENCV, 1, 2)
    translation = -np.einsum("nij,nj->ni", turn, views.eye)
    if (np.linalg.det(turn) < 0).any():
        return views
    read = np.array([axes.quaternion(each.tolist()) for each in turn])
    turn = np.array([axes.rotation_of(tuple(q[list(order)]), "a view") for q in read])
    back = np.swapaxes(turn, 1, 2)
    return replace(views, axes=back * _OPENCV, eye=-np.einsum("nij,nj->ni", back, translation))


def _turned_world(views: Views, turn: Array) -> Views:
    return replace(views, axes=turn @ views.axes, eye=views.eye @ turn.T)


def _swapped(views: Views, name: str) -> Views:
    return replace(views, **{name: getattr(views, name)[:, ::-1]})


def _of_other_axis(views: Views, up: bool) -> Views:
    ratio = views.size[:, :1] / views.size[:, 1:]
    return replace(views, focal=views.focal * (ratio if up else 1 / ratio))


def _stretched(views: Views, aspect: float | Array) -> Views:
    return replace(views, focal=views.focal * np.stack([np.ones(len(views.eye)), np.broadcast_to(aspect, len(views.eye))], -1))


def _factors(*names: str) -> dict[str, float]:
    """Factors by the names that sentences have for them: "2/3", or "0.3048 (feet)"."""
    fractions = {name: name.split()[0].partition("/") for name in names}
    return {name: float(numerator) / float(denominator or 1) for name, (numerator, _, denominator) in fractions.items()}


_SIZES = _factors("1/4", "1/3", "1/2", "2/3", "3/4", "4/3", "3/2", "2", "3", "4")
_HALVES = _factors("1/4", "1/2", "2", "4")
_ASPECTS = _factors("2", "1/2", "3/2", "2/3", "4/3", "3/4", "12/11", "11/12", "16/11", "11/16", "10/11", "11/10")
_UNITS = _factors(
    *("1000", "100", "10", "1/10", "1/100", "1/1000"),
    *("0.3048 (feet)", "0.0254 (inches)", "1/0.3048 (feet)", "1/0.0254 (inches)"),
)


@dataclass(frozen=True)
class Mistake:
    """A mistake that data sets' cameras are known to have.

    kind : a name for programs.
    sentence : a sentence that says what was done.
    undone : a function that gives the cameras without it.
    of_depth : true if only depth maps can show it.
    of_world : true if it turns all cameras together, which depth maps can't show: each sees what it saw.
    is_fitted : true if it has numbers that are fitted to the evidence, so that it explains whatever a known one does, too.
    """

    kind: str
    sentence: str
    undone: Callable[[Views], Views]
    of_depth: bool = False
    of_world: bool = False
    is_fitted: bool = False


def _mistakes() -> list[Mistake]:
    """The more usual ones first: of two that can't be told apart the first is named first."""
    fine = [
        Mistake(
            "half_pixel",
            "the principal point is half a pixel too small: it counts from the first pixel's center",
            lambda v: replace(v, center=v.center + 0.5),
        ),
        Mistake(
            "half_pixel_more", "the principal point is half a pixel too large", lambda v: replace(v, center=v.center - 0.5)
        ),
        Mistake("center_swapped", "cx and cy are swapped", lambda v: _swapped(v, "center")),
        Mistake(
            "center_upside_down",
            "cy counts from the bottom",
            lambda v: replace(v, center=np.stack([v.center[:, 0], v.size[:, 1] - v.center[:, 1]], -1)),
        ),
        Mistake(
            "center_mirrored",
            "cx counts from the right",
            lambda v: replace(v, center=np.stack([v.size[:, 0] - v.center[:, 0], v.center[:, 1]], -1)),
        ),
        Mistake("focal_swapped", "fl_x and fl_y are swapped", lambda v: _swapped(v, "focal")),
        Mistake(
            "opencv_axes",
            "y and z of the camera's axes are negated: OpenCV's stand where OpenGL's should, or the reverse",
            _flipped(1, -1, -1),
        ),
        Mistake("y_flipped", "the camera's y axis is negated", _flipped(1, -1, 1)),
        Mistake("z_flipped", "the camera's z axis is negated", _flipped(1, 1, -1)),
        Mistake("x_flipped", "the camera's x axis is negated: the picture is mirrored", _flipped(-1, 1, 1)),
        Mistake(
            "inverse",
            "the matrices are world to camera where camera to world is wanted, or the reverse",
            lambda v: _inverted(v, False, False),
        ),
        Mistake(
            "inverse",
            "the matrices are world to camera, with OpenCV's axes, where camera to world is wanted",
            lambda v: _inverted(v, False, True),
        ),
        Mistake(
            "inverse", "the matrices are camera to world where world to camera is wanted", lambda v: _inverted(v, True, True)
        ),
        Mistake("transposed", "the rotations are transposed", lambda v: replace(v, axes=np.swapaxes(v.axes, 1, 2))),
        Mistake(
            "transposed",
            "the rotations are transposed, with OpenCV's axes",
            lambda v: replace(v, axes=np.swapaxes(v.axes * _OPENCV, 1, 2) * _OPENCV),
        ),
        Mistake(
            "translation_as_eye",
            "the translations of world to camera stand where the eyes should",
            lambda v: _translation_as_eye(v, False),
        ),
        Mistake(
            "translation_as_eye",
            "the translations of world to camera, with OpenCV's axes, stand where the eyes should",
            lambda v: _translation_as_eye(v, True),
        ),
        Mistake("eye_as_translation", "the eyes stand where the translations of world to camera should", _eye_as_translation),
        Mistake(
            "quaternion_order",
            "the quaternions are x, y, z, w where w, x, y, z is wanted",
            lambda v: _reordered(v, (3, 0, 1, 2)),
        ),
        Mistake(
            "quaternion_order",
            "the quaternions are w, x, y, z where x, y, z, w is wanted",
            lambda v: _reordered(v, (1, 2, 3, 0)),
        ),
        Mistake(
            "y_up", "the cameras' world has y up and the scene's has z up", lambda v: _turned_world(v, _Y_TO_Z), of_world=True
        ),
        Mistake(
            "y_up", "the cameras' world has z up and the scene's has y up", lambda v: _turned_world(v, _Y_TO_Z.T), of_world=True
        ),
        Mistake(
            "y_down",
            "the cameras' world is turned upside down: it has y down where the scene has y up, or the reverse",
            lambda v: _turned_world(v, np.diag(_OPENCV)),
            of_world=True,
        ),
        Mistake(
            "y_down",
            "the cameras' world has y down, as COLMAP's, and the scene's has z up",
            lambda v: _turned_world(v, _Y_TO_Z @ np.diag(_OPENCV)),
            of_world=True,
        ),
        Mistake("late", "each picture has the camera of the one before it", lambda v: replace(v, shifted=1)),
        Mistake("late", "each picture has the camera of the one after it", lambda v: replace(v, shifted=-1)),
        Mistake(
            "fov_axis",
            "the field of view is that of the width and was taken for the height's",
            lambda v: _of_other_axis(v, True),
        ),
        Mistake(
            "fov_axis",
            "the field of view is that of the height and was taken for the width's",
            lambda v: _of_other_axis(v, False),
        ),
        Mistake(
            "distance_for_depth",
            "the depth maps hold distances from the eye, not depths along the view",
            lambda v: replace(v, along_ray=True),
            True,
        ),
    ]
    by_factors: list[tuple[str, str, dict[str, Any], Callable[[Views, Any], Views]]] = [
        (
            "size",
            "focal lengths and principal points are of another size, or resolution percentage: times {} is right",
            _SIZES,
            lambda v, s: _scaled(v, s, s),
        ),
        ("focal_of_another_size", "the focal lengths are of a picture of another size: times {} is right", _HALVES, _scaled),
        (
            "center_of_another_size",
            "the principal points are of a picture of another size: times {} is right",
            _SIZES,
            lambda v, s: _scaled(v, 1, s),
        ),
        ("aspect", "the pixels are not square: fl_y should be {} times what it is", _ASPECTS, _stretched),
        (
            "aspect",
            "fl_y is that of a square picture: it should be {} times what it is",
            {"width / height": 0, "height / width": 1},
            lambda v, across: _stretched(v, v.size[:, across] / v.size[:, 1 - across]),
        ),
        (
            "unit",
            "the cameras' places are in another unit than the scene: times {} is right",
            _UNITS,
            lambda v, s: replace(v, eye=v.eye * s),
        ),
    ]
    return fine + [
        Mistake(kind, sentence.format(description), partial(_undone_by, undone, factor))
        for kind, sentence, factors, undone in by_factors
        for description, factor in factors.items()
    ]


def _undone_by(undone: Callable[[Views, Any], Views], factor: Any, views: Views) -> Views:
    return undone(views, factor)


MISTAKES = _mistakes()


def _with_lenses(views: Views, change: Callable[[Lens], Lens | None]) -> Views:
    return replace(views, lenses=tuple(lens and change(lens) for lens in views.lenses))


_OF_LENSES = [
    Mistake(
        "lens_twice",
        "the pictures are undistorted already, and the cameras' lens distortion counts once more: it should be none",
        lambda v: replace(v, lenses=()),
    ),
    Mistake(
        "tangential_swapped",
        "p1 and p2 of the lens are swapped, as Metashape's are against OpenCV's",
        lambda v: _with_lenses(v, lambda lens: replace(lens, tangential=lens.tangential[::-1])),
    ),
    Mistake(
        "lens_model",
        "the lens is a fisheye, whose coefficients were taken for those of a lens with straight lines",
        lambda v: _with_lenses(v, lambda lens: replace(lens, projection="equidistant", divisor=())),
    ),
    Mistake(
        "lens_model",
        "the lens is none of a fisheye, for whose its coefficients were taken",
        lambda v: _with_lenses(v, lambda lens: replace(lens, projection="pinhole")),
    ),
]
"""The mistakes of cameras that have a lens."""


@dataclass(frozen=True)
class Verdict:
    """The verdict of the evidence.

    kind : a Mistake's kind, "none" if the cameras are right, "unknown" if they are wrong in no known way, "unsure" if the
        evidence is too little.
    sentence : a sentence for people.
    others : kinds that explain the evidence as well; of right cameras, those that the evidence can't exclude.
    error, error_as_is : the usual error with the mistake undone and with the cameras as they are.
    certainty : the log likelihood over that of the cameras as they are; of right ones, theirs over that of the likeliest
        mistake.
    """

    kind: str
    sentence: str
    others: tuple[str, ...] = ()
    error: float = 0.0
    error_as_is: float = 0.0
    certainty: float = 0.0
    observations: int = 0


def audit(cameras: Sequence[Camera], evidence: "Tracks | Depths") -> Verdict:
    """The verdict about cameras, of which the evidence counts the same pictures in the same order."""
    return _audited(views_of(cameras), evidence)


def _audited(views: Views, evidence: "Tracks | Depths") -> Verdict:
    as_is = evidence.errors(views)
    if len(as_is) < _FEWEST:
        return Verdict(
            "unsure", f"{counted(len(as_is), 'observation')} of {_FEWEST} that are needed to tell", observations=len(as_is)
        )
    tried, errors = _explanations(views, evidence, as_is)
    # The usual error is that of the best explanation, so that it does not hide in the worse ones.
    usual = max(evidence.floor, min(_usual(each, evidence) for each in (as_is, *errors)))
    costs = np.array([_cost(each, usual) for each in (as_is, *errors)])
    best = int(np.argmin(costs))
    errors_found = (as_is, *errors)[best]
    error, error_as_is = _usual(errors_found, evidence), _usual(as_is, evidence)
    certainty = float(costs[0] - costs[best])
    measured: dict[str, Any] = {"error": error, "error_as_is": error_as_is, "certainty": certainty, "observations": len(as_is)}
    sentence = f"something is wrong, in no way that is known: the evidence is off by {error_as_is:.3g} {evidence.unit}"
    unknown = Verdict("unknown", sentence, **measured)
    if certainty < _SURE:
        if error_as_is <= evidence.plausible:
            sentence = f"nothing is wrong with the cameras: the evidence fits to {error_as_is:.2g} {evidence.unit}"
            over = [
                (max(float(cost - costs[0]), 0.0), mistake.kind)
                for mistake, cost, each in zip(tried, costs[1:], errors, strict=True)
                if _differ(each, as_is, evidence) and not mistake.is_fitted
            ]
            possible = tuple(dict.fromkeys(kind for sure, kind in over if sure < _SURE))
            if possible:
                sentence += f"; it is too little to exclude: {', '.join(possible)}"
            if isinstance(evidence, Depths):
                turns = tuple(dict.fromkeys(mistake.kind for mistake in MISTAKES if mistake.of_world))
                sentence += f"; depth maps do not show how the whole world is turned: {', '.join(turns)}"
                possible += turns
            return Verdict("none", sentence, possible, **measured | {"certainty": min(over)[0] if over else 0.0})
        return unknown
    if error > evidence.plausible:
        return unknown
    mistake = tried[best - 1]
    tied = [tried[i - 1] for i in np.flatnonzero(costs - costs[best] < _TIED) if i and tried[i - 1] is not mistake]
    first = min([mistake, *tied], key=tried.index)
    others = tuple(dict.fromkeys(each.kind for each in (mistake, *tied) if each.kind != first.kind and not each.is_fitted))
    sentence = f"{first.sentence} (undone, the evidence fits to {error:.2g} {evidence.unit} in place of {error_as_is:.3g})"
    if others:
        sentence += f"; the evidence can't tell it from: {', '.join(others)}"
    return Verdict(first.kind, sentence, others, **measured)


def _explanations(views: Views, evidence: "Tracks | Depths", as_is: Array) -> tuple[list[Mistake], list[Array]]:
    """The mistakes that this evidence can show, and its errors once each of them is undone.

    as_is : the errors with the cameras as they are.
    """
    of_depth = isinstance(evidence, Depths)
    tried = [mistake for mistake in MISTAKES if not (mistake.of_world if of_depth else mistake.of_depth)]
    tried += _OF_LENSES if any(views.lenses) else []
    tried.append(_of_focal_factor(views, evidence))
    if isinstance(evidence, Tracks) and np.abs(views.center - views.size / 2).max() <= 0.5:
        tried += _left_out(views, evidence)
    errors = [evidence.errors(mistake.undone(views)) for mistake in tried]
    known = (as_is, *(each for each, mistake in zip(errors, tried, strict=True) if not mistake.is_fitted))
    if isinstance(evidence, Depths):
        lenses = _lenses_of_depths(views, evidence) if min(_usual(each, evidence) for each in known) > _EXPLAINED else []
    else:  # a lens's shift is seen in the largest errors but for outliers
        nearest = min(float(np.sort(each)[int(0.95 * (len(each) - 1))]) for each in known)
        lenses = _lens_of_tracks(views, evidence) if nearest > _SEEN / 2 * evidence.floor else []
    return tried + lenses, errors + [evidence.errors(mistake.undone(views)) for mistake in lenses]


def _usual(errors: Array, evidence: "Tracks | Depths") -> float:
    """The largest of the part of the errors that counts; behind the camera they are infinite."""
    return float(np.sort(errors)[int(evidence.part * (len(errors) - 1))])


def _differ(errors: Array, others: Array, evidence: "Tracks | Depths") -> bool:
    """True if there was something to undo: swapped, a principal point in the middle of a square is as it was."""
    with np.errstate(invalid="ignore"):
        return bool((np.abs(errors - others) > evidence.floor).any())


def _of_focal_factor(views: Views, evidence: "Tracks | Depths") -> Mistake:
    """The mistake of a focal length that is wrong by the factor that the evidence asks for."""
    factor = _factor_of_tracks(views, evidence) if isinstance(evidence, Tracks) else _factor_of_depths(views, evidence)
    off = f"{factor:.4g} times too short" if factor > 1 else f"{1 / factor:.4g} times too long"
    return Mistake("focal_factor", f"the focal length is {off}", lambda v: _scaled(v, factor), is_fitted=True)


def _factor_of_tracks(views: Views, evidence: Tracks) -> float:
    """The factor by which pictures show a point farther from the principal point than the cameras say, in the median."""
    places, depth = views.project(evidence.which, evidence.points)
    center = views.center[(evidence.which + views.shifted) % len(views.eye)]
    with np.errstate(all="ignore"):
        expected = places - center
        factors = ((evidence.places - center) * expected).sum(axis=-1) / (expected * expected).sum(axis=-1)
    usable = factors[(depth > 0) & np.isfinite(factors) & (factors > 0)]
    return float(np.median(usable)) if len(usable) else 1.0


def _factor_of_depths(views: Views, evidence: Depths) -> float:
    """The factor with the least usual error."""

    def usual(log: float) -> float:
        return _usual(evidence.errors(_scaled(views, math.exp(log))), evidence)

    return math.exp(_least(usual, *_LOG_OF_FACTOR))


def _least(cost: Callable[[float], float], first: float, last: float, steps: int, finest: float) -> float:
    """The value with the least cost: of some, then of those around the best, until it is told finely enough."""
    values = np.linspace(first, last, steps)
    while (step := values[1] - values[0]) > finest:
        best = values[int(np.argmin([cost(value) for value in values.tolist()]))]
        values = np.linspace(best - step, best + step, steps // 3)
    return float(best)


def _lenses_of_depths(views: Views, evidence: Depths) -> list[Mistake]:
    """The mistakes of cameras whose lens was left out or is another one: of straight lines with the k1 that depth maps ask for,
    or a fisheye; those that move the pictures."""

    def of_lens(k1: float, projection: str = "pinhole") -> Lens:
        return replace(opencv({"k1": k1}), projection=projection)

    def usual(k1: float) -> float:
        return _usual(evidence.errors(_with_lens_of(of_lens(k1), 1.0)(views)), evidence)

    as_is = [lens or Lens(()) for lens in views.lenses or (None,)]
    places = np.concatenate([np.stack([columns, rows], axis=-1) for columns, rows, _ in evidence.samples])
    points = (places - views.center[0]) / views.focal[0]
    result = []
    for lens in (of_lens(_least(usual, *_K1)), of_lens(0.0, "equidistant")):
        moved = np.hypot(*((lens.distort(points) - as_is[0].distort(points)) * views.focal[0]).T)
        if np.nanpercentile(moved, 95) > _LEFT_OUT:
            result.append(_of_lens(views, lens, 1.0))
    return result


def _left_out(views: Views, evidence: Tracks) -> list[Mistake]:
    """The mistake of cameras whose principal point is the middle: the one that the evidence asks for, if that is another."""
    places, depth = views.project(evidence.which, evidence.points)
    with np.errstate(all="ignore"):
        off = (evidence.places - places)[(depth > 0) & np.isfinite(places).all(axis=-1)]
    offset = np.median(off, axis=0) if len(off) else np.zeros(2)
    if np.hypot(*offset) < _LEFT_OUT:
        return []
    x, y = offset
    sentence = (
        f"the principal points were left out: the middle of the picture stands there, {x:+.1f}, {y:+.1f} pixels are right"
    )
    return [Mistake("center_left_out", sentence, lambda v: replace(v, center=v.center + offset))]


def _cost(errors: Array, usual: float) -> float:
    """The negative log likelihood of Cauchy's distribution, but for a constant."""
    bounded = np.minimum(errors / usual, _FARTHEST)
    return float(np.log1p(bounded * bounded).mean()) * min(len(errors), _COUNTED)


def _lens_of_tracks(views: Views, evidence: Tracks) -> list[Mistake]:
    """The mistake of cameras whose lens was left out or is another one: that which the evidence asks for, if it explains it."""
    straight = replace(views, lenses=())
    places, depth = straight.project(evidence.which, evidence.points)
    there = np.flatnonzero((depth > 0) & np.isfinite(places).all(axis=-1))
    there = there[:: max(1, len(there) // _FITTED_TO)]
    which = evidence.which[there]
    center, focal = (each[(which + views.shifted) % len(views.eye)] for each in (views.center, views.focal))
    points, measured = (places[there] - center) / focal, (evidence.places[there] - center) / focal
    best: tuple[Lens, float, float] | None = None
    for projection, terms, of_focal in _FITTED_LENSES:
        fit = _fitted(points, measured, focal, projection, terms, of_focal, evidence.floor)
        if fit is not None and (best is None or fit[2] < _BETTER * best[2]):
            best = fit
    if best is None:
        return []
    lens, factor, error = best
    with np.errstate(all="ignore"):
        as_is = points * factor
        if any(views.lenses):
            as_is = (views.project(evidence.which[there], evidence.points[there])[0] - center) / focal
        moved = np.hypot(*((lens.distort(points) * factor - as_is) * focal).T)
    moved = moved[np.isfinite(moved)]
    if not len(moved) or np.percentile(moved, 95) < min(_LEFT_OUT, _SEEN * error):
        return []
    return [_of_lens(views, lens, factor)]


def _of_lens(views: Views, lens: Lens, factor: float) -> Mistake:
    """The mistake of cameras that should have a lens, and focal lengths so many times as long."""
    right = ", ".join(f"{name} = {value:.4g}" for name, value in lens.terms) + " is right"
    right = f"a fisheye with {right}" if lens.projection != "pinhole" else right
    right += f", with focal lengths {factor:.4g} times as long" if factor != 1 else ""
    if any(views.lenses):
        kind, sentence = "lens_model", f"the lens is of another model or another camera: {right}"
    else:
        kind, sentence = "lens_left_out", f"lens distortion was left out: {right}, or the pictures were undistorted twice"
    return Mistake(kind, sentence, _with_lens_of(lens, factor), is_fitted=True)


def _with_lens_of(lens: Lens, factor: float) -> Callable[[Views], Views]:
    return lambda views: replace(_scaled(views, factor), lenses=(lens,) * len(views.eye))


def _fitted(
    points: Array, taken: Array, focal: Array, projection: str, count: int, of_focal: bool, floor: float
) -> tuple[Lens, float, float] | None:
    """The lens that takes a pinhole's points to places in pictures, the factor of the focal length and the usual error in
    pixels; None where there is none that does.

    points, taken : (m, 2), in the view plane at distance 1.
    count : the number of its terms k1, k2, k3, p1, p2. By least squares, each observation weighted by Cauchy's cost, so that
        outliers count little.
    """
    base = Lens((), projection).distort(points)
    off = taken - base
    # A point that is farther from where the projection alone shows it than lenses bend is an outlier, or beyond the picture.
    usable = np.hypot(*off.T) < np.maximum(0.5 * np.hypot(*base.T), 0.1)
    if usable.sum() < _FEWEST:
        return None
    base, off, focal = base[usable], off[usable], focal[usable]
    x, y = base.T
    r = x * x + y * y
    columns = [(r**power)[:, None] * base for power in (1, 2, 3)]
    columns += [np.stack([2 * x * y, r + 2 * y * y], axis=-1), np.stack([r + 2 * x * x, 2 * x * y], axis=-1)]
    slopes = np.stack(columns[:count] + [base] * of_focal, axis=-1)
    terms = np.zeros(slopes.shape[-1])
    for _ in range(_ROUNDS):
        errors = np.hypot(*((off - slopes @ terms) * focal).T)
        weight = focal / np.hypot(1, errors / max(float(np.median(errors)), floor))[:, None]
        terms = np.linalg.lstsq((weight[..., None] * slopes).reshape(-1, len(terms)), (weight * off).ravel(), rcond=None)[0]
    error = float(np.median(np.hypot(*((off - slopes @ terms) * focal).T)))
    if error > _LENS_FITS:
        return None
    factor = 1 + float(terms[-1]) * of_focal
    values = zip(("k1", "k2", "k3", "p1", "p2"), (terms[:count] / factor).tolist(), strict=False)
    return replace(opencv(dict(values)), projection=projection), factor, max(error, floor)
