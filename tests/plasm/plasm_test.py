#!/usr/bin/env python3
"""Small programs in pyplasm's language, what they show, and properties on random input.

    plasm_test.py [--seed N] [NAME...]

A program shows what it leaves in `shown`. Expected are its box (low and high corners), the content of its
cells of each dimension, and the volume of the union of what is solid, all by formulas that are here.
"""

import itertools
import math
import os
import pathlib
import random
import subprocess
import sys
import tempfile
import time
import warnings

os.environ.setdefault("BSP2_VIEW", "none")

import numpy as np  # noqa: E402

from bsp2 import plasm  # noqa: E402
from bsp2.plasm import _cells, _complex, geometry, lar, run  # noqa: E402

PI, SQRT = math.pi, math.sqrt


def ngon(n, r=1.0):
    return n / 2 * r * r * math.sin(2 * PI / n)


def chord(n, r=1.0):
    return 2 * r * math.sin(PI / n)


def arc_length(curve, n):
    points = [curve(i / n) for i in range(n + 1)]
    return sum(math.dist(a, b) for a, b in zip(points[:-1], points[1:]))


def sphere_faces(n, m, r=1.0):
    """The area of the quadrilaterals of a sphere in n x m parts."""
    total = 0.0
    for i in range(n):
        a, b = -PI / 2 + PI * i / n, -PI / 2 + PI * (i + 1) / n
        long, short = (2 * r * abs(math.cos(x)) * math.sin(PI / m) for x in (a, b))
        apothems = [r * math.cos(x) * math.cos(PI / m) for x in (a, b)]
        height = math.hypot(apothems[0] - apothems[1], r * (math.sin(a) - math.sin(b)))
        total += m * (long + short) / 2 * height
    return total


