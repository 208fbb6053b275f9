"""Cameras that look at a point, as programs write them down: calls and assignments in whatever language.

    gluPerspective(40, 16./9, .1, 100); gluLookAt(7,-6,4, 0,0,1, 0,0,1);                   OpenGL, glm, gl-matrix, Direct3D
    camera = new THREE.PerspectiveCamera(40, 16/9); camera.position.set(7,-6,4); camera.lookAt(0,0,1)       three.js
    camera.SetPosition(7,-6,4); camera.SetFocalPoint(0,0,1); camera.SetViewUp(0,0,1); camera.SetViewAngle(40)      VTK, ParaView
    p.computeViewMatrix([7,-6,4], [0,0,1], [0,0,1]); p.computeProjectionMatrixFOV(40, 16/9, .1, 100)            PyBullet
    look_at_view_transform(dist=9, elev=20, azim=130); FoVPerspectiveCameras(fov=40)                             PyTorch3D
    f3d --camera-position=7,-6,4 --camera-focal-point=0,0,1 --camera-view-up=0,0,1 --camera-view-angle=40                f3d
    openscad --camera=7,-6,4,0,0,1 --imgsize=640,480                                                                OpenSCAD
    plotter.camera_position = [(7,-6,4), (0,0,1), (0,0,1)]                                                          PyVista
    point3 lookfrom(7,-6,4); point3 lookat(0,0,1); vec3 vup(0,0,1); auto vfov = 40;                 Ray Tracing in One Weekend
    pinhole->set_eye(7,-6,4); pinhole->set_lookat(0,0,1); pinhole->set_view_distance(960); vp.set_hres(640);    textbooks

The statements that say a camera are looked for among the text's words (tokens.py), wherever they stand; names are followed to
plain values (expressions.py), and nothing is run. What is set twice to different values, moved by other means (rotate, dolly,
quaternions) or computed from what the text does not say is refused.

**Angles.** Whose unit a program's documentation says is taken so: degrees of the height in gluPerspective, three.js and
VTK; radians in glm, gl-matrix, Direct3D and Cesium (there of the longer side). Others: texts.angle_of, as of vfov.

**three.js.** setViewOffset is a part of the full picture: its pixels, and its principal point, which lies outside for most.
Potree's view is three.js' camera whose up is z.

**Textbooks.** The view plane's pixels have the size s and the zoom z magnifies: d · z / s in pixels. roll_angle has no agreed
sense and is refused unless it is 0.

Sources: the OpenGL reference pages of gluLookAt and gluPerspective; glm's ext/matrix_clip_space.inl; three.js'
PerspectiveCamera (setViewOffset, updateProjectionMatrix) and Object3D.lookAt; Potree's viewer/View.js; VTK's vtkCamera.h and
vtkCamera.cxx (WindowCenter, defaults); Shirley's books; Suffern's Ray Tracing from the Ground Up, chapters 8 to 10; PyBullet's
quickstart guide; PyTorch3D's renderer/cameras.py (degrees of the picture's shorter side, a point of view on a sphere about `at`
whose pole is y). Rejected: running the code.
"""

import bisect
import functools
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .. import rotation
from ..errors import InputError
from ..pinhole import ViewPlane
from . import axes, own, texts, tokens
from .camera import Camera, Options, not_a_pinhole
from .expressions import JOINTS, Degrees, Expressions, Radians, Unknown, numbers
from .source import Source

TITLE = "code that places a camera (gluLookAt, three.js, VTK, lookfrom …)"
SUFFIX = ".txt"
SEVERAL = "a text"

_COMMENT = r"//[^\n]*|/\*.*?(?:\*/|\Z)|#(?!\s*define)[^\n]*"
_OPTION = re.compile(
    r"--(camera(?:-position|-focal-point|-view-up|-view-angle)?|imgsize|projection)[= ]([-+\d.eE,]+|o|ortho)(?!\S)"
)
_WINDOW = re.compile(r"renderer|ren\w{0,3}win|renderwindow")
_MOST_CHARACTERS = 2**23
_LIBRARIES = {"np", "numpy", "jnp", "torch", "Mat"}
_MOST_STATEMENTS = 2_000
_MOST_WORDS = 400  # between brackets that turn a view
_IS_CODE = re.compile(r"\w\s*\(\s*[-\w.]|;\s*$|\w\.\w+\s*[=(]", re.MULTILINE)
_CAMERA = re.compile(r"cam|view|eye|lens|observer", re.IGNORECASE)
_NAMED_CAMERA = re.compile(r"cam", re.IGNORECASE)

