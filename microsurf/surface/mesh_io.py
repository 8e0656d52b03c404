"""Heightfields as triangle meshes: .ply and .obj in double precision, .stl in single.

A periodic surface is written with its first row and column repeated at the end,
(rows+1) × (columns+1) vertices, so that it closes its period. Writing .ply and
.obj is done here because trimesh stores vertices in single precision or with
eight decimals, which turns nanometres in metres into zeros; reading is trimesh's.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..scene import MAX_CELLS
from .declared import Declared
from .heightfield import Heightfield

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

ENDINGS = (".ply", ".obj", ".stl")
_COLUMN_WIDTH = 1e-6  # of the extent: closer x are one column; 60 times less than 1/16384
_ON_GRID = 0.01  # of the spacing; single precision at 16384 columns rounds to 1e-3

_PLY_HEADER = """ply
format binary_little_endian 1.0
comment microsurf heightfield
element vertex {vertices}
property double x
property double y
property double z
element face {faces}
property list uchar int vertex_indices
end_header
"""


def triangles(h: Heightfield) -> tuple[Array, Indices]:
    """Vertices (in the user's unit, row by row) and faces, counter-clockwise from above.

    All lower triangles come first, then all upper ones, each row by row.
    """
    heights = h.heights
    if h.boundary == "periodic":
        heights = np.pad(heights, ((0, 1), (0, 1)), mode="wrap")
    rows, columns = heights.shape
    y, x = np.indices((rows, columns))
    dx, dy = h.pixel
    vertices = np.stack([x * dx, y * dy, heights], axis=-1).reshape(-1, 3)
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    opposite = corner + columns + 1
    lower = np.stack([corner, corner + 1, opposite], axis=-1)
    upper = np.stack([corner, opposite, corner + columns], axis=-1)
    return vertices, np.concatenate([lower, upper])


def write(h: Heightfield, path: Path) -> None:
    """Write the surface's triangles in the format of the path's ending."""
    vertices, faces = triangles(h)
    ending = path.suffix.lower()
    if ending == ".stl":
        path.write_bytes(_stl(vertices, faces))
        return
    with path.open("wb") as stream:
        if ending == ".ply":
            header = _PLY_HEADER.format(vertices=len(vertices), faces=len(faces))
            stream.write(header.encode("ascii"))
            stream.write(vertices.astype("<f8").tobytes())  # tofile can miss a full disk
            packed = np.zeros(len(faces), dtype=[("count", "u1"), ("index", "<i4", (3,))])
            packed["count"] = 3
            packed["index"] = faces
            stream.write(packed.tobytes())
        else:
            np.savetxt(stream, vertices, fmt="v %.17g %.17g %.17g")
            np.savetxt(stream, faces + 1, fmt="f %d %d %d")


def _stl(vertices: Array, faces: Indices) -> bytes:
    from trimesh import Trimesh  # noqa: PLC0415 - late: 0.1 s that only meshes need
    from trimesh.exchange.stl import export_stl  # noqa: PLC0415 - late, as above

    # process=False: merging vertices would reorder them.
    return bytes(export_stl(Trimesh(vertices, faces, process=False, validate=False)))


def read(path: Path, declared: Declared) -> Heightfield:
    """Read a triangle mesh that is a heightfield on a rectangular grid with our diagonals.

    Raises
    ------
    InputError
        If the file can't be read, or is any other mesh; see `read_surface`.

    """
    from trimesh import load_mesh  # noqa: PLC0415 - late: 0.1 s that only meshes need

    try:
        # A file object and no resolver: a mesh must not make us open other files.
        with path.open("rb") as stream:
            loaded = load_mesh(
                stream,
                file_type=path.suffix.lower()[1:],
                process=False,
                skip_materials=True,
            )
        vertices = np.array(loaded.vertices, dtype=np.float64).reshape(-1, 3)
        faces = np.array(loaded.faces, dtype=np.int64).reshape(-1, 3)
    except Exception as error:  # trimesh raises whatever the bytes provoke
        raise InputError("not a triangle mesh, or truncated; write it again") from error
    if len(faces) == 0 or faces.min() < 0 or faces.max() >= len(vertices):
        raise InputError("a mesh without valid triangles; write it again")
    bad = int(np.count_nonzero(~np.isfinite(vertices)))
    if bad:
        raise InputError(f"{bad} coordinates are NaN or infinite; must be finite")
    x, columns, spacing = _grid_axis(vertices[:, 0], "x")
    y, rows, spacing_y = _grid_axis(vertices[:, 1], "y")
    # Each is an extent over its cells: a square pixel's two differ by rounding alone.
    square = abs(spacing_y - spacing) <= _ON_GRID * spacing / max(rows, columns)
    heights = _grid_heights(y * columns + x, vertices[:, 2], rows, columns)
    _check_faces(x[faces], y[faces], rows, columns)
    boundary = declared.boundary
    closes = min(rows, columns) > 2 and bool(
        np.array_equal(heights[0], heights[-1]) and np.array_equal(heights[:, 0], heights[:, -1])
    )
    if boundary == "periodic" and not closes:
        raise InputError(
            "boundary = 'periodic': its last row and column do not repeat the first; take 'mirror'"
        )
    if boundary is None:
        boundary = "periodic" if closes else "mirror"
    return Heightfield(
        heights[:-1, :-1] if boundary == "periodic" else heights,
        spacing if square else (spacing, spacing_y),
        boundary,
    )


def _grid_axis(values: Array, name: str) -> tuple[Indices, int, float]:
    """Return the indices of coordinates on a regular grid, their number and spacing."""
    ordered = np.unique(values)
    extent = float(ordered[-1] - ordered[0])
    count = 1 + int(np.count_nonzero(np.diff(ordered) > _COLUMN_WIDTH * extent))
    if not 2 <= count <= MAX_CELLS + 1:
        raise InputError(f"{count} different {name}: a heightfield has 2 … {MAX_CELLS} a side")
    spacing = extent / (count - 1)
    position = (values - ordered[0]) / spacing
    index = np.rint(position)
    if float(np.abs(position - index).max()) > _ON_GRID:
        raise InputError(f"{name} are not equally spaced; must be a heightfield on a regular grid")
    return index.astype(np.int64), count, spacing


def _grid_heights(index: Indices, z: Array, rows: int, columns: int) -> Array:
    # Compared before the grid is allocated: scattered points make it as large as they like.
    full = rows * columns <= len(index)
    if full:
        heights = np.full(rows * columns, np.nan)
        heights[index] = z
        full = not np.isnan(heights).any()
    if not full:
        raise InputError(f"a grid of {rows} × {columns} points with gaps; must have none")
    # An .stl has each vertex up to six times.
    if not np.array_equal(heights[index], z):
        raise InputError("several heights at one point; must be a heightfield, without overhangs")
    return heights.reshape(rows, columns)


def _check_faces(x: Indices, y: Indices, rows: int, columns: int) -> None:
    """Refuse triangles other than ours, given the grid indices (faces, 3) of their vertices."""
    left, top = x.min(axis=1), y.min(axis=1)
    # Corners 0 (x, y), 1 (x+1, y), 2 (x, y+1), 3 (x+1, y+1) of the cell.
    small = (x.max(axis=1) - left == 1) & (y.max(axis=1) - top == 1)
    corners = np.sort(x - left[:, None] + 2 * (y - top[:, None]), axis=1)
    lower = (corners == [0, 1, 3]).all(axis=1)
    upper = (corners == [0, 2, 3]).all(axis=1)
    other = int(np.count_nonzero(~(small & (lower | upper))))
    if other:
        raise InputError(
            f"{other} of {len(x)} triangles do not split cells from (x, y) to (x+1, y+1); "
            "save the heights as .npy"
        )
    uses = np.bincount(
        2 * (top * (columns - 1) + left) + upper, minlength=2 * (rows - 1) * (columns - 1)
    )
    if not (uses == 1).all():
        raise InputError(
            f"{int(np.count_nonzero(uses != 1))} triangles of the grid are missing or double; "
            "each must be there once"
        )
