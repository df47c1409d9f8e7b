"""Meshes for solvers, drawings, sections and the viewer of the module bsp2. Run by CTest, as test_bsp2.py."""

import importlib.util
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile
import unittest
import warnings
import xml.etree.ElementTree
import zipfile

import numpy as np

import bsp2

SOURCE = pathlib.Path(__file__).resolve().parents[2]
SEED = int(os.environ.get("BSP2_SEED", 1))


def some_boxes(rng, count=4):
    """Boxes on a grid, so that figures are exact: the solid, and a function that tells which points are inside."""
    low = np.array([[rng.randrange(4) for _ in range(3)] for _ in range(count)], float)
    high = low + np.array([[rng.randrange(1, 4) for _ in range(3)] for _ in range(count)])
    solid = bsp2.union(bsp2.cuboid(b - a).translate(a) for a, b in zip(low, high))
    return solid, lambda x: ((x[:, None] >= low) & (x[:, None] <= high)).all(axis=2).any(axis=1)


def volumes_of(points, tetrahedra):
    corners = points[tetrahedra]
    return np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6


def two_parts():
    steel = bsp2.cuboid([2, 1, 1]).part("steel")
    return steel + bsp2.cuboid([1, 1, 1]).translate([2, 0, 0]).part("copper")


class SolverMeshes(unittest.TestCase):
    def test_tetrahedra_fill_the_solid_face_to_face(self):
        rng = random.Random(SEED)
        for _ in range(3):
            solid, contains = some_boxes(rng)
            result = solid.evaluate()
            mesh = bsp2.solver_mesh(result, size=1.5)
            with self.subTest(seed=SEED, model=str(solid)):
                volumes = volumes_of(mesh.points, mesh.tetrahedra)
                self.assertGreater(volumes.min(), 0)
                self.assertAlmostEqual(volumes.sum(), result.volume, places=6)
                self.assertAlmostEqual(mesh.volume, result.volume, places=6)
                self.assertTrue(contains(mesh.points[mesh.tetrahedra].mean(axis=1)).all())
                faces = np.sort(mesh.tetrahedra[:, [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]].reshape(-1, 3), axis=1)
                faces, times = np.unique(faces, axis=0, return_counts=True)
                self.assertLessEqual(times.max(), 2)
                outer = {tuple(face) for face in faces[times == 1]}
                self.assertEqual(outer, {tuple(sorted(face)) for face in mesh.triangles.tolist()})
                self.assertEqual(np.unique(mesh.tetrahedra).size, len(mesh.points))

    def test_names_and_options(self):
        mesh = bsp2.solver_mesh(two_parts(), size=1, part_sizes={"copper": 0.3}, groups={"inlet": "x==min"})
        self.assertEqual(set(mesh.volume_names), {"steel", "copper"})
        self.assertLessEqual({"inlet", "steel|outside", "copper|outside"}, set(mesh.group_names))
        volumes = volumes_of(mesh.points, mesh.tetrahedra)
        for name, volume in (("steel", 2), ("copper", 1)):
            self.assertAlmostEqual(volumes[mesh.volumes == mesh.volume_names.index(name)].sum(), volume)
        inlet = mesh.triangles[mesh.groups == mesh.group_names.index("inlet")]
        self.assertTrue((mesh.points[inlet][:, :, 0] == 0).all())
        fine = np.bincount(mesh.volumes)[[mesh.volume_names.index(name) for name in ("steel", "copper")]]
        self.assertLess(fine[0], fine[1])
        field = [[0, 0.5, 0.5, 0.1], [3, 0.5, 0.5, 0.6]]
        mesh = bsp2.solver_mesh(bsp2.cuboid([3, 1, 1]), size_field=field)
        self.assertLess((mesh.points[:, 0] > 1.5).sum() * 3, (mesh.points[:, 0] < 1.5).sum())
        slow = bsp2.solver_mesh(bsp2.cuboid([3, 1, 1]), size_field=field, growth=0.2)
        self.assertLess(len(mesh.points), len(slow.points))
        with self.assertWarnsRegex(bsp2.ModelWarning, "no face is where it says"):
            bsp2.solver_mesh(bsp2.cube(), groups={"nowhere": "x==7"})
        for wrong in (
            lambda: bsp2.solver_mesh(two_parts(), part_sizes={"cooper": 1}),
            lambda: bsp2.solver_mesh(bsp2.cube(), size=-1),
            lambda: bsp2.solver_mesh(bsp2.cube(), size=float("nan")),
            lambda: bsp2.solver_mesh(bsp2.cube(), clean=float("inf")),
            lambda: bsp2.solver_mesh(bsp2.cube(), size_field=[[0, 0, 0, 0]]),
            lambda: bsp2.solver_mesh(bsp2.cube(), growth=0),
            lambda: bsp2.solver_mesh(bsp2.cube(), groups={"a": "q==1"}),
            lambda: bsp2.solver_mesh(bsp2.square()),
            lambda: bsp2.solver_mesh(bsp2.cube().evaluate(measures_only=True)),
            lambda: bsp2.solver_mesh(bsp2.cube(), size=1, polyhedra=True),
            lambda: bsp2.solver_mesh(bsp2.cube()).save("/dev/null/x.msh"),
            lambda: bsp2.solver_mesh(bsp2.cube()).save("x.stl"),
            lambda: bsp2.solver_mesh(bsp2.cube()).save("x.inp", gmsh_version=2.2),
        ):
            with self.assertRaises(bsp2.Error) as caught:
                wrong()
            self.assertTrue(caught.exception.is_users_mistake, caught.exception)
        with self.assertRaises(TypeError):
            bsp2.solver_mesh(bsp2.cube().evaluate(), size=1, threads=1)
        with self.assertRaisesRegex(TypeError, "a model or a result, not str"):
            bsp2.solver_mesh("x.csg")
        with self.assertRaisesRegex(ValueError, "4.1 or 2.2"):
            bsp2.solver_mesh(bsp2.cube()).save("x.msh", gmsh_version="2.2")
        with self.assertRaisesRegex(TypeError, "did you mean 'part_sizes'"):
            bsp2.solver_mesh(bsp2.cube(), part_size={"solid": 1})

    def test_arrays_are_no_copies_and_keep_the_mesh(self):
        mesh = bsp2.solver_mesh(bsp2.cube())
        points, tetrahedra = mesh.points, mesh.tetrahedra
        self.assertEqual(points.ctypes.data, mesh.points.ctypes.data)
        self.assertFalse(points.flags.owndata or points.flags.writeable)
        del mesh
        self.assertAlmostEqual(volumes_of(points, tetrahedra).sum(), 1)

    def test_files(self):
        mesh = bsp2.solver_mesh(two_parts(), size=1)
        with tempfile.TemporaryDirectory() as folder:
            for name in ("a.msh", "a.inp", "a.xdmf", "a.vtu", "new/case"):
                mesh.save(f"{folder}/{name}")
            self.assertTrue(os.path.exists(f"{folder}/a.h5") and os.path.exists(f"{folder}/new/case/constant/polyMesh/points"))
            self.assertIn("$MeshFormat\n4.1", pathlib.Path(folder, "a.msh").read_text(errors="replace"))
            mesh.save(f"{folder}/b.msh", gmsh_version=2.2)
            self.assertIn("$MeshFormat\n2.2", pathlib.Path(folder, "b.msh").read_text(errors="replace"))
            mesh.save(f"{folder}/second.vtu", second_order=True)
            self.assertGreater(os.path.getsize(f"{folder}/second.vtu"), os.path.getsize(f"{folder}/a.vtu"))
            two_parts().evaluate().save(f"{folder}/c.msh")
            self.assertGreater(os.path.getsize(f"{folder}/c.msh"), 500)
            bsp2.solver_mesh(two_parts(), polyhedra=True).save(f"{folder}/polyhedra")
            owner = pathlib.Path(folder, "polyhedra/constant/polyMesh/owner").read_text()
            self.assertIn("nCells: 2", owner.replace("nCells:2", "nCells: 2"))

    @unittest.skipUnless(importlib.util.find_spec("meshio"), "meshio is not installed")
    def test_meshio(self):
        mesh = bsp2.solver_mesh(two_parts(), size=1)
        handed = mesh.to_meshio()
        for name, (number, dimension) in handed.field_data.items():
            in_block = [(numbers == number).sum() for numbers in handed.cell_data["number"]]
            self.assertGreater(in_block[3 - dimension], 0, name)
            self.assertEqual(in_block[dimension - 2], 0, name)
        self.assertEqual(set(handed.field_data), {*mesh.volume_names, *mesh.group_names})
        with tempfile.TemporaryDirectory() as folder:
            import meshio

            handed.write(f"{folder}/x.vtk")
            again = meshio.read(f"{folder}/x.vtk")
        self.assertAlmostEqual(volumes_of(again.points, again.cells_dict["tetra"]).sum(), 3)
        self.assertEqual(len(again.cells_dict["triangle"]), len(mesh.triangles))


