"""STD facets as a renderer's kernels draw and weigh them, in float32 and without rejection.

Visible normals need rejection, for which a renderer has no numbers. With slopes in units of
σ/√2, c = √2 cotθ/σ(φ) and p the slope along the azimuth of w, visible ones have a density
∝ (c − p)₊ t_ν(p). Of |p| = r from t_ν, given the sign − with probability (c + r)/max(2c, c + r),
comes c of its mass; p = −r from r t_ν(r), r > c, in place of (r − c) t_ν(r) adds the rest, and
c t_ν(p) on p < −c too much. The density drawn, ∝ (c − p)₊ t_ν(p) + c t_ν(p) [p < −c], is closed,
above that of the visible normals everywhere, and by less than a quarter. t_ν is drawn by
Bailey's polar method, Mathematics of Computation 62, 1994.

``dr`` is drjit, or what has its functions; directions have ``x``, ``y`` and ``z``.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

_LEAST_COSINE = 1e-15
_MOST_EXPONENT = 80.0
"""Of e in float32; slopes beyond it are vertical to its digits."""
_LEAST = 1e-9
_LEAST_NUMBER = 1e-8
_ROOT = float(np.sqrt(2))


@dataclass(frozen=True)
class ShaderFacets:
    """Slopes: STD shape γ > 3/2, σ along u and v, and E = ∫_0^∞ r t_ν(r) dr."""

    gamma: float
    sigma: tuple[float, float]
    excess: float

    @property
    def nu(self) -> float:
        """Degrees of freedom of t_ν."""
        return 2 * self.gamma - 2

    def across(self, dr: Any, w: Any) -> Any:
        """Projected roughness sinθ σ(φ)."""
        return dr.sqrt((self.sigma[0] * w.x) ** 2 + (self.sigma[1] * w.y) ** 2)

    def distribution(self, dr: Any, h: Any) -> Any:
        """D of normals h in sr⁻¹."""
        z = dr.maximum(h.z, _LEAST_COSINE)
        rho2 = ((h.x / self.sigma[0]) ** 2 + (h.y / self.sigma[1]) ** 2) / z**2
        log = -self.gamma * log1p(dr, rho2 / (self.gamma - 1)) - 4 * dr.log(z)
        return dr.exp(log) / (np.pi * self.sigma[0] * self.sigma[1])

    def density(self, dr: Any, w: Any, h: Any, cosine: Any) -> Any:
        """Density of `draw` over D(h), in sr⁻¹, at w·h = ``cosine`` > 0."""
        across = self.across(dr, w) / _ROOT
        common = w.z * h.z
        weight = cosine + dr.select(cosine > 2 * common, common, 0.0)
        return weight / (w.z + across * self._steep(dr, w.z, across))

    def draw(self, dr: Any, w: Any, one: Any, two: Any) -> tuple[Any, Any]:
        """Draw slopes of a facet seen from w by ``one`` number in [0, 1), and ``two`` (x, y)."""
        nu = self.nu
        first, second = dr.maximum(1 - two.x, _LEAST_NUMBER), two.y
        size = self.across(dr, w)
        upright = size < _LEAST
        along = (
            dr.select(upright, 1.0, self.sigma[0] * w.x / dr.maximum(size, _LEAST)),
            dr.select(upright, 0.0, self.sigma[1] * w.y / dr.maximum(size, _LEAST)),
        )
        across = size / _ROOT
        plain = w.z / (w.z + across * self._steep(dr, w.z, across))
        of_plain = one < plain
        third = dr.select(of_plain, one / plain, (one - plain) / dr.maximum(1 - plain, _LEAST))
        c = w.z / dr.maximum(across, _LEAST)
        radius = dr.sqrt(nu * expm1(dr, -2 * dr.log(first) / nu))
        p = dr.abs(radius * dr.cos(2 * np.pi * second))
        down = third < (c + p) / dr.maximum(2 * c, c + p)
        small = dr.minimum(c, 1e4)  # of a larger c the other branch has no share
        rise = small**2 + (nu + small**2) * expm1(dr, -2 * dr.log(first) / (nu - 1))
        p = dr.select(of_plain, dr.select(down, -p, p), -dr.sqrt(rise))
        left = dr.maximum(1 - second, _LEAST_NUMBER)
        student = dr.sqrt((nu + 1) * expm1(dr, -2 * dr.log(left) / (nu + 1)))
        given_p = student * dr.cos(2 * np.pi * third) * dr.sqrt((nu + p * p) / (nu + 1))
        q = dr.select(of_plain, radius * dr.sin(2 * np.pi * second), given_p)
        return (
            self.sigma[0] / _ROOT * (p * along[0] - q * along[1]),
            self.sigma[1] / _ROOT * (p * along[1] + q * along[0]),
        )

    def _steep(self, dr: Any, cosine: Any, across: Any) -> Any:
        """∫_c^∞ r t_ν(r) dr."""
        c = cosine / dr.maximum(across, _LEAST * cosine)
        return self.excess * dr.exp(-(self.nu - 1) / 2 * log1p(dr, c * c / self.nu))


def log1p(dr: Any, x: Any) -> Any:
    """ln(1 + x) of x ≥ 0, to the digits of float32."""
    series = x * (1 + x * (-1 / 2 + x * (1 / 3 + x * (-1 / 4 + x * (1 / 5)))))
    return dr.select(x < 0.03, series, dr.log(1 + x))


def expm1(dr: Any, x: Any) -> Any:
    """e^x − 1 of x ≥ 0, to the digits of float32."""
    series = x * (1 + x * (1 / 2 + x * (1 / 6 + x * (1 / 24))))
    return dr.select(x < 0.03, series, dr.exp(dr.minimum(x, _MOST_EXPONENT)) - 1)


def conductor(dr: Any, cosine: Any, eta: Any, k: Any) -> Any:
    """Reflectance of unpolarised light by a conductor of index η + ik."""
    c2 = cosine * cosine
    s2 = 1 - c2
    real = eta * eta - k * k - s2
    size = dr.sqrt(real * real + 4 * eta * eta * k * k)
    a = dr.sqrt(dr.maximum((size + real) / 2, 0.0))
    across = (size + c2 - 2 * a * cosine) / (size + c2 + 2 * a * cosine)
    more, less = c2 * size + s2 * s2, 2 * a * cosine * s2
    return across * (1 + (more - less) / (more + less)) / 2
