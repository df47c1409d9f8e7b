"""Runs examples/python, and compares what they say with what is known."""

import importlib.util
import json
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
EXAMPLES = SOURCE / "examples" / "python"


class Examples(unittest.TestCase):
    def say(self, name, *arguments, launcher=()):
        with tempfile.TemporaryDirectory() as folder:
            command = [*launcher, sys.executable, "-W", "error", str(EXAMPLES / name), *arguments]
            return subprocess.run(command, cwd=folder, env=os.environ | {"BSP2_VIEW": "none"}, check=True, stdout=subprocess.PIPE, text=True, timeout=200).stdout

    def test_drilled_block(self):
        said = self.say("drilled_block.py")
        self.assertRegex(said, r"^volume 1115[0-9.]+ in \d+ convex cells\nfrom \[0. 0. 0.\] to \[40. 30. 10.\]\ndistances \[ 2.99\d+ -5. ")

    def test_inertia_study(self):
        self.assertEqual(self.say("inertia_study.py").count("by formula"), 5)  # it compares by itself

    def test_sweep(self):
        self.assertEqual(
            self.say("sweep_4d.py"),
            "content in space and time: 48.0\nat t = 0.5 from x = 1.5 to 5.5\nat t = 1 from x = 3 to 7\nat t = 3 from x = 6 to 10\n"
            "sweeps a volume of 30.0\nhits the post at t = 1.333333\n",
        )

    def test_many_cubes(self):
        self.assertRegex(self.say("many_cubes.py", "1000"), r"^1,000 cubes are an expression after [0-9.]+ s\n1,000 cells, volume 125\n$")

    def test_ranks(self):
        alone = self.say("ranks.py")
        self.assertRegex(alone, r"^volume 20, surface 72, digest [0-9a-f]{32}\n$")
        if "BSP2_MPIRUN" in os.environ:
            self.assertEqual(self.say("ranks.py", "x.pvtu", launcher=(os.environ["BSP2_MPIRUN"], "--oversubscribe", "-n", "2")), alone)

    def test_leaning_tower(self):
        self.assertEqual(self.say("leaning_tower.py", "4"), "2,609 primitives, 13,062 cells, volume 4478.334511\n")

    def test_located_points(self):
        said = self.say("located_points.py", "inside.txt")
        shares = re.match(r"(0\.\d+) of the points are inside, (0\.\d+) of the box is\n", said)
        self.assertAlmostEqual(float(shares[1]), float(shares[2]), delta=0.01)

    def test_plasm_temple(self):
        self.assertEqual(self.say("plasm_temple.py"), "box from [-0.8, -0.8, 0.0] to [17.2, 9.2, 9.2]\n")

    @unittest.skipUnless(importlib.util.find_spec("dolfinx"), "dolfinx is not installed")
    def test_heat_in_bar(self):
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, str(EXAMPLES / "heat_in_bar.py")]
            said = subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True, timeout=200).stdout
        flow, formula = re.search(r"heat flow ([0-9.]+), by formula ([0-9.]+)\n$", said).groups()
        # Linear in each part, so the elements hit it; the area is that of a square less a polygon of 16 corners.
        area = 1 - 8 * 0.3**2 * math.sin(math.pi / 8)
        self.assertAlmostEqual(float(flow), 100 * area / (3 + 1 / 8), delta=1e-4)
        self.assertEqual(flow, formula)

    def test_first_steps(self):
        cells = json.loads((EXAMPLES / "first_steps.ipynb").read_text())["cells"]
        program = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
        said = subprocess.run([sys.executable, "-W", "error", "-c", program], check=True, stdout=subprocess.PIPE, text=True).stdout
        self.assertRegex(said, r"^volume 5396.966, area 3841.928, [^\n]*\n240 convex cells")
        if importlib.util.find_spec("nbconvert") and importlib.util.find_spec("ipykernel"):
            with tempfile.TemporaryDirectory() as folder:
                notebook = [sys.executable, "-m", "nbconvert", "--to", "html", "--execute", str(EXAMPLES / "first_steps.ipynb"), "--output-dir", folder]
                subprocess.run(notebook, check=True, stderr=subprocess.DEVNULL)
                self.assertIn("image/png", pathlib.Path(folder, "first_steps.html").read_text())

    def test_first_screen_of_the_manual(self):
        program = re.search(r"```python\n(.*?)```", (SOURCE / "docs" / "python.md").read_text(), re.DOTALL)[1]
        with tempfile.TemporaryDirectory() as folder:
            said = subprocess.run([sys.executable, "-W", "error", "-c", program], cwd=folder, check=True, stdout=subprocess.PIPE, text=True).stdout
            self.assertRegex(said, r"^117\d\d[0-9.]* in \d+ convex cells\n")
            self.assertTrue(os.path.exists(os.path.join(folder, "drilled.stl")))

    def test_all_programs_of_the_manual(self):
        programs = re.findall(r"```python\n(.*?)```", (SOURCE / "docs" / "python.md").read_text(), re.DOTALL)
        self.assertGreaterEqual(len(programs), 2)
        for program in programs[1:]:
            with tempfile.TemporaryDirectory() as folder:
                subprocess.run([sys.executable, "-W", "error", "-c", program], cwd=folder, check=True, stdout=subprocess.PIPE)
                for name in re.findall(r'"([a-z]+\.[a-z]+)"', program):
                    self.assertTrue(os.path.exists(os.path.join(folder, name)), name)

    def test_each_is_tried(self):
        tried = {name[5:] for name in dir(self) if name.startswith("test_")}
        for example in (*EXAMPLES.glob("*.py"), *EXAMPLES.glob("*.ipynb")):
            self.assertTrue(any(example.stem.startswith(name) for name in tried), example)


if __name__ == "__main__":
    unittest.main()