_EYE = "eye eyepos eyeposition eyepoint eyelocation lookfrom lookfrompoint campos camerapos camposition "
_EYE += "cameraposition cameralocation camerafrom cameraorigin cameraeye cameracenter cameraeyeposition"
_TARGET = "lookat lookatpoint lookatpos lookto focalpoint camerafocalpoint cameratarget camtarget cameralookat cameraat "
_TARGET += "cameratargetposition"
_UP = "up vup upvector viewup cameraviewup cameraup camup camerauup defaultup cameraupvector"
_SPECIFIC = {
    **dict.fromkeys(_EYE.split(), "eye"),
    **dict.fromkeys(_TARGET.split(), "target"),
    **dict.fromkeys(_UP.split(), "up"),
    **dict.fromkeys(["cameradirection", "cameradir", "camerafront", "camdir", "viewdir", "viewdirection"], "direction"),
    **dict.fromkeys(["vfov", "fovy", "fovydegrees", "verticalfov", "verticalfieldofview", "yfov"], "fov_y"),
    **dict.fromkeys(["hfov", "fovx", "horizontalfov", "horizontalfieldofview", "xfov"], "fov_x"),
    **dict.fromkeys(["viewangle", "cameraviewangle"], "view_angle"),
    **dict.fromkeys(["fov", "fieldofview", "camerafov"], "fov"),
    **dict.fromkeys(["aspectratio", "aspect", "cameraaspect"], "aspect"),
    **dict.fromkeys(["imagewidth", "imgwidth", "screenwidth", "windowwidth", "hres"], "width"),
    **dict.fromkeys(["imageheight", "imgheight", "screenheight", "windowheight", "vres"], "height"),
    **dict.fromkeys(["windowsize", "viewsize", "imagesize"], "size"),
    "viewdistance": "view_distance",
    "pixelsize": "pixel_size",
    "zoom": "zoom",
    "rollangle": "roll",
    "windowcenter": "window_center",
    "usehorizontalviewangle": "use_horizontal",
    **dict.fromkeys(["parallelprojection", "cameraparallelprojection"], "parallel"),
    **dict.fromkeys(["aperture", "lensradius", "defocusangle", "aperturesize"], "blur"),
}
# Names that say something of a camera only where the object is one.
_GENERIC = {
    **dict.fromkeys(["position", "location", "origin", "pos", "from"], "eye"),
    **dict.fromkeys(["center", "centre", "target", "at", "to"], "target"),
    **dict.fromkeys(["direction", "forward", "front", "dir"], "direction"),
    "size": "size",
    "width": "width",
    "height": "height",
}
_LOOK_AT = {
    "lookat", "glulookat", "lookatrh", "lookatlh", "setlookat", "makelookat", "createlookat", "createlookatlh",
    "matrixlookatlh", "matrix4lookat", "xmmatrixlookatrh", "xmmatrixlookatlh", "d3dxmatrixlookatlh", "d3dxmatrixlookatrh",
    "targetto", "computeviewmatrix",
}  # fmt: skip
_PERSPECTIVE = {
    "gluperspective", "perspective", "perspectivecamera", "perspectiverh", "perspectivelh", "makeperspective",
    "perspectiveprojection", "createperspectiveprojectionmatrix", "computeprojectionmatrixfov",
}  # fmt: skip
_PERSPECTIVE |= {
    f"{name}{hand}"
    for name in ("xmmatrixperspectivefov", "d3dxmatrixperspectivefov", "createperspectivefieldofview", "perspectivefov")
    for hand in ("lh", "rh", "")
}
_FRUSTUM = {"glfrustum", "frustum", "makefrustum", "computeprojectionmatrix"}
_PYBULLET = {"computeviewmatrixfromyawpitchroll", "getcameraimage"}
_PYTORCH3D = {"lookatviewtransform", "fovperspectivecameras", "openglperspectivecameras", "perspectivecameras"}
_ORTHOGRAPHIC = {
    "glortho", "ortho", "orthographiccamera", "gluortho2d", "xmmatrixorthographiclh", "enableparallelprojection",
    "parallelprojectionon", "fovorthographiccameras", "orthographiccameras",
}  # fmt: skip
_ROLES_OF_POSES = {
    "eye", "target", "look_at", "set_view", "camera_position", "direction", "position_x", "position_y", "position_z",
    "lookatviewtransform", "computeviewmatrixfromyawpitchroll",
}  # fmt: skip
_PYTORCH3D_LOOK = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0))  # eye, at and up where they are not given
_MOVES = {
    "rotatex", "rotatey", "rotatez", "rotateonaxis", "translatex", "translatey", "translatez", "azimuth", "elevation",
    "dolly", "roll", "yaw", "pitch", "setroll", "orthogonalizeviewup", "applymatrix4", "setfocallength",
    "filmoffset", "quaternion", "rotation", "flyto", "setview", "usehorizontalviewangleon"
}  # fmt: skip
_TURNED = {"rotation", "quaternion", "matrix", "matrixworld", "rotate"}
_TURNED |= {"rotationeuler", "rotationquaternion", "rotationaxisangle"}  # Blender's
# Where they are made they turn the camera to their target, whatever it looked at before.
_CONTROLS = {"OrbitControls", "TrackballControls", "MapControls", "ArcballControls"}
_OTHER_CONTROLS = {"FirstPersonControls", "DeviceOrientationControls"}
_PLACES = {"position", "up", "direction"}
# Functions that turn or move a view that a look-at made: glm::rotate(view, …), mat4.rotateY(view, view, …).
_VIEW_MOVED = re.compile(r"(?:rotate|translate|scale)\w{0,3}", re.IGNORECASE)
_MOVED_BEHIND = re.compile(r"\s*[*@]\s*(?:\w{1,40}(?:::|\.)){0,3}(?:rotate|translate|scale)\w{0,3}\s*\(", re.IGNORECASE)
_GL_MOVES = {"gltranslatef", "gltranslated", "glrotatef", "glrotated", "glscalef", "glscaled", "glmultmatrixf", "glmultmatrixd"}
_CHANGES_BY = {*"+-*/"}
_COORDINATES = {*"xyzXYZ"}
_CHANGES = {"glloadidentity", "glpushmatrix", "resetcamera", "add", *_GL_MOVES}
_VECTORS = ("eye", "target", "up", "direction")
# Operations on what stands before them that no value is computed by.
_GOES_ON = re.compile(r"(?<![ \t])[ \t]*(?:[@%?\[]|\*\*|if\b|\.[ \t]*[A-Za-z_])")
_OF_VTK = re.compile(
    r"SetViewUp|SetFocalPoint|CameraFocalPoint|\bcamera_position\s*=|\bcpos\s*=|\bfocal_point\s*=", re.IGNORECASE
)
_OF_THREE = re.compile(r"\b(?:THREE|PerspectiveCamera)\b|\.position\.set\s*\(")
_OF_POTREE = re.compile(r"\bPotree\b|\bscene\.view\.(?:position|lookAt|setView)\b")
_LENSES = {"ThinLens", "FishEye", "Fisheye", "Spherical", "Stereo", "StereoCamera", "Orthographic"}


@dataclass
class _Scene:
    """The statements of a text: role → (value, place), and the events whose order counts."""

    values: dict[str, tuple[object, int]] = field(default_factory=dict)
    mirrored: bool = False
    aimed: list[tuple[int, tuple]] = field(default_factory=list)  # camera.lookAt(point): it counts where the camera is then
    moved: list[int] = field(default_factory=list)  # the eye, or up, was set
    frustum: tuple[float, ...] | None = None
    orthographic: int | None = None
    three: bool = False
    is_z_up: bool = False  # where no up is said
    is_height_first: bool = False  # in sizes, as in PyTorch3D's
    controls: str | None = None  # three.js' controls, which turn the camera to their target


def recognizes(source: Source) -> bool:
    if source.is_binary or source.is_folder or source.document or source.xml is not None:
        return False
    text = source.text
    if len(text) > _MOST_CHARACTERS:
        return False
    if own.recognizes(source):
        try:
            own.pairs(text.replace("−", "-"))
        except InputError:
            if not _IS_CODE.search(text[:65536]):
                return False
        else:
            return False
    return _code(text).says_pose()


@functools.lru_cache(maxsize=1)
def _code(text: str) -> "_Code":
    """The text as code, of which what is recognized is then read."""
    return _Code(text)


def _assigned(option: re.Match) -> str:
    """An option of f3d's or OpenSCAD's command as assignments; itself where it is another program's."""
    name, value = option.groups()
    if name == "projection":
        return "\nparallel_projection = 1;\n"
    if name in ("camera", "imgsize"):
        try:
            values = [*map(float, value.split(","))]
        except ValueError:
            return option[0]
        if name == "imgsize" and len(values) == 2:
            return "\nimage_width = {:g};\nimage_height = {:g};\n".format(*values)
        return _of_openscad(values) if name == "camera" and len(values) in (6, 7) else option[0]
    return f"\n{name.replace('-', '_')} = ({value});\n"


