"""Quantiles of the normal distribution, Student's t and χ², and Welch's degrees of freedom.

The only place of the package where they are computed, so that an interval has one level and
one rule: Student's t (1908) over independent values, the normal distribution where the
spread of one value is known. Degrees of freedom of a sum of estimated variances are those
of Satterthwaite (1946); of two means they are Welch's (1947).

The functions are those that `scipy.stats` calls, with the same bits, here and in all the package:
loading `scipy.stats` itself would take a tenth of the time of a short command.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from ..errors import float_array, require

Array = NDArray[np.float64]

CONFIDENCE = 0.95
"""Level of every interval that names none."""


def normal(level: float = CONFIDENCE) -> float:
    """Half of a two-sided interval in standard errors that are known; ``level`` in 0 … 1."""
    return float(special.ndtri((1 + level) / 2))


def normal_of_tails(p: float) -> float:
    """Return the |z| that chance exceeds with probability p in (0, 1]; exact however small p is."""
    return float(-special.ndtri(p / 2))


def student(dof: float, level: float = CONFIDENCE) -> float:
    """Half of a two-sided interval in standard errors of ``dof`` > 0 degrees of freedom.

    ∞ degrees of freedom are the normal distribution's; 0 of them give NaN, as scipy does.
    """
    return float(special.stdtrit(dof, (1 + level) / 2))


def chi_square(p: float, dof: float) -> float:
    """Quantile of χ² of ``dof`` > 0 degrees of freedom, at most so large with probability p."""
    return float(2 * special.gammaincinv(dof / 2, p))


def over_values(count: int, level: float = CONFIDENCE) -> float:
    """Half of an interval in standard errors: Student's t over ``count`` values, normal of one.

    The error of one value alone is known from elsewhere, such as from its rays.
    """
    return student(count - 1, level) if count > 1 else normal(level)


def half_width_of_mean(values: ArrayLike, level: float = CONFIDENCE) -> Array:
    """Half of the interval of the mean of two or more independent values.

    Parameters
    ----------
    values : array_like, shape (count, …)
    level : float in 0 … 1

    Returns
    -------
    ndarray, shape (…)
        In the unit of the values.

    """
    a = float_array("values", values)
    require(len(a) > 1, "values", a, "two or more")
    factor = student(len(a) - 1, level) / np.sqrt(len(a))
    return np.asarray(factor * a.std(axis=0, ddof=1))


def dof_of_sum(variances: ArrayLike, dof: ArrayLike) -> Array:
    """Degrees of freedom of the sum of independent estimated variances (Satterthwaite 1946).

    Parameters
    ----------
    variances : array_like, shape (count, …)
        ≥ 0; squares of standard errors.
    dof : array_like, shape (count,)
        Of each, > 0; ∞ where a variance is known.

    Returns
    -------
    ndarray, shape (…)
        Between the least ``dof`` and their sum; ∞ where all variances are 0, which is known.

    """
    v = float_array("variances", variances)
    # By a power of two, which is exact: squares of small errors would be 0.
    v = np.ldexp(v, -np.frexp(v.max(axis=0))[1])
    each = np.reshape(dof, (-1, *(1,) * (v.ndim - 1)))
    squares = (v**2 / each).sum(axis=0)
    with np.errstate(divide="ignore"):
        return np.asarray(np.where(squares > 0, v.sum(axis=0) ** 2, np.inf) / squares)


def two_sided_p(t: float, dof: float) -> float:
    """Chance of |t| or more by Student's t, ``dof`` > 0; ∞ for the normal distribution."""
    return float(2 * special.stdtr(dof, -abs(t)))


def normal_deviate(t: ArrayLike, dof: ArrayLike) -> Array:
    """Return the z ≥ 0 that is as unlikely as Student's |t|; ∞ where no float holds the chance."""
    with np.errstate(divide="ignore"):
        return np.asarray(-special.ndtri_exp(np.log(special.stdtr(dof, -np.abs(t)))))
