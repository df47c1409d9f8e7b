"""Primitives, what makes a complex of points and cells, and gives these back."""

import builtins
import math
import warnings

import numpy as np

from . import _cells, _complex
from ._complex import Batch, Hpc
from .fl import ISNUM

DEFAULT_TOLERANCE = 1e-6
DEFAULT_MAX_NUM_SPLIT = 10
DEFAULT_USE_OCTREE_PLANES = True


class PlasmConfig:
    """The tolerances of pyplasm's kernel: kept for programs that set them, used by nothing, since ours is
    exact."""

    def __init__(self):
        self._settings = [
            {
                "tolerance": DEFAULT_TOLERANCE,
                "maxnumtry": DEFAULT_MAX_NUM_SPLIT,
                "useOctreePlanes": DEFAULT_USE_OCTREE_PLANES,
            }
        ]

    def _setting(name):
        return lambda self: self._settings[-1][name]

    tolerance, maxnumtry, useOctreePlanes = map(_setting, ("tolerance", "maxnumtry", "useOctreePlanes"))
    del _setting

    def push(self, tolerance, maxnumtry=-1, useoctreeplanes=True):
        changed = {"tolerance": tolerance, "useOctreePlanes": useoctreeplanes}
        if maxnumtry >= 0:
            changed["maxnumtry"] = maxnumtry
        self._settings.append({**self._settings[-1], **changed})

    def pop(self):
        *earlier, _ = self._settings
        if not earlier:
            raise IndexError("there is no push to this pop of plasm_config")
        self._settings = earlier


plasm_config = PlasmConfig()


# Primitives.
_cubes = {}


def _cube(dimension):
    """The unit cube, one leaf for all that are made of it."""
    if dimension not in _cubes:
        corners = np.array(list(np.ndindex(*[2] * dimension)), float).reshape(2**dimension, dimension)
        shape = _cells.simplex_shape(0)
        for _ in builtins.range(dimension):
            shape = (
                _cells.product_shape(shape, _cells.simplex_shape(1))
                if shape.dimension
                else _cells.simplex_shape(1)
            )
        _cubes[dimension] = _complex.leaf(
            [Batch(corners[None], np.zeros(1, int), dimension, shape)], dimension
        )
    return _cubes[dimension]


def _list(value):
    return [value] if ISNUM(value) else list(value)


def CUBOID(sizes):
    """The box from the origin to `sizes`."""
    return _box(np.zeros(len(sizes)), sizes)


def CUBE(side):
    return CUBOID([side, side, side])


def _box(low, high):
    low, high = np.asarray(low, float), np.asarray(high, float)
    matrix = np.diag(np.concatenate([[1.0], high - low]))
    matrix[1:, 0] = low
    return Hpc([_cube(len(low))], matrix)


HEXAHEDRON = _box(*np.outer([-1, 1], np.full(3, 1 / math.sqrt(3))))


def SIMPLEX(dimension):
    """The simplex with corners at the origin and at 1 on each axis."""
    corners = np.concatenate([np.zeros((1, dimension)), np.eye(dimension)])
    shape = _cells.simplex_shape(dimension)
    return _complex.leaf([Batch(corners[None], np.zeros(1, int), dimension, shape)], dimension)


def MKPOL(triple):
    """The complex of hulls: [points, cells, pols]; cells count points from 1, pols are not used."""
    return _complex.from_cells(*_there(_points(triple[0]), triple[1], 1))


def _points(points):
    """Points as an array (points, coordinates)."""
    sizes = {len(point) for point in points}
    if len(sizes) != 1:
        raise ValueError(f"points need equally many coordinates, these have {sorted(sizes)}")
    return np.array([[float(value) for value in point] for point in points])


