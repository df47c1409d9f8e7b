"""Arrays of any kind wherever lists go: the same as lists of their numbers, or refused. Run by CTest, as test_bsp2.py."""

import datetime
import decimal
import fractions
import os
import random
import unittest
import warnings

import numpy as np

import bsp2

SEED = int(os.environ.get("BSP2_SEED", 1))
ROUNDS = 40 * int(os.environ.get("BSP2_ROUNDS", 1))
REAL = [bool, *np.sctypes["int"], *np.sctypes["uint"], *np.sctypes["float"]]
WHOLE = [*np.sctypes["int"], *np.sctypes["uint"]]

TETRAHEDRON = [[0, 1, 2], [0, 3, 1], [1, 3, 2], [0, 2, 3]]
CUBE = [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]

# Where lists of numbers go: a name, a shape, and what takes them.
REAL_PLACES = {
    "polygon": ((5, 2), lambda a: bsp2.polygon(a)),
    "polytope": ((6, 3), lambda a: bsp2.polytope(a)),
    "polyhedron": ((4, 3), lambda a: bsp2.polyhedron(a, TETRAHEDRON)),
    "mesh": ((4, 3), lambda a: bsp2.mesh(a, TETRAHEDRON)),
    "subdivision": ((4, 3), lambda a: bsp2.subdivision(a, TETRAHEDRON)),
    "sweep": ((3, 2), lambda a: bsp2.sweep(bsp2.square(), a)),
    "transform": ((4, 4), lambda a: bsp2.cube().transform(a)),
    "projective": ((4, 4), lambda a: bsp2.cube().projective(a)),
    "cuboid": ((4,), lambda a: bsp2.cuboid(a)),
    "cube": ((3,), lambda a: bsp2.cube(a)),
    "translate": ((3,), lambda a: bsp2.cube().translate(a)),
    "scale": ((3,), lambda a: bsp2.cube().scale(a)),
    "rotate": ((3,), lambda a: bsp2.cube().rotate(a)),
    "mirror": ((3,), lambda a: bsp2.cube().mirror(a)),
    "resize": ((3,), lambda a: bsp2.cube().resize(a)),
    "extrude": ((2,), lambda a: bsp2.extrude(bsp2.square(), a)),
    "bezier": ((3, 2), lambda a: bsp2.bezier(a)),
    "bspline": ((5, 2), lambda a: bsp2.bspline(a)),
    "node": ((3,), lambda a: bsp2.node("cube", size=a)),
    "a number": ((), lambda a: bsp2.sphere(r=a)),
    "a number of a node": ((), lambda a: bsp2.node("sphere", r=a)),
    "a number as a factor": ((), lambda a: bsp2.cube().scale(a)),
    "an angle": ((), lambda a: bsp2.cube().rotate(a)),
}
WHOLE_PLACES = {
    "triangles": ((4, 3), lambda a: bsp2.mesh(CUBE, a)),
    "faces": ((4, 3), lambda a: bsp2.polyhedron(CUBE, a)),
    "paths": ((2, 3), lambda a: bsp2.polygon([[0, 0], [1, 0], [1, 1], [0, 1], [2, 2], [3, 2], [4, 4], [5, 7]], a)),
    "axes": ((), lambda a: bsp2.cuboid([1, 2, 3]).section(a)),
}


def laid_out(rng, array):
    """The same numbers in memory in another way."""
    if array.ndim == 0:
        return array[()] if rng.random() < 0.5 else array
    kind = rng.randrange(5)
    if kind == 0:
        return np.asfortranarray(array)
    if kind == 1:  # every other one of a larger array
        larger = np.zeros([2 * n for n in array.shape], array.dtype)
        view = larger[tuple(slice(None, None, 2) for _ in array.shape)]
        view[...] = array
        return view
    if kind == 2:  # backwards
        return np.ascontiguousarray(array[::-1])[::-1]
    if kind == 3 and array.dtype.itemsize > 1:  # the other byte order
        return array.astype(array.dtype.newbyteorder())
    array = array.copy()
    array.flags.writeable = False
    return array


