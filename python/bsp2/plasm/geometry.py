"""Complexes: primitives, maps, assemblies, products, hulls, skeletons, Booleans, boxes."""

import builtins
import math
import os
import warnings

import numpy as np

from . import _cells, _complex, _files, _kernel, _partition
from ._complex import Batch, Hpc
from .fl import (
    CONS,
    INNERPROD,
    ISNUM,
    ISPOL,
    ISSEQOF,
    MEANPOINT,
    PERMUTATIONS,
    PI,
    UNITVECT,
    VECTPROD,
    reduce,
)

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
    """A complex together with its mirror image along an axis."""
    mirror = SCALE(axis)(-1).matrix
    return lambda pol: Hpc([Hpc([pol], mirror), pol])


# Assemblies.
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


# Numbers, vectors and complexes.
def _entrywise(function, values, name):
    """What a function of a list of numbers gives for numbers, for the entries of vectors, of matrices, ..."""
    if all(ISNUM(value) for value in values):
        return function(values)
    if not all(isinstance(value, (list, tuple, np.ndarray)) for value in values):
        raise TypeError(f"{name} takes numbers, vectors, matrices or complexes, not {values!r}")
    return [_entrywise(function, entries, name) for entries in zip(*values)]


def SUM(values):
    """The sum of numbers, vectors, matrices; the union of complexes."""
    return UNION(values) if ISPOL(values[0]) else _entrywise(sum, values, "SUM")


ADD = SUM


def DIFF(values):
    """The difference of numbers, vectors, matrices or complexes; of one number its negative."""
    if ISNUM(values):
        return -values
    if ISPOL(values[0]):
        return DIFFERENCE(values)
    return _entrywise(lambda numbers: numbers[0] - sum(numbers[1:]), values, "DIFF")


def PROD(values):
    """The product of numbers, of two vectors (inner), of two complexes."""
    values = list(values)
    for test, product in ((ISPOL, POWER), (ISNUM, math.prod), (ISSEQOF(ISNUM), INNERPROD)):
        if all(map(test, values)) and (product is not INNERPROD or len(values) == 2):
            return product(values)
    raise TypeError(f"PROD multiplies numbers, two vectors or two complexes, not {values!r}")


def SQR(value):
    """The square of a number, or of what a function gives."""
    return (lambda at: SQR(value(at))) if callable(value) else PROD([value, value])


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


# Round things, by their polygons.
def _circle(radius, n):
    """Corners (n, 2) of a regular polygon, the first one on the first axis."""
    return np.stack(_polar(_parts(2 * PI, n)[:-1], radius), axis=1)


def _polar(angle, radius):
    return radius * np.cos(angle), radius * np.sin(angle)


def _parts(length, n):
    """The ends of n equal parts of a segment from 0. Less than nothing has none: lengths of gaps are
    negative."""
    return np.arange(int(n) + 1) * (float(length) / n) if length >= 0 else np.zeros(0)


def _net(function, *axes):
    """The complex of a net: `function` maps arrays of coordinates, one for each axis, to one for each
    coordinate of the images; cells are the hulls of the images of the corners of boxes."""
    return _patches(np.stack(np.broadcast_arrays(*function(*np.meshgrid(*axes, indexing="ij"))), axis=-1))


def _patches(points):
    """The complex of hulls of neighbours in an array of points (.., coordinates)."""
    sizes = points.shape[:-1]
    ends = [
        points[tuple(slice(end, end + max(0, size - 1)) for end, size in zip(corner, sizes))]
        for corner in np.ndindex(*[2] * len(sizes))
    ]
    cells = np.stack(ends, axis=-2).reshape(-1, len(ends), points.shape[-1])
    return _complex.leaf([Batch(cells, np.arange(len(cells)))], points.shape[-1])


def CIRCLE_POINTS(radius, n):
    """The corners of the regular n-gon in a circle, the first one on the first axis."""
    return _circle(radius, n).tolist()


def CIRCUMFERENCE(radius):
    """The circle, as the n edges of a regular polygon."""

    def circumference(n):
        corners = _circle(radius, n)
        return _complex.segments(np.stack([corners, np.roll(corners, -1, axis=0)], axis=1))

    return circumference


def NGON(n):
    return CIRCUMFERENCE(1)(n)


