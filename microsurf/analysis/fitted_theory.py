"""The theory of a surface from a file: STD fitted to its slopes, before anything is traced."""

from dataclasses import replace
from typing import Any

import numpy as np

from ..errors import InputError
from ..scene import BECKMANN, Scene
from ..surface import StdFit, fit_std, notes_on_file, surface_of
from .comparison import ComparisonTable

_DIRECTED = "the fit is isotropic, so nothing here is a verdict about the theory"


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
    if fit.anisotropy.directed:
        notes.append(
            f"{file}: its slopes have a direction: σ at azimuth {fit.anisotropy.azimuth:.0f}° is "
            f"{fit.anisotropy.ratio:.3g} times that across (p = {fit.anisotropy.p_value:.1g}); "
            f"{_DIRECTED}"
        )
    return fit, notes


def fitted_scene(scene: Scene, fit: StdFit) -> Scene:
    """The scene with the roughness fitted to its surface in place of the stated one.

    Raises
    ------
    InputError
        If no model exists with it: γ ≤ 3/2, or σ out of the limits of a `Roughness`.

    """
    gamma = min(fit.gamma, BECKMANN)
    try:
        rough = replace(scene.roughness, gamma=gamma, sigma=(fit.sigma,))
    except InputError as error:
        flat = f"; {fit.flat:.1%} of its facets are flat, which may be why" if fit.flat else ""
        raise InputError(
            f"{scene.surface.file}: its slopes fit γ = {fit.gamma:.4g}, σ = {fit.sigma:.4g}, for "
            f"which there is no theory ({error}){flat}. `microsurf measure --surface` needs none"
        ) from error
    return replace(scene, roughness=rough)


def guarded(rows: ComparisonTable, fit: StdFit) -> ComparisonTable:
    """Decide nothing where the fit is of another family than the surface: slopes of a direction."""
    if not fit.anisotropy.directed:
        return rows
    return ComparisonTable(replace(row, verdict="undecided", why=_DIRECTED) for row in rows)


def fit_as_json(fit: StdFit) -> dict[str, Any]:
    """Figures of a fit for report.json."""
    anisotropy = fit.anisotropy
    return _finite(
        {**vars(fit), "anisotropy": _finite({**vars(anisotropy), "directed": anisotropy.directed})}
    )


def _finite(values: dict[str, Any]) -> dict[str, Any]:
    """JSON has no ∞: a figure without bound becomes the text "inf"."""

    def plain(value: Any) -> Any:
        if isinstance(value, tuple):
            return [plain(v) for v in value]
        return "inf" if isinstance(value, float) and np.isinf(value) else value

    return {key: plain(value) for key, value in values.items()}
