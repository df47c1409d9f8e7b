"""Many primitives, with progress; Ctrl-C ends it. many_cubes.py [N] makes about N cubes, 100,000 if nobody says how many."""

import sys
import time

import bsp2

n = round((float(sys.argv[1]) if len(sys.argv) > 1 else 1e5) ** (1 / 3))
start = time.time()
cube = bsp2.cube(0.5)
lattice = bsp2.union(cube.translate([x, y, z]) for x in range(n) for y in range(n) for z in range(n))
print(f"{n**3:,} cubes are an expression after {time.time() - start:.2f} s")

try:
    result = lattice.evaluate(progress=True)
except KeyboardInterrupt:
    sys.exit("ended by Ctrl-C")
print(f"{len(result):,} cells, volume {result.volume:g}")