# name: (program, box or None, {dimension: content}, volume of the union or None)
PROGRAMS = {
    # Primitives.
    "cuboid 3": ("shown = CUBOID([1, 2, 3])", ([0, 0, 0], [1, 2, 3]), {3: 6}, 6),
    "cuboid 2": ("shown = CUBOID([1.5, 2])", ([0, 0], [1.5, 2]), {2: 3}, 3),
    "cuboid 1": ("shown = CUBOID([4])", ([0], [4]), {1: 4}, None),
    "cuboid 4": ("shown = CUBOID([1, 2, 3, 4])", ([0] * 4, [1, 2, 3, 4]), {4: 24}, 24),
    "cuboid of numpy": (
        "import numpy\n"
        "shown = CUBOID(numpy.array([1, 2, 3], dtype=numpy.int16))",
        ([0] * 3, [1, 2, 3]), {3: 6}, None,
    ),
    "cube": ("shown = CUBE(2)", ([0] * 3, [2] * 3), {3: 8}, None),
    "flat cuboid": ("shown = CUBOID([1, 2, 0])", ([0] * 3, [1, 2, 0]), {2: 2}, None),
    "simplex 3": ("shown = SIMPLEX(3)", ([0] * 3, [1] * 3), {3: 1 / 6}, 1 / 6),
    "simplex 5": ("shown = SIMPLEX(5)", ([0] * 5, [1] * 5), {5: 1 / 120}, None),
    "point": ("shown = MK([1, 2, 3])", ([1, 2, 3], [1, 2, 3]), {}, None),
    "hexahedron": ("shown = HEXAHEDRON", ([-1 / SQRT(3)] * 3, [1 / SQRT(3)] * 3), {3: 8 / SQRT(27)}, None),
    "tetrahedron": (
        "shown = TETRAHEDRON",
        ([-0.5, -SQRT(3) / 2, -1 / 3], [1, SQRT(3) / 2, 1]), {3: ngon(3) * (4 / 3) / 3}, None,
    ),
    "icosahedron": ("shown = SKEL_0(ICOSAHEDRON)", None, {}, None),
    "octahedron": ("shown = CROSSPOLYTOPE(3)", ([-1] * 3, [1] * 3), {3: 4 / 3}, None),
    "cross polytope 4": ("shown = CROSSPOLYTOPE(4)", ([-1] * 4, [1] * 4), {4: 16 / 24}, 16 / 24),
    "permutahedron": (
        "shown = CUBOID([len(UKPOL(PERMUTAHEDRON(2))[0]), len(UKPOL(PERMUTAHEDRON(3))[0])])",
        ([0, 0], [6, 24]), None, None,
    ),
    "circle": ("shown = CIRCLE(2)([8, 3])", ([-2, -2], [2, 2]), {2: ngon(8, 2)}, ngon(8, 2)),
    "circumference": ("shown = CIRCUMFERENCE(2)(12)", ([-2, -2], [2, 2]), {1: 12 * chord(12, 2)}, None),
    "ngon": ("shown = NGON(6)", ([-1, -SQRT(3) / 2], [1, SQRT(3) / 2]), {1: 6}, None),
    "ring": ("shown = RING([1, 2])([16, 2])", ([-2, -2], [2, 2]), {2: ngon(16, 2) - ngon(16)}, None),
    "tube": ("shown = TUBE([1, 2, 5])(8)", ([-2, -2, 0], [2, 2, 5]), {3: 5 * (ngon(8, 2) - ngon(8))}, None),
    "cylinder": (
        "shown = CYLINDER([0.5, 3])(12)",
        ([-0.5, -0.5, 0], [0.5, 0.5, 3]), {3: 3 * ngon(12, 0.5)}, 3 * ngon(12, 0.5),
    ),
    "cone": ("shown = CONE([1, 3])(16)", ([-1, -1, 0], [1, 1, 3]), {3: ngon(16)}, ngon(16)),
    "truncated cone": (
        "shown = TRUNCONE([2, 1, 1])(4)",
        ([-2, -2, 0], [2, 2, 1]),
        {2: 4 * (chord(4, 2) + chord(4)) / 2 * math.hypot(1, math.cos(PI / 4))},
        None,
    ),
    "sphere is a surface": (
        "shown = SPHERE(2)([6, 8])",
        ([-2, -2, -2], [2, 2, 2]), {2: sphere_faces(6, 8, 2)}, None,
    ),
    "torus is a surface": ("shown = TORUS([1, 3])([4, 4])", ([-3, -3, -1], [3, 3, 1]), None, None),
    "dodecahedron": (
        "shown = JOIN(DODECAHEDRON)",
        None, {3: (15 + 7 * SQRT(5)) / 4 * (4 / (SQRT(3) * (1 + SQRT(5)))) ** 3}, None,
    ),
    "star": ("shown = STAR(5)", None, None, None),
    # QUOTE and products.
    "quote": ("shown = QUOTE([1, -1, 2])", ([0], [4]), {1: 3}, None),
    "quote begins with a gap": ("shown = QUOTE([-3, 1, -1, 1])", ([3], [6]), {1: 2}, None),
    "Q of a number": ("shown = Q(2.5)", ([0], [2.5]), {1: 2.5}, None),
    "Q of a negative number": ("shown = PROD([Q(-2), Q(1)])", ([-2, 0], [0, 1]), {2: 2}, None),
    "Q of a list": ("shown = Q([1, -1, 1])", ([0], [3]), {1: 2}, None),
    "intervals": ("shown = INTERVALS(10)(8)", ([0], [10]), {1: 10}, None),
    "grid": (
        "shown = INSR(PROD)([QUOTE([1, -2, 1]), QUOTE([3, -1, 3]), Q(2)])",
        ([0] * 3, [4, 7, 2]), {3: 24}, 24,
    ),
    "grid by composition": (
        "GRID = COMP([INSR(PROD), AA(QUOTE)])\n"
        "shown = GRID([[1, -1] * 3, [2]])",
        ([0, 0], [5, 2]), {2: 6}, None,
    ),
    "product of plane pieces": (
        "shown = PROD([CUBOID([1, 1]), CUBOID([2, 3])])",
        ([0] * 4, [1, 1, 2, 3]), {4: 6}, None,
    ),
    "extrude": (
        "shown = EXTRUDE([None, CIRCLE(1)([8, 1]), 2])",
        ([-1, -1, 0], [1, 1, 2]), {3: 2 * ngon(8)}, None,
    ),
    "power of numbers": ("shown = CUBOID([POWER([2, 3]), 1])", ([0, 0], [8, 1]), {2: 8}, None),
    "walls": ("shown = PROD([SKEL_1(CUBOID([2, 3])), Q(4)])", ([0] * 3, [2, 3, 4]), {2: 40}, None),
    # MKPOL and JOIN.
    "mkpol hulls its points": (
        "shown = MKPOL([[[0, 0], [2, 0], [2, 2], [0, 2], [1, 1]], [[1, 2, 3, 4, 5]], None])",
        ([0, 0], [2, 2]), {2: 4}, 4,
    ),
    "mkpol of two cells": (
        "shown = MKPOL([[[0, 0], [1, 0], [1, 1], [0, 1]], [[1, 2, 3], [1, 3, 4]], [[1, 2]]])",
        ([0, 0], [1, 1]), {2: 1}, 1,
    ),
    "mkpol of segments": (
        "shown = MKPOL([[[0, 0, 0], [3, 4, 0], [3, 4, 12]], [[1, 2], [2, 3]], None])",
        ([0] * 3, [3, 4, 12]), {1: 17}, None,
    ),
    "mkpol of all dimensions": (
        "shown = MKPOL([[[0, 0], [1, 0], [1, 1], [0, 1]], [[1], [1, 3], [1, 2, 3, 4]], None])",
        ([0, 0], [1, 1]), {1: SQRT(2), 2: 1}, None,
    ),
    "mkpol of numpy": (
        "import numpy\n"
        "shown = MKPOL([numpy.eye(3), numpy.array([[1, 2, 3]]), None])",
        ([0] * 3, [1] * 3), {2: SQRT(3) / 2}, None,
    ),
    "mkpol in space, plane": (
        "shown = MKPOL([[[0, 0, 1], [2, 0, 1], [2, 3, 1], [0, 3, 1]], [[1, 2, 3, 4]], None])",
        ([0, 0, 1], [2, 3, 1]), {2: 6}, None,
    ),
    "ukpol and back": (
        "shown = MKPOL(UKPOL(STRUCT([CUBOID([1, 2, 3]), T(1)(4), CUBOID([1, 1, 1])])))",
        ([0] * 3, [5, 2, 3]), {3: 7}, None,
    ),
    "ukpol goes around quadrilaterals": (
        "p, c, _ = UKPOL(PROD([Q(2), Q(3)]))\n"
        "shown = POLYLINE([p[i - 1] for i in c[0] + c[0][:1]])",
        ([0, 0], [2, 3]), {1: 10}, None,
    ),
    "ukpol goes around polygons": (
        "p, c, _ = UKPOL(CONVEXHULL(CIRCLE_POINTS(1, 7)))\n"
        "shown = POLYLINE([p[i - 1] for i in c[0] + c[0][:1]])",
        None, {1: 7 * chord(7)}, None,
    ),
    "join of points": (
        "shown = JOIN(AA(MK)([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]))",
        ([0] * 3, [1] * 3), {3: 1 / 6}, None,
    ),
    "join of boxes": (
        "shown = JOIN([CUBOID([1, 1]), T([1, 2])([2, 2])(CUBOID([1, 1]))])",
        ([0, 0], [3, 3]), {2: 5}, 5,
    ),
    "join makes a ball": ("shown = JOIN(SPHERE(1)([2, 4]))", ([-1] * 3, [1] * 3), {3: 4 / 3}, 4 / 3),
    "convex hull": (
        "shown = CONVEXHULL([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.1, 0.1, 0.1]])",
        ([0] * 3, [1] * 3), {3: 1 / 6}, None,
    ),
    "polyline": ("shown = POLYLINE([[0, 0], [3, 4], [3, 0]])", ([0, 0], [3, 4]), {1: 9}, None),
    "triangle stripe": (
        "shown = TRIANGLESTRIPE([[0, 0], [0, 1], [1, 0], [1, 1], [2, 0]])",
        ([0, 0], [2, 1]), {2: 1.5}, 1.5,
    ),
    "triangle fan": ("shown = TRIANGLEFAN([[0, 0], [1, 0], [1, 1], [0, 1]])", ([0, 0], [1, 1]), {2: 1}, None),
    "pyramid": ("shown = PYRAMID(3)(CUBOID([1, 1]))", ([0] * 3, [1, 1, 3]), {3: 1}, None),
    # Maps.
    "rotation turns the first axis to the second": (
        "shown = R([1, 2])(PI / 2)(CUBOID([2, 1]))",
        ([-1, 0], [0, 2]), {2: 2}, None,
    ),
    "rotation in the plane of x and z": (
        "shown = R([1, 3])(PI / 2)(CUBOID([1, 2, 3]))",
        ([-3, 0, 0], [0, 2, 1]), {3: 6}, None,
    ),
    "rotation the other way": (
        "shown = R([3, 1])(PI / 2)(CUBOID([1, 2, 3]))",
        ([0, 0, -1], [3, 2, 0]), {3: 6}, None,
    ),
    "translation embeds": ("shown = T(3)(2)(CUBOID([1, 1]))", ([0, 0, 2], [1, 1, 2]), {2: 1}, None),
    "axes as numbers and lists": (
        "shown = T([1, 3])([1, 2])(S(2)(3)(CUBOID([1, 1, 1])))",
        ([1, 0, 2], [2, 3, 3]), {3: 3}, None,
    ),
    "negative scaling mirrors": ("shown = S(1)(-2)(SIMPLEX(2))", ([-2, 0], [0, 1]), {2: 1}, 1),
    "scaling of a surface": (
        "shown = S([1, 2, 3])([2, 2, 2])(SKEL_2(CUBOID([1, 1, 1])))",
        ([0] * 3, [2] * 3), {2: 24}, None,
    ),
    "uneven scaling of a surface": (
        "shown = S(3)(5)(SKEL_2(CUBOID([1, 1, 1])))",
        ([0] * 3, [1, 1, 5]), {2: 22}, None,
    ),
    "scaling to nothing": ("shown = S(3)(0)(CUBOID([1, 2, 3]))", ([0] * 3, [1, 2, 0]), {2: 2}, None),
    "matrix": (
        "shown = MAT([[1, 0, 0], [1, 1, 0], [2, 0, 1]])(CUBOID([1, 1]))",
        ([1, 2], [2, 3]), {2: 1}, None,
    ),
    "shear by a matrix": (
        "shown = MAT([[1, 0, 0], [0, 1, 2], [0, 0, 1]])(CUBOID([1, 1]))",
        ([0, 0], [3, 1]), {2: 1}, 1,
    ),
    "rotation about a vector": (
        "shown = ROTN([PI / 2, [1, 0, 0]])(CUBOID([1, 2, 3]))",
        ([0, -3, 0], [1, 0, 2]), {3: 6}, None,
    ),
    "embed": ("shown = EMBED(2)(CUBOID([1, 1]))", ([0] * 4, [1, 1, 0, 0]), {2: 1}, None),
    "mirror": ("shown = MIRROR(1)(T(1)(1)(CUBOID([1, 1])))", ([-2, 0], [2, 1]), {2: 2}, None),
    # STRUCT.
    "struct keeps overlaps": (
        "shown = STRUCT([CUBOID([2, 1]), T(1)(1), CUBOID([2, 1])])",
        ([0, 0], [3, 1]), {2: 4}, 3,
    ),
    "maps act on all that follow": (
        "b = CUBOID([1, 1])\n"
        "shown = STRUCT([b, T(1)(2), b, T(2)(3), b])",
        ([0, 0], [3, 4]), {2: 3}, None,
    ),
    "repeated": ("shown = STRUCT(NN(10)([CUBOID([1, 1]), T(1)(1.5)]))", ([0, 0], [14.5, 1]), {2: 10}, 10),
    "turned and repeated": (
        "shown = STRUCT(NN(6)([T(1)(1)(CUBOID([1, 0.5])), R([1, 2])(PI / 3)]))",
        None, {2: 3}, None,
    ),
    "nested": (
        "row = STRUCT(NN(5)([CUBOID([1, 1, 1]), T(1)(2)]))\n"
        "shown = STRUCT(NN(4)([row, T(2)(2)]))",
        ([0] * 3, [9, 7, 1]), {3: 20}, None,
    ),
    "struct of dimensions": (
        "shown = STRUCT([CUBOID([1, 1, 1]), CUBOID([2, 2]), POLYLINE([[0, 0], [0, 5]])])",
        ([0] * 3, [2, 5, 1]), {1: 5, 2: 4, 3: 1}, None,
    ),
    "maps at the end do nothing": ("shown = STRUCT([CUBOID([1]), T(1)(1)])", ([0], [1]), {1: 1}, None),
    "two maps in a row": ("shown = STRUCT([T(1)(1), S(1)(2), CUBOID([1])])", ([1], [3]), {1: 2}, None),
    "functions are maps": (
        "shown = STRUCT([CUBOID([1, 1]), lambda p: T(1)(3)(p), CUBOID([1, 1])])",
        ([0, 0], [4, 1]), {2: 2}, None,
    ),
    "top": ("shown = TOP([CUBOID([2, 2, 1]), CUBOID([1, 1, 1])])", ([0] * 3, [2, 2, 2]), {3: 5}, None),
    "right": (
        "shown = RIGHT([CUBOID([2, 2, 1]), T(3)(7)(CUBOID([1, 1, 1]))])",
        ([0] * 3, [3, 2, 1]), {3: 5}, None,
    ),
    "align": (
        "shown = ALIGN([[1, MAX, MIN], [2, MED, MED]])([CUBOID([2, 3]), CUBOID([1, 1])])",
        ([0, 0], [3, 3]), {2: 7}, None,
    ),
    "box": ("shown = BOX([1, 3])(T([1, 2, 3])([1, 2, 3])(SIMPLEX(3)))", ([1, 3], [2, 4]), {2: 1}, None),
    "size": (
        "shown = CUBOID(SIZE([1, 2])(CUBOID([3, 4, 5])) + [MED(3)(CUBOID([1, 1, 4]))])",
        ([0] * 3, [3, 4, 2]), {3: 24}, None,
    ),
    # Skeletons and offsets.
    "edges": ("shown = SKELETON(1)(CUBOID([1, 2, 3]))", ([0] * 3, [1, 2, 3]), {1: 24}, None),
    "faces": ("shown = SKEL_2(CUBOID([1, 2, 3]))", ([0] * 3, [1, 2, 3]), {2: 22}, None),
    "edges of a prism": ("shown = SKEL_1(CYLINDER([1, 2])(6))", None, {1: 24}, None),
    "faces of a hull": (
        "shown = SKEL_2(CONVEXHULL(UKPOL(CUBOID([1, 2, 3]))[0]))",
        ([0] * 3, [1, 2, 3]), {2: 22}, None,
    ),
    "edges of a hull": ("shown = SKEL_1(CROSSPOLYTOPE(3))", None, {1: 12 * SQRT(2)}, None),
    "edges of a hull in four dimensions": (
        "shown = SKEL_1(JOIN(CUBOID([1, 1, 1, 1])))",
        ([0] * 4, [1] * 4), {1: 32}, None,
    ),
    "edges of polygons": (
        "shown = SKEL_1(MKPOL([CIRCLE_POINTS(1, 9), [range(1, 10)], None]))",
        None, {1: 9 * chord(9)}, None,
    ),
    "offset": ("shown = OFFSET([0.5, 0.5, 0.5])(CUBOID([1, 1, 1]))", ([0] * 3, [1.5] * 3), {3: 1.5**3}, None),
    "offset of edges": (
        "shown = OFFSET([0.1, 0.1, 0.1])(SKEL_1(CUBOID([1, 1, 1])))",
        ([0] * 3, [1.1] * 3), {3: 12 * 1.1 * 0.01}, 12 * 0.9 * 0.01 + 8 * 0.001,
    ),
    "sweep": ("shown = SWEEP([1, 1])(CUBOID([1, 1]))", ([0, 0], [2, 2]), {2: 3}, None),
    "minkowski": ("shown = MINKOWSKI([[1, 0], [0, 2]])(MK([0, 0]))", ([0, 0], [1, 2]), {2: 2}, None),
    "split cells": (
        "shown = STRUCT(SPLITCELLS(INSR(PROD)([QUOTE([1, 1]), QUOTE([1, 1])])))",
        ([0, 0], [2, 2]), {2: 4}, None,
    ),
    # MAP, curves, surfaces.
    "map of a grid": (
        "d = PROD([INTERVALS(1)(4), INTERVALS(1)(4)])\n"
        "shown = MAP([S1, S2, lambda p: p[0] + p[1]])(d)",
        ([0] * 3, [1, 1, 2]), {2: SQRT(3)}, None,
    ),
    "map to fewer coordinates": ("shown = MAP([S1])(CUBOID([2, 3]))", ([0], [2]), {1: 2}, None),
    "map swaps": ("shown = MAP([S3, S1, S2])(CUBOID([1, 2, 3]))", ([0] * 3, [3, 1, 2]), {3: 6}, None),
    "map of solids": (
        "d = INSR(PROD)([INTERVALS(PI / 2)(8), Q(1), Q(2)])\n"
        "shown = MAP(lambda p: [(1 + p[1]) * COS(p[0]), (1 + p[1]) * SIN(p[0]), p[2]])(d)",
        ([0] * 3, [2, 2, 2]), {3: 2 * (4 - 1) * 8 / 2 * math.sin(PI / 16)}, None,
    ),
    "bezier curve": (
        "shown = MAP(BEZIER(S1)([[0, 0], [1, 2], [2, 0]]))(INTERVALS(1)(16))",
        ([0, 0], [2, 1]), {1: arc_length(lambda t: (2 * t, 4 * t * (1 - t)), 16)}, None,
    ),
    "bezier line": (
        "shown = MAP(BEZIERCURVE([[0, 0, 0], [1, 2, 2]]))(INTERVALS(1)(5))",
        ([0] * 3, [1, 2, 2]), {1: 3}, None,
    ),
    "bezier surface of curves": (
        "a = BEZIER(S1)([[0, 0, 0], [2, 0, 0]])\n"
        "b = BEZIER(S1)([[0, 3, 0], [2, 3, 0]])\n"
        "d = PROD([INTERVALS(1)(3), INTERVALS(1)(2)])\n"
        "shown = MAP(BEZIER(S2)([a, b]))(d)",
        ([0] * 3, [2, 3, 0]), {2: 6}, None,
    ),
    "bezier surface of points": (
        "d = PROD([INTERVALS(1)(3), INTERVALS(1)(3)])\n"
        "shown = MAP(BEZIERSURFACE([[[0, 0, 0], [0, 1, 0]], [[1, 0, 1], [1, 1, 1]]]))(d)",
        ([0] * 3, [1] * 3), {2: SQRT(2)}, None,
    ),
    "hermite": (
        "shown = MAP(CUBICHERMITE(S1)([[0, 0], [1, 0], [1, 0], [1, 0]]))(INTERVALS(1)(8))",
        ([0, 0], [1, 0]), {1: 1}, None,
    ),
    "rotational surface": (
        "p = BEZIER(S1)([[1, 0, 0], [1, 0, 2]])\n"
        "d = PROD([INTERVALS(1)(2), INTERVALS(2 * PI)(8)])\n"
        "shown = MAP(ROTATIONALSURFACE(p))(d)",
        ([-1, -1, 0], [1, 1, 2]), {2: 2 * 8 * chord(8)}, None,
    ),
    "ruled surface": (
        "shown = MAP(RULEDSURFACE([lambda p: [p[0], 0, 0], lambda p: [0, 2, "
        "0]]))(PROD([INTERVALS(3)(3), Q(1)]))",
        ([0] * 3, [3, 2, 0]), {2: 6}, None,
    ),
    "cylindrical surface": (
        "c = lambda p: [COS(p[0]), SIN(p[0]), 0]\n"
        "shown = MAP(CYLINDRICALSURFACE([c, [0, 0, 3]]))(PROD([INTERVALS(2 * PI)(6), Q(1)]))",
        None, {2: 18}, None,
    ),
    "conical surface": (
        "c = lambda p: [COS(p[0]), SIN(p[0]), 0]\n"
        "shown = MAP(CONICALSURFACE([[0, 0, 1], c]))(PROD([INTERVALS(2 * PI)(4), Q(1)]))",
        ([-1, -1, 0], [1, 1, 1]), {2: 4 * SQRT(3) / 2}, None,
    ),
    "profile product": (
        "a = lambda p: [1, 0, p[0]]\n"
        "b = lambda p: [COS(p[1]), SIN(p[1]), 0]\n"
        "shown = MAP(PROFILEPRODSURFACE([a, b]))(PROD([Q(2), INTERVALS(2 * PI)(6)]))",
        None, {2: 12}, None,
    ),
    "spline of straight points": (
        "shown = NUBSPLINE(3)([0, 0, 0, 0, 1, 2, 2, 2, 2])([[0, 0], [1, 0], [2, 0], [3, 0], [4, 0]])",
        ([0, 0], [4, 0]), {1: 4}, None,
    ),
    "spline ends at its last point": (
        "shown = NUBSPLINE(2)([0, 0, 0, 1, 2, 3, 3, 3])([[0, 0], [0, 3], [1, 0], [2, 5], [7, 8]])",
        ([0, 0], [7, 8]), None, None,
    ),
    "nurbs circle": (
        "c = SQRT(2) / 2\n"
        "k = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]\n"
        "p = [[1, 0, 1], [c, c, c], [0, 1, 1], [-c, c, c], [-1, 0, 1], [-c, -c, c], [0, -1, 1], [c, "
        "-c, c], [1, 0, 1]]\n"
        "curve = RATIONALBSPLINE(2)(k)(p)\n"
        "r = [VECTNORM(curve([t / 10.0])) for t in range(41)]\n"
        "shown = CUBOID([max(r), min(r)])",
        ([0, 0], [1, 1]), {2: 1}, None,
    ),
    "cubic spline": (
        "shown = SPLINE(CUBICUBSPLINE(INTERVALS(1)(4)))([[0, 0], [1, 0], [2, 0], [3, 0], [4, 0]])",
        ([1, 0], [3, 0]), {1: 2}, None,
    ),
    "cardinal spline": (
        "shown = SPLINE(CUBICCARDINAL(INTERVALS(1)(4)))([[0, 0], [1, 0], [2, 0], [3, 0], [4, 0]])",
        ([1, 0], [3, 0]), {1: 2}, None,
    ),
    "ellipse": ("shown = ELLIPSE([3, 2])(4)", ([-3, -2], [3, 2]), None, None),
    "stripe of a line": (
        "shown = BEZIERSTRIPE([[[0, 0], [4, 0]], 0.5, 4])",
        ([4e-5, 0], [4.00004, 0.5]), {2: 2}, None,
    ),
    "thin solid": (
        "s = lambda p: [p[0], p[1], 0]\n"
        "shown = MAP(THINSOLID(s))(INSR(PROD)([INTERVALS(1)(2), INTERVALS(1)(2), Q(0.1)]))",
        ([0] * 3, [1, 1, 0.1]), {3: 0.1}, None,
    ),
    "markers": ("shown = POLYMARKER(2, 0.5)([[0, 0], [5, 5]])", ([-0.5, -0.5], [5.5, 5.5]), {1: 8}, None),
    # Booleans.
    "union": (
        "shown = UNION([CUBOID([2, 1, 1]), T(1)(1)(CUBOID([2, 1, 1]))])",
        ([0] * 3, [3, 1, 1]), {3: 3}, 3,
    ),
    "intersection": (
        "shown = INTERSECTION([CUBOID([2, 2]), T([1, 2])([1, 1])(CUBOID([2, 2]))])",
        ([1, 1], [2, 2]), {2: 1}, 1,
    ),
    "difference": (
        "shown = DIFFERENCE([CUBOID([3, 3, 3]), T([1, 2, 3])([1, 1, -1])(CUBOID([1, 1, 5]))])",
        ([0] * 3, [3] * 3), {3: 24}, 24,
    ),
    "symmetric difference": (
        "shown = XOR([CUBOID([2, 2]), T([1, 2])([1, 1])(CUBOID([2, 2]))])",
        ([0, 0], [3, 3]), {2: 6}, 6,
    ),
    "difference of several": (
        "shown = DIFF([CUBOID([4, 1]), T(1)(1)(CUBOID([1, 1])), T(1)(3)(CUBOID([1, 1]))])",
        ([0, 0], [3, 1]), {2: 2}, None,
    ),
    "sum is a union": (
        "shown = SUM([CUBOID([2, 1]), T(1)(1)(CUBOID([2, 1]))])",
        ([0, 0], [3, 1]), {2: 3}, None,
    ),
    "an empty difference": (
        "d = DIFFERENCE([CUBOID([1, 1, 1]), CUBOID([2, 2, 2])])\n"
        "shown = STRUCT([d, CUBOID([1, 1, 2])])",
        ([0] * 3, [1, 1, 2]), {3: 2}, None,
    ),
    "a struct is a set": (
        "s = STRUCT([CUBOID([2, 1]), T(1)(1), CUBOID([2, 1])])\n"
        "shown = DIFFERENCE([CUBOID([4, 1]), s])",
        ([3, 0], [4, 1]), {2: 1}, None,
    ),
    "what is not solid cuts nothing": (
        "shown = DIFFERENCE([CUBOID([1, 1, 1]), SPHERE(1)([8, 8])])",
        ([0] * 3, [1] * 3), {3: 1}, None,
    ),
    "union of plane pieces in space": (
        "a = T(3)(2)(CUBOID([2, 1]))\n"
        "shown = UNION([a, T(1)(1)(a)])",
        ([0, 0, 2], [3, 1, 2]), {2: 3}, None,
    ),
    "difference in a tilted plane": (
        "a = R([2, 3])(PI / 6)(EMBED(1)(CUBOID([3, 3])))\n"
        "b = R([2, 3])(PI / 6)(T([1, 2, 3])([1, 1, 0])(CUBOID([1, 1])))\n"
        "shown = DIFFERENCE([a, b])",
        None, {2: 8}, None,
    ),
    "booleans on a line": (
        "shown = DIFFERENCE([QUOTE([5]), QUOTE([-1, 1, -1, 1])])",
        ([0], [5]), {1: 3}, None,
    ),
    "booleans in four dimensions": (
        "shown = INTERSECTION([CUBOID([2, 2, 2, 2]), T([1, 2, 3, 4])([1, 1, 1, 1])(CUBOID([2, 2, 2, "
        "2]))])",
        ([1] * 4, [2] * 4), {4: 1}, None,
    ),
    "edges of a difference": (
        "w = INSR(PROD)([Q(8), Q(0.2), Q(4)])\n"
        "shown = SKEL_1(DIFFERENCE([w, T(1)(3)(CUBOID([2, 0.2, 4]))]))",
        ([0] * 3, [8, 0.2, 4]), {1: 129.6}, None,
    ),
    "edges of a plane difference": (
        "shown = SKEL_1(DIFFERENCE([CUBOID([38, 18]), T([1, 2])([2, 2])(CUBOID([34, 14]))]))",
        ([0, 0], [38, 18]), {1: 232}, None,
    ),
    "edges of an intersection": (
        "shown = SKEL_1(INTERSECTION([CUBOID([2, 2]), T([1, 2])([1, 1])(CUBOID([2, 2]))]))",
        ([1, 1], [2, 2]), None, None,
    ),
    "solidify": (
        "shown = SOLIDIFY(STRUCT(AA(POLYLINE)([[[0, 0], [4, 0], [4, 4], [0, 4], [0, 0]], [[1, 1], "
        "[2, 1], [2, 2], [1, 2], [1, 1]]])))",
        ([0, 0], [4, 4]), {2: 15}, None,
    ),
    "drilled and repeated": (
        "b = DIFFERENCE([CUBOID([1, 1, 1]), T([1, 2, 3])([0.5, 0.5, -1])(CYLINDER([0.25, 3])(8))])\n"
        "shown = STRUCT(NN(3)([b, T(1)(2)]))",
        ([0] * 3, [5, 1, 1]), {3: 3 * (1 - ngon(8, 0.25))}, None,
    ),
    # FL.
    "insr and insl": (
        "shown = CUBOID([INSR(DIFF)([1, 2, 4]), INSL(DIFF)([9, 2, 3])])",
        ([0, 0], [3, 4]), {2: 12}, None,
    ),
    "cons, comp, aa": (
        "f = CONS([S2, S1, COMP([AA(SUM), TRANS, LIST])])\n"
        "shown = CUBOID(f([2, 3])[:2])",
        ([0, 0], [3, 2]), {2: 6}, None,
    ),
    "distribution": (
        "shown = CUBOID(CAT(AA(SUM)([DISTL([1, [2, 3]])[1], DISTR([[4, 5], 1])[0]]) and [[4], [5]]))",
        ([0, 0], [4, 5]), {2: 20}, None,
    ),
    "raise": (
        "f = RAISE(SUM)([COS, SIN])\n"
        "shown = CUBOID([f(0), f(PI / 2) + 1])",
        ([0, 0], [1, 2]), {2: 2}, None,
    ),
    "vectors": (
        "shown = CUBOID(VECTSUM([[1, 2, 3], [1, 1, 1]]) if VECTPROD([[1, 0, 0], [0, 1, 0]]) == [0, "
        "0, 1] else [0])",
        ([0] * 3, [2, 3, 4]), {3: 24}, None,
    ),
    "conditions": (
        "shown = CUBOID([IF([ISNUM, K(2), K(3)])(1), CASE([[LT(0), K(1)], [GE(0), K(5)]])(4)])",
        ([0, 0], [2, 5]), {2: 10}, None,
    ),
    "lists": (
        "shown = CUBOID(AL([1, AR([[2], 3])]) if TREE(SUM)([1, 2, 3]) == 6 and INTSTO(3) == [1, 2, "
        "3] else [0])",
        ([0] * 3, [1, 2, 3]), {3: 6}, None,
    ),
    "map and range are lists": (
        "shown = CUBOID(map(float, range(1, 3)) + [1])",
        ([0] * 3, [1, 2, 1]), {3: 2}, None,
    ),
    # Appearance: nothing of it changes what is there.
    "colours": (
        "shown = COLOR(RED)(STRUCT([COLOR([0, 1, 0, 1])(CUBOID([1, 1])), MATERIAL([1] * "
        "17)(T(1)(1)(CUBOID([1, 1]))), TEXTURE('x.png')(T(1)(2)(CUBOID([1, 1])))]))",
        ([0, 0], [3, 1]), {2: 3}, None,
    ),
    # The names of the compiled module.
    "Plasm": (
        "shown = Plasm.Struct([Plasm.cube(3, -1, 1), Plasm.translate(Plasm.cube(3), Vecf(0, 4, 0, 0))])",
        ([-1] * 3, [5, 1, 1]), {3: 9}, None,
    ),
    "Plasm.mkpol": (
        "shown = Plasm.power(Plasm.mkpol(2, [0, 0, 1, 0, 0, 1], [[0, 1, 2]]), Plasm.cube(1))",
        ([0] * 3, [1] * 3), {3: 0.5}, None,
    ),
    "limits": (
        "b = Plasm.limits(T(1)(3)(CUBOID([1, 2])))\n"
        "shown = CUBOID([b.p1[1], b.size()[2]])",
        ([0, 0], [3, 2]), {2: 6}, None,
    ),
    "Hpc of a Grid": ("shown = Hpc(Grid([[1, -1, 1], [2, 2]]))", ([0, 0], [3, 4]), {2: 8}, None),
    # lar.
    "simplex grid": ("shown = SIMPLEXGRID([2, 2, 2])([2, 3, 1])", ([0] * 3, [2] * 3), {3: 8}, None),
    "larExtrude": (
        "v, c = larExtrude(([[0], [1]], [[0, 1]]), [1, -1, 2])\n"
        "shown = MKPOL([v, [[i + 1 for i in s] for s in c], None])",
        ([0, 0], [1, 4]), {2: 3}, None,
    ),
}  # fmt: skip

