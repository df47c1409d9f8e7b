"""All that needs the kernel, in three functions: the cells of an expression, its content, and what is written
of it.

Solids are given as expressions: ("union" | "intersection" | "difference" | "symmetric_difference", operands),
or lists of (points, matrices): hulls of points (k, d), each moved by homogeneous matrices (m, d+1, d+1) whose
first row and column are the homogeneous ones. What the kernel finds wrong is a bsp2.Error.
"""

import os
import pathlib
import sys
import warnings

import numpy as np

import bsp2


def evaluate(expression, dimension):
    """Convex cells of a solid: a list of arrays (cells, points, dimension), one for each number of points."""
    result = _found(expression, dimension)
    inside = np.flatnonzero(result.labels == bsp2.IN)
    starts = result.point_offsets.astype(np.int64)
    sizes = np.diff(starts)[inside]
    first = starts[:-1][inside]
    points = result.points
    return [points[first[sizes == n][:, None] + np.arange(n)] for n in np.unique(sizes)]


def volume(expression, dimension):
    """The content of a solid."""
    return _found(expression, dimension, measures_only=True).volume


def save(expression, dimension, path):
    """Writes a solid: .csg is the model, .h5 a snapshot, .pvtu its cells, .stl, .ply, .obj, .vtp its surface,
    .png, .svg, .pdf a picture of it."""
    ending = pathlib.Path(path).suffix.lower()
    if ending == ".csg":
        pathlib.Path(path).write_text(model(expression, dimension).to_text())
    elif ending == ".h5":
        _found(expression, dimension, snapshot=path)
    else:
        _found(expression, dimension).save(path)


def model(expression, dimension):
    """The expression as one of the module."""
    if isinstance(expression, tuple):
        name, operands = expression
        return getattr(bsp2, name)([model(operand, dimension) for operand in operands])
    hulls = []
    for points, matrices in expression:
        hull = bsp2.polytope(points)
        for matrix in matrices:
            is_moved = not np.array_equal(matrix, np.eye(dimension + 1))
            hulls.append(hull.transform(_rows(matrix, dimension)) if is_moved else hull)
    return bsp2.union(hulls)


def _rows(matrix, dimension):
    """The matrix as the module has it: the translation in the last column."""
    rows = np.eye(dimension + 1)
    rows[:dimension, :dimension] = matrix[1:, 1:]
    rows[:dimension, dimension] = matrix[1:, 0]
    return rows


def _found(expression, dimension, **options):
    """The result, by this process alone: programs do not know of others."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", bsp2.ModelWarning)
        result = bsp2.evaluate(model(expression, dimension), ranks=bsp2.Ranks(), **options)
    for sentence in result.warnings:
        if sentence != "the solid is empty":  # nothing odd for a program that goes on with it
            warnings.warn(sentence, bsp2.ModelWarning, stacklevel=_depth_of_program())
    return result


def _depth_of_program():
    """How far above the caller the program's own line is, as `stacklevel`."""
    here = os.path.dirname(__file__)
    frame, depth = sys._getframe(1), 1
    while frame.f_back is not None and os.path.dirname(frame.f_code.co_filename) == here:
        frame, depth = frame.f_back, depth + 1
    return depth
