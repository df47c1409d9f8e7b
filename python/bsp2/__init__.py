"""Solids of 1 to 6 dimensions as expressions, evaluated to convex cells: exactly, in parallel.

    import bsp2
    drilled = bsp2.cuboid([40, 30, 10]) - bsp2.cylinder(h=12, r=3).translate([20, 15, -1])
    result = drilled.evaluate()
    print(result.volume, len(result), "convex cells")
    result.save("drilled.stl")

Lengths are in the model's units, angles in degrees, axes count from 1. Wherever lists go, numpy arrays do. The manual is docs/python.md.
"""

import collections
import difflib
import functools
import json
import os
import sys
import warnings

import numpy

from . import _bsp2
from ._counted import counted as _counted
from ._bsp2 import *  # noqa: F401,F403
from ._bsp2 import Error, Expression, Ranks, Result, __version__  # noqa: F401


class ModelWarning(UserWarning):
    """What is odd about a model, or about a file that was written."""


Cells = collections.namedtuple("Cells", "points point_offsets face_offsets corner_offsets corners")
Cells.__doc__ = """The cells as flat arrays, n cells with p points, f faces and v corners of faces in all.

points: p x D. Cell i has points[point_offsets[i]:point_offsets[i + 1]], and faces face_offsets[i] to face_offsets[i + 1].
Face j has corners[corner_offsets[j]:corner_offsets[j + 1]], which are indices of points."""

Location = collections.namedtuple("Location", "labels primitives parts distances nearest")
Location.__doc__ = """Where k points are: label, primitive and part of the cell that each is in; the distance to the nearest point that has, or
may have, another label, below 0 inside; and such a point (k x D)."""


# --- Evaluation ---


class _Bar:
    """How far it is: tqdm's bar, if that is installed, else a line on a terminal."""

    def __init__(self):
        self.bar = None
        try:
            from tqdm.auto import tqdm

            self.bar = tqdm(total=100, unit="%", bar_format="{desc}: {percentage:3.0f}%|{bar}| {elapsed}{postfix}")
        except ImportError:
            self.is_terminal = sys.stderr.isatty()

    def __call__(self, superstep, done, cells):
        if self.bar is not None:
            self.bar.set_description_str(superstep, refresh=False)
            self.bar.set_postfix_str(_counted(cells, "cell"), refresh=False)
            self.bar.n = round(100 * done)
            self.bar.refresh()
        elif self.is_terminal:
            sys.stderr.write(f"\r{superstep} {round(100 * done)} %, {_counted(cells, 'cell')}\x1b[K")
            sys.stderr.flush()

    def close(self):
        if self.bar is not None:
            self.bar.close()
        elif self.is_terminal:
            sys.stderr.write("\r\x1b[K")


@functools.lru_cache(maxsize=None)
def _all_ranks():
    ranks = _bsp2._launched()
    return ranks if ranks.count > 1 else None


def ranks():
    """The processes that evaluate together: all that mpirun or srun started, or this one alone."""
    return _all_ranks() or Ranks()


def _warn(sentences):
    for sentence in sentences:
        warnings.warn(sentence, ModelWarning, stacklevel=4)


def _told(compute, what, progress, stop, all_ranks, options):
    """What a computation makes, while its progress is told."""
    bar = _Bar() if progress is True and (all_ranks or ranks()).is_master else None
    tell = bar if bar is not None else progress if callable(progress) else None
    try:
        return compute(what, options, tell, stop, all_ranks or ranks())
    finally:
        if bar is not None:
            bar.close()


def _found(compute, what, progress, stop, all_ranks, options):
    result = _told(compute, what, progress, stop, all_ranks, options)
    result._asked = (what if isinstance(what, Expression) else None, options)
    _warn(result.warnings)
    return result


_OPTIONS = frozenset(
    "threads regions level tolerance size size_field angle eye order budget cells curved coincidence parts_by_color keep_in keep_fuzzy keep_out strict "
    "measures_only surface surface_only faces contacts snapshot timeout".split()
)


