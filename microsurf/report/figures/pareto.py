"""Error against cost of every method: the frontier, and what lies behind it."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...analysis.tradeoff import pareto
from ...analysis.tradeoff.study import CHOICES, QUANTITIES, Tradeoff
from .style import (
    GREY,
    as_text,
    new_figure,
    nothing,
    own_style,
    source_style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LEAST, MOST = 1e-4, 2.0
"""Errors are drawn within these: a flat mirror's peak is off by hundreds of times."""


def rows(tradeoff: Tradeoff) -> list[dict[str, Any]]:
    """One row for each method and quantity: cost, error, both with their ranges, dominated by."""
    table = []
    for name, points in tradeoff.points.items():
        for run, point in zip(tradeoff.runs, points, strict=True):
            error = pareto.error(point.squared)
            table.append(
                {
                    "quantity": name,
                    "rung": point.name,
                    "model": run.method.model,
                    "seconds": point.seconds,
                    "seconds_low": point.seconds_low,
                    "seconds_high": point.seconds_high,
                    "seconds_evaluation": run.evaluation,
                    "bytes": run.bytes,
                    "bytes_basis": run.bytes_basis,
                    "error": error.value,
                    "error_low": error.low,
                    "error_high": error.high,
                    "error_below": error.below,
                    "dominated_by": tradeoff.dominated[name].get(point.name),
                }
            )
    return table


LEVELS = (0.01, 0.03, 0.1)


def within(table: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """What it costs to be wrong by no more than 1, 3 or 10 %, by quantity.

    The cheapest method whose error stays below with 95 % confidence; method None if none does.
    """
    table_within = []
    for name in CHOICES:
        mine = sorted((r for r in table if r["quantity"] == name), key=lambda r: r["seconds"])
        for level in LEVELS if mine else ():
            first = next((r for r in mine if r["error_below"] <= level), {})
            table_within.append(
                {"quantity": name, "level": level}
                | {key: first.get(key) for key in ("rung", "seconds", "error_below")}
            )
    return table_within


@own_style()
def figure(table: Sequence[Mapping[str, Any]], name: str = "") -> "Figure":
    """A panel for each of albedo, peak and lobe that the scene has, by its `rows`."""
    names = [q for q in CHOICES if any(row["quantity"] == q for row in table)]
    if not names:
        return nothing("no method was measured")
    drawn = new_figure(3.9)
    line = drawn.subplots(1, len(names), squeeze=False, sharex=True, sharey=True)[0]
    for panel, quantity in zip(line, names, strict=True):
        draw_methods(panel, [row for row in table if row["quantity"] == quantity])
        panel.set_title(QUANTITIES[quantity].removesuffix(", relative"), fontsize=9)
        panel.tick_params(which="both", labelsize=8)
        panel.set_xlabel("processor time of an angle (s)", fontsize=8.5)
    line[0].set_ylabel("error (%)", fontsize=9)
    if name:
        drawn.suptitle(as_text(name), fontsize=10)
    legend(drawn)
    return drawn


_HOW = (
    "hollow: dominated; line: frontier; bars: 95 %; arrow: not distinguished from 0;\n"
    "dotted: 1, 3 and 10 %; 0.01 % stands for less, 200 % for more"
)


def legend(drawn: "Figure", columns: int = 3, title: str = _HOW) -> None:
    """Name each kind of method once, below all panels."""
    handles: dict[str, Any] = {}
    for panel in drawn.axes:
        entries = zip(*panel.get_legend_handles_labels(), strict=True)
        handles |= {label: handle for handle, label in entries}
    drawn.legend(
        list(handles.values()), list(handles), loc="outside lower center", ncols=columns,
        fontsize=8, frameon=False, title_fontsize=8, title=title,
    )  # fmt: skip


def draw_methods(panel: "Axes", table: Sequence[Mapping[str, Any]]) -> None:
    """Methods with 95 % bars; filled on the frontier, hollow if dominated, and the line between."""
    if not table:
        panel.text(0.5, 0.5, "nothing measured", ha="center", transform=panel.transAxes)
        return
    for row in table:
        style = source_style(row["model"])
        known = row["error"] >= LEAST
        value = 100 * _drawn(row["error"] if known else row["error_high"])
        x = row["seconds"]
        ends = [[x - row["seconds_low"]], [row["seconds_high"] - x]]
        behind = row["dominated_by"] is not None
        if known:
            low = value - 100 * _drawn(row["error_low"])
            bars, limit = [[low], [100 * _drawn(row["error_high"]) - value]], False
        else:  # not distinguished from 0: an arrow from what it stays below
            bars, limit = [[value / 2], [0.0]], True
        panel.errorbar(
            x, value, bars, ends, uplims=[limit], color=style.colour, marker=style.marker,
            capsize=2, markersize=8 if style.marker == "*" else 5.5, linestyle="none",
            linewidth=0.8, markerfacecolor="white" if behind else style.colour, label=style.name,
        )  # fmt: skip
    ahead = sorted(
        (row["seconds"], row["error"] if row["error"] >= LEAST else row["error_high"])
        for row in table
        if row["dominated_by"] is None
    )
    x, y = np.array(ahead).T
    best = 100 * np.clip(np.minimum.accumulate(y), LEAST, MOST)
    panel.step(x, best, where="post", color=GREY, linewidth=1, zorder=0)
    panel.set(xscale="log", yscale="log")
    for level in (1, 3, 10):
        panel.axhline(level, color="#bbbbbb", linewidth=0.6, linestyle=":", zorder=0)
    panel.grid(visible=True, which="major", color="#eeeeee", linewidth=0.5)
    panel.spines[["top", "right"]].set_visible(False)


def _drawn(error: float) -> float:
    return float(np.clip(error, LEAST, MOST))