class Drawings(unittest.TestCase):
    def test_files_and_words(self):
        block = bsp2.cuboid([40, 30, 10]) - bsp2.cylinder(h=12, r=6, fn=32).translate([20, 15, -1])
        with tempfile.TemporaryDirectory() as folder:
            files = [f"{folder}/new/sheet.{ending}" for ending in ("svg", "pdf", "dxf")]
            bsp2.draw(block, files, views="front,top", sections="A=y:15", dimensions=["front:0,0,0:40,0,0"], title="Lager Ü", scale="1:1")
            text = pathlib.Path(files[0]).read_text()
            xml.etree.ElementTree.fromstring(text)
            self.assertIn("Lager Ü", text)
            self.assertRegex(text, "SECTION")
            self.assertTrue(pathlib.Path(files[1]).read_bytes().startswith(b"%PDF"))
            self.assertIn("SECTION", pathlib.Path(files[2]).read_text(errors="replace"))
            # The same from a result, and as the program draws it.
            bsp2.draw(block.evaluate(), f"{folder}/again.dxf", views="front,top", sections="A=y:15", title="t", date="2020-02-02")
            bsp2.draw(block, f"{folder}/first.dxf", views=["front", "top"], sections=["A=y:15"], title="t", date="2020-02-02")
            self.assertEqual(pathlib.Path(folder, "again.dxf").read_bytes(), pathlib.Path(folder, "first.dxf").read_bytes())
            model = pathlib.Path(folder, "t.csg")
            model.write_text(str(block))
            command = [bsp2._products._program(), "draw", str(model), "-o", f"{folder}/program.dxf", "--views", "front,top"]
            subprocess.run([*command, "--section", "A=y:15", "--date", "2020-02-02", "--quiet"], check=True)
            self.assertEqual(pathlib.Path(folder, "program.dxf").read_bytes(), pathlib.Path(folder, "first.dxf").read_bytes())

    def test_mistakes(self):
        with tempfile.TemporaryDirectory() as folder:
            path = f"{folder}/x.svg"
            for words, said in (
                (dict(views=["upside"]), "upside"),
                (dict(views=["top", "top"]), "twice"),
                (dict(views=[]), "needs a view"),
                (dict(sections="A=q:1"), "no section"),
                (dict(sections="A=x:7"), "does not cut"),
                (dict(sections=["A=x:0.5", "A=y:0.5"]), "two are called"),
                (dict(dimensions="front:0,0:1,1"), "no dimension"),
                (dict(scale="big"), "no scale"),
                (dict(sheet="A9"), "A9"),
                (dict(hidden="maybe"), "maybe"),
            ):
                with self.assertRaisesRegex(bsp2.Error, said) as caught:
                    bsp2.draw(bsp2.cube(), path, **words)
                self.assertNotIn("--", str(caught.exception))
                self.assertFalse(os.path.exists(path))
            with self.assertRaisesRegex(bsp2.Error, "dimension 3"):
                bsp2.draw(bsp2.square(), path)
            with self.assertRaisesRegex(bsp2.Error, "empty"):
                bsp2.draw(bsp2.cube() - bsp2.cube(), path)
            with self.assertRaisesRegex(bsp2.Error, "png"):
                bsp2.draw(bsp2.cube(), f"{folder}/x.png")
            with self.assertRaises(TypeError):
                bsp2.draw(bsp2.cube(), path, wievs="top")


