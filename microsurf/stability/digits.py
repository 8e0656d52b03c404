"""How many digits of a number are right, and how many its problem leaves."""

import math
from collections.abc import Callable, Sequence

from .reference import EXACT, Real, real

ROUNDING = 2.0**-53
"""Relative error of one rounding to the nearest double."""

MOST = -math.log10(ROUNDING)
"""Digits of a number that is rounded and nothing else: 15.95."""

_LEAST = 2.0**-1022  # below, doubles have an absolute error
_STEP = EXACT.mpf(10) ** -25  # of derivatives: 80 digits leave 30 of them
_UPWARDS = ("gamma", "n")  # inputs at whose lower border formulas end; all others are lowered


def relative_error(value: float, exact: Real) -> float:
    """|value/exact − 1|; relative to 2^−1022 where doubles are no finer. ∞ if value is NaN or ∞."""
    if not math.isfinite(value):
        return math.inf
    return float(abs(real(value) - exact) / max(abs(exact), real(_LEAST)))


def right(value: float, exact: Real) -> float:
    """Digits of value that are right, 0 … MOST."""
    return of_error(relative_error(value, exact))


def of_error(error: float) -> float:
    """−log10 of a relative error, 0 … MOST."""
    if error == 0:
        return MOST
    return min(max(-math.log10(error), 0.0), MOST) if math.isfinite(error) else 0.0


def condition(exact: Callable[..., Real], inputs: Sequence[float], names: Sequence[str]) -> float:
    """Relative condition number Σ_k |x_k ∂f/∂x_k| / |f| of f at its inputs; 0 where f = 0.

    What one rounding of each input does to the result, in roundings of the result.
    """
    given = [real(value) for value in inputs]
    base = exact(*given)
    if base == 0:
        return 0.0
    total = EXACT.zero
    for k, name in enumerate(names):
        if given[k] == 0 or EXACT.isinf(given[k]):
            continue
        moved = list(given)
        moved[k] *= 1 + _STEP if name in _UPWARDS else 1 - _STEP
        total += abs(exact(*moved) - base)
    return float(total / (_STEP * max(abs(base), real(_LEAST))))


def kept(error: float, conditioning: float) -> float:
    """Digits left if what the conditioning costs is forgiven, 0 … MOST."""
    return of_error(error / max(conditioning, 1.0))


def attainable(conditioning: float) -> float:
    """Digits that inputs rounded to doubles leave, 0 … MOST."""
    return of_error(ROUNDING * max(conditioning, 1.0))
