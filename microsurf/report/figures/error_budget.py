"""The error budget of one scene as a picture: terms beside what they add up to."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
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

PANELS = {"order-1 specular": "order-1 specular", "order-1 body": "order-1 body", "total": "total"}
_STYLE = {
    "model": ("#CC79A7", "xx", "the model itself"),
    "slopes": (ORANGE, "", "slopes a mesh holds"),
    "mesh": ("#56B4E9", "..", "mesh"),
    "losses": (GREY, "", "light lost"),
    "masking": (BLUE, "//", "masking of the structure"),
    "multiple": (VERMILION, "\\\\", "multiple scattering"),
    "il_assumption": (GREEN, "++", "IL assumption"),
}
_NAMED = 0.02
"""Per cent: terms that reach this nowhere are not drawn, and named as left out."""


def drawn_terms(rows: Sequence[dict[str, Any]]) -> list[str]:
    """Terms whose interval reaches beyond _NAMED anywhere in the panels."""
    return [
        term
        for term in _STYLE
        if any(
            row["term"] == term and max(abs(row[f"relative_{k}"]) for k in ("low", "high")) * 100
            > _NAMED
            for row in rows
            if row["quantity"] in PANELS and row["relative_low"] is not None
        )
    ]  # fmt: skip


@own_style()
def figure(rows: Sequence[dict[str, Any]]) -> "Figure":
    """Draw rows of `budget.rows` of one Kd and azimuth: a panel for each of PANELS."""
    names = [q for q in PANELS if any(r["quantity"] == q and r["predicted"] > 0 for r in rows)]
    terms = drawn_terms(rows)
    if not names:
        return nothing("no light is predicted")
    canvas = new_figure(3.1)
    panels = canvas.subplots(1, len(names), squeeze=False)[0]
    for panel, name in zip(panels, names, strict=False):
        _panel(panel, [row for row in rows if row["quantity"] == name], terms)
        panel.set_title(PANELS[name], fontsize=9)
    panels[0].set_ylabel("part of the prediction (%)", fontsize=9)
    handles, labels = panels[0].get_legend_handles_labels()
    entries = dict(zip(labels, handles, strict=True))
    for panel in panels[1:]:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    canvas.legend(
        entries.values(), entries.keys(), loc="outside lower center", ncols=3, fontsize=SMALL,
        frameon=False,
    )  # fmt: skip
    return canvas


def _panel(panel: "Axes", rows: list[dict[str, Any]], terms: list[str]) -> None:
    thetas = list(dict.fromkeys(row["theta_i"] for row in rows))
    mine = [t for t in terms if any(row["term"] == t for row in rows)]
    width = 0.8 / max(len(mine), 1)
    panel.axhline(0, color=GREY, linewidth=0.8)
    for k, term in enumerate(mine):
        colour, hatch, label = _STYLE[term]
        of_term = [row for row in rows if row["term"] == term]
        value, low, high = (
            100 * np.array([row[f"relative_{end}"] for row in of_term])
            for end in ("value", "low", "high")
        )
        x = np.arange(len(of_term)) + (k - (len(mine) - 1) / 2) * width
        panel.bar(
            x, value, width, yerr=(value - low, high - value), color=colour, hatch=hatch,
            edgecolor="white", linewidth=0.5, capsize=1.5,
            error_kw={"linewidth": 0.8, "ecolor": "#333333"}, label=label,
        )  # fmt: skip
    total, half = [], []
    for theta in thetas:
        at = [row for row in rows if row["theta_i"] == theta]
        total.append(100 * sum(row["relative_value"] for row in at))
        noise = [row for row in at if row["term"] == "noise"]
        half.append(100 * noise[0]["relative_high"] if noise else 0.0)
    panel.errorbar(
        range(len(thetas)), total, half, color=BLACK, marker="D", markersize=5, linestyle="none",
        capsize=3, label="measured / predicted − 1",
    )  # fmt: skip
    panel.set_xticks(range(len(thetas)), [f"{theta:g}" for theta in thetas])
    panel.set_xlabel(r"incidence $\theta_i$ (°)")
    clean(panel)
