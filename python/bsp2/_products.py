"""What is made of a model or a result: meshes for solvers, drawings, sections, what the viewer shows."""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

import numpy

import bsp2

from . import _bsp2
from ._bsp2 import Expression, Result, SolverMesh, Surface
from ._counted import counted

_MESH = frozenset("size part_sizes size_field growth clean groups polyhedra dual".split())
_DRAWING = frozenset(
    "hidden smooth smooth_angle centre_lines overall sheet scale projection title author number material date".split()
)
_OF_THE_MODEL = ("threads", "curved", "tolerance", "coincidence", "parts_by_color")
"""Options that a section has of the result it is of."""


def _model_of(result):
    """The expression that a result is of."""
    if result._asked[0] is not None:
        return result._asked[0]
    with tempfile.TemporaryDirectory() as folder:  # of a snapshot
        path = os.path.join(folder, "model.csg")
        result.save(path)
        return bsp2.load(path)


# --- Meshes for solvers ---


def solver_mesh(model, size=None, *, part_sizes=None, size_field=None, growth=0.6, clean=None, groups=None, polyhedra=False, dual=False, **options):
    """A mesh for solvers: tetrahedra that meet face to face, right side out, with parts and sides by name. See docs/meshing.md.

    model: an expression, which is evaluated with the other keywords, or a result that holds its cells.
    size: wanted length of edges; none: a twentieth of the diagonal; 0: the cells' own tetrahedra.
    part_sizes: likewise of parts: {"copper": 0.5}.
    size_field: rows of x, y, z and a length, or a file of them (.vtu, .msh, a text): edges are no longer than that of the nearest
    place; without size, as long. Of an expression what is round is refined alike (see `evaluate`).
    growth: by which share of the distance edges may grow from where they are short.
    clean: what is shorter is absorbed, by moves of at most this; none: a millionth of the smallest part, of what is round its tolerance if that is
        more; up to 16 millionths where the mesh would not be valid, or have angles below 1 degree that the solid does not have.
    groups: names of faces by where they are: {"inlet": "x==min", "top": "z>=4 & colour==red", "skin": "angle<=30"}.
    polyhedra: the cells as they are, for `save` alone. dual: polyhedra about the points of the tetrahedra, likewise.

    Under mpirun all ranks make this call; the master gets the mesh, and the others None.
    """
    if not isinstance(model, (Expression, Result)):
        raise TypeError(f"solver_mesh takes a model or a result, not {type(model).__name__}")
    bsp2._checked(options, _MESH)
    if isinstance(size_field, (str, os.PathLike)):
        size_field = _bsp2._read_size_field(os.fspath(size_field))
    field = [] if size_field is None else [[float(x) for x in row] for row in size_field]
    if any(len(row) != 4 for row in field):
        raise ValueError("size_field: a row is x, y, z and a length")
    if isinstance(model, Result):
        if options:
            raise TypeError(f"{', '.join(sorted(options))}: a result is evaluated already")
        result = model
    else:
        if not options.keys() & {"snapshot", "angle"}:  # with which it refines nothing
            options = {"size_field": field, "size": size or None, **options}
        result = model.evaluate(**options)
    if not result._is_of_master:
        return None
    if groups is None:
        rules = []
    elif isinstance(groups, dict):
        rules = [f"{name}={where}" for name, where in groups.items()]
    elif isinstance(groups, str):
        rules = [groups]
    else:
        rules = list(groups)
    mesh = result._solver_mesh(
        dict(
            size=size,
            clean=clean,
            part_sizes=dict(part_sizes or {}),
            size_field=field,
            growth=float(growth),
            groups=rules,
            polyhedra=polyhedra,
            dual=dual,
        )
    )
    bsp2._warn(mesh.warnings)
    return mesh


def _save_mesh(self, path, second_order=False, gmsh_version=4.1):
    """Writes .msh, .inp, .xdmf (with its .h5), .vtu or, as a folder, a case of OpenFOAM.

    second_order: with points in the middle of edges. gmsh_version: of .msh files, 4.1 or 2.2.
    """
    if not isinstance(gmsh_version, (int, float)) or gmsh_version not in (4.1, 2.2):
        raise ValueError(f"gmsh_version is 4.1 or 2.2, not {gmsh_version!r}")
    self._write(path, second_order, round(10 * gmsh_version))


