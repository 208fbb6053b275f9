"""How a function of arrays is replaced by its kernel, everywhere in the same way.

A function that a kernel stands in for is marked with `@or_compiled`. Its kernel has the same name and the same arguments, in
the module of the same name in kernels/, and returns the same arrays, to a few roundings. Nothing else knows of kernels, and
they are imported when they are first called, so that they may stand above what they stand in for.

numba, and the machine code of the loops that a picture needs, take half a second to load. Where less than that is to be won,
NumPy's functions stay (`uncompiled`); that is decided by how much there is to do, never by what is loaded already.
"""

import contextlib
import contextvars
import functools
import importlib
from collections.abc import Callable, Iterator

from . import AVAILABLE

# Pixels. Compiled loops save 56 ns of a core's time a pixel of level geometry.
PIXELS_WORTH_COMPILING = 1 << 23
# Paths of light, which take 200 to 300 ns less.
PATHS_WORTH_COMPILING = 1 << 22

_uncompiled = contextvars.ContextVar("uncompiled", default=False)


@contextlib.contextmanager
def uncompiled(so: bool) -> Iterator[None]:
    """Let what is called inside the block, in threads that are given its context too, use NumPy's functions only, if so."""
    before = _uncompiled.set(so)
    try:
        yield
    finally:
        _uncompiled.reset(before)


def compiled_for(paths: int) -> contextlib.AbstractContextManager[None]:
    """Let kernels be used inside the block, if so many paths of light alone are worth that; else all stays as it is."""
    return uncompiled(_uncompiled.get() and paths < PATHS_WORTH_COMPILING)


def or_compiled(plain: Callable) -> Callable:
    """The function, or its kernel where those can be used. `plain` is the function itself, which tests compare with."""
    module = f"{__package__.rpartition('.')[0]}.kernels.{plain.__module__.rpartition('.')[2]}"

    @functools.cache
    def kernel() -> Callable:
        return getattr(importlib.import_module(module), plain.__name__)

    @functools.wraps(plain)
    def chosen(*arguments):
        return (kernel() if AVAILABLE and not _uncompiled.get() else plain)(*arguments)

    chosen.plain = plain
    return chosen
