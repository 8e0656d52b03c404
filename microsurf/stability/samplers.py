"""Samplers: what they make of given random numbers, and what must hold of every draw.

A sampler is a deterministic map of random numbers with a distribution of its own. `Given` stands
in for the generator and hands it fixed numbers, so the map has a reference as a formula has;
whether the numbers' distribution is the right one is what the tests of `physics` ask. Of real
draws an identity is asked: their value is 1 + the worst deviation from it.
"""

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from ..physics import facet, student_t, visible_normals
from . import reference
from .case import CheckedFunction
from .domain import unit
from .reference import EXACT, Real

DRAWS = 200
_UNDERFLOW = (
    "of slopes beyond 1e308, which only tails of γ < 1.53 have, cosines below 1e-308 have an "
    "absolute error of up to 3e-320, or are 0"
)
_ALMOST_ONE = 1 - 2.0**-53
Array = NDArray[np.float64]


@dataclass
class Given:
    """In the place of a numpy Generator: always the same numbers.

    ``uniform`` are taken one after the other by calls of random(), the last for ever.
    """

    uniform: tuple[float, ...]
    exponential: float = 1.0
    t: float = 0.5

    def random(self, size: Any = None) -> Any:
        """Next uniform number."""
        value, *rest = self.uniform
        self.uniform = tuple(rest) or self.uniform
        return np.full(() if size is None else size, value)[()]

    def standard_exponential(self, size: Any) -> Array:
        """Draw s."""
        return np.full(size, self.exponential)

    def standard_gamma(self, shape: Array) -> Array:
        """Draw s."""
        return np.full(np.shape(shape), self.exponential)

    def standard_t(self, _: float, size: Any) -> Array:
        """Draw t."""
        return np.full(size, self.t)

    def standard_normal(self, size: Any) -> Array:
        """Draw t."""
        return np.full(size, self.t)


def _generator(given: Given) -> np.random.Generator:
    return cast("np.random.Generator", given)


def _slope(gamma: float, sigma: float, u: float, v: float) -> float:
    p, _ = student_t.sample_slopes(_generator(Given((u, v))), 1, gamma, sigma)
    return float(p[0])


def _cosine(uniform: float, gamma: float, sigma: float, given: tuple[float, ...]) -> float:
    """m_z of the visible normal that a ray along (wx, 0, wz) gets of s and t."""
    wx, wz, s, t = given
    numbers = _generator(Given((uniform,), s, t))
    return float(visible_normals.sample([wx, 0.0, wz], gamma, sigma, None, numbers)[2])


def _exact_cosine(gamma: Real, sigma: Real, p2: Real, t: Real) -> Real:
    """m_z of slopes p along the ray and t √((ν + p²)/(ν + 1)) across it, in units of σ/√2."""
    across = t**2
    if not EXACT.isinf(gamma):
        nu = 2 * gamma - 2
        across *= (nu + p2) / (nu + 1)
    return 1 / EXACT.sqrt(1 + sigma**2 / 2 * (p2 + across))


def _from_above(gamma: Real, sigma: Real, wx: Real, wz: Real, s: Real, t: Real) -> Real:
    del wx, wz  # the steep branch does not see them
    return _exact_cosine(gamma, sigma, reference.power_rise(gamma, s), t)


def _from_below(gamma: Real, sigma: Real, wx: Real, wz: Real, s: Real, t: Real) -> Real:
    c2 = 2 * (wz / (sigma * wx)) ** 2
    rise = reference.power_rise(gamma, s)
    growth = 1 if EXACT.isinf(gamma) else 1 + c2 / (2 * gamma - 2)
    return _exact_cosine(gamma, sigma, c2 + rise * growth, t)


def _visible_deviation(gamma: float, sigma: float, wx: float, wz: float) -> float:
    """Worst of ||m| − 1| and −w·m over draws, sideways and isotropic."""
    w = np.tile([wx, 0.0, wz], (DRAWS, 1))
    m = visible_normals.sample(w, gamma, sigma, None, np.random.default_rng(1))
    return _worst(np.abs(np.linalg.norm(m, axis=1) - 1), -np.sum(w * m, axis=1))


def _facet_deviation(mu: float, n: float) -> float:
    """Worst of ||o| − 1|, −o·m, and |o·m − i·m| of mirrored light, over draws."""
    m = unit(40.0, 30.0)
    side = np.cross(m, [0.0, 0.0, 1.0])
    i = mu * m + np.sqrt(1 - mu**2) * side / np.linalg.norm(side)
    rng = np.random.default_rng(1)
    o, is_body = facet.sample(np.tile(i, (DRAWS, 1)), np.tile(m, (DRAWS, 1)), n, rng)
    mirrored = np.abs(o @ m - i @ m)[~is_body]
    return _worst(np.abs(np.linalg.norm(o, axis=1) - 1), -(o @ m), mirrored)


def _worst(*deviations: Array) -> float:
    """1 + the largest of them; NaN if one is."""
    return 1 + max(0.0, float(np.max(np.concatenate(deviations))))


def _direction(theta: float) -> tuple[float, float]:
    w = unit(theta)
    return float(w[0]), float(w[2])


SAMPLERS = (
    CheckedFunction(
        "slopes at given numbers", "samplers", ("u", "gamma", "wide"),
        ("gamma", "sigma", "u", "v"),
        lambda u, gamma, sigma: (gamma, sigma, u, 0.1),
        _slope,
        lambda gamma, sigma, u, v: reference.slope_quantile(gamma, sigma, u)
        * EXACT.cos(2 * EXACT.pi * v),
    ),
    CheckedFunction(
        "visible normals at given numbers, from above", "samplers", ("s", "gamma", "wide"),
        ("gamma", "sigma", "wx", "wz", "s", "t"),
        lambda s, gamma, sigma: (gamma, sigma, *_direction(60.0), s, 0.5),
        lambda gamma, sigma, *given: _cosine(_ALMOST_ONE, gamma, sigma, given),
        _from_above,
        note=_UNDERFLOW,
    ),
    CheckedFunction(
        "visible normals at given numbers, from below", "samplers", ("s", "gamma", "below", "wide"),
        ("gamma", "sigma", "wx", "wz", "s", "t"),
        lambda s, gamma, below, sigma: (gamma, sigma, *_direction(below), s, 0.5),
        lambda gamma, sigma, *given: _cosine(0.0, gamma, sigma, given),
        _from_below,
        note=_UNDERFLOW,
    ),
    CheckedFunction(
        "visible normals: |m| = 1, w·m ≥ 0", "samplers", ("theta", "gamma", "sigma"),
        ("gamma", "sigma", "wx", "wz"),
        lambda theta, gamma, sigma: (gamma, sigma, *_direction(theta)),
        _visible_deviation,
        lambda *_: EXACT.one,
    ),
    CheckedFunction(
        "visible normals from below: the same", "samplers", ("below", "gamma", "sigma"),
        ("gamma", "sigma", "wx", "wz"),
        lambda below, gamma, sigma: (gamma, sigma, *_direction(below)),
        _visible_deviation,
        lambda *_: EXACT.one,
    ),
    CheckedFunction(
        "facet events: |o| = 1, o·m ≥ 0, mirror law", "samplers", ("n", "theta"), ("mu", "n"),
        lambda n, theta: (_direction(theta)[1], n),
        _facet_deviation,
        lambda *_: EXACT.one,
    ),
)  # fmt: skip
