"""K, R, t and 4 × 4 matrices in code: written here as each language writes them, they are the same camera."""

import numpy as np
import pytest

from viewcam_addon import cameras
from viewcam_addon.cameras import Options
from viewcam_addon.errors import InputError

from .test_read_only_formats import Known, the_same

known = Known("shifted")
K = np.array([[known.f_x, 0, known.c_x], [0, known.f_y, known.c_y], [0, 0, 1]])
R = np.array([known.u, -known.v, -known.w])
T = -R @ known.e
W2C = np.vstack([np.column_stack([R, T]), [0, 0, 0, 1]])
C2W = np.vstack([np.column_stack([R.T, known.e]), [0, 0, 0, 1]])
OPENGL = C2W @ np.diag([1, -1, -1, 1])
CORNER = Options(size=(known.width, known.height), pixel="corner")


def row(numbers, between=", "):
    return between.join(repr(float(number)) for number in np.ravel(numbers))


def rows(matrix, between=" ", after="; "):
    return after.join(row(each, between) for each in matrix)


def fixed(array):
    return np.array2string(array, separator=" ", floatmode="unique")


F, C_X, C_Y = repr(known.f_x), repr(known.c_x), repr(known.c_y)
CODES = {
    "numpy": f"K = np.array({K.tolist()})\nR = np.array({R.tolist()}, dtype=np.float64)\nt = np.array({T.tolist()})",
    "repr": f"K = {K!r}\nR = {R.tolist()!r}\nt = {T.tolist()!r}",
    "printed": f"K:\n{fixed(K)}\nR:\n{fixed(R)}\nt: {fixed(T)}",
    "torch": f"K = torch.tensor({K.tolist()}, dtype=torch.float64, device='cuda')\n"
    f"extrinsics = torch.tensor({W2C.tolist()}).cuda()",
    "names": f"f = {F}\ncx, cy = {C_X}, {C_Y}\n"
    f"K = np.array([[f, 0, cx], [0, {known.f_y!r}, cy], [0, 0, 1]])\nw2c = {W2C.tolist()}",
    "transposed": f"K = np.array({K.T.tolist()}).T\nR = np.array({R.T.tolist()}).transpose()\nt = {T[:, None].tolist()}",
    "repr_of_numpy_2": f"K = {K.tolist()}\nR = {R.tolist()}\nt = [{', '.join(f'np.float64({float(x)!r})' for x in T)}]",
    "reshaped": f"K = np.array([{row(K)}]).reshape(3, 3)\nR = np.array([{row(R)}]).reshape((3, 3))\nt = [{row(T)}]",
    "matlab": f"K = [{rows(K)}];  % intrinsics\nR = [{rows(R.T)}]'; t = [{row(T, '; ')}];",
    "matlab_lines": f"K = [{rows(K, '  ', chr(10))}];\nR = [{rows(R, ', ')}];\nt = [{row(T, ' ')}]';",
    "julia": f"K = [{rows(K)}]\nR = [{rows(R)}]\nt = [{row(T)}]",
    "opencv": f"cv::Mat K = (cv::Mat_<double>(3, 3) << {row(K)}); // pixels\ncv::Mat R = (cv::Mat_<double>(3,3) << {row(R)});\n"
    f"cv::Mat tvec = (cv::Mat_<double>(3,1) << {row(T)});",
    "opencv_small": f"cv::Matx33d K({row(K)});\ncv::Matx33d R({row(R)});\ncv::Vec3d t({row(T)});",
    "eigen": f"Eigen::Matrix3d K, R;\nK << {row(K)};\nR << {row(R[0])},\n     {row(R[1])},\n     {row(R[2])};\n"
    f"Eigen::Vector3d t({row(T)});",
    "c": f"double K[3][3] = {{{{{row(K[0])}}}, {{{row(K[1])}}}, {{{row(K[2])}}}}};\nconst double R[9] = {{{row(R)}}}; // rows\n"
    f"double t[] = {{{row(T)}}};",
    "r": f"K <- matrix(c({row(K.T)}), nrow = 3)\nR <- matrix(c({row(R)}), nrow = 3, byrow = TRUE)\nt <- c({row(T)})",
    "dictionary": f"camera = {{'K': np.array({K.tolist()}), 'R': np.array({R.tolist()}), 't': np.array({T.tolist()})}}",
    "rows_by_columns": f"K = {K.tolist()}\nextrinsic = {W2C.T.tolist()}",
}