def _of_openscad(values: Sequence[float]) -> str:
    """The camera of OpenSCAD's command as assignments: its eye and center; or its center, angles in degrees and distance.

    Its z is up, it turns about x, y and z in turn from a view from above, and it sees 22.5° upwards, its $vpf where nobody
    sets that (GLView.cc, Camera.cc).
    """
    eye, target, up = values[:3], values[3:6], (0.0, 0.0, 1.0)
    if len(values) == 7:
        turn = rotation.from_euler([math.radians(angle) for angle in target], "XYZ")
        target, eye, up = eye, (eye + values[6] * turn[:, 2]).tolist(), turn[:, 1].tolist()
    vectors = zip(("lookfrom", "lookat", "vup"), (eye, target, up), strict=True)
    return "".join(f"\n{name} = ({', '.join(map(repr, vector))});" for name, vector in vectors) + "\nvfov = 22.5;\n"


class _Code:
    """The statements of a text."""

    def __init__(self, text: str) -> None:
        self.text = texts.without(_COMMENT, _OPTION.sub(_assigned, text)).replace("−", "-")
        self._has_viewports = bool(re.search(r"\bSetViewport\s*\(", self.text))
        self._words, self._places = tokens.words(self.text)
        self._words += [""] * 8  # so that what stands before and behind a word can be asked for
        self._places += [len(self.text)] * 8
        self._lights = self._names_of_lights()
        self._cameras = self._names_of_cameras()
        self._stepped = self._names_stepped()
        self._following: set[str] = set()
        self._values: dict[str, object] = {}
        self._lookups = 0
        self._roles: dict[tuple[str, ...], str | None] = {}
        # Matches that may say something of a camera: the parts of a name, what follows it, where that ends, and where the
        # name stands.
        self.statements: list[tuple[list[str], str, int, int]] = []
        self.assigned: dict[str, list[int]] = {}
        self._changed: list[tuple[list[str], int]] = []  # by +=, and where
        self._coordinates: list[tuple[list[str], int]] = []  # eye[0] = …
        self._find_statements()
        self.reader = Expressions(self.text, self._name)

    def _find_statements(self) -> None:
        words, places = self._words, self._places
        known: dict[tuple[str, ...], bool] = {}
        at = 0
        while at < len(words):
            first = at
            of_what_is_called = words[first - 1] in JOINTS and places[first - 1] + len(words[first - 1]) == places[first]
            if not _is_name(words[first]) or of_what_is_called:
                at += 1
                continue
            parts, at = self._path(first)
            if self._is_set(at) and words[at] != "=":
                self._changed.append((parts, places[first]))
            elif words[at] == "[" and words[at + 1] in ("0", "1", "2") and words[at + 2] == "]" and self._is_set(at + 3):
                self._coordinates.append((parts, places[first]))
            sign, place = words[at], places[at]
            if parts[0] == "define" and words[first - 1] == "#" and place > places[first] + len(parts[0]):
                parts, after = self._path(at)
                if len(parts) == 1 and places[after] > place + len(parts[0]):
                    self.assigned.setdefault(parts[0], []).append(places[after])
            if sign not in ("=", "(", ":", "{"):
                continue
            at += 1
            if parts[-1] == "eye" and sign == "(" and ({*parts} & _LIBRARIES or (words[at].isdigit() and words[at + 1] == ")")):
                continue  # an identity matrix
            if (key := (sign, *parts)) not in known:
                known[key] = self._may_say(parts, sign)
            if known[key]:
                self.statements.append((parts, sign, place + 1, places[first]))
                if len(self.statements) > _MOST_STATEMENTS:  # refused in `said`
                    break
            if sign == "=" or (sign != ":" and len(parts) == 1):
                self.assigned.setdefault(parts[-1], []).append(place + (sign == "="))

    def _is_set(self, at: int) -> bool:
        """True if what stands before a word gets a value by it: =, += …"""
        return self._words[at] == "=" or (self._words[at] in _CHANGES_BY and self._words[at + 1] == "=")

    def _path(self, first: int) -> tuple[list[str], int]:
        """The parts of a name such as a.b()->c, of which the first is a word, and the word behind it."""
        words = self._words
        parts, at = [words[first]], first + 1
        while True:
            joint = at + 2 if words[at] == "(" and words[at + 1] == ")" else at
            if words[joint] not in JOINTS or not _is_name(words[joint + 1]):
                return parts, at
            parts.append(words[joint + 1])
            at = joint + 2

    def _names_of_lights(self) -> set[str]:
        words, names = self._words, set()
        for at in self._all("vtkLight"):
            if words[at + 1] == ">":  # vtkNew<vtkLight> a
                names.add(words[at + 2])
            elif words[at + 1] == "(" and words[(before := self._before(at))] == "=":
                names.add(words[before - 1])
        return names

    def _names_of_cameras(self) -> set[str]:
        words, names = self._words, set()
        for at in self._all("PerspectiveCamera"):
            if words[(before := self._before(at))] == "new" and words[before - 1] in ("=", ":"):
                names.add(words[before - 2])
        return names

    def _all(self, *kinds: str) -> Iterator[int]:
        """Each place of one of some words."""
        if any(kind in self.text for kind in kinds):
            yield from (at for at, word in enumerate(self._words) if word in kinds)

    def _before(self, at: int) -> int:
        """The word before a name and all of its namespaces."""
        at -= 1
        while self._words[at] in JOINTS and _is_name(self._words[at - 1]):
            at -= 2
        return at

    def _made_new(self, kinds: set[str]) -> int | None:
        """The first word that is made new and of one of these kinds."""
        return next((at for at in self._all(*kinds) if self._words[self._before(at)] == "new"), None)

    def _names_stepped(self) -> set[str]:
        """The names that are changed from what they were: a += 1, a++, --a."""
        words, places, names = self._words, self._places, set()
        for at, word in enumerate(words):
            if word in _CHANGES_BY and places[at + 1] == places[at] + 1:
                following = words[at + 1]
                if following == "=" or (following == word and word in "+-"):
                    names.add(words[at - 1] if _is_name(words[at - 1]) or following == "=" else words[at + 2])
        return names

    def _view_moved(self) -> int | None:
        """The place of the first of _VIEW_MOVED that moves a view."""
        words = self._words
        for at, word in enumerate(words):
            if _VIEW_MOVED.fullmatch(word) and words[at + 1] == "(" and _is_name(words[at + 2]):
                parts, after = self._path(at + 2)
                if words[after] == "," and parts[-1].lower().startswith(("view", "camera")):
                    return self._places[at]
        return None

    def _is_multiplied(self, opened: int, start: int) -> bool:
        """True if what a call makes is turned or moved where it stands, as in glm::lookAt(…) * glm::rotate(…)."""
        _, _, end = self.reader.arguments(opened)
        if _MOVED_BEHIND.match(self.text, end):
            return True
        words, before = self._words, bisect.bisect_left(self._places, start) - 1
        depth, opening = 0, before if words[before] == "(" else None
        if words[before] == "*":
            for at in range(before - 1, max(0, before - _MOST_WORDS), -1):
                depth += (words[at] == ")") - (words[at] == "(")
                if not depth:
                    opening = at
                    break
        return opening is not None and _VIEW_MOVED.fullmatch(words[opening - 1]) is not None

    def _may_say(self, parts: list[str], sign: str) -> bool:
        """True if a statement has a role, is one coordinate of what has one, or is a call that changes what others say."""
        if self._role(parts, sign):
            return True
        if len(parts) > 1 and parts[-1] in _COORDINATES and self._role(parts[:-1], sign) in _VECTORS:
            return True
        return sign == "(" and texts.plain(parts[-1]) in _CHANGES

    def says_pose(self) -> bool:
        return any(self._role(parts, sign) in _ROLES_OF_POSES for parts, sign, _, _ in self.statements)

    def _role(self, parts: list[str], sign: str) -> str | None:
        """The role of a statement in placing a camera; None if it has none."""
        key = (sign, *parts)
        if key not in self._roles:
            self._roles[key] = self._found_role(parts, sign)
        return self._roles[key]

    def _found_role(self, parts: list[str], sign: str) -> str | None:
        whole = ".".join(parts).lower()
        if parts[0] in self._lights or "light" in whole or "shadow" in whole:
            return None
        key = texts.plain(parts[-1])
        before = texts.plain(parts[-2]) if len(parts) > 1 else ""
        if (before, key, sign) == ("view", "setview", "(") and _OF_POTREE.search(self.text):
            return "set_view"
        if self._is_camera(parts[:-1]) and any(texts.plain(part) in _TURNED for part in parts[1:]):
            return "moves"
        if "scale" in parts[1:] and self._is_camera(parts[:-1]) and _OF_THREE.search(self.text):
            return "moves"  # which mirrors, or is seen where it is not one number
        if self._is_camera(parts[:-2]) and before in _PLACES and key not in ("set", "x", "y", "z") and sign == "(":
            return "moves"  # position.copy, .add, .applyAxisAngle
        if key == "set" and before:  # position.set(…)
            key, parts = before, parts[:-1]
            before = texts.plain(parts[-2]) if len(parts) > 1 else ""
        elif key in ("x", "y", "z") and before in ("position", "up") and sign == "=" and self._is_camera(parts[:-2]):
            return f"{before}_{key}"
        if sign == "(" and (key in _PYTORCH3D or key in _PYBULLET):
            return key
        if sign == "(" and key in _LOOK_AT and not (key == "setlookat" and before):
            return "look_at"
        if sign == "(" and key in ("setviewoffset", "clearviewoffset"):
            return key
        if sign == "(" and key in _PERSPECTIVE:
            return "perspective"
        if sign == "(" and key in _FRUSTUM:
            return "frustum"
        if sign == "(" and key in _ORTHOGRAPHIC:
            return "orthographic"
        if sign == "(" and key.removeprefix("set") == "size" and _WINDOW.search(before) and not self._has_viewports:
            return "size"
        if key in ("cameraposition", "cpos", "camera_position") and sign == "=":
            return "camera_position"
        bare = key.removeprefix("set")
        if bare == "up" and sign == "(" and before and not self._is_camera(parts[:-1]):
            return None  # keyboard.up("R")
        if bare in _SPECIFIC:
            return _SPECIFIC[bare]
        if self._is_camera(parts[:-1]):
            if key in _MOVES or bare in _MOVES:
                return "moves"
            return _GENERIC.get(bare)
        if bare == "target" and before == "controls":
            return "target_of_controls"
        return None

    def _is_camera(self, parts: list[str]) -> bool:
        # Where cameras are made, an eye or a preview is another thing.
        called = _NAMED_CAMERA if self._cameras else _CAMERA
        return any(part in self._cameras or called.search(part) for part in parts)

    def _name(self, path: str) -> object:
        """The value of a name: the one that it is given."""
        last = re.split(r"\.|->|::", path)[-1]
        if path == "scene.position" and not re.search(r"\bscene\.position\.", self.text):
            return (0.0, 0.0, 0.0)  # three.js
        if last in self._values:
            return self._values[last]
        self._lookups += 1
        if (
            last in self._stepped
            or last not in self.assigned
            or last in self._following
            or len(self.assigned[last]) > 20
            or max(len(self._following) / 12, self._lookups / 5000) > 1
        ):
            return None
        self._following.add(last)
        try:
            values = [self._at(place) for place in self.assigned[last]]
        finally:
            self._following.discard(last)
        # A value that is known in one place and computed in another is not known.
        value = values[0] if not any(map(_is_unknown, values)) and all(each == values[0] for each in values) else None
        if not self._following:
            self._values[last] = value
        return value

    def _at(self, place: int) -> object:
        if self.text[place : place + 1] in ("(", "{"):  # vec3 eye(1, 2, 3)
            values, named, _ = self.reader.arguments(place)
            if named:
                return Unknown(place)
            return values[0] if len(values) == 1 else tuple(values)
        return self._whole(place)

    def _whole(self, place: int) -> object:
        """The value at a place, an `Unknown` where something more is done with it."""
        value, end = self.reader.value(place)
        return Unknown(place) if _GOES_ON.match(self.text, end) else value

    # ---- what it says

    def scene(self) -> _Scene:
        if len(self.statements) > _MOST_STATEMENTS:
            raise InputError(f"the text says more than {_MOST_STATEMENTS} things of cameras: copy one camera")
        is_potree = bool(_OF_POTREE.search(self.text))
        scene = _Scene(three=is_potree or bool(_OF_THREE.search(self.text)), is_z_up=is_potree)
        for at in self._all(*_LENSES):
            if self._words[at + 1] == "*" or self._words[at - 1] == "new":
                not_a_pinhole("the text's camera", f"a {self._words[at]}")
        self._refuse_moves(scene)
        if scene.three and (turning := self._made_new(_CONTROLS)) is not None:
            scene.controls = self._words[turning]
        parts_of: dict[str, dict[str, float]] = {}
        placed: dict[str, str] = {}  # position or up: whose
        moved_before = None  # the matrix of OpenGL that gluLookAt multiplies
        for parts, sign, at, start in self.statements:
            role = self._role(parts, sign)
            if sign == "(" and (name := texts.plain(parts[-1])) in ("glloadidentity", "glpushmatrix", *_GL_MOVES):
                moved_before = start if name in _GL_MOVES else None
            elif role == "look_at" and moved_before is not None and texts.plain(parts[-1]) == "glulookat":
                texts.fail(self.text, moved_before, "this moves the view by other means, write eye, look-at and up")
            elif sign == "(" and texts.plain(parts[-1]) == "resetcamera" and scene.moved:
                texts.fail(self.text, start, "this moves the camera until all is seen, write where it is then")
            elif scene.three and self._adds_camera(parts, sign, at):
                texts.fail(self.text, start, "the camera is part of this, which may move it, write where it is in the scene")
            if role is None or (sign == ":" and role in ("width", "height", "size")):
                continue
            for name in {"position", "up"} & {*parts[1:]} if sign != ":" else ():
                whose = ".".join(parts[: parts.index(name, 1)])
                if placed.setdefault(name, whose) != whose:
                    texts.fail(self.text, start, f"this is another camera than {placed[name][:40]}, copy one camera")
            if sign == "(" and role in _VECTORS and _GOES_ON.match(self.text, self.reader.arguments(at - 1)[2]):
                role = "moves"  # position.set(…).multiplyScalar(…)
            if role == "look_at" and self._is_multiplied(at - 1, start):
                texts.fail(self.text, start, "more turns or moves this view, write eye, look-at and up")
            if role == "moves":
                if sign != ":":
                    texts.fail(self.text, start, "this moves or bends the camera by other means, write eye, look-at and up")
            elif role[:-1] in ("position_", "up_"):
                value = self._whole(at)
                if not isinstance(value, float):
                    texts.fail(self.text, at, "this is computed from what the text does not say, write the number")
                scene.moved.append(start)
                before = parts_of.setdefault(role[:-2], {}).setdefault(role[-1], value)
                if value != before:
                    texts.fail(self.text, at, f"this is {before:g} elsewhere in the text, copy one camera")
            else:
                self._take(scene, role, parts, sign, at, start)
        for name, stated in parts_of.items():
            role = {"position": "eye", "up": "up"}[name]
            usual = (0.0, 0.0, 0.0) if role == "eye" else (0.0, 1.0, 0.0)
            now = scene.values.get(role, (usual, 0))[0]
            if not isinstance(now, tuple):
                continue  # computed before: refused where it is needed
            scene.values[role] = (tuple(stated.get(axis, old) for axis, old in zip("xyz", now, strict=True)), 0)
        return scene

    def _take(self, scene: _Scene, role: str, parts: list[str], sign: str, at: int, start: int) -> None:
        """Take what a call of another program's function says, or a plain value."""
        if role == "look_at":
            if not scene.three or len(parts) == 1 or self._is_camera(parts[:-1]):  # else it is a mesh's or a lamp's
                self._look_at(scene, parts, at - 1, start)
        elif role == "perspective":
            self._perspective(scene, parts, at - 1, start)
        elif role == "set_view":
            self._of_potree(scene, at - 1, start)
        elif role in _PYTORCH3D:
            self._of_pytorch3d(scene, role, at - 1, start)
        elif role == "computeviewmatrixfromyawpitchroll":
            self._of_pybullet(scene, at - 1, start)
        elif role == "getcameraimage":
            values, named, _ = self.reader.arguments(at - 1)
            self._set(scene, "size", tuple((*values[:2], *(named[key] for key in ("width", "height") if key in named))), start)
        elif role == "frustum":
            values, _, _ = self.reader.arguments(at - 1)
            scene.frustum = numbers(tuple(values[:6]), 6) if len(values) >= 6 else None
            if scene.frustum is None:
                texts.fail(self.text, start, "give six plain numbers for the frustum")
        elif role == "setviewoffset":
            values, _, _ = self.reader.arguments(at - 1)
            self._set(scene, "view_offset", numbers(tuple(values), 6) or Unknown(start), start)
        elif role == "clearviewoffset":
            scene.values.pop("view_offset", None)
        elif role == "orthographic":
            scene.orthographic = start
        elif role == "camera_position":
            self._camera_position(scene, at, start)
        else:
            self._plain(scene, role, sign, at, start)

    def _refuse_moves(self, scene: _Scene) -> None:
        """Raise InputError where the camera, or one coordinate of it, is moved from where it was."""
        for parts, place in self._changed:
            if self._is_camera(parts[:-1] or parts) and self._role(parts, "=") not in (None, "width", "height", "size"):
                texts.fail(self.text, place, "this moves the camera from where it was, write where it is then")
        for parts, place in self._coordinates:
            if self._role(parts, "=") in _VECTORS:
                texts.fail(self.text, place, "this is one coordinate, write the whole vector where it is set")
        for parts, sign, _, start in self.statements:
            if len(parts) < 2 or sign != "=" or parts[-1] not in _COORDINATES or self._role(parts, sign):
                continue
            if self._role(parts[:-1], sign) in _VECTORS:
                texts.fail(self.text, start, "this is one coordinate, write the whole vector where it is set")
        if scene.three and (turning := self._made_new(_OTHER_CONTROLS)) is not None:
            texts.fail(self.text, self._places[turning], "these turn the camera by themselves, write where it looks then")
        if (moved := self._view_moved()) is not None:
            texts.fail(self.text, moved, "this moves the view by other means, write eye, look-at and up")

    def _adds_camera(self, parts: list[str], sign: str, at: int) -> bool:
        """True if the statement makes a camera part of something else than the scene."""
        if sign != "(" or len(parts) < 2 or parts[-1] != "add" or "scene" in parts[-2].lower():
            return False
        added = re.match(r"\s*([\w$.]+)\s*[,)]", self.text[at : at + 200])
        return added is not None and self._is_camera(added[1].split("."))

    def _set(self, scene: _Scene, role: str, value: object, at: int) -> None:
        before = scene.values.get(role)
        if before and before[0] != value and not _is_unknown(value) and not _is_unknown(before[0]):
            line = self.text.count("\n", 0, before[1]) + 1
            texts.fail(self.text, at, f"{role} is something else in line {line}, copy one camera")
        if before is None or _is_unknown(value):  # a value known once and computed once: nobody knows which counts
            scene.values[role] = (value, at)

    def _place(self, scene: _Scene, start: int, *vectors: object) -> None:
        """Set the eye, and the target and up as far as they are given."""
        scene.moved.append(start)
        for role, vector in zip(("eye", "target", "up"), vectors, strict=False):
            self._set(scene, role, vector, start)

    def _plain(self, scene: _Scene, role: str, sign: str, at: int, start: int) -> None:
        if sign in "({":
            values, named, _ = self.reader.arguments(at - 1)
            value: object = values[0] if len(values) == 1 else tuple(values)
            if not values and not named:
                return  # a getter
        else:
            value = self._whole(at)
        if role in _VECTORS:
            value = _only(value)
            vector = numbers(value, 3)
            if vector is None and sign in "({" and _looks_declared(self.text, at - 1):
                return
            if vector is None:
                parts_unknown = [part for part in value if isinstance(part, Unknown)] if isinstance(value, tuple) else [value]
                value = next((part for part in parts_unknown if isinstance(part, Unknown)), Unknown(start))
            else:
                value = vector
            if role == "eye" or (role == "up" and scene.three):
                scene.moved.append(start)
        self._set(scene, role, value, start)

    def _look_at(self, scene: _Scene, parts: list[str], opened: int, start: int) -> None:
        values, named, _ = self.reader.arguments(opened)
        if texts.plain(parts[-1]).endswith("lh"):
            scene.mirrored = True
        if named:
            roles = {key: _SPECIFIC.get(texts.plain(key)) for key in named}
            spelt = {own._spelt(roles[key] or key): value for key, value in named.items()}
            values = [spelt.get(name) for name in own.VECTORS]
        flat = tuple(values)
        if (nine := numbers(flat[-9:], 9)) and len(flat) in (9, 10):
            values = [nine[:3], nine[3:6], nine[6:]]
        if len(values) == 3 and (point := numbers(flat, 3)) and not named:
            scene.aimed.append((start, point))
            return
        if len(values) == 1:
            point = numbers(values[0], 3)
            if point is None:
                if _looks_declared(self.text, opened):
                    return
                texts.fail(self.text, getattr(values[0], "at", 0) or start, "give plain numbers for the point that it looks at")
            scene.aimed.append((start, point))
            return
        if not values:
            return
        vectors = [numbers(value, 3) for value in values[-3:]]
        if len(values) not in (3, 4) or None in vectors or len(vectors) < 3:
            if _looks_declared(self.text, opened):
                return
            texts.fail(self.text, start, "give eye, target and up as plain numbers")
        for role, vector in zip(("eye", "target", "up"), vectors, strict=True):
            self._set(scene, role, vector, start)

    def _of_potree(self, scene: _Scene, opened: int, start: int) -> None:
        """setView(position, target, how long it takes there, what is done then)."""
        values = self.reader.arguments(opened)[0]
        vectors = [numbers(value, 3) for value in values[:2]]
        if len(vectors) < 2 or None in vectors:
            texts.fail(self.text, start, "give position and target as plain numbers")
        self._place(scene, start, *vectors)

    def _of_pybullet(self, scene: _Scene, opened: int, start: int) -> None:
        """A point of view on a sphere about the target: degrees, whose roll, which also moves the eye, must be 0."""
        values, named, _ = self.reader.arguments(opened)
        arguments = (
            dict(zip(("cameraTargetPosition", "distance", "yaw", "pitch", "roll", "upAxisIndex"), values, strict=False)) | named
        )
        target = numbers(arguments.get("cameraTargetPosition"), 3)
        rest = numbers(tuple(arguments.get(name, 0.0) for name in ("distance", "yaw", "pitch", "roll", "upAxisIndex")), 5)
        if target is None or rest is None or rest[3] or rest[4] not in (1.0, 2.0):
            texts.fail(self.text, start, "give plain numbers and no roll, or write computeViewMatrix with eye, target and up")
        distance, yaw, pitch, _, axis = rest
        around, sideways = texts.turn(yaw, np.eye(3)[int(axis)]), texts.turn(pitch if axis == 2 else -pitch, np.eye(3)[0])
        offset = around @ sideways @ (-distance * np.eye(3)[1 if axis == 2 else 2])
        eye, up = np.array(target) + offset, around @ sideways @ np.eye(3)[int(axis)]
        self._place(scene, start, tuple(eye.tolist()), target, tuple(up.tolist()))

    def _of_pytorch3d(self, scene: _Scene, role: str, opened: int, start: int) -> None:
        values, named, _ = self.reader.arguments(opened)
        if role == "perspectivecameras":
            texts.fail(self.text, start, "write FoVPerspectiveCameras with the fov that this focal length makes")
        if role != "lookatviewtransform":
            if "degrees" in named or named.get("aspect_ratio", 1.0) != 1.0:
                texts.fail(self.text, start, "give fov in degrees and leave degrees and aspect_ratio out")
            angle = named.get("fov", values[2] if len(values) > 2 else 60.0)
            self._set(scene, "fov_of_shorter", Degrees(angle) if isinstance(angle, float) else Unknown(start), start)
            return
        names = ("dist", "elev", "azim", "degrees", "eye", "at", "up")
        by_name = dict(zip(names, values, strict=False)) | named
        eye, at, up = (
            numbers(_only(by_name.get(name, usual)), 3) for name, usual in zip(names[4:], _PYTORCH3D_LOOK, strict=True)
        )
        if "eye" not in by_name:
            spherical = numbers(
                tuple(_only(by_name.get(name, usual)) for name, usual in zip(names, (1.0, 0.0, 0.0), strict=False)), 3
            )
            if spherical is None or "degrees" in by_name or at is None:
                texts.fail(self.text, start, "give dist, elev and azim as plain numbers in degrees, or eye, at and up")
            distance, elevation, azimuth = spherical[0], math.radians(spherical[1]), math.radians(spherical[2])
            around = distance * math.cos(elevation)
            offset = (around * math.sin(azimuth), distance * math.sin(elevation), around * math.cos(azimuth))
            eye = tuple(a + b for a, b in zip(at, offset, strict=True))
        if None in (eye, at, up):
            texts.fail(self.text, start, "give eye, at and up as plain numbers")
        self._place(scene, start, eye, at, up)
        scene.is_height_first = True

    def _camera_position(self, scene: _Scene, at: int, start: int) -> None:
        value = self._whole(at)
        if single := numbers(value, 3):
            return self._place(scene, start, single)
        vectors = [numbers(part, 3) for part in value] if isinstance(value, tuple) and len(value) == 3 else [None]
        if None in vectors:
            texts.fail(self.text, start, "give position, focal point and up as three numbers each")
        self._place(scene, start, *vectors)

    def _perspective(self, scene: _Scene, parts: list[str], opened: int, start: int) -> None:
        values, named, _ = self.reader.arguments(opened)
        name = texts.plain(parts[-1])
        family = texts.plain("".join(parts))
        if name.endswith("lh") and not any(self._role(other, sign) == "look_at" for other, sign, _, _ in self.statements):
            scene.mirrored = True
        if values and isinstance(values[0], Unknown) and len(values) >= 5:  # the matrix that gl-matrix and D3DX fill
            values = values[1:]
        if not values and not named:
            if name == "perspectivecamera":
                self._set(scene, "fov_y", Degrees(50.0), start)
            return
        angle = named.get("fov", named.get("fovy", values[0] if values else None))
        if isinstance(angle, float) and not isinstance(angle, Radians | Degrees):
            if name in ("gluperspective", "perspectivecamera", "perspectiveprojection", "computeprojectionmatrixfov"):
                angle = Degrees(angle)
            elif angle < math.pi and ("glm" in family or "mat4" in family or name.startswith(("xm", "d3dx", "create"))):
                angle = Radians(angle)
        self._set(scene, "fov_y", angle if angle is not None else Unknown(start), start)
        if name == "perspectivefov" and len(values) >= 3:
            self._set(scene, "size", (values[1], values[2]), start)
        elif len(values) > 1 or "aspect" in named:
            aspect = named.get("aspect", values[1] if len(values) > 1 else None)
            if isinstance(aspect, float):
                self._set(scene, "aspect_of_lens", aspect, start)


