"""The figures of the atlas: what is measured over Smith, and the structures themselves."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from microsurf import generate_surface
from microsurf.report.figures import figure as figure_file
from microsurf.report.figures.style import BLACK, BLUE, GREY, ORANGE, VERMILION, own_style
from microsurf.scene import STRUCTURES
from microsurf.stats import intervals

Row = dict[str, Any]

GREEN = "#009E73"
SURFACES = {
    "independent": (BLACK, "o", "independent of height"),
    "tops": (VERMILION, "^", "steep at the tops"),
    "middle": (BLUE, "s", "steep in the middle"),
    "extremes": (ORANGE, "D", "steep at both extremes"),
}
THEORIES = {
    "smith-separable": (GREY, "--", "Smith, separable G2"),
    "vcavity-walk": (GREEN, ":", "V-cavity"),
}
ROWS = {
    "total": "total albedo",
    "body": "order-1 body",
    "specular": "order-1 specular",
    "mirror": "order-1 specular,\nnear the mirror direction",
}
LOGARITHMIC = {"specular": (0.5, 1, 2), "mirror": (0.01, 0.1, 1, 10)}
"""Ticks of the rows that span more than a factor of two."""
AGAINST = {"total": "smith-walk"}
"""What a quantity is divided by; order 1 by ``smith``."""


def ratios(rows: list[Row], shown: Row, source: str, quantity: str) -> tuple[np.ndarray, ...]:
    """θ_i, values over Smith's and half of their 95 % intervals; nothing where not computed."""
    asked = shown | {"source": source, "quantity": quantity}
    if "correlation" in shown and source not in SURFACES:
        asked.pop("correlation")
    mine = [row for row in rows if row.items() >= asked.items()]
    base = {
        row["theta_i"]: row["value"]
        for row in rows
        if row["source"] == AGAINST.get(quantity, "smith")
        and (row["gamma"], row["sigma"], row["quantity"])
        == (shown["gamma"], shown["sigma"], quantity)
    }
    theta, value, error, count = (
        np.array([row[key] for row in mine], float)
        for key in ("theta_i", "value", "error", "surfaces")
    )
    smith = np.array([base[row["theta_i"]] for row in mine])
    of_surfaces = source in SURFACES
    factor = [
        intervals.student(max(k - 1, 1)) if of_surfaces else intervals.normal() for k in count
    ]
    return theta, value / smith, np.array(factor) * error / smith


def atlas(rows: list[Row], gammas: tuple[float, ...], sigma: float, length: float) -> Figure:
    """A row of panels for each quantity, a column for each γ."""
    figure = Figure(figsize=(9.6, 9.0), layout="constrained")
    panels = figure.subplots(len(ROWS), len(gammas), sharex=True, sharey="row", squeeze=False)
    for k, (quantity, name) in enumerate(ROWS.items()):
        for gamma, panel in zip(gammas, panels[k], strict=True):
            shown = {"gamma": gamma, "sigma": sigma, "correlation": length}
            _panel(panel, rows, shown, quantity)
            if k == 0:
                panel.set_title(rf"$\gamma$ = {gamma:g}", fontsize=10)
        if quantity in LOGARITHMIC:
            ticks = LOGARITHMIC[quantity]
            panels[k, 0].set_yscale("log")
            panels[k, 0].set_yticks(ticks, [f"{tick:g}" for tick in ticks])
            panels[k, 0].yaxis.set_minor_formatter(NullFormatter())
        panels[k, 0].set_ylabel(f"{name}\nover Smith", fontsize=9)
    figure.supxlabel(r"incidence $\theta_i$ (°)", fontsize=10)
    handles, labels = panels[1, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3, frameon=False, fontsize=9)
    return figure


def _panel(panel: Axes, rows: list[Row], shown: Row, quantity: str) -> None:
    panel.axhline(1, color=GREY, linewidth=1.2, label="Smith, height-correlated (total: its walk)")
    for source, (colour, style, label) in THEORIES.items():
        theta, ratio, _ = ratios(rows, shown, source, quantity)
        panel.plot(theta, ratio, color=colour, linestyle=style, linewidth=1.6, label=label)
    for source, (colour, marker, label) in SURFACES.items():
        theta, ratio, band = ratios(rows, shown, source, quantity)
        panel.plot(theta, ratio, color=colour, marker=marker, markersize=3.5, linewidth=1.1,
                   label=label)  # fmt: skip
        low = np.maximum(ratio - band, 4e-3)  # an axis in logarithms has no zero
        panel.fill_between(theta, low, ratio + band, color=colour, alpha=0.2, linewidth=0)
    panel.set_xlim(0, 90)
    panel.set_xticks([0, 30, 60, 90])
    panel.tick_params(labelsize=8)
    panel.grid(visible=True, color="#dddddd", linewidth=0.5)
    panel.spines[["top", "right"]].set_visible(False)


def profiles(gamma: float, sigma: float) -> Figure:
    """A cut through a surface of each structure, with facets in the steepest tenth marked."""
    figure = Figure(figsize=(9.0, 6.4), layout="constrained")
    panels = figure.subplots(len(STRUCTURES), 1, sharex=True, sharey=True)
    for structure, panel in zip(STRUCTURES, panels, strict=True):
        made = generate_surface(gamma, sigma, correlation=16.0, structure=structure, seed=3)
        heights = made.heights - np.median(made.heights)
        steep = np.hypot(*np.gradient(heights)).ravel()
        limit = np.quantile(steep, 0.9)
        cut = heights[200]
        slope = np.hypot(*np.gradient(heights))[200]
        x = np.arange(len(cut)) / 16
        colour, marker, label = SURFACES[structure]
        panel.plot(x, cut / 16, color=GREY, linewidth=0.9)
        at = slope > limit
        panel.plot(x[at], cut[at] / 16, color=colour, marker=marker, markersize=2.5,
                   linestyle="none")  # fmt: skip
        panel.set_title(label, fontsize=9, loc="left")
        panel.spines[["top", "right"]].set_visible(False)
    panels[-1].set_xlabel("x / correlation length", fontsize=9)
    figure.supylabel("height / correlation length", fontsize=9)
    figure.suptitle(
        rf"Cuts through surfaces of the same slopes ($\gamma$ = {gamma:g}, $\sigma$ = {sigma:g}); "
        "marked: the steepest tenth",
        fontsize=10,
    )
    return figure


@own_style()
def write(rows: list[Row], out: Path) -> None:
    """Write both figures, as pictures and to be printed."""
    gammas = tuple(dict.fromkeys(row["gamma"] for row in rows))
    for name, figure in (
        ("atlas", atlas(rows, gammas, 0.5, 8.0)),
        ("structures", profiles(2.0, 0.5)),
    ):
        for ending in ("png", "pdf"):
            figure_file.write(figure, out / f"{name}.{ending}", dpi=110)
