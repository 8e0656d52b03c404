"""The figures of the papers, each with the explicit surface beside the theory.

`make gallery` writes them to reports/gallery. The sets of parameters are those of
Ribardière et al., Workshop on Material Appearance Modeling, 2018, who give no Kd; it is
0.8 here. Points are traced on surfaces of 512² cells, with 95 % bands over them; lines
are theory, all averaged over the detector's bins of 2° by 10°.
"""

import sys
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from tqdm import tqdm

from microsurf import generate_surface, measure, model, predict
from microsurf.report.figures.bands import cut
from microsurf.report.figures.figure import write
from microsurf.report.figures.style import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    VERMILION,
    WIDTH,
    own_style,
    source_style,
)
from microsurf.scene import BECKMANN, Accuracy, Effects, Light, Material, Roughness, Scene, Surface
from microsurf.stats import intervals

OUT = Path(__file__).parents[2] / "reports" / "gallery"
KD = 0.8
WALKS = 4_000_000
LINES = ((BLUE, "-", "o"), (VERMILION, "--", "s"), (BLACK, ":", "^"), (ORANGE, "-.", "D"))


def scene(
    gamma: float, sigma: float, n: float, theta: float = 60.0, *, again: bool = True
) -> Scene:
    """One material at one incidence, traced with 1.6 million paths on four surfaces."""
    return Scene(
        material=Material(n, (KD,)),
        roughness=Roughness(gamma, (sigma,)),
        surface=Surface(realisations=4),
        light=Light((theta,)),
        accuracy=Accuracy(400_000),
        effects=Effects(multiple_scattering=again),
    )


def curve(
    dataset: xr.Dataset, asked: Scene, order: int | None, kind: str | None = None
) -> xr.DataArray:
    """BRDF in the plane of incidence, of one order or of all, of one kind or of both together."""
    kd = asked.material.kd[0]
    density = cut(dataset.isel(theta_i=0, phi_i=0), asked, kd)
    density = density.sum("kind") if kind is None else density.sel(kind=kind)
    return density.sum("order") if order is None else density.sel(order=order)


def points(axes: Axes, measured: xr.Dataset, asked: Scene, style: tuple[str, str, str],
           label: str, order: int | None = 1, kind: str | None = None) -> None:  # fmt: skip
    """Measured BRDF with its 95 % band over the realisations."""
    colour, _, marker = style
    values = curve(measured, asked, order, kind)
    mean = values.mean("realisation").values
    band = intervals.half_width_of_mean(values.transpose("realisation", ...).values)
    low = np.maximum(mean - band, 1e-12)
    axes.fill_between(values.theta_o, low, mean + band, color=colour, alpha=0.2, lw=0)
    axes.plot(values.theta_o, np.where(mean > 0, mean, np.nan), ls="none", marker=marker, ms=2.2,
              color=colour, fillstyle="none", mew=0.6, label=label)  # fmt: skip


def line(axes: Axes, theory: xr.Dataset, asked: Scene, style: tuple[str, str, str],
         label: str, order: int | None = 1, kind: str | None = None) -> None:  # fmt: skip
    """Predicted BRDF."""
    colour, dash, _ = style
    values = curve(theory, asked, order, kind).isel(realisation=0)
    axes.plot(values.theta_o, np.where(values > 0, values, np.nan), ls=dash, lw=1.1, color=colour,
              label=label)  # fmt: skip


def finish(figure: Figure, panels: np.ndarray, name: str, low: float = 3e-2) -> None:
    """Axes, one legend for all panels, and the file."""
    drawn = [line.get_ydata() for axes in panels.ravel() for line in axes.lines]
    top = 1.5 * np.nanmax(np.concatenate(drawn))
    for axes in panels.ravel():
        axes.set(yscale="log", xlim=(-90, 90), xticks=np.arange(-90, 91, 30), ylim=(low, top))
        axes.grid(visible=True, color="#dddddd", linewidth=0.5)
        axes.spines[["top", "right"]].set_visible(False)
    for axes in panels[-1]:
        axes.set_xlabel(r"$\theta_o$ (°), mirror side positive", fontsize=9)
    for axes in panels[:, 0]:
        axes.set_ylabel("BRDF (1/sr)")
    handles = {
        label: handle
        for axes in panels.ravel()
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    handles["bands: 95 %"] = Patch(color=GREY, alpha=0.3, linewidth=0)
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=3,
                  fontsize=8, frameon=False, title=f"Kd = {KD:g}", title_fontsize=8)  # fmt: skip
    save(figure, name)


def save(figure: Figure, name: str) -> None:
    """Write one picture, small enough for the repository."""
    write(figure, OUT / f"{name}.png", dpi=150)


