"""The figure: lobes of two traced layers beside theories, and how far these are."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from microsurf.report.figures.style import BLACK, BLUE, GREEN, GREY, ORANGE, WIDTH, own_style
from microsurf.stats import intervals

from .cases import GAPS, QUANTITIES, THETAS, lobes_of

Row = dict[str, Any]

SHOWN = THETAS[-1]
LINES = {
    "layered-walk": (GREEN, "-", "d", "layered walk"),
    "il": (ORANGE, "--", "s", "IL facets, traced on the interface"),
    "smith-walk": (BLUE, ":", "<", "IL facets, Smith walk"),
    "thick limit": (BLACK, "", "x", "thick limit, of traces"),
}
NAMES = {
    "total": "total\nalbedo", "specular": "order-1\nspecular", "body": "order-1\nbody",
    "back": "body,\nback", "forward": "body,\nforward", "zenith": "body,\nzenith",
}  # fmt: skip


@own_style()
def figure(rows: list[Row]) -> Figure:
    """A column for each γ: lobes over deviations, at the steepest incidence."""
    drawn = Figure(figsize=(WIDTH, 6.6), layout="constrained")
    panels = drawn.subplots(2, len(GAPS), sharey="row", squeeze=False)
    for k, gamma in enumerate(GAPS):
        _lobes(panels[0, k], gamma)
        panels[0, k].set_title(rf"$\gamma$ = {gamma:g}", fontsize=10)
        _deviations(panels[1, k], [r for r in rows if r["gamma"] == gamma])
    panels[0, 0].set_ylabel("BRDF of body light (1/sr)", fontsize=9)
    panels[1, 0].set_ylabel("from two traced layers (%)", fontsize=9)
    handles, labels = panels[0, 0].get_legend_handles_labels()
    more, names = panels[1, 0].get_legend_handles_labels()
    wanted = [(h, n) for h, n in zip(more, names, strict=True) if n not in labels]
    drawn.legend(
        handles=[*handles, *(h for h, _ in wanted)], labels=[*labels, *(n for _, n in wanted)],
        loc="outside upper center", ncols=2, frameon=False, fontsize=8.5,
        title=rf"two independent layers far apart, $\theta_i$ = {SHOWN:g}°", title_fontsize=9.5,
    )  # fmt: skip
    return drawn


def _lobes(panel: Axes, gamma: float) -> None:
    lobe = lobes_of(gamma, "layers").sel(theta_i=SHOWN)
    mean = lobe.mean("realisation")
    half = intervals.half_width_of_mean(lobe.values)
    panel.plot(mean.theta_o, mean, color=BLACK, linewidth=1.4, label="two layers, traced")
    panel.fill_between(mean.theta_o, mean - half, mean + half, color=BLACK, alpha=0.2, linewidth=0)
    for source, (colour, line, _, label) in LINES.items():
        if source == "thick limit":
            continue
        values = lobes_of(gamma, source).sel(theta_i=SHOWN).mean("realisation")
        panel.plot(values.theta_o, values, color=colour, linestyle=line, linewidth=1.3, label=label)
    panel.set_xlabel(r"$\theta_o$ in the plane of incidence (°); mirror: +80°", fontsize=9)
    panel.set_xlim(-85, 85)  # the last ring has next to no light, and hardly a BRDF
    panel.set_ylim(0, None)
    _tidy(panel)


def _deviations(panel: Axes, rows: list[Row]) -> None:
    shown = {(r["source"], r["quantity"]): r for r in rows if r["theta_i"] == SHOWN}
    normal = intervals.normal()
    for x, quantity in enumerate(QUANTITIES):
        structure = shown["smith-walk over il", quantity]
        panel.bar(
            x, structure["percent"], 0.9, color=GREY, alpha=0.35,
            label="Smith walk over traced IL facets: the structure" if x == 0 else None,
        )  # fmt: skip
    for k, (source, (colour, _, marker, label)) in enumerate(LINES.items()):
        mine = [(x, shown.get((source, q))) for x, q in enumerate(QUANTITIES)]
        known = [(x, row) for x, row in mine if row is not None]
        panel.errorbar(
            [x + 0.2 * (k - 1.5) for x, _ in known], [row["percent"] for _, row in known],
            [normal * row["percent_error"] for _, row in known],
            color=colour, marker=marker, linestyle="none", markersize=4.5, capsize=2, label=label,
        )  # fmt: skip
    panel.axhline(0, color=BLACK, linewidth=0.8)
    panel.set_xticks(range(len(QUANTITIES)), [NAMES[q] for q in QUANTITIES], fontsize=8)
    _tidy(panel)


def _tidy(panel: Axes) -> None:
    panel.grid(visible=True, axis="y", color="#dddddd", linewidth=0.5)
    panel.spines[["top", "right"]].set_visible(False)
    panel.tick_params(labelsize=8)
