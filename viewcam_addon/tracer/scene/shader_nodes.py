"""Shader nodes, as data: a tree of closures, mixed and added, whose inputs are numbers, colors, images or value nodes.

The names and defaults are those of Blender's nodes, in small letters; what they compute is Cycles', in the version that the
scene names (`Scene.cycles`), and stands in core/closures. A tree, since a shader that feeds two others is simply there twice.
Rejected: names and links as in Blender's own files, which a hand must keep in step.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from ... import checks
from ...errors import InputError
from . import ies, value_nodes
from .colors import LARGEST_RADIANCE, WHITE, Color

RGB = tuple[float, float, float]

GRAY = (0.8, 0.8, 0.8)
# The inputs that stretch facets along a tangent.
ANISOTROPY: dict[str, value_nodes.Default | None] = {"anisotropy": 0.0, "rotation": 0.0, "tangent": value_nodes.TANGENT}
DISTRIBUTIONS = ("multiscatter_ggx", "ggx", "beckmann")


@dataclass(frozen=True)
class Kind:
    """The inputs of a type of node.

    inputs : name → its default; a number, a color, words to choose from (the first is the default), or None for a shader; of a
        node that makes values also what value_nodes.py says.
    scatters : the kinds of bounces (film.Bounces) that its light is counted as.
    is_value : true if it makes a value, and is no shader.
    node : the type of Blender's shader node, where it is not BSDF_ and our name.
    names : our name of an input → Blender's, or its number, where they differ.
    neutral : Blender's name of an input that is not modeled → the value without which the shader is only approximated.
    """

    inputs: Mapping[str, value_nodes.Default | None]
    scatters: tuple[str, ...] = ()
    is_value: bool = False
    node: str = ""
    names: Mapping[str, str | int] = field(default_factory=dict)
    neutral: Mapping[str, float] = field(default_factory=dict)


KINDS: dict[str, Kind] = {
    "diffuse": Kind({"color": GRAY, "roughness": 0.0, "normal": value_nodes.NORMAL}, ("diffuse",)),
    "translucent": Kind({"color": GRAY, "normal": value_nodes.NORMAL}, ("transmission",)),
    "glossy": Kind(
        {"color": GRAY, "roughness": 0.5, **ANISOTROPY, "distribution": DISTRIBUTIONS, "normal": value_nodes.NORMAL},
        ("glossy",),
    ),
    "sheen": Kind(
        {"color": GRAY, "roughness": 0.5, "distribution": ("microfiber", "ashikhmin"), "normal": value_nodes.NORMAL},
        ("diffuse", "glossy"),
    ),
    "metallic": Kind(
        {
            "color": (0.617, 0.577, 0.54),
            "edge_tint": (0.695, 0.726, 0.77),
            "ior": (2.757, 2.513, 2.231),
            "extinction": (3.867, 3.404, 3.009),
            "roughness": 0.5,
            **ANISOTROPY,
            "fresnel": ("f82", "physical_conductor"),
            "distribution": DISTRIBUTIONS,
            "normal": value_nodes.NORMAL,
        },
        ("glossy",),
        names={"color": "Base Color", "fresnel": "fresnel_type"},
        neutral={"Thin Film Thickness": 0.0},
    ),
    "glass": Kind(
        {"color": WHITE, "roughness": 0.0, "ior": 1.5, "distribution": DISTRIBUTIONS, "normal": value_nodes.NORMAL},
        ("glossy", "transmission"),
        neutral={"Thin Film Thickness": 0.0},
    ),
    "refraction": Kind(
        {"color": WHITE, "roughness": 0.0, "ior": 1.45, "distribution": ("beckmann", "ggx"), "normal": value_nodes.NORMAL},
        ("transmission",),
    ),
    "emission": Kind({"color": WHITE, "strength": 1.0}, node="EMISSION"),
    "transparent": Kind({"color": WHITE}),
    "principled": Kind(
        {
            "base_color": GRAY,
            "metallic": 0.0,
            "roughness": 0.5,
            "ior": 1.5,
            "diffuse_roughness": 0.0,
            "specular_ior_level": 0.5,
            "specular_tint": WHITE,
            "anisotropic": 0.0,
            "anisotropic_rotation": 0.0,
            "tangent": value_nodes.TANGENT,
            "transmission_weight": 0.0,
            "coat_weight": 0.0,
            "coat_roughness": 0.03,
            "coat_ior": 1.5,
            "coat_tint": WHITE,
            "sheen_weight": 0.0,
            "sheen_roughness": 0.5,
            "sheen_tint": WHITE,
            "emission_color": WHITE,
            "emission_strength": 0.0,
            "alpha": 1.0,
            "distribution": DISTRIBUTIONS[:2],
            "normal": value_nodes.NORMAL,
            "coat_normal": value_nodes.NORMAL,
        },
        ("diffuse", "glossy", "transmission"),
        neutral={"Thin Film Thickness": 0.0, "Subsurface Weight": 0.0, "Thin Wall": 0.0},
    ),
    "mix": Kind(
        {"factor": 0.5, "first": None, "second": None}, node="MIX_SHADER", names={"factor": 0, "first": 1, "second": 2}
    ),
    "add": Kind({"first": None, "second": None}, node="ADD_SHADER", names={"first": 0, "second": 1}),
    **{name: Kind(row.inputs, is_value=True) for name, row in value_nodes.KINDS.items()},
}


@dataclass(frozen=True)
class Shader:
    """A type of shader node as Blender has it.

    kind : the node's type.
    inputs : ours → theirs.
    words : ours → the property that has the word.
    neutral : see `Kind`.
    """

    kind: str
    inputs: Mapping[str, str | int]
    words: Mapping[str, str]
    neutral: Mapping[str, float]

    @property
    def class_name(self) -> str:
        return "ShaderNode" + self.kind.title().replace("_", "")


def _shader(ours: str, kind: Kind) -> Shader:
    inputs, words = {}, {}
    for name, default in kind.inputs.items():
        if isinstance(default, tuple) and isinstance(default[0], str):
            words[name] = str(kind.names.get(name, name))
        else:
            inputs[name] = kind.names.get(name, name.replace("_", " ").title().replace("Ior", "IOR"))
    return Shader(kind.node or f"BSDF_{ours.upper()}", inputs, words, kind.neutral)


SHADERS = {ours: _shader(ours, kind) for ours, kind in KINDS.items() if not kind.is_value}
# Blender's words, where they are others than ours in capitals.
_WORDS = {"multiscatter_ggx": "MULTI_GGX"}


def word_of(ours: str) -> str:
    """Blender's name of one of the words of our shader nodes."""
    return _WORDS.get(ours, ours.upper())


