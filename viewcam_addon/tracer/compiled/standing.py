"""How a function of arrays is replaced by its kernel, everywhere in the same way.

A function that a kernel stands in for is marked with `@or_compiled`. Its kernel has the same name and the same arguments, in
the module of the same name in this folder, and returns the same arrays, to a few roundings. Nothing else knows of kernels.
"""

import functools
import importlib
from collections.abc import Callable

from . import AVAILABLE


def or_compiled(plain: Callable) -> Callable:
    """The function, or its kernel where those can be used. `plain` is the function itself, which tests compare with."""
    module = f"{__package__}.{plain.__module__.rpartition('.')[2]}"

    @functools.cache
    def kernel() -> Callable:
        return getattr(importlib.import_module(module), plain.__name__)

    @functools.wraps(plain)
    def chosen(*arguments):
        return (kernel() if AVAILABLE else plain)(*arguments)

    chosen.plain = plain
    return chosen
