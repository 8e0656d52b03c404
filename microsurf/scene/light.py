"""Where the light comes from."""

from dataclasses import dataclass

from . import validators


@dataclass(frozen=True)
class Light:
    """Directions of incidence in degrees: θ in [0, 90), φ in [−360, 360] from +x."""

    theta: tuple[float, ...] = (0.0, 30.0, 60.0, 80.0)
    phi: tuple[float, ...] = (0.0,)

    @property
    def angles(self) -> int:
        """How many directions there are, each θ with each φ."""
        return len(self.theta) * len(self.phi)

    def __post_init__(self) -> None:
        object.__setattr__(self, "theta", validators.numbers("light.theta", self.theta))
        object.__setattr__(self, "phi", validators.numbers("light.phi", self.phi))
        for theta in self.theta:
            validators.require(0 <= theta < 90, "light.theta", theta, "0 ≤ θ < 90 degrees")
        for phi in self.phi:
            validators.require(-360 <= phi <= 360, "light.phi", phi, "−360 … 360 degrees")
        for name, values in (("light.theta", self.theta), ("light.phi", self.phi)):
            validators.require(
                len(set(values)) == len(values), name, list(values), "without repetition"
            )
