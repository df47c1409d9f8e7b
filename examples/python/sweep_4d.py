"""A solid of four dimensions: all places that a moving plate takes, with the time as the fourth axis."""

import numpy

import bsp2

plate = bsp2.cuboid([4, 3, 1])

# Times an interval of time it is a plate at rest. Sheared along x by the time, it moves at a speed of 3.
rests = bsp2.extrude(plate, 2)
shear = numpy.eye(5)
shear[0, 3] = 3
way = rests.transform(shear) + rests.translate([6, 0, 0, 2])
print("content in space and time:", round(way.evaluate().volume, 9))

# The plate at a time is a section, the space that it ever takes is a shadow.
for time in (0.5, 1, 3):
    lower, upper = bsp2.section(way, 4, time).evaluate().bounds
    print(f"at t = {time} from x = {lower[0]:g} to {upper[0]:g}")
print("sweeps a volume of", round(bsp2.project(way, 3).evaluate().volume, 9))

# When does it hit a post at x = 8? The intersection says: its least t is the time of the collision.
post = bsp2.extrude(bsp2.cuboid([1, 3, 5]).translate([8, 0, 0]), 4)
print("hits the post at t =", round((way & post).evaluate().bounds[0][3], 6))
