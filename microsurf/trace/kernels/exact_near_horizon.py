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


@inlined
def crossed(tile, column, row, share, z, t, across, down, wraps):
    """Slope from height ``z`` to a point of an edge, the distance ``t`` away.

    The edge begins at vertex (column, row), at most NEAR cells out of the period if it
    ``wraps``, and goes on by (across, down); ``share`` of it lies before the point.
    """
    if wraps:
        column, row = around(column, tile.columns), around(row, tile.rows)
    # Unsigned numbers: an index that may be negative would be tested at each look.
    i, j = np.uint64(column), np.uint64(row)
    begin, end = tile.heights[j, i], tile.heights[j + down, i + across]
    return ((1 - share) * begin + share * end - z) / t


@inlined
def near_horizon(tile, x, y, z, cx, cy, side, dx, dy, per_x, per_y, counts, wraps):
    """Greatest slope to the edges that a ray crosses first, at least 0, see `first_blocked`.

    No cell may be flipped. ``counts`` are those of columns' sides and rows' sides to look at,
    and the distance up to which diagonals are; with ``wraps`` they may lie out of the period.
    """
    zero, one = np.uint64(0), np.uint64(1)
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
    steepest = 0.0
    for k in range(many_x):
        column = i + k * step_x
        t = (column - x) * per_x
        along = y + t * dy
        row = int(np.floor(along)) if wraps else int(along)
        slope = crossed(tile, column, row, along - row, z, t, zero, one, wraps)
        steepest = max(steepest, slope if t > border else 0.0)
    for k in range(many_y):
        row = j + k * step_y
        t = (row - y) * per_y
        along = x + t * dx
        column = int(np.floor(along)) if wraps else int(along)
        slope = crossed(tile, column, row, along - column, z, t, one, zero, wraps)
        steepest = max(steepest, slope if t > border else 0.0)
    for k in range(many_u):
        difference = m + k * step_u
        t = (difference - u) * per_u
        along = x + t * dx
        column = int(np.floor(along)) if wraps else int(along)
        slope = crossed(tile, column, column - difference, along - column, z, t, one, one, wraps)
        steepest = max(steepest, slope if t > border else 0.0)
    return steepest
