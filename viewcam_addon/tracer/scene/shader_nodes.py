"""Shader nodes, as data: a tree of closures, mixed and added, whose inputs are numbers, colours or images.

The names and defaults are those of Blender's nodes, in small letters; what they compute is Cycles', in the version that the
scene names (`Scene.cycles`), and stands in core/closures. A tree, since a shader that feeds two others is simply there twice.
Rejected: names and links as in Blender's own files, which a hand must keep in step.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from ... import checks
from ...errors import InputError
from .colours import Colour

RGB = tuple[float, float, float]

WHITE, GREY = (1.0, 1.0, 1.0), (0.8, 0.8, 0.8)
DISTRIBUTIONS = ("multiscatter_ggx", "ggx", "beckmann")


@dataclass(frozen=True)
class Kind:
    """What a type of node is given.

    inputs : name → its default; a number, a colour, words to choose from (the first is the default), or None for a shader.
    scatters : the kinds of bounces (film.Bounces) that its light is counted as.
    """

    inputs: Mapping[str, float | RGB | tuple[str, ...] | None]
    scatters: tuple[str, ...] = ()


KINDS: dict[str, Kind] = {
    "diffuse": Kind({"color": GREY, "roughness": 0.0}, ("diffuse",)),
    "translucent": Kind({"color": GREY}, ("transmission",)),
    "glossy": Kind({"color": GREY, "roughness": 0.5, "distribution": DISTRIBUTIONS}, ("glossy",)),
    "metallic": Kind(
        {
            "color": (0.617, 0.577, 0.54),
            "edge_tint": (0.695, 0.726, 0.77),
            "ior": (2.757, 2.513, 2.231),
            "extinction": (3.867, 3.404, 3.009),
            "roughness": 0.5,
            "fresnel": ("f82", "physical_conductor"),
            "distribution": DISTRIBUTIONS,
        },
        ("glossy",),
    ),
    "glass": Kind(
        {"color": WHITE, "roughness": 0.0, "ior": 1.5, "distribution": DISTRIBUTIONS},
        ("glossy", "transmission"),
    ),
    "refraction": Kind(
        {"color": WHITE, "roughness": 0.0, "ior": 1.45, "distribution": ("beckmann", "ggx")},
        ("transmission",),
    ),
    "emission": Kind({"color": WHITE, "strength": 1.0}),
    "principled": Kind(
        {
            "base_color": GREY,
            "metallic": 0.0,
            "roughness": 0.5,
            "ior": 1.5,
            "diffuse_roughness": 0.0,
            "specular_ior_level": 0.5,
            "specular_tint": WHITE,
            "transmission_weight": 0.0,
            "coat_weight": 0.0,
            "coat_roughness": 0.03,
            "coat_ior": 1.5,
            "coat_tint": WHITE,
            "emission_color": WHITE,
            "emission_strength": 0.0,
            "distribution": DISTRIBUTIONS[:2],
        },
        ("diffuse", "glossy", "transmission"),
    ),
    "mix": Kind({"factor": 0.5, "first": None, "second": None}),
    "add": Kind({"first": None, "second": None}),
}


@dataclass(frozen=True)
class Node:
    """A node, and through its inputs all that feed it.

    type : one of `KINDS`. inputs : (name, value) of those that are not what they are by default: a number, a `Colour`, three
    numbers, a word, or a `Node` where a shader belongs.
    """

    type: str
    inputs: tuple[tuple[str, Any], ...] = ()

    def __post_init__(self) -> None:
        if self.type not in KINDS:
            raise InputError(f"a shader is of the type {checks.shown(self.type)}: give one of {', '.join(KINDS)}")
        known = KINDS[self.type].inputs
        values = {}
        for name, value in dict(self.inputs).items():
            if name not in known:
                raise InputError(f"a shader {self.type!r} has no input {checks.shown(name)}: give one of {', '.join(known)}")
            values[name] = _checked(f"{name} of a shader {self.type!r}", value, known[name])
        ordered = ((name, values[name]) for name in known if name in values and values[name] != _default(known[name]))
        object.__setattr__(self, "inputs", tuple(ordered))

    def __getitem__(self, name: str) -> Any:
        """The value of an input: a `Colour`, a word, or a `Node` or None."""
        return dict(self.inputs).get(name, _default(KINDS[self.type].inputs[name]))

    @property
    def is_shining(self) -> bool:
        """Whether it gives off any light of its own."""
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
    factors: tuple[tuple[Colour, bool], ...] = ()


def closures(shader: Node | None, factors: tuple[tuple[Colour, bool], ...] = ()) -> Iterator[Closure]:
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


def _default(of: Any) -> Any:
    if of is None:
        return None
    return of[0] if isinstance(of, tuple) and isinstance(of[0], str) else _colour(of)


def _colour(value: Any) -> Colour:
    if isinstance(value, Colour):
        return value
    return Colour((float(value),) * 3) if isinstance(value, int | float) else Colour(value)


def _checked(name: str, value: Any, known: Any) -> Any:
    if known is None:
        if value is not None and not isinstance(value, Node):
            raise InputError(f"{name} is no shader: give one")
        return value
    if isinstance(known, tuple) and isinstance(known[0], str):
        if value not in known:
            raise InputError(f"{name} is {checks.shown(value)}: give one of {', '.join(known)}")
        return value
    try:
        return _colour(value)
    except (InputError, TypeError, ValueError) as error:
        raise InputError(f"{name}: {error}") from error