def lobes_over_n_and_sigma() -> None:
    """Order 1 at 60°, Beckmann and STD, under both maskings."""
    figure = Figure(figsize=(WIDTH, 7.6), layout="constrained")
    panels = figure.subplots(3, 2, sharex=True, sharey=True)
    for row, n in zip(panels, (1.2, 1.5, 2.0), strict=True):
        for axes, sigma in zip(row, (0.3, 0.7), strict=True):
            for style, gamma, name in (
                (LINES[0], BECKMANN, "Beckmann"),
                (LINES[1], 1.75, "STD γ = 1.75"),
            ):
                asked = scene(gamma, sigma, n)
                line(axes, predict(asked), asked, (style[0], "-", ""), f"{name}, Smith")
                line(axes, predict(asked, "vcavity"), asked, (style[0], ":", ""),
                     f"{name}, V-cavity")  # fmt: skip
                points(axes, measure(asked), asked, style, f"{name}, traced")
            axes.set_title(f"n = {n:g}, σ = {sigma:g}, $\\theta_i$ = 60°", fontsize=9)
    finish(figure, panels, "lobes-n-sigma")


def effect_of_gamma() -> None:
    """Order 1 over γ at two σ."""
    figure = Figure(figsize=(WIDTH, 3.9), layout="constrained")
    panels = figure.subplots(1, 2, sharex=True, sharey=True, squeeze=False)
    for axes, sigma in zip(panels[0], (0.3, 0.7), strict=True):
        for style, gamma in zip(LINES, (1.75, 2.0, 4.0, 40.0), strict=True):
            asked = scene(gamma, sigma, 1.5)
            line(axes, predict(asked), asked, style, f"γ = {gamma:g}, Smith")
            points(axes, measure(asked), asked, style, f"γ = {gamma:g}, traced")
        axes.set_title(f"n = 1.5, σ = {sigma:g}, $\\theta_i$ = 60°", fontsize=9)
    finish(figure, panels, "effect-of-gamma")


def effect_of_masking() -> None:
    """Masking functions at γ = 1.75, n = 1.5, σ = 0.7."""
    figure = Figure(figsize=(WIDTH, 3.9), layout="constrained")
    panels = figure.subplots(1, 2, sharex=True, sharey=True, squeeze=False)
    labels = {"smith": "Smith, height-correlated", "smith-separable": "Smith, separable",
              "vcavity": "V-cavity"}  # fmt: skip
    for axes, theta in zip(panels[0], (30.0, 60.0), strict=True):
        asked = scene(1.75, 0.7, 1.5, theta)
        for style, (name, label) in zip(LINES, labels.items(), strict=False):
            line(axes, predict(asked, name), asked, style, label)
        points(axes, measure(asked), asked, (GREY, "", "o"), "traced")
        axes.set_title(f"γ = 1.75, n = 1.5, σ = 0.7, $\\theta_i$ = {theta:g}°", fontsize=9)
    finish(figure, panels, "effect-of-masking")


def multiple_scattering() -> None:
    """One order and all of them, for the two materials of the slides."""
    figure = Figure(figsize=(WIDTH, 3.9), layout="constrained")
    panels = figure.subplots(1, 2, sharex=True, squeeze=False)
    cases = ((8.0, 0.7, 1.0), (1.75, 0.5, 1.5))
    for axes, (gamma, sigma, n) in zip(panels[0], cases, strict=True):
        asked = scene(gamma, sigma, n)
        traced = measure(asked)
        line(axes, predict(asked), asked, LINES[0], "Smith, order 1")
        points(axes, traced, asked, LINES[0], "traced, order 1")
        for style, kind in ((LINES[1], "smith-walk"), (LINES[3], "vcavity-walk")):
            walked = model.walk(asked, kind, walks=WALKS)
            line(axes, walked, asked, style, source_style(kind).name, None)
        points(axes, traced, asked, LINES[1], "traced, all orders", None)
        axes.set_title(f"n = {n:g}, γ = {gamma:g}, σ = {sigma:g}, $\\theta_i$ = 60°", fontsize=9)
    finish(figure, panels, "multiple-scattering", low=5e-2)


def profiles() -> None:
    """The surfaces themselves: same σ, same seed, three tails."""
    figure = Figure(figsize=(WIDTH, 5.0), layout="constrained")
    panels = figure.subplots(3, 1, sharex=True)
    for axes, gamma in zip(panels, (1.75, 2.0, 40.0), strict=True):
        heights = generate_surface(gamma, 0.5, cells=512, seed=3).heights
        relief = np.ptp(heights, axis=1)
        row = heights[np.argsort(relief)[len(relief) // 2]]
        axes.plot(row - row.mean(), color=BLACK, lw=0.8)
        axes.set_title(
            f"γ = {gamma:g}, σ = 0.5: the row of median relief; of all rows the largest relief is "
            f"{relief.max():.0f} cells",
            fontsize=9,
        )
        axes.set(ylabel="height (cells)", xlim=(0, 512))
        axes.spines[["top", "right"]].set_visible(False)
    panels[-1].set_xlabel("x (cells)")
    save(figure, "profiles")


FIGURES = (profiles, effect_of_masking, multiple_scattering, effect_of_gamma,
           lobes_over_n_and_sigma)  # fmt: skip


@own_style()
def main() -> None:
    """Draw the figures named on the command line, or all of them."""
    OUT.mkdir(parents=True, exist_ok=True)
    chosen = [draw for draw in FIGURES if not sys.argv[1:] or draw.__name__ in sys.argv[1:]]
    for draw in tqdm(chosen, desc="gallery", disable=None):
        draw()


if __name__ == "__main__":
    main()