def _only(value: object) -> object:
    """The value that stands alone in brackets, as in PyTorch3D's batches of one; else the value itself."""
    return value[0] if isinstance(value, tuple) and len(value) == 1 else value


def _is_name(word: str) -> bool:
    return word[:1].isalpha() or word[:1] in ("_", "$")


def _is_unknown(value: object) -> bool:
    return isinstance(value, Unknown) or (isinstance(value, tuple) and any(map(_is_unknown, value)))


def _looks_declared(text: str, opened: int) -> bool:
    """True if the brackets are the head of a function's definition."""
    head = text[opened : opened + 2_000]
    try:
        end = texts.closing(head, 0, "()")
    except InputError:
        return False
    return bool(re.match(r"\)\s*(?:const\s*)?(?:->[^;{]{0,40})?[{:]", head[end : end + 60]))


def read(source: Source, options: Options) -> list[Camera]:
    code = _code(source.text)
    scene = code.scene()
    values, text = scene.values, code.text
    if scene.orthographic is not None and not {"fov", "fov_x", "fov_y"} & values.keys() and scene.frustum is None:
        not_a_pinhole("the text's camera", "orthographic")
    if _plain_number(values, "parallel", 0.0, text):
        not_a_pinhole("the text's camera", "in parallel projection")
    if _plain_number(values, "blur", 0.0, text) > 0:
        texts.fail(text, values["blur"][1], "this lens blurs and is no pinhole, set it to 0 for its middle")
    if _plain_number(values, "roll", 0.0, text):
        texts.fail(text, values["roll"][1], "which way a roll turns differs between books, write the up that it makes")
    eye, look_at, up, notes = _pose(scene, text, options)
    plane, stated, more = _plane(scene, text, options)
    singular_is_fine = "view_distance" in values
    pinhole = texts.posed(eye, look_at, up, plane, scene.mirrored, singular_is_fine)
    camera = Camera("Camera", pinhole, stated, (*notes, *more))
    return [texts.mirroring(camera, "The text's camera")]


