"""A fit of a measured BRDF: lobes measured and fitted, residuals over angle, Kd by wavelength."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...analysis.brdf_fit.curves import Curve, curves
from ...analysis.brdf_fit.fit import BrdfFit
from ...analysis.brdf_fit.summary import figures
from ...analysis.brdf_fit.verdict import from_mirror
from .style import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    SMALL,
    VERMILION,
    WIDTH,
    as_text,
    clean,
    new_figure,
    own_style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
Row = dict[str, Any]

_COLOURS = (BLACK, BLUE, VERMILION, ORANGE)
_MARKERS = ("o", "s", "^", "D")
_STYLES = {
    "beckmann": (BLUE, "--", "Beckmann"),
    "ggx": (VERMILION, ":", "GGX"),
    "std": (BLACK, "-", "STD"),
    "all orders": (ORANGE, "-.", "STD, all orders"),
}
_BIN = 10.0  # degrees


def rows(fit: BrdfFit) -> list[Row]:
    """Numbers of `figure`: lobes and residuals, a row each."""
    result: list[Row] = []
    for curve in curves(fit):
        for kind, at, values in (
            ("measured", curve.measured_at, curve.measured),
            ("fitted", curve.fitted_at, curve.fitted),
        ):
            result += [
                {"kind": kind, "theta_i_deg": curve.theta_i, "theta_o_deg": a, "f_cos_per_sr": v}
                for a, v in zip(at.tolist(), values.tolist(), strict=True)
            ]
    for name, (at, values) in _residuals(fit).items():
        result += [
            {"kind": f"rms residual, {name}", "from_mirror_deg": a, "log_residual": v}
            for a, v in zip(at.tolist(), values.tolist(), strict=True)
        ]
    return result


@own_style()
def figure(fit: BrdfFit) -> "Figure":
    """Draw lobes (points measured, lines fitted), and below residuals and Kd or n, k."""
    drawn = new_figure(5.6, WIDTH)
    grid = drawn.add_gridspec(2, 2, height_ratios=[1.25, 1])
    _lobes(drawn.add_subplot(grid[0, :]), curves(fit))
    _residual_panel(drawn.add_subplot(grid[1, 0]), fit)
    _spectrum(drawn.add_subplot(grid[1, 1]), fit)
    drawn.suptitle(_title(fit), fontsize=9)
    return drawn


def _title(fit: BrdfFit) -> str:
    values = figures(fit)
    parts = [f"{as_text(fit.measured.source)}, {fit.material}: {fit.verdict}"]
    for name, symbol in (("gamma", "γ"), ("sigma", "σ"), ("n", "n")):
        value, ends = values.get(name), values.get(f"{name}_ci")
        if isinstance(value, float) and ends:
            beyond = "∞" if ends[1] >= 1e8 else f"{ends[1]:.3g}"
            shown = "∞" if value >= 1e8 else f"{value:.3g}"
            parts.append(f"{symbol} {shown} [{ends[0]:.3g}, {beyond}]")
    return parts[0] + ("\n" + ", ".join(parts[1:]) if parts[1:] else "")


def _lobes(axes: "Axes", result: list[Curve]) -> None:
    top = max(float(curve.measured.max()) for curve in result)
    fitted = max(float(curve.fitted.max()) for curve in result)
    bright = [curve.measured[curve.measured > 0].min(initial=top) for curve in result]
    floor = max(min(map(float, bright)) / 2, top * 1e-5)
    for k, curve in enumerate(result):
        colour, marker = _COLOURS[k % len(_COLOURS)], _MARKERS[k % len(_MARKERS)]
        axes.plot(
            curve.measured_at, np.where(curve.measured > 0, curve.measured, np.nan), marker,
            color=colour, markersize=3.5, linestyle="none",
            label=rf"$\theta_i$ = {curve.theta_i:g}°",
        )  # fmt: skip
        axes.plot(curve.fitted_at, np.maximum(curve.fitted, floor / 10), color=colour, linewidth=1)
    axes.set(
        yscale="log", xlim=(-90, 90), ylim=(floor, 2 * min(max(top, fitted), 5 * top)),
        ylabel=r"$f\,\cos\theta_o$ (1/sr), mean of channels",
    )  # fmt: skip
    axes.set_xlabel(r"$\theta_o$ (°), mirror side positive; points measured, lines fitted")
    axes.set_xticks(np.arange(-90, 91, 30))
    axes.legend(fontsize=SMALL, frameon=False, loc="upper left")
    clean(axes)


def _residuals(fit: BrdfFit) -> dict[str, tuple[Array, Array]]:
    """Root mean square of residuals in bins of the angle from the mirror direction."""
    result: dict[str, tuple[Array, Array]] = {}
    every = {"all orders": fit.all_orders} if fit.all_orders else {}
    for name, one in {**fit.others, "std": fit.one_order, **every}.items():
        off = from_mirror(one.question.problem)
        index = (off / _BIN).astype(int)
        weight = one.question.problem.known.sum(axis=1)
        squares = np.bincount(index, np.sum(one.solution.residuals**2, axis=1))
        counts = np.bincount(index, weight)
        kept = counts > 0
        at = (np.arange(len(counts)) + 0.5)[kept] * _BIN
        result[name] = np.asarray(at), np.sqrt(squares[kept] / counts[kept])
    return result


def _residual_panel(axes: "Axes", fit: BrdfFit) -> None:
    for name, (at, values) in _residuals(fit).items():
        colour, line, label = _STYLES[name]
        axes.plot(at, values, color=colour, linestyle=line, marker=".", markersize=4, label=label)
    axes.set(
        xlabel="angle from the mirror direction (°)", ylim=(0, None),
        ylabel=r"rms residual of $\ln(1 + f\,\cos\theta_o)$",
    )  # fmt: skip
    axes.legend(fontsize=SMALL, frameon=False)
    clean(axes)


def _spectrum(axes: "Axes", fit: BrdfFit) -> None:
    values = figures(fit)
    at = np.array(fit.measured.wavelengths or range(1, 1 + len(fit.measured.channels)), float)
    for name, colour in (("kd", BLUE), ("n", BLACK), ("k", VERMILION)):
        series, ends = values.get(name), values.get(f"{name}_ci")
        if isinstance(series, list) and len(series) == len(at):
            low, high = np.array(ends).T
            mean = np.array(series)
            axes.errorbar(
                at, mean, [mean - low, high - mean], color=colour, marker=".", markersize=4,
                linewidth=1, elinewidth=0.7, ecolor=GREY,
                label={"kd": r"$K_d$"}.get(name, f"${name}$"),
            )  # fmt: skip
    axes.set_xlabel("wavelength (nm)" if fit.measured.wavelengths else "channel")
    if not fit.measured.wavelengths:
        axes.set_xticks(at, [as_text(channel) for channel in fit.measured.channels])
    axes.set_ylim(0, None)
    names = ", ".join(axes.get_legend_handles_labels()[1])
    axes.set_ylabel(f"{names} with 95 % intervals")
    axes.legend(fontsize=SMALL, frameon=False)
    clean(axes)
