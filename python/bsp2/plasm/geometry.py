"""Complexes: primitives, maps, assemblies, products, hulls, skeletons, Booleans, boxes."""

import builtins
import math
import os
import warnings

import numpy as np

from . import _cells, _complex, _files, _kernel, _partition
from ._complex import Batch, Hpc
from .fl import (
    AA,
    COMP,
    CONS,
    ID,
    ISNUM,
    ISPOL,
    ISSEQOF,
    MATHOM,
    MEANPOINT,
    PERMUTATIONS,
    PI,
    RAISE,
    UNITVECT,
    VECTDIFF,
    VECTNORM,
    VECTPROD,
    VECTSUM,
    INNERPROD,
    INSL,
    reduce,
)

DEFAULT_TOLERANCE = 1e-6
DEFAULT_MAX_NUM_SPLIT = 10
DEFAULT_USE_OCTREE_PLANES = True


class PlasmConfig:
    """The tolerances of pyplasm's kernel: kept for programs that set them, used by nothing, since ours is
    exact."""

    def __init__(self):
        self.stack = [(DEFAULT_TOLERANCE, DEFAULT_MAX_NUM_SPLIT, DEFAULT_USE_OCTREE_PLANES)]

    def tolerance(self):
        return self.stack[-1][0]

    def maxnumtry(self):
        return self.stack[-1][1]

    def useOctreePlanes(self):
        return self.stack[-1][2]

    def push(self, tolerance, maxnumtry=-1, useoctreeplanes=True):
        self.stack.append((tolerance, maxnumtry if maxnumtry >= 0 else self.maxnumtry(), useoctreeplanes))

    def pop(self):
        if len(self.stack) == 1:
            raise Exception("Cannot pop the default configuration")
        self.stack.pop()


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
    sizes = [float(size) for size in sizes]
    return Hpc([_cube(len(sizes))], np.diag([1.0] + sizes))


def CUBE(side):
    return CUBOID([side, side, side])


def _box(low, high):
    low, high = np.asarray(low, float), np.asarray(high, float)
    matrix = np.diag(np.concatenate([[1.0], high - low]))
    matrix[1:, 0] = low
    return Hpc([_cube(len(low))], matrix)


HEXAHEDRON = _box([-1 / math.sqrt(3)] * 3, [1 / math.sqrt(3)] * 3)


def SIMPLEX(dimension):
    """The simplex with corners at the origin and at 1 on each axis."""
    corners = np.concatenate([np.zeros((1, dimension)), np.eye(dimension)])
    shape = _cells.simplex_shape(dimension)
    return _complex.leaf([Batch(corners[None], np.zeros(1, int), dimension, shape)], dimension)


def MKPOL(triple):
    """The complex of hulls: [points, cells, pols]; cells count points from 1, pols are not used."""
    points, cells = triple[0], triple[1]
    points = np.array([[float(value) for value in point] for point in points])
    if points.ndim != 2:
        raise ValueError("MKPOL: all points need equally many coordinates")
    return _complex.from_cells(*_there(points, cells, 1))


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
    return MKPOL([[point], [[1]], [[1]]])


def CONVEXHULL(points):
    return MKPOL([points, [list(builtins.range(1, len(points) + 1))], [[1]]])


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
    return lambda n: QUOTE([float(length) / float(n)] * int(n))


def POLYPOINT(points):
    return MKPOL([points, [[i + 1] for i in builtins.range(len(points))], None])


def POLYLINE(points):
    """Segments from each point to the next."""
    points = np.array([[float(value) for value in point] for point in points])
    return _complex.segments(np.stack([points[:-1], points[1:]], axis=1))


def TRIANGLESTRIPE(points):
    cells = [[i, i + 1, i + 2] if i % 2 == 0 else [i + 1, i, i + 2] for i in builtins.range(len(points) - 2)]
    return _complex.from_cells(points, cells)


def TRIANGLEFAN(points):
    return _complex.from_cells(points, [[0, i - 1, i] for i in builtins.range(2, len(points))])


# Maps.
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
    return lambda pol: STRUCT([SCALE(axis)(-1)(pol), pol])


