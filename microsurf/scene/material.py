"""Of what the facets are: an interface over a substrate, or a conductor."""

from dataclasses import dataclass

from . import validators

MAX_INDEX = 100.0
"""Largest n and k: beyond, 4/n of the light at most enters, and F is 1 but at grazing."""


@dataclass(frozen=True)
class Material:
    """Interfaced-Lambertian facet, or a conductor.

    Relative index n in [1, 100] and substrate albedo Kd in [0, 1], by default 0.8;
    several Kd are answered by one trace. An extinction coefficient k in (0, 100] makes
    it a conductor of index n + ik, n in (0, 100], without a substrate (Kd = 0).
    """

    n: float = 1.5
    kd: tuple[float, ...] = ()
    k: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "n", validators.number("material.n", self.n))
        object.__setattr__(self, "k", validators.number("material.k", self.k))
        validators.require(0 <= self.k <= MAX_INDEX, "material.k", self.k, "0 (a dielectric) … 100")
        if self.kd == ():
            object.__setattr__(self, "kd", 0.0 if self.conductor else 0.8)
        object.__setattr__(self, "kd", validators.numbers("material.kd", self.kd))
        for kd in self.kd:
            validators.require(0 <= kd <= 1, "material.kd", kd, "0 … 1")
        if self.conductor:
            validators.require(0 < self.n <= MAX_INDEX, "material.n", self.n, "> 0 … 100 (with k)")
            validators.require(
                self.kd == (0.0,), "material.kd", self.kd, "left out: a conductor has no substrate"
            )
        else:
            validators.require(
                1 <= self.n <= MAX_INDEX, "material.n", self.n, "1 (no interface) … 100"
            )

    @property
    def conductor(self) -> bool:
        """Whether the facet is a conductor, and light that it does not mirror is absorbed."""
        return self.k > 0
