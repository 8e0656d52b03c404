"""The scene that a fit stands for, to validate it on an explicit surface."""

import numpy as np

from ...errors import InputError
from ...scene import BECKMANN, Light, Material, Roughness, Scene
from .fit import BrdfFit
from .summary import parameters
from .verdict import DOES_NOT_FIT, FITS, NARROW

_MOST_ANGLES = 6
_MOST_THETA = 85.0


def scene_of(fit: BrdfFit) -> Scene:
    """Return a scene with the fitted material, slopes and some of the measured incidences.

    With anisotropy its x axis is that of σ_x: turn the surface, or the light, by the azimuth
    of the fit to compare it with the measured azimuths.

    Raises
    ------
    InputError
        If the lobe was not resolved, the fit does not fit, or no scene has such a material.

    """
    if fit.verdict in (NARROW, DOES_NOT_FIT):
        raise InputError(
            f"{fit.measured.source}: {fit.verdict}: {fit.reason}; no scene follows from it"
        )
    if fit.material == "lambertian+conductor":
        raise InputError(
            f"material = {fit.material!r}: no scene has a mirror beside a Lambertian; fit "
            "interfaced-lambertian or conductor"
        )
    values = parameters(fit.best)
    if fit.material == "conductor":
        if len(values["n"]) > 1:
            raise InputError(
                f"{len(values['n'])} channels of a conductor: a scene has one n and k; give a "
                "file of one channel"
            )
        material = Material(values["n"][0], (), values["k"][0])
    else:
        material = Material(values["n"], tuple(values["kd"]))
    sigma = values["sigma"]
    theta = np.unique(np.round(np.degrees(fit.measured.theta_i), 2))
    theta = theta[theta <= _MOST_THETA]
    chosen = theta[np.unique(np.linspace(0, len(theta) - 1, _MOST_ANGLES).round().astype(int))]
    note = "" if fit.verdict == FITS else f" Its verdict: {fit.verdict}, {fit.reason}."
    return Scene(
        title=f"Fitted to {fit.measured.source}",
        rationale=f"Best parameters of {values_said(values)}.{note}",
        material=material,
        roughness=Roughness(
            min(values["gamma"], BECKMANN), tuple(sigma) if isinstance(sigma, list) else (sigma,)
        ),
        light=Light(tuple(map(float, chosen))),
    )


def values_said(values: dict[str, object]) -> str:
    """Say γ with its interval in words."""
    ends = values.get("gamma_ci")
    if not isinstance(ends, list):
        return "a fixed distribution"
    return "γ in " + " … ".join("∞" if end >= BECKMANN else f"{end:.4g}" for end in ends)
