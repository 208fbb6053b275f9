"""A view matrix and a projection matrix, as OpenGL, Direct3D, Vulkan, glm, NumPy and three.js have them, in any punctuation.

**Order.** Rows or columns first is told by where the translation stands, (12, 13, 14) or (3, 7, 11), and in a projection by
where the ±1 stands that makes the depth. Where neither tells it, the matrix is refused.

**Meaning.** clip = projection · view · (x, y, z, 1); x/w and y/w from −1 to 1 across the picture, from left to right and from
bottom to top; w positive in front of the eye. So OpenGL's cameras, which look along −z, and Direct3D's, which look along z, are
one case, and the rows of the depth's range do not matter. A projection whose y points down is Vulkan's and is taken as such.

`write` gives the two matrices in row order as NumPy has them, and the same as GLSL.

Sources: the OpenGL 4.6 specification, 13.8 (coordinate transformations); glm's ext/matrix_clip_space.inl; Direct3D's
XMMatrixPerspectiveFovLH. Rejected: a view matrix without saying so, since OpenCV's looks alike and is another camera.
"""

import re
from collections.abc import Sequence

import numpy as np

from ..errors import InputError
from ..pinhole import Pinhole
from . import axes, own, texts
from .camera import Camera, Options
from .source import Source

TITLE = "view and projection matrices (OpenGL, Direct3D, glm)"
SUFFIX = ".txt"
SEVERAL = "a text"

_ROLES = {
    **dict.fromkeys(
        ("view", "viewmatrix", "viewmat", "modelview", "modelviewmatrix", "worldtoview", "matrixworldinverse"), "view"
    ),
    **dict.fromkeys(
        ("projection", "projectionmatrix", "proj", "projmatrix", "projmat", "persp", "perspectivematrix"), "projection"
    ),
    **dict.fromkeys(
        ("viewprojection", "viewprojectionmatrix", "viewproj", "viewprojmatrix", "mvp", "modelviewprojection"), "both"
    ),
}
_NAMES = re.compile(
    r"\b(model[_ ]?view(?:[_ ]?proj(?:ection)?)?|view[_ ]?proj(?:ection)?|world_?to_?view|matrixWorldInverse"
    r"|view|proj(?:ection)?|mvp|persp(?:ective)?)"
    r"([_ ]?mat(?:rix)?)?\b(?:\s*\[\s*\d{1,2}\s*\])*\]?['\"]?\s*(?:\([^()\n]{0,40}\)\s*)?(?:(?::?=|:)\s*)?"
    r"(?=[^\w\s;.=:]|[-+.\d]|new\b|np\.|glm|mat|array|float|Matrix|XM|\[)",
    re.IGNORECASE,
)
_BEFORE = re.compile(r"(?:\s+|new\b|[A-Za-z_][\w.:]*\s*(?=\(|\{)|=|[\[({<]){0,20}")
_ROW = re.compile(r"[\s,()\[\]{}]*(?:glm::)?(?:d?vec4|float4|array|np\.array)\s*(?=[\[({])")
_SIZE = re.compile(
    r"\b(?:size|viewport|resolution)\b['\"]?\s*[=:]\s*(?:[\[({]\s*)?(\d{1,9})(?:\s*[x×,]\s*|\s+)(\d{1,9})", re.IGNORECASE
)
_NUMBER = re.compile(r"[\s,;|()\[\]{}<>]*([-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?)[fFd]?(?![\w.])")
_COMPUTED = re.compile(r"inv|linalg|dot|mul", re.IGNORECASE)
_KEPT = r"(?:T\b|transpos|astype|float|double|numpy|to\b|cuda|cpu|reshape|copy|clone|contiguous|view\b)"
_OPERATION = re.compile(
    r"(?<!\s)(?:\s{0,99}[)\]}>,])+[ \t]*(?:\.(?:T\b|transpos)[()\w]{0,20}[ \t]*)?"
    rf"(?:\*(?!\*)|/(?![/*])|@|(?<=\S)\[|\.(?!{_KEPT})[A-Za-z_])"
)
_MOST = 100
_ROUNDED = 1e-4  # a zero's rest after rounding to digits, relative to the largest number


def recognizes(source: Source) -> bool:
    return not source.is_binary and bool(_matrices_in(source.text))


