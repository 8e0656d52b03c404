"""Figures of the atlas of the IL assumption, and of both limits of two layers."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from microsurf.report.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    VERMILION,
    WIDTH,
    own_style,
)
from microsurf.stats import intervals

from .cases import CORRELATIONS, FAR_GAPS, GAMMAS, GAPS, INDICES, RATIOS, REALISATIONS, THETAS

Row = dict[str, Any]

LEVELS = ((1.0, "#d4e6f4"), (3.0, "#86b8dd"), (10.0, "#f3b760"), (np.inf, "#c8501a"))
"""Percent, and the colour of what is shown to be within."""
CROSSING = "#e4e4e4"
KINDS = [(0.0, 0.0), *((r, c) for r in RATIOS[1:] for c in CORRELATIONS)]
"""Rows: σ of the substrate over that of the interface, correlation."""
NAMES = {0.0: "flat", 0.5: "half", 1.0: "equal", 2.0: "double"}
THEORIES = {"il": "IL", "layered-walk": "layered walk"}
"""IL facets traced on the same interfaces, which pairs them; the theory of independent layers."""
COLUMNS = {"total": "total albedo", "lobe": "body lobe (rms over directions)"}


@own_style()
def atlas(worst: list[Row], n: float, kd: float, sigma: float, gammas: tuple[float, ...]) -> Figure:
    """Cells by gap and kind of substrate: how far IL is, at the worst of all incidences."""
    columns = {
        rf"{{}}, $\gamma$ = {gamma:g}": {"gamma": gamma, "sigma": sigma, "n": n, "kd": kd}
        for gamma in gammas
    }
    figure = _figure(
        worst, columns, ("substrate_over_interface", "correlation"),
        {kind: _kind_name(*kind) for kind in KINDS}, GAPS,
        "substrate: σ against the interface's, correlation ρ",
    )  # fmt: skip
    _legend(
        figure,
        "one interfaced-Lambertian facet in the place of two explicit layers: shown to be",
        f"n = {n:g}, Kd = {kd:g}, σ = {sigma:g}",
    )
    return figure


@own_style()
def layering(worst: list[Row], kd: float, sigma: float) -> Figure:
    """Cells by gap, index and roughness of an independent substrate: how far either theory is."""
    columns = {
        rf"{label}, $\gamma$ = {gamma:g}": {
            "theory": theory, "gamma": gamma, "sigma": sigma, "kd": kd,
        }
        for gamma in GAMMAS
        for theory, label in THEORIES.items()
    }  # fmt: skip
    kinds = [(ratio, n) for ratio in RATIOS for n in sorted(INDICES)]
    figure = _figure(
        worst, columns, ("substrate_over_interface", "n"),
        {(ratio, n): f"{NAMES[ratio]}, n = {n:g}" for ratio, n in kinds}, FAR_GAPS,
        "{}\nσ of the substrate, index",
    )  # fmt: skip
    _legend(
        figure,
        "a theory in the place of two explicit layers that are independent: shown to be",
        f"Kd = {kd:g}, σ of the interface {sigma:g}",
    )
    return figure


def _figure(
    worst: list[Row],
    columns: Mapping[str, Row],
    axes: tuple[str, str],
    labels: Mapping[tuple[float, float], str],
    gaps: Sequence[float],
    ylabel: str,
) -> Figure:
    """A row of panels for each quantity; of rows that have what a column of them says.

    ``labels`` are of kinds of pairs, by the two ``axes``. In headings and ``ylabel`` {} is
    the quantity.
    """
    figure = Figure(figsize=(WIDTH, 1.6 + 0.26 * len(COLUMNS) * len(labels)), layout="constrained")
    panels = figure.subplots(len(COLUMNS), len(columns), sharex=True, sharey=True, squeeze=False)
    for of_quantity, (quantity, name) in zip(panels, COLUMNS.items(), strict=True):
        for panel, (heading, shown) in zip(of_quantity, columns.items(), strict=True):
            rows = {
                (*(r[axis] for axis in axes), r["gap_over_length"]): r
                for r in worst
                if r.items() >= shown.items()
            }
            _cells(panel, rows, labels, gaps, quantity)
            panel.set_title(heading.format(name), fontsize=9)
        of_quantity[0].set_ylabel(ylabel.format(name), fontsize=9)
    for panel in panels[-1]:
        panel.set_xlabel(
            "gap / correlation length L" if len(columns) < 3 else "gap / L", fontsize=9
        )
    return figure


def _legend(figure: Figure, what: str, scenes: str) -> None:
    handles = [
        Patch(color=colour, label=f"within {level:g} %" if level < np.inf else "not within 10 %")
        for level, colour in LEVELS
    ]
    crossing = Patch(facecolor=CROSSING, hatch="////", edgecolor="white", label="would cross")
    thetas = ", ".join(f"{theta:g}" for theta in THETAS)
    figure.legend(
        handles=[*handles, crossing], loc="outside upper center", ncols=5, fontsize=8.5,
        title=f"{what}\n({scenes}; numbers: difference in %, worst of $\\theta_i$ = {thetas}°)",
        title_fontsize=9, frameon=False,
    )  # fmt: skip


def _kind_name(ratio: float, correlation: float) -> str:
    """Name of a kind of substrate."""
    if ratio == 0:
        return NAMES[ratio]
    return f"{NAMES[ratio]}, ρ = {correlation:g}".replace("-", "−")


def _cells(
    panel: Axes,
    rows: Mapping[tuple[float, ...], Row],
    labels: Mapping[tuple[float, float], str],
    gaps: Sequence[float],
    quantity: str,
) -> None:
    """A cell for each kind of pair, from above, and gap; where there is no row surfaces cross."""
    for y, kind in enumerate(labels):
        for x, gap in enumerate(gaps):
            row = rows.get((*kind, gap))
            if row is None:
                panel.add_patch(
                    Rectangle((x, y), 1, 1, facecolor=CROSSING, hatch="////", edgecolor="white",
                              linewidth=0)
                )  # fmt: skip
                continue
            colour = next(c for level, c in LEVELS if row[f"{quantity}_high"] <= level)
            panel.add_patch(Rectangle((x, y), 1, 1, facecolor=colour, edgecolor="white"))
            dark = np.dot(to_rgb(colour), (0.3, 0.59, 0.11)) < 0.5
            value = row[quantity]
            panel.text(
                x + 0.5, y + 0.5, f"{value:.1f}" if value < 9.95 else f"{value:.0f}", fontsize=6,
                ha="center", va="center", color="white" if dark else BLACK,
            )  # fmt: skip
    panel.set_xlim(0, len(gaps))
    panel.set_ylim(len(labels), 0)
    panel.set_xticks(np.arange(len(gaps)) + 0.5, [f"{gap:g}" for gap in gaps], fontsize=7.5)
    panel.set_yticks(np.arange(len(labels)) + 0.5, list(labels.values()), fontsize=7.5)
    panel.tick_params(length=0)
    panel.spines[:].set_visible(False)
    panel.grid(visible=False)


GRAZING = 75.0
RELIEFS = {
    (8.0, 0.5, 8.0): (BLACK, "o", "γ 8, σ 0.5"),
    (8.0, 0.5, 16.0): (BLUE, "s", "γ 8, σ 0.5, L = 16 cells"),
    (8.0, 0.25, 8.0): (ORANGE, "^", "γ 8, σ 0.25"),
    (2.0, 0.5, 8.0): (VERMILION, "D", "γ 2, σ 0.5"),
}
PAIRS = {
    (8.0, 1.0, 0.0): (BLACK, "o", "-", "independent, γ 8"),
    (8.0, 1.0, 1.0): (VERMILION, "^", "-", "the interface's relief, γ 8"),
    (8.0, 0.5, 1.0): (ORANGE, "s", "-", "its relief, half as high, γ 8"),
    (2.0, 1.0, 1.0): (BLUE, "D", "--", "the interface's relief, γ 2"),
    (2.0, 0.5, 1.0): (GREEN, "v", "--", "its relief, half as high, γ 2"),
}


@own_style()
def limits(thin: list[Row], thick: list[Row], kd: float) -> Figure:
    """Body light of IL facets as the gap closes; the thick limit as it opens."""
    figure = Figure(figsize=(WIDTH, 6.4), layout="constrained")
    panels = figure.subplots(2, 2).ravel()
    left = panels[0]
    t = intervals.student(REALISATIONS - 1)
    for row in (r for r in thin if r["kd"] == kd and r["theta_i"] == GRAZING):
        colour, marker, label = RELIEFS[row["gamma"], row["sigma"], row["length"]]
        gaps = np.array(sorted(float(k[4:-8]) for k in row if k.endswith("_percent")))
        value, error = (
            np.array([float(row[f"gap_{gap:g}_{what}"]) for gap in gaps])
            for what in ("percent", "se")
        )
        left.plot(gaps, value, color=colour, marker=marker, markersize=3.5, label=label)
        low = np.maximum(value - t * error, 0.01)
        left.fill_between(gaps, low, value + t * error, color=colour, alpha=0.2, linewidth=0)
        if row["fitted"]:
            power = 100 * row["coefficient"] * gaps ** row["exponent"]
            left.plot(gaps, power, color=colour, linestyle=":", linewidth=1)
    left.set(xscale="log", yscale="log", xlabel="gap / correlation length L",
             ylabel="body light over that of IL − 1 (%)")  # fmt: skip
    left.set_xticks(gaps, [f"1/{1 / gap:g}" for gap in gaps])
    left.minorticks_off()
    left.set_yticks([0.1, 1, 10], ["0.1", "1", "10"])
    left.set_ylim(0.1, 20)
    left.set_title(
        rf"thin, same relief: n = 1.5, Kd = {kd:g}, $\theta_i$ = {GRAZING:g}°", fontsize=9
    )
    left.legend(fontsize=8, frameon=False)
    top = max(r["percent"] + t * r["se"] for r in thick)
    for panel, theta in zip(panels[1:], THETAS, strict=True):
        _thick(panel, [r for r in thick if r["theta_i"] == theta])
        panel.set_title(rf"thick: n = 1.5, Kd = 0.8, σ = 0.5, $\theta_i$ = {theta:g}°", fontsize=9)
        panel.set_ylim(-1, top + 0.2)
    panels[1].legend(title="substrate", fontsize=7.5, title_fontsize=8, frameon=False)
    return figure


def _thick(panel: Axes, thick: list[Row]) -> None:
    """How far pairs at one incidence are from the thick limit, over the gap."""
    t = intervals.student(REALISATIONS - 1)
    for (gamma, ratio, correlation), (colour, marker, line, label) in PAIRS.items():
        kind = {"gamma": gamma, "substrate_over_interface": ratio, "correlation": correlation}
        rows = [r for r in thick if r.items() >= kind.items()]
        gaps, value, error = (
            np.array([r[key] for r in rows]) for key in ("gap_over_length", "percent", "se")
        )
        panel.plot(
            gaps, value, color=colour, marker=marker, markersize=3.5, linestyle=line, label=label
        )
        panel.fill_between(
            gaps, value - t * error, value + t * error, color=colour, alpha=0.15, linewidth=0
        )
    panel.axhline(0, color=GREY, linewidth=1)
    panel.set(xscale="log", xlabel="gap / correlation length L",
              ylabel="total albedo over the thick limit − 1 (%)")  # fmt: skip
    panel.set_xticks([2, 5, 10, 20, 50], ["2", "5", "10", "20", "50"])
    panel.minorticks_off()