PYTHON2 = """from pyplasm import *
def wall(n):
\tx = []
        # eight spaces are a tab
        for i in xrange(n / 2):
\t\tx = x + [1, -1]
\tprint "a wall of", n, "parts"
\treturn QUOTE(x)
d = {1: 2}
if d.has_key(1) and 3 <> 4:
    shown = PROD([wall(6), Q(10 / 2)])
VIEW(shown)
"""


def same(a, b, scale=None):
    return abs(a - b) <= 1e-9 * max(1.0, abs(b) if scale is None else scale)


def check_program(name):
    text, box, contents, union = PROGRAMS[name]
    names = {key: getattr(plasm, key) for key in plasm.__all__}
    exec(text, names)
    shown = names["shown"]
    if box is not None:
        found = shown.box()
        assert np.allclose(found, box, rtol=0, atol=1e-9), f"box {found} is to be {box}"
    if contents is not None:
        found = {r: content for r, (_, content) in shown.measures().items() if r}
        fits = set(found) == set(contents) and all(same(found[r], contents[r]) for r in contents)
        assert fits, f"contents {found} are to be {contents}"
    if union is not None:
        found = plasm.VOLUME(shown)
        assert same(found, union), f"the union has {found}, and is to have {union}"


def property_simplices(rng):
    """The content of random simplices is their determinant, in their space and in larger ones."""
    for dimension in range(1, 6):
        points = rng.normal(size=(50, dimension + 1, dimension))
        expected = np.abs(np.linalg.det(points[:, 1:] - points[:, :1])) / math.factorial(dimension)
        turn = np.linalg.qr(rng.normal(size=(dimension + 2, dimension + 2)))[0][:, :dimension]
        for cells in (points, points @ turn.T + 1):
            batch = _complex.Batch(cells, np.arange(50))
            assert (batch.frames()[0] == dimension).all()
            assert np.allclose(batch.measures(), expected, rtol=1e-8)