def _matrices_in(text: str) -> list[tuple[str, list[float], int]]:
    """Each matrix: view, projection or both; sixteen numbers, none where it is computed of them; its place."""
    result = []
    for name in _NAMES.finditer(text[: 2**20]):
        role = _ROLES.get(texts.plain((name[1] + (name[2] or "")).replace(" ", "")))
        before = _BEFORE.match(text, name.end())
        sixteen = before and _sixteen(text, before.end())
        if role and before and sixteen:
            numbers, end = sixteen
            is_computed = bool(_COMPUTED.search(before[0]) or _OPERATION.match(text, end))
            result.append((role, [] if is_computed else numbers, name.start()))
            if len(result) > _MOST:
                break
    return result


def _sixteen(text: str, at: int) -> tuple[list[float], int] | None:
    """The sixteen numbers at a place, and where they end."""
    numbers: list[float] = []
    rows = 0
    while len(numbers) < 16:
        match = _NUMBER.match(text, at)
        if not match:
            rows += 1
            skipped = _ROW.match(text, at) if rows <= 4 else None
            if not skipped:
                return None
            at = skipped.end()
            continue
        numbers.append(float(match[1]))
        at = match.end()
    return None if _NUMBER.match(text, at) and re.match(r"[ \t,]*[-+.\d]", text[at : at + 40]) else (numbers, at)


def read(source: Source, options: Options) -> list[Camera]:
    text = source.text
    texts_found = _matrices_in(text)
    if len(texts_found) > _MOST:
        raise InputError(f"there are more than {_MOST} matrices: copy one camera's view and projection")
    result: dict[str, np.ndarray] = {}
    like_rows: bool | None = None  # where a view does not tell the order, it is the projection's
    for role, numbers, at in sorted(texts_found, key=lambda matrix: matrix[0] == "view"):
        if not numbers:
            texts.fail(text, at, f"this {role} matrix is computed, write the numbers that it has then")
        as_written = np.array(numbers).reshape(4, 4)
        matrix = _in_rows(role, as_written, text, at, like_rows)
        if role == "projection":
            like_rows = np.array_equal(matrix, as_written)
        if role in result and not np.array_equal(result[role], matrix):
            texts.fail(text, at, f"there is another {role} matrix before, copy one camera")
        result[role] = matrix
    size = _SIZE.search(text)
    whole = result.get("both")
    if whole is None and "projection" in result and "view" in result:
        whole = result["projection"] @ result["view"]
    if whole is None and "projection" in result:
        raise InputError("there is a projection matrix and no view matrix: copy both")
    if whole is None:
        return [_posed(result["view"], options)]
    shape = (
        abs(result["projection"][1, 1] / result["projection"][0, 0])
        if "projection" in result and result["projection"][0, 0]
        else None
    )
    film = texts.film(options, "the projection", (int(size[1]), int(size[2])) if size else None, shape)
    notes = film.notes
    exact = film.width if film.is_stated or not shape else film.height * shape / film.pixel_aspect
    rows = whole[[0, 1, 3]]
    if "projection" in result and result["projection"][1, 1] < 0:
        rows[1] = -rows[1]
        notes = (*notes, "The projection's y points down, as Vulkan's: taken as such")
    to_pixels = np.array([[exact / 2, 0, film.width / 2], [0, -film.height / 2, film.height / 2], [0, 0, 1]]) @ rows
    pinhole, more = _projected(to_pixels, (film.width, film.height))
    camera = Camera("Camera", pinhole, film.is_stated, (*notes, *more))
    return [texts.mirroring(camera, "The text's camera")]


def _projected(to_pixels: np.ndarray, size: tuple[int, int]) -> tuple[Pinhole, tuple[str, ...]]:
    turn = to_pixels[:, :3]
    if abs(np.linalg.det(turn)) < 1e-30:
        raise InputError("the matrices are flat: copy the camera's view and projection")
    return texts.projected(turn, tuple(np.linalg.solve(turn, -to_pixels[:, 3]).tolist()), size, "the matrices")


def _posed(view: np.ndarray, options: Options) -> Camera:
    """A view matrix alone: OpenGL's, whose camera looks along −z."""
    plane = options.plane_or_refuse("the view matrix")
    if abs(np.linalg.det(view)) < 1e-30:
        raise InputError("the view matrix is flat: copy the camera's view and projection")
    pinhole, notes = axes.pinhole(np.linalg.inv(view), plane, "the view matrix")
    return Camera("Camera", pinhole, False, ("A view matrix alone is taken as OpenGL's, whose camera looks along −z", *notes))