@pytest.mark.parametrize("name", CODES)
def test_a_camera_in_the_code_of_any_language_is_that_camera(name):
    assert cameras.recognized(CODES[name]) == "arrays"
    the_same(cameras.read(CODES[name], options=CORNER), known)


WAYS = {"w2c_opencv": W2C, "c2w_opencv": C2W, "c2w_opengl": OPENGL, "w2c_opengl": np.linalg.inv(OPENGL)}


@pytest.mark.parametrize("name", ["pose", "T", "c2w", "transform_matrix"])
@pytest.mark.parametrize("way", WAYS)
def test_a_matrix_goes_the_way_that_is_chosen_and_is_refused_without(name, way):
    text = f"K = np.array({K.tolist()})\n{name} = np.array({WAYS[way].tolist()})"
    options = Options(size=CORNER.size, pixel="corner", pose=way)
    the_same(cameras.read(text, options=options), known)
    with pytest.raises(InputError, match="which way it goes is not said: give --pose, one of w2c_opencv, c2w_opencv"):
        cameras.read(text, options=CORNER)


def test_a_matrix_alone_leaves_the_lens_as_it_is():
    text = f"bpy.context.object.matrix_world = Matrix({OPENGL.tolist()})"
    (read,) = cameras.read(text, options=Options(view_plane=known.pinhole.plane))
    assert not read.size_stated
    the_same([read], known)


def blenders(matrix):
    """A matrix as Blender's console shows it."""
    return "<Matrix 4x4 " + "\n            ".join(f"({row(each)})" for each in matrix) + ">"


ALONE = {
    "numpy": lambda m: repr(np.array(m)),
    "printed": fixed,
    "list": lambda m: repr(m.tolist()),
    "three_rows": lambda m: repr(m[:3].tolist()),
    "arrays": lambda m: repr([*m]),
    "torch": lambda m: f"tensor({m.tolist()}, device='cuda:0', dtype=torch.float64)",
    "matlab": lambda m: f"[{rows(m)}]",
    "lines": lambda m: rows(m, ", ", chr(10)),
    "julia": lambda m: f"4×4 Matrix{{Float64}}:\n{rows(m, '  ', chr(10))}",
    "mathutils": lambda m: f"Matrix(({', '.join(f'({row(each)})' for each in m)}))",
    "blender": blenders,
    "columns": lambda m: row(m.T),
}


@pytest.mark.parametrize("name", ALONE)
def test_a_matrix_without_a_name_is_a_pose_once_its_way_is_said(name):
    with np.printoptions(floatmode="unique"):
        text = ALONE[name](OPENGL)
    assert cameras.recognized(text) == "arrays"
    with pytest.raises(InputError, match="which way it goes is not said"):
        cameras.read(text, options=Options(view_plane=known.pinhole.plane))
    the_same(cameras.read(text, options=Options(view_plane=known.pinhole.plane, pose="c2w_opengl")), known)


@pytest.mark.parametrize(
    "text",
    [
        rows(OPENGL * 2),  # no row 0 0 0 1
        row(np.arange(12)),  # no rotation
        rows(OPENGL) + "; 1 2 3 4",
        rows(OPENGL) + " meters",
    ],
)
def test_other_numbers_alone_are_no_pose(text):
    with pytest.raises(InputError, match="no camera that is understood"):
        cameras.recognized(text)


@pytest.mark.parametrize("factor", [1.0, 1000.0])
def test_variables_as_matlab_shows_them_are_read_with_the_factor_that_it_takes_out(factor):
    def display(name, matrix, factor=1.0):
        by = f"   {factor:.1e} *\n\n" if factor != 1 else ""
        return f"{name} =\n\n{by}" + "".join(f"   {row(each, '   ')}\n" for each in matrix / factor) + "\n\n"

    text = display("K", K, factor) + display("R", R) + display("t", T[:, None])
    (read,) = cameras.read(text, options=CORNER)
    np.testing.assert_allclose(read.pinhole.distance, known.pinhole.distance, rtol=1e-15)
    np.testing.assert_allclose(read.pinhole.eye, known.pinhole.eye, rtol=1e-12)


