"""Booleans, sums and differences, what is solid, and files of it."""

import math
import os

import numpy as np

from . import _cells, _complex, _files, _kernel, _partition
from ._complex import Batch
from .assemblies import POWER
from .boxes import RN
from .fl import INNERPROD, ISNUM, ISPOL, ISSEQOF
from .maps import EMBED


def _entrywise(function, values, name):
    """What a function of a list of numbers gives for numbers, for the entries of vectors, of matrices, ..."""
    if all(ISNUM(value) for value in values):
        return function(values)
    if not all(isinstance(value, (list, tuple, np.ndarray)) for value in values):
        raise TypeError(f"{name} takes numbers, vectors, matrices or complexes, not {values!r}")
    return [_entrywise(function, entries, name) for entries in zip(*values)]


def SUM(values):
    """The sum of numbers, vectors, matrices; the union of complexes."""
    return UNION(values) if ISPOL(values[0]) else _entrywise(sum, values, "SUM")


ADD = SUM


def DIFF(values):
    """The difference of numbers, vectors, matrices or complexes; of one number its negative."""
    if ISNUM(values):
        return -values
    if ISPOL(values[0]):
        return DIFFERENCE(values)
    return _entrywise(lambda numbers: numbers[0] - sum(numbers[1:]), values, "DIFF")


def PROD(values):
    """The product of numbers, of two vectors (inner), of two complexes."""
    values = list(values)
    for test, product in ((ISPOL, POWER), (ISNUM, math.prod), (ISSEQOF(ISNUM), INNERPROD)):
        if all(map(test, values)) and (product is not INNERPROD or len(values) == 2):
            return product(values)
    raise TypeError(f"PROD multiplies numbers, two vectors or two complexes, not {values!r}")


def SQR(value):
    """The square of a number, or of what a function gives."""
    return (lambda at: SQR(value(at))) if callable(value) else PROD([value, value])


# Booleans.
def _solids(pol, dimension):
    """What is solid of a complex, as the kernel takes it: hulls, each with its places."""
    result = []
    if pol.space_dim < dimension:
        return result
    for places in pol.places():
        arrays = [places.matrices] + [batch.points for batch in places.leaf.batches]
        if not all(np.isfinite(array).all() for array in arrays):
            raise ValueError("a coordinate of a complex is not a finite number")
        for batch in places.leaf.batches:
            if batch.points.shape[2] < dimension:
                continue
            if batch.dimension is not None:
                chosen = np.arange(len(batch.points)) if batch.dimension == dimension else ()
            else:
                chosen = np.flatnonzero(batch.frames()[0] == dimension)
            matrices = places.matrices[np.abs(np.linalg.det(places.matrices[:, 1:, 1:])) > 0]
            if len(matrices):
                result.extend((batch.points[i], matrices) for i in chosen)
    return result


def _boolean(name, pols):
    pols = [pols] if ISPOL(pols) else list(pols)
    if not pols or not all(ISPOL(pol) for pol in pols):
        raise TypeError(f"a {name.replace('_', ' ')} takes a list of complexes, not {pols}")
    dimension = max(pol.space_dim for pol in pols)
    operands = [_solids(pol, dimension) for pol in pols]
    if not any(operands):
        return _flat_boolean(name, pols, dimension)
    result = _evaluated(name, operands, dimension)
    result.edges = lambda: _partition.edges(name, pols, dimension)
    return result


def _evaluated(name, operands, dimension):
    if name == "difference" and not operands[0] or name == "intersection" and not all(operands):
        return _complex.leaf([], dimension)
    batches, at = [], 0
    for points in _kernel.evaluate((name, [operand for operand in operands if operand]), dimension):
        batches.append(Batch(points, np.arange(at, at + len(points)), dimension))
        at += len(points)
    return _complex.leaf(batches, dimension)


def _flat_boolean(name, pols, dimension):
    """Of what lies in one plane (line, ...) of its space: there it is solid."""
    pols = [EMBED(dimension - pol.space_dim)(pol) for pol in pols]
    points = [batch.points.reshape(-1, dimension) for pol in pols for batch in pol.cells()[0]]
    if not points:
        return _complex.leaf([], dimension)
    points = np.concatenate(points)
    rank, basis = _cells.frames(points[None])
    r = int(rank[0])
    if r == dimension or r == 0 or max(pol.point_dim() for pol in pols) < r:
        return _complex.leaf([], dimension)
    origin = points[0]
    basis = basis[0][:, :r]
    flat = [pol.mapped(lambda point: ((np.array(point) - origin) @ basis).tolist()) for pol in pols]
    result = _evaluated(name, [_solids(pol, r) for pol in flat], r)
    return result.mapped(lambda point: (origin + basis @ np.array(point)).tolist())


def UNION(pols):
    """The union of what is solid. Plane pieces of one plane in space are united there."""
    return _boolean("union", pols)


def INTERSECTION(pols):
    return _boolean("intersection", pols)


def DIFFERENCE(pols):
    """The first without the others."""
    return _boolean("difference", pols)


def XOR(pols):
    """What is in an odd number of complexes."""
    return _boolean("symmetric_difference", pols)


def VOLUME(pol):
    """The content of what is solid, overlaps counted once."""
    solids = _solids(pol, RN(pol))
    return _kernel.volume(("union", [solids]), pol.space_dim) if solids else 0.0


def SAVE(path):
    """Writes a complex, in the format that the name's ending says, and gives it back.

    .vtu has all cells as they are. Of what is solid .stl, .ply, .obj, .vtp have the surface, .pvtu and .h5
    the cells, .csg the model, .png, .svg and .pdf a picture; of a complex without anything solid .obj has its
    faces and lines.
    """

    def save(pol):
        ending = os.path.splitext(path)[1].lower()
        solids = _solids(pol, RN(pol))
        if ending == ".vtu":
            _files.write_vtu(pol, path)
        elif ending == ".obj" and not solids:
            _files.write_obj(pol, path)
        elif not solids:
            raise ValueError(
                f"nothing of the complex is solid: a .vtu or .obj file can have it, {path} cannot"
            )
        else:
            _kernel.save(("union", [solids]), pol.space_dim, path)
        return pol

    return save