def _known(values: dict, role: str, text: str, advice: str) -> Any:
    if role not in values:
        return None
    value, at = values[role]
    if isinstance(value, Unknown):
        texts.fail(text, value.at or at, advice)
    return value


def _plain_number(values: dict, role: str, usual: float, text: str) -> float:
    value = _known(values, role, text, f"write the number for {role}")
    if value is None:
        return usual
    if isinstance(value, str):
        value = {"true": 1.0, "false": 0.0}.get(value.lower(), value)
    if not isinstance(value, float):
        texts.fail(text, values[role][1], f"write the number for {role}")
    return float(value)


def _pose(scene: _Scene, text: str, options: Options) -> tuple:
    """eye, look_at, up and notes."""
    values, base = scene.values, options.base
    notes: tuple[str, ...] = ()
    vectors = {role: _known(values, role, text, f"write {role} in plain numbers") for role in _VECTORS}
    eye, target, up, direction = (vectors[role] for role in ("eye", "target", "up", "direction"))
    if scene.three and eye is None:
        eye = (0.0, 0.0, 0.0)
    if scene.controls:
        known = _known(values, "target_of_controls", text, "write the target in plain numbers") or (0.0, 0.0, 0.0)
        if (target := numbers(known, 3)) is None:
            texts.fail(text, values["target_of_controls"][1], "write the target in plain numbers")
        notes = (f"{scene.controls} turn the camera to their target, {target}",)
    if target is None and (aims := {point for _, point in scene.aimed}):
        if len(aims) > 1:
            texts.fail(text, scene.aimed[1][0], "it looks at several points, copy one camera")
        target = scene.aimed[0][1]
        if scene.moved and scene.moved[-1] > scene.aimed[-1][0]:
            texts.fail(
                text,
                scene.moved[-1],
                "the camera changes after it was turned to look at a point, set position and up before lookAt",
            )
    if target is None and "target_of_controls" in values:
        target = numbers(_known(values, "target_of_controls", text, "write the target in plain numbers"), 3)
    if target is None and scene.three and direction is None:
        if "OrbitControls" in text:
            target, notes = (0.0, 0.0, 0.0), ("OrbitControls turn the camera to the origin",)
        else:
            direction = (0.0, 0.0, -1.0)
    if target is None and direction is not None and eye is not None:
        target = tuple(a + b for a, b in zip(eye, direction, strict=True))
    for name, vector in (("eye", eye), ("target", target)):
        if vector is None:
            raise InputError(
                f"the text does not say the camera's {'position' if name == 'eye' else 'target'} in plain numbers: write it"
            )
    if up is None:
        if scene.three or re.search(r"vtk|SetViewAngle|SetFocalPoint|pinhole|set_view_distance", text, re.IGNORECASE):
            up = (0.0, 0.0, 1.0) if scene.is_z_up else (0.0, 1.0, 0.0)
        elif base:
            up, notes = base.up, (*notes, "The text does not say which way is up: that of the camera before was taken")
        else:
            raise InputError("the text does not say which way is up for its camera: write it")
    return eye, target, up, notes


