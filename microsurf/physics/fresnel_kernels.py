# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators
# ruff: noqa: ANN001, ANN201 - numba finds the types
"""Fresnel's F(μ) and T(μ), compiled, for the tracer and the walks: one number at a time.

The formulas are those of `physics.fresnel`, without its checks: μ in (0, 1], n ≥ 1 of a
dielectric, n > 0 and k > 0 of a conductor, η = n + ik.
"""

import numpy as np

from ..jit import force_inlined


@force_inlined
def refracted(mu, n, k):
    """Real and imaginary part of g = √(η² − 1 + μ²)."""
    real, imaginary = (n - 1) * (n + 1) - k * k + mu * mu, 2 * n * k
    size = np.sqrt(real * real + imaginary * imaginary)
    if real >= 0:
        a = np.sqrt((size + real) / 2)
        return a, imaginary / (2 * a)
    b = np.sqrt((size - real) / 2)
    return imaginary / (2 * b), b


@force_inlined
def absorptance(mu, n, k):
    """T(μ) of a conductor: what goes into it is absorbed there."""
    a, b = refracted(mu, n, k)
    imaginary = 2 * n * k
    square = (n - k) * (n + k)
    across = (a + mu) ** 2 + b * b
    along = (square * mu + a) ** 2 + (imaginary * mu + b) ** 2
    return 2 * mu * (a / across + (square * a + imaginary * b) / along)


@force_inlined
def transmittance(mu, n):
    """T(μ) of a dielectric."""
    g = np.sqrt((n - 1) * (n + 1) + mu * mu)
    a, b = g + mu, n * n * mu + g
    return 2 * g * mu * (1 / (a * a) + n * n / (b * b))


@force_inlined
def passed(mu, facet):
    """T(μ) of a facet with the index ``facet.n`` and ``facet.k``: what it does not mirror."""
    if facet.k > 0:
        return absorptance(mu, facet.n, facet.k)
    return transmittance(mu, facet.n)


@force_inlined
def reflected(mu, facet):
    """F(μ) of a facet; 1 − T would be noise near n = 1."""
    n, k = facet.n, facet.k
    a, b = refracted(mu, n, k)
    square, imaginary = (n - k) * (n + k), 2 * n * k
    across = (a + mu) ** 2 + b * b
    along = (square * mu + a) ** 2 + (imaginary * mu + b) ** 2
    excess = ((n - 1) * (n + 1) - k * k) ** 2 + imaginary * imaginary
    brewster = ((square + 1) * mu * mu - 1) ** 2 + (imaginary * mu * mu) ** 2
    return excess * (1 / (across * across) + brewster / (along * along)) / 2
