"""The film, as data: it makes light a picture, and an artist sets it among the render settings."""

from dataclasses import dataclass

from ... import checks
from ...errors import InputError
from . import values

FILTERS = ("BOX", "BLACKMAN_HARRIS", "GAUSSIAN")

LEVELS = ("geometry", "direct", "path")
"""Amounts of what is modeled, the least first."""

SAMPLES = 64
"""Samples a pixel, at the levels of light, where nobody says how many."""

MOST_SAMPLES = 4096
"""The most that a pixel gets where an error is wanted in place of a number of samples."""

MOST_REFINED = 2048**2
"""The most pixels of a picture that refines, of which all tiles are under way at a time: 384 bytes a pixel, 1.6 GB."""

_SEEDS = 8
_FINE = 16  # samples more from step to step, once there are so many


def seeds(level: str, samples: int) -> int:
    """In how many pictures of Cycles its samples are shared out, each with another seed, so that they tell their noise.

    Eight have a spread that tells it within a third or so, and cost little beside their samples. A picture of a single sample
    would be that of the pixels' centers, as that of geometry is.
    """
    return 1 if level == LEVELS[0] else max(min(_SEEDS, samples // 2), 1)


def refinement(samples: int, pixels: int) -> tuple[int, ...]:
    """The numbers of samples after which a picture is shown that refines before somebody's eyes, the last of them all samples.

    Each twice the one before, then 16 more each. None for more pixels than MOST_REFINED.
    """
    coarse = (1 << power for power in range(_FINE.bit_length() - 1))
    steps = (*(step for step in coarse if step < samples), *range(_FINE, samples, _FINE), samples)
    return steps if pixels <= MOST_REFINED else ()


def _filter(_: str, name: object) -> object:
    if name not in FILTERS:
        raise InputError(f"the pixel filter is {checks.quoted(name)}: give one of {', '.join(FILTERS)}")
    return name


def _bounces(name: str, value: object) -> object:
    if type(value) is not int or not 0 <= value <= 1024:
        raise InputError(f"{name} is {checks.quoted(value)}: give a whole number from 0 to 1024")
    return value


@dataclass(frozen=True)
class Film:
    """The film: how light becomes pixels.

    filter : the filter over which pixels spread their samples.
    filter_width : pixels, as Cycles counts them; BOX is one pixel wide.

    transparent : true to leave pixels see-through where the world is behind the scene.
    exposure : the factor of all light.
    """

    filter: str = values.value("BLACKMAN_HARRIS", _filter, "text")
    filter_width: float = values.number(1.5, 0.001, 10.0)
    transparent: bool = values.truth(False)
    exposure: float = values.number(1.0, most=1e6)

    def __post_init__(self) -> None:
        values.check(self)


@dataclass(frozen=True)
class Bounces:
    """The most scatterings of light before it must reach a lamp: in all, and by each kind of surface; 0 is light that comes
    straight from a lamp.

    transparent : the most surfaces that it may go straight through. Counting and defaults are Cycles'.
    """

    total: int = values.value(12, _bounces, "whole", 0)
    diffuse: int = values.value(4, _bounces, "whole", 0)
    glossy: int = values.value(4, _bounces, "whole", 0)
    transmission: int = values.value(12, _bounces, "whole", 0)
    transparent: int = values.value(8, _bounces, "whole", 0)

    def __post_init__(self) -> None:
        values.check(self, "the bounces")

    @property
    def parts_diffuse(self) -> bool:
        """True if Cycles' Diffuse Indirect is what diffuse surfaces have scattered. Where these may not scatter and others may,
        it is what a ray of a glossy lobe carries of the diffuse one beside it (docs/light.md): Combined alone is right there.
        """
        return self.diffuse > 0 or self.total == 0

    @property
    def none(self) -> "Bounces":
        """The bounces of level direct: light comes straight, if through what is transparent."""
        return Bounces(0, 0, 0, 0, self.transparent)
