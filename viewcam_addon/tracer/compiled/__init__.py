"""What chooses between NumPy and loops that numba compiles: an optional extra that changes no result, only how fast it comes.

NumPy calls Embree ray by ray and writes whole arrays between any two steps. Compiled, the steps of a ray follow one another in
registers, and Embree is asked about sixteen rays at a time. What is in kernels/ stands in for functions of rays/ and light/,
takes and returns the same arrays, and is used where `AVAILABLE` says so; those functions stay, and are what tests compare it
with. `AVAILABLE` costs a millisecond: numba itself is imported with the first kernel. VIEWCAM_COMPILED=0 in the environment
turns all of it off.

Rejected: a C extension of our own, which needs a wheel for every Python and machine; numba's parallel loops, since tiles have
threads already; fastmath, which makes results depend on the machine.
"""

import importlib.util
import os

from .library import PROVEN

AVAILABLE = PROVEN and os.environ.get("VIEWCAM_COMPILED", "1") != "0" and importlib.util.find_spec("numba") is not None
"""Whether kernels can be used: numba is installed, and Embree was found and gives packets the right answers."""
