"""Pictures of complexes: a PNG file, or a page that a browser turns and zooms. Nothing but numpy is needed.
"""

import base64
import json
import os
import pathlib
import struct
import sys
import tempfile
import webbrowser
import zlib

import numpy as np

STONE = (0.78, 0.74, 0.66, 1.0)
WIDTH, HEIGHT = 1024, 768
_FOLDED = 4_000_000
"""Samples of triangles that are drawn at once."""


def show(pol, how, number):
    """Writes the picture of a VIEW, `view_N.png` in the folder the program runs in, or opens the browser."""
    if how == "browser":
        path = pathlib.Path(tempfile.mkdtemp(prefix="bsp2-view-"), f"view_{number}.html")
        path.write_text(page(pol))
        webbrowser.open(path.as_uri())
    else:
        path = pathlib.Path(f"view_{number}.png")
        path.write_bytes(png(picture(pol)))
    print(f"written {path}", file=sys.stderr)


def drawn(pol):
    """Triangles (t, 3, 3), lines (l, 2, 3) and points (p, 3) of a complex, and the colour of each (.., 4).

    Of more than three dimensions the first three coordinates are drawn.
    """
    kinds = {0: ([], []), 1: ([], []), 2: ([], [])}
    top = pol.point_dim()
    for part, wanted in [(pol, None)] if top <= 2 else [(pol, "lower"), (pol.skeleton(2), None)]:
        batches, props = part.cells()
        table = part.places()[0].table if batches else [()]
        colours = np.array([_colour(dict(entry)) for entry in table])
        from ._complex import _corners

        for batch, prop in zip(batches, props):
            batch.order = np.arange(len(batch.points))
            for piece in _corners(batch):
                own = piece.dimension if piece.shape is None else piece.shape.dimension
                if own > 2 or wanted == "lower" and own == 2:
                    continue
                points = np.zeros(piece.points.shape[:2] + (3,))
                points[:, :, : pol.space_dim] = piece.points[:, :, :3]
                if own == 2 and piece.shape is not None and points.shape[1] == 4:
                    points = points[:, [2, 0, 1, 3]]
                colour = colours[prop[piece.order]]
                if own == 2:
                    for i in range(1, points.shape[1] - 1):
                        kinds[2][0].append(points[:, [0, i, i + 1]])
                        kinds[2][1].append(colour)
                else:
                    kinds[own][0].append(points)
                    kinds[own][1].append(colour)
    result = []
    for dimension in (2, 1, 0):
        shapes, colours = kinds[dimension]
        empty = np.zeros((0, dimension + 1, 3)), np.zeros((0, 4))
        result.append((np.concatenate(shapes), np.concatenate(colours)) if shapes else empty)
    return result


def _colour(props):
    if "VRMLmaterial" in props:
        values = [float(value) for value in props["VRMLmaterial"].split()]
        return [min(1.0, a + d) for a, d in zip(values[:3], values[4:7])] + [values[7]]
    if "RGBcolor" in props:
        return [min(1.0, max(0.0, float(value))) for value in props["RGBcolor"].split()]
    return STONE


def picture(pol):
    """The picture as an array (height, width, 3) of bytes: from the front, a little from right and above."""
    (triangles, t_colours), (lines, l_colours), (points, p_colours) = drawn(pol)
    turn = _camera(pol.space_dim)
    corners = np.concatenate([x.reshape(-1, 3) for x in (triangles, lines, points)]) @ turn.T
    image = np.full((HEIGHT * WIDTH, 3), 255.0)
    if not len(corners):
        return image.reshape(HEIGHT, WIDTH, 3).astype(np.uint8)
    low, high = corners.min(axis=0), corners.max(axis=0)
    scale = 0.92 * min(WIDTH / max(high[0] - low[0], 1e-12), HEIGHT / max(high[1] - low[1], 1e-12))
    middle = (low + high) / 2
    depths = np.full(HEIGHT * WIDTH, np.inf)

    def seen(x):
        flat = (x @ turn.T - middle) * scale
        return flat * [1, -1, -1] + [WIDTH / 2, HEIGHT / 2, 0]

    flat = seen(triangles)
    edges = triangles[:, 1:] - triangles[:, :1]
    normals = np.cross(edges[:, 0], edges[:, 1])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    light = np.array([-0.3, -0.55, 0.78])
    shade = 0.35 + 0.65 * np.abs(normals @ light) if pol.space_dim > 2 else np.ones(len(triangles))
    _draw(flat, t_colours[:, :3] * shade[:, None], image, depths)
    _draw(seen(lines), l_colours[:, :3] * 0.6, image, depths)
    _draw(seen(points), p_colours[:, :3] * 0.6, image, depths)
    return np.clip(image, 0, 255).reshape(HEIGHT, WIDTH, 3).astype(np.uint8)


