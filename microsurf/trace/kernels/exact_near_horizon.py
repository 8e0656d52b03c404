"""The horizon of a facet's point in the cells around it, without deciding from cell to cell.

Edges of one kind (sides of columns, sides of rows, diagonals) lie along a ray in equal steps.
So their heights are taken one after the other whatever those before were, which keeps a
processor busy where a walk from cell to cell makes it guess which side comes next.
"""

import numpy as np

from ...jit import inlined
from .exact_walk import around

_PARALLEL = 1e-6  # cells: a ray that drifts less than that against diagonals crosses none

NEAR = 24
"""Cells along the longer coordinate that a march looks at as a whole before it goes on by cells."""


_COLUMNS, _ROWS, _DIAGONALS = range(3)
"""Kinds of edges: those on lines of whole x, of whole y, and of whole x − y."""


@inlined
def steepest_among(
    tile, kind, first, step, count, position, per_line, along, rate, z, border, wraps
):
    """Greatest slope from height ``z`` to the edges of one kind, at least 0.

    The ray crosses ``count`` lines from ``first`` on; (line − position) · per_line is the
    distance to one, and along + rate · distance the place on it. Edges up to the distance
    ``border`` do not count. Vertices lie at most NEAR cells out of the period if it ``wraps``.
    """
    across, down = np.uint64(kind != _COLUMNS), np.uint64(kind != _ROWS)
    steepest = 0.0
    for k in range(count):
        line = first + k * step
        t = (line - position) * per_line
        point = along + t * rate
        cell = int(np.floor(point)) if wraps else int(point)
        share = point - cell
        column = line if kind == _COLUMNS else cell
        row = cell if kind == _COLUMNS else (line if kind == _ROWS else cell - line)
        if wraps:
            column, row = around(column, tile.columns), around(row, tile.rows)
        # Unsigned numbers: an index that may be negative would be tested at each look.
        i, j = np.uint64(column), np.uint64(row)
        edge = (1 - share) * tile.heights[j, i] + share * tile.heights[j + down, i + across]
        steepest = max(steepest, (edge - z) / t if t > border else 0.0)
    return steepest


@inlined
def near_horizon(tile, x, y, z, cx, cy, side, dx, dy, per_x, per_y, counts, wraps):
    """Greatest slope to the edges that a ray crosses first, at least 0, see `first_blocked`.

    No cell may be flipped. ``counts`` are those of columns' sides and rows' sides to look at,
    and the distance up to which diagonals are; with ``wraps`` they may lie out of the period.
    """
    many_x, many_y, reach = counts
    ahead_x, ahead_y = int(dx > 0), int(dy > 0)
    step_x, step_y = 2 * ahead_x - 1, 2 * ahead_y - 1
    i, j = cx + ahead_x, cy + ahead_y
    # Diagonals are where x − y is a whole number; the facet's side says between which two it is.
    du, u = dx - dy, x - y
    ahead_u = int(du > 0)
    step_u = 2 * ahead_u - 1
    m = cx - cy + ahead_u - side
    many_u = 0
    per_u = 0.0
    if abs(du) * reach > _PARALLEL:
        per_u = 1 / du
        many_u = int(np.floor(step_u * (u + reach * du - m))) + 1
    border = min((i - x) * per_x, (j - y) * per_y)  # of the facet itself: it hides nothing
    if many_u > 0:
        border = min(border, (m - u) * per_u)
    return max(
        steepest_among(tile, _COLUMNS, i, step_x, many_x, x, per_x, y, dy, z, border, wraps),
        steepest_among(tile, _ROWS, j, step_y, many_y, y, per_y, x, dx, z, border, wraps),
        steepest_among(tile, _DIAGONALS, m, step_u, many_u, u, per_u, x, dx, z, border, wraps),
    )
