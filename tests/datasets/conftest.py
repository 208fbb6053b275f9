"""Readers of the datasets, written from the formats' own documentation and sources, which know nothing of the writers.

Each gives, for every picture of a dataset, a function from points of the world to pixels from the upper left corner. The camera
of `seen` is then held against `Pinhole.project`, within what float64 allows.
"""

import json

import numpy as np
import pytest

UNIT = 2.0**-53


def read_transforms(text):
    """transforms.json as nerfstudio reads it, refusing what instant-ngp would stumble over.

    Sources: nerfstudio's data_conventions.md (columns of the matrix), nerfstudio_dataparser.py (a key at the top comes first,
    else it must stand in each frame), cameras.py (rays: pixel indices + 0.5 − c over f, y negated, z = −1); instant-ngp's
    nerf_loader.cu (cx over the w of the same object).
    """
    meta = json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    projections = {}
    for frame in meta["frames"]:
        for place in (meta, frame):
            assert ("cx" in place) == ("w" in place) and ("cy" in place) == ("h" in place), "instant-ngp divides cx by w"
        assert not (meta.keys() & frame.keys() - {"frames"}), "a key at the top hides the frame's from nerfstudio"
        values = {**frame, **meta}
        matrix = np.array(values["transform_matrix"])
        assert matrix.shape == (4, 4) and matrix[3].tolist() == [0, 0, 0, 1]
        assert isinstance(values["w"], int) and isinstance(values["h"], int)
        for side, axis in (("w", "x"), ("h", "y")):  # the angle, for readers without fl_x
            focal = values[side] / 2 / np.tan(values[f"camera_angle_{axis}"] / 2)
            assert abs(focal / values[f"fl_{axis}"] - 1) < 1e-9, (
                f"camera_angle_{axis} is for {focal}, not {values[f'fl_{axis}']}"
            )

        def projection(points, intrinsics=values, matrix=matrix):
            x, y, z = np.moveaxis((points - matrix[:3, 3]) @ matrix[:3, :3], -1, 0)  # the inverse of a rotation: its transpose
            return np.stack(
                [intrinsics["cx"] + intrinsics["fl_x"] * (x / -z), intrinsics["cy"] - intrinsics["fl_y"] * (y / -z)], axis=-1
            )

        check_rotation(matrix[:3, :3])
        projections[values["file_path"]] = projection
    return projections


def read_colmap(texts):
    """cameras.txt and images.txt as COLMAP reads them, lines parted at single spaces.

    Sources: COLMAP's doc/format.rst (fields, axes, Hamilton's quaternion, parameters of PINHOLE),
    src/colmap/scene/reconstruction_io_text.cc (two lines an image); gaussian-splatting's scene/colmap_loader.py (no other
    model).
    """
    cameras = {}
    for line in texts["cameras.txt"].splitlines():
        if line and not line.startswith("#"):
            number, model, _width, _height, *parameters = line.split(" ")
            parameters = [float(text) for text in parameters]
            assert model == "PINHOLE" and len(parameters) == 4, f"Gaussian splatting refuses {line}"
            cameras[int(number)] = parameters
    assert not [line for line in texts["points3D.txt"].splitlines() if line and not line.startswith("#")]
    lines = iter(texts["images.txt"].split("\n"))
    projections = {}
    for line in lines:
        if not line or line.startswith("#"):
            continue
        _number, *pose, camera, name = line.split(" ")
        assert next(lines) == "", "the line of image points must be there, and have none"
        w, x, y, z, *translation = map(float, pose)
        rotation = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        check_rotation(rotation)

        def projection(points, rotation=rotation, translation=translation, camera=cameras[int(camera)]):
            f_x, f_y, c_x, c_y = camera
            x, y, z = np.moveaxis(points @ rotation.T + np.array(translation), -1, 0)
            return np.stack([f_x * (x / z) + c_x, f_y * (y / z) + c_y], axis=-1)

        projections[name] = projection
    return projections


def read_record(document):
    """A sidecar's record by its own sentence: K worldToCamera P, over depth. It holds one picture, without a name."""

    def projection(points):
        homogeneous = np.concatenate([points, np.ones((len(points), 1))], axis=1)
        across, down, depth = np.array(document["K"]) @ (np.array(document["worldToCamera"])[:3] @ homogeneous.T)
        return np.stack([across / depth, down / depth], axis=-1)

    return {"": projection}


def check_rotation(matrix):
    """A reader takes the transpose for the inverse: 1e-14 is far above rounding, and far below float32's."""
    assert np.abs(matrix @ matrix.T - np.eye(3)).max() < 1e-14 and np.linalg.det(matrix) > 0, f"no rotation: {matrix.tolist()}"


@pytest.fixture(scope="session")
def readers():
    return {"transforms": read_transforms, "colmap": read_colmap, "record": read_record}


@pytest.fixture(scope="session")
def hold_together():
    """hold_together(projection, pinhole, points): fail where a reader's camera sees points elsewhere than Pinhole.project."""

    def hold(projection, pinhole, points):
        column, row, depth = pinhole.project(points)
        assert (depth > 0).all(), "the points must be before the eye"
        miss = np.abs(projection(points) - np.stack([column, pinhole.height - row], axis=-1))
        allowed = tolerance(pinhole, points, depth)
        worst = np.unravel_index(np.argmax(miss / allowed), miss.shape)
        assert (miss <= allowed).all(), f"{miss[worst]:.3g} pixels off where float64 allows {allowed[worst]:.3g}: {pinhole}"

    return hold


def tolerance(pinhole, points, depth):
    """(n, 2) pixels that rounding may move a point by; u = 2⁻⁵³ is one rounding.

    A pixel is c + d x/z. Errors a of x and of z move it by (d + |c|) (1 + |x|/z) a/z, c counting where K is multiplied before
    the division, as in a sidecar. Of the readers COLMAP's is the worst: its rotation is off by 46 u,

        axes that are within 4e-16 = 3.6 u, of which the largest sum of colmap.quaternion makes 3 · 3.6 + 6 and each difference
        2 · 3.6 + 2, together 23 u of a vector of length ≥ 2; 3 u of its length; twice both as a rotation; 6 u to expand it; and
        10 u of the pinhole's own axes

    which, times |P|, and with 4 u each of R P, of R e and of the pinhole's R (P − e), is a = 58 u (|P| + |e|). Quotient,
    products, sums and H − row add no more than 10 u of the numbers that they round.
    """
    reach = np.linalg.norm(points, axis=-1) + np.linalg.norm(pinhole.eye)
    steepness = (1 + np.linalg.norm(points - np.array(pinhole.eye), axis=-1) / depth)[:, None]
    scale = np.array(pinhole.distance) + np.abs(pinhole.principal_point) + pinhole.width + pinhole.height
    return UNIT * scale * steepness * (58 * (reach / depth)[:, None] + 10)