class Sections(unittest.TestCase):
    def test_areas_by_counting(self):
        rng = random.Random(SEED)
        for _ in range(3):
            solid, contains = some_boxes(rng)
            result = solid.evaluate()
            for axis in (1, 2, 3):
                at = rng.randrange(6) + 0.5
                grid = np.stack(np.meshgrid(*[np.arange(8) + 0.5] * 2), axis=-1).reshape(-1, 2)
                expected = contains(np.insert(grid, axis - 1, at, axis=1)).sum()
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    section = result.section(axis, at)
                    again = solid.section(axis, at).evaluate()
                self.assertEqual(section.dimension, 2)
                self.assertAlmostEqual(section.volume, expected, msg=f"seed {SEED}, axis {axis} at {at} of {solid}")
                self.assertEqual(section.digest, again.digest)

    def test_it_keeps_what_the_model_is(self):
        ball = bsp2.sphere(1).evaluate(curved=True, tolerance=0.02)
        self.assertIn(np.pi, ball.section(3, 0).volume_interval)
        line = bsp2.cuboid([1, 2, 3, 4]).evaluate().section(4, 1).section(3, 1).section(2, 1)
        self.assertEqual((line.dimension, line.volume), (1, 1.0))
        with tempfile.TemporaryDirectory() as folder:
            bsp2.cuboid([2, 3, 4]).evaluate(snapshot=f"{folder}/s.h5")
            self.assertEqual(bsp2.resume(f"{folder}/s.h5").section(1, 1).volume, 12)
        for wrong in ((0, 1), (4, 1), (1, float("nan"))):
            with self.assertRaises((bsp2.Error, ValueError)):
                bsp2.cube().evaluate().section(*wrong)


