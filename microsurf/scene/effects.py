"""What a scene leaves out on purpose, and what has to run for it."""

from dataclasses import dataclass

from . import validators


@dataclass(frozen=True)
class Effects:
    """What to leave out on purpose."""

    multiple_scattering: bool = True

    def __post_init__(self) -> None:
        validators.require(
            isinstance(self.multiple_scattering, bool),
            "effects.multiple_scattering",
            self.multiple_scattering,
            "true or false",
        )


@dataclass(frozen=True)
class Requirements:
    """The effects a scene needs, each false where it would compute a known answer.

    interface: n > 1 or k > 0, else no Fresnel; substrate: some Kd > 0, else no body events;
    roughness: σ > 0, else no mesh; anisotropy: σ_x ≠ σ_y; multiple_scattering:
    light that meets a second facet is followed; azimuth: from where light comes matters,
    else it comes from all sides in turn, and lobes are folded about the plane of incidence.
    """

    interface: bool
    substrate: bool
    roughness: bool
    anisotropy: bool
    multiple_scattering: bool
    azimuth: bool