def test_a_row_that_goes_on_after_three_points_is_one_row():
    k = f"K = [{row(K[0], ' ')}; ...\n {row(K[1], ' ')}; ... % of pixels\n {row(K[2], ' ')}];"
    the_same(cameras.read(f"{k}\nR = [{rows(R)}];\nt = [{row(T)}];", options=CORNER), known)


def test_k_alone_leaves_the_camera_where_it_stands():
    """Also where the text's world is another: what it does not say is no part of it."""
    base = known.pinhole
    for axes, scale in (("as_is", 1.0), ("y_up", 0.5)):
        options = Options(size=CORNER.size, base=base, axes=axes, scale=scale)
        (read,) = cameras.read("K = [900 0 330; 0 900 170; 0 0 1];", options=options)
        assert (read.pinhole.eye, read.pinhole.look_at, read.pinhole.up) == (base.eye, base.look_at, base.up)
        assert read.pinhole.distance == (900.0, 900.0) and "where the camera stands" in " ".join(read.notes)
    (read,) = cameras.read("K = [900 0 330; 0 900 170; 0 0 1];", options=CORNER)
    assert read.pinhole.eye == (0, 0, 0)


@pytest.mark.parametrize(
    "pose",
    [
        "R = np.eye(3)\nt = np.zeros(3)",
        "R = eye(3); t = zeros(3, 1);",
        "cv::Mat R = cv::Mat::eye(3, 3, CV_64F);\ncv::Mat t = cv::Mat::zeros(3, 1, CV_64F);",
        "R = torch.eye(3).cuda()\nt = torch.zeros((3, 1))",
    ],
)
def test_an_identity_and_zeros_are_numbers_too(pose):
    (read,) = cameras.read(f"K = [{rows(K)}];\n{pose}\n", options=CORNER)
    assert read.pinhole.eye == (0, 0, 0) and read.pinhole.axes()[1] == (0, -1, 0)


def test_the_size_is_the_texts_own():
    (read,) = cameras.read(f"K = np.array({K.tolist()})\nh, w = 480, 640\n")
    assert read.size_stated and (read.pinhole.width, read.pinhole.height) == (640, 480)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (f"K = np.array({K.tolist()})\nR = np.linalg.inv(np.array({R.tolist()}))\nt = {T.tolist()}", "R is computed"),
        (f"K = np.array({K.tolist()}) * 2", "K is computed"),
        (f"K = np.array({K.tolist()})[:2]", "K is computed"),
        (f"K = np.array([[600, 0, 1281 // 2], [0, 600, 360], [0, 0, 1]])\nR = {R.tolist()}", "K is computed"),
        (f"K = np.array([[fx, 0, 640], [0, fx, 360], [0, 0, 1]])\nR = {R.tolist()}", "K is computed"),
        (f"K = np.array({K.tolist()})\nK = np.array({(2 * K).tolist()})", "K is something else before"),
        (f"K = np.array({K.tolist()})\nR = np.array({R.tolist()})", "only a part of its pose"),
        (f"K = {K.tolist()}\nextrinsic = {(W2C * 2).tolist()}", "last row 0 0 0 1"),
    ],
)
def test_what_is_computed_or_contradicts_itself_is_refused(text, problem):
    with pytest.raises(InputError, match=problem):
        cameras.read(text, options=CORNER)


def test_1_minus_2_in_a_row_without_commas_are_two_numbers_and_with_commas_a_difference():
    text = f"K = [{rows(K)}]; R = [0 -1 0; 1 0 0; 0 0 1]; t = [2 -3, 4, 5];"
    with pytest.raises(InputError, match="t"):  # three numbers, or four
        cameras.read(f"K = [{rows(K)}]; R = [0 -1 0; 1 0 0; 0 0 1]; t = [2 -3 4 5];", options=CORNER)
    (read,) = cameras.read(text, options=CORNER)
    np.testing.assert_allclose(read.pinhole.eye, -np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]).T @ [-1, 4, 5])
