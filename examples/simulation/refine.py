#!/usr/bin/python3
"""Solve, estimate the error, refine, solve again: `bsp2 mesh` and dolfinx (Debian: python3-dolfinx) in a loop.

    examples/simulation/refine.py build/release/bin/bsp2 [plate|vessel] [--steps N] [--plot FILE.png]

plate   heat through a plate with eight holes, 100 at one side and 0 at the other: its flow, against elements of second order
vessel  a thick hollow ball under pressure from inside: how far its inside moves, against the closed form (Lame)

Elements are linear, so that the error of such a figure should fall with the points to the power of -2/3.
"""
import argparse
import pathlib
import re
import subprocess
import tempfile

import numpy
import ufl
from dolfinx import fem, io
from dolfinx.fem.petsc import LinearProblem
from mpi4py import MPI
from petsc4py import PETSc
from scipy.spatial import cKDTree

BETTER = 1.5  # by this the error shall be less after each step


def mesh_of(bsp2, folder, case, field):
    """The mesh of a case, the tags of its outer faces, and their numbers by name; field: rows of x, y, z, length, or none."""
    (folder / "model.csg").write_text(case.model())
    options = ["--size", str(case.size), *case.options]
    if field is not None:
        numpy.savetxt(folder / "sizes.txt", field)
        options += ["--size-field", folder / "sizes.txt"]
    for group in case.groups:
        options += ["--group", group]
    subprocess.run([bsp2, "mesh", folder / "model.csg", "-o", folder / "mesh.xdmf", "--quiet", *options], check=True)
    with io.XDMFFile(MPI.COMM_SELF, str(folder / "mesh.xdmf"), "r") as file:
        domain = file.read_mesh(name="mesh")
        domain.topology.create_connectivity(2, 3)
        tags = file.read_meshtags(domain, name="facet_tags")
    names = re.findall(r"group (\d+) (.+)", (folder / "mesh.xdmf").read_text())
    return domain, tags, {name: int(number) for number, name in names}


def solve(a, right, conditions):
    return LinearProblem(a, right, bcs=conditions, petsc_options={"ksp_type": "cg", "pc_type": "gamg", "ksp_rtol": 1e-9}).solve()


class Plate:
    size = 12
    groups = ["hot=x==min", "cold=x==max"]
    options = []
    right = 978.996  # by elements of second order on 376,466 points

    @staticmethod
    def model():
        return (pathlib.Path(__file__).parents[2] / "tests" / "cases" / "drilled-plate.csg").read_text()

    @staticmethod
    def solve(domain, tags, number):
        """The flow, and the gradients in the cells."""
        space = fem.FunctionSpace(domain, ("Lagrange", 1))
        ends = [fem.dirichletbc(PETSc.ScalarType(degrees), fem.locate_dofs_topological(space, 2, tags.find(number[group])), space)
                for group, degrees in (("hot", 100.0), ("cold", 0.0))]
        u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
        heat = solve(ufl.inner(ufl.grad(u), ufl.grad(v)) * ufl.dx, fem.Constant(domain, 0.0) * v * ufl.dx, ends)
        flow = fem.assemble_scalar(fem.form(ufl.inner(ufl.grad(heat), ufl.grad(heat)) * ufl.dx)) / 100
        return flow, gradients(space, heat.x.array[:, None])[:, 0]


class Vessel:
    """An eighth of a thick hollow ball under pressure from inside, truly round: its facets follow the sizes, too."""
    size = 0.5
    inner, outer, pressure, young, poisson = 1.0, 2.0, 1.0, 100.0, 0.3
    groups = ["x=x==min", "y=y==min", "z=z==min"]
    options = ["--curved", "--tolerance", str(size**2 / 8)]  # how far a chord of this length is from its circle of radius 1
    right = pressure * inner**3 / (young * (outer**3 - inner**3)) * ((1 - 2 * poisson) * inner + (1 + poisson) * outer**3 / (2 * inner**2))

    @classmethod
    def model(cls):
        return f"intersection() {{ cube([3, 3, 3]); difference() {{ sphere(r = {cls.outer}); sphere(r = {cls.inner}); }} }}\n"

    @classmethod
    def solve(cls, domain, tags, number):
        """How far the inside moves outwards on average, and the stresses in the cells."""
        space = fem.VectorFunctionSpace(domain, ("Lagrange", 1))
        held = [fem.dirichletbc(PETSc.ScalarType(0), fem.locate_dofs_topological(space.sub(k), 2, tags.find(number["xyz"[k]])),
                                space.sub(k)) for k in range(3)]
        lame = cls.young * cls.poisson / (1 + cls.poisson) / (1 - 2 * cls.poisson)
        shear = cls.young / 2 / (1 + cls.poisson)
        u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
        stress = lame * ufl.div(u) * ufl.Identity(3) + 2 * shear * ufl.sym(ufl.grad(u))
        x, normal = ufl.SpatialCoordinate(domain), ufl.FacetNormal(domain)
        round_sides = ufl.Measure("ds", domain=domain, subdomain_data=tags)(number["outside"])
        inside = ufl.conditional(ufl.lt(ufl.dot(x, x), ((cls.inner + cls.outer) / 2)**2), 1.0, 0.0)
        moved = solve(ufl.inner(stress, ufl.sym(ufl.grad(v))) * ufl.dx, -cls.pressure * inside * ufl.inner(normal, v) * round_sides, held)
        outwards = fem.assemble_scalar(fem.form(-inside * ufl.inner(normal, moved) * round_sides))
        gradient = gradients(space, moved.x.array.reshape(-1, 3))
        strain = (gradient + gradient.transpose(0, 2, 1)) / 2
        stresses = 2 * shear * strain + lame * numpy.trace(strain, axis1=1, axis2=2)[:, None, None] * numpy.eye(3)
        area = fem.assemble_scalar(fem.form(-inside * ufl.inner(normal, x) / ufl.sqrt(ufl.dot(x, x)) * round_sides))
        return outwards / area, stresses.reshape(-1, 9)


