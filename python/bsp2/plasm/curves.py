"""Curves, surfaces and solids as maps of points, and what displays them."""

import builtins
import cmath
import math

import numpy as np

from ._complex import Hpc, segments
from .fl import S1, UNITVECT, VECTPROD
from .geometry import INTERVALS, MAP, POLYLINE, POLYMARKER, T, UKPOL, _patches


def _at(values, point):
    """Control data that may be points or functions of a point."""
    return [value(point) if callable(value) else value for value in values]


def _combination(weights, points):
    return [sum(w * p[i] for w, p in zip(weights, points)) for i in builtins.range(len(points[0]))]


def _rational(point):
    """The point of homogeneous coordinates, the last one the weight."""
    return [value / point[-1] for value in point[:-1]] if point[-1] != 0 else list(point[:-1])


def _bernstein(degree, t):
    return [
        math.comb(degree, i) * math.pow(1 - t, degree - i) * math.pow(t, i)
        for i in builtins.range(degree + 1)
    ]


# Curves.
def BEZIER(parameter):
    """The Bezier curve of control points, or the surface of control curves, by a coordinate:
    BEZIER(S1)(points)."""

    def of(controls):
        controls = list(controls)

        def curve(point):
            return _combination(_bernstein(len(controls) - 1, parameter(point)), _at(controls, point))

        return curve

    return of


def BEZIERCURVE(controls):
    return BEZIER(S1)(controls)


def RATIONALBEZIER(controls):
    curve = BEZIER(S1)(controls)
    return lambda point: _rational(curve(point))


def BERNSTEINBASIS(parameter):
    """The polynomials of Bernstein of a degree."""

    def of_degree(n):
        def polynomial(i):
            return lambda point: _bernstein(n, parameter(point))[i]

        return [polynomial(i) for i in builtins.range(n + 1)]

    return of_degree


def CUBICHERMITE(parameter):
    """The cubic from a point to a point with tangents: [p1, p2, t1, t2]."""

    def of(controls):
        def curve(point):
            u = parameter(point)
            u2, u3 = u * u, u * u * u
            weights = [2 * u3 - 3 * u2 + 1, -2 * u3 + 3 * u2, u3 - 2 * u2 + u, u3 - u2]
            p1, p2, s1, s2 = _at(controls, point)
            return _combination(weights, [p1, p2, s1, s2])

        return curve

    return of


def HERMITE(controls):
    return CUBICHERMITE(S1)(controls)


def CUBICUBSPLINE(domain):
    """A span of the uniform cubic B-spline of four points, over a domain."""

    def of(controls):
        def curve(point):
            u = point[0]
            u2, u3 = u * u, u * u * u
            weights = [-u3 + 3 * u2 - 3 * u + 1, 3 * u3 - 6 * u2 + 4, -3 * u3 + 3 * u2 + 3 * u + 1, u3]
            return _combination([w / 6 for w in weights], _at(controls, point))

        return MAP(curve)(domain)

    return of


def CUBICCARDINAL(domain, h=1):
    """A span of the cardinal spline of four points, over a domain."""

    def of(controls):
        def curve(point):
            u = point[0]
            u2, u3 = u * u, u * u * u
            weights = [
                -h * u3 + 2 * h * u2 - h * u,
                (2 - h) * u3 + (h - 3) * u2 + 1,
                (h - 2) * u3 + (3 - 2 * h) * u2 + h * u,
                h * u3 - h * u2,
            ]
            return _combination(weights, _at(controls, point))

        return MAP(curve)(domain)

    return of


def SPLINE(curve):
    """A spline: `curve` for each four points that follow one another."""
    return lambda points: Hpc([curve(points[i : i + 4]) for i in builtins.range(len(points) - 3)])


def JOINTS(curve):
    """Markers where the spans of a spline meet."""
    from .geometry import MK

    return lambda points: POLYMARKER(2)(UKPOL(SPLINE(curve(MK([0])))(points))[0])


def BSPLINE(degree):
    """The B-spline of a degree over knots: BSPLINE(degree)(knots)(points)."""

    def of_knots(knots):
        def of(controls):
            count = len(controls)
            if len(knots) != count + degree + 1:
                raise ValueError(
                    f"BSPLINE: the number of knots is that of points plus the degree plus 1: "
                    f"{count} + {degree} + 1, not {len(knots)}"
                )
            first, last = knots[degree], knots[count]

            def curve(point):
                return _combination(
                    _spline_weights(knots, degree, count, first, last, point[0]), _at(controls, point)
                )

            return curve

        return of

    return of_knots


