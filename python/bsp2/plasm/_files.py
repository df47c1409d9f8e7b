"""Files of complexes as they are: cells of all dimensions up to three, overlaps and all."""

import base64

import numpy as np

from ._complex import _corners, _merged, _turned

_TYPES = {0: 1, 1: 3, 2: 7}  # VTK's vertex, line, polygon
_TETRAHEDRON, _CONVEX_POINT_SET = 10, 41


def write_vtu(pol, path):
    """The cells of a complex as an unstructured grid, for ParaView: points, lines, polygons, hulls."""
    if pol.space_dim > 3:
        raise ValueError(
            f"a .vtu file has three coordinates, and the complex {pol.space_dim}: PROJECT it, or cut it"
        )
    points, cells, sizes, types, order = [], [], [], [], []
    count = 0
    for piece in (_turned(piece) for batch in _merged(pol.cells()[0]) for piece in _corners(batch)):
        cell_count, corners, _ = piece.points.shape
        own = piece.dimension if piece.dimension is not None else min(corners - 1, pol.space_dim)
        kind = _TYPES.get(own, _TETRAHEDRON if corners == 4 else _CONVEX_POINT_SET)
        points.append(np.pad(piece.points.reshape(-1, pol.space_dim), ((0, 0), (0, 3 - pol.space_dim))))
        cells.append(np.arange(count, count + cell_count * corners))
        sizes.append(np.full(cell_count, corners))
        types.append(np.full(cell_count, kind, np.uint8))
        order.append(piece.order)
        count += cell_count * corners
    cat = lambda parts, kind: np.concatenate(parts).astype(kind) if parts else np.zeros(0, kind)  # noqa: E731
    total = sum(len(s) for s in sizes)
    with open(path, "w") as file:
        file.write(
            '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian"'
        )
        file.write(
            ' header_type="UInt64">\n'
            f'<UnstructuredGrid><Piece NumberOfPoints="{count}" NumberOfCells="{total}">\n'
        )
        points = np.concatenate(points) if points else np.zeros((0, 3))
        file.write("<Points>" + _array("Points", "Float64", points.astype("<f8"), 3) + "</Points>\n<Cells>\n")
        file.write(_array("connectivity", "Int64", cat(cells, "<i8")))
        file.write(_array("offsets", "Int64", np.cumsum(cat(sizes, "<i8")).astype("<i8")))
        file.write(_array("types", "UInt8", cat(types, "u1")) + "</Cells>\n<CellData>")
        file.write(
            _array("order", "Int64", cat(order, "<i8"))
            + "</CellData>\n</Piece></UnstructuredGrid></VTKFile>\n"
        )


def _array(name, kind, values, components=1):
    data = values.tobytes()
    text = base64.b64encode(np.array([len(data)], "<u8").tobytes() + data).decode()
    what = f'Name="{name}" type="{kind}" NumberOfComponents="{components}" format="binary"'
    return f"<DataArray {what}>{text}</DataArray>\n"


def write_obj(pol, path):
    """Faces, lines and points of a complex."""
    points, cells = pol.skeleton(2).points_and_cells() if pol.point_dim() > 2 else pol.points_and_cells()
    points = np.pad(points[:, :3], ((0, 0), (0, max(0, 3 - points.shape[1]))))
    with open(path, "w") as file:
        file.writelines("v %r %r %r\n" % tuple(point) for point in points.tolist())
        for cell in cells:
            kind = "f" if len(cell) > 2 else "l" if len(cell) == 2 else "p"
            file.write(kind + " " + " ".join(str(index + 1) for index in cell) + "\n")