def _plane(scene: _Scene, text: str, options: Options) -> tuple:
    """The view plane, whether its size is stated, and notes."""
    values = scene.values
    what = "the text"
    aspect = next((v for role in ("aspect_of_lens", "aspect") if isinstance(v := values.get(role, (None, 0))[0], float)), None)
    if aspect is not None and not 1e-4 < aspect < 1e4:
        raise InputError(f"the picture's aspect is {aspect:g}: give its width over its height")
    size = _size(values, aspect)
    if scene.is_height_first and isinstance(values.get("size", (None,))[0], float):
        size = _size(values | {"size": ((values["size"][0],) * 2, values["size"][1])}, aspect)
    elif scene.is_height_first and size:
        size = (size[1], size[0])
    if scene.frustum:
        return _of_frustum(scene.frustum, options, size)
    if "view_distance" in values:
        film = texts.film(options, what, size, None if size else aspect)
        d, zoom, s = (
            _plain_number(values, role, usual, text)
            for role, usual in (("view_distance", 0.0), ("zoom", 1.0), ("pixel_size", 1.0))
        )
        if s <= 0 or zoom <= 0:
            raise InputError(f"pixel size and zoom are {s:g} and {zoom:g}: give positive ones")
        return film.centered(d * zoom / s), film.is_stated, film.notes
    said_angles = [role for role in ("fov_of_shorter", "fov_y", "fov_x", "view_angle", "fov") if role in values]
    if _plain_number(values, "zoom", 1.0, text) != 1 and not (scene.three and said_angles):
        texts.fail(text, values["zoom"][1], "what this zooms differs between programs, write the field of view that it makes")
    if not said_angles:
        if _OF_VTK.search(text):
            film = texts.film(options, what, size)
            return (
                film.plane(math.radians(30), "y"),
                film.is_stated,
                (*film.notes, "The text says no view angle: it is VTK's own, 30°"),
            )
        kept = () if options.view_plane else ("The text does not say how the camera sees: as the camera before does",)
        return options.plane_or_refuse(what), False, kept
    radians, axis = _angle(scene, text, options, said_angles)
    if scene.three and (zoom := _plain_number(values, "zoom", 1.0, text)) != 1 and zoom > 0:
        radians = 2 * math.atan(math.tan(radians / 2) / zoom)
    if "view_offset" in values:
        return _part_of_picture(scene, text, options, size, radians)
    film = texts.film(options, what, size, aspect)
    plane = film.plane(radians, axis)
    if not film.is_stated and aspect and axis == "x":
        half = math.tan(radians / 2)
        plane = film.centered(film.height * aspect / 2 / half / film.pixel_aspect)
    if size and "aspect_of_lens" in values and aspect and abs(film.aspect / aspect - 1) * film.width > 1:
        d_y = plane.distance[1]
        plane = axes.view_plane(d_y * film.aspect / aspect, d_y, film.width / 2, film.height / 2, size)
    if "window_center" in values:
        shift = numbers(_known(values, "window_center", text, "write the window's center in numbers"), 2)
        if shift is None:
            texts.fail(text, values["window_center"][1], "write the window's center in numbers")
        c_x, c_top = (1 - shift[0]) / 2 * film.width, (1 + shift[1]) / 2 * film.height
        plane = axes.view_plane(*plane.distance, c_x, c_top, (film.width, film.height))
    return plane, film.is_stated, film.notes