def RING(radii):
    """The ring between two circles, in n parts around and m across."""
    inner, outer = radii
    return lambda parts: _net(_polar, _parts(2 * PI, parts[0]), inner + _parts(outer - inner, parts[1]))


def TUBE(args):
    """The prism over a ring in n parts: [inner radius, outer radius, height]."""
    inner, outer, height = args

    def polar(angle, radius, z):
        return *_polar(angle, radius), z

    return lambda n: _net(polar, _parts(2 * PI, n), inner + _parts(outer - inner, 1), _parts(height, 1))


def CIRCLE(radius):
    """The disk, in n parts around and m across."""
    return RING([0.0, radius])


def MY_CYLINDER(args):
    """The prism over a regular n-gon: [radius, height]."""
    radius, height = args
    return lambda n: _complex.product(CONVEXHULL(_circle(radius, n)), Q(height))


CYLINDER = MY_CYLINDER


def SPHERE(radius):
    """The surface of a ball, in n parts from pole to pole and m around."""

    def at(latitude, turn):
        around = radius * np.cos(latitude)
        return around * np.sin(turn), around * np.cos(turn), radius * np.sin(latitude)

    return lambda parts: _net(at, _parts(PI, parts[0]) - PI / 2, _parts(2 * PI, parts[1]) - PI)


def TORUS(radii):
    """The surface of a ring with an inner and an outer radius, in n parts around and m around its section."""
    middle, section = sum(radii) / 2, (radii[1] - radii[0]) / 2

    def at(turn, angle):
        across, z = _polar(angle, section)
        return *_polar(turn, middle + across), z

    return lambda parts: _net(at, *(_parts(2 * PI, n) for n in parts))


def CONE(args):
    """The pyramid over a regular n-gon: [radius, height]."""
    radius, height = args

    def cone(n):
        base = np.pad(_circle(radius, n), ((0, 0), (0, 1)))
        return CONVEXHULL(np.concatenate([base, [[0.0, 0.0, height]]]))

    return cone


def TRUNCONE(args):
    """The surface of a frustum: [lower radius, upper radius, height]."""
    lower, upper, height = args

    def at(turn, part):
        return *_polar(turn, lower + part * (upper - lower)), part * height

    return lambda n: _net(at, _parts(2 * PI, n), _parts(1, 1))


def _dodecahedron():
    """A cube with a roof on each face: the ridges are edges, and the edges of the cube diagonals of faces."""
    golden, half = (math.sqrt(5) - 1) / 2, 1 / math.sqrt(3)
    eaves = np.array([[x, y, 1.0] for x in (-1, 1) for y in (-1, 1)])
    roof = np.concatenate([eaves, [[-golden, 0.0, 1 + golden], [golden, 0.0, 1 + golden]]])
    roofs = [np.roll(roof * [1, 1, side], axis, axis=1) for axis in builtins.range(3) for side in (-1, 1)]
    cells = np.arange(6 * len(roof)).reshape(6, -1)
    return Hpc([_box([-half] * 3, [half] * 3), _complex.from_cells(half * np.concatenate(roofs), cells)])


def _icosahedron():
    """The hull of three golden rectangles, each across the next one."""
    golden, half = (math.sqrt(5) - 1) / 2, 2 / 5**0.75
    rectangle = half * np.array([[x * golden, y, 0.0] for x in (-1, 1) for y in (-1, 1)])
    return CONVEXHULL(np.concatenate([np.roll(rectangle, axis, axis=1) for axis in builtins.range(3)]))


DODECAHEDRON = _dodecahedron()
ICOSAHEDRON = _icosahedron()
TETRAHEDRON = JOIN([T(3)(-1.0 / 3.0)(NGON(3)), MK([0, 0, 1])])


def CROSSPOLYTOPE(dimension):
    points = np.concatenate([np.eye(dimension), -np.eye(dimension)])
    return _complex.from_cells(points, [list(builtins.range(2 * dimension))])


OCTAHEDRON = CROSSPOLYTOPE(2)


def PERMUTAHEDRON(dimension):
    """The hull of all orders of 1, ..., d + 1 as points, around the origin: turned by 45 degrees from each
    axis to the last one, and without the last coordinate then."""
    points = np.array(PERMUTATIONS(builtins.range(dimension + 1)), float) - dimension / 2
    for axis in builtins.range(dimension):
        x, last = points[:, axis].copy(), points[:, -1].copy()
        points[:, axis], points[:, -1] = (x - last) / math.sqrt(2), (x + last) / math.sqrt(2)
    return CONVEXHULL(points[:, :-1])


