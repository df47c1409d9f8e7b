"""Convex cells in batches: each cell is the hull of its points, and all cells of a batch have equally many.

Arrays are (cells, points of a cell, coordinates), of doubles. No function here loops over cells in Python
where a batch can be done at once; only cells of many points that no product or simplex made are looked at one
by one.
"""

import itertools
import math

import numpy as np

RANK_TOLERANCE = 2e-5
"""A cell counts as flat if a singular value of its points, from the first one, is this part of the largest or
less: above what roundings to single precision make of flat quadrilaterals, below what is meant."""


def _by_trying(count, corners, dimension):
    """Whether hulls are found sooner by trying all facets, for all cells of a batch at once, than one by one.

    In seconds: 40 microseconds for each facet that is tried, 10 nanoseconds for each point that is compared
    to it; 100 microseconds for each point of a cell that is looked at by itself.
    """
    if dimension not in (2, 3):
        return False
    tries = math.comb(corners, dimension)
    return tries * (4e-5 + 1e-8 * count * corners) < 1e-4 * count * corners or corners <= dimension + 2


_CHUNK = 2_000_000
"""Doubles of an intermediate array."""


class Shape:
    """The faces of cells that are alike: of each dimension, the points of each face."""

    def __init__(self, points, dimension, faces):
        self.points = points
        self.dimension = dimension
        self.faces = faces

    def boundary(self, dimension):
        """Faces of a dimension, by their number of points: a list of index arrays (faces, points)."""
        by_count = {}
        for face in self.faces[dimension]:
            by_count.setdefault(len(face), []).append(face)
        return [np.array(by_count[count]) for count in sorted(by_count)]


_simplices = {}
_products = {}


def simplex_shape(dimension):
    """The shape of a simplex: any subset of its points is a face."""
    if dimension not in _simplices:
        faces = [list(itertools.combinations(range(dimension + 1), r + 1)) for r in range(dimension + 1)]
        _simplices[dimension] = Shape(dimension + 1, dimension, faces)
    return _simplices[dimension]


def product_shape(a, b):
    """The shape of a product: its faces are the products of faces."""
    if (id(a), id(b)) not in _products:
        faces = [[] for _ in range(a.dimension + b.dimension + 1)]
        for r, s in itertools.product(range(a.dimension + 1), range(b.dimension + 1)):
            for f, g in itertools.product(a.faces[r], b.faces[s]):
                faces[r + s].append(tuple(i * b.points + j for i in f for j in g))
        _products[id(a), id(b)] = Shape(a.points * b.points, a.dimension + b.dimension, faces)
    return _products[id(a), id(b)]


def frames(points):
    """Rank of each cell, and an orthonormal basis of its directions: (cells,), (cells, coordinates,
    coordinates).

    The first `rank` columns of the basis span the cell.
    """
    count, _, dimension = points.shape
    if dimension == 0 or count == 0:
        return np.zeros(count, int), np.zeros((count, dimension, dimension))
    centred = points - points[:, :1]
    values, vectors = np.linalg.eigh(np.einsum("mki,mkj->mij", centred, centred))
    values, vectors = values[:, ::-1], vectors[:, :, ::-1]
    size = np.abs(points).max(axis=(1, 2))
    floor = np.maximum(values[:, :1] * RANK_TOLERANCE**2, (size[:, None] * 1e-12) ** 2)
    return (values > floor).sum(axis=1), vectors


def flattened(points, rank, basis, content, thickness, share):
    """Rank, directions and content of cells, those of them flat that are thinner than a length, or than a share
    of their size."""
    if not points.size:
        return rank, basis, content
    _, singular, directions = np.linalg.svd(points - points[:, :1])
    limits = np.maximum(singular[:, :1] * share, thickness)
    new = np.minimum((singular > limits).sum(axis=1), rank)
    thin = np.flatnonzero(new < rank)
    basis, content = np.array(basis), np.array(content)
    basis[thin] = directions[thin].swapaxes(1, 2)
    content[thin] = measures(points[thin], new[thin], basis[thin])
    return new, basis, content


