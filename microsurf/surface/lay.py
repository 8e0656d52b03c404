"""Axes of a lay without the lean of facets towards the grid.

The slope of a facet is a difference over one cell, and smaller than the surface's: along x by
the part k_x²/24 at a wavenumber of k_x per cell; the product of both slopes of a facet by more
than their squares. So the axes of facets lean towards x and y: by 0.23° at 17° for a lay of 6 × 12
cells. From slopes in the middle of cells whose errors are of fourth order they do not.
"""

import numpy as np
from numpy.typing import NDArray

from .heightfield import Heightfield
from .slope_likelihood import Maximum, moved

Array = NDArray[np.float64]


def lean(h: Heightfield, p: Array, q: Array, result: Maximum, information: Array) -> Array:
    """Change of (η, m, d, e) from the surface's slopes to those of its facets.

    Parameters
    ----------
    h : Heightfield
    p, q : ndarray, shape (splits, rows, columns)
        Slopes of its facets.
    result : Maximum
        Their fit.
    information : ndarray, shape (4, 4)
        Of one facet.

    Returns
    -------
    ndarray, shape (4,)
        Zero if no cell is measured with all cells around it.

    """
    heights = h.heights if h.filled is None else np.where(h.filled, np.nan, h.heights)
    if h.boundary == "periodic":
        heights = np.pad(heights, ((1, 2), (1, 2)), mode="wrap")
    else:
        p, q = p[:, 1:-1, 1:-1], q[:, 1:-1, 1:-1]
    dx, dy = h.pixel
    slopes = np.stack([_in_cells(heights) / dx, _in_cells(heights.T).T / dy])
    good = np.isfinite(slopes).all(axis=0)
    if not good.any():
        return np.zeros(4)
    facets = np.stack([p[:, good], q[:, good]])
    return -moved(facets, slopes[:, good], result, information)


def _in_cells(heights: Array) -> Array:
    """Difference along x in the middle of each cell but the outer ones, of fourth order.

    The mean over both rows of a cell is smaller than the slope by k_x²/24 + k_y²/8, which second
    differences give back.
    """
    difference = np.diff(heights, axis=1)
    mean = (difference[:-1] + difference[1:]) / 2
    inner = mean[1:-1, 1:-1]
    along = mean[1:-1, 2:] - 2 * inner + mean[1:-1, :-2]
    across = mean[2:, 1:-1] - 2 * inner + mean[:-2, 1:-1]
    return np.asarray(inner - along / 24 - across / 8)
