"""The functions of lar-cc and larlib that programs use most, by their definitions.

A model is a pair (V, CV): points, and cells as lists of indices of points, counted from 0.
"""

import itertools

from .geometry import MKPOL


def larExtrude(model, pattern):
    """A simplicial model swept along a new axis, in steps; negative steps are gaps."""
    points, cells = model
    size = len(cells[0])
    heights = [0] + list(itertools.accumulate(abs(step) for step in pattern))
    result = []
    for layer, step in enumerate(pattern):
        if step <= 0:
            continue
        for cell in cells:
            tube = [v + k * len(points) for k in (layer, layer + 1) for v in cell]
            result.extend(tube[i : i + size + 1] for i in range(size))
    return [list(v) + [z] for z in heights for v in points], result


def larSimplexGrid(shape):
    """A grid of unit cubes, each in simplices."""
    model = [[]], [[0]]
    for steps in shape:
        model = larExtrude(model, steps * [1])
    return model
