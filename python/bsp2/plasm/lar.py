"""The functions of lar-cc and larlib that programs use most, by their definitions.

A model is a pair (V, CV): points, and cells as lists of indices of points, counted from 0. Programs import
these from larcc, lar2psm, simplexn, largrid, mapper, sysml, boolean, splines, ...: where those are not
installed, all of these names are this module (`python3 -m bsp2.plasm`).
"""

import collections.abc
import functools
import itertools
import math

import numpy as np

from ._complex import Hpc, from_cells
from .appearance import COLOR, WHITE
from .curves import (
    BERNSTEINBASIS,
    BEZIER,
    BEZIERMANIFOLD,
    BEZIERSURFACE,
    BILINEARSURFACE,
    BIQUADRATICSURFACE,
    COONSPATCH,
    HERMITESURFACE,
    TENSORPRODSOLID,
    TENSORPRODSURFACE,
    _at,
    _combination,
    _rational,
    _spline_weights,
)
from .fl import S1
from .geometry import CUBOID, MKPOL, POLYLINE, R, S, STRUCT, SIZE, T


# Models and complexes.
class Model:
    """A model as an object: points `verts`, cells, and the number of coordinates. Unpacks to a pair."""

    def __init__(self, pair):
        self.verts, self.cells = pair
        self.n = len(self.verts[0])

    def __getitem__(self, index):
        return (self.verts, self.cells)[index]


class Struct(collections.abc.Sequence):
    """An assembly: models, and maps (matrices) of all that follow them."""

    def __init__(self, data=None, name=None, category=None):
        self.name, self.category = name, category
        self.body = [] if data is None else list(data)

    def __getitem__(self, index):
        return self.body[index]

    def __len__(self):
        return len(self.body)


def larModelBreak(model):
    points, cells = (model.verts, model.cells) if isinstance(model, Model) else (model[0], model[1])
    return [list(map(float, point)) for point in points], [list(map(int, cell)) for cell in cells]


def MKPOLS(model):
    """Each cell of a model as a complex: the hull of its points."""
    points, cells = larModelBreak(struct2lar(model) if isinstance(model, Struct) else model)
    coordinates = np.array(points)
    return [from_cells(coordinates[cell], [range(len(cell))]) for cell in cells]


def CCOMB(points):
    """The mean of points."""
    return np.mean(np.array(points, float), axis=0).tolist()


def EXPLODE(sx, sy, sz):
    """Moves complexes apart: their centres are scaled."""
    factors = [sx, sy, sz]

    def exploded(scene):
        result = []
        for pol in scene:
            centre = pol.points_and_cells()[0].mean(axis=0)
            shift = [(f - 1) * c for f, c in zip(factors, centre)]
            result.append(T(list(range(1, len(shift) + 1)))(shift)(pol))
        return STRUCT(result)

    return exploded


# Grids, extrusions, products.
def larExtrude(model, pattern):
    """A simplicial model swept along a new axis, in steps; negative steps are gaps."""
    points, cells = model
    size = len(cells[0])
    heights = [0] + list(itertools.accumulate(abs(step) for step in pattern))
    result = []
    for layer, step in enumerate(pattern):
        if step <= 0:
            continue
        for cell in cells:
            tube = [v + k * len(points) for k in (layer, layer + 1) for v in cell]
            result.extend(tube[i : i + size + 1] for i in range(size))
    return [list(v) + [z] for z in heights for v in points], result


larExtrude1 = larExtrude


def larSimplexGrid(shape):
    """A grid of unit cubes, each in simplices: a point, swept along one axis after the other."""
    return functools.reduce(lambda grid, steps: larExtrude(grid, [1] * steps), shape, ([[]], [[0]]))


larSimplexGrid1 = larSimplexGrid


def larSimplexFacets(simplices):
    """The facets of simplices, each once, sorted: of n corners all n - 1."""
    own = (itertools.combinations(sorted(simplex), len(simplex) - 1) for simplex in simplices)
    return [list(facet) for facet in sorted(set(itertools.chain.from_iterable(own)))]


def larSplit(length):
    """The n + 1 points that divide a length."""
    return lambda n: [[k * float(length) / n] for k in range(n + 1)]


def grid0(n):
    return [[k] for k in range(n + 1)]


def grid1(n):
    return [[k, k + 1] for k in range(n)]


def larGrid(n):
    return lambda d: [grid0, grid1][d](n)