def in_general_position(points):
    """Whether no point is nearly on a facet of the hull of the others: there the tolerance of a hull may merge facets."""
    dimension, near = points.shape[1], 1e-4
    for chosen in itertools.combinations(range(len(points)), dimension):
        corners = points[list(chosen)]
        edges = corners[1:] - corners[0]
        normal = np.array([(-1) ** i * np.linalg.det(np.delete(edges, i, axis=1)) for i in range(dimension)])
        sides = np.delete(points - corners[0], chosen, axis=0) @ (normal / np.linalg.norm(normal))
        if min(sides.max(), -sides.min()) < near and np.abs(sides).min() < near:
            return False
    return True


def general_points(rng, *shape):
    while True:
        points = rng.uniform(size=shape)
        if in_general_position(points):
            return points


def property_hulls(rng):
    """Hulls of random points, one by one and in batches, have the content of cones over their facets."""
    for dimension, count in ((2, 6), (2, 40), (3, 8), (3, 30), (4, 12)):
        points = np.array([general_points(rng, count, dimension) for _ in range(4)])
        contents = _cells.hull_measures(points)
        for cell, content in zip(points, contents):
            total, inner = 0.0, cell.mean(axis=0)
            for facet in _cells.facets(cell):
                corners = cell[list(facet)]
                assert len(facet) == dimension
                total += abs(np.linalg.det(corners - inner)) / math.factorial(dimension)
                normal = np.linalg.svd(corners - corners[0])[2][-1]
                sides = (cell - corners[0]) @ normal
                assert sides.max() < 1e-9 or sides.min() > -1e-9
            assert same(total, content), (total, content)
            # Euler: the faces of all dimensions, and the cell itself, alternate to 1.
            faces = _cells.hull_shape(cell).faces
            assert sum((-1) ** r * len(level) for r, level in enumerate(faces)) == 1
            corners = {i for facet in _cells.facets(cell) for i in facet}
            batch = _complex.Batch(cell[None], np.zeros(1, int))
            found = np.flatnonzero(_cells.extremes(cell[None], *batch.frames())[0])
            assert set(found) == corners
    # In batches of equal points, with what is no corner among them, the faces are those found one by one.
    cube = np.array(list(np.ndindex(2, 2, 2)), float)
    cells = np.concatenate([cube, rng.uniform(0.1, 0.9, size=(1, 3)), [[0.5, 0.5, 0.0]]])
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    batch = np.concatenate([[cells @ turn], rng.normal(size=(30, 10, 3))])
    for shape, chosen in _cells.hull_shapes(batch):
        for i in chosen:
            assert shape.faces == _cells.hull_shape(batch[i]).faces
    assert len(_cells.hull_shape(cells).faces[2]) == 6 and len(_cells.hull_shape(cells).faces[1]) == 12