class Surfaces(unittest.TestCase):
    def test_faces(self):
        surface = bsp2.cuboid([1, 2, 3]).evaluate().surface()
        self.assertEqual(sorted(np.bincount(surface.faces)), [2] * 6)
        surface = (bsp2.cube(3) - bsp2.cylinder(h=9, r=1, center=True, fn=12).translate([1.5, 1.5, 0])).evaluate().surface()
        self.assertEqual(surface.faces.max() + 1, 6 + 12)
        corners = surface.points[surface.triangles]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        for face in range(surface.faces.max() + 1):
            self.assertLess(np.ptp(normals[surface.faces == face], axis=0).max(), 1e-9)

    def test_one_file_of_cells(self):
        with tempfile.TemporaryDirectory() as folder:
            two_parts().evaluate().save(f"{folder}/x.vtu")
            self.assertEqual(os.listdir(folder), ["x.vtu"])
            head = pathlib.Path(folder, "x.vtu").read_bytes()[:3000].decode(errors="replace")
            self.assertRegex(head, r'NumberOfCells="2"')

    def test_intervals(self):
        result = bsp2.ball(3).evaluate(tolerance=0.1)
        self.assertIn(4 / 3 * np.pi, result.intervals["volume"])
        least, most = result.intervals["inertia"]
        self.assertTrue(least[1, 1] < 4 / 15 * np.pi < most[1, 1])


