"""Smith's theory of slopes that are given, not STD's: what a mesh has, tail cut and all.

A distribution of slopes is a sorted list of ρ = |(p/σ_x, q/σ_y)|, all of one weight, with
azimuths spread evenly in the stretched plane. For a direction at c = w_z/|(σ_x w_x, σ_y w_y)|

    w_z Λ(w) = across · H(c),  H(c) = E[(ρ cosφ − c)₊],

with E over φ in closed form: (√(ρ² − c²) − c arccos(c/ρ))/π where ρ > c. What they change
about order 1 is in `order_one`, about later orders in `higher_orders`.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from ...physics import student_t

Array = NDArray[np.float64]

_GROUPS = 2048  # of equal weight, that H is summed over; the steepest as many facets singly
_NODES = 4096  # of the table of H in c/(1+c)


@dataclass(frozen=True, eq=False)
class Slopes:
    """Slopes of facets per unit of projected area: ``rho``, sorted, shape (facets,), and σ."""

    rho: Array
    sigma_x: float
    sigma_y: float

    @cached_property
    def _table(self) -> CubicSpline:
        """H over c/(1+c)."""
        single = self.rho[-_GROUPS:]
        parts = np.array_split(self.rho[:-_GROUPS], _GROUPS) if self.rho.size > _GROUPS else []
        means = np.array([part.mean() for part in parts if part.size] + list(single))
        weights = np.array([part.size for part in parts if part.size] + [1.0] * single.size)
        weights /= self.rho.size
        u = np.arange(_NODES) / _NODES
        table = np.zeros(_NODES)
        for k, c in enumerate(u / (1 - u)):
            facing = means > c
            rho = means[facing]
            if not rho.size:
                break
            excess = np.sqrt((rho - c) * (rho + c)) - c * np.arccos(c / rho)
            table[k] = weights[facing] @ excess / np.pi
        return CubicSpline(u, table)

    def excess(self, c: Array) -> Array:
        """H(c) for c ≥ 0."""
        u = c / (1 + c)
        # Beyond the steepest facet the spline rings about 0.
        return np.where(u < self._last, np.maximum(self._table(u), 0.0), 0.0)

    @cached_property
    def _last(self) -> float:
        """Where H ends: nothing is steeper."""
        return float(self.rho[-1] / (1 + self.rho[-1]))

    def stretched(self, w: Array) -> tuple[Array, Array]:
        """Length of (σ_x w_x, σ_y w_y), and the azimuth of that vector."""
        x, y = self.sigma_x * w[..., 0], self.sigma_y * w[..., 1]
        return np.hypot(x, y), np.arctan2(y, x)

    def smith_lambda(self, w: Array) -> Array:
        """Λ(w) for unit vectors with w_z > 0, shape (..., 3)."""
        across, _ = self.stretched(w)
        c = w[..., 2] / np.maximum(across, 1e-300)
        return np.asarray(across * self.excess(c) / w[..., 2])

    def normals(self, rho: Array, azimuth: Array) -> Array:
        """Unit normals of facets of these ρ and azimuths in the stretched plane."""
        p, q = self.sigma_x * rho * np.cos(azimuth), self.sigma_y * rho * np.sin(azimuth)
        return student_t.normals(p, q)
