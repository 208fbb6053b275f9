"""How light becomes a picture, as data: what an artist sets among the render settings."""

from dataclasses import dataclass

from ... import checks
from ...errors import InputError

FILTERS = ("BOX", "BLACKMAN_HARRIS", "GAUSSIAN")

LEVELS = ("geometry", "direct", "path")
"""How much is modelled, the least first."""

SAMPLES = 64
"""Samples a pixel, at the levels of light, where nobody says how many."""

MOST_SAMPLES = 4096
"""The most that a pixel gets where an error is wanted in place of a number of samples."""

_SEEDS = 8


def seeds(level: str, samples: int) -> int:
    """In how many pictures of Cycles its samples are shared out, each with another seed, so that they tell their noise.

    Eight have a spread that tells it within a third or so, and cost little beside their samples. A picture of a single sample
    would be that of the pixels' centres, as that of geometry is.
    """
    return 1 if level == LEVELS[0] else max(min(_SEEDS, samples // 2), 1)


@dataclass(frozen=True)
class Film:
    """filter : over which pixels spread their samples. filter_width : pixels, as Cycles counts
    them; BOX is one pixel wide.

    transparent : whether the world behind the scene leaves pixels see-through. exposure : factor on all light.
    """

    filter: str = "BLACKMAN_HARRIS"
    filter_width: float = 1.5
    transparent: bool = False
    exposure: float = 1.0

    def __post_init__(self) -> None:
        if self.filter not in FILTERS:
            raise InputError(f"the pixel filter is {checks.shown(self.filter)}: give one of {', '.join(FILTERS)}")
        object.__setattr__(self, "filter_width", checks.number("filter_width", self.filter_width, 0.001, 10.0))
        object.__setattr__(self, "transparent", checks.truth("transparent", self.transparent))
        object.__setattr__(self, "exposure", checks.number("exposure", self.exposure, 0.0, 1e6))


@dataclass(frozen=True)
class Bounces:
    """How often light is scattered before it must reach a lamp: in all, and by each kind of surface; 0 is light that comes
    straight from a lamp. transparent : how often it may go straight through a surface. Cycles' own counting and defaults."""

    total: int = 12
    diffuse: int = 4
    glossy: int = 4
    transmission: int = 12
    transparent: int = 8

    def __post_init__(self) -> None:
        for name in ("total", "diffuse", "glossy", "transmission", "transparent"):
            value = getattr(self, name)
            if type(value) is not int or not 0 <= value <= 1024:
                raise InputError(f"{name} of the bounces is {checks.shown(value)}: give a whole number from 0 to 1024")

    @property
    def none(self) -> "Bounces":
        """Those of level direct: light comes straight, if through what is transparent."""
        return Bounces(0, 0, 0, 0, self.transparent)