# Assemblies.
def STRUCT(parts):
    """All complexes of a list together; a map moves all that follow it. Cells that overlap stay."""
    if not isinstance(parts, (list, tuple)):
        raise TypeError("STRUCT must be applied to a list")
    if not len(parts):
        raise ValueError("STRUCT must be applied to a not empty list")
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
    pol, axis, distances = triple
    return STRUCT([part for distance in distances for part in (T(axis)(distance), pol)])


def JOIN(pols):
    """The hull of complexes."""
    return _complex.hull([pols] if ISPOL(pols) else list(pols))


def POWER(pair):
    """The product of two complexes, or the power of two numbers."""
    if len(pair) != 2:
        raise ValueError("POWER can only be applied to a list of 2 arguments")
    if ISNUM(pair[0]) and ISNUM(pair[1]):
        return math.pow(pair[0], pair[1])
    return _complex.product(pair[0], pair[1])


def SKELETON(dimension):
    """The faces of a dimension of all cells."""
    return lambda pol: pol.skeleton(int(dimension))


SKEL_0, SKEL_1, SKEL_2, SKEL_3, SKEL_4, SKEL_5, SKEL_6, SKEL_7, SKEL_8, SKEL_9 = map(
    SKELETON, builtins.range(10)
)


# Numbers, vectors and complexes.
def SUM(values):
    """The sum of numbers, vectors, matrices; the union of complexes."""
    if ISPOL(values[0]):
        return UNION(values)
    if ISNUM(values[0]):
        return sum(values)
    if isinstance(values[0], (list, tuple)):
        return AA(VECTSUM)(zip(*values)) if isinstance(values[0][0], (list, tuple)) else VECTSUM(values)
    raise TypeError(f"'+' function has been applied to {values!r}!")


ADD = SUM


def DIFF(values):
    """The difference of numbers, vectors, matrices or complexes; of one number its negative."""
    if ISNUM(values):
        return -1 * values
    if ISPOL(values[0]):
        return DIFFERENCE(values)
    if ISNUM(values[0]):
        return reduce(lambda a, b: a - b, values)
    if isinstance(values[0], (list, tuple)):
        return AA(VECTDIFF)(zip(*values)) if isinstance(values[0][0], (list, tuple)) else VECTDIFF(values)
    raise TypeError(f"'-' function has been applied to {values!r}!")


def PROD(values):
    """The product of numbers, of two vectors (inner), of two complexes."""
    values = list(values)
    if ISPOL(values[0]):
        return POWER(values)
    if ISSEQOF(ISNUM)(values):
        return reduce(lambda a, b: a * b, values)
    if len(values) == 2 and ISSEQOF(ISNUM)(values[0]) and ISSEQOF(ISNUM)(values[1]):
        return INNERPROD(values)
    raise TypeError(f"PROD function has been applied to {values!r}!")


def SQR(value):
    """The square of a number, or of what a function gives."""
    return RAISE(RAISE(PROD))([ID, ID])(value)


# Booleans.
def _solids(pol, dimension):
    """What is solid of a complex, as the kernel takes it: hulls, each with its places."""
    result = []
    if pol.space_dim < dimension:
        return result
    for places in pol.places():
        arrays = [places.matrices] + [batch.points for batch in places.leaf.batches]
        if not all(np.isfinite(array).all() for array in arrays):
            raise ValueError("a coordinate of a complex is not a finite number")
        for batch in places.leaf.batches:
            if batch.points.shape[2] < dimension:
                continue
            if batch.dimension is not None:
                chosen = np.arange(len(batch.points)) if batch.dimension == dimension else ()
            else:
                chosen = np.flatnonzero(batch.frames()[0] == dimension)
            matrices = places.matrices[np.abs(np.linalg.det(places.matrices[:, 1:, 1:])) > 0]
            if len(matrices):
                result.extend((batch.points[i], matrices) for i in chosen)
    return result