def measures(points, rank, basis):
    """Length, area, volume, ... of each cell, by its rank. Points have none."""
    result = np.zeros(len(points))
    for r in np.unique(rank):
        chosen = np.flatnonzero(rank == r)
        if r == 0:
            continue
        flat = np.einsum("mki,mir->mkr", points[chosen] - points[chosen, :1], basis[chosen][:, :, :r])
        result[chosen] = hull_measures(flat)
    return result


def hull_measures(points):
    """Content of the hull of each cell, whose points have as many coordinates as it has dimensions."""
    count, corners, dimension = points.shape
    if dimension == 1:
        return np.ptp(points[:, :, 0], axis=1)
    if corners == dimension + 1:
        return np.abs(np.linalg.det(points[:, 1:] - points[:, :1])) / math.factorial(dimension)
    if _by_trying(count, corners, dimension):
        step = max(1, _CHUNK // (corners * dimension))
        return np.concatenate([_brute_measures(points[i : i + step]) for i in range(0, count, step)])
    return np.array([_measure(cell) for cell in points])


def extremes(points, rank, basis):
    """Which points of each cell are corners of it: (cells, points), without doubles of a corner."""
    count, corners, _ = points.shape
    result = np.zeros((count, corners), bool)
    for r in np.unique(rank):
        chosen = np.flatnonzero(rank == r)
        if r == 0:
            result[chosen, 0] = True
            continue
        if corners == r + 1:
            result[chosen] = True
            continue
        flat = np.einsum("mki,mir->mkr", points[chosen] - points[chosen, :1], basis[chosen][:, :, :r])
        if r == 1:
            rows = np.arange(len(chosen))
            result[chosen[rows], flat[:, :, 0].argmin(axis=1)] = True
            result[chosen[rows], flat[:, :, 0].argmax(axis=1)] = True
        elif _by_trying(len(chosen), corners, int(r)):
            step = max(1, _CHUNK // (corners * int(r)))
            for i in range(0, len(chosen), step):
                result[chosen[i : i + step]] = _brute_corners(flat[i : i + step])
        else:
            for cell, target in zip(flat, chosen):
                result[target, sorted({v for face in facets(cell) for v in face})] = True
    return result


def _rounded(points):
    """Cells (.., points, coordinates) stretched to be equally thick in all directions, and by what content
    shrank."""
    centred = points - points.mean(axis=-2, keepdims=True)
    values, vectors = np.linalg.eigh(np.einsum("...ki,...kj->...ij", centred, centred) / points.shape[-2])
    scale = np.sqrt(np.maximum(values, 1e-300))
    return np.einsum("...ki,...ij->...kj", centred, vectors) / scale[..., None, :], scale.prod(axis=-1)


def _jiggled(points):
    """Rounded points moved by a millionth of their cell's size, always alike: then no facet has more corners
    than it needs. A corner that is one by less is lost, and with it a millionth of the content at most."""
    return points + np.random.default_rng(7).uniform(-1e-6, 1e-6, points.shape[-2:])


def _cross(a, b):
    """Cross products (.., 3); numpy's own takes three times as long for few of them."""
    result = np.empty_like(a)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        result[..., i] = a[..., j] * b[..., k] - a[..., k] * b[..., j]
    return result


def _brute_facets(points):
    """For each set of `dimension` points of a cell: +1, -1 if it is a facet with all others below or above,
    else 0."""
    _, corners, dimension = points.shape
    moved = _jiggled(points)
    for chosen in itertools.combinations(range(corners), dimension):
        others = [i for i in range(corners) if i not in chosen]
        edges = moved[:, chosen[1:]] - moved[:, chosen[:1]]
        if dimension == 2:
            normal = np.stack([edges[:, 0, 1], -edges[:, 0, 0]], axis=-1)
        else:
            normal = _cross(edges[:, 0], edges[:, 1])
        sides = np.einsum("mki,mi->mk", moved[:, others] - moved[:, chosen[:1]], normal) > 0
        yield list(chosen), np.where(sides.all(axis=1), -1, np.where(sides.any(axis=1), 0, 1))


def _brute_measures(points):
    dimension = points.shape[2]
    total = np.zeros(len(points))
    points, content = _rounded(points)
    for chosen, sign in _brute_facets(points):
        total += sign * np.linalg.det(points[:, chosen])
    return np.abs(total) * content / math.factorial(dimension)


def _brute_corners(points):
    result = np.zeros(points.shape[:2], bool)
    points, _ = _rounded(points)
    for chosen, sign in _brute_facets(points):
        result[:, chosen] |= (sign != 0)[:, None]
    # What lies upon a facet or an edge may have come out by the jiggling: doubles are told from it here.
    same = (np.abs(points[:, :, None] - points[:, None]) <= 1e-5).all(axis=3) & result[:, None, :]
    earlier = np.tril(np.ones(points.shape[1:2] * 2, bool), -1)
    return result & ~(same & earlier).any(axis=2)


def simplicial_hull(points):
    """The hull of rounded points (k, d), d >= 2: facets (f, d) and their outward normals (f, d).

    Incremental: facets that a point sees make place for those between it and their rim.
    """
    moved = _jiggled(points)
    corners, dimension = points.shape
    start = _first_simplex(moved)
    inside = moved[start].mean(axis=0)
    faces = np.array([start[:i] + start[i + 1 :] for i in range(dimension + 1)])
    normals, offsets = _planes(moved, faces, inside)
    for i in range(corners):
        if i in start:
            continue
        seen = normals @ moved[i] > offsets
        if not seen.any():
            continue
        rims = {}
        for face in faces[seen]:
            for j in range(dimension):
                rim = tuple(sorted(np.delete(face, j)))
                rims[rim] = rims.get(rim, 0) + 1
        new = np.array([rim + (i,) for rim, times in rims.items() if times == 1])
        new_normals, new_offsets = _planes(moved, new, inside)
        faces = np.concatenate([faces[~seen], new])
        normals = np.concatenate([normals[~seen], new_normals])
        offsets = np.concatenate([offsets[~seen], new_offsets])
    return faces, normals


def _first_simplex(points):
    """Points that span space, each far from those before."""
    chosen = [int(points[:, 0].argmin())]
    rest = points - points[chosen[0]]
    for _ in range(points.shape[1]):
        far = int((rest**2).sum(axis=1).argmax())
        direction = rest[far] / np.linalg.norm(rest[far])
        chosen.append(far)
        rest = rest - np.outer(rest @ direction, direction)
    return chosen


def _planes(points, faces, inside):
    edges = points[faces[:, 1:]] - points[faces[:, :1]]
    dimension = points.shape[1]
    normals = np.stack(
        [(-1) ** i * np.linalg.det(np.delete(edges, i, axis=2)) for i in range(dimension)], axis=-1
    )
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    offsets = np.einsum("fi,fi->f", normals, points[faces[:, 0]])
    wrong = normals @ inside > offsets
    normals[wrong] *= -1
    offsets[wrong] *= -1
    return normals, offsets


def _measure(points):
    points, content = _rounded(points)
    faces, _ = simplicial_hull(points)
    moved = _jiggled(points)
    centre = moved.mean(axis=0)
    signs = np.sign(np.linalg.det(moved[faces] - centre))
    return (
        abs((signs * np.linalg.det(points[faces] - centre)).sum()) * content / math.factorial(points.shape[1])
    )


def facets(points):
    """Facets of the hull of points (k, d), d >= 1: the corners of each, ascending.

    Simplices in one hyperplane are one facet; what lies upon a facet or an edge is no corner.
    """
    dimension = points.shape[1]
    if dimension == 1:
        return [(int(points[:, 0].argmin()),), (int(points[:, 0].argmax()),)]
    points, _ = _rounded(points)
    size = np.ptp(points, axis=0).max()
    faces, normals = simplicial_hull(points)
    merged = []
    for face, normal in zip(faces, normals):
        heights = (points - points[face].mean(axis=0)) @ normal
        on = frozenset(np.flatnonzero(np.abs(heights) < RANK_TOLERANCE * size))
        merged.append(on if set(face) <= on else frozenset(face))
    planes = sorted({tuple(sorted(m)) for m in merged if not any(m < other for other in merged)})
    times = np.zeros(len(points), int)
    for plane in planes:
        times[list(plane)] += 1
    keep = np.zeros(len(points), bool)
    for i in np.flatnonzero(times >= dimension):
        if not any(np.abs(points[i] - points[j]).max() <= 1e-5 for j in np.flatnonzero(keep)):
            keep[i] = True
    result = [tuple(i for i in plane if keep[i]) for plane in planes]
    return [facet for facet in result if len(facet) >= dimension]


def hull_shape(points):
    """The shape of the hull of points (k, d), d its dimension; `faces` count the points as they are given."""
    dimension = points.shape[1]
    if len(points) == dimension + 1:
        return simplex_shape(dimension)
    return _shape_of(facets(points), len(points), dimension)


def hull_shapes(points):
    """The shapes of cells (cells, points, dimension): pairs of a shape and the cells that have it."""
    count, corners, dimension = points.shape
    if corners == dimension + 1:
        return [(simplex_shape(dimension), np.arange(count))]
    if not _by_trying(count, corners, dimension) or dimension != 3 or corners > 60:
        return [(hull_shape(cell), np.array([i])) for i, cell in enumerate(points)]
    step = max(1, _CHUNK // (corners * math.comb(corners, 3)))
    masks = np.concatenate([_facet_masks(points[i : i + step]) for i in range(0, count, step)])
    structures, which = np.unique(np.sort(masks, axis=1), axis=0, return_inverse=True)
    which = which.reshape(-1)
    result = []
    for number, row in enumerate(structures):
        found = {int(mask) for mask in row if mask}
        found = [mask for mask in found if not any(mask != other and mask & other == mask for other in found)]
        times = [sum(mask >> i & 1 for mask in found) for i in range(corners)]
        own = [tuple(i for i in range(corners) if mask >> i & 1 and times[i] >= 3) for mask in sorted(found)]
        chosen = np.flatnonzero(which == number)
        result.append((_shape_of([f for f in own if len(f) >= 3], corners, 3), chosen))
    return result


def _facet_masks(points):
    """For each three points of a cell: the set, as bits, of all that are in their plane if it bounds the
    cell, else 0."""
    points, _ = _rounded(points)
    count, corners, _ = points.shape
    bits = 1 << np.arange(corners, dtype=np.int64)
    result = []
    for i, j, k in itertools.combinations(range(corners), 3):
        normal = _cross(points[:, j] - points[:, i], points[:, k] - points[:, i])
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        heights = np.einsum("mki,mi->mk", points - points[:, i : i + 1], normal / np.maximum(length, 1e-300))
        on = np.abs(heights) < 3 * RANK_TOLERANCE
        bounds = ((heights < 0) | on).all(axis=1) | ((heights > 0) | on).all(axis=1)
        result.append(np.where(bounds & (length[:, 0] > 1e-7), on @ bits, 0))
    return np.stack(result, axis=1)


def _shape_of(own, count, dimension):
    """The shape that has these facets: other faces are what facets share."""
    own = [frozenset(f) for f in own]
    corners = frozenset().union(*own)
    faces = [set() for _ in range(dimension + 1)]
    faces[dimension] = {corners}
    faces[dimension - 1] = set(own)
    for r in range(dimension - 2, -1, -1):
        upper = faces[r + 1]
        meets = {a & b for a in upper for b in own if not a <= b}
        faces[r] = {m for m in meets if m and not any(m < other for other in meets)}
    return Shape(count, dimension, [sorted(tuple(sorted(f)) for f in level) for level in faces])
