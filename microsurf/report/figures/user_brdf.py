"""A user BRDF's lobes beside the theory's and the measured ones, in the plane of incidence."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from ...analysis.validate_user_brdf import theory_of
from ...analysis.validation import Validation
from .bands import cut, half_widths
from .style import (
    new_figure,
    nothing,
    own_style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Row = dict[str, Any]

# Okabe and Ito's palette; line styles and markers say it again.
_STYLES = {
    "specular": ("#D55E00", "s", "order-1 specular"),
    "body": ("#0072B2", "o", "order-1 body"),
    "total": ("#000000", "D", "all orders"),
}
_DARK = 1e-4
"""Part of the greatest value below which a logarithmic axis shows nothing."""


def rows(entry: Validation) -> list[Row]:
    """Numbers of `figure`: mean BRDF of the bins in sr⁻¹ at the first Kd and φ_i.

    ``half_width`` is that of the 95 % band of what was measured. Empty without a user BRDF.
    """
    return list(_rows(entry))


def _rows(entry: Validation) -> Iterator[Row]:
    if entry.user_brdf is None:
        return
    kd, of_user = next(iter(entry.user_brdf.predicted.items()))
    names = list(dict.fromkeys(lobe.quantity for lobe in entry.user_brdf.lobes))
    for t, theta in enumerate(entry.scene.light.theta):
        index = {"theta_i": t, "phi_i": 0}
        three = [
            cut(dataset.isel(index), entry.scene, kd)
            for dataset in (
                entry.measured,
                of_user,
                theory_of(entry, names[0]) if names else of_user,
            )
        ]
        for name in names:
            measured, user_brdf, theory = (
                density.sum(("order", "kind"))
                if name == "total"
                else density.sel(order=1, kind=name)
                for density in three
            )
            band = half_widths(
                {name: measured}, entry.measured.isel(index), entry.scene, kd
            )[name]  # fmt: skip
            for k, theta_o in enumerate(measured.theta_o.values):
                yield {
                    "quantity": name,
                    "theta_i_deg": theta,
                    "kd": kd,
                    "theta_o_deg": float(theta_o),
                    "measured_per_sr": float(measured.mean("realisation")[k]),
                    "half_width_per_sr": float(band[k]),
                    "user_brdf_per_sr": float(user_brdf[0, k]),
                    "theory_per_sr": float(theory[0, k]),
                }


@own_style()
def figure(entry: Validation) -> "Figure":
    """Draw measured (points, 95 % bands), theory (lines) and user BRDF (dashes), log scale."""
    table = rows(entry)
    names = list(dict.fromkeys(row["quantity"] for row in table))
    thetas = list(dict.fromkeys(row["theta_i_deg"] for row in table))
    if not names:
        return nothing("neither the user BRDF nor the surface reflects any light")
    drawn = new_figure(2.7 * len(names) + 0.6, max(3.4 * len(thetas), 5.0))
    panels = drawn.subplots(len(names), len(thetas), squeeze=False, sharex=True, sharey="row")
    for name, line in zip(names, panels, strict=True):
        for theta, panel in zip(thetas, line, strict=True):
            _lobe(
                panel,
                name,
                [r for r in table if (r["quantity"], r["theta_i_deg"]) == (name, theta)],
            )
            panel.set_title(rf"{_STYLES[name][2]}, $\theta_i$ = {theta:g}°", fontsize=9)
        line[0].set_ylabel("BRDF (1/sr)")
    for panel in panels[-1]:
        panel.set_xlabel(r"$\theta_o$ (°), mirror side positive")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    drawn.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    return drawn


def _lobe(panel: "Axes", name: str, table: list[Row]) -> None:
    colour, marker, _ = _STYLES[name]
    theta, measured, half, user_brdf, theory = (
        np.array([row[key] for row in table])
        for key in (
            "theta_o_deg", "measured_per_sr", "half_width_per_sr", "user_brdf_per_sr",
            "theory_per_sr",
        )
    )  # fmt: skip
    top = float(max(measured.max(), user_brdf.max(), theory.max()))
    if top == 0:
        panel.text(0.5, 0.5, "reflects nothing", ha="center", transform=panel.transAxes)
        return
    floor = max(top * _DARK, 1e-300)
    panel.fill_between(
        theta, np.maximum(measured - half, floor / 10), measured + half, color=colour, alpha=0.25,
        linewidth=0,
    )  # fmt: skip
    shown = np.where(measured > 0, measured, np.nan)
    panel.plot(
        theta, shown, linestyle="none", marker=marker, markersize=2.6, color=colour,
        label="measured, 95 % band",
    )  # fmt: skip
    panel.plot(theta, np.where(theory > 0, theory, np.nan), color=colour, label="theory")
    panel.plot(
        theta, np.where(user_brdf > 0, user_brdf, np.nan), color="#009E73", linestyle="--",
        linewidth=1.8, label="user BRDF",
    )  # fmt: skip
    bottom = float(min(measured[measured > 0].min(initial=top), theory.min()))
    panel.set(yscale="log", xlim=(-90, 90), ylim=(max(bottom / 2, floor), top * 2))
    panel.set_xticks(np.arange(-90, 91, 30))
    panel.grid(visible=True, color="#dddddd", linewidth=0.5)
    panel.spines[["top", "right"]].set_visible(False)