def STAR(n):
    """A star with n points, as a fan of triangles."""
    inner = [[math.cos(a), math.sin(a)] for a in (2 * PI / n * i for i in builtins.range(1, n + 1))]
    outer = [
        [2.5 * math.cos(a), 2.5 * math.sin(a)]
        for a in (PI / n + 2 * PI / n * i for i in builtins.range(1, n + 1))
    ]
    return TRIANGLEFAN([point for pair in zip(inner, outer) for point in pair])


def _perspective(axis, distance):
    """Points from the origin onto the hyperplane at a distance along an axis, without that coordinate."""
    return MAP(lambda point: (distance / point[axis] * np.array(point[:axis])).tolist())


def SCHLEGEL2D(distance):
    """The perspective of space from the origin, onto the plane z = distance."""
    return _perspective(2, distance)


def SCHLEGEL3D(distance):
    return _perspective(3, distance)


# What is made of complexes.
def EXTRUDE(triple):
    """The product with a segment: [unused, complex, height]."""
    return _complex.product(triple[1], Q(triple[2]))


def MULTEXTRUDE(pol):
    return lambda height: _complex.product(pol, Q(height))


def PRISM(height):
    return lambda base: _complex.product(base, QUOTE([height]))


def FINITECONE(pol):
    """The hull of a complex and the origin."""
    return _complex.hull([pol, MK(np.zeros(RN(pol)))])


def PYRAMID(height):
    """The hull of a complex and a point at a height above the mean of its corners."""

    def pyramid(base):
        corners, _ = base.points_and_cells()
        return _complex.hull([MK([*corners.mean(axis=0), height]), base])

    return pyramid


def SPLITCELLS(pol):
    """The cells of a complex, each a complex."""
    points, cells = pol.points_and_cells()
    return [_complex.from_cells(points[cell], [list(builtins.range(len(cell)))]) for cell in cells]


SPLITPOLS = SPLITCELLS


def EXTRACT_WIRES(pol):
    return SPLITCELLS(SKEL_1(pol))


def MESH(lengths):
    """The product of the QUOTEs of lists of lengths."""
    return reduce(_complex.product, map(QUOTE, lengths))


def NU_GRID(data):
    """The product of the polylines of lists of points."""
    return reduce(_complex.product, map(POLYLINE, data))


def POLYMARKER(kind, MARKERSIZE=0.1):
    """A mark at each point of a list, in the plane of the first two axes: 0 a diamond, 1 a cross, 2 a square,
    3 to 5 two of these together."""
    tips = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
    square = tips + np.roll(tips, -1, axis=0)
    diamond, frame = (np.stack([c, np.roll(c, -1, axis=0)], axis=1) for c in (tips, square))
    strokes = [diamond, square[[[0, 2], [1, 3]]], frame]
    parts = [(0,), (1,), (2,), (0, 1), (0, 2), (1, 2)][int(kind) % 6]
    mark = MARKERSIZE * np.concatenate([strokes[part] for part in parts])

    def marked(points):
        places = _points(points)
        size = max(2, places.shape[1])
        places = np.pad(places, ((0, 0), (0, size - places.shape[1])))
        ends = places[:, None, None] + np.pad(mark, ((0, 0), (0, 0), (0, size - 2)))
        return _complex.segments(ends.reshape(-1, 2, size))

    return marked


def ROTN(pair):
    """The turn by an angle about a vector through the origin."""
    angle, axis = pair
    x, y, z = axis = np.array(UNITVECT(axis))
    if x == 0 and y == 0:
        return ROTATE([1, 2])(angle)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    matrix = np.eye(4)
    matrix[1:, 1:] += math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    return Tensor(matrix)


MKVERSORK = Hpc([MY_CYLINDER([0.01, 0.875])(6), T(3)(0.875)(CONE([0.0625, 0.125])(8))])


def MKVECTOR(first):
    """An arrow from a point to a point."""

    def arrow(second):
        along = np.subtract(second, first)
        length = math.hypot(*along)
        turn = ROTN([math.acos(along[2] / length), [-along[1], along[0], 0.0]]).matrix
        place = np.eye(4)
        place[1:, 0] = first
        place[1:, 1:] = length * _complex.embedded(turn, 3)[1:, 1:]
        return Hpc([MKVERSORK], place)

    return arrow


