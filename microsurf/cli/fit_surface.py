"""What `microsurf fit` does with a measured surface."""

from contextlib import ExitStack
from pathlib import Path
from typing import Any

from ..analysis.surface_fit.study import SurfaceStudy, as_json, study_surface
from ..errors import InputError
from ..files import check_writable, whole_file
from ..report.figures import surface_fit as drawn
from ..report.figures.figure import write
from ..scene import BECKMANN, Roughness, Scene, Surface
from ..surface import level, notes_on_surface, read_asked
from .output import check_ending, number

FIGURES = (".png", ".pdf", ".svg")


def fit_surface_command(
    surface: Surface,
    *,
    levelled: bool,
    out: Path | None = None,
    figure: Path | None = None,
) -> dict[str, Any]:
    """Fit a file and return the figures to print; see `analysis.surface_fit`.

    Parameters
    ----------
    surface : Surface
        The file and how to read it.
    levelled : bool
        Whether ``surface.level`` was given; else a surface that is no period of a periodic
        one has its quadratic taken out.
    out, figure : Path, optional
        A scene that validates the fit (.toml), and a picture. Nothing is written if the
        fit fails, or there is no room for the picture.

    Raises
    ------
    InputError
        If the file or an option is not as it must be, or no STD fits.

    """
    for wanted, endings in ((out, (".toml",)), (figure, FIGURES)):
        if wanted is not None:
            check_ending(wanted, *endings)
            check_writable(wanted)
    stored = read_asked(surface)
    form = surface.level if levelled or stored.boundary == "periodic" else "quadratic"
    plane = level(stored, form)
    try:
        study = study_surface(stored, plane)
    except InputError as error:
        raise InputError(f"{surface.file}: {error}") from error
    scene = None if out is None else scene_of(study, surface, form, out)
    with ExitStack() as files:  # the picture, the larger one, takes its name last
        if figure is not None:
            path = files.enter_context(whole_file(figure))
            write(drawn.figure(drawn.rows(study), study), path)
        if out is not None and scene is not None:
            scene.write(out)
    written = [str(path) for path in (out, figure) if path is not None]
    return {**as_json(study), "notes": notes_on_surface(surface, plane), "files": written}


def table(values: dict[str, Any]) -> dict[str, Any]:
    """Return the figures as people read them: a line for each model and each scale."""
    shown = {
        k: v for k, v in values.items() if k not in ("models", "scales", "provenance", "notes")
    }
    for name, model in values["models"].items():
        shown[f"{name}, fitted"] = f"σ {model['sigma']:.4g}, KS {model['ks']:.3g}"
    for row in values["scales"][1:]:
        pixel = " × ".join(f"{side:.4g}" for side in row["pixel"])
        gamma, sigma = _with_interval(row, "gamma"), _with_interval(row, "sigma")
        shown[f"at pixel {pixel}"] = f"γ {gamma}, σ {sigma}, KS {row['ks']:.3g}"
    return shown


def _with_interval(row: dict[str, Any], name: str) -> str:
    low, high = map(number, row[f"{name}_ci"])
    return f"{number(row[name])} [{low}, {high}]"


def scene_of(study: SurfaceStudy, surface: Surface, form: str, out: Path) -> Scene:
    """Scene that traces the surface and compares it with its own fit.

    Raises
    ------
    InputError
        If the fit is one for which there is no theory.

    """
    fit = study.fit
    sigma = (fit.sigma,) if fit.isotropic else (fit.sigma_x, fit.sigma_y)
    try:
        roughness = Roughness(min(fit.gamma, BECKMANN), sigma)
    except InputError as error:
        raise InputError(f"{out}: no scene for this fit ({error}); fit without --out") from error
    axes = "" if fit.azimuth is None else f", axes at {fit.azimuth:.1f}°"
    return Scene(
        title=f"{Path(str(surface.file)).stem}: γ = {fit.gamma:.3g}, σ = {fit.sigma:.3g}{axes}",
        rationale="A measured surface against STD fitted to its slopes by microsurf fit.",
        roughness=roughness,
        surface=Surface(
            file=surface.file, spacing=surface.spacing, boundary=study.surface.boundary, level=form,
            channel=surface.channel, voids=surface.voids, height_unit=surface.height_unit,
            void_value=surface.void_value,
        ),
    )  # fmt: skip