def _checked(options, own=frozenset()):
    """own: options of whoever evaluates with these, which have been taken out."""
    possible = _OPTIONS | own
    for name in options:
        if name not in _OPTIONS:
            near = difflib.get_close_matches(name, possible, 1)
            hint = f"did you mean '{near[0]}'?" if near else f"{', '.join(sorted(possible))} are possible"
            raise TypeError(f"there is no option '{name}'; {hint}")
    return options


def evaluate(model, *, progress=False, stop=None, ranks=None, **options):
    """Evaluates a model to convex cells.

    progress: True shows a bar; or a function of (superstep, share done in [0, 1], cells so far).
    stop: a function that is asked some times a second; True ends it: the result is `interrupted`, and has no cells.
    ranks: who computes; none: all that mpirun started (then all of them make this call), else this process.
    Ctrl-C ends it, too.

    threads: of each rank; 0: one a core.
    regions: space is cut into so many, a power of two; none: by the model.
    level: stop after so many cuts in a row; the rest stays FUZZY.
    tolerance: round solids are refined until FUZZY cells are thinner than this length.
    size_field: rows of x, y, z and a length, of which the nearest counts: the tolerance is that of edges as long as `size` (none: as the
    largest length), and less by the square of what is shorter here, so what is round gets facets that are shorter in the same measure.
    angle, eye: or are seen thinner than so many degrees from this point.
    order: 'depth', or 'priority': what is largest first.
    budget: seconds of the computation; the rest stays FUZZY. cells: end at about so many.
    curved: spheres, cylinders and circles are truly round.
    coincidence: hyperplanes closer than this share of the model are one.
    parts_by_color: each colour is a part.
    keep_in, keep_fuzzy, keep_out: which cells are held. measures_only: none, only figures.
    strict: a warning is an error.
    surface, faces, contacts: find them now (where cells stay on several ranks they cannot be found later). faces are those of the
    surface, which files for CAD programs hold (.step, .iges, .brep). surface_only: find nothing else.
    snapshot: a file (.h5) that `resume` goes on from.
    timeout: seconds after which a silent rank ends all.
    """
    return _found(_bsp2._evaluate, model, progress, stop, ranks, _checked(options))


def resume(snapshot, /, *, progress=False, stop=None, ranks=None, **options):
    """Goes on from a snapshot, whoever wrote it; otherwise as `evaluate`. `snapshot=` is where it is written, none: nowhere."""
    return _found(_bsp2._resume, snapshot, progress, stop, ranks, _checked(options))


def _refine(model, steps=5, tolerance=None, **options):
    """Better and better results, one after the other: for round solids each with half the tolerance of the one before.

    tolerance: of the first one; none: a twentieth of the model's largest side.
    """
    if tolerance is None:
        first = model.evaluate(measures_only=True, level=8, **options)
        if first.volume_interval.least == 0 and first.bounds is None:
            box = 1.0
        else:
            box = max(upper - lower for lower, upper in zip(*first.bounds))
        tolerance = box / 20
    for _ in range(steps):
        yield model.evaluate(tolerance=tolerance, **options)
        tolerance /= 2


Expression.evaluate = evaluate
Expression.refine = _refine
Expression._repr_png_ = lambda self: self.evaluate()._repr_png_() if self.dimension in (2, 3) else None


# --- Results ---


def _cells(self):
    """Cells: points, offsets and faces as flat arrays; a corner of a face is an index of `points`."""
    corners_of_cell = numpy.diff(self.corner_offsets[self.face_offsets].astype(numpy.int64))
    first = numpy.repeat(self.point_offsets[:-1], corners_of_cell)
    return Cells(self.points, self.point_offsets, self.face_offsets, self.corner_offsets, first + self.corners)


def _locate(self, points):
    """Where points are. points: k x D. Returns a Location of arrays."""
    return Location(**self._locate(points))


def _distance(self, points):
    """The distance of each point to the boundary of the solid, below 0 inside. points: k x D."""
    return self._locate(points)["distances"]