def _mesh_to_meshio(self):
    """As a meshio.Mesh (which has to be installed).

    `cell_data["number"]` of tetrahedra and triangles is that of their volume or group: groups from 1 on, then volumes. `field_data` has the
    number and the dimension by name; a group that is called as a volume has ' (faces)' after its name there.
    """
    import meshio

    first = len(self.group_names) + 1
    names = {name: numpy.array([first + i, 3]) for i, name in enumerate(self.volume_names)}
    for i, name in enumerate(self.group_names):
        names[name if name not in names else f"{name} (faces)"] = numpy.array([1 + i, 2])
    numbers = [first + self.volumes, 1 + self.groups]
    return meshio.Mesh(
        self.points, [("tetra", self.tetrahedra), ("triangle", self.triangles)], cell_data={"number": numbers}, field_data=names
    )


def _repr_mesh(self):
    cells, points = counted(len(self.tetrahedra), "tetrahedron", "tetrahedra"), counted(len(self.points), "point")
    return f"<bsp2.SolverMesh: {cells}, {points}, volume {self.volume:.6g}>"


SolverMesh.save = _save_mesh
SolverMesh.to_meshio = _mesh_to_meshio
SolverMesh.__repr__ = _repr_mesh


# --- Drawings ---


def draw(model, files, *, views=None, sections=None, dimensions=None, progress=False, stop=None, ranks=None, **more):
    """An engineering drawing of a solid of space, in the words of `bsp2 draw` (docs/drawing.md). All ranks together.

    files: one, or several: .svg, .pdf, .dxf.
    views: of front, back, left, right, top, bottom, iso, as a list or "front,top".
    sections: ["A=x:10"]: cut there; "A=-x:10" looks the other way.
    dimensions: ["front:0,0,0:40,0,0"]: the distance of two points in a view.
    hidden: 'dashed', 'none', 'all'. smooth: 'none', 'thin'. smooth_angle, centre_lines, overall. sheet: 'A4' to 'A0'. scale: '1:2'.
    projection: 'first', 'third'. title, author, number, material, date. Other keywords are those of `evaluate`.
    """
    words = {name: more.pop(name) for name in sorted(_DRAWING & set(more))}
    for name, value in (("views", views), ("sections", sections), ("dimensions", dimensions)):
        if value is not None:
            text = isinstance(value, str)
            words[name] = (value.split(",") if name == "views" else [value]) if text else list(value)
    paths = [files] if isinstance(files, (str, os.PathLike)) else list(files)
    if isinstance(model, Result):
        options = {name: model._asked[1][name] for name in _OF_THE_MODEL if name in model._asked[1]}
        more = {**options, **more}
        model = _model_of(model)

    def compute(what, options, tell, stop, ranks):
        return _bsp2._draw(what, paths, words, options, tell, stop, ranks)

    bsp2._told(compute, model, progress, stop, ranks, bsp2._checked(more, _DRAWING | {"views", "sections", "dimensions"}))


# --- Sections ---


def _section(self, axis, at=0.0, **options):
    """What is at x_axis = at: a result of one dimension less, evaluated exactly. All ranks together.

    axis: from 1. at: in model units. options: as those of `evaluate`; by default those of this result that say what the model is.
    """
    kept = {name: self._asked[1][name] for name in _OF_THE_MODEL if name in self._asked[1]}
    return _model_of(self).section(axis, at).evaluate(**{**kept, **options})


Result.section = _section
Expression.section = lambda self, axis, at=0.0: bsp2.section(self, axis=axis, at=at)
Expression.section.__doc__ = "What is at x_axis = at, without that axis, which counts from 1."


# --- Faces ---


