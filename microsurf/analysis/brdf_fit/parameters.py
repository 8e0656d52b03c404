"""Parameters of a fit: what is free, between which bounds, and what the numbers mean.

Slopes are followed in η = 1/(γ − 1), which takes Beckmann to 0 and GGX to 1, in ln σ, and
with anisotropy in a (cos 2φ, sin 2φ): ln σ_x and ln σ_y are ln σ ± a, φ is the azimuth
of the axis of σ_x. So isotropy is an inner point like any other.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

BECKMANN, GGX = 0.0, 1.0
DISTRIBUTIONS: dict[str, float | None] = {"beckmann": BECKMANN, "ggx": GGX, "std": None}
"""η of each distribution; None: free."""
MOST_ETA = 1.96
"""γ = 1.51: at 1.5 masking ends, a fit there is at the border."""
LEAST_ETA = 1e-3
"""Below it γ, beyond 1000, is not distinguished from Beckmann's ∞."""
SIGMA = (1e-3, 5.0)
INDEX = (1.0, 5.0)
CONDUCTOR_INDEX = (0.02, 20.0)
_MOST_STRETCH = 2.0


class Shape(NamedTuple):
    """Slopes: γ, σ along its axes, and the azimuth of the first axis in radians."""

    gamma: float
    sigma_x: float
    sigma_y: float
    azimuth: float


@dataclass(frozen=True)
class Layout:
    """Which parameters are free, in the order of the vector.

    ``optics`` names those of the material with their bounds; ``eta`` fixes the
    distribution; ``sigma`` are the bounds of σ.
    """

    optics: tuple[tuple[str, float, float], ...]
    eta: float | None
    isotropic: bool
    sigma: tuple[float, float] = SIGMA

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the entries of the vector."""
        return tuple(name for name, _, _ in self._bounded)

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Least and largest vector."""
        low, high = zip(*((low, high) for _, low, high in self._bounded), strict=True)
        return np.array(low), np.array(high)

    @property
    def _bounded(self) -> list[tuple[str, float, float]]:
        rows = [("log_sigma", float(np.log(self.sigma[0])), float(np.log(self.sigma[1])))]
        if not self.isotropic:
            rows += [(name, -_MOST_STRETCH, _MOST_STRETCH) for name in ("stretch_c", "stretch_s")]
        if self.eta is None:
            rows.append(("eta", 0.0, MOST_ETA))
        return [*rows, *self.optics]

    def values(self, vector: Array) -> dict[str, float]:
        """Entries of the vector by name."""
        return dict(zip(self.names, map(float, vector), strict=True))

    def shape(self, vector: Array) -> Shape:
        """Slopes that a vector stands for."""
        of = self.values(vector)
        eta = of.get("eta", self.eta)
        c, s = of.get("stretch_c", 0.0), of.get("stretch_s", 0.0)
        along = float(np.hypot(c, s))
        return Shape(
            gamma_of(0.0 if eta is None else eta),
            float(np.exp(of["log_sigma"] + along)),
            float(np.exp(of["log_sigma"] - along)),
            float(np.arctan2(s, c) / 2),
        )


def gamma_of(eta: float) -> float:
    """γ of η; ∞ below the least η that is distinguished from it."""
    return 1 + 1 / eta if eta > LEAST_ETA else float("inf")