def PLANE(points):
    """[normal, point, a rectangle of the plane around the point] of three points."""
    origin, *others = np.array(points, float)
    sides = [other - origin for other in others]
    normal = UNITVECT(VECTPROD(sides))
    half = [math.hypot(*side) for side in sides]
    turn = ROTN([math.acos(normal[2]), [-normal[1], normal[0], 0.0]])
    square = turn(_box([-half[0], -half[1]], half))
    return [normal, points[0], TRANSLATE([1, 2, 3])(origin)(square)]


def RIF(size):
    """The axes as boxes, a hundredth as thick as they are long: red, green and blue."""
    from .appearance import BLUE, COLOR, GREEN, RED

    lengths = size * (0.01 + 0.99 * np.eye(3))
    return Hpc([COLOR(color)(CUBOID(sides)) for color, sides in zip((RED, GREEN, BLUE), lengths)])


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
    return lambda pol: reduce(lambda swept, vector: SWEEP(vector)(swept), reversed(vectors), pol)


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


def _screw(dimension, angle, rise):
    """The matrix of a turn in the plane of the last two of so many axes (if there are two), and of a step
    along the next axis."""
    matrix = np.eye(dimension + 2)
    if dimension > 1:
        matrix[dimension - 1 : dimension + 1, dimension - 1 : dimension + 1] = ROTATE([1, 2])(angle).matrix[
            1:, 1:
        ]
    matrix[dimension + 1, 0] = rise
    return matrix


def _between(pol, *matrices):
    """The complex of the hulls of the images of each cell by all of some maps, in one dimension more. Cells
    with fewer dimensions than others are passed over."""
    space, pieces = pol.space_dim + 1, []
    maps = [_complex.embedded(matrix, space) for matrix in matrices]
    for batch in SKELETON(DIM(pol))(pol).cells()[0]:
        points = np.pad(batch.points, ((0, 0), (0, 0), (0, 1)))
        images = [points @ matrix[1:, 1:].T + matrix[1:, 0] for matrix in maps]
        pieces.append(Batch(np.concatenate(images, axis=1), batch.order))
    return _complex.leaf(pieces, space)


def EXTRUSION(angle):
    """Layers of height 1/height, each turned by a part of an angle."""

    def of_height(height):
        def extruded(pol):
            dim = DIM(pol)
            layer = _between(pol, np.eye(dim + 2), _screw(dim, angle / height, 1.0 / height))
            steps = [_screw(dim, angle * k / height, k / height) for k in builtins.range(int(height))]
            return Hpc([Hpc([layer], step) for step in steps], space_dim=layer.space_dim)

        return extruded

    return of_height


def _prisms(pol, pair, lean=0.0):
    """The prisms of unit height over the cells of a complex, moved to be from one height to another along
    the next axis, and sheared along the first one."""
    dim = DIM(pol)
    unit = _between(pol, np.eye(dim + 2), _screw(dim, 0.0, 1.0))
    matrix = _screw(dim, 0.0, pair[0])
    matrix[1, -1] = lean
    matrix[-1, -1] = pair[1] - pair[0]
    return Hpc([unit], matrix)


def EX(pair):
    """The prism over a complex, from one height to another along the next axis."""
    return lambda pol: _prisms(pol, pair)


def LEX(pair):
    """EX, its upper end moved along the first axis by as much as it is high."""
    return lambda pol: _prisms(pol, pair, pair[1] - pair[0])


def SEX(pair):
    """Layers over a complex, each turned, by as much in all as they are high; the first one is turned back
    by the first of the pair."""
    back, total = pair[0], pair[1] - pair[0]

    def of_layers(number):
        def extruded(pol):
            matrix = _screw(DIM(pol), -back, 0.0)
            matrix[-1, -1] = total
            return Hpc([EXTRUSION(total)(number)(pol)], matrix)

        return extruded

    return of_layers


def POLAR(pol, precision=1e-6):
    """The polar of the cells: of each half-space a x + b y + ... <= d the point [a/d, b/d, ...]."""
    faces, cells, _ = UKPOLF(pol)
    faces = np.array(faces).reshape(-1, pol.space_dim + 1)
    away = np.where(np.abs(faces[:, :1]) >= precision, -faces[:, :1], 1.0)
    return _complex.from_cells(faces[:, 1:] / away, [np.array(cell) - 1 for cell in cells])


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
