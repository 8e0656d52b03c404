"""The same functions at 50 digits and 30 to lose, by formulas that `physics` does not use.

Each takes and returns mpmath numbers of `EXACT`: a double given to them is meant as it
is, to its last bit. `physics` rearranges its formulas so that nothing cancels; here they
stand as in the papers, and what cancels is paid with digits.
"""

from functools import lru_cache
from typing import Any

from mpmath import MPContext

EXACT: Any = MPContext()
EXACT.dps = 80

Real = Any
"""A number of `EXACT`."""

_NOTHING = 1500  # what falls as the exponential of so much is 0 for every double
_LARGE = 30  # from here on a series falls fast enough at z = 1
_ENOUGH = 300  # terms of a series that falls as e^(−k): beyond 80 digits


def real(value: float) -> Real:
    """Return the double as it is."""
    return EXACT.mpf(float(value))


def distribution(gamma: Real, sigma_x: Real, sigma_y: Real, mx: Real, my: Real, mz: Real) -> Real:
    """D(m) (Ribardière et al. 2018, eq. 6)."""
    return slope_density(gamma, sigma_x, sigma_y, mx / mz, my / mz) / mz**4


def slope_density(gamma: Real, sigma_x: Real, sigma_y: Real, p: Real, q: Real) -> Real:
    """Density of slopes: a bivariate Student t of 2γ − 2 degrees of freedom."""
    return _tail((p / sigma_x) ** 2 + (q / sigma_y) ** 2, gamma, gamma) / (
        EXACT.pi * sigma_x * sigma_y
    )


def _tail(rho2: Real, gamma: Real, power: Real) -> Real:
    """(1 + ρ²/(γ−1))^(−power), or e^(−ρ²)."""
    if EXACT.isinf(gamma):
        return EXACT.exp(-rho2)
    return (1 + rho2 / (gamma - 1)) ** -power


def slope_cdf(gamma: Real, sigma: Real, r: Real) -> Real:
    """Probability of |slope| ≤ r."""
    return 1 - _tail((r / sigma) ** 2, gamma, gamma - 1)


def slope_quantile(gamma: Real, sigma: Real, u: Real) -> Real:
    """Inverse of `slope_cdf`."""
    if EXACT.isinf(gamma):
        return sigma * EXACT.sqrt(-EXACT.log1p(-u))
    return sigma * EXACT.sqrt((gamma - 1) * EXACT.expm1(-EXACT.log1p(-u) / (gamma - 1)))


def area_beyond(gamma: Real, sigma: Real, slope: Real) -> Real:
    """Share of the microsurface area at |slope| > slope, by a hypergeometric function."""
    return _area_from(gamma, sigma, slope) / mean_area(gamma, sigma)


def mean_area(gamma: Real, sigma: Real) -> Real:
    """∫ √(1+r²) dF: microsurface area per mean plane."""
    return _area_from(gamma, sigma, EXACT.zero)


@lru_cache(maxsize=4096)
def _area_from(gamma: Real, sigma: Real, slope: Real) -> Real:
    """∫ √(1+r²) dF(r) from slope to ∞.

    With t = 1 + ρ²/a, a = γ − 1, and v = t₀/t it is Euler's integral of ₂F₁. For γ = ∞
    an incomplete gamma function.
    """
    start = (slope / sigma) ** 2
    if EXACT.isinf(gamma):
        rest = EXACT.gammainc(EXACT.mpf(3) / 2, start + sigma**-2)
        return EXACT.exp(sigma**-2) * sigma * rest
    a, half = gamma - 1, EXACT.mpf(1) / 2
    begin = 1 + start / a
    if a * EXACT.log(begin) > _NOTHING:
        return EXACT.zero
    b, spread = a - half, sigma**2 * a
    argument = (spread - 1) / (spread * begin)
    turned = argument / (argument - 1)
    # Pfaff's transformation: its series falls fast for large b, though for argument > 0 it
    # grows again after b/|turned| terms; stopped before, it errs by less than its last.
    if b > _LARGE and (turned > 0 or b > _ENOUGH * -turned):
        series = EXACT.sqrt(1 - argument) * _series(b + 1, turned)
    elif argument < -1:
        series = EXACT.sqrt(1 - argument) * EXACT.hyp2f1(-half, 1, b + 1, turned)
    else:
        series = EXACT.hyp2f1(-half, b, b + 1, argument)
    return a * begin ** (half - a) * EXACT.sqrt(spread) / b * series


def _series(c: Real, z: Real) -> Real:
    """₂F₁(−½, 1; c; z) term by term: for large c mpmath takes another way, which is long."""
    total = term = EXACT.one
    k = 0
    while abs(term) > abs(total) * EXACT.eps:
        term *= (k - EXACT.mpf("0.5")) / (c + k) * z
        total += term
        k += 1
    return total


def student_constant(nu: Real) -> Real:
    """K, the height of Student's t density at zero."""
    if EXACT.isinf(nu):
        return 1 / EXACT.sqrt(2 * EXACT.pi)
    half = EXACT.mpf(1) / 2
    log = EXACT.loggamma(nu / 2 + half) - EXACT.loggamma(nu / 2)
    return EXACT.exp(log) / EXACT.sqrt(nu * EXACT.pi)


