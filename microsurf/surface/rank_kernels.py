# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators
# ruff: noqa: ANN001, ANN201, ANN202 - numba finds the types
"""Rank the facets of a periodic grid by a histogram of ρ², and rescale their slopes.

ρ² = x² + y², with x and y the differences of the heights along an edge of the grid,
divided by the ratios of roughness. The edges that start at (i, j) are x[i, j] to
(i, j+1) and y[i, j] to (i+1, j); the lower facet of the cell has the slopes
(x[i, j], y[i, j+1]), the upper one (x[i+1, j], y[i, j]). Slopes are taken from the
heights whenever they are needed, which costs less than to keep them.

A bin is the leading bits of the double 1 + ρ²: bins of one width below ρ² = 1, and of
one relative width beyond. Within a bin ranks are interpolated.
"""

import numpy as np
from numpy.typing import NDArray

from ..jit import compiled, inlined

_BITS = 13  # 8192 bins an octave of 1 + ρ²: KS is then that of sorted facets to some percent
_SHIFT = 52 - _BITS
_ONE = 1023 << 52  # the bits of 1.0

INSIDE = 1 << _SHIFT
"""Positions within a bin, `scaled_divergence` counts in them."""


def lower_edges(bins: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the least ρ² of each bin."""
    return ((bins << _SHIFT) + _ONE).view(np.float64) - 1.0


def bins_up_to(square: float) -> int:
    """Return how many bins hold all ρ² ≤ ``square``."""
    return (int((1.0 + np.float64(square)).view(np.int64) - _ONE) >> _SHIFT) + 1


@inlined
def _place(square):
    """Bits of 1 + ρ² beyond those of 1: the bin, then the position within it."""
    return np.float64(1.0 + square).view(np.int64) - _ONE


@compiled
def fill_squares(heights, to_x, to_y, squares):
    """Write ρ² of the lower (0) and upper (1) facets, shape (2, rows, columns).

    ``to_x`` and ``to_y`` are the inverse ratios of roughness, here and below.
    """
    rows, columns = heights.shape
    for i in range(rows):
        here, next_row = heights[i], heights[i + 1 if i + 1 < rows else 0]
        y = (next_row[0] - here[0]) * to_y
        for j in range(columns):
            k = j + 1 if j + 1 < columns else 0
            y_right = (next_row[k] - here[k]) * to_y
            x, x_next = (here[k] - here[j]) * to_x, (next_row[k] - next_row[j]) * to_x
            squares[0, i, j] = x * x + y_right * y_right
            squares[1, i, j] = x_next * x_next + y * y
            y = y_right


@compiled
def count_facets(heights, to_x, to_y, counts):
    """Add each facet to its bin of ``counts``, which must reach as far as `bins_up_to`."""
    rows, columns = heights.shape
    for i in range(rows):
        here, next_row = heights[i], heights[i + 1 if i + 1 < rows else 0]
        y = (next_row[0] - here[0]) * to_y
        for j in range(columns):
            k = j + 1 if j + 1 < columns else 0
            y_right = (next_row[k] - here[k]) * to_y
            x, x_next = (here[k] - here[j]) * to_x, (next_row[k] - next_row[j]) * to_x
            counts[_place(x * x + y_right * y_right) >> _SHIFT] += 1
            counts[_place(x_next * x_next + y * y) >> _SHIFT] += 1
            y = y_right


@inlined
def _factor(square, targets):
    """How much longer a slope of ρ² has to be; without slope it has no direction: 0."""
    if square == 0:
        return 0.0
    index = _place(square)
    k = index >> _SHIFT
    return np.sqrt((targets[k, 0] + targets[k, 1] * (index & (INSIDE - 1))) / square)


@compiled
def scaled_divergence(heights, to_x, to_y, targets, scratch, divergence):
    """Write the divergence, over the ratios, of the slopes that the facets should have.

    Each edge takes the mean of its two facets. ``targets``, shape (bins, 2), holds the
    ρ² wanted at the start of each bin, and its rise for each of the `INSIDE` positions.
    ``scratch`` has the shape (2, columns).
    """
    rows, columns = heights.shape
    upper_above, edge_y_above = scratch[0], scratch[1]
    scratch[:] = 0.0
    half_x, half_y = 0.5 * to_x, 0.5 * to_y
    for i in range(-1, rows):  # the last row first: it lies above row 0
        here, next_row = heights[i], heights[i + 1 if i + 1 < rows else 0]
        # So with the last column.
        last = columns - 1
        x, y = (here[0] - here[last]) * to_x, (next_row[0] - here[0]) * to_y
        lower = _factor(x * x + y * y, targets)
        edge_x = x * (lower + upper_above[last])
        for j in range(columns):
            k = j + 1 if j + 1 < columns else 0
            y_right = (next_row[k] - here[k]) * to_y
            x, x_next = (here[k] - here[j]) * to_x, (next_row[k] - next_row[j]) * to_x
            edge_x_left, lower_left = edge_x, lower
            lower = _factor(x * x + y_right * y_right, targets)
            upper = _factor(x_next * x_next + y * y, targets)
            edge_x = x * (lower + upper_above[j])
            edge_y = y * (upper + lower_left)
            if i >= 0:
                rise = (edge_x_left - edge_x) * half_x
                divergence[i, j] = rise + (edge_y_above[j] - edge_y) * half_y
            upper_above[j], edge_y_above[j] = upper, edge_y
            y = y_right


@compiled
def divide_by_laplacian(spectrum, along_x, along_y):
    """Divide a half spectrum, its real and imaginary parts in turns, by along_x + along_y.

    The mean, where the sum is zero, becomes zero.
    """
    rows, columns = spectrum.shape
    for i in range(rows):
        for j in range(columns // 2):
            inverse = 1 / (along_x[j] + along_y[i])
            spectrum[i, 2 * j] *= inverse
            spectrum[i, 2 * j + 1] *= inverse
    spectrum[0, :2] = 0.0
