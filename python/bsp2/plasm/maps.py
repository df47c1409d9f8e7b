"""Maps of complexes: affine, projective, and by functions."""

import builtins
import math

import numpy as np

from . import _complex
from ._complex import Hpc
from .fl import CONS
from .primitives import _list


class Tensor:
    """An affine map of complexes, as T, S, R and MAT give it: a function, with its homogeneous `matrix`."""

    def __init__(self, matrix):
        self.matrix = matrix

    def __call__(self, pol):
        if not isinstance(pol, Hpc):
            raise TypeError(f"a transformer takes a complex, not {type(pol).__name__}")
        return Hpc([pol], self.matrix)


def _identity(axes, values):
    """The identity for a map of axes, and pairs of an axis and its value. Axis 0 is passed over."""
    names, amounts = [int(axis) for axis in _list(axes)], _list(values)
    return np.eye(max(names) + 1), [(axis, float(amount)) for axis, amount in zip(names, amounts) if axis > 0]


def TRANSLATE(axes):
    """Moves along axes, counted from 1: T(3)(h), T([1, 2])([x, y])."""

    def by(values):
        matrix, pairs = _identity(axes, values)
        for axis, amount in pairs:
            matrix[axis, 0] = amount
        return Tensor(matrix)

    return by


T = TRANSLATE


def SCALE(axes):
    """Stretches along axes; negative factors mirror."""

    def by(values):
        matrix, pairs = _identity(axes, values)
        for axis, amount in pairs:
            matrix[axis, axis] = amount
        return Tensor(matrix)

    return by


S = SCALE


def ROTATE(plane):
    """Turns the first axis of a plane towards the second: R([1, 2])(angle)."""

    def by(angle):
        i, j = int(plane[0]), int(plane[1])
        matrix = np.eye(max(i, j) + 1)
        cosine, sine = math.cos(angle), math.sin(angle)
        if abs(cosine) < 1e-15 or abs(sine) < 1e-15:  # a multiple of a right angle, which PI is not exactly
            cosine, sine = float(round(cosine)), float(round(sine))
        matrix[i, i], matrix[j, i], matrix[i, j], matrix[j, j] = cosine, sine, -sine, cosine
        return Tensor(matrix)

    return by


R = ROTATE


def MAT(matrix):
    """The map of a homogeneous matrix, whose first row and column are the homogeneous ones."""
    matrix = np.array(matrix, float)
    if np.array_equal(matrix[0], np.eye(len(matrix))[0]):
        return Tensor(matrix)
    if not matrix[0, 1:].any() and matrix[0, 0]:
        return Tensor(matrix / matrix[0, 0])

    def projective(pol):
        def moved(point):
            image = _complex.embedded(matrix, max(len(matrix) - 1, len(point))) @ np.array(
                [1.0] + list(point)
            )
            return (image[1:] / image[0]).tolist()

        return pol.mapped(moved)

    return projective


def SHEARING(axis):
    """Shears along an axis by multiples of the other coordinates, in their order."""

    def by(vector):
        matrix = np.eye(len(vector) + 2)
        matrix[axis, [i for i in builtins.range(1, len(vector) + 2) if i != axis]] = vector
        return Tensor(matrix)

    return by


H = SHEARING


def EMBED(more):
    """The complex in a space of so many more coordinates."""
    return lambda pol: Hpc([pol], None, None, pol.space_dim + int(more))


def MAP(function):
    """Maps the corners of all cells by a function of a point, or by a list of one for each coordinate."""
    if isinstance(function, (list, tuple)):
        function = CONS(function)
    return lambda pol: pol.mapped(function)


GMAP = MAP


def PROJECT(less):
    """Leaves out the last coordinates."""
    return lambda pol: pol.mapped(lambda point: point[:-less])


def MIRROR(axis):
    """A complex together with its mirror image along an axis."""
    mirror = SCALE(axis)(-1).matrix
    return lambda pol: Hpc([Hpc([pol], mirror), pol])