def _boolean(name, pols):
    pols = [pols] if ISPOL(pols) else list(pols)
    if not pols or not all(ISPOL(pol) for pol in pols):
        raise TypeError(f"a {name.replace('_', ' ')} takes a list of complexes, not {pols}")
    dimension = max(pol.space_dim for pol in pols)
    operands = [_solids(pol, dimension) for pol in pols]
    if not any(operands):
        return _flat_boolean(name, pols, dimension)
    result = _evaluated(name, operands, dimension)
    result.edges = lambda: _partition.edges(name, pols, dimension)
    return result


def _evaluated(name, operands, dimension):
    if name == "difference" and not operands[0] or name == "intersection" and not all(operands):
        return _complex.leaf([], dimension)
    batches, at = [], 0
    for points in _kernel.evaluate((name, [operand for operand in operands if operand]), dimension):
        batches.append(Batch(points, np.arange(at, at + len(points)), dimension))
        at += len(points)
    return _complex.leaf(batches, dimension)


def _flat_boolean(name, pols, dimension):
    """Of what lies in one plane (line, ...) of its space: there it is solid."""
    pols = [EMBED(dimension - pol.space_dim)(pol) for pol in pols]
    points = [batch.points.reshape(-1, dimension) for pol in pols for batch in pol.cells()[0]]
    if not points:
        return _complex.leaf([], dimension)
    points = np.concatenate(points)
    rank, basis = _cells.frames(points[None])
    r = int(rank[0])
    if r == dimension or r == 0 or max(pol.point_dim() for pol in pols) < r:
        return _complex.leaf([], dimension)
    origin = points[0]
    basis = basis[0][:, :r]
    flat = [pol.mapped(lambda point: ((np.array(point) - origin) @ basis).tolist()) for pol in pols]
    result = _evaluated(name, [_solids(pol, r) for pol in flat], r)
    return result.mapped(lambda point: (origin + basis @ np.array(point)).tolist())


def UNION(pols):
    """The union of what is solid. Plane pieces of one plane in space are united there."""
    return _boolean("union", pols)


def INTERSECTION(pols):
    return _boolean("intersection", pols)


def DIFFERENCE(pols):
    """The first without the others."""
    return _boolean("difference", pols)


def XOR(pols):
    """What is in an odd number of complexes."""
    return _boolean("symmetric_difference", pols)


def VOLUME(pol):
    """The content of what is solid, overlaps counted once."""
    solids = _solids(pol, RN(pol))
    return _kernel.volume(("union", [solids]), pol.space_dim) if solids else 0.0


def SAVE(path):
    """Writes a complex, in the format that the name's ending says, and gives it back.

    .vtu has all cells as they are. Of what is solid .stl, .ply, .obj, .vtp have the surface, .pvtu and .h5
    the cells, .csg the model, .png, .svg and .pdf a picture; of a complex without anything solid .obj has its
    faces and lines.
    """

    def save(pol):
        ending = os.path.splitext(path)[1].lower()
        solids = _solids(pol, RN(pol))
        if ending == ".vtu":
            _files.write_vtu(pol, path)
        elif ending == ".obj" and not solids:
            _files.write_obj(pol, path)
        elif not solids:
            raise ValueError(
                f"nothing of the complex is solid: a .vtu or .obj file can have it, {path} cannot"
            )
        else:
            _kernel.save(("union", [solids]), pol.space_dim, path)
        return pol

    return save


# Boxes.
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


TOP = ALIGN([[3, MAX, MIN], [1, MED, MED], [2, MED, MED]])
BOTTOM = ALIGN([[3, MIN, MAX], [1, MED, MED], [2, MED, MED]])
LEFT = ALIGN([[1, MIN, MAX], [3, MIN, MIN]])
RIGHT = ALIGN([[1, MAX, MIN], [3, MIN, MIN]])
UP = ALIGN([[2, MAX, MIN], [3, MIN, MIN]])
DOWN = ALIGN([[2, MIN, MAX], [3, MIN, MIN]])

NORTH = CONS([CONS([MAX(1), MAX(2)]), CONS([MIN(1), MIN(2)])])
SOUTH = CONS([CONS([MIN(1), MIN(2)]), CONS([MAX(1), MIN(2)])])
WEST = CONS([CONS([MIN(1), MAX(2)]), CONS([MIN(1), MIN(2)])])
EAST = CONS([CONS([MAX(1), MIN(2)]), CONS([MAX(1), MAX(2)])])


