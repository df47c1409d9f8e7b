"""Complexes together: assemblies, hulls, products, skeletons."""

import builtins
import math

import numpy as np

from . import _complex
from ._complex import Hpc
from .fl import ISPOL
from .maps import TRANSLATE


def STRUCT(parts):
    """All complexes of a list together; a map moves all that follow it. Cells that overlap stay."""
    if not isinstance(parts, (list, tuple)):
        raise TypeError(f"STRUCT takes a list of complexes and maps, not {type(parts).__name__}")
    if not len(parts):
        raise ValueError("STRUCT of an empty list: it needs a complex")
    for part in parts:
        if not (isinstance(part, Hpc) or callable(part)):
            raise TypeError(f"STRUCT takes complexes and maps of complexes, not {type(part).__name__}")
    result = None
    level, maps = [], []
    for part in reversed(parts):
        if isinstance(part, Hpc):
            if maps:
                result, level, maps = _moved(maps, level, result), [], []
            level.append(part)
        elif level or result is not None:
            maps.append(part)
    if maps:
        result, level = _moved(maps, level, result), []
    pieces = level[::-1] + ([result] if result is not None else [])
    if not pieces:
        raise ValueError("STRUCT needs a complex; there are maps only")
    return Hpc(pieces)


def _moved(maps, level, rest):
    """What follows a run of maps (the last one first here), moved by them."""
    pieces = level[::-1] + ([rest] if rest is not None else [])
    pol = Hpc(pieces)
    for function in maps:
        pol = function(pol)
    return pol


def LOCATE(triple):
    """[complex, axis, distances]: the complex at each distance from where it was before."""
    pol, axis, distances = triple
    return STRUCT([TRANSLATE(axis)(place)(pol) for place in np.cumsum(distances, axis=0)])


def JOIN(pols):
    """The hull of complexes."""
    return _complex.hull([pols] if ISPOL(pols) else list(pols))


def POWER(pair):
    """Of two complexes all pairs of a point of each (their Cartesian product); of two numbers the power."""
    if len(pair) != 2:
        raise ValueError(f"POWER takes two complexes, or two numbers: a list of 2, not of {len(pair)}")
    complexes = sum(ISPOL(factor) for factor in pair)
    if complexes == 1:
        raise TypeError("POWER takes two complexes, or two numbers, not one of each")
    return (_complex.product if complexes else math.pow)(*pair)


def SKELETON(dimension):
    """The faces of a dimension of all cells."""
    return lambda pol: pol.skeleton(int(dimension))


SKEL_0, SKEL_1, SKEL_2, SKEL_3, SKEL_4, SKEL_5, SKEL_6, SKEL_7, SKEL_8, SKEL_9 = map(
    SKELETON, builtins.range(10)
)