def _there(points, cells, first):
    """Points and cells, as indices from 0. Where cells name no point there is one more, the origin: pyplasm
    reads the memory behind the points, and finds zeros. That is told."""
    cells = [[int(index) - first for index in cell] for cell in cells]
    count = len(points)
    strange = sorted({index + first for cell in cells for index in cell if not 0 <= index < count})
    if strange:
        names = f"point {strange[0]}" if len(strange) == 1 else f"points {', '.join(map(str, strange))}"
        warnings.warn(
            f"cells name {names}, and there are points {first} to {count - 1 + first}: "
            f"{'the origin is taken for it' if len(strange) == 1 else 'the origin is taken for them'}",
            stacklevel=3,
        )
        points = np.concatenate([points, np.zeros((1, points.shape[1]))])
        cells = [[index if 0 <= index < count else count for index in cell] for cell in cells]
    return points, cells


def MK(point):
    """The complex of one point."""
    return CONVEXHULL([point])


def CONVEXHULL(points):
    """The hull of points, as one cell."""
    points = _points(points)
    return _complex.from_cells(points, np.arange(len(points))[None])


def UKPOL(pol):
    """[points, cells, pols] of a complex; each cell has points of its own."""
    points, cells = pol.points_and_cells()
    return [points.tolist(), [[index + 1 for index in cell] for cell in cells], [[1]]]


def UK(pol):
    """The first point of a complex."""
    return UKPOL(pol)[0][0]


def UKPOLF(pol):
    """[faces, cells, pols]: the half-spaces [d, a, b, ...], d + a x + b y + ... <= 0, of all solid cells."""
    dimension, faces, cells = pol.space_dim, [], []
    points, members = pol.points_and_cells()
    for member in members:
        own = points[member]
        rank, _ = _cells.frames(own[None])
        if dimension < 2 or rank[0] < dimension:
            continue
        centre, cell = own.mean(axis=0), []
        for facet in _cells.facets(own):
            corners = own[list(facet)]
            normal = np.linalg.svd(corners - corners.mean(axis=0))[2][-1]
            if normal @ (centre - corners[0]) > 0:
                normal = -normal
            faces.append([-float(normal @ corners[0])] + normal.tolist())
            cell.append(len(faces))
        cells.append(cell)
    return [faces, cells, [[1]]]


def OPTIMIZE(pol):
    return pol


def QUOTE(lengths):
    """Segments one after the other on a line; negative lengths are gaps."""
    lengths = [float(value) for value in lengths]
    ends = np.concatenate([[0.0], np.cumsum(np.abs(lengths))]) if lengths else np.zeros(1)
    kept = np.array([value >= 0 for value in lengths], bool)
    points = np.stack([ends[:-1], ends[1:]], axis=1)[kept][:, :, None]
    solid = points[:, 1, 0] > points[:, 0, 0] if len(points) else np.zeros(0, bool)
    order = np.flatnonzero(kept)
    pieces = [
        Batch(points[solid], order[solid], 1, _cells.simplex_shape(1)),
        Batch(points[~solid][:, :1], order[~solid], 0, _cells.simplex_shape(0)),
    ]
    return _complex.leaf(pieces, 1)


GRID = QUOTE


def Q(value):
    """QUOTE of a list; of a number the segment from 0 to it, which may be negative."""
    if isinstance(value, (list, tuple, np.ndarray)):
        return QUOTE(value)
    return _complex.from_cells([[0.0], [float(value)]], [[0, 1]])


def INTERVALS(length):
    """A segment in n equal parts."""
    return lambda n: QUOTE(np.full(int(n), float(length) / n))


def POLYPOINT(points):
    """The complex of points, each a cell."""
    points = _points(points)
    return _complex.from_cells(points, np.arange(len(points))[:, None])


def POLYLINE(points):
    """Segments from each point to the next."""
    points = np.array([[float(value) for value in point] for point in points])
    return _complex.segments(np.stack([points[:-1], points[1:]], axis=1))


def TRIANGLESTRIPE(points):
    """The triangles of each three points that follow one another, all with one orientation in a zigzag."""
    cells = np.arange(max(0, len(points) - 2))[:, None] + np.arange(3)
    cells[1::2, :2] = cells[1::2, 1::-1].copy()
    return _complex.from_cells(points, cells)


def TRIANGLEFAN(points):
    """The triangles of the first point and each two of the others that follow one another."""
    last = np.arange(2, len(points))
    return _complex.from_cells(points, np.stack([np.zeros_like(last), last - 1, last], axis=1))
