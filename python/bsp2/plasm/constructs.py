"""What is made of complexes: prisms, pyramids, extrusions, sweeps, offsets, grids."""

import builtins
import math

import numpy as np

from . import _complex
from ._complex import Batch, Hpc
from .assemblies import POWER, SKELETON, SKEL_1
from .booleans import XOR
from .boxes import DIM, RN, _limits
from .fl import MEANPOINT, UNITVECT, VECTPROD, reduce
from .maps import EMBED, MAT, PROJECT, ROTATE, S, T, TRANSLATE, Tensor
from .primitives import CUBOID, MK, POLYLINE, Q, QUOTE, UKPOL, UKPOLF, _box, _points
from .shapes import CONE, MY_CYLINDER


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
