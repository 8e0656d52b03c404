"""Slopes of a measured surface against GGX, Beckmann and STD, and how the fit moves with scale."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...analysis.surface_fit.study import MODELS, SurfaceStudy
from ...physics import student_t
from ...surface.fit import rho2, slopes_to_fit
from .style import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    SMALL,
    VERMILION,
    as_text,
    clean,
    new_figure,
    own_style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

_POINTS = 120
_LEFT = 30  # the figure begins at this part of σ
_STYLES = {
    "std": (ORANGE, "-", 3.0), "ggx": (BLUE, "--", 1.4), "beckmann": (VERMILION, ":", 1.6),
}  # fmt: skip
_NAMES = {"std": "STD", "ggx": "GGX", "beckmann": "Beckmann"}


def rows(study: SurfaceStudy) -> list[dict[str, Any]]:
    """What `figure` draws.

    Curves "facets", "std", "ggx" and "beckmann": share of facets steeper than ``x`` =
    |slope|, where along axes of different σ a slope counts by STD's ρ times √(σ_x σ_y).
    Rows "scale": pixel, γ and σ with their intervals of 95 %.
    """
    h, fit = study.surface, study.fit
    p, q = slopes_to_fit(h)
    slope = np.sort(np.sqrt(rho2(p, q, _scatter(study)))) * fit.sigma
    share = 1 - (np.arange(slope.size) + 0.5) / slope.size
    taken = np.unique(np.geomspace(1, slope.size, _POINTS).astype(int)) - 1
    taken = np.unique(np.concatenate([taken, slope.size - 1 - taken]))
    taken = taken[slope[taken] > 0]
    result = _curve("facets", slope[taken], share[taken])
    grid = np.geomspace(fit.sigma / 100, slope[-1] * 2, 200)
    for name in _STYLES:
        sigma = study.models[name]["sigma"]
        result += _curve(name, grid, _share_steeper(grid / sigma, _gamma(study, name)))
    for row in study.scales:
        result.append({
            "curve": "scale", "x": float(np.sqrt(row["pixel"][0] * row["pixel"][1])),
            "gamma": row["gamma"], "gamma_low": row["gamma_ci"][0],
            "gamma_high": row["gamma_ci"][1], "sigma": row["sigma"],
            "sigma_low": row["sigma_ci"][0], "sigma_high": row["sigma_ci"][1],
        })  # fmt: skip
    return result


def _scatter(study: SurfaceStudy) -> Array:
    """S of the fitted STD, from its axes."""
    fit = study.fit
    turn = np.radians(fit.azimuth or 0.0)
    axes = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    return np.asarray(axes @ np.diag([fit.sigma_x**2, fit.sigma_y**2]) @ axes.T)


def _gamma(study: SurfaceStudy, name: str) -> float:
    if name == "std":
        return study.fit.gamma
    return np.inf if MODELS[name] == 0 else 1 + 1 / MODELS[name]


def _share_steeper(rho: Array, gamma: float) -> Array:
    """1 − slope_cdf, without the rounding of that difference."""
    power = 1.0 if np.isinf(gamma) else 1 - 1 / gamma
    return np.exp(student_t.log_kernel(rho**2, gamma) * power)


def _curve(name: str, x: Array, y: Array) -> list[dict[str, Any]]:
    return [{"curve": name, "x": float(a), "y": float(b)} for a, b in zip(x, y, strict=True)]


@own_style()
def figure(drawn: list[dict[str, Any]], study: SurfaceStudy) -> "Figure":
    """Draw `rows`: slopes on the left, γ and σ by pixel on the right."""
    surface = new_figure(3.4)
    slopes, scale = surface.subplots(1, 2, width_ratios=(1.25, 1))
    for name, (colour, line, width) in _STYLES.items():
        x, y = _points(drawn, name)
        model, gamma = study.models[name], _gamma(study, name)
        label = f"{_NAMES[name]}, σ {model['sigma']:.3g}, KS {model['ks']:.2g}"
        if name == "std":
            label = f"STD, γ {'∞' if np.isinf(gamma) else f'{gamma:.3g}'}" + label[3:]
        slopes.plot(x, y, color=colour, linestyle=line, linewidth=width, label=label)
    x, y = _points(drawn, "facets")
    slopes.plot(x, y, ".", color=BLACK, markersize=3.5, label="facets")
    _mark_step(slopes, study)
    slopes.set(
        xscale="log", yscale="log", ylim=(y.min() / 4, 2), xlabel="slope",
        xlim=(study.fit.sigma / _LEFT, x.max() * 1.6), ylabel="share of facets steeper",
    )  # fmt: skip
    slopes.set_title("slopes of the facets", fontsize=9)
    surface.legend(
        *slopes.get_legend_handles_labels(), fontsize=SMALL, loc="outside lower center", ncols=3
    )
    clean(slopes)
    _draw_scales(scale, [row for row in drawn if row["curve"] == "scale"], study)
    return surface


def _mark_step(axes: "Axes", study: SurfaceStudy) -> None:
    """The slope of one step of the heights: below, slopes are the instrument's."""
    if study.height_step is None:
        return
    step = study.height_step / float(np.sqrt(np.prod(study.surface.pixel)))
    if step > study.fit.sigma / _LEFT:
        axes.axvline(step, color=GREY, linestyle="-.", linewidth=1.2, label="one step of heights")