def _camera(dimension):
    """Rows: to the right, up, and out of the picture."""
    if dimension <= 2:
        return np.eye(3)
    a, b = np.radians(30), np.radians(22)
    right = np.array([np.cos(a), np.sin(a), 0])
    out = np.array([np.sin(a) * np.cos(b), -np.cos(a) * np.cos(b), np.sin(b)])
    return np.array([right, np.cross(out, right), out])


def _draw(flat, colours, image, depths):
    """Draws simplices (n, k, 3) in pixels, by samples no further apart than one."""
    if not len(flat):
        return
    corners = flat.shape[1]
    longest = np.zeros(len(flat))
    for i in range(corners):
        longest = np.maximum(longest, np.linalg.norm(flat[:, i, :2] - flat[:, i - 1, :2], axis=1))
    steps = 2 ** np.ceil(np.log2(np.maximum(longest * 1.1, 1))).astype(int)
    for n in np.unique(steps):
        chosen = np.flatnonzero(steps == n)
        weights = _weights(corners, int(n))
        size = max(1, _FOLDED // len(weights))
        for at in range(0, len(chosen), size):
            part = chosen[at : at + size]
            samples = np.einsum("sk,nki->nsi", weights, flat[part]).reshape(-1, 3)
            owner = np.repeat(part, len(weights))
            x, y = np.floor(samples[:, :2].T).astype(int)
            inside = (x >= 0) & (x < WIDTH) & (y >= 0) & (y < HEIGHT)
            pixel, depth, owner = (y * WIDTH + x)[inside], samples[inside, 2], owner[inside]
            if corners < 3:
                depth = depth - 0.75  # an edge of a face is seen before the face
            np.minimum.at(depths, pixel, depth)
            front = depth <= depths[pixel]
            image[pixel[front]] = 255 * colours[owner[front]]


def _weights(corners, n):
    if corners == 1:
        return np.ones((1, 1))
    a = np.arange(n + 1) / n
    if corners == 2:
        return np.stack([1 - a, a], axis=1)
    u, v = np.meshgrid(a, a)
    u, v = u[u + v <= 1 + 1e-9], v[u + v <= 1 + 1e-9]
    return np.stack([1 - u - v, u, v], axis=1)


def png(image):
    """The bytes of a PNG file of an array (height, width, 3) of bytes."""
    height, width, _ = image.shape

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    rows = np.concatenate([np.zeros((height, 1), np.uint8), image.reshape(height, -1)], axis=1)
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    data = zlib.compress(rows.tobytes(), 6)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def page(pol):
    """A page that draws a complex with WebGL; dragging turns it, the wheel zooms."""
    kinds = drawn(pol)
    box = pol.box() or (np.zeros(3), np.ones(3))
    low, high = (np.pad(np.asarray(x, float)[:3], (0, max(0, 3 - len(x)))) for x in box)
    size = float(np.linalg.norm(high - low)) or 1.0
    arrays = []
    for shapes, colours in kinds:
        corners = shapes.shape[1] if len(shapes) else 1
        points = (shapes.reshape(-1, 3) - (low + high) / 2) / size
        if shapes.shape[1] == 3:
            edges = shapes[:, 1:] - shapes[:, :1]
            normals = np.cross(edges[:, 0], edges[:, 1])
            normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
        else:
            normals = np.zeros((len(shapes), 3))
        rows = [points, np.repeat(normals, corners, axis=0), np.repeat(colours[:, :3], corners, axis=0)]
        data = np.concatenate(rows, axis=1).astype("<f4")
        arrays.append(base64.b64encode(data.tobytes()).decode())
    script = pathlib.Path(__file__).with_name("_view.js").read_text()
    title = os.path.basename(sys.argv[0]) or "bsp2"
    return (
        "<!doctype html><meta charset='utf-8'><title>" + title + "</title>"
        "<style>html,body,canvas{margin:0;width:100%;height:100%;display:block;background:#fff}</style>"
        "<canvas></canvas><script>const ARRAYS=" + json.dumps(arrays) + ";\n" + script + "</script>"
    )