def _faces(self):
    """m: which plane face each triangle is of, from 0: those that meet in an edge, in one plane but for the rounding of points, and with
    the same part behind."""
    triangles = self.triangles.astype(numpy.int64)
    count = len(triangles)
    if count == 0:
        return numpy.zeros(0, numpy.int64)
    points = self.points
    size = numpy.ptp(points, axis=0).max()
    normal = numpy.cross(*(points[triangles[:, k]] - points[triangles[:, 0]] for k in (1, 2)))
    length = numpy.linalg.norm(normal, axis=1)
    normal /= numpy.where(length > 0, length, 1.0)[:, None]
    edges = numpy.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    order = numpy.lexsort(edges.T)
    same = (edges[order[1:]] == edges[order[:-1]]).all(axis=1)
    one, other = order[:-1][same] // 3, order[1:][same] // 3
    far = triangles[other, (order[1:][same] + 2) % 3]  # the corner of the other that is not on the edge
    height = numpy.abs(numpy.einsum("ij,ij->i", normal[one], points[far] - points[triangles[one, 0]]))
    alike = (height <= 1e-9 * size) & (numpy.einsum("ij,ij->i", normal[one], normal[other]) > 0)
    alike &= self.parts[one] == self.parts[other]
    one, other = one[alike], other[alike]
    least = numpy.arange(count)
    while True:  # the least number reaches all of a face
        before = least.copy()
        numpy.minimum.at(least, one, before[other])
        numpy.minimum.at(least, other, before[one])
        least = least[least]
        if numpy.array_equal(least, before):
            return numpy.unique(least, return_inverse=True)[1].reshape(-1)


Surface.faces = property(_faces, doc=_faces.__doc__)


# --- The viewer ---


def _program():
    """The program bsp2: of the build folder or the installation that this module is of, else where the shell finds it."""
    here = pathlib.Path(__file__).absolute().parent
    module = pathlib.Path(_bsp2.__file__).absolute().parent
    for folder in (here, module.parents[1], *here.parents[1:4], *module.parents[1:4]):
        if os.access(folder / "bin" / "bsp2", os.X_OK):
            return str(folder / "bin" / "bsp2")
    found = shutil.which("bsp2")
    if found is None:
        raise bsp2.Error("the viewer is a part of the program bsp2, which is neither beside this module nor where the shell looks for it")
    return found


def run_program():
    """Becomes the program bsp2: the command `bsp2` of a wheel."""
    program = _program()
    os.execv(program, [program, *sys.argv[1:]])


def _in_notebook():
    try:
        from IPython import get_ipython
    except ImportError:
        return False
    shell = get_ipython()
    return shell is not None and hasattr(shell, "kernel")


def _way_to_show():
    way = os.environ.get("BSP2_VIEW", "")
    if way not in ("", "none", "png", "browser"):
        raise bsp2.Error(f"BSP2_VIEW is '{way}'; none, png and browser are possible")
    if way:
        return way
    if _in_notebook():
        return "notebook"
    has_display = sys.platform == "darwin" or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    return "browser" if has_display else "png"


_pictures = 0


def _browse(model, options):
    """Starts `bsp2 view` and tells its link. The process ends when its pages are closed."""
    folder = tempfile.mkdtemp(prefix="bsp2-view-")
    path = os.path.join(folder, "model.csg")
    pathlib.Path(path).write_text(model.to_text())
    command = [_program(), "view", path, "--open"]
    if options.get("curved"):
        command.append("--curved")
    for name in ("tolerance", "coincidence"):
        if options.get(name) is not None:
            command += [f"--{name}", repr(float(options[name]))]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, stdin=subprocess.DEVNULL, text=True)
    link = process.stdout.readline().strip()
    if not link:
        raise bsp2.Error(f"the viewer does not start: '{' '.join(command)}' tells why")
    print(link)
    return process


def view(model, **options):
    """Shows a model or a result, as the environment variable BSP2_VIEW says; gives it back.

    browser: `bsp2 view` is started, and its page opened, where the model can be turned while it is evaluated. png: a picture view_1.png,
    view_2.png, ... in the current folder. none: nothing. Without it: a picture in a notebook; the browser where there is a display; else png.
    options: as those of `evaluate`.
    """
    global _pictures
    way = _way_to_show()
    if way == "none" or not (bsp2.ranks().is_master or way == "png"):
        return model
    if way == "browser":
        is_result = isinstance(model, Result)
        asked = {**model._asked[1], **options} if is_result else options
        _browse(_model_of(model) if is_result else model, asked)
        return model
    result = model if isinstance(model, Result) else model.evaluate(**options)
    if way == "notebook":
        from IPython.display import Image, display

        display(Image(result.picture()))
    else:
        _pictures += 1
        result.save(f"view_{_pictures}.png")
    return model
