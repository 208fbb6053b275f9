"""Every combination of what may go wrong between d in pixels and Blender's lens: set through the properties, judged by Blender.

Two judges, neither of which shares a line with intrinsics.py: Blender's own `calc_matrix_camera` for the whole grid, and
Cycles, rendering where in the world each pixel falls, for a sample of it.
"""

import itertools

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import datablocks

pytestmark = pytest.mark.slow

SIZES = [(1920, 1080), (1080, 1920), (1001, 777), (333, 778), (512, 512)]
FITS = ["AUTO", "HORIZONTAL", "VERTICAL"]
ASPECTS = [(1.0, 1.0), (2.0, 1.0), (1.0, 1.5)]
SHIFTS = [(0.0, 0.0), (0.13, -0.21)]
PERCENTAGES = [100, 33]
BORDERS = ["whole", "border", "cropped border"]
GRID = list(itertools.product(SIZES, FITS, ASPECTS, SHIFTS, PERCENTAGES, BORDERS))

# calc_matrix_camera holds float32 numbers: 60 cameras differed by at most 3.8e-3 px from the ideal.
LARGEST_OF_BLENDERS_MATRIX = 4e-3


def set_up(scene, camera_object, size, fit, aspect, shift, percentage, border, random):
    """Scene and camera of one combination, then the four values through the properties; the Pinhole that they state."""
    render, camera, group = scene.render, camera_object.data, camera_object.virtual_pinhole
    render.resolution_x, render.resolution_y = size
    render.pixel_aspect_x, render.pixel_aspect_y = aspect
    render.resolution_percentage = percentage
    render.use_border, render.use_crop_to_border = border != "whole", border == "cropped border"
    render.border_min_x, render.border_min_y, render.border_max_x, render.border_max_y = 0.21, 0.13, 0.87, 0.71
    camera.sensor_fit = fit
    camera.shift_x, camera.shift_y = shift
    group.enabled = True
    group.eye, group.look_at, group.up = random.uniform(-5, 5, 3), random.uniform(-5, 5, 3), random.normal(size=3)
    group.distance = max(size) * random.uniform(0.5, 2.0)
    return cameras.stated(camera_object, scene)


def blenders_picture(scene, camera_object, points):
    """(column, row) of points in the rendered picture by calc_matrix_camera; the inverse of the pose in float64."""
    frame, render = datablocks.frame_of(scene), scene.render
    depsgraph = bpy.context.evaluated_depsgraph_get()
    evaluated = camera_object.evaluated_get(depsgraph)
    width, height = frame.size
    projection = np.array(
        evaluated.calc_matrix_camera(depsgraph, x=width, y=height, scale_x=render.pixel_aspect_x, scale_y=render.pixel_aspect_y)
    )
    to_camera = np.linalg.inv(np.array(evaluated.matrix_world))
    clip = np.column_stack([points, np.ones(len(points))]) @ (projection @ to_camera).T
    column, row, *_ = frame.window
    return (clip[:, 0] / clip[:, 3] + 1) * width / 2 - column, (clip[:, 1] / clip[:, 3] + 1) * height / 2 - row


@pytest.mark.parametrize("fit", FITS)
@pytest.mark.parametrize("size", SIZES)
def test_every_camera_of_the_grid_is_the_one_that_blender_sees(camera_object, scene, size, fit):
    random = np.random.default_rng(SIZES.index(size) * 3 + FITS.index(fit))
    combinations = [each for each in GRID if each[:2] == (size, fit)]
    assert len(combinations) == len(ASPECTS) * len(SHIFTS) * len(PERCENTAGES) * len(BORDERS)
    for combination in combinations:
        pinhole = set_up(scene, camera_object, *combination, random)
        findings = cameras.check(camera_object, pinhole, scene)
        assert findings == [], f"{combination}: {findings}"
        columns, rows = (
            grid.ravel() for grid in np.meshgrid(np.linspace(0, pinhole.width, 9), np.linspace(0, pinhole.height, 9))
        )
        directions = pinhole.ray_directions(columns, rows, 0, 0)
        points = np.array(pinhole.eye) + directions * random.uniform(5, 50, (len(columns), 1))
        for column, row in (
            blenders_picture(scene, camera_object, points),
            cameras.read(camera_object, scene).project(points)[:2],
        ):
            error = np.hypot(column - columns, row - rows).max()
            assert error <= LARGEST_OF_BLENDERS_MATRIX, f"{combination}: {error:.1e} px"


def test_the_grid_is_whole():
    assert len(GRID) == 5 * 3 * 3 * 2 * 2 * 3


@pytest.mark.parametrize("wrong", ["half a pixel", "fit", "aspect", "0.1 %", "mirrored"])
def test_the_judge_finds_a_wrong_camera(camera_object, scene, wrong):
    random = np.random.default_rng(0)
    pinhole = set_up(scene, camera_object, (1001, 777), "AUTO", (2.0, 1.0), (0.13, -0.21), 33, "cropped border", random)
    points = np.array(pinhole.eye) + pinhole.ray_directions([0, pinhole.width], [0, pinhole.height], 0, 0) * 20
    if wrong == "half a pixel":
        camera_object.data.shift_x += 0.5 / (1001 * 33 // 100)
    elif wrong == "fit":
        camera_object.data.sensor_fit = "VERTICAL"
    elif wrong == "aspect":
        scene.render.pixel_aspect_x = 1.0
    elif wrong == "0.1 %":
        camera_object.data.lens *= 1.001
    else:
        camera_object.scale[0] = -1
    column, row = blenders_picture(scene, camera_object, points)
    error = np.hypot(column - [0, pinhole.width], row - [0, pinhole.height]).max()
    assert error > 10 * LARGEST_OF_BLENDERS_MATRIX, f"{error:.1e} px"


# A step that shares no factor with the lengths of the grid's axes, so that each of their values is in the sample.
SAMPLE = GRID[::17]


def test_the_sample_holds_every_value_of_the_grid():
    for axis, values in enumerate([SIZES, FITS, ASPECTS, SHIFTS, PERCENTAGES, BORDERS]):
        assert {combination[axis] for combination in SAMPLE} == set(values)


@pytest.mark.parametrize("combination", SAMPLE, ids=lambda combination: "-".join(map(str, combination)).replace(" ", ""))
def test_cycles_renders_the_camera_that_was_stated(camera_object, scene, render_positions, picture_error, combination):
    (width, height), *others = combination
    small = (width // 8, height // 8)  # keeps the odd sizes odd at 100 %: 125 × 97, 41 × 97
    pinhole = set_up(scene, camera_object, small, *others, np.random.default_rng(SAMPLE.index(combination)))
    positions = render_positions()
    assert positions.shape[:2] == (pinhole.height, pinhole.width)
    if combination[-1] == "border":  # zeros outside
        column, row, width, height = datablocks.frame_of(scene).border_window
        assert not positions[0, 0].any()
        assert not positions[-1, -1].any()
        pinhole, positions = pinhole.cropped(column, row, width, height), positions[row : row + height, column : column + width]
    error, tolerance = picture_error(pinhole, positions)
    assert error <= tolerance, f"{error:.1e} px, and {tolerance:.1e} are rounding"