def _in_rows(role: str, matrix: np.ndarray, text: str, at: int, like_rows: bool | None) -> np.ndarray:
    """The matrix in row order, for column vectors."""
    zero = _ROUNDED * max(1.0, np.abs(matrix[:3, :3]).max())
    last_row, last_column = np.abs(matrix[3, :3]).max() > zero, np.abs(matrix[:3, 3]).max() > zero
    if role == "view":
        if abs(matrix[3, 3] - 1) > _ROUNDED or (last_row and last_column):
            texts.fail(text, at, "a view matrix has 0 0 0 1 as its last row or column")
        if last_row == last_column:
            if np.array_equal(matrix, matrix.T) or like_rows:
                return matrix
            if like_rows is False:
                return matrix.T.copy()
            texts.fail(
                text, at, "whether its rows or its columns come first can't be told without a translation, move the camera"
            )
        return matrix.T.copy() if last_row else matrix
    if role == "both":
        # The depth's row, of unit length in a rigid view, tells; the other one is mixed.
        by_rows, by_columns = (abs(np.linalg.norm(m[3, :3]) - 1) < 1e-3 and _is_camera(m) for m in (matrix, matrix.T))
        if by_rows == by_columns:
            texts.fail(text, at, "whether its rows or its columns come first can't be told, copy view and projection")
        return matrix if by_rows else matrix.T.copy()
    if abs(matrix[3, 3]) > zero:
        texts.fail(text, at, "this projection is orthographic and no pinhole's")
    by_rows, by_columns = abs(abs(matrix[3, 2]) - 1) < 1e-3, abs(abs(matrix[2, 3]) - 1) < 1e-3
    shapes = [
        np.abs(m[3, :2]).max() < zero and np.abs(m[[0, 1], 3]).max() < zero and np.abs(m[2, :2]).max() < zero
        for m in (matrix, matrix.T)
    ]
    by_rows, by_columns = by_rows and shapes[0], by_columns and shapes[1]
    if by_rows and by_columns:  # the near plane is near ½ or 1: the one that is exact is the ±1
        by_rows, by_columns = abs(matrix[3, 2]) == 1, abs(matrix[2, 3]) == 1
    if by_rows and by_columns:
        texts.fail(text, at, "whether its rows or its columns come first can't be told of this near plane, use another")
    if not (by_rows or by_columns):
        texts.fail(text, at, "a projection matrix has 0 0 ±1 0 as its last row or column")
    return matrix if by_rows else matrix.T.copy()


def _is_camera(matrix: np.ndarray) -> bool:
    try:
        texts.projected(matrix[[0, 1, 3], :3], (0.0, 0.0, 0.0), (1, 1), "the matrices")
    except InputError:
        return False
    return True


_NEAR, _FAR = 0.1, 1000.0


def write(cameras: Sequence[Camera], options: Options) -> str:
    """NumPy's and GLSL's two matrices of each camera, near 0.1 and far 1000."""
    return "\n".join(map(_written, cameras))


def projection(camera: Camera) -> np.ndarray:
    """(4, 4), OpenGL's, in rows: from x right, y up, z back to the clip space of its picture."""
    pinhole = camera.pinhole
    (d_x, d_y), (c_x, c_y), (width, height) = pinhole.distance, pinhole.principal_point, (pinhole.width, pinhole.height)
    return np.array(
        [
            [2 * d_x / width, 0, 1 - 2 * c_x / width, 0],
            [0, 2 * d_y / height, 1 - 2 * c_y / height, 0],
            [0, 0, -(_FAR + _NEAR) / (_FAR - _NEAR), -2 * _FAR * _NEAR / (_FAR - _NEAR)],
            [0, 0, -1, 0],
        ]
    )


def view(camera: Camera) -> np.ndarray:
    """(4, 4), OpenGL's, in rows: from world space to x right, y up, z back."""
    return np.diag([1.0, -1, -1, 1]) @ np.array(axes.world_to_camera(camera.pinhole)) + 0.0


def _written(camera: Camera) -> str:
    matrices = {"view": view(camera), "projection": projection(camera)}
    width, height = camera.pinhole.width, camera.pinhole.height
    lines = [*own.beginning(camera, "#"), f"# OpenGL, column vectors; near {_NEAR:g}, far {_FAR:g}"]
    lines += [f"size = {width}, {height}"]
    for name, matrix in matrices.items():
        rows = ",\n    ".join(f"[{texts.listed(row, ', ')}]" for row in matrix.tolist())
        lines.append(f"{name} = np.array([\n    {rows},\n])")
    for name, matrix in matrices.items():  # GLSL goes column by column
        columns = ", ".join(repr(number + 0.0) for number in matrix.T.ravel().tolist())
        lines.append(f"# GLSL: const mat4 {name}_matrix_of_camera = mat4({columns});")
    return "\n".join([*lines, ""])
