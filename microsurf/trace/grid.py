"""The triangulated tile that rays meet: periodic heights in cell units, with a margin.

The tile is centred, so that float32 coordinates are as fine as they can be, and
its triangles go on one cell beyond each edge: a ray that leaves is continued from
inside the mesh on the other side, and nowhere does light depend on two edges that
round alike.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

MARGIN = 1
MAX_RELIEF = 1e6  # cells: float32 then resolves a sixteenth of one
LEVEL_STEP = 2
_FINEST = 5  # blocks of 2^5 cells, then of 2^(5 + LEVEL_STEP), …


class Grid(NamedTuple):
    """Vertices of the tile with its margin, as they are given to Embree and to compiled code.

    Attributes
    ----------
    heights : ndarray of float32, shape (rows + 2 MARGIN + 1, columns + 2 MARGIN + 1)
        Heights of all vertices in cells.
    flipped : ndarray of bool, shape (rows + 2 MARGIN, columns + 2 MARGIN)
        Cells split by the other diagonal.
    rows, columns : int
        Cells of the period.
    bottom, top : float
        Lowest and greatest height.
    tops : ndarray of float32
        Greatest heights over blocks of 32² cells of the period, then of 128²
        and so on, one level after the other, row by row: by these rays are carried
        through empty space.
    levels : ndarray of int64, shape (levels, 4)
        Of each level: the power of two that is a block's side in cells, its first
        entry in ``tops``, its blocks along x and y.
    aspect : float
        Width of a cell over its depth: a direction (dx, dy, dz) is (dx, aspect · dy, dz)
        in cells, a slope ∂z/∂y there is aspect times as large outside.

    """

    heights: NDArray[np.float32]
    flipped: NDArray[np.bool_]
    rows: int
    columns: int
    bottom: float
    top: float
    tops: NDArray[np.float32]
    levels: NDArray[np.int64]
    aspect: float = 1.0

    @property
    def x0(self) -> float:
        """x of the first column of vertices, margin included."""
        return float(-(self.columns // 2) - MARGIN)

    @property
    def y0(self) -> float:
        """y of the first row of vertices, margin included."""
        return float(-(self.rows // 2) - MARGIN)

    @property
    def reach(self) -> float:
        """Largest absolute coordinate, the scale of float32 rounding."""
        return max(-self.x0, -self.y0, abs(self.bottom), abs(self.top))


def from_heights(
    heights: NDArray[np.float64], flipped: NDArray[np.bool_], aspect: float = 1.0
) -> Grid:
    """Add the margin to one period of heights in cells, see `surface.mesh`.

    Raises InputError if the relief is beyond MAX_RELIEF.
    """
    rows, columns = heights.shape
    relief = float(heights.max() - heights.min())
    if relief > MAX_RELIEF:
        raise InputError(
            f"surface: a relief of {relief:.3g} cells; must be ≤ {MAX_RELIEF:.0e}, beyond which "
            "float32 rays can't tell cells apart. Check the spacing, or take a larger gamma"
        )
    j = np.arange(-MARGIN, rows + MARGIN + 1) % rows
    i = np.arange(-MARGIN, columns + MARGIN + 1) % columns
    vertices = np.ascontiguousarray(heights.astype(np.float32)[np.ix_(j, i)])
    tops, levels = _pyramid(vertices[MARGIN:-MARGIN, MARGIN:-MARGIN])
    return Grid(
        heights=vertices,
        flipped=np.ascontiguousarray(flipped[np.ix_(j[:-1], i[:-1])]),
        rows=rows,
        columns=columns,
        bottom=float(vertices.min()),
        top=float(vertices.max()),
        tops=tops,
        levels=levels,
        aspect=aspect,
    )


def _pyramid(period: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Greatest heights over ever larger blocks; ``period`` has a vertex more than cells a side."""
    cells = np.maximum(period[:-1], period[1:])
    cells = np.maximum(cells[:, :-1], cells[:, 1:])
    tops, levels, power, start = [], [], _FINEST, 0
    while True:
        y, x = (np.arange(0, count, 2**power) for count in cells.shape)
        blocks = np.maximum.reduceat(np.maximum.reduceat(cells, y, axis=0), x, axis=1)
        tops.append(blocks.ravel())
        levels.append((power, start, len(x), len(y)))
        start += blocks.size
        if blocks.size == 1:
            return np.concatenate(tops), np.array(levels)
        power += LEVEL_STEP


def triangles(grid: Grid) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Vertices (k, 3) and indices (2 cells, 3); triangle 2c + s is side s of cell c.

    Side 0 holds the corner (x+1, y), side 1 the corner (x, y+1) of an ordinary cell;
    in a flipped one side 0 holds (x, y) and side 1 (x+1, y+1).
    """
    height, width = grid.heights.shape
    vertices = np.zeros((height * width, 3), dtype=np.float32)
    vertices[:, 0] = np.tile(grid.x0 + np.arange(width), height)
    vertices[:, 1] = np.repeat(grid.y0 + np.arange(height), width)
    vertices[:, 2] = grid.heights.ravel()
    index = np.arange(height * width, dtype=np.int32).reshape(height, width)
    h00, h10 = index[:-1, :-1], index[:-1, 1:]
    h01, h11 = index[1:, :-1], index[1:, 1:]
    flip = grid.flipped
    faces = np.zeros((height - 1, width - 1, 2, 3), dtype=np.int32)
    faces[..., 0, 0], faces[..., 0, 1] = h00, h10
    faces[..., 0, 2] = np.where(flip, h01, h11)
    faces[..., 1, 0] = np.where(flip, h10, h00)
    faces[..., 1, 1], faces[..., 1, 2] = h11, h01
    return vertices, faces.reshape(-1, 3)


def points_on(
    grid: Grid, triangle: NDArray[np.int32], u: NDArray[np.float32], v: NDArray[np.float32]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points of triangles by the weights u, v of their second and third corners, shape (…, 3).

    In cells and in float64; and the unit normals upwards, not in cells.
    """
    a, b, c = _corners(grid, triangle)
    ab, ac = b - a, c - a
    normal = np.cross(ab, ac) * [1.0, grid.aspect, 1.0]
    normal /= np.sqrt((normal**2).sum(1, keepdims=True))
    return a + u[:, None].astype(float) * ab + v[:, None].astype(float) * ac, normal


def _corners(grid: Grid, triangle: NDArray[np.int32]) -> tuple[NDArray[np.float64], ...]:
    """Corners of triangles in the order of `grid.triangles`, counterclockwise from above."""
    width = grid.flipped.shape[1]
    cell, side = np.divmod(triangle.astype(np.int64), 2)
    y, x = np.divmod(cell, width)
    flipped = grid.flipped[y, x]
    # Steps from the cell's corner: side 0 of an ordinary cell is (0, 0), (1, 0), (1, 1).
    steps = np.array(
        [
            [[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]],
            [[(0, 0), (1, 0), (0, 1)], [(1, 0), (1, 1), (0, 1)]],
        ]
    )[flipped.astype(int), side]
    at_x, at_y = x[:, None] + steps[..., 0], y[:, None] + steps[..., 1]
    z = grid.heights[at_y, at_x].astype(float)
    corners = np.stack([grid.x0 + at_x, grid.y0 + at_y, z], axis=-1)
    return corners[:, 0], corners[:, 1], corners[:, 2]
