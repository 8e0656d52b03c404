"""Figures of the atlas of the IL assumption, and of both limits of two layers."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from microsurf.report.figures.style import BLACK, BLUE, GREY, ORANGE, VERMILION, WIDTH, own_style
from microsurf.stats import intervals

from .cases import CORRELATIONS, GAPS, RATIOS, REALISATIONS

Row = dict[str, Any]

LEVELS = ((1.0, "#d4e6f4"), (3.0, "#86b8dd"), (10.0, "#f3b760"), (np.inf, "#c8501a"))
"""Percent, and the colour of what is shown to be within."""
CROSSING = "#e4e4e4"
KINDS = [(0.0, 0.0), *((r, c) for r in RATIOS[1:] for c in CORRELATIONS)]
"""Rows: σ of the substrate over that of the interface, correlation."""
NAMES = {0.0: "flat", 0.5: "half", 1.0: "equal", 2.0: "double"}
COLUMNS = {"total": "total albedo", "lobe": "body lobe (rms over directions)"}


@own_style()
def atlas(worst: list[Row], n: float, kd: float, sigma: float, gammas: tuple[float, ...]) -> Figure:
    """Cells by gap and kind of substrate: how far IL is, at the worst of all incidences."""
    figure = Figure(figsize=(WIDTH, 8.2), layout="constrained")
    panels = figure.subplots(len(COLUMNS), len(gammas), sharex=True, sharey=True, squeeze=False)
    for k, (quantity, name) in enumerate(COLUMNS.items()):
        for j, gamma in enumerate(gammas):
            shown = {"gamma": gamma, "sigma": sigma, "n": n, "kd": kd}
            _cells(panels[k, j], [r for r in worst if r.items() >= shown.items()], quantity)
            panels[k, j].set_title(rf"{name}, $\gamma$ = {gamma:g}", fontsize=9.5)
        panels[k, 0].set_ylabel("substrate: σ against the interface's, correlation ρ", fontsize=9)
    for panel in panels[-1]:
        panel.set_xlabel("gap / correlation length L", fontsize=9)
    handles = [
        Patch(color=colour, label=f"within {level:g} %" if level < np.inf else "not within 10 %")
        for level, colour in LEVELS
    ]
    crossing = Patch(facecolor=CROSSING, hatch="////", edgecolor="white", label="would cross")
    figure.legend(
        handles=[*handles, crossing], loc="outside upper center", ncols=5, fontsize=8.5,
        title="one interfaced-Lambertian facet in the place of two explicit layers: shown to be",
        title_fontsize=9, frameon=False,
    )  # fmt: skip
    return figure


def _cells(panel: Axes, rows: list[Row], quantity: str) -> None:
    values = {
        (r["substrate_over_interface"], r["correlation"], r["gap_over_length"]): r for r in rows
    }
    for y, kind in enumerate(KINDS):
        for x, gap in enumerate(GAPS):
            row = values.get((*kind, gap))
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
    panel.set_xlim(0, len(GAPS))
    panel.set_ylim(len(KINDS), 0)
    panel.set_xticks(np.arange(len(GAPS)) + 0.5, [f"{gap:g}" for gap in GAPS], fontsize=7.5)
    labels = [
        NAMES[ratio] if ratio == 0 else f"{NAMES[ratio]}, ρ = {correlation:g}".replace("-", "−")
        for ratio, correlation in KINDS
    ]
    panel.set_yticks(np.arange(len(KINDS)) + 0.5, labels, fontsize=7.5)
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
    (1.0, 0.0): (BLACK, "o", "independent"),
    (1.0, 1.0): (VERMILION, "^", "the interface's relief"),
    (0.5, 1.0): (ORANGE, "s", "its relief, half as high"),
}


@own_style()
def limits(thin: list[Row], thick: list[Row], kd: float) -> Figure:
    """Body light of IL facets as the gap closes; the thick limit as it opens."""
    figure = Figure(figsize=(WIDTH, 3.4), layout="constrained")
    left, right = figure.subplots(1, 2)
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
             ylabel="body light: two layers over IL − 1 (%)")  # fmt: skip
    left.set_xticks(gaps, [f"1/{1 / gap:g}" for gap in gaps])
    left.minorticks_off()
    left.set_yticks([0.1, 1, 10], ["0.1", "1", "10"])
    left.set_ylim(0.1, 20)
    left.set_title(rf"thin: Kd = {kd:g}, $\theta_i$ = {GRAZING:g}°", fontsize=9.5)
    left.legend(fontsize=8, frameon=False)
    for (ratio, correlation), (colour, marker, label) in PAIRS.items():
        kind = {"theta_i": 0.0, "substrate_over_interface": ratio, "correlation": correlation}
        rows = [r for r in thick if r.items() >= kind.items()]
        gaps, value, error = (
            np.array([r[key] for r in rows]) for key in ("gap_over_length", "percent", "se")
        )
        right.plot(gaps, value, color=colour, marker=marker, markersize=3.5, label=label)
        right.fill_between(
            gaps, value - t * error, value + t * error, color=colour, alpha=0.2, linewidth=0
        )
    right.axhline(0, color=GREY, linewidth=1)
    right.set(xscale="log", xlabel="gap / correlation length L",
              ylabel="total: two layers over thick limit − 1 (%)")  # fmt: skip
    right.set_xticks([2, 5, 10, 20, 50], ["2", "5", "10", "20", "50"])
    right.minorticks_off()
    right.set_title(r"thick: Kd = 0.8, $\theta_i$ = 0°", fontsize=9.5)
    right.legend(title="substrate", fontsize=8, frameon=False)
    return figure
