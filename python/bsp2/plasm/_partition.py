"""The edges of Booleans, as pyplasm has them: those of its own subdivision of space.

For drawings alone: SKELETON(1) of a Boolean, in the plane and in space, and nothing else asks this. It
shows the edges of the cells that the Boolean is made of, and which cells these are is the choice of
whoever computes it. Programs draw these edges, so they are those that pyplasm draws: space is halved
along its longest axis as long as that divides the faces of the operands, and then cut by their planes, in
doubles and with a tolerance. Solids, their cells and volumes are the kernel's, which has none.
"""

import numpy as np


_TOLERANCE = 1e-6
"""Of the size of all operands: what is thinner is not cut."""
_MOST_FACES, _MOST_CELLS = 1500, 20000


class _Faces:
    """Faces of the operands: their boxes and planes."""

    def __init__(self, low, high, plane):
        self.low, self.high, self.plane = low, high, plane

    def chosen(self, which):
        return _Faces(self.low[which], self.high[which], self.plane[which])

    def __len__(self):
        return len(self.plane)

    def cross(self, low, high):
        """Which planes have some of a box on either side."""
        normals, offsets = self.plane[:, :-1], self.plane[:, -1]
        least = (np.where(normals >= 0, low, high) * normals).sum(axis=1) - offsets
        most = (np.where(normals <= 0, low, high) * normals).sum(axis=1) - offsets
        return (least < 0) & (0 < most)


def edges(name, pols, dimension):
    """Segments (n, 2, dimension): the edges of the cells of a Boolean, each once; None: they are too many."""
    if dimension not in (2, 3):
        return None
    operands = [_hulls(pol, dimension) for pol in pols]
    points = [cell for operand in operands for cell, _ in operand]
    if not points or sum(len(f) for operand in operands for _, f in operand) > _MOST_FACES:
        return None
    low = np.min([p.min(axis=0) for p in points], axis=0)
    high = np.max([p.max(axis=0) for p in points], axis=0)
    middle, half = (low + high) / 2, (high - low) / 2
    operands = [[((cell - middle) / half, facets) for cell, facets in operand] for operand in operands]
    corners = [cell[list(facet)] for operand in operands for cell, facets in operand for facet in facets]
    solids = [_Solid(operand, dimension) for operand in operands]
    faces = _Faces(
        np.array([c.min(axis=0) for c in corners]),
        np.array([c.max(axis=0) for c in corners]),
        np.concatenate([plane for solid in solids for plane in solid.planes]),
    )
    state = _State(name, solids)
    world = _box(np.full(dimension, -1.01), np.full(dimension, 1.01))
    try:
        _halve(state, world, np.full(dimension, -1.01), np.full(dimension, 1.01), faces)
    except OverflowError:
        return None
    segments = [s for cell in state.kept for s in _segments(cell)]
    if not segments:
        return np.zeros((0, 2, dimension))
    return _each_once(np.array(segments) * half + middle)


class _Solid:
    """An operand: hulls by the planes of their facets."""

    def __init__(self, hulls, dimension):
        self.planes = [np.array([_plane(cell, facet) for facet in facets]) for cell, facets in hulls]
        self.low = np.array([cell.min(axis=0) for cell, _ in hulls]).reshape(-1, dimension) - 0.01
        self.high = np.array([cell.max(axis=0) for cell, _ in hulls]).reshape(-1, dimension) + 0.01

    def has(self, point):
        near = np.flatnonzero(((self.low <= point) & (point <= self.high)).all(axis=1))
        return any((self.planes[i][:, :-1] @ point <= self.planes[i][:, -1] + _TOLERANCE).all() for i in near)


class _State:
    def __init__(self, name, operands):
        self.name = name
        self.operands = operands
        self.kept = []
        self.count = 0

    def classify(self, cell):
        corners = np.concatenate(cell)
        centre = (corners.min(axis=0) + corners.max(axis=0)) / 2
        full = [operand.has(centre) for operand in self.operands]
        inside = {
            "union": any(full),
            "intersection": all(full),
            "difference": full[0] and not any(full[1:]),
            "symmetric_difference": sum(full) % 2 == 1,
        }[self.name]
        if inside:
            self.kept.append(cell)
        self.count += 1
        if self.count > _MOST_CELLS:
            raise OverflowError


def _hulls(pol, dimension):
    """Corners and facets of each solid cell, in order; facets as pyplasm lists them, the last one first."""
    from ._complex import _corners, _merged

    result = []
    if pol.space_dim < dimension:
        return result
    for piece in (piece for batch in _merged(pol.cells()[0]) for piece in _corners(batch)):
        if piece.dimension != dimension:
            continue
        if piece.shape is not None:
            shapes = [(piece.shape, np.arange(len(piece.points)))]
        else:
            shapes = piece.shapes()
        for shape, chosen in shapes:
            facets = shape.faces[dimension - 1][::-1]
            result += [(piece.order[i], piece.points[i], facets) for i in chosen]
    result.sort(key=lambda entry: entry[0])
    return [(points, facets) for _, points, facets in result]


def _plane(cell, facet):
    """The outward normal of a facet, and how far out it is."""
    corners = cell[list(facet)]
    normal = np.linalg.svd(corners - corners.mean(axis=0))[2][-1]
    if normal @ (cell.mean(axis=0) - corners[0]) > 0:
        normal = -normal
    return np.append(normal, normal @ corners[0])