def _spline_weights(knots, degree, count, first, last, t):
    # A parameter summed up of parts may miss the ends by roundings, where the spline would end at once.
    slack = 1e-9 * max(abs(first), abs(last), last - first)
    if first - slack <= t < first:
        t = first
    if last < t <= last + slack:
        t = last
    weights = [
        1.0 if knots[i] <= t < knots[i + 1] or (t == last and knots[i] <= t <= knots[i + 1]) else 0.0
        for i in builtins.range(count + degree)
    ]
    for k in builtins.range(1, degree + 1):
        for i in builtins.range(count + degree - k):
            a, b = knots[i + k] - knots[i], knots[i + k + 1] - knots[i + 1]
            left = (t - knots[i]) / a * weights[i] if a else 0.0
            right = (knots[i + k + 1] - t) / b * weights[i + 1] if b else 0.0
            weights[i] = left + right
    return weights[:count]


def RATIONALBSPLINE(degree):
    def of_knots(knots):
        def of(controls):
            curve = BSPLINE(degree)(knots)(controls)
            return lambda point: _rational(curve(point))

        return of

    return of_knots


def _over_knots(spline, parts):
    def of_knots(knots):
        def of(controls):
            first, last = min(knots), max(knots)
            domain = T(1)(first)(INTERVALS(last - first)(parts - 1))
            return MAP(spline(knots)(controls))(domain)

        return of

    return of_knots


def NUBSPLINE(degree, totpoints=80):
    """The complex of a non-uniform B-spline, in totpoints - 1 segments."""
    return _over_knots(BSPLINE(degree), totpoints)


def NURBSPLINE(degree, totpoints=80):
    return _over_knots(RATIONALBSPLINE(degree), totpoints)


def _display(spline, args, marker_size):
    degree, knots, points = args
    corners, _ = spline(degree, len(knots))(knots)(points).points_and_cells()
    marks = {kind: POLYMARKER(kind, marker_size) for kind in (1, 2, 3)}
    shown = [marks[2](corners), POLYLINE(points), marks[1](points)]
    return Hpc([spline(degree)(knots)(points) if degree > 0 else marks[3](points), *shown])


def DISPLAYNUBSPLINE(args, marker_size=0.1):
    """A B-spline with its control polygon and marks at its knots: [degree, knots, points]."""
    return _display(NUBSPLINE, args, marker_size)


def DISPLAYNURBSPLINE(args, marker_size=0.1):
    return _display(NURBSPLINE, args, marker_size)


def ELLIPSE(axes):
    """The ellipse with half axes a and b, in 4 n segments.

    A quarter is the rational quadratic with the points (a, 0), (a, b), (0, b) of weights 1, sqrt(1/2), 1,
    at n equal steps of its parameter; the others are its mirror images.
    """

    def ellipse(n):
        t = np.linspace(0.0, 1.0, int(n) + 1)
        start, corner, end = (1 - t) ** 2, math.sqrt(2) * t * (1 - t), t**2
        weight = start + corner + end
        arc = np.stack([(start + corner) / weight, (corner + end) / weight], axis=1) * axes
        ends = np.stack([arc[:-1], arc[1:]], axis=1)
        return segments(np.concatenate([ends * mirror for mirror in ((1, 1), (1, -1), (-1, 1), (-1, -1))]))

    return ellipse


def CURVE_NORMAL(derivative):
    """The unit normal of a plane curve: the unit tangent, of its derivative, turned left by a right angle."""

    def normal(point):
        tangent = complex(*derivative(point))
        left = 1j * tangent / abs(tangent)
        return [left.real, left.imag]

    return normal


def DERBEZIER(controls):
    """The derivative of a Bezier curve."""
    n = len(controls) - 1

    def derivative(point):
        t, values = S1(point), _at(controls, point)
        steps = [[b - a for a, b in zip(p, q)] for p, q in zip(values[:-1], values[1:])]
        return [n * value for value in _combination(_bernstein(n - 1, t), steps)]

    return derivative


def BEZIERSTRIPE(args):
    """The stripe on the left of a plane Bezier curve: [control points, width, n], in n quadrilaterals."""
    controls, width, n = args
    # Beyond the start by a little, where a double control point has no normal.
    parameters = (1e-5 + np.arange(int(n) + 1) / n)[:, None].tolist()
    middle = np.array([BEZIERCURVE(controls)(t) for t in parameters])
    normals = np.array([CURVE_NORMAL(DERBEZIER(controls))(t) for t in parameters])
    return _patches(np.stack([middle, middle + width * normals], axis=1))


def CURVE2MAPVECT(curve):
    """The coordinates of a curve, each as a function of a point."""

    def coordinate(axis):
        return lambda point: curve(point)[axis]

    return [coordinate(axis) for axis, _ in enumerate(curve([0]))]


def SEGMENT(part):
    """The first part of a segment, from its start."""

    def segment(ends):
        a, b = ends
        return POLYLINE([a, [x + (y - x) * part for x, y in zip(a, b)]])

    return segment


