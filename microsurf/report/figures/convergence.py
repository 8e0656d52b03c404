"""convergence.png and .pdf: what mesh, tile, realisations and rays leave, a panel each."""

from typing import TYPE_CHECKING, Any

import numpy as np

from ...analysis.convergence.study import Convergence, Row
from ...stats import intervals
from .style import (
    GREY,
    QUANTITY_STYLE,
    SMALL,
    as_text,
    clean,
    new_figure,
    nothing,
    own_style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SHOWN = 60.0
_ONE, _DARK = "one surface: does not vary", "nothing to show: no light, or no spread"
_TITLES = (
    "what a finer mesh still changes",
    "what a larger tile still changes",
    "error over surfaces",
    "error of rays",
)


@own_style()
def draw(convergence: Convergence, name: str) -> "Figure":
    """One incidence, the one nearest to 60°, and the first Kd; all others are in the table."""
    if not convergence.rays:
        return nothing("the scene reflects no light")
    figure = new_figure(6.6)
    panels = figure.subplots(2, 2).ravel()
    first = min(convergence.rays, key=lambda row: abs(row["theta_i"] - _SHOWN))
    shown = {key: first[key] for key in ("theta_i", "phi_i", "kd")}
    _differences(panels[0], convergence.mesh, shown, "correlation", "cells per correlation length")
    _differences(
        panels[1], convergence.tile, shown, "tile", "side of the tile in correlation lengths"
    )
    _deviations(panels[2], convergence, "realisations", shown, "surfaces in the mean")
    _deviations(panels[3], convergence, "rays", shown, "paths on one surface")
    for panel, title in zip(panels, _TITLES, strict=True):
        panel.set_title(title, fontsize=9.5)
    handles: dict[str, Any] = {}
    for panel in panels:
        handles |= {
            label.split(":")[0]: handle
            for handle, label in zip(*panel.get_legend_handles_labels(), strict=True)
            if label.split(":")[0] in {style[2] for style in QUANTITY_STYLE.values()}
        }
    figure.legend(
        list(handles.values()),
        list(handles),
        loc="outside lower center",
        ncols=3,
        fontsize=SMALL,
        frameon=False,
    )
    incidence = rf"$\theta_i$ = {shown['theta_i']:g}°, Kd = {shown['kd']:g}"
    bars = f"bars {100 * intervals.CONFIDENCE:g} %"
    figure.suptitle(f"{as_text(name)}: albedos at {incidence}, {bars}", fontsize=10)
    return figure


def _rows(rows: list[Row], shown: Row, quantity: str) -> list[Row]:
    return [row for row in rows if row.items() >= (shown | {"quantity": quantity}).items()]


def _differences(panel: "Axes", rows: list[Row], shown: Row, key: str, label: str) -> None:
    """Relative differences to the finest step."""
    if not rows:
        _say(panel, label, _ONE)
        return
    ticks: list[float] = []
    for k, (name, (colour, marker, text)) in enumerate(QUANTITY_STYLE.items()):
        mine = _rows(rows, shown, name)
        if not mine or not mine[-1]["value"]:
            continue
        scale = 100 / mine[-1]["value"]
        ticks = [row[key] for row in mine]
        value, low, high = (
            scale * np.array([row[end] for row in mine]) for end in ("difference", "low", "high")
        )
        panel.errorbar(
            np.array(ticks) * 2 ** ((k - 1) * 0.07), value, [value - low, high - value],
            color=colour, marker=marker, markersize=4.5, capsize=3, linewidth=0.8, label=text,
        )  # fmt: skip
    if not ticks:
        _say(panel, label, _DARK)
        return
    panel.axhline(0, color=GREY, linewidth=0.8)
    panel.set(xscale="log", xlabel=label, ylabel="difference to the finest (%)")
    panel.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    panel.minorticks_off()
    clean(panel)


def _deviations(
    panel: "Axes", convergence: Convergence, study: str, shown: Row, label: str
) -> None:
    """Measured standard errors of a mean against 1/√N."""
    rows = getattr(convergence, study)
    if not rows:
        _say(panel, label, _ONE)
        return
    key, count = ("realisations", "groups") if study == "realisations" else ("paths", "repeats")
    for name, (colour, marker, text) in QUANTITY_STYLE.items():
        mine = [row for row in _rows(rows, shown, name) if row["deviation"]]
        if not mine or not mine[-1]["value"]:
            continue
        scale = 100 / mine[-1]["value"]
        x = np.array([row[key] for row in mine])
        y = scale * np.array([row["deviation"] for row in mine])
        # ln s has the standard error 1/√(2ν) of ν degrees of freedom.
        factor = np.exp(intervals.normal() / np.sqrt([2 * (row[count] - 1) for row in mine]))
        fit = _rows([row for row in convergence.powers if row["study"] == study], shown, name)[0]
        panel.errorbar(
            x, y, [y - y / factor, y * factor - y], color=colour, marker=marker, markersize=4.5,
            capsize=3, linestyle="none", label=f"{text}: {_exponent(fit)}",
        )  # fmt: skip
        panel.plot(x, y[0] * np.sqrt(x[0] / x), color=colour, linewidth=0.8)
        if "claimed" in mine[0]:
            claimed = scale * np.array([row["claimed"] for row in mine])
            panel.plot(x, claimed, color=colour, linewidth=1, linestyle=":")
    if not panel.lines:
        _say(panel, label, _DARK)
        return
    what = "lines: 1/√N" + ("; dotted: claimed by batches" if study == "rays" else "")
    panel.set(xscale="log", yscale="log", xlabel=label, ylabel="standard error (%)")
    panel.set_ylim(bottom=panel.get_ylim()[0] / 15)  # room for the legend
    panel.legend(loc="lower left", fontsize=8, frameon=False, title=what, title_fontsize=8)
    if study == "realisations":
        ticks = sorted({row[key] for row in rows if row["deviation"]})
        panel.set_xticks(ticks, [str(tick) for tick in ticks])
        panel.minorticks_off()
    clean(panel)


def _exponent(fit: Row) -> str:
    if fit["power"] is None:
        return "too few to fit"
    return rf"$N^{{{fit['power']:+.2f} \pm {(fit['high'] - fit['low']) / 2:.2f}}}$"


def _say(panel: "Axes", label: str, why: str) -> None:
    panel.text(0.5, 0.5, why, ha="center", transform=panel.transAxes)
    panel.set(xticks=[], yticks=[], xlabel=label)
