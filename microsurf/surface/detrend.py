"""Take tilt and form out of a measured surface, by its measured points alone."""

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..scene import LEVELS
from .heightfield import Heightfield

Array = NDArray[np.float64]


def level(h: Heightfield, form: str) -> Heightfield:
    """Subtract the least-squares polynomial in x and y from the heights.

    ``"none"`` leaves the surface as it is, ``"plane"`` takes out degree 1 (and the
    mean), ``"quadratic"`` degree 2. Filled points have no say. A levelled surface has
    no recipe.

    Raises
    ------
    InputError
        If ``form`` is none of these.

    """
    if form not in LEVELS:
        raise InputError(f"level = {form!r}: must be one of {', '.join(LEVELS)}")
    degree = LEVELS.index(form)
    if degree == 0:
        return h
    rows, columns = h.heights.shape
    in_y, in_x = _polynomials(rows, degree), _polynomials(columns, degree)
    coefficients = np.zeros((in_y.shape[1], in_x.shape[1]))
    i, j = np.nonzero(np.add.outer(np.arange(in_y.shape[1]), np.arange(in_x.shape[1])) <= degree)
    if h.filled is None:
        # Products of orthonormal polynomials are orthonormal on the grid, so the fit
        # is one projection, whatever the size.
        coefficients[i, j] = (in_y.T @ h.heights @ in_x)[i, j]
    else:
        weight = (~h.filled).astype(np.float64)
        # ⟨product m, product n⟩ over the measured points, for each pair of products.
        pairs_y = in_y[:, i, None] * in_y[:, None, i]
        pairs_x = in_x[:, j, None] * in_x[:, None, j]
        gram = np.einsum("ymn,yx,xmn->mn", pairs_y, weight, pairs_x, optimize=True)
        projected = (in_y.T @ (weight * h.heights) @ in_x)[i, j]
        coefficients[i, j] = np.linalg.lstsq(gram, projected)[0]
    return Heightfield(
        h.heights - in_y @ coefficients @ in_x.T,
        h.spacing,
        h.boundary,
        filled=h.filled,
        provenance={**h.provenance, "level": form},
    )


def _polynomials(count: int, degree: int) -> Array:
    """Orthonormal polynomials of degree 0 … ``degree`` on ``count`` points, as columns."""
    powers = np.vander(np.linspace(-1, 1, count), min(degree + 1, count), increasing=True)
    return np.asarray(np.linalg.qr(powers)[0])