def property_products(rng):
    """The content of a product is the product of contents; its skeletons are those of its hull."""
    for a, b in ((1, 1), (2, 1), (1, 2), (2, 2)):
        first, second = (plasm.CONVEXHULL(rng.uniform(size=(d + 3, d)).tolist()) for d in (a, b))
        product = plasm.PROD([first, second])
        sizes = [pol.measures()[d][1] for pol, d in ((first, a), (second, b))]
        assert same(product.measures()[a + b][1], sizes[0] * sizes[1])
        hull = plasm.JOIN(product)
        assert same(hull.measures()[a + b][1], sizes[0] * sizes[1])
        for r in range(1, a + b):
            one, other = (pol.skeleton(r).measures()[r] for pol in (product, hull))
            assert one[0] == other[0] and same(one[1], other[1]), (a, b, r, one, other)


def property_maps(rng):
    """Maps multiply contents by their determinant; where they stand in a structure does not matter."""
    for _ in range(10):
        matrix = np.eye(4)
        matrix[1:, 1:] = rng.normal(size=(3, 3))
        matrix[1:, 0] = rng.normal(size=3)
        parts = [
            plasm.CUBOID([1, 2, 3]),
            plasm.T(1)(0.5),
            plasm.SKEL_2(plasm.SIMPLEX(3)),
            plasm.CYLINDER([1, 1])(5),
        ]
        inside = plasm.STRUCT([plasm.MAT(matrix.tolist())] + parts)
        outside = plasm.MAP(lambda p: (matrix[1:, 1:] @ p + matrix[1:, 0]).tolist())(plasm.STRUCT(parts))
        assert np.allclose(inside.box(), outside.box())
        one, other = inside.measures(), outside.measures()
        assert {r: n for r, (n, _) in one.items()} == {r: n for r, (n, _) in other.items()}
        assert all(same(one[r][1], other[r][1]) for r in one), (one, other)
        solid = plasm.STRUCT(parts).measures()[3][1]
        assert same(one[3][1], solid * abs(np.linalg.det(matrix[1:, 1:])))


