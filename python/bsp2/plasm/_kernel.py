"""All that needs the kernel, in three functions: the content of an expression, its cells, and what is written
of it.

Solids are given as expressions: ("union" | "intersection" | "difference" | "symmetric_difference", operands),
or lists of (points, matrices): hulls of points (k, d), each moved by homogeneous matrices (m, d+1, d+1) whose
first row and column are the homogeneous ones. This backend runs the program `bsp2`, found by BSP2_PROGRAM,
beside this package in a build tree, or on the PATH.
"""

import json
import os
import pathlib
import shutil
import subprocess
import tempfile

import numpy as np


class KernelError(RuntimeError):
    """What the program says went wrong."""


def evaluate(expression, dimension):
    """Convex cells of a solid: a list of arrays (cells, points, dimension), one for each number of points."""
    import h5py

    with tempfile.TemporaryDirectory(prefix="bsp2-plasm-") as folder:
        path = os.path.join(folder, "result.h5")
        _run(expression, dimension, folder, ["--snapshot", path])
        with h5py.File(path) as file:
            cells = file["cells"]
            inside = np.flatnonzero(cells["label"][:] == 1)
            starts = cells["point_offset"][:].astype(np.int64)
            points = cells["points"][:].reshape(-1, dimension)
    sizes = np.diff(starts)[inside]
    first = starts[:-1][inside]
    return [points[first[sizes == n][:, None] + np.arange(n)] for n in np.unique(sizes)]


def volume(expression, dimension):
    """The content of a solid."""
    with tempfile.TemporaryDirectory(prefix="bsp2-plasm-") as folder:
        path = os.path.join(folder, "report.json")
        _run(expression, dimension, folder, ["--report", path])
        with open(path) as file:
            return json.load(file)["volume"]["in"]


def save(expression, dimension, path):
    """Writes a solid: .h5 is a snapshot, .pvtu its cells, .stl, .ply, .obj, .vtp its surface, .png, .svg,
    .pdf a picture of it."""
    ending = pathlib.Path(path).suffix.lower()
    with tempfile.TemporaryDirectory(prefix="bsp2-plasm-") as folder:
        if ending == ".csg":
            pathlib.Path(path).write_text(csg(expression, dimension))
        elif ending == ".h5":
            _run(expression, dimension, folder, ["--snapshot", str(path)])
        elif ending in (".png", ".svg", ".pdf"):
            _run(expression, dimension, folder, ["--picture", str(path)])
        elif ending == ".pvtu":
            snapshot = os.path.join(folder, "result.h5")
            _run(expression, dimension, folder, ["--snapshot", snapshot])
            _call([_program(), "export", snapshot, "-o", str(path)])
        else:
            _run(expression, dimension, folder, ["--boundary", str(path)])


def csg(expression, dimension):
    """The expression as the text of a model."""
    lines = []
    _write(expression, dimension, lines)
    return "\n".join(lines) + "\n"


def _write(expression, dimension, lines):
    if isinstance(expression, tuple):
        name, operands = expression
        lines.append(name + "() {")
        for operand in operands:
            _write(operand, dimension, lines)
        lines.append("}")
        return
    lines.append("union() {")
    for points, matrices in expression:
        hull = f"polytope(points = {np.asarray(points, float).tolist()});"
        for matrix in matrices:
            if np.array_equal(matrix, np.eye(dimension + 1)):
                lines.append(hull)
            else:
                lines.append(f"multmatrix(m = {_rows(matrix, dimension)}) {{ {hull} }}")
    lines.append("}")


def _rows(matrix, dimension):
    """The matrix as the language has it: the translation in the last column; 4 x 4 also for the plane."""
    size = 3 if dimension == 2 else dimension
    rows = np.eye(size + 1)
    rows[:dimension, :dimension] = matrix[1:, 1:]
    rows[:dimension, size] = matrix[1:, 0]
    return rows.tolist()


def _run(expression, dimension, folder, arguments):
    model = os.path.join(folder, "model.csg")
    with open(model, "w") as file:
        file.write(csg(expression, dimension))
    _call([_program(), "run", model, "--quiet", *arguments])


def _call(command):
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise KernelError(
            (done.stderr or done.stdout).strip() or f"{command[0]} ended with code {done.returncode}"
        )


def _program():
    named = os.environ.get("BSP2_PROGRAM")
    if named:
        return named
    for parent in pathlib.Path(__file__).resolve().parents:
        for place in ("build/release/bin/bsp2", "bin/bsp2"):
            if (parent / place).is_file():
                return str(parent / place)
    found = shutil.which("bsp2")
    if not found:
        raise KernelError("the program bsp2 is not found: name it by BSP2_PROGRAM, or put it on the PATH")
    return found
