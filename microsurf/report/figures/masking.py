"""Masking and shadowing by facet slope: the mesh's beside Smith's, a panel for each θ_i."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...stats import intervals
from .style import (
    BLACK,
    BLUE,
    SMALL,
    VERMILION,
    clean,
    new_figure,
    nothing,
    own_style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_STYLES: dict[str, tuple[str, str, Any, str]] = {
    "g1": (BLUE, "o", "-", r"$G_1$"),
    "g2": (VERMILION, "s", "--", r"$G_2$, mirror pairs"),
}
_ACROSS = 2


def rows(table: Sequence[dict[str, Any]], surfaces: int) -> list[dict[str, Any]]:
    """Rows of `masking.masking_by_slope` with the 95 % intervals that are drawn.

    ``surfaces`` is their number: Student's t over them; normal over the rays of one.
    """
    factor = intervals.over_values(surfaces)
    drawn = []
    for row in table:
        ends = {
            f"{name}_{end}": row[name] + sign * factor * row[f"{name}_se"]
            for name in _STYLES
            for end, sign in (("low", -1), ("high", 1))
        }
        drawn.append(row | ends)
    return drawn


@own_style()
def figure(drawn: Sequence[dict[str, Any]]) -> "Figure":
    """Draw `rows`: points are measured, with 95 % intervals; steps are Smith's."""
    from matplotlib.lines import Line2D  # noqa: PLC0415 - late: only to draw

    thetas = list(dict.fromkeys(row["theta_i"] for row in drawn))
    if not thetas:
        return nothing("no facet has a slope")
    across = min(_ACROSS, len(thetas))
    down = -(-len(thetas) // across)
    canvas = new_figure(0.8 + 2.5 * down)
    panels = canvas.subplots(down, across, sharex=True, sharey=True, squeeze=False)
    for panel, theta in zip(panels.ravel(), thetas, strict=False):
        _panel(panel, [row for row in drawn if row["theta_i"] == theta])
        panel.set_title(rf"$\theta_i$ = {theta:g}°", fontsize=10)
    for panel in panels.ravel()[len(thetas) :]:
        panel.set_visible(False)
    for panel in panels[-1]:
        panel.set_xlabel(r"slope of the facet over roughness, $\rho$")
    for panel in panels[:, 0]:
        panel.set_ylabel(r"$G_1$, $G_2$")
    handles = [
        Line2D([], [], color=colour, marker=marker, linestyle="none", label=f"{name}, measured")
        for colour, marker, _, name in _STYLES.values()
    ] + [
        Line2D([], [], color=colour, linestyle=line, label=f"{name}, Smith")
        for colour, _, line, name in _STYLES.values()
    ]
    canvas.legend(
        handles=handles, loc="outside lower center", ncols=4, fontsize=SMALL, frameon=False
    )
    return canvas


def _panel(panel: "Axes", mine: list[dict[str, Any]]) -> None:
    """One θ_i; the first bin and the last have no middle on this axis, they get a width."""
    inner = [row["rho_high"] for row in mine if row["rho_high"] is not None]
    least = min(inner, default=1.0) / 2
    low = np.array([max(row["rho_low"], least) for row in mine])
    high = np.array([row["rho_high"] or 2 * max(row["rho_low"], least) for row in mine])
    middle = np.sqrt(low * high)
    for name, (colour, marker, line, _) in _STYLES.items():
        value, below, above, theory = (
            np.array([row[key] for row in mine])
            for key in (name, f"{name}_low", f"{name}_high", f"{name}_smith")
        )
        panel.stairs(theory, np.append(low, high[-1]), baseline=None, color=colour,
                     linestyle=line, linewidth=1.1)  # fmt: skip
        panel.errorbar(middle, value, [value - below, above - value], color=colour,
                       marker=marker, markersize=4.5, linestyle="none", capsize=2.5,
                       ecolor=BLACK, elinewidth=0.9, zorder=3)  # fmt: skip
    panel.set(xscale="log", ylim=(-0.04, 1.12))
    panel.tick_params(labelsize=9)
    clean(panel)
