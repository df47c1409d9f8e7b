"""The names of pyplasm's compiled module that programs use: Plasm, Vecf, Matf, Boxf, and the graph of a grid.
"""

import math

import numpy as np

from . import _complex, appearance, geometry
from ._complex import Hpc

BOOL_CODE_OR, BOOL_CODE_AND, BOOL_CODE_DIFF, BOOL_CODE_XOR = range(4)


class Vecf:
    """Coordinates, the homogeneous one first."""

    def __init__(self, *values):
        if len(values) == 1 and isinstance(values[0], Vecf):
            values = values[0].values
        elif len(values) == 1 and isinstance(values[0], (int, np.integer)):
            values = [0.0] * (int(values[0]) + 1)
        elif len(values) == 1:
            values = values[0]
        self.values = [float(value) for value in values]

    @property
    def dim(self):
        return len(self.values) - 1

    def set(self, index, value):
        self.values[index] = float(value)

    def get(self, index):
        return self.values[index]

    def __len__(self):
        return len(self.values)

    def __getitem__(self, index):
        return self.values[index]

    def __mul__(self, other):
        if isinstance(other, Vecf):
            return sum(a * b for a, b in zip(self.values, other.values))
        return Vecf([value * other for value in self.values])

    __rmul__ = __mul__

    def __add__(self, other):
        return Vecf([a + b for a, b in zip(self.values, other.values)])

    def __sub__(self, other):
        return Vecf([a - b for a, b in zip(self.values, other.values)])

    def __eq__(self, other):
        return isinstance(other, Vecf) and self.values == other.values

    def module(self):
        return math.sqrt(sum(value * value for value in self.values))

    def normalize(self):
        length = self.module()
        return Vecf([value / length if length else value for value in self.values])

    def __repr__(self):
        return f"Vecf({self.values})"


class Vec3f:
    """Three coordinates."""

    def __init__(self, *values):
        values = list(values[0]) if len(values) == 1 else list(values)
        self.x, self.y, self.z = (float(value) for value in (values + [0.0] * 3)[:3])

    def __getitem__(self, index):
        return (self.x, self.y, self.z)[index]

    def cross(self, other):
        return Vec3f(np.cross([*self], [*other]))

    def dot(self, other):
        return sum(a * b for a, b in zip(self, other))

    def __add__(self, other):
        return Vec3f([a + b for a, b in zip(self, other)])

    def __sub__(self, other):
        return Vec3f([a - b for a, b in zip(self, other)])

    def __mul__(self, factor):
        return Vec3f([factor * value for value in self])

    __rmul__ = __mul__

    def module(self):
        return math.sqrt(self.dot(self))

    def normalize(self):
        return self * (1 / self.module()) if self.module() else self

    def __repr__(self):
        return f"Vec3f({self.x}, {self.y}, {self.z})"


class Matf:
    """A homogeneous matrix, its first row and column the homogeneous ones: Matf(dim), Matf(list of all
    entries)."""

    def __init__(self, given):
        if isinstance(given, Matf):
            self.rows = given.rows.copy()
        elif isinstance(given, (int, np.integer)):
            self.rows = np.eye(int(given) + 1)
        else:
            size = math.isqrt(len(given))
            self.rows = np.array(given, float).reshape(size, size)

    @property
    def dim(self):
        return len(self.rows) - 1

    def get(self, i, j):
        return float(self.rows[i, j])

    def set(self, i, j, value):
        self.rows[i, j] = value

    def invert(self):
        result = Matf(self)
        result.rows = np.linalg.inv(self.rows)
        return result

    def __mul__(self, other):
        if isinstance(other, Vecf):
            return Vecf(self.rows @ other.values)
        result = Matf(self)
        result.rows = self.rows @ other.rows
        return result

    def almostIdentity(self, tolerance):
        return bool(np.abs(self.rows - np.eye(len(self.rows))).max() <= tolerance)


