"""On several processes: mpirun -n 4 python3 ranks.py. The same script runs alone, too.

All processes run all of this, and make the same calls in the same order."""

import sys

import bsp2

sponge = bsp2.cube(3)
bar = bsp2.cuboid([1, 1, 5], center=True)
for turn in ([0, 0, 0], [90, 0, 0], [0, 90, 0]):
    sponge -= bar.rotate(turn).translate([1.5, 1.5, 1.5])

# Each rank computes some of the regions. The cells are the same however many ranks there are: the digest says so.
result = sponge.evaluate(regions=8, surface=True)
if bsp2.ranks().is_master:
    print(f"volume {result.volume:g}, surface {result.surface().area:g}, digest {result.digest}")
if len(sys.argv) > 1:
    result.save(sys.argv[1])  # by all together