# Surfaces. Points of the domain have two coordinates, or more that are not used.
def COONSPATCH(sides):
    """The patch of curves at v = 0, v = 1, u = 0, u = 1, with pyplasm's weights."""

    def patch(point):
        u, v = point[:2]
        su0, su1, s0v, s1v = _at(sides, point)
        return _combination([1 - v, v, 2 * (1 - u), 2 * u], [su0, su1, s0v, s1v])

    return patch


def RULEDSURFACE(pair):
    """alpha(u) + v beta(u)."""

    def surface(point):
        alpha, beta = pair[0](point), pair[1](point)
        return [a + point[1] * b for a, b in zip(alpha, beta)]

    return surface


def PROFILEPRODSURFACE(pair):
    """A profile in the plane xz times a section in the plane xy."""

    def surface(point):
        (radius, _, height), (x, y) = (f(point)[:size] for f, size in zip(pair, (3, 2)))
        return [radius * x, radius * y, height]

    return surface


def ROTATIONALSURFACE(profile):
    """A profile in the plane xz turned about z by the second coordinate."""

    def surface(point):
        radius, _, height = profile(point)
        turned = cmath.rect(radius, point[1])
        return [turned.real, turned.imag, height]

    return surface


def CYLINDRICALSURFACE(pair):
    """A curve swept along a vector: alpha(u) + v w."""
    curve, direction = pair[0], np.array(pair[1], float)
    return lambda point: (np.array(curve(point), float) + point[1] * direction).tolist()


def CONICALSURFACE(pair):
    """The lines from an apex to the points of a curve: (1 - v) apex + v beta(u)."""
    apex, curve = np.array(pair[0], float), pair[1]
    return lambda point: (apex + point[1] * (np.array(curve(point), float) - apex)).tolist()


def TENSORPRODSURFACE(bases):
    """The surface of two bases of functions of [t], and a table of control points."""
    first, second = bases

    def of(controls):
        def surface(point):
            u, v = [f([point[0]]) for f in first], [f([point[1]]) for f in second]
            rows = _at(controls, point)
            weights = [a * b for a in u for b in v]
            return _combination(
                weights, [rows[i][j] for i in builtins.range(len(u)) for j in builtins.range(len(v))]
            )

        return surface

    return of


def BILINEARSURFACE(controls):
    """(1 - u) (1 - v) p00 + (1 - u) v p01 + u (1 - v) p10 + u v p11, of a table of four points."""
    linear = [lambda p: 1 - p[0], lambda p: p[0]]
    return TENSORPRODSURFACE([linear, linear])(controls)


def BIQUADRATICSURFACE(controls):
    basis = [
        lambda p: 2 * p[0] * p[0] - p[0],
        lambda p: 4 * p[0] - 4 * p[0] * p[0],
        lambda p: 2 * p[0] * p[0] - 3 * p[0] + 1,
    ]
    return TENSORPRODSURFACE([basis, basis])(controls)


def HERMITESURFACE(controls):
    basis = [
        lambda p: 2 * p[0] ** 3 - 3 * p[0] ** 2 + 1,
        lambda p: 3 * p[0] ** 2 - 2 * p[0] ** 3,
        lambda p: p[0] ** 3 - 2 * p[0] ** 2 + p[0],
        lambda p: p[0] ** 3 - p[0] ** 2,
    ]
    return TENSORPRODSURFACE([basis, basis])(controls)


def BEZIERSURFACE(controls):
    """The tensor product surface of a table of control points."""
    bases = [BERNSTEINBASIS(S1)(len(side) - 1) for side in (controls, controls[0])]
    return TENSORPRODSURFACE(bases)(controls)


def TENSORPRODSOLID(bases):
    """The solid of three bases, and a table of values for each coordinate."""

    def of(controls):
        def solid(point):
            u, v, w = ([f([value]) for f in basis] for basis, value in zip(bases, point))
            tables = _at(controls, point)
            return [
                sum(
                    a * b * c * tables[m][i][j][k]
                    for i, a in enumerate(u)
                    for j, b in enumerate(v)
                    for k, c in enumerate(w)
                )
                for m in builtins.range(len(tables))
            ]

        return solid

    return of


def BEZIERMANIFOLD(degrees):
    return TENSORPRODSOLID([BERNSTEINBASIS(S1)(degree) for degree in degrees])


def THINSOLID(surface, delta=1e-4):
    """The layer beside a surface: the third coordinate is the distance along its normal."""

    def solid(point):
        steps = np.array([[0, 0, 0], [delta, 0, 0], [0, delta, 0]])
        at, *beside = (np.array(surface(p), float) for p in (point + steps).tolist())
        normal = UNITVECT(VECTPROD([p - at for p in beside]))
        return (at + point[2] * np.array(normal)).tolist()

    return solid
