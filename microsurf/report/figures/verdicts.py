"""Measured over predicted − 1 of one scene: its interval, its margin, its verdict."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ...analysis.comparison import Comparison
from ...results import albedos
from .style import (
    BLACK,
    GREY,
    MARGIN,
    QUANTITY_STYLE,
    SMALL,
    clean,
    new_figure,
    nothing,
    own_style,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

FILLS = {"holds": "full", "departs": "none", "undecided": "left"}
"""Of the markers, by verdict."""


def rows(comparisons: Sequence[Comparison]) -> list[dict[str, Any]]:
    """One row for each comparison; ``*_percent`` are relative differences."""
    return [
        {
            "quantity": c.quantity,
            "theta_i_deg": c.theta_i,
            "phi_i_deg": c.phi_i,
            "kd": c.kd,
            "measured": c.measured,
            "standard_error": c.standard_error,
            "model": c.model,
            "predicted": c.predicted,
            "predicted_error": c.predicted_error,
            "effect_percent": 100 * c.effect,
            "low_percent": 100 * c.low,
            "high_percent": 100 * c.high,
            "margin_percent": 100 * c.margin,
            "verdict": c.verdict,
            "expected": c.expected,
        }
        for c in comparisons
    ]


@own_style()
def figure(drawn: Sequence[dict[str, Any]]) -> "Figure":
    """Draw `rows`: a panel for each quantity, each with its own scale."""
    from matplotlib.patches import Patch  # noqa: PLC0415 - late: only to draw

    names = [q for q in albedos.QUANTITIES if any(row["quantity"] == q for row in drawn)]
    if not names:
        return nothing("no light that the theory speaks of")
    canvas = new_figure(2.9)
    panels = canvas.subplots(1, len(names), squeeze=False)[0]
    for panel, name in zip(panels, names, strict=False):
        mine = [row for row in drawn if row["quantity"] == name]
        colour, marker, label = QUANTITY_STYLE[name]
        margin = mine[0]["margin_percent"]
        panel.axhspan(-margin, margin, color=MARGIN, zorder=0)
        panel.axhline(0, color=GREY, linewidth=0.8)
        for x, row in enumerate(mine):
            effect = row["effect_percent"]
            panel.errorbar(
                x, effect, [[effect - row["low_percent"]], [row["high_percent"] - effect]],
                color=colour, marker=marker, fillstyle=FILLS[row["verdict"]], linestyle="none",
                markerfacecoloralt="white", capsize=3, markersize=6.5,
            )  # fmt: skip
        panel.set_xticks(range(len(mine)), [_place(row, mine) for row in mine])
        panel.set_xlim(-0.6, len(mine) - 0.4)
        ends = [abs(row[end]) for row in mine for end in ("low_percent", "high_percent")]
        reach = 1.15 * max(margin, *ends)
        panel.set_ylim(-reach, reach)
        panel.set_xlabel(r"incidence $\theta_i$ (°)")
        panel.set_title(f"{label}, margin ±{margin:g} %", fontsize=9)
        clean(panel)
    panels[0].set_ylabel("measured / predicted − 1 (%)", fontsize=9)
    canvas.legend(
        handles=[Patch(color=MARGIN, label="margin"), *verdict_handles()],
        loc="outside lower center", ncols=4, fontsize=SMALL, frameon=False,
    )  # fmt: skip
    return canvas


def verdict_handles() -> "list[Line2D]":
    """Legend of the markers' fills."""
    from matplotlib.lines import Line2D  # noqa: PLC0415 - late: only to draw

    return [
        Line2D(
            [], [], color=BLACK, marker="o", linestyle="none", fillstyle=fill,  # type: ignore[arg-type]
            markerfacecoloralt="white", label=word,
        )
        for word, fill in FILLS.items()
    ]  # fmt: skip


def _place(row: dict[str, Any], mine: list[dict[str, Any]]) -> str:
    text = f"{row['theta_i_deg']:g}"
    if len({r["phi_i_deg"] for r in mine}) > 1:
        text += f"\nφ {row['phi_i_deg']:g}"
    if len({r["kd"] for r in mine}) > 1:
        text += f"\nKd {row['kd']:g}"
    return text