def larVertProd(lists):
    return [list(itertools.chain.from_iterable(points)) for points in itertools.product(*lists)]


def index2addr(shape):
    weights = [math.prod(shape[k + 1 :]) for k in range(len(shape))]
    return lambda index: sum(a * b for a, b in zip(index, weights))


def larCellProd(lists):
    sizes = [len(cells) + 1 if len(cells[0]) > 1 else len(cells) for cells in lists]
    address = index2addr(sizes)
    return [[address(corner) for corner in itertools.product(*cells)] for cells in itertools.product(*lists)]


def larImageVerts(shape):
    return [list(point) for point in itertools.product(*(range(n + 1) for n in shape))]


def larGridSkeleton(shape):
    """The cells of a dimension of a grid of cubes."""

    def skeleton(d):
        kinds = [kind for kind in itertools.product((0, 1), repeat=len(shape)) if sum(kind) == d]
        return [cell for kind in kinds for cell in larCellProd([larGrid(n)(k) for n, k in zip(shape, kind)])]

    return skeleton


def gridSkeletons(shape):
    return [larGridSkeleton(shape)(d) for d in range(len(shape) + 1)]


def larCuboids(shape, full=False):
    """A grid of unit cubes; full: its cells of all dimensions."""
    shape = list(shape)
    return larImageVerts(shape), gridSkeletons(shape) if full else larGridSkeleton(shape)(len(shape))


def larModelProduct(pair):
    """The product of two models: all pairs of points, equal ones once, and of cells."""
    (first, cells1), (second, cells2) = map(larModelBreak, pair)
    places = {}
    numbers = [places.setdefault((*a, *b), len(places)) for a, b in itertools.product(first, second)]
    numbers = np.array(numbers).reshape(len(first), len(second))
    cells = [numbers[np.ix_(c, d)].reshape(-1).tolist() for c, d in itertools.product(cells1, cells2)]
    return list(map(list, places)), cells


def larQuote1D(pattern):
    """Segments one after the other; negative lengths are gaps."""
    points = [[x] for x in [0] + list(itertools.accumulate(map(abs, pattern)))]
    return points, [[k, k + 1] for k, length in enumerate(pattern) if length > 0]


def quads2tria(model):
    """Polygons as triangles around their middles."""
    points, cells = larModelBreak(model)
    triangles = []
    for cell in cells:
        corners = np.array([points[v] for v in cell])
        middle = corners.mean(axis=0)
        plane = np.linalg.svd(corners - middle)[2][:2]
        flat = (corners - middle) @ plane.T
        turn = [cell[k] for k in np.argsort(np.arctan2(flat[:, 1], flat[:, 0]))]
        points.append(middle.tolist())
        triangles += [[len(points) - 1, a, b] for a, b in zip(turn, turn[1:] + turn[:1])]
    return points, triangles


# Maps.
def larDomain(shape, cell="cuboid"):
    """The unit box as a model, in as many steps along each axis as `shape` says."""
    points, cells = larSimplexGrid(shape) if cell == "simplex" else larCuboids(shape)
    return [np.divide(points, shape).tolist(), cells]


def larIntervals(shape, cell="cuboid"):
    """The box of a size as a model, in steps."""

    def of_size(size):
        unit = larDomain(shape, cell)
        return [np.multiply(unit[0], size).tolist(), unit[1]]

    return of_size


def larMap(functions):
    """Maps the points of a model by a function, or by one for each coordinate."""

    def mapped(domain, dim=2):
        points, cells = domain
        if isinstance(functions, (list, tuple)):
            return [[[f(point) for f in functions] for point in points], cells]
        return [[functions(point) for point in points], cells]

    return mapped


def t(*vector):
    """The matrix of a translation; translations are in the last column."""
    matrix = np.eye(len(vector) + 1)
    matrix[:-1, -1] = vector
    return matrix


def s(*factors):
    """The matrix of a scaling."""
    return np.diag(list(map(float, factors)) + [1.0])


def r(*args):
    """The matrix of a rotation: by an angle in the plane, or about a vector by its length."""
    if len(args) == 1:
        c, d = math.cos(args[0]), math.sin(args[0])
        return np.array([[c, -d, 0], [d, c, 0], [0, 0, 1]])
    vector = np.array(args, float)
    angle = np.linalg.norm(vector)
    x, y, z = vector / angle if angle else vector
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    matrix = np.eye(4)
    matrix[:3, :3] += math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    return matrix


