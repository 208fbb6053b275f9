"""The light that the nodes of a light make, at each place of it and in each direction.

A lamp of the tracer has no space of its own: what Blender's nodes say in a light's is computed from places and directions of
the world, as Cycles has them (shader_setup_from_sample, and the files of intern/cycles/kernel/light).
"""

from collections.abc import Callable

import bpy
import numpy as np

from ...errors import InputError
from ...tracer.scene.materials import Color
from ...tracer.scene.shader_nodes import Node, closures, node
from ...tracer.scene.value_nodes import GENERATED, INCOMING, UV
from .. import versions
from . import shaders
from .nodes import Input, Output
from .shaders import RGB

_WHITE, _BLACK = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)
# What says something else of a light than of a surface, or nothing.
_OF_SURFACES = {
    *("ATTRIBUTE", "VERTEX_COLOR", "CAMERA", "TANGENT", "BUMP", "NORMAL_MAP", "OBJECT_INFO", "VECT_TRANSFORM", "WIREFRAME"),
}
_PLACES = {"Position", "Normal", "True Normal", "Incoming"}

UVMaker = Callable[[bpy.types.Light, np.ndarray], Node | None]


class LampReader(shaders.Tree):
    """Follows the nodes of a light. matrix : (4, 4), the light's space to the world's. uv : makes what its UV is."""

    def __init__(self, light: bpy.types.Light, matrix: np.ndarray, uv: UVMaker) -> None:
        super().__init__(Color(_WHITE))
        self._light, self._matrix, self._uv = light, matrix, uv

    def emission(self, of: Input) -> RGB | Node:
        """The emission of the shaders: the same everywhere, or a node that makes it; if `reading` has no reasons then."""
        total: RGB | Node = _BLACK
        for closure in closures(self.surface(of)):
            if closure.node.type != "emission":
                self.reading.reasons.append("has nodes that scatter light")
                return _WHITE
            shone = _scaled(_color(closure.node["color"]), _number(closure.node["strength"]))
            for factor, rest in closure.factors:
                shone = _scaled(shone, _share(_number(factor), rest))
            total = shone if total == _BLACK else _sum(total, shone)
        return total if isinstance(total, Node) else tuple(max(value, 0.0) for value in total)

    def _image(self, output: Output) -> Color:
        self._reason(output, "is no color alone")  # its place is the light's to say
        return self.viewport

    def _value(self, output: Output) -> Color | Node | None:
        source, name = output.node, output.socket.name
        if source.type == "UVMAP" or (source.type, name) in (("TEX_COORD", "UV"), ("NEW_GEOMETRY", "Parametric")):
            return self._of_itself(output, UV)
        if source.type == "TEX_COORD" and name == "Normal":
            return self._turned(node("geometry", output="normal"))
        if source.type == "TEX_COORD" and (name == "Generated" or (name == "Object" and source.object is None)):
            return self._of_itself(output, GENERATED)
        unknown = source.type in _OF_SURFACES or (source.type == "TEX_COORD" and name != "Object")
        unknown |= source.type == "NEW_GEOMETRY" and name not in _PLACES
        unknown |= source.type == "LIGHT_PATH" and not (name.startswith("Is ") or name == "Ray Length")
        if unknown:
            self._reason(output, f"says the {name} of a light")
            return None
        return super()._value(output)

    def _falloff(self, output: Output) -> Color | Node | None:
        if self._light.type != "SUN":
            return super()._falloff(output)
        if output.socket.name != "Quadratic" and not versions.SUNS_HAVE_NO_FALLOFF:
            self._reason(output, "lets a sun grow with its distance")
            return None
        strength = self._value_input(output.input("Strength"), 0.0)
        return node("math", operation="add", a=strength, b=0.0) if isinstance(strength, tuple) else strength

    def _of_itself(self, output: Output, known: object) -> Node | None:
        if known is INCOMING:
            return self._turned(node("geometry", output="incoming"))
        if known is GENERATED:
            return shaders.in_space_of(self._matrix) if versions.LIGHTS_HAVE_SPACES else node("geometry")
        return self._uv_of(output) if known is UV else None

    def _turned(self, normal: Node) -> Node:
        """A normal in the light's space."""
        columns = (shaders.dot(normal, column) for column in self._matrix[:3, :3].T)
        return node("vector_math", operation="normalize", a=node("combine_xyz", **dict(zip("xyz", columns, strict=True))))

    def _uv_of(self, output: Output) -> Node | None:
        result = self._uv(self._light, np.linalg.inv(self._matrix))
        if result is None:
            self._reason(output, f"says the UV of a {self._light.type.lower()}")
        return result


def emission(
    light: bpy.types.Light, matrix: np.ndarray, output: bpy.types.Node, uv: UVMaker
) -> tuple[RGB | Node, shaders.Reading]:
    """The factor of its light that a light's output is shown, and what that asks for, or why there is none."""
    reader = LampReader(light, matrix, uv)
    try:
        return reader.emission(Input(output.inputs["Surface"])), reader.reading
    except InputError as error:
        reader.reading.reasons.append(f"has nodes that are too much ({str(error).rpartition(': ')[0]})")
        return _WHITE, reader.reading


def _constant(value: Color | Node) -> tuple[RGB, float] | None:
    """The color that a value is everywhere, and its number; None where it varies."""
    if isinstance(value, Node):
        from ...tracer import native  # here: ctypes keeps its structures, and enabling the add-on needs none

        return native.constant_value(value)
    return value.rgb, value.rgb[0]


def _color(value: Color | Node) -> RGB | Node:
    constant = _constant(value)
    return tuple(max(each, 0.0) for each in constant[0]) if constant else value


def _number(value: Color | Node) -> float | Node:
    constant = _constant(value)
    return constant[1] if constant else value


def _share(factor: float | Node, rest: bool) -> float | Node:
    """The share of a mixture, from 0 to 1; or what it leaves to the other side."""
    if not isinstance(factor, Node):
        share = min(max(factor, 0.0), 1.0)
        return 1.0 - share if rest else share
    return node("clamp", value=node("math", operation="subtract", a=1.0, b=factor) if rest else factor)


def _scaled(value: RGB | Node, by: float | Node) -> RGB | Node:
    if by == 1.0:
        return value
    if isinstance(value, Node) or isinstance(by, Node):
        return node("vector_math", operation="scale", a=value, scale=by)
    return tuple(each * by for each in value)


def _sum(first: RGB | Node, second: RGB | Node) -> RGB | Node:
    if isinstance(first, Node) or isinstance(second, Node):
        return node("vector_math", operation="add", a=first, b=second)
    return tuple(a + b for a, b in zip(first, second, strict=True))
