"""Polyhedral complexes: points and convex cells of any dimension, in a space of any dimension.

A complex is a graph: leaves hold cells in arrays, other nodes hold children, an affine map and properties
such as colours. Nodes do not change, so a child may stand in many places; what is asked of the whole (boxes,
measures, points) is computed for all places of a leaf at once.
"""

import numpy as np

from . import _cells
from .._counted import counted


class Batch:
    """Cells with equally many points each: `points` (cells, points, coordinates) and the place of each in the
    whole.

    `dimension` (the rank of the points) and `shape` (the faces) are known where all cells are alike, else
    None. A cell that a map made flat keeps the faces of its shape.
    """

    def __init__(self, points, order, dimension=None, shape=None):
        self.points = points
        self.order = order
        self.dimension = dimension
        self.shape = shape
        self._frames = None
        self._measures = None
        self._keep = None
        self._shapes = None

    def solid(self):
        """Whether the cells are known to fill their space, however thin they are."""
        return self.dimension == self.points.shape[2]

    def frames(self):
        """Rank and directions of each cell, as `_cells.frames`."""
        if self._frames is None:
            count, _, coordinates = self.points.shape
            if self.solid():
                basis = np.broadcast_to(np.eye(coordinates), (count, coordinates, coordinates))
                self._frames = np.full(count, coordinates), basis
            else:
                self._frames = _cells.frames(self.points)
        return self._frames

    def measures(self):
        """Content of each cell, by its rank."""
        if self._measures is None:
            self._measures = _cells.measures(self.points, *self.frames())
        return self._measures

    def flattened(self, thickness, share):
        """Rank, directions and content of the cells, as `_cells.flattened`."""
        return _cells.flattened(self.points, *self.frames(), self.measures(), thickness, share)

    def corners(self):
        """Which points of each cell are corners of it, as `_cells.extremes`."""
        if self._keep is None:
            self._keep = _cells.extremes(self.points, *self.frames())
        return self._keep

    def shapes(self):
        """The shapes of the cells, as `_cells.hull_shapes`."""
        if self._shapes is None:
            _, basis = self.frames()
            flat = np.einsum("mki,mir->mkr", self.points - self.points[:, :1], basis[:, :, : self.dimension])
            self._shapes = _cells.hull_shapes(flat)
        return self._shapes

    def at(self, start):
        """The batch with its places counted from `start`."""
        result = Batch(self.points, self.order + start, self.dimension, self.shape)
        result._frames, result._measures = self._frames, self._measures
        return result

    def selected(self, chosen):
        return Batch(self.points[chosen], self.order[chosen], self.dimension, self.shape)


