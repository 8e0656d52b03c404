"""All scenes in one picture: where the theory holds, and where it departs."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...analysis.comparison import Comparison
from ...results import albedos
from . import verdicts
from .style import (
    GREY,
    MARGIN,
    QUANTITY_STYLE,
    SMALL,
    as_text,
    clean,
    new_figure,
    nothing,
    own_style,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST = 60
"""Scenes in one picture: more would not be read."""
LINEAR = 10.0
"""Per cent up to which the axis is linear; logarithmic beyond."""


def rows(comparisons: Mapping[str, Sequence[Comparison]]) -> list[dict[str, Any]]:
    """Rows of `verdicts`, with the scene's name in front; the first MOST scenes."""
    shown = list(comparisons.items())[:MOST]
    return [{"scene": name} | row for name, mine in shown for row in verdicts.rows(mine)]


@own_style()
def figure(drawn: Sequence[dict[str, Any]]) -> "Figure":
    """Draw `rows`: a line for each scene, within it its angles (and Kd) from top to bottom."""
    names = list(dict.fromkeys(row["scene"] for row in drawn))
    if not names:
        return nothing("no scene has a verdict")
    canvas = new_figure(1.5 + 0.42 * len(names))
    panels = canvas.subplots(1, len(albedos.QUANTITIES), sharey=True, sharex=True)
    for panel, quantity in zip(panels, albedos.QUANTITIES, strict=True):
        colour, marker, label = QUANTITY_STYLE[quantity]
        for index, name in enumerate(names):
            mine = [r for r in drawn if r["scene"] == name and r["quantity"] == quantity]
            if not mine:
                panel.text(
                    0, index, "none", ha="center", va="center", fontsize=8.5, color="#555555",
                    backgroundcolor="white",
                )  # fmt: skip
                continue
            margin = mine[0]["margin_percent"]
            panel.barh(index, 2 * margin, 0.8, -margin, color=MARGIN, zorder=0)
            for row, y in zip(mine, index + np.linspace(-0.3, 0.3, len(mine)), strict=True):
                effect = row["effect_percent"]
                panel.errorbar(
                    effect, y, xerr=[[effect - row["low_percent"]], [row["high_percent"] - effect]],
                    color=colour, marker=marker, fillstyle=verdicts.FILLS[row["verdict"]],
                    markerfacecoloralt="white", markersize=4.2, markeredgewidth=0.8,
                    elinewidth=0.9, linestyle="none",
                )  # fmt: skip
        panel.axvline(0, color=GREY, linewidth=0.8, zorder=0.5)
        panel.set_title(label, fontsize=10)
        clean(panel)
    ends = [abs(row[end]) for row in drawn for end in ("low_percent", "high_percent")]
    reach = 1.1 * max(ends, default=1.0)
    if reach > 3 * LINEAR:
        panels[0].set_xscale("symlog", linthresh=LINEAR)
    panels[0].set_xlim(-reach, reach)
    panels[0].set_yticks(range(len(names)), [as_text(name) for name in names])
    panels[0].set_ylim(len(names) - 0.4, -0.6)
    panels[1].set_xlabel("measured / predicted − 1 (%), 95 % intervals")
    handles = verdicts.verdict_handles()
    canvas.legend(
        handles=handles, loc="outside lower center", ncols=3, fontsize=SMALL, frameon=False
    )
    return canvas
