"""What `import bsp2` promises. Run by CTest; by hand: PYTHONPATH=build/release/python /usr/bin/python3 python/tests/test_bsp2.py"""

import ast
import gc
import importlib.util
import math
import os
import pathlib
import pickle
import random
import re
import signal
import subprocess
import sys
import tempfile
import time
import threading
import unittest
import warnings

import numpy as np

import bsp2

SEED = int(os.environ.get("BSP2_SEED", 1))
SOURCE = pathlib.Path(__file__).resolve().parents[2]


def drilled():
    return bsp2.cuboid([4, 3, 1]) - bsp2.cylinder(h=3, r=1, fn=16).translate([2, 1.5, -1])


class Models(unittest.TestCase):
    def test_operators_mean_what_they_say(self):
        """Points in random expressions of boxes, by arithmetic."""
        rng = random.Random(SEED)
        for dimension in range(1, 5):

            def solid(depth):
                if depth == 0:
                    low = np.array([rng.uniform(0, 2) for _ in range(dimension)])
                    high = low + [rng.uniform(1, 2) for _ in range(dimension)]
                    return bsp2.cuboid(high - low).translate(low), lambda x: ((x >= low) & (x <= high)).all(axis=1)
                (a, in_a), (b, in_b) = solid(depth - 1), solid(depth - 1)
                return rng.choice(
                    [
                        (a + b, lambda x: in_a(x) | in_b(x)),
                        (a - b, lambda x: in_a(x) & ~in_b(x)),
                        (a & b, lambda x: in_a(x) & in_b(x)),
                        (a ^ b, lambda x: in_a(x) ^ in_b(x)),
                        (a & ~b, lambda x: in_a(x) & ~in_b(x)),
                    ]
                )

            model, contains = solid(3)
            points = np.array([[rng.uniform(-1, 5) for _ in range(dimension)] for _ in range(300)])
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                result = model.evaluate(threads=1)
            found = result.locate(points)
            message = f"BSP2_SEED={SEED}, dimension {dimension}"
            np.testing.assert_array_equal(found.labels == bsp2.IN, contains(points), message)
            np.testing.assert_array_equal(result.distance(points) < 0, contains(points), message)
            self.assertEqual(bsp2.parse(str(model)).dimension, dimension)
            self.assertEqual(pickle.loads(pickle.dumps(model)).to_text().count("cuboid"), str(model).count("cuboid"))

    def test_arrays_of_any_kind(self):
        square = [[0, 0], [2, 0], [0, 2]]
        for dtype in (bool, np.int8, np.uint16, np.int64, np.float16, np.float32, np.float64, np.longdouble):
            model = bsp2.polygon(np.array(square, dtype=dtype))
            self.assertAlmostEqual(model.evaluate(threads=1).volume, 0.5 if dtype is bool else 2)
        turned = np.array(square, order="F")[::-1]
        self.assertAlmostEqual(bsp2.polytope(turned).evaluate(threads=1).volume, 2)
        self.assertEqual(bsp2.cuboid(np.array([1, 2, 3], dtype=np.int8)).translate(np.float32([1, 2, 3])).evaluate().volume, 6)
        for number, wrong in enumerate((
            lambda: bsp2.polygon(np.array(square) * 1j),
            lambda: bsp2.polygon(np.array(square, dtype="datetime64[s]")),
            lambda: bsp2.polygon(np.array(square, dtype=object)),
            lambda: bsp2.polytope([["a", "b"]]),
            lambda: bsp2.polytope([[1, 2], [3]]),
            lambda: bsp2.polytope([1, 2, 3]),
            lambda: bsp2.cuboid("12"),
            lambda: bsp2.cuboid([1, 2j]),
            lambda: bsp2.cube(None),
            lambda: bsp2.cube().translate([1, 2]),
            lambda: bsp2.cube().transform(np.eye(3)),
            lambda: bsp2.cube(math.nan),
            lambda: bsp2.cube(math.inf),
            lambda: bsp2.mesh([[0, 0, 0]], [[0, 1, 2]]),
            lambda: bsp2.mesh([[0, 0, 0]], [[0.5, 0, 0]]),
            lambda: bsp2.mesh([[0, 0, 0]], [[-1, 0, 0]]),
            lambda: bsp2.mesh([[0, 0, 0]], [[2**32, 0, 0]]),
            lambda: bsp2.mesh([[0, 0, 0]], np.array([[2**64 - 1, 0, 0]], dtype=np.uint64)),
            lambda: bsp2.polygon(square, np.array([[0, 1, 2.5]])),
            lambda: bsp2.ball(7),
            lambda: bsp2.node("cube", size=object()),
            lambda: bsp2.union(1),
            lambda: bsp2.union([1]),
            lambda: bsp2.cube() + 1,
            lambda: 1 + bsp2.cube(),
            lambda: bsp2.cube() + bsp2.square(),
            lambda: drilled().evaluate(thread=1),
            lambda: drilled().evaluate(threads=-1),
            lambda: drilled().evaluate(threads=10**9),
            lambda: drilled().evaluate(timeout=float("nan")),
            lambda: bsp2.ball(3).evaluate(tolerance=0.5, angle=5, eye=[float("inf"), 0, 0]),
            lambda: drilled().evaluate(order="sideways"),
            lambda: drilled().evaluate().locate([[1, 2]]),
            lambda: drilled().evaluate().locate([1, 2, 3]),
            lambda: drilled().evaluate().save("/dev/null/x.stl"),
            lambda: drilled().evaluate().picture(size=(0, 10)),
            lambda: drilled().evaluate().picture(edges="sharp"),
            lambda: drilled().evaluate().picture(shade="mood"),
            lambda: drilled().evaluate().picture(colour="red"),
        )):
            with self.subTest(number=number), self.assertRaises((TypeError, ValueError, bsp2.Error)):
                wrong()

    def test_pictures_look_as_they_are_asked_to(self):
        result = drilled().evaluate()
        plain = result.picture(size=(80, 80))
        looks = [{"edges": "feature"}, {"edges": "cells"}, {"axes": True}, {"transparent": True}, {"shade": "level"}]
        pictures = [result.picture(size=(80, 80), **look) for look in looks]
        self.assertEqual(len({plain, *pictures}), len(looks) + 1)
        self.assertEqual(result.picture(size=(80, 80), edges=True), pictures[1])
        self.assertEqual(result.picture(size=(80, 80), edges=False), plain)
        self.assertNotEqual(result.picture(size=(80, 80), shade="level", legend=False), pictures[4])
        self.assertTrue(result.picture("svg", edges="feature").startswith(b"<?xml"))

    def test_errors_have_the_message_of_the_program(self):
        with self.assertRaises(bsp2.Error) as caught:
            bsp2.parse("cube(")
        self.assertIn("model:1:6", str(caught.exception))
        self.assertTrue(caught.exception.is_users_mistake)
        with self.assertWarnsRegex(bsp2.ModelWarning, "empty"):
            (bsp2.cube() & bsp2.cube().translate([5, 0, 0])).evaluate()

    def test_no_arguments_end_python(self):
        """Whatever a function is given: a model, or an exception that says why not."""
        rng = random.Random(SEED)
        odd = [0, 1, -1, 2.5, math.nan, math.inf, 10**30, 2**31, True, None, "x", "", b"q", [], {}, np.array([]), np.zeros((2, 3)), object(), 1j]
        solids = [bsp2.cube(), bsp2.square(), bsp2.ball(3), bsp2.cuboid([1, 1, 1, 1]), bsp2.Expression(), bsp2.cuboid([1])]

        def value(depth=0):
            kind = rng.randrange(6 if depth < 3 else 4)
            if kind == 0:
                return rng.choice(odd)
            if kind == 1:
                return rng.choice(solids)
            if kind == 2:
                return rng.uniform(-2, 5)
            if kind == 3:
                return [[rng.uniform(-3, 3) for _ in range(3)] for _ in range(rng.randrange(6))]
            return [value(depth + 1) for _ in range(rng.randrange(4))]

        functions = [name for name in dir(bsp2) if type(getattr(bsp2, name)).__name__ == "builtin_function_or_method" and name[0] != "_"]
        self.assertGreater(len(functions), 40)
        methods = "translate rotate rotate_plane scale mirror transform projective resize part measure color".split()
        made = 0
        for _ in range(1000):
            name = rng.choice(functions)
            keywords = re.findall(r"(\w+): ", (getattr(bsp2, name).__doc__ or "").split("\n")[0])
            arguments = [value() for _ in range(rng.randrange(3))], {word: value() for word in keywords if rng.random() < 0.3}
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    model = getattr(bsp2, name)(*arguments[0], **arguments[1])
                    made += 1
                    if rng.random() < 0.5:
                        model = getattr(model, rng.choice(methods))(value())
                    if model.dimension < 4:
                        model.evaluate(threads=1, level=4, tolerance=0.5).cells
            except (TypeError, ValueError, AttributeError):
                pass
            except bsp2.Error as error:
                self.assertTrue(error.is_users_mistake, f"BSP2_SEED={SEED}: {name} {arguments}: {error}")
        self.assertGreater(made, 10)

    def test_a_list_in_itself_is_refused(self):
        endless = [1]
        endless.append(endless)
        for make in (lambda: bsp2.node("cube", size=endless), lambda: bsp2.bezier(endless)):
            with self.assertRaises(RecursionError):
                make()
        self.assertEqual(bsp2.node("cube", size=[1, 2, 3]).evaluate(threads=1).volume, 6)

    def test_texts_go_anywhere(self):
        with tempfile.TemporaryDirectory() as folder:
            drilled().evaluate().save(f"{folder}/a.stl")
            pathlib.Path(folder, "m.csg").write_text('import("a.stl"); import(file = "./a.stl");')
            model = bsp2.load(f"{folder}/m.csg")
            result = model.evaluate()
            result.save(f"{folder}/elsewhere/m.csg")
            for again in (bsp2.parse(model.to_text()), pickle.loads(pickle.dumps(model)), bsp2.load(f"{folder}/elsewhere/m.csg")):
                self.assertEqual(again.evaluate().digest, result.digest)

    def test_any_node_by_its_name(self):
        self.assertIn("center = true", str(bsp2.node("cube", center=np.bool_(True))))
        grown = bsp2.node("grow", bsp2.square(), delta=0.5)
        self.assertEqual(grown.evaluate(threads=1).volume, 4)
        self.assertIn("$fn = 8", str(bsp2.node("cylinder", h=2, r=np.float32(1), fn=np.int64(8))))
        self.assertEqual(sum(bsp2.cube().translate([2 * i, 0, 0]) for i in range(3)).evaluate().volume, 3)
        self.assertEqual(bsp2.hull([bsp2.square(), bsp2.square().translate([1, 0])]).evaluate().volume, 2)
        self.assertEqual(bsp2.cuboid([1, 2]).rotate(90).evaluate().bounds[0].tolist(), [-2, 0])


