"""A drilled block: from an expression to its volume, its cells as numpy arrays, and a file for the printer."""

import sys

import numpy

import bsp2

# Solids are values; + - & ^ ~ are the Booleans. The holes are a little longer than the block is thick.
block = bsp2.cuboid([40, 30, 10])
hole = bsp2.cylinder(h=12, r=3, fn=48).translate([0, 0, -1])
drilled = block - sum(hole.translate([x, 15, 0]) for x in (10, 20, 30))

# Nothing has been computed so far. Now it is, on all cores.
result = drilled.evaluate()
print(f"volume {result.volume:.6f} in {len(result)} convex cells")

# What was found is there as arrays, which nobody has copied.
assert numpy.isclose(result.volumes.sum(), result.volume)
print("from", result.points.min(axis=0), "to", result.points.max(axis=0))

# Where are points, and how far is it to the surface? (Below 0: inside.)
print("distances", result.distance([[10, 15, 5], [5, 5, 5]]).round(6))

# Files are written by their endings.
result.save(sys.argv[1] if len(sys.argv) > 1 else "drilled_block.stl")