def _of_frustum(frustum: tuple[float, ...], options: Options, size: tuple[int, int] | None) -> tuple:
    """The view plane of left, right, bottom, top, near and far. See `_plane`."""
    left, right, bottom, top, near, _ = frustum
    if not (left != right and bottom != top and near > 0):
        raise InputError("the frustum is empty: give left, right, bottom, top, near and far")
    aspect = abs((right - left) / (top - bottom))
    film = texts.film(options, "the text", size, aspect)
    exact = film.width if film.is_stated else film.height * aspect / film.pixel_aspect
    d_x, d_y = near * exact / (right - left), near * film.height / (top - bottom)
    if d_x <= 0 or d_y <= 0:
        raise InputError("the frustum turns the picture over: give left < right and bottom < top")
    c_x = -left / (right - left) * exact + (film.width - exact) / 2
    plane = axes.view_plane(d_x, d_y, c_x, film.height * top / (top - bottom), (film.width, film.height))
    return plane, film.is_stated, film.notes


def _angle(scene: _Scene, text: str, options: Options, said_angles: Sequence[str]) -> tuple[float, str]:
    """The field of view in radians, and the side of the picture that it is along: one of texts.AXES.

    said_angles : the roles of the angles that the text says, one at least.
    """
    values = scene.values
    role = said_angles[0]
    if len(said_angles) > 1:
        known = {value for each in said_angles if not isinstance(value := values[each][0], Unknown)}
        if len({float(x) for x in known if isinstance(x, float)}) > 1:
            texts.fail(text, values[said_angles[1]][1], "the field of view is said more than once, leave one out")
        role = next((each for each in said_angles if not isinstance(values[each][0], Unknown)), role)
    value = _known(values, role, text, "write the field of view as a number")
    if not isinstance(value, float):
        texts.fail(text, values[role][1], "write the field of view as a number")
    axis = {"fov_of_shorter": "smaller", "fov_y": "y", "fov_x": "x", "view_angle": "y"}.get(role, "")
    if role == "view_angle":
        value = value if isinstance(value, Radians) else Degrees(value)
        axis = "x" if _plain_number(values, "use_horizontal", 0.0, text) else "y"
    if role == "fov":
        if scene.three:
            value, axis = Degrees(value), "y"
        elif "Cesium" in text or "frustum.fov" in text:
            value, axis = Radians(value), "larger"
        else:
            raise InputError(f"a field of view of {value:g} may be meant across or upwards: say vfov or hfov")
    if isinstance(value, Radians):
        radians = float(value)
    else:
        radians = math.radians(value) if isinstance(value, Degrees) else texts.angle_of(value, "the field of view", options)
    if not 0 < radians < math.pi:
        raise InputError(f"the field of view is {math.degrees(radians):g}°: give an angle between 0 and 180")
    return radians, axis