class Boxf:
    """A box, with corners p1 and p2 of homogeneous coordinates."""

    def __init__(self, first, second=None):
        self.p1 = first if isinstance(first, Vecf) else Vecf([1.0] + [math.inf] * int(first))
        self.p2 = second if second is not None else Vecf([1.0] + [-math.inf] * self.p1.dim)

    def dim(self):
        return self.p1.dim

    def size(self):
        return self.p2 - self.p1

    def center(self):
        return (self.p1 + self.p2) * 0.5

    def isValid(self):
        return all(a <= b for a, b in zip(self.p1.values, self.p2.values))

    def fuzzyEqual(self, other, tolerance=1e-4):
        pairs = zip(self.p1.values + self.p2.values, other.p1.values + other.p2.values)
        return all(abs(a - b) <= tolerance for a, b in pairs)

    def __eq__(self, other):
        return isinstance(other, Boxf) and self.p1 == other.p1 and self.p2 == other.p2

    def __repr__(self):
        return f"Boxf({self.p1}, {self.p2})"


class Plasm:
    """pyplasm's functions of complexes."""

    @staticmethod
    def cube(dim, From=0.0, To=1.0):
        return geometry._box([From] * dim, [To] * dim)

    simplex = staticmethod(geometry.SIMPLEX)

    @staticmethod
    def Struct(pols):
        return Hpc(pols)

    @staticmethod
    def copy(pol):
        return Hpc([pol])

    @staticmethod
    def getSpaceDim(pol):
        return pol.space_dim

    @staticmethod
    def getPointDim(pol):
        return pol.point_dim()

    @staticmethod
    def transform(pol, vmat, hmat=None):
        return geometry.MAT(vmat.rows)(pol)

    @staticmethod
    def translate(pol, vector):
        return geometry.T(list(range(1, len(vector))))(list(vector.values[1:]))(pol)

    @staticmethod
    def scale(pol, vector):
        return geometry.S(list(range(1, len(vector))))(list(vector.values[1:]))(pol)

    @staticmethod
    def rotate(pol, dim, i, j, angle):
        return geometry.R([i, j])(angle)(geometry.EMBED(max(0, dim - pol.space_dim))(pol))

    @staticmethod
    def embed(pol, dim):
        return Hpc([pol], space_dim=dim)

    @staticmethod
    def limits(pol):
        box = pol.box()
        if box is None:
            return Boxf(pol.space_dim)
        return Boxf(Vecf([1.0] + box[0].tolist()), Vecf([1.0] + box[1].tolist()))

    @staticmethod
    def mkpol(dim, points, cells, tolerance=0.0):
        points = np.array(list(points), float).reshape(-1, dim)
        return _complex.from_cells(*geometry._there(points, cells, 0))

    @staticmethod
    def join(pols, tolerance=0.0):
        return geometry.JOIN(pols)

    @staticmethod
    def power(first, second):
        return geometry.POWER([first, second])

    @staticmethod
    def boolop(code, pols, tolerance=0.0, maxnumtry=0, useoctreeplanes=True):
        return [geometry.UNION, geometry.INTERSECTION, geometry.DIFFERENCE, geometry.XOR][code](pols)

    @staticmethod
    def skeleton(pol, dim, tolerance=0.0):
        return pol.skeleton(dim)

    @staticmethod
    def addProperty(pol, name, value):
        return appearance.with_property(pol, name, value)

    @staticmethod
    def getProperty(pol, name):
        return (pol.props or {}).get(name, "")

    @staticmethod
    def shrink(pol, clone=False):
        """The complex as one node above its cells."""
        batches, _ = pol.cells()
        return Hpc([_complex.leaf([batch], pol.space_dim) for batch in batches])

    @staticmethod
    def view(pol, *_):
        appearance.VIEW(pol)

    View = view

    @staticmethod
    def save(pol, path):
        geometry.SAVE(path)(pol)
        return True

    Print = staticmethod(geometry.PRINTPOL)

    @staticmethod
    def statistics(reset=False):
        return None


def Grid(lists):
    """The grid of lists of lengths, negative ones are gaps."""
    return geometry.MESH(lists)
