"""Two explicit layers: an interface, and a substrate under it (docs/layers.md)."""

from dataclasses import dataclass
from typing import Any

from ..errors import InputError
from . import validators

SHAPES = ("same", "flat")
"""Substrates without a roughness of their own: the interface's relief scaled, or a plane."""
GAPS = (1e-6, 1e6)
"""Distances of the mean planes in cells: nearer is one surface, farther sees no relief."""
MAX_ABSORPTION = 1e6
"""Per cell: nothing comes back from a substrate far nearer than the least gap."""


@dataclass(frozen=True)
class Substrate:
    """What lies under the interface: Lambertian about its own facets.

    One of three: a roughness of its own, gamma and sigma (0, or 1e−6 … 1000; two: x, y); a
    ``shape``, "same" (the interface's heights, by sigma over the interface's sigma; without
    sigma as they are) or "flat"; or the heights of a ``file``. A roughness of its own has a
    correlation with the interface, that of the Gaussian fields both are made from.
    """

    gamma: float | None = None
    sigma: tuple[float, ...] | None = None
    correlation_with_interface: float = 0.0
    shape: str | None = None
    file: str | None = None

    def __post_init__(self) -> None:
        where = "layers.substrate"
        if self.shape is not None:
            validators.choice(f"{where}.shape", self.shape, SHAPES)
        named = self.file is None or (isinstance(self.file, str) and self.file != "")
        validators.require(named, f"{where}.file", self.file, "the name of a file")
        self._check_roughness(where)
        correlation = validators.number(
            f"{where}.correlation_with_interface", self.correlation_with_interface
        )
        object.__setattr__(self, "correlation_with_interface", correlation)
        validators.require(
            -1 <= correlation <= 1, f"{where}.correlation_with_interface", correlation, "−1 … 1"
        )
        explicit = self.gamma is not None
        kinds = sum([explicit, self.shape is not None, self.file is not None])
        if kinds != 1:
            given = {"gamma": self.gamma, "shape": self.shape, "file": self.file}
            said = ", ".join(f"{k} = {v!r}" for k, v in given.items() if v is not None)
            raise InputError(
                f"{where} with {said or 'nothing'}: give gamma and sigma, or a shape "
                f"({', '.join(SHAPES)}), or a file"
            )
        if explicit != (self.sigma is not None) and self.shape != "same":
            raise InputError(
                f"{where}.gamma = {self.gamma} and sigma = {self.sigma}: give both, "
                "or neither with a shape or a file"
            )
        if not explicit and correlation != 0:
            raise InputError(
                f"{where}.correlation_with_interface = {correlation:g}: is that of a substrate "
                "with gamma and sigma; leave it out with a shape or a file"
            )

    def _check_roughness(self, where: str) -> None:
        if self.gamma is not None:
            gamma = validators.number(f"{where}.gamma", self.gamma)
            validators.require(gamma > 1.5, f"{where}.gamma", gamma, "> 1.5")
            object.__setattr__(self, "gamma", gamma)
        if self.sigma is None:
            return
        sigma = validators.numbers(f"{where}.sigma", self.sigma)
        object.__setattr__(self, "sigma", sigma)
        most = 1 if self.shape == "same" else 2
        allowed = "one number: a factor of heights" if most == 1 else "one number or two (x, y)"
        validators.require(len(sigma) <= most, f"{where}.sigma", sigma, allowed)
        for value in sigma:
            validators.require(
                value == 0 or 1e-6 <= value <= 1000, f"{where}.sigma", sigma, "0 or 1e-6 … 1000"
            )
        validators.require(
            (sigma[0] > 0) == (sigma[-1] > 0),
            f"{where}.sigma",
            sigma,
            "both zero (flat) or both positive",
        )

    @property
    def isotropic(self) -> bool:
        """Whether it has no direction of its own."""
        return self.file is None and (self.sigma is None or self.sigma[0] == self.sigma[-1])


@dataclass(frozen=True)
class Layers:
    """An interface over a substrate: distance of their mean planes, and what lies between.

    ``gap`` in cells, from the interface's mean plane down to the substrate's; ``absorption``
    per cell of length inside (Beer-Lambert), 0 … 1e6.
    """

    gap: float
    substrate: Substrate
    absorption: float = 0.0

    def __post_init__(self) -> None:
        gap = validators.number("layers.gap", self.gap)
        object.__setattr__(self, "gap", gap)
        validators.require(
            GAPS[0] <= gap <= GAPS[1], "layers.gap", gap, f"{GAPS[0]:g} … {GAPS[1]:g} cells"
        )
        absorption = validators.number("layers.absorption", self.absorption)
        object.__setattr__(self, "absorption", absorption)
        validators.require(
            0 <= absorption <= MAX_ABSORPTION,
            "layers.absorption",
            absorption,
            f"0 … {MAX_ABSORPTION:g} per cell",
        )


def refuse(layers: Layers | None, what: str) -> None:
    """Raise InputError if a scene has two layers, for ``what`` knows one surface only."""
    if layers is not None:
        raise InputError(
            f"[layers]: {what} knows one surface of interfaced-Lambertian facets only; "
            "leave [layers] out. Two layers are known to `microsurf measure`, `validate` and the "
            "model layered-walk"
        )


def required(layers: Layers | None, what: str) -> Layers:
    """Two layers, for ``what`` knows nothing else; raise InputError if a scene has none."""
    if layers is None:
        raise InputError(
            f"{what}: is of two layers; give the scene [layers], or take a model of one surface"
        )
    return layers


def check(layers: Layers, material: Any, surface: Any, effects: Any, accuracy: Any) -> None:
    """Refuse what does not go with two layers.

    Raises
    ------
    InputError
        For a conductor, single scattering alone, an error in place of paths, a substrate
        correlated with an interface that no field was made for, or scaled with one.

    """
    if material.conductor:
        raise InputError(
            f"material.k = {material.k:g} with [layers]: light must pass into the layer; "
            "leave k or [layers] out"
        )
    if not effects.multiple_scattering:
        raise InputError(
            "effects.multiple_scattering = false with [layers]: light inside meets many facets; "
            "leave one of both out (every result has order 1 apart)"
        )
    if accuracy.standard_error is not None:
        raise InputError(
            f"accuracy.standard_error = {accuracy.standard_error:g} with [layers]: what it takes "
            "is known of one surface only; give accuracy.paths"
        )
    substrate = layers.substrate
    if surface.file is not None and substrate.correlation_with_interface != 0:
        raise InputError(
            f"layers.substrate.correlation_with_interface = "
            f"{substrate.correlation_with_interface:g} with surface.file: a measured interface "
            'has no generating field; give 0, or shape = "same"'
        )
    if surface.file is not None and substrate.shape == "same" and substrate.sigma is not None:
        raise InputError(
            f"layers.substrate.sigma = {substrate.sigma[0]:g} with surface.file and shape = "
            '"same": a measured interface is not scaled; leave sigma out'
        )
