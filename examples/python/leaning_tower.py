"""The leaning tower of the paper, of 2,609 primitives. leaning_tower.py [N]: its round things have N facets, 16 if nobody says how many."""

import sys

import bsp2
from bsp2 import cuboid, cylinder, union

n = int(sys.argv[1]) if len(sys.argv) > 1 else 16
floors, columns, steps, storey = 8, 30, 293, 6.0


def disc(h, r, top=None):
    return cylinder(h=h, r1=r, r2=r if top is None else top, fn=n)


def drum(h, r):
    return cylinder(h=h, r=r, fn=2 * n)


def ring(h, outer, inner):
    return drum(h, outer) - drum(h + 2, inner).translate([0, 0, -1])


def beam(r, start, end):  # a cylinder along x
    return disc(end - start, r).rotate([0, 90, 0]).translate([start, 0, 0])


def plate(x, y, z):
    return cuboid([x, y, z]).translate([-x / 2, -y / 2, 0])


def around(solid, count, first=0.0):  # copies of a solid, turned about the axis of the tower
    return union(solid.rotate(360 * (k + first) / count) for k in range(count))


def stack(*layers):  # of (height, solid): each stands on the one before, all that on the ground
    z, placed = 0.0, []
    for height, solid in layers:
        placed.append(solid.translate([0, 0, z]))
        z += height
    return union(placed), z


def column(shaft):
    return stack((0.2, plate(0.62, 0.62, 0.2)), (0.12, disc(0.12, 0.29)), (shaft, disc(shaft, 0.2)),
                 (0.35, disc(0.35, 0.19, 0.3)), (0.15, plate(0.64, 0.64, 0.15)))


pillar, tall = column(2.75)
spring = 0.35 + tall  # where the arches begin
door = cuboid([2, 1, 2.3]).translate([5, -0.5, 0.35]).rotate(21.2)
arcade = ring(storey - 0.4 - spring, 7.5, 7.1) - around(beam(0.66, 6, 9), columns, 0.5)
archivolt = beam(0.7, 7.02, 7.58) - beam(0.6, 6, 9) - cuboid([4, 4, 2]).translate([6, -2, -2])
floor = union([ring(storey, 6.4, 5.8) - door, ring(0.35, 8, 5.9), ring(0.4, 7.9, 5.9).translate([0, 0, storey - 0.4]),
               around(pillar.translate([7.3, 0, 0.35]), columns),
               (arcade + around(archivolt, columns, 0.5)).translate([0, 0, spring])])

# The hardest part: a thick wall, out of which a spiral stair is cut.
height = floors * storey
step = cuboid([1.2, 0.8, 2.2]).translate([4.25, -0.4, 0])
stair = union(step.rotate(360 * 7 * i / steps).translate([0, 0, (height - 2.2) * i / steps]) for i in range(steps))
wall = ring(height, 6, 3.7) - stair

pillar, tall = column(3.6)
window = beam(0.9, 3, 7).translate([0, 0, 3.2]) + cuboid([4, 1.8, 2.4]).translate([3, -0.9, 0.8])
bells = union([ring(6, 5.4, 4.4) - around(window, 6), around(pillar.translate([5.9, 0, 0.3]), 12, 0.5), ring(0.3, 6.4, 4.6),
               ring(0.4, 6.5, 4.5).translate([0, 0, 0.3 + tall]), ring(0.5, 6, 4.8).translate([0, 0, 0.7 + tall])])

ground = (drum(1.2, 9.5) + drum(0.8, 8.8).translate([0, 0, 1.2])).translate([0, 0, -2])
tower = union([ground, wall, bells.translate([0, 0, height])] + [floor.translate([0, 0, i * storey]) for i in range(floors)])
tower = tower.rotate([3.97, 0, 0])

result = tower.evaluate(progress=True)
print(f"{result.report['primitives']:,} primitives, {len(result):,} cells, volume {result.volume:.6f}")
if len(sys.argv) > 2:
    result.save(sys.argv[2])
