"""Curves, surfaces and solids as maps of points, and what displays them."""

import builtins
import math

from .fl import COMP, K, S1, SEL, UNITVECT, VECTPROD
from ._complex import Hpc
from .geometry import INTERVALS, MAP, POLYLINE, POLYMARKER, POWER, S, STRUCT, T, UKPOL


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
                    f"BSPLINE: {count} points of degree {degree} need {count + degree + 1} knots, "
                    f"not {len(knots)}"
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
    marks = POLYMARKER(2, marker_size)(UKPOL(spline(degree, len(knots))(knots)(points))[0])
    curve = spline(degree)(knots)(points) if degree > 0 else POLYMARKER(3, marker_size)(points)
    return STRUCT([curve, marks, POLYLINE(points), POLYMARKER(1, marker_size)(points)])


def DISPLAYNUBSPLINE(args, marker_size=0.1):
    """A B-spline with its control polygon and marks at its knots: [degree, knots, points]."""
    return _display(NUBSPLINE, args, marker_size)


def DISPLAYNURBSPLINE(args, marker_size=0.1):
    return _display(NURBSPLINE, args, marker_size)


def ELLIPSE(axes):
    """The ellipse with half axes, in 4 n segments."""
    a, b = axes
    c = 0.5 * math.sqrt(2)
    quarter = RATIONALBEZIER([[a, 0, 1], [a * c, b * c, c], [0, b, 1]])

    def ellipse(n):
        one = MAP(quarter)(INTERVALS(1.0)(n))
        half = STRUCT([one, S(2)(-1)(one)])
        return STRUCT([half, S(1)(-1)(half)])

    return ellipse


def CURVE_NORMAL(derivative):
    """The unit normal of a plane curve, of its derivative."""

    def normal(point):
        x, y = derivative(point)
        length = math.hypot(x, y)
        return [-y / length, x / length]

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
    """The stripe beside a plane Bezier curve: [control points, width, n]."""
    controls, width, n = args
    curve, normal = BEZIERCURVE(controls), CURVE_NORMAL(DERBEZIER(controls))

    def stripe(point):
        (bx, by), (nx, ny) = curve(point), normal(point)
        return [bx + point[1] * nx, by + point[1] * ny]

    # Beyond the start by a little, where a double control point has no normal.
    return MAP(stripe)(S(2)(width)(T(1)(0.00001)(POWER([INTERVALS(1)(n), INTERVALS(1)(1)]))))


def CURVE2MAPVECT(curve):
    return [COMP([SEL(i), curve]) for i in builtins.range(1, len(curve([0])) + 1)]


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
        profile, section = pair[0](point), pair[1](point)
        return [profile[0] * section[0], profile[0] * section[1], profile[2]]

    return surface


def ROTATIONALSURFACE(profile):
    """A profile in the plane xz turned about z by the second coordinate."""

    def surface(point):
        x, _, z = profile(point)
        return [x * math.cos(point[1]), x * math.sin(point[1]), z]

    return surface


def CYLINDRICALSURFACE(pair):
    return RULEDSURFACE([pair[0], K(list(pair[1]))])


def CONICALSURFACE(pair):
    apex, curve = pair
    return RULEDSURFACE([K(apex), lambda point: [b - a for a, b in zip(apex, curve(point))]])


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
    return TENSORPRODSURFACE([BERNSTEINBASIS(S1)(1), BERNSTEINBASIS(S1)(1)])(controls)


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
    bases = [BERNSTEINBASIS(S1)(len(controls) - 1), BERNSTEINBASIS(S1)(len(controls[0]) - 1)]
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
        u, v, w = point
        p0, pu, pv = surface([u, v, w]), surface([u + delta, v, w]), surface([u, v + delta, w])
        gu, gv = ([b - a for a, b in zip(p0, p)] for p in (pu, pv))
        return [a + w * n for a, n in zip(p0, UNITVECT(VECTPROD([gu, gv])))]

    return solid