class Arrays(unittest.TestCase):
    def places(self, rng, places, kinds):
        for _ in range(ROUNDS):
            name = rng.choice(list(places))
            dtype = np.dtype(rng.choice(kinds))
            yield name, *places[name], dtype, f"BSP2_SEED={SEED}: {name} of {dtype}"

    def test_arrays_mean_what_lists_mean(self):
        rng = random.Random(SEED)
        numbers = np.random.default_rng(SEED)
        for name, shape, make, dtype, message in self.places(rng, REAL_PLACES, REAL):
            if dtype.kind == "f":
                array = numbers.uniform(0.5, 9, size=shape).astype(dtype)
            else:
                high = 2 if dtype.kind == "b" else np.iinfo(dtype).max
                low = 0 if dtype.kind != "i" else -high
                array = numbers.integers(low, min(high, 2**50), size=shape).astype(dtype)  # beyond 2^53 doubles end
            if array.ndim == 0:
                array = np.abs(array) + np.array(1, dtype)
            given = laid_out(rng, array)
            with self.subTest(message):
                if name == "a number" and isinstance(given, np.ndarray) and given.ndim == 0:
                    given = given[()]
                as_lists = np.array(array).tolist()
                if dtype == np.longdouble:
                    as_lists = array.astype(float).tolist()
                self.assertEqual(*(self.text_or_error(make, value) for value in (given, as_lists)))

    def text_or_error(self, make, value):
        try:
            return str(make(value)).replace("true", "1").replace("false", "0")
        except (TypeError, ValueError, bsp2.Error) as error:
            return type(error).__name__

    def test_indices_mean_what_lists_mean(self):
        rng = random.Random(SEED)
        for name, shape, make, dtype, message in self.places(rng, WHOLE_PLACES, WHOLE):
            array = np.array([rng.randrange(1, 4) for _ in range(int(np.prod(shape)))], dtype).reshape(shape)
            with self.subTest(message):
                self.assertEqual(str(make(laid_out(rng, array))), str(make(array.tolist())))

    def test_what_is_no_number_is_refused(self):
        rng = random.Random(SEED)
        for name, (shape, make) in {**REAL_PLACES, **WHOLE_PLACES}.items():
            ones = np.ones(shape)
            masked = np.ma.array(ones, mask=np.arange(ones.size).reshape(shape) == 0)
            odd = [
                ones * (1 + 2j), (ones * (1 + 2j)).astype(np.complex64), ones.astype("M8[s]"), ones.astype("m8[s]"),
                np.full(shape, "1"), np.full(shape, b"1"), np.full(shape, None), masked, ones * np.nan, ones * np.inf, -ones * np.inf,
                np.zeros(shape, [("x", float)]),
            ]  # fmt: skip
            for item in (1j, None, "1", np.nan, np.complex128(1j), np.datetime64(1, "s"), np.ma.masked, datetime.date(2020, 1, 1), object()):
                if shape:
                    lists = ones.tolist()
                    row = rng.choice(lists) if len(shape) == 2 else lists
                    row[rng.randrange(len(row))] = item
                    odd.append(lists)
                else:
                    odd.append(item)
            if name in WHOLE_PLACES:
                odd += [ones, ones * 1.5, (ones * 1.5).astype(np.float32), ones - 2, ones * 1e10, np.full(shape, 2**40), np.full(shape, -(2**31) - 1)]
                if shape == ():
                    odd = [value for value in odd if value is not None]
                    odd += [fractions.Fraction(3, 2), decimal.Decimal("1.5"), np.float16(1.5), np.longdouble(1.5)]
            for value in odd:
                if isinstance(value, np.ndarray) and value.ndim == 0:
                    value = value[()]
                if "node" in name and (value is None or isinstance(value, str) or isinstance(value, list) and "1" in value):
                    continue  # nodes have texts, too, and None says that there is no such argument
                with self.subTest(f"{name} of {value!r}"), self.assertRaises((TypeError, ValueError, bsp2.Error)):
                    with warnings.catch_warnings():
                        warnings.simplefilter("ignore")  # that a part is lost is an error, not a warning
                        made = make(value)
                        made.evaluate(threads=1, level=3, tolerance=1)

    def test_numbers_of_other_kinds(self):
        self.assertEqual(bsp2.cuboid([fractions.Fraction(1, 2), decimal.Decimal("0.5"), np.float16(0.5)]).evaluate().volume, 0.125)
        self.assertEqual(str(bsp2.cuboid(np.array([100, 100], np.int8))), str(bsp2.cuboid([100, 100])))
        large = np.array([2**62, 2**62], np.int64)
        self.assertEqual(str(bsp2.cuboid(large)), str(bsp2.cuboid([2.0**62] * 2)))

    def test_points_of_any_kind_are_located(self):
        rng = random.Random(SEED)
        result = bsp2.cuboid([4, 3, 1]).evaluate()
        points = np.array([[rng.randrange(-1, 6) for _ in range(3)] for _ in range(60)], float)
        expected = result.distance(points)
        for dtype in (*np.sctypes["int"], *np.sctypes["float"]):
            np.testing.assert_array_equal(result.distance(laid_out(rng, points.astype(dtype))), expected)
        for odd in (points * 1j, np.ma.masked_less(points, 0), points.astype("M8[s]"), points * np.nan, points.astype(object), [[None] * 3]):
            with self.assertRaises((TypeError, ValueError, bsp2.Error)):
                result.distance(odd)


if __name__ == "__main__":
    unittest.main()