@lru_cache(maxsize=65536)
def lambda_of_x(x: Real, nu: Real) -> Real:
    """Smith's Λ = A − SF, a plain difference; SF by the incomplete beta function."""
    if EXACT.isinf(x):
        return EXACT.zero
    if EXACT.isinf(nu):
        if x**2 / 2 > _NOTHING:
            return EXACT.zero
        lead = EXACT.exp(-(x**2) / 2) / (x * EXACT.sqrt(2 * EXACT.pi))
        return lead - EXACT.erfc(x / EXACT.sqrt(2)) / 2
    half = EXACT.mpf(1) / 2
    if (nu - 1) / 2 * EXACT.log(1 + x**2 / nu) > _NOTHING:
        return EXACT.zero
    fall = (1 + x**2 / nu) ** (-(nu - 1) / 2)
    lead = student_constant(nu) * nu / ((nu - 1) * x) * fall
    below = EXACT.betainc(nu / 2, half, 0, nu / (nu + x**2), regularized=True)
    return lead - below / 2


def smith_lambda(gamma: Real, sigma_x: Real, sigma_y: Real, wx: Real, wy: Real, wz: Real) -> Real:
    """Λ of a direction above the horizon."""
    across = EXACT.sqrt((sigma_x * wx) ** 2 + (sigma_y * wy) ** 2)
    if across == 0:
        return EXACT.zero
    return lambda_of_x(EXACT.sqrt(2) * wz / across, 2 * gamma - 2)


def projected_area(gamma: Real, sigma_x: Real, sigma_y: Real, wx: Real, wy: Real, wz: Real) -> Real:
    """σ(w) = w_z (1 + Λ(w)), of rays going either way."""
    rest = abs(wz) * smith_lambda(gamma, sigma_x, sigma_y, wx, wy, abs(wz))
    return rest + max(wz, 0)


def visible_density(
    gamma: Real,
    sigma_x: Real,
    sigma_y: Real,
    wx: Real,
    wy: Real,
    wz: Real,
    mx: Real,
    my: Real,
    mz: Real,
) -> Real:
    """⟨w·m⟩ D(m)/σ(w)."""
    facing = max(wx * mx + wy * my + wz * mz, 0)
    area = projected_area(gamma, sigma_x, sigma_y, wx, wy, wz)
    return facing * distribution(gamma, sigma_x, sigma_y, mx, my, mz) / area


def vcavity_masking(wx: Real, wz: Real, mx: Real, mz: Real) -> Real:
    """V-cavity G1 = min(1, 2 (n·m)(n·w)/(w·m)); w and m in one plane."""
    facing = wx * mx + wz * mz
    return min(EXACT.one, 2 * mz * wz / facing) if facing > 0 else EXACT.zero


def reflectance(mu: Real, n: Real, k: Real = 0) -> Real:
    """F by Snell's cosine and the amplitude ratios (Born & Wolf, §1.5.2 and §14.2)."""
    index = EXACT.mpc(n, k) if k != 0 else n
    inside = EXACT.sqrt(1 - (1 - mu**2) / index**2)
    across = (mu - index * inside) / (mu + index * inside)
    along = (index * mu - inside) / (index * mu + inside)
    return (abs(across) ** 2 + abs(along) ** 2) / 2


def transmittance(mu: Real, n: Real, k: Real = 0) -> Real:
    """1 − F."""
    return EXACT.one if n == 1 and k == 0 else 1 - reflectance(mu, n, k)


@lru_cache(maxsize=4096)
def external_reflectance(n: Real) -> Real:
    """r_e in closed form (Duntley 1942)."""
    if n == 1:
        return EXACT.zero
    squared = n**2
    return (
        EXACT.mpf(1) / 2
        + (n - 1) * (3 * n + 1) / (6 * (n + 1) ** 2)
        + squared * (squared - 1) ** 2 / (squared + 1) ** 3 * EXACT.log((n - 1) / (n + 1))
        - 2 * n**3 * (squared + 2 * n - 1) / ((squared + 1) * (n**4 - 1))
        + 8 * n**4 * (n**4 + 1) / ((squared + 1) * (n**4 - 1) ** 2) * EXACT.log(n)
    )


def external_transmittance(n: Real) -> Real:
    """1 − r_e."""
    return 1 - external_reflectance(n)


def internal_reflectance(n: Real) -> Real:
    """r_i = 1 − (1 − r_e)/n²."""
    return 1 - (1 - external_reflectance(n)) / n**2


def body_weight(n: Real, kd: Real) -> Real:
    """Kd (1 − r_i)/(1 − Kd r_i)."""
    inside = internal_reflectance(n)
    return kd * (1 - inside) / (1 - kd * inside)


def body(mu: Real, n: Real, kd: Real, mu_o: Real) -> Real:
    """f_b = T(i) T(o) Kd/(π n² (1 − Kd r_i)) (Ribardière et al. 2018, eq. 5)."""
    pair = transmittance(mu, n) * transmittance(mu_o, n)
    return pair * kd / (EXACT.pi * n**2 * (1 - kd * internal_reflectance(n)))


def albedo(mu: Real, n: Real, kd: Real) -> Real:
    """F + T w."""
    through = transmittance(mu, n)
    return 1 - through + through * body_weight(n, kd)


def power_rise(gamma: Real, s: Real) -> Real:
    """ν (e^(2s/(ν−1)) − 1): ρ² of the visible-normal map at an exponential draw s."""
    if EXACT.isinf(gamma):
        return 2 * s
    nu = 2 * gamma - 2
    return nu * (EXACT.exp(2 * s / (nu - 1)) - 1)