def _points(drawn: list[dict[str, Any]], name: str) -> tuple[Array, Array]:
    values = np.array([[row["x"], row["y"]] for row in drawn if row["curve"] == name])
    return values[:, 0], values[:, 1]


def _draw_scales(axes: "Axes", scales: list[dict[str, Any]], study: SurfaceStudy) -> None:
    from matplotlib.ticker import NullLocator  # noqa: PLC0415 - late: only to draw

    unit = as_text(study.surface.provenance.get("unit", "unit of the file"))
    pixel = np.array([row["x"] for row in scales])
    right = axes.twinx()
    bounds: list[float] = []
    for panel, name, colour, marker, shift in (
        (axes, "gamma", BLACK, "o", 0.98), (right, "sigma", BLUE, "s", 1.02),
    ):  # fmt: skip
        value, low, high = (
            np.array([row[key] for row in scales]) for key in (name, f"{name}_low", f"{name}_high")
        )
        there = np.isfinite(value)
        top = np.where(np.isfinite(high), high, 10 * value)[there]
        _, caps, _ = panel.errorbar(
            pixel[there] * shift, value[there], [(value - low)[there], top - value[there]],
            color=colour, marker=marker, markersize=4.5, capsize=2.5, linewidth=1.0,
        )  # fmt: skip
        endless = ~np.isfinite(high[there])
        if endless.any():  # arrows in the place of caps
            caps[1].set_ydata(np.where(endless, np.nan, top))
            x = pixel[there][endless] * shift
            panel.plot(x, top[endless], "^", color=colour, markersize=6)
        bounds += [*low[there], *top] if name == "gamma" else []
    axes.set_xscale("log")
    unbounded = np.array([not np.isfinite(row["gamma"]) for row in scales])
    axes.plot(
        pixel[unbounded], np.full(unbounded.sum(), 0.96), "^", color=BLACK, markersize=7,
        transform=axes.get_xaxis_transform(),
    )  # fmt: skip
    if bounds and max(bounds) > 3 * min(bounds):
        axes.set_yscale("log")
        _few_ticks(axes)
    elif not bounds:
        axes.set_yticks([])
    axes.set_xticks(pixel, [f"{d:.2g}" for d in pixel])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xlabel(f"pixel ({unit})")
    beyond = not all(np.isfinite(row["gamma_high"]) for row in scales)
    axes.set_ylabel("γ (circles; triangles: ∞)" if beyond else "γ (circles)")
    right.set_ylabel("σ (squares)", color=BLUE)
    axes.set_title("the fit at coarser pixels, 95 % intervals", fontsize=9)
    clean(axes)
    right.spines["top"].set_visible(False)


def _few_ticks(axes: "Axes") -> None:
    """Ticks of a logarithmic axis, few and as plain numbers."""
    from matplotlib.ticker import NullLocator  # noqa: PLC0415 - late: only to draw

    low, high = axes.get_ylim()
    marks = np.array([a * 10.0**e for e in range(-9, 5) for a in (1, 2, 5)])
    inside = marks[(marks >= low) & (marks <= high)]
    if inside.size < 2:
        inside = np.geomspace(low, high, 4)[1:3]
    axes.set_yticks(inside, [f"{mark:.4g}" for mark in inside])
    axes.yaxis.set_minor_locator(NullLocator())
