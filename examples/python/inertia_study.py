"""A parameter study: how the moment of inertia of a wheel grows with its radius, each figure with its bounds.

With matplotlib and a name for a picture it plots: python3 inertia_study.py study.png"""

import sys

import numpy

import bsp2

radii, rows = numpy.linspace(2, 4, 5), []
for radius in radii:
    # Truly round, so the true value is enclosed, and never hit.
    wheel = bsp2.d_cylinder(3, radius, 1, center=True) - bsp2.d_cylinder(3, 0.5, 2, center=True)
    found = wheel.evaluate(tolerance=0.05, measures_only=True).measures
    least, most = found.inertia_least, found.inertia_most
    # inertia[i][j] is the integral of x_i x_j, with x_0 = 1: about z it is that of x^2 + y^2.
    rows.append((least[1, 1] + least[2, 2], most[1, 1] + most[2, 2], numpy.pi / 2 * (radius**4 - 0.5**4)))

for radius, (least, most, truth) in zip(radii, rows):
    print(f"radius {radius:.1f}: from {least:9.4f} to {most:9.4f}, by formula {truth:9.4f}")
    assert least <= truth <= most

if len(sys.argv) > 1:
    import matplotlib.pyplot as plot

    least, most, truth = numpy.array(rows).T
    plot.fill_between(radii, least, most, alpha=0.5, label="enclosed")
    plot.plot(radii, truth, label="formula")
    plot.legend()
    plot.savefig(sys.argv[1])
