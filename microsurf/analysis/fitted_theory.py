"""The theory of a surface from a file: STD fitted to its slopes, before anything is traced."""

from dataclasses import replace
from typing import Any

import numpy as np

from ..errors import InputError
from ..scene import BECKMANN, Scene
from ..surface import StdFit, fit_std, notes_on_file, surface_of

LEAST_RATIO = 1.1
"""Ratio of σ below which an isotropic theory will do.

At it, σ along and across of one product, Smith's order 1 at n 1.5 and Kd 0.8 departs from that of
the isotropic σ by at most 0.25 % of its albedo at 60° and 0.54 % at 80°, but its specular part by
1.9 % and 3.9 %, up in one azimuth and down in the other (γ 2 … ∞, σ 0.1 … 0.5).
"""
_TURNED = (
    "the theory is turned to them; the error budget, masking by slope, the cost of models and the "
    "picture of the surface want axes along x and y, and are left out"
)


def prepare(scene: Scene) -> tuple[StdFit | None, list[str]]:
    """Look at the scene's file before anything is traced: its fit, and notes for people.

    None and no notes if the surface is generated.

    Raises
    ------
    InputError
        If the file can't be used, or no theory can be fitted to it.

    """
    file = scene.surface.file
    if file is None:
        return None, []
    notes = notes_on_file(scene)
    try:
        fit = fit_std(surface_of(scene, 0, 0))
    except InputError as error:
        raise InputError(f"{file}: {error}") from error
    fitted_scene(scene, fit)
    if fit.flat:
        notes.append(
            f"{file}: {fit.flat:.1%} of its facets are flat, which no STD has: a plateau, a filled "
            "gap or a coarse step of heights"
        )
    if has_lay(fit):
        along = f"{file}: its slopes have axes: σ = {fit.sigma_x:.3g} and {fit.sigma_y:.3g}"
        turn = turn_of(fit)
        notes.append(
            f"{along} along them, the first at azimuth {turn:.1f}°: {_TURNED}"
            if turn
            else f"{along} along x and y"
        )
    return fit, notes


def has_lay(fit: StdFit) -> bool:
    """Whether the slopes have a direction, beyond chance and beyond what matters."""
    ratio = max(fit.sigma_x, fit.sigma_y) / min(fit.sigma_x, fit.sigma_y)
    return not fit.isotropic and ratio > LEAST_RATIO


def turn_of(fit: StdFit) -> float:
    """Azimuth in degrees of the axis of σ_x, 0 if that of x is in its interval."""
    if not has_lay(fit) or fit.azimuth is None or fit.azimuth_ci is None:
        return 0.0
    return 0.0 if fit.azimuth_ci[0] <= 0 <= fit.azimuth_ci[1] else fit.azimuth


def turned(theory: Scene, degrees: float) -> Scene:
    """The scene seen from its slopes' axes, which are turned by so many degrees from x."""
    phi = tuple((phi - degrees) % 360 for phi in theory.light.phi)
    return replace(theory, light=replace(theory.light, phi=phi))


def fitted_scene(scene: Scene, fit: StdFit) -> Scene:
    """The scene with the roughness fitted to its surface in place of the stated one.

    Raises
    ------
    InputError
        If no model exists with it: γ ≤ 3/2, or σ out of the limits of a `Roughness`.

    """
    gamma = min(fit.gamma, BECKMANN)
    sigma = (fit.sigma_x, fit.sigma_y) if has_lay(fit) else (fit.sigma,)
    try:
        rough = replace(scene.roughness, gamma=gamma, sigma=sigma)
    except InputError as error:
        flat = f"; {fit.flat:.1%} of its facets are flat, which may be why" if fit.flat else ""
        raise InputError(
            f"{scene.surface.file}: its slopes fit γ = {fit.gamma:.4g}, σ = {fit.sigma:.4g}, for "
            f"which there is no theory ({error}){flat}. `microsurf measure --surface` needs none"
        ) from error
    return replace(scene, roughness=rough)


def fit_as_json(fit: StdFit) -> dict[str, Any]:
    """Figures of a fit for report.json."""
    return _finite({**vars(fit), "isotropic": fit.isotropic})


def _finite(values: dict[str, Any]) -> dict[str, Any]:
    """JSON has no ∞: a figure without bound becomes the text "inf"."""

    def plain(value: Any) -> Any:
        if isinstance(value, tuple):
            return [plain(v) for v in value]
        return "inf" if isinstance(value, float) and np.isinf(value) else value

    return {key: plain(value) for key, value in values.items()}