def _save(self, path, tets=False, clean=None, **look):
    """Writes a file in the format that its ending names: .pvtu, .vtu (the cells); .stl, .ply, .obj, .off, .amf, .3mf, .glb, .wrl, .x3d, .vtp
    (the surface); .step, .iges, .brep (its faces, for CAD programs); .png, .svg, .pdf (a picture), .json (the report), .csg (the model),
    .h5 (the snapshot, if one was asked for); .msh, .inp, .xdmf (a mesh for solvers, as `solver_mesh` makes it). All ranks together.

    tets: a .pvtu of simplices. clean: a surface without shorter edges and thinner triangles; 0: as it is. For pictures:
    size=(width, height), shade='color' (or part, rank, region, label, level), edges='none' (or feature: those of the solid, cells),
    legend=True, axes=False, transparent=False, eye, look, explode.
    """
    if os.path.splitext(path)[1].lower() in (".msh", ".inp", ".xdmf"):
        solver_mesh(self).save(path)
        return
    for sentence in self._write(path, tets, clean, look):
        warnings.warn(sentence, ModelWarning, stacklevel=2)


def _picture(self, format="png", **look):
    """A picture as bytes: png, svg or pdf. Keywords as those of `save`."""
    return self._picture(format, look)


def _repr_png(self):
    if self.dimension not in (2, 3) or not self.has_cells:
        return None
    return self._picture("png", {"size": (500, 500)})


def _repr(self):
    what = "interrupted" if self.interrupted else _counted(len(self), "cell") if self.has_cells else "no cells held"
    return f"<bsp2.Result: dimension {self.dimension}, volume {self.volume:.6g}, {what}>"


def _meshio(self):
    """The cells as a meshio.Mesh (which has to be installed): polyhedra by the number of their points, with label, part and volume."""
    import meshio

    cells = self.cells
    if self.dimension != 3:
        raise Error("meshio takes solids of three dimensions here")
    faces = [cells.corners[a:b].tolist() for a, b in zip(cells.corner_offsets[:-1], cells.corner_offsets[1:])]
    groups = {}
    counts = numpy.diff(cells.point_offsets)
    for i, count in enumerate(counts):
        groups.setdefault(int(count), []).append(i)
    blocks = [
        (f"polyhedron{count}", [faces[cells.face_offsets[i] : cells.face_offsets[i + 1]] for i in members]) for count, members in groups.items()
    ]
    data = {name: [getattr(self, name + "s")[members] for members in groups.values()] for name in ("label", "part", "volume")}
    return meshio.Mesh(self.points, blocks, cell_data=data)


def _vtk(self):
    """The cells as a vtkUnstructuredGrid (Debian: python3-vtk9), read from a .pvtu that is written for it; to be called by one rank."""
    import tempfile

    from vtkmodules.vtkIOXML import vtkXMLPUnstructuredGridReader

    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "cells.pvtu")
        self.save(path)
        reader = vtkXMLPUnstructuredGridReader()
        reader.SetFileName(path)
        reader.Update()
        return reader.GetOutput()


def _trimesh(self):
    """Vertices and faces of the surface, as trimesh.Trimesh(*result.triangles()) takes them."""
    surface = self.surface()
    return surface.points, surface.triangles


Result.cells = property(_cells, doc=_cells.__doc__)
Result.locate = _locate
Result.distance = _distance
Result.save = _save
Result.picture = _picture
Result.triangles = _trimesh
Result.to_meshio = _meshio
Result.to_vtk = _vtk
Result._repr_png_ = _repr_png
Result.__repr__ = _repr
Result.volume = property(
    lambda self: self.volume_interval.least, doc="Of the IN cells: the least that the volume of the solid can be; `volume_interval` has both."
)
Result.centroid = property(lambda self: self.measures.centroid, doc="D numbers, of the IN cells.")
Result.intervals = property(
    lambda self: {"volume": self.volume_interval, "inertia": (self.measures.inertia_least, self.measures.inertia_most)},
    doc="Between which values the figures of the solid are: volume as an Interval, inertia as two matrices, which are empty where nothing is FUZZY.",
)
Result.inertia = property(
    lambda self: self.measures.inertia, doc="(D+1) x (D+1): integrals of x_i x_j with x_0 = 1, over the IN cells (moments about the origin)."
)
Result.report = property(lambda self: json.loads(self._report()), doc="What report.json holds, as a dict: docs/report.md.")


from ._products import draw, solver_mesh, view  # noqa: E402,F401