def _box(low, high):
    """A cell: its faces, whose corners go around; in the plane its edges."""
    if len(low) == 2:
        a, b, c, d = (np.array([x, y]) for x, y in (low, (high[0], low[1]), high, (low[0], high[1])))
        return [np.array(pair) for pair in ((a, b), (b, c), (c, d), (d, a))]
    faces = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for end in (low, high):
            face = np.empty((4, 3))
            face[:, axis] = end[axis]
            face[:, u] = [low[u], high[u], high[u], low[u]]
            face[:, v] = [low[v], low[v], high[v], high[v]]
            faces.append(face)
    return faces


def _halve(state, cell, low, high, faces):
    if not len(faces):
        return _cut(state, cell, low, high, faces)
    axis = int(np.argmax(np.round(high - low, 6)))
    at = (low[axis] + high[axis]) / 2
    lower_high, upper_low = high.copy(), low.copy()
    lower_high[axis] = upper_low[axis] = at

    def of(some_low, some_high):
        there = (np.maximum(faces.low, low) <= some_high) & (np.minimum(faces.high, high) >= some_low)
        return faces.chosen(there.all(axis=1) & faces.cross(some_low, some_high))

    below, above = of(low, lower_high), of(upper_low, high)
    divides = len(below) < len(faces) and len(above) < len(faces) or not len(below) or not len(above)
    plane = np.zeros(len(low) + 1)
    plane[axis], plane[-1] = 1, at
    halves = _split(cell, plane) if divides else None
    if halves is None or None in halves:
        return _cut(state, cell, low, high, faces)
    _halve(state, halves[0], low, lower_high, below)
    _halve(state, halves[1], upper_low, high, above)


def _cut(state, cell, low, high, faces):
    waiting = [(cell, low, high, faces)]
    while waiting:
        cell, low, high, faces = waiting.pop()
        there = ((faces.low <= high) & (faces.high >= low)).all(axis=1) & faces.cross(low, high)
        for number in np.flatnonzero(there)[:1]:
            halves = _split(cell, faces.plane[number])
            for half in reversed([half for half in halves if half is not None]):
                corners = np.concatenate(half)
                rest = faces.chosen(slice(number + 1, None))
                waiting.append((half, corners.min(axis=0), corners.max(axis=0), rest))
        if not there.any():
            state.classify(cell)


def _split(cell, plane):
    """What a cell has below and above a plane; None for what has nothing there."""
    normal, offset = plane[:-1], plane[-1]
    heights = [face @ normal - offset for face in cell]
    least, most = min(h.min() for h in heights), max(h.max() for h in heights)
    if most <= _TOLERANCE:
        return cell, None
    if least >= -_TOLERANCE:
        return None, cell
    parts = []
    for sign in (1, -1):
        part, rim = [], []
        for face, h in zip(cell, heights):
            clipped = _clip(face, sign * h, rim)
            if len(clipped) >= len(normal):
                part.append(np.array(clipped))
        cap = _around(np.array(rim), normal)
        if len(cap) >= len(normal):
            part.append(cap)
        parts.append(part)
    return tuple(parts)


def _clip(face, heights, rim):
    """The part of a polygon, or a segment, below; points on the plane are added to `rim`."""
    result = []
    closed = len(face) > 2
    for i in range(len(face)):
        if abs(heights[i]) <= _TOLERANCE:
            rim.append(face[i])
        if heights[i] <= _TOLERANCE:
            result.append(face[i])
        j = (i + 1) % len(face)
        if (
            (closed or j)
            and min(heights[i], heights[j]) < -_TOLERANCE
            and max(heights[i], heights[j]) > _TOLERANCE
        ):
            t = heights[i] / (heights[i] - heights[j])
            result.append(face[i] + t * (face[j] - face[i]))
            rim.append(result[-1])
    if all(abs(h) <= _TOLERANCE for h in heights):
        return []  # it is the cap, or lies beside it
    if len(face) > 2 and len(result) < 3 or len(result) < 2:
        return []
    return result


def _around(points, normal):
    """Different points of a plane, one after the other around it."""
    different = []
    for point in points:
        if not any(np.abs(point - other).max() <= 2 * _TOLERANCE for other in different):
            different.append(point)
    if len(different) < 3:
        return np.array(different)
    points = np.array(different)
    u, v = np.linalg.svd(normal[None])[2][1:]
    flat = points - points.mean(axis=0)
    return points[np.argsort(np.arctan2(flat @ v, flat @ u))]


def _segments(cell):
    for face in cell:
        if len(face) == 2:
            yield face
        else:
            for i in range(len(face)):
                yield face[[i - 1, i]]


def _each_once(segments):
    """What segments cover, each part of a line once, divided where one of them ends."""
    size = np.ptp(segments.reshape(-1, segments.shape[2]), axis=0).max()
    lines = {}
    for a, b in segments:
        length = np.linalg.norm(b - a)
        if length <= 1e-7 * size:
            continue
        u = (b - a) / length
        first = u[np.flatnonzero(np.abs(u) > 1e-6)[0]]
        if first < 0:
            u = -u
        foot = a - (a @ u) * u
        key = tuple(np.round(np.concatenate([u, foot / size]), 5) + 0.0)
        lines.setdefault(key, (u, foot, []))[2].append(sorted((a @ u, b @ u)))
    result = []
    for u, foot, spans in lines.values():
        ends = sorted(end for span in spans for end in span)
        ends = [end for i, end in enumerate(ends) if i == 0 or end - ends[i - 1] > 1e-6 * size]
        for low, high in zip(ends[:-1], ends[1:]):
            centre = (low + high) / 2
            if any(span[0] < centre < span[1] for span in spans):
                result.append([foot + low * u, foot + high * u])
    return np.array(result).reshape(-1, 2, segments.shape[2])