def _to_origin(x, y):
    return lambda pol: STRUCT([T([1, 2])([-x(1)(pol), -y(2)(pol)]), pol])


MXMY, MXBY, MXTY = _to_origin(MED, MED), _to_origin(MED, MIN), _to_origin(MED, MAX)
LXMY, RXMY = _to_origin(MIN, MED), _to_origin(MAX, MED)


# Round things, by their polygons.
def CIRCLE_POINTS(radius, n):
    return [
        [radius * math.cos(i * 2 * PI / n), radius * math.sin(i * 2 * PI / n)] for i in builtins.range(int(n))
    ]


def CIRCUMFERENCE(radius):
    return lambda n: MAP(lambda p: [radius * math.cos(p[0]), radius * math.sin(p[0])])(INTERVALS(2 * PI)(n))


def NGON(n):
    return CIRCUMFERENCE(1)(n)


def _polar(p):
    return [p[1] * math.cos(p[0]), p[1] * math.sin(p[0])]


def RING(radii):
    """The ring between two circles, in n parts around and m across."""

    def ring(parts):
        first, second = radii
        domain = POWER([INTERVALS(2 * PI)(parts[0]), INTERVALS(second - first)(parts[1])])
        return MAP(_polar)(T(2)(first)(domain))

    return ring


def TUBE(args):
    inner, outer, height = args
    return lambda n: POWER([RING([inner, outer])([n, 1]), QUOTE([height])])


def CIRCLE(radius):
    """The disk, in n parts around and m across."""
    return lambda parts: MAP(_polar)(POWER([INTERVALS(2 * PI)(parts[0]), INTERVALS(radius)(parts[1])]))


def MY_CYLINDER(args):
    """The prism over a regular n-gon: [radius, height]."""

    def cylinder(n):
        radius, height = args
        base = _complex.from_cells(CIRCLE_POINTS(radius, n), [list(builtins.range(int(n)))])
        return POWER([base, _complex.from_cells([[0.0], [float(height)]], [[0, 1]])])

    return cylinder


CYLINDER = MY_CYLINDER


def SPHERE(radius):
    """The surface of a ball, in n parts from pole to pole and m around."""

    def sphere(parts):
        n, m = parts
        domain = T([1, 2])([-PI / 2, -PI])(POWER([INTERVALS(PI)(n), INTERVALS(2 * PI)(m)]))
        return MAP(
            lambda p: [
                radius * math.cos(p[0]) * math.sin(p[1]),
                radius * math.cos(p[0]) * math.cos(p[1]),
                radius * math.sin(p[0]),
            ]
        )(domain)

    return sphere


def TORUS(radii):
    """The surface of a ring with an inner and an outer radius, in n parts around and m around its section."""

    def torus(parts):
        inner, outer = radii
        n, m = parts
        a, c = 0.5 * (outer - inner), 0.5 * (inner + outer)
        return MAP(
            lambda p: [
                (c + a * math.cos(p[1])) * math.cos(p[0]),
                (c + a * math.cos(p[1])) * math.sin(p[0]),
                a * math.sin(p[1]),
            ]
        )(POWER([INTERVALS(2 * PI)(n), INTERVALS(2 * PI)(m)]))

    return torus


def CONE(args):
    """The pyramid over a regular n-gon: [radius, height]."""
    radius, height = args
    return lambda n: JOIN([CIRCLE(radius)([n, 1]), MK([0, 0, height])])


def TRUNCONE(args):
    """The surface of a frustum: [lower radius, upper radius, height]."""
    lower, upper, height = args

    def truncone(n):
        def side(p):
            radius = lower + p[1] * (upper - lower)
            return [radius * math.cos(p[0]), radius * math.sin(p[0]), height * p[1]]

        return MAP(side)(POWER([INTERVALS(2 * PI)(n), QUOTE([1])]))

    return truncone