def larApply(matrix):
    """Moves the points of a model by a matrix."""

    def applied(model):
        if isinstance(model, Struct):
            return Struct([matrix] + model.body)
        points, cells = larModelBreak(model)
        homogeneous = np.column_stack([np.array(points, float), np.ones(len(points))])
        moved = (homogeneous @ np.asarray(matrix, float).T)[:, :-1].tolist()
        return Model((moved, cells)) if isinstance(model, Model) else (moved, cells)

    return applied


def larTranslate(vector):
    return lambda points: [[x + v for x, v in zip(point, vector)] for point in points]


def larScale(factors):
    return lambda points: [[x * f for x, f in zip(point, factors)] for point in points]


def larRotate(angle):
    return lambda points: (np.array(points, float) @ r(angle)[:2, :2].T).tolist()


def evalStruct(structure):
    """The models of an assembly, moved."""
    result = []

    def walk(body, matrix):
        for part in body:
            if isinstance(part, Struct):
                walk(part.body, matrix)
            elif isinstance(part, np.ndarray) and part.ndim == 2 and part.shape[0] == part.shape[1]:
                matrix = part if matrix is None else matrix @ part
            else:
                result.append(part if matrix is None else larApply(matrix)(part))

    walk(structure.body, None)
    return result


def struct2lar(structure):
    """An assembly as one model; points of equal coordinates (to 1e-7) are one."""
    points, cells = {}, []
    for model in evalStruct(structure):
        own, faces = larModelBreak(model)
        index = [points.setdefault(_code(point), len(points)) for point in own]
        cells += [[index[v] for v in face] for face in faces]
    return [list(point) for point in points], cells


STRUCT2LAR = struct2lar


def _code(point):
    return tuple(round(x, 7) + 0.0 for x in point)


def vcode(precision=7):
    """A function of a point: its coordinates, rounded, as text. Of a point: the text, with 7 digits."""
    if isinstance(precision, (list, tuple, np.ndarray)):
        return vcode(7)(precision)
    return lambda point: "[" + ", ".join(str(round(float(x), precision) + 0.0) for x in point) + "]"


# Topology.
def larFacets(model, dim=3, emptyCellNumber=0):
    """The faces of dimension dim - 1 that two cells share."""
    points, cells = model[0], model[1]
    solid = len(cells) - emptyCellNumber
    at = {}
    for i, cell in enumerate(cells):
        for v in cell:
            at.setdefault(v, []).append(i)
    shared = {}
    for members in at.values():
        for i, j in itertools.combinations(members, 2):
            shared[i, j] = shared.get((i, j), 0) + 1
    facets = set()
    for (i, j), times in shared.items():
        if times >= dim and min(i, j) < solid:
            facets.add(tuple(sorted(set(cells[i]) & set(cells[j]))))
    return points, [list(facet) for facet in sorted(facets)]


def larCuboidsFacets(model):
    """The facets of cuboids, each once."""
    points, cells = model
    facets = set()
    for cell in cells:
        for k in range(len(points[0])):
            turn = sorted(cell, key=lambda v: points[v][k])
            half = len(cell) // 2
            facets |= {tuple(turn[:half]), tuple(turn[half:])}
    return points, [list(facet) for facet in sorted(facets)]


def boundaryCells(cells, facets):
    """Which facets bound an odd number of cells."""
    return boundaryOfChain(cells, facets)(range(len(cells)))


def boundaryOfChain(cells, facets):
    def bounding(chain):
        own = [set(cells[c]) for c in chain]
        return [k for k, facet in enumerate(facets) if sum(set(facet) <= cell for cell in own) % 2]

    return bounding


def lar2boundaryFaces(cells, facets):
    return boundaryCells(cells, facets)


def lar2InteriorFaces(cells, facets):
    return set(range(len(facets))) - set(boundaryCells(cells, facets))


def vertexSieve(first, second):
    """Two models over one list of points: those of the first alone, common ones, those of the second alone.

    Gives points, the cells of each, and the number of common points. Points equal to 1e-7 are one.
    """
    (v1, c1), (v2, c2) = first, second
    codes1, codes2 = [_code(p) for p in v1], [_code(p) for p in v2]
    set1, set2 = set(codes1), set(codes2)
    order = [c for c in dict.fromkeys(codes1) if c not in set2]
    common = [c for c in dict.fromkeys(codes1) if c in set2]
    order += common + [c for c in dict.fromkeys(codes2) if c not in set1]
    place = {code: k for k, code in enumerate(order)}
    cells1 = [sorted(place[codes1[v]] for v in cell) for cell in c1]
    cells2 = [sorted(place[codes2[v]] for v in cell) for cell in c2]
    return [list(code) for code in order], cells1, cells2, len(common)


