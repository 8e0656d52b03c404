"""Surfaces of the same slopes whose steep facets lie in different places.

With g a standard Gaussian field, h = F(g) has the slope F′(g)∇g. At a point ∇g does not
depend on g and |∇g|² is exponential, so with

    F′(g)² = (γ−1)/Q(u),  Q the quantile of the Gamma distribution of shape γ−1,

and u a function of g that is uniform on 0 … 1, the slopes are STD: a Gamma mixture of
Beckmann distributions (d'Eon 2023). The steepest lie where u is near 0:

    tops      u = 1 − Φ(g)
    middle    u = P(|g′| < |g|)
    extremes  u = P(|g′| > |g|)

At γ = ∞ F′ = 1 whatever u. In the middle F′ diverges as |g|^(−1/(2γ−2)), which F does not
for γ > 3/2. All this holds for points; facets average over their neighbourhood, and
`synthesis` gives them the slopes wanted.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import special
from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]

_STEPS = 16384  # of the table of F: differences of F exact to 1e−8 (γ = 1.5, far tail), 1e−11
_SMALLEST = 1e-18  # |g| below are rounding of 0


def impose(field: Array, gamma: float, structure: str) -> Array:
    """Return the heights F(g) of a Gaussian field, given in any unit: zero mean, any scale.

    Parameters
    ----------
    field : ndarray, shape (rows, columns)
        Gaussian and not constant; g is it less its mean, over its standard deviation.
    gamma : float
        Shape of STD, > 3/2; ∞ for Beckmann.
    structure : str
        One of `scene.STRUCTURES`; ``"independent"`` returns the field.

    """
    if structure == "independent" or np.isinf(gamma):
        return field
    g = (field - field.mean()) / field.std()
    if structure == "tops":
        x = np.linspace(g.min(), g.max(), _STEPS + 1)
        heights = _primitive(x, _steepness(special.ndtr(-x), special.ndtr(x), gamma), g)
    else:
        # In ln|g|, where dF is smooth up to the crossing of g = 0.
        size = np.maximum(np.abs(g), _SMALLEST)
        x = np.linspace(np.log(_SMALLEST), np.log(size.max()), _STEPS + 1)
        r = np.exp(x)
        below, above = special.erf(r / np.sqrt(2)), special.erfc(r / np.sqrt(2))
        if structure == "middle":
            steepness, power = _steepness(below, above, gamma), 1 - 0.5 / (gamma - 1)
        else:
            steepness, power = _steepness(above, below, gamma), 1.0
        # Below the table's start F is the power of |g| that it is near 0.
        start = steepness[0] * r[0] / power
        heights = np.sign(g) * (start + _primitive(x, steepness * r, np.log(size)))
    return np.asarray(heights - heights.mean())


def _steepness(u: Array, rest: Array, gamma: float) -> Array:
    """F′ = √((γ−1)/Q(u)), given also 1 − u in full precision."""
    shape = gamma - 1
    # Each form where its argument is the smaller one: digits of 1 − u are lost near 1.
    quantile = np.where(u < 0.5, special.gammaincinv(shape, u), special.gammainccinv(shape, rest))
    return np.asarray(np.sqrt(shape / quantile))


def _primitive(x: Array, derivative: Array, at: Array) -> Array:
    """Integral from x[0] to ``at`` of a derivative known at evenly spaced x."""
    return np.asarray(CubicSpline(x, derivative).antiderivative()(at))