def _dodecahedron():
    a, g = 1 / math.sqrt(3), 0.5 * (math.sqrt(5) - 1)
    ridge = MKPOL([[[1 - g, 1, -g], [1 + g, 1, -g]], [[1, 2]], [[1]]])
    roof = T([1, 2, 3])([-1, -1, -1])(JOIN([EMBED(1)(CUBOID([2, 2])), ridge]))
    pair = STRUCT([roof, R([2, 3])(PI), roof])
    parts = [_box([-1] * 3, [1] * 3), pair, R([1, 3])(PI / 2), R([1, 2])(PI / 2), pair, R([1, 2])(PI / 2)]
    return S([1, 2, 3])([a, a, a])(STRUCT(parts + [R([2, 3])(PI / 2), pair]))


def _icosahedron():
    g = 0.5 * (math.sqrt(5) - 1)
    b = 2 / math.sqrt(5 * math.sqrt(5))
    x = T([1, 2])([-g, -1])(CUBOID([2 * g, 2]))
    y = R([1, 3])(PI / 2)(R([1, 2])(PI / 2)(x))
    z = R([2, 3])(PI / 2)(R([1, 2])(PI / 2)(x))
    return S([1, 2, 3])([b, b, b])(JOIN([x, y, z]))


DODECAHEDRON = _dodecahedron()
ICOSAHEDRON = _icosahedron()
TETRAHEDRON = JOIN([T(3)(-1.0 / 3.0)(NGON(3)), MK([0, 0, 1])])


def CROSSPOLYTOPE(dimension):
    points = np.concatenate([np.eye(dimension), -np.eye(dimension)])
    return _complex.from_cells(points, [list(builtins.range(2 * dimension))])


OCTAHEDRON = CROSSPOLYTOPE(2)


def PERMUTAHEDRON(dimension):
    points = PERMUTATIONS(list(builtins.range(1, dimension + 2)))
    middle = MEANPOINT(points)
    pol = T(list(builtins.range(1, dimension + 2)))([-value for value in middle])(CONVEXHULL(points))
    for i in builtins.range(1, dimension + 1):
        pol = R([i, dimension + 1])(PI / 4)(pol)
    return PROJECT(1)(pol)


def STAR(n):
    """A star with n points, as a fan of triangles."""
    inner = [[math.cos(a), math.sin(a)] for a in (2 * PI / n * i for i in builtins.range(1, n + 1))]
    outer = [
        [2.5 * math.cos(a), 2.5 * math.sin(a)]
        for a in (PI / n + 2 * PI / n * i for i in builtins.range(1, n + 1))
    ]
    return TRIANGLEFAN([point for pair in zip(inner, outer) for point in pair])


def SCHLEGEL2D(distance):
    return MAP(lambda p: [distance * p[0] / p[2], distance * p[1] / p[2]])


def SCHLEGEL3D(distance):
    return MAP(lambda p: [distance * p[0] / p[3], distance * p[1] / p[3], distance * p[2] / p[3]])


# What is made of complexes.
def EXTRUDE(triple):
    """The product with a segment: [unused, complex, height]."""
    _, pol, height = triple
    return POWER([pol, Q(height)])


def MULTEXTRUDE(pol):
    return lambda height: POWER([pol, Q(height)])


def PRISM(height):
    return lambda base: POWER([base, QUOTE([height])])


def FINITECONE(pol):
    return JOIN([pol, MK([0] * RN(pol))])


def PYRAMID(height):
    return lambda pol: JOIN([MK(MEANPOINT(UKPOL(pol)[0]) + [height]), pol])


def SPLITCELLS(pol):
    """The cells of a complex, each a complex."""
    points, cells = pol.points_and_cells()
    return [_complex.from_cells(points[cell], [list(builtins.range(len(cell)))]) for cell in cells]


SPLITPOLS = SPLITCELLS


def EXTRACT_WIRES(pol):
    return SPLITCELLS(SKEL_1(pol))


def MESH(lengths):
    return INSL(RAISE(PROD))([QUOTE(value) for value in lengths])


def NU_GRID(data):
    return INSL(RAISE(PROD))([POLYLINE(points) for points in data])


