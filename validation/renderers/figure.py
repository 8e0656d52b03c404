"""Errors of BSDFs and of a walk over incidence, and where the light of ``roughplastic`` is."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from microsurf.report.figures.style import (
    BLUE,
    GREEN,
    GREY,
    MARGIN,
    ORANGE,
    PURPLE,
    SMALL,
    VERMILION,
    clean,
    new_figure,
    own_style,
)

from . import study
from .study import Row

SHOWN = "roughplastic, nonlinear"
STYLES = dict(
    zip(study.ALPHAS, ((BLUE, "o"), (GREEN, "s"), (ORANGE, "^"), (PURPLE, "D")), strict=True)
)
LAYERS = (
    ("order-1 specular", VERMILION), ("later specular", "#f2b48c"), ("order-1 body", BLUE),
    ("later body", "#9cc9e3"),
)  # fmt: skip


@own_style()
def errors_and_light(rows: list[Row]) -> Figure:
    """Rows of one seed: a panel for each model, the last for the light."""
    figure = new_figure(9.0)
    panels = figure.subplots(4, 3).ravel()
    for axes, name in zip(panels, study.MODELS, strict=False):
        _errors(axes, name, [r for r in rows if r["bsdf"] == name and r["part"] == "total"])
    _light(panels[9], [r for r in rows if r["bsdf"] == SHOWN])
    margin = f"α; green: ±{100 * study.MARGIN:g} %, bars: 95 %"
    for axes, of, title in (
        (panels[10], panels[9], "parts of the bars"),
        (panels[11], panels[0], margin),
    ):
        axes.set_axis_off()
        axes.legend(
            *of.get_legend_handles_labels(), title=title, loc="center", ncols=1 + (of is panels[0]),
            fontsize=SMALL, title_fontsize=SMALL, frameon=False,
        )  # fmt: skip
    return figure


def _errors(axes: Axes, name: str, rows: list[Row]) -> None:
    axes.axhspan(-100 * study.MARGIN, 100 * study.MARGIN, color=MARGIN)
    axes.axhline(0, color=GREY, linewidth=0.5)
    for alpha, (color, marker) in STYLES.items():
        mine = [r for r in rows if r["alpha"] == alpha]
        effect, low, high = (
            100 * np.array([r[key] for r in mine]) for key in ("effect", "low", "high")
        )
        axes.errorbar(
            [r["theta_i"] for r in mine], effect, np.stack([effect - low, high - effect]),
            color=color, marker=marker, markersize=4, label=f"{alpha:g}",
        )  # fmt: skip
    axes.set(
        title=name, xlabel=r"$\theta_i$ (°)", ylabel="total over traced − 1 (%)",
        xticks=study.THETAS,
    )  # fmt: skip
    axes.yaxis.label.set_fontsize(SMALL + 0.5)
    axes.title.set_fontsize(SMALL + 0.5)
    clean(axes)


def _light(axes: Axes, rows: list[Row]) -> None:
    """Stacked: left of each pair traced by order and kind, right what the BSDF sends back."""
    theta = study.THETAS[0]
    for k, alpha in enumerate(study.ALPHAS):
        of = {r["part"]: r for r in rows if r["alpha"] == alpha and r["theta_i"] == theta}
        first = {kind: of[f"order-1 {kind}"]["traced"] for kind in ("specular", "body")}
        traced = [
            value
            for kind in ("specular", "body")
            for value in (first[kind], of[kind]["traced"] - first[kind])
        ]
        mitsuba = [of["specular"]["predicted"], 0.0, of["body"]["predicted"], 0.0]
        for x, heights in ((k - 0.2, traced), (k + 0.2, mitsuba)):
            base = np.cumsum([0.0, *heights[:-1]])
            for (label, color), height, bottom in zip(LAYERS, heights, base, strict=True):
                shown = label if k == 0 and heights is traced else None
                axes.bar(x, height, 0.36, bottom, color=color, label=shown)
    axes.set(
        title=f"{SHOWN}, $\\theta_i$ = {theta:g}°:\nleft traced, right Mitsuba", xlabel="α",
        ylabel="albedo", xticks=range(len(study.ALPHAS)), ylim=(0, 1),
        xticklabels=[f"{a:g}" for a in study.ALPHAS],
    )  # fmt: skip
    axes.title.set_fontsize(SMALL + 0.5)
    clean(axes)
