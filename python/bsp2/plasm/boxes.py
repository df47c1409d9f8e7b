"""Dimensions, boxes, and what is placed by them."""

import numpy as np

from ._complex import Hpc
from .assemblies import STRUCT
from .fl import ISNUM, ISPOL
from .maps import T
from .primitives import _box


def RN(pol):
    """The dimension of the space."""
    if not ISPOL(pol):
        raise TypeError(f"a complex is needed here, not {type(pol).__name__}")
    return pol.space_dim


def DIM(pol):
    """The dimension of the cells."""
    return pol.point_dim()


def ISPOLDIM(pair):
    return lambda pol: pair[0] == DIM(pol) and pair[1] == RN(pol)


def _limits(pol):
    box = pol.box()
    if box is None:
        raise ValueError("a complex without cells has no box")
    return box


def _along(axes, of):
    def measured(pol):
        values = of(*_limits(pol))
        return (
            [float(values[int(i) - 1]) for i in axes]
            if isinstance(axes, (list, tuple))
            else float(values[int(axes) - 1])
        )

    return measured


def SIZE(axes):
    """The size of the box along an axis, or a list of axes."""
    return _along(axes, lambda low, high: high - low)


def MIN(axes):
    return _along(axes, lambda low, high: low)


def MAX(axes):
    return _along(axes, lambda low, high: high)


def MED(axes):
    """The middle of the box."""
    return _along(axes, lambda low, high: (low + high) / 2)


def BOX(axes):
    """The box, or its shadow on axes."""

    def boxed(pol):
        chosen = [int(i) - 1 for i in (axes if isinstance(axes, (list, tuple)) else [axes])]
        low, high = _limits(pol)
        return _box(low[chosen], high[chosen])

    return boxed


def ALIGN(rules):
    """Moves the second of two complexes so that, for each [axis, of the first, of the second], MIN, MED or
    MAX meet."""
    if len(rules) and ISNUM(rules[0]):
        rules = [rules]

    def where(kind, box, axis):
        if axis > len(box[0]):
            return 0.0
        return {MIN: box[0], MAX: box[1]}.get(kind, (box[0] + box[1]) / 2)[axis - 1]

    def aligned(pair):
        first, second = pair
        one, other = _limits(first), _limits(second)
        matrix = np.eye(max(int(axis) for axis, _, _ in rules) + 1)
        for axis, a, b in rules:
            matrix[axis, 0] += where(a, one, axis) - where(b, other, axis)
        return Hpc([first, Hpc([second], matrix)])

    return aligned


def _beside(axis, after, others):
    """ALIGN with the second complex after (or before) the first along an axis; on other axes one place."""
    touching = [axis, MAX, MIN] if after else [axis, MIN, MAX]
    return ALIGN([touching] + [[other, place, place] for other, place in others.items()])


TOP, BOTTOM = (_beside(3, after, {1: MED, 2: MED}) for after in (True, False))
RIGHT, LEFT = (_beside(1, after, {3: MIN}) for after in (True, False))
UP, DOWN = (_beside(2, after, {3: MIN}) for after in (True, False))


def _plane_corners(*chosen):
    """The function of a complex that gives corners of its box's shadow; of each the ends on x and y, 0 the
    low one."""
    return lambda pol: np.array(_limits(pol))[np.array(chosen), [0, 1]].tolist()


NORTH = _plane_corners((1, 1), (0, 0))
SOUTH = _plane_corners((0, 0), (1, 0))
WEST = _plane_corners((0, 1), (0, 0))
EAST = _plane_corners((1, 0), (1, 1))


def _to_origin(x, y):
    return lambda pol: STRUCT([T([1, 2])([-x(1)(pol), -y(2)(pol)]), pol])


MXMY, MXBY, MXTY = _to_origin(MED, MED), _to_origin(MED, MIN), _to_origin(MED, MAX)
LXMY, RXMY = _to_origin(MIN, MED), _to_origin(MAX, MED)
