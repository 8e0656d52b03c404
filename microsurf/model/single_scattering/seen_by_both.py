"""Facets that two directions see, under a bivariate Student t: expectations of step 2 and 3.

See `body_closed_form`: u is the slope along a direction in units of its scale, X = 1 − a u
what the facet shows to a direction that is a times as steep as this scale, and ρ the cosine
between the azimuths of both directions.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, stdtr

from ...physics import smith

Array = NDArray[np.float64]

# E[X_i₊ X_o₊] at ρ = −1 is kept above this part of that at ρ = 1: beyond it rounding is
# left of it, and it divides.
_LEAST = 1e-10
_LEAST_SLOPE = 1e-90  # of a direction, so that its inverse can be squared
BEND = np.pi / 2 - 1
"""Of the kernel √(1−ρ²) + ρ asin ρ: its rise over 1 from ρ = 0 to ±1."""


def partial_moments(c: Array, nu: float, order: int) -> list[Array]:
    """∫_−∞^c u^k t_ν(u) du for k = 0 … order < ν, by parts from k − 2 to k."""
    constant = smith.log_student_constant(nu)
    if np.isinf(nu):
        edge = np.exp(constant - c**2 / 2)
        moments = [ndtr(c), -edge]
        for k in range(2, order + 1):
            moments.append((k - 1) * moments[k - 2] - c ** (k - 1) * edge)
        return moments
    edge = nu * np.exp(constant - (nu - 1) / 2 * np.log1p(c**2 / nu))
    moments = [stdtr(nu, c), -edge / (nu - 1)]
    for k in range(2, order + 1):
        moments.append(((k - 1) * nu * moments[k - 2] - c ** (k - 1) * edge) / (nu - k))
    return moments


def _power(a: Array, m: list[Array], k: int) -> Array:
    """E[(1 − a u)₊^k] for k = 1 or 2 from moments m up to 1/a; k = 1 is 1 + Smith's Λ."""
    return np.asarray(m[0] - a * m[1] if k == 1 else m[0] - 2 * a * m[1] + a**2 * m[2])


def _end(a: Array) -> Array:
    """Slope up to which facets are seen from a direction."""
    return np.asarray(1 / np.maximum(a, _LEAST_SLOPE))


class Side(NamedTuple):
    """One direction, a times as steep as the scale of t_ν, and moments of u up to 1/a.

    ``heavier`` are those of t_(ν−1) at that of width √(ν/(ν−1)); none at ν = ∞. Moments are
    most of the work, so that each is computed once.
    """

    a: Array
    moments: list[Array]
    heavier: tuple[Array, list[Array]] | None


def side_of(a: Array, nu: float, order: int) -> Side:
    """Return a direction's moments of orders up to ``order`` < ν."""
    moments = partial_moments(_end(a), nu, order)
    if np.isinf(nu):
        return Side(a, moments, None)
    wider = a * np.sqrt(nu / (nu - 1))
    return Side(a, moments, (wider, partial_moments(_end(wider), nu - 1, order - 1)))


def joined(first: Side, second: Side, nu: float, k: int) -> Array:
    """E[(1 − a u)₊^k (1 − b v)₊] for uncorrelated u, v of a bivariate t, nearly.

    v given u is t_(ν+1) of width √((ν+u²)/(ν+1)), put at its mean under the weight of
    u: that factor takes t_ν to t_(ν−1). Exact for b = 0, b → ∞ and ν = ∞, from below otherwise.
    """
    alone = _power(first.a, first.moments, k)
    if first.heavier is None:
        return alone * _power(second.a, second.moments, 1)
    heights = smith.log_student_constant(nu) - smith.log_student_constant(nu - 1)
    ratio = np.exp(heights) / np.sqrt((1 - 1 / nu) * (1 + 1 / nu))
    b = second.a * (ratio * _power(*first.heavier, k) / alone)
    return alone * _power(b, partial_moments(_end(b), nu + 1, 1), 1)


class Pair(NamedTuple):
    """Two directions, a ≤ b times as steep as the scale of t_ν, and moments of u in one plane.

    In this order reciprocity is exact: every step is done once for a pair.
    """

    a: Side
    b: Side
    nu: float
    apart: list[Array]  # moments of the facets seen by both at ρ = −1
    across: tuple[Array, Array]  # E[X_a₊ X_b₊] at ρ = 0, either one first

    @property
    def together(self) -> list[Array]:
        """Moments of the facets seen by both at ρ = 1: what b sees, a does too."""
        return self.b.moments


def pair_of(i: Array, o: Array, nu: float, order: int) -> Pair:
    """Return two directions of steepness i and o, with moments of orders up to ``order`` < ν."""
    a, b = (side_of(steepness, nu, order) for steepness in (np.minimum(i, o), np.maximum(i, o)))
    below = partial_moments(-_end(b.a), nu, order)
    apart = [up - down for up, down in zip(a.moments, below, strict=True)]
    return Pair(a, b, nu, apart, (joined(a, b, nu, 1), joined(b, a, nu, 1)))


def expectations(pair: Pair) -> Array:
    """E[X_i₊ X_o₊] at ρ = −1, 0 and 1, shape (3, pairs)."""
    a, b, m, d = pair.a.a, pair.b.a, pair.together, pair.apart
    plus = m[0] - (a + b) * m[1] + a * b * m[2]
    minus = np.maximum(d[0] + (b - a) * d[1] - a * b * d[2], 0.0) + _LEAST * plus
    across = np.sqrt(pair.across[0] * pair.across[1])
    # From below by the kernel of grazing directions, the most bent there is.
    bent = (plus + minus) / 2 - (plus - minus) / np.pi * BEND
    return np.stack([minus, np.maximum(across, bent), plus])


def conditional_means(i: Array, o: Array, pair: Pair, together: Array) -> tuple[Array, Array]:
    """Means of 1 − a u over the facets seen by both, a that of i and that of o.

    At ρ = −1, 0 and 1, each of shape (3, pairs); ``together`` are the pair's `expectations`.
    """
    m, d = pair.together, pair.apart
    sides = (pair.a, pair.b), (pair.b, pair.a)
    across = [joined(*two, pair.nu, 2) / one for two, one in zip(sides, pair.across, strict=True)]

    def mean(a: Array, b: Array) -> Array:
        side = np.where(a <= b, 1.0, -1.0)
        plus = m[0] - (2 * a + b) * m[1] + a * (a + 2 * b) * m[2] - a**2 * b * m[3]
        minus = d[0] + side * ((b - 2 * a) * d[1] + a**2 * b * d[3]) + a * (a - 2 * b) * d[2]
        minus = np.maximum(minus, 0.0) + _LEAST * together[2]
        return np.stack([minus / together[0], np.where(a <= b, *across), plus / together[2]])

    return mean(i, o), mean(o, i)
