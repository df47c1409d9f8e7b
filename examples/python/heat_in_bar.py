"""Heat through a bar of two metals with a hole along it, solved by dolfinx (Debian: python3-dolfinx) on a mesh made here."""

import numpy
import ufl
from dolfinx import fem, mesh
from dolfinx.fem.petsc import LinearProblem
from mpi4py import MPI
from petsc4py import PETSc

import bsp2

# Steel from x = 0 to 3, copper from 3 to 4, and a hole of 16 facets through both.
bar = bsp2.cuboid([3, 1, 1]).part("steel") + bsp2.cuboid([1, 1, 1]).translate([3, 0, 0]).part("copper")
hole = bsp2.cylinder(h=6, r=0.3, fn=16).rotate([0, 90, 0]).translate([-1, 0.5, 0.5])
solid = bsp2.solver_mesh(bar - hole, size=0.5, groups={"hot": "x==min", "cold": "x==max"})
print(f"{len(solid.tetrahedra):,} tetrahedra in {' and '.join(solid.volume_names)}, faces: {', '.join(solid.group_names)}")

# The arrays are what dolfinx wants; it orders cells anew, and says how.
linear = ufl.Mesh(ufl.VectorElement("Lagrange", ufl.tetrahedron, 1))
domain = mesh.create_mesh(MPI.COMM_SELF, solid.tetrahedra.astype(numpy.int64), solid.points, linear)
part_of_cell = solid.volumes[domain.topology.original_cell_index]

# Each part conducts as its metal does.
conductivity = fem.Function(fem.FunctionSpace(domain, ("DG", 0)))
of_part = [{"steel": 1.0, "copper": 8.0}[name] for name in solid.volume_names]
conductivity.x.array[:] = numpy.array(of_part)[part_of_cell]

# 100 degrees at one end and 0 at the other; nothing passes the other faces.
space = fem.FunctionSpace(domain, ("Lagrange", 1))
ends = []
for at, degrees in ((0.0, 100.0), (4.0, 0.0)):
    there = fem.locate_dofs_geometrical(space, lambda x: numpy.isclose(x[0], at))
    ends.append(fem.dirichletbc(PETSc.ScalarType(degrees), there, space))
u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
form = conductivity * ufl.dot(ufl.grad(u), ufl.grad(v)) * ufl.dx
nothing = fem.Constant(domain, PETSc.ScalarType(0)) * v * ufl.dx
exactly = {"ksp_type": "preonly", "pc_type": "lu"}
temperature = LinearProblem(form, nothing, bcs=ends, petsc_options=exactly).solve()

# The flow, twice: from the solution, and by the resistances of two bars in a row.
power = fem.assemble_scalar(fem.form(conductivity * ufl.dot(ufl.grad(temperature), ufl.grad(temperature)) * ufl.dx)) / 100
area = solid.volume / 4
print(f"heat flow {power:.6f}, by formula {100 * area / (3 / 1.0 + 1 / 8.0):.6f}")