_NEEDED = {"image": "the name of one", "table": "the name of an image of one row", "text": "that of an IES file"}

MOST_NODES = 500
"""The limit of a value's tree: a larger one is none that a hand has made, or one node in it feeds others again and again."""
MOST_DEEP = 250
"""Nodes that feed one another in a row: Python does not follow many hundreds."""


@dataclass(frozen=True)
class Node:
    """A node, and through its inputs all that feed it.

    type : one of `KINDS`.
    inputs : (name, value) of those that are not what they are by default. Of a shader a `Color`, a word, or a `Node`: a shader
        where one belongs, else one that makes values. Of that also whether something holds, and in place of constant colors
        three numbers, which may be negative.
    """

    type: str
    inputs: tuple[tuple[str, Any], ...] = ()
    size: int = field(default=1, init=False, compare=False, repr=False)  # nodes that make the value, this one among them

    def __post_init__(self) -> None:
        what = "node" if self.is_value else "shader"
        if self.type not in KINDS:
            raise InputError(f"a {what} is of the type {checks.quoted(self.type)}: give one of {', '.join(KINDS)}")
        known = KINDS[self.type].inputs
        values = {}
        for name, value in dict(self.inputs).items():
            if name not in known:
                raise InputError(
                    f"a {what} {self.type!r} has no input {checks.quoted(name)}: give one of {', '.join(known) or 'none'}"
                )
            values[name] = _checked(f"{name} of a {what} {self.type!r}", value, known[name], self.is_value)
        for name, wanted in _NEEDED.items():
            if name in known and name not in values:
                raise InputError(f"a {what} {self.type!r} has no {name}: give {wanted}")
        ordered = ((name, values[name]) for name in known if name in values and values[name] != self._default(name))
        object.__setattr__(self, "inputs", tuple(ordered))
        size = 1 + sum(value.size for _, value in self.inputs if isinstance(value, Node) and value.is_value)
        object.__setattr__(self, "size", size)
        if size > MOST_NODES:
            raise InputError(f"an input is computed by more than {MOST_NODES} nodes: give it fewer")

    def __getitem__(self, name: str) -> Any:
        """The value of an input: a `Color`, a word, or a `Node` or None; of a node that makes values three numbers, too."""
        return dict(self.inputs).get(name, self._default(name))

    def _default(self, name: str) -> Any:
        default = KINDS[self.type].inputs[name]
        if default is value_nodes.UV:
            return Node("texture_coordinate")
        if default is value_nodes.GENERATED:
            return Node("texture_coordinate", (("output", "generated"),))
        if default is value_nodes.POSITION:
            return Node("geometry")
        if default is value_nodes.INCOMING:
            return Node("geometry", (("output", "incoming"),))
        if default is None or default in (value_nodes.IMAGE, value_nodes.IES, *value_nodes.OWN):
            return None
        if default is value_nodes.NAME:
            return ""
        if isinstance(default, tuple) and isinstance(default[0], str):
            return default[0]
        return _number_or_color(default, self.is_value)

    @property
    def is_value(self) -> bool:
        """True if it makes a value, and is no shader."""
        return self.type in KINDS and KINDS[self.type].is_value

    @property
    def varies(self) -> bool:
        """True if it is not the same everywhere: nobody asks a node that makes values, whose core knows."""
        return True

    @property
    def is_black(self) -> bool:
        return False

    @property
    def colors(self) -> Iterator[Color]:
        """All images and colors of the mesh that a value is made from."""
        for _, value in self.inputs:
            if isinstance(value, Color):
                yield value
            elif isinstance(value, Node):
                yield from value.colors

    @property
    def all(self) -> Iterator["Node"]:
        """The node, and all that feed it."""
        yield self
        for name in KINDS[self.type].inputs:
            if isinstance(value := self[name], Node):
                yield from value.all

    @property
    def attributes(self) -> Iterator[str]:
        """The names of the attributes that it asks meshes for."""
        yield from value_nodes.attributes_of(self.type, self.__getitem__)
        if self.is_stretched and self["tangent"] is None:
            yield "generated"

    @property
    def is_stretched(self) -> bool:
        """True for a shader whose facets are stretched along a tangent."""
        return any(not self[name].is_black for name in ("anisotropy", "anisotropic") if name in KINDS[self.type].inputs)

    @property
    def is_tabulated(self) -> bool:
        """True for a shader that looks up what it scatters in all (core/bsdf/albedo.h)."""
        inputs = KINDS[self.type].inputs
        return self.type in ("principled", "sheen") or ("distribution" in inputs and self["distribution"] == DISTRIBUTIONS[0])

    @property
    def is_rough_refraction(self) -> bool:
        """True for a shader that refracts in more than one direction."""
        if self.type == "principled" and self["transmission_weight"].is_black:
            return False
        return self.type in ("glass", "refraction", "principled") and not self["roughness"].is_black

    @property
    def is_shining(self) -> bool:
        """True if it gives off any light of its own."""
        if self.type == "emission":
            return not (self["color"].is_black or self["strength"].is_black)
        return self.type == "principled" and not (self["emission_color"].is_black or self["emission_strength"].is_black)


