"""Take tilt and form out of a measured surface."""

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..scene import LEVELS
from .heightfield import Heightfield

Array = NDArray[np.float64]


def level(h: Heightfield, form: str) -> Heightfield:
    """Subtract the least-squares polynomial in x and y from the heights.

    ``"none"`` leaves the surface as it is, ``"plane"`` takes out degree 1 (and the
    mean), ``"quadratic"`` degree 2. A levelled surface has no recipe.

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
    # Products of orthonormal polynomials are orthonormal on the grid, so the fit
    # is one projection, whatever the size.
    coefficients = in_y.T @ h.heights @ in_x
    i, j = np.ogrid[: in_y.shape[1], : in_x.shape[1]]
    coefficients[i + j > degree] = 0.0
    return Heightfield(h.heights - in_y @ coefficients @ in_x.T, h.spacing, h.boundary)


def _polynomials(count: int, degree: int) -> Array:
    """Orthonormal polynomials of degree 0 … ``degree`` on ``count`` points, as columns."""
    powers = np.vander(np.linspace(-1, 1, count), min(degree + 1, count), increasing=True)
    return np.asarray(np.linalg.qr(powers)[0])
