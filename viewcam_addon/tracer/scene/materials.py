"""What surfaces are made of, as data.

A material is either a tree of shader nodes (shader_nodes.py) or, for what a hand writes most, a sum of components without any
roughness, each with a colour: Lambert's diffuse reflection, emission, a perfect mirror, clear glass and clear refraction.
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields

from ... import checks
from ...errors import InputError
from .colours import LARGEST_RADIANCE, Colour, Picture, radiance
from .shader_nodes import Closure, Node, closures, node

__all__ = ["LARGEST_RADIANCE", "PLAIN", "Colour", "Material", "Picture", "radiance"]


@dataclass(frozen=True)
class Material:
    """The components that a surface's light is the sum of; None is no such component. Or `surface`, and no component.

    diffuse : albedo of a Lambert surface, both of its sides. emission : radiance, of both sides. mirror : reflectance of a
    perfect mirror. glass : colour of what is reflected and refracted by a clear dielectric, shared out by Fresnel's equations.
    refraction : colour of what is refracted, nothing being reflected. ior : of glass and refraction, inside over outside.
    surface : the shader that is in their place. transparent_shadow : whether shadow rays go through it where it is transparent.
    displacement : a node that makes a height, world units, whose slope turns the normals; nothing moves.
    """

    diffuse: Colour | None = None
    emission: Colour | None = None
    mirror: Colour | None = None
    glass: Colour | None = None
    refraction: Colour | None = None
    ior: float = 1.45
    surface: Node | None = None
    transparent_shadow: bool = True
    displacement: Node | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "ior", checks.number("ior of a material", self.ior, 1e-3, 1e3))
        truth = checks.truth("transparent_shadow of a material", self.transparent_shadow)
        object.__setattr__(self, "transparent_shadow", truth)
        if self.surface is not None and self.surface.is_value:
            raise InputError(f"the surface of a material is a node {self.surface.type!r}: give a shader")
        if self.surface is not None and self.colours:
            raise InputError(f"a material has a surface beside {', '.join(self.colours)}: give one or the other")
        if self.displacement is not None and not self.displacement.is_value:
            raise InputError(
                f"the displacement of a material is a shader {self.displacement.type!r}: give a node that makes a height"
            )

    @property
    def colours(self) -> dict[str, Colour]:
        """Component → its colour, without those that are None or black."""
        found = {field.name: getattr(self, field.name) for field in fields(self) if field.type in (Colour, Colour | None)}
        return {name: colour for name, colour in found.items() if colour is not None and not colour.is_black}

    @property
    def closures(self) -> tuple[Closure, ...]:
        """What the core adds up, of either form of a material."""
        if self.surface is not None:
            return tuple(closures(self.surface))
        made = {
            "emission": lambda colour: node("emission", color=colour),
            "diffuse": lambda colour: node("diffuse", color=colour),
            "mirror": lambda colour: node("glossy", color=colour, roughness=0.0, distribution="ggx"),
            "glass": lambda colour: node("glass", color=colour, ior=self.ior, distribution="ggx"),
            "refraction": lambda colour: node("refraction", color=colour, ior=self.ior, distribution="ggx"),
        }
        return tuple(Closure(make(self.colours[name])) for name, make in made.items() if name in self.colours)

    @property
    def inputs(self) -> tuple[tuple[str, Colour], ...]:
        """What all colours and numbers are given or made from, each with what a sentence calls it."""
        found = [("displacement", colour) for colour in self.displacement.colours] if self.displacement else []
        if self.surface is None:
            return (*self.colours.items(), *found)
        for closure in self.closures:
            kind = closure.node.type
            for name, value in (*closure.node.inputs, *(("a factor", factor) for factor, _ in closure.factors)):
                colours = value.colours if isinstance(value, Node) else [value] if isinstance(value, Colour) else []
                found += [(f"{name} of {kind}", colour) for colour in colours]
        return tuple(found)

    @property
    def nodes(self) -> Iterator[Node]:
        """Those of its closures and its displacement, and all that feed them."""
        makers = [maker for each in self.closures for maker in (each.node, *(factor for factor, _ in each.factors))]
        makers.append(self.displacement)
        for maker in makers:
            if isinstance(maker, Node):
                yield from maker.all

    @property
    def attributes(self) -> set[str]:
        """What its nodes ask meshes for, by name."""
        return {name for node in self.nodes for name in node.attributes}


PLAIN = Material(diffuse=Colour((0.8, 0.8, 0.8)))
"""What a surface without a material is made of, in Blender as here."""
