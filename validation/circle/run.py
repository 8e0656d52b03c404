"""The whole circle: surface → γ, σ → BRDF, and BRDF → fit → surface → BRDF, in one figure.

    MICROSURF_DATA=FOLDER python -m validation.circle.run

FOLDER/topography/di-4.di is a surface seen by an atomic force microscope (SurfaceTopography's
examples), FOLDER/brdf/garnet_red.brdf a paint (Cornell, as distributed with pbrt-v2). Neither is
ours to pass on. Left: the measured surface traced, and the theory with the STD fitted to
its slopes. Right: what the instrument saw, the fit, and light traced on a surface made with
the fitted slopes, which knows nothing of the fit's formulas. Writes circle.png,
and the lobes of the left as relief.csv, to reports/circle.
"""

import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import NDArray

from microsurf import measure, model
from microsurf.analysis.brdf_fit.fit import BrdfFit, fit_brdf
from microsurf.analysis.brdf_fit.scene_of import scene_of
from microsurf.analysis.fitted_theory import fitted_scene, turn_of, turned
from microsurf.cli.save import rounded, save
from microsurf.report.figures import lobes
from microsurf.report.figures.figure import DPI
from microsurf.report.figures.style import (
    BLUE,
    GREY,
    SMALL,
    VERMILION,
    clean,
    new_figure,
    own_style,
)
from microsurf.results import datasets
from microsurf.results.measured_brdf import read_brdf
from microsurf.scene import Accuracy, Light, Material, Scene, Surface
from microsurf.surface import fit_std, surface_of

OUT = Path(__file__).parents[2] / "reports" / "circle"
METAL = Material(0.21, (), 3.27)
"""Gold at 600 nm: what the surface is made of is not known, and any material will do."""
THETAS = (30.0, 60.0)
PAINT = (30.0, 50.0)
"""Beyond, the lobe is narrower across than the sectors of 10° over which the tracer averages it."""
CHANNEL = "650 nm"
NEAR = 6.0
"""Degrees from the plane of incidence of pairs that are drawn."""
PATHS = 400_000
Array = NDArray[np.float64]
Row = dict[str, Any]


def of_surface(file: Path) -> tuple[list[Row], str]:
    """Lobes of a measured surface, traced and predicted from its slopes alone."""
    given = Surface(file=str(file), level="quadratic", boundary="mirror")
    scene = Scene(surface=given, material=METAL, light=Light(THETAS), accuracy=Accuracy(PATHS))
    surface = surface_of(scene, 0, 0)
    fit = fit_std(surface)
    theory = fitted_scene(scene, fit)
    traced = measure(scene, [surface], progress=True)
    predicted = model.predict(turned(theory, turn_of(fit)), "smith")
    predicted = predicted.assign_coords(phi_i=list(theory.light.phi))
    table = lobes.rows(traced, {"smith": predicted}, theory, 0.0)
    said = f"γ = {fit.gamma:.2f}, σ = {fit.sigma_x:.3f} and {fit.sigma_y:.3f}"
    return [row for row in table if row["quantity"] == "specular"], said


def at_pairs(traced: xr.Dataset, scene: Scene, kd: float, fit: BrdfFit) -> Array:
    """Traced BRDF at the measured pairs in sr⁻¹: of the sector, between the rings' middles."""
    seen = fit.measured
    density = datasets.brdf(datasets.by_kind(traced.flux, scene.material.n, kd))
    total = density.sum(("order", "kind")).mean("realisation").isel(phi_i=0)
    width = 360 / total.sizes["phi_o"]
    turn = np.degrees(seen.phi_o - seen.phi_i) % 360
    sector = np.rint(turn / width).astype(int) % total.sizes["phi_o"]
    value = np.zeros(seen.pairs)
    rings = np.degrees(seen.theta_o)
    for t, theta in enumerate(scene.light.theta):
        for k in np.unique(sector):
            mine = (np.abs(np.degrees(seen.theta_i) - theta) < 0.1) & (sector == k)
            column = total.isel(theta_i=t, phi_o=int(k))
            value[mine] = np.interp(rings[mine], column.theta_o.values, column.values)
    return value


