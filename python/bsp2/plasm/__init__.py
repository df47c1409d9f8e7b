"""PLaSM's language in Python: `from bsp2.plasm import *` in the place of `from pyplasm import *`.

Complexes of points and convex cells of any dimension are made by functions of functions (docs/plasm.md). What
is solid of them takes part in Booleans, which are exact.
"""

import math
import sys
import time
import types
from functools import reduce

from . import appearance, curves, fl, geometry, legacy
from ._complex import Hpc
from .appearance import *
from .curves import *
from .fl import *
from .geometry import *
from .geometry import Q
from .legacy import *

pol_type = Hpc
long = int


def map(function, *iterables):
    """Python 2's: a list."""
    if function is None:
        return [list(values) for values in zip(*iterables)] if len(iterables) > 1 else list(iterables[0])
    return [function(*values) for values in zip(*iterables)]


def range(*limits):
    """Python 2's: a list."""
    import builtins

    return list(builtins.range(*limits))


xrange = range

from .lar import larExtrude, larSimplexGrid  # noqa: E402  pyplasm has these two itself


def cumsum(values):
    """Sums of the first values of a sequence."""
    import itertools

    return itertools.accumulate(values)


_private = {
    "builtins",
    "np",
    "cmath",
    "itertools",
    "segments",
    "appearance",
    "curves",
    "fl",
    "geometry",
    "primitives",
    "maps",
    "assemblies",
    "boxes",
    "booleans",
    "shapes",
    "constructs",
    "legacy",
    "lar",
}
__all__ = [name for name in globals() if not name.startswith("_") and name not in _private]