def POLYMARKER(kind, MARKERSIZE=0.1):
    """A marker at each point of a list."""
    a, b = MARKERSIZE, -MARKERSIZE
    diamond = _complex.from_cells([[a, 0], [0, a], [b, 0], [0, b]], [[0, 1], [1, 2], [2, 3], [3, 0]])
    square = [[a, a], [b, a], [b, b], [a, b]]
    cross = _complex.from_cells(square, [[0, 2], [1, 3]])
    frame = _complex.from_cells(square, [[0, 1], [1, 2], [2, 3], [3, 0]])
    markers = [diamond, cross, frame, Hpc([diamond, cross]), Hpc([diamond, frame]), Hpc([cross, frame])]

    def marked(points):
        axes = list(builtins.range(1, len(points[0]) + 1))
        return Hpc([T(axes)(point)(markers[kind % 6]) for point in points])

    return marked


def ROTN(pair):
    """The turn by an angle about a vector through the origin."""
    angle, axis = pair
    axis = UNITVECT(axis)
    if axis[0] == 0 and axis[1] == 0:
        return R([1, 2])(angle)
    x = UNITVECT(VECTPROD([[0, 0, 1], axis]))
    y = VECTPROD([axis, x])
    to = np.array(MATHOM([x, y, axis]))
    return COMP([MAT(to.T), R([1, 2])(angle), MAT(to)])


MKVERSORK = TOP([CYLINDER([1.0 / 100.0, 7.0 / 8.0])(6), CONE([1.0 / 16.0, 1.0 / 8])(8)])


def MKVECTOR(first):
    """An arrow from a point to a point."""

    def arrow(second):
        u = VECTDIFF([second, first])
        length = VECTNORM(u)
        turn = ROTN([math.acos(INNERPROD([[0, 0, 1], UNITVECT(u)])), VECTPROD([[0, 0, 1], u])])
        return COMP([T([1, 2, 3])(first), turn, S([1, 2, 3])([length] * 3)])(MKVERSORK)

    return arrow


def PLANE(points):
    """[normal, point, a square of the plane] of three points."""
    p0, p1, p2 = points
    v1, v2 = VECTDIFF([p1, p0]), VECTDIFF([p2, p0])
    a, b = VECTNORM(v1), VECTNORM(v2)
    normal = UNITVECT(VECTPROD([v1, v2]))
    angle = math.acos(INNERPROD([[0, 0, 1], normal]))
    square = T([1, 2])([-a, -b])(CUBOID([2 * a, 2 * b]))
    return [normal, p0, T([1, 2, 3])(p0)(ROTN([angle, VECTPROD([[0, 0, 1], normal])])(square))]


def RIF(size):
    from .appearance import BLUE, COLOR, GREEN, RED

    thin = 0.01 * size
    axes = [(RED, [size, thin, thin]), (GREEN, [thin, size, thin]), (BLUE, [thin, thin, size])]
    return Hpc([COLOR(color)(CUBOID(sizes)) for color, sizes in axes])


def SOLIDIFY(pol):
    """The plane region (or solid) that closed lines (or surfaces) bound: what they enclose an odd number of
    times.

    Each cell is swept along the first axis, to beyond the box, and what is covered by an odd number of these
    is kept.
    """
    low, high = _limits(pol)
    far = high[0] + (high[0] - low[0]) * 100
    points, cells = pol.points_and_cells()
    swept = []
    for cell in cells:
        shadow = points[cell].copy()
        shadow[:, 0] = far
        corners = np.concatenate([points[cell], shadow])
        values = np.linalg.svd(corners - corners[0], compute_uv=False)
        if len(values) == pol.space_dim and values[-1] > 1e-12 * values[0]:  # far away makes all of them thin
            swept.append(
                _complex.leaf([Batch(corners[None], np.zeros(1, int), pol.space_dim)], pol.space_dim)
            )
    return XOR(swept) if swept else _complex.leaf([], pol.space_dim)


def SWEEP(vector):
    """All sums of a point and a point of the segment from the origin to a vector."""

    def swept(pol):
        size = max(len(vector), pol.space_dim)
        shift = np.pad(np.array(vector, float), (0, size - len(vector)))
        matrix = np.eye(size + 2)
        matrix[1 : size + 1, size + 1] = shift
        return PROJECT(1)(MAT(matrix)(POWER([EMBED(size - pol.space_dim)(pol), QUOTE([1])])))

    return swept


