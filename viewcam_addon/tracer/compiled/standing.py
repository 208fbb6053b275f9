"""How a function of arrays is replaced by its kernel, everywhere in the same way.

A function that a kernel stands in for is marked with `@or_compiled`. Its kernel has the same name and the same arguments, in
the module of the same name in kernels/, and returns the same arrays, to a few roundings. Nothing else knows of kernels, and
they are imported when they are first called, so that they may stand above what they stand in for.
"""

import contextlib
import functools
import importlib
import threading
from collections.abc import Callable, Iterator

from . import AVAILABLE

_of_thread = threading.local()


@contextlib.contextmanager
def uncompiled(so: bool) -> Iterator[None]:
    """Let this thread use NumPy's functions only, if so: where too little is to be done to wait for numba."""
    before = getattr(_of_thread, "uncompiled", False)
    _of_thread.uncompiled = so
    try:
        yield
    finally:
        _of_thread.uncompiled = before


def or_compiled(plain: Callable) -> Callable:
    """The function, or its kernel where those can be used. `plain` is the function itself, which tests compare with."""
    module = f"{__package__.rpartition('.')[0]}.kernels.{plain.__module__.rpartition('.')[2]}"

    @functools.cache
    def kernel() -> Callable:
        return getattr(importlib.import_module(module), plain.__name__)

    @functools.wraps(plain)
    def chosen(*arguments):
        return (kernel() if AVAILABLE and not getattr(_of_thread, "uncompiled", False) else plain)(*arguments)

    chosen.plain = plain
    return chosen
