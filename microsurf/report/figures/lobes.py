"""Lobes in the plane of incidence: measured with their bands, predicted as lines."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from ...results import detector
from ...scene import Scene
from .bands import cut, half_widths
from .style import (
    BLACK,
    GREY,
    QUANTITY_STYLE,
    SMALL,
    SourceStyle,
    clean,
    new_figure,
    nothing,
    own_style,
    source_style,
)  # fmt: skip

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MEASURED = "measured"

_FLOOR = 3e-5
"""Below this part of the highest value nothing is drawn."""
_LINE = 90
"""Letters of labels that fit side by side under a figure."""
_LONE = 3
"""Curves of so few bins get a dash for each: a line would not be seen."""


def rows(
    measured: xr.Dataset | None, predicted: Mapping[str, xr.Dataset], scene: Scene, kd: float
) -> list[dict[str, Any]]:
    """BRDF by bin: order 1 by kind, all orders together; the first φ_i.

    ``low`` and ``high`` are the ends of the 95 % band of `bands`, for what is measured.
    ``theta_o_deg`` is signed, positive on the mirror side.
    """
    table = []
    for t, theta in enumerate(scene.light.theta):
        at = {"theta_i": t, "phi_i": 0}
        incidence = {"theta_i_deg": theta, "phi_i_deg": scene.light.phi[0], "kd": kd}
        if measured is not None:
            table += [incidence | row for row in _of_measured(measured.isel(at), scene, kd)]
        for key, prediction in predicted.items():
            table += [incidence | row for row in _of_predicted(key, prediction.isel(at), scene, kd)]
    return table


def _of_measured(measured: xr.Dataset, scene: Scene, kd: float) -> Iterator[dict[str, Any]]:
    density = cut(measured, scene, kd)
    curves = {
        "specular": density.sel(order=1, kind="specular"),
        "body": density.sel(order=1, kind="body"),
        "total": density.sum(("order", "kind")),
    }
    bands = half_widths(curves, measured, scene, kd)
    for name, curve in curves.items():
        mean = curve.mean("realisation").values
        if mean.any():
            for theta, value, half in zip(curve.theta_o.values, mean, bands[name], strict=True):
                yield _row(MEASURED, name, theta, value) | {
                    "low": float(max(value - half, 0.0)), "high": float(value + half),
                }  # fmt: skip


def _of_predicted(
    key: str, prediction: xr.Dataset, scene: Scene, kd: float
) -> Iterator[dict[str, Any]]:
    density = cut(prediction, scene, kd).isel(realisation=0)
    if density.sizes["order"] > 1:
        curves = {"total": density.sum(("order", "kind"))}
    else:
        curves = {kind: density.isel(order=0).sel(kind=kind) for kind in detector.KINDS}
    for name, curve in curves.items():
        if (curve > 0).any():
            for theta, value in zip(curve.theta_o.values, curve.values, strict=True):
                yield _row(key, name, theta, value)


def _row(source: str, quantity: str, theta: float, value: float) -> dict[str, Any]:
    return {
        "source": source, "quantity": quantity, "theta_o_deg": float(theta),
        "brdf_per_sr": float(value),
    }  # fmt: skip


@own_style()
def figure(
    drawn: Sequence[dict[str, Any]], styles: Mapping[str, SourceStyle] | None = None
) -> "Figure":
    """Draw `rows`, log scale, a panel for each θ_i.

    ``styles`` are those of sources which are not `source_style`'s; those
    that `rows` holds nothing of are named as dark.
    """
    styles = styles or {}
    if not drawn:
        return nothing("no result reflects any light into the plane of incidence")
    thetas = list(dict.fromkeys(row["theta_i_deg"] for row in drawn))
    columns = 2 if len(thetas) > 1 else 1
    lines = -(-len(thetas) // columns)
    canvas = new_figure(2.5 * lines + 1.2)
    panels = canvas.subplots(lines, columns, squeeze=False, sharex=True, sharey=True).ravel()
    for theta, panel in zip(thetas, panels, strict=False):
        mine = [row for row in drawn if row["theta_i_deg"] == theta]
        for (source, name), curve in groupby(mine, lambda row: (row["source"], row["quantity"])):
            _draw(panel, styles.get(source) or source_style(source), name, list(curve))
        panel.axvline(theta, color=GREY, linewidth=0.7, linestyle=(0, (1, 3)))
        phi = mine[0]["phi_i_deg"]
        azimuth = rf", $\phi_i$ = {phi:g}°" if phi else ""
        panel.set_title(rf"$\theta_i$ = {theta:g}°{azimuth}", fontsize=10)
        clean(panel)
    bright = {row["source"] for row in drawn}
    for style in (styles[source] for source in styles if source not in bright):
        panels[0].plot([], [], linestyle="none", label=f"{style.label}: reflects nothing")
    for panel in panels[len(thetas) :]:
        panel.set_visible(False)
    panels[0].set(yscale="log", ylim=_limits(drawn), xlim=(-90, 90))
    panels[0].set_xticks(np.arange(-90, 91, 30))
    for panel in panels[max(len(thetas) - columns, 0) : len(thetas)]:
        panel.set_xlabel(r"signed $\theta_o$ (°), mirror side > 0")
        panel.xaxis.set_tick_params(labelbottom=True)
    for panel in panels[::columns]:
        panel.set_ylabel("BRDF (1/sr)")
    handles = {
        label: handle
        for panel in panels
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True)
    }
    # Columns of three: what is measured, Smith, others.
    handles = dict(sorted(handles.items(), key=lambda item: _rank(item[0])))
    if any("low" in row for row in drawn):
        from matplotlib.patches import Patch  # noqa: PLC0415 - late: only to draw

        handles["bands: 95 %"] = Patch(color=BLACK, alpha=0.22, linewidth=0)
    canvas.legend(
        list(handles.values()), list(handles), loc="outside lower center",
        ncols=max(1, min(3, _LINE // max(map(len, handles)))),
        fontsize=SMALL, frameon=False,
    )  # fmt: skip
    return canvas


def _rank(label: str) -> int:
    """Place of a curve in the legend."""
    return next((k for k, word in enumerate(("measured", "Smith")) if label.startswith(word)), 2)


def _limits(drawn: Sequence[dict[str, Any]]) -> tuple[float, float]:
    """From a third of the lowest curve's 5 % quantile to twice the highest value."""
    values = np.array([row["brdf_per_sr"] for row in drawn])
    top = float(values.max(initial=0.0)) or 1.0
    lows = []
    for _, curve in groupby(drawn, lambda r: (r["theta_i_deg"], r["source"], r["quantity"])):
        positive = [row["brdf_per_sr"] for row in curve if row["brdf_per_sr"] > 0]
        lows.append(float(np.quantile(positive, 0.05)) if positive else top)
    return min(max(min(lows, default=top) / 3, top * _FLOOR), top / 100), 2 * top


def _draw(panel: "Axes", style: SourceStyle, name: str, curve: list[dict[str, Any]]) -> None:
    colour, marker, label = QUANTITY_STYLE[name]
    theta = np.array([row["theta_o_deg"] for row in curve])
    value = np.array([row["brdf_per_sr"] for row in curve])
    shown = np.where(value > 0, value, np.nan)
    what = "all orders" if name == "total" else label
    if curve[0]["source"] == MEASURED:
        low, high = (np.array([row[end] for row in curve]) for end in ("low", "high"))
        panel.fill_between(
            theta, np.maximum(low, 1e-12), high, color=colour, alpha=0.22, linewidth=0
        )
        panel.plot(
            theta, shown, linestyle="none", color=colour, marker=marker, markersize=2.6,
            fillstyle="none" if name == "total" else "full", markeredgewidth=0.6,
            label=f"{style.label}, {what}",
        )  # fmt: skip
        return
    lone = np.count_nonzero(value) <= _LONE
    panel.plot(
        theta, shown, color=colour, linestyle=style.line, linewidth=1.1,
        marker="_" if lone else None, markersize=12, label=f"{style.label}, {what}",
    )  # fmt: skip
