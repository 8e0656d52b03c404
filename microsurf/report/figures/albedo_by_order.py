"""Albedo by order: how much one bounce leaves out, and whether a random walk knows it."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from ...results import detector
from ...scene import Scene
from ...stats import intervals
from .lobes import MEASURED
from .style import (
    SMALL,
    clean,
    new_figure,
    nothing,
    own_style,
    source_style,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def rows(
    measured: xr.Dataset, predicted: Mapping[str, xr.Dataset], scene: Scene, kd: float
) -> list[dict[str, Any]]:
    """Albedo by order and θ_i at the first φ_i, both kinds together.

    ``low`` and ``high``: 95 % interval over the surfaces; missing if there is only one.
    Orders that carry no light are left out; so are those of the walk that others give.
    """
    table: list[dict[str, Any]] = []
    for source, dataset in {MEASURED: measured, **predicted}.items():
        values = dataset.microsurf.albedo_by_order(kd=kd).sum("kind").isel(phi_i=0)
        first = 1 if source == MEASURED or dataset.sizes["order"] == 1 else 2
        for order in detector.ORDERS[first - 1 : dataset.sizes["order"]]:
            for t, theta in enumerate(scene.light.theta):
                cell = values.sel(order=order).isel(theta_i=t).values
                if cell.any():
                    incidence = {
                        "theta_i_deg": theta, "phi_i_deg": scene.light.phi[0], "kd": kd,
                        "source": source, "order": order,
                    }  # fmt: skip
                    table.append(incidence | _interval(cell))
    return table


def _interval(values: np.ndarray) -> dict[str, float]:
    mean, count = float(values.mean()), len(values)
    if count == 1:
        return {"albedo": mean}
    half = float(intervals.half_width_of_mean(values))
    return {"albedo": mean, "low": mean - half, "high": mean + half}


@own_style()
def figure(drawn: Sequence[dict[str, Any]]) -> "Figure":
    """Draw `rows`: a panel for each order, each with its own scale from 0."""
    if not drawn:
        return nothing("no order carries any light")
    orders = sorted({row["order"] for row in drawn})
    canvas = new_figure(2.8, 7.1 if len(orders) > 1 else 3.5)
    panels = canvas.subplots(1, len(orders), squeeze=False)[0]
    handles: dict[str, Any] = {}
    for panel, order in zip(panels, orders, strict=False):
        mine = [row for row in drawn if row["order"] == order]
        for source in dict.fromkeys(row["source"] for row in mine):
            curve = [row for row in mine if row["source"] == source]
            of = source_style(source)
            theta, value = (np.array([r[k] for r in curve]) for k in ("theta_i_deg", "albedo"))
            style: dict[str, Any] = {"color": of.colour, "marker": of.marker, "linewidth": 0.9}
            if source == MEASURED:
                ends = [[abs(r.get(k, r["albedo"]) - r["albedo"]) for r in curve]
                        for k in ("low", "high")]  # fmt: skip
                handle: Any = panel.errorbar(theta, value, ends, markersize=4.5, capsize=2.5,
                                             **style)  # fmt: skip
            else:
                (handle,) = panel.plot(theta, value, markersize=6, fillstyle="none",
                                       linestyle="--", **style)  # fmt: skip
            handles[of.name] = handle
        top = max(row.get("high", row["albedo"]) for row in mine)
        panel.set(ylim=(0, 1.12 * top), xlabel=r"$\theta_i$ (°)", xlim=(-4, 90))
        panel.set_xticks([0, 30, 60, 90])
        panel.set_title(f"order {order}{' and more' if order == detector.ORDERS[-1] else ''}",
                        fontsize=10)  # fmt: skip
        panel.tick_params(labelsize=9)
        clean(panel)
    panels[0].set_ylabel("albedo")
    canvas.legend(
        list(handles.values()), list(handles), loc="outside lower center",
        ncols=4 if len(orders) > 1 else 2, fontsize=SMALL, frameon=False,
    )  # fmt: skip
    return canvas