def node(type: str, **inputs: Any) -> Node:
    """A node, by its inputs' names."""
    return Node(type, tuple(inputs.items()))


@dataclass(frozen=True)
class Closure:
    """A closure, and the factors of its weight: (a mixture's, whether it is what that leaves to the other side)."""

    node: Node
    factors: tuple[tuple[Color, bool], ...] = ()


def closures(shader: Node | None, factors: tuple[tuple[Color, bool], ...] = ()) -> Iterator[Closure]:
    """All closures of a tree, but for those that have no weight."""
    if shader is None:
        return
    if shader.type == "mix":
        factor = shader["factor"]
        for name, rest in (("first", True), ("second", False)):
            share = None if factor.varies else min(factor.rgb[0], 1.0)
            if share not in ((1.0,) if rest else (0.0,)):
                yield from closures(shader[name], factors if share == float(not rest) else (*factors, (factor, rest)))
    elif shader.type == "add":
        yield from closures(shader["first"], factors)
        yield from closures(shader["second"], factors)
    else:
        yield Closure(shader, factors)


def _number_or_color(value: Any, may_be_negative: bool) -> Any:
    if may_be_negative and isinstance(value, Color) and not value.varies:
        value = value.rgb
    if isinstance(value, bool | Color):
        return value
    three = (float(value),) * 3 if isinstance(value, int | float) else value
    if not may_be_negative:
        return Color(three)
    three = checks.vector("a value", three, 3)
    if any(abs(number) > LARGEST_RADIANCE for number in three):
        raise InputError(f"a value is {checks.quoted(three)}: give numbers up to {LARGEST_RADIANCE:g}")
    return three


def _checked(name: str, value: Any, known: Any, of_value: bool) -> Any:
    if isinstance(value, Node) and value.is_value == (known is None):
        raise InputError(f"{name} is a node {value.type!r}: give {'a shader' if known is None else 'one that makes values'}")
    if known is None:
        if value is not None and not isinstance(value, Node):
            raise InputError(f"{name} is no shader: give one")
        return value
    if isinstance(known, tuple) and isinstance(known[0], str):
        if value not in known:
            raise InputError(f"{name} is {checks.quoted(value)}: give one of {', '.join(known)}")
        return value
    if isinstance(known, bool):
        if not isinstance(value, bool):
            raise InputError(f"{name} is {checks.quoted(value)}: give true or false")
        return value
    if known is value_nodes.NAME:
        if not isinstance(value, str):
            raise InputError(f"{name} is {checks.quoted(value)}: give a name")
        return value
    if known is value_nodes.IES:
        ies.read(name, value)
        return value
    if known is value_nodes.IMAGE:
        if not isinstance(value, Color) or value != Color(WHITE, value.image):
            raise InputError(f"{name} is no image: give its name")
        return value
    if isinstance(value, Node):
        return value
    if known in value_nodes.OWN:
        raise InputError(f"{name} is no node: give one that makes a {known}, as {'normal_map' if known == 'normal' else known}")
    try:
        return _number_or_color(value, of_value)
    except (InputError, TypeError, ValueError) as error:
        raise InputError(f"{name}: {error}") from error