class Results(unittest.TestCase):
    def test_arrays_are_no_copies_and_keep_the_result(self):
        result = drilled().evaluate()
        arrays = [getattr(result, name) for name in ("points", "labels", "volumes", "corners", "point_offsets")]
        for array, name in zip(arrays, ("points", "labels", "volumes", "corners", "point_offsets")):
            self.assertEqual(array.ctypes.data, getattr(result, name).ctypes.data)
            self.assertFalse(array.flags.writeable or array.flags.owndata)
        volume, surface = result.volume, result.surface()
        triangles = surface.triangles
        del result, surface
        gc.collect()
        self.assertAlmostEqual(arrays[2].sum(), volume)
        self.assertLess(triangles.max(), 1000)

    def test_cells_fit_their_volumes(self):
        """By the divergence theorem, from the faces."""
        result = drilled().evaluate()
        points, point_offsets, face_offsets, corner_offsets, corners = result.cells
        self.assertEqual(points.shape[1], 3)
        for cell in range(len(result)):
            volume = 0.0
            for face in range(face_offsets[cell], face_offsets[cell + 1]):
                polygon = points[corners[corner_offsets[face] : corner_offsets[face + 1]]]
                for b, c in zip(polygon[1:-1], polygon[2:]):
                    volume += np.dot(polygon[0], np.cross(b, c)) / 6
            self.assertAlmostEqual(volume, result.volumes[cell])
        lower, upper = result.bounds
        np.testing.assert_array_equal(lower, points.min(axis=0))
        np.testing.assert_array_equal(upper, points.max(axis=0))

    def test_round_solids_are_enclosed(self):
        truth = 4 * math.pi / 3
        last = None
        for result in bsp2.ball(3, 1).measure("ball").refine(steps=2, tolerance=0.2):
            self.assertIn(truth, result.volume_interval)
            self.assertIn(truth, result.named_measures["ball"].volume)
            width = result.volume_interval.most - result.volume_interval.least
            self.assertTrue(last is None or width < last)
            last = width

    def test_surface_contacts_files(self):
        model = bsp2.cuboid([1, 1, 1]).part("a") + bsp2.cuboid([1, 1, 1]).translate([1, 0, 0]).part("b").color("red")
        result = model.evaluate()
        surface = result.surface()
        self.assertTrue(surface.closed)
        self.assertAlmostEqual(surface.area, 10)
        self.assertEqual(sorted(part.name for part in result.named_parts), ["a", "b"])
        self.assertEqual(set(surface.parts.tolist()), {0, 1})
        cells, faces, areas = result.contacts()
        self.assertEqual((len(cells), areas.tolist()), (1, [1.0]))
        with tempfile.TemporaryDirectory() as folder:
            triangles = surface.points, surface.triangles
            before = [array.copy() for array in triangles]
            for ending in "pvtu stl ply obj vtp png svg json csg brep".split():
                path = pathlib.Path(folder) / "new" / ("x." + ending)
                result.save(path)
                self.assertGreater(path.stat().st_size, 50)
            for array, copy in zip(triangles, before):  # a view of what is still there
                np.testing.assert_array_equal(array, copy)
            self.assertEqual(surface.points.ctypes.data, result.surface().points.ctypes.data)
            again = bsp2.load(pathlib.Path(folder) / "new" / "x.csg").evaluate()
            self.assertEqual(again.digest, result.digest)
            mesh = bsp2.mesh(*result.triangles()).evaluate()
            self.assertAlmostEqual(mesh.volume, 2)
        self.assertTrue(result._repr_png_().startswith(b"\x89PNG"))
        self.assertEqual(result.report["digest"], result.digest)
        np.testing.assert_allclose(result.centroid, [1, 0.5, 0.5])
        self.assertEqual(result.inertia.shape, (4, 4))

    def test_faces_without_cells(self):
        with tempfile.TemporaryDirectory() as folder:
            drilled().evaluate(surface_only=True, faces=True).save(f"{folder}/x.step")
            self.assertGreater(os.path.getsize(f"{folder}/x.step"), 1000)
            with self.assertRaisesRegex(bsp2.Error, "faces"):
                drilled().evaluate(surface_only=True).save(f"{folder}/y.step")

    def test_surfaces_are_cleaned(self):
        # Exactly, the faces of this roof meet in very many corners beside its top.
        result = bsp2.parse("roof() circle(r = 10, $fn = 60);").evaluate()
        with tempfile.TemporaryDirectory() as folder:
            result.save(f"{folder}/exact.off", clean=0)
            result.save(f"{folder}/clean.off", clean=0.001)
            triangles = [int(open(f"{folder}/{name}.off").read().split()[2]) for name in ("exact", "clean")]
            self.assertGreater(triangles[0], 118)
            self.assertEqual(triangles[1], 118)
            with self.assertRaises(bsp2.Error):
                result.save(f"{folder}/clean.off", clean=-1)

    def test_snapshots_are_gone_on_from(self):
        model = drilled()
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "s.h5")
            part = model.evaluate(cells=2, snapshot=path, regions=4)
            self.assertEqual(bsp2.resume(path, snapshot=f"{folder}/t.h5").digest, model.evaluate(regions=4).digest)
            self.assertTrue(bsp2.resume(f"{folder}/t.h5").complete)
            for options in ({"curved": True}, {"coincidence": 0}, {"parts_by_color": True}):
                with self.assertRaises(bsp2.Error):
                    bsp2.resume(path, **options)
            self.assertIsInstance(part.complete, bool)