def _part_of_picture(
    scene: _Scene, text: str, options: Options, size: tuple[int, int] | None, fov_y: float
) -> tuple[ViewPlane, bool, tuple[str, ...]]:
    """The view plane of three.js' setViewOffset(fullWidth, fullHeight, x, y, width, height), x and y from the top left.

    size : the size of the picture that shows this part; by default the part's own.
    fov_y : the full picture's vertical angle of view, radians. See `_plane`.
    """
    place = scene.values["view_offset"][1]
    part = _known(scene.values, "view_offset", text, "give six plain numbers: fullWidth, fullHeight, x, y, width, height")
    full_width, full_height, left, top, width, height = map(float, part)
    if not min(full_width, full_height, width, height) > 0:
        texts.fail(text, place, "this is an empty part of a picture, give widths and heights above 0")
    later = scene.values.get("aspect", (None, 0))
    if isinstance(later[0], float) and later[1] > place and abs(later[0] * full_height / full_width - 1) > 1e-6:
        texts.fail(text, later[1], "setViewOffset has set another aspect before, leave this out")
    is_whole = width.is_integer() and height.is_integer() and max(width, height) < 2**31
    film = texts.film(options, "the text", size or ((int(width), int(height)) if is_whole else None))
    across, along = film.width / width, film.height / height  # pixels of the picture in one of the part's
    distance = full_height / 2 / math.tan(fov_y / 2)
    c_x, c_top = (full_width / 2 - left) * across, (full_height / 2 - top) * along
    plane = axes.view_plane(distance * across, distance * along, c_x, c_top, (film.width, film.height))
    return plane, film.is_stated, film.notes


def _size(values: dict, aspect: float | None) -> tuple[int, int] | None:
    both = values.get("size", (None, 0))[0]
    width, height = (values.get(role, (None, 0))[0] for role in ("width", "height"))
    if isinstance(both, tuple) and (pair := numbers(both, 2)):
        width, height = pair
    if isinstance(width, float) and aspect and not isinstance(height, float):
        height = float(max(1, int(width / aspect)))
    if all(isinstance(x, float) and x.is_integer() and 1 <= x < 2**31 for x in (width, height)):
        return int(width), int(height)
    return None


def write(cameras: Sequence[Camera], options: Options) -> str:
    """gluLookAt and glFrustum of each camera: exact, whatever its principal point and pixels.

    Raises InputError if one is mirrored, which these can't say.
    """
    return "\n".join(map(_written, cameras))


def _written(camera: Camera) -> str:
    pinhole = camera.pinhole
    if pinhole.mirrored:
        raise InputError(f"gluLookAt can't say that {camera.name} is mirrored: make its scale positive, or write matrices")
    (d_x, d_y), (c_x, c_y), (width, height) = pinhole.distance, pinhole.principal_point, (pinhole.width, pinhole.height)
    near, far = 0.1, 1000.0
    window = [-c_x / d_x * near, (width - c_x) / d_x * near, -c_y / d_y * near, (height - c_y) / d_y * near]
    vectors = ", ".join(texts.listed(vector, ", ") for vector in texts.look(pinhole))
    lines = [
        *own.beginning(camera, "//"),
        f"windowSize = ({width}, {height});",
        f"glFrustum({texts.listed([*window, near, far], ', ')});",
        f"gluLookAt({vectors});",
    ]
    return "\n".join([*lines, ""])