def property_thin_cells(rng):
    """Cells that are thinner than a length are flat, wherever they stand and whatever scales them; solids stay."""
    quad = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    bent = 10.0 ** rng.uniform(-4, -1, size=30)  # how far one corner is out of the plane of the others
    cells = np.repeat(quad[None], 30, axis=0)
    cells[:, 2, 2] = bent
    least = np.linalg.svd(cells - cells[:, :1], compute_uv=False)[:, 2]
    quads = _complex.leaf([_complex.Batch(cells, np.arange(30))], 3)
    turn = geometry.ROTN([rng.uniform(1, 2), rng.normal(size=3).tolist()])
    for scale in (1, 8, -0.5):
        moved = turn(plasm.S([1, 2, 3])([scale] * 3)(quads))
        for limit in (1e-3, 1e-2):
            flat = least * abs(scale) <= limit
            found = moved.measures(limit)
            assert found[2][0] == flat.sum() and found[3][0] == 30 - flat.sum()
            assert same(found[3][1], bent[~flat].sum() / 6 * abs(scale) ** 3)
            assert abs(found[2][1] / (flat.sum() * scale**2) - 1) < 1e-3
    sheet = plasm.S(3)(1e-4)(quads)
    assert sheet.measures(1e-4)[2][0] == 30
    assert list(plasm.CUBOID([1, 1, 1e-5]).measures(1e-3)) == [3]


