"""The figures of a report: one message each, readable in print and without colour."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .. import result, summary
from ..errors import InputError
from ..physics import std
from ..scene import Scene
from ..scene_file import from_toml
from ..surface import Heightfield, facet_slopes
from ..verdict import Comparison
from .bands import cut, half_widths

# Okabe and Ito's palette: told apart by the colour-blind; line styles say it again.
BLACK, ORANGE, BLUE, VERMILION, GREY = (
    "#000000", "#E69F00", "#0072B2", "#D55E00", "#888888",
)  # fmt: skip
_QUANTITY_STYLE = {
    "specular": (VERMILION, "s", "order-1 specular"),
    "body": (BLUE, "o", "order-1 body"),
    "total": (BLACK, "D", "total"),
}
_MODEL_STYLE = {
    "flat": ("-", "flat IL"),
    "approximate": ("-.", "closed approximation"),
    "smith": ("-", "Smith, height-correlated"),
    "smith-separable": ("--", "Smith, separable"),
    "vcavity": (":", "V-cavity"),
    "smith-walk": ("-", "Smith walk"),
    "vcavity-walk": (":", "V-cavity walk"),
}


def _figure(width: float, height: float) -> Figure:
    return Figure(figsize=(width, height), layout="constrained")


def _grid(axes: Axes) -> None:
    axes.grid(visible=True, color="#dddddd", linewidth=0.5)
    axes.spines[["top", "right"]].set_visible(False)


def effects(comparisons: list[Comparison]) -> Figure:
    """Measured over predicted − 1, with its interval and the margin, by angle and quantity."""
    names = [q for q in summary.QUANTITIES if any(c.quantity == q for c in comparisons)]
    figure = _figure(9, 2.8)
    axes = figure.subplots(1, max(len(names), 1), squeeze=False)[0]
    for panel, name in zip(axes, names, strict=False):
        rows = [c for c in comparisons if c.quantity == name]
        colour, marker, label = _QUANTITY_STYLE[name]
        margin = 100 * rows[0].margin
        panel.axhspan(-margin, margin, color="#cfe8dc", zorder=0, label="margin")
        panel.axhline(0, color=GREY, linewidth=0.8)
        x = np.arange(len(rows))
        effect = np.array([100 * c.effect for c in rows])
        low, high = (np.array([100 * getattr(c, end) for c in rows]) for end in ("low", "high"))
        panel.errorbar(
            x, effect, [effect - low, high - effect], color=colour, marker=marker,
            linestyle="none", capsize=3, markersize=5, label="95 % interval",
        )  # fmt: skip
        panel.set_xticks(x, [_place(c, rows) for c in rows])
        panel.set_xlim(-0.6, len(rows) - 0.4)
        panel.set_xlabel(r"incidence $\theta_i$ (°)")
        panel.set_title(f"{label} albedo, margin ±{margin:g} %", fontsize=9)
        _grid(panel)
    axes[0].set_ylabel("measured / predicted − 1 (%)")
    return figure


def _place(row: Comparison, rows: list[Comparison]) -> str:
    text = f"{row.theta_i:g}"
    if len({c.phi_i for c in rows}) > 1:
        text += f"\nφ {row.phi_i:g}"
    if len({c.kd for c in rows}) > 1:
        text += f"\nKd {row.kd:g}"
    return text


def lobes(
    measured: xr.Dataset | None, predicted: Mapping[str, xr.Dataset], scene: Scene, kd: float
) -> Figure:
    """BRDF in the plane of incidence, log scale, a panel for each θ_i; bands are 95 %."""
    thetas = scene.light.theta
    columns = 2 if len(thetas) > 1 else 1
    rows = -(-len(thetas) // columns)
    figure = _figure(4.6 * columns if columns > 1 else 6.5, 3.3 * rows + 0.4)
    panels = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True).ravel()
    tops = []
    for t, (theta, panel) in enumerate(zip(thetas, panels, strict=False)):
        place = {"theta_i": t, "phi_i": 0}
        if measured is not None:
            tops += _measured_lobes(panel, measured.isel(place), scene, kd)
        for key, prediction in predicted.items():
            tops += _predicted_lobes(panel, key, prediction.isel(place), scene, kd)
        panel.axvline(theta, color=GREY, linewidth=0.6, linestyle=(0, (1, 3)))
        panel.set_title(rf"$\theta_i$ = {theta:g}°", fontsize=10)
        _grid(panel)
    for panel in panels[len(thetas) :]:
        panel.set_visible(False)
    top = max(tops, default=1.0)
    bottom = max(min((v for v in tops if v > 0), default=1e-3) / 3, top / 3e5)
    panels[0].set(yscale="log", ylim=(min(bottom, top / 100), top * 2), xlim=(-90, 90))
    panels[0].set_xticks(np.arange(-90, 91, 30))
    for panel in panels[: len(thetas)][-columns:]:
        panel.set_xlabel(r"$\theta_o$ in the plane of incidence (°), mirror side positive")
    for panel in panels[::columns]:
        panel.set_ylabel("BRDF (1/sr)")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    return figure


def _measured_lobes(panel: Axes, measured: xr.Dataset, scene: Scene, kd: float) -> list[float]:
    """Order 1 by kind, and all orders together, with the bands of `bands`."""
    density = cut(measured, scene, kd)
    curves = {
        "specular": density.sel(order=1, kind="specular"),
        "body": density.sel(order=1, kind="body"),
        "total": density.sum(("order", "kind")),
    }
    levels = []
    bands = half_widths(curves, measured, scene, kd)
    for name, curve in curves.items():
        colour, marker, label = _QUANTITY_STYLE[name]
        mean = curve.mean("realisation").values
        if not mean.any():
            continue
        panel.fill_between(
            curve.theta_o.values, np.maximum(mean - bands[name], 1e-12), mean + bands[name],
            color=colour, alpha=0.25, linewidth=0,
        )  # fmt: skip
        shown = np.where(mean > 0, mean, np.nan)
        panel.plot(
            curve.theta_o.values, shown, linestyle="none", color=colour, marker=marker,
            markersize=2.6, fillstyle="none" if name == "total" else "full",
            markeredgewidth=0.6, label=f"measured, {'all orders' if name == 'total' else label}",
        )  # fmt: skip
        levels += [float(mean.max()), float(np.quantile(mean[mean > 0], 0.05))]
    return levels


def _predicted_lobes(
    panel: Axes, key: str, prediction: xr.Dataset, scene: Scene, kd: float
) -> list[float]:
    density = cut(prediction, scene, kd).isel(realisation=0)
    style, label = _MODEL_STYLE[key]
    if density.sizes["order"] > 1:
        curves = {"total": density.sum(("order", "kind"))}
    else:
        curves = {kind: density.isel(order=0).sel(kind=kind) for kind in result.KINDS}
    levels = []
    for name, curve in curves.items():
        if not (curve > 0).any():
            continue
        what = "all orders" if name == "total" else name
        panel.plot(
            curve.theta_o.values, np.where(curve > 0, curve, np.nan),
            color=_QUANTITY_STYLE[name][0], linestyle=style, linewidth=1.1,
            label=f"{label}, {what}",
        )  # fmt: skip
        levels.append(float(curve.max()))
    return levels


def albedos(
    measured: xr.Dataset, predicted: Mapping[str, xr.Dataset], scene: Scene, kd: float
) -> Figure:
    """Albedo by order against incidence: how much a single bounce leaves out, and a walk knows."""
    figure = _figure(6, 4)
    axes = figure.subplots()
    n = scene.material.n
    by_order = summary.by_order(measured, n, kd).sum("kind").isel(phi_i=0)
    theta = np.asarray(scene.light.theta)
    styles = (("-", "o"), ("--", "s"), ("-.", "^"), (":", "v"))
    for order, (line, marker) in zip(result.ORDERS, styles, strict=True):
        values = by_order.sel(order=order)
        mean = values.mean("realisation").values
        error = (
            values.std("realisation", ddof=1).values if values.sizes["realisation"] > 1 else None
        )
        if not mean.any():
            continue
        axes.errorbar(
            theta, np.where(mean > 0, mean, np.nan), error, color=BLUE, linestyle=line,
            marker=marker, markersize=4, capsize=2,
            label=f"measured, order {order}{'+' if order == result.ORDERS[-1] else ''}",
        )  # fmt: skip
    for key, prediction in predicted.items():
        values = summary.by_order(prediction, n, kd).sum("kind").isel(realisation=0, phi_i=0)
        line, label = _MODEL_STYLE[key]
        if prediction.sizes["order"] == 1:
            axes.plot(
                theta, values.sel(order=1), color=ORANGE, linestyle=line, marker="x",
                label=f"{label}, order 1",
            )  # fmt: skip
            continue
        for order, (_, marker) in zip(result.ORDERS[1:], styles[1:], strict=True):
            axes.plot(
                theta, np.where(values.sel(order=order) > 0, values.sel(order=order), np.nan),
                color=VERMILION, linestyle="none", marker=marker, markersize=8, fillstyle="none",
                label=f"{label}, order {order}{'+' if order == result.ORDERS[-1] else ''}",
            )  # fmt: skip
    axes.set(xlabel=r"incidence $\theta_i$ (°)", ylabel="albedo", yscale="log")
    figure.legend(loc="outside lower center", fontsize=7, ncols=3, frameon=False)
    _grid(axes)
    return figure


def surface(heightfield: Heightfield, scene: Scene) -> Figure:
    """A profile of the surface, and its facet slopes against STD, out to what a mesh can hold."""
    figure = _figure(9, 3.3)
    left, right = figure.subplots(1, 2, width_ratios=(1.5, 1))
    heights = heightfield.heights
    columns = min(heights.shape[1], 256)
    row = heights[heights.shape[0] // 2, :columns]
    x = np.arange(columns) * heightfield.spacing
    left.plot(x, row - row.mean(), color=BLACK, linewidth=0.8)
    left.set(xlabel="x (unit of the spacing)", ylabel="height (same unit)", title="")
    left.set_title("profile of one row", fontsize=10)
    _grid(left)

    p, q = facet_slopes(heightfield)
    rough = scene.roughness
    rho = np.sort(np.hypot(p.ravel() / rough.sigma_x, q.ravel() / rough.sigma_y))
    share = 1 - (np.arange(rho.size) + 0.5) / rho.size
    keep = np.unique(np.geomspace(1, rho.size, 400).astype(int)) - 1
    keep = np.unique(np.concatenate([keep, rho.size - 1 - keep]))
    grid = np.geomspace(1e-2, max(rho[-1] * 3, 10), 300)
    right.plot(
        grid, np.exp(_log_tail(grid, rough.gamma)), color=ORANGE, linewidth=2.5, alpha=0.8,
        label=f"STD, γ = {rough.gamma:.3g}",
    )  # fmt: skip
    right.plot(rho[keep], share[keep], color=BLUE, linestyle="--", linewidth=1.2, label="facets")
    right.axvline(rho[-1], color=GREY, linestyle=":", linewidth=1, label="steepest facet")
    right.set(
        xscale="log", yscale="log", ylim=(0.1 / rho.size, 2),
        xlabel="|slope| / σ", ylabel="share of facets steeper",
    )  # fmt: skip
    right.set_title("slopes against STD", fontsize=10)
    right.legend(fontsize=7)
    _grid(right)
    return figure


def _log_tail(rho: np.ndarray, gamma: float) -> np.ndarray:
    """ln of 1 − slope_cdf, without the rounding of that difference."""
    return std.log_kernel(rho**2, gamma) * (1 if np.isinf(gamma) else 1 - 1 / gamma)


def results(datasets: Mapping[str, xr.Dataset], kd: float | None = None) -> Figure:
    """Lobes of any results in the plane of incidence, all orders and kinds together.

    Measurements are points with bands, predictions lines; a panel for each θ_i of
    the first result, which the others must share.
    """
    first = next(iter(datasets.values()))
    scene = from_toml(first.attrs["scene"])
    kd = scene.material.kd[0] if kd is None else kd
    measurements = {k: d for k, d in datasets.items() if d.attrs["source"] == "measurement"}
    predictions = {d.attrs["model"]: d for k, d in datasets.items() if k not in measurements}
    for name, dataset in datasets.items():
        if not np.array_equal(dataset.theta_i, first.theta_i):
            raise InputError(f"{name}: its angles of incidence are not those of the first file")
    if len(measurements) <= 1:
        return lobes(next(iter(measurements.values()), None), predictions, scene, kd)
    raise InputError(f"{len(measurements)} measurements: give one, with any number of predictions")