def corners(space):
    """Points and tetrahedra as the space numbers them."""
    return space.tabulate_dof_coordinates(), space.dofmap.list.array.reshape(-1, 4)


def gradients(space, values):
    """Of each component in each tetrahedron: t x components x 3."""
    points, cells = corners(space)
    edges = points[cells[:, 1:]] - points[cells[:, :1]]
    return numpy.linalg.solve(edges, values[cells[:, 1:]] - values[cells[:, :1]]).transpose(0, 2, 1)


def sizes(points, cells, fluxes, wanted):
    """Where edges shall be how long: rows of x, y, z, length; and the error as it is estimated.

    What is estimated is how far the flux of a tetrahedron is from what its corners have on average (Zienkiewicz and Zhu). The lengths
    are to those that were wanted in each tetrahedron as is best for an error that is less by BETTER (Li and Bettess).
    """
    edges = points[cells[:, 1:]] - points[cells[:, :1]]
    volumes = abs(numpy.linalg.det(edges)) / 6
    total, shares = numpy.zeros((len(points), fluxes.shape[1])), numpy.zeros(len(points))
    for k in range(4):
        numpy.add.at(total, cells[:, k], fluxes * volumes[:, None])
        numpy.add.at(shares, cells[:, k], volumes)
    average = total / shares[:, None]
    errors = numpy.sqrt(volumes * ((average[cells] - fluxes[:, None])**2).sum(axis=2).mean(axis=1))
    error = numpy.sqrt((errors**2).sum())
    ratio = error / BETTER / ((errors**1.2).sum()**0.5 * numpy.maximum(errors, 1e-12 * error)**0.4)
    lengths = wanted * numpy.clip(ratio, 1 / 2, 1)
    for _ in range(2):  # what is beside each other is not too different
        at_points = numpy.full(len(points), numpy.inf)
        for k in range(4):
            numpy.minimum.at(at_points, cells[:, k], lengths)
        lengths = at_points[cells].mean(axis=1)
    return numpy.column_stack([points[cells].mean(axis=1), lengths]), error


def run(bsp2, case, steps):
    """Points and relative errors of each step."""
    field, done = None, []
    for step in range(steps + 1):
        with tempfile.TemporaryDirectory() as folder:
            domain, tags, number = mesh_of(bsp2, pathlib.Path(folder), case, field)
        answer, fluxes = case.solve(domain, tags, number)
        points, cells = corners(fem.FunctionSpace(domain, ("Lagrange", 1)))
        wanted = case.size if field is None else field[cKDTree(field[:, :3]).query(points[cells].mean(axis=1))[1], 3]
        field, estimate = sizes(points, cells, fluxes, wanted)
        done.append((len(points), abs(answer / case.right - 1)))
        rate = "" if step == 0 else f", power {numpy.log(done[-1][1] / done[0][1]) / numpy.log(done[-1][0] / done[0][0]):.2f}"
        print(f"{case.__name__.lower():6} step {step}: {len(points):7,} points, {answer:.6g} for {case.right:.6g}, "
              f"{done[-1][1]:.3%} off, estimate {estimate:.3g}{rate}", flush=True)
    return numpy.array(done)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bsp2", type=pathlib.Path)
    parser.add_argument("case", nargs="?", choices=["plate", "vessel"], help="default: both")
    parser.add_argument("--steps", type=int, default=3)
    parser.add_argument("--plot", type=pathlib.Path)
    arguments = parser.parse_args()
    cases = [case for case in (Plate, Vessel) if arguments.case in (None, case.__name__.lower())]
    curves = {case.__name__.lower(): run(arguments.bsp2.resolve(), case, arguments.steps) for case in cases}
    if not arguments.plot:
        return
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    for name, curve in curves.items():
        pyplot.loglog(curve[:, 0], curve[:, 1], "o-", label=name)
        pyplot.loglog(curve[:, 0], curve[0, 1] * (curve[:, 0] / curve[0, 0])**(-2 / 3), ":", color="gray")
    pyplot.xlabel("points")
    pyplot.ylabel("relative error (dotted: power of -2/3)")
    pyplot.legend()
    pyplot.savefig(arguments.plot, dpi=100)


if __name__ == "__main__":
    main()