def property_unions(rng):
    """The union of random boxes is what inclusion and exclusion say."""
    for dimension in (2, 3):
        low = rng.integers(0, 6, size=(4, dimension)) / 4
        high = low + rng.integers(1, 6, size=(4, dimension)) / 4
        boxes = [geometry._box(a, b) for a, b in zip(low, high)]
        expected = 0.0
        for subset in range(1, 16):
            chosen = [i for i in range(4) if subset >> i & 1]
            common = np.prod(np.maximum(0, high[chosen].min(axis=0) - low[chosen].max(axis=0)))
            expected += common if len(chosen) % 2 else -common
        assert same(plasm.VOLUME(plasm.STRUCT(boxes)), expected)
        assert same(plasm.UNION(boxes).solid_volume(), expected)


def property_order(rng):
    """The cells of UKPOL stand in the order in which they were put together."""
    expected, parts = [], []
    for i in rng.permutation(40):
        pol = [plasm.CUBOID([1, 1, 1]), plasm.SIMPLEX(3), plasm.Q(1)][i % 3]
        parts += [plasm.T(1)(float(100 * i))(pol)]
        expected.append(float(100 * i))
    points, cells, _ = plasm.UKPOL(plasm.STRUCT([plasm.STRUCT(parts[:20]), plasm.STRUCT(parts[20:])]))
    assert [min(points[v - 1][0] for v in cell) for cell in cells] == expected


def check_sizes(rng):
    """Two grids of 512,000 cells, and 5,000 entries of STRUCT, are measured without a loop over cells."""
    began = time.process_time()
    n = 80
    grid = plasm.INSR(plasm.PROD)([plasm.INTERVALS(1)(n)] * 3)
    grid = plasm.STRUCT([grid, plasm.T(1)(2)(grid)])
    assert grid.cell_count() == 2 * n**3
    assert same(grid.measures()[3][1], 2.0)
    assert np.allclose(grid.box(), ([0, 0, 0], [3, 1, 1]))
    tower = plasm.STRUCT(plasm.NN(5000)([plasm.CUBOID([1, 1, 1]), plasm.T(3)(1), plasm.R([1, 2])(0.01)]))
    assert same(tower.measures()[3][1], 5000.0) and same(tower.box()[1][2], 5000.0)
    assert time.process_time() - began < 60  # a loop over cells takes minutes


def check_skeletons_of_booleans(rng):
    """A face of a Boolean's cells that is a line by roundings is none: circles that agree but for these."""
    parts = [i / 32 * PI for i in range(33)]
    half = plasm.CONVEXHULL([[0.5 * math.cos(a), 0.5 * math.sin(a)] for a in parts])
    net = plasm.MAP(lambda p: [p[1] * math.cos(p[0]), p[1] * math.sin(p[0]), p[2]])
    disk = net(plasm.INSR(plasm.PROD)([plasm.INTERVALS(PI)(32), plasm.INTERVALS(0.66)(4), plasm.Q(0.22)]))
    faces = plasm.SKELETON(2)(plasm.DIFFERENCE([disk, plasm.PROD([half, plasm.Q(0.22)])]))
    assert list(faces.measures()) == [2]


def check_inverses(rng):
    """A matrix that is singular but for roundings has no inverse; one whose rows are small has."""
    for _ in range(20):
        a, b = rng.normal(size=(2, 3))
        normal = np.cross(a, b)
        assert np.allclose(np.array(plasm.INV([a, b, 1e-9 * normal])) @ [a, b, 1e-9 * normal], np.eye(3))
        assert np.isnan(plasm.INV([a, (-1.1 * a).tolist(), (1e-16 * normal).tolist()])).all()
    assert np.isnan(plasm.INV([[0, 0], [0, 1]])).all()


def check_packages_of_python2(rng):
    """Within a package a module is found beside the one that imports it; what few have is missed when called."""
    with tempfile.TemporaryDirectory() as folder:
        package = pathlib.Path(folder, "furniture")
        package.mkdir()
        (package / "__init__.py").write_text("from sizes import *\nimport legs\nprint 'read'\n")
        (package / "sizes.py").write_text("HEIGHT = 3\n")
        (package / "legs.py").write_text("from sizes import HEIGHT\nfrom p2t import *\nleg = [1, 1, HEIGHT]\n")
        pathlib.Path(folder, "sizes.py").write_text("HEIGHT = 7\n")
        path = pathlib.Path(folder, "table.py")
        path.write_text(
            "from pyplasm import *\nimport furniture, triangle\nshown = CUBOID(furniture.legs.leg)\n"
            "try:\n    triangle.triangulate({})\nexcept ImportError as error:\n    told = str(error)\n"
        )
        with open(os.devnull, "w") as sink:
            out, sys.stdout = sys.stdout, sink
            try:
                names = run.run(path)
            finally:
                sys.stdout = out
        assert np.allclose(names["shown"].box(), ([0, 0, 0], [1, 1, 3]))
        assert "triangle" in names["told"]