class Running(unittest.TestCase):
    def test_progress_and_stop(self):
        told = []
        result = bsp2.ball(4).evaluate(
            tolerance=1e-3, progress=lambda *now: told.append(now), stop=lambda: any(name == "computation" for name, _, _ in told)
        )
        self.assertTrue(result.interrupted)
        self.assertEqual(len(result), 0)
        self.assertIn("compilation", {name for name, _, _ in told})

    def test_exceptions_of_callbacks_come_out(self):
        def fails(*_):
            raise KeyError("mine")

        with self.assertRaises(KeyError):
            bsp2.ball(4).evaluate(tolerance=1e-3, progress=fails)
        with self.assertRaises(KeyError):
            bsp2.ball(4).evaluate(tolerance=1e-3, stop=fails)

    def test_other_threads_go_on(self):
        stop, counted = threading.Event(), [0]

        def count():
            while not stop.is_set():
                counted[0] += 1

        def long_enough():
            return counted[0] > 1000

        thread = threading.Thread(target=count)
        thread.start()
        try:
            # Stopped by what another thread does: without it this would take minutes.
            self.assertTrue(bsp2.ball(4).evaluate(tolerance=1e-3, stop=long_enough).interrupted)
        finally:
            stop.set()
            thread.join()

    def test_ctrl_c_ends_it(self):
        script = (
            "import bsp2, sys\n"
            "def tell(name, done, cells):\n"
            "    if name == 'computation': print('now', flush=True)\n"
            "try: bsp2.ball(5).evaluate(tolerance=1e-4, progress=tell)\n"
            "except KeyboardInterrupt: print('interrupted'); sys.exit(7)\n"
        )
        with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as process:
            self.assertEqual(process.stdout.readline(), "now\n")
            process.send_signal(signal.SIGINT)
            said, _ = process.communicate(timeout=60)
            self.assertEqual((process.returncode, said.splitlines()[-1]), (7, "interrupted"))

    def test_nothing_leaks(self):
        def memory():
            gc.collect()
            with open("/proc/self/statm") as file:
                return int(file.read().split()[1]) * 4096

        def work(times):
            for _ in range(times):
                result = drilled().evaluate(threads=1)
                result.points, result.surface().triangles, result.locate([[1, 1, 1]])

        work(100)
        before = memory()
        work(300)
        self.assertLess(memory() - before, 300 * 4096 * 2)  # what each has takes 20 kB and more

    def test_the_same_on_several_ranks(self):
        mpirun = os.environ.get("BSP2_MPIRUN")
        if not mpirun:
            self.skipTest("no mpirun is named")
        script = (
            "import bsp2, sys\n"
            "result = (bsp2.cube(3) - bsp2.sphere(1.5, fn=20)).evaluate(regions=8, surface=True)\n"
            "if bsp2.ranks().is_master: print(bsp2.ranks().count, result.digest, result.surface().digest)\n"
            "result.save(sys.argv[1])\n"
        )
        with tempfile.TemporaryDirectory() as folder:
            said = {}
            for count in (1, 3):
                command = [mpirun, "--oversubscribe", "-n", str(count), sys.executable, "-c", script, f"{folder}/x.pvtu"]
                said[count] = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, timeout=120).stdout.split()
            self.assertEqual((said[1][0], said[3][0]), ("1", "3"))
            self.assertEqual(said[1][1:], said[3][1:])
            self.assertTrue(os.path.exists(f"{folder}/x.pvtu"))

    def on_ranks(self, count, script, *arguments):
        mpirun = os.environ.get("BSP2_MPIRUN")
        if not mpirun:
            self.skipTest("no mpirun is named")
        command = [mpirun, "--oversubscribe", "-n", str(count), sys.executable, "-c", script, *arguments]
        return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, timeout=100).stdout.split()

    def test_the_master_has_the_mesh(self):
        script = (
            "import bsp2\n"
            "mesh = bsp2.solver_mesh(bsp2.cube(), size=1)\n"
            "assert (mesh is None) != bsp2.ranks().is_master\n"
            "if mesh: print(round(mesh.volume, 9))\n"
        )
        self.assertEqual(self.on_ranks(2, script), ["1.0"])

    def test_a_rank_that_ends_early_ends_the_others(self):
        script = (
            "import bsp2\n"
            "bsp2.cube().evaluate()\n"
            "if bsp2.ranks().is_master:\n"
            "    try:\n"
            "        bsp2.cube().evaluate()\n"
            "    except bsp2.Error as error:\n"
            "        print('all ranks have to make the same calls' in str(error))\n"
        )
        begin = time.monotonic()
        self.assertEqual(self.on_ranks(3, script), ["True"])
        self.assertLess(time.monotonic() - begin, 40)  # after 60 s all are ended

    def test_several_ranks_find_all_contacts_again_and_again(self):
        script = (
            "import bsp2, sys\n"
            "for _ in range(2):\n"
            "    ranks = bsp2.Ranks.launched()\n"  # gone, and had again
            "    row = sum(bsp2.cube().translate([i, 0, 0]) for i in range(12))\n"
            "    result = row.evaluate(contacts=True, regions=8, ranks=ranks)\n"
            "    if ranks.is_master: print(ranks.count, len(result.contacts()[0]), sum(result.contacts()[2]))\n"
            "    result = ranks = None\n"
        )
        self.assertEqual(self.on_ranks(3, script), ["3", "11", "11.0"] * 2)

    def test_mpi4py_starts_and_ends_mpi_or_not(self):
        """Whoever starts MPI first: mpi4py ends it while results and ranks are still there."""
        if importlib.util.find_spec("mpi4py") is None:
            self.skipTest("mpi4py is not installed")
        work = (
            "import bsp2\n"
            "result = bsp2.cube(2).evaluate(regions=4)\n"
            "if bsp2.ranks().is_master: print(bsp2.ranks().count, result.volume)\n"
        )
        load = "from mpi4py import MPI\n"
        for script in (load + work, work + load, load + work + "MPI.Finalize()\nprint(end='', flush=True)\n"):
            self.assertEqual(self.on_ranks(2, script), ["2", "8.0"])
            done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=100)
            self.assertEqual((done.returncode, done.stdout), (0, "1 8.0\n"), done.stderr)

    def test_a_file_that_one_rank_cannot_use_ends_all(self):
        script = (
            "import bsp2, sys\n"
            "path = sys.argv[1] + ('/s.h5' if bsp2.ranks().is_master else '')\n"
            "try: bsp2.cube().evaluate(snapshot=path)\n"
            "except bsp2.Error as error: print(error.is_users_mistake)\n"
        )
        with tempfile.TemporaryDirectory() as folder:
            # What ranks print at the same time may be on one line.
            self.assertEqual("".join(self.on_ranks(2, script, folder)), "TrueTrue")


