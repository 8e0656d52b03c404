"""Closed form of the body term for Smith's height-correlated masking, approximate.

In the slopes of a facet, with X_w = w·(−p, −q, 1)/w_z and g = 1/√(1 + p² + q²),

    f_b = w/(π (1 − r_e)) · G2(i, o) · E[X_i₊ X_o₊ g T(i_z X_i g) T(o_z X_o g)].

Three steps replace the integral over the facets.

1. g^k times an STD is close to another STD of lighter tail: γ + k/2, of the same
   mass and the same second moments (`_slope_parameters`). Its mass and width are numbers of the
   material, not of the directions, and are summed in ln slope once a call.
2. Under that Student t, E[X_i₊ X_o₊] is a partial moment in closed form where i and
   o lie in one plane, ρ = ±1, ρ the cosine between their azimuths in scaled slopes.
   Across, at ρ = 0, one slope given the other is again a t, and its width is
   replaced by its exact mean. Between, the expectation follows ρ and the kernel
   √(1−ρ²) + ρ asin ρ, which holds when both directions graze: the even part of
   the arc-cosine kernel (Cho and Saul, "Kernel Methods for Deep Learning", NIPS 2009).
   As in the model of Oren and Nayar (SIGGRAPH 1994), unclipped facets give
   c₀ + c₁ tanθ_i tanθ_o cosΔφ.
3. k = 2 gives the mean cosines of the facets seen by both directions the same way.
   The spread about them is fitted, and T T is averaged over mean ± spread.

The four constants of the spread minimise the squared relative error of the mean of
T T against `single.body` over γ in {2, 3, 8, ∞}, σ in {0.05, 0.15, 0.5, 1}, n in
{1.33, 1.5, 2.5}, θ from 0 to 85° and Δφ from 0 to 180°, weighted by
sinθ cosθ of both directions; `validation/figures/approximate_error.py --fit` repeats it.
Its rms residual is 1.1 %.

Meneveaux et al., IEEE TVCG 24(3), 2018, give a closed form for Beckmann facets and
V-cavities; this one is for STD of any γ > 3/2 and Smith's G2.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...physics import fresnel, smith, student_t
from .facets import Facets, Masking
from .seen_by_both import BEND, conditional_means, expectations, pair_of

Array = NDArray[np.float64]


class CosineSpread(NamedTuple):
    """Constants of the spread of the cosines about their mean, see `_passed`."""

    steep: float  # by the slope along the direction …
    share: float  # … but at most this part of the mean
    common: float  # correlation of both cosines, and …
    aligned: float  # … its change with ρ


SPREAD = CosineSpread(1.696, 0.496, 0.517, 0.919)

_LOG_RHO2 = np.linspace(-45.0, 45.0, 301)  # steps of 0.3: rounding is left at γ = ∞
_AZIMUTHS = np.pi * (np.arange(16) + 0.5) / 32


class _ScaledSlopes(NamedTuple):
    """An STD times g^k: a mass times a bivariate Student t."""

    mass: float
    nu: float  # degrees of freedom
    scale: Array  # of the slopes p and q, shape (2,)


def _slope_parameters(gamma: float, sigma_x: float, sigma_y: float, k: int) -> _ScaledSlopes:
    """Student t of the mass and the second moments of STD times g^k, k = 1 or 2.

    With u = 1/(γ − 1), E[1/g] = (1 + (σ² − u) E[g]/2)/(1 − u/2) by parts, so that the
    tail of s²g, as slow as s^(1−2γ), needs no sum.
    """
    weight = np.exp(student_t.log_kernel(np.exp(_LOG_RHO2), gamma) + _LOG_RHO2)
    weight *= _LOG_RHO2[1] - _LOG_RHO2[0]
    across = np.stack([np.cos(_AZIMUTHS), np.sin(_AZIMUTHS)]) ** 2
    sigma2 = sigma_x**2 * across[0] + sigma_y**2 * across[1]
    length2 = 1 + sigma2[:, None] * np.exp(_LOG_RHO2)
    mass = (1 / (np.sqrt(length2) if k == 1 else length2)) @ weight
    u = 1 / (gamma - 1)
    longer = (1 + (sigma2 - u) * mass / 2) / (1 - u / 2) if k == 1 else 1.0
    moment = np.mean(across * (longer - mass) / sigma2, axis=1) / np.mean(mass)
    nu = 2 * gamma - 2 + k
    scale = np.array([sigma_x, sigma_y]) * np.sqrt(moment * (1 - 2 / nu))
    return _ScaledSlopes(float(np.mean(mass)), nu, scale)


def _between(values: Array, rho: Array, even: Array) -> Array:
    """Interpolate from values at ρ = −1, 0 and 1 with an even shape, 0 at 0 and 1 at ±1."""
    minus, zero, plus = values
    return np.asarray(zero + (plus - minus) / 2 * rho + ((plus + minus) / 2 - zero) * even)


def _cosine(z: Array, mean: Array, rho: Array) -> Array:
    """Mean cosine of facets seen by both, from its ratio to z = cosθ at ρ = −1, 0 and 1.

    Its square is interpolated: of grazing directions it starts like √(1 + ρ).
    """
    known = np.minimum((z * mean) ** 2, 1.0)
    square = _between(known, rho, rho**2)
    return np.sqrt(np.clip(square, np.min(known, axis=0), 1.0))


def _scaled(i: Array, o: Array, scale: Array) -> tuple[Array, Array, Array]:
    """Steepness of i and of o in scaled slopes, and the cosine ρ between their azimuths."""
    at_i, at_o = scale * i[:, :2], scale * o[:, :2]
    a, b = (np.hypot(w[:, 0], w[:, 1]) for w in (at_i, at_o))
    rho = np.sum(at_i * at_o, axis=1) / np.maximum(a * b, np.finfo(float).tiny)
    return a / i[:, 2], b / o[:, 2], np.clip(rho, -1.0, 1.0)


def _passed(n: float, cosines: Array, rise: Array, rho: Array, spread: CosineSpread) -> Array:
    """Mean of T(i·m) T(o·m) about the mean cosines of i and o, both of shape (2, pairs).

    1/s² = 1/(share μ)² + 1/(steep rise sinθ_μ)² is the spread of a cosine with mean μ:
    the slope along the direction, rise, makes it, and the horizon of the facet ends it.
    """
    steep = spread.steep * rise * np.sqrt(1 - cosines**2)
    s = steep * cosines / np.hypot(cosines, steep / spread.share)
    high = fresnel.transmittance(cosines + s, n)
    low = fresnel.transmittance(cosines - s, n)
    linked = (spread.common + spread.aligned * rho) * np.prod(high - low, axis=0)
    return np.asarray((np.prod(high + low, axis=0) + linked) / 4)


class Averages(NamedTuple):
    """What f_b takes of slopes and directions, whatever the index: one number for each pair.

    white : f_b without Fresnel terms, in sr⁻¹; cosines : mean cosines of i and o at the
    facets seen by both, rise : slopes of the facets along them, both of shape (2, pairs);
    rho : cosine between their azimuths in scaled slopes.
    """

    white: Array
    cosines: Array
    rise: Array
    rho: Array

    def body(self, n: float, spread: CosineSpread = SPREAD) -> Array:
        """f_b in sr⁻¹ at unit body weight, shape (pairs,)."""
        if n == 1:
            return self.white
        passed = _passed(n, self.cosines, self.rise, self.rho, spread)
        return np.asarray(self.white * passed / fresnel.external_diffuse_transmittance(n))

    def select(self, rows: NDArray[np.bool_]) -> Averages:
        """Return some of the pairs."""
        return Averages(*(values[..., rows] for values in self))


def averages(std: tuple[float, float, float], i: Array, o: Array) -> Averages:
    """Average over facets of STD (γ, σ_x, σ_y), for unit directions of shape (pairs, 3)."""
    i, o = np.broadcast_arrays(i, o)
    parameters = _slope_parameters(*std, 1)
    a, b, rho = _scaled(i, o, parameters.scale)
    single = expectations(pair_of(a, b, parameters.nu, 2))
    even = (np.sqrt((1 - rho) * (1 + rho)) + rho * np.arcsin(rho) - 1) / BEND
    masking = smith.g2_height_correlated(i, o, *std)
    white = parameters.mass / np.pi * masking * _between(single, rho, even)
    second = _slope_parameters(*std, 2)
    a, b, rho = _scaled(i, o, second.scale)
    pair = pair_of(a, b, second.nu, 3)
    together = expectations(pair)
    z = np.stack([i[:, 2], o[:, 2]])
    shortened = second.mass / parameters.mass * together / single
    means = [shortened * mean for mean in conditional_means(a, b, pair, together)]
    cosines = np.stack([_cosine(*w, rho) for w in zip(z, means, strict=True)])
    return Averages(np.asarray(white), cosines, z * np.stack([a, b]), rho)


def body(facets: Facets, i: Array, o: Array, spread: CosineSpread = SPREAD) -> Array:
    """f_b in sr⁻¹ at unit body weight, for unit directions of shape (pairs, 3) with z > 0.

    An approximation of `single.body` with Smith's height-correlated masking, whatever
    ``facets.masking`` says. Reciprocal, never negative, and exact for σ → 0.
    Rms relative error over the hemisphere, weighted by the flux, and relative error of
    the albedo, for γ ≥ 2 and σ ≤ 1: 2.1 % and 1.5 %; at 85° for γ = 2 and σ = 0.1: 10 %.
    For γ = 1.6: 4 % and 2 %, and 16 % at 85°, σ = 0.05. `validation/figures/approximate_error.py`
    maps them.
    """
    return averages(facets.std, i, o).body(facets.n, spread)


APPROXIMATE = Masking(smith.g2_height_correlated, body)
"""Smith's height-correlated G2 with this body term."""
