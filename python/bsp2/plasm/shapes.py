"""Round things by their polygons, and bodies that are regular."""

import builtins
import math

import numpy as np

from . import _complex
from ._complex import Batch, Hpc
from .assemblies import JOIN
from .fl import PERMUTATIONS, PI
from .maps import MAP, T
from .primitives import CONVEXHULL, MK, Q, TRIANGLEFAN, _box


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