# Diagrams of assemblies.
def assemblyDiagramInit(shape):
    """A grid of blocks with given sizes along three axes."""

    def diagram(sizes):
        lines = [[[x] for x in [0] + list(itertools.accumulate(row))] for row in sizes]
        return larVertProd(lines), larCuboids(shape)[1]

    return diagram


def unitDiagram(diagram, size=(1, 1, 1)):
    points, cells = diagram
    largest = max(points)
    return [[x / m * f for x, m, f in zip(point, largest, size)] for point in points], cells


def diagram2cellMatrix(diagram):
    """The map of a diagram's box to the box of a cell of another one."""

    def matrix(master, cell):
        low, high = np.array(min(diagram[0]), float), np.array(max(diagram[0]), float)
        corners = [master[0][v] for v in master[1][cell]]
        to_low, to_high = np.array(min(corners), float), np.array(max(corners), float)
        factors = (to_high - to_low) / (high - low)
        result = s(*factors)
        result[:-1, -1] = to_low - factors * low
        return result

    return matrix


def diagram2cell(diagram, master, cell):
    """The master diagram with a diagram in the place of a cell."""
    diagram = larApply(diagram2cellMatrix(diagram)(master, cell))(diagram)
    points, own, new, common = vertexSieve(master, diagram)
    first, count = len(master[0]), len(master[0]) - common + len(diagram[0])
    shared, added = set(range(first - common, first)), range(first, count)

    def with_new_points(face):
        if not shared & set(face):
            return face
        low, high = min(points[v] for v in face), max(points[v] for v in face)
        return face + [v for v in added if all(a <= x <= b for a, x, b in zip(low, points[v], high))]

    own = [with_new_points(face) for face in own]
    return points, own[:cell] + own[cell + 1 :] + new


def exteriorCells(diagram):
    """The points on each side of a diagram's box."""
    points, _ = diagram
    low, high = min(points), max(points)
    sides = [[k for k, p in enumerate(points) if p[h] == low[h]] for h in range(len(low))]
    return sides + [[k for k, p in enumerate(points) if p[h] == high[h]] for h in range(len(low))]


def cellNumbering(model, pol):
    """A complex with the number of each chosen cell of a model, in a colour, at the mean of its points."""

    def numbered(chosen, color=WHITE, scalingFactor=1):
        letters = [size * scalingFactor for size in (0.1, 0.2, 0.025)]
        write = TEXTWITHATTRIBUTES("centre", 0, *letters)
        middles = {cell: CCOMB([model[0][v] for v in model[1][cell]]) for cell in chosen}
        labels = [T([1, 2, 3])(middle)(write(str(cell))) for cell, middle in middles.items()]
        return Hpc([pol, COLOR(color)(Hpc(labels))])

    return numbered


# Text, in strokes on a grid of 4 x 6 as of seven segments, with diagonals where letters need them.
_SEGMENTS = {
    "0": "abcdef", "1": "bc", "2": "abged", "3": "abgcd", "4": "fgbc", "5": "afgcd", "6": "afgedc",
    "7": "abc", "8": "abcdefg", "9": "abcdfg", "A": "abcefg", "B": "abcdefg", "C": "adef", "D": "abcdef",
    "E": "adefg", "F": "aefg", "G": "acdef", "H": "bcefg", "I": "jm", "J": "bcde", "K": "efkn", "L": "def",
    "M": "bcefhk", "N": "bcefhn", "O": "abcdef", "P": "abefg", "Q": "abcdefn", "R": "abefgn", "S": "acdfg",
    "T": "ajm", "U": "bcdef", "V": "efkl", "W": "bcefln", "X": "hkln", "Y": "hkm", "Z": "adkl", "-": "g",
    "+": "gjm", "_": "d", "=": "dg", "/": "kl", "\\": "hn", "|": "jm", "*": "ghjklmn", ".": "d", ",": "l",
    ":": "jm", " ": "",
}  # fmt: skip
_STROKES = {
    "a": [[0, 6], [4, 6]], "b": [[4, 6], [4, 3]], "c": [[4, 3], [4, 0]], "d": [[0, 0], [4, 0]],
    "e": [[0, 0], [0, 3]], "f": [[0, 3], [0, 6]], "g": [[0, 3], [4, 3]], "h": [[0, 6], [2, 3]],
    "j": [[2, 6], [2, 3]], "k": [[4, 6], [2, 3]], "l": [[2, 3], [0, 0]], "m": [[2, 3], [2, 0]],
    "n": [[2, 3], [4, 0]],
}  # fmt: skip
FONTWIDTH, FONTHEIGHT, FONTSPACING = 4.0, 8.0, 1.0