def MINKOWSKI(vectors):
    """Sweeps along vectors, the last one first."""
    return COMP([SWEEP(vector) for vector in vectors]) if len(vectors) else ID


def OFFSET(sizes):
    """All sums of a point and a point of the box from the origin to `sizes`: each cell becomes one hull."""

    def grown(pol):
        result = pol
        for i, size in enumerate(sizes):
            shear = np.eye(len(sizes) + i + 2)
            shear[i + 1, len(sizes) + i + 1] = size
            result = MAT(shear)(POWER([result, QUOTE([1])]))
        return PROJECT(len(sizes))(result)

    return grown


def EXTRUSION(angle):
    """Layers of height 1/height, each turned by a part of an angle."""

    def of_height(height):
        def extruded(pol):
            dim = DIM(pol)
            step = COMP([T(dim + 1)(1.0 / height), R([dim - 1, dim])(angle / height)])
            cells = [EMBED(1)(cell) for cell in SPLITCELLS(SKELETON(dim)(pol))]
            layer = Hpc([JOIN([cell, step(cell)]) for cell in cells])
            return STRUCT([layer, step] * int(height))

        return extruded

    return of_height


def EX(pair):
    first, second = pair

    def extruded(pol):
        axis = DIM(pol) + 1
        return T(axis)(first)(S(axis)(second - first)(EXTRUSION(0.0)(1.0)(pol)))

    return extruded


def LEX(pair):
    first, second = pair

    def extruded(pol):
        axis = DIM(pol) + 1
        shear = np.eye(axis + 1)
        shear[1, axis] = second - first
        return T(axis)(first)(S(axis)(second - first)(MAT(shear)(EXTRUSION(0)(1)(pol))))

    return extruded


def SEX(pair):
    first, second = pair

    def of_height(height):
        def extruded(pol):
            dim = DIM(pol)
            result = S(dim + 1)(second - first)(EXTRUSION(second - first)(height)(pol))
            return R([dim, dim - 1])(first)(result)

        return extruded

    return of_height


def POLAR(pol, precision=1e-6):
    faces, cells, pols = UKPOLF(pol)
    points = []
    for face in faces:
        by = -face[0] if abs(face[0]) >= precision else 1
        points.append([value / by for value in face[1:]])
    return MKPOL([points, cells, pols])


def FRACTALSIMPLEX(dimension):
    """The corners of a simplex, n times replaced by simplices of half the size."""

    def fractal(n):
        corners = [[0.0] * dimension] + np.eye(dimension).tolist()
        simplices = [corners]
        for _ in builtins.range(n):
            simplices = [
                [pivot if point is pivot else MEANPOINT([point, pivot]) for point in simplex]
                for simplex in simplices
                for pivot in simplex
            ]
        points = np.array(simplices).reshape(-1, dimension)
        size = dimension + 1
        return _complex.from_cells(points, np.arange(len(points)).reshape(-1, size).tolist())

    return fractal


def BOUNDARY(pol, dimension):
    """[points, faces]: faces of a dimension that only one solid cell has, as sorted indices."""
    points, faces, seen = {}, [], {}
    for face in SPLITCELLS(SKELETON(dimension)(pol)):
        corners = tuple(sorted(points.setdefault(tuple(p), len(points)) for p in UKPOL(face)[0]))
        seen[corners] = seen.get(corners, 0) + 1
    faces = [list(corners) for corners, times in seen.items() if times == 1]
    return [[list(p) for p in points], faces]


def SIMPLEXGRID(size):
    """A box in cuboids, each in simplices: SIMPLEXGRID(size)(numbers of steps)."""

    def grid(shape):
        from .lar import larSimplexGrid

        points, cells = larSimplexGrid(shape)
        factors = [float(a) / b for a, b in zip(size, shape)]
        pol = _complex.from_cells(points, cells)
        return S(list(builtins.range(1, len(size) + 1)))(factors)(pol)

    return grid


def FLAT(pol):
    return SPLITCELLS(pol)


def PRINTPOL(pol):
    print(pol)
    return pol