def of_brdf(file: Path) -> tuple[list[Row], str]:
    """Pairs of a measured BRDF with the fit and the light traced on a surface of its slopes."""
    fit = fit_brdf(read_brdf(file))
    at = fit.measured.channels.index(CHANNEL)
    whole = scene_of(fit)
    kd = whole.material.kd[at]
    theta = np.unique(np.degrees(fit.measured.theta_i).round(2))
    scene = replace(
        whole,
        material=replace(whole.material, kd=(kd,)),
        surface=Surface(cells=1024, realisations=2),
        light=Light(tuple(theta[theta <= PAINT[-1]].tolist())),
        accuracy=Accuracy(PATHS),
    )
    traced = at_pairs(measure(scene, progress=True), scene, kd, fit)
    seen, cosine = fit.measured, np.cos(fit.measured.theta_o)
    turn = np.degrees(seen.phi_o - seen.phi_i) % 360
    columns = {
        "theta_i_deg": np.degrees(seen.theta_i).round(2),
        "theta_o_deg": np.where(np.cos(np.radians(turn)) < 0, 1, -1) * np.degrees(seen.theta_o),
        "from_plane_deg": np.minimum(np.abs(turn - 180), np.minimum(turn, 360 - turn)),
        "measured": seen.values[:, at],
        "fitted": fit.best.brdf[:, at],
        "traced": traced,
    }
    inside = columns["theta_i_deg"] <= PAINT[-1]
    names = ("measured", "fitted", "traced")
    logs = {name: np.log1p(columns[name] * cosine)[inside] for name in names}
    apart = {
        name: float(np.sqrt(np.mean((logs[name] - logs[other]) ** 2)))
        for name, other in (("fitted", "measured"), ("traced", "measured"))
    }
    rough = scene.roughness
    said = (
        f"γ = {rough.gamma:.2f}, σ = {rough.sigma_x:.3f}; "
        f"pairs within {NEAR:g}° of the plane;\n"
        rf"rms of $\Delta\,\ln(1 + f\,\cos\theta_o)$ up to {PAINT[-1]:g}°: "
        f"fit {apart['fitted']:.4f}, traced {apart['traced']:.4f}"
    )
    rows = np.stack(list(columns.values()), axis=1)[inside]
    return [dict(zip(columns, map(float, row), strict=True)) for row in rows], said


def draw_surface(axes: Axes, rows: list[Row], said: str) -> None:
    """Points traced with their 95 % intervals, lines predicted, a colour each angle."""
    for theta, color in zip(THETAS, (BLUE, VERMILION), strict=True):
        for source, style in (("measured", "o"), ("smith", "-")):
            mine = [r for r in rows if r["theta_i_deg"] == theta and r["source"] == source]
            word = "traced on it" if source == "measured" else "Smith, fitted slopes"
            axes.plot(
                [r["theta_o_deg"] for r in mine], [r["brdf_per_sr"] for r in mine], style,
                color=color, markersize=3, label=f"{theta:g}°, {word}",
            )  # fmt: skip
            if source == "measured":
                low, high = (np.array([r[end] for r in mine]) for end in ("low", "high"))
                axes.vlines([r["theta_o_deg"] for r in mine], low, high, color=color, linewidth=0.8)
    axes.set(title=f"a measured surface, as gold: {said}; bars 95 %", ylim=(1e-2, None))


def draw_brdf(axes: Axes, rows: list[Row], said: str) -> None:
    """Pairs near the plane of incidence: x measured, + fitted, circles traced."""
    for theta, color in zip(PAINT, (BLUE, VERMILION), strict=True):
        mine = [r for r in rows if r["theta_i_deg"] == theta and r["from_plane_deg"] < NEAR]
        mine.sort(key=lambda r: r["theta_o_deg"])
        x = [r["theta_o_deg"] for r in mine]
        for name, style, word in (
            ("measured", "x", "instrument"), ("fitted", "+", "fit, all orders"),
            ("traced", "o", "traced on a surface of the fit"),
        ):  # fmt: skip
            axes.plot(
                x, [r[name] for r in mine], style, color=color, markersize=4.5,
                markerfacecolor="none", label=f"{theta:g}°, {word}",
            )  # fmt: skip
    axes.set(title=f"a measured paint, {CHANNEL}: {said}", ylim=(2e-2, None))


@own_style()
def main() -> None:
    """Write the figure and its numbers."""
    folder = os.environ.get("MICROSURF_DATA")
    if not folder:
        sys.exit("MICROSURF_DATA: name the folder of topography/di-4.di and brdf/garnet_red.brdf")
    relief, of_slopes = of_surface(Path(folder) / "topography" / "di-4.di")
    paint, of_paint = of_brdf(Path(folder) / "brdf" / "garnet_red.brdf")
    figure = new_figure(7.6)
    axes = figure.subplots(2, 1)
    draw_surface(axes[0], relief, of_slopes)
    draw_brdf(axes[1], paint, of_paint)
    for one in axes:
        one.set(
            yscale="log", xlim=(-90, 90), xticks=np.arange(-90, 91, 30),
            xlabel=r"$\theta_o$ in the plane of incidence (°), mirror side positive",
            ylabel="BRDF (1/sr)",
        )  # fmt: skip
        one.title.set_fontsize(9)
        one.axvline(0, color=GREY, linewidth=0.5)
        one.legend(fontsize=SMALL, frameon=False)
        clean(one)
    OUT.mkdir(parents=True, exist_ok=True)
    save(OUT, {"circle.png": figure, "relief.csv": rounded(relief, 4)}, DPI)
    sys.stdout.write(f"{of_slopes}\n{of_paint}\n")


if __name__ == "__main__":
    main()