class Hpc:
    """A hierarchical polyhedral complex. Made by the functions of this package, not by hand."""

    def __init__(self, children=(), matrix=None, batches=None, space_dim=0, props=None):
        if isinstance(children, Hpc):
            children = (children,)
        self.children = tuple(children)
        self.matrix = matrix
        self.batches = batches
        self.props = props
        own = 0 if matrix is None else len(matrix) - 1
        self.space_dim = max([space_dim, own] + [child.space_dim for child in self.children])
        self._point_dim = None
        self._skeletons = {}
        self._leaves = None
        self.edges = None  # of a Boolean: what gives its edges

    def __repr__(self):
        return f"<complex of {counted(self.cell_count(), 'cell')}, dimension {self.point_dim()} in {self.space_dim}>"

    def nodes(self):
        """All nodes, each once, children before parents."""
        done, result, stack = set(), [], [(self, False)]
        while stack:
            node, entered = stack.pop()
            if entered:
                result.append(node)
            elif id(node) not in done:
                done.add(id(node))
                stack.append((node, True))
                stack.extend((child, False) for child in node.children if id(child) not in done)
        return result

    def point_dim(self):
        """The dimension of the cells: the largest there is."""
        for node in self.nodes():
            if node._point_dim is None:
                own = max((child._point_dim for child in node.children), default=0)
                for batch in node.batches or ():
                    if batch.dimension is None and len(batch.points):
                        own = max(own, int(batch.frames()[0].max()))
                    elif len(batch.points):
                        own = max(own, batch.dimension)
                node._point_dim = own
        return self._point_dim

    def cell_count(self):
        return sum(
            len(places.matrices) * len(b.points) for places in self.places() for b in places.leaf.batches
        )

    def places(self):
        """Where the leaves are: of each leaf the maps from its space to the whole, and their order."""
        if self._leaves is None:
            self._leaves = _places(self)
        return self._leaves

    def cells(self):
        """All cells in the space of the whole: a list of batches, and an array of the properties of each
        batch."""
        dimension, result, props = self.space_dim, [], []
        for places in self.places():
            linear, shift = places.matrices[:, 1:, 1:], places.matrices[:, 1:, 0]
            stays = len(linear) == 1 and np.array_equal(places.matrices[0], np.eye(dimension + 1))
            for batch in places.leaf.batches:
                d = batch.points.shape[2]
                if stays and d == dimension:
                    result.append(batch.at(places.order[0]))
                    props.append(np.full(len(batch.points), places.props[0]))
                    continue
                points = np.einsum("pij,mkj->pmki", linear[:, :, :d], batch.points) + shift[:, None, None]
                order = places.order[:, None] + batch.order[None]
                flat = _flattens(linear[:, :, :d])
                batch = Batch(
                    points.reshape(-1, points.shape[2], dimension),
                    order.reshape(-1),
                    None if flat else batch.dimension,
                    batch.shape,
                )
                result.append(batch)
                props.append(np.repeat(places.props, order.shape[1]))
        return result, props

    def box(self):
        """Least and largest coordinates; of a complex without cells None."""
        low, high = np.full(self.space_dim, np.inf), np.full(self.space_dim, -np.inf)
        for places in self.places():
            linear, shift = places.matrices[:, 1:, 1:], places.matrices[:, 1:, 0]
            for batch in places.leaf.batches:
                points = batch.points.reshape(-1, batch.points.shape[2])
                if not len(points):
                    continue
                step = max(1, _cells._CHUNK // max(1, points.size))
                for i in range(0, len(linear), step):
                    moved = np.einsum("pij,mj->pmi", linear[i : i + step, :, : points.shape[1]], points)
                    moved += shift[i : i + step, None]
                    low = np.minimum(low, moved.min(axis=(0, 1)))
                    high = np.maximum(high, moved.max(axis=(0, 1)))
        return None if np.isinf(low).any() else (low, high)

    def measures(self, thickness=None, share=_cells.RANK_TOLERANCE):
        """Number and content of the cells of each dimension: {dimension: (cells, content)}.

        thickness: cells are flat that are thinner than this length, or than a share of their size, unless they
        are known to be solid.
        """
        total = {}
        _in_bulk([batch for places in self.places() for batch in places.leaf.batches], measured=True)
        moved = []
        for places in self.places():
            linear = places.matrices[:, 1:, 1:]
            for batch in places.leaf.batches:
                d = batch.points.shape[2]
                flat, even = _effects(linear[:, :, :d])
                # What is thin depends on the map, unless it keeps angles: the rank is found in its place.
                anew = flat if batch.dimension is not None else ~even
                if anew.any():
                    points = np.einsum("pij,mkj->pmki", linear[anew][:, :, :d], batch.points)
                    places_of = Batch(points.reshape(-1, points.shape[2], self.space_dim), None)
                    moved.append((places_of, batch, linear[anew][:, :, :d]))
                if anew.all():
                    continue
                _add_alike(total, batch, linear[~anew][:, :, :d], thickness, share)
        _in_bulk([batch for batch, _, _ in moved])
        for batch, origin, maps in moved:
            _measure_moved(batch, origin, maps)
            rank, content = batch.frames()[0], batch.measures()
            if thickness is not None and not origin.solid():
                rank, _, content = batch.flattened(thickness, share)
            _add(total, rank, content)
        return {r: total[r] for r in sorted(total)}

    def solid_volume(self):
        """Content of the cells that fill their space, overlaps counted as often as they are there."""
        return self.measures().get(self.space_dim, (0, 0.0))[1]

    def points_and_cells(self):
        """Points (n, space_dim) and cells (lists of indices), each cell with points of its own, in order."""
        pieces = [_turned(piece) for batch in _merged(self.cells()[0]) for piece in _corners(batch)]
        count = sum(len(p.points) for p in pieces)
        if not count:
            return np.zeros((0, self.space_dim)), []
        order = np.concatenate([p.order for p in pieces])
        sizes = np.concatenate([np.full(len(p.points), p.points.shape[1]) for p in pieces])
        rank = np.empty(count, int)
        rank[np.argsort(order, kind="stable")] = np.arange(count)
        sorted_sizes = np.empty(count, int)
        sorted_sizes[rank] = sizes
        starts = np.concatenate([[0], np.cumsum(sorted_sizes)])
        points = np.empty((starts[-1], self.space_dim))
        at = 0
        for piece in pieces:
            first = starts[rank[at : at + len(piece.points)]]
            points[first[:, None] + np.arange(piece.points.shape[1])] = piece.points
            at += len(piece.points)
        return points, [list(range(a, b)) for a, b in zip(starts[:-1], starts[1:])]

    def mapped(self, function):
        """The complex whose cells are the hulls of the images of the corners of these."""
        pieces = [piece for batch in _merged(self.cells()[0]) for piece in _corners(batch)]
        if not pieces:
            return leaf([], self.space_dim)
        points = np.concatenate([p.points.reshape(-1, self.space_dim) for p in pieces])
        key = np.ascontiguousarray(np.round(points, 12) + 0.0)
        key = (
            key.view([("", key.dtype)] * self.space_dim).reshape(-1)
            if self.space_dim
            else np.zeros(len(points))
        )
        _, first, back = np.unique(key, return_index=True, return_inverse=True)
        images = _images(function, points[first])[back]
        result, at = [], 0
        for piece in pieces:
            count, corners, _ = piece.points.shape
            image = images[at : at + count * corners].reshape(count, corners, -1)
            at += count * corners
            result.append(Batch(image, piece.order))
        return leaf(result, images.shape[1])

    def skeleton(self, dimension):
        """The faces of a dimension of all cells. A face of several cells is there as often."""
        replaced = {}
        leaves = [
            node for node in self.nodes() if node.batches is not None and dimension not in node._skeletons
        ]
        _in_bulk([batch for node in leaves for batch in node.batches if batch.shape is None], cornered=True)
        for node in leaves:
            node.pieces = [piece for batch in node.batches for piece in _corners(batch)]
        _shape_in_bulk([piece for node in leaves for piece in node.pieces if piece.shape is None], dimension)
        for node in self.nodes():
            if node.batches is not None:
                if dimension not in node._skeletons:
                    ends = node.edges() if dimension == 1 and node.edges and node.batches else None
                    node._skeletons[dimension] = (
                        _skeleton(node, dimension) if ends is None else segments(ends)
                    )
                replaced[id(node)] = node._skeletons[dimension]
            else:
                children = [replaced[id(child)] for child in node.children]
                replaced[id(node)] = Hpc(children, node.matrix, None, node.space_dim, node.props)
        return replaced[id(self)]


class _Places:
    def __init__(self, leaf_, matrices, order, props):
        self.leaf = leaf_
        self.matrices = matrices
        self.order = order
        self.props = props


def leaf(batches, space_dim):
    """A complex of these batches."""
    return Hpc(batches=[b for b in batches if len(b.points)], space_dim=space_dim)


def from_cells(points, cells):
    """The complex of hulls of points: points (n, d), cells lists of indices, counted from 0. Empty cells are
    none."""
    points = np.asarray(points, float)
    by_count = {}
    for place, cell in enumerate(cells):
        if len(cell):
            by_count.setdefault(len(cell), []).append((place, cell))
    batches = []
    for members in by_count.values():
        index = np.array([cell for _, cell in members], dtype=np.int64)
        batches.append(Batch(points[index], np.array([place for place, _ in members])))
    return leaf(batches, points.shape[1])


def segments(ends):
    """The complex of segments (n, 2, d)."""
    return leaf([Batch(ends, np.arange(len(ends)))], ends.shape[2])


def product(a, b):
    """All pairs of a point of `a` and a point of `b`; its cells are the products of cells."""
    result = []
    first, second = _merged(a.cells()[0]), _merged(b.cells()[0])
    step = 1 + max([int(x.order.max()) for x in second if len(x.order)], default=0)
    for x in (piece for batch in first for piece in _corners(batch)):
        for y in (piece for batch in second for piece in _corners(batch)):
            count = len(x.points) * len(y.points)
            corners = x.points.shape[1] * y.points.shape[1]
            shape = (len(x.points), len(y.points), x.points.shape[1], y.points.shape[1])
            left = np.broadcast_to(x.points[:, None, :, None], shape + (a.space_dim,))
            right = np.broadcast_to(y.points[None, :, None, :], shape + (b.space_dim,))
            points = np.concatenate([left, right], axis=4).reshape(count, corners, -1)
            known = x.shape is not None and y.shape is not None
            ranked = known and None not in (x.dimension, y.dimension)
            piece = Batch(
                points,
                (x.order[:, None] * step + y.order[None]).reshape(-1),
                x.dimension + y.dimension if ranked else None,
                _cells.product_shape(x.shape, y.shape) if known else None,
            )
            if ranked and x.dimension and y.dimension:
                piece._measures = np.outer(x.measures(), y.measures()).reshape(-1)
            result.append(piece)
    return leaf(result, a.space_dim + b.space_dim)


def hull(complexes):
    """The one cell that is the hull of all points of complexes."""
    dimension = max(c.space_dim for c in complexes)
    all_points = []
    for c in complexes:
        for batch in c.cells()[0]:
            points = batch.points.reshape(-1, c.space_dim)
            all_points.append(np.pad(points, ((0, 0), (0, dimension - c.space_dim))))
    if not all_points:
        return leaf([], dimension)
    points = np.unique(np.concatenate(all_points), axis=0)
    return leaf([Batch(points[None], np.zeros(1, int))], dimension)


def embedded(matrix, dimension):
    """An affine map of fewer coordinates as one of `dimension`: the others stay."""
    size = len(matrix)
    if size == dimension + 1:
        return matrix
    result = np.eye(dimension + 1)
    size = min(size, dimension + 1)
    result[:size, :size] = matrix[:size, :size]
    return result


def _places(root):
    nodes = root.nodes()
    counts = {}
    for node in nodes:
        if node.batches is not None:
            counts[id(node)] = 1 + max([int(b.order.max()) for b in node.batches], default=0)
        else:
            counts[id(node)] = sum(counts[id(child)] for child in node.children)
    size = root.space_dim + 1
    waiting = {id(root): [(np.eye(size)[None], np.zeros(1, np.int64), np.zeros(1, np.int64))]}
    interned, table, result = {(): 0}, [()], []
    for node in reversed(nodes):
        arrived = waiting.pop(id(node))
        if len(arrived) == 1:
            matrices, order, props = arrived[0]
        else:
            matrices, order, props = (np.concatenate(parts) for parts in zip(*arrived))
        if node.matrix is not None:
            matrices = matrices @ embedded(node.matrix, size - 1)
        if node.props:
            merged = [_intern(interned, table, table[p], node.props) for p in range(int(props.max()) + 1)]
            props = np.array(merged)[props]
        if node.batches is not None:
            result.append(_Places(node, matrices, order, props))
            continue
        at = 0
        for child in node.children:
            waiting.setdefault(id(child), []).append((matrices, order + at, props))
            at += counts[id(child)]
    for places in result:
        places.table = table
    result.sort(key=lambda places: int(places.order.min()))
    return result


def _intern(interned, table, outer, own):
    merged = dict(outer)
    merged.update(own)
    key = tuple(sorted(merged.items()))
    if key not in interned:
        interned[key] = len(table)
        table.append(key)
    return interned[key]


def _measure_moved(batch, origin, maps):
    """Measures what maps make of the cells of a batch: by determinants, where a cell keeps its rank."""
    before, basis = origin.frames()
    content = np.zeros((len(maps), len(before)))
    for r in np.unique(before):
        chosen = before == r
        content[:, chosen] = _factors(maps, basis[chosen][:, :, :r]) * origin.measures()[chosen]
    content = content.reshape(-1)
    rank, directions = batch.frames()
    other = np.flatnonzero(rank != np.tile(before, len(maps)))
    if len(other):
        content[other] = _cells.measures(batch.points[other], rank[other], directions[other])
    batch._measures = content


def _add_alike(total, batch, maps, thickness, share):
    """Adds what maps that keep angles, or the rank, make of the cells of a batch."""
    kinds = [(maps, *batch.frames(), batch.measures())]
    if thickness is not None and not batch.solid():
        scales = np.round(np.sqrt(np.einsum("pij,pij->p", maps, maps) / max(maps.shape[2], 1)), 12)
        kinds = [
            (maps[scales == scale], *batch.flattened(thickness / max(scale, 1e-300), share))
            for scale in np.unique(scales)
        ]
    for alike, rank, basis, content in kinds:
        for r in np.unique(rank):
            chosen = rank == r
            factors = _factors(alike, basis[chosen][:, :, :r])
            _add(total, np.full(factors.size, r), (factors * content[chosen]).reshape(-1))


def _effects(linear):
    """Of maps (maps, D, d): which take cells to flatter ones, and which keep angles."""
    gram = np.einsum("pij,pik->pjk", linear, linear)
    if gram.shape[1] == 0:
        return np.zeros(len(linear), bool), np.ones(len(linear), bool)
    values = np.linalg.eigvalsh(gram)
    least, most = values[:, 0], np.maximum(values[:, -1], 1e-300)
    return least <= 1e-20 * most, most - least <= 1e-12 * most


def _flattens(linear):
    return _effects(linear)[0].any()


def _factors(linear, basis):
    """By what each map multiplies the content of each cell: (maps, cells)."""
    maps, cells = len(linear), len(basis)
    r = basis.shape[2]
    if r == 0:
        return np.ones((maps, cells))
    if r == linear.shape[1] == linear.shape[2]:
        return np.broadcast_to(np.abs(np.linalg.det(linear))[:, None], (maps, cells))
    gram = np.einsum("pij,pik->pjk", linear, linear)
    scale = np.trace(gram, axis1=1, axis2=2) / gram.shape[1]
    if np.abs(gram - scale[:, None, None] * np.eye(gram.shape[1])).max() <= 1e-14 * scale.max():
        return np.broadcast_to((scale ** (r / 2))[:, None], (maps, cells))
    inner = np.einsum("mji,pjk,mkl->pmil", basis, gram, basis, optimize=True)
    return np.sqrt(np.abs(np.linalg.det(inner)))


def _add(total, rank, content):
    for r in np.unique(rank):
        count, amount = total.get(int(r), (0, 0.0))
        chosen = rank == r
        total[int(r)] = (count + int(chosen.sum()), amount + float(content[chosen].sum()))


def _merged(batches):
    """The cells of batches in as few batches as there are kinds of cells."""
    kinds = {}
    for batch in batches:
        kinds.setdefault((batch.points.shape[1:], id(batch.shape), batch.dimension), []).append(batch)
    result = []
    for members in kinds.values():
        if len(members) == 1:
            result.append(members[0])
            continue
        points = np.concatenate([batch.points for batch in members])
        order = np.concatenate([batch.order for batch in members])
        result.append(Batch(points, order, members[0].dimension, members[0].shape))
    return result


def _in_bulk(batches, measured=False, cornered=False):
    """Computes what batches of few cells are asked for, for all of them at once."""
    missing = {}
    for batch in batches:
        done = batch._frames is not None and (batch._measures is not None or not measured)
        if not done or cornered and batch._keep is None:
            missing.setdefault((batch.points.shape[1:], batch.solid()), {})[id(batch)] = batch
    for members in missing.values():
        members = list(members.values())
        if len(members) == 1:
            continue
        whole = Batch(np.concatenate([batch.points for batch in members]), None, members[0].dimension)
        if not members[0].solid():
            whole.dimension = None
        rank, basis = whole.frames()
        contents = whole.measures() if measured else None
        keep = whole.corners() if cornered else None
        at = 0
        for batch in members:
            part = slice(at, at + len(batch.points))
            batch._frames = rank[part], basis[part]
            if measured and batch._measures is None:
                batch._measures = contents[part]
            if cornered:
                batch._keep = keep[part]
            at += len(batch.points)


def _shape_in_bulk(pieces, dimension):
    """The shapes of cells that have faces of a dimension, for all of them at once."""
    kinds = {}
    for piece in pieces:
        if piece.dimension > max(2, dimension) and piece._shapes is None:
            kinds.setdefault((piece.points.shape[1:], piece.dimension), []).append(piece)
    for (_, own), members in kinds.items():
        whole = Batch(np.concatenate([piece.points for piece in members]), None, own)
        owner = np.repeat(np.arange(len(members)), [len(piece.points) for piece in members])
        first = np.concatenate([[0], np.cumsum([len(piece.points) for piece in members])])
        for piece in members:
            piece._shapes = []
        for shape, chosen in whole.shapes():
            for number in np.unique(owner[chosen]):
                members[number]._shapes.append((shape, chosen[owner[chosen] == number] - first[number]))


def _corners(batch):
    """The batch, or pieces of it, without points that are no corners of their cell."""
    if batch.shape is not None or batch.points.shape[1] == 1:
        return [_with_simplices(batch)]
    rank, basis = batch.frames()
    keep = batch.corners()
    left = keep.sum(axis=1)
    pieces = []
    for count, r in sorted({(int(c), int(r)) for c, r in zip(*np.unique(np.stack([left, rank]), axis=1))}):
        chosen = np.flatnonzero((left == count) & (rank == r))
        points = batch.points[chosen][keep[chosen]].reshape(len(chosen), count, -1)
        if r == 2 and count > 3:
            points = _around(points, basis[chosen][:, :, :2])
        shape = _cells.simplex_shape(r) if count == r + 1 else None
        pieces.append(Batch(points, batch.order[chosen], r, shape))
    return pieces


def _around(points, basis):
    """Corners of plane cells, one after the other around the cell."""
    flat = np.einsum("mki,mir->mkr", points - points.mean(axis=1, keepdims=True), basis)
    turn = np.argsort(np.arctan2(flat[:, :, 1], flat[:, :, 0]), axis=1)
    return np.take_along_axis(points, turn[:, :, None], axis=1)


def _turned(batch):
    """Quadrilaterals of products with their corners one after the other around the cell, as programs expect
    it."""
    if batch.shape is None or batch.shape.dimension != 2 or batch.points.shape[1] != 4:
        return batch
    return Batch(batch.points[:, [2, 0, 1, 3]], batch.order, batch.dimension)


def _with_simplices(batch):
    if batch.shape is None and batch.points.shape[1] == 1:
        return Batch(batch.points, batch.order, 0, _cells.simplex_shape(0))
    return batch


def _images(function, points):
    values = [function(point) for point in points.tolist()]
    images = np.array(values, dtype=float)
    if images.ndim != 2:
        raise TypeError("MAP: the function has to give a list of coordinates for each point")
    return images


def _skeleton(node, dimension):
    result = []
    for batch in node.pieces:
        own = batch.dimension if batch.shape is None else batch.shape.dimension
        if own < dimension:
            continue
        if own == dimension:
            result.append((batch, np.zeros(len(batch.points), int)))
        elif batch.shape is None and own == 2:
            result.append(_polygon_faces(batch, dimension))
        elif batch.shape is not None:
            result.extend(_faces(batch, batch.shape, dimension))
        else:
            for shape, chosen in batch.shapes():
                result.extend(_faces(batch.selected(chosen), shape, dimension))
    if node.edges:  # of a Boolean: what is left of a face between two cuts that are all but one is none
        full = [_cells.frames(batch.points)[0] == dimension for batch, _ in result]
        result = [(batch.selected(f), number[f]) for (batch, number), f in zip(result, full)]
    # Faces come in the order of their cells, each cell's together.
    step = 1 + max([int(number.max()) for _, number in result if len(number)], default=0)
    pieces = [Batch(b.points, b.order * step + number, b.dimension, b.shape) for b, number in result]
    return leaf(pieces, node.space_dim)


def _faces(batch, shape, dimension):
    result, at = [], 0
    for faces in shape.boundary(dimension):
        count, corners = faces.shape
        points = batch.points[:, faces].reshape(-1, corners, batch.points.shape[2])
        known = corners == dimension + 1
        flat = batch.dimension is None
        shape_ = _cells.simplex_shape(dimension) if known else None
        piece = Batch(points, np.repeat(batch.order, count), None if flat else dimension, shape_)
        result.append((piece, np.tile(np.arange(at, at + count), len(batch.points))))
        at += count
    return result


def _polygon_faces(batch, dimension):
    """Edges or corners of plane cells whose corners go around."""
    count, corners, d = batch.points.shape
    if dimension == 0:
        points = batch.points.reshape(-1, 1, d)
    else:
        points = np.stack([batch.points, np.roll(batch.points, -1, axis=1)], axis=2).reshape(-1, 2, d)
    piece = Batch(points, np.repeat(batch.order, corners), dimension, _cells.simplex_shape(dimension))
    return piece, np.tile(np.arange(corners), count)