def _letter(character):
    strokes = [POLYLINE(_STROKES[name]) for name in _SEGMENTS.get(character.upper(), "adbcef")]
    return STRUCT(strokes) if strokes else MKPOL([[[0.0, 0.0]], [[1]], None])


def charpols(characters):
    return [_letter(character) for character in characters]


def TEXT(text):
    return STRUCT([part for pol in charpols(text) for part in (pol, T(1)(FONTSPACING + FONTWIDTH))])


def TEXTWITHATTRIBUTES(TEXTALIGNMENT="centre", TEXTANGLE=0, TEXTWIDTH=1.0, TEXTHEIGHT=2.0, TEXTSPACING=0.25):
    """A function of a text: a complex of its letters."""
    scale = S([1, 2])([TEXTWIDTH / FONTWIDTH, TEXTHEIGHT / FONTHEIGHT])

    def written(text):
        line = STRUCT(
            [part for pol in charpols(text) for part in (scale(pol), T(1)(TEXTSPACING + TEXTWIDTH))]
        )
        shift = {"centre": -0.5, "right": -1.0}.get(TEXTALIGNMENT, 0.0) * SIZE(1)(line)
        return R([1, 2])(TEXTANGLE)(T(1)(shift)(line))

    return written


# Splines and boxes.
def larBezier(parameter):
    return BEZIER(parameter)


def larBezierCurve(controls):
    return BEZIER(S1)(controls)


def larDom(knots, tics=32):
    """The segment as long as the knots of a spline reach, from 0, in `tics` parts for each whole unit."""
    length = knots[-1] - knots[0]
    parts = tics * int(length)
    return [np.linspace(0.0, length, parts + 1)[:, None].tolist(), grid1(parts)]


def TBSPLINE(parameter):
    """A B-spline by a coordinate, of control points or functions of a point."""

    def of_degree(degree):
        def of_knots(knots):
            def of(controls):
                count = len(controls)
                first, last = knots[degree], knots[count]

                def curve(point):
                    weights = _spline_weights(knots, degree, count, first, last, parameter(point))
                    return _combination(weights, _at(controls, point))

                return curve

            return of

        return of_knots

    return of_degree


def NURBS(parameter):
    """A rational B-spline by a coordinate; the last coordinate of control points is the weight."""

    def of_degree(degree):
        def of_knots(knots):
            def of(controls):
                curve = TBSPLINE(parameter)(degree)(knots)(controls)
                return lambda point: _rational(curve(point))

            return of

        return of_knots

    return of_degree


larCoonsPatch = COONSPATCH
larBernsteinBasis = BERNSTEINBASIS
larTensorProdSurface = TENSORPRODSURFACE
larBilinearSurface = BILINEARSURFACE
larBiquadraticSurface = BIQUADRATICSURFACE
larHermiteSurface = HERMITESURFACE
larBezierSurface = BEZIERSURFACE
larTensorProdSolid = TENSORPRODSOLID
larBezierManifold = BEZIERMANIFOLD


def larBox(low, high):
    """A box as a model of one cell."""
    points, cells = larCuboids([1] * len(low))
    return [[a + x * (b - a) for a, b, x in zip(low, high, point)] for point in points], cells


def VIEWLAR(model):
    from .appearance import VIEW

    VIEW(STRUCT(MKPOLS(model)))


def larCircle(radius=1.0, angle=2 * math.pi):
    def circle(shape=36):
        n = shape if isinstance(shape, int) else shape[0]
        return larMap(lambda p: [radius * math.cos(p[0]), radius * math.sin(p[0])])(
            larIntervals([n])([angle])
        )

    return circle


def larBlock(*size):
    return larBox([0] * len(size), list(size))


def larCuboid(size):
    return CUBOID(size)
