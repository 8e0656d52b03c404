"""Error against cost of several scenes: a panel each, and all of them in one."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...analysis.tradeoff.study import CHOICES, QUANTITIES
from .pareto import LEAST, MOST, draw_methods, legend
from .style import (
    SMALL,
    as_text,
    new_figure,
    nothing,
    own_style,
    source_style,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Rows = Sequence[Mapping[str, Any]]


@own_style()
def scenes(tables: Mapping[str, Rows], quantity: str = "albedo") -> "Figure":
    """A small panel for each scene, by its rows of `frontier_plot.rows`, of one quantity.

    A scene of one method, which has no other to be compared with, gets none beside others.
    """
    columns = 3
    several = {name: table for name, table in tables.items() if len({r["rung"] for r in table}) > 1}
    tables = several or tables
    lines = -(-len(tables) // columns)
    if not tables:
        return nothing("no scene was measured")
    drawn = new_figure(1.75 * lines + 1.2)
    grid = drawn.subplots(lines, columns, squeeze=False, sharex=True, sharey=True)
    for panel, (name, table) in zip(grid.ravel(), tables.items(), strict=False):
        draw_methods(panel, [row for row in table if row["quantity"] == quantity])
        panel.set_title(as_text(name), fontsize=SMALL)
        panel.tick_params(which="both", labelsize=8)
    for panel in grid.ravel()[len(tables) :]:
        panel.set_axis_off()
    for k in range(columns):  # under the lowest panel of each column
        lowest = grid[(len(tables) - 1 - k) // columns, k]
        lowest.tick_params(labelbottom=True)
        lowest.set_xlabel("processor time (s)", fontsize=SMALL)
    what = QUANTITIES[quantity].removesuffix(", relative")
    drawn.supylabel(f"error of the {what} (%)", fontsize=9)
    legend(drawn, columns=3)
    return drawn


def medians(tables: Mapping[str, Rows]) -> list[dict[str, Any]]:
    """For each quantity and method the quartiles over scenes of error and relative cost.

    The cost is in those of the scene's cheapest method. Scenes of one method, which has no
    other to be compared with, are left out.
    """
    pairs_by_method: dict[tuple[str, str], list[tuple[float, float]]] = {}
    models = {}
    for table in tables.values():
        for quantity in CHOICES:
            mine = [row for row in table if row["quantity"] == quantity]
            least = min((row["seconds"] for row in mine), default=1.0)
            for row in mine if len(mine) > 1 else ():
                models[row["rung"]] = row["model"]
                pair = row["error"], row["seconds"] / least
                pairs_by_method.setdefault((quantity, row["rung"]), []).append(pair)
    rows = []
    for (quantity, method), pairs in pairs_by_method.items():
        row = {"quantity": quantity, "rung": method, "model": models[method], "scenes": len(pairs)}
        for name, values in zip(("error", "cost"), np.array(pairs).T, strict=True):
            quartiles = np.quantile(values, [0.25, 0.5, 0.75])
            ends = (f"{name}_low", name, f"{name}_high")
            row |= {key: float(value) for key, value in zip(ends, quartiles, strict=True)}
        rows.append(row)
    return rows


@own_style()
def over_all(rows: Rows) -> "Figure":
    """A panel for each quantity of `medians`: symbols the medians, bars the middle half."""
    names = [q for q in CHOICES if any(row["quantity"] == q for row in rows)]
    if not names:
        return nothing("no scene was measured")
    drawn = new_figure(4.3)
    grid = drawn.subplots(1, len(names), squeeze=False, sharex=True, sharey=True)[0]
    for panel, quantity in zip(grid, names, strict=False):
        for row in rows:
            if row["quantity"] != quantity:
                continue
            style = source_style(row["model"])
            values = 100 * np.clip([row[k] for k in ("error_low", "error", "error_high")],
                                   LEAST, MOST)  # fmt: skip
            x = row["cost"]
            panel.errorbar(
                x, values[1], np.abs(np.diff(values))[:, None],
                [[x - row["cost_low"]], [row["cost_high"] - x]],
                color=style.colour, marker=style.marker,
                markersize=8 if style.marker == "*" else 5,
                linestyle="none", linewidth=0.7, label=style.name,
            )  # fmt: skip
        panel.set(xscale="log", yscale="log")
        panel.set_title(QUANTITIES[quantity].removesuffix(", relative"), fontsize=9)
        panel.grid(visible=True, which="major", color="#eeeeee", linewidth=0.5)
        panel.spines[["top", "right"]].set_visible(False)
        panel.tick_params(which="both", labelsize=8)
        panel.set_xlabel("time over the cheapest's", fontsize=SMALL)
    grid[0].set_ylabel("error (%)", fontsize=9)
    how = "symbols: median of scenes; bars: middle half; 0.01 % stands for less, 200 % for more"
    legend(drawn, columns=3, title=how)
    return drawn
