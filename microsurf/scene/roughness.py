"""How steep the facets are: the parameters of Student's t-distribution of slopes."""

from dataclasses import dataclass

from . import validators

BECKMANN = 1e9
"""γ that stands for Beckmann's ∞: the same to nine digits."""


@dataclass(frozen=True)
class Roughness:
    """STD slopes: shape γ > 3/2, roughness σ along x and y (one number: isotropic).

    σ = 0 is flat; below 1e−6 a lobe is narrower than float32 directions can tell.
    """

    gamma: float = 2.0
    sigma: tuple[float, ...] = (0.5,)

    def __post_init__(self) -> None:
        object.__setattr__(self, "gamma", validators.number("roughness.gamma", self.gamma))
        object.__setattr__(self, "sigma", validators.numbers("roughness.sigma", self.sigma))
        validators.require(
            self.gamma > 1.5,
            "roughness.gamma",
            self.gamma,
            "> 1.5 (below, the mean slope of the surface is infinite)",
        )
        validators.require(
            len(self.sigma) <= 2, "roughness.sigma", self.sigma, "one number or two (x, y)"
        )
        for sigma in self.sigma:
            validators.require(
                sigma == 0 or 1e-6 <= sigma <= 1000,
                "roughness.sigma",
                sigma,
                "0 (flat) or 1e-6 … 1000",
            )
        validators.require(
            (self.sigma_x > 0) == (self.sigma_y > 0),
            "roughness.sigma",
            self.sigma,
            "both zero (flat) or both positive",
        )

    @property
    def sigma_x(self) -> float:
        """Roughness along x."""
        return self.sigma[0]

    @property
    def sigma_y(self) -> float:
        """Roughness along y."""
        return self.sigma[-1]

    @property
    def isotropic(self) -> bool:
        """Whether both roughnesses are equal."""
        return self.sigma_x == self.sigma_y
