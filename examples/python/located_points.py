"""Points and a solid: which are inside, and how far from its surface they are. So a volume can be estimated by throwing points, too."""

import sys

import numpy

import bsp2

gear = bsp2.linear_extrude(bsp2.circle(r=10, fn=64) + bsp2.union(
    bsp2.square([4, 3], center=True).translate([11, 0]).rotate(30 * i) for i in range(12)), height=4) - bsp2.cylinder(h=9, r=3, center=True, fn=32)
result = gear.evaluate()

lower, upper = result.bounds
random = numpy.random.default_rng(7)
points = random.uniform(lower, upper, (100_000, 3))

inside = result.locate(points).labels == bsp2.IN
print(f"{inside.mean():.3f} of the points are inside, {result.volume / numpy.prod(upper - lower):.3f} of the box is")

# Below 0 is inside: how thick may a coat be until it has half of the material?
depth = -result.distance(points[inside][:2000])
print(f"half of the material is less than {numpy.median(depth):.2f} below the surface")

if len(sys.argv) > 1:
    numpy.savetxt(sys.argv[1], points[inside])
