"""What `microsurf fit` does with a measured BRDF."""

import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from ..analysis.brdf_fit.fit import fit_brdf
from ..analysis.brdf_fit.held_out import HELD_OUT
from ..analysis.brdf_fit.later_orders import WALKS
from ..analysis.brdf_fit.scene_of import scene_of
from ..analysis.brdf_fit.summary import figures
from ..analysis.brdf_fit.verdict import MARGIN
from ..files import check_writable, whole_file
from ..report.figures import brdf_fit as drawn
from ..report.figures.figure import write
from ..results.measured_brdf import read_brdf, write_csv
from .output import check_ending, number

FIGURES = (".png", ".pdf", ".svg")


def fit_brdf_command(
    path: Path,
    *,
    material: str = "interfaced-lambertian",
    anisotropic: bool = False,
    aperture: float | None = None,
    orders: str = "all",
    hold_out: tuple[float, ...] = HELD_OUT,
    margin: float = MARGIN,
    walks: int = WALKS,
    seed: int = 0,
    out: Path | None = None,
    figure: Path | None = None,
    pairs: Path | None = None,
) -> dict[str, Any]:
    """Fit a file and return the figures to print; see `analysis.brdf_fit.fit`.

    ``out`` takes a scene (.toml), ``figure`` a picture, ``pairs`` the pairs as CSV. Nothing
    is written if the fit fails, or there is no room for the picture.

    Raises
    ------
    InputError
        If the file or an option is not as it must be.

    """
    for wanted, endings in ((out, (".toml",)), (figure, FIGURES), (pairs, (".csv",))):
        if wanted is not None:
            check_ending(wanted, *endings)
            check_writable(wanted)
    begin = time.perf_counter()
    measured = read_brdf(path)
    fit = fit_brdf(
        measured,
        material,
        isotropic=not anisotropic,
        aperture=aperture,
        orders=orders,
        hold_out=hold_out,
        margin=margin,
        walks=walks,
        seed=seed,
    )
    values = {**figures(fit), "seconds": time.perf_counter() - begin}
    with ExitStack() as files:  # the picture, the largest, takes its name last
        if figure is not None:
            write(drawn.figure(fit), files.enter_context(whole_file(figure)))
        if out is not None:
            scene_of(fit).write(out)
        if pairs is not None:
            write_csv(measured, pairs)
    return {**values, "files": [str(path) for path in (out, figure, pairs) if path is not None]}


def table(values: dict[str, Any]) -> dict[str, Any]:
    """Return the figures as people read them: no lists by channel or by zone."""
    lists = ("zones", "distributions", "one_order", "evidence", "wavelengths")
    shown = {k: v for k, v in values.items() if k not in lists}
    channels = values["channels"]
    shown["channels"] = f"{channels[0]} … {channels[-1]}" if len(channels) > 3 else channels
    for name in ("kd", "n", "k"):
        if isinstance(values.get(name), list):
            shown.pop(f"{name}_ci", None)
            shown[name] = _range(values[name])
    if values["gamma"] is not None:
        shown["gamma"] = number(values["gamma"])
    if values.get("gamma_ci"):
        shown["gamma_ci"] = "  ".join(map(number, values["gamma_ci"]))
    for name, other in values["distributions"].items():
        sigma = other.get("sigma")
        shown[f"{name}, order 1"] = (
            f"γ {number(other['gamma'])}, σ {number(sigma)}, log rms {other['log_rms']:.3g}"
        )
    for name, row in values["evidence"].items():
        shown[f"std against {name}"] = (
            f"better at {row['better']} of {row['of']} incidences left out, p {row['p']:.2g}"
        )
    return shown


def _range(values: list[float]) -> str:
    return f"{np.min(values):.4g} … {np.max(values):.4g} ({len(values)} channels)"