class Hints(unittest.TestCase):
    """The .pyi says what there is."""

    def setUp(self):
        self.tree = ast.parse((SOURCE / "python" / "bsp2" / "__init__.pyi").read_text())

    def test_names(self):
        hinted = {each.name for each in self.tree.body if isinstance(each, (ast.FunctionDef, ast.ClassDef))}
        there = {name for name, value in vars(bsp2).items() if not name.startswith("_") and getattr(value, "__module__", "").startswith("bsp2")}
        self.assertEqual(hinted, there)
        for kind in (each for each in self.tree.body if isinstance(each, ast.ClassDef)):
            for member in kind.body:
                name = member.target.id if isinstance(member, ast.AnnAssign) else getattr(member, "name", None)
                if name and kind.name != "Error":
                    self.assertTrue(hasattr(getattr(bsp2, kind.name), name), f"{kind.name}.{name}")

    def test_keywords(self):
        for function in (each for each in self.tree.body if isinstance(each, ast.FunctionDef)):
            written = re.match(r"\w+\((.*)\) ->", getattr(bsp2, function.name).__doc__ or "")
            if not written:
                continue
            names = {match for match in re.findall(r"(?:^|, )(\w+): ", written[1])}
            arguments = function.args.args + function.args.kwonlyargs
            self.assertEqual({argument.arg for argument in arguments}, names, function.name)


if __name__ == "__main__":
    unittest.main()