def check_python2(rng):
    """A program of Python 2, with tabs, runs as a file; so does one that imports nothing."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder, "wall.py")
        path.write_text(PYTHON2)
        with open(os.devnull, "w") as sink:
            out, sys.stdout = sys.stdout, sink
            try:
                names = run.run(path)
            finally:
                sys.stdout = out
        assert np.allclose(names["shown"].box(), ([0, 0], [5, 5]))
        assert same(names["shown"].measures()[2][1], 15.0)
        path.write_text("VIEW(CUBOID([1,1]))\n")
        done = subprocess.run(
            [sys.executable, "-m", "bsp2.plasm", str(path)], cwd=folder,
            env=dict(os.environ, BSP2_VIEW="png"), capture_output=True, text=True,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        assert pathlib.Path(folder, "view_1.png").read_bytes()[:4] == b"\x89PNG"
        path.write_text(
            "from larcc import *\nfrom pyplasm import *\nshown = STRUCT(MKPOLS(larCuboids([2, 2])))\n"
        )
        assert same(run.run(path)["shown"].measures()[2][1], 4.0)


def check_command(rng):
    """What is wrong with a program ends it with code 2, and a message that has no lines of the library."""
    cases = {
        "VIEW(CUBE(1))\n": (0, ""),
        "VIEW(CUBOID([1,\n": (2, "SyntaxError"),
        "from pyplasm import *\nDIFFERENCE([])\n": (2, "line 2, in <module>"),
        "MAP(lambda p: q)(CUBE(1))\n": (2, "NameError: name 'q' is not defined"),
        "SAVE('solid.xyz')(CUBE(1))\n": (2, "cannot write 'solid.xyz'"),
        "DIFFERENCE([CUBOID([float('nan'), 1]), CUBOID([1, 1])])\n": (2, "not a finite number"),
        "UNION([CUBE(1), S(3)(1e-13)(CUBE(1))])\n": (0, "line 1, in a warning"),
        "from bsp2.plasm import _cells\n_cells.frames = None\nimport sys\nsys.exit(5)\n": (5, ""),
        "raise KeyboardInterrupt\n": (130, "bsp2.plasm: interrupted\n"),
        None: (2, "program.py: no such file"),
    }
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder, "program.py")
        for text, (code, part) in cases.items():
            path.unlink(missing_ok=True)
            if text is not None:
                path.write_text(text)
            done = subprocess.run(
                [sys.executable, "-m", "bsp2.plasm", str(path)], cwd=folder, capture_output=True, text=True
            )
            assert done.returncode == code, (text, done)
            if part == "line 1, in a warning":
                assert f"{path}:1: ModelWarning: " in done.stderr, (text, done.stderr)
            else:
                assert part in done.stderr and bool(part) == bool(done.stderr), (text, done.stderr)
            assert "geometry.py" not in done.stderr, (text, done.stderr)


def check_pyplasm(rng):
    """The package of that name has all of this."""
    sources = pathlib.Path(__file__).resolve().parents[2] / "python"
    built = pathlib.Path(plasm.__file__).parents[2]  # before its sources, which have no compiled module
    paths = f"{built}{os.pathsep}{sources}"
    text = "from pyplasm import *\nprint(VOLUME(UNION([CUBE(2), CUBE(1)])))"
    done = subprocess.run(
        [sys.executable, "-c", text], env=dict(os.environ, PYTHONPATH=paths), capture_output=True, text=True
    )
    assert done.stdout == "8.0\n", done


def check_errors(rng):
    """Mistakes are exceptions with a sentence."""
    for text, kind in (
        ("STRUCT([])", ValueError),
        ("STRUCT(3)", TypeError),
        ("STRUCT([1])", TypeError),
        ("STRUCT([T(1)(1)])", ValueError),
        ("POWER([1])", ValueError),
        ("MKPOL([[[0, 0], [1]], [[1]], None])", ValueError),
        ("VIEW(3)", TypeError),
        ("MAP(lambda p: 1)(Q(1))", TypeError),
        ("T(1)(1)(7)", TypeError),
        ("COLOR(3)", TypeError),
        ("BSPLINE(2)([0, 1])([[0], [1]])", ValueError),
        ("SIZE(1)(DIFFERENCE([Q(1), Q(2)]))", ValueError),
        ("UNION([])", TypeError),
        ("UNION([CUBE(1), 3])", TypeError),
        ("VOLUME(3)", TypeError),
        ("SAVE('a.stl')(3)", TypeError),
    ):
        try:
            eval(text, {key: getattr(plasm, key) for key in plasm.__all__})
        except kind as error:
            assert str(error)
        else:
            raise AssertionError(f"{text} is no error")
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        plasm.MKPOL([[[0, 0], [1, 0]], [[1, 2, 3]], None])
    assert len(told) == 1 and "point 3" in str(told[0].message)


def check_files(rng):
    """Complexes are written as they are, solids by the kernel."""
    pol = plasm.STRUCT(
        [plasm.CYLINDER([1, 1])(6), plasm.SPHERE(1)([4, 6]), plasm.POLYLINE([[0, 0], [3, 4]]), plasm.MK([9])]
    )
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "all.vtu")
        plasm.SAVE(path)(pol)
        text = pathlib.Path(path).read_text()
        assert f'NumberOfCells="{pol.cell_count()}"' in text
        for ending in ("stl", "csg", "png", "h5"):
            plasm.SAVE(os.path.join(folder, "solid." + ending))(pol)
            assert os.path.getsize(os.path.join(folder, "solid." + ending)) > 100
        plasm.SAVE(os.path.join(folder, "lines.obj"))(plasm.SKEL_1(plasm.CUBOID([1, 1, 1])))
        lines = pathlib.Path(folder, "lines.obj").read_text().splitlines()
        assert sum(line.startswith("l ") for line in lines) == 12
        try:
            plasm.SAVE(os.path.join(folder, "lines.stl"))(plasm.SKEL_1(pol))
        except ValueError as error:
            assert "solid" in str(error)
        else:
            raise AssertionError("lines have no surface")


def check_lar(rng):
    """A diagram with a block replaced has the same volume, and shares the points of the cut."""
    master = lar.assemblyDiagramInit([3, 3, 2])([[0.5, 3, 0.5], [0.5, 2, 0.5], [0.25, 2.5]])
    door = lar.assemblyDiagramInit([3, 1, 2])([[1, 1, 1], [1], [2, 1]])
    points, cells = lar.diagram2cell(door, master, 10)
    shown = plasm.STRUCT(lar.MKPOLS((points, cells)))
    assert len(cells) == 17 + 6 and same(shown.measures()[3][1], 4 * 3 * 2.75)
    model = lar.larApply(lar.t(1, 2, 3) @ lar.s(2, 2, 2))(lar.larCuboids([1, 1, 1]))
    assert np.allclose(plasm.STRUCT(lar.MKPOLS(model)).box(), ([1, 2, 3], [3, 4, 5]))
    both = lar.struct2lar(lar.Struct([lar.larCuboids([1, 1]), lar.t(1, 0), lar.larCuboids([1, 1])]))
    assert len(both[0]) == 6 and len(both[1]) == 2
    cubes = lar.larCuboids([2, 2, 2], True)
    assert len(lar.boundaryCells(cubes[1][3], cubes[1][2])) == 24


def main():
    given = sys.argv[1:]
    seed = (
        int(given.pop(given.index("--seed") + 1))
        if "--seed" in given
        else random.SystemRandom().randrange(2**31)
    )
    if "--seed" in given:
        given.remove("--seed")
    functions = {
        n: f for n, f in globals().items() if n.startswith(("property_", "check_")) and n != "check_program"
    }
    failed = 0
    for name in list(PROGRAMS) + list(functions):
        if given and name not in given:
            continue
        try:
            if name in PROGRAMS:
                check_program(name)
            else:
                functions[name](np.random.default_rng(seed))
        except Exception as error:
            failed += 1
            print(f"FAILED {name}: {type(error).__name__}: {error}")
            if not isinstance(error, AssertionError):
                import traceback

                traceback.print_exc()
    print(f"{len(PROGRAMS)} programs, {len(functions)} properties, seed {seed}: {failed or 'none'} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