class Viewing(unittest.TestCase):
    def ways(self, way, script, **more):
        environment = {**os.environ, **more}
        environment.pop("BSP2_VIEW", None)
        if way is not None:
            environment["BSP2_VIEW"] = way
        for name in ("DISPLAY", "WAYLAND_DISPLAY"):
            environment.pop(name, None)
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run([sys.executable, "-c", script], cwd=folder, env=environment, capture_output=True, text=True, timeout=100)
            return done, sorted(os.listdir(folder))

    def test_pictures_or_nothing(self):
        script = "import bsp2; bsp2.view(bsp2.view(bsp2.cube()).evaluate())"
        self.assertEqual(self.ways("none", script)[1], [])
        for way in ("png", None):
            self.assertEqual(self.ways(way, script)[1], ["view_1.png", "view_2.png"])
        done, _ = self.ways("hologram", script)
        self.assertIn("hologram", done.stderr)

    def test_browser(self):
        script = (
            "import bsp2, os, urllib.request\n"
            "found = []\n"
            "popen = bsp2._products.subprocess.Popen\n"
            "def started(*command, **more):\n"
            "    found.append(popen(*command, **more)); return found[-1]\n"
            "bsp2._products.subprocess.Popen = started\n"
            "result = bsp2.sphere(2).evaluate(curved=True, tolerance=0.5)\n"
            "bsp2.view(result)\n"
            "print('--curved' in found[0].args, found[0].poll())\n"
            "found[0].terminate(); print(found[0].wait(30) is not None)\n"
        )
        # Nobody opens the page: where xdg-open is missing, the viewer says so and goes on.
        done, _ = self.ways("browser", script, PATH="/nonexistent")
        self.assertRegex(done.stdout, r"^http://\S+\nTrue None\nTrue\n$", done.stderr)


class Wheels(unittest.TestCase):
    @unittest.skipUnless("BSP2_BUILD_DIR" in os.environ, "no build folder is named")
    def test_a_wheel_is_complete(self):
        """What `pip install .` makes, unpacked anywhere as pip does it, works without the build folder."""
        sys.path.insert(0, str(SOURCE / "python" / "tools"))
        import bsp2_wheel

        with tempfile.TemporaryDirectory() as folder:
            said = subprocess.run(
                [sys.executable, "-c", "import bsp2_wheel, sys; bsp2_wheel.build_wheel(sys.argv[1], {'build-dir': sys.argv[2]})",
                 folder, os.environ["BSP2_BUILD_DIR"]],
                env={**os.environ, "PYTHONPATH": str(SOURCE / "python" / "tools")}, capture_output=True, text=True,
            )  # fmt: skip
            self.assertEqual(said.returncode, 0, said.stderr)
            (wheel,) = pathlib.Path(folder).glob("bsp2-*.whl")
            packages = pathlib.Path(folder, "packages")
            with zipfile.ZipFile(wheel) as archive:
                recorded = archive.read(f"bsp2-{bsp2_wheel.version()}.dist-info/RECORD").decode()
                self.assertEqual({line.split(",")[0] for line in recorded.split()}, set(archive.namelist()))
                for entry in archive.infolist():
                    target = packages / entry.filename
                    target.parent.mkdir(parents=True, exist_ok=True)
                    target.write_bytes(archive.read(entry))
                    target.chmod(entry.external_attr >> 16 & 0o777)
            script = "import bsp2; bsp2.cube().evaluate().save('x.vtu'); print(bsp2.__file__, bsp2._products._program())"
            environment = {**os.environ, "PYTHONPATH": str(packages)}
            said = subprocess.run([sys.executable, "-c", script], cwd=folder, env=environment, capture_output=True, text=True)
            program = packages / "bsp2" / "bin" / "bsp2"
            self.assertEqual(said.stdout, f"{packages}/bsp2/__init__.py {program}\n", said.stderr)
            self.assertTrue(os.path.exists(f"{folder}/x.vtu"))
            command = [sys.executable, "-c", "from bsp2._products import run_program; run_program()", "--version"]
            for command in (command, [program, "--version"]):
                subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL)
            # Nothing of what the library loads in a build folder is missing: modules, readers of files, the viewer's page.
            built = pathlib.Path(os.environ["BSP2_BUILD_DIR"], "lib", "bsp2")
            there = {file.relative_to(built) for file in built.rglob("*") if file.is_file()}
            loaded = packages / "bsp2" / "lib" / "bsp2"
            self.assertLessEqual(there, {file.relative_to(loaded) for file in loaded.rglob("*")})


if __name__ == "__main__":
    unittest.main()
